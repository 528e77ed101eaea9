"""A local force: any law of a force on one point of the structure, by its displacement or rotation and their rate."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from snapbeam.model.extension import check_defined, check_names, check_pair, overrides
from snapbeam.model.quantity import STRUCTURE, check_fields, check_label, keep_shape, numbers_type, quantity
from snapbeam.model.reduced_model import ReducedModel, row_of_matrices
from snapbeam.util.validation import InputError

_Array = NDArray[np.float64]

LOCAL_FORCES: dict[str, type[LocalForce]] = {}
"""Every law of a local force, by the name it has in parameter files."""
_PLACES = ("location", "coordinate", "shape", "label")
_PERMITTIVITY = 8.8541878188e-12
"""Permittivity of vacuum, F/m (CODATA 2022)."""
_NEAREST = 0.1
"""Share of the way to the end of the range of a law, from which on the steps of a run do not follow its stiffness."""


@dataclass(frozen=True, kw_only=True)
class LocalForce:
    """A law of a force that acts on one point: derive a frozen dataclass from it, with the law's constants as fields.

    The law depends on the displacement u of the point from the straight beam, or on its rotation, and on the rate v of
    that. Its physics are scalar functions; ``law`` contains the constants, by the names of the fields:

    - ``force(law, displacement)``: conservative force on the beam, N, or moment, N m; positive in the direction of u;
    - ``energy(law, displacement)``: its potential energy, J; the force is minus its derivative.

    A law with ``dissipative`` = True has two more, and need not have the first two:

    - ``damping_force(law, displacement, velocity)``: the part that depends on v;
    - ``damping_coefficient(law, displacement, velocity)``: minus its derivative by v, N s/m or N m s/rad.

    They use ``+``, ``-``, ``*``, ``/`` and :mod:`math` alone. ``displacement_range(law)``, a pair, limits the
    displacements; a run that leaves them ends with the status DIVERGED.

    Parameters
    ----------
    location : float, optional
        Location of the force on a beam, over the length.
    coordinate : {"displacement", "rotation"}
        Coordinate u at the location: displacement, m, or rotation, rad.
    shape : array_like of shape (N,), optional
        Row of a structure given by matrices, u = shape . alpha; its contact point by default.
    label : str, optional
        Name in place of the number of the force: ``"magnet"`` in ``force.magnet.gap``.

    See Also
    --------
    snapbeam.LocalSpring, snapbeam.ExternalForce, snapbeam.quantity

    Notes
    -----
    In modal coordinates about a well, p' = ... + r F(u, v) with r = V^T shape, u = u_well + r . q and v = r . p.  The wells of
    the model are those without the force; runs begin in those of the system (:attr:`snapbeam.System.potential`).

    Examples
    --------
    >>> import snapbeam as sb
    >>> from snapbeam import paper
    >>> system = sb.System(
    ...     sb.ReducedModel.from_beam(paper.BEAM, modes=2),
    ...     forces=[sb.LocalSpring(stiffness=20.0, location=0.4)],
    ... )
    >>> system.get("force.stiffness")
    20.0
    """

    location: float | None = quantity(
        "1", "location of the force over the length", default=None, optional=True, low=0.0, high=1.0,
        closed="both", scope=STRUCTURE,
    )  # fmt: skip
    coordinate: str = quantity(
        "1",
        "coordinate that the local force acts on",
        default="displacement",
        kind=str,
        choices=("displacement", "rotation"),
        scope=STRUCTURE,
    )
    shape: Any = quantity(
        "1", "force on each coordinate per unit of the force", default=None, optional=True, kind=object,
        scope=STRUCTURE,
    )  # fmt: skip
    label: str = dataclasses.field(default="", repr=False)

    hooks: ClassVar[tuple[str, ...]] = (
        "name", "force", "energy", "dissipative", "damping_force", "damping_coefficient", "displacement_range",
    )  # fmt: skip
    """Names that are read of a law of one's own; a law has no others, but for those that begin with an underscore."""
    name: ClassVar[str] = ""
    """Name in parameter files and attributes."""
    noun: ClassVar[str] = "a local force"
    """Name in messages."""
    constant_part: ClassVar[float] = 0.0
    """Part of the force that does not depend on the motion, N."""
    dissipative: ClassVar[bool] = False
    """True if the force also depends on the velocity."""

    def __init_subclass__(cls, **options: Any) -> None:
        super().__init_subclass__(**options)
        if cls.force is not LocalForce.force and cls.energy is LocalForce.energy:
            raise InputError(
                f"{cls.__name__}.energy: must be given for a law with a force, which is minus its derivative; define "
                "energy(law, displacement)"
            )
        check_names(cls)
        if overrides(cls, LocalForce, "energy"):
            check_defined(cls, LocalForce, ["force"])
        if cls.name:
            check_pair(cls, "dissipative", LocalForce, ["damping_force", "damping_coefficient"])
            if not cls.dissipative:
                check_defined(cls, LocalForce, ["force"])
            LOCAL_FORCES[cls.name] = cls

    def __post_init__(self) -> None:
        check_fields(self)
        check_label(self.label)
        keep_shape(self)

    @staticmethod
    def force(law: Any, displacement: float) -> float:
        """Conservative force, N; none by default."""
        return 0.0

    @staticmethod
    def energy(law: Any, displacement: float) -> float:
        """Potential energy of the force, J."""
        return 0.0

    @staticmethod
    def damping_force(law: Any, displacement: float, velocity: float) -> float:
        """Part of the force that depends on the velocity, N."""
        return 0.0

    @staticmethod
    def damping_coefficient(law: Any, displacement: float, velocity: float) -> float:
        """Minus the derivative of the damping force by the velocity, N s/m."""
        return 0.0

    @staticmethod
    def displacement_range(law: Any) -> tuple[float, float]:
        """Displacements at which the law is valid, such as up to the contact of two electrodes; all by default."""
        return -math.inf, math.inf

    def force_at(self, displacement: Any) -> Any:
        """Conservative force, N, at a displacement or an array of them."""
        return _elementwise(type(self).force, self.numbers, displacement)

    def energy_at(self, displacement: Any) -> Any:
        """Potential energy, J, at a displacement or an array of them."""
        return _elementwise(type(self).energy, self.numbers, displacement)

    def stiffness_at(self, displacement: Any, length: float) -> Any:
        """Minus the derivative of the conservative force, N/m, by differences of order six over a part of *length*."""
        low, high = self.displacement_range(self.numbers)
        h = np.minimum(np.minimum(1e-3 * length, 0.1 * (displacement - low)), 0.1 * (high - displacement))
        total = 0.0
        for k, weight in enumerate((45.0, -9.0, 1.0), 1):
            total += weight * (self.force_at(displacement + k * h) - self.force_at(displacement - k * h))
        return -total / (60.0 * h)

    @classmethod
    def is_limited(cls) -> bool:
        """Return whether the law is valid only in a range of displacements."""
        return cls.displacement_range is not LocalForce.displacement_range

    @property
    def rate_dependent(self) -> bool:
        """True if the force depends on the velocity of the structure."""
        return self.dissipative

    @property
    def is_conservative(self) -> bool:
        """True if the law has a conservative part."""
        return type(self).force is not LocalForce.force

    @classmethod
    def numbers_type(cls) -> Any:
        """The named tuple of the law's constants, as its functions get them; an attribute of the class, ``Numbers``."""
        return numbers_type(cls, (item.name for item in dataclasses.fields(cls) if item.name not in _PLACES))

    @cached_property
    def numbers(self) -> Any:
        """The law's constants."""
        kind = self.numbers_type()
        return kind(*(float(getattr(self, name)) for name in kind._fields))

    def row(self, model: ReducedModel) -> _Array:
        """Return the shape that gives u of the modal amplitudes, u = shape . alpha; shape (N,)."""
        if model.beam is not None:
            if self.shape is not None or self.location is None:
                raise InputError(
                    f"force.location = {self.location}: a force on a beam acts at a location; give location in "
                    "[0, 1] and leave shape out"
                )
            at = self.location * model.beam.length
            modes = model.beam.buckling_modes(model.modes)
            return np.asarray(modes.slope(at) if self.coordinate == "rotation" else modes.shape(at))
        if self.location is not None or self.coordinate != "displacement":
            raise InputError(
                f"force.location = {self.location}, coordinate = {self.coordinate!r}: a structure given by matrices has "
                "no length; give shape"
            )
        return row_of_matrices(model, self.shape)

    def largest_displacement(self, model: ReducedModel) -> float:
        """Displacement that an interwell motion may reach, m or rad: twice that of a well or of the length scale."""
        shape, center = np.abs(self.row(model)), np.abs(model.midspan_shape)
        assert model.length_scale is not None
        well = abs(float(self.row(model) @ model.well_amplitude))
        return 2.0 * max(well, model.length_scale * float(shape.max() / max(center.max(), 1e-300)))

    def displacements(self, largest: float, count: int) -> _Array:
        """Displacements at which the law is valid, up to *largest* from the straight beam, ascending; shape (count,).

        A tenth of the way to an end of the range is left out.  A range without the straight beam counts from its
        nearest end.
        """
        low, high = self.displacement_range(self.numbers)
        near = min(max(0.0, low), high)
        first, last = max(low, near - largest), min(high, near + largest)
        middle = near if low < near < high else 0.5 * (first + last)
        ends = (middle + (1.0 - _NEAREST) * (end - middle) for end in (low, high))
        return np.linspace(max(first, next(ends)), min(last, next(ends)), count)

    def greatest_stiffness(self, largest: float) -> float:
        """Maximum slope of the conservative force over displacements up to *largest*, by differences; N/m."""
        at = self.displacements(largest, 401)
        return float(np.abs(np.diff(self.force_at(at)) / np.diff(at)).max())

    def greatest_damping(self, largest: float, fastest: float) -> float:
        """Maximum damping coefficient over displacements and velocities up to *largest* and *fastest*; N s/m."""
        numbers, damping = self.numbers, type(self).damping_coefficient
        # dense near 0, where friction changes
        speeds = [0.0, *(fastest * 10.0 ** (-k / 4.0) for k in range(24))]
        places = self.displacements(largest, 17).tolist()
        return max(abs(damping(numbers, u, s * v)) for u in places for v in speeds for s in (1.0, -1.0))

    def reversal_speed(self, largest: float, fastest: float) -> float:
        """Speed scale over which the force reverses, m/s: v_0 of F_c tanh(v/v_0), 0 of -c |v| v.

        At v_0 the damping coefficient is 1/cosh(1)^2 of that at rest. Infinite where it stays larger up to *fastest*. Scale 0
        means that the coefficient has a kink at rest: it grows with |v| there.
        """
        numbers, damping = self.numbers, type(self).damping_coefficient
        place = float(self.displacements(largest, 3)[1])
        at_zero = damping(numbers, place, 0.0)

        def rise(speed: float) -> float:
            return damping(numbers, place, speed) - at_zero

        small = 1e-3 * fastest
        if rise(small) * rise(-small) > 0.0 and abs(rise(small) - 2.0 * rise(0.5 * small)) < 0.1 * abs(rise(small)):
            return 0.0
        at_rest = abs(at_zero) / math.cosh(1.0) ** 2
        speeds = fastest * 10.0 ** np.linspace(-9.0, 0.0, 181)
        fallen = (float(v) for v in speeds for s in (1.0, -1.0) if abs(damping(numbers, place, s * v)) < at_rest)
        return next(fallen, math.inf)


