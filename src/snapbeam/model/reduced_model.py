"""Galerkin reduction of a beam: mass, stiffness and tension matrices, wells, linear modes, damping."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from snapbeam.model.beam import Beam
from snapbeam.model.boundary_conditions import Modes
from snapbeam.model.buckling_modes import MAX_MODES, BucklingModes, StructureMatrices, checked_structure, damping_ratios
from snapbeam.model.equilibria import Equilibrium, Landscape, condensed, landscape_of, tangent_stiffness
from snapbeam.model.imperfection import Imperfection, perfect_equilibria
from snapbeam.model.matrix_pairs import eigenpairs
from snapbeam.model.quantity import ParameterField, quantities
from snapbeam.util.validation import (
    InputError,
    InputTypeError,
    finite_array,
    instance,
    integer,
    positive,
    shown,
    within,
)

# ----------------------------------------------------------------------------------------------------
# Eigenvalues of the diagonal-plus-rank-one problems into which a buckled beam splits.


_HALVINGS = 2200
"""Number of halvings after which no number lies between the ends of any interval."""


def rank_one_eigenpairs(diagonal: _Array, c: float) -> tuple[_Array, _Array]:
    """Solve diag(d) y = lam (Id + c 1 1^T) y, d_i >= 0, c > 0, to high relative accuracy; Y^T (Id + c 1 1^T) Y = Id.

    The eigenvalues, returned ascending, are the roots of 1 - c' sum d_i/(d_i - lam) with c' = c/(1 + c n).  The sum
    falls from +inf to -inf between neighbouring d_i, and from a positive value at lam = 0 to -inf at the smallest d_i,
    so each interval holds exactly one root.  Bisection for its distance from the nearer pole keeps the differences d_i
    - lam, and with them the eigenvectors y_i = 1/(d_i - lam), accurate whatever the spread of the d_i, which grows like
    n^4 here (cf. Golub, SIAM Rev. 15, 1973).
    """
    n = diagonal.size
    if not (np.isfinite(diagonal).all() and math.isfinite(c)):
        raise InputError("model: its frequencies are beyond what a number holds; are the units of the beam right?")
    order = np.argsort(diagonal, kind="stable")
    d = diagonal[order]
    weight = c / (1.0 + c * n)

    def secular(gap: _Array) -> _Array:
        """1 - c' sum d_i/gap, for gap[i, j] = d_i - lam_j; a vanishing d_i drops out."""
        safe = np.where(gap == 0.0, 1.0, gap)
        terms = np.where(gap == 0.0, 0.0, d[:, np.newaxis] / safe)
        return np.asarray(1.0 - weight * np.sum(terms, axis=0))

    left = np.concatenate(([0.0], d[:-1]))
    width = d - left
    middle = left + 0.5 * width
    near_left = secular(d[:, np.newaxis] - middle) < 0.0
    origin = np.where(near_left, left, d)
    from_origin = d[:, np.newaxis] - origin
    low = np.where(near_left, 0.0, -0.5 * width)
    high = np.where(near_left, 0.5 * width, 0.0)
    for _ in range(_HALVINGS):
        shift = 0.5 * (low + high)
        if ((shift == low) | (shift == high)).all():
            break
        above = secular(from_origin - shift) > 0.0
        low = np.where(above, shift, low)
        high = np.where(above, high, shift)

    gap = from_origin - shift
    with np.errstate(divide="ignore"):
        y = 1.0 / gap
    for j in np.flatnonzero(width == 0.0):  # d_j = 0, or two equal d: the pole is the eigenvalue
        y[:, j] = 0.0
        y[j, j] = 1.0
        if j > 0:
            y[j - 1, j] = -1.0
    y /= np.sqrt(np.sum(y**2, axis=0) + c * np.sum(y, axis=0) ** 2)
    vectors = np.empty_like(y)
    vectors[order] = y
    return origin + shift, vectors


# ----------------------------------------------------------------------------------------------------
# Linear modes about a well.


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


