"""Checks of a structure given by its matrices."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from snapbeam.core.validate import InputError, finite_array, nonnegative, positive, within
from snapbeam.model.imperfection.landscape import landscape_of

__all__ = ["Structure", "checked_structure", "damping_ratios"]

_Array = NDArray[np.float64]
_SYMMETRY = 1e-10  # largest asymmetry taken for rounding, relative to the largest entry
_BALANCE = 1e-8  # largest residual force at an equilibrium, relative to its two parts


@dataclass(frozen=True, kw_only=True)
class Structure:
    """What a user gives for a structure, as given; see ``ReducedModel.from_matrices``."""

    mass: ArrayLike
    stiffness: ArrayLike
    contact_shape: ArrayLike
    midspan_shape: ArrayLike | None
    nonlinear_stiffness: float
    equilibrium: ArrayLike | None
    length_scale: float
    damping_ratio: ArrayLike
    reference_frequency: float | None
    transverse_force: ArrayLike | None = None


def damping_ratios(value: ArrayLike, count: int) -> _Array:
    """One damping ratio a mode, each in [0, 1), from a number or *count* numbers."""
    array = finite_array("damping_ratio", value)
    if array.ndim == 0:
        within("damping_ratio", float(array), 0.0, 1.0, closed="left")
    else:
        _require_shape("damping_ratio", array, (count,), "a number or one for each mode")
        for i, ratio in enumerate(array):
            within(f"damping_ratio[{i}]", float(ratio), 0.0, 1.0, closed="left")
    return np.array(np.broadcast_to(array, (count,)))


def checked_structure(given: Structure) -> dict[str, Any]:
    """The fields of a reduced model for a structure, or an ``InputError`` that says what is wrong."""
    mass = finite_array("mass", given.mass)
    if mass.ndim != 2 or mass.shape[0] != mass.shape[1] or mass.size == 0:
        raise InputError(f"mass of shape {mass.shape}: must be a square matrix (N, N)")
    count = mass.shape[0]
    mass = _symmetric("mass", mass)
    try:
        np.linalg.cholesky(mass)
    except np.linalg.LinAlgError:
        lowest = np.linalg.eigvalsh(mass)[0]
        raise InputError(
            f"mass: must be positive definite, but its lowest eigenvalue is {lowest:g}"
        ) from None

    stiffness = finite_array("stiffness", given.stiffness)
    if stiffness.ndim == 2:
        _require_shape("stiffness", stiffness, (count, count), "as large as the mass matrix")
        stiffness = _symmetric("stiffness", stiffness)
    else:
        _require_shape("stiffness", stiffness, (count,), "a diagonal (N,) or a matrix (N, N)")

    contact_shape = _shape("contact_shape", given.contact_shape, count)
    midspan_shape = contact_shape.copy()
    if given.midspan_shape is not None:
        midspan_shape = _shape("midspan_shape", given.midspan_shape, count)
    gamma = nonnegative("nonlinear_stiffness", given.nonlinear_stiffness)
    reference = given.reference_frequency
    force = None
    if given.transverse_force is not None:
        force = finite_array("transverse_force", given.transverse_force)
        _require_shape("transverse_force", force, (count,), "one number for each coordinate")
        if not force.any():
            force = None
    if force is not None and given.equilibrium is not None:
        raise InputError(
            "equilibrium beside transverse_force: leave it out, the equilibria follow from the force"
        )
    if force is None:
        equilibrium = _equilibrium(given.equilibrium, stiffness, gamma, midspan_shape)
    else:
        equilibrium = landscape_of(stiffness, gamma, force, midspan_shape).lower.amplitude
    return {
        "mass": mass,
        "stiffness": stiffness,
        "nonlinear_stiffness": gamma,
        "equilibrium": equilibrium,
        "transverse_force": force,
        "length_scale": positive("length_scale", given.length_scale, "m"),
        "damping_ratio": damping_ratios(given.damping_ratio, count),
        "midspan_shape": midspan_shape,
        "contact_shape": contact_shape,
        "given_reference_frequency": None
        if reference is None
        else positive("reference_frequency", reference, "Hz"),
    }


def _equilibrium(value: ArrayLike | None, stiffness: _Array, gamma: float, midspan_shape: _Array) -> _Array:
    if value is None:
        return np.zeros(midspan_shape.size)
    a = finite_array("equilibrium", value)
    _require_shape("equilibrium", a, midspan_shape.shape, "one number for each coordinate")
    if not a.any():
        return a
    given = f"equilibrium = {a.tolist()}"
    if gamma == 0.0:
        raise InputError(f"{given}: must be zero unless nonlinear_stiffness is greater than 0")
    bent = stiffness * a if stiffness.ndim == 1 else stiffness @ a
    stretched = gamma * (a @ a) * a
    residual = float(np.abs(bent + stretched).max())
    if residual > _BALANCE * max(float(np.abs(bent).max()), float(np.abs(stretched).max())):
        raise InputError(f"{given}: must satisfy K0 a + gamma (a . a) a = 0, but leaves {residual:g}")
    lift = float(midspan_shape @ a)
    if lift >= 0.0:
        raise InputError(
            f"{given}: must be the lower well, but displaces the centre by {lift:g}, not downward"
        )
    return a


def _shape(name: str, value: ArrayLike, count: int) -> _Array:
    array = finite_array(name, value)
    _require_shape(name, array, (count,), "one number for each coordinate")
    if not array.any():
        raise InputError(f"{name} = {array.tolist()}: must not be all zeros")
    return array


def _require_shape(name: str, array: _Array, shape: tuple[int, ...], meaning: str) -> None:
    if array.shape != shape:
        raise InputError(f"{name} of shape {array.shape}: must have the shape {shape}, {meaning}")


def _symmetric(name: str, matrix: _Array) -> _Array:
    asymmetry = np.abs(matrix - matrix.T)
    if asymmetry.max() > _SYMMETRY * np.abs(matrix).max():
        i, j = (int(n) for n in np.unravel_index(np.argmax(asymmetry), matrix.shape))
        raise InputError(
            f"{name}[{i}, {j}] = {matrix[i, j]:g}, {name}[{j}, {i}] = {matrix[j, i]:g}: must be symmetric"
        )
    return 0.5 * (matrix + matrix.T)
