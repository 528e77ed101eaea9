"""After a step of a run under Newton's law of impact: hits located, chatter that ends in sticking, release.

One mode only.  A hit lasts no time: the relative velocity changes its sign and is multiplied by e.  Hits that follow
each other ever faster (complete chatter) end in sticking: once the beam would leave the tip by less than can
be seen, it is carried along, until the force that this takes would have to pull.  What comes after does not depend on
when exactly the chatter ended, since a beam that is carried forgets how it arrived.

Hits and releases are located on the trajectory itself, to the last bits, between two ticks; from there a free step
of less than a tick leads to the next one.
"""

from __future__ import annotations

import math

from snapbeam.core.codes import RunStatus
from snapbeam.engines.cpu.carried import carry
from snapbeam.engines.cpu.hold import hold
from snapbeam.engines.cpu.recording import record_instants
from snapbeam.engines.cpu.settle import cut_to, meets, swapped, weighed
from snapbeam.engines.cpu.state import Now, Watch, cut_slot, phase_at
from snapbeam.engines.cpu.step import Step, observe, prepare, take_step
from snapbeam.engines.cpu.uneven import about_level, at_center
from snapbeam.engines.scalar.compile import compiled, inlined
from snapbeam.engines.scalar.decisions import Seen, count_in_step, track
from snapbeam.engines.scalar.extras import observe as observe_extras
from snapbeam.engines.scalar.signals import first_rise
from snapbeam.engines.scalar.tip import seen_from

__all__ = ["settle_newton"]

_OK, _RUNNING, _NOT_FINITE = int(RunStatus.OK), int(RunStatus.RUNNING), int(RunStatus.NOT_FINITE)
_STEP_LIMIT = int(RunStatus.STEP_LIMIT)
_LOCATIONS = 8
"""Newton steps in which a hit is located, at most."""
_NOISE = 1e-12
"""Of the tip's speed: relative velocities that are rounding."""
_SOON = 0.05
"""Of the shortest period: how long the rest of a chatter may last to be taken as complete."""


@inlined
def strike(memory, blocks, place, run, tip, p, seen, when, phase, book, outputs):
    """Newton's law; *p* is where the mode's velocity stands.  Returns whether the bodies stay together.

    They do if the contact presses them together and what is left of the chatter, a geometric series of ever
    shorter flights, is over soon and too low to be seen.
    """
    layout = place.layout
    c, e = memory[layout.contact], tip.law.coefficient
    speed = seen.wv + seen.dv
    impulse = (1.0 + e) * seen.dv / (c * c)
    memory[p] += c * impulse
    book.work += impulse * speed
    book.gross_work += abs(impulse * speed)
    lost = 0.5 * (1.0 - e * e) * seen.dv * seen.dv / (c * c)
    book.dissipated += lost
    book.lost += lost
    book.total_impulse += impulse
    if outputs is not None:
        at = book.impacts - outputs.marks[1]
        if at < outputs.impacts.shape[0]:
            outputs.impacts[at, 0] = when
            outputs.impacts[at, 1] = 0.0
            outputs.impacts[at, 2] = math.nan
            outputs.impacts[at, 3] = impulse
    book.impacts += 1
    spare, size = run.spare, layout.size
    away = e * seen.dv
    force, _, _ = hold(memory, blocks, layout, tip, phase, spare, spare + size, spare + 2 * size)
    pressed = force * c * c
    if not pressed > 0.0:
        return False
    height = 0.5 * away * away / pressed
    if height <= run.lowest * 1e-4 or e == 0.0:
        return True
    if height > run.lowest or e >= 1.0:
        return False
    lasts = 2.0 * away / (pressed * (1.0 - e))
    shortest = 2.0 * math.pi / max(memory[layout.omega], tip.drive.omega)
    if lasts > _SOON * shortest:
        return False
    after = phase + tip.drive.omega * lasts
    later, _, _ = hold(memory, blocks, layout, tip, after, spare, spare + size, spare + 2 * size)
    return later > 0.0


