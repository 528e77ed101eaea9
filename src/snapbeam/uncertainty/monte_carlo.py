"""Monte Carlo runs: statistics of numbered samples of a system, with checkpoints and workers as in a sweep."""

from __future__ import annotations

import os
import re
import warnings
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from snapbeam.dynamics.flow import InitialConditions, held_in_space
from snapbeam.model.integration import Integration
from snapbeam.model.parameter_axes import unit_of
from snapbeam.model.parameters import PHYSICAL, in_table, lookup, physical_names, ratio_of, row_of
from snapbeam.model.quantity import numbered, split_name
from snapbeam.model.state import amplitude_scale
from snapbeam.model.system import System
from snapbeam.solver.statistics import STATISTICS, Statistic, name_in, of_one_named, rows_for
from snapbeam.sweeps.compute import CheckpointOptions, compute_table
from snapbeam.sweeps.points import Columns, PointList
from snapbeam.sweeps.setup import Progress, SweepSetup, sweep_setup
from snapbeam.sweeps.tasks import PointWork
from snapbeam.uncertainty.distributions import Distribution, Normal, ParameterUncertainty, UniformTolerance
from snapbeam.util.diagnostics import DiagnosticWarning
from snapbeam.util.status_codes import ResponseClass, RunStatus
from snapbeam.util.units import number_in_unit, unit_in_text
from snapbeam.util.validation import (
    InputError,
    InputTypeError,
    checked,
    choice,
    instance,
    integer,
    or_default,
    shown,
    text,
)

Statistics = dict[str, NDArray[Any]]
_REACHED = (int(RunStatus.OK), int(RunStatus.EARLY_STOP))
_FIRST = (ResponseClass.INTRAWELL, ResponseClass.TRANSIENT_1)
_Array = NDArray[np.float64]
_Numbers = NDArray[np.int64]
_Made = dict[tuple[Any, ...], System]
_KEPT = 4096
"""Maximum number of cached systems."""


def _made(made: _Made, system: System, changes: dict[str, Any]) -> System:
    """A neighbour of a system, made once."""
    key = tuple(sorted(changes.items()))
    if key not in made:
        if len(made) >= _KEPT:
            made.clear()
        made[key] = system.replace(**changes)
    return made[key]


@dataclass(frozen=True, eq=False)
class _DrawnSetup(SweepSetup):
    """Runs of which many share a structure that was made before."""

    made: _Made = field(default_factory=dict)

    def neighbour(self, changes: dict[str, Any]) -> tuple[System, Integration]:
        """Neighbour of a point, as in any sweep."""
        if any(name.startswith("integration.") for name in changes):
            return super().neighbour(changes)
        return _made(self.made, self.system, changes), self.integration


