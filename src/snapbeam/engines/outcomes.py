"""The table of outcomes: what kernels keep of a run, and what follows from it.

Kernels write :data:`ACCUMULATORS`, one record a run; maps, runs and :class:`~snapbeam.Outcome` hold :data:`STATISTICS`.
A new statistic is a row: either a formula of what is kept already, or, with ``update``, a scalar function
that kernels call after every step.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from snapbeam.core.codes import ResponseClass, RunStatus, class_of
from snapbeam.core.named import NamedTable
from snapbeam.core.validate import InputError

if TYPE_CHECKING:
    from snapbeam.engines.answer import Reading

__all__ = [
    "ACCUMULATORS",
    "OTHER_IMPACTS",
    "OTHER_IMPULSE",
    "OTHER_PEAK",
    "OTHER_WORK",
    "STATISTICS",
    "Passed",
    "Statistic",
    "accumulators_dtype",
    "empty_accumulators",
    "register",
    "updated",
    "unregister",
]

Values = NDArray[Any]


class Passed(NamedTuple):
    """A step that was taken, as statistics see it; SI units, seen from the striker's side."""

    time: float
    """At its beginning, s."""
    length: float
    displacement: tuple[float, float]
    """Of the beam at the striker's location, at the two ends of the step."""
    velocity: tuple[float, float]
    midspan_displacement: tuple[float, float]
    midspan_velocity: tuple[float, float]
    penetration: tuple[float, float]
    touching: bool


# What every kernel keeps: name, kind, value at the start.
_KEPT: tuple[tuple[str, type, float], ...] = (
    ("status", np.int64, int(RunStatus.NOT_RUN)),
    ("time", np.int64, 0),  # ticks marched
    ("touching", np.int64, 0),
    ("onset", np.int64, 0),  # tick at which the present contact began
    ("side", np.int64, 0),  # sign of the centre displacement, -1 in the well the run began in
    ("zero_crossings", np.int64, 0),
    ("zero_crossings_last_quarter", np.int64, 0),
    ("impacts", np.int64, 0),
    ("steps", np.int64, 0),
    ("samples", np.int64, 0),
    ("last_zero_crossing", np.float64, math.nan),
    ("min_displacement", np.float64, 0.0),
    ("max_displacement", np.float64, 0.0),
    ("min_center", np.float64, 0.0),
    ("max_center", np.float64, 0.0),
    ("peak_velocity", np.float64, 0.0),
    ("peak_midspan_velocity", np.float64, 0.0),
    ("square_displacement", np.float64, 0.0),  # integrals over time
    ("square_center", np.float64, 0.0),
    ("square_velocity", np.float64, 0.0),
    ("square_midspan_velocity", np.float64, 0.0),
    ("energy_time", np.float64, 0.0),  # integral of the modal energy, sampled
    ("high_energy_time", np.float64, 0.0),  # of the modes above a frequency
    ("peak_force", np.float64, 0.0),
    ("contact_time", np.float64, 0.0),
    ("total_impulse", np.float64, 0.0),
    ("work", np.float64, 0.0),
    ("gross_work", np.float64, 0.0),
    ("dissipated", np.float64, 0.0),  # integrated, where a ledger is kept
    ("lost", np.float64, 0.0),  # in contact
    ("base_work", np.float64, 0.0),  # of a moving base, on the beam in its frame
    ("circuit_energy", np.float64, 0.0),  # lost in a harvester's circuit, load included
    ("peak_circuit", np.float64, 0.0),  # greatest voltage or current, as the circuit's coordinate
    ("load_work", np.float64, 0.0),  # of what an axial load has beyond its mean
    ("first_energy", np.float64, 0.0),
    ("energy", np.float64, 0.0),  # at the end, contact included
    ("displacement", np.float64, 0.0),  # of contact point and centre, at the end
    ("center", np.float64, 0.0),
    ("deepest", np.float64, 0.0),  # greatest penetration of the present contact
    ("impulse", np.float64, 0.0),  # of the present contact
    ("early_stop_time", np.float64, math.nan),
)