def linear_modes_about(
    alpha: _Array, mass: _Array, tangent: _Array, magnitude: _Array, parity: NDArray[np.int_] | None = None
) -> LinearModes:
    """Linear modes about the equilibrium alpha of a tangent stiffness; each parity by itself where the tangent does not couple the two.

    *magnitude* is the sum of the moduli of its terms, from which rounding follows.  Rigid modes have the frequency 0.
    """
    count = mass.shape[0]
    odd = np.zeros(count, dtype=bool) if parity is None else parity < 0
    apart = parity is not None and not tangent[np.ix_(odd, ~odd)].any()
    groups = [np.flatnonzero(~odd), np.flatnonzero(odd)] if apart else [np.arange(count)]
    eigenvalue, vectors = np.empty(count), np.zeros((count, count))
    for index in groups:
        if index.size:
            block = np.ix_(index, index)
            eigenvalue[index], vectors[block] = eigenpairs(tangent[block], mass[block], magnitude[block])
    if eigenvalue.min() < 0.0:
        raise InputError(
            f"well_amplitude = {shown(alpha.tolist())}: must be stable, but the tangent stiffness has the negative "
            f"eigenvalue {eigenvalue.min():g} 1/s^2 there"
        )
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


class ModalDamping(NamedTuple):
    """Damping of the linear modes, 2 zeta omega on the diagonal and sum_k c_k u_k u_k^T; read-only."""

    ratio: _Array
    """zeta, each in [0, 1), shape (N,)."""
    rows: _Array
    """u_k, shape (K, N)."""
    coefficients: _Array
    """c_k of either sign, 1/s, shape (K,)."""


# ----------------------------------------------------------------------------------------------------
# The wells of a reduced model: where they are, what is between them, and which of them counts.


