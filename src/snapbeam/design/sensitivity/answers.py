"""What is asked of a system as one number: a statistic, a threshold, the notch of the threshold, a lifetime."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from snapbeam.config.parameters import lookup
from snapbeam.core.validate import InputError, axis, choice, integer, shown
from snapbeam.design.events import OUTCOMES, reached, require_held
from snapbeam.design.trials import Trials
from snapbeam.dynamics.lifetimes.lifetime_map import lifetime_map
from snapbeam.dynamics.lifetimes.survival import LifetimeSettings
from snapbeam.dynamics.starts import InitialConditions
from snapbeam.engines.each import of_one_named
from snapbeam.engines.outcomes import STATISTICS
from snapbeam.sweeps.points import PointList

__all__ = ["Answer", "LifetimeQoI", "NotchQoI", "StatisticQoI", "ThresholdQoI", "answer_of"]

_Array = NDArray[np.float64]
_Numbers = NDArray[np.int64]


class Answer(Protocol):
    """One number of every draw."""

    @property
    def unit(self) -> str: ...

    @property
    def words(self) -> str: ...

    def of(self, trials: Trials, scores: _Array, numbers: _Numbers) -> _Array:
        """The numbers of draws with the given scores and starts; NaN where there is none."""
        ...


@dataclass(frozen=True)
class StatisticQoI:
    """A statistic of the run of each draw, such as ``peak_force``.

    Parameters
    ----------
    name : str
        Of :data:`snapbeam.STATISTICS`, of one of several strikers, such as ``"peak_force_striker_2"``, or an outcome
        such as ``"snap"``: 1 where it happens, else 0.
    """

    name: str

    def __post_init__(self) -> None:
        known = [name for name, row in STATISTICS.items() if row.dtype in ("float64", "int32")]
        if not isinstance(self.name, str) or of_one_named(self.name) is None:
            choice("statistic", self.name, (*known, *OUTCOMES))

    @property
    def unit(self) -> str:
        """Of the statistic."""
        return STATISTICS[self.name].unit if self.name in STATISTICS else "1"

    @property
    def words(self) -> str:
        """What it is."""
        return STATISTICS[self.name].long_name if self.name in STATISTICS else OUTCOMES[self.name].words

    def of(self, trials: Trials, scores: _Array, numbers: _Numbers) -> _Array:
        """One run a draw."""
        require_held([self.name], trials.system)
        found = trials.statistics({}, numbers, scores=scores)
        values = found[self.name] if self.name in STATISTICS else OUTCOMES[self.name].happened(found)
        return np.where(reached(found), values.astype(np.float64), np.nan)


@dataclass(frozen=True, kw_only=True)
class ThresholdQoI:
    """The least value of a parameter at which a draw snaps, on a row of values and then by halving.

    Parameters
    ----------
    parameter : str
        Parameter to raise, such as ``"velocity_amplitude"``.
    bounds : tuple of two floats
    values : int
        Values tried first, evenly spaced: a window of snapping narrower than their spacing may be missed.
    halvings : int
        Of the step below the lowest that snaps.
    at : mapping of str to float, optional
        Other parameters, as they are meant to be.
    """

    parameter: str = "velocity_amplitude"
    bounds: tuple[float, float] = (0.005, 0.65)
    values: int = 25
    halvings: int = 8
    at: Mapping[str, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        row = lookup(self.parameter)
        if not row.is_run or row.quantity.kind is not float:
            raise InputError(
                f"along = {shown(self.parameter)}: must be a number that may differ between runs"
            )
        axis("bounds", self.bounds, -np.inf, np.inf)
        integer("values", self.values, 2, 100_000)
        integer("halvings", self.halvings, 0, 40)

    @property
    def unit(self) -> str:
        """Of the parameter."""
        return lookup(self.parameter).quantity.unit

    @property
    def words(self) -> str:
        """What it is."""
        return f"least {lookup(self.parameter).quantity.long_name} that snaps"

    @property
    def error(self) -> float:
        """Half of the last step."""
        return (self.bounds[1] - self.bounds[0]) / (self.values - 1) / 2.0 ** (self.halvings + 1)

    def of(self, trials: Trials, scores: _Array, numbers: _Numbers) -> _Array:
        """All draws at once: every value, then as many rounds as there are halvings."""
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

    def _snaps(
        self, trials: Trials, scores: _Array, numbers: _Numbers, row: str, values: _Array
    ) -> NDArray[np.bool_]:
        points = {lookup(name).name: np.full(values.size, float(value)) for name, value in self.at.items()}
        found = trials.statistics(points | {row: values}, numbers, scores=scores)
        return np.asarray(found["response_class"] > 0)


@dataclass(frozen=True, kw_only=True)
class NotchQoI:
    """Where the threshold is lowest along a parameter, or how low it is there.

    Parameters
    ----------
    parameter : str
        Parameter along which thresholds are compared, such as ``"frequency_ratio"``.
    values : array_like
        Its values, strictly increasing, at least 3; the place is that of the parabola through the lowest three.
    threshold : ThresholdQoI
    depth : bool
        Whether the threshold there is meant, and not the place.
    """

    parameter: str = "frequency_ratio"
    values: ArrayLike = tuple(np.linspace(1.0, 1.8, 9).tolist())
    threshold: ThresholdQoI = field(default_factory=ThresholdQoI)
    depth: bool = False

    def __post_init__(self) -> None:
        row = lookup(self.parameter)
        if axis(self.parameter, self.values, row.quantity.low, row.quantity.high).size < 3:
            raise InputError(f"values = {shown(self.values)}: must be at least 3")

    @property
    def unit(self) -> str:
        """Of what it is along, or of the threshold."""
        return self.threshold.unit if self.depth else lookup(self.parameter).quantity.unit

    @property
    def words(self) -> str:
        """What it is."""
        place = lookup(self.parameter).quantity.long_name
        return f"lowest threshold over {place}" if self.depth else f"{place} at which the threshold is lowest"

    def of(self, trials: Trials, scores: _Array, numbers: _Numbers) -> _Array:
        """A threshold at every value."""
        x = np.asarray(self.values, dtype=np.float64)
        table = np.stack([self._threshold(float(value), trials, scores, numbers) for value in x], axis=1)
        found = np.full(numbers.size, np.nan)
        for i, row in enumerate(table):
            known = np.isfinite(row)
            if not known.any():
                continue
            at = int(np.nanargmin(row))
            if not 0 < at < x.size - 1 or not known[at - 1 : at + 2].all():
                continue  # at an end, or beside what is not known: the notch may lie elsewhere
            place, lowest = _vertex(x[at - 1 : at + 2], row[at - 1 : at + 2])
            found[i] = lowest if self.depth else place
        return found

    def _threshold(self, value: float, trials: Trials, scores: _Array, numbers: _Numbers) -> _Array:
        own = self.threshold
        there = ThresholdQoI(
            parameter=own.parameter, bounds=own.bounds, values=own.values, halvings=own.halvings,
            at={**own.at, self.parameter: value},
        )  # fmt: skip
        return there.of(trials, scores, numbers)


def _vertex(x: _Array, y: _Array) -> tuple[float, float]:
    """Place and height of the lowest point of the parabola through three points of which the middle is lowest."""
    a, b, c = np.polyfit(x - x[1], y, 2)
    if not a > 0.0:
        return float(x[1]), float(y[1])
    place = float(np.clip(-0.5 * b / a, x[0] - x[1], x[2] - x[1]))
    return float(x[1] + place), float(a * place**2 + b * place + c)


@dataclass(frozen=True, kw_only=True)
class LifetimeQoI:
    """How long snapping lasts, from many starts of each draw, in cycles.

    Parameters
    ----------
    initial_conditions : Starts
        The same for every draw.
    settings : Survival, optional
    """

    initial_conditions: InitialConditions = field(default_factory=lambda: InitialConditions(count=16))
    settings: LifetimeSettings = field(default_factory=LifetimeSettings)

    @property
    def unit(self) -> str:
        """Cycles."""
        return "1"

    @property
    def words(self) -> str:
        """What it is."""
        return "lifetime of snapping, in cycles"

    def of(self, trials: Trials, scores: _Array, numbers: _Numbers) -> _Array:
        """A lifetime map over the draws."""
        columns = trials.columns({}, numbers, scores)
        if any(name.startswith("start.") for name in columns):
            raise InputError(
                "displacement: lifetimes have the starts of LifetimeQoI; leave it out of the spread"
            )
        found = lifetime_map(
            trials.system,
            _listed(columns),
            trials.integration,
            initial_conditions=self.initial_conditions,
            settings=self.settings,
        )
        trials.runs += numbers.size * self.initial_conditions.count
        return np.asarray(found["lifetime"].values, dtype=np.float64)


def _listed(columns: dict[str, Any]) -> PointList:
    return PointList(columns)


def answer_of(given: Answer | str) -> Answer:
    """An answer, or that of a statistic by its name.

    Raises
    ------
    InputError
    """
    if isinstance(given, str):
        return StatisticQoI(given)
    if not hasattr(given, "of") or not hasattr(given, "unit"):
        raise InputError(
            f"answer = {shown(given)}: must be the name of a statistic, a ThresholdQoI, a NotchQoI or a LifetimeQoI"
        )
    return given
