"""The CPU engine: two trajectories at a time, each with steps that its own contacts decide.

In free flight a trajectory takes steps of a fixed length, as many as a bound on the speed of the gap says
are safe; near the shaker it looks inside each step with a resolution finer than the fastest mode, and a
step that would enter the contact is cut where it does.  In contact, steps grow from the onset and shrink
towards the release, which is located too, so that the d^(3/2) edges of the force fall between steps.  Time is
an integer number of ticks; the phase of the drive comes from that integer alone.

A kick waits for the sums of the one before, so that one trajectory alone leaves most of a core idle.  Two are
marched side by side, a step of each at a time; when one ends, the next run takes its place.  They share nothing
but the structure: results do not depend on batch, order or threads.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from snapbeam.codes import RunStatus
from snapbeam.kernels.compile import compiled, inlined
from snapbeam.kernels.composition import TURNS
from snapbeam.kernels.cpu_step import (
    Done,
    Impactor,
    Step,
    look_inside,
    observe,
    prepare,
    take_step,
    take_two,
)
from snapbeam.kernels.fields import Counts, Numbers, Ticks
from snapbeam.kernels.march_parts import (
    PIECES,
    Clock,
    change_well,
    contact_level,
    count_in_step,
    finish_impact,
    first_entry,
    flight_level,
    safe_for,
    seen_from,
    set_up,
    track_extremes,
)
from snapbeam.kernels.physics import contact_energy, contact_force, tension_energy, tension_factors
from snapbeam.kernels.rows import (
    acceleration_rows,
    dot,
    flow_coefficients,
    modal_energy,
    speed_bound,
    tension_rows,
)
from snapbeam.kernels.statistics import first_fall, sign_of, turning_point, widened

__all__ = ["march_many"]

_OK, _DECIDED, _RUNNING = int(RunStatus.OK), int(RunStatus.DECIDED), int(RunStatus.RUNNING)
_NOT_FINITE, _STEP_LIMIT = int(RunStatus.NOT_FINITE), int(RunStatus.STEP_LIMIT)
_TWO_PI = 2.0 * math.pi
_NO_STEP = Step(0, 0, 0.0, 0.0, False, 0, 0, 0, 0, 0, 0, 0)
_NOTHING_DONE = Done(0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


class Run(NamedTuple):
    """What stays the same in a run."""

    struck: Impactor
    """The shaker as seen from the well the run begins in."""
    clock: Clock
    rest_contact: float
    """Displacement of the contact point in that well, seen from the shaker's side."""
    rest_center: float
    finest_look: float
    """Longest piece that a step is looked into by, s."""
    step_pieces: int
    """Such pieces in a flight step."""
    step_time: float
    """Of the flight step, s."""
    coefficients: int
    """Where the prepared steps begin, one for each level."""
    slot: int
    """Length of one."""
    spare: int
    """Rows for a look ahead: q, p, k."""


class Now(NamedTuple):
    """Where a run stands."""

    t: int
    """Ticks."""
    q: int
    p: int
    k: int
    q1: int
    p1: int
    k1: int
    home: float
    """+1 in the well the run began in, -1 in the other: the origin of q."""
    stretch: float
    w: float
    """Displacement of the contact point, and its rate."""
    wv: float
    d: float
    """Penetration, and its rate."""
    dv: float
    c: float
    """Displacement of the centre, and its rate."""
    cv: float
    touching: bool
    safe_gap: int
    """Until then the gap cannot close."""
    safe_center: int
    """Until then the centre cannot cross."""
    sample: int
    """Instants recorded so far."""
    status: int


