"""The wells of a reduced model: where they are, what is between them, and which of them counts."""

from __future__ import annotations

import dataclasses
from functools import cached_property
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from snapbeam.core.validate import InputError, finite_array
from snapbeam.model.beam import Beam
from snapbeam.model.imperfection.equilibria import Equilibrium
from snapbeam.model.imperfection.imperfection import Imperfection
from snapbeam.model.imperfection.landscape import Landscape, landscape_of
from snapbeam.model.imperfection.perfect import perfect_equilibria

__all__ = ["Wells"]

_Array = NDArray[np.float64]


class Wells:
    """What follows from the potential energy of a reduced model."""

    stiffness: _Array
    nonlinear_stiffness: float
    equilibrium: _Array
    midspan_shape: _Array
    transverse_force: _Array | None
    imperfection: Imperfection | None
    beam: Beam | None
    natural_frequencies: Any
    mass: _Array

    def potential_energy(self, alpha: ArrayLike) -> _Array:
        """Potential energy, J, of amplitudes of shape (..., N); 0 for the straight structure."""
        a = self._amplitudes("alpha", alpha)
        bent = a * self.stiffness if self.stiffness.ndim == 1 else a @ self.stiffness
        square = np.sum(a * a, axis=-1)
        energy: _Array = 0.5 * np.sum(a * bent, axis=-1) + 0.25 * self.nonlinear_stiffness * square**2
        return energy if self.transverse_force is None else energy - a @ self.transverse_force

    def kinetic_energy(self, alpha_velocity: ArrayLike) -> _Array:
        """Kinetic energy, J, of amplitude velocities of shape (..., N)."""
        v = self._amplitudes("alpha_velocity", alpha_velocity)
        energy: _Array = 0.5 * np.sum(v * (v @ self.mass), axis=-1)
        return energy

    def _amplitudes(self, name: str, value: ArrayLike) -> _Array:
        array = finite_array(name, value)
        if array.ndim == 0 or array.shape[-1] != self.equilibrium.size:
            raise InputError(
                f"{name} of shape {array.shape}: must have the shape (..., {self.equilibrium.size}), a number a mode"
            )
        return array

    @cached_property
    def landscape(self) -> Landscape | None:
        """The wells and the saddle of a structure with a side force; None without one."""
        if self.transverse_force is None:
            return None
        return landscape_of(
            self.stiffness, self.nonlinear_stiffness, self.transverse_force, self.midspan_shape
        )

    @cached_property
    def equilibria(self) -> tuple[Equilibrium, ...]:
        """Every shape in which the structure can rest, by energy, with its stability."""
        if self.landscape is not None:
            return self.landscape.equilibria
        return perfect_equilibria(self.stiffness, self.nonlinear_stiffness)

    @property
    def wells(self) -> _Array:
        """Amplitudes at the two wells, lower first, shape (2, N); twice the same if monostable."""
        if self.landscape is not None:
            return np.stack((self.equilibrium, self.landscape.upper.amplitude))
        return np.stack((self.equilibrium, -self.equilibrium))

    @cached_property
    def mirrored(self) -> Self:
        """The mirror image, upper and lower exchanged: the model itself if its wells are equal."""
        if self.landscape is None or self.transverse_force is None:
            return self
        return dataclasses.replace(  # type: ignore[type-var]
            self,
            transverse_force=-self.transverse_force,
            equilibrium=-self.landscape.upper.amplitude,
            imperfection=None if self.imperfection is None else self.imperfection.mirrored,
        )

    @property
    def _about_deepest(self) -> Self:
        """The model, or its mirror image, whose lower well is the one of least energy."""
        if self.landscape is None or not self.is_bistable:
            return self
        own, other = (each.energy for each in (self.landscape.lower, self.landscape.upper))
        if own == other:  # by symmetry, though not that of the model's mirror image
            return max(self, self.mirrored, key=lambda model: float(model.natural_frequencies[0]))
        return self if own < other else self.mirrored

    @property
    def well_frequencies(self) -> _Array:
        """Natural frequencies about the lower and about the upper well, Hz, ascending, shape (2, N)."""
        return np.stack((self.natural_frequencies, self.mirrored.natural_frequencies))

    @property
    def dividing_height(self) -> float:
        """Displacement of the centre that divides the wells, m: that of the lowest saddle; 0 between equal wells."""
        if self.landscape is None or self.landscape.saddle is None:
            return 0.0
        return float(self.midspan_shape @ self.landscape.saddle.amplitude)

    @property
    def is_bistable(self) -> bool:
        """Whether the structure has two wells."""
        if self.landscape is not None:
            return self.landscape.is_bistable
        return bool(np.any(self.equilibrium != 0.0))

    def require_bistable(self, what: str) -> None:
        """Refuse a structure with a single equilibrium, naming *what* needs two wells."""
        if self.is_bistable:
            return
        if self.beam is None:
            raise InputError(f"{what} needs a bistable structure: give an equilibrium other than zero")
        if self.imperfection is not None:
            raise InputError(
                f"{what} needs two wells: this imperfection leaves one; a smaller one leaves two, "
                "and so does a greater axial_load"
            )
        raise InputError(
            f"{what} needs a buckled beam: axial_load = {self.beam.axial_load:g} N must exceed the critical "
            f"load of {self.beam.critical_load:g} N"
        )

    @property
    def well_energy(self) -> float:
        """Potential energy of either well, J: -(P - P_cr)^2/(4 gamma) for a buckled beam, 0 if straight.

        Of unequal wells that of the lower one.
        """
        return float(self.potential_energy(self.equilibrium))

    @cached_property
    def saddle_energy(self) -> float:
        """Energy of the lowest saddle between the wells, J.

        Every equilibrium lies along an eigenvector of K0 with an eigenvalue kappa < 0, at the energy
        -kappa^2/(4 gamma), or at 0.  The wells belong to the lowest eigenvalue and the lowest saddle
        to the second, E I k_2^2 - P, if it is negative; otherwise it is the straight state, at 0.
        Refused (InputError) if the structure has no second well.
        """
        self.require_bistable("saddle_energy")
        if self.landscape is not None and self.landscape.saddle is not None:
            return self.landscape.saddle.energy
        kappa = np.sort(self.stiffness if self.stiffness.ndim == 1 else np.linalg.eigvalsh(self.stiffness))
        second = min(float(kappa[1]), 0.0) if kappa.size > 1 else 0.0
        return -(second**2) / (4.0 * self.nonlinear_stiffness) + 0.0
