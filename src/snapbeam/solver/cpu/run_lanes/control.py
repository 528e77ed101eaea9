"""The next step of every lane, and the flows that it needs."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

from snapbeam.solver.compilation import compiled, inlined
from snapbeam.solver.cpu.run_lanes import layout as at
from snapbeam.solver.cpu.run_lanes.state import (
    TWO_PI,
    change_energy_origin,
    close_energy,
    flows_over,
    prepare,
    sample_energy,
    slot_of,
)
from snapbeam.solver.cpu.run_lanes.step import (
    bounds,
    cubic_errors,
    load_prepared_step,
    modal_energy,
    modes_of,
    propagate_free,
    tension,
)
from snapbeam.solver.excitation import numbers_of
from snapbeam.solver.interpolation import (
    first_downcrossing,
    hermite_overshoot_bound,
    turning_point,
    update_extrema,
)
from snapbeam.solver.physics import sincos, tension_energy
from snapbeam.solver.simd import (
    WIDTH,
    bits,
    broadcast_load,
    halvings,
    less,
    load,
    lowest,
    mask_of,
    pick,
    power_of_two,
    splat,
    store,
    vabs,
    vfloor,
    vmax,
    vmin,
    vtrunc,
)
from snapbeam.solver.step_control import (
    GRADING,
    RELEASE,
    STRETCH_LIMIT,
    ContactKinematics,
    clock_of,
    close_impact,
    count_zero_crossings_in_step,
    first_contact_onset,
    refine_onset,
    safe_interval,
    square_of_rate,
    square_of_signal,
    time_beyond,
)

_CUSTOM = -99.0
"""Key of flows that were made for a step of any length."""


@compiled
def _change_wells(m, n, shape, lane_settings, kernel_input, which):
    """Take the other well as the origin, in some lanes."""
    well_sign, mask = load(m, at.WELL_SIGN), mask_of(which)
    if kernel_input.high:
        close_energy(m, shape, kernel_input, n[at.TOUCHING], which)
    for i in range(modes_of(shape)):
        mode = at.MODE + i * at.MODE_ROWS
        q, well = load(m, mode + at.Q), load(m, mode + at.SEEN_WELL)
        store(m, mode + at.Q, pick(mask, q - well_sign * broadcast_load(m, mode + at.SHIFT), q))
        store(m, mode + at.SEEN_WELL, pick(mask, 0.0 - well, well))
    store(m, at.WELL_SIGN, pick(mask, 0.0 - well_sign, well_sign))
    gq, qr = tension(m, shape, lane_settings.gamma, mask, at.Q)
    store(m, at.STRETCH, pick(mask, 2.0 * gq + qr, load(m, at.STRETCH)))
    if kernel_input.high:
        now = load(m, at.T) * load(m, at.TICK)
        span = time_beyond(now, load(m, at.CROSSING), load(m, at.STEP_TIME))
        change_energy_origin(m, shape, kernel_input, span, n[at.TOUCHING], which)


@inlined
def _flight_halvings(m, n, lane_settings):
    """Halvings of the flight step in free flight."""
    level = splat(0.0)
    if lane_settings.stretch > 0.0:
        far = halvings(vabs(load(m, at.STRETCH)), splat(STRETCH_LIMIT * lane_settings.stretch))
        level = vmin(vmax(far, level), load(m, at.MAX_HALVINGS))
    return level


@inlined
def _contact_halvings(m, level, touching):
    """The same of the lanes in contact: graded from the onset and towards the release."""
    dv = load(m, at.DV)
    want = GRADING * ((load(m, at.T) - load(m, at.ONSET)) * load(m, at.TICK))
    left = -RELEASE * load(m, at.D) / dv
    want = vmax(pick(less(dv, 0.0), vmin(want, left), want), splat(0.0))
    graded = vmax(halvings(load(m, at.STEP_TIME), want), load(m, at.COARSEST))
    return pick(mask_of(touching), vmax(level, vmin(graded, load(m, at.MAX_HALVINGS))), level)


@inlined
def propose_step(m, n, shape, lane_settings, kernel_input):
    """The length of the next step of every lane that begins one; returns those."""
    fresh = n[at.LIVE] & ~(n[at.SHORTENED] | n[at.INSIDE] | n[at.PROBED])
    if lane_settings.stretch > 0.0:
        across = load(m, at.C) * (load(m, at.WELL_SIGN) * load(m, at.REST_CENTER))
        crossed = bits(less(across, 0.0)) & fresh
        if crossed:
            _change_wells(m, n, shape, lane_settings, kernel_input, crossed)
    which = mask_of(fresh)
    one = pick(which, splat(1.0), splat(0.0))
    store(m, at.STEPS, load(m, at.STEPS) + one)
    store(m, at.STEPS_SINCE_START, load(m, at.STEPS_SINCE_START) + one)
    level = _flight_halvings(m, n, lane_settings)
    if n[at.TOUCHING] & fresh:
        level = _contact_halvings(m, level, n[at.TOUCHING] & fresh)
    ticks = load(m, at.STEP) * power_of_two(0.0 - level)
    t, limit = load(m, at.T), load(m, at.LIMIT)
    over = bits(less(limit, t + ticks)) & fresh
    ticks = pick(mask_of(over), limit - t, ticks)
    n[at.ODD] = (n[at.ODD] & ~fresh) | over
    ticks = pick(which, ticks, load(m, at.TICKS))
    store(m, at.TICKS, ticks)
    store(m, at.LEVEL, pick(which, level, load(m, at.LEVEL)))
    store(m, at.LENGTH, pick(mask_of(n[at.INSIDE]), load(m, at.LENGTH), ticks * load(m, at.TICK)))
    phase = load(m, at.PHASE0) + TWO_PI * (load(m, at.WITHIN) / load(m, at.PERIOD))
    sine, cosine = sincos(phase)
    store(m, at.PHASE, phase)
    store(m, at.SINE, sine)
    store(m, at.COSINE, cosine)
    return fresh


@compiled
def _prepare_any_length(m, shape, lane_settings, odd):
    """Prepare steps of any length, and have them at hand."""
    while odd:
        lane = lowest(odd)
        odd &= odd - 1
        place = slot_of(lane_settings, lane, at.LEVELS)
        prepare(m, shape, lane_settings, place, m[at.LENGTH + lane], m[at.OMEGA + lane])
        load_prepared_step(m, shape, place, lane)
        m[at.KEY + lane] = _CUSTOM


@inlined
def load_flows(m, n, shape, lane_settings):
    """Have the flows of every lane's step at hand."""
    odd = (n[at.ODD] | n[at.INSIDE]) & n[at.LIVE]
    level, key = load(m, at.LEVEL), load(m, at.KEY)
    other = (bits(less(level, key)) | bits(less(key, level))) & n[at.LIVE] & ~odd
    while other:
        lane = lowest(other)
        other &= other - 1
        load_prepared_step(m, shape, slot_of(lane_settings, lane, int(m[at.LEVEL + lane])), lane)
        m[at.KEY + lane] = m[at.LEVEL + lane]
    if odd:
        _prepare_any_length(m, shape, lane_settings, odd)


