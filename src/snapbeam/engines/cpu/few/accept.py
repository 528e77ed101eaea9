"""Steps that are taken: statistics, contacts that begin and end, energy, and where every lane stands then."""

from __future__ import annotations

from snapbeam.engines.cpu.few import places as at
from snapbeam.engines.cpu.few.meet import look_at
from snapbeam.engines.cpu.few.modes import modal_energy, modes_of
from snapbeam.engines.scalar.compile import compiled, inlined
from snapbeam.engines.scalar.decisions import (
    ContactKinematics,
    clock_of,
    count_zero_crossings_in_step,
    close_impact,
    low_energy_limit,
)
from snapbeam.engines.scalar.lanes import WIDTH, load, splat, broadcast_load, store, vabs, vfloor
from snapbeam.engines.scalar.masks import bits, less, lowest, mask_of, pick, vmax, vmin
from snapbeam.engines.scalar.physics import mode_energy, tension_energy
from snapbeam.engines.scalar.signals import hermite_overshoot_bound, update_extrema
from snapbeam.engines.scalar.tip import numbers_of

__all__ = ["accept", "end_contact"]


@compiled
def _widen(m, low, high, u0, v0, which):
    """Widen the extremes of some lanes by cubics that pass their ends; those are at the end of the step in TEMP."""
    while which:
        lane = lowest(which)
        which &= which - 1
        m[low + lane], m[high + lane] = update_extrema(
            m[low + lane], m[high + lane], m[u0 + lane], m[v0 + lane],
            m[at.TEMP + lane], m[at.TEMP1 + lane], m[at.LENGTH + lane],
        )  # fmt: skip


@inlined
def _extremes(m, low, high, u0, v0, u1, v1, length, which):
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
        _widen(m, low, high, u0, v0, turning)


@inlined
def _add(m, row, which, more):
    store(m, row, load(m, row) + pick(which, more, splat(0.0)))


@inlined
def _track(m, seen1, length, which):
    """Extremes and mean squares, as :func:`~snapbeam.engines.scalar.decisions.accumulate_displacement` keeps them."""
    _extremes(m, at.MIN_W, at.MAX_W, at.W, at.WV, seen1.w, seen1.wv, length, which)
    _extremes(m, at.MIN_C, at.MAX_C, at.C, at.CV, seen1.c, seen1.cv, length, which)
    mask, half = mask_of(which), 0.5 * length
    peak, center_peak = load(m, at.PEAK_WV), load(m, at.PEAK_CV)
    store(m, at.PEAK_WV, pick(mask, vmax(peak, vabs(seen1.wv)), peak))
    store(m, at.PEAK_CV, pick(mask, vmax(center_peak, vabs(seen1.cv)), center_peak))
    w, wv, c, cv = load(m, at.W), load(m, at.WV), load(m, at.C), load(m, at.CV)
    _add(m, at.SQUARE_W, mask, half * (w * w + seen1.w * seen1.w))
    _add(m, at.SQUARE_C, mask, half * (c * c + seen1.c * seen1.c))
    _add(m, at.SQUARE_WV, mask, half * (wv * wv + seen1.wv * seen1.wv))
    _add(m, at.SQUARE_CV, mask, half * (cv * cv + seen1.cv * seen1.cv))


@compiled
def _count(m, n, world, kernel_input, accumulators_of_runs, c1, cv1, which, looked):
    """Count the crossings of the centre in the steps of some lanes."""
    store(m, at.TEMP, c1)
    store(m, at.TEMP1, cv1)
    while which:
        lane = lowest(which)
        which &= which - 1
        i = n[at.RUNS + lane]
        accumulators, clock = accumulators_of_runs[i], clock_of(kernel_input.runs[i], kernel_input.max_steps)
        pieces = 0
        if not n[at.TOUCHING] & (1 << lane):
            pieces = look_at(m, world.look, lane, looked)
        seen = ContactKinematics(0.0, 0.0, 0.0, 0.0, m[at.C + lane], m[at.CV + lane])
        seen1 = ContactKinematics(0.0, 0.0, 0.0, 0.0, m[at.TEMP + lane], m[at.TEMP1 + lane])
        rest = m[at.HOME + lane] * m[at.REST_CENTER + lane]
        start, length, piece = int(m[at.T + lane]), m[at.LENGTH + lane], m[at.LOOK_PIECE + lane]
        count_zero_crossings_in_step(
            accumulators, clock, start, length, seen, seen1, looked, rest, pieces, piece
        )
        m[at.SIDE + lane], m[at.LATE + lane] = accumulators.side, accumulators.zero_crossings_last_quarter


@inlined
def _crossings(m, n, world, kernel_input, accumulators_of_runs, seen1, length, after, which, looked):
    """Where the centre may have crossed, have it counted."""
    touching = which & n[at.TOUCHING]
    near = bits(less(load(m, at.SAFE_CENTER), after)) & which & ~touching
    if touching:
        side = load(m, at.SIDE)
        clear = vmin(side * load(m, at.C), side * seen1.c)
        near |= touching & ~bits(less(hermite_overshoot_bound(load(m, at.CV), seen1.cv, length), clear))
    if near:
        _count(m, n, world, kernel_input, accumulators_of_runs, seen1.c, seen1.cv, near, looked)


