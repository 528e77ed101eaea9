"""The table of outcomes: what engines keep of a run, and what follows from it.

Engines write :data:`ACCUMULATORS`, one record a run; maps, runs and :class:`~snapbeam.RunSummary` hold :data:`STATISTICS`.
A new statistic is a row: either a formula of what is kept already, or, with ``update``, a scalar function
that engines call after every step.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Container
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from snapbeam.model.early_termination import crossing_energy, decidable_energy
from snapbeam.model.extension import takes
from snapbeam.solver.ensemble import Ensemble, Records
from snapbeam.util.status_codes import ResponseClass, RunStatus, class_of
from snapbeam.util.validation import InputError, NamedTable, instance, require_texts, shown

_MADE = 0.01
"""Tolerance of the energy balance over the gross work: a run that gains more energy is not accepted."""
_ROUNDED = 1e-6
"""The same over the energies, for rounding."""
_CANCELLED = 1e-12
"""The same over the potential energy of the well, for the rounding of differences from it."""
_Array = NDArray[np.float64]


Values = NDArray[Any]

WORKS = {
    "base_work": "work done by the base, in its frame",
    "force_work": "work done by external forces",
    "load_work": "work done by the change of the axial load",
    "local_force_work": "work done by the damping part of a local force",
}
"""Accumulators of the works of what is no contact, and what they are."""


class CompletedStep(NamedTuple):
    """A step, as statistics see it; SI units, displacements positive away from the striker."""

    time: float
    """Time at its beginning, s."""
    length: float
    displacement: tuple[float, float]
    """Displacement of the beam at the striker's location, at the two ends of the step."""
    velocity: tuple[float, float]
    midspan_displacement: tuple[float, float]
    midspan_velocity: tuple[float, float]
    penetration: tuple[float, float]
    """Penetration of the first contact at the two ends of the step, m; -1e30 without a striker."""
    touching: bool


SAMPLED = ("energy", "contact", "work", "dissipated", "lost", *WORKS)
"""Columns of the values of a sample; the energies lost in circuits follow."""


OF_CORE = (
    "status", "time", "side", "zero_crossings", "zero_crossings_last_quarter", "last_zero_crossing", "steps", "trials",
    "sampled_steps", "min_displacement", "max_displacement", "min_center", "max_center", "peak_velocity",
    "peak_midspan_velocity", "square_displacement", "square_center", "square_velocity", "square_midspan_velocity",
    "energy_time", "high_energy_time", "dissipated", "first_energy", "energy", "displacement", "center", "early_stop_time",
)  # fmt: skip
"""Counts of the core for a run, as in ``core/api.hpp: Statistic``: the time in ticks; sides are -1 in the well that a run
begins in; squares and energies of modes are integrals over time; the last energy has that of contacts."""
_KEPT = (*OF_CORE, "impacts", "peak_force", "contact_time", "total_impulse", "work", "gross_work", "lost", *WORKS)
"""Accumulators of every engine for a run: the same and those of all channels."""
_COUNTED = frozenset(OF_CORE[:5]) | {"steps", "trials", "sampled_steps", "impacts"}
_AT_START = {"status": float(RunStatus.NOT_RUN), "last_zero_crossing": math.nan, "early_stop_time": math.nan}
"""Values at the start that are not 0."""
OF_CONTACT = ("impacts", "peak_force", "impulse", "work")
"""Columns of what is kept of each contact."""
CIRCUIT_LOSS, CIRCUIT_LATE_LOSS, CIRCUIT_PEAK = range(3)
"""Columns of each circuit: energy lost, J, with load; that in the last quarter; maximum of its coordinate."""


