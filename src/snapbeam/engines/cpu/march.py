"""The CPU engine's march: two trajectories at a time, each with steps that its own contacts decide.

In free flight a trajectory takes steps of a fixed length, or of twice that while its energy is low, as many as
a bound on the speed of the gap says are safe; near the tip it looks inside each step with a resolution finer
than the fastest mode, and a step that would enter the contact is cut where it does.  In contact, steps grow
from the onset and shrink towards the release, which is located too, so that the edges of the force fall
between steps.  Time is an integer number of ticks; the argument of the drive comes from that integer alone.

A kick waits for the sums of the one before, so that one trajectory alone leaves a core waiting.  Two are
marched side by side, a step of each at a time; when one ends, the next run takes its place.  They share nothing
but the structure: results do not depend on batch, order or threads.
"""

from __future__ import annotations

from typing import Any, NamedTuple

from snapbeam.core.codes import RunStatus
from snapbeam.engines.cpu.settling.after import after_step
from snapbeam.engines.cpu.state import (
    Now,
    Place,
    Watch,
    begin,
    change_well,
    cut_slot,
    finish,
    land,
    phase_at,
)
from snapbeam.engines.cpu.step import Done, Step, prepare, take_step, take_two
from snapbeam.engines.cpu.strikers.force import press, put_others
from snapbeam.engines.cpu.strikers.meet import close_others, level_of_others
from snapbeam.engines.cpu.uneven import turn_over
from snapbeam.engines.cpu.world.circuit import Tap
from snapbeam.engines.cpu.world.edges import up_to_edge
from snapbeam.engines.cpu.world.forced import Given, enter_forces
from snapbeam.engines.scalar.compile import compiled, inlined
from snapbeam.engines.scalar.contact import released_at
from snapbeam.engines.scalar.decisions import contact_level, flight_level, ticks_of
from snapbeam.engines.scalar.tip import seen_from

__all__ = ["Kept", "choose", "march_many"]

_RUNNING = int(RunStatus.RUNNING)
_NO_STEP = Step(0, 0, 0.0, 0.0, False, 0, 0, 0, 0, 0, 0, 0)
_NOTHING_DONE = Done(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, Given(0.0, 0.0, 0.0), Tap(0.0, 0.0, 0.0, 0.0))


class Kept(NamedTuple):
    """Where a march of many puts what it finds."""

    books: Any
    """A record a run."""
    states: Any
    """States at landings, q and p about the well at hand, shape (runs, landings, 2 rows); none if of length 0."""
    homes: Any
    """That well, and the ticks since the present contact began (-1: apart), shape (runs, landings, 2)."""
    pulse: Any
    """Not 0: stop."""


@inlined
def choose(memory, blocks, place, run, now, book):
    """The next step of a run, and where it stands: about the other well, if it has crossed over."""
    layout, clock, home, stretch, t = place.layout, run.clock, now.home, now.stretch, now.t
    rows, seen, watch = now.rows, now.seen, now.watch
    r = layout.work + 9 * layout.size
    if layout.stretch > 0.0 and turn_over(layout.uneven, seen.c, home, run.rest_center):
        there = phase_at(run, t)
        enter_forces(layout.forced, memory, run.struck.drive, there)
        press(memory, layout.size, layout.others, run.struck.drive, there, rows.q, 0.0, False)
        put_others(memory, layout.others, -home)
        stretch = change_well(memory, blocks, layout, home, rows.q, rows.k, r)
        home = -home
    book.steps += 1
    level = flight_level(clock, watch.quiet, stretch, layout.stretch)
    if watch.touching:
        left = released_at(run.struck.law, seen.d, seen.dv)
        level = max(level, contact_level(clock, (t - book.onset) * clock.tick, left, seen.dv))
    level = level_of_others(memory, layout.others, clock, t, watch.touching, level)
    ticks, at = ticks_of(clock, level), run.coefficients + (level + 1) * run.slot
    # up to the next state that is handed out, to a jump of the drive's velocity, or to the end
    limit = min((now.landed + 1) * clock.landing, clock.end)
    limit = up_to_edge(run.struck.drive, run.phase, clock.period, t, limit)
    if t + ticks > limit:
        ticks, at = limit - t, cut_slot(run)
        prepare(memory, layout, place.stages, run.struck.drive, ticks * clock.tick, at)
    length, phase = ticks * clock.tick, phase_at(run, t)
    step = Step(
        ticks, at, length, phase, watch.touching, rows.q, rows.p, rows.k, rows.q1, rows.p1, rows.k1, r
    )
    return Now(t, home, stretch, rows, seen, _beaten(watch), now.sample, now.landed, now.status), step


