"""Integration on the CPU: two runs at a time, each with steps that follow from its own contacts.

A step lasts the flight step divided by a power of two.  In free flight this is the flight step itself, halved while the
beam is stretched far beyond its wells.  While a bound on the speed of the gap excludes a contact, nothing else is done;
near the tip the motion is sampled inside each step, with a resolution finer than the fastest mode, and a step in which a
contact begins is shortened to end at the onset.  In contact, steps grow from the onset and shrink towards the release,
which is located too, so that onset and release of the force fall between steps.  Time is an integer number of ticks; the
argument of the drive follows from that integer alone.

:func:`propose_step` determines the length of a step, :mod:`snapbeam.solver.cpu.step` takes it, and
:mod:`snapbeam.solver.cpu.events` locates contacts in it and accepts it.

Each kick depends on the sums of the kick before it, so a single trajectory leaves the processor idle for most of the
time.  Two trajectories are therefore integrated together, a step of each at a time; when one ends, the next run takes
its place.  They share nothing but the structure: results do not depend on batch, order or threads.
"""

from __future__ import annotations

from typing import Any, NamedTuple

from snapbeam.solver.compilation import compiled, inlined
from snapbeam.solver.contact_force import released_at
from snapbeam.solver.cpu.contact_dispatch import accept_step_by_law
from snapbeam.solver.cpu.indentation import tip_at
from snapbeam.solver.cpu.recording import has_room, restore_state, save_state
from snapbeam.solver.cpu.state import (
    IntegratorState,
    StepControl,
    Workspace,
    begin,
    change_energy_origin,
    change_origin,
    close_energy,
    finish,
    phase_at,
    restart_from_state,
    run_of,
    variable_slot,
)
from snapbeam.solver.cpu.step import Step, nothing_done, prepare, take_step, take_two_steps
from snapbeam.solver.cpu.terms.discontinuities import up_to_discontinuity
from snapbeam.solver.cpu.terms.further_contact_events import (
    close_further_contacts,
    further_contacts_halvings,
    store_contact_states,
)
from snapbeam.solver.cpu.terms.further_contacts import evaluate_contacts, mirror_further_contacts
from snapbeam.solver.step_control import contact_halvings, flight_halvings, time_beyond
from snapbeam.solver.terms.interface import has_crossed, update_forces
from snapbeam.util.status_codes import RunStatus

_RUNNING = int(RunStatus.INTERRUPTED)
_NO_STEP = Step(0, 0, 0.0, 0.0, False, 0, 0, 0, 0, 0, 0, 0)


class KernelOutput(NamedTuple):
    """The output arrays of the kernels."""

    accumulators_of_runs: Any
    """A record a run."""
    states: Any
    """Output states, q and p about the well at hand, shape (runs, output states, 2 rows); none if of length 0."""
    contacts: Any
    """Current well, and ticks since contact onset of each striker (-1: apart), shape (runs, output states, 1 + strikers)."""
    stop_flag: Any
    """Stop flag: the integration stops if it is not 0."""