# After a step of every lane: which contacts begin or end in it, and where such steps then end.


class About(NamedTuple):
    """The kinematics at the ends of the steps, eight of each: beam at striker and centre from rest, the penetration."""

    w: Any
    wv: Any
    d: Any
    dv: Any
    c: Any
    cv: Any


@compiled
def inner_samples_of(m, sampling, lane, inner_samples):
    """Copy the samples inside the step of a lane to the layout of the scalar functions; returns the number of subintervals."""
    subintervals = int(m[at.SUBINTERVALS + lane])
    for i in range(subintervals + 1):
        for j in range(4):
            inner_samples[i, j] = m[sampling + (4 * i + j) * WIDTH + lane]
    return subintervals


@inlined
def _update_safe_intervals(m, shape, late, early_center):
    """Until when the gap cannot close, and the centre cannot cross, in lanes where that has passed."""
    bound, push, center_bound, center_push = bounds(m, shape)
    t, tick, step_time = load(m, at.T), load(m, at.TICK), load(m, at.STEP_TIME)
    zero = splat(0.0)
    gap = safe_interval(zero - load(m, at.D), bound, load(m, at.TIP_SPEED), push, step_time)
    store(m, at.SAFE_GAP, pick(mask_of(late), t + vtrunc(gap / tick), load(m, at.SAFE_GAP)))
    center = safe_interval(vabs(load(m, at.C)), center_bound, zero, center_push, step_time)
    store(m, at.SAFE_CENTER, pick(mask_of(early_center), t + vtrunc(center / tick), load(m, at.SAFE_CENTER)))