@dataclass
class Trials:
    """Monte Carlo samples of a system, run on demand.

    The result of a run depends only on its point and the number of its sample.  Rounds are kept in a folder
    each of the store, in the order in which they are asked for: a question that asks the same again reads them
    instead.
    """

    system: System
    """System, with the tip fixed in space if initial states differ."""
    integration: Integration
    uncertainty: ParameterUncertainty
    keeping: CheckpointOptions = field(default_factory=CheckpointOptions)
    cluster: str | None = None
    runs: int = 0
    """Number of requested runs."""
    rounds: int = 0
    made: dict[tuple[Any, ...], System] = field(default_factory=dict, repr=False)
    """Systems of the structures that were sampled so far."""
    progress: Progress | None = field(default=None, repr=False)
    """Called with the runs of a round, unless the round has a report of its own."""
    scaled: bool = False
    """True if statistics have beside them the length and the velocity of the sample that they are over."""

    def columns(self, points: Columns, numbers: _Numbers, scores: NDArray[np.float64] | None = None) -> Columns:
        """Parameters of samples by their *numbers*, about *points*; *scores* (runs, parameters) replace their own."""
        uncertainty, found = self.uncertainty, dict(points)
        if scores is None:
            scores = uncertainty.normals(numbers)
        for j, (name, each) in enumerate(uncertainty.of.items()):
            nominal = points[name] if name in points else np.full(numbers.size, self._nominal(name))
            found[name] = each.at(nominal, scores[:, j])
            if lookup(name).quantity.kind is int:  # a seed
                found[name] = np.floor(found[name]).astype(np.int64)
            _require_allowed(name, found[name], each)
        in_units = [name for name in found if name in PHYSICAL]
        units = self._units(found, in_units, numbers.size)
        for j, name in enumerate(in_units):  # of the structure of each sample
            found[ratio_of(name)] = found.pop(name) / units[:, j]
            _require_allowed(ratio_of(name), found[ratio_of(name)])
        if uncertainty.hold_fixed == "physical" and uncertainty.structural:
            self._hold(points, found, numbers.size, {ratio_of(name) for name in in_units})
        if uncertainty.displacement > 0.0:
            found |= self._ringing(found, numbers)
        return found

    def statistics(
        self,
        points: Columns,
        numbers: _Numbers,
        progress: Progress | None = None,
        scores: NDArray[np.float64] | None = None,
    ) -> dict[str, NDArray[Any]]:
        """Run the samples and return every statistic of the table, arrays of shape (runs,)."""
        columns = self.columns(points, numbers, scores)
        if not columns:  # nothing is sampled and nothing varies: the system as it stands
            own = in_table(self.system.parameters)
            named = [name for name in own if isinstance(own[name], float) and lookup(name).is_run][:1]
            columns = {name: np.full(numbers.size, self._nominal(name)) for name in named}
        return self.of_columns(columns, progress)

    def of_columns(self, columns: Columns, progress: Progress | None = None) -> dict[str, NDArray[Any]]:
        """Run points as they are, without sampling."""
        setup = self._setup(columns)
        keeping = self.keeping
        if keeping.path is not None:
            keeping = replace(keeping, path=_folder(Path(keeping.path)) / f"round_{self.rounds:04d}")
        work = PointWork(setup)
        table, _ = compute_table(work, keeping, cluster=self.cluster, progress=progress or self.progress)
        self.rounds += 1
        self.runs += setup.points.size
        found = {name: work.values(name, table) for name in (*work.integers, *work.numbers)}
        found |= {name: found[name_in(found, name)] for name in rows_for(2) if name_in(found, name) in found}
        if self.scaled:
            found |= dict(zip((key for key, _ in _SCALES.values()), setup.scales_of(columns), strict=True))
        return found

    def _setup(self, columns: Columns) -> SweepSetup:
        """The runs as a sweep; every structure among them is made before any run, and once."""
        structural = [name for name in columns if not lookup(name).is_run]
        first = {name: values[:1] for name, values in columns.items()} if structural else columns
        with warnings.catch_warnings():
            if self.rounds:  # what is doubtful of the system was told in the first round
                warnings.simplefilter("ignore", DiagnosticWarning)
            setup = sweep_setup(self.system, PointList(first), self.integration)
        if not structural:
            return setup
        for _ in self._structures(columns, next(iter(columns.values())).size):
            pass
        return _DrawnSetup(setup.system, setup.integration, PointList(columns), self.made)

    def _nominal(self, name: str) -> float:
        value = self.system.get(name) if ratio_of(name) in self.system.parameters else None
        if value is None or np.ndim(value) != 0:
            same = [each for each in self.system.parameters if split_name(each)[1] == split_name(name)[1] != ""]
            way = f"; this system has {', '.join(same)}" if value is None and same else ""
            if way and name == "drive.phase":
                way += ": leave phase = True out, and give it as a UniformRange(0, 2 pi)"
            raise InputError(f"{name}: has no single value in this system to be drawn about{way}")
        return float(value)

    def _hold(self, points: Columns, found: Columns, size: int, known: set[str]) -> None:
        """Keep Hz, m/s and m where the beam differs from the one that the ratios were given for, but for those *known*."""
        kept = "beam.length" in self.uncertainty.of
        ratios = [name for name in self.system.parameters if kept or not name.endswith(".location")]
        names = physical_names([name for name in ratios if name not in known])
        nominal, drawn = self._units(points, names, size), self._units(found, names, size)
        for j, physical in enumerate(names):
            ratio = PHYSICAL[physical].parameter
            value = found[ratio] if ratio in found else np.full(size, self._nominal(ratio))
            found[ratio] = value * (nominal[:, j] / drawn[:, j])
            _require_allowed(ratio, found[ratio])

    def in_hz(self, points: Columns) -> Columns:
        """Points whose Omega and V are those of the nominal system, in the ratios of their own structure."""
        size = next(iter(points.values())).size
        names = ["drive.frequency_hz", "drive.velocity_m_s"]
        nominal, own = self._units({}, names, size), self._units(points, names, size)
        found = dict(points)
        for j, ratio in enumerate(("drive.frequency_ratio", "drive.velocity_amplitude")):
            found[ratio] = points[ratio] * (nominal[:, j] / own[:, j])
        return found

    def cycles(self, columns: Columns) -> NDArray[np.float64]:
        """Seconds of a cycle of every run of a sine."""
        size = next(iter(columns.values())).size
        ratio = columns.get("drive.frequency_ratio")
        if ratio is None:
            ratio = np.full(size, self._nominal("drive.frequency_ratio"))
        return np.asarray(1.0 / (ratio * self._units(columns, ["drive.frequency_hz"], size)[:, 0]))

    def _units(self, columns: Columns, names: list[str], size: int) -> NDArray[np.float64]:
        """Physical value of a ratio of 1 for every run, shape (runs, names)."""
        units = np.empty((size, len(names)))
        for system, which in self._structures(columns, size):
            units[which] = [unit_of(system, name) for name in names]
        return units

    def _structures(self, columns: Columns, size: int) -> Iterator[tuple[System, list[int]]]:
        """The structures among runs, and which runs have each."""
        names = [name for name in columns if not lookup(name).is_run and not name.startswith("integration.")]
        if not names:
            yield self.system, list(range(size))
            return
        keys: dict[tuple[Any, ...], list[int]] = {}
        for i, key in enumerate(zip(*(columns[name].tolist() for name in names), strict=True)):
            keys.setdefault(key, []).append(i)
        for key, which in keys.items():
            yield _made(self.made, self.system, dict(zip(names, key, strict=True))), which

    def _ringing(self, columns: Columns, numbers: _Numbers) -> Columns:
        """The start of every sample, as columns; one that would press the tip is turned about, so that it leaves it."""
        given = [name for name in columns if name.startswith("initial_state.")]
        if given:
            raise InputError(f"{given[0]}: is sampled by the displacement of the uncertainty; leave one of the two out")
        striker, size = self.system.striker, numbers.size
        modes = self.system.model.modes
        given_place = 0.5 if striker is None else striker.location
        location = columns.get("contact.location", np.full(size, given_place))
        table = np.empty((size, 2, modes))
        starts = InitialConditions(count=1, displacement=self.uncertainty.displacement, seed=self.uncertainty.seed)
        for system, which in self._structures(columns, size):
            scale = amplitude_scale(system.model)
            speed = scale * 2.0 * np.pi * system.model.reference_frequency
            runs: dict[int, list[int]] = {}
            for i in which:
                runs.setdefault(int(numbers[i]), []).append(i)
            for number, alike in runs.items():
                state = starts.state(system, number, location=location[alike])
                table[alike] = np.stack((state.amplitude / scale, state.velocity / speed), axis=1)
        return {
            f"initial_state.{what}[{mode + 1}]": table[:, k, mode]
            for k, what in enumerate(("amplitude", "velocity"))
            for mode in range(modes)
        }


