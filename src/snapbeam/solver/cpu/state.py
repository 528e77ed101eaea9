"""A run of the CPU engine: what stays the same in it, where it stands, how it begins, lands and ends."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

from snapbeam.solver.compilation import called, compiled, inlined
from snapbeam.solver.contact_force import contact_energy, felt_force, is_impulsive
from snapbeam.solver.cpu.indentation import law_at, tip_at
from snapbeam.solver.cpu.mode_lanes import (
    WORK_ROWS,
    Layout,
    acceleration_rows,
    beam_energy,
    beam_power,
    flow_coefficients,
    modal_energies,
    modal_energy,
    tension_rows,
)
from snapbeam.solver.cpu.step import observe, prepare
from snapbeam.solver.cpu.terms.further_contact_events import (
    accumulate_open_further_contacts,
    begin_further_contacts,
    restart_further_contacts,
)
from snapbeam.solver.cpu.terms.further_contacts import evaluate_contacts, with_further_contact_energy
from snapbeam.solver.cpu.terms.velocity_block import prepare_velocity_block
from snapbeam.solver.excitation import Tip, drive_rate, numbers_of
from snapbeam.solver.physics import tension_energy, tension_factors
from snapbeam.solver.splitting import TURNS, Stages
from snapbeam.solver.step_control import (
    SUBINTERVALS,
    Clock,
    ContactKinematics,
    accumulate_energy,
    accumulate_open_contact,
    begin_other_well,
    begin_statistics,
    clock_of,
    close_impact,
)
from snapbeam.solver.terms.interface import (
    add_potential_energy,
    add_to_tension,
    begin_run,
    enter_well,
    kinematics_from_barrier,
    relative_to_nearest_well,
    update_forces,
)
from snapbeam.util.status_codes import RunStatus

_OK, _EARLY_STOP, _RUNNING = int(RunStatus.OK), int(RunStatus.EARLY_STOP), int(RunStatus.INTERRUPTED)
_TWO_PI = 2.0 * math.pi


class KernelInput(NamedTuple):
    """Input of a kernel: runs, contact laws, drives and initial states of an ensemble."""

    runs: Any
    law_numbers: Any
    drive_numbers: Any
    contact_rows: Any
    starts: Any
    law: Any
    """Any numbers of the law, for their type; so is the drive's."""
    drive: Any
    other_numbers: Any
    """Numbers of the further strikers, shape (runs, strikers, numbers)."""
    other_places: Any
    other_rows: Any
    circuit_rates: Any
    """Rates of loss of the circuits, shape (runs, circuits)."""
    extras: Any
    """Statistics that were registered, by type."""
    max_steps: int
    high: bool
    """True if some modes count as high."""


class Workspace(NamedTuple):
    """Memory layout and composition stages of a run."""

    layout: Layout
    stages: Stages


class Scratch(NamedTuple):
    """Scratch arrays of a thread outside memory: samples inside a step, and partial sums."""

    inner_samples: Any
    parts: Any


class Rows(NamedTuple):
    """Memory offsets of the state (q, p, acceleration k of the tension), and of the state after the step."""

    q: int
    p: int
    k: int
    q1: int
    p1: int
    k1: int


class StepControl(NamedTuple):
    """The quantities that control the steps, kept from step to step."""

    touching: bool
    safe_gap: int
    """Until this tick the gap cannot close."""
    safe_center: int
    """Until this tick the centre cannot cross."""
    energy_tick: int
    """Tick at which the energy was last evaluated."""
    steps_since_start: int
    """Steps since the run began or was stored."""


