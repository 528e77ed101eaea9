"""Independent reference for any combination of parts: equations in buckling modes, SciPy's DOP853, contacts as events.

Nothing is taken from the package.  Mass, stiffness and shapes are written out from their closed forms; strikers with a
mass and circuits have equations of their own.  The number of each part is not limited.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np
import scipy.linalg
from numpy.typing import NDArray
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

Array = NDArray[np.float64]
Motion = Callable[[float], tuple[float, float, float]]
"""Displacement, velocity and acceleration."""
MOST_PIECES = 20_000
"""Events of a run at which the reference gives up."""
NEAR = 0.8
"""Share of the time at which SciPy fails at an infinite force, up to which its states are compared."""
LEAST_DEPTH, LEAST_FORCE = 1e-14, 1e-9
"""Penetration (m) and force (N) beyond zero at which events lie, so that rounding makes none."""


@dataclass(frozen=True)
class BeamNumbers:
    """A clamped beam, its imperfection and its damping, in SI units."""

    length: float
    thickness: float
    width: float
    density: float
    young: float
    level: float
    modes: int
    damping_ratio: float
    rise: float = 0.0
    skew: float = 0.0
    point_load: float = 0.0
    point_location: float = 0.5
    uniform_load: float = 0.0
    gravity: float = 0.0


class ReferenceBeam:
    """The beam on its first buckling modes, with the two wells and the natural frequencies."""

    def __init__(self, given: BeamNumbers) -> None:
        n, section = given.modes, given.thickness * given.width
        self.length = given.length
        bending = given.young * given.width * given.thickness**3 / 12.0
        critical = 4.0 * math.pi**2 * bending / given.length**2
        load = critical + math.pi**2 * given.young * section * given.level**2 / (4.0 * given.length**2)
        self.k = np.array([wavenumber(i) for i in range(1, n + 1)]) / given.length
        self.odd = np.arange(1, n + 1) % 2 == 1
        overlap = 2.0 * np.outer(self.odd, self.odd) + 2.0 / 3.0 * np.outer(~self.odd, ~self.odd)
        self.mass = given.density * section * (np.eye(n) + overlap) / np.outer(self.k, self.k)
        self.inverse = np.linalg.inv(self.mass)
        self.gamma = given.young * section / (2.0 * given.length)
        initial = np.zeros(n)
        initial[0] = given.rise / self.shape(0.5)[0]
        if given.skew:
            heights = np.array([self.shape(x)[1] for x in np.linspace(0.0, 0.5, 4001)])
            initial[1] = given.skew / heights[np.argmax(np.abs(heights))]
        nodes, weights = np.polynomial.legendre.leggauss(200)
        shapes = np.array([self.shape(0.5 * (1.0 + x)) for x in nodes])
        self.rigid = given.density * section * 0.5 * given.length * (weights @ shapes)
        uniform = given.uniform_load / (given.density * section) - given.gravity
        self.constant = bending * self.k**2 * initial + given.point_load * self.shape(given.point_location)
        self.constant = self.constant + uniform * self.rigid
        self.linear = bending * self.k**2 - load - self.gamma * float(initial @ initial)
        straight = np.zeros(n)
        straight[0] = math.sqrt((load - critical) / self.gamma)
        self.wells = {sign: self.settle(sign * straight, ()) for sign in (-1.0, 1.0)}
        self.damping_ratio = given.damping_ratio
        self.deepest = min((-1.0, 1.0), key=lambda sign: self.energy(self.wells[sign]))
        """Well of lowest energy, whose damping a beam without strikers has."""
        self.fabricated = 1.0 if initial[0] > 0.0 else -1.0
        """Well on the side of the initial shape, where a beam without strikers begins."""
        self.omega = float(self.frequencies(self.deepest)[0][0])
        """First natural frequency about the deeper well, rad/s."""

    def shape(self, place: float) -> Array:
        """phi at a place over the length."""
        x, k, size = place * self.length, self.k, self.length
        symmetric = 1.0 - np.cos(k * x)
        other = -2.0 * (x - 0.5 * size) / size + np.sin(k * (x - 0.5 * size)) / np.sin(0.5 * k * size)
        return np.asarray(math.sqrt(2.0 / size) / k * np.where(self.odd, symmetric, other))

    def slope(self, place: float) -> Array:
        """phi' at a place over the length."""
        x, k, size = place * self.length, self.k, self.length
        other = -2.0 / size + k * np.cos(k * (x - 0.5 * size)) / np.sin(0.5 * k * size)
        return np.asarray(math.sqrt(2.0 / size) / k * np.where(self.odd, k * np.sin(k * x), other))

    def force(self, a: Array) -> Array:
        """Minus the gradient of the potential energy."""
        return np.asarray(self.constant - self.linear * a - self.gamma * (a @ a) * a)

    def energy(self, a: Array) -> float:
        """The potential energy."""
        return float(0.5 * a @ (self.linear * a) + 0.25 * self.gamma * (a @ a) ** 2 - self.constant @ a)

    def tangent(self, a: Array) -> Array:
        """The second derivative of the potential energy."""
        return np.asarray(np.diag(self.linear + self.gamma * (a @ a)) + 2.0 * self.gamma * np.outer(a, a))

    def settle(self, a: Array, forces: Sequence[PointForce]) -> Array:
        """The equilibrium that Newton's method finds from *a*, with local forces."""
        for _ in range(60):
            missing, matrix = self.force(a), self.tangent(a)
            for each in forces:
                u = float(each.row @ a)
                h = 1e-6 * max(abs(u), 1e-6)
                slope = (each.force(u + h) - each.force(u - h)) / (2.0 * h)
                missing = missing + each.force(u) * each.row
                matrix = matrix - slope * np.outer(each.row, each.row)
            a = a + np.linalg.solve(matrix, missing)
        return a

    def frequencies(self, sign: float) -> tuple[Array, Array]:
        """Angular natural frequencies about a well of the beam, and the modes."""
        squared, vectors = scipy.linalg.eigh(self.tangent(self.wells[sign]), self.mass)
        return np.sqrt(squared), vectors

    def damping(self, sign: float) -> Array:
        """The damping matrix of the linear modes about a well."""
        omega, vectors = self.frequencies(sign)
        mv = self.mass @ vectors
        return np.asarray(mv @ np.diag(2.0 * self.damping_ratio * omega) @ mv.T)


