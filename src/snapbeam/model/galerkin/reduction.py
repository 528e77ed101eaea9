"""From a beam to numbers with names: mass, stiffness, wells, linear modes and damping; no time."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from snapbeam.core.validate import InputError, InputTypeError, finite_array, integer, positive, shown, within
from snapbeam.model.beam import Beam
from snapbeam.model.galerkin.linear import (
    LinearModes,
    linear_modes_about,
    linear_modes_of_beam,
    linear_modes_of_structure,
)
from snapbeam.model.galerkin.matrices import Structure, checked_structure, damping_ratios
from snapbeam.model.galerkin.modes import MAX_MODES, BucklingModes
from snapbeam.model.galerkin.wells import Wells
from snapbeam.model.imperfection.imperfection import Imperfection
from snapbeam.model.imperfection.landscape import landscape_of, tangent_stiffness
from snapbeam.model.quantity import ParameterField

__all__ = ["MODEL_QUANTITIES", "ReducedModel"]

_Array = NDArray[np.float64]

MODEL_QUANTITIES: dict[str, tuple[ParameterField, Any]] = {
    "modes": (
        ParameterField("1", "number of buckling modes", kind=int, low=1, high=MAX_MODES, symbol="N"),
        32,
    ),
    "damping_ratio": (
        ParameterField(
            "1", "damping ratio of every linear mode", low=0.0, high=1.0, closed="left", symbol=r"\zeta",
            plausible=(0.0, 1.0, "percent"),
        ),
        0.005,
    ),
    "reference_frequency": (
        ParameterField("Hz", "frequency that Omega and V are normalised by", low=0.0, optional=True, symbol="f_1"),
        None,
    ),
}  # fmt: skip
"""What a reduction takes beside the beam, and its default."""

_LEAST_COMPLIANCE = 1e-300
"""1/kg, below which the inverse is no number."""


@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class ReducedModel(Wells):
    """N modal amplitudes alpha with a mass, a stiffness and one tension term: the left side of Eq. (11),

        m alpha'' + K0 alpha + gamma (alpha . alpha) alpha = phi(x_s) f,

    whose potential energy is U = alpha . K0 alpha / 2 + gamma (alpha . alpha)^2 / 4, and less B . alpha, with B on
    the right, where a constant side force B makes the wells unequal.  Made by :meth:`from_beam` or
    :meth:`from_matrices`; arrays are read-only.

    Attributes
    ----------
    mass : array of shape (N, N)
        Mass matrix m; kg m for a beam, whose displacement w = alpha . phi (m) has alpha and phi in m^0.5.
    stiffness : array of shape (N,) or (N, N)
        Linear stiffness K0 of the straight structure, N for a beam: its diagonal, or the full matrix if one
        was given.
    nonlinear_stiffness : float
        gamma, N/m for a beam.
    well_amplitude : array of shape (N,)
        Amplitudes at rest in the lower well, (-sqrt((P - P_cr)/gamma), 0, ...); of a structure with one equilibrium
        that one, zeros if it is perfect.
    length_scale : float or None
        Length that normalises displacements, m: the buckling level b; of a beam that the load alone would not buckle
        the height of the centre in the well of least energy; None for a straight beam.
    damping_ratio : array of shape (N,)
        Damping ratio of each linear mode about a well, by ascending frequency.
    midspan_shape : array of shape (N,)
        phi_i at the centre, whose displacement tells the wells apart.
    contact_shape : array of shape (N,) or None
        phi_i at the shaker if it does not depend on the location (given by matrices).
    beam : Beam or None
        What the model was reduced from.
    given_reference_frequency : float or None
        Frequency to normalise with, Hz, if it is not the first natural frequency.
    transverse_force : array of shape (N,) or None
        B, of a structure whose wells are unequal.
    imperfection : Imperfection or None
        What B follows from.
    """

    mass: _Array
    stiffness: _Array
    nonlinear_stiffness: float
    well_amplitude: _Array
    length_scale: float | None
    damping_ratio: _Array
    midspan_shape: _Array
    contact_shape: _Array | None = None
    beam: Beam | None = None
    given_reference_frequency: float | None = None
    transverse_force: _Array | None = None
    imperfection: Imperfection | None = None

    def __post_init__(self) -> None:
        for value in vars(self).values():
            if isinstance(value, np.ndarray):
                value.setflags(write=False)

    def __repr__(self) -> str:
        wells = "two wells" if self.is_bistable else "one equilibrium"
        of = "given by matrices" if self.beam is None else f"of {self.beam!r}"
        return f"<ReducedModel: {self.modes} modes, {wells}, first at {self.natural_frequencies[0]:.4g} Hz, {of}>"

    @classmethod
    def from_beam(
        cls,
        beam: Beam,
        modes: int = 32,
        damping_ratio: ArrayLike = 0.005,
        reference_frequency: float | None = None,
        imperfection: Imperfection | None = None,
    ) -> ReducedModel:
        """Galerkin reduction of a beam on its first buckling modes (Eqs. 10-15).

        In the wavenumbers k_i the matrices are closed forms.  With c_ij = 2 for two symmetric modes,
        2/3 for two antisymmetric ones and 0 otherwise,

            m_ij = rho S (delta_ij + c_ij) / (k_i k_j),    K0_i = E I k_i^2 - P,    gamma = E S/(2 L).

        Parameters
        ----------
        beam : Beam
        modes : int
            Number of modes N, 1 to 256.
        damping_ratio : float or array of shape (N,)
            Damping ratio of the linear modes about a well, each in [0, 1).
        reference_frequency : float, optional
            Frequency that normalises the excitation, Hz; the first natural frequency by default, of unequal wells about
            the one of least energy.
        imperfection : Imperfection, optional
            What makes the wells unequal; one that is nothing is left out.  Damping is that of the linear modes about
            the well that the striker pushes away from, and the same matrix everywhere.

        Raises
        ------
        InputError
            For a number of modes or a damping ratio out of range.
        """
        if not isinstance(beam, Beam):
            raise InputTypeError(f"beam = {shown(beam)}: must be a Beam")
        count = integer("modes", modes, 1, MAX_MODES)
        shapes = beam.buckling_modes(count)
        k = shapes.wavenumber
        if isinstance(shapes, BucklingModes):
            mass = beam.mass_per_length * (np.eye(count) + _coupling(shapes.parity)) / np.outer(k, k)
        else:
            mass = beam.mass_per_length * shapes.overlap
        gamma = beam.nonlinear_stiffness
        equilibrium = np.zeros(count)
        # alpha_1 = -b/phi_1(1/2); K0 from E I (k_i^2 - k_1^2) - (P - P_cr), free of cancellation
        if isinstance(shapes, BucklingModes):
            equilibrium[0] = -math.pi * beam.buckling_level / math.sqrt(2.0 * beam.length)
        else:
            equilibrium[0] = -beam.buckling_level / float(shapes.shape(0.5 * beam.length)[0])
        if beam.is_buckled:
            stiffness = beam.bending_stiffness * (k**2 - k[0] ** 2) - gamma * equilibrium[0] ** 2
        else:
            stiffness = beam.bending_stiffness * k**2 - beam.axial_load
        length_scale, force = (beam.buckling_level if beam.is_buckled else None), None
        if imperfection is not None and not isinstance(imperfection, Imperfection):
            raise InputTypeError(f"imperfection = {shown(imperfection)}: must be an Imperfection")
        if imperfection is not None and imperfection.is_none:
            imperfection = None
        if imperfection is not None:
            initial = imperfection.initial_shape(shapes)
            force = beam.bending_stiffness * k**2 * initial + imperfection.transverse_load(shapes, beam)
            # an initial shape acts as a side force, and as a load of gamma s0 more
            stiffness = stiffness - gamma * float(initial @ initial)
            found = landscape_of(stiffness, gamma, force, shapes.shape(0.5 * beam.length))
            equilibrium = found.lower.amplitude
            if length_scale is None:
                height = abs(float(shapes.shape(0.5 * beam.length) @ found.deepest.amplitude))
                length_scale = height if height > 0.0 else None
        return cls(
            mass=mass,
            stiffness=stiffness,
            nonlinear_stiffness=gamma,
            well_amplitude=equilibrium,
            length_scale=length_scale,
            damping_ratio=damping_ratios(damping_ratio, count),
            midspan_shape=shapes.shape(0.5 * beam.length),
            beam=beam,
            given_reference_frequency=None
            if reference_frequency is None
            else positive("reference_frequency", reference_frequency, "Hz"),
            transverse_force=force,
            imperfection=imperfection,
        )

    @classmethod
    def from_matrices(
        cls,
        mass: ArrayLike,
        stiffness: ArrayLike,
        *,
        contact_shape: ArrayLike,
        midspan_shape: ArrayLike | None = None,
        nonlinear_stiffness: float = 0.0,
        equilibrium: ArrayLike | None = None,
        length_scale: float = 1.0,
        damping_ratio: ArrayLike = 0.0,
        reference_frequency: float | None = None,
        transverse_force: ArrayLike | None = None,
    ) -> ReducedModel:
        """A model of any structure, given by its matrices; a free mass (stiffness 0) is one.

        Parameters
        ----------
        mass : array of shape (N, N)
            Mass matrix, symmetric and positive definite.
        stiffness : array of shape (N,) or (N, N)
            Linear stiffness of the unstressed structure: a diagonal or a symmetric matrix.
        contact_shape : array of shape (N,)
            Displacement under the shaker per unit of each coordinate.
        midspan_shape : array of shape (N,), optional
            The same for the point whose sign tells the wells apart; the contact point if not given.
        nonlinear_stiffness : float
            gamma of the term gamma (alpha . alpha) alpha, at least 0.
        well_amplitude : array of shape (N,), optional
            Coordinates at rest in the lower well (where the displacement of the centre is not
            positive); zeros if not given.  It must be a stable equilibrium.
        length_scale : float
            Length that normalises displacements, m.
        damping_ratio : float or array of shape (N,)
            Damping ratio of each linear mode about the equilibrium, each in [0, 1).
        reference_frequency : float, optional
            Frequency that normalises the excitation, Hz; needed if the first natural frequency is 0.
        transverse_force : array of shape (N,), optional
            Constant force B that makes the wells unequal; the equilibria then follow from it and are not given.

        Raises
        ------
        InputError
            For matrices of the wrong shape, not symmetric or not positive definite, values that are not
            finite or out of range, or an equilibrium that is none or is unstable.
        """
        given = checked_structure(
            Structure(
                mass=mass,
                stiffness=stiffness,
                contact_shape=contact_shape,
                midspan_shape=midspan_shape,
                nonlinear_stiffness=nonlinear_stiffness,
                well_amplitude=equilibrium,
                length_scale=length_scale,
                damping_ratio=damping_ratio,
                reference_frequency=reference_frequency,
                transverse_force=transverse_force,
            )
        )
        model = cls(**given)
        model._linear_modes()  # refuses an unstable equilibrium here rather than at its first use
        return model

    # ------------------------------------------------------------------ shapes

    @property
    def modes(self) -> int:
        """Number of modes N."""
        return self.well_amplitude.size

    def shape_at(self, location: ArrayLike) -> _Array:
        """phi_i at a location x_s in [0, 1] of the length, or at each of several; shape (..., N), m^0.5.

        A model given by matrices has its one contact point and returns it whatever the location.
        """
        at: Any = location if isinstance(location, (int, float)) else finite_array("location", location)
        if np.ndim(at) == 0:
            at = within("location", at, 0.0, 1.0, closed="both")
        elif at.size and (at.min() < 0.0 or at.max() > 1.0):
            raise InputError(f"location from {at.min():g} to {at.max():g}: must lie in [0, 1]")
        if self.beam is None:
            assert self.contact_shape is not None
            one = self.contact_shape
            return np.broadcast_to(one, (*at.shape, self.modes)) if np.ndim(at) else one
        return np.moveaxis(self.beam.buckling_modes(self.modes).shape(at * self.beam.length), 0, -1)

    @cached_property
    def lightest_contact_mass(self) -> float:
        """Least :meth:`contact_mass` between 2 % and half of the span, kg, looked for at 25 places.

        The other half of a beam is the mirror image of the first.
        """
        last = 0.5 if self.beam is None or self.beam.boundary.is_symmetric else 0.98
        return min(self.contact_mass(location) for location in np.linspace(0.02, last, 25).tolist())

    def contact_mass(self, location: float) -> float:
        """Mass met by an impulse at *location*, kg: 1/(phi . m^-1 phi).

        It falls like rho S L / N as modes are added.
        """
        location = within("location", location, 0.0, 1.0)
        compliance = float(np.sum((self.linear_modes.T @ self.shape_at(location)) ** 2))
        if not compliance > _LEAST_COMPLIANCE:
            raise InputError(
                f"location = {shown(location)}: is so near a clamp that the beam does not move there"
            )
        return 1.0 / compliance

    # ------------------------------------------------------------------ linear modes about a well

    def _linear_modes(self) -> LinearModes:
        if self.transverse_force is not None or (
            self.beam is not None and self.beam.boundary.rotational_stiffness
        ):
            tangent = tangent_stiffness(self.stiffness, self.nonlinear_stiffness, self.well_amplitude)
            parity = None if self.beam is None else self.beam.buckling_modes(self.modes).parity
            return linear_modes_about(self.mass, tangent, parity)
        if self.beam is not None:
            return linear_modes_of_beam(self.beam, self.modes)
        return linear_modes_of_structure(
            self.mass, self.stiffness, self.nonlinear_stiffness, self.well_amplitude
        )

    @cached_property
    def _linear(self) -> LinearModes:
        return self._linear_modes()

    @property
    def omega(self) -> _Array:
        """Angular natural frequencies about a well, rad/s, ascending, shape (N,)."""
        return self._linear.omega

    @cached_property
    def natural_frequencies(self) -> _Array:
        """Natural frequencies about a well, Hz, ascending, shape (N,)."""
        freq: _Array = self.omega / (2.0 * math.pi)
        freq.setflags(write=False)
        return freq

    @property
    def linear_modes(self) -> _Array:
        """Linear modes about a well, the columns of V with V^T m V = Id, shape (N, N)."""
        return self._linear.vectors

    @property
    def parity(self) -> NDArray[np.int_]:
        """+1 for each symmetric linear mode, -1 for each antisymmetric one, 0 if not known; shape (N,)."""
        return self._linear.parity

    @cached_property
    def tension_matrix(self) -> _Array:
        """G = V^T V, through which the tension couples the linear modes; exactly 0 across parities."""
        return _symmetric(self.linear_modes.T @ self.linear_modes)

    @cached_property
    def damping_matrix(self) -> _Array:
        """C = m V diag(2 zeta omega) V^T m, the same about both wells, shape (N, N)."""
        mv = self.mass @ self.linear_modes
        return _symmetric((mv * (2.0 * self.damping_ratio * self.omega)) @ mv.T)

    @property
    def reference_frequency(self) -> float:
        """Frequency that normalises the excitation, Hz: the first natural one unless one was given.

        Refused (InputError) if that frequency is 0, of a free mass or a beam at its critical load, and none was given.
        """
        if self.given_reference_frequency is not None:
            return self.given_reference_frequency
        first = float(self._about_deepest.natural_frequencies[0])
        if first == 0.0:
            raise InputError(
                "reference_frequency is not given and the first natural frequency is 0: "
                "give reference_frequency in Hz, greater than 0"
            )
        return first


def _symmetric(matrix: _Array) -> _Array:
    """A matrix symmetric but for rounding, made exactly so and read-only."""
    symmetric: _Array = 0.5 * (matrix + matrix.T)
    symmetric.setflags(write=False)
    return symmetric


def _coupling(parity: NDArray[np.int_]) -> _Array:
    """c_ij of the mass matrix: 2 between symmetric modes, 2/3 between antisymmetric ones."""
    symmetric = (parity > 0).astype(np.float64)
    antisymmetric = 1.0 - symmetric
    coupling: _Array = 2.0 * np.outer(symmetric, symmetric) + 2.0 / 3.0 * np.outer(
        antisymmetric, antisymmetric
    )
    return coupling