class Wells:
    """Potential energy of a reduced model: wells, stiffness, frequencies."""

    stiffness: _Array
    nonlinear_stiffness: float
    well_amplitude: _Array
    midspan_shape: _Array
    transverse_force: _Array | None
    imperfection: Imperfection | None
    beam: Beam | None
    given_reference_frequency: float | None
    natural_frequencies: Any
    mass: _Array
    elongation_matrix: _Array | None

    def potential_energy(self, alpha: ArrayLike) -> _Array:
        """Potential energy, J, of amplitudes of shape (..., N); 0 for the straight structure."""
        a = self._amplitudes("alpha", alpha)
        bent = a * self.stiffness if self.stiffness.ndim == 1 else a @ self.stiffness
        square = np.sum(a * (a if self.elongation_matrix is None else a @ self.elongation_matrix), axis=-1)
        energy: _Array = 0.5 * np.sum(a * bent, axis=-1) + 0.25 * self.nonlinear_stiffness * square**2
        return energy if self.transverse_force is None else energy - a @ self.transverse_force

    def kinetic_energy(self, alpha_velocity: ArrayLike) -> _Array:
        """Kinetic energy, J, of amplitude velocities of shape (..., N)."""
        v = self._amplitudes("alpha_velocity", alpha_velocity)
        energy: _Array = 0.5 * np.sum(v * (v @ self.mass), axis=-1)
        return energy

    def _amplitudes(self, name: str, value: ArrayLike, ndim: int | None = None) -> _Array:
        array = finite_array(name, value, ndim)
        if array.ndim == 0 or array.shape[-1] != self.well_amplitude.size:
            raise InputError(
                f"{name} of shape {array.shape}: must have the shape (..., {self.well_amplitude.size}), a number a mode"
            )
        return array

    @cached_property
    def landscape(self) -> Landscape | None:
        """The wells and the saddle of a structure with a transverse force; None without one."""
        if self.transverse_force is None:
            return None
        return landscape_of(
            self.stiffness, self.nonlinear_stiffness, self.transverse_force, self.midspan_shape, self.elongation_matrix
        )

    @cached_property
    def equilibria(self) -> tuple[Equilibrium, ...]:
        """Every shape in which the structure can rest, by energy, with its stability."""
        if self.landscape is not None:
            return self.landscape.equilibria
        if self.elongation_matrix is None:
            return perfect_equilibria(self.stiffness, self.nonlinear_stiffness)
        own = condensed(self.stiffness, np.zeros(self.well_amplitude.size), self.elongation_matrix)
        return tuple(
            dataclasses.replace(
                each, amplitude=own.back @ each.amplitude, unstable_directions=each.unstable_directions + own.unstable
            )
            for each in perfect_equilibria(own.stiffness, self.nonlinear_stiffness)
        )

    @property
    def wells(self) -> _Array:
        """Amplitudes at the two wells, lower first, shape (2, N); twice the same if monostable."""
        if self.landscape is not None:
            return np.stack((self.well_amplitude, self.landscape.upper.amplitude))
        return np.stack((self.well_amplitude, -self.well_amplitude))

    @cached_property
    def mirrored(self) -> Self:
        """The mirror image, upper and lower exchanged: the model itself if its wells are equal."""
        if self.landscape is None or self.transverse_force is None:
            return self
        return dataclasses.replace(  # type: ignore[type-var]
            self,
            transverse_force=-self.transverse_force,
            well_amplitude=-self.landscape.upper.amplitude,
            imperfection=None if self.imperfection is None else self.imperfection.mirrored,
        )

    @property
    def about_reference_well(self) -> Self:
        """The model or its mirror image with the minimum of energy in the lower well, for the normalisation."""
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
        """True if the structure has two wells."""
        if self.landscape is not None:
            return self.landscape.is_bistable
        return bool(np.any(self.well_amplitude != 0.0))

    def require_bistable(self, what: str) -> None:
        """Refuse a structure with a single equilibrium, naming *what* needs two wells."""
        if self.is_bistable:
            return
        if self.beam is None:
            raise InputError(f"{what} needs a bistable structure: give a well_amplitude other than zero")
        if self.imperfection is not None:
            raise InputError(f"{what} needs two wells: this imperfection leaves one; {self.two_well_limits}")
        raise InputError(
            f"{what} needs a buckled beam: axial_load = {self.beam.axial_load:g} N must exceed the critical "
            f"load of {self.beam.critical_load:g} N"
        )

    @property
    def as_fabricated_well(self) -> str | None:
        """The well on the side of the initial shape, "lower" or "upper"; None without an initial shape at the centre."""
        if self.beam is None or self.imperfection is None:
            return None
        initial = self.imperfection.initial_shape(self.beam.buckling_modes(self.well_amplitude.size))
        height = float(self.midspan_shape @ initial)
        return None if height == 0.0 else "upper" if height > 0.0 else "lower"

    @property
    def reference_well(self) -> str:
        """The well whose first natural frequency normalises: "lower", "upper", "either" of equal ones, or "only".

        "given" if a reference frequency was given.
        """
        if self.given_reference_frequency is not None:
            return "given"
        if not self.is_bistable:
            return "only"
        if self.landscape is None:
            return "either"
        return "lower" if self.about_reference_well is self else "upper"

    def side_of(self, amplitude: ArrayLike) -> str:
        """The well on whose side of :attr:`dividing_height` the centre is, "lower" or "upper"; "only" of one well."""
        if not self.is_bistable:
            return "only"
        height = float(self.midspan_shape @ self._amplitudes("amplitude", amplitude, 1))
        return "upper" if height > self.dividing_height else "lower"

    @cached_property
    def two_well_limits(self) -> str:
        """Words for the nearest imperfection and the minimum axial load with two wells, of a beam with one; computed.

        Raises
        ------
        InputError
            If the model has two wells already, or no imperfection that takes one away.
        """
        if self.beam is None or self.imperfection is None or self.is_bistable:
            why = "has two wells" if self.is_bistable else "has no imperfection"
            raise InputError(f"two_well_limits: must be of a beam with one well by its imperfection; this model {why}")
        beam, given = self.beam, self.imperfection

        def scaled(factor: float) -> bool:
            return self._is_bistable_with(beam, given.scaled(factor))

        def loaded(load: float) -> bool:
            return self._is_bistable_with(beam.replace(axial_load=load), given)

        steps = np.geomspace(1.0, _FURTHEST_IMPERFECTION, _HINT_STEPS).tolist()
        found = []
        for more in (True, False):
            at = [step if more else 1.0 / step for step in steps]
            first = next((i for i in range(1, len(at)) if scaled(at[i])), None)
            if first is not None:
                found.append((first, more, _first_true(scaled, at[first - 1], at[first])))
        hints = []
        for _, more, factor in sorted(found)[:1]:
            bound = "at least" if more else "at most"
            sizes = [
                f"{'-' if value < 0.0 else ''}{name} of {bound} {_rounded(abs(factor * value), more):.4g} {item.unit}"
                for name, item in quantities(Imperfection).items()
                if item.kind is float and name != "point_location" and (value := getattr(given, name)) != 0.0
            ]
            if given.profile is not None:
                sizes.append(f"{bound} {_rounded(factor, more):.4g} times the profile")
            hints.append(f"{' and '.join(sizes)} (axial_load = {beam.axial_load:.4g} N)")
        loads = np.linspace(
            beam.axial_load, max(beam.axial_load, 0.0) + _FURTHEST_LOAD * beam.critical_load, _HINT_STEPS
        )
        first = next((i for i in range(1, loads.size) if loaded(float(loads[i]))), None)
        if first is not None:
            load = _first_true(loaded, float(loads[first - 1]), float(loads[first]))
            hints.append(f"axial_load of at least {_rounded(load, True):.4g} N (this imperfection)")
        if not hints:
            return "no imperfection of the same shape and no axial load was found that leaves two"
        return f"two wells need {', or '.join(hints)}"

    def _is_bistable_with(self, beam: Beam, imperfection: Imperfection) -> bool:
        modes = self.well_amplitude.size
        return ReducedModel.from_beam(beam, modes, imperfection=imperfection).is_bistable

    @property
    def well_energy(self) -> float:
        """Potential energy of either well, J: -(P - P_cr)^2/(4 gamma) for a buckled beam, 0 if straight.

        Of unequal wells that of the lower one.
        """
        return float(self.potential_energy(self.well_amplitude))

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
        matrix = self.stiffness
        if self.elongation_matrix is not None:
            matrix = condensed(matrix, np.zeros(self.well_amplitude.size), self.elongation_matrix).stiffness
        kappa = np.sort(matrix if matrix.ndim == 1 else np.linalg.eigvalsh(matrix))
        second = min(float(kappa[1]), 0.0) if kappa.size > 1 else 0.0
        return -(second**2) / (4.0 * self.nonlinear_stiffness) + 0.0