@dataclass(frozen=True)
class Statistic:
    """One row of the table.

    Attributes
    ----------
    name : str
        Variable of a map, and attribute of an :class:`~snapbeam.RunSummary`.
    dtype : str
        Data type of the variable.
    unit : str
        Unit as UDUNITS knows it; ``"1"`` for displacements over b and velocities over b omega_1.
    long_name : str
        Meaning in words.
    value : callable
        Function of a :class:`~snapbeam.solver.statistics.Reading` of many runs that returns an array of shape (runs,).
        With *update* also of the array of results of *update*.
    update : callable, optional
        ``update(held, step) -> held``, a scalar function of numbers; *step* is a
        :class:`CompletedStep`.
    start : float
        Initial value of *update*.
    comment : str
        Relative error of the integral or of the maximum over time, in addition to the error of the run.

    See Also
    --------
    snapbeam.register_statistic

    Examples
    --------
    >>> import snapbeam as sb
    >>> row = sb.Statistic(
    ...     "mean_force", "float64", "N", "mean contact force",
    ...     lambda reading: reading.seen("total_impulse") / reading.duration,
    ... )
    """

    name: str
    dtype: str
    unit: str
    long_name: str
    value: Callable[..., Values]
    update: Callable[[float, Any], float] | None = None
    start: float = 0.0
    comment: str = ""

    def __post_init__(self) -> None:
        for name in ("name", "unit", "long_name", "comment"):
            require_texts(name, getattr(self, name))

    @property
    def normalised_by(self) -> str:
        """Unit that the value is over: "b", "b omega_1", or none."""
        found = re.search(r", over (b omega_1|b)$", self.long_name)
        return found[1] if found else ""


def _over(above: Values, below: Values) -> Values:
    """A ratio, NaN where there is nothing to divide by."""
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.where(below > 0.0, above / below, np.nan)


def _column(column: str) -> Callable[[Reading], Values]:
    return lambda reading: reading.accumulators[column]


def _seen(column: str) -> Callable[[Reading], Values]:
    return lambda reading: reading.seen(column)


def _speed(column: str) -> Callable[[Reading], Values]:
    return lambda reading: reading.seen(column) * (1.0 / reading.speed)


def _low_high(of: str, greatest: bool) -> Callable[[Reading], Values]:
    """Minimum or maximum displacement over b, in the signs of space."""

    def value(reading: Reading) -> Values:
        end = "max" if greatest == (reading.sign > 0.0) else "min"
        return reading.sign * reading.seen(f"{end}_{of}") / reading.length + 0.0

    return value


def _peak(of: str) -> Callable[[Reading], Values]:
    ends = f"min_{of}", f"max_{of}"
    return lambda reading: np.maximum(*(np.abs(reading.seen(end)) for end in ends)) / reading.length


def _rms(of: str) -> Callable[[Reading], Values]:
    def value(reading: Reading) -> Values:
        mean = _over(reading.seen(f"square_{of}"), reading.duration)
        real = np.where(mean >= 0.0, mean, np.nan)  # less its change along a chaotic run it may be negative
        return np.asarray(np.sqrt(real) / (reading.speed if "velocity" in of else reading.length))

    return value


def _response(reading: Reading) -> Values:
    kept, ensemble = reading.accumulators, reading.ensemble
    all_crossings, late = kept["zero_crossings"], kept["zero_crossings_last_quarter"]
    kinds = class_of(all_crossings, late, ensemble.cycles, -ensemble.first_side * kept["side"])
    structure = ensemble.structure
    if not (structure.model.is_bistable and structure.wells_are_mirror_images and ensemble.has_striker):
        # the paper's rule is for equal wells and a striker; here the centre may cross far from the other well
        kinds = np.where(reading.other_well_reached, kinds, ResponseClass.INTRAWELL)
    return np.where(reading.good, kinds, ResponseClass.UNKNOWN)


def _high_share(reading: Reading) -> Values:
    energy = reading.seen("energy_time")
    return np.where(energy > 0.0, _over(reading.seen("high_energy_time"), energy), np.where(reading.good, 0.0, np.nan))


def _dissipated(reading: Reading) -> Values:
    given = sum(map(reading.seen, WORKS), start=reading.seen("work"))
    return given - (reading.seen("energy") - reading.seen("first_energy")) - _harvested(reading)


def _harvested(reading: Reading, column: int = CIRCUIT_LOSS) -> Values:
    """Energies lost in circuits that ended in their loads."""
    circuits = enumerate(reading.ensemble.circuits)
    parts = (circuit.share * reading.accumulators["circuits"][:, i, column] for i, circuit in circuits)
    return np.where(reading.good, sum(parts, start=np.zeros(reading.accumulators.size)), np.nan)


