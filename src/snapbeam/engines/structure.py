"""A structure as engines see it: modal numbers about a well, in no layout and without time."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from snapbeam.model.reduction import ReducedModel

__all__ = ["Structure", "structure_of"]

_Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Structure:
    """Linear modes about the well that a striker pushes away from, and the tension that couples them.

    Everything is seen from the striker's side: a structure that is struck from above is the mirror image of the one
    that is struck from below.  Arrays have shape (N,) unless said otherwise.
    """

    omega: _Array
    """Natural frequencies, rad/s."""
    damping_ratio: _Array
    coupling: _Array
    """G = V^T V, shape (N, N), exactly 0 between modes that the tension does not couple."""
    tension_stiffness: float
    """gamma, Eq. (15)."""
    well: _Array
    """g = V^T alpha_eq."""
    center: _Array
    """V^T phi(1/2)."""
    shift: _Array
    """From this well to the other one, as q."""
    stretch: float
    """Squared slopes in the well, alpha_eq . alpha_eq; 0 if there is one well only."""
    center_rest: float
    """Displacement of the centre in the well, m."""
    sign: float
    """+1 seen from below, -1 from above."""
    equilibrium: _Array
    """alpha in the well, as it is in space."""
    model: ReducedModel

    def row(self, shape: _Array) -> _Array:
        """V^T shape, seen from the striker's side."""
        row: _Array = self.sign * (self.model.linear_modes.T @ shape)
        return row

    def to_modal(self, alpha: _Array, velocity: _Array) -> tuple[_Array, _Array]:
        """Amplitudes of shape (..., N) and their velocities as q and p about the well."""
        back = self.model.linear_modes.T @ self.model.mass
        if alpha.ndim == 1:
            return back @ (alpha - self.equilibrium), back @ velocity
        return (alpha - self.equilibrium) @ back.T, velocity @ back.T

    def amplitudes(self, q: _Array) -> _Array:
        """alpha of q of shape (..., N) about the well."""
        alpha: _Array = self.equilibrium + q @ self.model.linear_modes.T
        return alpha

    def velocities(self, p: _Array) -> _Array:
        """Velocities of alpha, of p of shape (..., N)."""
        velocity: _Array = p @ self.model.linear_modes.T
        return velocity

    @cached_property
    def hash(self) -> str:
        """SHA-256 of its numbers, which linear algebra may round otherwise on another type of processor."""
        digest = hashlib.sha256()
        for part in (self.omega, self.damping_ratio, self.coupling, self.well, self.center, self.equilibrium):
            digest.update(np.ascontiguousarray(part).tobytes())
        digest.update(np.array([self.tension_stiffness, self.sign]).tobytes())
        return digest.hexdigest()


def structure_of(model: ReducedModel, side: str) -> Structure:
    """The structure of a reduced model, about the well that a striker from *side* pushes away from."""
    sign = 1.0 if side == "below" else -1.0
    equilibrium = sign * model.equilibrium
    modes = model.linear_modes
    return Structure(
        omega=model.omega,
        damping_ratio=model.damping_ratio,
        coupling=model.tension_matrix,
        tension_stiffness=float(model.tension_stiffness),
        well=modes.T @ equilibrium,
        center=sign * (modes.T @ model.center_shape),
        shift=-2.0 * (modes.T @ model.mass @ equilibrium),
        stretch=float(equilibrium @ equilibrium),
        center_rest=sign * float(model.center_shape @ equilibrium),
        sign=sign,
        equilibrium=equilibrium,
        model=model,
    )