@inlined
def _stuck(memory, place, run, seen, p, book):
    """What is left of the relative velocity after the last hit of a chatter is lost; begins the book of a contact."""
    c = memory[place.layout.contact]
    away = run.struck.law.coefficient * seen.dv
    book.impulse = -away / (c * c)
    book.work += book.impulse * (seen.wv + seen.dv)
    lost = 0.5 * away * away / (c * c)
    book.dissipated += lost
    book.lost += lost
    book.deepest = 0.0
    book.touching = 1


@compiled
def _rises(looked, pieces, piece, still, still_speed):
    """When the penetration first becomes positive in a step that begins in touch; -1 if it does not.

    As long as the gap is rounding (*still*) nothing has happened yet: the bodies part more slowly than can be seen.
    """
    i = 0
    if abs(looked[0, 1]) <= still_speed:
        while i < pieces and abs(looked[i + 1, 0]) <= still:
            i += 1
        if i < pieces and looked[i + 1, 0] > still:
            return i * piece
        i += 1
    while i < pieces:
        rise = first_rise(min(looked[i, 0], 0.0), looked[i, 1], looked[i + 1, 0], looked[i + 1, 1], piece)
        if rise >= 0.0:
            return (i + rise) * piece
        i += 1
    return -1.0


@inlined
def _located(memory, blocks, place, run, tip, step, entry, still_speed):
    """The step cut at the hit itself, by Newton's method on the trajectory; what it gave, and what is seen there.

    The last value says whether there is a hit at all: whether the bodies meet and do not merely graze.
    """
    layout, stages = place.layout, place.stages
    cut = cut_to(step, run, 0, entry)
    before = math.inf
    prepare(memory, layout, stages, run.struck.drive, cut.length, cut.at)
    done = take_step(memory, blocks, layout, stages, tip, cut, True)
    about = observe(memory, layout, tip, step.phase + tip.drive.omega * cut.length, step.q1, step.p1)
    for _ in range(_LOCATIONS):
        if about.dv <= still_speed:
            break
        change = -about.d / about.dv
        if abs(change) >= 0.5 * before or cut.length + change > step.length or cut.length + change < 0.0:
            break
        before = abs(change)
        cut = cut_to(step, run, 0, cut.length + change)
        prepare(memory, layout, stages, run.struck.drive, cut.length, cut.at)
        done = take_step(memory, blocks, layout, stages, tip, cut, True)
        about = observe(memory, layout, tip, step.phase + tip.drive.omega * cut.length, step.q1, step.p1)
    return cut, done, about, about.dv > still_speed


@inlined
def _moved_on(memory, blocks, place, run, tip, step, q, p, k, after, phase, together):
    """From a hit or a release to the next tick, into the rows that the step began from; returns g.q and q.Gq."""
    layout, stages = place.layout, place.stages
    if together:
        there = phase + tip.drive.omega * after
        _, gq, qr = hold(memory, blocks, layout, tip, there, step.q, step.p, step.k)
        return gq, qr
    rest = Step(0, cut_slot(run), after, phase, False, q, p, k, step.q, step.p, step.k, step.r)
    prepare(memory, layout, stages, run.struck.drive, after, rest.at)
    done = take_step(memory, blocks, layout, stages, tip, rest, True)
    return done.gq, done.qr


