"""Axes of a map as people write them: a number, a list, or start:stop:count."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from snapbeam.model.parameters import PHYSICAL, lookup, physical_hint
from snapbeam.model.quantity import split_name
from snapbeam.util.units import number_in_unit
from snapbeam.util.validation import (
    InputError,
    InputTypeError,
    axis,
    choice,
    finite,
    finite_array,
    flag,
    instance,
    shown,
)

if TYPE_CHECKING:
    from snapbeam.model.system import System

Axis = float | NDArray[np.float64]

_FORMS = "a number, numbers separated by commas, or start:stop:count, such as 0.1:4:64, with :log if geometric"


_WHOLE = "a whole number, whole numbers separated by commas, such as 1,32, or start:stop:count"


def parse_axis(name: str, value: float | str | Sequence[float], *, whole: bool = False, unit: str = "1") -> Axis:
    """Return *value* as one number, or as a strictly increasing axis, in *unit*; *name* stands in refusals.

    It is ``0.18``, ``"0.18"``, ``"1/2.1"``, ``"0.1,0.2,0.5"``, or ``"0.1:4:64"`` for 64 points from 0.1 to 4, both
    included, ``"1e3:1e6:7:log"`` for a geometric sequence.  Numbers of text may have a unit that pint knows:
    ``"1.9um:2.1um:5"``, ``"1kohm,1Mohm"``.  *whole* numbers are integers.
    """
    instance("name", name, str, "text")
    flag("whole", whole)
    if isinstance(value, str):
        return _parse_text(name, value, _WHOLE if whole else _FORMS, unit)
    if isinstance(value, (int, float)) and not isinstance(value, bool):
        return _finite(name, shown(value), finite(name, value))
    if isinstance(value, bool) or not isinstance(value, (Sequence, np.ndarray)):
        raise InputTypeError(f"{name} = {shown(value)}: must be {_FORMS}")
    return axis(name, value, -math.inf, math.inf)


_MOST_POINTS = 10_000_000


def _parse_text(name: str, text: str, forms: str, unit: str) -> Axis:
    parts = text.split(":")
    geometric = len(parts) == 4 and parts[3].strip() == "log"
    if geometric or len(parts) == 3:
        start, stop = (_number(name, text, part, forms, unit) for part in parts[:2])
        try:
            count = int(parts[2])
        except ValueError:
            raise InputError(f"{name} = {text!r}: the count {parts[2]!r} must be a whole number") from None
        if count < 2 or not start < stop:
            raise InputError(f"{name} = {text!r}: start must be less than stop and count at least 2")
        if count > _MOST_POINTS:
            raise InputError(f"{name} = {text!r}: the count must be at most {_MOST_POINTS}")
        if geometric and start <= 0.0:
            raise InputError(f"{name} = {text!r}: start must be greater than 0 for a geometric sequence")
        return np.geomspace(start, stop, count) if geometric else np.linspace(start, stop, count)
    if len(parts) != 1:
        raise InputError(f"{name} = {shown(text)}: must be {forms}")
    numbers = [_number(name, text, part, forms, unit) for part in text.split(",")]
    return numbers[0] if len(numbers) == 1 else axis(name, numbers, -math.inf, math.inf)


def _number(name: str, text: str, part: str, forms: str, unit: str) -> float:
    try:
        value = number_in_unit(part, unit)
    except InputError as error:
        raise InputError(f"{name} = {text!r}: {error}{physical_hint(name)}") from None
    if value is None:
        raise InputError(f"{name} = {shown(text)}: must be {forms}")
    return _finite(name, text, value)


def _finite(name: str, text: str, value: float) -> float:
    if not math.isfinite(value):
        raise InputError(f"{name} = {text}: must be finite")
    return value


CHANGES_UNITS = ("beam.", "boundary.", "imperfection.", "model.")
"""Sections of parameters that may change the first natural frequency and the length scale."""


def unit_of(system: System, name: str) -> float:
    """Value of a normalised parameter of 1 in the physical unit of *name*."""
    scale, row = system.scale, PHYSICAL[name]
    if row.unit != "m":
        return row.unit_of(scale.length, scale.omega)
    if system.model.beam is None:
        raise InputError(f"{name}: a structure given by matrices has no length; give location")
    return system.model.beam.length


def axis_that_changes_unit(system: System, name: str, axes: Mapping[str, Any]) -> str | None:
    """The first of some axes along which a ratio of 1 is not always the same in the physical unit of *name*."""
    unit = unit_of(system, name)
    for other, values in axes.items():
        if not other.startswith(CHANGES_UNITS):
            continue
        for value in values:
            try:
                own = unit_of(system.replace(**{other: value.item()}), name)
            except InputError:  # valid together with another axis, or refused when the sweep is checked
                return other
            if abs(own / unit - 1.0) > 1e-9:
                return other
    return None


def _unit(system: System, name: str) -> float:
    return unit_of(system, choice("name", name, tuple(PHYSICAL)))


def from_physical(system: System, name: str, value: ArrayLike) -> Any:
    """Ratios from values in the physical unit of *name*."""
    unit = _unit(system, name)
    return finite_array(name, value) / unit


def checked_physical(system: System, name: str, value: float, shown: str) -> float:
    """The ratio that a value in the physical unit of *name* is, refused, with the name *shown*, where it cannot be."""
    ratio, row = float(from_physical(system, name, value)), lookup(PHYSICAL[name].parameter)
    short = split_name(row.name)[1]
    try:
        row.quantity.check(short, ratio)
    except InputError as error:
        must = str(error).partition(": ")[2]
        unit = PHYSICAL[name].unit
        raise InputError(f"{shown} = {value:g} {unit}: is {short} = {ratio:.6g}, which {must}") from None
    return ratio


def to_physical(system: System, name: str, value: ArrayLike) -> Any:
    """Values in the physical unit of *name* from ratios."""
    unit = _unit(system, name)
    return finite_array(name, value) * unit


def ratios_of(system: System, columns: Mapping[str, Any]) -> dict[str, Any]:
    """Return columns with those in physical units as ratios of one structure."""
    found = dict(columns)
    for name in columns.keys() & PHYSICAL.keys():
        values = found.pop(name)
        for value in np.unique(values).tolist():
            checked_physical(system, name, value, name)
        found[PHYSICAL[name].parameter] = values / unit_of(system, name)
    return found
