"""The march of a single mode under Newton's law of impact, with sticking.

Flight is that of :mod:`snapbeam.engines.cpu.march`.  At an impact the relative velocity changes sign and is
multiplied by the coefficient of restitution.  Where impacts would follow each other ever faster, tip and
beam stay together: the beam then moves as the shaker does, until the force that this takes would have to
pull.
"""

from __future__ import annotations

import math

from snapbeam.core.codes import RunStatus
from snapbeam.engines.columns import Counts, Numbers, Ticks
from snapbeam.engines.cpu.rows import acceleration_rows, flow_coefficients, modal_energy, tension_rows
from snapbeam.engines.cpu.step import Step, look_inside, observe, prepare, take_step
from snapbeam.engines.scalar.compile import compiled
from snapbeam.engines.scalar.composition import TURNS
from snapbeam.engines.scalar.decisions import (
    change_well,
    count_in_step,
    first_entry,
    flight_level,
    seen_from,
    set_up,
    track_extremes,
)
from snapbeam.engines.scalar.physics import shaker_motion, sincos, tension_energy, tension_factors
from snapbeam.engines.scalar.signals import sign_of

__all__ = ["march_restitution", "march_restitution_many"]

_OK, _NOT_FINITE, _STEP_LIMIT = int(RunStatus.OK), int(RunStatus.NOT_FINITE), int(RunStatus.STEP_LIMIT)
_TWO_PI = 2.0 * math.pi
_PIECES = 16
"""Pieces that every flight step is looked into."""
_STICK = 1.0 / 512.0
"""Share of a flight step: where the next impact would follow sooner than this, the bodies stick."""


@compiled
def _hold(memory, blocks, layout, impactor, phase, q, p, k, r):
    """Put the mode where the shaker is; returns the contact force that holds it there, g.q and q.Gq."""
    sine, cosine = sincos(phase)
    motion, velocity = shaker_motion(impactor.amplitude, impactor.omega, sine, cosine)
    c = memory[layout.contact]
    for row in range(layout.size):
        memory[q + row] = 0.0
        memory[p + row] = 0.0
    memory[q] = (impactor.offset + motion) / c
    memory[p] = velocity / c
    gq, qr = tension_rows(memory, blocks, layout, q, r)
    along_g, along_r = tension_factors(layout.gamma, gq, qr)
    acceleration_rows(memory, layout, along_g, along_r, r, k)
    acceleration = -impactor.omega * impactor.omega * motion / c
    free = memory[k] - 2.0 * memory[layout.damping] * memory[p] - memory[layout.omega_squared] * memory[q]
    return (acceleration - free) / c, gq, qr


@compiled
def _enter(counts, numbers, outputs, onset, duration, force, impulse):
    """Enter an impact (duration 0, no finite force) or a time of sticking in the statistics."""
    at = counts[Counts.IMPACTS]
    if at < outputs.impacts.shape[0]:
        outputs.impacts[at, 0] = onset
        outputs.impacts[at, 1] = duration
        outputs.impacts[at, 2] = force
        outputs.impacts[at, 3] = impulse
    counts[Counts.IMPACTS] += 1
    numbers[Numbers.CONTACT_TIME] += duration