class RunConstants(NamedTuple):
    """Constants of a run."""

    tip: Tip
    """The tip relative to the well from which the run's displacements are measured."""
    clock: Clock
    phase: float
    """Argument of the drive at the start."""
    rest_contact: float
    """Displacement of the contact point in that well, positive as the striker pushes."""
    rest_center: float
    tip_speed: float
    shortest_subinterval: float
    """Longest subinterval in which a step is sampled, s."""
    step_subintervals: int
    """Number of such subintervals in a flight step."""
    step_time: float
    """Duration of the flight step, s."""
    coefficients: int
    """Memory offset of the prepared steps, one for each number of halvings from 0 on."""
    slot: int
    """Length of one."""
    spare: int
    """Rows for a trial step inside a step: q, p, k."""
    lowest: float
    """Height of a flight that is too low to be resolved, m: under Newton's law, where chatter ends."""
    high: bool
    """True if some modes count as high, so that the modal energies are summed."""


class IntegratorState(NamedTuple):
    """State of the integrator within a run."""

    t: int
    """Ticks."""
    well_sign: float
    """+1 in the first well, -1 in the other: the origin of q."""
    stretch: float
    """Squared slopes beyond those of the well."""
    rows: Rows
    kinematics: ContactKinematics
    control: StepControl
    sample: int
    """Instants recorded so far."""
    stored_states: int
    """States handed out so far."""
    status: int


@inlined
def variable_slot(run):
    """Memory offset of the prepared step of variable length."""
    return run.coefficients + (run.clock.max_halvings + 1) * run.slot


@inlined
def sampling_slot(run):
    """Memory offset of the flows over one subinterval of a flight step and over any other subinterval."""
    return variable_slot(run) + run.slot


@inlined
def phase_at(run, t):
    """Argument of the drive at a tick: from the whole number alone, never by addition."""
    return run.phase + _TWO_PI * ((t % run.clock.period) / run.clock.period)


@inlined
def run_of(memory, layout, stages, kernel_input, i):
    """Constants of run *i*; its prepared steps are written to memory."""
    record = kernel_input.runs[i]
    size, work = layout.size, layout.work
    tip = Tip(
        record.offset,
        numbers_of(kernel_input.law, kernel_input.law_numbers, i),
        numbers_of(kernel_input.drive, kernel_input.drive_numbers, i),
    )
    clock = clock_of(record, kernel_input.max_steps)
    coefficients, slot = work + WORK_ROWS * size, (stages.flows + 1) // 2 * 4 * size + 2 * TURNS
    step_time = clock.step * clock.tick
    for level in range(clock.max_halvings + 1):
        length, at = step_time / (1 << level), coefficients + level * slot
        prepare(memory, layout, stages, tip.drive, length, at)
    fastest = drive_rate(tip.drive)
    for row in range(size):
        fastest = max(fastest, memory[layout.omega + row])
    shortest_subinterval = _TWO_PI / (SUBINTERVALS * fastest)
    step_subintervals = max(4, math.ceil(step_time / shortest_subinterval))
    run = RunConstants(
        tip,
        clock,
        record.phase,
        record.rest_contact,
        record.rest_center,
        record.tip_speed,
        shortest_subinterval,
        step_subintervals,
        step_time,
        coefficients,
        slot,
        work + 6 * size,
        record.lowest,
        kernel_input.high,
    )
    flow_coefficients(memory, layout, step_time / step_subintervals, sampling_slot(run))
    return run


@inlined
def _energies_at(memory, layout, run, well_sign, rows, kinematics, touching):
    """Energy of all linear modes, of those of the beam, of the high ones, and the rates of the last two.

    *rows* are the locations of q, p and k.  Modes are those about the well that the beam is near.
    """
    q, p, k = rows
    near = relative_to_nearest_well(memory, layout.size, layout.terms, well_sign, run.spare, q)
    force = felt_force(law_at(memory, layout, run, q), kinematics.d, kinematics.dv) if touching else 0.0
    linear, high, power, high_power = modal_energies(memory, layout, q, near, p, k, force)
    whole = beam_energy(memory, layout, near, p, linear)
    power, high_power = beam_power(memory, layout, p, k, force, power, high_power)
    return linear, whole, high, power, high_power


@inlined
def sample_energy(memory, layout, run, well_sign, rows, kinematics, touching, accumulators, span):
    """Add to the energy of the modes over time, up to where q, p and k stand; returns that of all linear modes."""
    linear, whole, high, power, high_power = _energies_at(
        memory, layout, run, well_sign, rows, kinematics, touching
    )
    accumulate_energy(accumulators, whole, high, power, high_power, span)
    return linear