@compiled
def _begin(memory, blocks, layout, stages, run_data, coarsest, finest, max_steps, counts, numbers):
    """Put a run into its place in memory; returns what stays and where it stands."""
    contact_row, start, reals, ticks = run_data
    struck, clock, (rest_contact, rest_center) = set_up(
        memory, layout, contact_row, start, reals, ticks, coarsest, finest, max_steps
    )
    size = layout.size
    slot = (stages.count + 1) // 2 * 4 * size + 2 * TURNS
    q, p, k = layout.work, layout.work + size, layout.work + 2 * size
    r, coefficients = layout.work + 9 * size, layout.work + 10 * size
    step_time = clock.step * clock.tick
    for level in range(clock.finest + 1):
        prepare(memory, layout, stages, struck, step_time / (1 << level), coefficients + level * slot)
    fastest = struck.omega
    for row in range(size):
        fastest = max(fastest, memory[layout.omega + row])
    finest_look = _TWO_PI / (PIECES * fastest)
    step_pieces = max(4, math.ceil(step_time / finest_look))
    run = Run(
        struck,
        clock,
        rest_contact,
        rest_center,
        finest_look,
        step_pieces,
        step_time,
        coefficients,
        slot,
        q + 6 * size,
    )
    flow_coefficients(memory, layout, step_time / step_pieces, _look_slot(run))

    t = counts[Counts.TIME]
    phase = _TWO_PI * ((t % clock.period) / clock.period)
    gq, qr = tension_rows(memory, blocks, layout, q, r)
    along_g, along_r = tension_factors(layout.gamma, gq, qr)
    acceleration_rows(memory, layout, along_g, along_r, r, k)
    w, wv, d, dv, c, cv = observe(memory, layout, struck, phase, q, p)
    w += rest_contact
    c += rest_center
    touching = d > 0.0 or (d == 0.0 and dv > 0.0)
    counts[Counts.TOUCHING], counts[Counts.ONSET] = touching, t
    counts[Counts.SIDE] = sign_of(c, 0)
    numbers[Numbers.MIN_DISPLACEMENT] = numbers[Numbers.MAX_DISPLACEMENT] = w
    numbers[Numbers.MIN_CENTER] = numbers[Numbers.MAX_CENTER] = c
    numbers[Numbers.DEEPEST] = max(d, 0.0)
    status = _RUNNING if t < clock.end else _OK
    q1, p1, k1, stretch = q + 3 * size, p + 3 * size, k + 3 * size, 2.0 * gq + qr
    now = Now(t, q, p, k, q1, p1, k1, 1.0, stretch, w, wv, d, dv, c, cv, touching, t, t, 0, status)
    return run, now


@inlined
def _cut_slot(run):
    """Where a step of any other length is prepared."""
    return run.coefficients + (run.clock.finest + 1) * run.slot


@inlined
def _look_slot(run):
    """Where the flow over one piece of a flight step stands, and after it that over any other piece."""
    return _cut_slot(run) + run.slot


@inlined
def _choose(memory, blocks, layout, stages, run, now, counts):
    """The next step of a run, and where it stands: about the other well, if it has crossed over."""
    clock, home, stretch, t = run.clock, now.home, now.stretch, now.t
    if layout.stretch > 0.0 and now.c * (home * run.rest_center) < 0.0:
        stretch = change_well(memory, blocks, layout, home, now.q, now.k, layout.work + 9 * layout.size)
        home = -home
    counts[Counts.STEPS] += 1
    level = flight_level(clock, stretch, layout.stretch)
    if now.touching:
        elapsed = (t - counts[Counts.ONSET]) * clock.tick
        level = max(level, contact_level(clock, elapsed, now.d, now.dv))
    ticks, at = clock.step >> level, run.coefficients + level * run.slot
    if t + ticks > clock.end:
        ticks, at = clock.end - t, _cut_slot(run)
        prepare(memory, layout, stages, run.struck, ticks * clock.tick, at)
    phase = _TWO_PI * ((t % clock.period) / clock.period)
    r, length = layout.work + 9 * layout.size, ticks * clock.tick
    step = Step(ticks, at, length, phase, now.touching, now.q, now.p, now.k, now.q1, now.p1, now.k1, r)
    now = Now(
        t, now.q, now.p, now.k, now.q1, now.p1, now.k1, home, stretch, now.w, now.wv, now.d, now.dv, now.c,
        now.cv, now.touching, now.safe_gap, now.safe_center, now.sample, now.status
    )  # fmt: skip
    return now, step


@inlined
def _cut(step, run, ticks, length):
    """*step*, of another length and prepared in the slot for those."""
    return Step(
        ticks, _cut_slot(run), length, step.phase, step.touching, step.q, step.p, step.k,
        step.q1, step.p1, step.k1, step.r
    )  # fmt: skip


@inlined
def _aside(step, run, length, size):
    """*step*, cut to *length* and written to the spare rows: a look ahead."""
    return Step(
        0, _cut_slot(run), length, step.phase, step.touching, step.q, step.p, step.k,
        run.spare, run.spare + size, run.spare + 2 * size, step.r
    )  # fmt: skip


