"""Components of a motion: tones, polynomials in pieces and sweeps, of which the native core's signals consist.

    tone     mean + amplitude sin(rate t + phase), times a window
    pieces   gain sum_k c_k (t - begin)^k, a polynomial of degree five from each begin to the next
    sweep    speed/w(t) sin(integral of w), with w from first to last in a duration

The motion of a drive is the sum of its components; t is the time since the drive began, s.  Every array has shape (runs,), or
begins with that axis, or with one of length 1 that all runs share.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from snapbeam.util.validation import InputError

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
    runs = max(len(begin) for begin, _ in pieces)
    for _, powers in pieces:
        each = powers.values() if isinstance(powers, dict) else [powers]
        runs = max([runs, *(len(np.atleast_1d(values)) for values in each)])
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


_PIECES = 20_000
"""Pieces of a motion that is approximated, at most."""
_CLOSE = 1e-9
"""Error of such a motion over its maximum; that of its rate is a thousand times as large."""
_NODES = np.array([0.0, 0.5, 1.0])
_THROUGH = np.linalg.inv(np.vstack([_NODES[:, None] ** np.arange(6), np.arange(6) * _NODES[:, None] ** np.maximum(np.arange(6) - 1, 0)]))  # fmt: skip
"""Coefficients of a quintic from its values and rates at the nodes."""


def fitted(
    name: str,
    motion: Callable[[float], tuple[float, float]],
    until: float,
    longest: float,
    jumps: Sequence[float],
) -> Pieces:
    """Quintics through values and rates of a *motion*, of time (s), up to *until*; shorter where they miss it by more than 1e-9.

    Raises
    ------
    InputError
        If the motion is not finite, or is not smooth between its *jumps*.
    """
    tiny = 1e-13 * until
    ends = [0.0, *sorted(t for t in set(jumps) if tiny < t < until - tiny), until]
    parts: list[tuple[float, float, float, float]] = []
    for low, high in itertools.pairwise(ends):
        edges = np.linspace(low, high, 1 + min(max(64, math.ceil((high - low) / longest)), _PIECES)).tolist()
        parts += [(a, b, low + tiny, high - tiny) for a, b in itertools.pairwise(edges)]
    at = np.array([motion(min(max(a, low), high)) for a, _, low, high in parts])
    most = np.maximum(np.abs(at).max(axis=0), 1e-300)
    begins: list[float] = []
    coefficients: list[_Array] = []
    parts.reverse()
    while parts:
        a, b, low, high = parts.pop()
        h = b - a

        def seen(share: float, a: float = a, h: float = h, low: float = low, high: float = high) -> _Array:
            return np.array(motion(min(max(a + share * h, low), high))) * (1.0, h)

        nodes = np.array([seen(share) for share in _NODES])
        found = _THROUGH @ np.concatenate((nodes[:, 0], nodes[:, 1]))
        most = np.maximum(most, np.abs(nodes * (1.0, 1.0 / h)).max(axis=0))
        slopes = np.arange(1, 6) * found[1:]
        wrong = max(
            np.abs((np.polyval(found[::-1], share), np.polyval(slopes[::-1], share)) - seen(share))
            @ (1.0, 1e-3 * most[0] / (most[1] * h))
            for share in (0.2, 0.4, 0.75)
        )
        if wrong <= _CLOSE * most[0]:
            begins.append(a)
            coefficients.append(found / h ** np.arange(6))
        elif h > 1e-9 * until and len(begins) + len(parts) < _PIECES:
            middle = 0.5 * (a + b)
            parts += [(middle, b, low, high), (a, middle, low, high)]
        else:
            raise InputError(
                f"{name}.motion at {a:g} s: is not finite or not smooth, or has more than {_PIECES} parts, so that engine = 'native' "
                "cannot approximate it; name the times of its jumps in discontinuities, or define components"
            )
    return Pieces(np.array(begins)[None], np.array(coefficients)[None])


def side_by_side(pieces: Sequence[Pieces], which: NDArray[np.int64]) -> Pieces:
    """Pieces of many runs, *which* of them each has, as one table."""
    most = max(each.begins.shape[1] for each in pieces)
    begins = [
        np.pad(each.begins[0], (0, most - each.begins.shape[1]), constant_values=1e300) for each in pieces
    ]
    rows = [np.pad(each.coefficients[0], ((0, most - each.begins.shape[1]), (0, 0))) for each in pieces]
    return Pieces(np.array(begins)[which], np.array(rows)[which])