OTHER_IMPACTS, OTHER_PEAK, OTHER_IMPULSE, OTHER_WORK = range(4)
"""What is kept of each striker beside the first."""


@dataclass(frozen=True)
class Statistic:
    """One row of the table.

    Attributes
    ----------
    name : str
        Variable of a map, and attribute of an :class:`~snapbeam.Outcome`.
    dtype : str
    unit : str
        As UDUNITS knows it; ``"1"`` for displacements over b and velocities over b omega_1.
    long_name : str
    value : callable
        From a :class:`~snapbeam.engines.answer.Reading` of many runs to an array of shape (runs,).  With *update*:
        from the reading and the array of what *update* left.
    update : callable, optional
        ``update(held, step) -> held``, a scalar function of numbers that kernels compile; *step* is a
        :class:`Passed`.
    start : float
        What *update* begins with.
    """

    name: str
    dtype: str
    unit: str
    long_name: str
    value: Callable[..., Values]
    update: Callable[[float, Any], float] | None = None
    start: float = 0.0


def _plain(column: str) -> Callable[[Reading], Values]:
    return lambda reading: reading.accumulators[column]


def _seen(column: str, factor: Callable[[Reading], float] = lambda _: 1.0) -> Callable[[Reading], Values]:
    return lambda reading: reading.seen(column) * factor(reading)


def _low_high(low: str, high: str, greatest: bool) -> Callable[[Reading], Values]:
    """Least or greatest displacement over b, in the signs of space."""

    def value(reading: Reading) -> Values:
        upward = reading.sign > 0.0
        column = high if greatest == upward else low
        return reading.sign * reading.seen(column) / reading.length + 0.0

    return value


def _peak(low: str, high: str) -> Callable[[Reading], Values]:
    return lambda reading: np.maximum(np.abs(reading.seen(low)), np.abs(reading.seen(high))) / reading.length


def _rms(column: str, per_speed: bool) -> Callable[[Reading], Values]:
    def value(reading: Reading) -> Values:
        with np.errstate(invalid="ignore", divide="ignore"):
            mean = np.where(reading.duration > 0.0, reading.seen(column) / reading.duration, np.nan)
        return np.asarray(np.sqrt(mean) / (reading.speed if per_speed else reading.length))

    return value


def _response(reading: Reading) -> Values:
    accumulators = reading.accumulators
    kinds = class_of(
        accumulators["zero_crossings"],
        accumulators["zero_crossings_last_quarter"],
        reading.cycles,
        -reading.first_side * accumulators["side"],
    )
    return np.where(reading.good, kinds, ResponseClass.UNKNOWN)


def _contact_share(reading: Reading) -> Values:
    with np.errstate(invalid="ignore", divide="ignore"):
        share = np.where(
            reading.duration > 0.0, reading.accumulators["contact_time"] / reading.duration, np.nan
        )
    return np.where(reading.good, share, np.nan)


def _high_share(reading: Reading) -> Values:
    with np.errstate(invalid="ignore", divide="ignore"):
        share = reading.seen("high_energy_time") / reading.seen("energy_time")
    return np.where(reading.seen("energy_time") > 0.0, share, np.where(reading.good, 0.0, np.nan))


def _dissipated(reading: Reading) -> Values:
    given = reading.seen("work") + reading.seen("base_work") + reading.seen("load_work")
    return given - (reading.seen("energy") - reading.seen("first_energy")) - _harvested(reading)


def _harvested(reading: Reading) -> Values:
    tapped = reading.ensemble.tapped
    return reading.seen("circuit_energy") * (0.0 if tapped is None else tapped.share)


def _harvested_power(reading: Reading) -> Values:
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.where(reading.duration > 0.0, _harvested(reading) / reading.duration, np.nan)


