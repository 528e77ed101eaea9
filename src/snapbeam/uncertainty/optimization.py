"""Optimal designs under chance constraints, searched with common samples and checked with validation samples."""

from __future__ import annotations

import contextlib
import math
import os
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any, ClassVar, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import optimize, stats

from snapbeam.model.integration import Integration
from snapbeam.model.parameters import in_table, lookup
from snapbeam.model.system import System
from snapbeam.solver.statistics import STATISTICS
from snapbeam.sweeps.compute import CheckpointOptions
from snapbeam.sweeps.points import Columns
from snapbeam.sweeps.setup import is_positive
from snapbeam.uncertainty.differential_evolution import DifferentialEvolution, front_of
from snapbeam.uncertainty.distributions import ParameterUncertainty
from snapbeam.uncertainty.gradients import not_smooth, slopes_of_runs
from snapbeam.uncertainty.monte_carlo import OUTCOMES, Trials, reached, require_held, scale_key, trials_of
from snapbeam.util.diagnostics import Diagnostic, counting, tell
from snapbeam.util.proportions import mean_interval, proportion
from snapbeam.util.provenance import canonical_json
from snapbeam.util.units import number_in_unit
from snapbeam.util.validation import (
    InputError,
    InputTypeError,
    checked,
    finite,
    finite_array,
    instance,
    integer,
    or_default,
    shown,
    within,
)

if TYPE_CHECKING:
    import xarray as xr

Values = dict[str, NDArray[Any]]
_SURE = 0.99
"""Confidence level at which a design is discarded after a quarter of its runs."""
_Array = NDArray[np.float64]
_REPORT_FACTOR = 4
"""Samples from which a single design is reported, over validation_samples."""


# What a design is judged by: quantities of its runs or of itself, objectives to make small, constraints to satisfy.


class DesignQuantity(NamedTuple):
    """Something with a number for every run, or for every design."""

    name: str
    unit: str
    long_name: str
    kind: str
    """``"outcome"`` and ``"run"``: of a run; ``"design"``: of the nominal design alone."""
    of: Callable[[System, Values], NDArray[Any]]
    """Function of the nominal system and columns, parameters of designs or statistics of runs; returns numbers."""


def _own(name: str, values: Values, system: System) -> _Array:
    value = values.get(name)
    return np.asarray(system.parameters[name] if value is None else value, dtype=np.float64)


def _speed(system: System, values: Values) -> _Array:
    return _own("drive.velocity_amplitude", values, system) * system.scale.length * system.scale.omega


def _stroke(system: System, values: Values) -> _Array:
    ratio = _own("drive.frequency_ratio", values, system)
    return _own("drive.velocity_amplitude", values, system) * system.scale.length / ratio


def _acceleration(system: System, values: Values) -> _Array:
    return _speed(system, values) * (_own("drive.frequency_ratio", values, system) * system.scale.omega)


def _settled(_: System, values: Values) -> _Array:
    """Cycles to the last crossing; those of runs that do not end in a well are infinite."""
    found = np.nan_to_num(values["last_zero_crossing"], nan=0.0) / values[CYCLE]
    return np.where(OUTCOMES["continuous"].happened(values), np.inf, found)


CYCLE = "cycle"
"""Key of the seconds of a cycle, in addition to the statistics of a run."""


OWN: dict[str, DesignQuantity] = {
    row.name: row
    for row in (
        DesignQuantity("speed", "m/s", "velocity amplitude of the tip", "design", _speed),
        DesignQuantity("stroke", "m", "displacement amplitude of the tip", "design", _stroke),
        DesignQuantity("acceleration", "m/s^2", "acceleration amplitude of the tip", "design", _acceleration),
        DesignQuantity("cycles_to_settle", "1", "cycles to the last snap", "run", _settled),
    )
}
"""Quantities in addition to statistics, outcomes and parameters; the first three are of a sine."""


def quantity_of(name: str) -> DesignQuantity:
    """A quantity by name: an outcome, a statistic, one of :data:`OWN`, or a parameter of the design."""
    if instance("quantity", name, str, "a name") in OWN:
        return OWN[name]
    if name in OUTCOMES:
        event = OUTCOMES[name]
        return DesignQuantity(name, "1", event.long_name, "outcome", lambda _, found: event.happened(found))
    if name in STATISTICS:
        row = STATISTICS[name]
        if row.dtype not in ("float64", "int32"):
            raise InputError(f"{name}: is not a number that can be minimised")
        return DesignQuantity(name, row.unit, row.long_name, "run", lambda _, found: found[name].astype(np.float64))
    try:
        parameter = lookup(name)
    except InputError:
        known = ", ".join((*OWN, *OUTCOMES))
        raise InputError(f"{name}: is not a quantity; must be one of {known}, a statistic or a parameter") from None
    full = parameter.name
    return DesignQuantity(
        full, parameter.quantity.unit, parameter.quantity.long_name, "design", lambda s, v: _own(full, v, s)
    )


