"""An independent solution of a beam that several strikers strike: the paper's coordinates, SciPy's DOP853.

Nothing is taken from the package.  Each tip moves as prescribed and presses with a force of its penetration; every
onset and release of every contact is an event at which the integration begins anew.  Steps in flight five times as long
locate some of them 1e-8 b off, which a few impacts make 1e-6 b.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from oracle import CONTACT_STIFFNESS, LENGTH, LEVEL, LOCATION, PaperBeam
from scipy.integrate import solve_ivp

Array = NDArray[np.float64]


def hertz(d: float) -> float:
    """The paper's contact."""
    return CONTACT_STIFFNESS * d**1.5


@dataclass(frozen=True)
class Tip:
    """One striker."""

    motion: Callable[[float], tuple[float, float]]
    """Displacement from its mid-position (m), in the direction in which it pushes, and velocity."""
    location: float = LOCATION
    side: float = 1.0
    """+1 from below, -1 from above."""
    gap: float = 0.0
    """m, of the mid-position to the beam at rest in the lower well."""
    force: Callable[[float], float] = hertz


@dataclass
class Struck:
    """At the times asked for: displacements over b, forces (N) and tips over b of shape (times, strikers), work (J)."""

    displacement: Array
    midspan_displacement: Array
    force: Array
    tip: Array
    work: Array


def solve_several(
    beam: PaperBeam, tips: Sequence[Tip], times: Array, rtol: float = 1e-11, start: Array | None = None
) -> Struck:
    """Integrate from rest in the lower well, or from amplitudes *start* at rest."""
    n, count = beam.k.size, len(tips)
    shapes = np.array([beam.shape(tip.location * LENGTH) for tip in tips])
    rest = shapes @ beam.rest
    pushes = (beam.inverse @ shapes.T).T
    linear = np.zeros((2 * n, 2 * n))
    linear[:n, n:] = np.eye(n)
    linear[n:] = np.hstack((-beam.inverse * beam.stiffness, -beam.damping))

    def depth(j: int, t: float, a: Array) -> float:
        tip = tips[j]
        return tip.side * (rest[j] - float(shapes[j] @ a)) - tip.gap + tip.motion(t)[0]

    def forces(t: float, a: Array) -> Array:
        return np.array([tip.force(max(depth(j, t, a), 0.0)) for j, tip in enumerate(tips)])

    def rate(t: float, y: Array) -> Array:
        a = y[:n]
        out = np.zeros(2 * n + 1)
        out[: 2 * n] = linear @ y[: 2 * n]
        out[n : 2 * n] -= beam.inverse @ ((beam.gamma * (a @ a)) * a)
        for j, force in enumerate(forces(t, a)):
            if force > 0.0:
                out[n : 2 * n] += tips[j].side * force * pushes[j]
                out[2 * n] += force * tips[j].motion(t)[1]
        return out

    def edge(j: int) -> Callable[[float, Array], float]:
        def event(t: float, y: Array) -> float:
            return depth(j, t, y[:n])

        event.terminal = True  # type: ignore[attr-defined]
        return event

    size, speed = abs(beam.rest[0]), abs(beam.rest[0]) * beam.omega[0]
    scale = np.concatenate((np.full(n, size), np.full(n, speed), [beam.mass[0, 0] * speed**2]))
    y = np.concatenate((beam.rest if start is None else start, np.zeros(n + 1)))
    t, states, taken = 0.0, [], []
    pressing = np.array([depth(j, 0.0, y[:n]) >= 0.0 for j in range(count)])
    while t < times[-1]:
        events = [edge(j) for j in range(count)]
        for j, event in enumerate(events):
            event.direction = -1.0 if pressing[j] else 1.0  # type: ignore[attr-defined]
        part = solve_ivp(
            rate, (t, times[-1]), y, "DOP853", dense_output=True, rtol=rtol, atol=0.1 * rtol * scale,
            max_step=4e-6 if pressing.any() else 2e-5, events=events,
        )  # fmt: skip
        assert part.success, part.message
        end = float(part.t[-1])
        inside = times[(times >= t) & ((times < end) | (end >= times[-1]))]
        if inside.size:
            taken.append(inside)
            states.append(part.sol(inside).T)
        t, y = end, part.y[:, -1]
        for j, found in enumerate(part.t_events):
            pressing[j] = pressing[j] != (found.size > 0)
    found, at = np.concatenate(states), np.concatenate(taken)
    alpha = found[:, :n]
    center = beam.shape(0.5 * LENGTH)
    where = [[tip.side * (tip.motion(t)[0] - tip.gap) + rest[j] for j, tip in enumerate(tips)] for t in at]
    pressed = np.array([forces(t, a) for t, a in zip(at, alpha, strict=True)])
    return Struck(
        alpha @ shapes[0] / LEVEL, alpha @ center / LEVEL, pressed,
        np.array(where) / LEVEL, found[:, 2 * n],
    )  # fmt: skip
