"""Contact onset and release of the further strikers, and the statistics of their contacts.

Each is watched as the first one is: near the beam a free step is sampled inside, a step that would pass an onset or release of
a contact ends there, and steps in contact are graded.  A step ends at the first onset or release of all.
"""

from __future__ import annotations

import math

from snapbeam.solver.compilation import called, inlined
from snapbeam.solver.cpu.mode_lanes import (
    flow_coefficients,
    propagate_free,
    speed_bound_with_terms,
    validity_horizon,
)
from snapbeam.solver.cpu.step import with_velocity_dependent
from snapbeam.solver.cpu.terms.further_contacts import (
    block,
    mirror_further_contacts,
    penetration_of,
    read_indentations,
    unload_further,
)
from snapbeam.solver.further_contacts import (
    DEEPEST,
    DEPTH,
    DEPTH1,
    EVENT_TICKS,
    HERE,
    IMPULSE,
    KEPT,
    LAW,
    LOST,
    LOST_KEPT,
    NUMBERS,
    ONSET,
    PUSHED,
    RATE,
    RATE1,
    SAFE,
    SIGN,
    SINCE,
    SPEED,
    TOUCHING,
    WORK,
    WORKED,
    any_jumps,
    break_of,
    breaks_at,
    count_of,
    damping_of,
    jumps_at,
    mark_at,
    motion_of,
    peak_in_step_of,
    peak_of,
    way_to_release,
)
from snapbeam.solver.interpolation import first_downcrossing, first_upcrossing
from snapbeam.solver.simd import WIDTH, dot, fma, lanes_sum, load, store
from snapbeam.solver.statistics import OTHER_IMPACTS, OTHER_IMPULSE, OTHER_PEAK, OTHER_WORK
from snapbeam.solver.step_control import (
    ContactKinematics,
    contact_halvings,
    refine_onset,
    safe_interval,
)


@called
def _observe(memory, size, others, drive, argument, t, q):
    for j in range(count_of(others.kinds)):
        at = block(others, j)
        depth, velocity = penetration_of(memory, size, others, drive, argument, j, q)
        memory[at + DEPTH] = depth
        memory[at + RATE] = velocity - dot(memory, size, others.rows + j * size, q + size)
        memory[at + SAFE] = t


@inlined
def restart_further_contacts(memory, size, others, drive, argument, t, q):
    """Set the further strikers at tick *t* from the state alone; p follows *q*."""
    if others is None:
        return
    _observe(memory, size, others, drive, argument, t, q)


@called
def _begin(memory, size, others, drive, tick, argument, well_sign, q):
    mirror_further_contacts(memory, others, well_sign)
    _observe(memory, size, others, drive, argument, 0, q)
    for j in range(count_of(others.kinds)):
        at = block(others, j)
        depth, since = memory[at + DEPTH], memory[at + SINCE]
        touching = depth > 0.0 or (depth == 0.0 and memory[at + RATE] > 0.0)
        if math.isfinite(since):
            touching = since >= 0.0
        if touching:
            memory[at + TOUCHING] = 1.0
            memory[at + DEEPEST] = mark_at(others.kinds, memory, at + LAW, j, depth, memory[at + RATE])
            if since > 0.0:
                memory[at + ONSET] = -math.floor(since / tick + 0.5)


@inlined
def begin_further_contacts(memory, size, others, drive, kernel_input, i, tick, argument, well_sign, q):
    """Put the strikers of run *i* in memory; one that presses at the start touches from then on; p follows *q*.

    If the state contains the time since a contact began, or that there is none, it decides instead.
    """
    if others is None:
        return
    for j in range(count_of(others.kinds)):
        at = block(others, j)
        for number in range(NUMBERS):
            memory[at + number] = kernel_input.other_numbers[i, j, number]
        place = kernel_input.other_places[i, j]
        for row in range(size):
            memory[others.rows + j * size + row] = kernel_input.other_rows[place, row]
    read_indentations(memory, others, others.indentations, q)
    _begin(memory, size, others, drive, tick, argument, well_sign, q)