@dataclass(frozen=True, kw_only=True)
class Objective:
    """Something to make small, or large.

    Parameters
    ----------
    quantity : str
        An outcome (its probability), a statistic of the runs, of one of several strikers too, as
        ``"peak_force_contact_2"``, a parameter, ``"speed"``, ``"stroke"``, ``"acceleration"`` or
        ``"cycles_to_settle"``.
    quantile : float, optional
        Quantile of a statistic, in (0, 1), to optimise; its mean by default.
    maximize : bool
        True if the quantity is to be large.

    See Also
    --------
    snapbeam.uncertainty.Constraint, snapbeam.uncertainty.optimize_design

    Examples
    --------
    >>> import snapbeam as sb
    >>> objective = sb.uncertainty.Objective(quantity="peak_force", quantile=0.9)
    >>> objective.maximize
    False
    """

    quantity: str
    quantile: float | None = None
    maximize: bool = False
    instead: ClassVar[dict[str, str]] = {
        "mean": 'leave it out, the mean of a statistic is the objective without quantile: {quantity = "peak_force"}'
    }

    def __post_init__(self) -> None:
        kind = quantity_of(self.quantity).kind
        if self.quantile is not None:
            within("quantile", self.quantile, 0.0, 1.0)
            if kind != "run":
                raise InputError(
                    f"quantile = {self.quantile:g} of {self.quantity}: only statistics of runs have quantiles"
                )

    @property
    def _quantity(self) -> DesignQuantity:
        """Quantity of interest."""
        return quantity_of(self.quantity)

    @property
    def label(self) -> str:
        """Name in datasets."""
        name = self.quantity.replace(".", "_")
        return name if self.quantile is None else f"{name}_q{100.0 * self.quantile:g}".replace(".", "_")

    @property
    def long_name(self) -> str:
        """Quantity that is minimised or maximised."""
        quantity = self._quantity
        if quantity.kind == "outcome":
            return f"probability that {quantity.long_name}"
        if self.quantile is not None:
            share = "median" if self.quantile == 0.5 else f"{self.quantile:g} quantile"
            return f"{share} of the {quantity.long_name}"
        return quantity.long_name if quantity.kind == "design" else f"mean {quantity.long_name}"

    def followed(self, values: _Array, changes: _Array) -> tuple[float, _Array]:
        """Value of runs, and its change where theirs, of shape (variables, runs), are small."""
        if self.quantile is None:
            return float(values.mean()), changes.mean(axis=1)
        one = np.argsort(values, kind="stable")[min(math.ceil(self.quantile * values.size) - 1, values.size - 1)]
        return float(values[one]), changes[:, one]

    def estimate(self, values: NDArray[Any], failed: int, confidence: float) -> tuple[float, float, float]:
        """Value and interval from runs that came to an end.

        Of an outcome Wilson's interval, of a mean Student's, of a quantile that of order statistics; none of a
        positive statistic goes below 0.
        """
        n, positive = values.size, is_positive(self.quantity) and not bool((values < 0.0).any())
        least = 0.0 if positive else -np.inf
        if self._quantity.kind == "outcome":
            found = proportion(int(values.sum()), n, confidence, failed)
            return float(found[0]), float(found[1]), float(found[2])
        if n < 2 or failed:  # a run that failed might have been anything
            middle = float(np.mean(values)) if n else float("nan")
            return middle, least, np.inf
        if self.quantile is None:
            if not np.isfinite(values).all():
                return np.inf, least, np.inf
            middle, low, high = map(float, mean_interval(values, confidence, positive))
            return middle, low, high
        middle, low, high = _quantile(np.sort(values), self.quantile, confidence)
        return middle, max(low, least), high


def _quantile(ordered: _Array, share: float, confidence: float) -> tuple[float, float, float]:
    """A quantile with the interval between order statistics, infinite where there are too few runs."""
    n = ordered.size
    middle = float(ordered[min(int(np.ceil(share * n)) - 1, n - 1)])
    low, high = stats.binom.ppf([0.5 * (1.0 - confidence), 0.5 * (1.0 + confidence)], n, share)
    below = float(ordered[int(low) - 1]) if low >= 1 else -np.inf
    above = float(ordered[int(high)]) if high < n else np.inf
    return middle, below, above


@dataclass(frozen=True, kw_only=True)
class Constraint:
    """Constraint of a design, with a probability.

    Parameters
    ----------
    quantity : str
        Name of the quantity, as in :class:`Objective`.
    lower, upper : float or str, optional
        Limits, at least one: a number in the unit of the quantity or text such as ``"5 N"``. Of an outcome *lower* is
        its probability, such as 0.95 of ``"other_well"``.
    probability : float
        Required fraction of systems for a constraint of a statistic of runs, in (0, 1).

    See Also
    --------
    snapbeam.uncertainty.Objective, snapbeam.uncertainty.optimize_design

    Examples
    --------
    >>> import snapbeam as sb
    >>> force = sb.uncertainty.Constraint(quantity="peak_force", upper=60.0, probability=0.9)  # N
    >>> force.upper
    60.0
    """

    quantity: str
    lower: float | None = None
    upper: float | None = None
    probability: float = 0.95
    scale: str = field(default="", init=False, repr=False)
    instead: ClassVar[dict[str, str]] = {
        "mean": 'limits hold for a share of the systems: {quantity = "peak_force", upper = "5 N", probability = 0.5} for the median'
    }

    def __post_init__(self) -> None:
        kind = quantity_of(self.quantity).kind
        if self.lower is None and self.upper is None:
            raise InputError(f"constraint of {self.quantity}: must have lower or upper")
        scales = {"" for each in (self.lower, self.upper) if each is not None and not isinstance(each, str)}
        for name in ("lower", "upper"):
            value = getattr(self, name)
            if isinstance(value, str):
                key, unit = scale_key(self.quantity, self._quantity.unit, value)
                scales.add(key)
                try:
                    value = number_in_unit(value, unit)
                except InputError as error:
                    raise InputError(f"{name} = {getattr(self, name)!r}, of {self.quantity}: {error}") from None
            if value is not None or getattr(self, name) is not None:
                object.__setattr__(self, name, finite(name, value))
        if len(scales) > 1:
            raise InputError(f"constraint of {self.quantity}: give both of lower and upper a unit, or none")
        object.__setattr__(self, "scale", scales.pop())
        within("probability", self.probability, 0.0, 1.0)
        if kind == "outcome":
            if self.upper is not None or self.lower is None:
                raise InputError(f"constraint of {self.quantity}: give its minimum probability as lower")
            within("lower", self.lower, 0.0, 1.0)
        elif self.lower is not None and self.upper is not None and self.lower > self.upper:
            raise InputError(
                f"constraint of {self.quantity}: lower = {self.lower:g} must not be more than upper = {self.upper:g}"
            )

    @property
    def _quantity(self) -> DesignQuantity:
        """Quantity of interest."""
        return quantity_of(self.quantity)

    @property
    def label(self) -> str:
        """Name in datasets."""
        return self.quantity.replace(".", "_")

    @property
    def required(self) -> float:
        """Required fraction of the runs that satisfy it."""
        return float(self.lower) if self._quantity.kind == "outcome" else self.probability  # type: ignore[arg-type]

    @property
    def _limits(self) -> tuple[float, float, float]:
        """Limits, infinite where there is none, and their size."""
        low, high = (-np.inf if self.lower is None else self.lower), (np.inf if self.upper is None else self.upper)
        return low, high, max(abs(self.lower or 0.0), abs(self.upper or 0.0), 1e-300)

    def room(self, values: _Array) -> _Array:
        """Distance from the nearest limit, negative beyond it."""
        low, high, _ = self._limits
        return np.asarray(np.minimum(values - low, high - values))

    def kept(self, values: NDArray[Any]) -> NDArray[np.bool_]:
        """Mask of the runs that satisfy it."""
        if self._quantity.kind == "outcome":
            return np.asarray(values, dtype=bool)
        low, high, _ = self._limits
        return np.asarray((values >= low) & (values <= high))

    def followed(self, values: _Array, changes: _Array, needed: int) -> tuple[float, _Array]:
        """Distance of the last of the *needed* runs from its limit, over its size, and its change."""
        (low, high, size), inside = self._limits, self.room(values)
        one = np.argsort(-inside, kind="stable")[min(needed, values.size) - 1]
        sign = 1.0 if values[one] - low < high - values[one] else -1.0
        return float(inside[one]) / size, sign * changes[:, one] / size

    def excess(self, values: _Array) -> _Array:
        """Constraint violation of designs, over its size; 0 if satisfied."""
        return np.asarray(np.maximum(-self.room(values), 0.0) / self._limits[2])


