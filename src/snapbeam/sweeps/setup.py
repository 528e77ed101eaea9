"""Checked setup of a sweep: its system, points and integration."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from snapbeam.model.drive.recorded_motion import RecordedMotion
from snapbeam.model.integration import Integration
from snapbeam.model.parameter_axes import ratios_of, unit_of
from snapbeam.model.parameters import PHYSICAL, lookup, ratio_of
from snapbeam.model.quantity import quantities, split_name
from snapbeam.model.state import State, started
from snapbeam.model.system import System
from snapbeam.simulation.request import require_motion
from snapbeam.simulation.save import code_flags
from snapbeam.simulation.simulate import attributes_of
from snapbeam.solver.assemble import cycles_of, make_ensemble, plans_of, run_columns
from snapbeam.solver.engines import engine_of
from snapbeam.solver.restrictions import check_integrable
from snapbeam.solver.statistics import STATISTICS, statistics_of
from snapbeam.solver.step_size import SUBDIVISION, Plan, long_sweep, require_resolved, seconds_of
from snapbeam.sweeps.points import Columns, Grid, PointList, Points, labels_of, points_of, require_memory
from snapbeam.util.cores import usable_cores
from snapbeam.util.diagnostics import Diagnostic, tell
from snapbeam.util.status_codes import ResponseClass, RunStatus
from snapbeam.util.validation import InputError, instance, or_default

# ----------------------------------------------------------------------------------------------------
# Checks and diagnostics of a sweep before any run.


def require_parameters(system: System, points: Points) -> None:
    """Refuse axes of parameters that the system does not have, at its first point."""
    first = {name: values[0] for name, values in points.take(np.zeros(1, dtype=np.int64)).items()}
    for name in first:
        of_run = not name.startswith(("integration.", "initial_state.")) and lookup(name).is_run
        if not of_run or ratio_of(name) in system.parameters:
            continue
        section, field = split_name(name)
        if field != "gap" or section not in {split_name(each)[0] for each in system.parameters}:
            raise InputError(
                f"{name}: is not a parameter of this system; its parameters are {', '.join(system.parameters)}"
            )
    require_motion(system, any(name.startswith("initial_state.") for name in first))
    _at(system, first)


def _at(system: System, point: dict[str, Any]) -> System:
    """Return the system at a point."""
    plain = {name: value.item() if isinstance(value, np.generic) else value for name, value in point.items()}
    plain = {name: value for name, value in plain.items() if not name.startswith("integration.")}
    return system.replace(**plain)


def diagnostics_of(system: System, points: Points) -> Iterator[Diagnostic]:
    """Yield the diagnostics of the system, and of the sweep at the limits of its parameters."""
    yield from system.diagnostics()
    for number in _ends(points):
        point = {name: values[0] for name, values in points.take(np.array([number])).items()}
        yield from _at(system, point).diagnostics()


def _ends(points: Points) -> list[int]:
    """Return the points at which a parameter is minimum or maximum."""
    if isinstance(points, Grid):
        edges = np.diag(np.array(points.shape) - 1)  # the last value of one axis, the first of the others
        return list(dict.fromkeys([0, *np.ravel_multi_index(tuple(edges), points.shape).tolist()]))
    numbers = [values for values in points.columns.values() if values.dtype.kind in "if"]
    return sorted({int(at) for values in numbers for at in (values.argmin(), values.argmax())})


def require_every_structure(setup: SweepSetup) -> None:
    """Refuse invalid models, initial conditions that do not fit them, and steps that are too long, before any run.

    A sweep therefore cannot end hours later because its last beam is not buckled.
    """
    names = setup.points.names
    stepped = setup.integration.step is not None or "integration.step" in names
    if not stepped and all(lookup(name).is_run and not name.startswith("initial_state.") for name in names):
        return
    require_memory(setup.points.size, "give fewer points", 16 * (len(names) + 1))
    columns = setup.points.take(np.arange(setup.points.size))
    for system, integration, _, points in setup.groups(columns):
        setup.start_of(system, points)
        if stepped:
            own = {name: values for name, values in points.items() if not name.startswith("initial_state.")}
            require_resolved(system, integration, cycles_of(system, run_columns(system, own)))


# ----------------------------------------------------------------------------------------------------


Progress = Callable[[int, int], object]

TITLE = "map of the response of a struck bistable beam"
_ALWAYS = ("drive.frequency_ratio", "drive.velocity_amplitude", "contact.location")
"""Parameters that every dataset contains, swept or not."""


@dataclass(frozen=True, eq=False)
class SweepSetup:
    """A checked sweep."""

    system: System
    integration: Integration
    """Solver settings, with the selected engine."""
    points: Points

    def with_points(self, points: Points) -> SweepSetup:
        """Return the same sweep over other points."""
        return SweepSetup(self.system, self.integration, points)

    def integrate(
        self,
        columns: Columns,
        threads: int | None = None,
        progress: Progress | None = None,
        *,
        start: Callable[[System, State | None, Columns], State] | None = None,
        step_factor: float = 1.0,
        endless: bool = False,
    ) -> dict[str, NDArray[Any]]:
        """Integrate runs and return their statistics, arrays of shape (runs,) by name.

        The results of a run depend only on its own point, not on the other runs of its batch.  ``start(system, state,
        points)`` returns other initial conditions; *state* is that of the points, or None if they do not determine it.
        *endless*: no run ends because it is sure to be continuous.
        """
        total = next(iter(columns.values())).size
        found: dict[str, NDArray[Any]] = {}
        done = 0
        for system, integration, which, points in self.groups(columns):
            state = self.start_of(system, points)
            if start is not None:
                state = start(system, state, points)
            own = {name: values for name, values in points.items() if not name.startswith("initial_state.")}
            for part in _alike(system, state, which.size):
                columns_of_part = {name: values[part] for name, values in own.items()}
                begun = state[part] if state is not None and state.batch else state
                ensemble = make_ensemble(system, integration, columns_of_part, start=begun, step_factor=step_factor)
                if endless:
                    ensemble.runs["decide_crossings"] = -1
                # else the CPU: few runs, or one after the other
                ensemble = replace(ensemble, on_gpu=integration.engine == "cuda")

                def report(inside: int, _: int, before: int = done) -> None:
                    if progress is not None:
                        progress(before + inside, total)

                books = engine_of(ensemble).run_ensemble(ensemble, threads, report)
                for name, values in statistics_of(ensemble, books).items():
                    found.setdefault(name, np.zeros(total, dtype=values.dtype))[which[part]] = values
                done += part.size
        return found

    def groups(
        self, columns: Columns
    ) -> Iterator[tuple[System, Integration, NDArray[np.int64], dict[str, NDArray[np.float64]]]]:
        """Yield the points by model: a system, an integration, the numbers of its points, and their parameters."""
        structural = [name for name in columns if not lookup(name).is_run]
        own = [name for name in columns if name not in structural]
        total = next(iter(columns.values())).size
        if not structural:
            points = ratios_of(self.system, {name: np.asarray(columns[name], dtype=np.float64) for name in own})
            yield self.system, self.integration, np.arange(total), points
            return
        keys: dict[tuple[Any, ...], list[int]] = {}
        for i, key in enumerate(zip(*(columns[name].tolist() for name in structural), strict=True)):
            keys.setdefault(key, []).append(i)
        for key, members in keys.items():
            which = np.array(members)
            changes = dict(zip(structural, key, strict=True))
            points = {name: np.asarray(columns[name][which], dtype=np.float64) for name in own}
            try:
                system, integration = self.neighbour(changes)
                points = ratios_of(system, points)
            except InputError as error:
                where = ", ".join(f"{name} = {value}" for name, value in changes.items())
                raise InputError(f"at {where}: {error}") from None
            yield system, integration, which, points

    def neighbour(self, changes: dict[str, Any]) -> tuple[System, Integration]:
        """Return the system and the integration with other model-level parameters."""
        of_run = {name: value for name, value in changes.items() if name.startswith("integration.")}
        of_system = {name: value for name, value in changes.items() if name not in of_run}
        system = self.system.replace(**of_system) if of_system else self.system
        if of_run:
            own = {split_name(name)[1]: value for name, value in of_run.items()}
            return system, self.integration.replace(**own)
        return system, self.integration

    @staticmethod
    def start_of(system: System, points: dict[str, NDArray[np.float64]]) -> State | None:
        """Return the initial conditions of the runs, if the points determine them."""
        prefix = "initial_state."
        own = {name.removeprefix(prefix): values for name, values in points.items() if name.startswith(prefix)}
        return started(system.model, system.start_state, own) if own else None

    @cached_property
    def plan(self) -> Plan:
        """Steps of the system of the sweep."""
        return plans_of(self.system, self.integration, run_columns(self.system, {}))[0]

    @property
    def fixed(self) -> dict[str, float]:
        """Parameters of drive and striker that every dataset contains and that are not swept, by dotted name."""
        own, swept = self.system.parameters, {ratio_of(name) for name in self.points.names}
        return {name: own[name] for name in _ALWAYS if name in own and name not in swept}

    @property
    def structural(self) -> list[str]:
        """Swept parameters that change the frequencies, the length scale or the steps."""
        begin = ("beam.", "model.", "boundary.", "imperfection.", "integration.step", "integration.accuracy")
        return [name for name in self.points.names if name.startswith(begin)]

    @cached_property
    def _outermost(self) -> list[System]:
        """Systems at the ends and in the middle of every axis that changes the structure."""
        names = [name for name in self.structural if not name.startswith("integration.")]
        if not names:
            return [self.system]
        if isinstance(self.points, Grid):
            axes = {name: self.points.axes[name] for name in names}
            first = {name: values[0].item() for name, values in axes.items()}
            asked = [
                first | {name: values[at].item()} for name, values in axes.items() for at in (0, values.size // 2, -1)
            ]
        else:
            table = {name: np.asarray(self.points.columns[name]).ravel() for name in names}
            places = {int(find(values)) for values in table.values() for find in (np.argmin, np.argmax)}
            asked = [{name: values[at].item() for name, values in table.items()} for at in places]
        found = []
        for changes in asked:
            with suppress(InputError):  # refused when the points are computed
                found.append(self.neighbour(changes)[0])
        return found

    @cached_property
    def _steps_vary(self) -> bool:
        """True if runs at the ends of the axes have other steps than each other."""
        found: set[Plan] = set()
        for system, integration, _, points in self.groups(self.points.take(np.array(_ends(self.points)))):
            own = {name: values for name, values in points.items() if not name.startswith("initial_state.")}
            found |= set(plans_of(system, integration, run_columns(system, own)))
        return len(found) > 1

    @cached_property
    def length_varies(self) -> bool:
        """True if the length that displacements are normalised by differs between the points."""
        lengths = [system.scale.length for system in self._outermost]
        return bool(lengths) and max(lengths) - min(lengths) > 1e-9 * max(lengths)

    def scales_of(self, columns: Columns) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Length, m, and velocity, m/s, that the displacements and velocities of every point are normalised by."""
        size = next(iter(columns.values())).size
        length, speed = np.empty(size), np.empty(size)
        for system, _, which, _ in self.groups(columns):
            length[which] = system.scale.length
            speed[which] = system.scale.length * 2.0 * np.pi * system.model.reference_frequency
        return length, speed

    def identity(self) -> dict[str, Any]:
        """Return plain values of everything that the results depend on; sweeps with equal values have equal results."""
        integration = {name: getattr(self.integration, name) for name in quantities(Integration) if name != "threads"}
        own = {"system": self.system.to_mapping(), "integration": integration}
        return own | {"points": self.points.describe(), "step": self.plan.step}

    def attributes(self, title: str = TITLE, more: dict[str, Any] | None = None) -> dict[str, Any]:
        """Return the attributes of a dataset: title, all parameters and provenance."""
        own: dict[str, Any] = {
            "cycles": self._cycles(),
            "engine": self.integration.engine,
            "early_termination": int(self.integration.early_termination),
        }
        if self.system.striker is not None:
            own["side"] = self.system.striker.side
        own |= {lookup(name).short: value for name, value in self.fixed.items()}
        more = own | (more or {})
        attrs = attributes_of(title, self.system, self.integration, self.plan, more, self.points.describe())
        varied = {lookup(ratio_of(name)).short for name in self.points.names}
        if self._steps_vary:
            varied |= {"step", "longest_contact_step", "shortest_contact_step"}
        if self.structural:
            varied |= {"reference_frequency", "length_scale"}
            varied |= {"reference_well", "initial_well", "initial_well_reason"}
            if any(system.model.is_bistable for system in self._outermost):
                varied.add("wells")
        if any(name == "contact.side" or name.startswith("initial_state.") for name in self.points.names):
            varied |= {"initial_well", "initial_well_reason"}
        beam = self.system.model.beam
        if beam is not None and any(name.startswith(("beam.", "boundary.")) for name in self.points.names):
            # the one that follows from the other differs at every point
            pair = {"beam.buckling_level", "beam.axial_load"}
            given = pair & set(self.points.names) or {f"beam.{beam.given}"}
            varied |= {lookup(name).short for name in pair - given}
        for name in varied:
            attrs.pop(name, None)
        return attrs

    def _cycles(self) -> float:
        """Return the number of cycles of each run; a recorded motion determines it if none is given."""
        leads = self.system.primary_excitation
        drive = None if leads is None else leads[1]
        if isinstance(drive, RecordedMotion) and self.integration.cycles is None:
            return round(drive.duration * drive.frequency, 9)
        return self.integration.cycles_or_default

    def coordinates(self) -> dict[str, Any]:
        """Return the coordinates of a dataset: axes, fixed parameters and quantities that depend on the model."""
        coords = self.points.coordinates()
        for name, value in self.fixed.items():
            row = lookup(name)
            coords[row.short] = ((), value, labels_of(row))
        if self.structural:
            coords |= self._of_structure()
        return coords

    def _of_structure(self) -> dict[str, Any]:
        """Return reference frequency, step and length scale as functions of the parameters that change them."""
        names = self.structural
        if isinstance(self.points, Grid):
            axes = [self.points.axes[name] for name in names]
            dims, shape = tuple(lookup(name).short for name in names), tuple(values.size for values in axes)
            columns = dict(zip(names, np.meshgrid(*axes, indexing="ij"), strict=True))
        else:
            dims, shape = self.points.dims, self.points.shape
            columns = {name: self.points.columns[name] for name in names}
        table = np.empty((3, *shape))
        made: dict[tuple[Any, ...], tuple[float, float, float]] = {}
        for at in np.ndindex(shape):
            key = tuple(columns[name][at].item() for name in names)
            if key not in made:
                system, integration = self.neighbour(dict(zip(names, key, strict=True)))
                plan = plans_of(system, integration, run_columns(system, {}))[0]
                made[key] = system.model.reference_frequency, plan.step, system.scale.length
            table[(slice(None), *at)] = made[key]
        found = self._ratios(names, dims, columns)
        labels = {
            "reference_frequency": ("Hz", "frequency that Omega and V are normalised by"),
            "step": ("s", "step in free flight"),
            "length_scale": ("m", "length that displacements are normalised by"),
        }
        return found | {
            name: (dims, values, {"units": unit, "long_name": words})
            for (name, (unit, words)), values in zip(labels.items(), table, strict=True)
            if name not in dims and name not in self.points.coordinates()
        }

    def _ratios(self, names: list[str], dims: tuple[str, ...], columns: Mapping[str, Any]) -> dict[str, Any]:
        """Return the ratios that axes in physical units are at each structure."""
        found = {}
        for name in self.points.names:
            if name not in PHYSICAL:
                continue
            shape = np.shape(columns[names[0]])
            units = np.empty(shape)
            for at in np.ndindex(shape):
                own = {each: columns[each][at].item() for each in names}
                units[at] = unit_of(self.neighbour(own)[0], name)
            row = lookup(PHYSICAL[name].parameter)
            if isinstance(self.points, PointList):
                found[row.short] = (dims, self.points.columns[name] / units, labels_of(row))
                continue
            values = self.points.axes[name] / units[..., None]
            found[row.short] = ((*dims, lookup(name).short), values, labels_of(row))
        return found