_FURTHEST_IMPERFECTION = 100.0
"""Maximum and, inverted, minimum factor of the imperfection at which two wells are looked for."""
_FURTHEST_LOAD = 40.0
"""Maximum axial load over the critical load at which two wells are looked for."""
_HINT_STEPS = 81


def _first_true(holds: Callable[[float], bool], outside: float, inside: float) -> float:
    """Boundary of the range in which *holds* is true, between a value outside and one inside, to 4 digits."""
    while abs(inside - outside) > 5e-5 * abs(inside):
        middle = 0.5 * (outside + inside)
        outside, inside = (outside, middle) if holds(middle) else (middle, inside)
    return inside


def _rounded(value: float, up: bool) -> float:
    """Four digits, not below the value or not above it."""
    if value == 0.0:
        return 0.0
    unit = 10.0 ** (math.floor(math.log10(abs(value))) - 3)
    return (math.ceil if up else math.floor)(value / unit) * unit


# ----------------------------------------------------------------------------------------------------


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
"""Parameters of a reduction in addition to the beam, with their defaults."""

_EPSILON, _ROUNDINGS = float(np.finfo(float).eps), 64
"""Rounding of a damping matrix in modal coordinates, over its terms and the number of modes."""
_LEAST_COMPLIANCE = 1e-300
"""1/kg, below which the inverse is no number."""