@inlined
def _exclude_by_cubics(m, shape, observed, after, late, early):
    """Lanes in which the gap may close within the step, and the centre may cross, after all.

    The cubics through both ends of the step bound the motion inside it, at a fraction of the price of samples.  Where they
    exclude an event, the step is safe.
    """
    length = load(m, at.LENGTH)
    gap_error, center_error = cubic_errors(m, shape, length)
    reach = vmax(load(m, at.D), observed.d) + hermite_overshoot_bound(load(m, at.DV), observed.dv, length)
    apart = bits(less(reach + gap_error, 0.0)) & late
    rest = load(m, at.WELL_SIGN) * load(m, at.REST_CENTER)
    c0, c1 = load(m, at.C), observed.c + rest
    swell = hermite_overshoot_bound(load(m, at.CV), observed.cv, length) + center_error
    clear = bits(less(swell, vmin(vabs(c0), vabs(c1)))) & bits(less(0.0, c0 * c1)) & early
    store(m, at.SAFE_GAP, pick(mask_of(apart), after, load(m, at.SAFE_GAP)))
    store(m, at.SAFE_CENTER, pick(mask_of(clear), after, load(m, at.SAFE_CENTER)))
    return late & ~apart, early & ~clear


@inlined
def _sample_inside_steps(m, shape, lane_settings, sampled, with_center):
    """Sample the free steps of some lanes inside; returns where the penetration may have been positive."""
    which, ticks, step = mask_of(sampled), load(m, at.TICKS), load(m, at.STEP)
    length, subintervals = load(m, at.LENGTH), load(m, at.STEP_SUBINTERVALS)
    usual = ~(bits(less(ticks, step)) | bits(less(step, ticks)))
    other = vmax(splat(2.0), 0.0 - vfloor(0.0 - length / load(m, at.SHORTEST_SUBINTERVAL)))
    subintervals = pick(mask_of(usual), subintervals, other)
    store(m, at.SUBINTERVALS, pick(which, subintervals, load(m, at.SUBINTERVALS)))
    store(m, at.SUBINTERVAL, pick(which, length / subintervals, load(m, at.SUBINTERVAL)))
    key, had = pick(mask_of(usual), splat(0.0), ticks), load(m, at.FLOW_KEY)
    stale = (bits(less(key, had)) | bits(less(had, key))) & sampled
    if stale:
        flows_over(m, shape, load(m, at.SUBINTERVAL), at.SAMPLING_FLOW, mask_of(stale))
        store(m, at.FLOW_KEY, pick(mask_of(stale), key, had))
    most, left = 0, sampled
    while left:
        most = max(most, int(m[at.SUBINTERVALS + lowest(left)]))
        left &= left - 1
    return bits(less(0.0, propagate_free(m, shape, lane_settings.sampling, which, with_center, most)))


@inlined
def _end_step(m, n, lane, event_ticks):
    """End the step of a lane after *event_ticks* ticks, in another pass."""
    bit = 1 << lane
    n[at.SHORTENED] |= bit
    n[at.ODD] |= bit
    m[at.WHOLE + lane] = m[at.TICKS + lane]
    m[at.TICKS + lane] = event_ticks


