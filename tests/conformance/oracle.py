"""An independent solution of Eq. (11): the paper's own coordinates, SciPy's DOP853, contacts as events.

Nothing here is taken from the package: mass, stiffness, shapes and damping are written out again from the
closed forms, and the equations are integrated as they stand in the paper.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import scipy.linalg
from numpy.typing import NDArray
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

LENGTH, THICKNESS, WIDTH, DENSITY, YOUNG, LEVEL = 0.161, 0.4e-3, 15e-3, 7800.0, 200e9, 0.335e-3
CONTACT_STIFFNESS, DAMPING_RATIO, LOCATION = 4e8, 0.005, 1.0 / 2.1

Array = NDArray[np.float64]


@dataclass
class Solution:
    """Displacement at the shaker and at the centre (of b) at the times asked for, and every impact."""

    time: Array
    displacement: Array
    midspan_displacement: Array
    impacts: Array
    """Onset s, duration s, peak force N; the last one may still be going on."""


class PaperBeam:
    """The paper's beam on N buckling modes, Eqs. (4)-(18)."""

    def __init__(self, modes: int) -> None:
        section = THICKNESS * WIDTH
        bending = YOUNG * WIDTH * THICKNESS**3 / 12.0
        critical = 4.0 * math.pi**2 * bending / LENGTH**2
        load = critical + math.pi**2 * YOUNG * section * LEVEL**2 / (4.0 * LENGTH**2)
        self.k = np.array([_wavenumber(i) for i in range(1, modes + 1)]) / LENGTH
        self.odd = np.arange(1, modes + 1) % 2 == 1
        coupling = 2.0 * np.outer(self.odd, self.odd) + 2.0 / 3.0 * np.outer(~self.odd, ~self.odd)
        self.mass = DENSITY * section * (np.eye(modes) + coupling) / np.outer(self.k, self.k)
        self.stiffness = bending * self.k**2 - load
        self.gamma = YOUNG * section / (2.0 * LENGTH)
        self.rest = np.zeros(modes)
        self.rest[0] = -math.sqrt((load - critical) / self.gamma)
        tangent = self.stiffness + self.gamma * self.rest[0] ** 2
        tangent[0] += 2.0 * self.gamma * self.rest[0] ** 2
        squared, vectors = scipy.linalg.eigh(np.diag(tangent), self.mass)
        self.omega = np.sqrt(squared)
        mv = self.mass @ vectors
        damping = mv @ np.diag(2.0 * DAMPING_RATIO * self.omega) @ mv.T
        self.inverse = np.linalg.inv(self.mass)
        self.damping = self.inverse @ damping

    def shape(self, x: float) -> Array:
        """phi_i at x (m)."""
        xi = x - 0.5 * LENGTH
        symmetric = 1.0 - np.cos(self.k * x)
        antisymmetric = -2.0 * xi / LENGTH + np.sin(self.k * xi) / np.sin(0.5 * self.k * LENGTH)
        return math.sqrt(2.0 / LENGTH) / self.k * np.where(self.odd, symmetric, antisymmetric)

    def solve(self, ratio: float, velocity: float, times: Array, location: float = LOCATION) -> Solution:
        """Displacements at *times* (s, from 0), for Omega = *ratio* and V = *velocity*."""
        n, phi, center = self.k.size, self.shape(location * LENGTH), self.shape(0.5 * LENGTH)
        omega = ratio * self.omega[0]
        stroke = velocity * LEVEL * self.omega[0] / omega
        start = float(phi @ self.rest)
        push, inverse, damping = self.inverse @ phi, self.inverse, self.damping
        gamma, stiffness = self.gamma, self.stiffness
        linear = np.zeros((2 * n, 2 * n))
        linear[:n, n:] = np.eye(n)
        linear[n:] = np.hstack((-inverse * stiffness, -damping))

        def depth(t: float, y: Array) -> float:
            return start + stroke * math.sin(omega * t) - float(phi @ y[:n])

        def flight(t: float, y: Array) -> Array:
            a = y[:n]
            out: Array = linear @ y
            out[n:] -= inverse @ ((gamma * (a @ a)) * a)
            return out

        def contact(t: float, y: Array) -> Array:
            out = flight(t, y)
            out[n:] += push * (CONTACT_STIFFNESS * max(depth(t, y), 0.0) ** 1.5)
            return out

        def onset(t: float, y: Array) -> float:
            return depth(t, y)

        def release(t: float, y: Array) -> float:
            return depth(t, y)

        onset.terminal, onset.direction = True, 1.0  # type: ignore[attr-defined]
        release.terminal, release.direction = True, -1.0  # type: ignore[attr-defined]
        scale = np.concatenate((np.full(n, abs(self.rest[0])), np.full(n, abs(self.rest[0]) * self.omega[0])))
        # the longest step in flight is well below the shortest time apart
        longest, rtol = (1e-4 if n <= 2 else 2e-5), (1e-11 if n <= 8 else 1e-10)
        t, y, touching = 0.0, np.concatenate((self.rest, np.zeros(n))), True
        found, states, impacts = [], [], []
        while t < times[-1]:
            inside = times[(times >= t) & (times <= times[-1])]
            part = solve_ivp(
                contact if touching else flight, (t, times[-1]), y, "DOP853", dense_output=True,
                rtol=rtol, atol=0.1 * rtol * scale, max_step=4e-6 if touching else longest,
                events=release if touching else onset,
            )  # fmt: skip
            assert part.success, part.message
            end = part.t[-1]
            inside = inside[(inside < end) | (end >= times[-1])]
            found.append(inside)
            states.append(part.sol(inside)[:n].T)
            if touching:
                depths = np.array([depth(s, z) for s, z in zip(part.t, part.y.T, strict=True)])
                impacts.append((t, end - t, CONTACT_STIFFNESS * max(depths.max(), 0.0) ** 1.5))
            t, y, touching = end, part.y[:, -1], not touching
        alpha = np.concatenate(states)
        return Solution(np.concatenate(found), alpha @ phi / LEVEL, alpha @ center / LEVEL, np.array(impacts))

    def bounces(self, ratio: float, velocity: float, coefficient: float, location: float, count: int) -> Array:
        """The first *count* impacts of one mode under Newton's law, rows of onset (s) and impulse (N s)."""
        phi, mass = float(self.shape(location * LENGTH)[0]), float(self.mass[0, 0])
        omega = ratio * self.omega[0]
        stroke = velocity * LEVEL * self.omega[0] / omega
        start = phi * self.rest[0]

        def flight(t: float, y: Array) -> Array:
            force = self.stiffness[0] * y[0] + self.gamma * y[0] ** 3
            return np.array([y[1], -force / mass - self.damping[0, 0] * y[1]])

        def depth(t: float, y: Array) -> float:
            return start + stroke * math.sin(omega * t) - phi * y[0]

        depth.terminal, depth.direction = True, 1.0  # type: ignore[attr-defined]
        scale = abs(self.rest[0]) * np.array([1.0, self.omega[0]])
        t, y, found = 0.0, np.array([self.rest[0], 0.0]), []
        while True:
            closing = stroke * omega * math.cos(omega * t) - phi * y[1]
            impulse = (1.0 + coefficient) * closing * mass / phi**2
            found.append((t, impulse))
            if len(found) == count:
                return np.array(found)
            y = y + np.array([0.0, phi * impulse / mass])
            # off the tip before the event is looked for, lest the impact itself be found again
            part = solve_ivp(
                flight, (t, t + 1.0), y, "DOP853", rtol=1e-12, atol=1e-13 * scale, max_step=2e-5, events=depth,
                first_step=1e-8,
            )  # fmt: skip
            assert part.status == 1, part.message
            t, y = float(part.t[-1]), part.y[:, -1]


def _wavenumber(i: int) -> float:
    """k_i L: (i + 1) pi for odd i; for even i the root of tan(k L/2) = k L/2."""
    if i % 2 == 1:
        return (i + 1) * math.pi
    n = i // 2
    low, high = n * math.pi, (n + 0.5) * math.pi
    return 2.0 * brentq(lambda x: math.sin(x) - x * math.cos(x), low, high, xtol=1e-15)