@inlined
def end_contact(m, kernel_input, i, lane, accumulators, end):
    """Enter the contact that ends at tick *end* in the book."""
    law = numbers_of(kernel_input.law, kernel_input.law_numbers, i)
    accumulators.deepest, accumulators.impulse = m[at.DEEPEST + lane], m[at.IMPULSE + lane]
    close_impact(accumulators, None, 0, law, end, m[at.TICK + lane])
    m[at.DEEPEST + lane] = m[at.IMPULSE + lane] = 0.0


@compiled
def _events(m, n, kernel_input, accumulators_of_runs, which):
    """Contacts that begin and end where their lanes stand now."""
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
def _beam_energy(m, body, energy):
    """As :func:`~snapbeam.engines.cpu.rows.beam_energy` of the other layout, at the ends of the steps."""
    if body is None:
        return energy
    omega = broadcast_load(m, body + at.OMEGA_I)
    return energy - mode_energy(omega, load(m, body + at.Q1), load(m, body + at.P1))


@inlined
def _weigh(m, n, shape, world, seen1, released, events, which):
    """After some steps, or a release, look at the energy; returns the lanes whose future is certain."""
    beat = load(m, at.BEAT)
    eighth = bits(less(beat - 8.0 * vfloor(0.125 * beat), 0.5))
    due = (released | eighth) & which
    if due == 0:
        return 0
    mask, t = mask_of(due), load(m, at.T)
    linear, high = modal_energy(m, shape, at.Q1, at.P1)
    span = (t - load(m, at.WEIGHED)) * load(m, at.TICK)
    _add(m, at.ENERGY_TIME, mask, _beam_energy(m, world.body, linear) * span)
    _add(m, at.HIGH_TIME, mask, high * span)
    store(m, at.WEIGHED, pick(mask, t, load(m, at.WEIGHED)))
    apart = due & ~n[at.TOUCHING]
    energy = linear + tension_energy(world.gamma, load(m, at.GQ), load(m, at.QR))
    quiet = bits(less(energy, low_energy_limit(world.gamma, world.stretch)))
    n[at.QUIET] = (n[at.QUIET] & ~apart) | (quiet & apart)
    sixteenth = bits(less(beat - 16.0 * vfloor(0.0625 * beat), 0.5))
    sure = apart & ~events & sixteenth & bits(less(load(m, at.HOME), 0.0))
    if sure:
        sure &= bits(less(load(m, at.DECIDE_REACH), seen1.w)) & bits(less(0.0, seen1.c))
        sure &= bits(less(energy, load(m, at.DECIDE_ENERGY)))
    return sure


@inlined
def accept(m, n, shape, world, kernel_input, accumulators_of_runs, about, given, which, looked):
    """Take the steps of the lanes *which*; returns those that are decided."""
    mask, length = mask_of(which), load(m, at.LENGTH)
    well_sign = load(m, at.HOME)
    seen1 = ContactKinematics(
        about.w + well_sign * load(m, at.REST_CONTACT), about.wv, about.d, about.dv,
        about.c + well_sign * load(m, at.REST_CENTER), about.cv,
    )  # fmt: skip
    touching = which & n[at.TOUCHING]
    if touching:
        impulse, work, gross = given
        pressed = mask_of(touching)
        deepest = load(m, at.DEEPEST)
        store(m, at.DEEPEST, pick(pressed, vmax(deepest, about.d), deepest))
        _add(m, at.IMPULSE, pressed, impulse)
        _add(m, at.WORK, pressed, work)
        _add(m, at.GROSS, pressed, gross)
    _track(m, seen1, length, which)
    ticks, period = load(m, at.TICKS), load(m, at.PERIOD)
    after = load(m, at.T) + ticks
    _crossings(m, n, world, kernel_input, accumulators_of_runs, seen1, length, after, which, looked)
    store(m, at.T, pick(mask, after, load(m, at.T)))
    within = load(m, at.WITHIN)
    turned = within + ticks
    turned = pick(less(turned, period), turned, turned - period)
    store(m, at.WITHIN, pick(mask, turned, within))
    events = n[at.EVENT] & which
    released = events & touching
    if events:
        _events(m, n, kernel_input, accumulators_of_runs, events)
    for bit in (at.CUTTING, at.EVENT, at.LOOKS, at.PROBED):
        n[bit] &= ~which
    sure = _weigh(m, n, shape, world, seen1, released, events, which)
    many = load(m, at.DECIDE_CROSSINGS)
    sure |= bits(less(-0.5, many)) & bits(less(many, load(m, at.LATE))) & which
    for i in range(modes_of(shape)):
        mode = at.MODE + i * at.MODE_ROWS
        for field in range(at.Q, at.K + WIDTH, WIDTH):
            new = load(m, mode + field + at.Q1 - at.Q)
            store(m, mode + field, pick(mask, new, load(m, mode + field)))
    d = pick(mask_of(released), vmin(seen1.d, splat(0.0)), seen1.d)
    store(m, at.W, pick(mask, seen1.w, load(m, at.W)))
    store(m, at.WV, pick(mask, seen1.wv, load(m, at.WV)))
    store(m, at.D, pick(mask, d, load(m, at.D)))
    store(m, at.DV, pick(mask, seen1.dv, load(m, at.DV)))
    store(m, at.C, pick(mask, seen1.c, load(m, at.C)))
    store(m, at.CV, pick(mask, seen1.cv, load(m, at.CV)))
    store(m, at.STRETCH, pick(mask, 2.0 * load(m, at.GQ) + load(m, at.QR), load(m, at.STRETCH)))
    return sure
