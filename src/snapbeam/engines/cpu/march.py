"""The CPU engine: two trajectories at a time, each with steps that its own contacts decide.

In free flight a trajectory takes steps of a fixed length, or of twice that while its energy is low, as many as
a bound on the speed of the gap says are safe; near the shaker it looks inside each step with a resolution finer
than the fastest mode, and a step that would enter the contact is cut where it does.  In contact, steps grow
from the onset and shrink towards the release, which is located too, so that the d^(3/2) edges of the force fall
between steps.  Time is an integer number of ticks; the phase of the drive comes from that integer alone.

A kick waits for the sums of the one before, so that one trajectory alone leaves a core waiting.  Two are
marched side by side, a step of each at a time; when one ends, the next run takes its place.  They share nothing
but the structure: results do not depend on batch, order or threads.
"""

from __future__ import annotations

import math

from snapbeam.core.codes import RunStatus
from snapbeam.engines.columns import Counts
from snapbeam.engines.cpu.settle import settle
from snapbeam.engines.cpu.state import Now, begin, cut_slot, finish
from snapbeam.engines.cpu.step import Done, Step, prepare, take_step, take_two
from snapbeam.engines.scalar.compile import compiled, inlined
from snapbeam.engines.scalar.decisions import change_well, contact_level, flight_level, seen_from, ticks_of

__all__ = ["march_many"]

_RUNNING = int(RunStatus.RUNNING)
_TWO_PI = 2.0 * math.pi
_NO_STEP = Step(0, 0, 0.0, 0.0, False, 0, 0, 0, 0, 0, 0, 0)
_NOTHING_DONE = Done(0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


@inlined
def choose(memory, blocks, layout, stages, run, now, counts):
    """The next step of a run, and where it stands: about the other well, if it has crossed over."""
    clock, home, stretch, t = run.clock, now.home, now.stretch, now.t
    if layout.stretch > 0.0 and now.c * (home * run.rest_center) < 0.0:
        stretch = change_well(memory, blocks, layout, home, now.q, now.k, layout.work + 9 * layout.size)
        home = -home
    counts[Counts.STEPS] += 1
    level = flight_level(clock, now.quiet, stretch, layout.stretch)
    if now.touching:
        elapsed = (t - counts[Counts.ONSET]) * clock.tick
        level = max(level, contact_level(clock, elapsed, now.d, now.dv))
    ticks, at = ticks_of(clock, level), run.coefficients + (level + 1) * run.slot
    if t + ticks > clock.end:
        ticks, at = clock.end - t, cut_slot(run)
        prepare(memory, layout, stages, run.struck, ticks * clock.tick, at)
    phase = _TWO_PI * ((t % clock.period) / clock.period)
    r, length = layout.work + 9 * layout.size, ticks * clock.tick
    step = Step(ticks, at, length, phase, now.touching, now.q, now.p, now.k, now.q1, now.p1, now.k1, r)
    now = Now(
        t, now.q, now.p, now.k, now.q1, now.p1, now.k1, home, stretch, now.quiet, now.w, now.wv, now.d, now.dv, now.c,
        now.cv, now.touching, now.safe_gap, now.safe_center, now.sample, now.status
    )  # fmt: skip
    return now, step


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
    asked, limits, room = (contact_rows, starts, reals, ticks), (coarsest, finest, max_steps), (seen, parts)
    live_a, live_b, following = False, False, 1
    i_a = which[0]
    i_b = i_a
    counts_a, numbers_a = counts[i_a], numbers[i_a]
    counts_b, numbers_b = counts_a, numbers_a
    run_a, now_a = begin(memory, blocks, layout_a, stages, asked, i_a, limits, counts_a, numbers_a)
    run_b, now_b = run_a, now_a
    step_a, step_b, done_a, done_b = _NO_STEP, _NO_STEP, _NOTHING_DONE, _NOTHING_DONE
    live_a = True
    while live_a or live_b or following < which.size:
        if not live_a and following < which.size:
            i_a = which[following]
            counts_a, numbers_a = counts[i_a], numbers[i_a]
            run_a, now_a = begin(memory, blocks, layout_a, stages, asked, i_a, limits, counts_a, numbers_a)
            live_a, following = True, following + 1
        if not live_b and following < which.size:
            i_b = which[following]
            counts_b, numbers_b = counts[i_b], numbers[i_b]
            run_b, now_b = begin(memory, blocks, layout_b, stages, asked, i_b, limits, counts_b, numbers_b)
            live_b, following = True, following + 1
        if live_a:
            now_a, step_a = choose(memory, blocks, layout_a, stages, run_a, now_a, counts_a)
        if live_b:
            now_b, step_b = choose(memory, blocks, layout_b, stages, run_b, now_b, counts_b)
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
            now_a = settle(
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
                finish(memory, blocks, layout_a, run_a, now_a, counts_a, numbers_a, outputs)
                live_a = False
        if live_b:
            now_b = settle(
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
                finish(memory, blocks, layout_b, run_b, now_b, counts_b, numbers_b, outputs)
                live_b = False
