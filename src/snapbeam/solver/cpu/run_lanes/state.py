"""A run takes a lane: what stays the same in it, the steps that are prepared for it, how it begins."""

from __future__ import annotations

import math
from typing import NamedTuple

from snapbeam.solver.compilation import called, compiled, inlined
from snapbeam.solver.contact_force import contact_energy, contact_force, is_impulsive
from snapbeam.solver.cpu.run_lanes import layout as at
from snapbeam.solver.cpu.run_lanes.step import (
    beam_energies,
    beam_signals,
    groups_of,
    modal_energies,
    modal_energy,
    modes_of,
    signals,
    tension,
)
from snapbeam.solver.excitation import drive_rate, numbers_of
from snapbeam.solver.physics import (
    decay_less_one,
    rotation,
    shaker_motion,
    sincos,
    sincos_cosm1,
    tension_energy,
)
from snapbeam.solver.simd import WIDTH, broadcast_load, lanes_tuple, load, mask_of, pick, splat, store
from snapbeam.solver.splitting import TURNS, Stages
from snapbeam.solver.step_control import SUBINTERVALS, TWELFTH, ContactKinematics, begin_statistics
from snapbeam.util.status_codes import RunStatus

TWO_PI = 2.0 * math.pi
_OK, _RUNNING = int(RunStatus.OK), int(RunStatus.INTERRUPTED)


class LaneSettings(NamedTuple):
    """Settings common to all runs, apart from the modes."""

    stages: Stages
    gamma: float
    stretch: float
    """Squared slopes in a well; 0 if there is one well only."""
    slot: int
    """Plain numbers of a prepared step."""
    sampling: int
    """Memory offset of the samples inside a step."""


@inlined
def flows_over(m, shape, length, place, which):
    """The exact flow of every mode over *length*, a time a lane, into the rows from *place* on of the lanes *which*."""
    for i in range(modes_of(shape)):
        mode = at.MODE + i * at.MODE_ROWS
        omega_damped, sigma = (
            broadcast_load(m, mode + at.OMEGA_DAMPED),
            broadcast_load(m, mode + at.DAMPING),
        )
        sine, _, less_one = sincos_cosm1(omega_damped * length)
        lost = decay_less_one(sigma * length)
        squared = broadcast_load(m, mode + at.OMEGA_SQUARED)
        a11, a12, a21, a22 = rotation(sigma, squared, sine / omega_damped, less_one, lost)
        row = mode + place
        store(m, row, pick(which, a11, load(m, row)))
        store(m, row + WIDTH, pick(which, a12, load(m, row + WIDTH)))
        store(m, row + 2 * WIDTH, pick(which, a21, load(m, row + 2 * WIDTH)))
        store(m, row + 3 * WIDTH, pick(which, a22, load(m, row + 3 * WIDTH)))


@called
def prepare(m, shape, lane_settings, place, length, omega):
    """Prepare a step of *length* at *place*: flows of all modes, and rotations of a drive of frequency *omega*."""
    for group in range(groups_of(shape)):
        pairs = at.PAIRS + 4 * WIDTH * group
        omega_damped, sigma, squared = (
            load(m, pairs),
            load(m, pairs + WIDTH),
            load(m, pairs + 2 * WIDTH),
        )
        part = load(m, pairs + 3 * WIDTH) * length
        sine, _, less_one = sincos_cosm1(omega_damped * part)
        a11, a12, a21, a22 = rotation(
            sigma, squared, sine / omega_damped, less_one, decay_less_one(sigma * part)
        )
        store(m, place, a11)
        store(m, place + WIDTH, a12)
        store(m, place + 2 * WIDTH, a21)
        store(m, place + 3 * WIDTH, a22)
        place += 4 * WIDTH
    for i in range(0, TURNS, WIDTH):
        sine, cosine = sincos(load(m, lane_settings.stages.elapsed + i) * (length * omega))
        store(m, place + i, sine)
        store(m, place + TURNS + i, cosine)


@inlined
def slot_of(lane_settings, lane, level):
    """Memory offset of the prepared step of a level."""
    return at.TABLES + (lane * (at.LEVELS + 1) + level) * lane_settings.slot


@compiled
def _prepare_all(m, shape, lane_settings, lane, levels):
    """The steps of a lane at every level."""
    step_time, omega = m[at.STEP_TIME + lane], m[at.OMEGA + lane]
    for level in range(levels):
        prepare(
            m,
            shape,
            lane_settings,
            slot_of(lane_settings, lane, level),
            step_time / (1 << level),
            omega,
        )