@compiled
def _end_at_release(m, n, about_d, about_dv, leaving):
    """Cut the steps in which the penetration falls below zero; returns the lanes whose steps end there as they are."""
    store(m, at.TEMP, about_d)
    store(m, at.TEMP1, about_dv)
    whole = 0
    while leaving:
        lane = lowest(leaving)
        leaving &= leaving - 1
        n[at.EVENT] |= 1 << lane
        ticks, d = int(m[at.TICKS + lane]), m[at.D + lane]
        event_ticks = ticks
        if d > 0.0:
            fall = first_downcrossing(
                d, m[at.DV + lane], m[at.TEMP + lane], m[at.TEMP1 + lane], m[at.LENGTH + lane]
            )
            event_ticks = max(1, int(fall * ticks))
        if event_ticks != ticks:
            _end_step(m, n, lane, event_ticks)
        else:
            whole |= 1 << lane
    return whole


@compiled
def _end_at_onset(m, n, sampling, rising, inner_samples):
    """Cut the steps in which the gap closes; returns those that end as they are, and those that touch at once."""
    on, at_once = 0, 0
    while rising:
        lane = lowest(rising)
        rising &= rising - 1
        bit = 1 << lane
        subintervals = inner_samples_of(m, sampling, lane, inner_samples)
        onset_time = first_contact_onset(inner_samples, subintervals, m[at.SUBINTERVAL + lane])
        if onset_time < 0.0:
            on |= bit
            continue
        ticks = int(m[at.TICKS + lane])
        event_ticks = min(ticks, int(onset_time / m[at.TICK + lane]))
        if event_ticks < 1:
            at_once |= bit
            continue
        n[at.EVENT] |= bit
        if event_ticks != ticks:
            n[at.REFINING] |= bit
            _end_step(m, n, lane, event_ticks)
        else:
            on |= bit
    return on, at_once


@inlined
def detect_contact_events(m, n, shape, lane_settings, observed, whole, inner_samples):
    """Contact events in the steps of the lanes *whole*; returns the lanes whose steps end as they are, and those in contact at once."""
    if whole == 0:
        return 0, 0
    touching = whole & n[at.TOUCHING]
    free = whole & ~touching
    ends, at_once = whole, 0
    if touching:
        leaving = touching & ~bits(less(0.0, observed.d))
        if leaving:
            ends = (ends & ~leaving) | _end_at_release(m, n, observed.d, observed.dv, leaving)
    if free:
        after = load(m, at.T) + load(m, at.TICKS)
        late, early = bits(less(load(m, at.SAFE_GAP), after)), bits(less(load(m, at.SAFE_CENTER), after))
        if (late | early) & free:
            _update_safe_intervals(m, shape, late & free, early & free)
            late = bits(less(load(m, at.SAFE_GAP), after)) & free
            early = bits(less(load(m, at.SAFE_CENTER), after)) & free
            if late | early:
                late, early = _exclude_by_cubics(m, shape, observed, after, late, early)
            if late | early:
                rising = _sample_inside_steps(m, shape, lane_settings, late | early, early != 0) & late
                if rising:
                    on, at_once = _end_at_onset(m, n, lane_settings.sampling, rising, inner_samples)
                    ends = (ends & ~rising) | on
    return ends, at_once


@compiled
def refine_onsets(m, n, kernel_input, d, dv, which):
    """Cut the steps of lanes once more that enter the contact, where their ends missed the onset; returns those lanes."""
    store(m, at.TEMP, d)
    store(m, at.TEMP1, dv)
    again = 0
    while which:
        lane = lowest(which)
        which &= which - 1
        n[at.REFINING] &= ~(1 << lane)
        clock = clock_of(kernel_input.runs[n[at.RUNS + lane]], kernel_input.max_steps)
        kinematics = ContactKinematics(0.0, 0.0, m[at.TEMP + lane], m[at.TEMP1 + lane], 0.0, 0.0)
        least = (clock.step >> clock.max_halvings) * clock.tick
        ticks = int(m[at.TICKS + lane])
        event_ticks = refine_onset(clock, ticks, int(m[at.WHOLE + lane]), kinematics, least)
        if event_ticks != ticks:
            m[at.TICKS + lane] = event_ticks
            again |= 1 << lane
    return again