def _elementwise(function: Callable[[Any, float], float], numbers: Any, displacement: Any) -> Any:
    """A scalar function of a law at each displacement; a float for a float."""
    values = np.frompyfunc(lambda u: float(function(numbers, float(u))), 1, 1)(displacement)
    return values.astype(np.float64) if isinstance(values, np.ndarray) else values


@dataclass(frozen=True, kw_only=True)
class LocalSpring(LocalForce):
    """A linear and cubic spring to the ground, F = -k u - k_3 u^3, such as a torsional spring at mid-span.

    Parameters
    ----------
    stiffness : float
        k, N/m, or N m/rad for a rotation.
    cubic_stiffness : float
        k_3, N/m^3, or N m/rad^3. With k > 0 a softening spring, k_3 < 0, is valid up to u^2 = -k/k_3, where its force
        falls to zero.

    See Also
    --------
    snapbeam.LocalForce, snapbeam.MagneticForce

    Examples
    --------
    >>> import snapbeam as sb
    >>> spring = sb.LocalSpring(stiffness=0.02, location=0.5, coordinate="rotation")
    """

    stiffness: float = quantity("N/m", "stiffness of the local spring", low=0.0, closed="left", symbol="k")
    cubic_stiffness: float = quantity("N/m^3", "cubic stiffness of the local spring", default=0.0, symbol="k_3")
    name = "local_spring"

    @staticmethod
    def force(law: Any, displacement: float) -> float:
        """-k u - k_3 u^3."""
        return -displacement * (law.stiffness + law.cubic_stiffness * displacement * displacement)

    @staticmethod
    def energy(law: Any, displacement: float) -> float:
        """k u^2/2 + k_3 u^4/4."""
        square = displacement * displacement
        return square * (0.5 * law.stiffness + 0.25 * law.cubic_stiffness * square)

    @staticmethod
    def displacement_range(law: Any) -> tuple[float, float]:
        """Up to where the force of a softening spring falls to zero."""
        if law.cubic_stiffness < 0.0 < law.stiffness:
            end = math.sqrt(-law.stiffness / law.cubic_stiffness)
            return -end, end
        return -math.inf, math.inf