def limit(local: PointForce, sign: float) -> Callable[[float, Array, Sequence[bool]], float]:
    """Event in which a displacement leaves the range of its law."""

    def value(t: float, y: Array, touching: Sequence[bool]) -> float:
        return sign * float(local.row @ y[: local.row.size]) - local.reach

    value.terminal, value.direction = True, 1.0  # type: ignore[attr-defined]
    return value


def wavenumber(i: int) -> float:
    """The wavenumber of a buckling mode of a clamped beam, times the length."""
    if i % 2 == 1:
        return (i + 1) * math.pi
    low, high = i * math.pi, (i + 1) * math.pi
    return 2.0 * float(brentq(lambda h: math.sin(h) - h * math.cos(h), 0.5 * low, 0.5 * high, xtol=1e-15))


@dataclass(frozen=True)
class Tip:
    """A striker and its contact."""

    motion: Motion
    location: float
    force: Callable[[float], float]
    """Elastic force of a penetration."""
    damping: Callable[[float], float] | None = None
    """Force per rate of penetration."""
    side: float = 1.0
    """+1 pushes upwards."""
    gap: float | None = None
    """None: touches at the start."""
    body: tuple[float, float, float] | None = None
    """Mass, stiffness and damper of a suspension."""


@dataclass(frozen=True)
class PointForce:
    """A force that depends on the displacement and velocity of a row."""

    row: Array
    force: Callable[[float], float]
    damping: Callable[[float, float], float] | None = None
    reach: float = math.inf
    """Displacement of either sign up to which the law is valid."""


@dataclass(frozen=True)
class Circuit:
    """m alpha'' + ... = row z, inertia z' = -row . alpha' - loss z."""

    row: Array
    inertia: float
    loss: float


@dataclass(frozen=True)
class Parts:
    """Everything that acts on the beam."""

    tips: Sequence[Tip] = ()
    external: Sequence[tuple[Array, Callable[[float], float]]] = ()
    local: Sequence[PointForce] = ()
    base: Motion | None = None
    """Upwards."""
    carried: bool = True
    """Whether the strikers stand on the base."""
    load: Callable[[float], float] | None = None
    circuits: Sequence[Circuit] = ()
    start: tuple[Array, Array] | None = None
    breaks: Sequence[float] = field(default=())
    """Times at which a motion is not smooth."""


