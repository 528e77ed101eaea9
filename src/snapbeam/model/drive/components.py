"""Components of a motion: tones, polynomials in pieces and sweeps, of which the native core makes its signals.

    tone     mean + amplitude sin(rate t + phase), times a window
    pieces   gain sum_k c_k (t - begin)^k, a polynomial of degree five from each begin to the next
    sweep    size/w(t)^power sin(integral of w), with w from first to last in a duration

The motion of a drive is the sum of its components; t is the time since the drive began, s.  Every array has shape (runs,), or
begins with that axis, or with one of length 1 that all runs share.  :class:`Motion` evaluates them in Python.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Sequence
from functools import partial
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from snapbeam.util.validation import InputError

_Array = NDArray[np.float64]
RISE = np.array([0.0, 0.0, 0.0, 10.0, -15.0, 6.0])
"""x^3 (10 - 15 x + 6 x^2): from 0 to 1, without a jump of the first two derivatives."""
STEEPEST = 1.875
"""Maximum slope of that polynomial on [0, 1]."""
SHARPEST = 5.7736
"""Maximum curvature of that polynomial on [0, 1], 10/sqrt(3)."""


class Pieces(NamedTuple):
    """Polynomials from each begin to the next."""

    begins: _Array
    """s, shape (runs or 1, pieces); the first holds before it too, the last for good."""
    coefficients: _Array
    """Coefficients of the powers of the time since the begin, shape (runs or 1, pieces, 6)."""
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

    size: _Array
    """Amplitude of the value (power 0), of its rate (1) or of its second derivative (2)."""
    first: _Array
    last: _Array
    """rad/s."""
    duration: _Array
    exponential: bool
    power: int = 1


Component = Tone | Pieces | Sweep


class Motion:
    """Sum of components: value, rate and acceleration at times.

    Parameters
    ----------
    components : sequence of Component
    runs : int or array of int, shape (times,)
        Run whose parameters count, or the run of each time.

    Examples
    --------
    >>> import numpy as np
    >>> Motion([Tone(np.array([2.0]), np.array([3.0]))])(0.0)
    array([0., 6., 0.])
    """

    def __init__(self, components: Sequence[Component], runs: int | NDArray[np.int64] = 0) -> None:
        own = partial(_of_runs, runs=runs)
        self._sweeps = [
            Sweep(own(each.size), own(each.first), own(each.last), own(each.duration), each.exponential, each.power)
            for each in components
            if isinstance(each, Sweep)
        ]
        self._pieces, self._runs = [each for each in components if isinstance(each, Pieces)], runs
        together: dict[int, list[Tone]] = {}
        for each in components:
            if isinstance(each, Tone):
                together.setdefault(id(each.window), []).append(each)
        self._tones = []
        for tones in together.values():
            numbers = [
                np.stack(np.broadcast_arrays(*map(own, each)))
                for each in zip(*(tone[:4] for tone in tones), strict=True)
            ]
            self._tones.append(([each if each.ndim > 1 else each[:, None] for each in numbers], tones[0].window))

    def __call__(self, times: ArrayLike) -> _Array:
        """Value, rate and acceleration at *times* (s); shape (3, ...) of times of shape (...)."""
        given = np.asarray(times, dtype=np.float64)
        t = given.reshape(-1)
        found = np.zeros((3, t.size))
        for pieces in self._pieces:
            found += _in_pieces(pieces, t, self._runs)
        for (amplitude, rate, phase, mean), window in self._tones:
            angle = rate * t + phase
            sine = amplitude * np.sin(angle)
            tones = np.stack((
                np.sum(mean + sine, axis=0), np.sum(rate * amplitude * np.cos(angle), axis=0), -np.sum(rate * rate * sine, axis=0)
            ))  # fmt: skip
            found += tones if window is None else _product(_in_pieces(window, t, self._runs), tones)
        for sweep in self._sweeps:
            found += _swept(t, sweep)
        return found.reshape(3, *given.shape)


def _of_runs(values: _Array | float, runs: int | NDArray[np.int64]) -> _Array:
    """Numbers of some runs, from one for all or one for each."""
    array = np.asarray(values, dtype=np.float64)
    return array if array.ndim == 0 else array[np.zeros_like(runs) if len(array) == 1 else runs]


def _in_pieces(pieces: Pieces, t: _Array, runs: int | NDArray[np.int64]) -> _Array:
    """Value and derivatives of pieces of some runs."""
    begins, coefficients, _ = pieces
    which = runs if len(begins) > 1 else 0
    if isinstance(which, int):
        at = np.searchsorted(begins[which], t, side="right") - 1
    else:
        at = np.sum(begins[which] <= t[:, None], axis=1) - 1
    at = np.maximum(at, 0)
    x, c = t - begins[which, at], coefficients[which, at].T
    value, slope, bend = c[5], 0.0 * x, 0.0 * x
    for k in range(4, -1, -1):
        value, slope, bend = value * x + c[k], slope * x + value, bend * x + slope
    return np.asarray(_of_runs(pieces.gain, runs) * np.stack((value, slope, 2.0 * bend)))


def _product(one: _Array, other: _Array) -> _Array:
    """Value and derivatives of a product."""
    (a, da, dda), (b, db, ddb) = one, other
    return np.stack((a * b, da * b + a * db, dda * b + 2.0 * da * db + a * ddb))


def _swept(t: _Array, sweep: Sweep) -> _Array:
    """Value and derivatives of a sweep."""
    size, first, last, duration, exponential, power = sweep
    s = np.minimum(t, duration)
    if exponential:
        grows = np.log(last / first) / duration
        now, still = first * np.exp(grows * s), grows == 0.0
        angle = np.where(still, first * s, (now - first) / np.where(still, 1.0, grows))
        change, bend = grows * now, grows * grows * now
    else:
        change = (last - first) / duration
        now, bend = first + change * s, np.zeros(1)
        angle = s * (first + 0.5 * change * s)
    angle, over = angle + last * (t - s), t >= duration
    now, change, bend = np.where(over, last, now), np.where(over, 0.0, change), np.where(over, 0.0, bend)
    sine, cosine, a = np.sin(angle), np.cos(angle), size / now**power
    falls = -power * a * change / now
    curves = power * a * ((power + 1) * change * change / (now * now) - bend / now)
    return np.stack((
        a * sine, a * now * cosine + falls * sine,
        (curves - a * now * now) * sine + (2.0 * falls * now + a * change) * cosine,
    ))  # fmt: skip


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
    name: str, motion: Callable[[float], tuple[float, float]], until: float, longest: float, jumps: Sequence[float]
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
                f"{name}.motion at {a:g} s: is not finite or not smooth, or has more than {_PIECES} parts, and cannot be "
                "approximated; name the times of its jumps in discontinuities, or define components"
            )
    return Pieces(np.array(begins)[None], np.array(coefficients)[None])


def side_by_side(pieces: Sequence[Pieces], which: NDArray[np.int64]) -> Pieces:
    """Pieces of many runs, *which* of them each has, as one table."""
    most = max(each.begins.shape[1] for each in pieces)
    begins = [np.pad(each.begins[0], (0, most - each.begins.shape[1]), constant_values=1e300) for each in pieces]
    rows = [np.pad(each.coefficients[0], ((0, most - each.begins.shape[1]), (0, 0))) for each in pieces]
    return Pieces(np.array(begins)[which], np.array(rows)[which])