@inlined
def propose_step(memory, blocks, workspace, run, now, accumulators):
    """The next step of a run, and where it stands: about the other well, if it has crossed over."""
    layout, clock, well_sign, stretch, t = workspace.layout, run.clock, now.well_sign, now.stretch, now.t
    rows, kinematics, control, energy_tick = now.rows, now.kinematics, now.control, now.control.energy_tick
    r = layout.work + 9 * layout.size
    crossed = kinematics.c * (well_sign * run.rest_center) < 0.0
    if layout.stretch > 0.0 and has_crossed(layout.terms, kinematics.c, well_sign, crossed):
        there = phase_at(run, t)
        update_forces(memory, layout.size, layout.terms, run.tip.drive, there, rows.q)
        evaluate_contacts(memory, layout.size, layout.others, run.tip.drive, there, rows.q, 0.0, False)
        mirror_further_contacts(memory, layout.others, -well_sign)
        if run.high:
            close_energy(memory, layout, run, now, accumulators)
            energy_tick = t
        stretch = change_origin(memory, blocks, layout, well_sign, rows.q, rows.k, r)
        if run.high:
            beyond = time_beyond(t * clock.tick, accumulators.last_zero_crossing, run.step_time)
            change_energy_origin(memory, layout, run, now, accumulators, beyond)
        well_sign = -well_sign
    accumulators.steps += 1
    level = flight_halvings(clock, stretch, layout.stretch)
    if control.touching:
        left = released_at(run.tip.law, kinematics.d, kinematics.dv)
        level = max(
            level, contact_halvings(clock, (t - accumulators.onset) * clock.tick, left, kinematics.dv)
        )
    level = further_contacts_halvings(memory, layout.others, clock, t, control.touching, level)
    ticks, at = clock.step >> level, run.coefficients + level * run.slot
    # up to the next state that is handed out, to a jump of the drive's velocity, or to the end
    limit = min((now.stored_states + 1) * clock.output_interval, clock.end)
    limit = up_to_discontinuity(run.tip.drive, run.phase, clock.period, t, limit)
    if t + ticks > limit:
        ticks, at = limit - t, variable_slot(run)
        prepare(memory, layout, workspace.stages, run.tip.drive, ticks * clock.tick, at)
    length, phase = ticks * clock.tick, phase_at(run, t)
    step = Step(
        ticks, at, length, phase, control.touching, rows.q, rows.p, rows.k, rows.q1, rows.p1, rows.k1, r
    )
    return IntegratorState(
        t,
        well_sign,
        stretch,
        rows,
        kinematics,
        _with_one_more_step(control, energy_tick),
        now.sample,
        now.stored_states,
        now.status,
    ), step


@inlined
def _with_one_more_step(control, energy_tick):
    """One step more, and the tick at which the energy was last evaluated."""
    return StepControl(
        control.touching,
        control.safe_gap,
        control.safe_center,
        energy_tick,
        control.steps_since_start + 1,
    )


@inlined
def store_state(memory, blocks, layout, run, now, accumulators, i, kernel_output):
    """Keep the state of a run that has reached an output time, and begin again from it alone."""
    if kernel_output.states.shape[1] == 0 or now.t < min(
        (now.stored_states + 1) * run.clock.output_interval, run.clock.end
    ):
        return now
    size, rows, stored = layout.size, now.rows, now.stored_states
    for row in range(size):
        kernel_output.states[i, stored, row] = memory[rows.q + row]
        kernel_output.states[i, stored, size + row] = memory[rows.p + row]
    kernel_output.contacts[i, stored, 0] = int(now.well_sign)
    kernel_output.contacts[i, stored, 1] = now.t - accumulators.onset if now.control.touching else -1
    store_contact_states(memory, layout.others, now.t, kernel_output.contacts[i, stored])
    if now.status != _RUNNING:
        return now
    if run.high:
        close_energy(memory, layout, run, now, accumulators)
    again, _ = restart_from_state(
        memory, blocks, layout, run, now.t, now.well_sign, rows, now.control.touching, stored + 1, now.sample
    )
    return again


