"""After a step of a run: was the contact met or left in it, and what is kept of it."""

from __future__ import annotations

import math
from typing import NamedTuple

from snapbeam.core.codes import RunStatus
from snapbeam.engines.cpu.recording import record_contact, record_instants
from snapbeam.engines.cpu.rows import (
    beam_energy,
    dot,
    flow_coefficients,
    modal_energies,
    modal_energy,
    speed_bound,
)
from snapbeam.engines.cpu.settling.hardest import hardest_point
from snapbeam.engines.cpu.settling.look import look_inside
from snapbeam.engines.cpu.state import Now, Rows, Watch, cut_slot, look_slot
from snapbeam.engines.cpu.step import Step, observe, prepare, take_step, tapped_step
from snapbeam.engines.cpu.strikers.meet import (
    count_others,
    entry_of_others,
    first_edge,
    keep_others,
    see_others,
    trusted,
    turn_others,
)
from snapbeam.engines.cpu.uneven import about_level, above_own_well, at_center, lifted, second_well
from snapbeam.engines.cpu.world.around import count_given
from snapbeam.engines.cpu.world.circuit import calm, count_circuit, known_for, passed_by, tapped_speed
from snapbeam.engines.cpu.world.forced import extra_speed
from snapbeam.engines.scalar.compile import inlined
from snapbeam.engines.scalar.contact import jumps, slack_at
from snapbeam.engines.scalar.decisions import (
    TRUST,
    Seen,
    count_in_step,
    entry_again,
    finish_impact,
    first_entry,
    is_quiet,
    safe_for,
    track,
    track_energy,
)
from snapbeam.engines.scalar.extras import observe as observe_extras
from snapbeam.engines.scalar.physics import tension_energy
from snapbeam.engines.scalar.signals import first_fall, first_rise
from snapbeam.engines.scalar.tip import seen_from

__all__ = ["settle"]

_OK, _DECIDED, _RUNNING = int(RunStatus.OK), int(RunStatus.DECIDED), int(RunStatus.RUNNING)
_LOCATIONS = 4
"""Newton steps in which the onset of a force that begins with a jump is located, at most."""
_NOT_FINITE, _STEP_LIMIT = int(RunStatus.NOT_FINITE), int(RunStatus.STEP_LIMIT)


class Met(NamedTuple):
    """What a step met: whether it enters or leaves the contact, where it is cut, and how it was looked into."""

    event: bool
    cut: int
    """Ticks; 0: the contact begins with the step."""
    entry: float
    """Seconds into the step at which the gap closes; negative: it does not."""
    safe_gap: int
    safe_center: int
    pieces: int
    piece: float


@inlined
def cut_to(step, run, ticks, length):
    """*step*, of another length and prepared in the slot for those."""
    return Step(
        ticks, cut_slot(run), length, step.phase, step.touching, step.q, step.p, step.k,
        step.q1, step.p1, step.k1, step.r
    )  # fmt: skip


@inlined
def meets(memory, layout, run, now, tip, step, seen1, room):
    """Whether and where a step enters or leaves the contact."""
    seen, clock, tick = now.seen, run.clock, run.clock.tick
    safe_gap, safe_center = now.watch.safe_gap, now.watch.safe_center
    event, cut, entry, pieces, piece = False, step.ticks, -1.0, 0, 0.0
    after = now.t + step.ticks
    if step.touching:
        if seen1.d <= 0.0:
            event = True
            if seen.d > 0.0:
                fall = first_fall(seen.d, seen.dv, seen1.d, seen1.dv, step.length)
                cut = max(1, int(fall * step.ticks))
        slack = slack_at(tip.law, seen.d, seen.dv, seen1.d, seen1.dv, step.length)
        if slack >= 0.0 and slack * step.ticks + 1.0 < cut:
            # the force has an edge there, though the contact goes on
            event, cut = False, int(slack * step.ticks) + 1
        return Met(event, cut, entry, safe_gap, safe_center, pieces, piece)
    size, known = layout.size, known_for(layout.circuit, run.step_time)
    if after > safe_gap:
        bound = speed_bound(memory, layout, layout.contact, step.q, step.p)
        bound = tapped_speed(
            memory, size, layout.omega, layout.circuit, layout.contact, step.q, step.p, bound, TRUST * known
        )
        bound += extra_speed(layout.forced, memory, size, tip.drive, layout.contact, TRUST * run.step_time)
        push = dot(memory, size, layout.contact, step.k)
        safe_gap = now.t + int(safe_for(-seen.d, bound, run.tip_speed, push, known) / tick)
    if after > safe_center:
        bound = speed_bound(memory, layout, layout.center, step.q, step.p)
        bound = tapped_speed(
            memory, size, layout.omega, layout.circuit, layout.center, step.q, step.p, bound, TRUST * known
        )
        bound += extra_speed(layout.forced, memory, size, tip.drive, layout.center, TRUST * run.step_time)
        push = dot(memory, size, layout.center, step.k)
        safe_center = now.t + int(
            safe_for(abs(at_center(layout.uneven, seen.c)), bound, 0.0, push, known) / tick
        )
    safe_gap = trusted(memory, layout.others, now.t, safe_gap)
    safe_center = trusted(memory, layout.others, now.t, safe_center)
    if after > min(safe_gap, safe_center):
        look, pieces = look_slot(run), run.step_pieces
        if step.ticks == 2 * clock.step:
            pieces *= 2
        elif step.ticks != clock.step:
            look += 4 * size
            pieces = max(2, math.ceil(step.length / run.finest_look))
            flow_coefficients(memory, layout, step.length / pieces, look)
        piece = step.length / pieces
        free = tapped_step(memory, layout, run.spare, step)
        look_inside(memory, layout, tip, look, pieces, piece, free, after > safe_center, room)
        if after > safe_gap:
            entry = first_entry(room.looked, pieces, piece)
            if entry >= 0.0:
                event, cut = True, min(step.ticks, int(entry / tick))
    if passed_by(layout.circuit, event, seen.d, seen1.d):
        entry = first_rise(seen.d, seen.dv, seen1.d, seen1.dv, step.length) * step.length
        event, cut = True, min(step.ticks, int(entry / tick))
    return Met(event, cut, entry, safe_gap, safe_center, pieces, piece)