@inlined
def _beaten(watch):
    """One step more."""
    return Watch(
        watch.touching, watch.quiet, watch.safe_gap, watch.safe_center, watch.weighed, watch.beat + 1
    )


@inlined
def hand_out(memory, blocks, layout, run, now, book, i, kept):
    """Keep the state of a run that has come to a landing, and begin again from it alone."""
    if kept.states.shape[1] == 0 or now.t < min((now.landed + 1) * run.clock.landing, run.clock.end):
        return now
    size, rows, landed = layout.size, now.rows, now.landed
    for row in range(size):
        kept.states[i, landed, row] = memory[rows.q + row]
        kept.states[i, landed, size + row] = memory[rows.p + row]
    kept.homes[i, landed, 0] = int(now.home)
    kept.homes[i, landed, 1] = now.t - book.onset if now.watch.touching else -1
    if now.status != _RUNNING:
        return now
    again, _ = land(
        memory, blocks, layout, run, now.t, now.home, rows, now.watch.touching, landed + 1, now.sample
    )
    return again


@compiled
def march_many(memory, blocks, layouts, stages, asked, which, room, kept):
    """March the runs *which*, two at a time; *memory* and *room* belong to the caller's thread.

    *layouts* are two places in memory that share the rows of the structure.
    """
    place_a, place_b = Place(layouts[0], stages), Place(layouts[1], stages)
    books, goes_on = kept.books, kept.states.shape[1] > 0
    live_a, live_b, following = True, False, 1
    i_a = which[0]
    i_b = i_a
    book_a = books[i_a]
    book_b = book_a
    run_a, now_a = begin(memory, blocks, place_a, asked, i_a, book_a)
    run_b, now_b = run_a, now_a
    step_a, step_b, done_a, done_b = _NO_STEP, _NO_STEP, _NOTHING_DONE, _NOTHING_DONE
    while live_a or live_b or following < which.size:
        if kept.pulse[0] != 0:
            break
        if not live_a and following < which.size:
            i_a = which[following]
            book_a = books[i_a]
            run_a, now_a = begin(memory, blocks, place_a, asked, i_a, book_a)
            live_a, following = True, following + 1
        if not live_b and following < which.size:
            i_b = which[following]
            book_b = books[i_b]
            run_b, now_b = begin(memory, blocks, place_b, asked, i_b, book_b)
            live_b, following = True, following + 1
        if live_a:
            now_a, step_a = choose(memory, blocks, place_a, run_a, now_a, book_a)
        if live_b:
            now_b, step_b = choose(memory, blocks, place_b, run_b, now_b, book_b)
        tip_a = seen_from(run_a.struck, now_a.home, run_a.rest_contact)
        tip_b = seen_from(run_b.struck, now_b.home, run_b.rest_contact)
        if live_a and live_b:
            done_a, done_b = take_two(
                memory, blocks, stages, layouts[0], tip_a, step_a, layouts[1], tip_b, step_b
            )
        elif live_a:
            done_a = take_step(memory, blocks, layouts[0], stages, tip_a, step_a, None)
        else:
            done_b = take_step(memory, blocks, layouts[1], stages, tip_b, step_b, None)
        if live_a:
            now_a, _ = after_step(
                memory, blocks, place_a, run_a, now_a, step_a, done_a, room, book_a, asked, None
            )
            now_a = hand_out(memory, blocks, layouts[0], run_a, now_a, book_a, i_a, kept)
            if now_a.status != _RUNNING:
                if not goes_on:
                    close_others(memory, layouts[0].others, book_a, None, now_a.t, run_a.clock.tick)
                finish(memory, blocks, layouts[0], run_a, now_a, book_a, None, 0, goes_on)
                live_a = False
        if live_b:
            now_b, _ = after_step(
                memory, blocks, place_b, run_b, now_b, step_b, done_b, room, book_b, asked, None
            )
            now_b = hand_out(memory, blocks, layouts[1], run_b, now_b, book_b, i_b, kept)
            if now_b.status != _RUNNING:
                if not goes_on:
                    close_others(memory, layouts[1].others, book_b, None, now_b.t, run_b.clock.tick)
                finish(memory, blocks, layouts[1], run_b, now_b, book_b, None, 0, goes_on)
                live_b = False
    if live_a:
        book_a.time, book_a.status = now_a.t, _RUNNING
    if live_b:
        book_b.time, book_b.status = now_b.t, _RUNNING
