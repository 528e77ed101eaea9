"""After a step of every lane: which enter or leave the contact in it, and where such steps are cut."""

from __future__ import annotations

from typing import Any, NamedTuple

from snapbeam.engines.cpu.few import places as at
from snapbeam.engines.cpu.few.modes import bounds, propagate_free
from snapbeam.engines.cpu.few.seat import flows_over
from snapbeam.engines.scalar.compile import compiled, inlined
from snapbeam.engines.scalar.decisions import (
    ContactKinematics,
    clock_of,
    refine_onset,
    first_contact_onset,
    safe_interval,
)
from snapbeam.engines.scalar.lanes import WIDTH, load, splat, store, vabs, vfloor, vtrunc
from snapbeam.engines.scalar.masks import bits, less, lowest, mask_of, pick, vmax
from snapbeam.engines.scalar.signals import first_downcrossing, turning_point, update_extrema

__all__ = ["About", "cut_again", "look_at", "meet", "probe"]


class About(NamedTuple):
    """What is seen at the ends of the steps, eight of each: beam at striker and centre from rest, the penetration."""

    w: Any
    wv: Any
    d: Any
    dv: Any
    c: Any
    cv: Any


@compiled
def look_at(m, look, lane, looked):
    """What was seen inside the step of a lane, as the scalar functions have it; returns how many pieces."""
    pieces = int(m[at.LOOK_PIECES + lane])
    for i in range(pieces + 1):
        for j in range(4):
            looked[i, j] = m[look + (4 * i + j) * WIDTH + lane]
    return pieces


@inlined
def _safe(m, shape, late, early_center):
    """Until when the gap cannot close, and the centre cannot cross, in lanes where that has passed."""
    bound, push, center_bound, center_push = bounds(m, shape)
    t, tick, step_time = load(m, at.T), load(m, at.TICK), load(m, at.STEP_TIME)
    zero = splat(0.0)
    gap = safe_interval(zero - load(m, at.D), bound, load(m, at.TIP_SPEED), push, step_time)
    store(m, at.SAFE_GAP, pick(mask_of(late), t + vtrunc(gap / tick), load(m, at.SAFE_GAP)))
    center = safe_interval(vabs(load(m, at.C)), center_bound, zero, center_push, step_time)
    store(m, at.SAFE_CENTER, pick(mask_of(early_center), t + vtrunc(center / tick), load(m, at.SAFE_CENTER)))


@inlined
def _look(m, shape, world, lookers, with_center):
    """Look into the free steps of some lanes; returns where the penetration may have been positive."""
    which, ticks, step = mask_of(lookers), load(m, at.TICKS), load(m, at.STEP)
    length, pieces = load(m, at.LENGTH), load(m, at.PIECES)
    single = ~(bits(less(ticks, step)) | bits(less(step, ticks)))
    double = ~(bits(less(ticks, 2.0 * step)) | bits(less(2.0 * step, ticks)))
    usual = single | double
    other = vmax(splat(2.0), 0.0 - vfloor(0.0 - length / load(m, at.FINEST_LOOK)))
    pieces = pick(mask_of(double), 2.0 * pieces, pieces)
    pieces = pick(mask_of(usual), pieces, other)
    store(m, at.LOOK_PIECES, pick(which, pieces, load(m, at.LOOK_PIECES)))
    store(m, at.LOOK_PIECE, pick(which, length / pieces, load(m, at.LOOK_PIECE)))
    key, had = pick(mask_of(usual), splat(0.0), ticks), load(m, at.LOOK_KEY)
    stale = (bits(less(key, had)) | bits(less(had, key))) & lookers
    if stale:
        flows_over(m, shape, load(m, at.LOOK_PIECE), at.LOOK, mask_of(stale))
        store(m, at.LOOK_KEY, pick(mask_of(stale), key, had))
    most, left = 0, lookers
    while left:
        most = max(most, int(m[at.LOOK_PIECES + lowest(left)]))
        left &= left - 1
    return bits(less(0.0, propagate_free(m, shape, world.look, which, with_center, most)))