@compiled
def integrate_ensemble(memory, blocks, layouts, stages, kernel_input, which, scratch, kernel_output):
    """Integrate the runs *which*, two at a time; *memory* and *scratch* belong to the caller's thread.

    *layouts* are two places in memory that share the rows of the structure.
    """
    workspace_a, workspace_b = Workspace(layouts[0], stages), Workspace(layouts[1], stages)
    accumulators_of_runs, goes_on = kernel_output.accumulators_of_runs, kernel_output.states.shape[1] > 0
    live_a, live_b, following = True, False, 1
    i_a = which[0]
    i_b = i_a
    accumulators_a = accumulators_of_runs[i_a]
    accumulators_b = accumulators_a
    run_a, now_a = begin(memory, blocks, workspace_a, kernel_input, i_a, accumulators_a)
    run_b, now_b = run_a, now_a
    step_a, step_b = _NO_STEP, _NO_STEP
    done_a, done_b = nothing_done(layouts[0]), nothing_done(layouts[1])
    while live_a or live_b or following < which.size:
        if kernel_output.stop_flag[0] != 0:
            break
        if not live_a and following < which.size:
            i_a = which[following]
            accumulators_a = accumulators_of_runs[i_a]
            run_a, now_a = begin(memory, blocks, workspace_a, kernel_input, i_a, accumulators_a)
            live_a, following = True, following + 1
        if not live_b and following < which.size:
            i_b = which[following]
            accumulators_b = accumulators_of_runs[i_b]
            run_b, now_b = begin(memory, blocks, workspace_b, kernel_input, i_b, accumulators_b)
            live_b, following = True, following + 1
        if live_a:
            now_a, step_a = propose_step(memory, blocks, workspace_a, run_a, now_a, accumulators_a)
        if live_b:
            now_b, step_b = propose_step(memory, blocks, workspace_b, run_b, now_b, accumulators_b)
        tip_a = tip_at(memory, layouts[0], run_a, now_a.well_sign, now_a.rows.q)
        tip_b = tip_at(memory, layouts[1], run_b, now_b.well_sign, now_b.rows.q)
        if live_a and live_b:
            done_a, done_b = take_two_steps(
                memory, blocks, stages, layouts[0], tip_a, step_a, layouts[1], tip_b, step_b
            )
        elif live_a:
            done_a = take_step(memory, blocks, layouts[0], stages, tip_a, step_a, None)
        else:
            done_b = take_step(memory, blocks, layouts[1], stages, tip_b, step_b, None)
        if live_a:
            now_a, _ = accept_step_by_law(
                memory,
                blocks,
                workspace_a,
                run_a,
                now_a,
                step_a,
                done_a,
                scratch,
                accumulators_a,
                kernel_input,
                None,
            )
            now_a = store_state(memory, blocks, layouts[0], run_a, now_a, accumulators_a, i_a, kernel_output)
            if now_a.status != _RUNNING:
                if not goes_on:
                    close_further_contacts(
                        memory, layouts[0].others, accumulators_a, None, now_a.t, run_a.clock.tick
                    )
                finish(memory, blocks, layouts[0], run_a, now_a, accumulators_a, None, 0, goes_on)
                live_a = False
        if live_b:
            now_b, _ = accept_step_by_law(
                memory,
                blocks,
                workspace_b,
                run_b,
                now_b,
                step_b,
                done_b,
                scratch,
                accumulators_b,
                kernel_input,
                None,
            )
            now_b = store_state(memory, blocks, layouts[1], run_b, now_b, accumulators_b, i_b, kernel_output)
            if now_b.status != _RUNNING:
                if not goes_on:
                    close_further_contacts(
                        memory, layouts[1].others, accumulators_b, None, now_b.t, run_b.clock.tick
                    )
                finish(memory, blocks, layouts[1], run_b, now_b, accumulators_b, None, 0, goes_on)
                live_b = False
    if live_a:
        accumulators_a.time, accumulators_a.status = now_a.t, _RUNNING
    if live_b:
        accumulators_b.time, accumulators_b.status = now_b.t, _RUNNING


# A single run that is recorded: in slices, so that it can be observed, stopped and emptied.


@compiled
def integrate_recorded(
    memory, blocks, layout, stages, kernel_input, scratch, accumulators, outputs, saved_state, budget
):
    """Integrate the first run until it ends, *outputs* are full or *budget* steps are taken.

    *saved_state* is a pair of arrays in which the run is saved; the first integer there, if negative, says that
    it has not begun.
    """
    workspace, (marks, reals) = Workspace(layout, stages), saved_state
    if marks[0] < 0:
        run, now = begin(memory, blocks, workspace, kernel_input, 0, accumulators)
    else:
        now = restore_state(marks, reals)
        run = run_of(memory, layout, stages, kernel_input, 0)
    left = budget
    while now.status == _RUNNING and left > 0 and has_room(now, accumulators, outputs):
        left -= 1
        now, step = propose_step(memory, blocks, workspace, run, now, accumulators)
        tip = tip_at(memory, layout, run, now.well_sign, now.rows.q)
        done = take_step(memory, blocks, layout, stages, tip, step, True)
        now, _ = accept_step_by_law(
            memory, blocks, workspace, run, now, step, done, scratch, accumulators, kernel_input, outputs
        )
    if now.status != _RUNNING:
        close_further_contacts(memory, layout.others, accumulators, outputs, now.t, run.clock.tick)
        finish(memory, blocks, layout, run, now, accumulators, outputs.impacts, outputs.marks[1], False)
    accumulators.time, accumulators.status, accumulators.samples = now.t, now.status, now.sample
    save_state(now, marks, reals)
