"""Where to run next so that quantile thresholds become narrow: rounds, each within what the last left open."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from snapbeam.core.validate import InputError, choice, finite_array, integer, within
from snapbeam.design.events import OUTCOMES
from snapbeam.design.quantiles.isotonic import crossing

__all__ = ["Runs", "QuantileSearchSettings", "search"]

_Array = NDArray[np.float64]
_Index = NDArray[np.int64]
Ask = Callable[[_Index, _Array, _Index], tuple[NDArray[np.bool_], NDArray[np.bool_]]]
"""Given columns, values and numbers of draws: which runs hit, and which failed."""
_WIDER = 0.5
"""Of an interval, by which the next round reaches beyond it on either side."""
_SURE = 0.99


@dataclass(frozen=True, kw_only=True)
class QuantileSearchSettings:
    """How quantile thresholds are sought.

    Parameters
    ----------
    probabilities : tuple of float
        Increasing, each in (0, 1).
    runs : int
        Runs of every column, at least 40 a probability.
    rounds : int
        Rounds they are made in: the first over the whole range, each later one about the intervals found so far.
    confidence : float
        Of the intervals, in [0.5, 0.99].
    seed : int
        Chooses the values at which runs are made.
    outcome : str
        What the probability is of, as in :class:`Allocation`.
    """

    probabilities: tuple[float, ...] = (0.05, 0.5, 0.95)
    runs: int = 400
    rounds: int = 4
    confidence: float = 0.95
    seed: int = 0
    outcome: str = "snap"

    def __post_init__(self) -> None:
        given = np.atleast_1d(finite_array("probabilities", self.probabilities))
        chosen = tuple(within("probabilities", each, 0.0, 1.0) for each in given.ravel())
        if not chosen or (np.diff(chosen) <= 0.0).any():
            raise InputError(f"probabilities = {chosen}: must be increasing")
        object.__setattr__(self, "probabilities", chosen)
        integer("runs", self.runs, 40 * len(chosen), 10**7)
        integer("rounds", self.rounds, 1, 50)
        within("confidence", self.confidence, 0.5, 0.99, closed="both")
        integer("seed", self.seed, 0, 2**63 - 1)
        choice("outcome", self.outcome, tuple(OUTCOMES))


@dataclass
class Runs:
    """What was run in one column."""

    values: _Array = field(default_factory=lambda: np.empty(0))
    hits: NDArray[np.bool_] = field(default_factory=lambda: np.empty(0, dtype=bool))
    failed: int = 0
    made: int = 0


def search(
    ask: Ask,
    columns: int,
    between: tuple[float, float],
    how: QuantileSearchSettings,
    tell: Callable[[int, int], object] | None = None,
) -> list[Runs]:
    """Make the runs of every column.

    Every run has a value of its own, one in each of as many equal parts of what is looked at as there are runs, so that
    no grid hides anything; and a draw of its own.  Columns share the numbers of draws.
    """
    found = [Runs() for _ in range(columns)]
    share = np.diff(np.linspace(0, how.runs, how.rounds + 1).astype(np.int64))
    total = columns * how.runs
    for number, count in enumerate(share.tolist()):
        asked = [_values(column, between, how, number, count, c) for c, column in enumerate(found)]
        which = np.repeat(np.arange(columns), count)
        draws = np.concatenate([np.arange(column.made, column.made + count) for column in found])
        hits, failed = ask(which, np.concatenate(asked), draws)
        for c, column in enumerate(found):
            own = which == c
            good = ~failed[own]
            column.values = np.concatenate([column.values, asked[c][good]])
            column.hits = np.concatenate([column.hits, hits[own][good]])
            column.failed += int((~good).sum())
            column.made += count
        if tell is not None:
            tell(min(columns * int(share[: number + 1].sum()), total), total)
    return found


def _values(
    column: Runs,
    between: tuple[float, float],
    how: QuantileSearchSettings,
    number: int,
    count: int,
    place: int,
) -> _Array:
    """Values of the runs of one round."""
    generator = np.random.Generator(np.random.Philox(key=[how.seed, place * 64 + number]))
    windows = [between] if number == 0 or column.values.size == 0 else _windows(column, between, how)
    each = np.diff(np.linspace(0, count, len(windows) + 1).astype(np.int64))
    parts = []
    for (low, high), size in zip(windows, each.tolist(), strict=True):
        parts.append(low + (high - low) * (np.arange(size) + generator.random(size)) / max(size, 1))
    return np.concatenate(parts)


def _windows(
    column: Runs, between: tuple[float, float], how: QuantileSearchSettings
) -> list[tuple[float, float]]:
    """A little more than the interval of each probability."""
    found = []
    for probability in how.probabilities:
        _, low, high = crossing(column.values, column.hits, probability, _SURE)
        low, high = max(low, between[0]), min(high, between[1])
        reach = _WIDER * (high - low)
        found.append((max(low - reach, between[0]), min(high + reach, between[1])))
    return found
