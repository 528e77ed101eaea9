"""An initial shape and a constant transverse load: what a real beam has and the ideal one has not."""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from snapbeam.model.beam import Beam
from snapbeam.model.boundary_conditions import Modes
from snapbeam.model.equilibria import Equilibrium
from snapbeam.model.quantity import check_fields, quantity
from snapbeam.util.validation import InputError, finite_array

# ----------------------------------------------------------------------------------------------------
# A shape given by points, on the buckling modes.


_POINTS = 16
"""Gauss-Legendre points in each panel; a half wave of the last mode has two panels."""


def projected(modes: Modes, profile: _Array, symmetric: bool = False) -> _Array:
    """The integrals of w0' phi_i', m^0.5, of a shape through points: places from 0 to 1 and heights, m, (2, points).

    The slopes of the modes are orthonormal, so that sum alpha0_i phi_i is the shape among those of the modes whose
    slope is nearest to that of w0.  Antisymmetric modes have no part in a *symmetric* shape.
    """
    from scipy.interpolate import CubicSpline

    at, heights = profile
    spline = CubicSpline(at * modes.length, heights)
    panels = 2 * (modes.count + 1)
    nodes, weights = np.polynomial.legendre.leggauss(_POINTS)
    edges = np.unique(np.concatenate((np.linspace(0.0, 1.0, panels + 1), np.clip(at, 0.0, 1.0)))) * modes.length
    half = 0.5 * np.diff(edges)
    x = np.clip((edges[:-1, None] + half[:, None] * (1.0 + nodes)).ravel(), 0.0, modes.length)
    weight = (half[:, None] * weights).ravel()
    found: _Array = (modes.slope(x) * spline(x, 1)) @ weight
    if symmetric:
        found[modes.parity < 0] = 0.0
    return found


# ----------------------------------------------------------------------------------------------------


_Array = NDArray[np.float64]
FORMS = ("mode", "sine")


@dataclass(frozen=True, kw_only=True, eq=False)
class Imperfection:
    """The shape w0(x) that a beam has before it is loaded, and a transverse load that never changes.

    With alpha0 and F, their projections on the buckling modes, the potential energy is

        U = sum E I k_i^2 (alpha_i - alpha0_i)^2/2 - P (s - s0)/2 + gamma (s - s0)^2/4 - F . alpha,

    with s = alpha . alpha and s0 = alpha0 . alpha0: that of a perfect beam under the load P + gamma s0 with the
    constant force E I k_i^2 alpha0_i + F_i. Parts add up. Displacements, loads and forces are positive towards the
    upper well.

    Parameters
    ----------
    midspan_amplitude : float
        Height of the initial shape at the centre, m.
    shape : {"mode", "sine"}
        Initial shape: the first buckling mode, or the part of a single half sine that the modes hold.
    antisymmetric_amplitude : float
        Maximum height, m, of a part of the form of the second buckling mode, on the left half.
    profile : array_like of shape (2, points), optional
        Measured initial shape: places over the length, ascending from 0 to 1, and heights, m. The straight line through
        its ends is subtracted.
    point_load : float
        Constant force, N, at *point_location*.
    point_location : float
        Location of *point_load* over the length, in (0, 1).
    uniform_load : float
        Constant force per length, N/m.
    gravity : float
        Acceleration of gravity, m/s^2, towards the lower well: 9.81 for a horizontal beam.

    See Also
    --------
    snapbeam.ReducedModel, snapbeam.model.identify_imperfection

    Examples
    --------
    >>> import snapbeam as sb
    >>> from snapbeam import paper
    >>> model = sb.ReducedModel.from_beam(paper.BEAM, modes=2, imperfection=sb.Imperfection(midspan_amplitude=2e-6))
    >>> len(model.wells)
    2
    """

    midspan_amplitude: float = quantity(
        "m", "height at the centre of the initial shape", default=0.0, symbol="a_0", short="imperfection_midspan_amplitude",
        plausible=(0.0, 1.0, "mm"),
    )  # fmt: skip
    shape: str = quantity(
        "1", "shape of the initial deflection", default="mode", kind=str, choices=FORMS, short="imperfection_shape"
    )
    antisymmetric_amplitude: float = quantity(
        "m", "maximum height of the antisymmetric part of the initial shape", default=0.0,
        short="imperfection_antisymmetric_amplitude", plausible=(0.0, 1.0, "mm"),
    )  # fmt: skip
    profile: _Array | None = quantity(
        "m", "places over the length and heights of a measured initial shape", default=None, kind=object,
        optional=True, short="imperfection_profile",
    )  # fmt: skip
    point_load: float = quantity(
        "N", "constant force at a point", default=0.0, symbol="F", short="imperfection_point_load"
    )
    point_location: float = quantity(
        "1", "location of the constant force over the length", default=0.5, low=0.0, high=1.0,
        short="imperfection_point_location",
    )  # fmt: skip
    uniform_load: float = quantity("N/m", "constant force per length", default=0.0, short="imperfection_uniform_load")
    gravity: float = quantity(
        "m/s^2", "gravity towards the lower well", default=0.0, symbol="g", short="imperfection_gravity"
    )

    def __post_init__(self) -> None:
        check_fields(self)
        if self.profile is not None:
            object.__setattr__(self, "profile", _profile(self.profile))

    @property
    def is_none(self) -> bool:
        """True if the beam is perfect."""
        profile = self.profile is not None and bool(np.any(self.profile[1] != self.profile[1, 0]))
        loads = (self.midspan_amplitude, self.antisymmetric_amplitude, self.point_load, self.uniform_load, self.gravity)
        return not profile and not any(loads)

    @property
    def mirrored(self) -> Imperfection:
        """The mirror image, upper and lower exchanged."""
        return self.scaled(-1.0)

    def scaled(self, factor: float) -> Imperfection:
        """The same imperfection, *factor* times as large."""
        names = ("midspan_amplitude", "antisymmetric_amplitude", "point_load", "uniform_load", "gravity")
        changed: dict[str, Any] = {name: factor * getattr(self, name) for name in names}
        if self.profile is not None:
            changed["profile"] = self.profile * np.array([[1.0], [factor]])
        return dataclasses.replace(self, **changed)

    def initial_shape(self, modes: Modes) -> _Array:
        """alpha0_i, the integrals of w0' phi_i', m^0.5, shape (N,)."""
        found = np.zeros(modes.count)
        if self.midspan_amplitude != 0.0 and self.shape == "mode":
            found[0] += self.midspan_amplitude / float(modes.shape(0.5 * modes.length)[0])
        elif self.midspan_amplitude != 0.0:
            at = np.linspace(0.0, 1.0, _SINE_POINTS)
            found += projected(modes, np.stack((at, self.midspan_amplitude * np.sin(np.pi * at))), symmetric=True)
        if self.antisymmetric_amplitude != 0.0:
            if modes.count < 2:
                raise InputError(
                    f"antisymmetric_amplitude = {self.antisymmetric_amplitude:g} m: needs a second mode; give modes = 2 or more"
                )
            at = np.linspace(0.0, 0.5, _SEARCH) * modes.length
            heights = modes.shape(at)[1]
            found[1] += self.antisymmetric_amplitude / float(heights[np.argmax(np.abs(heights))])
        if self.profile is not None:
            found += projected(modes, self.profile)
        return found

    def transverse_load(self, modes: Modes, beam: Beam) -> _Array:
        """F_i, the integrals of the transverse load times phi_i, N m^0.5, shape (N,)."""
        found = np.zeros(modes.count)
        if self.point_load != 0.0:
            found += self.point_load * modes.shape(self.point_location * modes.length)
        uniform = self.uniform_load - beam.mass_per_length * self.gravity
        if uniform != 0.0:
            found += uniform * modes.integral
        return found