def _listed(objectives: Any, constraints: Any) -> tuple[tuple[Objective, ...], tuple[Constraint, ...]]:
    listed = (objectives,) if isinstance(objectives, (str, Objective)) else tuple(objectives)
    made = tuple(Objective(quantity=each) if isinstance(each, str) else each for each in listed)
    return made, (constraints,) if isinstance(constraints, Constraint) else tuple(constraints)


def require_kinds(objectives: Any, constraints: Any) -> tuple[tuple[Objective, ...], tuple[Constraint, ...]]:
    """Objectives and constraints as tuples."""
    made, kept = _listed(objectives, constraints)
    for each in made:
        if not isinstance(each, Objective):
            raise InputError(f"objectives: {shown(each)} must be an Objective, or the name of a quantity")
    for limit in kept:
        if not isinstance(limit, Constraint):
            raise InputError(f"constraints: {shown(limit)} must be a Constraint")
    if not 1 <= len(made) <= 3:
        raise InputError(f"objectives: {len(made)} of them; must be one to three")
    labels = [each.label for each in made]
    if len(set(labels)) < len(labels):
        raise InputError(f"objectives {labels}: must differ from each other")
    return made, kept


# A design problem: what may be chosen, what is to be small, what must hold; anything that optimises can drive it.


class Worth(NamedTuple):
    """Objectives and constraint violations of designs, from their runs."""

    objectives: _Array
    """Objectives to minimise, shape (designs, objectives): maxima are negated; infinite if unknown."""
    violation: _Array
    """Violation of the constraints, shape (designs,): 0 if all are satisfied with a margin."""
    runs: NDArray[np.int64]


class Estimate(NamedTuple):
    """Estimate of one design from independent validation samples, with intervals."""

    objectives: _Array
    """Value, lower and upper limit, of shape (objectives, 3), in their own signs."""
    constraints: _Array
    """Fraction of the runs that satisfy each constraint, with its interval, shape (constraints, 3)."""
    runs: int
    failed: int