@inlined
def any_touches(memory, others, touching):
    """Return whether the first striker or a further one is in contact."""
    if others is None:
        return touching
    for j in range(count_of(others.kinds)):
        touching = touching or memory[block(others, j) + TOUCHING] != 0.0
    return touching


@inlined
def limit_safe_interval(memory, others, t, until):
    """Tick until which free flight is known to last; *t* while another striker touches the beam."""
    if others is None:
        return until
    return t if any_touches(memory, others, False) else until


@inlined
def further_contacts_halvings(memory, others, clock, t, touching, level):
    """The level of a step, made finer for those that touch, and finer still where more than one contact lasts.

    A beam that is pressed from several sides has the stiffness of all contacts, whose rates add as squares: of two
    to four that is one halving.
    """
    if others is None:
        return level
    count = int(touching)
    for j in range(count_of(others.kinds)):
        at = block(others, j)
        if memory[at + TOUCHING] != 0.0:
            count += 1
            elapsed = (t - memory[at + ONSET]) * clock.tick
            left = way_to_release(others.kinds, memory, at + LAW, j, memory[at + DEPTH], memory[at + RATE])
            level = max(level, contact_halvings(clock, elapsed, left, memory[at + RATE]))
    if count > 1:
        level = max(level, min(clock.min_contact_halvings + 1, clock.max_halvings))
    return level


@inlined
def observe_further_contacts(memory, size, others, drive, argument, q, p):
    """Note penetrations and their rates at the end of a step."""
    if others is None:
        return
    for j in range(count_of(others.kinds)):
        at = block(others, j)
        depth, velocity = penetration_of(memory, size, others, drive, argument, j, q)
        memory[at + DEPTH1] = depth
        memory[at + RATE1] = velocity - dot(memory, size, others.rows + j * size, p)


@called
def _onset_time(memory, layout, others, drive, flow, subintervals, subinterval, step, j, scratch):
    """Time within a free step at which the gap of striker j closes, s; -1 if it does not."""
    size, row, parts = layout.size, others.rows + j * layout.size, scratch.parts
    sign, here = memory[block(others, j) + SIGN], memory[block(others, j) + HERE]
    propagate_free(
        memory, layout, row, flow, subintervals, subinterval, step.q, step.p, step.k, step.k1, False, parts
    )
    push0, push1 = dot(memory, size, row, step.k), dot(memory, size, row, step.k1)
    before, rate_before = 0.0, 0.0
    for i in range(subintervals + 1):
        done, owed = i / subintervals, 0.5 * subinterval
        if i == 0:
            owed = 0.0
            w, rate = dot(memory, size, row, step.q), dot(memory, size, row, step.p)
        else:
            at = 4 * WIDTH * (i - 1)
            w, rate = lanes_sum(load(parts, at)), lanes_sum(load(parts, at + WIDTH))
        motion, velocity = motion_of(drive, memory, step.phase + i * subinterval * drive.omega, j, sign)
        depth = here + motion - w
        closing = velocity - rate - owed * ((1.0 - done) * push0 + done * push1)
        if i > 0:
            rise = first_upcrossing(before, rate_before, depth, closing, subinterval)
            if rise >= 0.0:
                return (i - 1 + rise) * subinterval
        before, rate_before = depth, closing
    return -1.0


@inlined
def _sampled_onset(memory, layout, others, slot, run, drive, step, j, scratch):
    """The same, in subintervals that resolve the fastest mode."""
    sampling, subintervals = slot, run.step_subintervals
    if step.ticks != run.clock.step:
        sampling += 4 * layout.size
        subintervals = max(2, math.ceil(step.length / run.shortest_subinterval))
        flow_coefficients(memory, layout, step.length / subintervals, sampling)
    free = with_velocity_dependent(memory, layout, run.spare, step)
    return _onset_time(
        memory, layout, others, drive, sampling, subintervals, step.length / subintervals, free, j, scratch
    )


