"""Step-size control, contact onset and statistics: scalar functions that the kernels of every engine call."""

from __future__ import annotations

import math
from typing import NamedTuple

from snapbeam.solver.compilation import compiled, inlined
from snapbeam.solver.contact_force import mark_of, peak_force
from snapbeam.solver.interpolation import count_zero_crossings, first_upcrossing, sign_of, update_extrema
from snapbeam.solver.simd import select_less


class Clock(NamedTuple):
    """Time in ticks, the steps that are allowed, and when a run may end early."""

    tick: float
    """Seconds."""
    step: int
    """Flight step."""
    period: int
    """Period of the drive's argument, ticks."""
    output_interval: int
    """Between two output states."""
    end: int
    last_quarter: int
    min_contact_halvings: int
    """Halvings of the flight step that make the longest contact step."""
    max_halvings: int
    """Halvings of the flight step that make the shortest contact step."""
    max_steps: int
    decide_energy: float
    """Energy above the well below which a beam in the far well stays there; -inf: never decide."""
    decide_reach: float
    """Highest future position of the tip, or 0 if that is higher."""
    decide_crossings: int
    """Crossings in the last quarter beyond which the response is continuous; -1: never decide."""


class ContactKinematics(NamedTuple):
    """Displacement, penetration and their rates at an instant, positive as the striker pushes."""

    w: float
    """Displacement of the beam at the striker, m, and its rate."""
    wv: float
    d: float
    """Penetration, and its rate."""
    dv: float
    c: float
    """Displacement of the centre, and its rate."""
    cv: float


# How contact steps are graded: a step is at most this share of the time since the onset, and of the time to
# the release at the present rate.
GRADING = 0.5
RELEASE = 0.5
# Safety of the bound on the speed of a signal, and for how many steps it is trusted.
_MARGIN = 1.25
TRUST = 8
# Flight steps are halved where the squared slopes differ from those of the well by more than this many times
# the well's own, and again at every doubling.
STRETCH_LIMIT = 4.0
# Subintervals per period of the fastest mode when a step is sampled inside.
SUBINTERVALS = 5.0
_THIRD, _SIXTH, TWELFTH = 1.0 / 3.0, 1.0 / 6.0, 1.0 / 12.0


@inlined
def clock_of(run, max_steps):
    """The clock of a run, from its record."""
    return Clock(
        run.tick,
        run.step,
        run.period,
        run.output_interval,
        run.end,
        run.last_quarter,
        run.min_contact_halvings,
        run.max_halvings,
        max_steps,
        run.decide_energy,
        run.decide_reach,
        run.decide_crossings,
    )


@compiled
def begin_statistics(accumulators, center, kinematics, law, energy):
    """Begin a run's statistics with its kinematics at the start.

    *center* is where the centre is from the height that divides the wells.
    """
    accumulators.side = sign_of(center, 0)
    accumulators.min_displacement, accumulators.max_displacement = kinematics.w, kinematics.w
    accumulators.min_center, accumulators.max_center = kinematics.c, kinematics.c
    accumulators.deepest = mark_of(law, kinematics.d, kinematics.dv)
    accumulators.first_energy = energy


@compiled
def close_impact(accumulators, impacts, before, law, end, tick):
    """Enter the contact that ends at tick *end* in the statistics, unless the penetration stayed at zero.

    *impacts* is a table that begins after *before* impacts, or None.
    """
    deepest = accumulators.deepest
    if deepest > 0.0:
        duration = (end - accumulators.onset) * tick
        force = peak_force(law, deepest)
        if impacts is not None:
            at = accumulators.impacts - before
            if at < impacts.shape[0]:
                impacts[at, 0] = accumulators.onset * tick
                impacts[at, 1] = duration
                impacts[at, 2] = force
                impacts[at, 3] = accumulators.impulse
        accumulators.impacts += 1
        # of a contact that began before the run, what falls into it
        accumulators.contact_time += duration if accumulators.onset >= 0 else end * tick
        accumulators.peak_force = max(accumulators.peak_force, force)
    accumulators.total_impulse += accumulators.impulse
    accumulators.touching = 0
    accumulators.deepest = 0.0
    accumulators.impulse = 0.0


