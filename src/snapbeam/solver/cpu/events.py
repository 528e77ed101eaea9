"""After a step of a run: was the contact met or left in it, and what is kept of it."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

from numba.extending import overload

from snapbeam.solver.compilation import INLINE_HERE, compiled, inlined
from snapbeam.solver.contact_force import (
    begins_with_jump,
    felt_force,
    force_break,
    jumps,
    scalar_function,
)
from snapbeam.solver.cpu.indentation import tip_at, unload
from snapbeam.solver.cpu.mode_lanes import (
    flow_coefficients,
    modal_energy,
    propagate_free,
    signals,
    speed_bound_with_terms,
    validity_horizon,
)
from snapbeam.solver.cpu.recording import record_contact, record_inside_step, record_instants
from snapbeam.solver.cpu.state import (
    IntegratorState,
    Rows,
    StepControl,
    sample_energy,
    sampling_slot,
    variable_slot,
)
from snapbeam.solver.cpu.step import (
    Step,
    observe,
    prepare,
    take_step,
    with_velocity_dependent,
)
from snapbeam.solver.cpu.terms.further_contact_events import (
    accumulate_further_contacts,
    corrections_of_onset,
    first_further_event,
    limit_safe_interval,
    observe_further_contacts,
    refine_further_onsets,
    store_further_contacts,
    update_further_contacts,
)
from snapbeam.solver.cpu.terms.step_across import mark_at_jump, taken_across
from snapbeam.solver.excitation import turned_motion
from snapbeam.solver.interpolation import (
    cubic,
    first_downcrossing,
    first_upcrossing,
    turning_point,
    update_extrema,
)
from snapbeam.solver.physics import sincos, tension_energy
from snapbeam.solver.registered_statistics import observe as observe_extras
from snapbeam.solver.simd import WIDTH, dot, fma, lanes_sum, load, store
from snapbeam.solver.step_control import (
    ContactKinematics,
    accumulate_displacement,
    close_impact,
    count_zero_crossings_in_step,
    first_contact_onset,
    refine_onset,
    safe_interval,
)
from snapbeam.solver.terms.interface import (
    accumulate_loss,
    accumulate_work,
    add_potential_energy,
    center_from_barrier,
    kinematics_from_barrier,
    may_hide_onset,
    relative_to_nearest_well,
    store_loss,
    wells_differ,
)
from snapbeam.util.status_codes import RunStatus

_PARTS = 24
"""Equal parts of a step, at whose ends the force is evaluated."""


# Instant of the greatest penetration of a contact, or of the greatest force if it depends on the rate too.


def locate_peak_force(
    memory: Any,
    blocks: Any,
    layout: Any,
    stages: Any,
    run: Any,
    tip: Any,
    now: Any,
    step: Any,
    kinematics1: Any,
    sample: Any,
    accumulators: Any,
    outputs: Any,
) -> Any:
    """The maximum penetration of a contact so far, or the maximum force under a law that loses energy.

    Returns that and how many samples there are: a moment inside the step is one where the run is recorded.
    """
    raise TypeError("locate_peak_force runs in compiled code only")


@inlined
def step_inside(step, run, length, size):
    """*step*, shortened to *length* and written to the spare rows: a trial step."""
    return Step(
        0, variable_slot(run), length, step.phase, step.touching, step.q, step.p, step.k,
        run.spare, run.spare + size, run.spare + 2 * size, step.r
    )  # fmt: skip


@inlined
def _deepest_point(
    memory, blocks, layout, stages, run, tip, now, step, kinematics1, sample, accumulators, outputs
):
    """The maximum penetration of a contact so far, its turning point within the step included.

    Returns that and how many samples there are: the turning point is one where the run is recorded.
    """
    kinematics, deepest = now.kinematics, max(accumulators.deepest, kinematics1.d)
    turn = (
        turning_point(kinematics.d, kinematics.dv, kinematics1.d, kinematics1.dv, step.length)
        if kinematics.dv > 0.0
        else -1.0
    )
    if (
        turn > 0.0
        and update_extrema(
            kinematics.d, deepest, kinematics.d, kinematics.dv, kinematics1.d, kinematics1.dv, step.length
        )[1]
        > deepest
    ):
        part, size = turn * step.length, layout.size
        prepare(memory, layout, stages, run.tip.drive, part, variable_slot(run))
        with_energy = None if outputs is None else True
        short = step_inside(step, run, part, size)
        here = take_step(memory, blocks, layout, stages, tip, short, with_energy)
        here = taken_across(memory, blocks, layout, stages, run, tip, now.t, short, here, with_energy)
        there = step.phase + tip.drive.omega * part
        observed = observe(memory, layout, tip, there, run.spare, run.spare + size)
        if outputs is not None:
            when = now.t * run.clock.tick + part
            sample = record_inside_step(
                memory, layout, tip, now, short, here, when, observed, sample, accumulators, outputs
            )
        deepest = max(deepest, observed.d)
    return deepest, sample


@inlined
def _greatest_force(
    memory, blocks, layout, stages, run, tip, now, step, kinematics1, sample, accumulators, outputs
):
    """The maximum force of a contact so far: located on the cubic through the step, then evaluated by a trial step."""
    kinematics, law = now.kinematics, tip.law
    greatest = max(
        accumulators.deepest,
        max(felt_force(law, kinematics.d, kinematics.dv), felt_force(law, kinematics1.d, kinematics1.dv)),
    )
    c0, c1, c2, c3 = cubic(kinematics.d, kinematics.dv, kinematics1.d, kinematics1.dv, step.length)
    best, at = greatest, 0.0
    for i in range(1, _PARTS):
        s = i / _PARTS
        d = c0 + s * (c1 + s * (c2 + s * c3))
        force = felt_force(law, d, (c1 + s * (2.0 * c2 + s * 3.0 * c3)) / step.length)
        if force > best:
            best, at = force, s
    if at > 0.0:
        part, size = at * step.length, layout.size
        prepare(memory, layout, stages, run.tip.drive, part, variable_slot(run))
        with_energy = None if outputs is None else True
        short = step_inside(step, run, part, size)
        here = take_step(memory, blocks, layout, stages, tip, short, with_energy)
        here = taken_across(memory, blocks, layout, stages, run, tip, now.t, short, here, with_energy)
        there = step.phase + tip.drive.omega * part
        observed = observe(memory, layout, tip, there, run.spare, run.spare + size)
        if outputs is not None:
            when = now.t * run.clock.tick + part
            sample = record_inside_step(
                memory, layout, tip, now, short, here, when, observed, sample, accumulators, outputs
            )
        greatest = max(greatest, felt_force(law, observed.d, observed.dv))
    return greatest, sample


@overload(locate_peak_force, jit_options=INLINE_HERE)
def _locate_peak_force(
    memory, blocks, layout, stages, run, tip, now, step, kinematics1, sample, accumulators, outputs
):
    law = tip.types[tip.fields.index("law")]
    chosen = _greatest_force if law.instance_class.owner.rate_dependent else _deepest_point

    def implementation(
        memory, blocks, layout, stages, run, tip, now, step, kinematics1, sample, accumulators, outputs
    ):
        return chosen(
            memory, blocks, layout, stages, run, tip, now, step, kinematics1, sample, accumulators, outputs
        )

    return implementation


# Samples inside a free step: penetration and centre between its ends.


@compiled
def sample_inside_step(memory, layout, tip, flow, subintervals, subinterval, step, with_center, scratch):
    """Sample a free step at the ends of its *subintervals*, each one exact linear flow.

    The tension's acceleration, known at both ends of the step, is taken as linear in between: exact
    enough for signals whose fastest mode the subintervals resolve.  Row i of ``scratch.inner_samples`` becomes the penetration, its
    rate, and, if *with_center*, the displacement of the centre from rest and its rate.
    """
    inner_samples, parts = scratch.inner_samples, scratch.parts
    q, p, k, k1 = step.q, step.p, step.k, step.k1
    propagate_free(
        memory, layout, layout.contact, flow, subintervals, subinterval, q, p, k, k1, with_center, parts
    )
    size, drive = layout.size, tip.drive
    contact0, contact1 = dot(memory, size, layout.contact, k), dot(memory, size, layout.contact, k1)
    center0, center1 = dot(memory, size, layout.center, k), dot(memory, size, layout.center, k1)
    turn_sine, turn_cosine = sincos(drive.omega * subinterval)
    sine, cosine = sincos(step.phase)
    w, rate, c, c_rate = signals(memory, layout, q, p)
    # kicks act at the ends of the subintervals, half a kick at the first; the rates there lack the remaining half
    for i in range(subintervals + 1):
        done, remaining = i / subintervals, 0.5 * subinterval
        if i == 0:
            remaining = 0.0
        else:
            at = 4 * WIDTH * (i - 1)
            w, rate = lanes_sum(load(parts, at)), lanes_sum(load(parts, at + WIDTH))
            if with_center:
                c, c_rate = lanes_sum(load(parts, at + 2 * WIDTH)), lanes_sum(load(parts, at + 3 * WIDTH))
        argument = step.phase + i * subinterval * drive.omega
        motion, velocity = turned_motion(drive, memory, argument, sine, cosine)
        inner_samples[i, 0] = tip.offset + motion - w
        inner_samples[i, 1] = velocity - rate - remaining * ((1.0 - done) * contact0 + done * contact1)
        inner_samples[i, 2] = c
        inner_samples[i, 3] = c_rate + remaining * ((1.0 - done) * center0 + done * center1)
        sine, cosine = sine * turn_cosine + cosine * turn_sine, cosine * turn_cosine - sine * turn_sine


# The part of a tick between the onset of a force that begins with a jump and the tick at which its contact begins.


def kick_at_onset(
    memory: Any, layout: Any, law: Any, p: Any, kinematics: Any, accumulators: Any, outputs: Any
) -> Any:
    """The kinematics of a contact that begins at a tick, once the velocities *p* have the impulse since its onset.

    The gap closed d/v before the tick (after it where d < 0), and the force that begins there with c v has the impulse
    c v d/v = c d by the tick; what is left out is of second order in that time.  A law without a jump changes nothing.
    """
    raise TypeError("kick_at_onset runs in compiled code only")


@overload(kick_at_onset, jit_options=INLINE_HERE)
def _kick_at_onset(memory, layout, law, p, kinematics, accumulators, outputs):
    owner = law.instance_class.owner
    if not begins_with_jump(owner):
        return lambda memory, layout, law, p, kinematics, accumulators, outputs: kinematics
    damping_coefficient = scalar_function(owner, "damping_coefficient")

    def implementation(memory, layout, law, p, kinematics, accumulators, outputs):
        size, contact = layout.size, layout.contact
        damping, rate = damping_coefficient(law, 0.0), kinematics.dv
        impulse, gained = damping * kinematics.d, dot(memory, size, contact, contact)
        for row in range(0, size, WIDTH):
            store(memory, p + row, fma(impulse, load(memory, contact + row), load(memory, p + row)))
        gained *= impulse
        work, lost = impulse * (kinematics.wv + rate), impulse * (rate - 0.5 * gained)
        accumulators.impulse += impulse
        accumulators.work += work
        accumulators.gross_work += abs(work)
        accumulators.lost += lost
        if outputs is not None:
            accumulators.dissipated += lost
        # the force at the onset is the maximum of an impact that the damper stops
        accumulators.deepest = max(accumulators.deepest, damping * rate)
        centre = impulse * dot(memory, size, layout.center, contact)
        return ContactKinematics(
            kinematics.w,
            kinematics.wv + gained,
            kinematics.d,
            rate - gained,
            kinematics.c,
            kinematics.cv + centre,
        )

    return implementation


_OK, _EARLY_STOP, _RUNNING = int(RunStatus.OK), int(RunStatus.EARLY_STOP), int(RunStatus.INTERRUPTED)
_LOCATIONS = 4
"""Newton steps in which the onset of a force that begins with a jump is located, at most."""
_DIVERGED, _STEP_LIMIT = int(RunStatus.DIVERGED), int(RunStatus.STEP_LIMIT)


class ContactEvent(NamedTuple):
    """Onset or release of contact in a step: end of the shortened step, and the samples inside it."""

    event: bool
    event_ticks: int
    """Ticks; 0: the contact begins with the step."""
    onset_time: float
    """Seconds into the step at which the gap closes; negative: it does not."""
    safe_gap: int
    safe_center: int
    subintervals: int
    subinterval: float


@inlined
def shortened_step(step, run, ticks, length):
    """*step*, of another length and prepared in the slot for those."""
    return Step(
        ticks, variable_slot(run), length, step.phase, step.touching, step.q, step.p, step.k,
        step.q1, step.p1, step.k1, step.r
    )  # fmt: skip


@inlined
def detect_contact_event(memory, layout, run, now, tip, step, kinematics1, scratch):
    """Detect an onset or release of contact within a step, and the time at which the step must end."""
    kinematics, clock, tick = now.kinematics, run.clock, run.clock.tick
    safe_gap, safe_center = now.control.safe_gap, now.control.safe_center
    event, event_ticks, onset_time, subintervals, subinterval = False, step.ticks, -1.0, 0, 0.0
    after = now.t + step.ticks
    if step.touching:
        if kinematics1.d <= 0.0:
            event = True
            if kinematics.d > 0.0:
                fall = first_downcrossing(
                    kinematics.d, kinematics.dv, kinematics1.d, kinematics1.dv, step.length
                )
                event_ticks = max(1, int(fall * step.ticks))
        fraction = force_break(
            tip.law, kinematics.d, kinematics.dv, kinematics1.d, kinematics1.dv, step.length
        )
        if fraction >= 0.0 and fraction * step.ticks + 1.0 < event_ticks:
            # the force is not smooth there, though the contact goes on
            event, event_ticks = False, int(fraction * step.ticks) + 1
        return ContactEvent(event, event_ticks, onset_time, safe_gap, safe_center, subintervals, subinterval)
    size, known = layout.size, validity_horizon(layout, run.step_time)
    may_hide = may_hide_onset(layout.terms) or layout.others is not None
    if after > safe_gap:
        bound = speed_bound_with_terms(
            memory, layout, tip.drive, layout.contact, step.q, step.p, step.k, known
        )
        push = dot(memory, size, layout.contact, step.k)
        safe_gap = now.t + int(safe_interval(-kinematics.d, bound, run.tip_speed, push, known) / tick)
    if after > safe_center:
        bound = speed_bound_with_terms(
            memory, layout, tip.drive, layout.center, step.q, step.p, step.k, known
        )
        push = dot(memory, size, layout.center, step.k)
        safe_center = now.t + int(
            safe_interval(abs(center_from_barrier(layout.terms, kinematics.c)), bound, 0.0, push, known)
            / tick
        )
    safe_gap = limit_safe_interval(memory, layout.others, now.t, safe_gap)
    safe_center = limit_safe_interval(memory, layout.others, now.t, safe_center)
    if may_hide and max(kinematics.d, kinematics1.d) > 0.0:
        # the accelerations changed more than was foreseen
        safe_gap = now.t
    if after > min(safe_gap, safe_center):
        sampling, subintervals = sampling_slot(run), run.step_subintervals
        if step.ticks != clock.step:
            sampling += 4 * size
            subintervals = max(2, math.ceil(step.length / run.shortest_subinterval))
            flow_coefficients(memory, layout, step.length / subintervals, sampling)
        subinterval = step.length / subintervals
        free = with_velocity_dependent(memory, layout, run.spare, step)
        sample_inside_step(
            memory, layout, tip, sampling, subintervals, subinterval, free, after > safe_center, scratch
        )
        if after > safe_gap:
            onset_time = first_contact_onset(scratch.inner_samples, subintervals, subinterval)
    if may_hide and onset_time < 0.0 and kinematics1.d > 0.0 and kinematics.d <= 0.0:
        # the step ended in the contact, unseen by the samples
        onset_time = (
            first_upcrossing(kinematics.d, kinematics.dv, kinematics1.d, kinematics1.dv, step.length)
            * step.length
        )
    if onset_time >= 0.0:
        event, event_ticks = True, min(step.ticks, int(onset_time / tick))
    return ContactEvent(event, event_ticks, onset_time, safe_gap, safe_center, subintervals, subinterval)


@inlined
def swap_rows(rows):
    """The end of a step becomes the beginning of the next."""
    return Rows(rows.q1, rows.p1, rows.k1, rows.q, rows.p, rows.k)


@inlined
def monitor_energy(
    memory, layout, run, now, t, state, kinematics1, control, event, status, accumulators, kernel_input
):
    """Add up the energy of the modes where some count as high, and end the run where its class is certain.

    *state* contains the locations of q, p and k, and the values of g.q and q.Gq.  Every sixteenth step the energy decides
    whether early termination is possible.  Returns the step control and the status.
    """
    clock, steps_since_start, last = run.clock, control.steps_since_start, control.energy_tick
    q, p, k, gq, qr = state
    decides = clock.decide_energy > -math.inf and (steps_since_start & 15) == 0
    decides = (
        decides
        and not (event or control.touching)
        and now.well_sign < 0.0
        and kinematics1.w > clock.decide_reach
    )
    decides = decides and center_from_barrier(layout.terms, kinematics1.c) > 0.0
    linear = 0.0
    if run.high:
        pressed = control.touching and not event
        span, last = (t - last) * clock.tick, t
        linear = sample_energy(
            memory, layout, run, now.well_sign, (q, p, k), kinematics1, pressed, accumulators, span
        )
    elif decides:
        near = relative_to_nearest_well(memory, layout.size, layout.terms, now.well_sign, run.spare, q)
        linear = modal_energy(memory, layout, near, p)
    if decides:
        energy = linear + tension_energy(layout.gamma, gq, qr)
        if wells_differ(layout.terms):
            energy = modal_energy(memory, layout, q, p) + tension_energy(layout.gamma, gq, qr)
        energy = add_potential_energy(memory, layout.size, layout.terms, q, energy)
        if energy < clock.decide_energy:
            status = _EARLY_STOP
    if clock.decide_crossings >= 0 and accumulators.zero_crossings_last_quarter > clock.decide_crossings:
        status = _EARLY_STOP
    if status == _RUNNING and accumulators.steps >= clock.max_steps:
        status = _STEP_LIMIT
    return StepControl(
        control.touching, control.safe_gap, control.safe_center, last, steps_since_start
    ), status


@inlined
def accept_step(
    memory, blocks, workspace, run, now, step, done, scratch, accumulators, kernel_input, outputs
):
    """The state of a run after a step, shortened to an onset or release inside it, with its statistics.

    Returns that and the step that was taken.  *outputs* are what is recorded, or None.
    """
    layout, stages, clock, tick = workspace.layout, workspace.stages, run.clock, run.clock.tick
    with_energy = None if outputs is None else True
    tip = tip_at(memory, layout, run, now.well_sign, now.rows.q)
    rest_contact, rest_center = now.well_sign * run.rest_contact, now.well_sign * run.rest_center
    t, kinematics, touching = now.t, now.kinematics, now.control.touching
    omega = tip.drive.omega
    done = taken_across(memory, blocks, layout, stages, run, tip, t, step, done, with_energy)
    observed = observe(memory, layout, tip, step.phase + omega * step.length, step.q1, step.p1)
    if not math.isfinite(observed.d + observed.dv):
        return (
            IntegratorState(
                t,
                now.well_sign,
                now.stretch,
                now.rows,
                kinematics,
                now.control,
                now.sample,
                now.stored_states,
                _DIVERGED,
            ),
            step,
        )
    there = step.phase + omega * step.length
    observe_further_contacts(memory, layout.size, layout.others, tip.drive, there, step.q1, step.p1)
    contact_event = detect_contact_event(memory, layout, run, now, tip, step, observed, scratch)
    edge = first_further_event(
        memory, layout, layout.others, sampling_slot(run), run, t, tip.drive, step, scratch
    )
    if edge < contact_event.event_ticks:
        contact_event = ContactEvent(
            False,
            edge,
            -1.0,
            contact_event.safe_gap,
            contact_event.safe_center,
            contact_event.subintervals,
            contact_event.subinterval,
        )
    if contact_event.event_ticks < 1:
        if contact_event.event:
            accumulators.touching, accumulators.onset = 1, t
            kinematics = kick_at_onset(memory, layout, tip.law, step.p, kinematics, accumulators, outputs)
        update_further_contacts(
            memory, layout.size, layout.others, step.q, step.p, 0, t, 0.0, tick, accumulators, outputs
        )
        status = _STEP_LIMIT if accumulators.steps >= clock.max_steps else _RUNNING
        control = StepControl(
            touching or contact_event.event,
            contact_event.safe_gap,
            contact_event.safe_center,
            now.control.energy_tick,
            now.control.steps_since_start,
        )
        return IntegratorState(
            t,
            now.well_sign,
            now.stretch,
            now.rows,
            kinematics,
            control,
            now.sample,
            now.stored_states,
            status,
        ), step
    whole, event_ticks = step.ticks, contact_event.event_ticks
    corrections = 0 if touching or not contact_event.event else _LOCATIONS if jumps(tip.law) else 1
    further_corrections = 0
    if edge < whole and not contact_event.event:
        further_corrections = corrections_of_onset(layout.others, _LOCATIONS)
    while event_ticks != step.ticks:
        step = shortened_step(step, run, event_ticks, event_ticks * tick)
        prepare(memory, layout, stages, run.tip.drive, step.length, step.at)
        done = take_step(memory, blocks, layout, stages, tip, step, with_energy)
        done = taken_across(memory, blocks, layout, stages, run, tip, t, step, done, with_energy)
        there = step.phase + omega * step.length
        observed = observe(memory, layout, tip, there, step.q1, step.p1)
        observe_further_contacts(memory, layout.size, layout.others, tip.drive, there, step.q1, step.p1)
        smallest_correction = (clock.step >> clock.max_halvings) * tick
        if corrections > 0:
            corrections -= 1
            event_ticks = refine_onset(
                clock, event_ticks, whole, observed, 0.5 * tick if jumps(tip.law) else smallest_correction
            )
        event_ticks = refine_further_onsets(
            memory,
            layout.others,
            clock,
            contact_event.event_ticks,
            event_ticks,
            whole,
            smallest_correction,
            further_corrections,
        )
        further_corrections -= 1
    store_further_contacts(memory, layout.others)
    store_loss(memory, layout.terms)
    kinematics1 = ContactKinematics(
        observed.w + rest_contact, observed.wv, observed.d, observed.dv, observed.c + rest_center, observed.cv
    )
    sample = now.sample
    if outputs is not None:
        sample = record_instants(memory, blocks, layout, stages, run, tip, now, step, accumulators, outputs)

    # statistics of the step
    if touching:
        accumulators.deepest = mark_at_jump(
            memory, blocks, layout, stages, run, tip, t, step, accumulators.deepest
        )
        accumulators.deepest, sample = locate_peak_force(
            memory, blocks, layout, stages, run, tip, now, step, kinematics1, sample, accumulators, outputs
        )
        accumulators.impulse += done.impulse
        accumulators.work += done.work
        accumulators.gross_work += done.gross
        accumulators.lost += done.lost
    accumulate_further_contacts(memory, layout.others, touching, done, accumulators)
    accumulate_work(layout.terms, accumulators, done.external)
    late = min(max((t + step.ticks - clock.last_quarter) / step.ticks, 0.0), 1.0)
    accumulate_loss(memory, layout.size, layout.terms, accumulators, step.q1, step.p1, late)
    if outputs is not None:
        accumulators.dissipated += done.dissipated + done.lost
    accumulate_displacement(accumulators, kinematics, kinematics1, step.length)
    if touching or t + step.ticks > contact_event.safe_center:
        count_zero_crossings_in_step(
            accumulators, clock, t, step.length, kinematics_from_barrier(layout.terms, kinematics), kinematics_from_barrier(layout.terms, kinematics1),
            scratch.inner_samples, center_from_barrier(layout.terms, rest_center), contact_event.subintervals, contact_event.subinterval,
        )  # fmt: skip
    observe_extras(
        kernel_input.extras, accumulators, t * tick, step.length, kinematics, kinematics1, touching
    )

    # accept
    t += step.ticks
    status = _RUNNING if t < clock.end else _OK
    safe_gap, safe_center = contact_event.safe_gap, contact_event.safe_center
    if contact_event.event:
        safe_gap, safe_center = t, t
        if touching:
            if outputs is None:
                close_impact(accumulators, None, 0, tip.law, t, tick)
            else:
                close_impact(accumulators, outputs.impacts, outputs.marks[1], tip.law, t, tick)
            kinematics1 = ContactKinematics(
                kinematics1.w,
                kinematics1.wv,
                min(kinematics1.d, 0.0),
                kinematics1.dv,
                kinematics1.c,
                kinematics1.cv,
            )
        else:
            accumulators.touching, accumulators.onset = 1, t
            kinematics1 = kick_at_onset(memory, layout, tip.law, step.p1, kinematics1, accumulators, outputs)
    elif touching:
        kinematics1 = unload(memory, layout, tip.law, step.q1, kinematics1, accumulators, outputs)
        tip = tip_at(memory, layout, run, now.well_sign, step.q1)
    update_further_contacts(
        memory, layout.size, layout.others, step.q1, step.p1, contact_event.event_ticks, t, step.length, tick, accumulators, outputs
    )  # fmt: skip
    touching = touching != contact_event.event
    control = StepControl(
        touching, safe_gap, safe_center, now.control.energy_tick, now.control.steps_since_start
    )
    state = step.q1, step.p1, step.k1, done.gq, done.qr
    control, status = monitor_energy(
        memory,
        layout,
        run,
        now,
        t,
        state,
        kinematics1,
        control,
        contact_event.event,
        status,
        accumulators,
        kernel_input,
    )
    if outputs is not None:
        sample = record_contact(
            memory, layout, run, tip, now, step, done, kinematics1, sample, accumulators, outputs
        )
    stretch = 2.0 * done.gq + done.qr
    return (
        IntegratorState(
            t,
            now.well_sign,
            stretch,
            swap_rows(now.rows),
            kinematics1,
            control,
            sample,
            now.stored_states,
            status,
        ),
        step,
    )