@compiled
def _record(memory, blocks, layout, stages, run, impactor, now, step, numbers, outputs):
    """Write down what happens at the instants inside a step; returns how many are recorded then."""
    clock, sample, size = run.clock, now.sample, layout.size
    times, q2, p2 = outputs.times, run.spare, run.spare + size
    while sample < times.size:
        if times[sample] > (now.t + step.ticks) * clock.tick and now.t + step.ticks < clock.end:
            break
        part = min(max(0.0, times[sample] - now.t * clock.tick), step.length)
        prepare(memory, layout, stages, impactor, part, _cut_slot(run))
        here = take_step(
            memory, blocks, layout, stages, impactor, _aside(step, run, part, size), outputs.ledger
        )
        depth = observe(memory, layout, impactor, step.phase + impactor.omega * part, q2, p2)[2]
        energy = modal_energy(memory, layout, q2, p2) + tension_energy(layout.gamma, here.gq, here.qr)
        for row in range(size):
            outputs.rows[sample, row] = memory[q2 + row]
            if now.home < 0.0:
                outputs.rows[sample, row] += memory[layout.shift + row]
        outputs.values[sample, 0] = depth
        outputs.values[sample, 1] = contact_force(impactor.stiffness, depth)
        outputs.values[sample, 2] = energy
        outputs.values[sample, 3] = contact_energy(impactor.stiffness, depth)
        outputs.values[sample, 4] = numbers[Numbers.WORK] + here.work
        outputs.values[sample, 5] = numbers[Numbers.DISSIPATED] + here.dissipated
        sample += 1
    return sample