def _harvested_per_cycle(reading: Reading) -> Values:
    runs = reading.ensemble.runs
    return _over(_harvested(reading), reading.ensemble.cycles * reading.duration / (runs["end"] * runs["tick"]))


def _late_duration(reading: Reading) -> Values:
    """Seconds of a run in its last quarter; NaN for a run that ended before it."""
    runs = reading.ensemble.runs
    inside = (reading.accumulators["time"] - runs["last_quarter"]) * runs["tick"]
    return np.where(inside > 0.0, inside, np.nan)


def _late_voltage(reading: Reading) -> Values:
    if not reading.ensemble.circuits:
        return 0.0 * _late_duration(reading)
    first = reading.ensemble.circuits[0]
    per_square = 1.0 / first.rate if reading.ensemble.structure.circuits[0].mode is None else first.rate
    lost = np.where(reading.good, reading.accumulators["circuits"][:, 0, CIRCUIT_LATE_LOSS], np.nan)
    # a circuit at rest has lost an energy of the size of rounding, of either sign
    return np.sqrt(np.maximum(lost, 0.0) / _late_duration(reading) / per_square) * np.abs(first.volts)


def _peak_voltage(reading: Reading) -> Values:
    peak: Any = 0.0
    if reading.ensemble.circuits:
        peak = reading.accumulators["circuits"][:, 0, CIRCUIT_PEAK] * np.abs(reading.ensemble.circuits[0].volts)
    return np.where(reading.good, peak, np.nan)


_ERROR = "relative error of the integral over time, beside that of the run: at most about {} (standard), {} (reference)"
_RMS_DISPLACEMENT = _ERROR.format("1e-5", "2e-7")
_RMS_VELOCITY = _ERROR.format("2e-4", "2e-6")
_SHARE = _ERROR.format("5e-4", "1e-5")
_PEAK = (
    "relative error of the maximum inside steps, beside that of the run: at most about {} (standard), {} (reference); "
    "measured on 200 random runs of the paper's beam with 1 to 32 modes"
)
_PEAK_VELOCITY = _PEAK.format("1e-4", "1e-5")
_PEAK_VOLTAGE = _PEAK.format("5e-3", "1e-5")

