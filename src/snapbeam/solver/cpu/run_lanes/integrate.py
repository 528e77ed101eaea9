"""Integration of few modes: eight runs in a register, each with its own time, step, contact and well.

In every pass each lane takes a step of its own.  One that must end where the contact begins or ends takes that shorter
step in the next pass, while the others go on; so does one that must be sampled for the maximum penetration of a
contact.  A lane whose run has ended takes the next one.  Nothing passes from lane to lane, and every sum is taken in
the order in which the other layout takes it: results are the same to the bit, whatever a run is integrated with.
"""

from __future__ import annotations

import math

from snapbeam.solver.compilation import compiled, inlined
from snapbeam.solver.contact_force import contact_energy
from snapbeam.solver.cpu.run_lanes import layout as at
from snapbeam.solver.cpu.run_lanes.control import (
    About,
    accept_steps,
    detect_contact_events,
    detect_deepest_points,
    end_contact,
    load_flows,
    propose_step,
    refine_onsets,
)
from snapbeam.solver.cpu.run_lanes.state import begin_run, close_energy
from snapbeam.solver.cpu.run_lanes.step import beam_signals, modal_energy, signals, take_step, tension
from snapbeam.solver.excitation import numbers_of
from snapbeam.solver.physics import shaker_motion, sincos, tension_energy
from snapbeam.solver.simd import (
    WIDTH,
    bits,
    lanes_tuple,
    less,
    load,
    lowest,
    mask_of,
    pick,
    store,
    vabs,
    vmax,
)
from snapbeam.solver.step_control import accumulate_open_contact
from snapbeam.util.status_codes import RunStatus

_OK, _EARLY_STOP, _RUNNING = int(RunStatus.OK), int(RunStatus.EARLY_STOP), int(RunStatus.INTERRUPTED)
_DIVERGED, _STEP_LIMIT = int(RunStatus.DIVERGED), int(RunStatus.STEP_LIMIT)


@inlined
def _observe(m, shape):
    """The kinematics at the ends of the steps."""
    well_sign = load(m, at.WELL_SIGN)
    offset = load(m, at.OFFSET) + (1.0 - well_sign) * load(m, at.REST_CONTACT)
    omega = load(m, at.OMEGA)
    sine, cosine = sincos(load(m, at.PHASE) + omega * load(m, at.LENGTH))
    motion, velocity = shaker_motion(load(m, at.AMPLITUDE), omega, sine, cosine)
    w, wv, c, cv = signals(m, shape, at.Q1, at.P1)
    beam, beam_rate = beam_signals(m, shape, at.Q1, at.P1, w, wv)
    return About(beam, beam_rate, offset + motion - w, velocity - wv, c, cv)


@compiled
def _finish(m, n, shape, lane_settings, kernel_input, lane, accumulators, status, goes_on):
    """Close the record of accumulators of a lane; its last contact too, unless the run is to go on from here."""
    i, t, tick = n[at.RUNS + lane], int(m[at.T + lane]), m[at.TICK + lane]
    law = numbers_of(kernel_input.law, kernel_input.law_numbers, i)
    accumulators.deepest, accumulators.impulse = m[at.DEEPEST + lane], m[at.IMPULSE + lane]
    if n[at.TOUCHING] & (1 << lane):
        if goes_on:
            accumulate_open_contact(accumulators, law, t, tick)
        else:
            end_contact(m, kernel_input, i, lane, accumulators, t)
    if status == _EARLY_STOP:
        accumulators.early_stop_time = t * tick
    if kernel_input.high:
        close_energy(m, shape, kernel_input, n[at.TOUCHING], 1 << lane)
    gq, qr = tension(m, shape, lane_settings.gamma, mask_of(0), at.Q)
    linear = modal_energy(m, shape, at.Q, at.P)
    store(m, at.TEMP, linear + tension_energy(lane_settings.gamma, gq, qr))
    accumulators.energy = m[at.TEMP + lane] + contact_energy(law, m[at.D + lane])
    accumulators.displacement, accumulators.center = m[at.W + lane], m[at.C + lane]
    accumulators.min_displacement, accumulators.max_displacement = m[at.MIN_W + lane], m[at.MAX_W + lane]
    accumulators.min_center, accumulators.max_center = m[at.MIN_C + lane], m[at.MAX_C + lane]
    accumulators.peak_velocity, accumulators.peak_midspan_velocity = (
        m[at.PEAK_WV + lane],
        m[at.PEAK_CV + lane],
    )
    accumulators.square_displacement, accumulators.square_center = (
        m[at.SQUARE_W + lane],
        m[at.SQUARE_C + lane],
    )
    accumulators.square_velocity, accumulators.square_midspan_velocity = (
        m[at.SQUARE_WV + lane],
        m[at.SQUARE_CV + lane],
    )
    accumulators.energy_time, accumulators.high_energy_time = m[at.ENERGY_TIME + lane], m[at.HIGH_TIME + lane]
    accumulators.modal_energy, accumulators.high_energy = m[at.ENERGY + lane], m[at.HIGH_ENERGY + lane]
    accumulators.modal_power, accumulators.high_power = m[at.POWER + lane], m[at.HIGH_POWER + lane]
    accumulators.work, accumulators.gross_work = m[at.WORK + lane], m[at.GROSS + lane]
    accumulators.steps = int(m[at.STEPS + lane])
    accumulators.time, accumulators.status = t, status
    n[at.LIVE] &= ~(1 << lane)


