"""A parameter as a field of a value: its unit, limits, long name and scope are part of the definition.

The table of parameters (:mod:`snapbeam.model.parameters`) is gathered from these fields; checks, files,
the command line, axes of sweeps and labels of pictures read it there.
"""

from __future__ import annotations

import dataclasses
import math
import secrets
from collections import namedtuple
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any

from snapbeam.util.validation import (
    InputError,
    choice,
    finite,
    finite_array,
    flag,
    integer,
    nonnegative,
    positive,
    require_texts,
    shown,
    within,
)

RUN = "run"
"""Scope of what may differ between the runs of one ensemble."""
STRUCTURE = "structure"
"""Scope of what needs another reduction, other steps or another integration."""


@dataclass(frozen=True)
class ParameterField:
    """Description of one field: unit, long name, type, allowed range.

    Attributes
    ----------
    unit : str
        SI unit, ``"1"`` if it has none.
    long_name : str
        Meaning in words.
    kind : type
        float, int, bool, str, or object for anything that checks itself.
    low, high, closed
        The interval that its numbers must lie in; *closed* as in :func:`snapbeam.util.validation.within`.
    choices : tuple of str
        The words allowed, of text.
    scope : {"run", "structure"}
    symbol : str
        The paper's symbol, as mathematics.
    short : str
        Name of the dimension or attribute that holds it in a dataset; the field's own name if empty.
    plausible : triple, optional
        The sizes that numbers of real structures have, and the unit that is probably meant outside.
    optional : bool
        True if the field may be None.
    parse : callable, optional
        ``parse(name, value)`` of a field of kind object: returns what the field holds, or refuses.
    """

    unit: str
    long_name: str
    kind: type = float
    low: float = -math.inf
    high: float = math.inf
    closed: str = "neither"
    choices: tuple[str, ...] = ()
    scope: str = STRUCTURE
    symbol: str = ""
    short: str = ""
    plausible: tuple[float, float, str] | None = None
    optional: bool = False
    parse: Callable[[str, Any], Any] | None = None

    def __post_init__(self) -> None:
        for name in ("unit", "long_name", "choices", "symbol", "short"):
            require_texts(name, getattr(self, name))

    def check(self, name: str, value: Any) -> Any:
        """*value* as what this quantity holds; refused, with *name*, if it cannot be."""
        if value is None and self.optional:
            return None
        if self.kind is float:
            unit = "" if self.unit == "1" else self.unit
            if math.isinf(self.high) and self.low == 0.0:
                return (nonnegative if self.closed == "left" else positive)(name, value, unit)
            if math.isinf(self.low) and math.isinf(self.high):
                return finite(name, value, f"a finite number{' of ' + unit if unit else ''}")
            return within(name, value, self.low, self.high, closed=self.closed, unit=unit)
        if self.kind is int:
            return integer(name, value, int(self.low), None if math.isinf(self.high) else int(self.high))
        if self.kind is bool:
            return flag(name, value)
        if self.kind is str:
            return choice(name, value, self.choices)
        return value if self.parse is None else self.parse(name, value)


def quantity(unit: str, words: str, *, default: Any = dataclasses.MISSING, **more: Any) -> Any:
    """A dataclass field that is a :class:`ParameterField`.

    See Also
    --------
    snapbeam.ContactLaw, snapbeam.Drive, snapbeam.LocalForce

    Examples
    --------
    >>> from dataclasses import dataclass
    >>> import snapbeam as sb
    >>> @dataclass(frozen=True, kw_only=True)
    ... class Magnet(sb.LocalForce):
    ...     constant: float = sb.quantity("N m^2", "constant of the magnet", low=0.0)
    """
    return dataclasses.field(default=default, metadata={"quantity": ParameterField(unit, words, **more)})


def quantities(kind: type) -> dict[str, ParameterField]:
    """The quantities of a dataclass, by the names of their fields."""
    return {item.name: item.metadata["quantity"] for item in dataclasses.fields(kind) if "quantity" in item.metadata}


def check_fields(value: Any) -> None:
    """Check every quantity of a frozen dataclass, and store it as a plain number, in its ``__post_init__``."""
    for name, item in quantities(type(value)).items():
        object.__setattr__(value, name, item.check(name, getattr(value, name)))


# ----------------------------------------------------------------------------------------------------
# Names of parameters: section.field, section.number.field for the second and later contacts, drives, forces, harvesters.


NUMBERED = ("contact", "drive", "force", "harvester")
"""Sections of which a system can have several."""


def section_of(kind: str, number: int) -> str:
    """The section of one of several parts, the first being 1, whose number is left out: ``force``, ``force.2``."""
    return kind if number == 1 else f"{kind}.{number}"


def numbered(section: str) -> tuple[str, int]:
    """The kind and the number of a section: ``contact.2`` is that of the second contact; 1 of any other."""
    kind, _, number = section.partition(".")
    return (kind, int(number)) if kind in NUMBERED and countable(number) else (section, 1)


def countable(text: str) -> bool:
    """Return whether a text is the number of a part or a channel: of digits that ``int`` takes, and not too many."""
    return text.isdecimal() and len(text) < 10


def split_name(name: str) -> tuple[str, str]:
    """The section and the field of a dotted name; no field of a section's own name, such as ``force.2``."""
    section, dot, field = name.rpartition(".")
    return (section, field) if dot and not field.isdigit() else (name, "")


def check_label(label: Any) -> None:
    """Raise an error for a label that cannot replace a number in a dotted name."""
    if not isinstance(label, str) or not label.isprintable() or label != label.strip() or label.isdigit():
        raise InputError(
            f"label = {shown(label)}: must be printable text without spaces at its ends, and not a number, such as 'tip'"
        )


def keep_shape(force: Any) -> None:
    """Replace the ``shape`` of a force, unless it is None, by a tuple of numbers, so that == compares forces."""
    if force.shape is not None:
        object.__setattr__(force, "shape", tuple(finite_array("shape", force.shape, 1).tolist()))


# ----------------------------------------------------------------------------------------------------
# The numbers of a law or a drive, as its functions get them.


_named_tuple: Any = namedtuple


def own_name(kind: type) -> str:
    """A name that no other class has, in this process or in one whose machine code may be loaded into it.

    Compiled functions are linked by names that those of their arguments' types are part of.  Two laws whose numbers
    were called alike would share code, whichever was loaded first.
    """
    return f"{kind.__qualname__}.{secrets.token_hex(8)}"


def numbers_type(kind: Any, fields: Iterable[str]) -> Any:
    """The named tuple of a class's numbers, made once; an attribute of the class, ``Numbers``."""
    if "Numbers" not in vars(kind):
        made: Any = _named_tuple("Numbers", tuple(fields))
        made.__module__, made.__qualname__ = kind.__module__, f"{kind.__qualname__}.Numbers"
        made.__name__, made.owner = own_name(kind), kind
        kind.Numbers = made
    return kind.Numbers
