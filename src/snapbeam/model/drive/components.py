"""Components of a motion: tones, polynomials in pieces and sweeps, of which the native core's signals consist.

    tone     mean + amplitude sin(rate t + phase), times a window
    pieces   gain sum_k c_k (t - begin)^k, a polynomial of degree five from each begin to the next
    sweep    speed/w(t) sin(integral of w), with w from first to last in a duration

The motion of a drive is the sum of its components; t is the time since the drive began, s.  Every array has shape (runs,), or
begins with that axis, or with one of length 1 that all runs share.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

_Array = NDArray[np.float64]
RISE = np.array([0.0, 0.0, 0.0, 10.0, -15.0, 6.0])
"""x^3 (10 - 15 x + 6 x^2): from 0 to 1, without a jump of the first two derivatives."""


class Pieces(NamedTuple):
    """Polynomials from each begin to the next."""

    begins: _Array
    """s, shape (runs or 1, pieces); the first holds before it too, the last for good."""
    coefficients: _Array
    """Of powers of the time since the begin, shape (runs or 1, pieces, 6)."""
    gain: _Array | float = 1.0


class Tone(NamedTuple):
    """A sine, perhaps in a window."""

    amplitude: _Array
    rate: _Array
    """rad/s."""
    phase: _Array | float = 0.0
    mean: _Array | float = 0.0
    window: Pieces | None = None


class Sweep(NamedTuple):
    """A sine of changing frequency."""

    speed: _Array
    """Velocity amplitude, m/s."""
    first: _Array
    last: _Array
    """rad/s."""
    duration: _Array
    exponential: bool


Component = Tone | Pieces | Sweep


def in_pieces(*pieces: tuple[_Array, dict[int, _Array] | _Array], gain: _Array | float = 1.0) -> Pieces:
    """Pieces from their begins and coefficients, arrays of shape (runs,) by power."""
    runs = max(np.size(begin) for begin, _ in pieces)
    begins = np.stack([np.broadcast_to(begin, runs) for begin, _ in pieces], axis=1)
    coefficients = np.zeros((runs, len(pieces), 6))
    for i, (_, powers) in enumerate(pieces):
        if isinstance(powers, dict):
            for k, values in powers.items():
                coefficients[:, i, k] = values
        else:
            coefficients[:, i] = powers
    return Pieces(begins, coefficients, gain)


def rising(duration: _Array, back: bool = False) -> _Array:
    """Coefficients of the smooth rise from 0 to 1 within a duration (s), or of the way back; shape (runs, 6)."""
    found: _Array = RISE / np.asarray(duration)[:, None] ** np.arange(6)
    if back:
        found = -found
        found[:, 0] = 1.0
    return found


def sampled(rows: _Array, interval: float, gain: _Array | float = 1.0) -> Pieces:
    """Pieces of equal length with coefficients *rows*, shape (pieces, 6)."""
    return Pieces(interval * np.arange(len(rows), dtype=np.float64)[None], rows[None], gain)


def hermite(values: _Array, rates: _Array, interval: float) -> _Array:
    """Coefficients of the cubics through samples and their rates, shape (samples - 1, 6)."""
    rise, a, b = np.diff(values), rates[:-1], rates[1:]
    found = np.zeros((rise.size, 6))
    found[:, 0], found[:, 1] = values[:-1], a
    found[:, 2] = (3.0 * rise / interval - 2.0 * a - b) / interval
    found[:, 3] = (a + b - 2.0 * rise / interval) / interval**2
    return found