@compiled
def observe_run(m, shape, lane_settings, lane):
    """The kinematics of a lane at the state Q, P, and its tension; returns its energy without the contact."""
    which = mask_of(1 << lane)
    gq, qr = tension(m, shape, lane_settings.gamma, which, at.Q)
    w, wv, c, cv = signals(m, shape, at.Q, at.P)
    linear = modal_energy(m, shape, at.Q, at.P)
    phase = load(m, at.PHASE0) + TWO_PI * (load(m, at.WITHIN) / load(m, at.PERIOD))
    sine, cosine = sincos(phase)
    motion, velocity = shaker_motion(load(m, at.AMPLITUDE), load(m, at.OMEGA), sine, cosine)
    well_sign, rest = load(m, at.WELL_SIGN), load(m, at.REST_CONTACT)
    offset = load(m, at.OFFSET) + (1.0 - well_sign) * rest
    beam, beam_rate = beam_signals(m, shape, at.Q, at.P, w, wv)
    store(m, at.W, pick(which, beam + well_sign * rest, load(m, at.W)))
    store(m, at.WV, pick(which, beam_rate, load(m, at.WV)))
    store(m, at.D, pick(which, offset + motion - w, load(m, at.D)))
    store(m, at.DV, pick(which, velocity - wv, load(m, at.DV)))
    store(m, at.C, pick(which, c + well_sign * load(m, at.REST_CENTER), load(m, at.C)))
    store(m, at.CV, pick(which, cv, load(m, at.CV)))
    store(m, at.STRETCH, pick(which, 2.0 * gq + qr, load(m, at.STRETCH)))
    store(m, at.TEMP, linear + tension_energy(lane_settings.gamma, gq, qr))
    return m[at.TEMP + lane]


@inlined
def _energies_at(m, shape, law, q, p, k, d, pressed):
    """Energy of all linear modes, of those of the beam, of the high ones, and the rates of the last two."""
    force = pick(mask_of(pressed), contact_force(law, d), splat(0.0))
    linear, high, power, high_power = modal_energies(m, shape, q, p, k, force)
    whole, power = beam_energies(m, shape, q, p, k, force, linear, power)
    return linear, whole, high, power, high_power


@inlined
def _keep_energies(m, whole, high, power, high_power, mask):
    """Store the latest energies and powers of the masked lanes."""
    for row, value in (
        (at.ENERGY, whole),
        (at.HIGH_ENERGY, high),
        (at.POWER, power),
        (at.HIGH_POWER, high_power),
    ):
        store(m, row, pick(mask, value, load(m, row)))


@inlined
def sample_energy(m, shape, law, q, p, k, d, pressed, t, which):
    """Add to the energy of the modes over time, in the lanes *which*; returns that of all linear modes.

    *d* is the penetration in the lanes *pressed*; *t* is the present tick.
    """
    linear, whole, high, power, high_power = _energies_at(m, shape, law, q, p, k, d, pressed)
    mask, zero = mask_of(which), splat(0.0)
    span = (t - load(m, at.ENERGY_TICK)) * load(m, at.TICK)
    half, twelfth = 0.5 * span, TWELFTH * (span * span)
    more = half * (load(m, at.ENERGY) + whole) + twelfth * (load(m, at.POWER) - power)
    store(m, at.ENERGY_TIME, load(m, at.ENERGY_TIME) + pick(mask, more, zero))
    more = half * (load(m, at.HIGH_ENERGY) + high) + twelfth * (load(m, at.HIGH_POWER) - high_power)
    store(m, at.HIGH_TIME, load(m, at.HIGH_TIME) + pick(mask, more, zero))
    store(m, at.ENERGY_TICK, pick(mask, t, load(m, at.ENERGY_TICK)))
    _keep_energies(m, whole, high, power, high_power, mask)
    return linear


@called
def close_energy(m, shape, kernel_input, touching, which):
    """The same where the lanes *which* are now, between two steps."""
    law = lanes_tuple(kernel_input.law, m, at.LAW)
    sample_energy(m, shape, law, at.Q, at.P, at.K, load(m, at.D), touching & which, load(m, at.T), which)


@called
def change_energy_origin(m, shape, kernel_input, span, touching, which):
    """Begin to add up the energy of the modes about the other well, which was entered *span* ago."""
    law, mask, zero = lanes_tuple(kernel_input.law, m, at.LAW), mask_of(which), splat(0.0)
    _, whole, high, power, high_power = _energies_at(
        m, shape, law, at.Q, at.P, at.K, load(m, at.D), touching & which
    )
    half = 0.5 * (span * span)
    more = (whole - load(m, at.ENERGY)) * span - half * (power - load(m, at.POWER))
    store(m, at.ENERGY_TIME, load(m, at.ENERGY_TIME) + pick(mask, more, zero))
    more = (high - load(m, at.HIGH_ENERGY)) * span - half * (high_power - load(m, at.HIGH_POWER))
    store(m, at.HIGH_TIME, load(m, at.HIGH_TIME) + pick(mask, more, zero))
    _keep_energies(m, whole, high, power, high_power, mask)


