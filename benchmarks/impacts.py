"""A one-mode oscillator under a law of restitution: here, and by the algorithm that general tools have for it.

DynamicalSystems.jl and its like integrate the flight by an adaptive Runge-Kutta method and find each impact as an event
of it; that is SciPy's ``solve_ivp`` with an event here, which is interpreted.  Beside it stands the most that any
event-driven program can reach: the flight in closed form, compiled, so that nothing but diagnostic impacts is left.
"""

from __future__ import annotations

import math
import time
from typing import Any, NamedTuple

import numba
import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

import snapbeam as sb
from snapbeam.dynamics.stroboscope import Stroboscope

__all__ = ["Way", "ways"]

_Array = NDArray[np.float64]
RESTITUTION = 0.6
PHASE = math.pi
"""Of the wall at the start of a run."""
_TOLERANCE = 1e-10
_LOOKS = 200
"""At the gap of a flight in a period, between which an impact is bracketed."""


class Way(NamedTuple):
    """How the orbits were carried on."""

    name: str
    periods: int
    """In all."""
    cpu: float
    """Seconds of processor time."""
    error: float
    """Greatest distance from the exact orbit at the end, over the wall's amplitude."""


def exact(ratio: float) -> _Array:
    """State of the orbit with one impact in a period, when the wall's phase is pi; the wall's amplitude is 1."""
    kappa = 0.5 * (1.0 + RESTITUTION) / math.tan(math.pi / ratio)
    speed = 1.0 / math.hypot(kappa, 0.5 * (1.0 - RESTITUTION) / ratio)
    w, up, wall = kappa * speed, 0.5 * (1.0 + RESTITUTION) * speed, 0.5 * (1.0 - RESTITUTION) * speed
    after = ((PHASE - math.atan2(w, wall / ratio)) % (2.0 * math.pi)) / ratio
    cosine, sine = math.cos(after), math.sin(after)
    return np.array([w * cosine + up * sine, -w * sine + up * cosine])


def flow_of(ratio: float) -> Stroboscope:
    """The oscillator, of natural frequency 1 and mass 1, struck at rest by a wall sin(ratio t)."""
    model = sb.ReducedModel.from_matrices([[1.0]], [1.0], contact_shape=[1.0], length_scale=1.0)
    drive = sb.Sine(frequency_ratio=ratio, velocity_amplitude=ratio)
    system = sb.System(model, contacts=[sb.Contact(sb.Restitution(RESTITUTION), sb.Striker(drive=drive, gap=0.0))])
    return Stroboscope(system, phase=PHASE)


def by_events(ratio: float, state: _Array, periods: int) -> _Array:
    """An adaptive Runge-Kutta method, impacts found as events of it."""

    def gap(t: float, y: _Array) -> float:
        return float(y[0]) - math.sin(ratio * t + PHASE)

    gap.terminal, gap.direction = True, -1.0  # type: ignore[attr-defined]
    t, end, y = 0.0, periods * 2.0 * math.pi / ratio, np.array(state)
    while t < end:
        found: Any = solve_ivp(
            lambda _, y: (y[1], -y[0]), (t, end), y, method="DOP853", events=gap, rtol=_TOLERANCE, atol=_TOLERANCE
        )
        t, y = float(found.t[-1]), found.y[:, -1]
        if found.status == 1:
            wall = ratio * math.cos(ratio * t + PHASE)
            y = np.array([math.sin(ratio * t + PHASE) + 1e-12, wall + RESTITUTION * (wall - y[1])])
    return y


@numba.njit(cache=False)
def _gap(ratio: float, t: float, q: float, p: float, after: float) -> float:  # pragma: no cover - compiled
    return q * math.cos(after) + p * math.sin(after) - math.sin(ratio * (t + after) + math.pi)


@numba.njit(cache=False)
def in_closed_form(ratio: float, q: float, p: float, periods: int, restitution: float) -> tuple[float, float]:
    """Flights in closed form; impacts bracketed by looks at the gap, then halved to rounding."""
    t, end, look = 0.0, periods * 2.0 * math.pi / ratio, 2.0 * math.pi / (ratio * 200)
    while True:
        begin, hit = 1e-9, False
        while t + begin < end:
            stop = min(begin + look, end - t)
            if _gap(ratio, t, q, p, stop) < 0.0:
                hit = True
                break
            if t + stop >= end:
                break
            begin = stop
        if not hit:
            left = end - t
            return q * math.cos(left) + p * math.sin(left), -q * math.sin(left) + p * math.cos(left)
        low, high = begin, stop
        for _ in range(60):
            middle = 0.5 * (low + high)
            if _gap(ratio, t, q, p, middle) < 0.0:
                high = middle
            else:
                low = middle
        speed = -q * math.sin(low) + p * math.cos(low)
        t += low
        wall = ratio * math.cos(ratio * t + math.pi)
        q, p = math.sin(ratio * t + math.pi), wall + restitution * (wall - speed)


def ways(orbits: int, periods: int, by_scipy: int) -> list[Way]:
    """Exact orbits of several ratios carried on for some periods; SciPy has fewer of them."""
    ratios = np.linspace(1.6, 1.8, orbits)
    states = np.array([exact(float(ratio)) for ratio in ratios])
    flow = flow_of(float(ratios[0]))
    # the drive's speed in a file is that of the tip, so that a ratio changes both
    points = {"drive.frequency_ratio": ratios, "drive.velocity_amplitude": ratios}
    flow.advance(states[:2], 1, points={name: values[:2] for name, values in points.items()})
    begun = time.process_time()
    ends = flow.advance(states, periods, points=points).states
    here = time.process_time() - begun
    in_closed_form(1.7, *states[0], 1, RESTITUTION)
    begun = time.process_time()
    closed = np.array(
        [in_closed_form(float(r), *state, periods, RESTITUTION) for r, state in zip(ratios, states, strict=True)]
    )
    bound = time.process_time() - begun
    chosen = np.linspace(0, orbits - 1, by_scipy).astype(int)
    begun = time.process_time()
    seen = np.array([by_events(float(ratios[i]), states[i], periods) for i in chosen])
    there = time.process_time() - begun

    def off(found: _Array, exactly: _Array) -> float:
        return float(np.abs(found - exactly).max())

    return [
        Way("snapbeam", orbits * periods, here, off(ends, states)),
        Way("flights in closed form, compiled", orbits * periods, bound, off(closed, states)),
        Way("solve_ivp (DOP853) with events", by_scipy * periods, there, off(seen, states[chosen])),
    ]