_TABLE: dict[str, tuple[Any, ...]] = {
    "response_class": ("int8", "1", _response, "response class"),
    "status": ("int8", "1", lambda reading: reading.status, "status of the run"),
    "zero_crossings": ("int32", "1", _column("zero_crossings"), "zero crossings of the centre displacement"),
    "zero_crossings_last_quarter":
        ("int32", "1", _column("zero_crossings_last_quarter"), "zero crossings in the last quarter"),
    "last_zero_crossing": ("float64", "s", _column("last_zero_crossing"), "time of the last zero crossing"),
    "final_well": ("int8", "1", lambda reading: reading.sign * reading.accumulators["side"],
        "sign of the centre displacement at the end"),
    "other_well_reached": ("bool", "1", lambda reading: reading.other_well_reached,
        "whether the centre came more than half of the way from the border of the wells to the well it did not begin in, "
        "or provably stays in that well; with one well, to the mirror image of its rest"),
    "final_well_proven": ("bool", "1", lambda r: r.final, "whether the run provably ends in its last well"),
    "min_displacement":
        ("float64", "1", _low_high("displacement", False), "minimum beam displacement at the striker, over b"),
    "max_displacement":
        ("float64", "1", _low_high("displacement", True), "maximum beam displacement at the striker, over b"),
    "min_midspan_displacement": ("float64", "1", _low_high("center", False), "minimum mid-span displacement, over b"),
    "max_midspan_displacement": ("float64", "1", _low_high("center", True), "maximum mid-span displacement, over b"),
    "peak_force": ("float64", "N", lambda reading: reading.peak_force, "peak contact force"),
    "impacts": ("int32", "1", _column("impacts"), "impacts, also those that have not ended"),
    "contact_time_fraction": ("float64", "1", lambda reading: _over(reading.seen("contact_time"), reading.duration),
        "time in contact over the duration, of all strikers together"),
    "early_stop_time": ("float64", "s", _column("early_stop_time"), "time at which the class became certain"),
    "peak_displacement":
        ("float64", "1", _peak("displacement"), "maximum distance of the contact point from the straight beam, over b"),
    "peak_midspan_displacement":
        ("float64", "1", _peak("center"), "maximum distance of mid-span from the straight beam, over b"),
    "peak_velocity": ("float64", "1", _speed("peak_velocity"),
        "maximum speed of the contact point, over b omega_1", _PEAK_VELOCITY),
    "peak_midspan_velocity": ("float64", "1", _speed("peak_midspan_velocity"),
        "maximum speed of mid-span, over b omega_1", _PEAK_VELOCITY),
    "rms_displacement": ("float64", "1", _rms("displacement"),
        "root mean square displacement of the contact point, over b", _RMS_DISPLACEMENT),
    "rms_midspan_displacement": ("float64", "1", _rms("center"),
        "root mean square displacement of the centre, over b", _RMS_DISPLACEMENT),
    "rms_velocity": ("float64", "1", _rms("velocity"),
        "root mean square velocity of the contact point, over b omega_1", _RMS_VELOCITY),
    "rms_midspan_velocity": ("float64", "1", _rms("midspan_velocity"),
        "root mean square velocity of the centre, over b omega_1", _RMS_VELOCITY),
    "impulse": ("float64", "N s", _seen("total_impulse"), "impulse on the beam, all impacts"),
    "striker_work": ("float64", "J", _seen("work"), "work done by the striker"),
    "gross_work": ("float64", "J", _seen("gross_work"),
        "work done by strikers, base, axial load and external forces, taken as positive"),
    "mean_power": ("float64", "W", lambda reading: _over(reading.seen("work"), reading.duration),
        "work done by the striker over the time of the run"),
    "energy_dissipated": ("float64", "J", _dissipated, "energy dissipated: all work less what the beam gained"),
    "energy_lost_contact": ("float64", "J", _seen("lost"), "energy lost in contact"),
    "high_frequency_energy_fraction": ("float64", "1", _high_share,
        "fraction of the modal energy above a multiple of omega_1, over time", _SHARE),
    **{name: ("float64", "J", _seen(name), long_name) for name, long_name in WORKS.items()},
    "energy_harvested": ("float64", "J", _harvested, "energy that ended in the loads of harvesters"),
    "harvested_power": ("float64", "W", lambda reading: _over(_harvested(reading), reading.duration),
        "energy in the loads of harvesters over the time of the run"),
    "harvested_per_cycle": ("float64", "J", _harvested_per_cycle,
        "energy in the loads of harvesters over the cycles of the run"),
    "harvested_power_last_quarter":
        ("float64", "W", lambda reading: _harvested(reading, CIRCUIT_LATE_LOSS) / _late_duration(reading),
        "power in the loads of harvesters, last quarter of the run"),
    "rms_voltage_last_quarter": ("float64", "V", _late_voltage,
        "root mean square voltage across the (first) load, last quarter of the run"),
    "peak_voltage": ("float64", "V", _peak_voltage, "maximum voltage across the (first) load", _PEAK_VOLTAGE),
}  # fmt: skip
"""Data type, unit, value, long name and comment of each statistic of the package."""
_ROWS = tuple(
    Statistic(name, dtype, unit, long_name, value, comment="".join(comment))
    for name, (dtype, unit, value, long_name, *comment) in _TABLE.items()
)


STATISTICS: dict[str, Statistic] = NamedTable(lambda name: of_one_named(name), ((row.name, row) for row in _ROWS))
"""Variables of a map and attributes of an outcome, by name; ``peak_force_contact_2`` is found too, not listed."""


def updated() -> tuple[Statistic, ...]:
    """The statistics that engines update after every step."""
    return tuple(row for row in STATISTICS.values() if row.update is not None)