@inlined
def _cut(m, n, lane, cut):
    """End the step of a lane after *cut* ticks, in another pass."""
    bit = 1 << lane
    n[at.CUTTING] |= bit
    n[at.ODD] |= bit
    m[at.WHOLE + lane] = m[at.TICKS + lane]
    m[at.TICKS + lane] = cut


@compiled
def _leave(m, n, about_d, about_dv, leaving):
    """Cut the steps in which the penetration falls below zero; returns the lanes whose steps end there as they are."""
    store(m, at.TEMP, about_d)
    store(m, at.TEMP1, about_dv)
    whole = 0
    while leaving:
        lane = lowest(leaving)
        leaving &= leaving - 1
        n[at.EVENT] |= 1 << lane
        ticks, d = int(m[at.TICKS + lane]), m[at.D + lane]
        cut = ticks
        if d > 0.0:
            fall = first_downcrossing(
                d, m[at.DV + lane], m[at.TEMP + lane], m[at.TEMP1 + lane], m[at.LENGTH + lane]
            )
            cut = max(1, int(fall * ticks))
        if cut != ticks:
            _cut(m, n, lane, cut)
        else:
            whole |= 1 << lane
    return whole


@compiled
def _enter(m, n, look, rising, looked):
    """Cut the steps in which the gap closes; returns those that end as they are, and those that touch at once."""
    on, at_once = 0, 0
    while rising:
        lane = lowest(rising)
        rising &= rising - 1
        bit = 1 << lane
        pieces = look_at(m, look, lane, looked)
        entry = first_contact_onset(looked, pieces, m[at.LOOK_PIECE + lane])
        if entry < 0.0:
            on |= bit
            continue
        ticks = int(m[at.TICKS + lane])
        cut = min(ticks, int(entry / m[at.TICK + lane]))
        if cut < 1:
            at_once |= bit
            continue
        n[at.EVENT] |= bit
        if cut != ticks:
            n[at.LOOKS] |= bit
            _cut(m, n, lane, cut)
        else:
            on |= bit
    return on, at_once


@inlined
def meet(m, n, shape, world, about, whole, looked):
    """What the steps of the lanes *whole* meet; returns those that end as they are, and those that touch at once."""
    if whole == 0:
        return 0, 0
    touching = whole & n[at.TOUCHING]
    free = whole & ~touching
    ends, at_once = whole, 0
    if touching:
        leaving = touching & ~bits(less(0.0, about.d))
        if leaving:
            ends = (ends & ~leaving) | _leave(m, n, about.d, about.dv, leaving)
    if free:
        after = load(m, at.T) + load(m, at.TICKS)
        late, early = bits(less(load(m, at.SAFE_GAP), after)), bits(less(load(m, at.SAFE_CENTER), after))
        if (late | early) & free:
            _safe(m, shape, late & free, early & free)
            late = bits(less(load(m, at.SAFE_GAP), after)) & free
            early = bits(less(load(m, at.SAFE_CENTER), after)) & free
            if late | early:
                rising = _look(m, shape, world, late | early, early != 0) & late
                if rising:
                    on, at_once = _enter(m, n, world.look, rising, looked)
                    ends = (ends & ~rising) | on
    return ends, at_once


@compiled
def cut_again(m, n, kernel_input, d, dv, which):
    """Cut the steps of lanes once more that enter the contact, where they did not meet it; returns those that do."""
    store(m, at.TEMP, d)
    store(m, at.TEMP1, dv)
    again = 0
    while which:
        lane = lowest(which)
        which &= which - 1
        n[at.LOOKS] &= ~(1 << lane)
        clock = clock_of(kernel_input.runs[n[at.RUNS + lane]], kernel_input.max_steps)
        seen = ContactKinematics(0.0, 0.0, m[at.TEMP + lane], m[at.TEMP1 + lane], 0.0, 0.0)
        least = (clock.step >> clock.finest) * clock.tick
        ticks = int(m[at.TICKS + lane])
        cut = refine_onset(clock, ticks, int(m[at.WHOLE + lane]), seen, least)
        if cut != ticks:
            m[at.TICKS + lane] = cut
            again |= 1 << lane
    return again


@compiled
def probe(m, n, d, dv, turning):
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
            n[at.ASIDE] |= 1 << lane
            found |= 1 << lane
    return found
