"""A sweep before it is computed: the system, its points and how each run is integrated, checked once."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from snapbeam.model.drive.recorded_motion import RecordedMotion
from snapbeam.model.integration import Integration
from snapbeam.model.parameters import lookup
from snapbeam.model.quantity import quantities
from snapbeam.model.state import State, started
from snapbeam.model.system import System
from snapbeam.simulation.save import code_flags
from snapbeam.simulation.simulate import attributes_of
from snapbeam.solver.assemble import cycles_of, make_ensemble, plans_of, run_columns
from snapbeam.solver.registry import resolve
from snapbeam.solver.statistics import STATISTICS, statistics_of
from snapbeam.solver.step_size import Plan, require_resolved
from snapbeam.sweeps.points import Columns, Grid, Points, points_of
from snapbeam.util.diagnostics import Diagnostic, tell
from snapbeam.util.status_codes import ResponseClass, RunStatus
from snapbeam.util.validation import InputError, InputTypeError, shown

if TYPE_CHECKING:
    import xarray as xr

__all__ = [
    "Progress",
    "SweepSetup",
    "diagnostics_of",
    "require_every_structure",
    "require_parameters",
    "sweep_setup",
    "variable_attributes",
]


# ----------------------------------------------------------------------------------------------------
# What is refused of a sweep before any run, and what is doubtful about it.


def require_parameters(system: System, points: Points) -> None:
    """Refuse axes over what the system does not have, by its first point."""
    first = {name: values[0] for name, values in points.take(np.zeros(1, dtype=np.int64)).items()}
    for name in first:
        if (
            name.startswith(("integration.", "initial_state."))
            or not lookup(name).is_run
            or name in system.parameters
        ):
            continue
        section, _, field = name.partition(".")
        if field != "gap" or section not in {each.partition(".")[0] for each in system.parameters}:
            raise InputError(f"{name}: no parameter of this system; it has {', '.join(system.parameters)}")
    if (
        system.striker is None
        and system.initial_state is None
        and not system.moving
        and not any(name.startswith("initial_state.") for name in first)
    ):
        raise InputError("striker = None: a beam that nothing strikes needs a start to move from")
    _at(system, first)


def _at(system: System, point: dict[str, Any]) -> System:
    """The system at a point."""
    plain = {name: value.item() if isinstance(value, np.generic) else value for name, value in point.items()}
    return system.replace(
        **{name: value for name, value in plain.items() if not name.startswith("integration.")}
    )


def diagnostics_of(system: System, points: Points) -> Iterator[Diagnostic]:
    """What is doubtful about the system, or at the ends of what is swept."""
    yield from system.diagnostics()
    for number in _ends(points):
        point = {name: values[0] for name, values in points.take(np.array([number])).items()}
        yield from _at(system, point).diagnostics()


def _ends(points: Points) -> list[int]:
    """Points at which some number is least or greatest."""
    if isinstance(points, Grid):
        corners = [(0,) * len(points.shape)]
        corners += [
            tuple(size - 1 if i == at else 0 for i in range(len(points.shape)))
            for at, size in enumerate(points.shape)
        ]
        return [int(np.ravel_multi_index(corner, points.shape)) for corner in corners]
    numbers = [values for values in points.columns.values() if values.dtype.kind in "if"]
    return sorted({int(at) for values in numbers for at in (values.argmin(), values.argmax())})


def require_every_structure(setup: SweepSetup) -> None:
    """Refuse structures that are none, starts that do not fit them, and steps that do not resolve some run.

    Before any run: a sweep does not end in the middle of the night because its last beam is not buckled.
    """
    names = setup.points.names
    stepped = setup.integration.step is not None or "integration.step" in names
    if not stepped and all(lookup(name).is_run and not name.startswith("initial_state.") for name in names):
        return
    columns = setup.points.take(np.arange(setup.points.size))
    for system, integration, _, points in setup.groups(columns):
        setup.start_of(system, points)
        if stepped:
            own = {name: values for name, values in points.items() if not name.startswith("initial_state.")}
            require_resolved(system, integration, cycles_of(system, run_columns(system, own)))


# ----------------------------------------------------------------------------------------------------


Progress = Callable[[int, int], object]

TITLE = "map of the response of a struck bistable beam"
_ALWAYS = ("drive.frequency_ratio", "drive.velocity_amplitude", "striker.location")
"""Parameters that every map says, swept or not."""


@dataclass(frozen=True, eq=False)
class SweepSetup:
    """A sweep that makes sense."""

    system: System
    integration: Integration
    """With the engine resolved."""
    points: Points

    def with_points(self, points: Points) -> SweepSetup:
        """The same sweep over other points."""
        return SweepSetup(self.system, self.integration, points)

    def integrate(
        self,
        columns: Columns,
        threads: int | None = None,
        progress: Progress | None = None,
        *,
        start: Callable[[System, State | None], State] | None = None,
        step_factor: float = 1.0,
    ) -> dict[str, NDArray[Any]]:
        """Integrate runs and return their statistics, arrays of shape (runs,) by name.

        What a run gives depends on its own point alone, not on what it is marched with.

        Parameters
        ----------
        columns : dict of str to array of shape (runs,)
            The points.
        threads, progress
            As for an engine.
        start : callable, optional
            ``start(system, state) -> State``: where the runs of a system begin instead; *state* is where the
            points say, None if they say nothing of it.
        step_factor : float
            Times the length of every step.
        """
        total = next(iter(columns.values())).size
        found: dict[str, NDArray[Any]] = {}
        done = 0
        for system, integration, which, points in self.groups(columns):
            state = self.start_of(system, points)
            if start is not None:
                state = start(system, state)
            own = {name: values for name, values in points.items() if not name.startswith("initial_state.")}
            for part in _alike(system, state, which.size):
                columns_of_part = {name: values[part] for name, values in own.items()}
                begun = state[part] if state is not None and state.batch else state
                ensemble = make_ensemble(
                    system, integration, columns_of_part, start=begun, step_factor=step_factor
                )

                def report(inside: int, _: int, before: int = done) -> None:
                    if progress is not None:
                        progress(before + inside, total)

                engine = resolve(
                    integration.engine,
                    modes=system.model.modes,
                    law=ensemble.law,
                    drive=ensemble.drive,
                    body=ensemble.structure.body_mass is not None,
                    unequal_wells=ensemble.structure.model.transverse_force is not None,
                    around=system.has_environment,
                    several=bool(system.further_contacts),
                )[1]
                books = engine.run_ensemble(ensemble, threads, report)
                for name, values in statistics_of(ensemble, books).items():
                    found.setdefault(name, np.zeros(total, dtype=values.dtype))[which[part]] = values
                done += part.size
        return found

    def groups(
        self, columns: Columns
    ) -> Iterator[tuple[System, Integration, NDArray[np.int64], dict[str, NDArray[np.float64]]]]:
        """The points by structure: a system, an integration, which points, and what differs among them."""
        structural = [name for name in columns if not lookup(name).is_run]
        own = [name for name in columns if name not in structural]
        total = next(iter(columns.values())).size
        if not structural:
            points = {name: np.asarray(columns[name], dtype=np.float64) for name in own}
            yield self.system, self.integration, np.arange(total), points
            return
        keys: dict[tuple[Any, ...], list[int]] = {}
        for i, key in enumerate(zip(*(columns[name].tolist() for name in structural), strict=True)):
            keys.setdefault(key, []).append(i)
        for key, members in keys.items():
            which = np.array(members)
            changes = dict(zip(structural, key, strict=True))
            try:
                system, integration = self.neighbour(changes)
            except InputError as error:
                where = ", ".join(f"{name} = {value}" for name, value in changes.items())
                raise InputError(f"at {where}: {error}") from None
            points = {name: np.asarray(columns[name][which], dtype=np.float64) for name in own}
            yield system, integration, which, points

    def neighbour(self, changes: dict[str, Any]) -> tuple[System, Integration]:
        """The system and the integration with some parameters of their structure changed."""
        of_run = {
            name.removeprefix("integration."): value
            for name, value in changes.items()
            if name.startswith("integration.")
        }
        of_system = {name: value for name, value in changes.items() if not name.startswith("integration.")}
        system = self.system.replace(**of_system) if of_system else self.system
        return system, self.integration.replace(**of_run) if of_run else self.integration

    @staticmethod
    def start_of(system: System, points: dict[str, NDArray[np.float64]]) -> State | None:
        """Where runs of a system begin, if the points say something of it."""
        prefix = "initial_state."
        own = {
            name.removeprefix(prefix): values for name, values in points.items() if name.startswith(prefix)
        }
        return started(system.model, system.striker, system.initial_state, own) if own else None

    @cached_property
    def plan(self) -> Plan:
        """Steps of the system as it stands."""
        return plans_of(self.system, self.integration, run_columns(self.system, {}))[0]

    @property
    def fixed(self) -> dict[str, float]:
        """What every map says of the drive and the striker, where it is not swept, by dotted name."""
        parameters = self.system.parameters
        return {
            name: parameters[name] for name in _ALWAYS if name in parameters and name not in self.points.names
        }

    @property
    def structural(self) -> list[str]:
        """What differs among the points and changes the frequencies, the length scale or the steps."""
        return [
            name
            for name in self.points.names
            if name.startswith(
                ("beam.", "model.", "boundary.", "imperfection.", "integration.step", "integration.accuracy")
            )
        ]

    def identity(self) -> dict[str, Any]:
        """Everything that the numbers depend on, plain: what two sweeps must share to be one."""
        integration = {
            name: getattr(self.integration, name) for name in quantities(Integration) if name != "threads"
        }
        return {
            "system": self.system.to_mapping(),
            "integration": integration,
            "points": self.points.describe(),
            "step": self.plan.step,
        }

    def attributes(self, title: str = TITLE, more: dict[str, Any] | None = None) -> dict[str, Any]:
        """The attributes of a file: a title, every parameter, and what made it."""
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
        varied = {lookup(name).short for name in self.points.names}
        if self.structural:
            varied |= {
                "reference_frequency",
                "step",
                "longest_contact_step",
                "shortest_contact_step",
                "length_scale",
            }
        beam = self.system.model.beam
        if beam is not None and any(name.startswith(("beam.", "boundary.")) for name in self.points.names):
            # the one of the two that follows from the other follows anew at every point
            pair = {"beam.buckling_level", "beam.axial_load"}
            given = pair & set(self.points.names) or {f"beam.{beam.given}"}
            varied |= {lookup(name).short for name in pair - given}
        for name in varied:
            attrs.pop(name, None)
        return attrs

    def _cycles(self) -> float:
        """Cycles of each run; those of the record, if it is marched to its end."""
        drive = None if self.system.striker is None else self.system.striker.drive
        if isinstance(drive, RecordedMotion) and self.integration.cycles is None:
            return round(drive.duration * drive.frequency, 9)
        return self.integration.cycles_or_default

    def coordinates(self) -> dict[str, Any]:
        """Coordinates of a dataset: dimensions, what holds throughout, and what goes with the structure."""
        coords = self.points.coordinates()
        for name, value in self.fixed.items():
            row = lookup(name)
            coords[row.short] = ((), value, {"units": row.quantity.unit, "long_name": row.quantity.long_name})
        if self.structural:
            coords |= self._of_structure()
        return coords

    def _of_structure(self) -> dict[str, Any]:
        """Frequency and length that normalise, and step, over what changes them."""
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
        labels = {
            "reference_frequency": ("Hz", "frequency that Omega and V are normalised by"),
            "step": ("s", "step in free flight"),
            "length_scale": ("m", "length that displacements are normalised by"),
        }
        return {
            name: (dims, values, {"units": unit, "long_name": words})
            for (name, (unit, words)), values in zip(labels.items(), table, strict=True)
            if name not in dims and name not in self.points.coordinates()
        }

    def dataset(self, statistics: dict[str, NDArray[Any]]) -> xr.Dataset:
        """The statistics of every point as a labelled map."""
        import xarray as xr

        dataset = xr.Dataset(coords=self.coordinates(), attrs=self.attributes())
        for name, values in statistics.items():
            dataset[name] = (self.points.dims, self.points.arranged(values), variable_attributes(name))
        return dataset


def sweep_setup(system: System, axes: Any, integration: Integration | None = None) -> SweepSetup:
    """Check what is asked of a sweep; the parameters are those of :func:`snapbeam.sweep`."""
    if not isinstance(system, System):
        raise InputTypeError(f"system = {shown(system)}: must be a System")
    integration = Integration() if integration is None else integration
    if not isinstance(integration, Integration):
        raise InputTypeError(f"integration = {shown(integration)}: must be an Integration")
    if integration.tolerance is not None:
        raise InputError(
            f"tolerance = {integration.tolerance:g}: is for one run; give a sweep a step, or accuracy = 'reference'"
        )
    points = axes if isinstance(axes, Points) else points_of(axes)
    require_parameters(system, points)
    law = type(system.contact) if system.contact is not None else None
    resolved = resolve(
        integration.engine,
        runs=points.size,
        cycles=integration.cycles_or_default,
        modes=system.model.modes,
        law=law,
        body=system.striker is not None and system.striker.mass is not None,
        unequal_wells=system.model.transverse_force is not None,
        around=system.has_environment,
        several=bool(system.further_contacts),
        **({} if system.striker is None else {"drive": type(system.striker.drive)}),
    )[0]
    setup = SweepSetup(system, integration.replace(engine=resolved), points)
    require_every_structure(setup)
    tell(diagnostics_of(system, points))
    return setup


def _alike(system: System, state: State | None, runs: int) -> list[NDArray[np.int64]]:
    """The runs that are marched together: of free beams, those that begin on the same side of the centre.

    A free beam is seen from the well that it begins in, a struck one from its striker.
    """
    every = np.arange(runs)
    if system.striker is not None or state is None or not state.batch:
        return [every]
    upper = state.amplitude @ system.model.midspan_shape > 0.0
    return [part for part in (every[~upper], every[upper]) if part.size]


def variable_attributes(name: str) -> dict[str, Any]:
    """Unit and name in words of one variable of a map; for codes, what they mean."""
    row = STATISTICS[name]
    labels: dict[str, Any] = {"units": row.unit, "long_name": row.long_name}
    if name == "response_class":
        labels |= code_flags(ResponseClass)
    elif name == "status":
        labels |= code_flags(RunStatus)
    return labels