@called
def close_energy(memory, layout, run, now, accumulators):
    """The same where a run stands now, between two steps."""
    rows, control = now.rows, now.control
    span = (now.t - control.energy_tick) * run.clock.tick
    places = rows.q, rows.p, rows.k
    sample_energy(
        memory, layout, run, now.well_sign, places, now.kinematics, control.touching, accumulators, span
    )


@called
def change_energy_origin(memory, layout, run, now, accumulators, span):
    """Begin to add up the energy of the modes about the other well, which was entered *span* ago."""
    rows = now.rows.q, now.rows.p, now.rows.k
    _, whole, high, power, high_power = _energies_at(
        memory, layout, run, -now.well_sign, rows, now.kinematics, now.control.touching
    )
    begin_other_well(accumulators, whole, high, power, high_power, span)


@inlined
def form_acceleration(memory, blocks, layout, drive, argument, q, k):
    """Write the acceleration k by all forces of place and time, but the first striker's; returns g.q and q.Gq."""
    r = layout.work + 9 * layout.size
    update_forces(memory, layout.size, layout.terms, drive, argument, q)
    evaluate_contacts(memory, layout.size, layout.others, drive, argument, q, 0.0, False)
    gq, qr = tension_rows(memory, blocks, layout, q, r)
    along_g, along_r = tension_factors(layout.gamma, gq, qr)
    along_g, along_r = add_to_tension(memory, layout.terms, along_g, along_r)
    acceleration_rows(memory, layout, along_g, along_r, r, k)
    return gq, qr


@called
def restart_from_state(memory, blocks, layout, run, t, well_sign, rows, touching, stored, sample):
    """State of a run at tick *t* from q and p alone, at its beginning and at an output state."""
    q, p = rows.q, rows.p
    gq, qr = form_acceleration(memory, blocks, layout, run.tip.drive, phase_at(run, t), q, rows.k)
    restart_further_contacts(memory, layout.size, layout.others, run.tip.drive, phase_at(run, t), t, q)
    tip = tip_at(memory, layout, run, well_sign, q)
    observed = observe(memory, layout, tip, phase_at(run, t), q, p)
    rest_contact, rest_center = well_sign * run.rest_contact, well_sign * run.rest_center
    kinematics = ContactKinematics(
        observed.w + rest_contact, observed.wv, observed.d, observed.dv, observed.c + rest_center, observed.cv
    )
    energy = modal_energy(memory, layout, q, p) + tension_energy(layout.gamma, gq, qr)
    energy = add_potential_energy(memory, layout.size, layout.terms, q, energy)
    status = _RUNNING if t < run.clock.end else _OK
    control = StepControl(touching, t, t, t, 0)
    return IntegratorState(
        t, well_sign, 2.0 * gq + qr, rows, kinematics, control, sample, stored, status
    ), energy


