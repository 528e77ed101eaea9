"""Parts of a march: its clock, what it writes, and the decisions and bookkeeping between steps."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from snapbeam.engines.columns import Counts, Numbers, Reals, Ticks
from snapbeam.engines.cpu.rows import acceleration_rows, tension_rows
from snapbeam.engines.cpu.step import Impactor
from snapbeam.engines.scalar.compile import compiled
from snapbeam.engines.scalar.physics import contact_force, tension_factors
from snapbeam.engines.scalar.signals import count_crossings, first_rise, widened

__all__ = [
    "PIECES",
    "Clock",
    "Outputs",
    "change_well",
    "contact_level",
    "count_in_step",
    "finish_impact",
    "first_entry",
    "flight_level",
    "is_quiet",
    "safe_for",
    "seen_from",
    "set_up",
    "ticks_of",
    "track_extremes",
]


class Clock(NamedTuple):
    """Time in ticks, the steps that are allowed, and when a run may end early."""

    tick: float
    """Seconds."""
    step: int
    """Flight step."""
    period: int
    """Of the drive."""
    end: int
    last_quarter: int
    coarsest: int
    """Halvings of the flight step that make the longest contact step."""
    finest: int
    """Halvings of the flight step that make the shortest contact step."""
    max_steps: int
    decide_energy: float
    """Energy above the well below which a beam in the far well stays there; -inf: never decide."""
    decide_reach: float
    """Highest future position of the shaker, or 0 if that is higher."""
    decide_crossings: int
    """Crossings in the last quarter beyond which the response is continuous; -1: never decide."""


class Outputs(NamedTuple):
    """Where a march writes what is asked of it; arrays of length 0 ask for nothing."""

    times: NDArray[np.float64]
    """Instants to record, s, ascending."""
    rows: NDArray[np.float64]
    """q at those instants, shape (instants, rows)."""
    values: NDArray[np.float64]
    """Penetration, contact force, beam energy, contact energy, work and dissipation, shape (instants, 6)."""
    impacts: NDArray[np.float64]
    """Onset, duration, greatest penetration and impulse of each impact, shape (impacts, 4)."""
    ledger: bool
    """Whether to integrate the dissipation."""


# How contact steps are graded: a step is at most this share of the time since the onset, and of the time to
# the release at the present rate.
_GRADING = 0.5
_RELEASE = 0.5
# Safety of the bound on the speed of a signal, and for how many steps it is trusted.
_MARGIN = 1.25
_TRUST = 8
# Flight steps are halved where the squared slopes differ from those of the well by more than this many times
# the well's own, and again at every doubling.
_STRETCH = 4.0
# Below this share of the energy of the barrier, free flight takes steps of twice the length: what the steps
# must resolve is how far the tension swings, and that goes with the root of the energy.
_QUIET = 0.2
# Pieces per period of the fastest mode when a step is looked into.
PIECES = 5.0


@compiled
def set_up(memory, layout, contact_row, start, reals, ticks, coarsest, finest, max_steps):
    """Put one run's contact row and start into memory; returns its shaker, clock and rests."""
    for row in range(layout.size):
        memory[layout.contact + row] = contact_row[row]
    for row in range(2 * layout.size):
        memory[layout.work + row] = start[row]
    impactor = Impactor(
        reals[Reals.OFFSET], reals[Reals.AMPLITUDE], reals[Reals.OMEGA], reals[Reals.STIFFNESS]
    )
    clock = Clock(
        reals[Reals.TICK],
        ticks[Ticks.STEP],
        ticks[Ticks.PERIOD],
        ticks[Ticks.END],
        ticks[Ticks.LAST_QUARTER],
        coarsest,
        finest,
        max_steps,
        reals[Reals.DECIDE_ENERGY],
        reals[Reals.DECIDE_REACH],
        ticks[Ticks.DECIDE_CROSSINGS],
    )
    return impactor, clock, (reals[Reals.REST_CONTACT], reals[Reals.REST_CENTER])


@compiled
def finish_impact(counts, numbers, outputs, stiffness, end, tick):
    """Enter the contact that ends at tick *end* in the statistics, unless nothing was pressed."""
    deepest = numbers[Numbers.DEEPEST]
    if deepest > 0.0:
        duration = (end - counts[Counts.ONSET]) * tick
        force = contact_force(stiffness, deepest)
        at = counts[Counts.IMPACTS]
        if at < outputs.impacts.shape[0]:
            outputs.impacts[at, 0] = counts[Counts.ONSET] * tick
            outputs.impacts[at, 1] = duration
            outputs.impacts[at, 2] = force
            outputs.impacts[at, 3] = numbers[Numbers.IMPULSE]
        counts[Counts.IMPACTS] += 1
        numbers[Numbers.CONTACT_TIME] += duration
        numbers[Numbers.PEAK_FORCE] = max(numbers[Numbers.PEAK_FORCE], force)
    counts[Counts.TOUCHING] = 0
    numbers[Numbers.DEEPEST] = 0.0
    numbers[Numbers.IMPULSE] = 0.0


