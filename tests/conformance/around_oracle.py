"""An independent solution of what surrounds a beam: a base that moves, a load that changes, a circuit, a stop.

The paper's coordinates, the circuit as an equation of its own, work and delivered energy as integrals of theirs; DOP853
of SciPy, contacts as events.  Nothing is taken from the package.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from oracle import CONTACT_STIFFNESS, DENSITY, LENGTH, LEVEL, LOCATION, THICKNESS, WIDTH, PaperBeam
from scipy.integrate import solve_ivp

Array = NDArray[np.float64]
Motion = Callable[[float], tuple[float, float, float]]


def still(t: float) -> tuple[float, float, float]:
    """No motion."""
    return 0.0, 0.0, 0.0


def unchanged(t: float) -> float:
    """No change."""
    return 0.0


@dataclass(frozen=True)
class Surroundings:
    """What acts on the beam beside its tension."""

    base: Motion = still
    """Displacement, velocity and acceleration of the base, upwards."""
    load: Callable[[float], float] = unchanged
    """Axial load beyond the mean, N."""
    coupling: Array | None = None
    """theta of every buckling mode: m alpha'' + ... = theta z."""
    inertia: float = 0.0
    """M of M z' = -theta . alpha' - loss z; 0: z follows at once."""
    loss: float = 1.0
    gap: float | None = None
    """Of a stop, m, from below, at LOCATION; None: there is none."""
    striker_on_base: bool = True
    """Whether the stop moves with the base."""
    forces: tuple[tuple[float, Callable[[float], float]], ...] = ()
    """Place over the length, and force in N over time."""


@dataclass
class Found:
    """At the times asked for: displacements over b, z, work of base and load, energy lost in the circuit, work of forces."""

    displacement: Array
    midspan_displacement: Array
    z: Array
    base_work: Array
    load_work: Array
    circuit: Array
    force_work: Array


def integrals(k: Array) -> Array:
    """Integrals of the shapes over the length, by Gauss's rule on many pieces."""
    beam = PaperBeam(k.size)
    nodes, weights = np.polynomial.legendre.leggauss(12)
    edges = np.linspace(0.0, LENGTH, 201)
    half = 0.5 * (edges[1] - edges[0])
    found = np.zeros(k.size)
    for left in edges[:-1]:
        for node, weight in zip(nodes, weights, strict=True):
            found += weight * half * beam.shape(left + half * (1.0 + node))
    return found


def slopes(beam: PaperBeam, x: float) -> Array:
    """phi_i' at x."""
    xi = x - 0.5 * LENGTH
    symmetric = beam.k * np.sin(beam.k * x)
    antisymmetric = -2.0 / LENGTH + beam.k * np.cos(beam.k * xi) / np.sin(0.5 * beam.k * LENGTH)
    return math.sqrt(2.0 / LENGTH) / beam.k * np.where(beam.odd, symmetric, antisymmetric)


def live(beam: PaperBeam, around: Surroundings, times: Array, rtol: float = 1e-11) -> Found:
    """Integrate from rest in the lower well."""
    n = beam.k.size
    phi, center = beam.shape(LOCATION * LENGTH), beam.shape(0.5 * LENGTH)
    pull = beam.inverse @ (DENSITY * THICKNESS * WIDTH * integrals(beam.k))
    push = beam.inverse @ phi
    theta = np.zeros(n) if around.coupling is None else around.coupling
    tap = beam.inverse @ theta
    start = float(phi @ beam.rest)
    linear = np.zeros((2 * n, 2 * n))
    linear[:n, n:] = np.eye(n)
    linear[n:] = np.hstack((-beam.inverse * beam.stiffness, -beam.damping))
    mass_pull = DENSITY * THICKNESS * WIDTH * integrals(beam.k)
    rows = [(beam.shape(place * LENGTH), force) for place, force in around.forces]

    def depth(t: float, y: Array, pressing: bool = False) -> float:
        if around.gap is None:
            return -1.0
        at = start - around.gap - (0.0 if around.striker_on_base else around.base(t)[0])
        return at - float(phi @ y[:n])

    def rate(t: float, y: Array, pressing: bool) -> Array:
        a, v, z = y[:n], y[n : 2 * n], y[2 * n]
        out = np.zeros(2 * n + 5)
        out[: 2 * n] = linear @ y[: 2 * n]
        out[n : 2 * n] -= beam.inverse @ ((beam.gamma * (a @ a)) * a)
        acceleration, change = around.base(t)[2], around.load(t)
        out[n : 2 * n] += -acceleration * pull + change * (beam.inverse @ a)
        if around.coupling is not None:
            if around.inertia > 0.0:
                out[2 * n] = (-theta @ v - around.loss * z) / around.inertia
            else:
                z = -float(theta @ v) / around.loss
            out[n : 2 * n] += tap * z
            out[2 * n + 3] = around.loss * z * z
        if pressing:
            out[n : 2 * n] += push * (CONTACT_STIFFNESS * max(depth(t, y), 0.0) ** 1.5)
        out[2 * n + 1] = -acceleration * float(mass_pull @ v)
        out[2 * n + 2] = change * float(a @ v)
        for row, force in rows:
            out[n : 2 * n] += force(t) * (beam.inverse @ row)
            out[2 * n + 4] += force(t) * float(row @ v)
        return out

    def opens(t: float, y: Array, pressing: bool) -> float:
        return depth(t, y)

    def closes(t: float, y: Array, pressing: bool) -> float:
        return depth(t, y)

    closes.terminal, closes.direction = True, 1.0  # type: ignore[attr-defined]
    opens.terminal, opens.direction = True, -1.0  # type: ignore[attr-defined]
    size, speed = abs(beam.rest[0]), abs(beam.rest[0]) * beam.omega[0]
    energy = beam.mass[0, 0] * speed**2
    circuit = max(float(np.abs(theta).max()) * speed / max(around.loss, 1e-300), 1e-12)
    scale = np.concatenate((np.full(n, size), np.full(n, speed), [circuit], np.full(4, energy)))
    t, y, pressing, states, taken = 0.0, np.concatenate((beam.rest, np.zeros(n + 5))), False, [], []
    longest = 1e-4 if n <= 2 else 2e-5
    while t < times[-1]:
        part = solve_ivp(
            rate, (t, times[-1]), y, "DOP853", dense_output=True, rtol=rtol, atol=0.1 * rtol * scale,
            max_step=4e-6 if pressing else longest, args=(pressing,),
            events=None if around.gap is None else [opens if pressing else closes],
        )  # fmt: skip
        assert part.success, part.message
        end = float(part.t[-1])
        inside = times[(times >= t) & ((times < end) | (end >= times[-1]))]
        if inside.size:
            taken.append(inside)
            states.append(part.sol(inside).T)
        t, y = end, part.y[:, -1]
        pressing = pressing != (part.status == 1)
    found = np.concatenate(states)
    z = found[:, 2 * n]
    if around.coupling is not None and around.inertia == 0.0:
        z = -(found[:, n : 2 * n] @ theta) / around.loss
    return Found(found[:, :n] @ phi / LEVEL, found[:, :n] @ center / LEVEL, z, *found[:, 2 * n + 1 :].T)
