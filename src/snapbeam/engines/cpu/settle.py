"""After a step of a run: was the contact met or left in it, and what is kept of it."""

from __future__ import annotations

import math

from snapbeam.core.codes import RunStatus
from snapbeam.engines.columns import Counts, Numbers
from snapbeam.engines.cpu.rows import dot, flow_coefficients, modal_energy, speed_bound
from snapbeam.engines.cpu.state import Now, cut_slot, look_slot
from snapbeam.engines.cpu.step import Step, look_inside, observe, prepare, take_step
from snapbeam.engines.scalar.compile import compiled, inlined
from snapbeam.engines.scalar.decisions import (
    count_in_step,
    finish_impact,
    first_entry,
    is_quiet,
    safe_for,
    seen_from,
    track_extremes,
)
from snapbeam.engines.scalar.physics import contact_energy, contact_force, tension_energy
from snapbeam.engines.scalar.signals import first_fall, turning_point, widened

__all__ = ["settle"]

_OK, _DECIDED, _RUNNING = int(RunStatus.OK), int(RunStatus.DECIDED), int(RunStatus.RUNNING)
_NOT_FINITE, _STEP_LIMIT = int(RunStatus.NOT_FINITE), int(RunStatus.STEP_LIMIT)


@inlined
def _cut(step, run, ticks, length):
    """*step*, of another length and prepared in the slot for those."""
    return Step(
        ticks, cut_slot(run), length, step.phase, step.touching, step.q, step.p, step.k,
        step.q1, step.p1, step.k1, step.r
    )  # fmt: skip


@inlined
def _aside(step, run, length, size):
    """*step*, cut to *length* and written to the spare rows: a look ahead."""
    return Step(
        0, cut_slot(run), length, step.phase, step.touching, step.q, step.p, step.k,
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
        prepare(memory, layout, stages, impactor, part, cut_slot(run))
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
def settle(memory, blocks, layout, stages, run, now, step, done, room, counts, numbers, outputs):
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
            t, q, p, k, q1, p1, k1, now.home, now.stretch, now.quiet, w, wv, d, dv, c, cv, touching, safe_gap,
            safe_center, now.sample, _NOT_FINITE
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
            look, pieces = look_slot(run), run.step_pieces
            if ticks == 2 * clock.step:
                pieces *= 2
            elif ticks != clock.step:
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
                            t, q, p, k, q1, p1, k1, now.home, now.stretch, now.quiet, w, wv, d, dv, c, cv, True,
                            safe_gap, safe_center, now.sample, status
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
            prepare(memory, layout, stages, impactor, part, cut_slot(run))
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
    quiet, released = now.quiet, event and touching
    if event:
        safe_gap, safe_center = t, t
        if touching:
            finish_impact(counts, numbers, outputs, impactor.stiffness, t, tick)
            touching = False
            d1 = min(d1, 0.0)
        else:
            touching = True
            counts[Counts.TOUCHING], counts[Counts.ONSET] = 1, t
    if released or (not touching and (counts[Counts.STEPS] & 7) == 0):
        energy = modal_energy(memory, layout, q1, p1) + tension_energy(layout.gamma, done.gq, done.qr)
        quiet = is_quiet(energy, layout.gamma, layout.stretch)
        if not event and now.home < 0.0 and (counts[Counts.STEPS] & 15) == 0 and w1 > clock.decide_reach:
            if c1 > 0.0 and energy < clock.decide_energy:
                status = _DECIDED
    if clock.decide_crossings >= 0 and counts[Counts.CROSSINGS_LAST_QUARTER] > clock.decide_crossings:
        status = _DECIDED
    if status == _RUNNING and counts[Counts.STEPS] >= clock.max_steps:
        status = _STEP_LIMIT
    return Now(
        t, q1, p1, k1, q, p, k, now.home, 2.0 * done.gq + done.qr, quiet, w1, wv1, d1, dv1, c1, cv1, touching, safe_gap,
        safe_center, sample, status
    )  # fmt: skip