@called
def _edge(memory, layout, others, slot, run, t, drive, step, scratch):
    """The tick of a step at which the first of the others meets or leaves the beam, and each one's own."""
    size, tick, earliest = layout.size, run.clock.tick, step.ticks
    after = t + step.ticks
    # a contact changes how fast the others may close: nothing that was known in free flight holds while one lasts
    busy = any_touches(memory, others, step.touching)
    for j in range(count_of(others.kinds)):
        at, row, event_ticks = block(others, j), others.rows + j * size, -1
        depth, rate, depth1, rate1 = (
            memory[at + DEPTH], memory[at + RATE], memory[at + DEPTH1], memory[at + RATE1]
        )  # fmt: skip
        if memory[at + TOUCHING] != 0.0:
            if depth1 <= 0.0:
                event_ticks = step.ticks
                if depth > 0.0:
                    event_ticks = max(
                        1, int(first_downcrossing(depth, rate, depth1, rate1, step.length) * step.ticks)
                    )
            if breaks_at(others.kinds, j):
                share = break_of(others.kinds, memory, at + LAW, j, depth, rate, depth1, rate1, step.length)
                if share >= 0.0 and share * step.ticks + 1.0 < (
                    step.ticks if event_ticks < 0 else event_ticks
                ):
                    # the force is not smooth there, though the contact goes on
                    event_ticks, earliest = -1, min(earliest, int(share * step.ticks) + 1)
        else:
            inside = max(depth, depth1) > 0.0
            if busy or inside:
                memory[at + SAFE] = t
            elif after > memory[at + SAFE]:
                known = validity_horizon(layout, run.step_time)
                bound = speed_bound_with_terms(memory, layout, drive, row, step.q, step.p, step.k, known)
                push = dot(memory, size, row, step.k)
                safe = safe_interval(-depth, bound, memory[at + SPEED], push, known)
                memory[at + SAFE] = t + int(safe / tick)
            onset_time = -1.0
            if after > memory[at + SAFE]:
                if step.touching:
                    # the samples do not include the first contact's force; the ends of the step do
                    onset_time = first_upcrossing(depth, rate, depth1, rate1, step.length) * step.length
                else:
                    onset_time = _sampled_onset(memory, layout, others, slot, run, drive, step, j, scratch)
            if onset_time < 0.0 and depth1 > 0.0:
                # a free step ended in the contact unseen: the accelerations changed more than was foreseen
                onset_time = first_upcrossing(depth, rate, depth1, rate1, step.length) * step.length
            if onset_time >= 0.0:
                event_ticks = min(step.ticks, int(onset_time / tick))
        memory[at + EVENT_TICKS] = event_ticks
        if event_ticks >= 0:
            earliest = min(earliest, event_ticks)
    return earliest


@inlined
def first_further_event(memory, layout, others, slot, run, t, drive, step, scratch):
    """The tick within a step at which the first of the other strikers meets or leaves the beam; its end if none does.

    *slot* is where the flow over a subinterval is stored.
    """
    if others is None:
        return step.ticks
    return _edge(memory, layout, others, slot, run, t, drive, step, scratch)


@inlined
def corrections_of_onset(others, most):
    """Corrections of the onset of a further contact, at most: *most* if its force may begin with a jump."""
    if others is None:
        return 0
    return most if any_jumps(others.kinds) else 1


@inlined
def refine_further_onsets(memory, others, clock, edge, event_ticks, whole, smallest_correction, corrections):
    """End of a step that was shortened to *event_ticks*, refined by the gap of the contact that begins there.

    Nothing new without *corrections* left: the *edge* to which the step was shortened first is one of theirs.
    """
    if others is None:
        return event_ticks
    if corrections > 0:
        for j in range(count_of(others.kinds)):
            at = block(others, j)
            if memory[at + TOUCHING] == 0.0 and memory[at + EVENT_TICKS] == edge:
                kinematics = ContactKinematics(0.0, 0.0, memory[at + DEPTH1], memory[at + RATE1], 0.0, 0.0)
                if jumps_at(others.kinds, memory, at + LAW, j):
                    smallest_correction = 0.5 * clock.tick
                return refine_onset(clock, event_ticks, whole, kinematics, smallest_correction)
    return event_ticks


