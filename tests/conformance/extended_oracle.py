"""Independent reference solution of extended systems: the paper's coordinates and those of the bodies, SciPy's DOP853.

Nothing is taken from the package.  The tip moves as prescribed or is a body with equations of its own; the force is
any function of the penetration and its rate; onsets, releases and vanishing forces are events.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from oracle import LENGTH, LEVEL, LOCATION, PaperBeam
from scipy.integrate import solve_ivp

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Tip:
    """What strikes: where it is, how hard it presses, and, if it is a body, its own equations."""

    motion: Callable[[float, Array], tuple[float, float]]
    """Displacement from the start (m) and velocity (m/s), of the time and the body's own state."""
    force: Callable[[float, float], float]
    """Force (N) of a penetration (m) and its rate (m/s), before it is cut off at zero."""
    edge: Callable[[float, float], float] | None = None
    """A smooth function of the same with the sign of that force, if it can be negative."""
    body: Callable[[float, Array, float], Array] | None = None
    """Rate of the body's own state, of time, state and contact force."""
    state: tuple[float, ...] = ()
    """The body's state at the start."""
    gap: float = 0.0
    """m, at the start."""
    location: float = LOCATION
    breaks: tuple[float, ...] = ()
    """Instants (s) at which the motion is not smooth: integrated up to and from."""


@dataclass
class Followed:
    """What was found at the times asked for, displacements over b."""

    displacement_at_striker: Array
    midspan_displacement: Array
    penetration_normalised: Array
    own: Array
    """State of the body, shape (times, numbers)."""
    force: Array


def follow(beam: PaperBeam, tip: Tip, times: Array, rtol: float = 1e-11) -> Followed:
    """Integrate from rest in the lower well."""
    n, m = beam.k.size, len(tip.state)
    phi, center = beam.shape(tip.location * LENGTH), beam.shape(0.5 * LENGTH)
    start, push = float(phi @ beam.rest) - tip.gap, beam.inverse @ phi
    linear = np.zeros((2 * n, 2 * n))
    linear[:n, n:] = np.eye(n)
    linear[n:] = np.hstack((-beam.inverse * beam.stiffness, -beam.damping))

    def seen(t: float, y: Array) -> tuple[float, float]:
        w, v = tip.motion(t, y[2 * n :])
        return start + w - float(phi @ y[:n]), v - float(phi @ y[n : 2 * n])

    def rate(t: float, y: Array, pressing: bool) -> Array:
        a = y[:n]
        out = np.empty(2 * n + m)
        out[: 2 * n] = linear @ y[: 2 * n]
        out[n : 2 * n] -= beam.inverse @ ((beam.gamma * (a @ a)) * a)
        if hasattr(beam, "pull"):
            out[n : 2 * n] += beam.inverse @ beam.pull(a)
        f = tip.force(*_above(seen(t, y))) if pressing else 0.0
        out[n : 2 * n] += push * f
        if tip.body is not None:
            out[2 * n :] = tip.body(t, y[2 * n :], f)
        return out

    def gap_closes(t: float, y: Array, pressing: bool) -> float:
        return seen(t, y)[0]

    def gap_opens(t: float, y: Array, pressing: bool) -> float:
        return seen(t, y)[0]

    def vanishes(t: float, y: Array, pressing: bool) -> float:
        return 1.0 if tip.edge is None else tip.edge(*seen(t, y))

    def presses(t: float, y: Array, pressing: bool) -> float:
        return -1.0 if tip.edge is None else tip.edge(*seen(t, y))

    gap_closes.terminal, gap_closes.direction = True, 1.0  # type: ignore[attr-defined]
    gap_opens.terminal, gap_opens.direction = True, -1.0  # type: ignore[attr-defined]
    vanishes.terminal, vanishes.direction = True, -1.0  # type: ignore[attr-defined]
    presses.terminal, presses.direction = True, 1.0  # type: ignore[attr-defined]
    length, speed = abs(beam.rest[0]), abs(beam.rest[0]) * beam.omega[0]
    scale = np.concatenate((np.full(n, length), np.full(n, speed), np.full(m, LEVEL)))
    t, y = 0.0, np.concatenate((beam.rest, np.zeros(n), np.array(tip.state)))
    depth, closing = seen(t, y)
    touching, states = depth > 0.0 or (depth == 0.0 and closing > 0.0), []
    pressing = touching
    longest = 1e-4 if n <= 2 else 2e-5
    taken = np.zeros(0)
    while t < times[-1]:
        until = min([at for at in tip.breaks if at > t] + [float(times[-1])])
        part = solve_ivp(
            rate, (t, until), y, "DOP853", dense_output=True, rtol=rtol, atol=0.1 * rtol * scale,
            max_step=4e-6 if touching else longest, args=(pressing,),
            events=[gap_opens, vanishes if pressing else presses] if touching else [gap_closes],
        )  # fmt: skip
        assert part.success, part.message
        end = float(part.t[-1])
        inside = times[(times >= t) & ((times < end) | (end >= times[-1]))]
        if inside.size:
            taken = np.concatenate((taken, inside))
            states.append(part.sol(inside).T)
        t, y = end, part.y[:, -1]
        if part.t_events[0].size:
            touching = pressing = not touching
        elif part.status == 1:
            pressing = not pressing
    found = np.concatenate(states)
    depths = np.array([seen(s, z) for s, z in zip(taken, found, strict=True)])
    forces = [max(0.0, tip.force(d, v)) if d > 0.0 else 0.0 for d, v in depths]
    return Followed(
        found[:, :n] @ phi / LEVEL, found[:, :n] @ center / LEVEL, depths[:, 0] / LEVEL, found[:, 2 * n :],
        np.array(forces),
    )  # fmt: skip


def _above(pair: tuple[float, float]) -> tuple[float, float]:
    return max(pair[0], 0.0), pair[1]


def differences(data: Any, truth: Followed) -> dict[str, float]:
    """Greatest differences of a run's dataset, over b, by name."""
    names = ("displacement_at_striker", "midspan_displacement", "penetration_normalised")
    return {name: float(np.abs(data[name].values - getattr(truth, name)).max()) for name in names}


def missing(data: Any) -> float:
    """What the ledger of a run with one striker misses at its worst, over the gross work."""
    ledger = data.energy_beam + data.energy_contact + data.energy_dissipated - data.striker_work
    return float(np.ptp(ledger.values)) / float(data.attrs["gross_work"])
