"""Tolerances of parameters as probability distributions."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.special import ndtr

from snapbeam.model.parameters import lookup
from snapbeam.model.quantity import split_name
from snapbeam.util.units import number_in_unit
from snapbeam.util.validation import (
    InputError,
    InputTypeError,
    checked,
    choice,
    finite,
    finite_array,
    flag,
    integer,
    nonnegative,
    positive,
    shown,
)

HOLD_FIXED = ("physical", "normalised")
_OWN = ("displacement", "phase", "hold_fixed", "seed", "correlation")


_Array = NDArray[np.float64]


@dataclass(frozen=True)
class Distribution:
    """Distribution of a parameter, given its nominal value."""

    kind: ClassVar[str] = ""

    def at(self, nominal: _Array, normal: _Array) -> _Array:
        """Values that have the rank Phi(*normal*), of the broadcast shape."""
        raise NotImplementedError

    def describe(self) -> dict[str, Any]:
        """Type and parameters of the distribution as plain values."""
        return {"type": self.kind, **self.__dict__}


@dataclass(frozen=True)
class Normal(Distribution):
    """Normally distributed about the nominal value.

    Parameters
    ----------
    standard_deviation : float
        Standard deviation in the unit of the parameter, or as a share of the nominal value.
    relative : bool
        True if *standard_deviation* is a share of the nominal value.

    See Also
    --------
    snapbeam.uncertainty.LogNormal, snapbeam.uncertainty.UniformTolerance

    Examples
    --------
    >>> import snapbeam as sb
    >>> level = sb.uncertainty.Normal(0.01, relative=True)  # 1 % of the nominal value
    >>> level
    Normal(standard_deviation=0.01, relative=True)
    """

    standard_deviation: float
    relative: bool = False
    kind: ClassVar[str] = "normal"

    def __post_init__(self) -> None:
        object.__setattr__(self, "standard_deviation", positive("standard_deviation", self.standard_deviation))
        flag("relative", self.relative)

    def at(self, nominal: _Array, normal: _Array) -> _Array:
        """Nominal value plus the standard deviation times *normal*."""
        return np.asarray(nominal + self.standard_deviation * (np.abs(nominal) if self.relative else 1.0) * normal)


@dataclass(frozen=True)
class UniformTolerance(Distribution):
    """Uniformly distributed within a half width of the nominal value, as a drawing's tolerance +- is.

    Parameters
    ----------
    half_width : float
        Half width in the unit of the parameter, or as a share of the nominal value.
    relative : bool
        True if *half_width* is a share of the nominal value.

    See Also
    --------
    snapbeam.uncertainty.UniformRange, snapbeam.uncertainty.Normal

    Examples
    --------
    >>> import snapbeam as sb
    >>> thickness = sb.uncertainty.UniformTolerance(5e-6)  # m
    >>> thickness
    UniformTolerance(half_width=5e-06, relative=False)
    """

    half_width: float
    relative: bool = False
    kind: ClassVar[str] = "uniform"

    def __post_init__(self) -> None:
        object.__setattr__(self, "half_width", positive("half_width", self.half_width))
        flag("relative", self.relative)

    def at(self, nominal: _Array, normal: _Array) -> _Array:
        """Nominal value plus the half width times 2 Phi(*normal*) - 1."""
        size = self.half_width * (np.abs(nominal) if self.relative else 1.0)
        return np.asarray(nominal + size * (2.0 * ndtr(normal) - 1.0))


@dataclass(frozen=True)
class LogNormal(Distribution):
    """Nominal value times exp(sigma z), z standard normal: for positive quantities known to a factor.

    Parameters
    ----------
    sigma : float
        Standard deviation of the logarithm.

    See Also
    --------
    snapbeam.uncertainty.Normal

    Examples
    --------
    >>> import snapbeam as sb
    >>> stiffness = sb.uncertainty.LogNormal(0.2)
    >>> stiffness
    LogNormal(sigma=0.2)
    """

    sigma: float
    kind: ClassVar[str] = "lognormal"

    def __post_init__(self) -> None:
        object.__setattr__(self, "sigma", positive("sigma", self.sigma))

    def at(self, nominal: _Array, normal: _Array) -> _Array:
        """Nominal value, which is the median, times the factor."""
        return np.asarray(nominal * np.exp(self.sigma * normal))


@dataclass(frozen=True)
class UniformRange(Distribution):
    """Uniform distribution between two values, independent of the nominal value: for example an uncontrolled phase.

    Parameters
    ----------
    low, high : float
        Minimum and maximum in the unit of the parameter.

    See Also
    --------
    snapbeam.uncertainty.UniformTolerance

    Examples
    --------
    >>> import snapbeam as sb
    >>> sb.uncertainty.UniformRange(0.0, 3.14)
    UniformRange(low=0.0, high=3.14)
    """

    low: float
    high: float
    kind: ClassVar[str] = "range"

    def __post_init__(self) -> None:
        for name in ("low", "high"):
            object.__setattr__(self, name, finite(name, getattr(self, name)))
        if not self.low < self.high:
            raise InputError(f"low = {self.low:g}, high = {self.high:g}: low must be less than high")

    def at(self, nominal: _Array, normal: _Array) -> _Array:
        """Value between the two by the rank."""
        return np.asarray(self.low + (self.high - self.low) * ndtr(normal) + 0.0 * nominal)


@dataclass(frozen=True)
class Empirical(Distribution):
    """Empirical distribution of observed values, independent of the nominal value.

    Parameters
    ----------
    quantiles : tuple of float
        Quantiles at evenly spaced ranks from 0 to 1, at least two, not falling, in the unit of the parameter.
    """

    quantiles: tuple[float, ...]
    kind: ClassVar[str] = "empirical"

    def __post_init__(self) -> None:
        table = finite_array("quantiles", self.quantiles, 1)
        if table.size < 2 or (np.diff(table) < 0.0).any():
            raise InputError("quantiles: must be at least two that do not fall")
        object.__setattr__(self, "quantiles", tuple(table.tolist()))

    def at(self, nominal: _Array, normal: _Array) -> _Array:
        """Value between the quantiles by the rank."""
        ranks = np.linspace(0.0, 1.0, len(self.quantiles))
        return np.asarray(np.interp(ndtr(normal), ranks, self.quantiles) + 0.0 * nominal)


KINDS: dict[str, type[Distribution]] = {each.kind: each for each in (Normal, UniformTolerance, LogNormal, UniformRange)}
"""Distributions by the names that files use."""


# Parameter uncertainty: distributions of any parameters of a system, and numbered samples of them.


_PHASE = UniformRange(math.pi, 2.0 * math.pi)


@dataclass(frozen=True, kw_only=True, eq=False)
class ParameterUncertainty:
    """Uncertainty of the parameters and the initial state of a system.

    Sample number s follows from the seed and s alone (Philox with the key (seed, s)), on any number of threads or
    workers. With a phase or a ringing start the tip's mid-position is fixed in space.

    Parameters
    ----------
    of : mapping of str to Distribution
        Distributions by the names of parameters: :class:`Normal`, :class:`UniformTolerance`, :class:`LogNormal`, about
        the value of the system or of the point, or :class:`UniformRange`.
    correlation : array_like of shape (parameters, parameters), optional
        Correlations of the normal scores (a Gaussian copula), in the order of *of*.
    displacement : float
        Root mean square at the centre, m, of a ringing start of all modes with equal mean energy; a start that would
        press the beam into the tip is mirrored about its rest.
    phase : bool
        True if the drive begins at any phase of the half cycle in which the tip is drawn back.
    hold_fixed : {"physical", "normalised"}
        Excitation that stays fixed if the beam differs from the nominal one: ``"physical"``, frequency in Hz, velocity
        in m/s and location in m; ``"normalised"``, Omega, V and x_s.
    seed : int
        Seed of the samples.

    See Also
    --------
    snapbeam.uncertainty.probability_map, snapbeam.uncertainty.sample_systems

    Examples
    --------
    >>> import snapbeam as sb
    >>> uncertainty = sb.uncertainty.ParameterUncertainty(
    ...     of={"contact.stiffness": sb.uncertainty.LogNormal(0.2), "location": sb.uncertainty.Normal(0.005)}
    ... )
    >>> uncertainty.hold_fixed
    'physical'
    """

    of: Mapping[str, Distribution] = field(default_factory=dict)
    correlation: ArrayLike | None = None
    displacement: float = 0.0
    phase: bool = False
    hold_fixed: str = "physical"
    seed: int = 0

    def __post_init__(self) -> None:
        if not isinstance(self.of, Mapping):
            raise InputTypeError(f"of = {shown(self.of)}: must map parameters to distributions")
        of: dict[str, Distribution] = {}
        for name, each in self.of.items():
            row = lookup(name)
            if not isinstance(each, Distribution) or type(each) is Distribution:
                raise InputTypeError(
                    f"{name} = {shown(each)}: must be a distribution, such as sb.uncertainty.Normal(0.01, relative=True)"
                )
            seed = split_name(row.name)[1] == "seed" and row.section != "integration"
            if seed and not isinstance(each, UniformRange):
                raise InputError(f"{name} = {each!r}: must be a UniformRange, such as UniformRange(0, 1000000)")
            if not seed and (row.quantity.kind is not float or row.section == "integration"):
                raise InputError(f"{name}: cannot be uncertain; must be a real number of the system, or a seed")
            if row.name in of:
                raise InputError(f"{name}: is given twice")
            of[row.name] = each
        nonnegative("displacement", self.displacement, "m")
        integer("seed", self.seed, 0, 2**63 - 1)
        choice("hold_fixed", self.hold_fixed, HOLD_FIXED)
        if flag("phase", self.phase):
            if "drive.phase" in of:
                raise InputError("phase = True with drive.phase: give one of the two")
            of["drive.phase"] = _PHASE
        object.__setattr__(self, "of", of)
        if self.correlation is not None:
            object.__setattr__(self, "correlation", self._correlations(self.correlation))

    def _correlations(self, given: ArrayLike) -> _Array:
        matrix = finite_array("correlation", given, 2)
        drawn = len(self.of) - bool(self.phase)
        if matrix.shape != (drawn, drawn):
            raise InputError(f"correlation of shape {matrix.shape}: must have the shape ({drawn}, {drawn})")
        if not np.allclose(matrix, matrix.T) or not np.allclose(np.diag(matrix), 1.0):
            raise InputError("correlation: must be symmetric, with ones on its diagonal")
        if np.linalg.eigvalsh(matrix)[0] < -1e-10:
            raise InputError("correlation: must be positive semidefinite")
        return matrix

    @classmethod
    @checked
    def from_calibration(cls, calibration: Any, **more: Any) -> ParameterUncertainty:
        """Return the uncertainty of a calibration: standard errors and their correlation, with damping and contact.

        Raises
        ------
        InputError
            If the data leave a fitted parameter undetermined.
        """
        if not hasattr(calibration, "undetermined"):
            raise InputTypeError(f"calibration = {shown(calibration)}: must be a Calibration")
        if calibration.undetermined:
            raise InputError(
                f"calibration: {', '.join(calibration.undetermined)} not determined by the data, so its uncertainty is unknown; leave it out of the fit"
            )
        errors = {f"beam.{name}": error for name, error in calibration.standard_errors.items()}
        matrix = np.eye(len(errors) + 2)
        matrix[: len(errors), : len(errors)] = calibration.correlation
        errors["model.damping_ratio"] = calibration.damping_ratio_se
        errors["contact.stiffness"] = calibration.contact_stiffness_se
        of = {name: Normal(error) for name, error in errors.items() if error or name.startswith("beam.")}
        return cls(of=of, correlation=matrix[: len(of), : len(of)], **more)

    @property
    def parameters(self) -> tuple[str, ...]:
        """The uncertain parameters, by dotted name."""
        return tuple(self.of)

    @property
    def structural(self) -> tuple[str, ...]:
        """The uncertain parameters that change the structure."""
        return tuple(name for name in self.of if not lookup(name).is_run)

    @property
    def is_empty(self) -> bool:
        """True if all samples are equal."""
        return not self.of and self.displacement == 0.0

    @property
    def moves_start(self) -> bool:
        """True if runs have different initial states or phases, so that the tip must be fixed in space."""
        return self.displacement > 0.0 or "drive.phase" in self.of

    def normals(self, numbers: NDArray[np.int64]) -> _Array:
        """Standard normal scores of the samples of the given numbers, of shape (samples, parameters)."""
        which, back = np.unique(numbers, return_inverse=True)
        names = sorted(self.of)
        scores = np.empty((which.size, len(names)))
        for row, number in zip(scores, which.tolist(), strict=True):
            row[:] = np.random.Generator(np.random.Philox(key=[self.seed, number])).standard_normal(len(names))
        # a parameter's own scores hang on its rank among the names alone, not on the order in which they were given
        scores = scores[:, [names.index(name) for name in self.of]]
        if self.correlation is not None:
            matrix = np.asarray(self.correlation)
            value, vector = np.linalg.eigh(matrix)
            root = vector @ np.diag(np.sqrt(np.maximum(value, 0.0))) @ vector.T
            scores[:, : len(matrix)] = scores[:, : len(matrix)] @ root
        return np.asarray(scores[back])

    def describe(self) -> dict[str, Any]:
        """Return everything that identifies this uncertainty, as plain values."""
        found: dict[str, Any] = {name: each.describe() for name, each in self.of.items()}
        own = {"displacement": self.displacement, "hold_fixed": self.hold_fixed, "seed": self.seed}
        if self.correlation is not None:
            own["correlation"] = np.asarray(self.correlation).tolist()
        return found | own


def uncertainty_from_mapping(
    given: Mapping[str, Any], name: str = "uncertainty", full_name: Callable[[str], str] = str
) -> ParameterUncertainty:
    """Read the uncertainty from a section of a parameter file.

    Each parameter has a table that names one distribution: ``{normal = 0.02, relative = true}``, ``{uniform =
    1e-5}``, ``{lognormal = 0.3}`` or ``{range = [3.14, 6.28]}``; further keys are ``displacement``, ``phase``,
    ``hold_fixed`` and ``seed``.  *full_name* returns the dotted name of a parameter of the system of the file.
    """
    if not isinstance(given, Mapping):
        raise InputTypeError(f"{name} = {shown(given)}: must be a table")
    of: dict[str, Distribution] = {}
    for key, table in _flat(given).items():
        if not isinstance(table, Mapping):
            raise InputError(f"{name}.{key} = {shown(table)}: must be a table, such as {{normal = 0.01}}")
        own = full_name(key)
        try:
            of[own] = _distribution(f"{name}.{key}", table, lookup(own).quantity.unit)
        except InputError as error:
            words = str(error)
            raise InputError(words if words.startswith(f"{name}.{key}") else f"{name}.{key}: {words}") from None
    return ParameterUncertainty(of=of, **{key: given[key] for key in _OWN if key in given})


def _flat(given: Mapping[str, Any]) -> dict[str, Any]:
    """Tables by dotted name, whether a file writes ``"beam.thickness"`` or ``beam.thickness``."""
    found: dict[str, Any] = {}
    for key, table in given.items():
        if key in _OWN:
            continue
        if isinstance(table, Mapping) and not set(table) & set(KINDS):
            found |= {f"{key}.{inner}": each for inner, each in table.items()}
        else:
            found[str(key)] = table
    return found


def _distribution(name: str, table: Mapping[str, Any], unit: str) -> Distribution:
    def number(value: Any) -> Any:
        """A number that text states in the unit of the parameter, or as a share."""
        if not isinstance(value, str):
            return value
        found = number_in_unit(value, "1" if table.get("relative") or "lognormal" in table else unit)
        return value if found is None else found

    kinds = [key for key in table if key in KINDS]
    others = [key for key in table if key not in KINDS and key != "relative"]
    if len(kinds) != 1 or others:
        raise InputError(f"{name} = {shown(dict(table))}: must name one of {', '.join(KINDS)}, and may say relative")
    value = table[kinds[0]]
    more = {key: table[key] for key in table if key == "relative"}
    if kinds[0] == "range":
        if more or not isinstance(value, (list, tuple)) or len(value) != 2:
            raise InputError(f"{name}.range = {shown(value)}: must be two numbers [low, high] alone")
        return UniformRange(*map(number, value))
    if kinds[0] == "lognormal" and more:
        raise InputError(f"{name}: a lognormal is relative by itself; leave relative out")
    kind: Any = KINDS[kinds[0]]
    return kind(number(value), **more)