@inlined
def _settle(memory, blocks, layout, stages, run, now, step, done, room, counts, numbers, outputs):
    """Where a run stands after a step, cut at the contact's edge if it met one, with its statistics kept."""
    clock, t, size = run.clock, now.t, layout.size
    tick, end = clock.tick, clock.end
    seen, parts = room
    q, p, k, q1, p1, k1 = now.q, now.p, now.k, now.q1, now.p1, now.k1
    w, wv, d, dv, c, cv = now.w, now.wv, now.d, now.dv, now.c, now.cv
    touching, safe_gap, safe_center = now.touching, now.safe_gap, now.safe_center
    impactor = seen_from(run.struck, now.home, run.rest_contact)
    rest_contact, rest_center = now.home * run.rest_contact, now.home * run.rest_center
    ticks, length, phase = step.ticks, step.length, step.phase
    w1, wv1, d1, dv1, c1, cv1 = observe(memory, layout, impactor, phase + impactor.omega * length, q1, p1)
    if not math.isfinite(d1 + dv1):
        return Now(
            t, q, p, k, q1, p1, k1, now.home, now.stretch, w, wv, d, dv, c, cv, touching, safe_gap, safe_center,
            now.sample, _NOT_FINITE
        )  # fmt: skip

    # where the step meets or leaves the contact, if it does
    event, cut = False, ticks
    pieces, piece = 0, 0.0
    if touching:
        if d1 <= 0.0:
            event = True
            if d > 0.0:
                cut = max(1, int(first_fall(d, dv, d1, dv1, length) * ticks))
    else:
        if t + ticks > safe_gap:
            bound = speed_bound(memory, layout, layout.contact, q, p)
            push = dot(memory, size, layout.contact, k)
            speed = run.struck.amplitude * run.struck.omega
            safe_gap = t + int(safe_for(-d, bound, speed, push, run.step_time) / tick)
        if t + ticks > safe_center:
            bound = speed_bound(memory, layout, layout.center, q, p)
            push = dot(memory, size, layout.center, k)
            safe_center = t + int(safe_for(abs(c), bound, 0.0, push, run.step_time) / tick)
        if t + ticks > min(safe_gap, safe_center):
            look, pieces = _look_slot(run), run.step_pieces
            if ticks != clock.step:
                look += 4 * size
                pieces = max(2, math.ceil(length / run.finest_look))
                flow_coefficients(memory, layout, length / pieces, look)
            piece = length / pieces
            near_center = t + ticks > safe_center
            look_inside(
                memory, layout, impactor, look, pieces, piece, phase, q, p, k, k1, parts, near_center, seen
            )
            if t + ticks > safe_gap:
                entry = first_entry(seen, pieces, piece)
                if entry >= 0.0:
                    event, cut = True, min(ticks, int(entry / tick))
                    if cut < 1:
                        counts[Counts.TOUCHING], counts[Counts.ONSET] = 1, t
                        status = _STEP_LIMIT if counts[Counts.STEPS] >= clock.max_steps else _RUNNING
                        return Now(
                            t, q, p, k, q1, p1, k1, now.home, now.stretch, w, wv, d, dv, c, cv, True, safe_gap,
                            safe_center, now.sample, status
                        )  # fmt: skip
    if cut < ticks:
        ticks, length = cut, cut * tick
        step = _cut(step, run, ticks, length)
        prepare(memory, layout, stages, impactor, length, step.at)
        done = take_step(memory, blocks, layout, stages, impactor, step, outputs.ledger)
        w1, wv1, d1, dv1, c1, cv1 = observe(memory, layout, impactor, phase + impactor.omega * length, q1, p1)
    w1 += rest_contact
    c1 += rest_center
    sample = now.sample
    if sample < outputs.times.size:
        sample = _record(memory, blocks, layout, stages, run, impactor, now, step, numbers, outputs)

    # statistics of the step
    if touching:
        numbers[Numbers.IMPULSE] += done.impulse
        numbers[Numbers.WORK] += done.work
        numbers[Numbers.GROSS_WORK] += done.gross
        deepest = max(numbers[Numbers.DEEPEST], d1)
        turn = turning_point(d, dv, d1, dv1, length) if dv > 0.0 else -1.0
        if turn > 0.0 and widened(d, deepest, d, dv, d1, dv1, length)[1] > deepest:
            part = turn * length
            prepare(memory, layout, stages, impactor, part, _cut_slot(run))
            take_step(memory, blocks, layout, stages, impactor, _aside(step, run, part, size), False)
            there = phase + impactor.omega * part
            depth = observe(memory, layout, impactor, there, run.spare, run.spare + size)[2]
            deepest = max(deepest, depth)
        numbers[Numbers.DEEPEST] = deepest
    numbers[Numbers.DISSIPATED] += done.dissipated
    track_extremes(numbers, w, wv, w1, wv1, c, cv, c1, cv1, length)
    if touching or t + ticks > safe_center:
        count_in_step(counts, numbers, clock, t, length, c, cv, c1, cv1, seen, rest_center, pieces, piece)

    # accept
    t += ticks
    status = _RUNNING if t < end else _OK
    if event:
        safe_gap, safe_center = t, t
        if touching:
            finish_impact(counts, numbers, outputs, impactor.stiffness, t, tick)
            touching = False
            d1 = min(d1, 0.0)
        else:
            touching = True
            counts[Counts.TOUCHING], counts[Counts.ONSET] = 1, t
    elif not touching and now.home < 0.0 and (counts[Counts.STEPS] & 15) == 0 and w1 > clock.decide_reach:
        energy = modal_energy(memory, layout, q1, p1) + tension_energy(layout.gamma, done.gq, done.qr)
        if c1 > 0.0 and energy < clock.decide_energy:
            status = _DECIDED
    if clock.decide_crossings >= 0 and counts[Counts.CROSSINGS_LAST_QUARTER] > clock.decide_crossings:
        status = _DECIDED
    if status == _RUNNING and counts[Counts.STEPS] >= clock.max_steps:
        status = _STEP_LIMIT
    return Now(
        t, q1, p1, k1, q, p, k, now.home, 2.0 * done.gq + done.qr, w1, wv1, d1, dv1, c1, cv1, touching, safe_gap,
        safe_center, sample, status
    )  # fmt: skip


@compiled
def _finish(memory, blocks, layout, run, now, counts, numbers, outputs):
    """Close a run's book; the state, about the well it began in, goes to its first two work rows."""
    q, p, size, tick = now.q, now.p, layout.size, run.clock.tick
    r = layout.work + 9 * size
    if now.touching:
        finish_impact(counts, numbers, outputs, run.struck.stiffness, now.t, tick)
    if now.status == _DECIDED:
        numbers[Numbers.DECIDED_AT] = now.t * tick
    gq, qr = tension_rows(memory, blocks, layout, q, r)
    numbers[Numbers.ENERGY] = (
        modal_energy(memory, layout, q, p)
        + tension_energy(layout.gamma, gq, qr)
        + contact_energy(run.struck.stiffness, now.d)
    )
    if now.home < 0.0:
        change_well(memory, blocks, layout, now.home, q, now.k, r)
    for row in range(size):
        q_end, p_end = memory[q + row], memory[p + row]
        memory[layout.work + row], memory[layout.work + size + row] = q_end, p_end
    counts[Counts.TIME], counts[Counts.STATUS], counts[Counts.SAMPLES] = now.t, now.status, now.sample


