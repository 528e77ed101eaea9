"""An independent solution of anything at once: springs at the ends, unequal wells, strikers, a base, a load, a circuit.

Nothing is taken from the package.  The paper's coordinates, the gradient of the energy as it is written, bodies and
circuits as equations of their own; SciPy's DOP853, every onset and release of every contact an event.  Steps three
times as long locate some of these late: 5e-7 b of one mixture of twenty.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np
import scipy.linalg
from numpy.typing import NDArray
from oracle import DAMPING_RATIO, DENSITY, LENGTH, LEVEL, THICKNESS, WIDTH
from scipy.integrate import solve_ivp
from sprung_beam import BENDING, SprungBeam

Array = NDArray[np.float64]


class MixedBeam(SprungBeam):
    """Springs at the ends, and initial heights, a force at a point, one per length and gravity."""

    def __init__(
        self, modes: int, ends: tuple[float | None, float | None, float | None], uneven: dict[str, float]
    ) -> None:
        super().__init__(modes, *ends)
        self.load = float(BENDING * self.k[0] ** 2 - self.stiffness[0])
        nodes, weights = np.polynomial.legendre.leggauss(200)
        places = 0.5 * LENGTH * (1.0 + nodes)
        self.integral = 0.5 * LENGTH * np.array([self.shape(x) for x in places]).T @ weights
        initial = np.zeros(modes)
        initial[0] = uneven.get("rise", 0.0) / self.shape(0.5 * LENGTH)[0]
        if uneven.get("skew"):
            heights = np.array([self.shape(x)[1] for x in np.linspace(0.0, 0.5, 4001) * LENGTH])
            initial[1] = uneven["skew"] / heights[np.argmax(np.abs(heights))]
        self.initial = initial
        self.side = uneven.get("point_load", 0.0) * self.shape(uneven.get("point_location", 0.5) * LENGTH)
        weight = DENSITY * THICKNESS * WIDTH * uneven.get("gravity", 0.0)
        self.side = self.side + (uneven.get("uniform_load", 0.0) - weight) * self.integral
        for _ in range(60):
            self.rest = self.rest - np.linalg.solve(self.tangent(self.rest), self.gradient(self.rest))
        squared, vectors = scipy.linalg.eigh(self.tangent(self.rest), self.mass)
        self.omega = np.sqrt(squared)
        mv = self.mass @ vectors
        self.damping = self.inverse @ (mv @ np.diag(2.0 * DAMPING_RATIO * self.omega) @ mv.T)

    def gradient(self, a: Array) -> Array:
        s = a @ a - self.initial @ self.initial
        return np.asarray(BENDING * self.k**2 * (a - self.initial) - (self.load - self.gamma * s) * a - self.side)

    def tangent(self, a: Array) -> Array:
        s = a @ a - self.initial @ self.initial
        own = np.diag(BENDING * self.k**2 - self.load + self.gamma * s)
        return np.asarray(own + 2.0 * self.gamma * np.outer(a, a))

    def slope(self, x: float) -> Array:
        """phi_i' at x (m)."""
        return np.array([float(self._of(c, k, np.array(x), 1)) for c, k in zip(self.forms, self.k, strict=True)])


@dataclass(frozen=True)
class Tip:
    """One striker."""

    motion: Callable[[float], tuple[float, float]]
    """From its mid-position in the direction in which it pushes (m), as long as nothing touches it, and velocity."""
    force: Callable[[float, float], float]
    """Of penetration and its rate."""
    location: float
    side: float = 1.0
    gap: float = 0.0
    body: tuple[float, float, float] | None = None
    """Mass, spring and damper."""


@dataclass(frozen=True)
class Around:
    """What surrounds the beam."""

    base: Callable[[float], tuple[float, float, float]] | None = None
    """Displacement, velocity and acceleration, upwards."""
    striker_on_base: bool = True
    load: Callable[[float], float] | None = None
    coupling: Array | None = None
    inertia: float = 0.0
    loss: float = 1.0
    """m alpha'' + ... = theta z, M z' = -theta . alpha' - loss z."""
    forces: tuple[tuple[float, Callable[[float], float]], ...] = ()
    """Place over the length, and force in N over time."""
    breaks: tuple[float, ...] = field(default=())
    """s, where something is not smooth."""


