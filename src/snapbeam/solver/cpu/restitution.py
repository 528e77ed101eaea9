"""After a step of a run under Newton's law of impact: hits located, chatter that ends in sticking, release.

One mode only.  A hit lasts no time: the relative velocity changes its sign and is multiplied by e.  Hits that follow
each other ever faster (complete chatter) end in sticking: once the beam would leave the tip by less than can
be resolved, it is carried along, until the force that this takes would have to pull.  What comes after does not depend on
when exactly the chatter ended, since a beam that is carried forgets how it arrived.

Hits and releases are located on the trajectory itself, to the last bits, between two ticks; from there a free step
of less than a tick leads to the next one.
"""

from __future__ import annotations

import math

from snapbeam.solver.compilation import compiled, inlined
from snapbeam.solver.cpu.events import detect_contact_event, monitor_energy, shortened_step, swap_rows
from snapbeam.solver.cpu.recording import record_held, record_instants
from snapbeam.solver.cpu.state import IntegratorState, StepControl, phase_at, sampling_slot, variable_slot
from snapbeam.solver.cpu.step import Step, observe, prepare, take_step
from snapbeam.solver.cpu.sticking import PANELS, constraint_force, held_for, hold
from snapbeam.solver.cpu.terms.discontinuities import up_to_discontinuity
from snapbeam.solver.cpu.terms.further_contact_events import (
    accumulate_further_contacts,
    add_stored_contacts,
    any_touches,
    first_further_event,
    observe_further_contacts,
    refine_further_onsets,
    restart_further_contacts,
    store_further_contacts,
    update_further_contacts,
)
from snapbeam.solver.cpu.terms.step_across import in_succession
from snapbeam.solver.excitation import drive_rate, tip_about_well
from snapbeam.solver.interpolation import cubic, first_upcrossing, root
from snapbeam.solver.registered_statistics import observe as observe_extras
from snapbeam.solver.step_control import (
    ContactKinematics,
    accumulate_displacement,
    close_impact,
    contact_halvings,
    count_zero_crossings_in_step,
)
from snapbeam.solver.terms.interface import (
    accumulate_loss,
    accumulate_work,
    add_stored_loss,
    center_from_barrier,
    kinematics_from_barrier,
    store_loss,
)
from snapbeam.util.status_codes import RunStatus

_LOCATIONS = 24
"""Newton steps in which a hit is located, at most."""
_NOISE = 1e-12
"""Relative velocities below this multiple of the tip's speed are rounding."""
_SOON = 0.05
"""Maximum remaining duration of a chatter that is completed at once, over the shortest period."""


# A step in which the tip carries a single mode along, up to the release.


_OK, _RUNNING, _DIVERGED = int(RunStatus.OK), int(RunStatus.INTERRUPTED), int(RunStatus.DIVERGED)
_STEP_LIMIT = int(RunStatus.STEP_LIMIT)
_BISECTIONS = 60


@inlined
def _release_between(memory, blocks, layout, run, tip, phase, source, low, high):
    """Time of zero constraint force between *low* (pushing) and *high* (pulling), s after *phase*, by bisection."""
    for _ in range(_BISECTIONS):
        middle = 0.5 * (low + high)
        if middle <= low or middle >= high:
            break
        if constraint_force(memory, blocks, layout, run, tip, phase, middle, source) < 0.0:
            high = middle
        else:
            low = middle
    return low


@compiled
def _release(memory, blocks, layout, run, tip, phase, source, length):
    """Time of the first change of the force to tension within *length*, s; negative if there is none.

    The force is evaluated in *PANELS* panels; where it dips between them, its minimum is located.
    """
    subinterval = length / PANELS
    before = force = constraint_force(memory, blocks, layout, run, tip, phase, 0.0, source)
    if force < 0.0:
        return 0.0
    for i in range(1, PANELS + 1):
        after = constraint_force(memory, blocks, layout, run, tip, phase, i * subinterval, source)
        if after < 0.0:
            return _release_between(
                memory, blocks, layout, run, tip, phase, source, (i - 1) * subinterval, i * subinterval
            )
        if i > 1 and force < before and force <= after:
            # the minimum of the parabola through the three
            bend = before - 2.0 * force + after
            if bend > 0.0:
                at = (i - 1 + 0.5 * (before - after) / bend) * subinterval
                if constraint_force(memory, blocks, layout, run, tip, phase, at, source) < 0.0:
                    return _release_between(
                        memory, blocks, layout, run, tip, phase, source, (i - 2) * subinterval, at
                    )
        before, force = force, after
    return -1.0


