"""Assembly of an ensemble from a system and its runs: everything turned into modal numbers and ticks."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from snapbeam.model.drive.base import HORIZON, Drive
from snapbeam.model.early_termination import decidable_energy
from snapbeam.model.integration import Integration
from snapbeam.model.quantity import RUN as RUN_SCOPE
from snapbeam.model.quantity import numbered, quantities, section_of, split_name
from snapbeam.model.state import State
from snapbeam.model.system import System
from snapbeam.solver.channels import channels_of
from snapbeam.solver.ensemble import FAR_AWAY, CircuitCoupling, Ensemble, Records, run_dtype
from snapbeam.solver.excitation import carried, displacements, motion_of, own_columns, side_of, started
from snapbeam.solver.restrictions import check_integrable
from snapbeam.solver.step_size import Plan, choose_base_step, clocked, for_modes, most_steps
from snapbeam.solver.structure import Structure, structure_of
from snapbeam.util.validation import InputError, shown

_Array = NDArray[np.float64]
_Integers = NDArray[np.int64]


# What moves in every run of an ensemble.


_SHORTEST_PERIOD = 1e-300
"""Period of an excitation, s, below which its reciprocal and its products are not numbers."""


def _runs_of(columns: Mapping[str, _Array]) -> int:
    return next(iter(columns.values())).size if columns else 1


def cycles_of(system: System, columns: Mapping[str, _Array]) -> _Array:
    """Seconds of one cycle of excitation of each run, or of the first mode where nothing moves, shape (runs,)."""
    runs, leads = _runs_of(columns), system.primary_excitation
    if leads is None:
        return 2.0 * math.pi / (np.ones(runs) * system.scale.omega)
    section, drive = leads
    with np.errstate(all="ignore"):
        periods = drive.cycle(own_columns(columns, section, runs), system.scale)
    bad = np.flatnonzero(~((periods >= _SHORTEST_PERIOD) & np.isfinite(periods)))
    if bad.size:
        raise InputError(
            f"{section}: a period of {float(periods[bad[0]]):g} s: must be at least {_SHORTEST_PERIOD:g} s and finite; "
            "change the frequency"
        )
    return periods


def phases_of(system: System, columns: Mapping[str, _Array], runs: int) -> _Array:
    """Argument of the drive at the start of each run: of several motions their own phases count instead."""
    if len(system.moving) > 1:
        return np.zeros(runs)
    name = next((f"{section}.phase" for section, _ in system.moving), "drive.phase")
    return columns.get(name, np.zeros(runs))


def clock_of(system: System, columns: Mapping[str, _Array], runs: int) -> _Array:
    """Rate of the phase of each run, rad/s: of its one motion, or of the time since they began that several motions share."""
    if not system.moving:
        return np.full(runs, system.scale.omega)
    if len(system.moving) > 1:
        return 2.0 * math.pi / (HORIZON * cycles_of(system, columns))
    section, drive = system.moving[0]
    return drive.numbers(own_columns(columns, section, runs), system.scale)["omega"]


def highest_of(system: System, columns: Mapping[str, _Array], runs: int) -> _Array:
    """Highest position of the tip from its mid-position, m; -inf without one, inf where nothing is said of it.

    A body goes wherever it is thrown, and a shaken beam too: no such run is decided by it.
    """
    if (
        any(section != "drive" for section, _ in system.moving)
        or any(each.striker.mass is not None for each in system.contacts)
        or len(system.contacts) > 1
        or system.local_forces
    ):
        return np.full(runs, np.inf)
    if system.striker is None:
        return np.full(runs, -np.inf)
    drive, own = system.striker.drive, own_columns(columns, "drive", runs)
    if system.striker.side == "above" and drive.recorded:  # made in space; other motions are positive as it pushes
        return drive.mirrored_bounds(own, system.scale)
    return drive.bounds(own, system.scale)[0]


def _begun_at(system: System, columns: Mapping[str, _Array], clock: _Array, phase: _Array, number: int) -> _Array:
    """Displacement of a tip, the first being 1, from its mid-position at the start, m, in the frame of the ends; shape (runs,).

    All tips but the first are placed as their motions begin, even if the state is later in them.
    """
    striker, base, found = system.contacts[number - 1].striker, system.base_excitation, np.zeros(phase.size)
    motions: list[tuple[str, Drive, float]] = [(section_of("drive", number), striker.drive, 1.0)]
    if base is not None and (share := carried(system, striker)):
        motions.append(("base_excitation", base.motion, share))
    for section, drive, share in motions:
        own, times = own_columns(columns, section, phase.size), np.zeros(phase.size)
        if number == 1:
            own, times = started(system, own, phase, clock)
        found = found + share * displacements(drive, own, system.scale, times)
    return found


def fastest_of(system: System, columns: Mapping[str, _Array], runs: int) -> _Array:
    """Maximum angular frequency of all that moves, rad/s, or 0; that of a striker, which acts in contact only, counts a quarter."""
    found = np.zeros(runs)
    for section, drive in system.moving:
        numbers = drive.numbers(own_columns(columns, section, runs), system.scale)
        own = numbers["fastest" if "fastest" in numbers else "omega"]
        found = np.maximum(found, own if _is_around(section) else 0.25 * own)
    return found


def motions_of(ensemble: Ensemble, system: System, times: _Array) -> dict[str, tuple[_Array, _Array]]:
    """Displacement (m) and velocity (m/s) of the base in space; change of the load and external forces (N) and their rates.

    By section.  *ensemble* is that of the one run, which may begin in the middle of its drives.
    """
    found, base = {}, system.base_excitation
    for section, drive in system.moving:
        if _is_around(section):
            sign = -1.0 if section == "base_excitation" and base is not None and base.direction == "down" else 1.0
            value, rate, _ = sign * _motion_at(ensemble, system, section, drive, times)
            found[section] = value, rate
    return found


def tip_of(ensemble: Ensemble, system: System, number: int, times: _Array) -> _Array:
    """Displacement from its mid-position (m) of a striker of several, the first being 1.

    Seen from its own side, in the frame of the ends but without what a base does to it.  *ensemble* is that of the one
    run, which may begin in the middle of its drives.
    """
    drive = system.contacts[number - 1].striker.drive
    return _motion_at(ensemble, system, section_of("drive", number), drive, times)[0]


def _motion_at(ensemble: Ensemble, system: System, section: str, drive: Drive, times: _Array) -> _Array:
    """Displacement, velocity and acceleration of one motion of the one run of an ensemble, shape (3, times)."""
    own, begun = started(system, drive.columns(), ensemble.runs["phase"], ensemble.clock)
    at = begun[0] + times
    motion = motion_of(drive, system.scale, at.max(initial=0.0), own)
    return side_of(system, section, drive) * motion(at)


def _is_around(section: str) -> bool:
    """Return whether the parameters of a section act on the structure itself: base, axial load or local force."""
    return section in ("base_excitation", "axial_load") or numbered(section)[0] == "force"


_LOWEST = {"standard": 1e-9, "reference": 1e-13}
"""Height of a flight after an impact that lasts no time, over b, below which chatter ends in sticking."""
_RESOLVED = 24.0
"""Flight steps, at least, in a period of the fastest part of a base's motion, a load or a force."""
_TAPPED = {"standard": 0.35, "reference": 0.1}
"""Longest step over the reciprocal of the angular frequency or rate of what is in the kicks beside tension and contacts."""
_DECAY, _FOLLOWS = 3.0, 8.0
"""Decay of a circuit in a step, lam h, at most, and beyond which it follows the beam (``core/step.hpp``)."""
_GENERAL = 0.4
"""Step with the general composition of order 6 over that with the one for forces of position alone, for an equal error."""


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
        Cycles to integrate, a state handed out after each; by default the cycles of *integration*, in one go.
    step_factor : float
        Times the length of every step.

    Raises
    ------
    InputError
        For parameters that cannot differ between the runs of an ensemble, and for more steps than can be counted.
    """
    check_integrable(system, integration.engine)
    columns = run_columns(system, points or {})
    state = system.start_state if start is None else start
    runs = _runs_of(columns)
    if state.batch and runs in (1, state.batch[0]):
        runs = state.batch[0]
    columns = {name: np.array(np.broadcast_to(values, (runs,))) for name, values in columns.items()}
    side = _side(system, state, goes_on=periods is not None)
    structure = structure_of(
        system.model, side, tuple(each.striker for each in system.contacts), system.base_excitation, tuple(system.harvesters),
        system.external_forces,
        system.local_forces, system.unloaded_potential.dividing_height,
        tuple(i for i, each in enumerate(system.contacts) if each.law.memory),
    )  # fmt: skip
    plans = plans_of(system, integration, columns) if plan is None else [plan] * runs
    if step_factor != 1.0:
        plans = [each.scaled(step_factor) for each in plans]
    _require_clock(system, state)
    _require_valid(system, state)
    clock = clock_of(system, columns, runs)
    table = np.zeros(runs, dtype=run_dtype(len(system.contacts)))
    table["contact_time"] = state.flat.contact_times(max(1, len(system.contacts)))
    units = np.array([each.unit for each in system.harvesters] or [1.0])
    starts = _starts(structure, table, state, units)
    table["phase"] = np.where(np.isnan(state.phase), phases_of(system, columns, runs), state.phase)
    rows = _place(system, structure, state, columns, table, starts, clock)
    cycles = clocked(table, system, integration, cycles_of(system, columns), plans, periods)
    _require_record(system, table, clock)
    table["lowest"] = system.scale.length * _LOWEST[integration.accuracy]
    ensemble = Ensemble(
        structure=structure,
        scale=system.scale,
        order=plans[0].order,
        runs=table,
        clock=clock,
        comes_round=len(system.moving) < 2 and all(drive.is_periodic for _, drive in system.moving),
        location=columns.get("contact.location", np.full(runs, 0.5)),
        highest=table["rest_contact"][:, 0] + table["offset"][:, 0] + highest_of(system, columns, runs),
        contact_rows=rows,
        starts=starts,
        max_steps=most_steps(integration, system.model.modes),
        high_omega=integration.high_frequency_ratio * system.scale.omega,
        cycles=cycles,
        circuits=_circuits(system, columns, runs),
        contacts=len(system.contacts),
        impulsive=any(each.law.impulsive for each in system.contacts),
    )
    _decide(ensemble, system, integration)
    if integration.engine == "python":
        return dataclasses.replace(ensemble, systems=_systems(system, points or {}, runs))
    return dataclasses.replace(ensemble, channels=channels_of(system, ensemble, columns))


def _systems(system: System, points: Mapping[str, _Array], runs: int) -> tuple[System, ...]:
    """The system of each run, with its own parameters."""
    if not points:
        return (system,) * runs
    rows = zip(*(np.broadcast_to(values, (runs,)).tolist() for values in points.values()), strict=True)
    found = ({name: value for name, value in zip(points, row, strict=True) if value == value} for row in rows)
    return tuple(system.replace(**changes) for changes in found)


def _require_record(system: System, table: Records, clock: _Array) -> None:
    """Refuse runs that last longer than the shortest record."""
    records: list[Any] = [each for _, each in system.moving if each.recorded]
    if not records:
        return
    record = min(records, key=lambda each: each.duration)
    ends = float((table["end"] * table["tick"] + table["phase"] / clock).max())
    if ends > record.duration * (1.0 + 1e-9) + float(table["tick"].max()):
        what = record.name.replace("_", " ")
        raise InputError(
            f"cycles: the run ends after {ends:g} s, but the {what} lasts {record.duration:g} s; ask for fewer "
            "cycles, or give a longer record"
        )


_LONGEST_CLOCK = 2.0 * math.pi * 2.0**16 / HORIZON
"""Phase of the clock that several motions share, after 65,536 cycles."""


def _require_clock(system: System, state: State) -> None:
    """Refuse a phase of one drive in a start of several motions, which share a clock and have their own phases."""
    if len(system.moving) < 2 or state.modal is not None:
        return
    given = state.phase[(state.phase < 0.0) | (state.phase > _LONGEST_CLOCK)]  # not NaN, which is none
    if given.size:
        names = ", ".join(f"{section}.phase" for section, _ in system.moving)
        raise InputError(
            f"state phase = {shown(given[0])}: must not be given if several "
            f"motions act; give each motion its own phase ({names})"
        )


def _require_valid(system: System, state: State) -> None:
    """Refuse one start at which a local force is not valid; of a batch, such runs end at once with the status DIVERGED."""
    if state.batch or not system.local_forces or bool(system.unloaded_potential.holds(state.amplitude)):
        return
    for force in system.local_forces:
        low, high = force.displacement_range(force.numbers)
        u = float(force.row(system.model) @ state.amplitude)
        if not low < u < high:
            raise InputError(
                f"initial_state: the displacement {u:.4g} m or rad of {type(force).__name__} must be within the range of its law, "
                f"from {low:.4g} to {high:.4g} m or rad"
            )


def run_columns(system: System, points: Mapping[str, _Array]) -> dict[str, _Array]:
    """Every parameter of scope *run* of a system, and every number of its contact laws, as an array of shape (runs,), by dotted name.

    *points* holds those that differ between the runs; the others are the system's own.
    """
    own: dict[str, float] = {}
    for number, each in enumerate(system.contacts, 1):
        for part in (each.law, each.striker):
            own |= {
                f"{section_of('contact', number)}.{name}": value
                for name, value in vars(part).items()
                if isinstance(value, float) and (part is each.law or quantities(type(part))[name].scope == RUN_SCOPE)
            }
        moving = section_of("drive", number)
        own |= {f"{moving}.{name}": value for name, value in each.striker.drive.values().items()}
    for number, harvester in enumerate(system.harvesters, 1):
        own[f"{section_of('harvester', number)}.resistance"] = float(harvester.resistance)
    for section, motion in system.moving:
        if _is_around(section):
            own |= {f"{section}.{name}": value for name, value in motion.values().items()}
    columns = {name: np.full(_runs_of(points), value) for name, value in own.items()}
    for name, values in points.items():
        section, field = split_name(name)
        kind, number = numbered(section)
        may_gap = field == "gap" and kind == "contact" and number <= len(system.contacts)
        if name not in columns and not may_gap:
            raise InputError(f"{name}: no parameter that may differ between the runs of one ensemble")
        columns[name] = np.asarray(values, dtype=np.float64)
    return columns


def plans_of(system: System, integration: Integration, columns: Mapping[str, _Array]) -> list[Plan]:
    """The steps of each run: they follow from the structure and from the run's own contact.

    A striker with a mass meets the beam for a shorter time, as the two masses together do: m_s m/(m_s + m).
    """
    laws: list[tuple[str, Any]] = [
        (section_of("contact", number), each.law) for number, each in enumerate(system.contacts, 1)
    ]
    of_contacts = [_plans_of(system, integration, columns, *each) for each in laws or [("contact", None)]]
    plans = [each[0] if len(each) == 1 else _serving(each) for each in zip(*of_contacts, strict=True)]
    if masses := [each.striker.mass for each in system.contacts if each.striker.mass is not None]:
        more = max(0, math.ceil(0.5 * math.log2(1.0 + system.struck_model.lightest_contact_mass / min(masses)) - 1e-9))
        plans = [each._replace(contact=each.contact * 0.5**more) for each in plans]
        plans = [for_modes(each, *_suspensions(system), integration) for each in plans]
    if integration.step is None:
        if plans[0].order == 6 and _depends_on_velocity(system):
            plans = [each.scaled(_GENERAL) for each in plans]
        with np.errstate(divide="ignore"):
            longest = 2.0 * math.pi / (_RESOLVED * fastest_of(system, columns, len(plans)))
        if system.harvesters:
            step = np.minimum([each.step for each in plans], longest)
            longest = np.minimum(longest, _longest_with_circuits(step, system, columns, integration.accuracy))
        if system.local_forces:
            longest = np.minimum(longest, _longest_with_local_forces(system, integration.accuracy))
        plans = [each.no_longer(own) for each, own in zip(plans, longest.tolist(), strict=True)]
    return plans


def _suspensions(system: System) -> tuple[float, float]:
    """Maximum frequency (rad/s) and decay rate (1/s) of the bodies of strikers on their suspensions."""
    bodies = [(each.striker, each.striker.mass) for each in system.contacts if each.striker.mass is not None]
    return (
        max(math.sqrt(striker.suspension_stiffness / mass) for striker, mass in bodies),
        max(0.5 * striker.suspension_damping / mass for striker, mass in bodies),
    )


def _depends_on_velocity(system: System) -> bool:
    """True if a force depends on velocities, so that the kicks need the general composition of order 6.

    It also holds contacts of no duration together, whose steps have far less error.
    """
    return (
        any(each.law.rate_dependent for each in system.contacts)
        or bool(system.struck_model.modal_damping.coefficients.size)
        or any(each.dissipative for each in system.local_forces)
        or bool(system.harvesters)
    )


def _longest_with_local_forces(system: System, accuracy: str) -> float:
    """Longest step with local forces, s: their stiffness and damping are in the kicks."""
    model, scale = system.struck_model, system.scale
    at_center = abs(float(model.midspan_shape @ model.well_amplitude)) or scale.length
    squared, decay = 0.0, 0.0
    for force in system.local_forces:
        shape = force.row(model)
        mobility = float(np.sum((model.linear_modes.T @ shape) ** 2))
        largest = force.largest_displacement(model)
        fastest = largest * scale.omega * max(1.0, scale.length / at_center)
        squared += mobility * force.greatest_stiffness(largest)
        decay += mobility * force.greatest_damping(largest, fastest) if force.dissipative else 0.0
    return _TAPPED[accuracy] / max(math.sqrt(squared), decay, 1e-300)


def _longest_with_circuits(step: _Array, system: System, columns: Mapping[str, _Array], accuracy: str) -> _Array:
    """Longest steps that resolve circuits, s, of runs whose other parts ask for a *step*.

    The stiffness t.t of circuits with inertia, and the damping rate t.t of those without, are in the kicks.  The decay lam h of a
    circuit in a step is at most 3, or over 8: then it follows the beam.
    """
    model, squared, decay, longest = system.struck_model, 0.0, np.zeros(step.size), np.full(step.size, math.inf)
    for harvester, circuit in zip(system.harvesters, _circuits(system, columns, step.size), strict=True):
        row = model.linear_modes.T @ harvester.row(model)
        if harvester.inertia > 0.0:
            squared += float(row @ row) / harvester.inertia
            resolved = circuit.rate * step <= _FOLLOWS
            longest = np.where(resolved, np.minimum(longest, _DECAY / np.maximum(circuit.rate, 1e-300)), longest)
        else:
            decay += float(row @ row) * circuit.rate
    exchange = np.maximum(np.maximum(math.sqrt(squared), decay), 1e-300)
    return np.minimum(longest, 2.0 * _TAPPED[accuracy] / exchange)


def _serving(plans: Sequence[Plan]) -> Plan:
    """Steps that serve several contacts: as short as the shortest of them, in flight and in contact."""
    contact = min(each.contact for each in plans)
    halvings = math.ceil(math.log2(contact / min(each.shortest for each in plans)) - 1e-9)
    return Plan(plans[0].order, min(each.step for each in plans), contact, halvings)


def _plans_of(
    system: System, integration: Integration, columns: Mapping[str, _Array], section: str, contact: Any
) -> list[Plan]:
    """The steps that a contact law asks for, or the beam alone, None."""
    known = () if contact is None else quantities(type(contact))
    of_contact = {name: columns[at] for name in known if (at := f"{section}.{name}") in columns}
    how: dict[str, Any] = {"step": integration.step, "accuracy": integration.accuracy}
    if contact is None or not of_contact:
        return [choose_base_step(system.struck_model, contact, **how)] * _runs_of(columns)
    different, which = np.unique(np.stack(list(of_contact.values()), axis=1), axis=0, return_inverse=True)
    laws = [dataclasses.replace(contact, **dict(zip(of_contact, map(float, row), strict=True))) for row in different]
    plans = [choose_base_step(system.struck_model, law, **how) for law in laws]
    return [plans[i] for i in which.ravel()]


def _side(system: System, state: State, goes_on: bool) -> str:
    model = system.model
    if system.striker is not None:
        return system.striker.side
    if model.is_bistable and model.mirrored is not model:
        # one damping matrix, whichever well the beam starts in
        return "below" if system.struck_model is model else "above"
    if goes_on:
        # the same from call to call, whichever well it comes to
        return "below"
    # measured from the well the beam starts in, so that mirror images are mirrored to the bit
    return "above" if float(state.flat[0].amplitude @ system.model.midspan_shape) > 0.0 else "below"


def _starts(structure: Structure, table: Records, state: State, units: _Array) -> _Array:
    """q and p of every start; which start and well each run has is entered in the table."""
    flat, modal = state.flat, state.flat.modal
    count = flat.batch[0]
    table["start_row"] = np.arange(table.size) if count > 1 else 0
    table["well_sign"] = 1.0
    if modal is not None and modal.structure == structure.hash:
        table["well_sign"] = modal.well_sign
        return np.stack((modal.q, modal.p), axis=1)
    return modal_of(structure, flat, units)


def modal_of(structure: Structure, flat: State, units: _Array) -> _Array:
    """q and p of each state of a batch about the first well, shape (runs, 2, N); *units* of the circuits."""
    circuit = _per_unit(flat.circuit, units)
    parts = (flat.amplitude, flat.velocity, flat.striker_shift, flat.striker_rate, flat.indentation, circuit)
    return np.array([structure.to_modal(*each) for each in zip(*parts, strict=True)])


def _place(
    system: System,
    structure: Structure,
    state: State,
    columns: Mapping[str, _Array],
    table: Records,
    starts: _Array,
    clock: _Array,
) -> _Array:
    """Enter the row of every contact, its rest and its offset: penetration of the tip at mid-stroke into the beam at rest.

    A tip touches the beam or stands its gap away from the beam at rest.  The first one touches the beam as the run begins
    unless the state says where it is, the others touch it at rest.  Returns the rows of all contacts; of a beam alone that of mid-span.
    """  # fmt: skip
    runs, rows = table.size, list[_Array]()
    table["offset"] = FAR_AWAY
    for j in range(max(1, len(system.contacts))):
        section, sign = section_of("contact", j + 1), 1.0
        if j and system.contacts[j].striker.side != system.contacts[0].striker.side:
            sign = -1.0
        different, which = np.unique(columns.get(f"{section}.location", np.full(runs, 0.5)), return_inverse=True)
        shapes = np.array([structure.model.shape_at(float(x)) for x in different])
        own = np.array([structure.row(shape, j, sign) for shape in shapes])
        table["contact_row"][:, j] = len(rows) + which
        table["rest_contact"][:, j] = sign * structure.sign * structure.rests(shapes)[which]
        rows += list(own)
        if not system.contacts:
            continue
        # the gap is that to the beam at rest, which a local force moves out of the well of the structure
        resting = touching = _reach_at_rest(system, structure, which, own)
        begun = _begun_at(system, columns, clock, table["phase"], j + 1)
        if not j:
            pairs = zip(which.tolist(), table["start_row"].tolist(), strict=True)
            touching = np.array([float(own[place] @ starts[at, 0]) for place, at in pairs])
        gap = columns.get(f"{section}.gap", np.full(runs, np.nan))
        table["offset"][:, j] = np.where(np.isnan(gap), touching - begun, resting - gap)
    given, modal = state.flat.striker_position, state.flat.modal
    if system.contacts and not np.isnan(given).all():
        rest, offset = table["rest_contact"][:, 0], table["offset"][:, 0]
        position = structure.sign * given - rest
        if modal is not None and modal.structure == structure.hash:
            # to the bit, unless the striker now strikes at another place
            position = np.where(structure.sign * (rest + modal.offset) == given, modal.offset, position)
        table["offset"][:, 0] = np.where(np.isnan(given), offset, position)
    return np.array(rows)


def _reach_at_rest(system: System, structure: Structure, which: _Integers, rows: _Array) -> _Array | float:
    """Displacement of contact points from the well of the structure at rest, which local forces cause; *which* row each has."""
    if system.potential.is_of_the_structure_alone:
        return 0.0
    state = system.rest_state
    q = structure.to_modal(state.amplitude, state.velocity, 0.0, 0.0, 0.0)[0]
    return np.asarray(rows[which] @ q)


def _per_unit(circuit: _Array, units: _Array) -> _Array:
    """States of circuits as coordinates: one of each start, or one for each of several circuits."""
    if units.size == 1:
        return circuit / units[0]
    return np.broadcast_to(circuit.reshape(circuit.shape[0], -1), (circuit.shape[0], units.size)) / units


def _circuits(system: System, columns: Mapping[str, _Array], runs: int) -> tuple[CircuitCoupling, ...]:
    """The circuits of the harvesters, for every run."""
    found = []
    for number, harvester in enumerate(system.harvesters, 1):
        resistance = columns.get(f"{section_of('harvester', number)}.resistance", np.zeros(runs))
        loss, inertia = harvester.loss(resistance), harvester.inertia
        rate = loss / inertia if inertia > 0.0 else 1.0 / loss
        volts = harvester.volts(resistance) * (1.0 / math.sqrt(inertia) if inertia > 0.0 else 1.0)
        found.append(CircuitCoupling(rate, harvester.share(resistance), volts, harvester.unit))
    return tuple(found)


def _decide(ensemble: Ensemble, system: System, integration: Integration) -> None:
    """Set the criteria of early termination of each run: crossings, energy and reach of the tip."""
    table, structure = ensemble.runs, ensemble.structure
    table["decide_crossings"], table["decide_energy"] = -1, -math.inf
    if not integration.early_termination or len(system.contacts) > 1 or system.local_forces:
        return
    if system.striker is not None and structure.wells_are_mirror_images:
        # elsewhere the class also depends on whether the other well is reached
        table["decide_crossings"] = int(ensemble.cycles / 20.0)
    table["decide_reach"] = ensemble.reach
    table["decide_energy"] = decidable_energy(structure.model, ensemble.location, ensemble.highest)
