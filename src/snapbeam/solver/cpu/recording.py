"""The records of a run, and how its state is saved and restored when their buffers are full."""

from __future__ import annotations

from typing import Any, NamedTuple

from snapbeam.solver.compilation import compiled, inlined
from snapbeam.solver.contact_force import contact_energy, felt_force
from snapbeam.solver.cpu.mode_lanes import modal_energy
from snapbeam.solver.cpu.state import IntegratorState, Rows, StepControl, variable_slot
from snapbeam.solver.cpu.step import Step, observe, prepare, take_step
from snapbeam.solver.cpu.sticking import held_for, hold
from snapbeam.solver.cpu.terms.further_contact_events import any_touches
from snapbeam.solver.cpu.terms.step_across import taken_across
from snapbeam.solver.physics import tension_energy
from snapbeam.solver.step_control import ContactKinematics
from snapbeam.solver.terms import WORKS
from snapbeam.solver.terms.interface import add_potential_energy, no_external_work, works_so_far, write_loss

VALUES = 7 + len(WORKS)
"""Penetration, contact force, beam energy, contact energy, work, dissipation, loss in contact and works of the terms, of a
sample; the energies lost in circuits follow."""
MARKS, REALS = 24, 10
"""Number of integers and floats of a saved state."""
_TOGETHER = ContactKinematics(0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
_MOST_IN_CONTACT = 96
"""Steps of one contact whose ends are recorded."""
_works_so_far = works_so_far(tuple(WORKS))


class Outputs(NamedTuple):
    """The arrays that a recorded run writes to, until they are full."""

    times: Any
    """Instants to record, s, ascending."""
    at: Any
    """Times of the samples, s; not ordered within a step."""
    rows: Any
    """q about the first well, then p, shape (samples, 2 rows)."""
    values: Any
    """Shape (samples, VALUES)."""
    impacts: Any
    """Onset, duration, peak force and impulse of each impact, of several strikers which one too, shape (rows, 4 or 5);
    a row for each striker more than it takes to be full, since several may end with one step."""
    most_impacts: int
    """Impacts that make it full."""
    marks: Any
    """Instants recorded so far; impacts handed on before; samples of the present contact."""
    most: int
    """Instants that one step may hold."""
    in_contact: bool
    """True if the ends of steps in contact are recorded too."""


@inlined
def has_room(now, accumulators, outputs):
    """Return whether the buffers have room for the samples and the impact of another step."""
    rows = now.sample + outputs.most + 3 <= outputs.at.size
    return rows and accumulators.impacts - outputs.marks[1] < outputs.most_impacts


class _Instant(NamedTuple):
    """State at the time of a sample."""

    when: float
    """s."""
    q: int
    """Memory offset of the state."""
    p: int
    kinematics: ContactKinematics
    energy: float
    """Energy of the beam, J."""


class _Sums(NamedTuple):
    """Energies since the beginning of the run, J."""

    work: float
    dissipated: float
    lost: float
    works: Any
    """Work of the terms, a tuple."""
    within: float
    """1 with what a part of a step gave, 0 without."""


@inlined
def _sums(terms, accumulators):
    """Sums from a record of accumulators."""
    return _Sums(
        accumulators.work,
        accumulators.dissipated,
        accumulators.lost,
        _works_so_far(terms, accumulators, no_external_work(terms)),
        0.0,
    )


@inlined
def _sums_with(terms, accumulators, done):
    """The same with what a part of a step gave."""
    return _Sums(
        accumulators.work + done.work, accumulators.dissipated + done.dissipated + done.lost, accumulators.lost + done.lost,
        _works_so_far(terms, accumulators, done.external), 1.0,
    )  # fmt: skip


@inlined
def _write(memory, layout, well_sign, law, outputs, sample, instant, accumulators, sums):
    """One sample, about the first well."""
    size, kinematics = layout.size, instant.kinematics
    for row in range(size):
        outputs.rows[sample, row] = memory[instant.q + row]
        if well_sign < 0.0:
            outputs.rows[sample, row] += memory[layout.shift + row]
        outputs.rows[sample, size + row] = memory[instant.p + row]
    outputs.at[sample] = instant.when
    outputs.values[sample, 0] = kinematics.d
    outputs.values[sample, 1] = felt_force(law, kinematics.d, kinematics.dv)
    outputs.values[sample, 2] = instant.energy
    outputs.values[sample, 3] = contact_energy(law, kinematics.d)
    outputs.values[sample, 4] = sums.work
    outputs.values[sample, 5] = sums.dissipated
    outputs.values[sample, 6] = sums.lost
    for i in range(len(sums.works)):
        outputs.values[sample, 7 + i] = sums.works[i]
    write_loss(memory, layout.terms, accumulators, outputs.values, sample, VALUES, sums.within)


@compiled
def record_instants(memory, blocks, layout, stages, run, tip, now, step, accumulators, outputs):
    """Write down what happens at the instants inside a step; returns how many samples there are then."""
    clock, sample, size = run.clock, now.sample, layout.size
    times, done = outputs.times, outputs.marks[0]
    q2, p2 = run.spare, run.spare + size
    while done < times.size:
        if times[done] > (now.t + step.ticks) * clock.tick and now.t + step.ticks < clock.end:
            break
        part = min(max(0.0, times[done] - now.t * clock.tick), step.length)
        prepare(memory, layout, stages, run.tip.drive, part, variable_slot(run))
        short = Step(
            0, variable_slot(run), part, step.phase, step.touching, step.q, step.p, step.k,
            q2, p2, run.spare + 2 * size, step.r
        )  # fmt: skip
        here = take_step(memory, blocks, layout, stages, tip, short, True)
        here = taken_across(memory, blocks, layout, stages, run, tip, now.t, short, here, True)
        observed = observe(memory, layout, tip, step.phase + tip.drive.omega * part, q2, p2)
        energy = modal_energy(memory, layout, q2, p2) + tension_energy(layout.gamma, here.gq, here.qr)
        energy = add_potential_energy(memory, size, layout.terms, q2, energy)
        instant = _Instant(times[done], q2, p2, observed, energy)
        _write(
            memory,
            layout,
            now.well_sign,
            tip.law,
            outputs,
            sample,
            instant,
            accumulators,
            _sums_with(layout.terms, accumulators, here),
        )
        sample, done = sample + 1, done + 1
    outputs.marks[0] = done
    # the slot for steps of any length holds the present step again, if it was shortened
    if step.at == variable_slot(run):
        prepare(memory, layout, stages, run.tip.drive, step.length, step.at)
    return sample


@inlined
def record_held(memory, blocks, layout, run, tip, now, step, accumulators, outputs):
    """Record as :func:`record_instants`, for a step in which the tip carries a single mode."""
    clock, sample, size, done = run.clock, now.sample, layout.size, outputs.marks[0]
    times, q2, p2 = outputs.times, run.spare, run.spare + size
    while done < times.size:
        if times[done] > (now.t + step.ticks) * clock.tick and now.t + step.ticks < clock.end:
            break
        part = min(max(0.0, times[done] - now.t * clock.tick), step.length)
        here, _ = held_for(memory, blocks, layout, run, tip, step.phase, step.q, part)
        force, gq, qr = hold(
            memory, blocks, layout, tip, step.phase, part, step.q, q2, p2, run.spare + 2 * size
        )
        energy = modal_energy(memory, layout, q2, p2) + tension_energy(layout.gamma, gq, qr)
        energy = add_potential_energy(memory, size, layout.terms, q2, energy)
        instant = _Instant(times[done], q2, p2, _TOGETHER, energy)
        sums = _sums_with(layout.terms, accumulators, here)
        _write(memory, layout, now.well_sign, tip.law, outputs, sample, instant, accumulators, sums)
        outputs.values[sample, 1] = force
        sample, done = sample + 1, done + 1
    outputs.marks[0] = done
    return sample


@inlined
def record_inside_step(memory, layout, tip, now, short, here, when, observed, sample, accumulators, outputs):
    """Record the end of a trial step inside a step in contact; returns the number of samples."""
    if not outputs.in_contact:
        return sample
    energy = modal_energy(memory, layout, short.q1, short.p1) + tension_energy(layout.gamma, here.gq, here.qr)
    energy = add_potential_energy(memory, layout.size, layout.terms, short.q1, energy)
    instant = _Instant(when, short.q1, short.p1, observed, energy)
    _write(
        memory,
        layout,
        now.well_sign,
        tip.law,
        outputs,
        sample,
        instant,
        accumulators,
        _sums_with(layout.terms, accumulators, here),
    )
    return sample + 1


@inlined
def record_contact(memory, layout, run, tip, now, step, done, kinematics1, sample, accumulators, outputs):
    """Write down the end of a step in contact, of the first ones of each; returns how many samples there are."""
    others, now_touching = layout.others, accumulators.touching != 0
    if not outputs.in_contact or not any_touches(memory, others, step.touching or now_touching):
        return sample
    if not any_touches(memory, others, step.touching):
        outputs.marks[2] = 0
    when = (now.t + step.ticks) * run.clock.tick
    if outputs.marks[2] >= _MOST_IN_CONTACT and any_touches(memory, others, now_touching):
        return sample
    outputs.marks[2] += 1
    energy = modal_energy(memory, layout, step.q1, step.p1) + tension_energy(layout.gamma, done.gq, done.qr)
    energy = add_potential_energy(memory, layout.size, layout.terms, step.q1, energy)
    instant = _Instant(when, step.q1, step.p1, kinematics1, energy)
    _write(
        memory, layout, now.well_sign, tip.law, outputs, sample, instant, accumulators, _sums(layout.terms, accumulators)
    )  # fmt: skip
    return sample + 1


@compiled
def save_state(now, marks, reals):
    """Save the integrator state of a run to *marks* and *reals*."""
    rows, kinematics, control = now.rows, now.kinematics, now.control
    marks[0], marks[1], marks[2], marks[3] = now.t, now.sample, now.stored_states, now.status
    marks[4], marks[5], marks[6] = rows.q, rows.p, rows.k
    marks[7], marks[8], marks[9] = rows.q1, rows.p1, rows.k1
    marks[10] = int(control.touching)
    marks[11], marks[12], marks[13], marks[14] = (
        control.safe_gap,
        control.safe_center,
        control.energy_tick,
        control.steps_since_start,
    )
    reals[0], reals[1] = now.well_sign, now.stretch
    reals[2], reals[3], reals[4] = kinematics.w, kinematics.wv, kinematics.d
    reals[5], reals[6], reals[7] = kinematics.dv, kinematics.c, kinematics.cv


@compiled
def restore_state(marks, reals):
    """The state of a run that was saved."""
    rows = Rows(marks[4], marks[5], marks[6], marks[7], marks[8], marks[9])
    kinematics = ContactKinematics(reals[2], reals[3], reals[4], reals[5], reals[6], reals[7])
    control = StepControl(marks[10] != 0, marks[11], marks[12], marks[13], marks[14])
    return IntegratorState(
        marks[0], reals[0], reals[1], rows, kinematics, control, marks[1], marks[2], marks[3]
    )