@inlined
def _begin_at_once(m, n, accumulators_of_runs, which):
    """Contacts that begin with the step: it is taken again, in contact."""
    n[at.TOUCHING] |= which
    while which:
        lane = lowest(which)
        which &= which - 1
        accumulators = accumulators_of_runs[n[at.RUNS + lane]]
        accumulators.touching, accumulators.onset = 1, int(m[at.T + lane])
        m[at.ONSET + lane] = m[at.T + lane]


@inlined
def _pass(m, n, shape, lane_settings, kernel_input, accumulators_of_runs, inner_samples):
    """A step of every lane; returns the lanes that are not finite, decided, over, and at their limit of steps."""
    fresh = propose_step(m, n, shape, lane_settings, kernel_input)
    load_flows(m, n, shape, lane_settings)
    live = n[at.LIVE]
    touching = n[at.TOUCHING] & live
    law = lanes_tuple(kernel_input.law, m, at.LAW)
    contact = take_step(
        m, shape, lane_settings.stages, lane_settings.gamma, touching != 0, mask_of(touching), law
    )
    observed = _observe(m, shape)
    going = live
    inside = n[at.INSIDE] & live
    if inside:
        deepest = load(m, at.DEEPEST)
        store(m, at.DEEPEST, pick(mask_of(inside), vmax(deepest, observed.d), deepest))
        n[at.INSIDE] &= ~inside
        n[at.PROBED] |= inside
        going &= ~inside
    failed = going & ~bits(less(vabs(observed.d + observed.dv), math.inf))
    going &= ~failed
    refining = n[at.REFINING] & n[at.SHORTENED] & going
    ends, at_once = detect_contact_events(m, n, shape, lane_settings, observed, fresh & going, inner_samples)
    going = (going & ~fresh) | ends
    if refining:
        going &= ~refine_onsets(m, n, kernel_input, observed.d, observed.dv, refining)
    if at_once:
        _begin_at_once(m, n, accumulators_of_runs, at_once)
    pressed = going & n[at.TOUCHING] & ~n[at.PROBED]
    if pressed:
        turning = bits(less(load(m, at.DV) * observed.dv, 0.0)) & bits(less(0.0, load(m, at.DV))) & pressed
        if turning:
            going &= ~detect_deepest_points(m, n, observed.d, observed.dv, turning)
    sure, over = 0, 0
    if going:
        sure = accept_steps(
            m,
            n,
            shape,
            lane_settings,
            kernel_input,
            accumulators_of_runs,
            law,
            observed,
            contact,
            going,
            inner_samples,
        )
        over = going & ~bits(less(load(m, at.T), load(m, at.END)))
    spent = (going | at_once) & ~bits(less(load(m, at.STEPS), load(m, at.MAX_STEPS)))
    return failed, sure, over, spent


@compiled
def integrate_run_lanes(m, n, shape, lane_settings, kernel_input, which, scratch, kernel_output, spare):
    """Integrate the runs *which*, eight at a time; *m* and *n* are the calling thread's own, *spare* is nobody's record of accumulators."""
    accumulators_of_runs, inner_samples, following, goes_on = (
        kernel_output.accumulators_of_runs,
        scratch.inner_samples,
        0,
        False,
    )
    n[at.LIVE] = 0
    for lane in range(WIDTH):
        # lanes that stay empty integrate what the first run begins with, unseen
        i = which[min(lane, which.size - 1)]
        if lane < which.size:
            begin_run(m, n, shape, lane_settings, kernel_input, lane, i, accumulators_of_runs[i])
            following += 1
        else:
            begin_run(m, n, shape, lane_settings, kernel_input, lane, i, spare[0])
            n[at.LIVE] &= ~(1 << lane)
    while n[at.LIVE]:
        if kernel_output.stop_flag[0] != 0:
            break
        failed, sure, over, spent = _pass(
            m, n, shape, lane_settings, kernel_input, accumulators_of_runs, inner_samples
        )
        ended = failed | sure | over | spent
        while ended:
            lane = lowest(ended)
            ended &= ended - 1
            bit = 1 << lane
            status = _STEP_LIMIT
            if failed & bit:
                status = _DIVERGED
            elif sure & bit:
                status = _EARLY_STOP
            elif over & bit:
                status = _OK
            accumulators = accumulators_of_runs[n[at.RUNS + lane]]
            _finish(m, n, shape, lane_settings, kernel_input, lane, accumulators, status, goes_on)
            if following < which.size:
                i = which[following]
                following += 1
                begin_run(m, n, shape, lane_settings, kernel_input, lane, i, accumulators_of_runs[i])
    live = n[at.LIVE]
    while live:
        lane = lowest(live)
        live &= live - 1
        accumulators = accumulators_of_runs[n[at.RUNS + lane]]
        accumulators.time, accumulators.status = int(m[at.T + lane]), _RUNNING