@inlined
def store_further_contacts(memory, others):
    """Keep what the accepted step gave: a trial step that follows writes over it."""
    if others is None:
        return
    for j in range(count_of(others.kinds)):
        at = block(others, j)
        memory[at + KEPT], memory[at + WORKED] = memory[at + IMPULSE], memory[at + WORK]
        memory[at + LOST_KEPT] = memory[at + LOST]


@inlined
def add_stored_contacts(memory, others):
    """Add what :func:`store_further_contacts` kept of the first part of a step to what the second part gave."""
    if others is None:
        return
    for j in range(count_of(others.kinds)):
        at = block(others, j)
        memory[at + IMPULSE] += memory[at + KEPT]
        memory[at + WORK] += memory[at + WORKED]
        memory[at + LOST] += memory[at + LOST_KEPT]


@inlined
def accumulate_further_contacts(memory, others, touching, done, accumulators):
    """Enter the work of each of the others in the statistics, and of all if the first does not touch."""
    if others is None:
        return
    for j in range(count_of(others.kinds)):
        accumulators.others[j, OTHER_WORK] += memory[block(others, j) + WORKED]
    if not touching:
        accumulators.work += done.work
        accumulators.gross_work += done.gross
        accumulators.lost += done.lost


@inlined
def _leave(memory, others, j, accumulators, outputs, t, tick):
    """Enter a contact that ends at tick *t* in the statistics, unless nothing was pressed."""
    at = block(others, j)
    deepest = memory[at + DEEPEST]
    if deepest > 0.0:
        onset, impulse = memory[at + ONSET], memory[at + PUSHED]
        duration, force = (t - onset) * tick, peak_of(others.kinds, memory, at + LAW, j, deepest)
        _write_impact(outputs, accumulators, onset * tick, duration, force, impulse, j)
        accumulators.impacts += 1
        # of a contact that began before the run, what falls into it
        accumulators.contact_time += duration if onset >= 0.0 else t * tick
        accumulators.others[j, OTHER_IMPACTS] += 1.0
        accumulators.others[j, OTHER_PEAK] = max(accumulators.others[j, OTHER_PEAK], force)
    accumulators.total_impulse += memory[at + PUSHED]
    accumulators.others[j, OTHER_IMPULSE] += memory[at + PUSHED]
    memory[at + TOUCHING], memory[at + DEEPEST], memory[at + PUSHED] = 0.0, 0.0, 0.0


@inlined
def _write_impact(outputs, accumulators, onset, duration, force, impulse, j):
    if outputs is None:
        return
    at = accumulators.impacts - outputs.marks[1]
    if at < outputs.impacts.shape[0]:
        outputs.impacts[at, 0], outputs.impacts[at, 1] = onset, duration
        outputs.impacts[at, 2], outputs.impacts[at, 3] = force, impulse
        outputs.impacts[at, 4] = j + 2


@called
def _kick_at_onset(memory, size, others, j, p, accumulators, outputs):
    """The impulse of a force that begins with a jump, from the onset to the tick at which the contact begins.

    As of the first contact (``cpu/events.py: kick_at_onset``).
    """
    at, row = block(others, j), others.rows + j * size
    damping, rate = damping_of(others.kinds, memory, at + LAW, j, 0.0), memory[at + RATE]
    impulse = damping * memory[at + DEPTH]
    gained, velocity = impulse * dot(memory, size, row, row), rate + dot(memory, size, row, p)
    for i in range(0, size, WIDTH):
        store(memory, p + i, fma(impulse, load(memory, row + i), load(memory, p + i)))
    work, lost = impulse * velocity, impulse * (rate - 0.5 * gained)
    accumulators.work += work
    accumulators.gross_work += abs(work)
    accumulators.others[j, OTHER_WORK] += work
    accumulators.lost += lost
    if outputs is not None:
        accumulators.dissipated += lost
    memory[at + RATE] = rate - gained
    memory[at + PUSHED] += impulse
    memory[at + DEEPEST] = max(memory[at + DEEPEST], damping * rate)


