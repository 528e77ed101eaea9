"""The one table of parameters: dotted name, unit, limits, words, default and scope of everything that can be set.

It is gathered from where the values are defined (:mod:`snapbeam.model.quantity`); parameter files, the command line,
axes of sweeps, labels of pictures and attributes of files read it here.
"""

from __future__ import annotations

import dataclasses
import difflib
import math
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

from snapbeam.core.validate import InputError, shown
from snapbeam.model.beam import Beam
from snapbeam.model.contact import LAWS
from snapbeam.model.drive import DRIVES
from snapbeam.model.ends import Ends
from snapbeam.model.galerkin.reduction import MODEL_QUANTITIES
from snapbeam.model.imperfection import Imperfection
from snapbeam.model.integration import Integration
from snapbeam.model.quantity import RUN, Quantity, quantities
from snapbeam.model.start import START_NAME
from snapbeam.model.striker import Striker

__all__ = ["Parameter", "lookup", "parameters", "short_names"]

_NONE = dataclasses.MISSING
_POWER = re.compile(r"\^([\d.]+)")


@dataclass(frozen=True)
class Parameter:
    """One row of the table.

    Attributes
    ----------
    name : str
        Dotted name, ``section.name``.
    short : str
        Name of the dimension or the attribute that holds it in a dataset.
    quantity : Quantity
        Unit, limits, words, symbol and scope.
    default : object
        What it is if nothing is given; None if it follows from others, is needed or has none.
    kinds : tuple of str
        Laws of contact, or drives, that have it; empty for the other sections.
    """

    name: str
    short: str
    quantity: Quantity
    default: Any = None
    kinds: tuple[str, ...] = ()

    @property
    def section(self) -> str:
        """What it is a parameter of."""
        return self.name.partition(".")[0]

    @property
    def is_run(self) -> bool:
        """Whether it may differ between the runs of one ensemble."""
        return self.quantity.scope == RUN

    @property
    def label(self) -> str:
        """Words, symbol and unit, for an axis of a picture."""
        words = self.quantity.words[:1].upper() + self.quantity.words[1:]
        symbol = f" ${self.quantity.symbol}$" if self.quantity.symbol else ""
        raised = _POWER.sub(r"$^{\1}$", self.quantity.unit)
        unit = "" if raised == "1" else f" ({raised})"
        return f"{words}{symbol}{unit}"

    @property
    def limits(self) -> str:
        """What is allowed, in words."""
        item = self.quantity
        if item.choices:
            return " or ".join(item.choices)
        if item.kind is bool:
            return "true or false"
        if item.kind is object:
            return ""
        if math.isinf(item.low) and math.isinf(item.high):
            return "any"
        left = "[" if item.closed in ("left", "both") or item.kind is int else "("
        right = (
            "]" if item.closed in ("right", "both") or (item.kind is int and item.high < math.inf) else ")"
        )
        return f"{left}{item.low:g}, {item.high:g}{right}"


def _rows() -> Iterable[Parameter]:
    own: tuple[tuple[str, type], ...] = (
        ("beam", Beam),
        ("ends", Ends),
        ("imperfection", Imperfection),
        ("striker", Striker),
        ("run", Integration),
    )
    for section, part in own:
        yield from _of_class(section, part)
    for name, (item, default) in MODEL_QUANTITIES.items():
        yield Parameter(f"model.{name}", item.short or name, item, default)
    several: tuple[tuple[str, Mapping[str, type]], ...] = (("contact", LAWS), ("drive", DRIVES))
    for section, known in several:
        for kind_name, kind in known.items():
            for row in _of_class(section, kind):
                yield dataclasses.replace(row, kinds=(kind_name,))


def _of_class(section: str, kind: type) -> Iterable[Parameter]:
    defaults = {item.name: item.default for item in dataclasses.fields(kind)}
    for name, item in quantities(kind).items():
        default = defaults[name]
        yield Parameter(f"{section}.{name}", item.short or name, item, None if default is _NONE else default)


def parameters() -> dict[str, Parameter]:
    """Every parameter by its dotted name, those of registered laws and drives included."""
    table: dict[str, Parameter] = {}
    for row in _rows():
        if row.name in table:
            row = dataclasses.replace(row, kinds=(*table[row.name].kinds, *row.kinds))
        table[row.name] = row
    order = ("beam", "model", "ends", "imperfection", "contact", "striker", "drive", "start", "run")
    return dict(sorted(table.items(), key=lambda item: order.index(item[1].section)))


def short_names() -> dict[str, str]:
    """Dotted names by the names that datasets use."""
    return {row.short: name for name, row in parameters().items()}


def lookup(name: str) -> Parameter:
    """The row of a parameter, by its dotted name or by the name that datasets use.

    ``start.amplitude[i]`` and ``start.velocity[i]`` stand for every mode i.

    Raises
    ------
    InputError
        If there is none: the message names the nearest.
    """
    if not isinstance(name, str):
        raise InputError(f"parameter {shown(name)}: must be a name, such as 'drive.frequency_ratio'")
    table = parameters()
    if name in table:
        return table[name]
    found = START_NAME.fullmatch(name.removeprefix("start."))
    if found is not None:
        of, mode = found[1], found[2]
        over = "that of the well" if of == "amplitude" else "omega_1 times the amplitude of the well"
        words = f"{of} of buckling mode {mode} at the start, over {over}"
        return Parameter(f"start.{of}[{mode}]", f"start_{of}_{mode}", Quantity("1", words, scope=RUN))
    if name in ("start.striker_position", "start_striker_position"):
        words = "mid-position of the striker's tip in space"
        return Parameter("start.striker_position", "start_striker_position", Quantity("m", words, scope=RUN))
    shorts = short_names()
    if name in shorts:
        return table[shorts[name]]
    tails: dict[str, list[str]] = {}
    for full in table:
        tails.setdefault(full.partition(".")[2], []).append(full)
    if len(tails.get(name, [])) == 1:
        return table[tails[name][0]]
    close = difflib.get_close_matches(name, [*table, *shorts], 3)
    hint = (
        f"; did you mean {' or '.join(map(repr, close))}?"
        if close
        else f"; see {', '.join(list(table)[:6])}, ..."
    )
    raise InputError(f"{name}: no parameter{hint}")
