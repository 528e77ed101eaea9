"""The paper's beam with an initial shape and a side load, written out again: nothing is taken from the package."""

from __future__ import annotations

import numpy as np
import scipy.linalg
from extended_oracle import Tip
from numpy.typing import NDArray
from oracle import DAMPING_RATIO, LENGTH, PaperBeam
from scipy.optimize import minimize

Array = NDArray[np.float64]


class UnevenBeam(PaperBeam):
    """Initial heights (m, at the centre) of the first mode, of the second at its top, and a force at a point."""

    def __init__(self, modes: int, rise: float = 0.0, skew: float = 0.0, force: float = 0.0, at: float = 0.5) -> None:
        super().__init__(modes)
        bending = 200e9 * 15e-3 * (0.4e-3) ** 3 / 12.0
        self.load = bending * self.k**2 - self.stiffness
        initial = np.zeros(modes)
        initial[0] = rise / self.shape(0.5 * LENGTH)[0]
        if skew:
            heights = np.array([self.shape(x)[1] for x in np.linspace(0.0, 0.5, 4001) * LENGTH])
            initial[1] = skew / heights[np.argmax(np.abs(heights))]
        self.initial, self.bending = initial, bending
        self.side = force * self.shape(at * LENGTH)
        self.first = self.rest
        self.rest = self.settled(self.rest)
        tangent = self.tangent(self.rest)
        squared, vectors = scipy.linalg.eigh(tangent, self.mass)
        self.omega = np.sqrt(squared)
        mv = self.mass @ vectors
        self.damping = self.inverse @ (mv @ np.diag(2.0 * DAMPING_RATIO * self.omega) @ mv.T)
        self.push = self.bending * self.k**2 * self.initial + self.side

    def energy(self, a: Array) -> float:
        """As it is written: bending from the initial shape, work of the load, stretching, work of the side load."""
        bent = 0.5 * np.sum(self.bending * self.k**2 * (a - self.initial) ** 2)
        s = a @ a - self.initial @ self.initial
        return float(bent - 0.5 * self.load[0] * s + 0.25 * self.gamma * s * s - self.side @ a)

    def gradient(self, a: Array) -> Array:
        s = a @ a - self.initial @ self.initial
        return self.bending * self.k**2 * (a - self.initial) - (self.load - self.gamma * s) * a - self.side

    def tangent(self, a: Array) -> Array:
        s = a @ a - self.initial @ self.initial
        own = np.diag(self.bending * self.k**2 - self.load + self.gamma * s)
        return np.asarray(own + 2.0 * self.gamma * np.outer(a, a))

    def settled(self, start: Array) -> Array:
        """The minimum below a start, by SciPy, polished by Newton's method."""
        size = float(np.abs(self.first).max())
        scale = size**2 * float(np.abs(self.tangent(self.first)).max())
        found = minimize(
            lambda y: self.energy(size * y) / scale,
            start / size,
            jac=lambda y: self.gradient(size * y) * size / scale,
            method="BFGS",
            options={"gtol": 1e-9},
        )
        a = size * found.x
        for _ in range(8):
            a = a - np.linalg.solve(self.tangent(a), self.gradient(a))
        return np.asarray(a)

    def pull(self, a: Array) -> Array:
        """What the generalised forces have beyond the perfect beam's: to add to its acceleration, times the mass."""
        return np.asarray(self.push + self.gamma * (self.initial @ self.initial) * a)


__all__ = ["Tip", "UnevenBeam"]
