"""The CPU engine: one trajectory after the other, each with steps that its own contacts decide.

In free flight a trajectory takes steps of a fixed length, as many as a bound on the speed of the gap says
are safe; near the shaker it looks inside each step with a resolution finer than the fastest mode, and a
step that would enter the contact is cut where it does.  In contact, steps grow from the onset and shrink
towards the release, which is located too, so that the d^(3/2) edges of the force fall between steps.  Time is
an integer number of ticks; the phase of the drive comes from that integer alone.  No trajectory knows
of any other, so results do not depend on batch, order or threads.
"""

from __future__ import annotations

import math

import numpy as np

from snapbeam.codes import RunStatus
from snapbeam.kernels.compile import compiled
from snapbeam.kernels.composition import TURNS
from snapbeam.kernels.cpu_step import look_inside, observe, prepare, take_step
from snapbeam.kernels.fields import Counts, Numbers, Ticks
from snapbeam.kernels.march_parts import (
    PIECES,
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
from snapbeam.kernels.statistics import extremes, first_fall, sign_of, turning_point

__all__ = ["march", "march_many"]

_OK, _DECIDED, _RUNNING = int(RunStatus.OK), int(RunStatus.DECIDED), int(RunStatus.RUNNING)
_NOT_FINITE, _STEP_LIMIT = int(RunStatus.NOT_FINITE), int(RunStatus.STEP_LIMIT)
_TWO_PI = 2.0 * math.pi


@compiled
def march(memory, blocks, layout, composition, struck, rests, clock, counts, numbers, outputs):
    """March one trajectory to its end; the state and the statistics are kept in the arrays given.

    The first two work rows of *memory* hold q and p, before and after, about the well the run began in.
    *rests* are the displacements of the contact point and of the centre in that well, seen from the shaker's
    side; *struck* is the shaker and its contact.
    """
    size = layout.size
    slot = (composition.flow.size + 1) // 2 * 4 * size + 2 * TURNS
    q, p, k = layout.work, layout.work + size, layout.work + 2 * size
    q1, p1, k1 = q + 3 * size, p + 3 * size, k + 3 * size
    q2, p2, k2 = q + 6 * size, p + 6 * size, k + 6 * size
    r = q + 9 * size
    coefficients = layout.work + 10 * size
    cut_slot = coefficients + (clock.finest + 1) * slot
    look_slot = cut_slot + slot
    tick, step = clock.tick, clock.step
    step_time = step * tick
    for level in range(clock.finest + 1):
        prepare(memory, layout, composition, struck, step_time / (1 << level), coefficients + level * slot)
    fastest = struck.omega
    for row in range(size):
        fastest = max(fastest, memory[layout.omega + row])
    finest_look = _TWO_PI / (PIECES * fastest)
    step_pieces = max(4, math.ceil(step_time / finest_look))
    flow_coefficients(memory, layout, step_time / step_pieces, look_slot)
    seen = np.empty((step_pieces + 1, 4))
    shaker_speed = struck.amplitude * struck.omega
    ledger = outputs.ledger

    t = counts[Counts.TIME]
    phase = _TWO_PI * ((t % clock.period) / clock.period)
    gq, qr = tension_rows(memory, blocks, layout, q, r)
    along_g, along_r = tension_factors(layout.gamma, gq, qr)
    acceleration_rows(memory, layout, along_g, along_r, r, k)
    stretch = 2.0 * gq + qr
    home, impactor, rest_contact, rest_center = 1.0, struck, rests[0], rests[1]
    w, wv, d, dv, c, cv = observe(memory, layout, impactor, phase, q, p)
    w += rest_contact
    c += rest_center
    touching = d > 0.0 or (d == 0.0 and dv > 0.0)
    counts[Counts.TOUCHING], counts[Counts.ONSET] = touching, t
    counts[Counts.SIDE] = sign_of(c, 0)
    numbers[Numbers.MIN_DISPLACEMENT] = numbers[Numbers.MAX_DISPLACEMENT] = w
    numbers[Numbers.MIN_CENTER] = numbers[Numbers.MAX_CENTER] = c
    numbers[Numbers.DEEPEST] = max(d, 0.0)
    safe_gap, safe_center = t, t
    sample = 0
    status = _OK
    while t < clock.end:
        if layout.stretch > 0.0 and c * rest_center < 0.0:
            stretch = change_well(memory, blocks, layout, home, q, k, r)
            home = -home
            impactor = seen_from(struck, home, rests[0])
            rest_contact, rest_center = home * rests[0], home * rests[1]
        if counts[Counts.STEPS] >= clock.max_steps:
            status = _STEP_LIMIT
            break
        counts[Counts.STEPS] += 1
        level = flight_level(clock, stretch, layout.stretch)
        if touching:
            level = max(level, contact_level(clock, (t - counts[Counts.ONSET]) * tick, d, dv))
        ticks, at = step >> level, coefficients + level * slot
        if t + ticks > clock.end:
            ticks, at = clock.end - t, cut_slot
            prepare(memory, layout, composition, impactor, ticks * tick, at)
        phase = _TWO_PI * ((t % clock.period) / clock.period)
        length = ticks * tick
        done = take_step(
            memory,
            blocks,
            layout,
            composition,
            impactor,
            at,
            length,
            phase,
            touching,
            ledger,
            q,
            p,
            k,
            q1,
            p1,
            k1,
            r,
        )
        w1, wv1, d1, dv1, c1, cv1 = observe(memory, layout, impactor, phase + impactor.omega * length, q1, p1)
        if not math.isfinite(d1 + dv1):
            status = _NOT_FINITE
            break

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
                safe_gap = t + int(safe_for(-d, bound, shaker_speed, push, step_time) / tick)
            if t + ticks > safe_center:
                bound = speed_bound(memory, layout, layout.center, q, p)
                push = dot(memory, size, layout.center, k)
                safe_center = t + int(safe_for(abs(c), bound, 0.0, push, step_time) / tick)
            if t + ticks > min(safe_gap, safe_center):
                look, pieces = look_slot, step_pieces
                if ticks != step:
                    look += 4 * size
                    pieces = max(2, math.ceil(length / finest_look))
                    flow_coefficients(memory, layout, length / pieces, look)
                piece = length / pieces
                look_inside(memory, layout, impactor, look, pieces, piece, phase, q, p, k, k1, q2, p2, seen)
                if t + ticks > safe_gap:
                    entry = first_entry(seen, pieces, piece)
                    if entry >= 0.0:
                        event, cut = True, min(ticks, int(entry / tick))
                        if cut < 1:
                            touching = True
                            counts[Counts.TOUCHING], counts[Counts.ONSET] = 1, t
                            continue
        if cut < ticks:
            ticks, length = cut, cut * tick
            prepare(memory, layout, composition, impactor, length, cut_slot)
            done = take_step(
                memory,
                blocks,
                layout,
                composition,
                impactor,
                cut_slot,
                length,
                phase,
                touching,
                ledger,
                q,
                p,
                k,
                q1,
                p1,
                k1,
                r,
            )
            w1, wv1, d1, dv1, c1, cv1 = observe(
                memory, layout, impactor, phase + impactor.omega * length, q1, p1
            )
        w1 += rest_contact
        c1 += rest_center

        # what is recorded at instants inside the step
        while sample < outputs.times.size:
            if outputs.times[sample] > (t + ticks) * tick and t + ticks < clock.end:
                break
            part = min(max(0.0, outputs.times[sample] - t * tick), length)
            prepare(memory, layout, composition, impactor, part, cut_slot)
            here = take_step(
                memory,
                blocks,
                layout,
                composition,
                impactor,
                cut_slot,
                part,
                phase,
                touching,
                ledger,
                q,
                p,
                k,
                q2,
                p2,
                k2,
                r,
            )
            depth = observe(memory, layout, impactor, phase + impactor.omega * part, q2, p2)[2]
            energy = modal_energy(memory, layout, q2, p2) + tension_energy(layout.gamma, here[0], here[1])
            for row in range(size):
                outputs.rows[sample, row] = memory[q2 + row]
                if home < 0.0:
                    outputs.rows[sample, row] += memory[layout.shift + row]
            outputs.values[sample, 0] = depth
            outputs.values[sample, 1] = contact_force(impactor.stiffness, depth)
            outputs.values[sample, 2] = energy
            outputs.values[sample, 3] = contact_energy(impactor.stiffness, depth)
            outputs.values[sample, 4] = numbers[Numbers.WORK] + here[3]
            outputs.values[sample, 5] = numbers[Numbers.DISSIPATED] + here[5]
            sample += 1

        # statistics of the step
        if touching:
            numbers[Numbers.IMPULSE] += done[2]
            numbers[Numbers.WORK] += done[3]
            numbers[Numbers.GROSS_WORK] += done[4]
            deepest = max(numbers[Numbers.DEEPEST], d1)
            turn = turning_point(d, dv, d1, dv1, length)
            if turn > 0.0 and dv > 0.0 and extremes(d, dv, d1, dv1, length)[1] > deepest:
                part = turn * length
                prepare(memory, layout, composition, impactor, part, cut_slot)
                take_step(
                    memory,
                    blocks,
                    layout,
                    composition,
                    impactor,
                    cut_slot,
                    part,
                    phase,
                    True,
                    False,
                    q,
                    p,
                    k,
                    q2,
                    p2,
                    k2,
                    r,
                )
                depth = observe(memory, layout, impactor, phase + impactor.omega * part, q2, p2)[2]
                deepest = max(deepest, depth)
            numbers[Numbers.DEEPEST] = deepest
        numbers[Numbers.DISSIPATED] += done[5]
        track_extremes(numbers, w, wv, w1, wv1, c, cv, c1, cv1, length)
        if touching or t + ticks > safe_center:
            count_in_step(counts, numbers, clock, t, length, c, cv, c1, cv1, seen, rest_center, pieces, piece)

        # accept
        q, q1 = q1, q
        p, p1 = p1, p
        k, k1 = k1, k
        t += ticks
        w, wv, d, dv, c, cv = w1, wv1, d1, dv1, c1, cv1
        stretch = 2.0 * done[0] + done[1]
        if event:
            safe_gap, safe_center = t, t
            if touching:
                finish_impact(counts, numbers, outputs, impactor.stiffness, t, tick)
                touching = False
                d = min(d, 0.0)
            else:
                touching = True
                counts[Counts.TOUCHING], counts[Counts.ONSET] = 1, t
        elif not touching and home < 0.0 and (counts[Counts.STEPS] & 15) == 0 and w > clock.decide_reach:
            energy = modal_energy(memory, layout, q, p) + tension_energy(layout.gamma, done[0], done[1])
            if c > 0.0 and energy < clock.decide_energy:
                status = _DECIDED
                break
        if clock.decide_crossings >= 0 and counts[Counts.CROSSINGS_LAST_QUARTER] > clock.decide_crossings:
            status = _DECIDED
            break
    if touching:
        finish_impact(counts, numbers, outputs, impactor.stiffness, t, tick)
    if status == _DECIDED:
        numbers[Numbers.DECIDED_AT] = t * tick
    gq, qr = tension_rows(memory, blocks, layout, q, r)
    numbers[Numbers.ENERGY] = (
        modal_energy(memory, layout, q, p)
        + tension_energy(layout.gamma, gq, qr)
        + contact_energy(impactor.stiffness, d)
    )
    if home < 0.0:
        change_well(memory, blocks, layout, home, q, k, r)
    for row in range(size):
        q_end, p_end = memory[q + row], memory[p + row]
        memory[layout.work + row], memory[layout.work + size + row] = q_end, p_end
    counts[Counts.TIME], counts[Counts.STATUS], counts[Counts.SAMPLES] = t, status, sample


@compiled
def march_many(
    memory,
    blocks,
    layout,
    composition,
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
    outputs,
):
    """March the runs *which*, one after the other; *memory* belongs to the caller's thread."""
    for i in which:
        impactor, clock, rests = set_up(
            memory,
            layout,
            contact_rows[ticks[i, Ticks.CONTACT_ROW]],
            starts[ticks[i, Ticks.START_ROW]],
            reals[i],
            ticks[i],
            coarsest,
            finest,
            max_steps,
        )
        march(memory, blocks, layout, composition, impactor, rests, clock, counts[i], numbers[i], outputs)
