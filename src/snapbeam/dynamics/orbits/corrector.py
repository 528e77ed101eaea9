"""Orbits on planes across a branch: the prediction along its tangent is corrected there (Keller 1977)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from snapbeam.dynamics.orbits.orbit import OrbitNotFoundError, PeriodicOrbit
from snapbeam.dynamics.orbits.shooting import Family, Return, jacobian, newton

__all__ = ["Corrector", "Spot"]

_Array = NDArray[np.float64]
_ITERATIONS = 14
_DIFFERENCE = 2e-6
"""Of the difference by the parameter, over its range."""


class Spot(NamedTuple):
    """One orbit of a branch."""

    y: _Array
    """State, and the parameter over its range."""
    tangent: _Array
    came: Return
    slope: _Array
    """Derivative of the return map by the parameter over its range."""
    iterations: int


@dataclass(frozen=True, eq=False)
class Corrector:
    """Finds orbits on planes across a branch."""

    family: Family
    period: int
    span: float
    tolerance: float

    def bordered(self, came: Return, slope: _Array, row: _Array) -> _Array:
        """Derivative of the equations of an orbit and a plane."""
        size = slope.size
        table = np.empty((size + 1, size + 1))
        table[:size, :size] = came.jacobian - np.eye(size)
        table[:size, size] = slope
        table[size] = row
        return table

    def derivatives(self, y: _Array) -> tuple[Return, _Array]:
        """The return map and its derivatives at a state and a value."""
        value = float(y[-1]) * self.span
        came = jacobian(self.family, y[:-1], self.period, value)
        step = _DIFFERENCE * self.span
        return came, self.family.slope(y[:-1], self.period, value, step) * self.span

    def correct(
        self, guess: _Array, row: _Array, before: _Array, known: tuple[Return, _Array] | None = None
    ) -> Spot:
        """The orbit on the plane through *guess* across *row*; its tangent goes on as *before* does.

        Raises
        ------
        OrbitNotFoundError
        """

        def residual(y: _Array) -> _Array:
            value = float(y[-1]) * self.span
            there = self.family.march(y[None, :-1], self.period, value).states[0]
            return np.append(there - y[:-1], row @ (y - guess))

        def derivative(y: _Array) -> tuple[_Array, _Array]:
            came, slope = self.derivatives(y)
            return np.append(came.x - y[:-1], row @ (y - guess)), self.bordered(came, slope, row)

        first = None if known is None else self.bordered(*known, row)
        shot = newton(residual, derivative, guess, self.tolerance, _ITERATIONS, first)
        came, slope = self.derivatives(shot.x)
        if not np.isfinite(came.jacobian).all() or not np.isfinite(slope).all():
            raise OrbitNotFoundError("a run beside the orbit failed")
        return Spot(shot.x, self.tangent(came, slope, before), came, slope, shot.iterations)

    def tangent(self, came: Return, slope: _Array, before: _Array) -> _Array:
        """Of the branch, of length one, towards where *before* points."""
        wanted = np.zeros(slope.size + 1)
        wanted[-1] = 1.0
        try:
            found = np.linalg.solve(self.bordered(came, slope, before), wanted)
        except np.linalg.LinAlgError:
            return before
        return found / np.linalg.norm(found)

    def orbit(self, spot: Spot) -> PeriodicOrbit:
        """As an orbit of the flow at its value."""
        came, x = spot.came, spot.y[:-1]
        residual = float(np.abs(came.x - x).max())
        flow = self.family.at(float(spot.y[-1]) * self.span)
        return PeriodicOrbit(flow, x, self.period, came.jacobian, residual, spot.iterations)