@dataclass(frozen=True, kw_only=True)
class _TowardsGap(LocalForce):
    """A force from a fixed body at a distance g from the straight beam, up to which its law is valid."""

    gap: float = quantity("m", "location of the electrode or magnet, from the straight beam", symbol="g")

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.gap == 0.0:
            raise InputError(
                "force.gap = 0: must differ from 0; give the distance from the straight beam, with its sign"
            )

    @staticmethod
    def displacement_range(law: Any) -> tuple[float, float]:
        """Up to the electrode or magnet."""
        return (-math.inf, law.gap) if law.gap > 0.0 else (law.gap, math.inf)


@dataclass(frozen=True, kw_only=True)
class ElectrostaticForce(_TowardsGap):
    """Attraction between a part of the beam and a fixed electrode, F = eps_0 A V^2/(2 (g - u)^2), as of parallel plates.

    On a spring of stiffness k it pulls in at V^2 = 8 k g^3/(27 eps_0 A), at u = g/3.

    Parameters
    ----------
    voltage : float
        Voltage V between the plates, V.
    area : float
        A, m^2, of the electrode.
    gap : float
        g, m: where the electrode is, from the straight beam; negative below it.

    See Also
    --------
    snapbeam.LocalForce, snapbeam.MagneticForce

    Examples
    --------
    >>> import snapbeam as sb
    >>> electrode = sb.ElectrostaticForce(voltage=20.0, area=3e-9, gap=-8e-6, location=0.5)
    """

    voltage: float = quantity("V", "voltage of the electrode", symbol="V")
    area: float = quantity("m^2", "area of the electrode", low=0.0, symbol="A")
    name = "electrostatic_force"

    @staticmethod
    def force(law: Any, displacement: float) -> float:
        """eps_0 A V^2/(2 (g - u)^2), towards the electrode."""
        away = law.gap - displacement
        return math.copysign(0.5 * _PERMITTIVITY * law.area * law.voltage * law.voltage / (away * away), law.gap)

    @staticmethod
    def energy(law: Any, displacement: float) -> float:
        """Energy of the electrode and its source, -eps_0 A V^2/(2 |g - u|)."""
        return -0.5 * _PERMITTIVITY * law.area * law.voltage * law.voltage / abs(law.gap - displacement)


