"""Buckling modes of a beam whose ends turn on rotational springs."""

from __future__ import annotations

import math
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from snapbeam.core.validate import InputError, finite_array
from snapbeam.model.galerkin.modes import wavenumbers

__all__ = ["SpringModes", "spring_wavenumbers"]

_Array = NDArray[np.float64]
_HALVINGS = 200
_NODES = 16
"""Of Gauss and Legendre in each panel, of which a half wave of the last mode has two."""


def _mixed(stiffness: float) -> tuple[float, float]:
    """Weights of phi'' and of phi' in the condition at an end, from its stiffness over E I/L."""
    return (0.0, 1.0) if math.isinf(stiffness) else (1.0 / (1.0 + stiffness), stiffness / (1.0 + stiffness))


def _conditions(z: float, left: float, right: float) -> _Array:
    """What phi = a (cos z x - 1) + b sin z x + c x, x from 0 to 1, must fulfil: phi(1) = 0, and both end moments."""
    (bent0, turned0), (bent1, turned1) = _mixed(left), _mixed(right)
    cosine, sine = math.cos(z), math.sin(z)
    return np.array(
        [
            [cosine - 1.0, sine, 1.0],
            [bent0 * z * z, turned0 * z, turned0],
            [
                -bent1 * z * z * cosine - turned1 * z * sine,
                -bent1 * z * z * sine + turned1 * z * cosine,
                turned1,
            ],
        ]
    )


def _balance(z: float, left: float, right: float) -> float:
    m = _conditions(z, left, right)
    return float(
        m[0, 0] * (m[1, 1] * m[2, 2] - m[1, 2] * m[2, 1])
        - m[0, 1] * (m[1, 0] * m[2, 2] - m[1, 2] * m[2, 0])
        + m[0, 2] * (m[1, 0] * m[2, 1] - m[1, 1] * m[2, 0])
    )


def spring_wavenumbers(count: int, left: float, right: float) -> _Array:
    """k_i L of the first *count* buckling modes, ascending.

    *left* and *right* are the stiffnesses over E I/L.  A stiffer end raises every one of them, from i pi of pinned ends
    to that of clamped ones, which is at most (i + 1) pi: one root lies in each of these intervals.
    """
    clamped = wavenumbers(count, 1.0)
    sign = math.copysign(1.0, _balance(0.5, left, right))
    found = np.empty(count)
    for i in range(count):
        low, high = (i + 1) * math.pi, float(clamped[i])
        for _ in range(_HALVINGS):
            middle = 0.5 * (low + high)
            if middle in (low, high):
                break
            if sign * _balance(middle, left, right) > 0.0:
                low = middle
            else:
                high = middle
        found[i] = 0.5 * (low + high)
        sign = -sign
    return found


class SpringModes:
    """Buckling modes between springs, as :class:`~snapbeam.model.galerkin.modes.BucklingModes` are between clamps.

    Slopes are orthonormal, and the curvatures with the springs' energy have the integrals k_i^2.  Every mode rises from
    the left end.  Between equal springs the modes are written about the centre, so that the antisymmetric ones are
    exactly 0 there.

    Parameters
    ----------
    length : float
        L, m.
    count : int
    left, right : float
        Rotational stiffnesses over E I/L; infinite for a clamp.
    """

    def __init__(self, length: float, count: int, left: float, right: float) -> None:
        self.length, self.count = length, count
        self.wavenumber = spring_wavenumbers(count, left, right) / length
        alike = left == right
        index = np.arange(1, count + 1)
        self.parity = np.where(index % 2 == 1, 1, -1) if alike else np.zeros(count, dtype=np.int_)
        z = self.wavenumber * length
        if alike:
            # cos z (x - 1/2) - cos(z/2), and sin z (x - 1/2) - (2 x - 1) sin(z/2)
            symmetric = self.parity > 0
            rigid = np.where(symmetric, -np.cos(0.5 * z), 0.0)
            tilt = np.where(symmetric, 0.0, -2.0 * np.sin(0.5 * z))
            cosine, sine = np.where(symmetric, 1.0, 0.0), np.where(symmetric, 0.0, 1.0)
            self._center = 0.5
        else:
            vectors = np.array([_null(_conditions(each, left, right)) for each in z])
            cosine, sine, tilt = vectors.T
            rigid = -cosine
            self._center = 0.0
        self._parts = np.stack((rigid, tilt, cosine, sine))
        nodes, weights = self._panels
        norm = np.sqrt(np.sum(weights * self._at(nodes, 1) ** 2, axis=1))
        rises = np.sign(self._at(0.05 * length / index, 0).diagonal())
        self._parts = self._parts * (rises / norm)

    @cached_property
    def _panels(self) -> tuple[_Array, _Array]:
        nodes, weights = np.polynomial.legendre.leggauss(_NODES)
        edges = np.linspace(0.0, self.length, 2 * (self.count + 1) + 1)
        half = 0.5 * np.diff(edges)
        x = np.clip(edges[:-1, None] + half[:, None] * (1.0 + nodes), 0.0, self.length).ravel()
        return x, (half[:, None] * weights).ravel()

    @cached_property
    def overlap(self) -> _Array:
        """Integrals of phi_i phi_j, m^2, shape (N, N); exactly 0 across parities."""
        x, weights = self._panels
        shapes = self._at(x, 0)
        found: _Array = (shapes * weights) @ shapes.T
        return np.where(np.multiply.outer(self.parity, self.parity) < 0, 0.0, 0.5 * (found + found.T))

    @property
    def integral(self) -> _Array:
        """Integrals of phi_i over the length, m^1.5, shape (N,); exactly 0 for antisymmetric modes."""
        x, weights = self._panels
        return np.where(self.parity < 0, 0.0, self._at(x, 0) @ weights)

    def shape(self, x: ArrayLike) -> _Array:
        """Mode shapes phi_i at the positions *x* (m, 0 to L); shape (N, *x.shape), in m^0.5."""
        return self._at(self._checked(x), 0)

    def slope(self, x: ArrayLike) -> _Array:
        """Slopes phi_i' likewise, in m^-0.5."""
        return self._at(self._checked(x), 1)

    def curvature(self, x: ArrayLike) -> _Array:
        """Curvatures phi_i'' likewise, in m^-1.5."""
        return self._at(self._checked(x), 2)

    def _checked(self, x: ArrayLike) -> _Array:
        position = finite_array("x", x)
        if position.size and (position.min() < 0.0 or position.max() > self.length):
            bad = position.min() if position.min() < 0.0 else position.max()
            raise InputError(f"x = {bad:g}: must lie in [0, {self.length:g}] m, on the beam")
        return position

    def _at(self, x: ArrayLike, derivative: int) -> _Array:
        position = np.asarray(x, dtype=np.float64)
        column = (-1, *(1,) * position.ndim)
        rigid, tilt, cosine, sine = (part.reshape(column) for part in self._parts)
        k = self.wavenumber.reshape(column)
        away = position[np.newaxis] - self._center * self.length
        c, s = np.cos(k * away), np.sin(k * away)
        if derivative == 0:
            return np.asarray(rigid + tilt * away / self.length + cosine * c + sine * s)
        if derivative == 1:
            return np.asarray(tilt / self.length + k * (sine * c - cosine * s))
        return np.asarray(-(k**2) * (cosine * c + sine * s))


def _null(matrix: _Array) -> _Array:
    scaled = matrix / np.abs(matrix).max(axis=1, keepdims=True)
    vector: _Array = np.linalg.svd(scaled)[2][-1]
    return vector
