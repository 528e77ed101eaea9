"""The CUDA engine's kernel: the march of :mod:`snapbeam.engines.cpu.march`, a block of threads a trajectory.

A block takes a run from the queue, marches it to its end, enters what it found and takes the next.  After a
*budget* of steps every block lays down its run, wherever it is, and the kernel returns; the next call
goes on from the same bits.  So a call is short, whatever the runs are: the host can show progress, be
interrupted, and share the device with a display.

The first thread keeps the books (counts and numbers of a run); all threads make the same decisions.
"""

from __future__ import annotations

import math
from functools import cache
from typing import Any, NamedTuple

from numba import cuda, float64, int64

from snapbeam.core.codes import RunStatus
from snapbeam.engines.columns import Counts, Numbers, Reals, Ticks
from snapbeam.engines.cpu.step import Impactor
from snapbeam.engines.cuda.block import PARTS, SIMULATED, Block, shared, stride_of
from snapbeam.engines.cuda.layout import RESIDENT_WARPS, launch_bounds
from snapbeam.engines.cuda.step import Mode, functions
from snapbeam.engines.scalar.decisions import (
    PIECES,
    Clock,
    contact_level,
    count_in_step,
    finish_impact,
    first_entry,
    flight_level,
    is_quiet,
    safe_for,
    seen_from,
    ticks_of,
    track_extremes,
)
from snapbeam.engines.scalar.physics import (
    contact_energy,
    mode_energy,
    tension_acceleration,
    tension_energy,
    tension_factors,
)
from snapbeam.engines.scalar.signals import first_fall, sign_of, turning_point, widened

__all__ = ["march_kernel"]

_OK, _DECIDED, _RUNNING = int(RunStatus.OK), int(RunStatus.DECIDED), int(RunStatus.RUNNING)
_NOT_FINITE, _STEP_LIMIT = int(RunStatus.NOT_FINITE), int(RunStatus.STEP_LIMIT)
_TWO_PI = 2.0 * math.pi
# What a pass through a step is for.
_WHOLE, _CUT, _DEEPEST = 0, 1, 2

_first_entry, _count_in_step = shared(first_entry), shared(count_in_step)
_finish_impact, _track_extremes = shared(finish_impact), shared(track_extremes)


class Unrecorded(NamedTuple):
    """The one of :class:`snapbeam.engines.scalar.decisions.Outputs` that an impact asks for, with no room."""

    impacts: Any