@compiled
def march_many(
    memory,
    blocks,
    layouts,
    stages,
    contact_rows,
    starts,
    reals,
    ticks,
    coarsest,
    finest,
    max_steps,
    counts,
    numbers,
    which,
    seen,
    parts,
    outputs,
):
    """March the runs *which*, two at a time; *memory*, *seen* and *parts* belong to the caller's thread.

    *layouts* are two places in memory that share the rows of the structure.  Outputs of a length, and a ledger,
    are for one run alone.
    """
    layout_a, layout_b = layouts
    room = (seen, parts)
    live_a, live_b, following = False, False, 1
    i_a = which[0]
    i_b = i_a
    data = (
        contact_rows[ticks[i_a, Ticks.CONTACT_ROW]],
        starts[ticks[i_a, Ticks.START_ROW]],
        reals[i_a],
        ticks[i_a],
    )
    counts_a, numbers_a = counts[i_a], numbers[i_a]
    counts_b, numbers_b = counts_a, numbers_a
    run_a, now_a = _begin(
        memory, blocks, layout_a, stages, data, coarsest, finest, max_steps, counts_a, numbers_a
    )
    run_b, now_b = run_a, now_a
    step_a, step_b, done_a, done_b = _NO_STEP, _NO_STEP, _NOTHING_DONE, _NOTHING_DONE
    live_a = True
    while live_a or live_b or following < which.size:
        if not live_a and following < which.size:
            i_a = which[following]
            data = (
                contact_rows[ticks[i_a, Ticks.CONTACT_ROW]],
                starts[ticks[i_a, Ticks.START_ROW]],
                reals[i_a],
                ticks[i_a],
            )
            counts_a, numbers_a = counts[i_a], numbers[i_a]
            run_a, now_a = _begin(
                memory, blocks, layout_a, stages, data, coarsest, finest, max_steps, counts_a, numbers_a
            )
            live_a, following = True, following + 1
        if not live_b and following < which.size:
            i_b = which[following]
            data = (
                contact_rows[ticks[i_b, Ticks.CONTACT_ROW]],
                starts[ticks[i_b, Ticks.START_ROW]],
                reals[i_b],
                ticks[i_b],
            )
            counts_b, numbers_b = counts[i_b], numbers[i_b]
            run_b, now_b = _begin(
                memory, blocks, layout_b, stages, data, coarsest, finest, max_steps, counts_b, numbers_b
            )
            live_b, following = True, following + 1
        if live_a:
            now_a, step_a = _choose(memory, blocks, layout_a, stages, run_a, now_a, counts_a)
        if live_b:
            now_b, step_b = _choose(memory, blocks, layout_b, stages, run_b, now_b, counts_b)
        if live_a and live_b:
            shaker_a = seen_from(run_a.struck, now_a.home, run_a.rest_contact)
            shaker_b = seen_from(run_b.struck, now_b.home, run_b.rest_contact)
            done_a, done_b = take_two(
                memory, blocks, stages, layout_a, shaker_a, step_a, layout_b, shaker_b, step_b
            )
        elif live_a:
            shaker_a = seen_from(run_a.struck, now_a.home, run_a.rest_contact)
            done_a = take_step(memory, blocks, layout_a, stages, shaker_a, step_a, outputs.ledger)
        else:
            shaker_b = seen_from(run_b.struck, now_b.home, run_b.rest_contact)
            done_b = take_step(memory, blocks, layout_b, stages, shaker_b, step_b, outputs.ledger)
        if live_a:
            now_a = _settle(
                memory,
                blocks,
                layout_a,
                stages,
                run_a,
                now_a,
                step_a,
                done_a,
                room,
                counts_a,
                numbers_a,
                outputs,
            )
            if now_a.status != _RUNNING:
                _finish(memory, blocks, layout_a, run_a, now_a, counts_a, numbers_a, outputs)
                live_a = False
        if live_b:
            now_b = _settle(
                memory,
                blocks,
                layout_b,
                stages,
                run_b,
                now_b,
                step_b,
                done_b,
                room,
                counts_b,
                numbers_b,
                outputs,
            )
            if now_b.status != _RUNNING:
                _finish(memory, blocks, layout_b, run_b, now_b, counts_b, numbers_b, outputs)
                live_b = False
