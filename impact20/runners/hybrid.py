"""The course of a run with located events, shared by all solvers that can locate them.

The solver supplies `segment(states, pulse, t, u, end, times)`: integrate with the contacts in the given states (0 open, 1
closed, 3 let go while the penetration is still positive) until `end` or until the state of a contact ends, and return the time, the state, the output states at those of
`times` that were reached, and the contact whose state ended, or -1.
"""

from __future__ import annotations

from collections.abc import Callable
from math import cos, sin
from typing import Any, NamedTuple

import numpy as np

from impact20 import Array, Case
from impact20.runners import CannotRun, Result
from impact20.runners.flat import initial_state

CHATTER = 1e-7
"""Speed of impact over the scale at which chatter is complete."""
MOST = 2_000


class Segment(NamedTuple):
    """Where a segment ended."""

    t: float
    u: Array
    passed: Array
    """Output displacements at the times reached."""
    contact: int
    evaluations: int


def approach(case: Case, j: int, t: float, u: Array) -> tuple[float, float]:
    """Penetration and its rate."""
    tip, n = case.tips[j], len(case.stiffness)
    angle = tip.frequency * t + tip.phase
    d = tip.amplitude * sin(angle) - tip.gap - float(tip.row @ u[:n])
    rate = tip.amplitude * tip.frequency * cos(angle) - float(tip.row @ u[n : 2 * n])
    return d, rate


def _reaction(case: Case, t: float) -> tuple[float, Array]:
    """Acceleration that presses a single mass which stands on the tip of its only contact, and its state."""
    if len(case.stiffness) != 1 or case.coupling is not None or case.circuit is not None or case.truss is not None:
        raise CannotRun("sustained contact of several or nonlinear coordinates is left out")
    tip = case.tips[0]
    row = tip.row[0]
    angle = tip.frequency * t + tip.phase
    u = np.array([(tip.amplitude * sin(angle) - tip.gap) / row, tip.amplitude * tip.frequency * cos(angle) / row])
    force = -case.stiffness[0] * u[0] - case.damping[0] * u[1]
    if case.load is not None:
        force += case.load[0]
    if case.harmonic is not None:
        force += case.harmonic[0] * sin(case.frequency * t + case.phase)
    return -tip.amplitude * tip.frequency**2 * sin(angle) - row * force, u


def _stand(case: Case, t: float, end: float) -> float:
    """Time at which the mass leaves the tip, or *end*."""
    period = 2 * np.pi / max(case.frequency, case.tips[0].frequency, 1e-3)
    low = t
    while low < end:
        high = min(low + period / 400, end)
        if _reaction(case, high)[0] < 0:
            for _ in range(60):
                middle = (low + high) / 2
                low, high = (middle, high) if _reaction(case, middle)[0] >= 0 else (low, middle)
            return high
        low = high
    return end


def drive(case: Case, segment: Callable[..., Segment], edge: float = 0.0) -> Result:
    """Run a case; *edge* is the penetration at which a solver switches a contact, if not 0."""
    n, times = len(case.stiffness), case.times
    t, u = 0.0, initial_state(case)
    states = [0] * len(case.tips)
    for j, tip in enumerate(case.tips):
        d, rate = approach(case, j, t, u)
        if tip.law != "restitution":
            states[j] = int(d > edge or (d == edge and rate > 0))
    impacts, evaluations, at = sum(states), 0, 0
    values = np.full(case.samples, np.nan)
    pulse = case.pulse is not None
    for _ in range(MOST):
        end = min(case.horizon, case.pulse_duration) if pulse else case.horizon
        waiting = times[at : int(np.searchsorted(times, end, side="right"))]
        piece = segment(tuple(states), pulse, t, u, end, waiting)
        evaluations += piece.evaluations
        values[at : at + len(piece.passed)] = piece.passed
        at += len(piece.passed)
        t, u = piece.t, np.array(piece.u, dtype=float)
        if piece.contact < 0:
            if not pulse or t >= case.horizon:
                break
            pulse = False
            continue
        j = piece.contact
        tip = case.tips[j]
        if tip.law != "restitution":
            # A dashpot lets go while the penetration is positive; the contact opens when that has passed, too.
            states[j] = {0: 1, 1: 3 if tip.law == "kelvin_voigt" else 0, 3: 0}[states[j]]
            impacts += states[j] == 1
            continue
        impacts += 1
        _, speed = approach(case, j, t, u)
        square = float(tip.row @ tip.row)
        if speed < CHATTER * case.scale and _reaction(case, t)[0] > 0:
            until = _stand(case, t, case.horizon)
            while at < case.samples and times[at] <= until:
                values[at] = float(case.output @ _reaction(case, times[at])[1][:n])
                at += 1
            t, u = until, _reaction(case, until)[1]
            if until >= case.horizon:
                break
            continue
        u[n : 2 * n] += tip.row * (1 + tip.coefficient) * speed / square
        # The next segment begins just outside, so that its event function has the right sign.
        u[:n] += tip.row * (approach(case, j, t, u)[0] + 1e-16) / square
    else:
        raise RuntimeError(f"more than {MOST} events")
    return Result(values, impacts, evaluations or None, u)


def through(case: Case, why: str) -> tuple[int, ...]:
    """States for a solver without events; CannotRun with *why* if a contact is a jump."""
    if any(tip.law == "restitution" for tip in case.tips):
        raise CannotRun(why)
    return (2,) * len(case.tips)


def outputs(case: Case, states: Any) -> Array:
    """The output of states of shape (times, size)."""
    return np.asarray(np.asarray(states)[:, : len(case.stiffness)] @ case.output)