@inlined
def _held_step(step, ticks, length):
    """A step of another length in which the tip carries the beam."""
    return Step(
        ticks, step.at, length, step.phase, True, step.q, step.p, step.k, step.q1, step.p1, step.k1, step.r
    )


@inlined
def _held_to(memory, blocks, layout, tip, step):
    """The phase at the end of a step in which the tip carries the beam, g.q and q.Gq; further contacts are observed."""
    there = step.phase + tip.drive.omega * step.length
    _, gq, qr = hold(memory, blocks, layout, tip, step.phase, step.length, step.q, step.q1, step.p1, step.k1)
    observe_further_contacts(memory, layout.size, layout.others, tip.drive, there, step.q1, step.p1)
    return there, gq, qr


@inlined
def _up_to_further_event(memory, blocks, layout, others, run, tip, t, step, scratch):
    """Ticks within a carried step to the first onset or release of another striker: as detected, and as located."""
    if others is None:
        return step.ticks, step.ticks
    clock, whole = run.clock, step.ticks
    _held_to(memory, blocks, layout, tip, step)
    edge = first_further_event(memory, layout, others, sampling_slot(run), run, t, tip.drive, step, scratch)
    if edge < 1 or edge == whole:
        return edge, edge
    _held_to(memory, blocks, layout, tip, _held_step(step, edge, edge * clock.tick))
    smallest_correction = (clock.step >> clock.max_halvings) * clock.tick
    return edge, refine_further_onsets(memory, others, clock, edge, edge, whole, smallest_correction, 1)


@inlined
def _turned(memory, layout, run, now, accumulators, outputs):
    """State of a run if a contact of another striker begins or ends as a step begins: nothing has moved."""
    clock, t = run.clock, now.t
    update_further_contacts(
        memory,
        layout.size,
        layout.others,
        now.rows.q,
        now.rows.p,
        0,
        t,
        0.0,
        clock.tick,
        accumulators,
        outputs,
    )
    status = _STEP_LIMIT if accumulators.steps >= clock.max_steps else _RUNNING
    return IntegratorState(
        t, now.well_sign, now.stretch, now.rows, now.kinematics, now.control, now.sample, now.stored_states, status
    )  # fmt: skip


@inlined
def _account_for_surroundings(
    memory, layout, run, t, step, p, edge, done, touching, accumulators, outputs, jumped
):
    """Enter works and further contacts of a step up to tick *t* in the statistics; p is the row of the velocities there.

    *jumped*: the velocity did not follow from the step alone.
    """
    size, others, clock, drive = layout.size, layout.others, run.clock, run.tip.drive
    accumulate_further_contacts(memory, others, touching, done, accumulators)
    accumulate_work(layout.terms, accumulators, done.external)
    late = min(max((t - clock.last_quarter) / step.ticks, 0.0), 1.0)
    accumulate_loss(memory, size, layout.terms, accumulators, p - size, p, late)
    update_further_contacts(
        memory, size, others, p - size, p, edge, t, step.length, clock.tick, accumulators, outputs
    )
    if jumped:
        restart_further_contacts(memory, size, others, drive, phase_at(run, t), t, p - size)