@compiled
def _constants(m, shape, kernel_input, lane, i):
    """Write the constants of run *i* to its lane."""
    record = kernel_input.runs[i]
    drive = numbers_of(kernel_input.drive, kernel_input.drive_numbers, i)
    m[at.OMEGA + lane], m[at.AMPLITUDE + lane] = drive.omega, drive.amplitude
    for f in range(kernel_input.law_numbers.shape[1]):
        m[at.LAW + f * WIDTH + lane] = kernel_input.law_numbers[i, f]
    step_time = record.step * record.tick
    m[at.TICK + lane], m[at.STEP + lane], m[at.STEP_TIME + lane] = record.tick, record.step, step_time
    m[at.PERIOD + lane], m[at.OUTPUT_INTERVAL + lane] = record.period, record.output_interval
    m[at.END + lane] = record.end
    m[at.LIMIT + lane] = min(record.output_interval, record.end)
    m[at.COARSEST + lane], m[at.MAX_HALVINGS + lane] = record.min_contact_halvings, record.max_halvings
    m[at.COARSE_TICKS + lane] = record.step >> record.min_contact_halvings
    m[at.PHASE0 + lane], m[at.OFFSET + lane], m[at.WELL_SIGN + lane] = (
        record.phase,
        record.offset,
        record.well_sign,
    )
    m[at.REST_CONTACT + lane], m[at.REST_CENTER + lane] = record.rest_contact, record.rest_center
    m[at.TIP_SPEED + lane] = record.tip_speed
    m[at.DECIDE_REACH + lane], m[at.DECIDE_ENERGY + lane] = record.decide_reach, record.decide_energy
    m[at.DECIDE_CROSSINGS + lane], m[at.MAX_STEPS + lane] = record.decide_crossings, kernel_input.max_steps
    fastest = drive_rate(drive)
    for j in range(modes_of(shape)):
        mode = at.MODE + j * at.MODE_ROWS
        fastest = max(fastest, m[mode + at.OMEGA_I])
        m[mode + at.CONTACT + lane] = kernel_input.contact_rows[record.contact_row, j]
        m[mode + at.Q + lane] = kernel_input.starts[record.start_row, 0, j]
        m[mode + at.P + lane] = kernel_input.starts[record.start_row, 1, j]
        m[mode + at.SEEN_WELL + lane] = record.well_sign * m[mode + at.WELL]
    shortest_subinterval = TWO_PI / (SUBINTERVALS * fastest)
    m[at.SHORTEST_SUBINTERVAL + lane], m[at.STEP_SUBINTERVALS + lane] = (
        shortest_subinterval,
        max(4, math.ceil(step_time / shortest_subinterval)),
    )


@compiled
def begin_run(m, n, shape, lane_settings, kernel_input, lane, i, accumulators):
    """Put run *i* into a lane; its status."""
    record, bit = kernel_input.runs[i], 1 << lane
    n[at.RUNS + lane] = i
    _constants(m, shape, kernel_input, lane, i)
    _prepare_all(m, shape, lane_settings, lane, record.max_halvings + 1)
    m[at.KEY + lane], m[at.FLOW_KEY + lane], m[at.SUBINTERVALS + lane] = -99.0, -1.0, 0.0
    m[at.T + lane] = m[at.WITHIN + lane] = 0.0
    energy = observe_run(m, shape, lane_settings, lane)
    kinematics = ContactKinematics(
        m[at.W + lane], m[at.WV + lane], m[at.D + lane], m[at.DV + lane], m[at.C + lane], m[at.CV + lane]
    )
    law = numbers_of(kernel_input.law, kernel_input.law_numbers, i)
    since = record.contact_time
    touching = since >= 0.0
    if not math.isfinite(since):
        pressed = kinematics.d > 0.0 or (kinematics.d == 0.0 and kinematics.dv > 0.0)
        touching = pressed and not is_impulsive(law)
    accumulators.touching, accumulators.onset = int(touching), 0
    if math.isfinite(since) and since > 0.0:
        accumulators.onset = -int(since / record.tick + 0.5)
    begin_statistics(accumulators, kinematics.c, kinematics, law, energy + contact_energy(law, kinematics.d))
    m[at.ONSET + lane], m[at.SIDE + lane], m[at.DEEPEST + lane] = (
        accumulators.onset,
        accumulators.side,
        accumulators.deepest,
    )
    m[at.CROSSING + lane] = accumulators.last_zero_crossing
    m[at.MIN_W + lane], m[at.MAX_W + lane] = accumulators.min_displacement, accumulators.max_displacement
    m[at.MIN_C + lane], m[at.MAX_C + lane] = accumulators.min_center, accumulators.max_center
    for row in range(at.PEAK_WV, at.CROSSING, WIDTH):
        m[row + lane] = 0.0
    for row in range(at.IMPULSE, at.DEEPEST, WIDTH):
        m[row + lane] = 0.0
    for row in (
        at.SAFE_GAP,
        at.SAFE_CENTER,
        at.ENERGY_TICK,
        at.STEPS_SINCE_START,
        at.STEPS,
        at.CROSSINGS_LAST_QUARTER,
    ):
        m[row + lane] = 0.0
    for j in range(at.TOUCHING, at.ODD + 1):
        n[j] &= ~bit
    n[at.LIVE] |= bit
    if touching:
        n[at.TOUCHING] |= bit
    if kernel_input.high:
        close_energy(m, shape, kernel_input, n[at.TOUCHING], bit)
    return _RUNNING if record.end > 0 else _OK