def _folder(path: Path) -> Path:
    """The folder of a store of rounds, made where it is not there."""
    if path.exists() and not path.is_dir():
        raise InputError(f"checkpoint = {str(path)!r}: is a file; must be a folder")
    if not path.absolute().parent.is_dir():
        raise InputError(f"checkpoint = {str(path)!r}: {str(path.absolute().parent)!r} is not an existing folder")
    if (path / "map.json").exists():
        raise InputError(f"checkpoint = {str(path)!r}: holds a sweep; give another folder")
    path.mkdir(exist_ok=True)
    return path


def _remedy(name: str, distribution: Distribution | None) -> str:
    """Advice for samples out of range; a width in the unit of the parameter may be meant as a share of its value."""
    others = "make the uncertainty smaller, or use a LogNormal or a UniformRange"
    if not isinstance(distribution, (Normal, UniformTolerance)) or distribution.relative:
        return others
    width = distribution.half_width if isinstance(distribution, UniformTolerance) else distribution.standard_deviation
    unit = lookup(name).quantity.unit
    meant = f"{width:g}{'' if unit == '1' else f' {unit}'}"
    return f"{meant} is in the unit of the parameter; for a share of its value set relative = true; {others}"


def _require_allowed(name: str, values: NDArray[np.float64], distribution: Distribution | None = None) -> None:
    """Refuse samples that no system can have, with the advice to sample from something else."""
    for value in (values.min(), values.max()):
        try:
            lookup(name).quantity.check(name, value.item())
        except InputError as error:
            raise InputError(f"{error}; a sample is out of range; {_remedy(name, distribution)}") from None