def register_statistic(statistic: Statistic) -> None:
    """Add a statistic to the table; every run and map from now on has it.

    See Also
    --------
    snapbeam.Statistic, snapbeam.unregister_statistic

    Examples
    --------
    >>> import snapbeam as sb
    >>> sb.register_statistic(
    ...     sb.Statistic(
    ...         "mean_force", "float64", "N", "mean contact force",
    ...         lambda reading: reading.seen("total_impulse") / reading.duration,
    ...     )
    ... )
    >>> "mean_force" in sb.STATISTICS
    True
    >>> sb.unregister_statistic("mean_force")
    """
    instance("statistic", statistic, Statistic, "a Statistic")
    if not isinstance(statistic.name, str) or not statistic.name.isidentifier():
        raise InputError(f"statistic {statistic.name!r}: must be a name, such as 'rms_force'")
    if statistic.name in STATISTICS:
        raise InputError(f"statistic {statistic.name!r}: there is one of that name")
    results = ("reading",) if statistic.update is None else ("reading", "held")
    for hook, names in (("value", results), ("update", ("held", "step"))):
        function = getattr(statistic, hook)
        if function is not None and not takes(function, len(names)):
            raise InputError(f"statistic {statistic.name!r}: {hook} must be a function of ({', '.join(names)})")
    STATISTICS[statistic.name] = statistic


def unregister_statistic(name: str) -> None:
    """Take a registered statistic out of the table again.

    See Also
    --------
    snapbeam.register_statistic

    Examples
    --------
    >>> import snapbeam as sb
    >>> row = sb.Statistic("impulse_per_second", "float64", "N", "impulse per second", lambda reading: 0.0)
    >>> sb.register_statistic(row)
    >>> sb.unregister_statistic("impulse_per_second")
    """
    if not isinstance(name, str) or name not in list(STATISTICS) or STATISTICS[name] in _ROWS:
        raise InputError(f"statistic {shown(name)}: was not registered")
    del STATISTICS[name]


def accumulators_dtype(contacts: int = 0, circuits: int = 0) -> np.dtype[Any]:
    """One record of what engines keep of a run, with so many contacts and circuits."""
    parts = (("contacts", contacts, len(OF_CONTACT)), ("circuits", circuits, CIRCUIT_PEAK + 1))
    fields: list[Any] = [(name, np.float64, (count, columns)) for name, count, columns in parts if count]
    fields += [(f"own_{row.name}", np.float64) for row in updated()]
    fields += [(name, np.int64 if name in _COUNTED else np.float64) for name in _KEPT]
    return np.dtype(fields, align=True)


ACCUMULATORS = accumulators_dtype()
"""Data type of the accumulators of the package's own statistics."""


def empty_accumulators(runs: int, contacts: int = 0, circuits: int = 0) -> Any:
    """Accumulators of runs that have not begun, with so many contacts and circuits."""
    accumulators_of_runs = np.zeros(runs, dtype=accumulators_dtype(contacts, circuits))
    for name, start in (_AT_START | {f"own_{row.name}": row.start for row in updated()}).items():
        accumulators_of_runs[name] = start
    return accumulators_of_runs


def rounding_energy(ensemble: Ensemble, accumulators_of_runs: Records) -> _Array:
    """Energy that rounding may add to each run, J, even where nothing does work."""
    ends = np.abs(accumulators_of_runs["energy"]) + np.abs(accumulators_of_runs["first_energy"])
    return np.asarray(_ROUNDED * ends + _CANCELLED * abs(ensemble.structure.model.well_energy))


def lost_in_circuits(accumulators_of_runs: Any) -> NDArray[np.float64]:
    """Energy lost in all circuits of each run, J."""
    if "circuits" not in accumulators_of_runs.dtype.names:
        return np.zeros(accumulators_of_runs.size)
    return np.asarray(accumulators_of_runs["circuits"][:, :, CIRCUIT_LOSS].sum(axis=1))


# Statistics of each of several strikers: rows beside the table's, whose names bear the striker's number.


_EACH = {
    "impacts": ("impacts", "impacts"),
    "peak_force": ("peak_force", "peak contact force"),
    "impulse": ("impulse", "impulse on the beam, all impacts"),
    "striker_work": ("work", "work done"),
}
"""Statistics of each of several strikers: one of :data:`OF_CONTACT`, and long name."""


