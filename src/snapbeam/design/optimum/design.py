"""The best design under limits that hold with a stated probability, sought on common draws and judged on fresh ones."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from snapbeam.config.parameters import lookup
from snapbeam.core.kinds import checked
from snapbeam.core.provenance import canonical_json
from snapbeam.core.reporting import counting
from snapbeam.core.validate import InputError, InputTypeError, integer, shown, within
from snapbeam.design.optimum.evolution import DifferentialEvolution, front_of
from snapbeam.design.optimum.measures import Objective, Constraint
from snapbeam.design.optimum.problem import DesignProblem, Estimate, problem_of
from snapbeam.design.spread import ParameterUncertainty
from snapbeam.design.trials import trials_of
from snapbeam.model.integration import Integration
from snapbeam.model.system import System
from snapbeam.sweeps.stored import CheckpointOptions

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["OptimizerSettings", "design_problem", "optimize_design"]

_Array = NDArray[np.float64]
CHECK, REPORT = 10**9, 2 * 10**9
"""First numbers of the draws by which candidates are chosen, and of those by which the chosen are reported."""
HOLDS = ("fails", "undecided", "holds")


@dataclass(frozen=True, kw_only=True)
class OptimizerSettings:
    """How long a design is sought.

    Parameters
    ----------
    generations : int
        Including the first.
    population : int
        Designs of a generation, at least 6.
    samples : int
        Runs of a design while it is sought, at least 8.
    validation_samples : int
        Runs on fresh draws of a design that is checked, and again of one that is reported.
    candidates : int
        Designs that are checked at most, the best first, until one holds.
    confidence : float
    seed : int
    """

    generations: int = 30
    population: int = 24
    samples: int = 64
    validation_samples: int = 400
    candidates: int = 8
    confidence: float = 0.95
    seed: int = 0

    def __post_init__(self) -> None:
        integer("generations", self.generations, 1, 10**6)
        integer("population", self.population, 6, 10**5)
        integer("samples", self.samples, 8, 10**6)
        integer("validation_samples", self.validation_samples, 20, 10**7)
        integer("candidates", self.candidates, 1, 10**4)
        within("confidence", self.confidence, 0.0, 1.0)
        integer("seed", self.seed, 0, 2**63 - 1)

    @property
    def max_runs(self) -> int:
        """Runs that a design takes at most, of one goal."""
        return (
            self.generations * self.population * self.samples
            + (self.candidates + 1) * self.validation_samples
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
    integration: Integration | None = None,
    checkpoint: str | os.PathLike[str] | CheckpointOptions | None = None,
) -> DesignProblem:
    """A design problem for an optimiser of one's own, such as pymoo's, Optuna's or Ax's; as of :func:`design`.

    Returns
    -------
    DesignProblem
        Its ``evaluate(designs)`` gives goals and violations of rows of designs, on the same draws each time; its
        ``estimate(design, numbers)`` intervals on draws of any numbers.

    Raises
    ------
    InputError
        For variables, goals and limits that cannot be, and a spread in which nothing differs.
    """
    trials = trials_of(
        system, uncertainty, integration, store=checkpoint, early=_early(objectives, constraints)
    )
    return problem_of(trials, variables, objectives, constraints, samples)


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
    """Where and how to strike so that limits hold with a stated probability and goals are least.

    Designs are sought by generalised differential evolution on common draws.  The best are checked on fresh draws
    until one holds its limits for certain, and what is found is reported from draws that neither saw: the reported
    intervals owe nothing to the search.

    Parameters
    ----------
    system : System
        The nominal one.
    variables : mapping of str to (low, high)
        Real parameters that may be chosen.
    objectives : Goal or str, or a list of up to three
        What to make small; of several the Pareto front is sought.
    constraints : Limit, or a list of them
    uncertainty : Spread
        What differs between systems that are built and driven alike.
    settings : Effort, optional
    integration : Integration, optional
    checkpoint : path or Keeping, optional
        Folder that keeps the runs; one that exists is resumed.
    progress : callable, optional
        Called as ``progress(done, total)`` with generations; True writes a line to standard error.

    Returns
    -------
    xarray.Dataset
        Along ``design``, one, or a front by its first goal: a variable a parameter; ``goal_...`` with ``_low`` and
        ``_high`` and, as the search saw it, ``_sought``; ``kept_...``, the share of systems that keep a limit, with
        ``_low`` and ``_high``, beside ``required_...``; ``holds``: whether every lower limit is as great as
        required, some upper one is less, or neither is known.  Along ``tried``: every design that was looked at,
        its goals and ``violation``.

    Raises
    ------
    InputError
        For bad input, and if no design that was tried keeps the limits.

    Examples
    --------
    >>> ds = sb.optimize_design(  # doctest: +SKIP
    ...     system,
    ...     {"location": (0.2, 0.5), "frequency_ratio": (0.5, 2.0), "velocity_amplitude": (0.05, 0.5)},
    ...     "peak_force",
    ...     [sb.Limit(of="other_well", at_least=0.95), sb.Limit(of="stroke", at_most=1e-3)],
    ...     spread,
    ... )
    """
    settings = OptimizerSettings() if settings is None else settings
    if not isinstance(settings, OptimizerSettings):
        raise InputTypeError(f"effort = {shown(settings)}: must be an Effort")
    problem = design_problem(
        system,
        variables,
        objectives,
        constraints,
        uncertainty,
        samples=settings.samples,
        integration=integration,
        checkpoint=checkpoint,
    )
    report = counting(progress, "design", "generations")
    search = DifferentialEvolution(list(problem.bounds.values()), settings.population, settings.seed)
    tried: list[tuple[_Array, _Array, _Array]] = []
    for generation in range(settings.generations):
        asked = search.ask()
        worth = problem.evaluate(asked)
        tried.append((asked, worth.goals, worth.violation))
        search.tell(worth.goals, worth.violation)
        if report is not None:
            report(generation + 1, settings.generations)
    x, goal_values, violation = (np.concatenate(parts) for parts in zip(*tried, strict=True))
    chosen = _chosen(problem, settings, x, goal_values, violation)
    found = [_fresh(problem, settings, x[i], REPORT) for i in chosen]
    return _dataset(problem, settings, (x, goal_values, violation), chosen, found)


def _early(goals: Any, limits: Any) -> bool:
    """Whether runs may end once their class is certain: not where a statistic of theirs is asked for."""
    listed = [*([goals] if isinstance(goals, (str, Objective)) else goals)]
    listed += [limits] if isinstance(limits, Constraint) else list(limits)
    made = [Objective(quantity=each) if isinstance(each, str) else each for each in listed]
    return all(getattr(each, "quantity", None) is not None and each._quantity.kind != "run" for each in made)


def _fresh(problem: DesignProblem, effort: OptimizerSettings, x: _Array, begin: int) -> Estimate:
    return problem.estimate(x, np.arange(begin, begin + effort.validation_samples), effort.confidence)


def _chosen(
    problem: DesignProblem, effort: OptimizerSettings, x: _Array, goals: _Array, violation: _Array
) -> list[int]:
    """Designs to be reported: the best that holds on fresh draws, or the front."""
    good = np.flatnonzero(violation == 0.0)
    if not good.size:
        best = int(np.argmin(violation))
        where = ", ".join(f"{name} = {value:.4g}" for name, value in zip(problem.names, x[best], strict=True))
        raise InputError(
            f"limits: no design of {len(x)} that were tried keeps them; {where} breaks them least.  Widen the bounds, "
            "loosen a limit or give more generations"
        )
    if len(problem.goals) > 1:
        front = good[front_of(goals[good])]
        _, unique = np.unique(goals[front], axis=0, return_index=True)
        return front[np.sort(unique)][np.argsort(goals[front[np.sort(unique)], 0], kind="stable")].tolist()
    order = good[np.argsort(goals[good, 0], kind="stable")]
    ranked: list[int] = []
    for i in order.tolist():  # a population that has converged holds the same design many times over
        if not any(np.allclose(x[i], x[j], rtol=1e-3, atol=0.0) for j in ranked[-20:]):
            ranked.append(i)
    # ever further down the list, where designs cost more and promise more
    steps = np.unique(np.geomspace(1, len(ranked), min(effort.candidates, len(ranked))).astype(np.int64)) - 1
    ranked = [ranked[k] for k in steps.tolist()]
    seen: list[tuple[float, int]] = []
    for i in ranked:
        state, short = _holds(problem, _fresh(problem, effort, x[i], CHECK))
        if state == 2:
            return [i]
        seen.append((short, i))
    return [min(seen)[1]]


def _holds(problem: DesignProblem, found: Estimate) -> tuple[int, float]:
    """Whether limits hold for certain (2), fail for certain (0) or neither (1), and by how much they may lack."""
    required = np.array([limit.required for limit in problem.limits])
    own = np.array([limit._quantity.kind == "design" for limit in problem.limits], dtype=bool)
    wanted = np.where(own, 1.0, required)
    short = float(np.maximum(wanted - found.limits[:, 1], 0.0).sum()) if required.size else 0.0
    if short == 0.0:
        return 2, 0.0
    return (0 if (found.limits[:, 2] < wanted).any() else 1), short


def _dataset(
    problem: DesignProblem,
    effort: OptimizerSettings,
    tried: tuple[_Array, _Array, _Array],
    chosen: list[int],
    found: list[Estimate],
) -> xr.Dataset:
    import xarray as xr

    trials = problem.trials
    attrs: dict[str, Any] = {
        "title": "designs of a struck bistable beam", "system": trials.system.hash,
        "uncertainty": canonical_json(trials.spread.describe()), "samples": effort.samples, "validation_samples": effort.validation_samples,
        "generations": effort.generations, "population": effort.population, "confidence": effort.confidence,
        "seed": effort.seed, "spread_seed": trials.spread.seed, "runs_made": trials.runs,
        "cycles": trials.integration.cycles_or_default, "modes": trials.system.model.modes,
    }  # fmt: skip
    attrs |= {f"fixed_{lookup(name).short}": value for name, value in trials.system.parameters.items()
              if isinstance(value, (int, float)) and name not in problem.bounds}  # fmt: skip
    dataset = xr.Dataset(attrs=attrs)
    x, goals, violation = tried
    for j, name in enumerate(problem.names):
        row = lookup(name)
        labels = {"units": row.quantity.unit, "long_name": row.quantity.long_name, "parameter": name}
        dataset[row.short] = (("design",), x[chosen, j], labels)
        dataset[f"tried_{row.short}"] = (("tried",), x[:, j], labels)
    for k, goal in enumerate(problem.goals):
        sign = -1.0 if goal.maximize else 1.0
        own = {"units": goal._quantity.unit, "long_name": goal.words}
        for end, values in zip(
            ("", "_low", "_high"), np.array([each.goals[k] for each in found]).T, strict=True
        ):
            dataset[f"goal_{goal.label}{end}"] = (("design",), values, own)
        dataset[f"goal_{goal.label}_sought"] = (("design",), sign * goals[chosen, k], own)
        seen = np.where(np.isfinite(goals[:, k]), sign * goals[:, k], np.nan)
        dataset[f"tried_goal_{goal.label}"] = (("tried",), seen, own)
    for k, limit in enumerate(problem.limits):
        own = {"units": "1", "long_name": f"share of systems that keep the limit of {limit.quantity}"}
        own |= {
            name: value for name in ("at_least", "at_most") if (value := getattr(limit, name)) is not None
        }
        for end, values in zip(
            ("", "_low", "_high"), np.array([each.limits[k] for each in found]).T, strict=True
        ):
            dataset[f"kept_{limit.label}{end}"] = (("design",), values, own)
        required = 1.0 if limit._quantity.kind == "design" else limit.required
        dataset[f"required_{limit.label}"] = (
            (),
            required,
            {"units": "1", "long_name": "share that is required"},
        )
    states = np.array([_holds(problem, each)[0] for each in found], dtype=np.int8)
    flags = {"flag_values": np.arange(3, dtype=np.int8), "flag_meanings": " ".join(HOLDS)}
    dataset["holds"] = (("design",), states, {"units": "1", "long_name": "whether the limits hold"} | flags)
    failed = np.array([each.failed for each in found])
    dataset["runs_failed"] = (
        ("design",),
        failed,
        {"units": "1", "long_name": "runs that failed; they keep no limit"},
    )
    labels = {"units": "1", "long_name": "by how much the limits are broken; 0 where they are kept"}
    dataset["violation"] = (("tried",), violation, labels)
    return dataset
