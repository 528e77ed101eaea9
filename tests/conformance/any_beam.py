"""An independent solution for any beam: mode shapes as null vectors, integrals by quadrature, contacts as events.

Nothing here is taken from the package, nor from the closed forms of the paper: buckled shapes are the null vectors of
the four conditions at the clamps, mass and stretching are Gauss-Legendre sums over them, and Eq. (11) is integrated in
raw amplitudes by DOP853 as it stands, with every closing and opening of the gap located.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import scipy.linalg
from numpy.typing import NDArray
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

Array = NDArray[np.float64]
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(400)


def clamped(k: float) -> Array:
    """What A + B x + C cos kx + D sin kx and its slope are at both ends of a beam of unit length."""
    c, s = math.cos(k), math.sin(k)
    return np.array([[1, 0, 1, 0], [0, 1, 0, k], [1, 1, c, s], [0, 1, -k * s, k * c]], dtype=float)


def wavenumbers(count: int) -> list[float]:
    """Where a clamped beam buckles: zeros of the determinant, the double ones of the symmetric shapes included."""
    found: list[float] = []
    n = 1
    while len(found) < count:
        found.append(2.0 * n * math.pi)
        # between two symmetric shapes one antisymmetric one, where the determinant over sin(k/2) changes its sign
        low, high = 2.0 * n * math.pi + 1e-6, 2.0 * (n + 1) * math.pi - 1e-6
        found.append(brentq(lambda k: float(np.linalg.det(clamped(k))) / math.sin(0.5 * k), low, high, xtol=1e-14))
        n += 1
    return found[:count]


@dataclass(frozen=True)
class Numbers:
    """A beam and how it is struck, SI."""

    length: float
    thickness: float
    width: float
    density: float
    young: float
    level: float
    modes: int
    damping_ratio: float
    contact_stiffness: float
    location: float
    frequency_ratio: float
    velocity_amplitude: float


MOST_PARTS = 4000


class Endless(Exception):
    """The solution goes to and fro between flight and contact and gets no further: a graze within its errors."""


class AnyBeam:
    """Eq. (11) in raw amplitudes."""

    def __init__(self, given: Numbers) -> None:
        self.given, n = given, given.modes
        section = given.thickness * given.width
        bending = given.young * given.width * given.thickness**3 / 12.0
        x, weights = 0.5 * (_NODES + 1.0), 0.5 * _WEIGHTS
        shapes, slopes, curvatures, self.made_of = [], [], [], []
        for k in wavenumbers(n):
            a, b, c, d = scipy.linalg.svd(clamped(k))[2][-1]
            slope = b - c * k * np.sin(k * x) + d * k * np.cos(k * x)
            norm = math.sqrt(float(weights @ slope**2))
            self.made_of.append((k, np.array([a, b, c, d]) / norm))
            shapes.append((a + b * x + c * np.cos(k * x) + d * np.sin(k * x)) / norm)
            slopes.append(slope / norm)
            curvatures.append(-(k**2) * (c * np.cos(k * x) + d * np.sin(k * x)) / norm)
        phi, first, second = np.array(shapes), np.array(slopes), np.array(curvatures)
        # w = sum of alpha phi(x / L), alpha a length: slopes over L, curvatures over L^2
        length = given.length
        self.mass = given.density * section * length * (phi * weights) @ phi.T
        bend = bending / length**3 * (second * weights) @ second.T
        self.stretch = (first * weights) @ first.T / length
        critical = bending * (2.0 * math.pi / length) ** 2
        # the well of the first mode alone: level = twice its amplitude at the centre
        top = abs(self.shape(0.5)[0])
        rest = given.level / top
        self.gamma = given.young * section / (2.0 * length)
        load = critical + self.gamma * rest**2 * self.stretch[0, 0]
        self.stiffness = bend - load * self.stretch
        self.rest = np.zeros(n)
        self.rest[0] = -math.copysign(rest, self.shape(0.5)[0])
        pulled = self.stretch @ self.rest
        tangent = self.stiffness + self.gamma * float(self.rest @ pulled) * self.stretch
        tangent = tangent + 2.0 * self.gamma * np.outer(pulled, pulled)
        squared, vectors = scipy.linalg.eigh(tangent, self.mass)
        self.omega = np.sqrt(squared)
        mv = self.mass @ vectors
        self.damping = mv @ np.diag(2.0 * given.damping_ratio * self.omega) @ mv.T

    def shape(self, x: float) -> Array:
        """phi_i at x, over the length."""
        return np.array([c[0] + c[1] * x + c[2] * math.cos(k * x) + c[3] * math.sin(k * x) for k, c in self.made_of])

    def displacement(self, times: Array, velocity_factor: float = 1.0) -> Array:
        """At the contact point and at the centre, over the level, at *times* (s, rising from 0); shape (times, 2)."""
        given, n = self.given, self.given.modes
        phi, center = self.shape(given.location), self.shape(0.5)
        omega = given.frequency_ratio * self.omega[0]
        stroke = velocity_factor * given.velocity_amplitude * given.level * self.omega[0] / omega
        start, inverse = float(phi @ self.rest), np.linalg.inv(self.mass)
        linear = np.zeros((2 * n, 2 * n))
        linear[:n, n:] = np.eye(n)
        linear[n:] = np.hstack((-inverse @ self.stiffness, -inverse @ self.damping))
        pull, push = inverse @ self.stretch, inverse @ phi

        def depth(t: float, y: Array) -> float:
            return start + stroke * math.sin(omega * t) - float(phi @ y[:n])

        def flight(t: float, y: Array) -> Array:
            a = y[:n]
            out: Array = linear @ y
            out[n:] -= self.gamma * float(a @ (self.stretch @ a)) * (pull @ a)
            return out

        def contact(t: float, y: Array) -> Array:
            out = flight(t, y)
            out[n:] += push * (given.contact_stiffness * max(depth(t, y), 0.0) ** 1.5)
            return out

        def onset(t: float, y: Array) -> float:
            return depth(t, y)

        def release(t: float, y: Array) -> float:
            return depth(t, y)

        onset.terminal, onset.direction = True, 1.0  # type: ignore[attr-defined]
        release.terminal, release.direction = True, -1.0  # type: ignore[attr-defined]
        size = abs(self.rest[0])
        scale = np.concatenate((np.full(n, size), np.full(n, size * self.omega[0])))
        shortest = 2.0 * math.pi / float(self.omega[-1])
        mass = 1.0 / float(phi @ push)
        speed = given.level * self.omega[0]
        # Hertz: how long the shortest impacts that matter last
        lasts = 2.94 * (5.0 * mass / (4.0 * given.contact_stiffness)) ** 0.4 / speed**0.2
        # how finely the gap is looked at: a graze is short, and between two looks it is missed
        glance = min(0.2 * shortest, 2.0 * math.pi / float(self.omega[0]) / 300.0)
        t, y, touching = 0.0, np.concatenate((self.rest, np.zeros(n))), True
        found, parts = [], 0
        while t < times[-1]:
            parts += 1
            if parts > MOST_PARTS:
                raise Endless(f"{parts} flights and contacts by {t:.3e} s")
            part = solve_ivp(
                contact if touching else flight, (t, times[-1]), y, "DOP853", dense_output=True,
                rtol=2e-12, atol=1e-14 * scale, max_step=lasts / 20.0 if touching else glance,
                events=release if touching else onset,
            )  # fmt: skip
            assert part.success, part.message
            end = float(part.t[-1])
            inside = times[(times >= t) & ((times < end) | (end >= times[-1]))]
            if inside.size:
                found.append(part.sol(inside)[:n].T)
            t, y, touching = end, part.y[:, -1], not touching
        alpha = np.concatenate(found)
        return np.stack((alpha @ phi, alpha @ center), axis=1) / given.level


def drawn(rng: np.random.Generator, max_modes: int = 8) -> Numbers:
    """A beam from the size of a microswitch to that of a girder, and a way to strike it."""
    length = 10.0 ** rng.uniform(-3.5, 1.0)
    thickness = length * 10.0 ** rng.uniform(-3.0, -2.0)
    level_over_r = 10.0 ** rng.uniform(math.log10(1.1), math.log10(6.0))
    young = 10.0 ** rng.uniform(9.5, 11.4)
    # contact stiffness of a sphere of a hundredth to a half of the width, of the same material
    width = thickness * 10.0 ** rng.uniform(0.5, 1.7)
    radius = width * 10.0 ** rng.uniform(-2.0, -0.3)
    return Numbers(
        length=length,
        thickness=thickness,
        width=width,
        density=10.0 ** rng.uniform(3.0, 3.95),
        young=young,
        level=level_over_r * thickness / math.sqrt(12.0),
        modes=int(rng.integers(1, max_modes + 1)),
        damping_ratio=10.0 ** rng.uniform(-3.0, -1.5),
        contact_stiffness=4.0 / 3.0 * math.sqrt(radius) * young / (2.0 * (1.0 - 0.09)),
        location=rng.uniform(0.15, 0.85),
        frequency_ratio=rng.uniform(0.2, 4.0),
        velocity_amplitude=rng.uniform(0.02, 0.65),
    )
