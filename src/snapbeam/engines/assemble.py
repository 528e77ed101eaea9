"""From a system and its runs to an ensemble: everything turned into modal numbers and ticks."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from snapbeam.core.validate import InputError
from snapbeam.engines.clock import Clocked, clocked, most_steps
from snapbeam.engines.columns import RUN
from snapbeam.engines.ensemble import Ensemble
from snapbeam.engines.plan import Plan, plan_steps
from snapbeam.engines.structure import Structure, structure_of
from snapbeam.model.contact import ContactLaw, HertzContact
from snapbeam.model.decision import decidable_energy, passed_heights
from snapbeam.model.drive import Drive, Sine
from snapbeam.model.galerkin.reduction import ReducedModel
from snapbeam.model.integration import Integration
from snapbeam.model.quantity import RUN as RUN_SCOPE
from snapbeam.model.quantity import quantities
from snapbeam.model.start import rest_state
from snapbeam.model.state import State
from snapbeam.model.system import System

__all__ = ["cycles_of", "make_ensemble", "plans_of", "run_columns"]

_Array = NDArray[np.float64]
_Integers = NDArray[np.int64]

_LOWEST = {"map": 1e-9, "reference": 1e-13}
"""Height of a flight after an impact that lasts no time, over b, below which chatter ends in sticking."""
_FAR_AWAY = -1e30
"""Penetration, m, of a tip that is not there."""


def make_ensemble(
    system: System,
    integration: Integration,
    points: Mapping[str, _Array] | None = None,
    *,
    plan: Plan | None = None,
    start: State | None = None,
    periods: float | None = None,
    step_factor: float = 1.0,
) -> Ensemble:
    """Arrange runs of a system for an engine.

    Parameters
    ----------
    system : System
    integration : Integration
    points : mapping of str to array of shape (runs,), optional
        Parameters of scope *run* that differ between the runs, by dotted name.
    plan : Plan, optional
        Steps, in place of those that *integration* asks for.
    start : State, optional
        One start for all runs, or a batch with one for each; the system's by default.
    periods : float, optional
        Cycles to march, a state handed out after each; by default the cycles of *integration*, in one go.
    step_factor : float
        Times the length of every step.

    Raises
    ------
    InputError
        For parameters that cannot differ between the runs of an ensemble, and for more steps than can be counted.
    """
    columns = run_columns(system, points or {})
    state = (system.start or rest_state(system.model, system.striker)) if start is None else start
    runs = next(iter(columns.values())).size if columns else 1
    if state.batch and runs in (1, state.batch[0]):
        runs = state.batch[0]
    columns = {name: np.array(np.broadcast_to(values, (runs,))) for name, values in columns.items()}
    structure = structure_of(system.model, _side(system, state, goes_on=periods is not None), system.striker)
    plans = plans_of(system, integration, columns) if plan is None else [plan] * runs
    if step_factor != 1.0:
        plans = [each._replace(step=step_factor * each.step) for each in plans]
    driven = _drive_of(system, columns, runs)
    table = np.zeros(runs, dtype=RUN)
    places = _places(structure, table, columns.get("striker.location", np.full(runs, 0.5)))
    starts = _starts(structure, table, state)
    table["phase"] = np.where(np.isnan(state.phase), columns.get("drive.phase", np.zeros(runs)), state.phase)
    table["offset"] = _offsets(system, structure, state, columns, table, places.rows, starts, driven)
    table["tip_speed"] = driven.speed
    highest = table["rest_contact"] + table["offset"] + driven.highest
    if structure.body_mass is not None:
        highest = np.full(highest.shape, np.inf)  # a body goes wherever it is thrown
    time = clocked(table, system, integration, driven.period, plans, periods)
    _decisions(table, system, structure, integration, time, places.location, highest)
    table["lowest"] = system.scale.length * _LOWEST[integration.accuracy]
    law: type[ContactLaw] = HertzContact if system.contact is None else type(system.contact)
    return Ensemble(
        structure=structure,
        scale=system.scale,
        order=plans[0].order,
        law=law,
        drive=driven.kind,
        runs=table,
        law_numbers=_law_numbers(law, system, columns, runs),
        drive_numbers=driven.numbers,
        samples=driven.samples,
        location=places.location,
        highest=highest,
        contact_rows=places.rows,
        starts=starts,
        max_steps=most_steps(integration, system.model.modes),
        high_omega=integration.high_frequency_ratio * system.scale.omega,
        cycles=time.cycles,
    )


def run_columns(system: System, points: Mapping[str, _Array]) -> dict[str, _Array]:
    """Every parameter of scope *run* of a system as an array of shape (runs,), by dotted name.

    *points* holds those that differ between the runs; the others are the system's own.
    """
    size = next(iter(points.values())).size if points else 1
    own: dict[str, float] = {}
    for section, part in (("contact", system.contact), ("striker", system.striker)):
        if part is not None:
            own |= {
                f"{section}.{name}": value
                for name, value in vars(part).items()
                if isinstance(value, float) and quantities(type(part))[name].scope == RUN_SCOPE
            }
    if system.striker is not None:
        own |= {f"drive.{name}": value for name, value in system.striker.drive.values().items()}
    columns = {name: np.full(size, value) for name, value in own.items()}
    for name, values in points.items():
        if name not in columns and not (name == "striker.gap" and system.striker is not None):
            raise InputError(f"{name}: no parameter that may differ between the runs of one ensemble")
        columns[name] = np.asarray(values, dtype=np.float64)
    return columns


def plans_of(system: System, integration: Integration, columns: Mapping[str, _Array]) -> list[Plan]:
    """The steps of each run: they follow from the structure and from the run's own contact.

    A striker with a mass meets the beam for a shorter time, as the two masses together do: m_s m/(m_s + m).
    """
    plans, striker = _plans_of(system, integration, columns), system.striker
    if striker is None or striker.mass is None:
        return plans
    mass = _struck(system).lightest_contact_mass
    more = max(0, math.ceil(0.5 * math.log2(1.0 + mass / striker.mass) - 1e-9))
    return [each._replace(coarsest=each.coarsest + more, finest=each.finest + more) for each in plans]


def _struck(system: System) -> ReducedModel:
    """The model as the striker sees it, so that mirror images are stepped alike."""
    above = system.striker is not None and system.striker.side == "above"
    return system.model.mirrored if above else system.model


def _plans_of(system: System, integration: Integration, columns: Mapping[str, _Array]) -> list[Plan]:
    of_contact = {name[8:]: values for name, values in columns.items() if name.startswith("contact.")}
    step, accuracy = integration.step, integration.accuracy
    runs = next(iter(columns.values())).size if columns else 1
    contact = system.contact if system.striker is not None else None
    if contact is None or not of_contact:
        return [plan_steps(_struck(system), contact, step=step, accuracy=accuracy)] * runs
    table = np.stack(list(of_contact.values()), axis=1)
    different, which = np.unique(table, axis=0, return_inverse=True)
    plans = [
        plan_steps(
            _struck(system),
            dataclasses.replace(contact, **dict(zip(of_contact, map(float, row), strict=True))),  # type: ignore[type-var]
            step=step,
            accuracy=accuracy,
        )
        for row in different
    ]
    return [plans[i] for i in which.ravel()]


def cycles_of(system: System, columns: Mapping[str, _Array]) -> _Array:
    """Seconds of one cycle of excitation of each run, or of the first mode where nothing strikes, shape (runs,)."""
    runs = next(iter(columns.values())).size if columns else 1
    if system.striker is None:
        return 2.0 * math.pi / (np.ones(runs) * system.scale.omega)
    own = {name[6:]: values for name, values in columns.items() if name.startswith("drive.")}
    return system.striker.drive.cycle(own or {"": np.zeros(runs)}, system.scale)


def _side(system: System, state: State, goes_on: bool) -> str:
    if system.striker is not None:
        return system.striker.side
    if goes_on:
        # the same from call to call, whichever well it comes to
        return "below"
    # seen from the well the beam starts in, so that mirror images are mirrored to the bit
    first = state.flat()[0]
    return "above" if float(first.amplitude @ system.model.center_shape) > 0.0 else "below"


class _Driven(NamedTuple):
    """What the drive is, for every run."""

    kind: type[Drive]
    numbers: _Array
    period: _Array
    """Of one cycle, s."""
    highest: _Array
    """From the mid-position, m."""
    speed: _Array
    samples: _Array


def _drive_of(system: System, columns: Mapping[str, _Array], runs: int) -> _Driven:
    scale, striker = system.scale, system.striker
    if striker is None:
        numbers = np.tile([1.0 * scale.omega, 0.0], (runs, 1))
        return _Driven(
            Sine, numbers, cycles_of(system, columns), np.full(runs, -np.inf), np.zeros(runs), np.empty(0)
        )
    drive = striker.drive
    own = {name[6:]: values for name, values in columns.items() if name.startswith("drive.")}
    own = own or {"": np.zeros(runs)}
    found = drive.numbers(own, scale)
    highest, speed = drive.bounds(own, scale)
    samples = drive.samples() * (1.0 if striker.side == "below" else -1.0)
    if striker.side == "above":
        highest = drive.mirrored_bounds(own, scale)
    table = np.stack([found[name] for name in drive.number_names], axis=1)
    return _Driven(
        drive.marched_as or type(drive), table, cycles_of(system, columns), highest, speed, samples
    )


class _Places(NamedTuple):
    location: _Array
    rows: _Array


def _places(structure: Structure, table: NDArray[Any], location: _Array) -> _Places:
    different, which = np.unique(location, return_inverse=True)
    shapes = np.array([structure.model.shape_at(float(x)) for x in different])
    table["contact_row"] = which
    table["rest_contact"] = structure.sign * (shapes @ structure.equilibrium)[which]
    table["rest_center"] = structure.center_rest
    return _Places(location, np.array([structure.row(shape) for shape in shapes]))


def _starts(structure: Structure, table: NDArray[Any], state: State) -> _Array:
    """q and p of every start; which start and home each run has is entered in the table."""
    flat, modal = state.flat(), state.flat().modal
    count = flat.batch[0]
    table["start_row"] = np.arange(table.size) if count > 1 else 0
    table["home"], table["contact_time"] = 1.0, flat.contact_time
    if modal is not None and modal.structure == structure.hash:
        table["home"] = modal.home
        return np.stack((modal.q, modal.p), axis=1)
    parts = (flat.amplitude, flat.velocity, flat.striker_shift, flat.striker_rate)
    pairs = [structure.to_modal(*each) for each in zip(*parts, strict=True)]
    return np.array(pairs)


def _offsets(
    system: System,
    structure: Structure,
    state: State,
    columns: Mapping[str, _Array],
    table: NDArray[Any],
    rows: _Array,
    starts: _Array,
    driven: _Driven,
) -> _Array:
    """Penetration of the tip at mid-stroke into the beam at rest in the first well."""
    if system.striker is None:
        return np.full(table.size, _FAR_AWAY)
    flat, modal = state.flat(), state.flat().modal
    position = structure.sign * flat.striker_position - table["rest_contact"]
    if modal is not None and modal.structure == structure.hash:
        # to the bit, unless the striker now strikes at another place
        same = structure.sign * (table["rest_contact"] + modal.offset) == flat.striker_position
        return np.where(same, modal.offset, position)
    pairs = {(int(run["contact_row"]), int(run["start_row"])) for run in table}
    reach = {(place, at): float(rows[place] @ starts[at, 0]) for place, at in pairs}
    touching = np.array([reach[int(run["contact_row"]), int(run["start_row"])] for run in table])
    begun = _begun(driven, table["phase"])
    offset = touching - begun
    if "striker.gap" in columns:
        offset = np.where(np.isnan(columns["striker.gap"]), offset, -columns["striker.gap"])
    return np.asarray(np.where(np.isnan(flat.striker_position), offset, position))


def _begun(driven: _Driven, phase: _Array) -> _Array:
    """How far the tip is from its mid-position at the start, m."""
    if driven.kind.harmonic:
        amplitude = driven.numbers[:, driven.kind.number_names.index("amplitude")]
        return np.where(phase == 0.0, 0.0, amplitude * np.sin(phase))
    motion, numbers = driven.kind.motion, driven.kind.numbers_type()  # type: ignore[attr-defined]
    begun = [
        motion(numbers(*row), driven.samples, at)[0] for row, at in zip(driven.numbers, phase, strict=True)
    ]
    return np.array(begun)


def _law_numbers(law: type[ContactLaw], system: System, columns: Mapping[str, _Array], runs: int) -> _Array:
    names = law.numbers_type()._fields
    if system.contact is None or system.striker is None:
        return np.zeros((runs, len(names)))
    return np.stack([columns[f"contact.{name}"] for name in names], axis=1)


def _decisions(
    table: NDArray[Any],
    system: System,
    structure: Structure,
    integration: Integration,
    time: Clocked,
    location: _Array,
    highest: _Array,
) -> None:
    """When a run may end early."""
    table["decide_crossings"], table["decide_energy"] = -1, -math.inf
    keeps = system.contact is None or system.contact.keeps.energy_bound
    if not integration.early_decision or not keeps:
        return
    table["decide_crossings"] = int(time.cycles / 20.0)
    table["decide_reach"] = np.maximum(highest, 0.0)
    if structure.uneven is not None:
        table["decide_reach"] = passed_heights(structure.model, location, highest)
    table["decide_energy"] = decidable_energy(structure.model, location, highest)
