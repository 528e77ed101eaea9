"""Checks of user input: one way in, one kind of refusal.

Every function here takes the name of a parameter and the value that was given, returns the
value as a plain Python or NumPy number, or raises :class:`InputError` with the name, the value and
what is allowed.  Nothing is clipped or converted silently.
"""

from __future__ import annotations

import math
from numbers import Integral, Real
from typing import Any

import numpy as np
from numpy.typing import NDArray

__all__ = [
    "InputError",
    "InputTypeError",
    "axis",
    "choice",
    "finite",
    "finite_array",
    "flag",
    "integer",
    "nonnegative",
    "positive",
    "within",
]


class InputError(ValueError):
    """A parameter that cannot be used: the message names it, its value and what is allowed."""


class InputTypeError(InputError, TypeError):
    """A parameter of a kind that cannot be used, such as text where a number belongs."""


def _refuse(name: str, value: Any, allowed: str) -> InputError:
    return InputError(f"{name} = {value!r}: must be {allowed}")


def _number(name: str, value: Any, allowed: str) -> float:
    if isinstance(value, np.ndarray) and value.ndim == 0:
        value = value.item()
    if isinstance(value, (bool, np.bool_)) or not isinstance(value, Real):
        raise InputTypeError(f"{name} = {value!r}: must be {allowed}, not {type(value).__name__}")
    return float(value)


def finite(name: str, value: Any, allowed: str = "a finite number") -> float:
    """Return *value* as a float; refuse NaN, infinity and whatever is no real number."""
    number = _number(name, value, allowed)
    if not math.isfinite(number):
        raise _refuse(name, value, allowed)
    return number


def positive(name: str, value: Any, unit: str = "") -> float:
    """Return *value* as a float; refuse what is not finite and greater than zero."""
    allowed = f"a finite number greater than 0{' ' + unit if unit else ''}"
    number = finite(name, value, allowed)
    if not number > 0.0:
        raise _refuse(name, value, allowed)
    return number


def nonnegative(name: str, value: Any, unit: str = "") -> float:
    """Return *value* as a float; refuse what is not finite or less than zero."""
    allowed = f"a finite number of at least 0{' ' + unit if unit else ''}"
    number = finite(name, value, allowed)
    if number < 0.0:
        raise _refuse(name, value, allowed)
    return number


def within(
    name: str, value: Any, low: float, high: float, *, closed: str = "neither", unit: str = ""
) -> float:
    """Return *value* as a float inside an interval.

    ``closed`` is ``"neither"``, ``"left"``, ``"right"`` or ``"both"``.
    """
    left = closed in ("left", "both")
    right = closed in ("right", "both")
    interval = f"{'[' if left else '('}{low:g}, {high:g}{']' if right else ')'}"
    allowed = f"a number in {interval}{' ' + unit if unit else ''}"
    number = finite(name, value, allowed)
    above = number >= low if left else number > low
    below = number <= high if right else number < high
    if not (above and below):
        raise _refuse(name, value, allowed)
    return number


def integer(name: str, value: Any, low: int, high: int | None = None) -> int:
    """Return *value* as an int between *low* and *high*, both included."""
    allowed = f"an integer of at least {low}" if high is None else f"an integer in [{low}, {high}]"
    if isinstance(value, np.ndarray) and value.ndim == 0:
        value = value.item()
    if isinstance(value, (bool, np.bool_)):
        raise InputTypeError(f"{name} = {value!r}: must be {allowed}, not {type(value).__name__}")
    if isinstance(value, Integral):
        number = int(value)
    elif isinstance(value, Real):
        if not float(value).is_integer():
            raise _refuse(name, value, allowed)
        number = int(float(value))
    else:
        raise InputTypeError(f"{name} = {value!r}: must be {allowed}, not {type(value).__name__}")
    if number < low or (high is not None and number > high):
        raise _refuse(name, value, allowed)
    return number


def flag(name: str, value: Any) -> bool:
    """Return *value* if it is True or False."""
    if not isinstance(value, (bool, np.bool_)):
        raise InputTypeError(f"{name} = {value!r}: must be True or False, not {type(value).__name__}")
    return bool(value)


def choice(name: str, value: Any, allowed: tuple[str, ...]) -> str:
    """Return *value* if it is one of the words *allowed*."""
    words = ", ".join(repr(word) for word in allowed)
    if not isinstance(value, str):
        raise InputTypeError(f"{name} = {value!r}: must be one of {words}, not {type(value).__name__}")
    if value not in allowed:
        raise InputError(f"{name} = {value!r}: must be one of {words}")
    return value


def finite_array(name: str, value: Any, ndim: int | None = None) -> NDArray[np.float64]:
    """Return *value* as a float64 array; refuse text, NaN, infinity and a wrong number of dimensions."""
    try:
        raw = np.asarray(value)
    except ValueError:
        raise InputError(f"{name}: must be an array of numbers, not a list of unequal lengths") from None
    if raw.dtype.kind not in "iuf":
        raise InputTypeError(f"{name} = {value!r}: must be an array of numbers, not of {raw.dtype}")
    array = np.array(raw, dtype=np.float64)
    if ndim is not None and array.ndim != ndim:
        raise InputError(f"{name} of shape {array.shape}: must have {ndim} dimension(s)")
    bad = ~np.isfinite(array)
    if bad.any():
        first = tuple(int(i) for i in np.argwhere(bad)[0])
        raise InputError(f"{name}{list(first)} = {array[first]!r}: must be finite")
    return array


def axis(name: str, value: Any, low: float, high: float, *, closed: str = "neither") -> NDArray[np.float64]:
    """Return *value* as a strictly increasing 1-D axis whose points all lie in the interval."""
    array = finite_array(name, value)
    if array.ndim != 1:
        raise InputError(f"{name} of shape {array.shape}: must be a number or a one-dimensional array")
    if array.size == 0:
        raise InputError(f"{name} = []: must hold at least one point")
    for point in (array.min(), array.max()):
        within(name, float(point), low, high, closed=closed)
    steps = np.diff(array)
    if (steps <= 0.0).any():
        at = int(np.argmax(steps <= 0.0))
        raise InputError(
            f"{name}[{at}] = {array[at]:g}, {name}[{at + 1}] = {array[at + 1]:g}: must be strictly increasing"
        )
    return array