@compiled
def detect_deepest_points(m, n, d, dv, turning):
    """Lanes whose contact is deepest inside the step at hand: a pass of theirs goes there first; returns those."""
    store(m, at.TEMP, d)
    store(m, at.TEMP1, dv)
    found = 0
    while turning:
        lane = lowest(turning)
        turning &= turning - 1
        d0, v0, d1, v1 = m[at.D + lane], m[at.DV + lane], m[at.TEMP + lane], m[at.TEMP1 + lane]
        length, deepest = m[at.LENGTH + lane], max(m[at.DEEPEST + lane], m[at.TEMP + lane])
        turn = turning_point(d0, v0, d1, v1, length)
        if turn > 0.0 and update_extrema(d0, deepest, d0, v0, d1, v1, length)[1] > deepest:
            m[at.DEEPEST + lane] = deepest
            m[at.LENGTH + lane] = turn * length
            n[at.INSIDE] |= 1 << lane
            found |= 1 << lane
    return found


# Steps that are taken: statistics, contacts that begin and end, energy, and where every lane stands then.


@compiled
def _extend_by_turning_points(m, low, high, u0, v0, which):
    """Widen the extremes of some lanes by cubics that pass their ends; those are at the end of the step in TEMP."""
    while which:
        lane = lowest(which)
        which &= which - 1
        m[low + lane], m[high + lane] = update_extrema(
            m[low + lane], m[high + lane], m[u0 + lane], m[v0 + lane],
            m[at.TEMP + lane], m[at.TEMP1 + lane], m[at.LENGTH + lane],
        )  # fmt: skip


@inlined
def _accumulate_extremes(m, low, high, u0, v0, u1, v1, length, which):
    before, rate = load(m, u0), load(m, v0)
    lesser, greater = vmin(before, u1), vmax(before, u1)
    swell = hermite_overshoot_bound(rate, v1, length)
    least, most = load(m, low), load(m, high)
    past = (bits(less(most, greater + swell)) | bits(less(lesser - swell, least))) & which
    turning = bits(less(rate * v1, 0.0)) & past
    mask = mask_of(which & ~turning)
    store(m, low, pick(mask, vmin(least, lesser), least))
    store(m, high, pick(mask, vmax(most, greater), most))
    if turning:
        store(m, at.TEMP, u1)
        store(m, at.TEMP1, v1)
        _extend_by_turning_points(m, low, high, u0, v0, turning)


@inlined
def _add(m, row, which, more):
    store(m, row, load(m, row) + pick(which, more, splat(0.0)))


@inlined
def _accumulate_displacement(m, kinematics1, length, which):
    """Extremes and mean squares, as :func:`~snapbeam.solver.step_control.accumulate_displacement` keeps them."""
    _accumulate_extremes(m, at.MIN_W, at.MAX_W, at.W, at.WV, kinematics1.w, kinematics1.wv, length, which)
    _accumulate_extremes(m, at.MIN_C, at.MAX_C, at.C, at.CV, kinematics1.c, kinematics1.cv, length, which)
    mask = mask_of(which)
    peak, center_peak = load(m, at.PEAK_WV), load(m, at.PEAK_CV)
    store(m, at.PEAK_WV, pick(mask, vmax(peak, vabs(kinematics1.wv)), peak))
    store(m, at.PEAK_CV, pick(mask, vmax(center_peak, vabs(kinematics1.cv)), center_peak))
    w, wv, c, cv = load(m, at.W), load(m, at.WV), load(m, at.C), load(m, at.CV)
    inverse = 1.0 / length
    _add(m, at.SQUARE_W, mask, square_of_signal(w, wv, kinematics1.w, kinematics1.wv, length))
    _add(m, at.SQUARE_C, mask, square_of_signal(c, cv, kinematics1.c, kinematics1.cv, length))
    _add(m, at.SQUARE_WV, mask, square_of_rate(w, wv, kinematics1.w, kinematics1.wv, length, inverse))
    _add(m, at.SQUARE_CV, mask, square_of_rate(c, cv, kinematics1.c, kinematics1.cv, length, inverse))