@compiled
def accumulate_open_contact(accumulators, law, end, tick):
    """Enter what a contact gave so far, of a run that is to go on from tick *end*."""
    accumulators.contact_time += (end - max(accumulators.onset, 0)) * tick
    accumulators.total_impulse += accumulators.impulse
    accumulators.peak_force = max(accumulators.peak_force, peak_force(law, accumulators.deepest))


@compiled
def safe_interval(distance, bound, tip_speed, acceleration, step):
    """For how long a signal at *distance* from zero cannot reach it, at most a few steps; 0 if a bound is not finite."""
    horizon = TRUST * step
    speed = _MARGIN * bound + tip_speed + abs(acceleration) * horizon
    safe = select_less(distance, speed * horizon, distance / speed, horizon)
    return select_less(speed, math.inf, safe, 0.0 * horizon)


@compiled
def contact_halvings(clock, elapsed, d, dv):
    """Halvings of the flight step for a step in contact: graded from the onset and towards the release."""
    want = GRADING * elapsed
    if dv < 0.0:
        want = min(want, -RELEASE * d / dv)
    level = clock.min_contact_halvings
    while level < clock.max_halvings and (clock.step >> level) * clock.tick > want:
        level += 1
    return level


@inlined
def time_beyond(time, crossing, step):
    """Time since the last zero crossing of mid-span, if it is less than two steps before *time*; otherwise 0."""
    span = time - crossing
    return select_less(span, 2.0 * step, span, 0.0 * step)


@compiled
def flight_halvings(clock, stretch, stretch_at_rest):
    """Halvings of the flight step for a beam stretched far beyond its wells."""
    level = 0
    reach = STRETCH_LIMIT * stretch_at_rest
    while level < clock.max_halvings and stretch_at_rest > 0.0 and abs(stretch) > reach:
        reach *= 2.0
        level += 1
    return level


@compiled
def first_contact_onset(inner_samples, subintervals, subinterval):
    """Time of the first positive penetration inside a sampled step; -1 if there is none."""
    for i in range(subintervals):
        rise = first_upcrossing(
            inner_samples[i, 0],
            inner_samples[i, 1],
            inner_samples[i + 1, 0],
            inner_samples[i + 1, 1],
            subinterval,
        )
        if rise >= 0.0:
            return (i + rise) * subinterval
    return -1.0


@compiled
def refine_onset(clock, event_ticks, whole, kinematics, smallest_correction):
    """Refined end of a step of *whole* ticks that was shortened to *event_ticks* but did not end at the onset.

    The samples inside the step follow from a linear flow with a tension that varies linearly; a step that ends there
    is more accurate.  *smallest_correction* is the smallest correction, s, that is made.
    """
    if kinematics.dv > 0.0:
        late = kinematics.d / kinematics.dv
        if abs(late) > smallest_correction:
            return min(max(1, event_ticks - round(late / clock.tick)), whole)
    return event_ticks


@compiled
def count_zero_crossings_in_step(
    accumulators,
    clock,
    start,
    length,
    kinematics,
    kinematics1,
    inner_samples,
    rest,
    subintervals,
    subinterval,
):
    """Count zero crossings of the centre in a step, through the samples inside it."""
    left, left_rate, begun = kinematics.c, kinematics.cv, 0.0
    i = 1
    while True:
        if i < subintervals and i * subinterval < length:
            right, right_rate, ended = rest + inner_samples[i, 2], inner_samples[i, 3], i * subinterval
        else:
            right, right_rate, ended = kinematics1.c, kinematics1.cv, length
        found, last, side = count_zero_crossings(
            accumulators.side, left, left_rate, right, right_rate, ended - begun
        )
        accumulators.side = side
        if found > 0:
            when = start * clock.tick + begun + last * (ended - begun)
            accumulators.zero_crossings += found
            accumulators.last_zero_crossing = when
            if when > clock.last_quarter * clock.tick:
                accumulators.zero_crossings_last_quarter += found
        if ended >= length:
            return
        left, left_rate, begun = right, right_rate, ended
        i += 1