def trials_of(
    system: System,
    uncertainty: ParameterUncertainty | None,
    integration: Integration | None,
    *,
    checkpoint: str | os.PathLike[str] | CheckpointOptions | None = None,
    cluster: str | None = None,
    early: bool = True,
    statistics: Iterable[str] = (),
) -> Trials:
    """Check what is sampled of a system; with *statistics*, which need whole runs, none ends early."""
    instance("system", system, System, "a System")
    uncertainty = or_default("uncertainty", uncertainty, ParameterUncertainty, "a ParameterUncertainty")
    integration = or_default("integration", integration, Integration, "an Integration")
    if uncertainty.hold_fixed == "physical" and uncertainty.structural:
        loose = [name for name in system.parameters if _has_no_unit(name)]
        if loose:
            raise InputError(
                f"hold_fixed = 'physical' with {loose[0]}: is a ratio without a physical unit, which would change with the "
                "structure; give hold_fixed = 'normalised'"
            )
    keeping = checkpoint if isinstance(checkpoint, CheckpointOptions) else CheckpointOptions(checkpoint)
    if uncertainty.moves_start and system.striker is not None and "contact.gap" not in uncertainty.of:
        if system.parameters.get("contact.gap") is None:
            system = held_in_space(system)
    needed = [each for each in statistics if each]
    require_held(needed, system)
    how = integration.replace(early_termination=early and not needed)
    return Trials(system, how, uncertainty, keeping, cluster, scaled=bool(needed))


@checked
def sample_systems(system: System, uncertainty: ParameterUncertainty, count: int) -> list[System]:
    """Draw systems from the uncertainty of parameters, for runs with a time series.

    Sample s is number s in every other function of the uncertainty.

    Parameters
    ----------
    system : System
        The nominal system.
    uncertainty : ParameterUncertainty
        Uncertain parameters and initial state.
    count : int
        Number of systems.

    Returns
    -------
    list of System
        Systems for :func:`snapbeam.simulate`, one for each sample.

    Raises
    ------
    InputError
        If a sampled value is out of range, or a parameter has no single value.

    See Also
    --------
    snapbeam.uncertainty.ParameterUncertainty, snapbeam.simulate

    Examples
    --------
    >>> import snapbeam as sb
    >>> from snapbeam import paper
    >>> system = paper.struck_beam(frequency_ratio=1.2, velocity_amplitude=0.18)
    >>> thickness = sb.uncertainty.Normal(0.01, relative=True)
    >>> uncertainty = sb.uncertainty.ParameterUncertainty(of={"beam.thickness": thickness})
    >>> systems = sb.uncertainty.sample_systems(system, uncertainty, 20)
    >>> runs = sb.simulate(systems, sb.Integration(cycles=2))
    >>> len({run.summary.max_displacement for run in runs})
    20
    """
    trials = trials_of(system, uncertainty, None)
    numbers = np.arange(integer("count", count, 1), dtype=np.int64)
    columns = trials.columns({}, numbers)
    return [
        trials.system.replace(**{name: values[k].item() for name, values in columns.items()})
        for k in range(numbers.size)
    ]


def _has_no_unit(name: str) -> bool:
    """Return whether a parameter of an excitation is a ratio to a time or length of the structure, without a unit of its own."""
    section, field = split_name(name)
    row = row_of(name)
    if row is None or numbered(section)[0] not in ("drive", "base_excitation", "axial_load", "force"):
        return False
    counts = field.endswith(("_cycles", "_fraction"))
    number = row.quantity.kind is float and row.is_run and row.quantity.unit == "1"
    return number and not counts and not physical_names([name])


Ask = Callable[[_Numbers, _Numbers], dict[str, NDArray[Any]]]
"""Function of points and samples, by number, that returns the statistics of their runs."""


# What a run may come to, read from its class: outcomes that have a probability.


class Event(NamedTuple):
    """Something that a run does or does not."""

    long_name: str
    happened: Callable[[Statistics], NDArray[np.bool_]]
    statistic: str = ""
    """Statistic of the whole run that is compared with a value; empty where the response class tells."""

    def failed(self, found: Statistics) -> NDArray[np.bool_]:
        """Mask of the runs of which it is not known."""
        lost = ~reached(found)
        return lost | np.isnan(found[self.statistic].astype(np.float64)) if self.statistic else lost


