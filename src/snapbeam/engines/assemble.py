"""From a system and its runs to an ensemble: everything turned into modal numbers and ticks."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from snapbeam.core.validate import InputError
from snapbeam.engines.clock import Clocked, clocked, most_steps
from snapbeam.engines.columns import RUN
from snapbeam.engines.driven import Driven, begun_at, cycles_of, driven_of, fastest_of, phases_of
from snapbeam.engines.ensemble import Ensemble, CircuitCoupling
from snapbeam.engines.others import others_of
from snapbeam.engines.plan import Plan, choose_base_step
from snapbeam.engines.structure import Structure, structure_of
from snapbeam.model.contact import ContactLaw, HertzContact
from snapbeam.model.decision import decidable_energy, passed_heights
from snapbeam.model.galerkin.reduction import ReducedModel
from snapbeam.model.integration import Integration
from snapbeam.model.quantity import RUN as RUN_SCOPE
from snapbeam.model.quantity import quantities
from snapbeam.model.start import rest_state
from snapbeam.model.state import State
from snapbeam.model.striker.another import numbered
from snapbeam.model.system import System

__all__ = ["FAR_AWAY", "cycles_of", "make_ensemble", "plans_of", "run_columns"]

_Array = NDArray[np.float64]
_Integers = NDArray[np.int64]

_LOWEST = {"standard": 1e-9, "reference": 1e-13}
"""Height of a flight after an impact that lasts no time, over b, below which chatter ends in sticking."""
_RESOLVED = 24.0
"""Flight steps, at least, in a period of a base's or an axial load's fastest part."""
_TAPPED = {"standard": 0.35, "reference": 0.1}
"""Longest step with a harvester, over the reciprocal of the greatest angular frequency with an open circuit. It
is in the kicks, and at 0.5 a run of one or three modes still loses up to 5e-3 of its gross work."""
FAR_AWAY = -1e30
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
    state = (system.initial_state or rest_state(system.model, system.striker)) if start is None else start
    runs = next(iter(columns.values())).size if columns else 1
    if state.batch and runs in (1, state.batch[0]):
        runs = state.batch[0]
    columns = {name: np.array(np.broadcast_to(values, (runs,))) for name, values in columns.items()}
    side = _side(system, state, goes_on=periods is not None)
    structure = structure_of(system.model, side, system.striker, system.base_excitation, system.harvester)
    plans = plans_of(system, integration, columns) if plan is None else [plan] * runs
    if step_factor != 1.0:
        plans = [each._replace(step=step_factor * each.step) for each in plans]
    driven = driven_of(system, columns, runs)
    table = np.zeros(runs, dtype=RUN)
    places = _places(structure, table, columns.get("striker.location", np.full(runs, 0.5)))
    starts = _starts(structure, table, state, 1.0 if system.harvester is None else system.harvester.unit)
    table["phase"] = np.where(np.isnan(state.phase), phases_of(system, columns, runs), state.phase)
    table["offset"] = _offsets(system, structure, state, columns, table, places.rows, starts, driven)
    table["tip_speed"] = driven.speed
    tapped = _tapped(system, columns, runs)
    if tapped is not None:
        table["circuit_rate"] = tapped.rate
    highest = table["rest_contact"] + table["offset"] + driven.highest
    if structure.body_mass is not None or driven.kind.parts or system.further_contacts:
        highest = np.full(highest.shape, np.inf)  # a body goes wherever it is thrown, and a shaken beam too
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
        tapped=tapped,
        harvester=system.harvester,
        others=others_of(system, structure, columns, runs),
    )


def run_columns(system: System, points: Mapping[str, _Array]) -> dict[str, _Array]:
    """Every parameter of scope *run* of a system as an array of shape (runs,), by dotted name.

    *points* holds those that differ between the runs; the others are the system's own.
    """
    size = next(iter(points.values())).size if points else 1
    own: dict[str, float] = {}
    parts: list[tuple[str, Any]] = [("contact", system.contact), ("striker", system.striker)]
    for number, each in enumerate(system.further_contacts, 2):
        parts += [(f"contact_{number}", each.contact), (f"striker_{number}", each.striker)]
        own |= {f"drive_{number}.{name}": value for name, value in each.striker.drive.values().items()}
    for section, part in parts:
        if part is not None:
            own |= {
                f"{section}.{name}": value
                for name, value in vars(part).items()
                if isinstance(value, float) and quantities(type(part))[name].scope == RUN_SCOPE
            }
    if system.striker is not None:
        own |= {f"drive.{name}": value for name, value in system.striker.drive.values().items()}
    if system.harvester is not None:
        own["harvester.resistance"] = float(system.harvester.resistance)
    for section, around in (("base", system.base_excitation), ("axial", system.axial_load)):
        if around is not None:
            own |= {f"{section}.{name}": value for name, value in around.motion.values().items()}
    columns = {name: np.full(size, value) for name, value in own.items()}
    for name, values in points.items():
        section, _, field = name.partition(".")
        strikers = 0 if system.striker is None else 1 + len(system.further_contacts)
        may_gap = field == "gap" and numbered(section)[0] == "striker" and numbered(section)[1] <= strikers
        if name not in columns and not may_gap:
            raise InputError(f"{name}: no parameter that may differ between the runs of one ensemble")
        columns[name] = np.asarray(values, dtype=np.float64)
    return columns


def plans_of(system: System, integration: Integration, columns: Mapping[str, _Array]) -> list[Plan]:
    """The steps of each run: they follow from the structure and from the run's own contact.

    A striker with a mass meets the beam for a shorter time, as the two masses together do: m_s m/(m_s + m).
    """
    plans, striker = _plans_of(system, integration, columns), system.striker
    further = [
        _plans_of(system, integration, columns, f"contact_{number}", each.contact)
        for number, each in enumerate(system.further_contacts, 2)
    ]
    if further:
        plans = [_serving(each) for each in zip(plans, *further, strict=True)]
    if integration.step is None and (system.base_excitation is not None or system.axial_load is not None):
        fastest = fastest_of(system, columns, len(plans))
        plans = [
            each._replace(step=min(each.step, 2.0 * math.pi / (_RESOLVED * rate)))
            for each, rate in zip(plans, fastest.tolist(), strict=True)
        ]
    if integration.step is None and system.harvester is not None:
        tapped = _tapped(system, columns, len(plans))
        assert tapped is not None
        # a circuit couples the fastest modes too, and is in its kicks
        longest = _TAPPED[integration.accuracy] / _fastest_open(system)
        rates = tapped.rate if system.harvester.inertia > 0.0 else np.zeros(len(plans))
        plans = [
            each._replace(step=min(each.step, longest, 1.0 / rate if rate > 0.0 else math.inf))
            for each, rate in zip(plans, rates.tolist(), strict=True)
        ]
    if striker is None or striker.mass is None:
        return plans
    mass = _struck(system).lightest_contact_mass
    more = max(0, math.ceil(0.5 * math.log2(1.0 + mass / striker.mass) - 1e-9))
    return [each._replace(coarsest=each.coarsest + more, finest=each.finest + more) for each in plans]


def _fastest_open(system: System) -> float:
    """Greatest angular frequency of the beam in its well, rad/s, while no current flows: theta^2/C stiffens it."""
    model, harvester = _struck(system), system.harvester
    assert harvester is not None
    stiffness = np.diag(model.omega**2)
    if harvester.inertia > 0.0:
        row = model.linear_modes.T @ harvester.row(model)
        stiffness = stiffness + np.outer(row, row) / harvester.inertia
    return float(np.sqrt(np.linalg.eigvalsh(stiffness)[-1]))


def _struck(system: System) -> ReducedModel:
    """The model as the striker sees it, so that mirror images are stepped alike."""
    above = system.striker is not None and system.striker.side == "above"
    return system.model.mirrored if above else system.model


def _serving(plans: Sequence[Plan]) -> Plan:
    """Steps that serve several contacts: as short as the shortest of them, in flight and in contact."""
    step = min(each.step for each in plans)
    longest = min(each.step * 0.5**each.coarsest for each in plans)
    shortest = min(each.step * 0.5**each.finest for each in plans)
    coarsest, finest = (math.ceil(math.log2(step / each) - 1e-9) for each in (longest, shortest))
    return plans[0]._replace(step=step, coarsest=max(0, coarsest), finest=max(0, coarsest, finest))


def _plans_of(
    system: System,
    integration: Integration,
    columns: Mapping[str, _Array],
    section: str = "contact",
    contact: ContactLaw | None = None,
) -> list[Plan]:
    """The steps that a contact asks for: that of the first striker, or another one's."""
    of_contact = {
        name.partition(".")[2]: values for name, values in columns.items() if name.startswith(f"{section}.")
    }
    step, accuracy = integration.step, integration.accuracy
    runs = next(iter(columns.values())).size if columns else 1
    contact = contact or (system.contact if system.striker is not None else None)
    if contact is None or not of_contact:
        return [choose_base_step(_struck(system), contact, step=step, accuracy=accuracy)] * runs
    table = np.stack(list(of_contact.values()), axis=1)
    different, which = np.unique(table, axis=0, return_inverse=True)
    plans = [
        choose_base_step(
            _struck(system),
            dataclasses.replace(contact, **dict(zip(of_contact, map(float, row), strict=True))),  # type: ignore[type-var]
            step=step,
            accuracy=accuracy,
        )
        for row in different
    ]
    return [plans[i] for i in which.ravel()]