@compiled
def accumulate_displacement(accumulators, kinematics, kinematics1, length):
    """Widen the extremes of the beam at the striker and at the centre by a step, and add to their mean squares."""
    accumulators.min_displacement, accumulators.max_displacement = update_extrema(
        accumulators.min_displacement,
        accumulators.max_displacement,
        kinematics.w,
        kinematics.wv,
        kinematics1.w,
        kinematics1.wv,
        length,
    )
    accumulators.min_center, accumulators.max_center = update_extrema(
        accumulators.min_center,
        accumulators.max_center,
        kinematics.c,
        kinematics.cv,
        kinematics1.c,
        kinematics1.cv,
        length,
    )
    accumulators.peak_velocity = max(accumulators.peak_velocity, abs(kinematics1.wv))
    accumulators.peak_midspan_velocity = max(accumulators.peak_midspan_velocity, abs(kinematics1.cv))
    if length > 0.0:
        inverse = 1.0 / length
        accumulators.square_displacement += square_of_signal(
            kinematics.w, kinematics.wv, kinematics1.w, kinematics1.wv, length
        )
        accumulators.square_center += square_of_signal(
            kinematics.c, kinematics.cv, kinematics1.c, kinematics1.cv, length
        )
        accumulators.square_velocity += square_of_rate(
            kinematics.w, kinematics.wv, kinematics1.w, kinematics1.wv, length, inverse
        )
        accumulators.square_midspan_velocity += square_of_rate(
            kinematics.c, kinematics.cv, kinematics1.c, kinematics1.cv, length, inverse
        )


@inlined
def square_of_signal(u0, v0, u1, v1, length):
    """Integral of the square of a signal over a step, of its values *u* and its rates *v* at both ends.

    The trapezoidal rule with the correction by the slopes at the ends.  Over steps of equal length the corrections
    cancel, so that a mode that swings fast within a step is averaged without bias.
    """
    return (0.5 * length) * (u0 * u0 + u1 * u1) + (_SIXTH * (length * length)) * (u0 * v0 - u1 * v1)


@inlined
def square_of_rate(u0, v0, u1, v1, length, inverse):
    """Integral of the square of the rate *v* of a signal *u* over a step; *inverse* is 1 / *length*.

    From the rates at both ends and their mean, which the values of the signal give without error: with half the
    difference a of the rates and the distance b of their average from the mean, mean^2 + a^2 / 3 + g b^2.  The rule has
    order four with any g.  With g = 3/5 its error over many steps has order six: of a sine of 2 rad in a step the
    mean square is 0.15 % low, of one of 3 rad 1.5 %, of one of 4 rad 6 %.
    """
    mean = (u1 - u0) * inverse
    a, b = 0.5 * (v1 - v0), 0.5 * (v0 + v1) - mean
    return length * (mean * mean + _THIRD * (a * a) + 0.6 * (b * b))


@inlined
def begin_energy(accumulators, whole, high, rate, high_rate):
    """Begin to add up the energy of the modes at a state with this energy and this rate, high modes separately."""
    accumulators.modal_energy, accumulators.high_energy = whole, high
    accumulators.modal_power, accumulators.high_power = rate, high_rate


@inlined
def accumulate_energy(accumulators, whole, high, rate, high_rate, span):
    """Add to the energy of the modes over time, up to a state with this energy and this rate, *span* after the last."""
    half, twelfth = 0.5 * span, TWELFTH * (span * span)
    accumulators.energy_time += half * (accumulators.modal_energy + whole) + twelfth * (
        accumulators.modal_power - rate
    )
    accumulators.high_energy_time += half * (accumulators.high_energy + high) + twelfth * (
        accumulators.high_power - high_rate
    )
    begin_energy(accumulators, whole, high, rate, high_rate)


@inlined
def begin_other_well(accumulators, whole, high, rate, high_rate, span):
    """Begin to add up the energy of the modes about the other well, into which the centre came *span* ago."""
    half = 0.5 * (span * span)
    accumulators.energy_time += (whole - accumulators.modal_energy) * span - half * (
        rate - accumulators.modal_power
    )
    accumulators.high_energy_time += (high - accumulators.high_energy) * span - half * (
        high_rate - accumulators.high_power
    )
    begin_energy(accumulators, whole, high, rate, high_rate)