_SINE_POINTS = 2001
_SEARCH = 4001


def _profile(value: Any) -> _Array:
    given = finite_array("profile", value)
    if given.ndim != 2 or given.shape[0] != 2 or given.shape[1] < 4:
        raise InputError(f"profile of shape {given.shape}: must be (2, points), places and heights, 4 points or more")
    at = given[0]
    if not (np.diff(at) > 0.0).all() or abs(at[0]) > _ENDS or abs(at[-1] - 1.0) > _ENDS:
        raise InputError(
            f"profile with places from {at[0]:g} to {at[-1]:g}: must ascend from 0 to 1, from end to end of the beam"
        )
    line = given[1, 0] + (given[1, -1] - given[1, 0]) * (at - at[0]) / (at[-1] - at[0])
    made = np.stack((at, given[1] - line))
    made.setflags(write=False)
    return made


_ENDS = 1e-6


# ----------------------------------------------------------------------------------------------------
# The equilibria of a perfect structure in closed form.


def perfect_equilibria(stiffness: _Array, gamma: float) -> tuple[Equilibrium, ...]:
    """The straight state, and a pair along every eigenvector of K0 with an eigenvalue kappa < 0, by energy.

    Of the i-th such pair, alpha = +-sqrt(-kappa_i/gamma) and U = -kappa_i^2/(4 gamma); it is unstable towards
    all lower ones.
    """
    if stiffness.ndim == 1:
        kappa, axes = stiffness, np.eye(stiffness.size)
    else:
        kappa, axes = np.linalg.eigh(stiffness)
    order = np.argsort(kappa, kind="stable")
    buckled = [int(i) for i in order if kappa[i] < 0.0]
    found = []
    for below, i in enumerate(buckled if gamma > 0.0 else []):
        for sign in (-1.0, 1.0):
            with np.errstate(over="ignore"):
                alpha = sign * np.sqrt(-kappa[i] / gamma) * axes[:, i]
                energy = -0.25 * float(kappa[i] * (kappa[i] / gamma))
            if not (math.isfinite(energy) and np.isfinite(alpha).all()):
                raise InputError(
                    f"stiffness = {kappa[i]:g}, nonlinear_stiffness = {gamma:g}: the equilibria are no finite numbers; must "
                    "be closer to 1 in these units"
                )
            found.append(Equilibrium(amplitude=alpha, energy=energy, unstable_directions=below))
    straight = np.zeros(kappa.size)
    found.append(Equilibrium(amplitude=straight, energy=0.0, unstable_directions=len(buckled)))
    return tuple(found)