@compiled
def march_restitution(
    memory, blocks, layout, stages, struck, rests, clock, seen, parts, counts, numbers, outputs
):
    """March a single mode to its end; *rests* are the displacements of contact point and centre at rest.

    The contact stiffness of *struck* is read as the coefficient of restitution.
    """
    size = layout.size
    slot = (stages.flows + 1) // 2 * 4 * size + 2 * TURNS
    q, p, k = layout.work, layout.work + size, layout.work + 2 * size
    q1, p1, k1 = q + 3 * size, p + 3 * size, k + 3 * size
    q2, p2, k2 = q + 6 * size, p + 6 * size, k + 6 * size
    r = q + 9 * size
    cut_slot = layout.work + 10 * size
    look_slot = cut_slot + slot
    restitution, times = struck.stiffness, outputs.times
    tick, step = clock.tick, clock.step
    c_row = memory[layout.contact]
    home, impactor, rest_contact, rest_center = 1.0, struck, rests[0], rests[1]
    t = 0
    w, wv, d, dv, c, cv = observe(memory, layout, impactor, 0.0, q, p)
    w, c = w + rest_contact, c + rest_center
    counts[Counts.SIDE] = sign_of(c, 0)
    numbers[Numbers.MIN_DISPLACEMENT] = numbers[Numbers.MAX_DISPLACEMENT] = w
    numbers[Numbers.MIN_CENTER] = numbers[Numbers.MAX_CENTER] = c
    stuck, onset, impulse, peak = False, 0.0, 0.0, 0.0
    hit = d >= 0.0 and dv > 0.0
    sample, status = 0, _OK
    gq, qr = tension_rows(memory, blocks, layout, q, r)
    while True:
        if hit:
            # Newton's law, then the question whether the bodies part for any time worth the name
            blow = (1.0 + restitution) * dv / c_row
            numbers[Numbers.WORK] += blow / c_row * (wv + dv)
            numbers[Numbers.GROSS_WORK] += abs(blow / c_row * (wv + dv))
            before = 0.5 * memory[p] * memory[p]
            memory[p] += blow
            lost = blow / c_row * (wv + dv) - (0.5 * memory[p] * memory[p] - before)
            numbers[Numbers.DISSIPATED] += lost
            _enter(counts, numbers, outputs, t * tick, 0.0, math.nan, blow / c_row)
            phase = _TWO_PI * ((t % clock.period) / clock.period)
            force, _, _ = _hold(memory, blocks, layout, impactor, phase, q2, p2, k2, r)
            if restitution * dv <= 0.5 * force * c_row * c_row * _STICK * step * tick:
                stuck, onset, impulse, peak = True, t * tick, 0.0, 0.0
            d, dv, wv = 0.0, -restitution * dv, wv + (1.0 + restitution) * dv
            hit = False
        if t >= clock.end:
            break
        if layout.stretch > 0.0 and c * rest_center < 0.0:
            change_well(memory, blocks, layout, home, q, k, r)
            home = -home
            impactor = seen_from(struck, home, rests[0])
            rest_contact, rest_center = home * rests[0], home * rests[1]
        if counts[Counts.STEPS] >= clock.max_steps:
            status = _STEP_LIMIT
            break
        counts[Counts.STEPS] += 1
        gq, qr = tension_rows(memory, blocks, layout, q, r)
        along_g, along_r = tension_factors(layout.gamma, gq, qr)
        acceleration_rows(memory, layout, along_g, along_r, r, k)
        ticks = min(step >> flight_level(clock, False, 2.0 * gq + qr, layout.stretch), clock.end - t)
        phase = _TWO_PI * ((t % clock.period) / clock.period)
        length = ticks * tick
        released, dissipated, work, gross = False, 0.0, 0.0, 0.0
        pieces, piece = 0, 0.0
        if stuck:
            # Simpson's rule for what the force does; the step ends where the force would pull
            ticks = max(1, ticks // 4)
            length = ticks * tick
            _hold(memory, blocks, layout, impactor, phase, q, p, k, r)
            force1, _, _ = _hold(
                memory, blocks, layout, impactor, phase + impactor.omega * length, q1, p1, k1, r
            )
            if force1 < 0.0:
                low, high = 0, ticks
                while high - low > 1:
                    middle = (low + high) // 2
                    there = phase + impactor.omega * middle * tick
                    trial, _, _ = _hold(memory, blocks, layout, impactor, there, q1, p1, k1, r)
                    if trial < 0.0:
                        high = middle
                    else:
                        low = middle
                ticks, length, released = high, high * tick, True
            for i in range(3):
                weight = length / 6.0 * (4.0 if i == 1 else 1.0)
                there = phase + impactor.omega * 0.5 * i * length
                force, _, _ = _hold(memory, blocks, layout, impactor, there, q1, p1, k1, r)
                velocity = memory[p1] * c_row
                impulse += weight * force
                work += weight * force * velocity
                gross += weight * abs(force * velocity)
                dissipated += weight * 2.0 * memory[layout.damping] * memory[p1] * memory[p1]
                peak = max(peak, force)
        else:
            prepare(memory, layout, stages, impactor, length, cut_slot)
            done = take_step(
                memory,
                blocks,
                layout,
                stages,
                impactor,
                Step(ticks, cut_slot, length, phase, False, q, p, k, q1, p1, k1, r),
                True,
            )
            pieces, piece = _PIECES, length / _PIECES
            flow_coefficients(memory, layout, piece, look_slot)
            look_inside(
                memory, layout, impactor, look_slot, pieces, piece, phase, q, p, k, k1, parts, True, seen
            )
            seen[0, 0] = min(seen[0, 0], 0.0)
            entry = first_entry(seen, pieces, piece) if d < 0.0 or dv < 0.0 else 0.0
            if entry >= 0.0:
                hit = True
                cut = max(1, min(ticks, int(entry / tick)))
                if cut < ticks:
                    ticks, length = cut, cut * tick
                    prepare(memory, layout, stages, impactor, length, cut_slot)
                    done = take_step(
                        memory,
                        blocks,
                        layout,
                        stages,
                        impactor,
                        Step(ticks, cut_slot, length, phase, False, q, p, k, q1, p1, k1, r),
                        True,
                    )
            dissipated = done[5]
        w1, wv1, d1, dv1, c1, cv1 = observe(memory, layout, impactor, phase + impactor.omega * length, q1, p1)
        if not math.isfinite(d1 + dv1):
            status = _NOT_FINITE
            break
        w1, c1 = w1 + rest_contact, c1 + rest_center
        while sample < times.size:
            if times[sample] > (t + ticks) * tick and t + ticks < clock.end:
                break
            part = min(max(0.0, times[sample] - t * tick), length)
            there = phase + impactor.omega * part
            force, share = 0.0, part / length
            if stuck:
                force, here_g, here_r = _hold(memory, blocks, layout, impactor, there, q2, p2, k2, r)
                lost = dissipated * share
            else:
                prepare(memory, layout, stages, impactor, part, cut_slot)
                here = take_step(
                    memory,
                    blocks,
                    layout,
                    stages,
                    impactor,
                    Step(ticks, cut_slot, part, phase, False, q, p, k, q2, p2, k2, r),
                    True,
                )
                here_g, here_r, lost = here[0], here[1], here[5]
            for row in range(size):
                outputs.rows[sample, row] = memory[q2 + row]
                if home < 0.0:
                    outputs.rows[sample, row] += memory[layout.shift + row]
            energy = modal_energy(memory, layout, q2, p2) + tension_energy(layout.gamma, here_g, here_r)
            outputs.values[sample, 0] = observe(memory, layout, impactor, there, q2, p2)[2]
            outputs.values[sample, 1] = force
            outputs.values[sample, 2] = energy
            outputs.values[sample, 3] = 0.0
            outputs.values[sample, 4] = numbers[Numbers.WORK] + work * share
            outputs.values[sample, 5] = numbers[Numbers.DISSIPATED] + lost
            sample += 1
        numbers[Numbers.DISSIPATED] += dissipated
        numbers[Numbers.WORK] += work
        numbers[Numbers.GROSS_WORK] += gross
        track_extremes(numbers, w, wv, w1, wv1, c, cv, c1, cv1, length)
        count_in_step(counts, numbers, clock, t, length, c, cv, c1, cv1, seen, rest_center, pieces, piece)
        q, q1 = q1, q
        p, p1 = p1, p
        t += ticks
        w, wv, d, dv, c, cv = w1, wv1, d1, dv1, c1, cv1
        if stuck:
            d, dv = 0.0, 0.0
        if released or (stuck and t >= clock.end):
            _enter(counts, numbers, outputs, onset, t * tick - onset, peak, impulse)
            numbers[Numbers.PEAK_FORCE] = max(numbers[Numbers.PEAK_FORCE], peak)
            stuck, d, dv = False, -0.0, -1.0
    gq, qr = tension_rows(memory, blocks, layout, q, r)
    numbers[Numbers.ENERGY] = modal_energy(memory, layout, q, p) + tension_energy(layout.gamma, gq, qr)
    if home < 0.0:
        change_well(memory, blocks, layout, home, q, k, r)
    counts[Counts.TIME], counts[Counts.STATUS], counts[Counts.SAMPLES] = t, status, sample


@compiled
def march_restitution_many(
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
    """March the runs *which*, one after the other; *memory*, *seen* and *parts* belong to the caller's thread."""
    layout = layouts[0]
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
        march_restitution(
            memory,
            blocks,
            layout,
            stages,
            impactor,
            rests,
            clock,
            seen,
            parts,
            counts[i],
            numbers[i],
            outputs,
        )