def _harvested_per_cycle(reading: Reading) -> Values:
    runs = reading.ensemble.runs
    with np.errstate(invalid="ignore", divide="ignore"):
        done = reading.cycles * reading.duration / (runs["end"] * runs["tick"])
        return np.where(done > 0.0, _harvested(reading) / done, np.nan)


def _peak_voltage(reading: Reading) -> Values:
    tapped = reading.ensemble.tapped
    return reading.seen("peak_circuit") * (0.0 if tapped is None else np.abs(tapped.volts))


def _mean_power(reading: Reading) -> Values:
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.where(reading.duration > 0.0, reading.seen("work") / reading.duration, np.nan)


_ROWS = (
    Statistic("response_class", "int8", "1", "response class", _response),
    Statistic("status", "int8", "1", "status of the run", lambda reading: reading.status),
    Statistic("zero_crossings", "int32", "1", "zero crossings of the centre displacement", _plain("zero_crossings")),
    Statistic(
        "zero_crossings_last_quarter", "int32", "1", "zero crossings in the last quarter", _plain("zero_crossings_last_quarter")
    ),
    Statistic("last_zero_crossing", "float64", "s", "time of the last zero crossing", _plain("last_zero_crossing")),
    Statistic(
        "final_well", "int8", "1", "sign of the centre displacement at the end",
        lambda reading: reading.sign * reading.accumulators["side"],
    ),
    Statistic("final_well_proven", "bool", "1", "whether the run provably ends in its last well", lambda r: r.final),
    Statistic(
        "min_displacement", "float64", "1", "least beam displacement at the striker, over b",
        _low_high("min_displacement", "max_displacement", greatest=False),
    ),
    Statistic(
        "max_displacement", "float64", "1", "greatest beam displacement at the striker, over b",
        _low_high("min_displacement", "max_displacement", greatest=True),
    ),
    Statistic(
        "min_midspan_displacement", "float64", "1", "least centre displacement, over b",
        _low_high("min_center", "max_center", greatest=False),
    ),
    Statistic(
        "max_midspan_displacement", "float64", "1", "greatest centre displacement, over b",
        _low_high("min_center", "max_center", greatest=True),
    ),
    Statistic("peak_force", "float64", "N", "peak contact force", lambda reading: reading.peak_force),
    Statistic("impacts", "int32", "1", "impacts", _plain("impacts")),
    Statistic("contact_time_fraction", "float64", "1", "share of time in contact", _contact_share),
    Statistic("early_stop_time", "float64", "s", "time at which the class became certain", _plain("early_stop_time")),
    Statistic(
        "peak_displacement", "float64", "1", "greatest distance of the contact point from the straight beam, over b",
        _peak("min_displacement", "max_displacement"),
    ),
    Statistic(
        "peak_midspan_displacement", "float64", "1", "greatest distance of the centre from the straight beam, over b",
        _peak("min_center", "max_center"),
    ),
    Statistic(
        "peak_velocity", "float64", "1", "greatest speed of the contact point at the end of a step, over b omega_1",
        _seen("peak_velocity", lambda reading: 1.0 / reading.speed),
    ),
    Statistic(
        "peak_midspan_velocity", "float64", "1", "greatest speed of the centre at the end of a step, over b omega_1",
        _seen("peak_midspan_velocity", lambda reading: 1.0 / reading.speed),
    ),
    Statistic(
        "rms_displacement", "float64", "1", "root mean square displacement of the contact point, over b",
        _rms("square_displacement", per_speed=False),
    ),
    Statistic(
        "rms_midspan_displacement", "float64", "1", "root mean square displacement of the centre, over b",
        _rms("square_center", per_speed=False),
    ),
    Statistic(
        "rms_velocity", "float64", "1", "root mean square velocity of the contact point, over b omega_1",
        _rms("square_velocity", per_speed=True),
    ),
    Statistic(
        "rms_midspan_velocity", "float64", "1", "root mean square velocity of the centre, over b omega_1",
        _rms("square_midspan_velocity", per_speed=True),
    ),
    Statistic("impulse", "float64", "N s", "impulse on the beam, all impacts", _seen("total_impulse")),
    Statistic("striker_work", "float64", "J", "work done by the striker", _seen("work")),
    Statistic(
        "gross_work", "float64", "J", "work done by the striker, the base and the axial load, taken as positive",
        _seen("gross_work"),
    ),
    Statistic("mean_power", "float64", "W", "work done by the striker over the time of the run", _mean_power),
    Statistic(
        "energy_dissipated", "float64", "J", "energy dissipated: all work less what the beam gained",
        _dissipated,
    ),
    Statistic("energy_lost_contact", "float64", "J", "energy lost in contact", _seen("lost")),
    Statistic(
        "high_frequency_energy_fraction", "float64", "1", "share of the modal energy above a multiple of omega_1, over time",
        _high_share,
    ),
    Statistic("base_work", "float64", "J", "work done by the base, in its frame", _seen("base_work")),
    Statistic("load_work", "float64", "J", "work done by the change of the axial load", _seen("load_work")),
    Statistic("energy_harvested", "float64", "J", "energy that ended in the harvester's load", _harvested),
    Statistic(
        "harvested_power", "float64", "W", "energy in the harvester's load over the time of the run", _harvested_power
    ),
    Statistic(
        "harvested_per_cycle", "float64", "J", "energy in the harvester's load over the cycles of the run",
        _harvested_per_cycle,
    ),
    Statistic("peak_voltage", "float64", "V", "greatest voltage across the load at the end of a step", _peak_voltage),
)  # fmt: skip


