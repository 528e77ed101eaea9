"""When a state is certainly on its way to an attractor: norms in which orbits contract, and clouds of chaotic ones."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solve_discrete_lyapunov
from scipy.spatial import cKDTree

from snapbeam.dynamics.orbits.orbit import PeriodicOrbit

__all__ = ["Ball", "Cloud", "balls_of", "cloud_of"]

_Array = NDArray[np.float64]
_TRIED = 48
"""States on each shell that are tried."""
_SHELLS = 9
_LARGEST = 0.5
"""Radius of the largest shell, in units of the well's amplitude along the longest axis."""
_SHARE = 0.5
"""Of the radius that was tried, within which a state counts as captured."""
_SEED = 20240817


@dataclass(frozen=True, eq=False)
class Ball:
    """States about one point of a stable orbit that the flow brings nearer with every return.

    Nearness is |e|_Q^2 = e.Q e with Q - M^T Q M = 1 for the derivative M of the return map: in it the linear part
    contracts.  The radius is the largest at which, and at all smaller ones of a row of shells, every one of 48 states
    came back nearer: tried, not proved; half of it is used.
    """

    center: _Array
    factor: _Array
    """L of Q = L L^T, shape (d, d)."""
    radius: float

    def holds(self, rows: _Array) -> NDArray[np.bool_]:
        """Which states of shape (runs, d) are within, each by itself."""
        away = rows - self.center
        total = np.zeros(len(rows))
        for column in self.factor.T:
            part = (away * column).sum(axis=1)
            total += part * part
        found: NDArray[np.bool_] = total <= (_SHARE * self.radius) ** 2
        return found


def balls_of(orbit: PeriodicOrbit) -> list[Ball]:
    """A ball about every point of a stable orbit, in the order of its points; radius 0 where none was found."""
    points, found = orbit.points, []
    size = orbit.coordinates.size
    generator = np.random.Generator(np.random.Philox(_SEED))
    directions = generator.standard_normal((_TRIED, size))
    directions /= np.sqrt((directions**2).sum(axis=1))[:, None]
    ball = _ball(orbit, orbit.coordinates, orbit.jacobian, directions)
    found.append(ball)
    if orbit.period > 1:
        from snapbeam.dynamics.orbits.shooting import Family, jacobian

        for point in points[1:]:
            came = jacobian(Family(orbit.flow), point, orbit.period)
            found.append(_ball(orbit, point, came.jacobian, directions))
    return found


def _ball(orbit: PeriodicOrbit, point: _Array, slope: _Array, directions: _Array) -> Ball:
    metric = solve_discrete_lyapunov(slope.T, np.eye(point.size))
    metric = 0.5 * (metric + metric.T)
    factor = np.linalg.cholesky(metric)
    # on a shell of |e|_Q = r: e = r L^-T u for unit vectors u
    shell = np.linalg.solve(factor.T, directions.T).T
    longest = float(np.sqrt((shell**2).sum(axis=1)).max())
    ball = Ball(point, factor, 0.0)
    radius = 0.0
    for level in range(_SHELLS, -1, -1):
        size = _LARGEST / longest * 0.5**level
        came = orbit.flow.march(point + size * shell, orbit.period).states
        away = (came - point) @ factor
        if not (np.sqrt((away**2).sum(axis=1)) < size).all():
            break
        radius = size
    return Ball(ball.center, ball.factor, radius)


@dataclass(frozen=True, eq=False)
class Cloud:
    """Points of a chaotic attractor, and how far from them its own points lie."""

    points: _Array
    tree: cKDTree
    reach: float

    def holds(self, rows: _Array) -> NDArray[np.bool_]:
        """Which states lie among the points."""
        known = np.asarray(np.isfinite(rows).all(axis=1))
        away, _ = self.tree.query(np.where(known[:, None], rows, 0.0))
        found: NDArray[np.bool_] = known & (away <= self.reach)
        return found


def cloud_of(points: _Array) -> Cloud:
    """A cloud from points of shape (points, d): half of them say how far the other half is."""
    first, second = points[::2], points[1::2]
    away, _ = cKDTree(first).query(second)
    return Cloud(points, cKDTree(points), 1.5 * float(np.quantile(away, 0.99)))