OUTCOMES: dict[str, Event] = {
    "snap": Event("the beam snaps through at least once", lambda found: found["response_class"] > 0),
    "continuous": Event(
        "the beam snaps on at the end", lambda found: found["response_class"] == ResponseClass.CONTINUOUS
    ),
    "first_well": Event(
        "the beam ends about the well it began in", lambda found: np.isin(found["response_class"], _FIRST)
    ),
    "other_well": Event(
        "the beam ends about the other well", lambda found: found["response_class"] == ResponseClass.TRANSIENT_2
    ),
}
"""Outcomes that every probability map has.  The last three exclude each other and one of them happens."""

_BEYOND = re.compile(r"\s*(\w+)\s*(>=|<=|>|<)\s*(\S.*?)\s*")
_COMPARED = {">": np.greater, "<": np.less, ">=": np.greater_equal, "<=": np.less_equal}
_SCALES = {"b": ("length_scale", "m"), "b omega_1": ("velocity_scale", "m/s")}
"""Keys of :meth:`Trials.of_columns` with the values that statistics are over, and their units."""


def outcome_named(given: Any, name: str = "outcome") -> tuple[str, Event]:
    """Return an outcome, one of :data:`OUTCOMES` or such as ``"peak_force > 60 N"``, and its name."""
    short = " ".join(text(name, given).split()) if isinstance(given, str) else ""
    if short in OUTCOMES:
        return short, OUTCOMES[short]
    found = _BEYOND.fullmatch(short)
    if found is None:
        allowed = ", ".join(map(repr, OUTCOMES))
        raise (InputError if isinstance(given, str) else InputTypeError)(
            f"{name} = {shown(given)}: must be one of {allowed}, or a statistic beyond a value, as 'peak_force > 60 N'"
        )
    statistic, sign, value = found.groups()
    row = number_statistic(name, statistic)
    key, unit = scale_key(statistic, row.unit, value)
    try:
        limit = number_in_unit(value, unit)
    except InputError as error:
        raise InputError(f"{name} = {shown(given)}: {error}") from None
    if limit is None or not np.isfinite(limit):
        raise InputError(f"{name} = {shown(given)}: {value!r} is not a number")

    def happened(found: Statistics) -> NDArray[np.bool_]:
        return np.asarray(_COMPARED[sign](found[statistic] * (found[key] if key else 1.0), limit))

    words = row.long_name.removesuffix(f", over {row.normalised_by}") if key else row.long_name
    limit_text = value if unit_in_text(value) or unit == "1" else f"{value} {unit}"
    printed = re.sub(r"(?<=[\d ])u(?=[a-zA-Z])", "µ", limit_text)
    return f"{statistic} {sign} {value}", Event(f"{words} {sign} {printed}", happened, statistic)


def scale_key(statistic: str, unit: str, value: str) -> tuple[str, str]:
    """Key of the scale, and unit, of a value that is given with a unit of a statistic over a scale; else no key and *unit*."""
    over = STATISTICS[statistic].normalised_by if statistic in STATISTICS else ""
    return _SCALES.get(over, ("", unit)) if unit_in_text(value) else ("", unit)


def metres_key(statistic: str) -> str:
    """Key of the value that a statistic is over in the columns of :meth:`Trials.of_columns`; empty for others."""
    return _SCALES.get(STATISTICS[statistic].normalised_by, ("", ""))[0]


def number_statistic(name: str, statistic: Any) -> Statistic:
    """Return the row of a statistic that is a number."""
    if not isinstance(statistic, str) or of_one_named(statistic) is None:
        choice(name, statistic, tuple(each for each, row in STATISTICS.items() if row.dtype in ("float64", "int32")))
    return STATISTICS[statistic]


def reached(found: Statistics) -> NDArray[np.bool_]:
    """Mask of the runs with a known response class."""
    return np.isin(found["status"], _REACHED)


def require_held(names: Iterable[str], system: System) -> None:
    """Refuse statistics that runs of a system do not have: those of one of several strikers, if it is not there."""
    strikers = len(system.contacts)
    held = rows_for(strikers)
    for name in names:
        if name in STATISTICS and name not in held and (name_in(held, name) not in held or not strikers):
            raise InputError(
                f"{name}: the system has {strikers} striker{'s' * (strikers != 1)}; each has its own "
                "statistics where there are several"
            )