@dataclass
class DesignProblem:
    """Variables with bounds, objectives and constraints, judged by numbered samples of a system.

    Made by :func:`snapbeam.uncertainty.design_problem`; ``evaluate`` is all that an optimiser needs.
    """

    trials: Trials
    bounds: dict[str, tuple[float, float]]
    """Bounds of the variables, by dotted name."""
    objectives: tuple[Objective, ...]
    constraints: tuple[Constraint, ...]
    samples: int = 64
    """Runs of a design while it is sought, the same samples for every one."""
    validation_samples: int = 400
    """Number of samples on which a design is checked later.

    The search asks for the share of runs whose lower 95 % limit, on that many samples, is the required one.
    """

    @property
    def names(self) -> tuple[str, ...]:
        """Variables by dotted name."""
        return tuple(self.bounds)

    def evaluate(self, designs: ArrayLike) -> Worth:
        """Evaluate designs on common random samples 0, 1, ....

        A design that breaks a constraint by what it is itself is not run.  Of the others a quarter of the runs is made
        first, and the rest of those that may still keep every constraint.

        Parameters
        ----------
        designs : array_like of shape (designs, variables)
            Values of the variables in the order of :attr:`names`.
        """
        return self.judge(designs)[0]

    def judge(self, designs: ArrayLike) -> tuple[Worth, _Array]:
        """Evaluate designs, with their distances from the constraints.

        Parameters
        ----------
        designs : array_like of shape (designs, variables)

        Returns
        -------
        Worth
        distances : array of shape (designs, constraints)
            Distance of the fraction of the runs that satisfy a constraint from the required one, or of a quantity of
            the design from its limit; negative if violated, NaN of a design that was not run.
        """
        x = finite_array("designs", designs, 2)
        if x.shape[1] != len(self.bounds):
            raise InputError(f"designs of shape {x.shape}: must have {len(self.bounds)} variables")
        table = np.array(list(self.bounds.values()))
        if (x < table[:, 0] - 1e-12).any() or (x > table[:, 1] + 1e-12).any():
            raise InputError("designs: must lie within their bounds")
        objectives = np.full((len(x), len(self.objectives)), np.inf)
        violation = self._own_excess(x)
        runs = np.zeros(len(x), dtype=np.int64)
        distances = np.full((len(x), len(self.constraints)), np.nan)
        for k, constraint in enumerate(self.constraints):
            if constraint._quantity.kind == "design":
                distances[:, k] = self.room(constraint, x)
        alive = np.flatnonzero(violation == 0.0)
        if not self._needs_runs:
            for k, objective in enumerate(self.objectives):
                objectives[alive, k] = self._sign(objective) * self._own(objective, x[alive])
            return Worth(objectives, violation, runs), distances
        first = max(4, self.samples // 4)
        parts: dict[int, list[dict[str, NDArray[Any]]]] = {int(i): [] for i in alive}
        for begin, end in ((0, first), (first, self.samples)):
            if not alive.size or end <= begin:
                break
            for i, found in zip(alive.tolist(), self.runs_of(x[alive], np.arange(begin, end)), strict=True):
                parts[i].append(found)
                runs[i] = end
            joined = {
                i: {n: np.concatenate([part[n] for part in parts[i]]) for n in parts[i][0]} for i in alive.tolist()
            }
            last = end == self.samples
            for i in alive.tolist():
                for k, constraint in enumerate(self.constraints):
                    if constraint._quantity.kind != "design":
                        distances[i, k] = self._kept(constraint, joined[i]).mean() - constraint.required
                if last or self._missing(joined[i], hopeful=True) > 0.0:
                    violation[i] = self._missing(joined[i])
            if last:
                for i in alive[violation[alive] == 0.0].tolist():
                    objectives[i] = self._objectives_of(x[i : i + 1], joined[i])
            alive = alive[violation[alive] == 0.0]
        return Worth(objectives, violation, runs), distances

    def estimate(self, design: ArrayLike, numbers: NDArray[np.int64], confidence: float = 0.95) -> Estimate:
        """Estimate the objectives and constraints of one design from the given samples, with intervals."""
        x = finite_array("design", design, 1)[None]
        found = self.runs_of(x, numbers)[0]
        good = reached(found)
        failed = int((~good).sum())
        objectives = np.empty((len(self.objectives), 3))
        for row, objective in zip(objectives, self.objectives, strict=True):
            if objective._quantity.kind == "design":
                row[:] = self._own(objective, x)[0]
            else:
                values = objective._quantity.of(self.trials.system, found)[good]
                row[:] = objective.estimate(values, failed, confidence)
        constraints = np.ones((len(self.constraints), 3))
        for row, constraint in zip(constraints, self.constraints, strict=True):
            if constraint._quantity.kind == "design":
                row[:] = float(constraint.excess(self._own(constraint, x))[0] == 0.0)
                continue
            kept = self._kept(constraint, found)
            row[0] = kept.sum() / max(int(good.sum()), 1)
            row[1] = float(proportion(int(kept.sum()), good.size, confidence)[1])
            row[2] = float(proportion(int(kept.sum()) + failed, good.size, confidence)[2])
        return Estimate(objectives, constraints, int(good.size), failed)

    def runs_of(self, x: _Array, numbers: NDArray[np.int64]) -> list[dict[str, NDArray[Any]]]:
        """Statistics and columns of the runs of designs, each on the same samples."""
        each = np.repeat(np.arange(len(x)), numbers.size)
        points: Columns = {name: x[each, j] for j, name in enumerate(self.bounds)}
        columns = self.trials.columns(points, np.tile(numbers, len(x)))
        found = self.trials.of_columns(columns)
        own = self.trials.system.parameters
        fixed = {name: np.full(each.size, value) for name, value in own.items() if isinstance(value, float)}
        whole = fixed | columns | found
        if "cycles_to_settle" in {each.quantity for each in self._parts}:
            whole[CYCLE] = self.trials.cycles(columns)
        return [{name: values[each == i] for name, values in whole.items()} for i in range(len(x))]

    @property
    def _parts(self) -> tuple[Objective | Constraint, ...]:
        """Objectives and constraints."""
        return (*self.objectives, *self.constraints)

    @property
    def _needs_runs(self) -> bool:
        return {each._quantity.kind for each in self._parts} != {"design"}

    @property
    def not_smooth(self) -> str:
        """Reason why the search has no gradients; empty if it has."""
        if len(self.objectives) > 1:
            return "there are several objectives"
        for each in self._parts:
            name, kind = each.quantity, each._quantity.kind
            known = kind == "design" or (kind == "run" and name in STATISTICS)
            if why := "changes by jumps" if not known else not_smooth(name) if kind == "run" else "":
                return f"{name} {why}"
        return "" if self._needs_runs else "no run is needed"

    def slopes(self, design: _Array) -> tuple[_Array, _Array] | None:
        """Objective to minimise and slacks of the constraints of one design on the common samples, with their derivatives.

        Enough runs satisfy a constraint if the last one that is needed does: its distance from the limit is the slack,
        and as smooth as the statistic. Derivatives of statistics are exact; None where the core takes none.

        Returns
        -------
        values : array of shape (1 + constraints,)
        derivatives : array of shape (1 + constraints, variables)
        """
        low, high = np.array(list(self.bounds.values())).T
        moves, numbers = _MOVE * np.diag(high - low), np.arange(self.samples)
        near = np.clip(np.concatenate([[design], design + moves, design - moves]), low, high)
        distance = np.diag(near[1 : 1 + low.size] - near[1 + low.size :])
        made = [self.trials.columns({n: np.full(numbers.size, v) for n, v in zip(self.bounds, row, strict=True)}, numbers)
                for row in near]  # fmt: skip
        pairs = list(zip(made[1 : 1 + low.size], made[1 + low.size :], strict=True))
        found = slopes_of_runs(self.trials.system, self.trials.integration, made[0], pairs)
        if found is None or not reached(found[0]).all():
            return None
        self.trials.runs += numbers.size
        answers = []
        for each in self._parts:
            if each._quantity.kind == "design":
                own = self._own(each, near)
                runs, changes = own[:1], (own[1 : 1 + low.size] - own[1 + low.size :])[:, None]
            else:
                runs, changes = found[0][each.quantity], np.array([change[each.quantity] for change in found[1]])
            if isinstance(each, Objective):
                value, change = each.followed(runs, changes)
                answers.append(self._sign(each) * np.append(value, change / distance))
            else:
                needed = _share_for(each.required, self.validation_samples) * runs.size
                if each.scale:  # what runs have over a length or velocity of their own system
                    unit, of_units = found[0][each.scale], np.array([change[each.scale] for change in found[1]])
                    runs, changes = unit * runs, unit * changes + of_units * runs
                value, change = each.followed(runs, changes, math.ceil(needed - 1e-9))
                answers.append(np.append(value, change / distance))
        table = np.array(answers)
        return table[:, 0], table[:, 1:]

    def _own(self, of: Objective | Constraint, x: _Array) -> _Array:
        """A quantity of designs themselves, in units of the nominal system of each."""
        values = np.empty(len(x))
        structural = [name for name in self.bounds if not lookup(name).is_run]
        for i, row in enumerate(x):
            point = dict(zip(self.bounds, row.tolist(), strict=True))
            changes = {name: point[name] for name in structural}
            system = self.trials.system.replace(**changes) if changes else self.trials.system
            plain = {name: np.array([value]) for name, value in point.items()}
            values[i] = float(np.ravel(of._quantity.of(system, plain))[0])
        return values

    def room(self, constraint: Constraint, x: _Array) -> _Array:
        """Distance of a quantity of designs themselves from the nearest limit of a constraint, negative beyond it."""
        return constraint.room(self._own(constraint, x))

    def _own_excess(self, x: _Array) -> _Array:
        found = np.zeros(len(x))
        for constraint in self.constraints:
            if constraint._quantity.kind == "design":
                found += constraint.excess(self._own(constraint, x))
        # beyond what any share of runs can break: such a design is never run
        return np.where(found > 0.0, found + len(self.constraints), 0.0)

    @staticmethod
    def _sign(objective: Objective) -> float:
        return -1.0 if objective.maximize else 1.0

    def _objectives_of(self, x: _Array, found: dict[str, NDArray[Any]]) -> _Array:
        good = reached(found)
        values = []
        for objective in self.objectives:
            if objective._quantity.kind == "design":
                values.append(float(self._own(objective, x)[0]))
            else:
                runs = objective._quantity.of(self.trials.system, found)[good]
                values.append(objective.estimate(runs, 0, 0.95)[0] if runs.size else np.inf)
        signed = np.multiply([self._sign(objective) for objective in self.objectives], values)
        return np.where(np.isfinite(signed), signed, np.inf)

    def _kept(self, constraint: Constraint, found: dict[str, NDArray[Any]]) -> NDArray[np.bool_]:
        """Mask of the runs that satisfy a constraint; failed runs satisfy none."""
        values = constraint._quantity.of(self.trials.system, found)
        values = values * found[constraint.scale] if constraint.scale else values
        return np.asarray(constraint.kept(values) & reached(found))

    def _missing(self, found: dict[str, NDArray[Any]], *, hopeful: bool = False) -> float:
        """Deficit of the fractions of runs that satisfy the constraints; failed runs satisfy none.

        *hopeful*: by how much they are too small even if they are as great as the runs let hope, without a margin.
        """
        total = 0.0
        for constraint in self.constraints:
            if constraint._quantity.kind == "design":
                continue
            kept = self._kept(constraint, found)
            share = float(kept.mean())
            wanted = _share_for(constraint.required, self.validation_samples)
            if hopeful:
                share, wanted = float(proportion(int(kept.sum()), kept.size, _SURE)[2]), constraint.required
            total += max(0.0, wanted - share)
        return total


def _share_for(required: float, runs: int, confidence: float = 0.95) -> float:
    """The smallest share of *runs* whose lower limit is at least *required*; 1 if there is none."""
    low = np.asarray(proportion(np.arange(runs + 1), np.full(runs + 1, runs), confidence)[1])
    enough = np.flatnonzero(low >= required)
    return float(enough[0] / runs) if enough.size else 1.0


def problem_of(
    trials: Trials, variables: Any, objectives: Any, constraints: Any, samples: int, validation_samples: int
) -> DesignProblem:
    """Check variables, objectives and constraints."""
    if not isinstance(variables, Mapping) or not variables:
        raise InputTypeError(f"variables = {shown(variables)}: must map at least one parameter to (low, high)")
    bounds: dict[str, tuple[float, float]] = {}
    for name, pair in variables.items():
        row = trials.system.parameter(str(name))
        if row.quantity.kind is not float or row.section == "integration":
            raise InputError(f"{name}: cannot be chosen; must be a real number of the system")
        try:
            numbers = (number_in_unit(each, row.quantity.unit) if isinstance(each, str) else each for each in pair)
            low, high = (float(row.quantity.check(str(name), each)) for each in numbers)
        except (TypeError, ValueError) as error:
            if isinstance(error, InputError):
                raise
            raise InputTypeError(f"{name} = {shown(pair)}: must be two numbers (low, high)") from None
        if not low < high:
            raise InputError(f"{name} = ({low:g}, {high:g}): low must be less than high")
        if row.name in bounds:
            raise InputError(f"{name}: is given twice among the variables")
        bounds[row.name] = (low, high)
    made, kept = require_kinds(objectives, constraints)
    require_held(
        [*(objective.quantity for objective in made), *(constraint.quantity for constraint in kept)], trials.system
    )
    if any(constraint.scale for constraint in kept):
        trials = replace(trials, scaled=True)
    integer("samples", samples, 8, 10**6)
    if trials.uncertainty.is_empty:
        raise InputError("uncertainty: nothing is uncertain, so every probability is 0 or 1; give tolerances")
    integer("validation_samples", validation_samples, 20, 10**7)
    return DesignProblem(trials, bounds, made, kept, samples, validation_samples)


_STALLED, _IMPROVED = 10, 1e-4
"""Generations without an improvement of the best design by more than this share after which the search stops."""
_DIFFERENTIATED = 25
"""Maximum number of designs that are differentiated at the end of a search."""
_MOVE, _KEPT = 1e-6, 1e-6
"""Change of a variable, over its range, with which the numbers of runs are differentiated; slack that gradients leave."""
_CLOSE = 1e-3
"""Distance of two designs, over the range of each variable, below which they are not refined."""
CHECK, REPORT = 10**9, 2 * 10**9
"""First numbers of the samples by which candidates are chosen, and of those by which the chosen are reported."""
SATISFIED = ("violated", "undecided", "satisfied")


@dataclass(frozen=True, kw_only=True)
class OptimizerSettings:
    """Settings of the optimiser: generations, population, samples and validation.

    Parameters
    ----------
    generations : int
        Number of generations, the first included.
    population : int
        Designs of a generation, at least 6.
    samples : int
        Runs of a design during the search, at least 8.
    validation_samples : int
        Validation samples of a design, and again of a reported one of a front; a single design is reported from four
        times as many.
    candidates : int
        Maximum number of designs to validate until one satisfies the constraints.
    refinements : int
        Maximum number of further designs to validate, between the feasible one and better infeasible ones.
    confidence : float
        Confidence level of the intervals, in (0, 1).
    seed : int
        Seed of the search.

    See Also
    --------
    snapbeam.uncertainty.optimize_design

    Examples
    --------
    >>> import snapbeam as sb
    >>> settings = sb.uncertainty.OptimizerSettings(generations=10, population=12, samples=32)
    >>> settings.validation_samples
    400
    """

    generations: int = 30
    population: int = 24
    samples: int = 64
    validation_samples: int = 400
    candidates: int = 8
    refinements: int = 12
    confidence: float = 0.95
    seed: int = 0

    def __post_init__(self) -> None:
        integer("generations", self.generations, 1, 10**6)
        integer("population", self.population, 6, 10**5)
        integer("samples", self.samples, 8, 10**6)
        integer("validation_samples", self.validation_samples, 20, 10**7)
        integer("candidates", self.candidates, 1, 10**4)
        integer("refinements", self.refinements, 0, 10**4)
        within("confidence", self.confidence, 0.0, 1.0)
        integer("seed", self.seed, 0, 2**63 - 1)

    @property
    def max_runs(self) -> int:
        """Runs that a design takes at most, of one objective."""
        return (
            self.generations * self.population * self.samples
            + (self.candidates + self.refinements + _REPORT_FACTOR) * self.validation_samples
        )


@checked
def design_problem(
    system: System,
    variables: Mapping[str, tuple[float, float]],
    objectives: Any,
    constraints: Any,
    uncertainty: ParameterUncertainty,
    *,
    samples: int = 64,
    validation_samples: int = 400,
    integration: Integration | None = None,
    checkpoint: str | os.PathLike[str] | CheckpointOptions | None = None,
) -> DesignProblem:
    """A design problem for an optimiser of one's own, such as pymoo's, Optuna's or Ax's; as in :func:`optimize_design`.

    Returns
    -------
    DesignProblem
        Its ``evaluate(designs)`` gives objectives and violations of rows of designs, on the same samples each time; its
        ``estimate(design, numbers)`` intervals on samples of any numbers.

    See Also
    --------
    snapbeam.uncertainty.optimize_design, snapbeam.uncertainty.DifferentialEvolution

    Examples
    --------
    >>> import snapbeam as sb
    >>> from snapbeam import paper
    >>> system = paper.struck_beam(frequency_ratio=1.2, velocity_amplitude=0.18)
    >>> uncertainty = sb.uncertainty.ParameterUncertainty(
    ...     of={"contact.stiffness": sb.uncertainty.LogNormal(0.2), "location": sb.uncertainty.Normal(0.005)}
    ... )
    >>> problem = sb.uncertainty.design_problem(
    ...     system, {"velocity_amplitude": (0.05, 0.4)}, "speed", sb.uncertainty.Constraint(quantity="snap", lower=0.8),
    ...     uncertainty, samples=8, integration=sb.Integration(cycles=5),
    ... )
    >>> objectives, violation, runs = problem.evaluate([[0.1], [0.3]])
    >>> objectives.shape
    (2, 1)
    """
    trials = trials_of(system, uncertainty, integration, checkpoint=checkpoint, early=_early(objectives, constraints))
    return problem_of(trials, variables, objectives, constraints, samples, validation_samples)


@checked
def optimize_design(
    system: System,
    variables: Mapping[str, tuple[float, float]],
    objectives: Any,
    constraints: Any,
    uncertainty: ParameterUncertainty,
    settings: OptimizerSettings | None = None,
    *,
    integration: Integration | None = None,
    checkpoint: str | os.PathLike[str] | CheckpointOptions | None = None,
    progress: Callable[[int, int], object] | bool | None = None,
) -> xr.Dataset:
    """Minimise objectives under constraints that hold with a stated probability.

    Generalised differential evolution searches designs on common samples. The best ones are checked on validation
    samples until one satisfies its constraints; bisection towards better designs that violate one brings it to them.
    Further samples report the result, so that the search does not bias the intervals. The search stops after ten
    generations without progress.

    The search of one objective ends with sequential quadratic programming from the best design, with exact gradients
    through the runs, if statistics and variables have them (:func:`snapbeam.uncertainty.gradient`): a required share of
    runs is the statistic of the last run that is needed. Probabilities of outcomes, counts and classes change by jumps.

    Parameters
    ----------
    system : System
        The nominal system.
    variables : mapping of str to (low, high)
        Real parameters to choose, with their limits.
    objectives : Objective or str, or a list of up to three
        Quantities to minimise; several give the Pareto front.
    constraints : Constraint, or a list of them
        Conditions on a design.
    uncertainty : ParameterUncertainty
        Uncertain parameters and initial state of the system.
    settings : OptimizerSettings, optional
        Settings of the optimiser.
    integration : Integration, optional
        Settings of the runs.
    checkpoint, progress : optional
        Folder and report of generations, as in :func:`snapbeam.sweep`.

    Returns
    -------
    xarray.Dataset
        Variables over ``design``, one, or a front ordered by its first objective: each parameter; ``objective_...``
        with ``_low``, ``_high`` and ``_sought``, the value of the search; ``satisfied_...``, the fraction of systems
        that satisfy a constraint, with ``_low`` and ``_high``, and ``required_...``; ``constraints_satisfied``: every
        lower limit reaches its required fraction, some upper limit does not, or neither is known; ``distance_...`` of
        the fraction from the required one, or of a quantity from its limit. Along ``tried``: every evaluated design,
        its ``tried_distance_...`` and ``violation``. If no design satisfies the constraints, the one with the least
        violation is reported, with a :class:`~snapbeam.DiagnosticWarning`. ``termination_reason`` is of search and
        refinement.

    See Also
    --------
    snapbeam.uncertainty.Objective, snapbeam.uncertainty.Constraint, snapbeam.uncertainty.OptimizerSettings

    Examples
    --------
    >>> import snapbeam as sb
    >>> from snapbeam import paper
    >>> system = paper.struck_beam(frequency_ratio=1.2, velocity_amplitude=0.18)
    >>> uncertainty = sb.uncertainty.ParameterUncertainty(
    ...     of={"contact.stiffness": sb.uncertainty.LogNormal(0.2), "location": sb.uncertainty.Normal(0.005)}
    ... )
    >>> best = sb.uncertainty.optimize_design(
    ...     system, {"velocity_amplitude": (0.05, 0.4)}, "speed", sb.uncertainty.Constraint(quantity="snap", lower=0.8),
    ...     uncertainty, sb.uncertainty.OptimizerSettings(generations=3, population=6, samples=12, validation_samples=40),
    ...     integration=sb.Integration(cycles=5),
    ... )
    >>> best.velocity_amplitude.dims
    ('design',)
    """
    settings = or_default("settings", settings, OptimizerSettings, "an OptimizerSettings")
    problem = design_problem(
        system, variables, objectives, constraints, uncertainty, samples=settings.samples,
        validation_samples=settings.validation_samples, integration=integration, checkpoint=checkpoint,
    )  # fmt: skip
    report = counting(progress, "design", "generations")
    search = DifferentialEvolution(list(problem.bounds.values()), settings.population, settings.seed)
    tried: list[tuple[_Array, _Array, _Array, _Array]] = []
    stopped, stalled, before = f"{settings.generations} generations", 0, None
    for generation in range(settings.generations):
        asked = search.ask()
        worth, distances = problem.judge(asked)
        tried.append((asked, worth.objectives, worth.violation, distances))
        search.tell(worth.objectives, worth.violation)
        stalled = stalled + 1 if before is not None and not _improved(search, before) else 0
        before = search.violation[0], search.objectives.copy()
        if report is not None:
            report(generation + 1, settings.generations)
        if stalled >= _STALLED:
            stopped = f"{generation + 1} generations, the last {_STALLED} without progress"
            break
    why = problem.not_smooth
    polished, count = (search.designs[0], 0) if why else _polished(problem, search.designs[0])
    if count:
        worth, distances = problem.judge(polished[None])
        tried.append((polished[None], worth.objectives, worth.violation, distances))
        stopped += f"; gradients of {count} designs from the best one"
    else:
        stopped += f"; without gradients: {why or 'runs have no exact derivatives by these variables'}"
    x, objective_values, violation, distances = (np.concatenate(parts) for parts in zip(*tried, strict=True))
    if not (violation == 0.0).any():
        words = f"none of the {len(x)} designs satisfies the constraints; the one that violates them least is reported"
        chosen, factor, stopped = [int(np.argmin(violation))], 1, f"{stopped}; {words}"
    elif len(problem.objectives) > 1:
        chosen, factor = _front(objective_values, violation), 1
    else:
        kept = _refined(problem, settings, x, objective_values, violation)
        x, objective_values, violation, distances = (
            np.concatenate([known, np.array(more)]) if more else known
            for known, more in (
                (x, kept.x), (objective_values, kept.objectives), (violation, kept.violation), (distances, kept.distances),
            )
        )  # fmt: skip
        chosen, factor, stopped = [kept.chosen], _REPORT_FACTOR, f"{stopped}; {kept.reason}"
    numbers = np.arange(REPORT, REPORT + factor * settings.validation_samples)
    found = [problem.estimate(x[i], numbers, settings.confidence) for i in chosen]
    dataset = _dataset(problem, settings, (x, objective_values, violation, distances), chosen, found)
    if not (dataset["constraints_satisfied"] == SATISFIED.index("satisfied")).any():
        tell([Diagnostic("NO_FEASIBLE_DESIGN", f"constraints: no reported design is known to satisfy them ({stopped}); widen the bounds, "
                         "loosen a constraint or use more generations")])  # fmt: skip
    return dataset.assign_attrs(termination_reason=stopped)


def _improved(search: DifferentialEvolution, before: tuple[float, _Array]) -> bool:
    """Return whether a generation improved: the best design (one objective), or any of the population (several)."""
    violation, objectives = before
    if search.violation[0] != violation:
        return True
    if objectives.shape[1] > 1 or violation > 0.0:
        return not np.array_equal(search.objectives, objectives)
    best, now = float(objectives[0, 0]), float(search.objectives[0, 0])
    return bool(now < best - _IMPROVED * abs(best))


def _early(objectives: Any, constraints: Any) -> bool:
    """Return whether early termination is allowed: not if a statistic of the runs is requested."""
    parts: list[Any] = [part for parts in _listed(objectives, constraints) for part in parts]
    return all(getattr(each, "quantity", None) is not None and each._quantity.kind != "run" for each in parts)


def _front(objectives: _Array, violation: _Array) -> list[int]:
    """The front, by its first objective."""
    good = np.flatnonzero(violation == 0.0)
    front = good[front_of(objectives[good])]
    _, unique = np.unique(objectives[front], axis=0, return_index=True)
    kept = front[np.sort(unique)]
    return [int(i) for i in kept[np.argsort(objectives[kept, 0], kind="stable")]]


def _polished(problem: DesignProblem, begin: _Array) -> tuple[_Array, int]:
    """Best design on the way of sequential quadratic programming with exact gradients, and how many were differentiated."""
    low, high = np.array(list(problem.bounds.values())).T
    known: dict[bytes, tuple[_Array, _Array]] = {}

    def at(unit: _Array) -> tuple[_Array, _Array]:
        inside = np.clip(unit, 0.0, 1.0)
        if inside.tobytes() not in known:
            came = problem.slopes(low + (high - low) * inside) if len(known) < _DIFFERENTIATED else None
            if came is None or not np.isfinite(np.column_stack(came)).all():
                raise FloatingPointError
            known[inside.tobytes()] = came[0] - _KEPT * (np.arange(came[0].size) > 0), came[1] * (high - low)
        return known[inside.tobytes()]

    with contextlib.suppress(FloatingPointError):  # a jump on the way: what was found before it counts
        start = (begin - low) / (high - low)
        size = max(abs(float(at(start)[0][0])), 1e-300)
        optimize.minimize(
            lambda u: at(u)[0][0] / size, start, jac=lambda u: at(u)[1][0] / size, method="SLSQP",
            bounds=[(0.0, 1.0)] * low.size, options={"ftol": _IMPROVED},
            constraints={"type": "ineq", "fun": lambda u: at(u)[0][1:], "jac": lambda u: at(u)[1][1:]},
        )  # fmt: skip
    best = min(
        known, key=lambda unit: (max(0.0, -known[unit][0][1:].min(initial=0.0)), known[unit][0][0]), default=None
    )
    return begin if best is None else low + (high - low) * np.frombuffer(best), len(known)


@dataclass
class _Refined:
    """The design that is reported, and designs that were checked beyond those of the search."""

    chosen: int
    reason: str
    x: list[_Array]
    objectives: list[_Array]
    violation: list[float]
    distances: list[_Array]


def _refined(
    problem: DesignProblem, effort: OptimizerSettings, x: _Array, objectives: _Array, violation: _Array
) -> _Refined:
    """The best design that holds on independent validation samples, brought to its constraints."""
    sign = -1.0 if problem.objectives[0].maximize else 1.0
    numbers = np.arange(CHECK, CHECK + effort.validation_samples)

    def check(design: _Array) -> tuple[bool, float, float, _Array]:
        """Return whether a design satisfies the constraints, its signed objective, the deficit and the distances."""
        found = problem.estimate(design, numbers, effort.confidence)
        state, short = _holds(problem, found)
        return (state == 2, sign * float(found.objectives[0, 0]), short, _distances(problem, design[None], [found])[0])

    good = np.flatnonzero(violation == 0.0)
    order = good[np.argsort(objectives[good, 0], kind="stable")]
    ranked: list[int] = []
    for i in order.tolist():  # a population that has converged holds the same design many times over
        if not any(np.allclose(x[i], x[j], rtol=1e-3, atol=0.0) for j in ranked[-20:]):
            ranked.append(i)
    # ever further down the list, where designs cost more and promise more
    steps = np.unique(np.geomspace(1, len(ranked), min(effort.candidates, len(ranked))).astype(np.int64)) - 1
    lacking: list[tuple[float, int]] = []
    best, value, beyond = -1, np.inf, None
    for i in (ranked[k] for k in steps.tolist()):
        holds, value, short, _ = check(x[i])
        if holds:
            best = i
            break
        lacking.append((short, i))
        beyond = x[i]
    if best < 0:
        words = (
            f"none of {len(lacking)} checked designs satisfies the constraints; the one that lacks least is reported"
        )
        return _Refined(min(lacking)[1], words, [], [], [], [])
    low, high = np.array(list(problem.bounds.values())).T
    inside, chosen = x[best], best
    made = _Refined(best, "", [], [], [], [])
    broken = np.flatnonzero(violation > 0.0)
    distance = np.abs((x[broken] - inside) / (high - low)).max(axis=1)
    targets = broken[np.argsort(distance, kind="stable")].tolist()
    checked = 0
    while checked < effort.refinements:
        if beyond is None:
            if not targets:
                made.reason = f"refined until no design was left to compare, after {checked} checked designs"
                break
            tried = x[targets.pop(0)]
        else:
            tried = 0.5 * (inside + beyond)
        if np.abs((tried - inside) / (high - low)).max() < _CLOSE:
            if beyond is None:
                continue
            made.reason = f"refined to a constraint, after {checked} checked designs"
            break
        checked += 1
        holds, found, short, distances = check(tried)
        made.x.append(tried)
        made.objectives.append(np.array([found]))
        made.violation.append(short)
        made.distances.append(distances)
        if holds and found < value:
            inside, value, chosen = tried, found, len(x) + len(made.x) - 1
        elif not holds and found < value:
            beyond = tried
        else:  # nothing is gained in this direction
            beyond = None
    made.reason = made.reason or f"refined with {checked} checked designs, the maximum (refinements)"
    made.chosen = chosen
    return made


def _distances(problem: DesignProblem, x: _Array, found: list[Estimate]) -> _Array:
    """Distances of designs from their constraints, shape (designs, constraints), as :meth:`DesignProblem.judge`."""
    distances = np.empty((len(x), len(problem.constraints)))
    for k, constraint in enumerate(problem.constraints):
        if constraint._quantity.kind == "design":
            distances[:, k] = problem.room(constraint, x)
        else:
            distances[:, k] = [each.constraints[k, 0] - constraint.required for each in found]
    return distances


def _holds(problem: DesignProblem, found: Estimate) -> tuple[int, float]:
    """Status of the constraints: satisfied (2), violated (0) or undecided (1); and the largest possible deficit."""
    required = np.array([constraint.required for constraint in problem.constraints])
    own = np.array([constraint._quantity.kind == "design" for constraint in problem.constraints], dtype=bool)
    wanted = np.where(own, 1.0, required)
    deficits: _Array = np.maximum(wanted - found.constraints[:, 1], 0.0)
    short = float(deficits.sum())
    if short == 0.0:
        return 2, 0.0
    return (0 if (found.constraints[:, 2] < wanted).any() else 1), short


def _dataset(
    problem: DesignProblem,
    effort: OptimizerSettings,
    tried: tuple[_Array, _Array, _Array, _Array],
    chosen: list[int],
    found: list[Estimate],
) -> xr.Dataset:
    from snapbeam.util.datasets import xr

    trials = problem.trials
    attrs: dict[str, Any] = {
        "title": "designs of a struck bistable beam", "system": trials.system.hash,
        "uncertainty": canonical_json(trials.uncertainty.describe()), "samples": effort.samples, "validation_samples": effort.validation_samples,
        "generations": effort.generations, "population": effort.population, "confidence": effort.confidence,
        "refinements": effort.refinements, "seed": effort.seed, "uncertainty_seed": trials.uncertainty.seed, "runs_made": trials.runs,
        "cycles": trials.integration.cycles_or_default, "modes": trials.system.model.modes,
    }  # fmt: skip
    if all(lookup(name).is_run for name in problem.names):  # otherwise the wells differ between designs
        attrs |= {"initial_well": trials.system.start_well, "initial_well_reason": trials.system.initial_well_reason}
    attrs |= {f"fixed_{lookup(name).short}": +value for name, value in in_table(trials.system.parameters).items()
              if isinstance(value, (int, float)) and name not in problem.bounds}  # fmt: skip
    if trials.system.model.beam is None:
        attrs["length_scale"] = trials.system.scale.length
    dataset = xr.Dataset(attrs=attrs)
    x, objectives, violation, distances = tried
    reported = _distances(problem, x[chosen], found)
    for j, name in enumerate(problem.names):
        row = lookup(name)
        labels = {"units": row.quantity.unit, "long_name": row.quantity.long_name, "parameter": name}
        dataset[row.short] = (("design",), x[chosen, j], labels)
        dataset[f"tried_{row.short}"] = (("tried",), x[:, j], labels)
    for k, objective in enumerate(problem.objectives):
        sign = -1.0 if objective.maximize else 1.0
        own = {"units": objective._quantity.unit, "long_name": objective.long_name}
        for end, values in zip(("", "_low", "_high"), np.array([each.objectives[k] for each in found]).T, strict=True):
            dataset[f"objective_{objective.label}{end}"] = (("design",), values, own)
        dataset[f"objective_{objective.label}_sought"] = (("design",), sign * objectives[chosen, k], own)
        seen = np.where(np.isfinite(objectives[:, k]), sign * objectives[:, k], np.nan)
        dataset[f"tried_objective_{objective.label}"] = (("tried",), seen, own)
    for k, constraint in enumerate(problem.constraints):
        own = {"units": "1", "long_name": f"fraction of systems that satisfy the constraint of {constraint.quantity}"}
        own |= {name: value for name in ("lower", "upper") if (value := getattr(constraint, name)) is not None}
        for end, values in zip(("", "_low", "_high"), np.array([each.constraints[k] for each in found]).T, strict=True):
            dataset[f"satisfied_{constraint.label}{end}"] = (("design",), values, own)
        required = 1.0 if constraint._quantity.kind == "design" else constraint.required
        dataset[f"required_{constraint.label}"] = ((), required, {"units": "1", "long_name": "required fraction"})
        unit, about = constraint._quantity.unit, f"distance of {constraint.quantity} from its limit"
        if constraint._quantity.kind != "design":
            unit, about = "1", f"distance of the fraction that satisfies the constraint of {constraint.quantity}"
            about = f"{about} from the required one"
        labels = {"units": unit, "long_name": f"{about}; negative: violated"}
        dataset[f"distance_{constraint.label}"] = (("design",), reported[:, k], labels)
        dataset[f"tried_distance_{constraint.label}"] = (("tried",), distances[:, k], labels)
    states = np.array([_holds(problem, each)[0] for each in found], dtype=np.int8)
    flags = {"flag_values": np.arange(3, dtype=np.int8), "flag_meanings": " ".join(SATISFIED)}
    words = {"units": "1", "long_name": "whether the constraints are satisfied"}
    dataset["constraints_satisfied"] = (("design",), states, words | flags)
    failed = np.array([each.failed for each in found])
    labels = {"units": "1", "long_name": "runs that failed; they satisfy no constraint"}
    dataset["runs_failed"] = (("design",), failed, labels)
    labels = {"units": "1", "long_name": "violation of the constraints; 0 where they are satisfied"}
    dataset["violation"] = (("tried",), violation, labels)
    return dataset
