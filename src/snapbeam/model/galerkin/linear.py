"""Linear modes about a well."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from snapbeam.core.validate import InputError
from snapbeam.model.beam import Beam
from snapbeam.model.galerkin.modes import BucklingModes
from snapbeam.model.galerkin.rank_one import rank_one_eigenpairs

__all__ = ["LinearModes", "linear_modes_about", "linear_modes_of_beam", "linear_modes_of_structure"]

_Array = NDArray[np.float64]


class LinearModes(NamedTuple):
    """Angular frequencies (N,) ascending, mass-normalised columns (N, N), parities (N,); read-only."""

    omega: _Array
    vectors: _Array
    parity: NDArray[np.int_]


def linear_modes_of_beam(beam: Beam, count: int) -> LinearModes:
    """Linear modes of a beam reduced on its first *count* buckling modes.

    In the unknowns alpha_i/k_i each parity is a diagonal-plus-rank-one problem.  The tangent stiffness
    about a well of a buckled beam is the Jacobian of Eq. (11),

        K0_1 + 3 gamma a^2 = 2 (P - P_cr),    K0_i + gamma a^2 = E I (k_i^2 - k_1^2)  for i > 1.

    (Eq. (A.2) prints 2 gamma a^2 for i > 1, which is not that Jacobian and contradicts the frequencies
    that the paper gives.)
    """
    shapes = BucklingModes(beam.length, count)
    k = shapes.wavenumber
    if beam.is_buckled:
        tangent = beam.bending_stiffness * (k**2 - k[0] ** 2)
        # gamma a^2 = P - P_cr with a^2 = pi^2 b^2/(2 L)
        tangent[0] = beam.nonlinear_stiffness * (math.pi * beam.buckling_level) ** 2 / beam.length
    else:
        tangent = beam.bending_stiffness * k**2 - beam.axial_load
    diagonal = k**2 * tangent / beam.mass_per_length
    eigenvalue = np.empty(count)
    vectors = np.zeros((count, count))
    for parity, c in ((1, 2.0), (-1, 2.0 / 3.0)):
        index = np.flatnonzero(shapes.parity == parity)
        if index.size:
            eigenvalue[index], y = rank_one_eigenpairs(diagonal[index], c)
            vectors[np.ix_(index, index)] = k[index, np.newaxis] * y / math.sqrt(beam.mass_per_length)
    order = np.argsort(eigenvalue, kind="stable")
    return _read_only(np.sqrt(eigenvalue[order]), vectors[:, order], shapes.parity[order])


def linear_modes_of_structure(
    mass: _Array, stiffness: _Array, nonlinear_stiffness: float, equilibrium: _Array
) -> LinearModes:
    """Linear modes of the tangent K0 + gamma (|a|^2 Id + 2 a a^T) at the equilibrium a.

    An eigenvalue that rounding cannot tell from 0 is 0.

    Raises
    ------
    InputError
        If an eigenvalue is negative, so that the equilibrium is unstable.
    """
    import scipy.linalg

    a = equilibrium
    tangent = np.diag(stiffness) if stiffness.ndim == 1 else stiffness
    tangent = tangent + nonlinear_stiffness * (a @ a * np.eye(a.size) + 2.0 * np.outer(a, a))
    eigenvalue, vectors = scipy.linalg.eigh(tangent, mass)
    rounding = 8.0 * a.size * np.finfo(np.float64).eps * np.abs(eigenvalue).max()
    if eigenvalue[0] < -rounding:
        raise InputError(
            f"equilibrium = {a.tolist()}: must be stable, but the tangent stiffness has the negative "
            f"eigenvalue {eigenvalue[0]:g} 1/s^2 there"
        )
    eigenvalue[np.abs(eigenvalue) <= rounding] = 0.0
    return _read_only(np.sqrt(eigenvalue), vectors, np.zeros(a.size, dtype=np.int_))


def linear_modes_about(mass: _Array, tangent: _Array, parity: NDArray[np.int_] | None = None) -> LinearModes:
    """Linear modes of any tangent stiffness; each parity by itself where the tangent does not couple the two.

    Raises
    ------
    InputError
        If an eigenvalue is negative.
    """
    import scipy.linalg

    count = mass.shape[0]
    odd = np.zeros(count, dtype=bool) if parity is None else parity < 0
    apart = parity is not None and not tangent[np.ix_(odd, ~odd)].any()
    groups = [np.flatnonzero(~odd), np.flatnonzero(odd)] if apart else [np.arange(count)]
    eigenvalue, vectors = np.empty(count), np.zeros((count, count))
    for index in groups:
        if index.size:
            block = np.ix_(index, index)
            eigenvalue[index], vectors[block] = scipy.linalg.eigh(tangent[block], mass[block])
    rounding = 8.0 * count * np.finfo(np.float64).eps * np.abs(eigenvalue).max()
    if eigenvalue.min() < -rounding:
        raise InputError(f"equilibrium: must be stable, but has the eigenvalue {eigenvalue.min():g} 1/s^2")
    eigenvalue[np.abs(eigenvalue) <= rounding] = 0.0
    order = np.argsort(eigenvalue, kind="stable")
    own = parity[order] if parity is not None and apart else np.zeros(count, dtype=np.int_)
    return _read_only(np.sqrt(eigenvalue[order]), vectors[:, order], own)


def _read_only(omega: _Array, vectors: _Array, parity: NDArray[np.int_]) -> LinearModes:
    """The modes with the sign that makes the largest entry of each column positive."""
    largest = np.argmax(np.abs(vectors), axis=0)
    modes = LinearModes(omega, vectors * np.sign(vectors[largest, np.arange(omega.size)]), parity)
    for array in modes:
        array.setflags(write=False)
    return modes
