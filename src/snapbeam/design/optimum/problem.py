"""A design problem: what may be chosen, what is to be small, what must hold; anything that optimises can drive it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from snapbeam.config.parameters import lookup
from snapbeam.core.validate import InputError, InputTypeError, finite_array, integer, shown
from snapbeam.design.events import reached, require_held
from snapbeam.design.optimum.measures import CYCLE, Objective, Constraint, require_kinds
from snapbeam.design.proportion import wilson
from snapbeam.design.trials import Trials
from snapbeam.sweeps.points import Columns

__all__ = ["DesignProblem", "Estimate", "Worth"]

_Array = NDArray[np.float64]
_SURE = 0.99
"""Of the interval by which a design is dropped after a quarter of its runs."""


class Worth(NamedTuple):
    """What some designs are worth, by the runs that were made of them."""

    goals: _Array
    """Of shape (designs, goals), to be made small: a goal that is to be large is negated; infinite where not known."""
    violation: _Array
    """Of shape (designs,): 0 where every limit is kept by the share of the runs that it asks for, and a margin."""
    runs: NDArray[np.int64]


class Estimate(NamedTuple):
    """What one design is worth on fresh draws, with intervals."""

    goals: _Array
    """Value, lower and upper limit, of shape (goals, 3), in their own signs."""
    limits: _Array
    """Share of the runs that keep each limit with its interval, of shape (limits, 3)."""
    runs: int
    failed: int


@dataclass
class DesignProblem:
    """Variables with bounds, goals and limits, judged by numbered draws of a system.

    Made by :func:`snapbeam.design_problem`; ``evaluate`` is all that an optimiser needs.
    """

    trials: Trials
    bounds: dict[str, tuple[float, float]]
    """By dotted name."""
    goals: tuple[Objective, ...]
    limits: tuple[Constraint, ...]
    draws: int = 64
    """Runs of a design while it is sought, the same draws for every one."""
    margin: float = 0.5
    """Share of the misses that a limit allows which is not used up while designs are sought."""

    @property
    def names(self) -> tuple[str, ...]:
        """Variables by dotted name."""
        return tuple(self.bounds)

    def evaluate(self, designs: ArrayLike) -> Worth:
        """What designs are worth on the common draws 0, 1, ..., the same for each.

        A design that breaks a limit by what it is itself is not run.  Of the others a quarter of the runs is made
        first, and the rest of those that may still keep every limit.

        Parameters
        ----------
        designs : array_like of shape (designs, variables)
            In the order of :attr:`names`.
        """
        x = finite_array("designs", designs, 2)
        if x.shape[1] != len(self.bounds):
            raise InputError(f"designs of shape {x.shape}: must have {len(self.bounds)} variables")
        table = np.array(list(self.bounds.values()))
        if (x < table[:, 0] - 1e-12).any() or (x > table[:, 1] + 1e-12).any():
            raise InputError("designs: must lie within their bounds")
        goals = np.full((len(x), len(self.goals)), np.inf)
        violation = self._own_excess(x)
        runs = np.zeros(len(x), dtype=np.int64)
        alive = np.flatnonzero(violation == 0.0)
        if not self._needs_runs:
            goals[alive] = self._own_goals(x[alive])
            return Worth(goals, violation, runs)
        first = max(4, self.draws // 4)
        parts: dict[int, list[dict[str, NDArray[Any]]]] = {int(i): [] for i in alive}
        for begin, end in ((0, first), (first, self.draws)):
            if not alive.size or end <= begin:
                break
            for i, found in zip(alive.tolist(), self.runs_of(x[alive], np.arange(begin, end)), strict=True):
                parts[i].append(found)
                runs[i] = end
            joined = {i: _joined(parts[i]) for i in alive.tolist()}
            last = end == self.draws
            for i in alive.tolist():
                if last or self._missing(joined[i], hopeful=True) > 0.0:
                    violation[i] = self._missing(joined[i])
            if last:
                for i in alive[violation[alive] == 0.0].tolist():
                    goals[i] = self._goals_of(x[i : i + 1], joined[i])
            alive = alive[violation[alive] == 0.0]
        return Worth(goals, violation, runs)

    def estimate(self, design: ArrayLike, numbers: NDArray[np.int64], confidence: float = 0.95) -> Estimate:
        """What one design is worth on the draws of the given numbers, with intervals."""
        x = finite_array("design", design, 1)[None]
        found = self.runs_of(x, numbers)[0]
        good = reached(found)
        failed = int((~good).sum())
        goals = np.empty((len(self.goals), 3))
        for row, goal in zip(goals, self.goals, strict=True):
            if goal._quantity.kind == "design":
                row[:] = self._own(goal, x)[0]
            else:
                values = goal._quantity.of(self.trials.system, found)[good]
                row[:] = goal.estimate(values, failed, confidence)
        limits = np.ones((len(self.limits), 3))
        for row, limit in zip(limits, self.limits, strict=True):
            if limit._quantity.kind == "design":
                row[:] = float(limit.excess(self._own(limit, x))[0] == 0.0)
                continue
            kept = limit.kept(limit._quantity.of(self.trials.system, found)) & good
            row[0] = kept.sum() / max(int(good.sum()), 1)
            row[1] = float(wilson(int(kept.sum()), good.size, confidence)[1])
            row[2] = float(wilson(int(kept.sum()) + failed, good.size, confidence)[2])
        return Estimate(goals, limits, int(good.size), failed)

    def runs_of(self, x: _Array, numbers: NDArray[np.int64]) -> list[dict[str, NDArray[Any]]]:
        """Statistics and columns of the runs of designs, each on the same draws."""
        each = np.repeat(np.arange(len(x)), numbers.size)
        points: Columns = {name: x[each, j] for j, name in enumerate(self.bounds)}
        columns = self.trials.columns(points, np.tile(numbers, len(x)))
        found = self.trials.of_columns(columns)
        fixed = {
            name: np.full(each.size, value)
            for name, value in self.trials.system.parameters.items()
            if isinstance(value, float)
        }
        whole = fixed | columns | found
        if "cycles_to_settle" in {
            *(goal.quantity for goal in self.goals),
            *(limit.quantity for limit in self.limits),
        }:
            whole[CYCLE] = self.trials.cycles(columns)
        return [{name: values[each == i] for name, values in whole.items()} for i in range(len(x))]

    @property
    def _needs_runs(self) -> bool:
        kinds = {
            *(goal._quantity.kind for goal in self.goals),
            *(limit._quantity.kind for limit in self.limits),
        }
        return kinds != {"design"}

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

    def _own_excess(self, x: _Array) -> _Array:
        own = [limit for limit in self.limits if limit._quantity.kind == "design"]
        found = np.zeros(len(x))
        for limit in own:
            found += limit.excess(self._own(limit, x))
        # beyond what any share of runs can break: such a design is never run
        return np.where(found > 0.0, found + len(self.limits), 0.0)

    def _own_goals(self, x: _Array) -> _Array:
        return np.stack([self._sign(goal) * self._own(goal, x) for goal in self.goals], axis=1)

    @staticmethod
    def _sign(goal: Objective) -> float:
        return -1.0 if goal.maximize else 1.0

    def _goals_of(self, x: _Array, found: dict[str, NDArray[Any]]) -> _Array:
        good = reached(found)
        values = []
        for goal in self.goals:
            if goal._quantity.kind == "design":
                values.append(float(self._own(goal, x)[0]))
            else:
                runs = goal._quantity.of(self.trials.system, found)[good]
                values.append(goal.estimate(runs, 0, 0.95)[0] if runs.size else np.inf)
        signed = np.array([self._sign(goal) * value for goal, value in zip(self.goals, values, strict=True)])
        return np.where(np.isfinite(signed), signed, np.inf)

    def _missing(self, found: dict[str, NDArray[Any]], *, hopeful: bool = False) -> float:
        """By how much the shares of runs that keep the limits are too small; failed runs keep none.

        *hopeful*: by how much they are too small even if they are as great as the runs let hope, without a margin.
        """
        good = reached(found)
        total = 0.0
        for limit in self.limits:
            if limit._quantity.kind == "design":
                continue
            kept = limit.kept(limit._quantity.of(self.trials.system, found)) & good
            share = float(kept.mean())
            wanted = limit.required + self.margin * (1.0 - limit.required)
            if hopeful:
                share, wanted = float(wilson(int(kept.sum()), kept.size, _SURE)[2]), limit.required
            total += max(0.0, wanted - share)
        return total


def _joined(parts: list[dict[str, NDArray[Any]]]) -> dict[str, NDArray[Any]]:
    return {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}


def problem_of(
    trials: Trials, variables: Any, goals: Any, limits: Any, draws: int, margin: float = 0.5
) -> DesignProblem:
    """Check what may be chosen and what is asked of it.

    Raises
    ------
    InputError
    """
    if not isinstance(variables, Mapping) or not variables:
        raise InputTypeError(
            f"variables = {shown(variables)}: must map at least one parameter to (low, high)"
        )
    bounds: dict[str, tuple[float, float]] = {}
    for name, pair in variables.items():
        row = lookup(str(name))
        if row.quantity.kind is not float or row.section == "run":
            raise InputError(f"{name}: cannot be chosen; must be a real number of the system")
        try:
            low, high = (float(row.quantity.check(str(name), each)) for each in pair)
        except (TypeError, ValueError) as error:
            if isinstance(error, InputError):
                raise
            raise InputTypeError(f"{name} = {shown(pair)}: must be two numbers (low, high)") from None
        if not low < high:
            raise InputError(f"{name} = ({low:g}, {high:g}): low must be less than high")
        if row.name in bounds:
            raise InputError(f"{name}: stands twice among the variables")
        bounds[row.name] = (low, high)
    made, kept = require_kinds(goals, limits)
    require_held([*(goal.quantity for goal in made), *(limit.quantity for limit in kept)], trials.system)
    integer("draws", draws, 8, 10**6)
    if trials.spread.is_empty:
        raise InputError("spread: nothing differs, so no probability can be promised; give tolerances")
    return DesignProblem(trials, bounds, made, kept, draws, margin)