@inlined
def swapped(rows):
    """The end of a step becomes the beginning of the next."""
    return Rows(rows.q1, rows.p1, rows.k1, rows.q, rows.p, rows.k)


@inlined
def weighed(memory, layout, run, now, t, state, seen1, watch, event, status, book, asked):
    """After some steps, or a release, the energy is looked at: is the beam quiet, is its future certain?

    *state* is where q and p stand, and g.q and q.Gq.  Returns what is kept in mind, and the status.
    """
    clock, beat, quiet, last = run.clock, watch.beat, watch.quiet, watch.weighed
    released = event and not watch.touching
    if released or (beat & 7) == 0:
        q, p, gq, qr = state
        high = 0.0
        near = second_well(memory, layout.size, layout.uneven, now.home, q, run.spare)
        if asked.high:
            linear, high = modal_energies(memory, layout, near, p)
        else:
            linear = modal_energy(memory, layout, near, p)
        track_energy(book, beam_energy(memory, layout, near, p, linear), high, (t - last) * clock.tick)
        last = t
        if not watch.touching:
            energy = linear + tension_energy(layout.gamma, gq, qr)
            if layout.uneven is not None:
                energy = modal_energy(memory, layout, q, p) + tension_energy(layout.gamma, gq, qr)
            energy = lifted(memory, layout.size, layout.uneven, q, energy)
            quiet = is_quiet(above_own_well(layout.uneven, now.home, energy), layout.gamma, layout.stretch)
            quiet = calm(layout.circuit, quiet)
            if not event and now.home < 0.0 and (beat & 15) == 0 and seen1.w > clock.decide_reach:
                if at_center(layout.uneven, seen1.c) > 0.0 and energy < clock.decide_energy:
                    status = _DECIDED
    if clock.decide_crossings >= 0 and book.crossings_last_quarter > clock.decide_crossings:
        status = _DECIDED
    if status == _RUNNING and book.steps >= clock.max_steps:
        status = _STEP_LIMIT
    return Watch(watch.touching, quiet, watch.safe_gap, watch.safe_center, last, beat), status


