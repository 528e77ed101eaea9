"""The paper's beam between springs, from scratch: shapes as null vectors of end conditions, integrals by quadrature.

Nothing is taken from the package.  A shape is A cos kx + B sin kx + C x + D, which fulfils phi'''' + k^2 phi'' = 0; the
four conditions at the ends have a solution where their determinant vanishes.
"""

from __future__ import annotations

import math

import numpy as np
import scipy.linalg
from numpy.typing import NDArray
from oracle import DAMPING_RATIO, DENSITY, LENGTH, LEVEL, THICKNESS, WIDTH, YOUNG, PaperBeam
from scipy.optimize import brentq

Array = NDArray[np.float64]
BENDING = YOUNG * WIDTH * THICKNESS**3 / 12.0


class SprungBeam(PaperBeam):
    """Rotational stiffnesses (N m/rad; None clamps) and an axial stiffness of the supports (N/m)."""

    def __init__(self, modes: int, left: float | None, right: float | None, axial: float | None = None) -> None:
        self.left, self.right = left, right
        section = THICKNESS * WIDTH
        self.gamma = YOUNG * section / (2.0 * LENGTH)
        if axial is not None:
            self.gamma /= 1.0 + YOUNG * section / (axial * LENGTH)
        self.k = np.array(self._wavenumbers(modes))
        nodes, weights = np.polynomial.legendre.leggauss(400)
        x, weight = 0.5 * LENGTH * (1.0 + nodes), 0.5 * LENGTH * weights
        raw = [scipy.linalg.null_space(self._conditions(k), rcond=1e-9)[:, 0] for k in self.k]
        slopes = np.array([self._of(c, k, x, 1) for c, k in zip(raw, self.k, strict=True)])
        size = np.sqrt((slopes**2) @ weight)
        self.forms = [c / s for c, s in zip(raw, size, strict=True)]
        shapes = np.array([self._of(c, k, x, 0) for c, k in zip(self.forms, self.k, strict=True)])
        self.mass = DENSITY * section * (shapes * weight) @ shapes.T
        center = self.shape(0.5 * LENGTH)
        load = BENDING * self.k[0] ** 2 + self.gamma * (LEVEL / center[0]) ** 2
        self.stiffness = BENDING * self.k**2 - load
        self.rest = np.zeros(modes)
        self.rest[0] = -LEVEL / center[0]
        tangent = self.stiffness + self.gamma * self.rest[0] ** 2
        tangent[0] += 2.0 * self.gamma * self.rest[0] ** 2
        squared, vectors = scipy.linalg.eigh(np.diag(tangent), self.mass)
        self.omega = np.sqrt(squared)
        mv = self.mass @ vectors
        self.inverse = np.linalg.inv(self.mass)
        self.damping = self.inverse @ (mv @ np.diag(2.0 * DAMPING_RATIO * self.omega) @ mv.T)

    @staticmethod
    def _of(c: Array, k: float, x: Array, order: int) -> Array:
        """A shape or one of its derivatives; C and D as heights at the ends of the line, all of one size."""
        s, co = np.sin(k * x), np.cos(k * x)
        turn = (c[0] * co + c[1] * s, k * (c[1] * co - c[0] * s), -k * k * (c[0] * co + c[1] * s))[order]
        line = (c[2] * x / LENGTH + c[3], c[2] / LENGTH + 0.0 * x, 0.0 * x)[order]
        return np.asarray(turn + line)

    def _conditions(self, k: float) -> Array:
        """No displacement at the ends; E I phi'' = k_theta phi' at the left one, - at the right one, or no slope."""
        unit, rows = np.eye(4), []
        for x in (0.0, LENGTH):
            rows.append([float(self._of(c, k, np.array(x), 0)) for c in unit])
        for x, spring, sign in ((0.0, self.left, 1.0), (LENGTH, self.right, -1.0)):
            slope = np.array([float(self._of(c, k, np.array(x), 1)) for c in unit]) * LENGTH
            bent = np.array([float(self._of(c, k, np.array(x), 2)) for c in unit]) * LENGTH**2
            stiff = math.inf if spring is None else spring * LENGTH / BENDING
            row = slope if math.isinf(stiff) else (bent - sign * stiff * slope) / (1.0 + stiff)
            rows.append(row.tolist())
        return np.array(rows)

    def _wavenumbers(self, count: int) -> list[float]:
        """Roots of the determinant, which changes its sign at each; none below pi."""

        def determinant(z: float) -> float:
            return float(np.linalg.det(self._conditions(z / LENGTH)))

        grid = np.linspace(0.97 * math.pi, (count + 2.5) * math.pi, 160 * (count + 2))
        values = [determinant(z) for z in grid]
        found = []
        for low, high, first, second in zip(grid[:-1], grid[1:], values[:-1], values[1:], strict=True):
            if first * second < 0.0:
                found.append(brentq(determinant, low, high, xtol=1e-15, rtol=1e-15) / LENGTH)
        return found[:count]

    def shape(self, x: float) -> Array:
        """phi_i at x (m)."""
        return np.array([float(self._of(c, k, np.array(x), 0)) for c, k in zip(self.forms, self.k, strict=True)])
