"""The next step of every lane, and the flows that it needs."""

from __future__ import annotations

from snapbeam.engines.cpu.few import places as at
from snapbeam.engines.cpu.few.modes import at_hand, modes_of, tension
from snapbeam.engines.cpu.few.seat import TWO_PI, prepare, slot_of
from snapbeam.engines.scalar.compile import compiled, inlined
from snapbeam.engines.scalar.decisions import GRADING, RELEASE, STRETCHED
from snapbeam.engines.scalar.lanes import load, splat, broadcast_load, store, vabs
from snapbeam.engines.scalar.masks import (
    bits,
    halvings,
    less,
    lowest,
    mask_of,
    pick,
    power_of_two,
    vmax,
    vmin,
)
from snapbeam.engines.scalar.physics import sincos

__all__ = ["propose_step", "fetch"]

_CUSTOM = -99.0
"""Key of flows that were made for a step of any length."""


@compiled
def _change_wells(m, shape, world, which):
    """Take the other well as the origin, in some lanes."""
    well_sign, mask = load(m, at.HOME), mask_of(which)
    for i in range(modes_of(shape)):
        mode = at.MODE + i * at.MODE_ROWS
        q, well = load(m, mode + at.Q), load(m, mode + at.SEEN_WELL)
        store(m, mode + at.Q, pick(mask, q - well_sign * broadcast_load(m, mode + at.SHIFT), q))
        store(m, mode + at.SEEN_WELL, pick(mask, 0.0 - well, well))
    store(m, at.HOME, pick(mask, 0.0 - well_sign, well_sign))
    gq, qr = tension(m, shape, world.gamma, mask, at.Q)
    store(m, at.STRETCH, pick(mask, 2.0 * gq + qr, load(m, at.STRETCH)))


@inlined
def _flight(m, n, world):
    """Halvings of the flight step in free flight, or -1."""
    level = splat(0.0)
    if world.stretch > 0.0:
        far = halvings(vabs(load(m, at.STRETCH)), splat(STRETCHED * world.stretch))
        level = vmin(vmax(far, level), load(m, at.FINEST))
    return pick(mask_of(n[at.QUIET]), splat(-1.0), level)


@inlined
def _in_contact(m, level, touching):
    """The same of the lanes in contact: graded from the onset and towards the release."""
    dv = load(m, at.DV)
    want = GRADING * ((load(m, at.T) - load(m, at.ONSET)) * load(m, at.TICK))
    left = -RELEASE * load(m, at.D) / dv
    want = vmax(pick(less(dv, 0.0), vmin(want, left), want), splat(0.0))
    graded = vmax(halvings(load(m, at.STEP_TIME), want), load(m, at.COARSEST))
    return pick(mask_of(touching), vmax(level, vmin(graded, load(m, at.FINEST))), level)


@inlined
def propose_step(m, n, shape, world):
    """The length of the next step of every lane that begins one; returns those."""
    fresh = n[at.LIVE] & ~(n[at.CUTTING] | n[at.ASIDE] | n[at.PROBED])
    if world.stretch > 0.0:
        across = load(m, at.C) * (load(m, at.HOME) * load(m, at.REST_CENTER))
        crossed = bits(less(across, 0.0)) & fresh
        if crossed:
            _change_wells(m, shape, world, crossed)
    which = mask_of(fresh)
    one = pick(which, splat(1.0), splat(0.0))
    store(m, at.STEPS, load(m, at.STEPS) + one)
    store(m, at.BEAT, load(m, at.BEAT) + one)
    level = _flight(m, n, world)
    if n[at.TOUCHING] & fresh:
        level = _in_contact(m, level, n[at.TOUCHING] & fresh)
    ticks = load(m, at.STEP) * power_of_two(0.0 - level)
    t, limit = load(m, at.T), load(m, at.LIMIT)
    over = bits(less(limit, t + ticks)) & fresh
    ticks = pick(mask_of(over), limit - t, ticks)
    n[at.ODD] = (n[at.ODD] & ~fresh) | over
    ticks = pick(which, ticks, load(m, at.TICKS))
    store(m, at.TICKS, ticks)
    store(m, at.LEVEL, pick(which, level, load(m, at.LEVEL)))
    store(m, at.LENGTH, pick(mask_of(n[at.ASIDE]), load(m, at.LENGTH), ticks * load(m, at.TICK)))
    phase = load(m, at.PHASE0) + TWO_PI * (load(m, at.WITHIN) / load(m, at.PERIOD))
    sine, cosine = sincos(phase)
    store(m, at.PHASE, phase)
    store(m, at.SINE, sine)
    store(m, at.COSINE, cosine)
    return fresh


@compiled
def _make(m, shape, world, odd):
    """Prepare steps of any length, and have them at hand."""
    while odd:
        lane = lowest(odd)
        odd &= odd - 1
        place = slot_of(world, lane, at.LEVELS - 1)
        prepare(m, shape, world, place, m[at.LENGTH + lane], m[at.OMEGA + lane])
        at_hand(m, shape, place, lane)
        m[at.KEY + lane] = _CUSTOM


@inlined
def fetch(m, n, shape, world):
    """Have the flows of every lane's step at hand."""
    odd = (n[at.ODD] | n[at.ASIDE]) & n[at.LIVE]
    level, key = load(m, at.LEVEL), load(m, at.KEY)
    other = (bits(less(level, key)) | bits(less(key, level))) & n[at.LIVE] & ~odd
    while other:
        lane = lowest(other)
        other &= other - 1
        at_hand(m, shape, slot_of(world, lane, int(m[at.LEVEL + lane])), lane)
        m[at.KEY + lane] = m[at.LEVEL + lane]
    if odd:
        _make(m, shape, world, odd)