@compiled
def begin(memory, blocks, workspace, kernel_input, i, accumulators):
    """Put run *i* into its place in memory; returns what stays and where it stands."""
    layout, record = workspace.layout, kernel_input.runs[i]
    size, work = layout.size, layout.work
    for row in range(size):
        memory[layout.contact + row] = kernel_input.contact_rows[record.contact_row, row]
        memory[work + row] = kernel_input.starts[record.start_row, 0, row]
        memory[work + size + row] = kernel_input.starts[record.start_row, 1, row]
    begin_run(memory, size, layout.terms, kernel_input.circuit_rates, i, layout.omega_squared, layout.damping)
    run = run_of(memory, layout, workspace.stages, kernel_input, i)
    rows = Rows(work, work + size, work + 2 * size, work + 3 * size, work + 4 * size, work + 5 * size)
    if record.well_sign < 0.0:
        for row in range(size):
            memory[layout.g + row] = -memory[layout.g + row]
    enter_well(memory, size, layout.terms, record.well_sign)
    begin_further_contacts(
        memory,
        size,
        layout.others,
        run.tip.drive,
        kernel_input,
        i,
        run.clock.tick,
        phase_at(run, 0),
        record.well_sign,
        work,
    )
    prepare_velocity_block(memory, size, layout.velocity_block)
    now, energy = restart_from_state(memory, blocks, layout, run, 0, record.well_sign, rows, False, 0, 0)
    kinematics, since = now.kinematics, record.contact_time
    touching = since >= 0.0
    if not math.isfinite(since):
        # under a law whose impacts last no time, what is in touch and closing is about to hit
        pressed = kinematics.d > 0.0 or (kinematics.d == 0.0 and kinematics.dv > 0.0)
        touching = pressed and not is_impulsive(run.tip.law)
    accumulators.touching, accumulators.onset = int(touching), 0
    if math.isfinite(since) and since > 0.0:
        accumulators.onset = -int(since / run.clock.tick + 0.5)
    begin_statistics(
        accumulators,
        kinematics_from_barrier(layout.terms, kinematics).c,
        kinematics,
        run.tip.law,
        with_further_contact_energy(
            memory, layout.others, energy + contact_energy(law_at(memory, layout, run, work), kinematics.d)
        ),
    )
    control = StepControl(touching, 0, 0, 0, 0)
    begun = IntegratorState(0, now.well_sign, now.stretch, rows, kinematics, control, 0, 0, now.status)
    if run.high:
        close_energy(memory, layout, run, begun, accumulators)
    return run, begun


@compiled
def change_origin(memory, blocks, layout, well_sign, q, k, r):
    """Take the other well as the origin of the coordinates.

    If the wells are unequal, the origin is where the other well would be if they were equal.  The change is exact,
    since the structure is the same about both wells, except for a constant force if the wells are unequal.

    About the well that the beam is in, the linear flow holds most of the motion of every mode; about
    the far one, modes faster than the step would be held in place by kicks alone.
    """
    for row in range(layout.size):
        memory[q + row] -= well_sign * memory[layout.shift + row]
        memory[layout.g + row] = -memory[layout.g + row]
    enter_well(memory, layout.size, layout.terms, -well_sign)
    gq, qr = tension_rows(memory, blocks, layout, q, r)
    along_g, along_r = tension_factors(layout.gamma, gq, qr)
    along_g, along_r = add_to_tension(memory, layout.terms, along_g, along_r)
    acceleration_rows(memory, layout, along_g, along_r, r, k)
    return 2.0 * gq + qr


@compiled
def finish(memory, blocks, layout, run, now, accumulators, impacts, before, goes_on):
    """Close a run's record of accumulators; its last contact too, unless the run is to go on from here."""
    q, p, tick = now.rows.q, now.rows.p, run.clock.tick
    law = law_at(memory, layout, run, q)
    if now.control.touching:
        if goes_on:
            accumulate_open_contact(accumulators, law, now.t, tick)
        else:
            close_impact(accumulators, impacts, before, law, now.t, tick)
    if goes_on:
        accumulate_open_further_contacts(memory, layout.others, accumulators, now.t, tick)
    if now.status == _EARLY_STOP:
        accumulators.early_stop_time = now.t * tick
    if run.high:
        close_energy(memory, layout, run, now, accumulators)
    gq, qr = tension_rows(memory, blocks, layout, q, layout.work + 9 * layout.size)
    stored = modal_energy(memory, layout, q, p) + tension_energy(layout.gamma, gq, qr)
    stored = add_potential_energy(memory, layout.size, layout.terms, q, stored)
    stored = stored + contact_energy(law, now.kinematics.d)
    accumulators.energy = with_further_contact_energy(memory, layout.others, stored)
    accumulators.displacement, accumulators.center = now.kinematics.w, now.kinematics.c
    if now.well_sign < 0.0:
        # the place in memory is left as it was found
        for row in range(layout.size):
            memory[layout.g + row] = -memory[layout.g + row]
    accumulators.time, accumulators.status, accumulators.samples = now.t, now.status, now.sample
