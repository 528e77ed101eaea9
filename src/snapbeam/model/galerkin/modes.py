"""Buckling modes of a clamped-clamped beam in closed form (Eqs. 4-9)."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from snapbeam.core.validate import InputError, finite_array, integer, positive

__all__ = ["MAX_MODES", "BucklingModes", "wavenumbers"]

MAX_MODES = 256
"""Largest number of modes offered; the closed forms themselves know no limit."""

_Array = NDArray[np.float64]


def wavenumbers(count: int, length: float) -> _Array:
    """Wavenumbers k_i of the first *count* buckling modes, 1/m, ascending (Eq. 7).

    Odd i (symmetric): k_i L = (i + 1) pi.  Even i (antisymmetric): z = k_i L / 2 is the i/2-th positive
    root of tan z = z, found by Newton's method on z - m pi - arctan z, whose slope lies between 0.95
    and 1, so that it converges from z = (m + 1/2) pi for every m.

    Parameters
    ----------
    count : int
        Number of modes, 1 to 256.
    length : float
        Length L of the beam, m.

    Returns
    -------
    array of shape (count,)
    """
    count = integer("count", count, 1, MAX_MODES)
    length = positive("length", length, "m")
    index = np.arange(1, count + 1)
    z = 0.5 * (index + 1) * math.pi
    root = np.arange(1, count // 2 + 1)
    even = (root + 0.5) * math.pi
    for _ in range(6):
        even -= (even - root * math.pi - np.arctan(even)) * (1.0 + even**-2)
    z[1::2] = even
    return np.asarray(2.0 * z / length)


class _Evaluation(NamedTuple):
    """What shape, slope and curvature are put together from; the modes lie along the first axis."""

    xi: _Array
    k: _Array
    even: NDArray[np.bool_]
    sine: _Array
    cosine: _Array
    factor: _Array
    amplitude: _Array


class BucklingModes:
    """The first buckling modes phi_i of a clamped-clamped beam, normalised by Eq. (9).

    The slopes are orthonormal, integral of phi_i' phi_j' = delta_ij, which makes the integrals of
    phi_i''^2 equal to k_i^2 and gives every mode the amplitude sqrt(2) / (k_i sqrt(L)).  With the
    distance xi = x - L/2 from the centre,

        phi_i = sqrt(2)/(k_i sqrt(L)) [1 - (-1)^((i+1)/2) cos k_i xi]               i odd
        phi_i = sqrt(2)/(k_i sqrt(L)) [-2 xi/L + sin(k_i xi)/sin(k_i L/2)]          i even

    which are Eqs. (4)-(8) written about the centre, where the even modes are then exactly 0.

    Parameters
    ----------
    length : float
        Length L of the beam, m.
    count : int
        Number of modes N, 1 to 256.

    Attributes
    ----------
    wavenumber : array of shape (N,)
        k_i, 1/m.
    parity : array of int, shape (N,)
        +1 for the symmetric (odd) modes, -1 for the antisymmetric (even) ones.
    """

    def __init__(self, length: float, count: int) -> None:
        self.length = positive("length", length, "m")
        self.count = integer("count", count, 1, MAX_MODES)
        self.wavenumber = wavenumbers(self.count, self.length)
        index = np.arange(1, self.count + 1)
        self.parity = np.where(index % 2 == 1, 1, -1)
        self._amplitude = math.sqrt(2.0 / self.length) / self.wavenumber
        # factor of the trigonometric part: -(-1)^((i+1)/2) and 1/sin(k_i L/2)
        self._factor = np.where((index // 2) % 2 == 0, 1.0, -1.0)
        self._factor[1::2] = 1.0 / np.sin(0.5 * self.wavenumber[1::2] * self.length)

    @property
    def integral(self) -> _Array:
        """Integrals of phi_i over the length, m^1.5, shape (N,); exactly 0 for the antisymmetric modes."""
        return np.where(self.parity > 0, self._amplitude * self.length, 0.0)

    def shape(self, x: ArrayLike) -> _Array:
        """Mode shapes phi_i at the positions *x* (m, 0 to L); shape (N, *x.shape), in m^0.5."""
        at = self._at(x)
        rigid = np.where(at.even, -2.0 * at.xi / self.length, 1.0)
        return np.asarray(at.amplitude * (rigid + at.factor * np.where(at.even, at.sine, at.cosine)))

    def slope(self, x: ArrayLike) -> _Array:
        """Slopes phi_i' at the positions *x* (m, 0 to L); shape (N, *x.shape), in m^-0.5."""
        at = self._at(x)
        rigid = np.where(at.even, -2.0 / self.length, 0.0)
        waves = at.factor * at.k * np.where(at.even, at.cosine, -at.sine)
        return np.asarray(at.amplitude * (rigid + waves))

    def curvature(self, x: ArrayLike) -> _Array:
        """Curvatures phi_i'' at the positions *x* (m, 0 to L); shape (N, *x.shape), in m^-1.5."""
        at = self._at(x)
        return np.asarray(-at.amplitude * at.factor * at.k**2 * np.where(at.even, at.sine, at.cosine))

    def _at(self, x: ArrayLike) -> _Evaluation:
        position = finite_array("x", x)
        if position.size and (position.min() < 0.0 or position.max() > self.length):
            bad = position.min() if position.min() < 0.0 else position.max()
            raise InputError(f"x = {bad:g}: must lie in [0, {self.length:g}] m, on the beam")
        xi = position[np.newaxis] - 0.5 * self.length
        column = (-1, *(1,) * position.ndim)
        k = self.wavenumber.reshape(column)
        return _Evaluation(
            xi=xi,
            k=k,
            even=(self.parity < 0).reshape(column),
            sine=np.sin(k * xi),
            cosine=np.cos(k * xi),
            factor=self._factor.reshape(column),
            amplitude=self._amplitude.reshape(column),
        )
