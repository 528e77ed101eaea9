"""Numbers with the prefixes of the SI that suit them."""

from __future__ import annotations

from typing import Any

import numpy as np

WITH_PREFIX = frozenset(("m", "m/s", "s", "N", "N/m", "N m", "Pa", "Hz", "ohm", "F", "H", "V", "A", "W", "J"))
"""Units that take a prefix of the SI."""
_PREFIXES = ("y", "z", "a", "f", "p", "n", "µ", "m", "", "k", "M", "G", "T", "P", "E", "Z", "Y")


def prefixed(value: float, unit: str, digits: int = 3) -> str:
    """A number in *unit*, rounded to *digits*, with a prefix of the SI: ``161 mm``, not ``16.1 cm``."""
    if value == 0.0 or not np.isfinite(value):
        return f"{value:g} {unit}"
    rounded = float(f"{value:.{digits - 1}e}")
    step = _step(rounded if np.isfinite(rounded) else value)
    return f"{value / 1000.0**step:.{digits}g} {_PREFIXES[step + 8]}{unit}"


def with_unit(value: Any, unit: str, digits: int = 6) -> str:
    """A value as text: a number with its unit, with a prefix where the unit takes one."""
    if not isinstance(value, float):
        return str(value)
    if unit in WITH_PREFIX:
        return prefixed(value, unit, digits)
    return f"{value:.{digits}g} {'' if unit == '1' else unit}".rstrip()


def scale_of(values: Any, unit: str) -> tuple[float, str]:
    """Divisor for a short axis, and the resulting unit, such as ``(1e-3, "mN")``."""
    most = float(np.fmax.reduce(np.abs(np.asarray(values, dtype=float)), axis=None, initial=0.0))
    if most == 0.0 or not np.isfinite(most):
        return 1.0, unit
    step = _step(most)
    return 1000.0**step, f"{_PREFIXES[step + 8]}{unit}"


def _step(value: float) -> int:
    """Thousands in a number, as far as there are prefixes."""
    return max(-8, min(8, int(np.floor(np.log10(abs(value)) / 3.0 + 1e-12))))