def name_in(held: Container[Any], name: str) -> str:
    """The name by which runs have a statistic: that of the first striker is ``peak_force`` where there is one."""
    whole = name.removesuffix("_contact_1") if isinstance(name, str) else name
    return whole if name not in held and whole in _EACH else name


def rows_for(strikers: int) -> dict[str, Statistic]:
    """The rows of a system with so many strikers: the table's, and if there are several those of each of them."""
    rows = [_of_one(name, number + 1) for number in range(strikers if strikers > 1 else 0) for name in _EACH]
    return STATISTICS | {row.name: row for row in rows}


def of_one_named(name: str) -> Statistic | None:
    """The row of one of several strikers by its name; None if there is no such row."""
    whole, _, number = name.rpartition("_contact_")
    if whole not in _EACH or not number.isdecimal() or number != str(int(number)) or number == "0":
        return None
    return _of_one(whole, int(number))


def _of_one(name: str, number: int) -> Statistic:
    """Value of one striker, counted from 1."""
    whole, (column, words) = STATISTICS[name], _EACH[name]
    words = f"{words}, contact {number}"
    return Statistic(
        f"{name}_contact_{number}", whole.dtype, whole.unit, words, lambda reading: reading.one(column, number)
    )


# What engines answer: the accumulators of many runs, read as statistics in the units and signs of a map.


@dataclass(frozen=True)
class Reading:
    """The accumulators of an ensemble, and what it takes to read them."""

    ensemble: Ensemble
    accumulators: Records

    @property
    def sign(self) -> float:
        """+1 for a striker below, -1 for one above."""
        return self.ensemble.structure.sign

    @property
    def length(self) -> float:
        """Length that normalises displacements, m."""
        return self.ensemble.scale.length

    @property
    def speed(self) -> float:
        """Speed that normalises velocities, m/s."""
        return self.ensemble.scale.length * self.ensemble.scale.omega

    @cached_property
    def status(self) -> NDArray[np.int64]:
        """Status of each run; ENERGY_ERROR if a run gained more energy than the work done on it.

        Damping, and a contact with losses, only take energy.
        """
        accumulators, status = self.accumulators, self.accumulators["status"]
        done = (status == RunStatus.OK) | (status == RunStatus.EARLY_STOP)
        with np.errstate(invalid="ignore"):  # runs that failed have no numbers
            given = sum((accumulators[name] for name in WORKS), start=accumulators["work"])
            made = accumulators["energy"] - accumulators["first_energy"] - given
        allowed = _MADE * accumulators["gross_work"] + rounding_energy(self.ensemble, accumulators)
        return np.where(done & (made > allowed), RunStatus.ENERGY_ERROR, status)

    @cached_property
    def good(self) -> NDArray[np.bool_]:
        """Runs whose class is known."""
        status = self.status
        return np.asarray((status == RunStatus.OK) | (status == RunStatus.EARLY_STOP))

    @cached_property
    def duration(self) -> NDArray[np.float64]:
        """Time integrated, s."""
        return np.asarray(self.accumulators["time"] * self.ensemble.runs["tick"])

    def seen(self, column: str) -> NDArray[np.float64]:
        """A column, NaN where the run failed."""
        return np.where(self.good, self.accumulators[column], np.nan)

    def one(self, column: str, number: int) -> NDArray[np.float64]:
        """A column of one of several strikers, the first being 1."""
        found = self.accumulators["contacts"][:, number - 1, OF_CONTACT.index(column)]
        return np.asarray(found if column == "impacts" else np.where(self.good, found, np.nan))

    @property
    def peak_force(self) -> NDArray[np.float64]:
        """Peak force of any striker; NaN if impacts have zero duration."""
        force = self.seen("peak_force")
        without = self.ensemble.impulsive & (force == 0.0) & (self.accumulators["impacts"] > 0)
        return np.where(without, np.nan, force)

    @cached_property
    def other_well_reached(self) -> NDArray[np.bool_]:
        """Runs whose centre came more than half of the way from the border of the wells to the other well.

        Of a beam with one well, which snaps through and returns, the mirror image of its rest takes the place of the
        other well, and the flat shape that of the border.
        Runs that provably stay in that well count too: an early end may come before the first half of the way.
        """
        structure, kept = self.ensemble.structure, self.accumulators
        level, first = structure.dividing_height, structure.center_rest
        second = -first  # of one well, the mirror image of its rest position
        if structure.model.is_bistable:
            _, from_mirror_image, _ = structure.about_second_well()
            second = float(structure.center @ from_mirror_image) - first
        elif first == 0.0:
            return np.zeros(kept.size, dtype=bool)
        upper, lower = 0.5 * (max(first, second) - level), 0.5 * (min(first, second) - level)
        over, under = kept["max_center"] - level > upper, kept["min_center"] - level < lower
        stays = self.final & (kept["side"] == -self.ensemble.first_side)
        return np.asarray(self.good & (np.where(self.ensemble.first_side < 0, over, under) | stays))

    @cached_property
    def final(self) -> NDArray[np.bool_]:
        """Runs that will provably stay in the well they ended in.

        Untouched, the beam only loses energy: with less than it takes to come back to the highest position the tip
        will ever have, or to pass the saddle, it never does.  Nothing is said of a well that the tip is in.
        """
        accumulators, ensemble = self.accumulators, self.ensemble
        model = ensemble.structure.model
        found = np.zeros(accumulators.size, dtype=bool)
        if not model.is_bistable:
            return found
        settled = self.good & (accumulators["energy"] < crossing_energy(model) - model.well_energy)
        if not (ensemble.highest > -np.inf).any():
            return np.asarray(settled)
        away = settled & (accumulators["side"] > 0) & (accumulators["displacement"] > ensemble.reach)
        away &= accumulators["center"] > ensemble.structure.dividing_height
        which = np.flatnonzero(away)
        if which.size:
            bound = decidable_energy(model, ensemble.location[which], ensemble.highest[which])
            found[which] = accumulators["energy"][which] < bound
        return found


