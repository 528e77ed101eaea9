"""Sensitivity of a quantity of interest to uncertain parameters."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray
from scipy import special, stats

from snapbeam.dynamics.flow import InitialConditions
from snapbeam.dynamics.lifetimes import LifetimeSettings, lifetime_map
from snapbeam.model.integration import Integration
from snapbeam.model.parameters import lookup, ratio_of
from snapbeam.model.system import System
from snapbeam.solver.statistics import STATISTICS, of_one_named
from snapbeam.sweeps.compute import CheckpointOptions
from snapbeam.sweeps.points import PointList
from snapbeam.uncertainty.distributions import ParameterUncertainty
from snapbeam.uncertainty.monte_carlo import OUTCOMES, Trials, reached, require_held, trials_of
from snapbeam.util.diagnostics import counting
from snapbeam.util.provenance import canonical_json
from snapbeam.util.validation import InputError, axis, checked, choice, finite_array, integer, seed_of, shown, within

if TYPE_CHECKING:
    import xarray as xr

_GROUPS = 20
_Numbers = NDArray[np.int64]
_Array = NDArray[np.float64]
METHODS = ("local", "sobol", "given_data")
_DEFAULT = {"local": 16, "sobol": 128, "given_data": 1000}
_REPLICATES = 4
PARAMETER = "parameter"


# Which of some inputs moves an output most, from any sample of both.


class Indices(NamedTuple):
    """Sensitivity indices with their intervals, arrays of shape (inputs,)."""

    estimate: _Array
    low: _Array
    high: _Array

    def variables(self, name: str) -> dict[str, _Array]:
        """Return the variables of a dataset: the estimate and its limits."""
        return {name: self.estimate, f"{name}_low": self.low, f"{name}_high": self.high}


def first_order(x: _Array, y: _Array, confidence: float, seed: int) -> Indices:
    """First-order indices Var(E[y | x_j])/Var(y) of a sample, however it was sampled, of correlated inputs too.

    Inputs, shape (runs, inputs), are cut into bins of equal numbers of runs; the index is the variance of the means of
    the bins over that of the output, less the contribution of chance: Kelley's epsilon squared (Plischke, Borgonovo
    and Smith, Eur. J.  Oper. Res. 226 (2013) 536, on estimates from bins).  It may be less than 0 by chance, and does
    not contain the variation within a bin.  The interval is that of a jackknife over twenty groups of runs.
    """
    if y.size < 200:
        raise InputError(f"samples = {y.size}: must be at least 200 to be cut into bins")
    _check_variation("quantity", y)
    count = int(np.clip(y.size // 40, 5, 100))
    generator = np.random.Generator(np.random.Philox(key=[seed, 0]))
    group = generator.permutation(y.size) % _GROUPS
    # bins of equal numbers of runs, in the order of an input
    binned = np.argsort(np.argsort(x, axis=0, kind="stable"), axis=0).T * count // y.size
    whole = _all(binned, y, count)
    left = np.array([_all(binned[:, group != g], y[group != g], count) for g in range(_GROUPS)])
    pseudo = _GROUPS * whole - (_GROUPS - 1) * left
    error = pseudo.std(axis=0, ddof=1) / np.sqrt(_GROUPS)
    reach = float(stats.t.ppf(0.5 * (1.0 + confidence), _GROUPS - 1)) * error
    return Indices(whole, whole - reach, whole + reach)


_ROUNDING = 64.0 * float(np.finfo(np.float64).eps)
"""Range of an output over its maximum magnitude, up to which it is constant but for rounding."""


def _check_variation(name: str, values: _Array) -> None:
    """Refuse an output that is constant up to rounding: its variance has no shares."""
    extent = float(np.ptp(values))
    if extent <= _ROUNDING * float(np.abs(values).max()):
        raise InputError(f"{name}: is constant, {values.flat[0]:.12g} within {extent:.1g}; must vary with the inputs")


def _all(binned: NDArray[np.int64], y: _Array, count: int) -> _Array:
    return np.array([_epsilon(row, y, count) for row in binned])


def _epsilon(binned: NDArray[np.int64], y: _Array, count: int) -> float:
    size = np.bincount(binned, minlength=count)
    middle = y - y.mean()
    means = np.bincount(binned, weights=middle, minlength=count) / size
    total = float(np.sum(middle**2))
    between = float(np.sum(size * means**2))
    within_bins = (total - between) / (y.size - count)
    return (between - (count - 1) * within_bins) / total


# Sobol's indices of independent inputs, with intervals from sequences scrambled independently.


class Sobol(NamedTuple):
    """Indices of the first order and in total."""

    first: Indices
    total: Indices
    runs: int


@checked
def sobol_indices(
    function: Callable[[_Array], _Array],
    inputs: int,
    samples: int = 128,
    *,
    replicates: int = 4,
    confidence: float = 0.95,
    rng: int | np.random.Generator | None = 0,
) -> Sobol:
    """Sobol's indices by Saltelli's estimator (``scipy.stats.sobol_indices``), over scrambled Sobol sequences.

    The error is Student's interval of the mean of *replicates* independently scrambled sequences (Owen); resampling the
    points of one would overestimate it. At equal cost, few long sequences have a smaller error than many short ones.

    Parameters
    ----------
    function : callable
        Function of ranks in (0, 1), shape (inputs, points), that returns shape (points,); called once.
    inputs : int
        Number of inputs.
    samples : int
        Points of a sequence, a power of 2; *replicates* times *samples* times (*inputs* + 2) points in all.
    replicates : int
        Number of sequences, at least 4.
    confidence : float
        Confidence level of the intervals, in (0, 1).
    rng : int, numpy.random.Generator or None
        Seed, or a generator that gives one; None: random.

    See Also
    --------
    snapbeam.uncertainty.sensitivity

    Examples
    --------
    >>> import numpy as np
    >>> import snapbeam as sb
    >>> result = sb.uncertainty.sobol_indices(lambda x: x[0] + 2.0 * x[1], inputs=2, samples=256)
    >>> np.round(result.total.estimate, 1)
    array([0.2, 0.8])
    """
    integer("inputs", inputs, 1, 1000)
    integer("replicates", replicates, 4, 10_000)
    within("confidence", confidence, 0.0, 1.0)
    seed = seed_of(rng)
    if integer("samples", samples, 2, 2**24) & (samples - 1):
        raise InputError(f"samples = {samples}: must be a power of 2")
    blocks = np.concatenate([_matrices(inputs, samples, seed, r) for r in range(replicates)], axis=1)
    values = finite_array("the result of function", function(blocks), 1)
    if values.size != blocks.shape[1]:
        raise InputError(
            f"function: its result has {values.size} numbers; must have one for each of the {blocks.shape[1]} points, "
            f"the columns of its argument of shape {blocks.shape}"
        )
    table = values.reshape(replicates, inputs + 2, samples)
    for each in table[:, :2]:
        _check_variation("function", each)
    found = [
        stats.sobol_indices(func={"f_A": row[None, 0], "f_B": row[None, 1], "f_AB": row[2:, None]}, n=samples)
        for row in table
    ]
    first = np.array([np.ravel(each.first_order) for each in found])
    total = np.array([np.ravel(each.total_order) for each in found])
    return Sobol(_mean(first, confidence), _mean(total, confidence), values.size)


def _matrices(inputs: int, size: int, seed: int, number: int) -> _Array:
    """The points of one sequence: A, B and, for each input, A with that of B in its place; (inputs, points)."""
    generator = np.random.default_rng(np.random.SeedSequence([seed, number]))
    points = stats.qmc.Sobol(2 * inputs, scramble=True, seed=generator).random(size).T
    points = np.clip(points, 1e-12, 1.0 - 1e-12)
    a, b = points[:inputs], points[inputs:]
    mixed = [np.where(np.arange(inputs)[:, None] == j, b, a) for j in range(inputs)]
    return np.concatenate([a, b, *mixed], axis=1)


def _mean(table: _Array, confidence: float) -> Indices:
    middle = table.mean(axis=0)
    reach = stats.t.ppf(0.5 * (1.0 + confidence), len(table) - 1) * stats.sem(table, axis=0)
    return Indices(middle, middle - reach, middle + reach)


# What is asked of a system as one number: a statistic, a threshold, a lifetime.


class QuantityOfInterest(Protocol):
    """A number for every sample of a system."""

    @property
    def unit(self) -> str:
        """Unit of the quantity."""
        ...

    @property
    def long_name(self) -> str:
        """Description of the quantity."""
        ...

    def of(self, trials: Trials, scores: _Array, numbers: _Numbers) -> _Array:
        """The numbers of samples with the given scores and starts; NaN where there is none."""
        ...


@dataclass(frozen=True)
class StatisticQoI:
    """A statistic of the run of each sample, such as ``peak_force``.

    Parameters
    ----------
    name : str
        Name of a statistic of :data:`snapbeam.STATISTICS`, of one of several strikers, such as
        ``"peak_force_contact_2"``, or an outcome such as ``"snap"``: 1 where it happens, else 0.

    See Also
    --------
    snapbeam.uncertainty.sensitivity, snapbeam.uncertainty.ThresholdQoI

    Examples
    --------
    >>> import snapbeam as sb
    >>> sb.uncertainty.StatisticQoI("peak_force").unit
    'N'
    """

    name: str

    def __post_init__(self) -> None:
        known = [name for name, row in STATISTICS.items() if row.dtype in ("float64", "int32")]
        if not isinstance(self.name, str) or of_one_named(self.name) is None:
            choice("statistic", self.name, (*known, *OUTCOMES))

    @property
    def unit(self) -> str:
        """Unit of the statistic."""
        return STATISTICS[self.name].unit if self.name in STATISTICS else "1"

    @property
    def long_name(self) -> str:
        """Long name of the quantity."""
        return STATISTICS[self.name].long_name if self.name in STATISTICS else OUTCOMES[self.name].long_name

    def of(self, trials: Trials, scores: _Array, numbers: _Numbers) -> _Array:
        """One run a sample."""
        require_held([self.name], trials.system)
        found = trials.statistics({}, numbers, scores=scores)
        values = found[self.name] if self.name in STATISTICS else OUTCOMES[self.name].happened(found)
        return np.where(reached(found), values.astype(np.float64), np.nan)


@dataclass(frozen=True, kw_only=True)
class ThresholdQoI:
    """The minimum value of a parameter at which a sample snaps, on a row of values and then by halving.

    Parameters
    ----------
    parameter : str
        Parameter to raise, such as ``"velocity_amplitude"``.
    bounds : tuple of two floats
        Minimum and maximum of the parameter, in its unit.
    values : int
        Values tried first, evenly spaced; narrower windows of snapping may be missed.
    halvings : int
        Halvings of the step below the lowest value that snaps.
    at : mapping of str to float, optional
        Other parameters, at nominal values.

    See Also
    --------
    snapbeam.uncertainty.sensitivity

    Examples
    --------
    >>> import snapbeam as sb
    >>> quantity = sb.uncertainty.ThresholdQoI(parameter="velocity_amplitude", bounds=(0.02, 0.4), values=10)
    """

    parameter: str = "velocity_amplitude"
    bounds: tuple[float, float] = (0.005, 0.65)
    values: int = 25
    halvings: int = 8
    at: Mapping[str, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        row = lookup(self.parameter)
        if not row.is_run or row.quantity.kind is not float:
            raise InputError(f"parameter = {shown(self.parameter)}: must be a number that may differ between runs")
        axis("bounds", self.bounds, -np.inf, np.inf)
        integer("values", self.values, 2, 100_000)
        integer("halvings", self.halvings, 0, 40)

    @property
    def unit(self) -> str:
        """Unit of the parameter."""
        return lookup(self.parameter).quantity.unit

    @property
    def long_name(self) -> str:
        """Long name of the quantity."""
        return f"minimum {lookup(self.parameter).quantity.long_name} for snap-through"

    @property
    def error(self) -> float:
        """Half of the last step."""
        return (self.bounds[1] - self.bounds[0]) / (self.values - 1) / 2.0 ** (self.halvings + 1)

    def of(self, trials: Trials, scores: _Array, numbers: _Numbers) -> _Array:
        """All samples at once: every value, then as many rounds as there are halvings."""
        row, size = lookup(self.parameter).name, numbers.size
        tried = np.linspace(*self.bounds, self.values)
        each = np.repeat(np.arange(size), tried.size)
        snaps = self._snaps(trials, scores[each], numbers[each], row, np.tile(tried, size))
        table = snaps.reshape(size, tried.size)
        first = np.where(table.any(axis=1), table.argmax(axis=1), tried.size)
        known = (first > 0) & (first < tried.size)
        low, high = tried[np.clip(first - 1, 0, None)], tried[np.clip(first, None, tried.size - 1)]
        for _ in range(self.halvings):
            middle = 0.5 * (low + high)
            up = self._snaps(trials, scores, numbers, row, middle)
            low, high = np.where(up, low, middle), np.where(up, middle, high)
        return np.where(known, 0.5 * (low + high), np.nan)

    def _snaps(self, trials: Trials, scores: _Array, numbers: _Numbers, row: str, values: _Array) -> NDArray[np.bool_]:
        points = {lookup(name).name: np.full(values.size, float(value)) for name, value in self.at.items()}
        found = trials.statistics(points | {row: values}, numbers, scores=scores)
        return np.asarray(found["response_class"] > 0)


@dataclass(frozen=True, kw_only=True)
class LifetimeQoI:
    """Mean lifetime of snapping, from many initial conditions of each sample, in cycles.

    Parameters
    ----------
    initial_conditions : InitialConditions
        Initial conditions, the same for every sample.
    settings : LifetimeSettings, optional
        Settings of the estimate of lifetimes.

    See Also
    --------
    snapbeam.uncertainty.sensitivity, snapbeam.dynamics.lifetime_map

    Examples
    --------
    >>> import snapbeam as sb
    >>> starts = sb.dynamics.InitialConditions(count=16, displacement=1e-6)
    >>> quantity = sb.uncertainty.LifetimeQoI(initial_conditions=starts)
    """

    initial_conditions: InitialConditions = field(default_factory=lambda: InitialConditions(count=16))
    settings: LifetimeSettings = field(default_factory=LifetimeSettings)

    @property
    def unit(self) -> str:
        """Cycles."""
        return "1"

    @property
    def long_name(self) -> str:
        """Long name of the quantity."""
        return "lifetime of snapping, in cycles"

    def of(self, trials: Trials, scores: _Array, numbers: _Numbers) -> _Array:
        """A lifetime map over the samples."""
        columns = trials.columns({}, numbers, scores)
        if any(name.startswith("initial_state.") for name in columns):
            raise InputError(
                "displacement: lifetimes have the initial conditions of LifetimeQoI; leave it out of the uncertainty"
            )
        found = lifetime_map(
            trials.system,
            PointList(columns),
            trials.integration,
            initial_conditions=self.initial_conditions,
            settings=self.settings,
        )
        trials.runs += numbers.size * self.initial_conditions.count
        return np.asarray(found["lifetime"].values, dtype=np.float64)


def quantity_of_interest(given: QuantityOfInterest | str) -> QuantityOfInterest:
    """Return the quantity of interest, or that of a statistic by its name."""
    if isinstance(given, str):
        return StatisticQoI(given)
    if not hasattr(given, "of") or not hasattr(given, "unit"):
        raise InputError(f"quantity = {shown(given)}: must be the name of a statistic, a ThresholdQoI or a LifetimeQoI")
    return given


@checked
def sensitivity(
    system: System,
    quantity: QuantityOfInterest | str,
    uncertainty: ParameterUncertainty,
    method: str = "local",
    *,
    samples: int | None = None,
    confidence: float = 0.95,
    integration: Integration | None = None,
    checkpoint: str | os.PathLike[str] | CheckpointOptions | None = None,
    progress: Callable[[int, int], object] | bool | None = None,
) -> xr.Dataset:
    """Compute which uncertain parameter changes a quantity of interest most, with intervals.

    Parameters
    ----------
    system : System
        The nominal system.
    quantity : str or ThresholdQoI or LifetimeQoI
        Name of a statistic, such as ``"peak_force"``, or of an outcome, or one of these.
    uncertainty : ParameterUncertainty
        Uncertainty of at least one parameter.
    method : {"local", "sobol", "given_data"}
        ``"local"``: half the difference of the quantities with a parameter one standard normal score up and down, over
        *samples* common random numbers. ``"sobol"``: first and total indices over four scrambled sequences of *samples*
        points, whose scatter gives the intervals, all from one start. ``"given_data"``: first indices from *samples*
        plain samples, which may be correlated.
    samples : int, optional
        Number of samples; 16, 128 and 1000 for the three methods.
    confidence : float
        Confidence level of the intervals, in (0, 1).
    integration : Integration, optional
        Settings of the runs.
    checkpoint, progress : optional
        Folder and report of runs of each round, as in :func:`snapbeam.sweep`; not for lifetimes.

    Returns
    -------
    xarray.Dataset
        Variables over ``parameter``, with ``unit``: locally ``effect`` (of +1 standard score) and ``derivative`` (per
        unit), with limits, ``quantity_minus`` and ``quantity_plus``; else ``first_order`` and, of Sobol's,
        ``total_order``, with limits. Mean and standard deviation of the quantity are attributes.

    Raises
    ------
    InputError
        If the quantity is missing for some samples or does not vary, or if parameters are correlated with Sobol's
        indices.

    See Also
    --------
    snapbeam.uncertainty.gradient, snapbeam.uncertainty.sobol_indices

    Examples
    --------
    >>> import snapbeam as sb
    >>> from snapbeam import paper
    >>> system = paper.struck_beam(frequency_ratio=1.2, velocity_amplitude=0.18)
    >>> uncertainty = sb.uncertainty.ParameterUncertainty(
    ...     of={"contact.stiffness": sb.uncertainty.LogNormal(0.2), "location": sb.uncertainty.Normal(0.005)}
    ... )
    >>> tornado = sb.uncertainty.sensitivity(
    ...     system, "peak_force", uncertainty, samples=4, integration=sb.Integration(cycles=5)
    ... )
    >>> [float(value) for value in tornado.effect.round(2)]  # N a standard deviation
    [0.82, 0.11]
    """
    choice("method", method, METHODS)
    within("confidence", confidence, 0.0, 1.0)
    asked = quantity_of_interest(quantity)
    trials = trials_of(system, uncertainty, integration, checkpoint=checkpoint, early=isinstance(asked, ThresholdQoI))
    trials.progress = counting(progress, "sensitivity", "runs")
    names = trials.uncertainty.parameters
    if not names:
        raise InputError("uncertainty: has no uncertain parameter, so there is nothing to compare")
    count = integer("samples", _DEFAULT[method] if samples is None else samples, 2, 2**24)
    if trials.uncertainty.correlation is not None and method == "sobol":
        raise InputError(
            "correlation with method = 'sobol': its indices are of independent parameters; use 'given_data'"
        )
    made = {"local": _local, "sobol": _sobol, "given_data": _given_data}[method]
    table, values = made(trials, asked, count, confidence)
    return _dataset(trials, asked, method, count, confidence, table, values)


def _ask(trials: Trials, quantity: QuantityOfInterest, scores: _Array, numbers: NDArray[np.int64]) -> _Array:
    values = quantity.of(trials, scores, numbers)
    lost = ~np.isfinite(values)
    if lost.any():
        raise InputError(
            f"quantity: {quantity.long_name} is missing for {int(lost.sum())} of {values.size} samples; give it a wider "
            "range, or an uncertainty in which every system has it"
        )
    return values


def _local(
    trials: Trials, quantity: QuantityOfInterest, count: int, confidence: float
) -> tuple[dict[str, _Array], _Array]:
    uncertainty = trials.uncertainty
    inputs = len(uncertainty.of)
    numbers = np.arange(count)
    base = uncertainty.normals(numbers)
    stack = [np.where(np.arange(inputs) == j, score, base) for j in range(inputs) for score in (-1.0, 1.0)]
    values = _ask(trials, quantity, np.concatenate(stack), np.tile(numbers, 2 * inputs))
    both = values.reshape(inputs, 2, count)
    half = 0.5 * (both[:, 1] - both[:, 0])
    width = np.array([_width(trials, name) for name in uncertainty.of])
    table = {"quantity_minus": both[:, 0].mean(axis=1), "quantity_plus": both[:, 1].mean(axis=1)}
    table |= _mean(half.T, confidence).variables("effect") | {"step": width}
    table |= _mean(half.T / width, confidence).variables("derivative")
    return table, values


def _width(trials: Trials, name: str) -> float:
    """Half of what a parameter differs by between the scores -1 and +1."""
    system = trials.system
    given = system.get(name) if ratio_of(name) in system.parameters else None  # a ratio, or one in its unit
    nominal = np.full(2, 0.0 if given is None else given, dtype=np.float64)
    return 0.5 * float(np.ptp(trials.uncertainty.of[name].at(nominal, np.array([-1.0, 1.0]))))


def _sobol(
    trials: Trials, quantity: QuantityOfInterest, count: int, confidence: float
) -> tuple[dict[str, _Array], _Array]:
    kept: list[_Array] = []

    def function(ranks: _Array) -> _Array:
        values = _ask(trials, quantity, special.ndtri(ranks).T, np.zeros(ranks.shape[1], dtype=np.int64))
        kept.append(values)
        return values

    found = sobol_indices(
        function, len(trials.uncertainty.of), count, replicates=_REPLICATES, confidence=confidence, rng=trials.uncertainty.seed
    )  # fmt: skip
    return found.first.variables("first_order") | found.total.variables("total_order"), kept[0]


def _given_data(
    trials: Trials, quantity: QuantityOfInterest, count: int, confidence: float
) -> tuple[dict[str, _Array], _Array]:
    numbers = np.arange(count)
    scores = trials.uncertainty.normals(numbers)
    values = _ask(trials, quantity, scores, numbers)
    return first_order(scores, values, confidence, trials.uncertainty.seed).variables("first_order"), values


_WORDS = {
    "effect": "change of the quantity for +1 standard score",
    "derivative": "change of the quantity for a unit of the parameter",
    "quantity_minus": "mean quantity at the score -1",
    "quantity_plus": "mean quantity at the score +1",
    "step": "half the difference of the parameter between the scores -1 and +1, in its unit",
    "first_order": "share of the variance of the quantity that the parameter makes by itself",
    "total_order": "fraction of the variance of the quantity to which the parameter contributes",
}


def _dataset(
    trials: Trials,
    quantity: QuantityOfInterest,
    method: str,
    count: int,
    confidence: float,
    table: dict[str, _Array],
    values: _Array,
) -> xr.Dataset:
    from snapbeam.util.datasets import xr

    names = list(trials.uncertainty.of)
    attrs: dict[str, Any] = {
        "title": "sensitivity of a struck bistable beam", "method": method, "samples": count, "runs_made": trials.runs,
        "confidence": confidence, "quantity": quantity.long_name, "quantity_units": quantity.unit,
        "quantity_mean": float(values.mean()), "quantity_sd": float(values.std(ddof=1)),
        "uncertainty": canonical_json(trials.uncertainty.describe()), "system": trials.system.hash, "seed": trials.uncertainty.seed,
    }  # fmt: skip
    dataset = xr.Dataset(attrs=attrs)
    dataset[PARAMETER] = ((PARAMETER,), names, {"long_name": "parameter"})
    dataset["unit"] = ((PARAMETER,), [lookup(name).quantity.unit for name in names])
    for name, array in table.items():
        plain, _, end = name.rpartition("_") if name.endswith(("_low", "_high")) else (name, "", "")
        text = {"low": "lower limit: ", "high": "upper limit: "}.get(end, "") + _WORDS[plain]
        unit = quantity.unit if plain in ("effect", "quantity_minus", "quantity_plus") else "1"
        dataset[name] = ((PARAMETER,), array, {"units": unit, "long_name": text})
    return dataset
