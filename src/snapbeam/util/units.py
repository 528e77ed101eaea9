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
_OPERATOR = re.compile(r"(?<!\*)\s*([*/])\s*(?=[-+]?(?:\d|\.\d))")
"""Operator before a number, between two factors of a product; a power, ``m**2``, has none."""
_FACTOR = re.compile(rf"\s*([-+]?{_NUMBER})\s*(\D.*?)?\s*", re.DOTALL)
_ANGLE = "radian"
_GRAVITY = re.compile(r"(?<![A-Za-z_])g(?![A-Za-z_0-9])")


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
    given = re.sub(r"(?<=[A-Za-z])(?=[2-4](?![0-9.]))", "^", given)  # kg/m3 is kg/m^3
    ends = [
        (given, unit),
        (_GRAVITY.sub("standard_gravity", given), unit),
        (given, _GRAVITY.sub("standard_gravity", unit)),
    ]
    for text, wanted_unit in dict.fromkeys(ends):
        try:
            own, target = registry.Unit(text), registry.Unit("" if wanted_unit == "1" else wanted_unit)
            if own.dimensionality != target.dimensionality:
                continue
            one, two = (registry.Quantity(Decimal(count), own).to(target).magnitude for count in (1, 2))
        except Exception:  # text of a user: pint has errors of many kinds, Python's own among them
            continue
        angles, wanted = (dict(registry.get_root_units(each)[1]._units).get(_ANGLE, 0) for each in (own, target))
        if two == 2 * one and (angles == wanted or angles == 0):
            return float(one)
    return None


def number_in_unit(text: str, unit: str) -> float | None:
    """The number that a text states, in *unit*, which is the default; None if it is none."""
    found = _TEXT.fullmatch(text)
    if found is None or (found[3] and _OPERATOR.search(found[3])):
        return _product(text, unit)
    if found[2] is not None and float(found[2]) == 0.0:
        return None
    return _converted([(found[1], False), (found[2] or "1", True)], found[3] or "", unit)


def unit_in_text(text: str) -> str:
    """The unit of a number as it is written, such as ``mm/s``; empty without one, and of a product of numbers.

    Examples
    --------
    >>> from snapbeam.util.units import unit_in_text
    >>> unit_in_text("20 mm/s"), unit_in_text("0.3"), unit_in_text("200 um * 30 um")
    ('mm/s', '', '')
    """
    found = _TEXT.fullmatch(text)
    return "" if found is None or not found[3] or _OPERATOR.search(found[3]) else found[3]


def _converted(numbers: list[tuple[str, bool]], given: str, unit: str) -> float:
    """The product of numbers, each of which may be a divisor, from the unit *given* to *unit*."""
    value = math.prod(1.0 / float(text) if divides else float(text) for text, divides in numbers)
    if given:
        factor = conversion_factor(given, unit)
        if factor is None:
            must = "a number without a unit" if unit == "1" else f"in {unit}"
            raise InputError(f"the unit {given!r} does not fit; must be {must}")
    else:
        factor = 1.0
    if not math.isfinite(value * factor) or value * factor == 0.0:  # exponents that a fraction would write out
        return value * factor
    exact = Fraction(repr(factor))
    for text, divides in numbers:
        exact = exact / Fraction(text) if divides else exact * Fraction(text)
    return float(exact)  # rounded once: 10 um is 1e-5 m to the last digit


def _product(text: str, unit: str) -> float | None:
    """The number of a product or a quotient of numbers with units, such as ``"200 um * 30 um"``; None if it is none."""
    numbers, given = [], ""
    parts = _OPERATOR.split(text)
    for operator, part in zip(["*", *parts[1::2]], parts[::2], strict=True):
        found = _FACTOR.fullmatch(part)
        divides = operator == "/"
        if found is None or len(parts) == 1 or (divides and float(found[1]) == 0.0):
            return None
        numbers.append((found[1], divides))
        if found[2]:
            given += f" {operator} ({found[2]})" if given else f"({found[2]})" if not divides else f"1 / ({found[2]})"
    return _converted(numbers, given, unit)
