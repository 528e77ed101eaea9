"""How many runs each point of a probability map gets: more where its interval is wide, until all are narrow enough."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from scipy import special

from snapbeam.core.validate import InputError, choice, integer, within
from snapbeam.design.events import OUTCOMES
from snapbeam.design.proportion import INTERVALS, interval_of

__all__ = ["SamplingPlan", "Counts", "allocate"]

_Array = NDArray[np.float64]
_Index = NDArray[np.int64]
Ask = Callable[[_Index, _Index], tuple[NDArray[np.bool_], NDArray[np.bool_]]]
"""Given points and numbers of draws, what happened, of shape (outcomes, runs), and which runs failed."""


@dataclass(frozen=True, kw_only=True)
class SamplingPlan:
    """How runs are spent on the points of a probability map.

    Parameters
    ----------
    half_width : float, optional
        Half the width of the interval of *outcome* that every point is to reach, in (0, 0.5); None: *initial_runs* runs for
        every point.
    outcome : str
        Whose interval is looked at: ``"snap"``, ``"continuous"``, ``"first_well"`` or ``"other_well"``.
    initial_runs : int
        Runs that every point has to begin with, at least 8 where more follow.
    max_runs : int
        Runs of a point at most.
    total_runs : int, optional
        Runs of all points together at most; those with the widest intervals come first.
    confidence : float
        Of the intervals, in (0, 1).
    interval : {"wilson", "jeffreys"}

    Raises
    ------
    InputError
        For values out of range, and names of outcomes or intervals that there are not.
    """

    half_width: float | None = 0.05
    outcome: str = "snap"
    initial_runs: int = 32
    max_runs: int = 10_000
    total_runs: int | None = None
    confidence: float = 0.95
    interval: str = "wilson"

    def __post_init__(self) -> None:
        choice("outcome", self.outcome, tuple(OUTCOMES))
        if self.half_width is not None:
            within("half_width", self.half_width, 0.0, 0.5)
        integer("initial_runs", self.initial_runs, 1 if self.half_width is None else 8, 10**7)
        integer("max_runs", self.max_runs, 1, 10**7)
        if self.half_width is not None and self.max_runs < self.initial_runs:
            raise InputError(
                f"most = {self.max_runs} with initial_runs = {self.initial_runs}: must be at least that"
            )
        if self.total_runs is not None:
            integer("total_runs", self.total_runs, 1, 10**12)
        within("confidence", self.confidence, 0.0, 1.0)
        choice("interval", self.interval, INTERVALS)


@dataclass
class Counts:
    """What happened at every point."""

    hits: _Index
    """Of shape (outcomes, points)."""
    runs: _Index
    """That came to an end."""
    failed: _Index
    rounds: int = 0
    open: NDArray[np.bool_] = field(default_factory=lambda: np.zeros(0, dtype=bool))
    """Points that have not reached the half width."""

    def limits(self, allocation: SamplingPlan, outcome: int) -> tuple[_Array, _Array, _Array]:
        """Probability of an outcome and its interval, at every point."""
        return interval_of(
            self.hits[outcome], self.runs, self.failed,
            confidence=allocation.confidence, method=allocation.interval,
        )  # fmt: skip


def allocate(
    ask: Ask, points: int, allocation: SamplingPlan, tell: Callable[[int, int], object] | None = None
) -> Counts:
    """Spend runs on points until the interval of each is narrow enough.

    In every round each point that is too wide is given half of the runs that it seems to lack, at most as many as it
    has: the number of looks at the data stays small, and with it what stopping at a lucky one costs in coverage.
    Failed runs count as runs made, and widen the interval.
    """
    outcomes = list(OUTCOMES)
    watched = outcomes.index(allocation.outcome)
    zeros = np.zeros(points, dtype=np.int64)
    counts = Counts(np.zeros((len(outcomes), points), dtype=np.int64), zeros.copy(), zeros.copy())
    wanted = np.full(points, allocation.initial_runs)
    made = 0
    while True:
        wanted = _affordable(counts, wanted, allocation, made, watched)
        if not wanted.any():
            break
        which = np.repeat(np.arange(points), wanted)
        begun = counts.runs + counts.failed
        numbers = np.concatenate([np.arange(b, b + w) for b, w in zip(begun, wanted, strict=True)])
        happened, failed = ask(which, numbers)
        good = ~failed
        np.add.at(counts.runs, which[good], 1)
        np.add.at(counts.failed, which[failed], 1)
        for row, each in zip(counts.hits, happened, strict=True):
            np.add.at(row, which[good & each], 1)
        counts.rounds += 1
        made += which.size
        wanted = _lacking(counts, allocation, watched)
        if tell is not None:
            tell(made, made + int(wanted.sum()))
    counts.open = _is_open(counts, allocation, watched)
    return counts


def _half_widths(counts: Counts, allocation: SamplingPlan, watched: int) -> _Array:
    _, low, high = counts.limits(allocation, watched)
    return np.asarray(0.5 * (high - low))


def _is_open(counts: Counts, allocation: SamplingPlan, watched: int) -> NDArray[np.bool_]:
    if allocation.half_width is None:
        return np.zeros(counts.runs.size, dtype=bool)
    return np.asarray(_half_widths(counts, allocation, watched) > allocation.half_width)


def _lacking(counts: Counts, allocation: SamplingPlan, watched: int) -> _Index:
    """Runs that each point is given next."""
    if allocation.half_width is None:
        return np.zeros_like(counts.runs)
    z = float(special.ndtri(0.5 * (1.0 + allocation.confidence)))
    made = counts.runs + counts.failed
    middle = (counts.hits[watched] + 0.5 * z * z) / (made + z * z)
    need = z * z * middle * (1.0 - middle) / allocation.half_width**2
    more = np.clip(np.ceil(0.5 * (need - made)), 8, np.maximum(made, 8)).astype(np.int64)
    more = np.minimum(more, allocation.max_runs - made)
    return np.where(_is_open(counts, allocation, watched), np.maximum(more, 0), 0)


def _affordable(counts: Counts, wanted: _Index, allocation: SamplingPlan, made: int, watched: int) -> _Index:
    """What of the runs wanted the total allows, the widest intervals first."""
    if allocation.total_runs is None or made + wanted.sum() <= allocation.total_runs:
        return wanted
    order = np.argsort(-_half_widths(counts, allocation, watched), kind="stable")
    left = allocation.total_runs - made
    granted = np.zeros_like(wanted)
    before = np.cumsum(wanted[order]) - wanted[order]
    granted[order] = np.clip(left - before, 0, wanted[order])
    return granted