@dataclass(frozen=True, kw_only=True)
class MagneticForce(_TowardsGap):
    """Attraction or repulsion by a magnet, F = a/(g - u)^2 towards it, as of two poles in line.

    Parameters
    ----------
    strength : float
        a, N m^2; negative for repulsion.
    gap : float
        g, m: where the magnet is, from the straight beam; negative below it.

    See Also
    --------
    snapbeam.LocalForce, snapbeam.ElectrostaticForce

    Examples
    --------
    >>> import snapbeam as sb
    >>> magnet = sb.MagneticForce(strength=8e-9, gap=8e-4, location=0.5)
    """

    strength: float = quantity("N m^2", "strength of the magnet", symbol="a")
    name = "magnetic_force"

    @staticmethod
    def force(law: Any, displacement: float) -> float:
        """a/(g - u)^2, towards the magnet."""
        away = law.gap - displacement
        return math.copysign(1.0, law.gap) * law.strength / (away * away)

    @staticmethod
    def energy(law: Any, displacement: float) -> float:
        """-a/|g - u|."""
        return -law.strength / abs(law.gap - displacement)


@dataclass(frozen=True, kw_only=True)
class QuadraticDamping(LocalForce):
    """Quadratic damping of a point, F = -c abs(v) v, such as the drag of a tip mass in air.

    Parameters
    ----------
    coefficient : float
        c, N s^2/m^2.

    See Also
    --------
    snapbeam.LocalForce, snapbeam.CoulombFriction

    Examples
    --------
    >>> import snapbeam as sb
    >>> drag = sb.QuadraticDamping(coefficient=0.5, location=0.5)
    """

    coefficient: float = quantity("N s^2/m^2", "coefficient of quadratic damping", low=0.0, closed="left")
    name = "quadratic_damping"
    dissipative = True

    @staticmethod
    def damping_force(law: Any, displacement: float, velocity: float) -> float:
        """-c |v| v."""
        return -law.coefficient * abs(velocity) * velocity

    @staticmethod
    def damping_coefficient(law: Any, displacement: float, velocity: float) -> float:
        """2 c |v|."""
        return 2.0 * law.coefficient * abs(velocity)