@cache
def march_kernel(order: int, threads: int, columns: int, warps: int = RESIDENT_WARPS) -> Any:
    """The kernel for a composition, a number of threads and of coupled modes (at most)."""
    step_functions = functions(order, threads, columns)
    distinct, synchronise = step_functions.distinct, step_functions.synchronise
    sum_one, sum_four = step_functions.sum_one, step_functions.sum_four
    tension, flow_into, prepare = step_functions.tension, step_functions.flow_into, step_functions.prepare
    observe, take_step = step_functions.observe, step_functions.take_step
    look_inside = step_functions.look_inside
    stride, partial, room = stride_of(threads), 4 * PARTS, 2 * threads + columns
    sums = 4 * stride

    def march(
        structure, places, coupling, gamma, rest_stretch, contact_rows, starts, reals, ticks, queue_order,
        queue, slots, marks, kept, modes_kept, flows, turns, seen, counts, numbers,
        coarsest, finest, max_steps, budget,
    ):  # fmt: skip
        lane, index = cuda.threadIdx.x, cuda.blockIdx.x
        terms = cuda.shared.array(sums, float64)
        parts = cuda.shared.array(partial, float64)
        values = cuda.shared.array(room, float64)
        drawn = cuda.shared.array(1, int64)
        i = lane
        while i < max(sums, room):
            if i < sums:
                terms[i] = 0.0
            if i < room:
                values[i] = 0.0
            i += threads
        column = cuda.local.array(columns, float64)
        for j in range(columns):
            column[j] = coupling[j, lane]
        block = Block(
            lane, terms[lane:], terms[lane % partial // PARTS * stride + lane % PARTS :], parts,
            values[places[0, lane] :], values[places[1, lane] :], column,
            flows[index], turns[index], seen[index],
        )  # fmt: skip
        shift = structure[6, lane]
        cut_slot = finest + 2
        whole_look = (finest + 3) * distinct
        unrecorded = Unrecorded(numbers[:0])
        run = slots[index]
        left = budget
        synchronise()
        while left > 0:
            fresh = run < 0
            if fresh:
                if lane == 0:
                    drawn[0] = cuda.atomic.add(queue, 0, 1)
                synchronise()
                place = drawn[0]
                synchronise()
                if place >= queue_order.size:
                    break
                run = queue_order[place]
            real, whole, own, book = reals[run], ticks[run], counts[run], numbers[run]
            struck = Impactor(
                real[Reals.OFFSET], real[Reals.AMPLITUDE], real[Reals.OMEGA],
                real[Reals.STIFFNESS],
            )  # fmt: skip
            clock = Clock(
                real[Reals.TICK], whole[Ticks.STEP], whole[Ticks.PERIOD], whole[Ticks.END],
                whole[Ticks.LAST_QUARTER], coarsest, finest, max_steps, real[Reals.DECIDE_ENERGY],
                real[Reals.DECIDE_REACH], whole[Ticks.DECIDE_CROSSINGS],
            )  # fmt: skip
            at_contact, at_center = real[Reals.REST_CONTACT], real[Reals.REST_CENTER]
            mode = Mode(
                structure[0, lane], structure[1, lane], structure[2, lane], structure[3, lane],
                structure[5, lane], contact_rows[whole[Ticks.CONTACT_ROW], lane],
            )  # fmt: skip
            tick, step = clock.tick, clock.step
            step_time = step * tick
            fastest = struck.omega
            for j in range(threads):
                fastest = max(fastest, structure[0, j])
            finest_look = _TWO_PI / (PIECES * fastest)
            step_pieces = max(4, math.ceil(step_time / finest_look))
            shaker_speed = struck.amplitude * struck.omega

            if fresh:
                for level in range(finest + 2):
                    prepare(block, mode, struck.omega, 2.0 * step_time / (1 << level), level)
                flow_into(block, mode, step_time / step_pieces, whole_look)
                start = whole[Ticks.START_ROW]
                q, p = starts[start, 0, lane], starts[start, 1, lane]
                home, g = 1.0, structure[4, lane]
                t, steps = 0, 0
            else:
                q, p = modes_kept[index, 0, lane], modes_kept[index, 1, lane]
                home = float(marks[index, 2])
                g = home * structure[4, lane]
                t, steps = own[Counts.TIME], own[Counts.STEPS]
            impactor = seen_from(struck, home, at_contact)
            rest_contact, rest_center = home * at_contact, home * at_center
            if fresh:
                k, gq, qr = 0.0, 0.0, 0.0
                w, wv, d, dv, c, cv = observe(block, mode, impactor, 0.0, q, p)
                w += rest_contact
                c += rest_center
                touching = d > 0.0 or (d == 0.0 and dv > 0.0)
                onset, safe_gap, safe_center, quiet = t, t, t, False
                deepest = max(d, 0.0)
                if lane == 0:
                    own[Counts.STATUS] = _RUNNING
                    own[Counts.TOUCHING], own[Counts.ONSET] = int(touching), t
                    own[Counts.SIDE] = sign_of(c, 0)
                    book[Numbers.MIN_DISPLACEMENT] = book[Numbers.MAX_DISPLACEMENT] = w
                    book[Numbers.MIN_CENTER] = book[Numbers.MAX_CENTER] = c
                    book[Numbers.DEEPEST] = deepest
            else:
                k = modes_kept[index, 2, lane]
                w, wv, d, dv = kept[index, 0], kept[index, 1], kept[index, 2], kept[index, 3]
                c, cv, gq, qr = kept[index, 4], kept[index, 5], kept[index, 6], kept[index, 7]
                touching, onset = own[Counts.TOUCHING] != 0, own[Counts.ONSET]
                safe_gap, safe_center, quiet = marks[index, 0], marks[index, 1], marks[index, 3] != 0
                deepest = book[Numbers.DEEPEST]
            synchronise()

            status = _RUNNING
            while True:
                if t >= clock.end:
                    status = _OK
                    break
                if left <= 0:
                    break
                left -= 1
                change = rest_stretch > 0.0 and c * rest_center < 0.0
                if change:
                    # the other well becomes the origin; see change_well
                    q -= home * shift
                    g, home = -g, -home
                    impactor = seen_from(struck, home, at_contact)
                    rest_contact, rest_center = home * at_contact, home * at_center
                if change or fresh:
                    r = tension(block, q)
                    gq, qr, _, _ = sum_four(block, g * q, r * q, 0.0, 0.0)
                    along_g, along_r = tension_factors(gamma, gq, qr)
                    k = tension_acceleration(along_g, along_r, g, r)
                if fresh:
                    energy = sum_one(block, mode_energy(mode.omega, q, p)) + tension_energy(gamma, gq, qr)
                    fresh, quiet = False, is_quiet(energy, gamma, rest_stretch)
                if steps >= max_steps:
                    status = _STEP_LIMIT
                    break
                steps += 1
                level = flight_level(clock, quiet, 2.0 * gq + qr, rest_stretch)
                if touching:
                    level = max(level, contact_level(clock, (t - onset) * tick, d, dv))
                span, slot = ticks_of(clock, level), level + 1
                if t + span > clock.end:
                    span, slot = clock.end - t, cut_slot
                phase = _TWO_PI * ((t % clock.period) / clock.period)
                length = span * tick
                here, purpose = length, _WHOLE
                event, entered = False, False
                pieces, piece = 0, 0.0
                q1, p1, k1 = q, p, k
                w1, wv1, d1, dv1, c1, cv1 = w, wv, d, dv, c, cv
                gq1, qr1, impulse, work, gross = gq, qr, 0.0, 0.0, 0.0
                # one text for the step, the step cut short by an event, and the look for the deepest point
                while True:
                    if slot == cut_slot:
                        prepare(block, mode, struck.omega, here, slot)
                    q2, p2, k2, gq2, qr2, impulse2, work2, gross2 = take_step(
                        block, mode, g, gamma, impactor, slot, here, phase, touching, q, p, k
                    )
                    w2, wv2, d2, dv2, c2, cv2 = observe(
                        block, mode, impactor, phase + impactor.omega * here, q2, p2
                    )
                    if purpose == _DEEPEST:
                        deepest = max(deepest, d2)
                        break
                    q1, p1, k1 = q2, p2, k2
                    w1, wv1, d1, dv1, c1, cv1 = w2 + rest_contact, wv2, d2, dv2, c2 + rest_center, cv2
                    gq1, qr1, impulse, work, gross = gq2, qr2, impulse2, work2, gross2
                    if purpose == _WHOLE:
                        if not math.isfinite(d1 + dv1):
                            status = _NOT_FINITE
                            break
                        cut = span
                        if touching:
                            if d1 <= 0.0:
                                event = True
                                if d > 0.0:
                                    cut = max(1, int(first_fall(d, dv, d1, dv1, length) * span))
                        else:
                            if t + span > min(safe_gap, safe_center):
                                oq = abs(mode.omega * q) + abs(p)
                                gap_bound, gap_push, center_bound, center_push = sum_four(
                                    block, abs(mode.contact) * oq, mode.contact * k,
                                    abs(mode.center) * oq, mode.center * k,
                                )  # fmt: skip
                                if t + span > safe_gap:
                                    safe = safe_for(-d, gap_bound, shaker_speed, gap_push, step_time)
                                    safe_gap = t + int(safe / tick)
                                if t + span > safe_center:
                                    safe = safe_for(abs(c), center_bound, 0.0, center_push, step_time)
                                    safe_center = t + int(safe / tick)
                            if t + span > min(safe_gap, safe_center):
                                look, pieces = whole_look, step_pieces
                                if span == 2 * step:
                                    pieces *= 2
                                elif span != step:
                                    look += 1
                                    pieces = max(2, math.ceil(length / finest_look))
                                    flow_into(block, mode, length / pieces, look)
                                piece = length / pieces
                                look_inside(block, mode, impactor, look, pieces, piece, phase, q, p, k, k1)
                                if t + span > safe_gap:
                                    entry = _first_entry(block.seen, pieces, piece)
                                    if entry >= 0.0:
                                        event, cut = True, min(span, int(entry / tick))
                                        entered = cut < 1
                        if entered:
                            break
                        if cut < span:
                            span, length = cut, cut * tick
                            here, slot, purpose = length, cut_slot, _CUT
                            continue
                    if touching:
                        deepest = max(deepest, d1)
                        turn = turning_point(d, dv, d1, dv1, length) if dv > 0.0 else -1.0
                        if turn > 0.0 and widened(d, deepest, d, dv, d1, dv1, length)[1] > deepest:
                            here, slot, purpose = turn * length, cut_slot, _DEEPEST
                            continue
                    break
                if status == _NOT_FINITE:
                    break
                if entered:
                    touching, onset = True, t
                    if lane == 0:
                        own[Counts.TOUCHING], own[Counts.ONSET] = 1, t
                    continue

                counted = touching or t + span > safe_center
                if lane == 0:
                    if touching:
                        book[Numbers.IMPULSE] += impulse
                        book[Numbers.WORK] += work
                        book[Numbers.GROSS_WORK] += gross
                        book[Numbers.DEEPEST] = deepest
                    _track_extremes(book, w, wv, w1, wv1, c, cv, c1, cv1, length)
                    if counted:
                        _count_in_step(
                            own,
                            book,
                            clock,
                            t,
                            length,
                            c,
                            cv,
                            c1,
                            cv1,
                            block.seen,
                            rest_center,
                            pieces,
                            piece,
                        )

                q, p, k = q1, p1, k1
                t += span
                w, wv, d, dv, c, cv = w1, wv1, d1, dv1, c1, cv1
                gq, qr = gq1, qr1
                released = event and touching
                if event:
                    safe_gap, safe_center = t, t
                    if touching:
                        if lane == 0:
                            _finish_impact(own, book, unrecorded, impactor.stiffness, t, tick)
                        touching, deepest = False, 0.0
                        d = min(d, 0.0)
                    else:
                        touching, onset = True, t
                        if lane == 0:
                            own[Counts.TOUCHING], own[Counts.ONSET] = 1, t
                if released or (not touching and (steps & 7) == 0):
                    energy = sum_one(block, mode_energy(mode.omega, q, p)) + tension_energy(gamma, gq, qr)
                    quiet = is_quiet(energy, gamma, rest_stretch)
                    if not event and home < 0.0 and (steps & 15) == 0 and w > clock.decide_reach:
                        if c > 0.0 and energy < clock.decide_energy:
                            status = _DECIDED
                            break
                if counted and clock.decide_crossings >= 0:
                    synchronise()
                    if own[Counts.CROSSINGS_LAST_QUARTER] > clock.decide_crossings:
                        status = _DECIDED
                        break

            if lane == 0:
                own[Counts.TIME], own[Counts.STATUS], own[Counts.STEPS] = t, status, steps
            if status == _RUNNING:
                modes_kept[index, 0, lane], modes_kept[index, 1, lane], modes_kept[index, 2, lane] = q, p, k
                if lane == 0:
                    marks[index, 0], marks[index, 1] = safe_gap, safe_center
                    marks[index, 2], marks[index, 3] = int(home), int(quiet)
                    kept[index, 0], kept[index, 1], kept[index, 2], kept[index, 3] = w, wv, d, dv
                    kept[index, 4], kept[index, 5], kept[index, 6], kept[index, 7] = c, cv, gq, qr
            else:
                linear = sum_one(block, mode_energy(mode.omega, q, p))
                if lane == 0:
                    if touching:
                        _finish_impact(own, book, unrecorded, impactor.stiffness, t, tick)
                    if status == _DECIDED:
                        book[Numbers.DECIDED_AT] = t * tick
                    book[Numbers.ENERGY] = (
                        linear + tension_energy(gamma, gq, qr) + contact_energy(impactor.stiffness, d)
                    )
                    cuda.atomic.add(queue, 1, 1)
                run = -1
        if lane == 0:
            slots[index] = run

    bounds = {} if SIMULATED else {"launch_bounds": launch_bounds(threads, columns, warps)}
    return cuda.jit(**bounds)(march)
