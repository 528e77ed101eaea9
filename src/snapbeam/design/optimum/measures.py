"""What a design is judged by: quantities of its runs or of itself, goals to make small, limits to keep."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from snapbeam.config.parameters import lookup
from snapbeam.core.validate import InputError, finite, instance, positive, shown, within
from snapbeam.design.events import OUTCOMES
from snapbeam.design.proportion import interval_of
from snapbeam.engines.outcomes import STATISTICS
from snapbeam.model.system import System

__all__ = ["OWN", "Objective", "Constraint", "QuantityOfInterest", "quantity_of"]

_Array = NDArray[np.float64]
Values = dict[str, NDArray[Any]]


class QuantityOfInterest(NamedTuple):
    """Something with a number for every run, or for every design."""

    name: str
    unit: str
    words: str
    kind: str
    """``"outcome"`` and ``"run"``: of a run; ``"design"``: of the nominal design alone."""
    of: Callable[[System, Values], NDArray[Any]]
    """From the nominal system and columns, parameters of designs or statistics of runs, to numbers."""


def _own(name: str, values: Values, system: System) -> _Array:
    value = values.get(name)
    return np.asarray(system.parameters[name] if value is None else value, dtype=np.float64)


def _speed(system: System, values: Values) -> _Array:
    return _own("drive.velocity_amplitude", values, system) * system.scale.length * system.scale.omega


def _stroke(system: System, values: Values) -> _Array:
    return np.asarray(
        _own("drive.velocity_amplitude", values, system)
        * system.scale.length
        / _own("drive.frequency_ratio", values, system)
    )


def _acceleration(system: System, values: Values) -> _Array:
    omega = _own("drive.frequency_ratio", values, system) * system.scale.omega
    return np.asarray(_speed(system, values) * omega)


def _settled(_: System, values: Values) -> _Array:
    """Cycles to the last crossing; those of runs that do not end in a well are infinite."""
    found = np.nan_to_num(values["last_zero_crossing"], nan=0.0) / values[CYCLE]
    return np.where(OUTCOMES["continuous"].happened(values), np.inf, found)


CYCLE = "cycle"
"""Seconds of a cycle, beside the statistics of a run."""


OWN: dict[str, QuantityOfInterest] = {
    row.name: row
    for row in (
        QuantityOfInterest("speed", "m/s", "velocity amplitude of the tip", "design", _speed),
        QuantityOfInterest("stroke", "m", "displacement amplitude of the tip", "design", _stroke),
        QuantityOfInterest(
            "acceleration", "m/s^2", "acceleration amplitude of the tip", "design", _acceleration
        ),
        QuantityOfInterest("cycles_to_settle", "1", "cycles to the last snap", "run", _settled),
    )
}
"""Quantities beside statistics, outcomes and parameters; the first three are of a sine."""


def quantity_of(name: str) -> QuantityOfInterest:
    """A quantity by name: an outcome, a statistic, one of :data:`OWN`, or a parameter of the design.

    Raises
    ------
    InputError
        If there is none.
    """
    if instance("quantity", name, str, "a name") in OWN:
        return OWN[name]
    if name in OUTCOMES:
        event = OUTCOMES[name]
        return QuantityOfInterest(name, "1", event.words, "outcome", lambda _, found: event.happened(found))
    if name in STATISTICS:
        row = STATISTICS[name]
        if row.dtype not in ("float64", "int32"):
            raise InputError(f"{name}: is no number that could be small or large")
        return QuantityOfInterest(
            name, row.unit, row.long_name, "run", lambda _, found: found[name].astype(np.float64)
        )
    try:
        parameter = lookup(name)
    except InputError:
        known = ", ".join((*OWN, *OUTCOMES))
        raise InputError(f"{name}: no quantity; must be one of {known}, a statistic or a parameter") from None
    full = parameter.name
    return QuantityOfInterest(
        full, parameter.quantity.unit, parameter.quantity.long_name, "design", lambda s, v: _own(full, v, s)
    )


@dataclass(frozen=True, kw_only=True)
class Objective:
    """Something to make small, or large.

    Parameters
    ----------
    quantity : str
        An outcome (its probability), a statistic of the runs, of one of several strikers too, as
        ``"peak_force_striker_2"``, a parameter, ``"speed"``, ``"stroke"``, ``"acceleration"`` or
        ``"cycles_to_settle"``.
    quantile : float, optional
        Of a statistic, in (0, 1): what is exceeded by no more than the rest of the runs; its mean by default.
    maximize : bool
        Whether it is to be large.
    """

    quantity: str
    quantile: float | None = None
    maximize: bool = False

    def __post_init__(self) -> None:
        kind = quantity_of(self.quantity).kind
        if self.quantile is not None:
            within("quantile", self.quantile, 0.0, 1.0)
            if kind != "run":
                raise InputError(
                    f"quantile = {self.quantile:g} of {self.quantity}: only statistics of runs have quantiles"
                )

    @property
    def _quantity(self) -> QuantityOfInterest:
        """What it is of."""
        return quantity_of(self.quantity)

    @property
    def label(self) -> str:
        """Its name in datasets."""
        name = self.quantity.replace(".", "_")
        return name if self.quantile is None else f"{name}_q{100.0 * self.quantile:g}".replace(".", "_")

    @property
    def words(self) -> str:
        """What is made small or large."""
        quantity = self._quantity
        if quantity.kind == "outcome":
            return f"probability that {quantity.words}"
        if self.quantile is not None:
            share = "median" if self.quantile == 0.5 else f"{self.quantile:g} quantile"
            return f"{share} of the {quantity.words}"
        return quantity.words if quantity.kind == "design" else f"mean {quantity.words}"

    def estimate(self, values: NDArray[Any], failed: int, confidence: float) -> tuple[float, float, float]:
        """Value and interval from runs that came to an end.

        Of an outcome Wilson's interval, of a mean Student's, of a quantile that of order statistics.
        """
        n = values.size
        if self._quantity.kind == "outcome":
            found = interval_of(int(values.sum()), n, failed, confidence=confidence)
            return float(found[0]), float(found[1]), float(found[2])
        if n < 2 or failed:  # a run that failed might have been anything
            middle = float(np.mean(values)) if n else float("nan")
            return middle, -np.inf, np.inf
        if self.quantile is None:
            if not np.isfinite(values).all():
                return np.inf, -np.inf, np.inf
            reach = float(stats.t.ppf(0.5 * (1.0 + confidence), n - 1) * values.std(ddof=1) / np.sqrt(n))
            middle = float(values.mean())
            return middle, middle - reach, middle + reach
        return _quantile(np.sort(values), self.quantile, confidence)


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
    """Something to keep.

    Parameters
    ----------
    quantity : str
        As of a :class:`Goal`.
    lower, upper : float, optional
        One of them at least.  Of an outcome *lower* is its probability, such as 0.95 of ``"other_well"``.
    probability : float
        Of a statistic of runs: share of all systems that must keep it, in (0, 1).
    """

    quantity: str
    lower: float | None = None
    upper: float | None = None
    probability: float = 0.95

    def __post_init__(self) -> None:
        kind = quantity_of(self.quantity).kind
        if self.lower is None and self.upper is None:
            raise InputError(f"limit of {self.quantity}: must have at_least or at_most")
        for name in ("lower", "upper"):
            if getattr(self, name) is not None:
                finite(name, getattr(self, name))
        within("probability", self.probability, 0.0, 1.0)
        if kind == "outcome":
            if self.upper is not None or self.lower is None:
                raise InputError(f"limit of {self.quantity}: give the probability it must have at_least")
            within("lower", self.lower, 0.0, 1.0)
        elif self.lower is not None and self.upper is not None and self.lower > self.upper:
            raise InputError(f"limit of {self.quantity}: lower = {self.lower:g} is more than at_most")

    @property
    def _quantity(self) -> QuantityOfInterest:
        """What it is of."""
        return quantity_of(self.quantity)

    @property
    def label(self) -> str:
        """Its name in datasets."""
        return self.quantity.replace(".", "_")

    @property
    def required(self) -> float:
        """Share of the runs that must keep it."""
        return float(self.lower) if self._quantity.kind == "outcome" else self.probability  # type: ignore[arg-type]

    def kept(self, values: NDArray[Any]) -> NDArray[np.bool_]:
        """Which runs keep it."""
        if self._quantity.kind == "outcome":
            return np.asarray(values, dtype=bool)
        low = -np.inf if self.lower is None else self.lower
        high = np.inf if self.upper is None else self.upper
        return np.asarray((values >= low) & (values <= high))

    def excess(self, values: _Array) -> _Array:
        """By how much designs break it, over its size; 0 where they keep it."""
        size = positive("size", max(abs(self.lower or 0.0), abs(self.upper or 0.0), 1e-300))
        low = -np.inf if self.lower is None else self.lower
        high = np.inf if self.upper is None else self.upper
        return np.asarray(np.maximum(np.maximum(low - values, values - high), 0.0) / size)


def require_kinds(goals: Any, limits: Any) -> tuple[tuple[Objective, ...], tuple[Constraint, ...]]:
    """Goals and limits as tuples.

    Raises
    ------
    InputError
    """
    listed = (goals,) if isinstance(goals, (str, Objective)) else tuple(goals)
    made = tuple(Objective(quantity=each) if isinstance(each, str) else each for each in listed)
    kept = (limits,) if isinstance(limits, Constraint) else tuple(limits)
    for each in made:
        if not isinstance(each, Objective):
            raise InputError(f"goals: {shown(each)} must be a Goal, or the name of a quantity")
    for each in kept:
        if not isinstance(each, Constraint):
            raise InputError(f"limits: {shown(each)} must be a Limit")
    if not 1 <= len(made) <= 3:
        raise InputError(f"goals: {len(made)} of them; must be one to three")
    labels = [each.label for each in made]
    if len(set(labels)) < len(labels):
        raise InputError(f"goals {labels}: must differ from each other")
    return made, kept