@dataclass(frozen=True, kw_only=True)
class CoulombFriction(LocalForce):
    """Coulomb friction at a point, smoothed over a small velocity: F = -F_c tanh(v/v_0).

    Far above v_0 the force is constant.  Below, it is a damper of the coefficient F_c/v_0, so that a point which would stick
    creeps instead.

    Parameters
    ----------
    friction_force : float
        F_c, N.
    smoothing_velocity : float
        v_0, m/s.

    See Also
    --------
    snapbeam.LocalForce, snapbeam.QuadraticDamping

    Examples
    --------
    >>> import snapbeam as sb
    >>> friction = sb.CoulombFriction(friction_force=2e-3, smoothing_velocity=0.02, location=0.5)
    """

    friction_force: float = quantity("N", "friction force", low=0.0, closed="left")
    smoothing_velocity: float = quantity("m/s", "velocity that smooths friction", low=0.0)
    name = "coulomb_friction"
    dissipative = True

    @staticmethod
    def damping_force(law: Any, displacement: float, velocity: float) -> float:
        """-F_c tanh(v/v_0)."""
        return -law.friction_force * math.tanh(velocity / law.smoothing_velocity)

    @staticmethod
    def damping_coefficient(law: Any, displacement: float, velocity: float) -> float:
        """F_c/(v_0 cosh^2(v/v_0))."""
        cosh = math.cosh(min(abs(velocity / law.smoothing_velocity), 300.0))
        return law.friction_force / (law.smoothing_velocity * cosh * cosh)