@called
def _turn(memory, size, others, q, p, edge, t, length, tick, accumulators, outputs):
    for j in range(count_of(others.kinds)):
        at = block(others, j)
        depth, rate, depth1, rate1 = (
            memory[at + DEPTH], memory[at + RATE], memory[at + DEPTH1], memory[at + RATE1]
        )  # fmt: skip
        touching = memory[at + TOUCHING] != 0.0
        if touching and length > 0.0:
            memory[at + DEEPEST] = peak_in_step_of(
                others.kinds, memory, at + LAW, j, memory[at + DEEPEST], depth, rate, depth1, rate1, length
            )
            memory[at + PUSHED] += memory[at + KEPT]
        if length > 0.0:
            memory[at + DEPTH], memory[at + RATE] = depth1, rate1
        if memory[at + EVENT_TICKS] >= 0.0 and memory[at + EVENT_TICKS] <= edge:
            memory[at + SAFE] = t
            if touching:
                _leave(memory, others, j, accumulators, outputs, t, tick)
                memory[at + DEPTH] = min(memory[at + DEPTH], 0.0)
            else:
                memory[at + TOUCHING], memory[at + ONSET] = 1.0, t
                memory[at + DEEPEST], memory[at + PUSHED] = 0.0, 0.0
                if jumps_at(others.kinds, memory, at + LAW, j):
                    _kick_at_onset(memory, size, others, j, p, accumulators, outputs)
        elif touching:
            unload_further(memory, others, others.indentations, j, q, accumulators, outputs)


@inlined
def update_further_contacts(memory, size, others, q, p, edge, t, length, tick, accumulators, outputs):
    """Update the further strikers at tick *t*, after a step of *length* (s) with its first event at tick *edge*.

    The state stands in the rows *q* and *p*.  With a length of 0 nothing has moved: those turn whose gap closes as the step begins.
    """
    if others is None:
        return
    _turn(memory, size, others, q, p, edge, t, length, tick, accumulators, outputs)


@inlined
def close_further_contacts(memory, others, accumulators, outputs, t, tick):
    """Enter the contacts that go on at the end of a run; they stay closed in its final state."""
    if others is None:
        return
    for j in range(count_of(others.kinds)):
        at = block(others, j)
        if memory[at + TOUCHING] != 0.0:
            _leave(memory, others, j, accumulators, outputs, t, tick)
            memory[at + TOUCHING] = 1.0


@called
def _accumulate_open(memory, others, accumulators, t, tick):
    for j in range(count_of(others.kinds)):
        at = block(others, j)
        if memory[at + TOUCHING] != 0.0:
            force = peak_of(others.kinds, memory, at + LAW, j, memory[at + DEEPEST])
            accumulators.contact_time += (t - max(memory[at + ONSET], 0.0)) * tick
            accumulators.total_impulse += memory[at + PUSHED]
            accumulators.others[j, OTHER_IMPULSE] += memory[at + PUSHED]
            accumulators.others[j, OTHER_PEAK] = max(accumulators.others[j, OTHER_PEAK], force)


@inlined
def accumulate_open_further_contacts(memory, others, accumulators, t, tick):
    """Enter what their contacts gave so far, of a run that is to go on from tick *t*."""
    if others is None:
        return
    _accumulate_open(memory, others, accumulators, t, tick)


@inlined
def store_contact_states(memory, others, t, found):
    """Write for each of them the ticks since its contact began, -1: apart, behind the well and the first striker."""
    if others is None:
        return
    for j in range(count_of(others.kinds)):
        at = block(others, j)
        found[2 + j] = t - int(memory[at + ONSET]) if memory[at + TOUCHING] != 0.0 else -1