def _of_one_striker(name: str) -> Statistic | None:
    from snapbeam.engines.each import of_one_named

    return of_one_named(name)


STATISTICS: dict[str, Statistic] = NamedTable(_of_one_striker, ((row.name, row) for row in _ROWS))
"""Variables of a map and attributes of an outcome, by name; ``peak_force_striker_2`` is found too, not listed."""


def updated() -> tuple[Statistic, ...]:
    """The statistics that kernels update after every step."""
    return tuple(row for row in STATISTICS.values() if row.update is not None)


def register(statistic: Statistic) -> None:
    """Add a statistic to the table; every run and map from now on has it.

    Raises
    ------
    InputError
        If the name is taken or cannot name a variable.
    """
    if not statistic.name.isidentifier():
        raise InputError(f"statistic {statistic.name!r}: must be a name, such as 'rms_force'")
    if statistic.name in STATISTICS:
        raise InputError(f"statistic {statistic.name!r}: there is one of that name")
    STATISTICS[statistic.name] = statistic


def unregister(name: str) -> None:
    """Take a registered statistic out of the table again.

    Raises
    ------
    InputError
        If there is none of that name, or it is one of the package's own.
    """
    if name not in list(STATISTICS) or STATISTICS[name] in _ROWS:
        raise InputError(f"statistic {name!r}: was not registered")
    del STATISTICS[name]


def accumulators_dtype(others: int = 0) -> np.dtype[Any]:
    """One record of what kernels keep of a run, with *others* strikers beside the first."""
    # first, so that Numba does not take the record for one of the kind without
    fields: list[Any] = [("others", np.float64, (others, OTHER_WORK + 1))] if others else []
    fields += [(name, kind) for name, kind, _ in _KEPT]
    fields += [(f"own_{row.name}", np.float64) for row in updated()]
    return np.dtype(fields, align=True)


ACCUMULATORS = accumulators_dtype()
"""Of the package's own statistics."""


def empty_accumulators(runs: int, others: int = 0) -> Any:
    """Books of runs that have not begun, with *others* strikers beside the first."""
    accumulators_of_runs = np.zeros(runs, dtype=accumulators_dtype(others))
    for name, _, start in _KEPT:
        accumulators_of_runs[name] = start
    for row in updated():
        accumulators_of_runs[f"own_{row.name}"] = row.start
    return accumulators_of_runs