def sweep_setup(system: System, axes: Any, integration: Integration | None = None) -> SweepSetup:
    """Check a sweep; the parameters are those of :func:`snapbeam.sweep`."""
    instance("system", system, System, "a System")
    integration = or_default("integration", integration, Integration, "an Integration")
    if integration.tolerance is not None:
        raise InputError(
            f"tolerance = {integration.tolerance:g}: applies to single runs; for a sweep give step, or accuracy = 'reference'"
        )
    points = points_of(axes, system)
    require_parameters(system, points)
    check_integrable(system, integration.engine)
    engine = "native" if integration.engine == "auto" else integration.engine
    setup = SweepSetup(system, integration.replace(engine=engine), points)
    require_every_structure(setup)
    tell(diagnostics_of(system, points))
    return setup


_PROBES, _GOLDEN = 64, 0.6180339887498949
"""Points that the duration of a sweep is estimated from."""
_FEW = 5000
"""Cycles of one mode that never take a minute."""


def announce_long_sweep(setup: SweepSetup, repeats: int = 1, *, by_cluster: bool = False) -> None:
    """Say before a sweep with *repeats* runs at each point that it may take over a minute on the cores that it uses.

    The estimate is that of a run (:func:`~snapbeam.solver.step_size.seconds_of`), averaged over points in all parts of the sweep, or
    over the limits of its axes if each point has a model of its own.
    """
    if setup.integration.engine == "cuda":
        return
    size, alike = setup.points.size, all(lookup(name).is_run for name in setup.points.names)
    cycles = setup.integration.cycles  # none given: those of a record may be many
    if cycles is not None and size * repeats * cycles * setup.system.model.modes <= _FEW and alike:
        return
    # multiples of the golden section fall on the columns of no grid
    spread = np.unique((np.arange(min(size, _PROBES)) * _GOLDEN % 1.0 * size).astype(np.int64))
    columns = setup.points.take(spread if alike else np.array(_ends(setup.points)))
    steps: list[float] = []
    seconds: list[float] = []
    for system, integration, _, points in setup.groups(columns):
        own = {name: values for name, values in points.items() if not name.startswith("initial_state.")}
        state = setup.start_of(system, points)
        counts = make_ensemble(system, integration, own, start=state).runs["end"] / SUBDIVISION
        steps += counts.tolist()
        seconds += [seconds_of(count, system.model.modes) for count in counts.tolist()]
    runs = setup.points.size * repeats
    threads = setup.integration.threads or usable_cores()
    cores = 1 if by_cluster else max(1, min(threads, usable_cores(), runs))
    early = setup.integration.early_termination
    tell(long_sweep(runs, float(np.mean(steps)), float(np.mean(seconds)), cores, early))


