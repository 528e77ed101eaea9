"""The next step of every lane, and the flows that it needs."""

from __future__ import annotations

from snapbeam.engines.cpu.few import places as at
from snapbeam.engines.cpu.few.seat import TWO_PI, flows_over
from snapbeam.engines.cpu.few.text import modes_of, tension
from snapbeam.engines.scalar.compile import compiled, inlined
from snapbeam.engines.scalar.composition import TURNS
from snapbeam.engines.scalar.decisions import GRADING, RELEASE, STRETCHED
from snapbeam.engines.scalar.lanes import WIDTH, load, splat, spread_at, store, vabs
from snapbeam.engines.scalar.masks import bits, less, lowest, mask_of, pick, vmax, vmin
from snapbeam.engines.scalar.physics import sincos

__all__ = ["choose", "fetch"]

_CUSTOM = -99.0
"""Key of flows that were made for a step of any length."""


@compiled
def _change_wells(m, shape, world, which):
    """Take the other well as the origin, in some lanes."""
    home, mask = load(m, at.HOME), mask_of(which)
    for i in range(modes_of(shape)):
        mode = at.MODE + i * at.MODE_ROWS
        q, well = load(m, mode + at.Q), load(m, mode + at.SEEN_WELL)
        store(m, mode + at.Q, pick(mask, q - home * spread_at(m, mode + at.SHIFT), q))
        store(m, mode + at.SEEN_WELL, pick(mask, 0.0 - well, well))
    store(m, at.HOME, pick(mask, 0.0 - home, home))
    gq, qr = tension(m, shape, world.gamma, mask, at.Q)
    store(m, at.STRETCH, pick(mask, 2.0 * gq + qr, load(m, at.STRETCH)))


@inlined
def _flight(m, n, world, fresh):
    """Level and ticks of a step in free flight."""
    quiet = n[at.QUIET]
    step = load(m, at.STEP)
    level = pick(mask_of(quiet), splat(-1.0), splat(0.0))
    ticks = pick(mask_of(quiet), 2.0 * step, step)
    if world.stretch > 0.0:
        reach = STRETCHED * world.stretch
        stretched, finest = vabs(load(m, at.STRETCH)), load(m, at.FINEST)
        more = bits(less(reach, stretched)) & bits(less(level, finest)) & fresh & ~quiet
        while more:
            mask = mask_of(more)
            level, ticks = pick(mask, level + 1.0, level), pick(mask, 0.5 * ticks, ticks)
            reach *= 2.0
            more &= bits(less(reach, stretched)) & bits(less(level, finest))
    return level, ticks


@inlined
def _in_contact(m, level, ticks, touching):
    """The same of the lanes in contact: graded from the onset and towards the release."""
    tick, dv = load(m, at.TICK), load(m, at.DV)
    want = GRADING * ((load(m, at.T) - load(m, at.ONSET)) * tick)
    left = -RELEASE * load(m, at.D) / dv
    want = pick(less(dv, 0.0), vmin(want, left), want)
    own, own_ticks, finest = load(m, at.COARSEST), load(m, at.COARSE_TICKS), load(m, at.FINEST)
    more = bits(less(want, own_ticks * tick)) & bits(less(own, finest)) & touching
    while more:
        mask = mask_of(more)
        own, own_ticks = pick(mask, own + 1.0, own), pick(mask, 0.5 * own_ticks, own_ticks)
        more &= bits(less(want, own_ticks * tick)) & bits(less(own, finest))
    mask = mask_of(touching)
    return pick(mask, vmax(level, own), level), pick(mask, vmin(ticks, own_ticks), ticks)


@inlined
def choose(m, n, shape, world):
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
    level, ticks = _flight(m, n, world, fresh)
    if n[at.TOUCHING] & fresh:
        level, ticks = _in_contact(m, level, ticks, n[at.TOUCHING] & fresh)
    t, limit = load(m, at.T), load(m, at.LIMIT)
    over = bits(less(limit, t + ticks)) & fresh
    ticks = pick(mask_of(over), limit - t, ticks)
    n[at.ODD] = (n[at.ODD] & ~fresh) | over
    ticks = pick(which, ticks, load(m, at.TICKS))
    store(m, at.TICKS, ticks)
    store(m, at.LEVEL, pick(which, level, load(m, at.LEVEL)))
    store(m, at.LENGTH, pick(mask_of(n[at.ASIDE]), load(m, at.LENGTH), ticks * load(m, at.TICK)))
    store(m, at.PHASE, load(m, at.PHASE0) + TWO_PI * (load(m, at.WITHIN) / load(m, at.PERIOD)))
    return fresh


@inlined
def _fetch_prepared(m, shape, world, lane):
    """The flows of a prepared step into a lane."""
    level = int(m[at.LEVEL + lane])
    m[at.KEY + lane] = m[at.LEVEL + lane]
    place = at.TABLES + lane * at.LEVELS * world.slot + (level + 1) * world.slot
    flows = world.stages.flows
    distinct = (flows + 1) // 2
    for i in range(modes_of(shape)):
        row = at.MODE + i * at.MODE_ROWS + at.FLOW + lane
        for j in range(4 * distinct):
            m[row + j * WIDTH] = m[place + j]
        place += 4 * distinct
    for j in range(flows + 1):
        m[at.TURN + j * WIDTH + lane] = m[place + j]
        m[at.TURN + (TURNS + j) * WIDTH + lane] = m[place + TURNS + j]


@compiled
def _make(m, shape, world, odd):
    """The flows of steps of any length, and the drive's turns in them, for some lanes."""
    stages, which = world.stages, mask_of(odd)
    length, omega = load(m, at.LENGTH), load(m, at.OMEGA)
    for flow in range((stages.flows + 1) // 2):
        flows_over(m, shape, m[stages.flow + flow] * length, at.FLOW + 4 * WIDTH * flow, which)
    for stage in range(stages.flows + 1):
        sine, cosine = sincos(m[stages.elapsed + stage] * (length * omega))
        row = at.TURN + stage * WIDTH
        store(m, row, pick(which, sine, load(m, row)))
        row += TURNS * WIDTH
        store(m, row, pick(which, cosine, load(m, row)))
    store(m, at.KEY, pick(which, splat(_CUSTOM), load(m, at.KEY)))


@inlined
def fetch(m, n, shape, world):
    """Have the flows of every lane's step at hand."""
    odd = (n[at.ODD] | n[at.ASIDE]) & n[at.LIVE]
    level, key = load(m, at.LEVEL), load(m, at.KEY)
    other = (bits(less(level, key)) | bits(less(key, level))) & n[at.LIVE] & ~odd
    while other:
        lane = lowest(other)
        other &= other - 1
        _fetch_prepared(m, shape, world, lane)
    if odd:
        _make(m, shape, world, odd)