@inlined
def settle_newton(memory, blocks, place, run, now, step, done, room, book, asked, outputs):
    """As :func:`snapbeam.engines.cpu.settle.settle`, of a run whose impacts last no time."""
    layout, clock, tick = place.layout, run.clock, run.clock.tick
    tip = seen_from(run.struck, now.home, run.rest_contact)
    rest_contact, rest_center = now.home * run.rest_contact, now.home * run.rest_center
    t, seen, watch = now.t, now.seen, now.watch
    if watch.touching:
        return carry(memory, blocks, place, run, tip, now, step, room, book, asked, outputs)
    still_speed = _NOISE * (run.tip_speed + abs(seen.wv))
    if seen.d >= 0.0 and seen.dv > still_speed:
        # in touch and closing before any step
        q, p, k = now.rows.q, now.rows.p, now.rows.k
        together = strike(memory, blocks, place, run, tip, p, seen, t * tick, step.phase, book, outputs)
        if together:
            _stuck(memory, place, run, seen, p, book)
            book.onset = t
            hold(memory, blocks, layout, tip, step.phase, q, p, k)
        status = _STEP_LIMIT if book.steps >= clock.max_steps else _RUNNING
        away = 0.0 if together else tip.law.coefficient * seen.dv
        wv = seen.wv + seen.dv + away
        kept = Watch(together, False, t, t, watch.weighed, watch.beat)
        after = Seen(seen.w, wv, 0.0, -away, seen.c, memory_rate(memory, layout, p))
        return Now(t, now.home, now.stretch, now.rows, after, kept, now.sample, now.landed, status), step

    about = observe(memory, layout, tip, step.phase + tip.drive.omega * step.length, step.q1, step.p1)
    if not math.isfinite(about.d + about.dv):
        return (
            Now(t, now.home, now.stretch, now.rows, seen, watch, now.sample, now.landed, _NOT_FINITE),
            step,
        )
    met = meets(memory, layout, run, now, tip, step, about, room)
    entry = met.entry
    if seen.d > -still_speed * run.step_time and met.pieces > 0:
        still = still_speed * run.step_time
        entry = _rises(room.looked, met.pieces, met.piece, still, still_speed)
    hit, ticks = False, step.ticks
    if entry >= 0.0:
        located, done, about, hit = _located(memory, blocks, place, run, tip, step, entry, still_speed)
        ticks = min(max(1, math.ceil(located.length / tick)), step.ticks)
        if hit:
            step = Step(
                ticks, located.at, located.length, step.phase, False, step.q, step.p, step.k, step.q1, step.p1,
                step.k1, step.r,
            )  # fmt: skip
        else:
            step = cut_to(step, run, ticks, ticks * tick)
            prepare(memory, layout, place.stages, run.struck.drive, step.length, step.at)
            done = take_step(memory, blocks, layout, place.stages, tip, step, True)
            about = observe(memory, layout, tip, step.phase + tip.drive.omega * step.length, step.q1, step.p1)
    seen1 = Seen(about.w + rest_contact, about.wv, about.d, about.dv, about.c + rest_center, about.cv)
    sample = now.sample
    if outputs is not None:
        sample = record_instants(memory, blocks, layout, place.stages, run, tip, now, step, book, outputs)
    book.dissipated += done.dissipated
    track(book, seen, seen1, step.length)
    if hit or t + step.ticks > met.safe_center:
        count_in_step(
            book, clock, t, step.length, about_level(layout.uneven, seen), about_level(layout.uneven, seen1),
            room.looked, at_center(layout.uneven, rest_center), met.pieces, met.piece,
        )  # fmt: skip
    observe_extras(asked.extras, book, t * tick, step.length, seen, seen1, False)

    t += step.ticks
    status = _RUNNING if t < clock.end else _OK
    rows, gq, qr, together = swapped(now.rows), done.gq, done.qr, False
    if hit:
        when, phase = now.t * tick + step.length, step.phase + tip.drive.omega * step.length
        together = strike(memory, blocks, place, run, tip, step.p1, seen1, when, phase, book, outputs)
        if together:
            _stuck(memory, place, run, seen1, step.p1, book)
            book.onset = t
        gq, qr = _moved_on(
            memory, blocks, place, run, tip, step, step.q1, step.p1, step.k1,
            (t - now.t) * tick - step.length, phase, together,
        )  # fmt: skip
        rows = now.rows
        about = observe(memory, layout, tip, phase_at(run, t), rows.q, rows.p)
        d, dv = (0.0, 0.0) if together else (min(about.d, 0.0), about.dv)
        seen1 = Seen(about.w + rest_contact, about.wv, d, dv, about.c + rest_center, about.cv)
    safe_gap, safe_center = (t, t) if entry >= 0.0 else (met.safe_gap, met.safe_center)
    kept = Watch(together, watch.quiet, safe_gap, safe_center, watch.weighed, watch.beat)
    state = rows.q, rows.p, gq, qr
    kept, status = weighed(memory, layout, run, now, t, state, seen1, kept, hit, status, book, asked)
    return Now(t, now.home, 2.0 * gq + qr, rows, seen1, kept, sample, now.landed, status), step


@inlined
def memory_rate(memory, layout, p):
    """Rate of the centre of a single mode."""
    return memory[layout.center] * memory[p]