def _alike(system: System, state: State | None, runs: int) -> list[NDArray[np.int64]]:
    """Return batches of runs that can be integrated together.

    The sign convention of a beam with a striker follows from the striker, that of a free beam from its initial well.
    """
    every = np.arange(runs)
    if system.striker is not None or state is None or not state.batch:
        return [every]
    upper = state.amplitude @ system.model.midspan_shape > 0.0
    return [part for part in (every[~upper], every[upper]) if part.size]


_POSITIVE = re.compile(r"(peak|rms|harvested)_|energy_(dissipated|harvested|lost)|contact_time_fraction|impulse")


def is_positive(name: str) -> bool:
    """Return True for the name of a statistic of the package that is never negative."""
    return name in STATISTICS and _POSITIVE.match(name) is not None


def variable_attributes(name: str, metres: bool = False) -> dict[str, Any]:
    """Return the attributes of a variable: unit, long name, and the meanings of codes; in m and m/s, or over b."""
    row = STATISTICS[name]
    labels: dict[str, Any] = {"units": row.unit, "long_name": row.long_name}
    if metres and row.normalised_by:
        words = row.long_name.removesuffix(f", over {row.normalised_by}")
        labels = {"units": "m" if row.normalised_by == "b" else "m/s", "long_name": words}
    if row.comment:
        labels["comment"] = row.comment
    if name == "response_class":
        labels |= code_flags(ResponseClass)
    elif name == "status":
        labels |= code_flags(RunStatus)
    return labels
