"""A parameter as a field of a value: its unit, limits, words and scope stand where the value is defined.

The table of parameters (:mod:`snapbeam.config.parameters`) is gathered from these fields; checks, files,
the command line, axes of sweeps and labels of pictures read it there.
"""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass
from typing import Any

from snapbeam.core.validate import choice, finite, flag, integer, nonnegative, positive, within

__all__ = ["RUN", "STRUCTURE", "ParameterField", "check_fields", "quantities", "quantity"]

RUN = "run"
"""Scope of what may differ between the runs of one ensemble."""
STRUCTURE = "structure"
"""Scope of what needs another reduction, other steps or another integration."""


@dataclass(frozen=True)
class ParameterField:
    """What one field means.

    Attributes
    ----------
    unit : str
        SI unit, ``"1"`` if it has none.
    long_name : str
        What it is.
    kind : type
        float, int, bool, str, or object for anything that checks itself.
    low, high, closed
        The interval that its numbers must lie in; *closed* as in :func:`snapbeam.core.validate.within`.
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
        Whether it may be None.
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
        return value


def quantity(unit: str, words: str, *, default: Any = dataclasses.MISSING, **more: Any) -> Any:
    """A dataclass field that is a :class:`Quantity`."""
    return dataclasses.field(default=default, metadata={"quantity": ParameterField(unit, words, **more)})


def quantities(kind: type) -> dict[str, ParameterField]:
    """The quantities of a dataclass, by the names of their fields."""
    return {
        item.name: item.metadata["quantity"]
        for item in dataclasses.fields(kind)
        if "quantity" in item.metadata
    }


def check_fields(value: Any) -> None:
    """Check every quantity of a frozen dataclass, and keep it as a plain number, in its ``__post_init__``."""
    for name, item in quantities(type(value)).items():
        object.__setattr__(value, name, item.check(name, getattr(value, name)))