@compiled
def _count_zero_crossings(
    m, n, lane_settings, kernel_input, accumulators_of_runs, c1, cv1, which, inner_samples
):
    """Count the crossings of the centre in the steps of some lanes."""
    store(m, at.TEMP, c1)
    store(m, at.TEMP1, cv1)
    while which:
        lane = lowest(which)
        which &= which - 1
        i = n[at.RUNS + lane]
        accumulators, clock = accumulators_of_runs[i], clock_of(kernel_input.runs[i], kernel_input.max_steps)
        subintervals = 0
        if not n[at.TOUCHING] & (1 << lane):
            subintervals = inner_samples_of(m, lane_settings.sampling, lane, inner_samples)
        kinematics = ContactKinematics(0.0, 0.0, 0.0, 0.0, m[at.C + lane], m[at.CV + lane])
        kinematics1 = ContactKinematics(0.0, 0.0, 0.0, 0.0, m[at.TEMP + lane], m[at.TEMP1 + lane])
        rest = m[at.WELL_SIGN + lane] * m[at.REST_CENTER + lane]
        start, length, subinterval = int(m[at.T + lane]), m[at.LENGTH + lane], m[at.SUBINTERVAL + lane]
        count_zero_crossings_in_step(
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
        )
        m[at.SIDE + lane], m[at.CROSSINGS_LAST_QUARTER + lane] = (
            accumulators.side,
            accumulators.zero_crossings_last_quarter,
        )
        m[at.CROSSING + lane] = accumulators.last_zero_crossing


@inlined
def _accumulate_zero_crossings(
    m, n, lane_settings, kernel_input, accumulators_of_runs, kinematics1, length, after, which, inner_samples
):
    """Count zero crossings of mid-span in the lanes in which one is possible."""
    touching = which & n[at.TOUCHING]
    near = bits(less(load(m, at.SAFE_CENTER), after)) & which & ~touching
    if touching:
        side = load(m, at.SIDE)
        clear = vmin(side * load(m, at.C), side * kinematics1.c)
        near |= touching & ~bits(less(hermite_overshoot_bound(load(m, at.CV), kinematics1.cv, length), clear))
    if near:
        _count_zero_crossings(
            m,
            n,
            lane_settings,
            kernel_input,
            accumulators_of_runs,
            kinematics1.c,
            kinematics1.cv,
            near,
            inner_samples,
        )


@inlined
def end_contact(m, kernel_input, i, lane, accumulators, end):
    """Enter the contact that ends at tick *end* in the record of accumulators."""
    law = numbers_of(kernel_input.law, kernel_input.law_numbers, i)
    accumulators.deepest, accumulators.impulse = m[at.DEEPEST + lane], m[at.IMPULSE + lane]
    close_impact(accumulators, None, 0, law, end, m[at.TICK + lane])
    m[at.DEEPEST + lane] = m[at.IMPULSE + lane] = 0.0


@compiled
def _begin_and_end_contacts(m, n, kernel_input, accumulators_of_runs, which):
    """Contacts that begin and end where their lanes are now."""
    n[at.TOUCHING] ^= which
    while which:
        lane = lowest(which)
        which &= which - 1
        i, t = n[at.RUNS + lane], int(m[at.T + lane])
        accumulators = accumulators_of_runs[i]
        m[at.SAFE_GAP + lane] = m[at.SAFE_CENTER + lane] = m[at.T + lane]
        if n[at.TOUCHING] & (1 << lane):
            accumulators.touching, accumulators.onset = 1, t
            m[at.ONSET + lane] = m[at.T + lane]
        else:
            end_contact(m, kernel_input, i, lane, accumulators, t)


@inlined
def _every(steps, share, many):
    """Lanes whose number of steps is a multiple of *many*, 1 / *share*."""
    return bits(less(steps - many * vfloor(share * steps), 0.5))