@inlined
def _further_step(memory, blocks, workspace, run, tip, rest, done):
    """Take the *rest* of a tick after a hit or a release; returns its results, and those of the whole step."""
    layout, stages = workspace.layout, workspace.stages
    prepare(memory, layout, stages, run.tip.drive, rest.length, rest.at)
    two = take_step(memory, blocks, layout, stages, tip, rest, True)
    add_stored_contacts(memory, layout.others)
    add_stored_loss(memory, layout.terms)
    store_further_contacts(memory, layout.others)
    store_loss(memory, layout.terms)
    return two, in_succession(layout, done, two)


@inlined
def carry(memory, blocks, workspace, run, tip, now, step, scratch, accumulators, kernel_input, outputs):
    """Integrate one step of sustained contact (sticking), up to the release if there is one.

    Returns that and the step.
    """
    layout, clock, tick = workspace.layout, run.clock, run.clock.tick
    rest_contact, rest_center = now.well_sign * run.rest_contact, now.well_sign * run.rest_center
    t, kinematics, control = now.t, now.kinematics, now.control
    # however strongly it is stretched, a beam that is carried moves no faster than the tip
    left = min((now.stored_states + 1) * clock.output_interval, clock.end)
    left = up_to_discontinuity(tip.drive, run.phase, clock.period, t, left) - t
    ticks = min(clock.step >> contact_halvings(clock, (t - accumulators.onset) * tick, 0.0, 0.0), left)
    ticks = max(1, ticks // 4)
    if any_touches(memory, layout.others, False):
        ticks = min(ticks, step.ticks)
    step = _held_step(step, ticks, ticks * tick)
    edge, ticks = _up_to_further_event(memory, blocks, layout, layout.others, run, tip, t, step, scratch)
    if ticks < 1:
        return _turned(memory, layout, run, now, accumulators, outputs), step
    length = ticks * tick
    release = _release(memory, blocks, layout, run, tip, step.phase, step.q, length)
    released = release >= 0.0
    if released:
        length = release
        if release <= (ticks - 1) * tick:
            edge = -1
        ticks = min(max(1, math.ceil(release / tick)), ticks)
    step = _held_step(step, ticks, length)
    done, peak = held_for(memory, blocks, layout, run, tip, step.phase, step.q, length)
    store_further_contacts(memory, layout.others)
    store_loss(memory, layout.terms)
    sample = now.sample
    if outputs is not None:
        sample = record_held(memory, blocks, layout, run, tip, now, step, accumulators, outputs)
    accumulators.impulse += done.impulse
    accumulators.work += done.work
    accumulators.gross_work += done.gross
    accumulators.dissipated += done.dissipated
    accumulators.deepest = max(accumulators.deepest, peak)
    there, gq, qr = _held_to(memory, blocks, layout, tip, step)
    observed = observe(memory, layout, tip, there, step.q1, step.p1)
    kinematics1 = ContactKinematics(
        observed.w + rest_contact, observed.wv, 0.0, 0.0, observed.c + rest_center, observed.cv
    )
    accumulate_displacement(accumulators, kinematics, kinematics1, length)
    # a carried centre moves as the tip does, slowly enough for one cubic
    count_zero_crossings_in_step(
        accumulators, clock, t, length, kinematics_from_barrier(layout.terms, kinematics), kinematics_from_barrier(layout.terms, kinematics1), scratch.inner_samples,
        center_from_barrier(layout.terms, rest_center), 0, 0.0,
    )  # fmt: skip
    observe_extras(kernel_input.extras, accumulators, t * tick, length, kinematics, kinematics1, True)
    t += ticks
    status = _RUNNING if t < clock.end else _OK
    if not math.isfinite(done.impulse):
        status = _DIVERGED
    rows, touching = swap_rows(now.rows), True
    if released:
        touching = False
        after = (t - now.t) * tick - length
        rest = Step(
            0, variable_slot(run), after, there, False, step.q1, step.p1, step.k1,
            step.q, step.p, step.k, step.r,
        )  # fmt: skip
        two, done = _further_step(memory, blocks, workspace, run, tip, rest, done)
        gq, qr, rows = two.gq, two.qr, now.rows
        accumulators.dissipated += two.dissipated
        accumulators.work += two.work
        accumulators.gross_work += two.gross
        if outputs is None:
            close_impact(accumulators, None, 0, tip.law, t, tick)
        else:
            close_impact(accumulators, outputs.impacts, outputs.marks[1], tip.law, t, tick)
        observed = observe(memory, layout, tip, phase_at(run, t), rows.q, rows.p)
        d = min(observed.d, 0.0)
        kinematics1 = ContactKinematics(
            observed.w + rest_contact, observed.wv, d, observed.dv, observed.c + rest_center, observed.cv
        )
    _account_for_surroundings(
        memory, layout, run, t, step, rows.p, edge, done, True, accumulators, outputs, released
    )
    next_control = StepControl(touching, t, t, control.energy_tick, control.steps_since_start)
    state = rows.q, rows.p, rows.k, gq, qr
    next_control, status = monitor_energy(
        memory,
        layout,
        run,
        now,
        t,
        state,
        kinematics1,
        next_control,
        released,
        status,
        accumulators,
        kernel_input,
    )
    return IntegratorState(
        t, now.well_sign, 2.0 * gq + qr, rows, kinematics1, next_control, sample, now.stored_states, status
    ), step


@inlined
def apply_impact_law(memory, blocks, workspace, run, tip, p, kinematics, when, phase, accumulators, outputs):
    """Newton's law; *p* is where the mode's velocity stands.  Returns whether the bodies stay together.

    They do if the contact presses them together and what is left of the chatter, a geometric series of ever
    shorter flights, is over soon and too low to be resolved.
    """
    layout = workspace.layout
    c, e = memory[layout.contact], tip.law.coefficient
    speed = kinematics.wv + kinematics.dv
    impulse = (1.0 + e) * kinematics.dv / (c * c)
    memory[p] += c * impulse
    accumulators.work += impulse * speed
    accumulators.gross_work += abs(impulse * speed)
    lost = 0.5 * (1.0 - e * e) * kinematics.dv * kinematics.dv / (c * c)
    accumulators.dissipated += lost
    accumulators.lost += lost
    away = e * kinematics.dv
    force = constraint_force(memory, blocks, layout, run, tip, phase, 0.0, p - layout.size)
    pressed = force * c * c
    if e == 0.0 and pressed > 0.0:
        # without a rebound, landing and sustained contact are one impact: closed, and counted, at its release
        accumulators.impulse, accumulators.deepest = impulse, force
        return True
    accumulators.total_impulse += impulse
    if outputs is not None:
        at = accumulators.impacts - outputs.marks[1]
        if at < outputs.impacts.shape[0]:
            outputs.impacts[at, 0] = when
            outputs.impacts[at, 1] = 0.0
            outputs.impacts[at, 2] = math.nan
            outputs.impacts[at, 3] = impulse
    accumulators.impacts += 1
    if not pressed > 0.0:
        return False
    height = 0.5 * away * away / pressed
    if height <= run.lowest * 1e-4:
        return True
    if height > run.lowest or e >= 1.0:
        return False
    lasts = 2.0 * away / (pressed * (1.0 - e))
    shortest = 2.0 * math.pi / max(memory[layout.omega], drive_rate(tip.drive))
    if lasts > _SOON * shortest:
        return False
    return constraint_force(memory, blocks, layout, run, tip, phase, lasts, p - layout.size) > 0.0


@inlined
def _stuck(memory, workspace, run, kinematics, p, accumulators):
    """Begin the record of a sustained contact: the relative velocity that the last hit left is lost."""
    c = memory[workspace.layout.contact]
    away = run.tip.law.coefficient * kinematics.dv
    impulse = -away / (c * c)
    accumulators.impulse += impulse
    accumulators.work += impulse * (kinematics.wv + kinematics.dv)
    lost = 0.5 * away * away / (c * c)
    accumulators.dissipated += lost
    accumulators.lost += lost
    accumulators.touching = 1


@compiled
def _rises(inner_samples, subintervals, subinterval, still, still_speed):
    """Time of the first positive penetration in a step that begins in touch; -1 if there is none.

    As long as the gap is rounding (*still*) nothing has happened yet: the bodies part more slowly than can be resolved.
    """
    i = 0
    if abs(inner_samples[0, 1]) <= still_speed:
        while i < subintervals and abs(inner_samples[i + 1, 0]) <= still:
            i += 1
        if i < subintervals and inner_samples[i + 1, 0] > still:
            return i * subinterval
        i += 1
    while i < subintervals:
        rise = _rise(
            min(inner_samples[i, 0], 0.0),
            inner_samples[i, 1],
            inner_samples[i + 1, 0],
            inner_samples[i + 1, 1],
            subinterval,
        )
        if rise >= 0.0:
            return (i + rise) * subinterval
        i += 1
    return -1.0


@inlined
def _mend(inner_samples, subintervals, length, observed):
    """Correct the samples inside a step so that they agree with its end.

    They follow from linear modes under a tension that changes evenly, and a hit of a beam that passes the tip by a
    billionth of b is one all the same.  The bend is the cubic that begins with neither value nor slope.
    """
    off, slope = (
        observed.d - inner_samples[subintervals, 0],
        (observed.dv - inner_samples[subintervals, 1]) * length,
    )
    for i in range(1, subintervals + 1):
        u = i / subintervals
        inner_samples[i, 0] += u * u * (off * (3.0 - 2.0 * u) + slope * (u - 1.0))
        inner_samples[i, 1] += u * (off * 6.0 * (1.0 - u) + slope * (3.0 * u - 2.0)) / length


@inlined
def _turns(u0, v0, u1, v1, h):
    """Locations in [0, 1] of the minimum and maximum of a cubic between two falls; -1 and -1 if it only falls."""
    _, c1, c2, c3 = cubic(u0, v0, u1, v1, h)
    inside = c2 * c2 - 3.0 * c1 * c3
    if not (c3 < 0.0 and inside > 0.0):
        return -1.0, -1.0
    root_of = math.sqrt(inside)
    # without differences of what is alike
    bottom = c1 / (-c2 - root_of) if c2 > 0.0 else (c2 - root_of) / (-3.0 * c3)
    return bottom, (c2 + root_of) / (-3.0 * c3)


@compiled
def _rise(u0, v0, u1, v1, h):
    """Upcrossing as first_rise, also if the signal decreases at both ends and increases between them."""
    rise = first_upcrossing(u0, v0, u1, v1, h)
    if rise >= 0.0 or v0 > 0.0 or v1 > 0.0:
        return rise
    bottom, top = _turns(u0, v0, u1, v1, h)
    if not (0.0 <= bottom < top < 1.0):
        return -1.0
    c0, c1, c2, c3 = cubic(u0, v0, u1, v1, h)
    if ((c3 * top + c2) * top + c1) * top + c0 <= 0.0:
        return -1.0
    return root(c0, c1, c2, c3, bottom, top)


@compiled
def _onset_time(inner_samples, subintervals, subinterval):
    """Time of the first positive penetration; -1 if there is none."""
    for i in range(subintervals):
        rise = _rise(
            inner_samples[i, 0],
            inner_samples[i, 1],
            inner_samples[i + 1, 0],
            inner_samples[i + 1, 1],
            subinterval,
        )
        if rise >= 0.0:
            return (i + rise) * subinterval
    return -1.0


@compiled
def _top(inner_samples, subintervals, subinterval, onset_time):
    """Time of the first maximum of the penetration after *onset_time*; the end of the step if it only grows."""
    for i in range(min(int(onset_time / subinterval), subintervals - 1), subintervals):
        v0, v1 = inner_samples[i, 1], inner_samples[i + 1, 1]
        if v1 < 0.0:
            if v0 > 0.0:
                return (i + v0 / (v0 - v1)) * subinterval
            _, top = _turns(inner_samples[i, 0], v0, inner_samples[i + 1, 0], v1, subinterval)
            if (i + top) * subinterval > onset_time:
                return (i + top) * subinterval
    return subintervals * subinterval


@inlined
def _step_to(memory, blocks, workspace, run, tip, step, length):
    """A step of *length*; its results, and the kinematics there."""
    shortened = shortened_step(step, run, 0, length)
    prepare(memory, workspace.layout, workspace.stages, run.tip.drive, shortened.length, shortened.at)
    done = take_step(memory, blocks, workspace.layout, workspace.stages, tip, shortened, True)
    phase = step.phase + tip.drive.omega * shortened.length
    return shortened, done, observe(memory, workspace.layout, tip, phase, step.q1, step.p1)


@inlined
def _located(memory, blocks, workspace, run, tip, step, onset_time, top, at_end, still_speed):
    """The step that ends at the impact itself, by Newton's method on the trajectory; its results, and the kinematics there.

    *top* is where the penetration is maximum if it falls again within the step, *at_end* that at the end of the
    whole step.  The last value says whether there is a hit at all: whether the bodies meet within the step, and do not
    merely graze.
    """
    before, low, high = math.inf, 0.0, step.length
    if at_end < 0.0 and top < step.length:
        shortened, done, observed = _step_to(memory, blocks, workspace, run, tip, step, top)
        if observed.d <= 0.0:
            return shortened, done, observed, False
        high, at_end = top, observed.d
    shortened, done, observed = _step_to(memory, blocks, workspace, run, tip, step, onset_time)
    for _ in range(_LOCATIONS):
        if observed.dv <= still_speed and not (at_end > 0.0 and observed.d > 0.0):
            break
        change = -observed.d / observed.dv if observed.dv > still_speed else -math.inf
        if abs(change) >= 0.5 * before and before < math.inf:
            break
        wanted = shortened.length + change
        if observed.d < 0.0:
            low = shortened.length
        else:
            high = shortened.length
        if wanted >= high and at_end < 0.0:
            return shortened, done, observed, False  # they meet in the next step
        if wanted < low or wanted > high:
            # the way is bent: halve what is known to hold the hit
            if high - low <= 4e-16 * step.length:
                break
            wanted, change = 0.5 * (low + high), math.inf
        before = abs(change)
        shortened, done, observed = _step_to(memory, blocks, workspace, run, tip, step, wanted)
    return shortened, done, observed, observed.dv > still_speed


@inlined
def _up_to_further_event_in_flight(
    memory, blocks, workspace, others, run, tip, t, step, done, observed, scratch
):
    """A free step up to the first onset or release of another striker: the tick as detected, the step and its results."""
    if others is None:
        return step.ticks, step, done, observed
    layout, clock, drive, whole = workspace.layout, run.clock, tip.drive, step.ticks
    there = step.phase + drive.omega * step.length
    observe_further_contacts(memory, layout.size, others, drive, there, step.q1, step.p1)
    edge = first_further_event(memory, layout, others, sampling_slot(run), run, t, drive, step, scratch)
    event_ticks, corrections = edge, 1
    if edge < 1:
        return edge, shortened_step(step, run, 0, 0.0), done, observed
    while event_ticks != step.ticks:
        step = shortened_step(step, run, event_ticks, event_ticks * clock.tick)
        prepare(memory, layout, workspace.stages, run.tip.drive, step.length, step.at)
        done = take_step(memory, blocks, layout, workspace.stages, tip, step, True)
        there = step.phase + drive.omega * step.length
        observed = observe(memory, layout, tip, there, step.q1, step.p1)
        observe_further_contacts(memory, layout.size, others, drive, there, step.q1, step.p1)
        event_ticks = refine_further_onsets(
            memory, others, clock, edge, event_ticks, whole, (clock.step >> clock.max_halvings) * clock.tick, corrections
        )  # fmt: skip
        corrections -= 1
    return edge, step, done, observed


@inlined
def _moved_on(memory, blocks, workspace, run, tip, step, done, q, p, k, after, phase, together):
    """From a hit to the next tick, into the rows that the step began from; returns g.q, q.Gq, and the results of all."""
    if together:
        _, gq, qr = hold(memory, blocks, workspace.layout, tip, phase, after, q, step.q, step.p, step.k)
        return gq, qr, done
    rest = Step(0, variable_slot(run), after, phase, False, q, p, k, step.q, step.p, step.k, step.r)
    two, done = _further_step(memory, blocks, workspace, run, tip, rest, done)
    return two.gq, two.qr, done


@inlined
def accept_step_restitution(
    memory, blocks, workspace, run, now, step, done, scratch, accumulators, kernel_input, outputs
):
    """Accept a step as :func:`snapbeam.solver.cpu.events.accept_step`, for impacts of zero duration."""
    layout, clock, tick = workspace.layout, run.clock, run.clock.tick
    tip = tip_about_well(run.tip, now.well_sign, run.rest_contact)
    rest_contact, rest_center = now.well_sign * run.rest_contact, now.well_sign * run.rest_center
    t, kinematics, control = now.t, now.kinematics, now.control
    if control.touching:
        return carry(
            memory, blocks, workspace, run, tip, now, step, scratch, accumulators, kernel_input, outputs
        )
    still_speed = _NOISE * (run.tip_speed + abs(kinematics.wv))
    if kinematics.d >= 0.0 and kinematics.dv > still_speed:
        # in touch and closing before any step
        q, p, k = now.rows.q, now.rows.p, now.rows.k
        together = apply_impact_law(
            memory, blocks, workspace, run, tip, p, kinematics, t * tick, step.phase, accumulators, outputs
        )
        if together:
            _stuck(memory, workspace, run, kinematics, p, accumulators)
            accumulators.onset = t
            hold(memory, blocks, layout, tip, step.phase, 0.0, q, q, p, k)
        restart_further_contacts(memory, layout.size, layout.others, tip.drive, step.phase, t, q)
        status = _STEP_LIMIT if accumulators.steps >= clock.max_steps else _RUNNING
        away = 0.0 if together else tip.law.coefficient * kinematics.dv
        wv = kinematics.wv + kinematics.dv + away
        next_control = StepControl(together, t, t, control.energy_tick, control.steps_since_start)
        after = ContactKinematics(kinematics.w, wv, 0.0, -away, kinematics.c, memory_rate(memory, layout, p))
        return IntegratorState(
            t,
            now.well_sign,
            now.stretch,
            now.rows,
            after,
            next_control,
            now.sample,
            now.stored_states,
            status,
        ), step

    observed = observe(memory, layout, tip, step.phase + tip.drive.omega * step.length, step.q1, step.p1)
    if not math.isfinite(observed.d + observed.dv):
        return (
            IntegratorState(
                t,
                now.well_sign,
                now.stretch,
                now.rows,
                kinematics,
                control,
                now.sample,
                now.stored_states,
                _DIVERGED,
            ),
            step,
        )
    edge, step, done, observed = _up_to_further_event_in_flight(
        memory, blocks, workspace, layout.others, run, tip, t, step, done, observed, scratch
    )
    if step.ticks < 1:
        return _turned(memory, layout, run, now, accumulators, outputs), step
    whole = step.ticks
    contact_event = detect_contact_event(memory, layout, run, now, tip, step, observed, scratch)
    onset_time = contact_event.onset_time
    if contact_event.subintervals > 0:
        _mend(scratch.inner_samples, contact_event.subintervals, step.length, observed)
        if t + step.ticks > contact_event.safe_gap:
            onset_time = _onset_time(
                scratch.inner_samples, contact_event.subintervals, contact_event.subinterval
            )
    if kinematics.d > -still_speed * run.step_time and contact_event.subintervals > 0:
        still = still_speed * run.step_time
        onset_time = _rises(
            scratch.inner_samples, contact_event.subintervals, contact_event.subinterval, still, still_speed
        )
    hit, ticks = False, step.ticks
    if onset_time >= 0.0:
        top = _top(scratch.inner_samples, contact_event.subintervals, contact_event.subinterval, onset_time)
        located, done, observed, hit = _located(
            memory, blocks, workspace, run, tip, step, onset_time, top, observed.d, still_speed
        )
        ticks = min(max(1, math.ceil(located.length / tick)), step.ticks)
        if hit:
            step = Step(
                ticks, located.at, located.length, step.phase, False, step.q, step.p, step.k, step.q1, step.p1,
                step.k1, step.r,
            )  # fmt: skip
        else:
            step = shortened_step(step, run, ticks, ticks * tick)
            prepare(memory, layout, workspace.stages, run.tip.drive, step.length, step.at)
            done = take_step(memory, blocks, layout, workspace.stages, tip, step, True)
            observed = observe(
                memory, layout, tip, step.phase + tip.drive.omega * step.length, step.q1, step.p1
            )
    kinematics1 = ContactKinematics(
        observed.w + rest_contact, observed.wv, observed.d, observed.dv, observed.c + rest_center, observed.cv
    )
    if step.ticks < whole:
        edge = -1
    there = step.phase + tip.drive.omega * step.length
    observe_further_contacts(memory, layout.size, layout.others, tip.drive, there, step.q1, step.p1)
    store_further_contacts(memory, layout.others)
    store_loss(memory, layout.terms)
    sample = now.sample
    if outputs is not None:
        sample = record_instants(
            memory, blocks, layout, workspace.stages, run, tip, now, step, accumulators, outputs
        )
    accumulators.dissipated += done.dissipated
    accumulate_displacement(accumulators, kinematics, kinematics1, step.length)
    if hit or t + step.ticks > contact_event.safe_center:
        count_zero_crossings_in_step(
            accumulators, clock, t, step.length, kinematics_from_barrier(layout.terms, kinematics), kinematics_from_barrier(layout.terms, kinematics1),
            scratch.inner_samples, center_from_barrier(layout.terms, rest_center), contact_event.subintervals, contact_event.subinterval,
        )  # fmt: skip
    observe_extras(kernel_input.extras, accumulators, t * tick, step.length, kinematics, kinematics1, False)

    t += step.ticks
    status = _RUNNING if t < clock.end else _OK
    rows, gq, qr, together = swap_rows(now.rows), done.gq, done.qr, False
    if hit:
        when, phase = now.t * tick + step.length, step.phase + tip.drive.omega * step.length
        together = apply_impact_law(
            memory, blocks, workspace, run, tip, step.p1, kinematics1, when, phase, accumulators, outputs
        )
        if together:
            _stuck(memory, workspace, run, kinematics1, step.p1, accumulators)
            accumulators.onset = t
        gq, qr, done = _moved_on(
            memory, blocks, workspace, run, tip, step, done, step.q1, step.p1, step.k1,
            (t - now.t) * tick - step.length, phase, together,
        )  # fmt: skip
        rows = now.rows
        observed = observe(memory, layout, tip, phase_at(run, t), rows.q, rows.p)
        d, dv = (0.0, 0.0) if together else (min(observed.d, 0.0), observed.dv)
        kinematics1 = ContactKinematics(
            observed.w + rest_contact, observed.wv, d, dv, observed.c + rest_center, observed.cv
        )
    _account_for_surroundings(
        memory, layout, run, t, step, rows.p, edge, done, False, accumulators, outputs, hit
    )
    safe_gap, safe_center = (
        (t, t) if onset_time >= 0.0 else (contact_event.safe_gap, contact_event.safe_center)
    )
    next_control = StepControl(
        together, safe_gap, safe_center, control.energy_tick, control.steps_since_start
    )
    state = rows.q, rows.p, rows.k, gq, qr
    next_control, status = monitor_energy(
        memory, layout, run, now, t, state, kinematics1, next_control, hit, status, accumulators, kernel_input
    )
    return IntegratorState(
        t, now.well_sign, 2.0 * gq + qr, rows, kinematics1, next_control, sample, now.stored_states, status
    ), step


@inlined
def memory_rate(memory, layout, p):
    """Rate of the centre of a single mode."""
    return memory[layout.center] * memory[p]