def solve(beam: MixedBeam, tips: Sequence[Tip], around: Around, times: Array, rtol: float = 1e-11) -> Array:
    """Displacements over b of the first contact point and the centre, and the first penetration: shape (times, 3)."""
    n, count = beam.k.size, len(tips)
    shapes = np.array([beam.shape(tip.location * LENGTH) for tip in tips])
    rest, pushes = shapes @ beam.rest, (beam.inverse @ shapes.T).T
    pull = beam.inverse @ (DENSITY * THICKNESS * WIDTH * beam.integral)
    theta = np.zeros(n) if around.coupling is None else around.coupling
    bodies = [j for j, tip in enumerate(tips) if tip.body is not None]

    def seen(j: int, t: float, y: Array) -> tuple[float, float]:
        tip = tips[j]
        w, v = tip.motion(t)
        if around.base is not None and not around.striker_on_base:
            moved = around.base(t)
            w, v = w - tip.side * moved[0], v - tip.side * moved[1]
        if tip.body is not None:
            at = 2 * n + 1 + 2 * bodies.index(j)
            w, v = w + y[at], v + y[at + 1]
        depth = tip.side * (rest[j] - float(shapes[j] @ y[:n])) - tip.gap + w
        return depth, v - tip.side * float(shapes[j] @ y[n : 2 * n])

    def rate(t: float, y: Array) -> Array:
        a, v, z = y[:n], y[n : 2 * n], y[2 * n]
        out = np.zeros(y.size)
        force = -beam.gradient(a)
        if around.load is not None:
            force = force + around.load(t) * a
        for place, history in around.forces:
            force = force + history(t) * beam.shape(place * LENGTH)
        out[:n] = v
        if around.coupling is not None:
            if around.inertia > 0.0:
                out[2 * n] = (-theta @ v - around.loss * z) / around.inertia
            else:
                z = -float(theta @ v) / around.loss
            force = force + theta * z
        out[n : 2 * n] = beam.inverse @ force - beam.damping @ v
        if around.base is not None:
            out[n : 2 * n] -= around.base(t)[2] * pull
        for j, tip in enumerate(tips):
            depth, closing = seen(j, t, y)
            f = max(0.0, tip.force(depth, closing)) if depth > 0.0 else 0.0
            out[n : 2 * n] += tip.side * f * pushes[j]
            if tip.body is not None:
                at = 2 * n + 1 + 2 * bodies.index(j)
                m, k, c = tip.body
                out[at], out[at + 1] = y[at + 1], (-f - c * y[at + 1] - k * y[at]) / m
                if around.base is not None and around.striker_on_base:
                    # its suspension stands on the base
                    out[at + 1] -= tip.side * around.base(t)[2]
        return out

    def edge(j: int) -> Callable[[float, Array], float]:
        def event(t: float, y: Array) -> float:
            return seen(j, t, y)[0]

        event.terminal = True  # type: ignore[attr-defined]
        return event

    size, speed = abs(beam.rest[0]), abs(beam.rest[0]) * beam.omega[0]
    circuit = max(float(np.abs(theta).max()) * speed / max(around.loss, 1e-300), 1e-12)
    scale = np.concatenate(
        (np.full(n, size), np.full(n, speed), [circuit], np.tile([LEVEL, LEVEL * beam.omega[0]], len(bodies)))
    )
    y = np.concatenate((beam.rest, np.zeros(n + 1 + 2 * len(bodies))))
    t, taken, found = 0.0, [], []
    depths = [seen(j, 0.0, y) for j in range(count)]
    pressing = np.array([d > 1e-18 or (abs(d) <= 1e-18 and v > 0.0) for d, v in depths], dtype=bool)
    while t < times[-1]:
        until = min([at for at in around.breaks if at > t] + [float(times[-1])])
        events = [edge(j) for j in range(count)]
        for j, event in enumerate(events):
            event.direction = -1.0 if pressing[j] else 1.0  # type: ignore[attr-defined]
        part = solve_ivp(
            rate, (t, until), y, "DOP853", dense_output=True, rtol=rtol, atol=0.1 * rtol * scale,
            max_step=2e-6 if pressing.any() else 6e-6, events=events or None,
        )  # fmt: skip
        assert part.success, part.message
        end = float(part.t[-1])
        inside = times[(times >= t) & ((times < end) | (end >= times[-1]))]
        if inside.size:
            taken.append(inside)
            found.append(part.sol(inside).T)
        t, y = end, part.y[:, -1]
        for j, hit in enumerate(part.t_events or []):
            pressing[j] = pressing[j] != (hit.size > 0)
    states, at = np.concatenate(found), np.concatenate(taken)
    depth = [seen(0, s, z)[0] for s, z in zip(at, states, strict=True)] if tips else np.zeros(at.size)
    first = shapes[0] if tips else beam.shape(0.5 * LENGTH)
    return np.stack(
        [states[:, :n] @ first, states[:, :n] @ beam.shape(0.5 * LENGTH), np.asarray(depth)], axis=1
    ) / LEVEL  # fmt: skip