@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class ReducedModel(Wells):
    """Reduced model of N modal amplitudes alpha with a mass, a stiffness and one tension term.

    The equation of motion, with the left side of Eq. (11), is

        m alpha'' + K0 alpha + gamma (alpha . alpha) alpha = phi(x_s) f,

    and the potential energy is U = alpha . K0 alpha / 2 + gamma (alpha . alpha)^2 / 4. A constant transverse force B
    makes the wells unequal: it adds B to the right side and -B . alpha to U. :meth:`from_beam` and
    :meth:`from_matrices` create a model; its arrays are read-only.

    The arguments of :meth:`from_matrices` are attributes; for a beam w = alpha . phi (m), with alpha and phi in m^0.5, mass in
    kg m, stiffness in N and nonlinear_stiffness in N/m.

    Attributes
    ----------
    well_amplitude : array of shape (N,)
        Amplitudes at rest in the lower well, (-sqrt((P - P_cr)/gamma), 0, ...), or in the one equilibrium.
    length_scale : float or None
        Length that normalises displacements, m: the buckling level b; of a beam that the load alone would not buckle,
        the height of the centre in the well of minimum energy; None for a straight beam.
    beam : Beam or None
        Beam from which the model was reduced.
    damping : array of shape (N, N) or None
        Damping matrix C, N s/m, if given; *given_damping_ratio* otherwise.
    given_reference_frequency : float or None
        Frequency that normalises, Hz, if it is not the first natural frequency.
    imperfection : Imperfection or None
        Imperfection from which *transverse_force* follows.

    See Also
    --------
    snapbeam.Beam, snapbeam.System, snapbeam.model.converged_modes

    Examples
    --------
    >>> import snapbeam as sb
    >>> from snapbeam import paper
    >>> model = sb.ReducedModel.from_beam(paper.BEAM, modes=8, damping_ratio=0.005)
    >>> round(model.reference_frequency, 2)
    81.92
    >>> model.is_bistable
    True
    """

    mass: _Array
    stiffness: _Array
    nonlinear_stiffness: float
    well_amplitude: _Array
    length_scale: float | None
    midspan_shape: _Array
    contact_shape: _Array | None = None
    given_damping_ratio: _Array | None = None
    damping: _Array | None = None
    beam: Beam | None = None
    given_reference_frequency: float | None = None
    transverse_force: _Array | None = None
    imperfection: Imperfection | None = None
    base_shape: _Array | None = None
    elongation_matrix: _Array | None = None
    patch_shape: _Array | None = None

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
            Beam to reduce.
        modes : int
            Number of modes N, 1 to 256.
        damping_ratio : float or array of shape (N,)
            Damping ratio of the linear modes about a well, each in [0, 1): of unequal wells the one that the first
            striker pushes away from, or the one of minimum energy. The matrix is the same everywhere.
        reference_frequency : float, optional
            Frequency that normalises the excitation, Hz; by default the first natural frequency, of unequal wells about
            the one of minimum energy.
        imperfection : Imperfection, optional
            Imperfection, which makes the wells unequal.
        """
        instance("beam", beam, Beam, "a Beam")
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
            # an initial shape acts as a transverse force, and as a load of gamma s0 more
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
            given_damping_ratio=damping_ratios(damping_ratio, count),
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
        well_amplitude: ArrayLike | None = None,
        length_scale: float = 1.0,
        damping_ratio: ArrayLike | None = None,
        damping: ArrayLike | None = None,
        reference_frequency: float | None = None,
        transverse_force: ArrayLike | None = None,
        base_shape: ArrayLike | None = None,
        elongation_matrix: ArrayLike | None = None,
        patch_shape: ArrayLike | None = None,
        modes: int | None = None,
    ) -> ReducedModel:
        """A model of any structure, given by its matrices; a free mass (stiffness 0) is one.

        A coordinate with a penalty stiffness (at least 1e14, and 1e12 times every other) is fixed: it is removed from
        matrices and rows, and a :class:`~snapbeam.DiagnosticWarning` names it.

        Parameters
        ----------
        mass : array of shape (N, N)
            Mass matrix, symmetric and positive definite, dense or sparse.
        stiffness : array of shape (N,) or (N, N)
            Linear stiffness of the unstressed structure: a diagonal or a symmetric matrix, dense or sparse.
        contact_shape : array of shape (N,)
            Displacement under the shaker per unit of each coordinate.
        midspan_shape : array of shape (N,), optional
            Shape values at the point whose sign distinguishes the wells; the contact point by default.
        nonlinear_stiffness : float
            Factor gamma of gamma (alpha . alpha) alpha, at least 0.
        well_amplitude : array of shape (N,), optional
            Stable equilibrium in the lower well (the displacement of the centre is not positive); zeros by default.
        length_scale : float
            Length that normalises displacements, m.
        damping_ratio : float or array of shape (N,)
            Damping ratio of each linear mode about the equilibrium, in [0, 1).
        damping : array of shape (N, N), optional
            Damping matrix C, N s/m, in place of *damping_ratio*: C alpha' on the left side, about both wells.
            Symmetric, without negative eigenvalues; it may couple or overdamp modes and damp rigid ones.
        reference_frequency : float, optional
            Frequency that normalises the excitation, Hz; needed if the first natural frequency is 0.
        transverse_force : array of shape (N,), optional
            Constant force B that makes the wells unequal; the equilibria follow from it.
        base_shape : array of shape (N,), optional
            Displacement r of each coordinate under a unit motion of the base without deformation; needed for a base
            excitation, with the inertial force -m r y''.
        elongation_matrix : array of shape (N, N), optional
            Matrix S of the term gamma (alpha . S alpha) S alpha, symmetric, without negative eigenvalues; the identity
            by default. Of a beam it is the geometric stiffness matrix of a unit tension, gamma = E A/(2 L); of a cubic
            spring k_3 with the elongation h . alpha it is h h^T, gamma = k_3.
        patch_shape : array of shape (N,), optional
            Difference of the slopes at the ends of piezoelectric layers, w'(x_2) - w'(x_1), per unit of each
            coordinate, for a :class:`~snapbeam.PiezoelectricHarvester`.
        modes : int, optional
            Number of lowest linear modes, 1 to 256, onto which matrices and rows are projected: the new coordinates.
            Sparse matrices of more than 4000 coordinates need it; not with well_amplitude.

        Raises
        ------
        InputError
            For matrices of wrong shape, symmetry or definiteness, *damping* beside *damping_ratio*, values out of
            range, a point that is not a stable equilibrium, or if rounding hides whether a natural frequency is 0.
        """
        given = checked_structure(
            StructureMatrices(
                mass=mass,
                stiffness=stiffness,
                contact_shape=contact_shape,
                midspan_shape=midspan_shape,
                nonlinear_stiffness=nonlinear_stiffness,
                well_amplitude=well_amplitude,
                length_scale=length_scale,
                damping_ratio=damping_ratio,
                damping=damping,
                reference_frequency=reference_frequency,
                transverse_force=transverse_force,
                base_shape=base_shape,
                elongation_matrix=elongation_matrix,
                patch_shape=patch_shape,
                modes=modes,
            )
        )
        model = cls(**given)
        _ = (model._linear, model.modal_damping)  # refuse an unstable equilibrium here rather than at its first use
        return model

    # ------------------------------------------------------------------ shapes

    @property
    def modes(self) -> int:
        """Number of modes N."""
        return self.well_amplitude.size

    def shape_at(self, location: ArrayLike) -> _Array:
        """phi_i at a location x_s in [0, 1] of the length, or at each of several; shape (..., N), m^0.5.

        A model given by matrices has one contact point, and returns it for every location.
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
        """Minimum :meth:`contact_mass` between 2 % and half of the span, kg, looked for at 25 places.

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
            raise InputError(f"location = {shown(location)}: is so near a clamp that the beam does not move there")
        return 1.0 / compliance

    # ------------------------------------------------------------------ linear modes about a well

    def _linear_modes(self) -> LinearModes:
        if self.beam is not None and self.transverse_force is None and not self.beam.boundary.is_elastic:
            return linear_modes_of_beam(self.beam, self.modes)
        parity = None if self.beam is None else self.beam.buckling_modes(self.modes).parity
        alpha, stretch = self.well_amplitude, self.elongation_matrix
        return linear_modes_about(
            alpha,
            self.mass,
            tangent_stiffness(self.stiffness, self.nonlinear_stiffness, alpha, stretch),
            self.tangent_magnitude(alpha),
            parity,
        )

    def tangent_magnitude(self, alpha: ArrayLike) -> _Array:
        """Sum of the magnitudes of the terms of the tangent stiffness, shape (N, N): the measure of its rounding."""
        alpha = np.abs(self._amplitudes("alpha", alpha, 1))
        stretch = None if self.elongation_matrix is None else np.abs(self.elongation_matrix)
        return tangent_stiffness(np.abs(self.stiffness), self.nonlinear_stiffness, alpha, stretch)

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
        """G = V^T S V, through which the tension couples the linear modes; exactly 0 across parities of a beam."""
        return _symmetric(self.linear_modes.T @ self.pulled(self.linear_modes))

    def pulled(self, amplitude: _Array) -> _Array:
        """Return S alpha, the row that the tension acts along, for amplitudes of shape (N,) or (N, columns)."""
        alpha = finite_array("amplitude", amplitude)
        if alpha.ndim not in (1, 2) or len(alpha) != self.modes:
            raise InputError(
                f"amplitude of shape {alpha.shape}: must have the shape ({self.modes},) or ({self.modes}, columns)"
            )
        return alpha if self.elongation_matrix is None else self.elongation_matrix @ alpha

    @cached_property
    def modal_damping(self) -> ModalDamping:
        """The damping V^T C V of the linear modes as ratios, and as rows and coefficients of the rest.

        The rest holds what couples modes, and the damping of modes that are rigid or not underdamped; all of it of a
        few dampers at points, whose rows are fewer.
        """
        if self.damping is None:
            assert self.given_damping_ratio is not None
            return ModalDamping(self.given_damping_ratio, np.zeros((0, self.modes)), np.zeros(0))
        modes, size = self.linear_modes, np.abs(self.linear_modes)
        with np.errstate(over="ignore", invalid="ignore"):
            matrix = np.array(_symmetric(modes.T @ self.damping @ modes))
        if not np.isfinite(matrix).all():
            raise InputError("damping: its rates are beyond what a number holds; are the units of the matrices right?")
        rounding = _ROUNDINGS * self.modes * _EPSILON
        matrix[np.abs(matrix) <= rounding * (size.T @ np.abs(self.damping) @ size)] = 0.0
        rate = matrix.diagonal()
        alone = np.where((rate >= 0.0) & (rate < 2.0 * self.omega), rate, 0.0)
        splits = []
        for own in (alone, np.zeros(self.modes)):
            coefficients, vectors = np.linalg.eigh(matrix - np.diag(own))
            kept = np.abs(coefficients) > rounding * np.abs(coefficients).max()
            ratio = own / np.where(own > 0.0, 2.0 * self.omega, 1.0)
            splits.append(ModalDamping(ratio, np.ascontiguousarray(vectors.T[kept]), coefficients[kept]))
        by_modes, by_rows = splits
        found = by_rows if 2 * by_rows.coefficients.size <= by_modes.coefficients.size else by_modes
        for array in found:
            array.setflags(write=False)
        return found

    @cached_property
    def damping_ratio(self) -> _Array:
        """Damping ratio of each linear mode, shape (N,).

        Of a damping matrix C it is (V^T C V)_ii/(2 omega_i), without what couples the modes, and 0 of a rigid mode; the
        modes of the damped structure follow from :meth:`~snapbeam.System.poles`.
        """
        if self.damping is None:
            return self.modal_damping.ratio
        rate = np.sum(self.linear_modes * (self.damping @ self.linear_modes), axis=0)
        moving = self.omega > 0.0
        ratio: _Array = np.where(moving, rate, 0.0) / np.where(moving, 2.0 * self.omega, 1.0)
        ratio.setflags(write=False)
        return ratio

    @cached_property
    def damping_matrix(self) -> _Array:
        """C, as given or m V diag(2 zeta omega) V^T m, the same about both wells, shape (N, N)."""
        if self.damping is not None:
            return self.damping
        mv = self.mass @ self.linear_modes
        return _symmetric((mv * (2.0 * self.damping_ratio * self.omega)) @ mv.T)

    @property
    def reference_frequency(self) -> float:
        """Frequency that normalises the excitation, Hz: the first natural one unless one was given.

        Refused (InputError) if that frequency is 0, of a free mass or a beam at its critical load, and none was given.
        """
        if self.given_reference_frequency is not None:
            return self.given_reference_frequency
        first = float(self.about_reference_well.natural_frequencies[0])
        if first == 0.0:
            raise InputError(
                "reference_frequency is not given and the first natural frequency is 0: "
                "give reference_frequency in Hz, greater than 0"
            )
        return first

    @property
    def reference_text(self) -> str:
        """Words for the frequency that normalises, its well, and the well where a run without a striker begins."""
        names = {
            "given": "as given",
            "only": "the first frequency about the equilibrium",
            "either": "the first frequency about either well",
        }
        well = names.get(self.reference_well, f"the first frequency about the {self.reference_well} well")
        text = f"Omega = 1 is {self.reference_frequency:.3f} Hz, {well}"
        if not self.is_bistable:
            return text
        start = self.as_fabricated_well
        begins = "the lower well" if start is None else f"the {start} well, as fabricated"
        return f"{text}; a run without a striker begins in {begins}"


def _symmetric(matrix: _Array) -> _Array:
    """A matrix symmetric but for rounding, made exactly so and read-only."""
    symmetric: _Array = 0.5 * (matrix + matrix.T)
    symmetric.setflags(write=False)
    return symmetric


def _coupling(parity: NDArray[np.int_]) -> _Array:
    """c_ij of the mass matrix: 2 between symmetric modes, 2/3 between antisymmetric ones."""
    symmetric = (parity > 0).astype(np.float64)
    antisymmetric = 1.0 - symmetric
    coupling: _Array = 2.0 * np.outer(symmetric, symmetric) + 2.0 / 3.0 * np.outer(antisymmetric, antisymmetric)
    return coupling


# ----------------------------------------------------------------------------------------------------
# The shape of a beam along its length, from the amplitudes of its buckling modes.


def row_of_matrices(model: ReducedModel, shape: tuple[float, ...] | None) -> _Array:
    """Row of a force on a structure given by matrices, (N,): its *shape*, by default that of the contact."""
    if shape is None:
        assert model.contact_shape is not None
        return model.contact_shape
    row = np.asarray(shape)
    if row.shape != (model.modes,):
        raise InputError(
            f"force.shape of shape {row.shape}: must be ({model.modes},); give one number for each coordinate"
        )
    return row


def displacement_along(
    length: float, amplitude: ArrayLike, positions: ArrayLike, modes: Modes | None = None
) -> NDArray[np.float64]:
    """Displacement w = sum alpha_i phi_i(x), m, (..., points), of amplitudes (..., N) at *positions* x/L in [0, 1]."""
    alpha, x = finite_array("amplitude", amplitude), finite_array("positions", positions, 1)
    if x.size and (x.min() < 0.0 or x.max() > 1.0):
        raise InputError(f"positions from {x.min():g} to {x.max():g}: must lie in [0, 1]")
    between = BucklingModes(length, alpha.shape[-1]) if modes is None else modes
    shapes = between.shape(np.clip(x * length, 0.0, length))
    return np.asarray(alpha @ shapes)