@inlined
def _monitor_energy(m, n, shape, lane_settings, kernel_input, law, kinematics1, events, which):
    """Add up the energy of the modes, and every sixteenth step return the lanes whose future is certain."""
    linear = splat(0.0)
    if kernel_input.high:
        pressed = n[at.TOUCHING] & which & ~events
        linear = sample_energy(
            m, shape, law, at.Q1, at.P1, at.K1, kinematics1.d, pressed, load(m, at.T), which
        )
    decides = which & ~(n[at.TOUCHING] | events) & _every(load(m, at.STEPS_SINCE_START), 0.0625, 16.0)
    decides &= bits(less(splat(-math.inf), load(m, at.DECIDE_ENERGY)))
    decides &= bits(less(load(m, at.WELL_SIGN), 0.0))
    decides &= bits(less(load(m, at.DECIDE_REACH), kinematics1.w)) & bits(less(0.0, kinematics1.c))
    if decides == 0:
        return 0
    if not kernel_input.high:
        linear = modal_energy(m, shape, at.Q1, at.P1)
    energy = linear + tension_energy(lane_settings.gamma, load(m, at.GQ), load(m, at.QR))
    return decides & bits(less(energy, load(m, at.DECIDE_ENERGY)))


@inlined
def accept_steps(
    m,
    n,
    shape,
    lane_settings,
    kernel_input,
    accumulators_of_runs,
    law,
    observed,
    contact,
    which,
    inner_samples,
):
    """Accept the steps of the lanes *which*; returns those that are decided."""
    mask, length = mask_of(which), load(m, at.LENGTH)
    well_sign = load(m, at.WELL_SIGN)
    kinematics1 = ContactKinematics(
        observed.w + well_sign * load(m, at.REST_CONTACT), observed.wv, observed.d, observed.dv,
        observed.c + well_sign * load(m, at.REST_CENTER), observed.cv,
    )  # fmt: skip
    touching = which & n[at.TOUCHING]
    if touching:
        pressed = mask_of(touching)
        deepest = load(m, at.DEEPEST)
        store(m, at.DEEPEST, pick(pressed, vmax(deepest, observed.d), deepest))
        _add(m, at.IMPULSE, pressed, contact.impulse)
        _add(m, at.WORK, pressed, contact.work)
        _add(m, at.GROSS, pressed, contact.gross)
    _accumulate_displacement(m, kinematics1, length, which)
    ticks, period = load(m, at.TICKS), load(m, at.PERIOD)
    after = load(m, at.T) + ticks
    _accumulate_zero_crossings(
        m,
        n,
        lane_settings,
        kernel_input,
        accumulators_of_runs,
        kinematics1,
        length,
        after,
        which,
        inner_samples,
    )
    store(m, at.T, pick(mask, after, load(m, at.T)))
    within = load(m, at.WITHIN)
    turned = within + ticks
    turned = pick(less(turned, period), turned, turned - period)
    store(m, at.WITHIN, pick(mask, turned, within))
    events = n[at.EVENT] & which
    released = events & touching
    if events:
        _begin_and_end_contacts(m, n, kernel_input, accumulators_of_runs, events)
    for bit in (at.SHORTENED, at.EVENT, at.REFINING, at.PROBED):
        n[bit] &= ~which
    sure = _monitor_energy(m, n, shape, lane_settings, kernel_input, law, kinematics1, events, which)
    many = load(m, at.DECIDE_CROSSINGS)
    sure |= bits(less(-0.5, many)) & bits(less(many, load(m, at.CROSSINGS_LAST_QUARTER))) & which
    for i in range(modes_of(shape)):
        mode = at.MODE + i * at.MODE_ROWS
        for field in range(at.Q, at.K + WIDTH, WIDTH):
            new = load(m, mode + field + at.Q1 - at.Q)
            store(m, mode + field, pick(mask, new, load(m, mode + field)))
    d = pick(mask_of(released), vmin(kinematics1.d, splat(0.0)), kinematics1.d)
    store(m, at.W, pick(mask, kinematics1.w, load(m, at.W)))
    store(m, at.WV, pick(mask, kinematics1.wv, load(m, at.WV)))
    store(m, at.D, pick(mask, d, load(m, at.D)))
    store(m, at.DV, pick(mask, kinematics1.dv, load(m, at.DV)))
    store(m, at.C, pick(mask, kinematics1.c, load(m, at.C)))
    store(m, at.CV, pick(mask, kinematics1.cv, load(m, at.CV)))
    store(m, at.STRETCH, pick(mask, 2.0 * load(m, at.GQ) + load(m, at.QR), load(m, at.STRETCH)))
    return sure