class Solution:
    """States of a run at the times asked for, up to where the motion leaves the range of a law."""

    left: float = math.inf
    """Time at which a force is infinite, or a displacement leaves the range of its law, s."""
    latest: float = math.inf
    """Time up to which the motion is certain, s: where a force grows without bound, the end is only near."""

    def __init__(
        self,
        beam: ReferenceBeam,
        parts: Parts,
        times: Array,
        rtol: float = 2e-12,
        longest: float = 150.0,
        kick: Array | None = None,
    ) -> None:
        self.beam, self.parts, n = beam, parts, beam.k.size
        tips, circuits = parts.tips, parts.circuits
        sign = -tips[0].side if tips else beam.fabricated
        self.rest = beam.settle(beam.wells[sign], parts.local)
        self.damping = beam.damping(sign if tips else beam.deepest)
        self.bodies = {j: 2 * n + 2 * i for i, j in enumerate(j for j, tip in enumerate(tips) if tip.body)}
        self.live = {i: 0 for i, each in enumerate(circuits) if each.inertia > 0.0}
        first = 2 * n + 2 * len(self.bodies)
        self.live = {i: first + number for number, i in enumerate(self.live)}
        self.shapes = [beam.shape(tip.location) for tip in tips]
        size = float(np.abs(beam.wells[sign]).max())
        speed, height = size * beam.omega, size * float(beam.shape(0.5)[0])
        scale = np.concatenate((np.full(n, size), np.full(n, speed)))
        scale = np.append(scale, np.tile([height, height * beam.omega], len(self.bodies)))
        for i in self.live:
            most = float(np.abs(circuits[i].row).max()) * speed
            scale = np.append(scale, most / max(circuits[i].loss, circuits[i].inertia * beam.omega))
        y = np.zeros(scale.size)
        y[:n], y[n : 2 * n] = (self.rest, np.zeros(n)) if parts.start is None else parts.start
        self.offset = [0.0] * len(tips)
        for j, tip in enumerate(tips):
            here = self.shapes[j] @ (y[:n] if tip.gap is None else self.rest)
            self.offset[j] = tip.side * float(here) - (tip.gap or 0.0)
            if tip.gap is None:
                self.offset[j] -= self.depth(j, 0.0, y)[0]
        if kick is not None:
            y = y + kick[: y.size] * scale
        self.states = self.integrate(y, times, rtol, 2.0 * math.pi / beam.omega / longest, 0.1 * rtol * scale)

    def depth(self, j: int, t: float, y: Array) -> tuple[float, float]:
        """Penetration of a contact and its rate."""
        tip, n = self.parts.tips[j], self.beam.k.size
        w, v = tip.motion(t)[:2]
        if self.parts.base is not None and not self.parts.carried:
            moved = self.parts.base(t)
            w, v = w - tip.side * moved[0], v - tip.side * moved[1]
        if tip.body is not None:
            w, v = w + y[self.bodies[j]], v + y[self.bodies[j] + 1]
        reached, rate = self.shapes[j] @ y[:n], self.shapes[j] @ y[n : 2 * n]
        return self.offset[j] + w - tip.side * float(reached), v - tip.side * float(rate)

    def pressure(self, j: int, depth: float, rate: float) -> float:
        """Contact force before it is cut off at zero."""
        tip, d = self.parts.tips[j], max(depth, 0.0)
        return tip.force(d) + (0.0 if tip.damping is None else tip.damping(d) * rate)

    def current(self, y: Array) -> Array:
        """z of each circuit."""
        n = self.beam.k.size
        return np.array([
            y[self.live[i]] if i in self.live else -float(each.row @ y[n : 2 * n]) / each.loss
            for i, each in enumerate(self.parts.circuits)
        ])  # fmt: skip

    def rate(self, t: float, y: Array, touching: Sequence[bool]) -> Array:
        """The right side of the equations of motion."""
        parts, n = self.parts, self.beam.k.size
        a, v, out = y[:n], y[n : 2 * n], np.zeros(y.size)
        force = self.beam.force(a) - self.damping @ v
        if parts.load is not None:
            force = force + parts.load(t) * a
        base = None if parts.base is None else parts.base(t)[2]
        if base is not None:
            force = force - base * self.beam.rigid
        for row, history in parts.external:
            force = force + history(t) * row
        for local in parts.local:
            u = float(local.row @ a)
            f = local.force(u)
            if local.damping is not None:
                f += local.damping(u, float(local.row @ v))
            force = force + f * local.row
        for i, (each, z) in enumerate(zip(parts.circuits, self.current(y), strict=True)):
            force = force + z * each.row
            if i in self.live:
                out[self.live[i]] = (-float(each.row @ v) - each.loss * z) / each.inertia
        for j, tip in enumerate(parts.tips):
            d, closing = self.depth(j, t, y)
            f = max(0.0, self.pressure(j, d, closing)) if touching[j] or d > 0.0 else 0.0
            force = force + tip.side * f * self.shapes[j]
            if tip.body is not None:
                at, (m, k, c) = self.bodies[j], tip.body
                out[at], out[at + 1] = y[at + 1], (-f - c * y[at + 1] - k * y[at]) / m
                if base is not None and parts.carried:
                    out[at + 1] -= tip.side * base
        out[:n], out[n : 2 * n] = v, self.beam.inverse @ force
        return out

    def event(self, j: int, of_force: bool, rising: bool) -> Callable[[float, Array, Sequence[bool]], float]:
        """Onset or release of a contact, or a zero of a force that loses energy."""

        def value(t: float, y: Array, touching: Sequence[bool]) -> float:
            d, closing = self.depth(j, t, y)
            if not of_force:
                return d - sign * LEAST_DEPTH
            return self.pressure(j, d, closing) - sign * LEAST_FORCE if d > 0.0 else 1.0

        sign = 1.0 if rising else -1.0
        value.terminal, value.direction = True, sign  # type: ignore[attr-defined]
        return value

    def integrate(self, y: Array, times: Array, rtol: float, longest: float, atol: Array) -> Array:
        """States at *times*."""
        tips, t, last = self.parts.tips, 0.0, float(times[-1])
        depths = [self.depth(j, 0.0, y) for j in range(len(tips))]
        touching = [d > 1e-16 or (abs(d) <= 1e-16 and v > 0.0) for d, v in depths]
        pressing = [self.pressure(j, d, v) >= 0.0 for j, (d, v) in enumerate(depths)]
        watched = [(j, False) for j in range(len(tips))]
        watched += [(j, True) for j, tip in enumerate(tips) if tip.damping is not None]
        found: list[Array] = []
        pieces, ends = (
            0,
            [limit(local, sign) for local in self.parts.local for sign in (1.0, -1.0) if local.reach < math.inf],
        )
        while t < last:
            until = min([at for at in self.parts.breaks if at > t * (1.0 + 1e-12)] + [last])
            events = [self.event(j, of, not (pressing if of else touching)[j]) for j, of in watched]
            part = solve_ivp(
                self.rate, (t, until), y, "DOP853", dense_output=True, rtol=rtol, atol=atol,
                max_step=longest, first_step=min(1e-3 * longest, until - t), args=(tuple(touching),), events=events + ends or None,
            )  # fmt: skip
            pieces += 1
            assert pieces < MOST_PIECES
            end = float(part.t[-1])
            if not part.success:
                self.left, self.latest = end, NEAR * end
            elif any(hit.size for hit in (part.t_events or [])[len(watched) :]):
                self.left = self.latest = end
            if self.left < math.inf:
                inside = times[(times >= t) & (times < self.latest)]
                found.append(part.sol(inside).T if inside.size else np.zeros((0, y.size)))
                break
            inside = times[(times >= t) & ((times < end) | (end >= last))]
            if inside.size:
                found.append(part.sol(inside).T)
            t, y = end, part.y[:, -1]
            for (j, of_force), hit in zip(watched, (part.t_events or [])[: len(watched)], strict=True):
                if hit.size and of_force:
                    pressing[j] = not pressing[j]
                elif hit.size:
                    touching[j], pressing[j] = not touching[j], True
        return np.concatenate(found)

    def heights(self, places: Sequence[float]) -> Array:
        """Displacements of places over the length, m, shape (times, places)."""
        shapes = np.array([self.beam.shape(place) for place in places])
        return np.asarray(self.states[:, : self.beam.k.size] @ shapes.T)

    def depths(self, times: Array) -> Array:
        """Penetrations of all contacts, m, shape (times, contacts)."""
        count = range(len(self.parts.tips))
        pairs = zip(times, self.states, strict=True)
        return np.array([[self.depth(j, t, y)[0] for j in count] for t, y in pairs])

    def currents(self) -> Array:
        """z of all circuits, shape (times, circuits)."""
        return np.array([self.current(y) for y in self.states])