@compiled
def safe_for(distance, bound, shaker_speed, acceleration, step):
    """For how long a signal at *distance* from zero cannot reach it, at most a few steps."""
    horizon = _TRUST * step
    speed = _MARGIN * bound + shaker_speed + abs(acceleration) * horizon
    if speed * horizon <= distance:
        return horizon
    return distance / speed


@compiled
def contact_level(clock, elapsed, d, dv):
    """Halvings of the flight step for a step in contact: graded from the onset and towards the release."""
    want = _GRADING * elapsed
    if dv < 0.0:
        want = min(want, -_RELEASE * d / dv)
    level = clock.coarsest
    while level < clock.finest and (clock.step >> level) * clock.tick > want:
        level += 1
    return level


@compiled
def is_quiet(energy, gamma, stretch_at_rest):
    """Whether a beam of this energy above the well stays far below the barrier, gamma s^2 / 4 for squared slopes s.

    Without impact and damping the energy is constant, so that the length of the steps is.
    """
    return energy < _QUIET * 0.25 * gamma * stretch_at_rest * stretch_at_rest


@compiled
def ticks_of(clock, level):
    """Length of the step of a level, in ticks: halvings of the flight step, or -1 for twice its length."""
    return clock.step << 1 if level < 0 else clock.step >> level


@compiled
def flight_level(clock, quiet, stretch, stretch_at_rest):
    """Halvings of the flight step for a beam stretched far beyond its wells; -1 if it is quiet."""
    if quiet:
        return -1
    level = 0
    reach = _STRETCH * stretch_at_rest
    while level < clock.finest and stretch_at_rest > 0.0 and abs(stretch) > reach:
        reach *= 2.0
        level += 1
    return level


@compiled
def first_entry(seen, pieces, piece):
    """When the penetration first becomes positive inside a step that was looked into; -1 if it does not."""
    for i in range(pieces):
        rise = first_rise(seen[i, 0], seen[i, 1], seen[i + 1, 0], seen[i + 1, 1], piece)
        if rise >= 0.0:
            return (i + rise) * piece
    return -1.0


@compiled
def count_in_step(counts, numbers, clock, start, length, c, cv, c1, cv1, seen, rest, pieces, piece):
    """Count zero crossings of the centre in a step, through what was seen inside it."""
    left, left_rate, begun = c, cv, 0.0
    i = 1
    while True:
        if i < pieces and i * piece < length:
            right, right_rate, ended = rest + seen[i, 2], seen[i, 3], i * piece
        else:
            right, right_rate, ended = c1, cv1, length
        found, last, side = count_crossings(
            counts[Counts.SIDE], left, left_rate, right, right_rate, ended - begun
        )
        counts[Counts.SIDE] = side
        if found > 0:
            when = start * clock.tick + begun + last * (ended - begun)
            counts[Counts.CROSSINGS] += found
            numbers[Numbers.LAST_CROSSING] = when
            if when > clock.last_quarter * clock.tick:
                counts[Counts.CROSSINGS_LAST_QUARTER] += found
        if ended >= length:
            return
        left, left_rate, begun = right, right_rate, ended
        i += 1


@compiled
def track_extremes(numbers, w, wv, w1, wv1, c, cv, c1, cv1, length):
    """Widen the extremes of the contact point (w) and of the centre (c) by a step."""
    numbers[Numbers.MIN_DISPLACEMENT], numbers[Numbers.MAX_DISPLACEMENT] = widened(
        numbers[Numbers.MIN_DISPLACEMENT], numbers[Numbers.MAX_DISPLACEMENT], w, wv, w1, wv1, length
    )
    numbers[Numbers.MIN_CENTER], numbers[Numbers.MAX_CENTER] = widened(
        numbers[Numbers.MIN_CENTER], numbers[Numbers.MAX_CENTER], c, cv, c1, cv1, length
    )


@compiled
def change_well(memory, blocks, layout, home, q, k, r):
    """Take the other well as the origin: exact, since the structure is the same about both.

    About the well that the beam is in, the linear flow holds most of the motion of every mode; about
    the far one, modes faster than the step would be held in place by kicks alone.
    """
    for row in range(layout.size):
        memory[q + row] -= home * memory[layout.shift + row]
        memory[layout.g + row] = -memory[layout.g + row]
    gq, qr = tension_rows(memory, blocks, layout, q, r)
    along_g, along_r = tension_factors(layout.gamma, gq, qr)
    acceleration_rows(memory, layout, along_g, along_r, r, k)
    return 2.0 * gq + qr


@compiled
def seen_from(impactor, home, rest):
    """The shaker as seen from the well *home*: +1 the one the run began in, -1 the other."""
    return Impactor(
        impactor.offset + (1.0 - home) * rest, impactor.amplitude, impactor.omega, impactor.stiffness
    )
