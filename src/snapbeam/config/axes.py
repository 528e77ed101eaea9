"""Axes of a map as people write them: a number, a list, or start:stop:count."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from snapbeam.core.validate import InputError, InputTypeError, axis, finite, flag, instance, shown

__all__ = ["Axis", "parse_axis"]

Axis = float | NDArray[np.float64]

_FORMS = "a number, numbers separated by commas, or start:stop:count, such as 0.1:4:64"


_WHOLE = "a whole number, whole numbers separated by commas, such as 1,32, or start:stop:count"


def parse_axis(name: str, value: float | str | Sequence[float], *, whole: bool = False) -> Axis:
    """Return *value* as one number, or as a strictly increasing axis.

    Parameters
    ----------
    name : str
        The parameter to name in a refusal.
    value : float, str or sequence of float
        ``0.18``, ``"0.18"``, ``"1/2.1"``, ``"0.1,0.2,0.5"``, or ``"0.1:4:64"`` for 64 points from 0.1 to 4,
        both included.
    whole : bool
        Whether the numbers are to be whole, as a refusal then says.

    Returns
    -------
    float or array of shape (points,)

    Raises
    ------
    InputError
        If it cannot be read so, is not finite, or does not increase.
    """
    instance("name", name, str, "text")
    flag("whole", whole)
    if isinstance(value, str):
        return _parse_text(name, value, _WHOLE if whole else _FORMS)
    if isinstance(value, (int, float)) and not isinstance(value, bool):
        return _finite(name, shown(value), finite(name, value))
    if isinstance(value, bool) or not isinstance(value, (Sequence, np.ndarray)):
        raise InputTypeError(f"{name} = {shown(value)}: must be {_FORMS}")
    return axis(name, value, -math.inf, math.inf)


_MOST_POINTS = 10_000_000


def _parse_text(name: str, text: str, forms: str) -> Axis:
    parts = text.split(":")
    if len(parts) == 3:
        start, stop = (_number(name, text, part, forms) for part in parts[:2])
        try:
            count = int(parts[2])
        except ValueError:
            raise InputError(f"{name} = {text!r}: the count {parts[2]!r} must be a whole number") from None
        if count < 2 or not start < stop:
            raise InputError(f"{name} = {text!r}: start must be less than stop and count at least 2")
        if count > _MOST_POINTS:
            raise InputError(f"{name} = {text!r}: the count must be at most {_MOST_POINTS}")
        return np.linspace(start, stop, count)
    if len(parts) != 1:
        raise InputError(f"{name} = {shown(text)}: must be {forms}")
    numbers = [_number(name, text, part, forms) for part in text.split(",")]
    return numbers[0] if len(numbers) == 1 else axis(name, numbers, -math.inf, math.inf)


def _number(name: str, text: str, part: str, forms: str) -> float:
    numerator, slash, denominator = part.partition("/")
    try:
        value = float(numerator) / float(denominator) if slash else float(part)
    except (ValueError, ZeroDivisionError):
        raise InputError(f"{name} = {shown(text)}: must be {forms}") from None
    return _finite(name, text, value)


def _finite(name: str, text: str, value: float) -> float:
    if not math.isfinite(value):
        raise InputError(f"{name} = {text}: must be finite")
    return value