def _side(system: System, state: State, goes_on: bool) -> str:
    if system.striker is not None:
        return system.striker.side
    if goes_on:
        # the same from call to call, whichever well it comes to
        return "below"
    # seen from the well the beam starts in, so that mirror images are mirrored to the bit
    first = state.flat()[0]
    return "above" if float(first.amplitude @ system.model.midspan_shape) > 0.0 else "below"


class _Places(NamedTuple):
    location: _Array
    rows: _Array


def _places(structure: Structure, table: NDArray[Any], location: _Array) -> _Places:
    different, which = np.unique(location, return_inverse=True)
    shapes = np.array([structure.model.shape_at(float(x)) for x in different])
    table["contact_row"] = which
    table["rest_contact"] = structure.sign * structure.rests(shapes)[which]
    table["rest_center"] = structure.center_rest
    return _Places(location, np.array([structure.row(shape) for shape in shapes]))


def _starts(structure: Structure, table: NDArray[Any], state: State, unit: float) -> _Array:
    """q and p of every start; which start and home each run has is entered in the table."""
    flat, modal = state.flat(), state.flat().modal
    count = flat.batch[0]
    table["start_row"] = np.arange(table.size) if count > 1 else 0
    table["home"], table["contact_time"] = 1.0, flat.contact_time
    if modal is not None and modal.structure == structure.hash:
        table["home"] = modal.well_sign
        return np.stack((modal.q, modal.p), axis=1)
    parts = (flat.amplitude, flat.velocity, flat.striker_shift, flat.striker_rate, flat.circuit / unit)
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
    driven: Driven,
) -> _Array:
    """Penetration of the tip at mid-stroke into the beam at rest in the first well."""
    if system.striker is None:
        return np.full(table.size, FAR_AWAY)
    flat, modal = state.flat(), state.flat().modal
    position = structure.sign * flat.striker_position - table["rest_contact"]
    if modal is not None and modal.structure == structure.hash:
        # to the bit, unless the striker now strikes at another place
        same = structure.sign * (table["rest_contact"] + modal.offset) == flat.striker_position
        return np.where(same, modal.offset, position)
    pairs = {(int(run["contact_row"]), int(run["start_row"])) for run in table}
    reach = {(workspace, at): float(rows[workspace] @ starts[at, 0]) for workspace, at in pairs}
    touching = np.array([reach[int(run["contact_row"]), int(run["start_row"])] for run in table])
    begun = begun_at(driven, table["phase"])
    offset = touching - begun
    if "striker.gap" in columns:
        offset = np.where(np.isnan(columns["striker.gap"]), offset, -columns["striker.gap"])
    return np.asarray(np.where(np.isnan(flat.striker_position), offset, position))


def _tapped(system: System, columns: Mapping[str, _Array], runs: int) -> CircuitCoupling | None:
    """The circuit of a harvester, for every run."""
    harvester = system.harvester
    if harvester is None:
        return None
    resistance = columns.get("harvester.resistance", np.zeros(runs))
    loss, inertia = harvester.loss(resistance), harvester.inertia
    rate = loss / inertia if inertia > 0.0 else 1.0 / loss
    unit = 1.0 / math.sqrt(inertia) if inertia > 0.0 else 1.0
    return CircuitCoupling(rate, harvester.share(resistance), harvester.volts(resistance) * unit)


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
    properties = system.contact is None or system.contact.properties.energy_bound
    if not integration.early_termination or not properties or system.further_contacts:
        return
    table["decide_crossings"] = int(time.cycles / 20.0)
    table["decide_reach"] = np.maximum(highest, 0.0)
    if structure.uneven is not None:
        table["decide_reach"] = passed_heights(structure.model, location, highest)
    table["decide_energy"] = decidable_energy(structure.model, location, highest)