def statistics_of(ensemble: Ensemble, accumulators_of_runs: Records) -> dict[str, NDArray[Any]]:
    """Statistics of runs in the units and signs of a map, arrays of shape (runs,) by name."""
    reading = Reading(ensemble, accumulators_of_runs)
    found = {}
    for name, row in rows_for(ensemble.contacts).items():
        values = row.value(reading) if row.update is None else row.value(reading, accumulators_of_runs[f"own_{name}"])
        found[name] = np.asarray(values).astype(row.dtype)
    return found


# What engines hand over beside accumulators: output states, and pieces of a recorded run.


class OutputStates(NamedTuple):
    """States of many runs at every output time."""

    accumulators_of_runs: Records
    q: _Array
    """Linear modes about the current well, shape (runs, output states, N)."""
    p: _Array
    well_sign: NDArray[np.int64]
    """Current well: +1 first, -1 second, shape (runs, output states)."""
    contact_ticks: NDArray[np.int64]
    """Ticks since the present contact of each striker began, -1: apart, shape (runs, output states, strikers)."""


class Recorded(NamedTuple):
    """A piece of a recorded run."""

    times: _Array
    """Times of the samples, s, shape (samples,)."""
    q: _Array
    """Linear modes about the first well, shape (samples, N)."""
    p: _Array
    contacts: _Array
    """Penetration and force of every contact, shape (samples, strikers, 2)."""
    values: _Array
    """Beam energy, contact energy, work, dissipation, loss in contact, :data:`WORKS`, losses of circuits; shape (samples, columns)."""
    impacts: _Array
    """Onset, duration, peak force and impulse of each impact that ended, shape (impacts, 4)."""
    accumulators_of_runs: Records
    """The run's record of accumulators as it is at the end of the piece, shape (1,)."""
    last: tuple[Any, ...]
    """State at its end: what :class:`OutputStates` holds of one run and one time."""

    def at(self, which: Any) -> Recorded:
        """Some of the samples."""
        kept = {name: getattr(self, name)[which] for name in ("times", "q", "p", "contacts", "values")}
        return self._replace(**kept)
