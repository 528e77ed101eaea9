"""Numbers with a unit, such as ``"1.9 um"`` or ``"2 mN/um"``, in the unit of a parameter; the units are those of pint."""

from __future__ import annotations

import math
import re
from decimal import Decimal
from fractions import Fraction
from functools import cache
from typing import Any

from snapbeam.util.validation import InputError

_NUMBER = r"(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?"
_TEXT = re.compile(rf"\s*([-+]?{_NUMBER})(?:\s*/\s*({_NUMBER}))?\s*(\D.*?)?\s*", re.DOTALL)
_ANGLE = "radian"


@cache
def _registry() -> Any:
    import pint

    # decimal numbers: a prefix is exact
    registry: Any = pint.UnitRegistry(non_int_type=Decimal, on_redefinition="raise")
    registry.define("@alias ohm = Ohm")
    return registry


@cache
def conversion_factor(given: str, unit: str) -> float | None:
    """Factor from one unit to another; None if they do not fit, or differ by more than a factor.

    An angular frequency in rad/s or a speed in rpm is not a frequency in Hz. Where an acceleration is expected,
    g is the standard acceleration of free fall.

    Examples
    --------
    >>> from snapbeam.util.units import conversion_factor
    >>> conversion_factor("mN/um", "N/m")
    1000.0
    """
    if given == unit:
        return 1.0
    registry = _registry()
    target = registry.Unit("" if unit == "1" else unit)
    gravity = re.sub(r"(?<![A-Za-z_])g(?![A-Za-z_0-9])", "standard_gravity", given)
    for text in dict.fromkeys((given, gravity)):
        try:
            own = registry.Unit(text)
            if own.dimensionality != target.dimensionality:
                continue
            one, two = (registry.Quantity(Decimal(count), own).to(target).magnitude for count in (1, 2))
        except Exception:  # text of a user: pint has errors of many kinds, Python's own among them
            continue
        angles, wanted = (dict(each._units).get(_ANGLE, 0) for each in map(_in_roots, (own, target)))
        if two == 2 * one and (angles == wanted or angles == 0):
            return float(one)
    return None


def _in_roots(unit: Any) -> Any:
    return _registry().get_root_units(unit)[1]


def number_in_unit(text: str, unit: str) -> float | None:
    """The number that a text states, in *unit*; without a unit of its own it is in that unit already.  None if it is none.

    Raises
    ------
    InputError
        If the unit of the text does not fit.
    """
    found = _TEXT.fullmatch(text)
    if found is None or (found[2] is not None and float(found[2]) == 0.0):
        return None
    value = float(found[1]) / float(found[2] or 1.0)
    if not found[3]:
        return value
    factor = conversion_factor(found[3], unit)
    if factor is None:
        must = "a number without a unit" if unit == "1" else f"in {unit}"
        raise InputError(f"the unit {found[3]!r} does not fit; must be {must}")
    if not math.isfinite(value * factor) or value == 0.0:  # exponents that a fraction would write out
        return value * factor
    exact = Fraction(found[1]) / Fraction(found[2] or 1) * Fraction(repr(factor))
    return float(exact)  # rounded once: 10 um is 1e-5 m to the last digit