@inlined
def settle(memory, blocks, place, run, now, step, done, room, book, asked, outputs):
    """Where a run stands after a step, cut at the contact's edge if it met one, with its statistics kept.

    Returns that and the step that was taken.  *outputs* are what is recorded, or None.
    """
    layout, stages, clock, tick = place.layout, place.stages, run.clock, run.clock.tick
    ledger = None if outputs is None else True
    tip = seen_from(run.struck, now.home, run.rest_contact)
    rest_contact, rest_center = now.home * run.rest_contact, now.home * run.rest_center
    t, seen, touching = now.t, now.seen, now.watch.touching
    omega = tip.drive.omega
    about = observe(memory, layout, tip, step.phase + omega * step.length, step.q1, step.p1)
    if not math.isfinite(about.d + about.dv):
        return (
            Now(t, now.home, now.stretch, now.rows, seen, now.watch, now.sample, now.landed, _NOT_FINITE),
            step,
        )
    met = meets(memory, layout, run, now, tip, step, about, room)
    there = step.phase + omega * step.length
    see_others(memory, layout.size, layout.others, tip.drive, there, step.q1, step.p1)
    edge = first_edge(memory, layout, layout.others, look_slot(run), run, t, tip.drive, step, room)
    if edge < met.cut:
        met = Met(False, edge, -1.0, met.safe_gap, met.safe_center, met.pieces, met.piece)
    if met.cut < 1:
        if met.event:
            book.touching, book.onset = 1, t
        turn_others(memory, layout.others, 0, t, 0.0, tick, book, outputs)
        status = _STEP_LIMIT if book.steps >= clock.max_steps else _RUNNING
        watch = Watch(
            touching or met.event,
            now.watch.quiet,
            met.safe_gap,
            met.safe_center,
            now.watch.weighed,
            now.watch.beat,
        )
        return Now(t, now.home, now.stretch, now.rows, seen, watch, now.sample, now.landed, status), step
    whole, cut = step.ticks, met.cut
    looks = 0 if touching or not met.event else _LOCATIONS if jumps(tip.law) else 1
    due = edge < whole and not met.event
    while cut != step.ticks:
        step = cut_to(step, run, cut, cut * tick)
        prepare(memory, layout, stages, run.struck.drive, step.length, step.at)
        done = take_step(memory, blocks, layout, stages, tip, step, ledger)
        there = step.phase + omega * step.length
        about = observe(memory, layout, tip, there, step.q1, step.p1)
        see_others(memory, layout.size, layout.others, tip.drive, there, step.q1, step.p1)
        least = (clock.step >> clock.finest) * tick
        if looks > 0:
            looks -= 1
            cut = entry_again(clock, cut, whole, about, 0.5 * tick if jumps(tip.law) else least)
        cut = entry_of_others(memory, layout.others, clock, met.cut, cut, whole, least, due)
        due = False
    keep_others(memory, layout.others)
    seen1 = Seen(about.w + rest_contact, about.wv, about.d, about.dv, about.c + rest_center, about.cv)
    sample = now.sample
    if outputs is not None:
        sample = record_instants(memory, blocks, layout, stages, run, tip, now, step, book, outputs)

    # statistics of the step
    if touching:
        book.deepest, sample = hardest_point(
            memory, blocks, layout, stages, run, tip, now, step, seen1, sample, book, outputs
        )
        book.impulse += done.impulse
        book.work += done.work
        book.gross_work += done.gross
        book.lost += done.lost
    count_others(memory, layout.others, touching, done, book)
    count_given(layout.forced, book, done.given)
    count_circuit(memory, layout, layout.circuit, step.p1, book, done.tap)
    if outputs is not None:
        book.dissipated += done.dissipated + done.lost
    track(book, seen, seen1, step.length)
    if touching or t + step.ticks > met.safe_center:
        count_in_step(
            book, clock, t, step.length, about_level(layout.uneven, seen), about_level(layout.uneven, seen1),
            room.looked, at_center(layout.uneven, rest_center), met.pieces, met.piece,
        )  # fmt: skip
    observe_extras(asked.extras, book, t * tick, step.length, seen, seen1, touching)

    # accept
    t += step.ticks
    status = _RUNNING if t < clock.end else _OK
    quiet, safe_gap, safe_center = now.watch.quiet, met.safe_gap, met.safe_center
    if met.event:
        safe_gap, safe_center = t, t
        if touching:
            if outputs is None:
                finish_impact(book, None, 0, tip.law, t, tick)
            else:
                finish_impact(book, outputs.impacts, outputs.marks[1], tip.law, t, tick)
            seen1 = Seen(seen1.w, seen1.wv, min(seen1.d, 0.0), seen1.dv, seen1.c, seen1.cv)
        else:
            book.touching, book.onset = 1, t
    turn_others(memory, layout.others, met.cut, t, step.length, tick, book, outputs)
    touching = touching != met.event
    watch = Watch(touching, quiet, safe_gap, safe_center, now.watch.weighed, now.watch.beat)
    state = step.q1, step.p1, done.gq, done.qr
    watch, status = weighed(memory, layout, run, now, t, state, seen1, watch, met.event, status, book, asked)
    if outputs is not None:
        sample = record_contact(memory, layout, run, tip, now, step, done, seen1, sample, book, outputs)
    stretch = 2.0 * done.gq + done.qr
    return (
        Now(t, now.home, stretch, swapped(now.rows), seen1, watch, sample, now.landed, status),
        step,
    )
