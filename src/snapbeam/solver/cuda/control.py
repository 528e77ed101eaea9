"""One step of a run on the device, and what follows it: the decisions of the CPU engine, a thread a mode."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

from snapbeam.solver.cuda.layout import device, shared
from snapbeam.solver.cuda.state import Held, Standing, energies_function
from snapbeam.solver.cuda.step import Functions
from snapbeam.solver.excitation import tip_about_well
from snapbeam.solver.interpolation import first_downcrossing, turning_point, update_extrema
from snapbeam.solver.physics import tension_acceleration, tension_energy, tension_factors
from snapbeam.solver.step_control import (
    ContactKinematics,
    accumulate_displacement,
    accumulate_energy,
    begin_other_well,
    close_impact,
    contact_halvings,
    count_zero_crossings_in_step,
    first_contact_onset,
    flight_halvings,
    refine_onset,
    safe_interval,
    time_beyond,
)
from snapbeam.util.status_codes import RunStatus

_OK, _EARLY_STOP, _RUNNING = int(RunStatus.OK), int(RunStatus.EARLY_STOP), int(RunStatus.INTERRUPTED)
_DIVERGED, _STEP_LIMIT = int(RunStatus.DIVERGED), int(RunStatus.STEP_LIMIT)
_TWO_PI = 2.0 * math.pi
# What a pass through a step is for.
_WHOLE, _CUT, _DEEPEST = 0, 1, 2

_first_contact_onset, _count_zero_crossings_in_step, _refine_onset = (
    shared(first_contact_onset),
    shared(count_zero_crossings_in_step),
    shared(refine_onset),
)
_close_impact, _accumulate_displacement, _accumulate_energy, _begin_other_well = (
    shared(close_impact),
    shared(accumulate_displacement),
    shared(accumulate_energy),
    shared(begin_other_well),
)
_time_beyond = shared(time_beyond)
_safe_interval = shared(safe_interval)
_flight_halvings, _contact_halvings, _tip_about_well = (
    shared(flight_halvings),
    shared(contact_halvings),
    shared(tip_about_well),
)
_first_downcrossing, _turning_point, _update_extrema = (
    shared(first_downcrossing),
    shared(turning_point),
    shared(update_extrema),
)


class Taken(NamedTuple):
    """A step: its results, its length in ticks if shortened, and the samples inside it."""

    own: Standing
    kinematics: ContactKinematics
    span: int
    length: float
    event: bool
    entered: bool
    failed: bool
    deepest: float
    safe_gap: int
    safe_center: int
    subintervals: int
    subinterval: float
    impulse: float
    work: float
    gross: float


def _look_ahead_functions(functions: Functions) -> tuple[Any, Any, Any]:
    """Device functions of what is watched for: a change of well, how long nothing can happen, what is in a step."""
    sum_four, tension = functions.sum_four, functions.tension
    sample_inside_step, flow_into = functions.sample_inside_step, functions.flow_into
    energies = energies_function(functions)

    @device
    def change_well(block, fixed, held, accumulators):
        """The other well becomes the origin, if the centre has crossed over; see change_well.

        Returns the state, the well, and the tick at which the energy was last evaluated.
        """
        own, well_sign = held.own, held.well_sign
        if not (fixed.rest_stretch > 0.0 and held.kinematics.c * (well_sign * fixed.rest_center) < 0.0):
            return own, well_sign, held.energy_tick
        pressed, kinematics = held.touching, held.kinematics
        linear, high, power, high_power = energies(block, fixed, own, kinematics, pressed)
        if block.lane == 0 and fixed.high:
            span = (held.t - held.energy_tick) * fixed.clock.tick
            _accumulate_energy(accumulators, linear, high, power, high_power, span)
        q, well_sign = own.q - well_sign * fixed.shift, -well_sign
        g, r = well_sign * fixed.g, tension(block, q)
        gq, qr, _, _ = sum_four(block, g * q, r * q, 0.0, 0.0)
        along_g, along_r = tension_factors(fixed.gamma, gq, qr)
        own = Standing(q, own.p, tension_acceleration(along_g, along_r, g, r), gq, qr)
        linear, high, power, high_power = energies(block, fixed, own, kinematics, pressed)
        if block.lane == 0 and fixed.high:
            crossing = accumulators.last_zero_crossing
            span = _time_beyond(held.t * fixed.clock.tick, crossing, fixed.step_time)
            _begin_other_well(accumulators, linear, high, power, high_power, span)
        return own, well_sign, held.t

    @device
    def safe_until(block, fixed, held, own, after):
        """Until when the gap cannot close and the centre cannot cross, computed again where it is needed."""
        safe_gap, safe_center = held.safe_gap, held.safe_center
        if after > min(safe_gap, safe_center):
            mode, clock = fixed.mode, fixed.clock
            oq = abs(mode.omega * own.q) + abs(own.p)
            gap_bound, gap_push, center_bound, center_push = sum_four(
                block,
                abs(mode.contact) * oq,
                mode.contact * own.k,
                abs(mode.center) * oq,
                mode.center * own.k,
            )
            if after > safe_gap:
                safe = _safe_interval(
                    -held.kinematics.d, gap_bound, fixed.tip_speed, gap_push, fixed.step_time
                )
                safe_gap = held.t + int(safe / clock.tick)
            if after > safe_center:
                safe = _safe_interval(abs(held.kinematics.c), center_bound, 0.0, center_push, fixed.step_time)
                safe_center = held.t + int(safe / clock.tick)
        return safe_gap, safe_center

    @device
    def inner_samples(block, fixed, tip, own, k1, phase, span, length):
        """Sample a free step inside; returns the number and the length of its subintervals."""
        sampling, subintervals, step = fixed.step_sampling_slot, fixed.step_subintervals, fixed.clock.step
        if span != step:
            sampling += 1
            subintervals = max(2, math.ceil(length / fixed.shortest_subinterval))
            flow_into(block, fixed.mode, length / subintervals, sampling)
        subinterval = length / subintervals
        sample_inside_step(
            block, fixed.mode, tip, sampling, subintervals, subinterval, phase, own.q, own.p, own.k, k1
        )
        return subintervals, subinterval

    return change_well, safe_until, inner_samples


def _step_and_cut_function(functions: Functions, safe_until: Any, inner_samples: Any) -> Any:
    """The device function that takes a step and shortens it to an event."""
    observe, take_step, prepare = functions.observe, functions.take_step, functions.prepare

    @device
    def take_and_cut_step(block, fixed, held, own, well_sign, span, slot, phase):
        """Take a step, shorten it to an event, and locate the maximum penetration: one text for all three."""
        clock, kinematics, touching = fixed.clock, held.kinematics, held.touching
        tip = _tip_about_well(fixed.tip, well_sign, fixed.rest_contact)
        g, tick = well_sign * fixed.g, clock.tick
        length = span * tick
        here, purpose = length, _WHOLE
        event, entered, failed, deepest = False, False, False, held.deepest
        subintervals, subinterval = 0, 0.0
        whole, found = span, touching
        safe_gap, safe_center = held.safe_gap, held.safe_center
        own1, kinematics1, impulse, work, gross = own, kinematics, 0.0, 0.0, 0.0
        while True:
            if slot == fixed.variable_slot:
                prepare(block, fixed.mode, fixed.tip.drive.omega, here, slot)
            q2, p2, k2, gq2, qr2, impulse2, work2, gross2 = take_step(
                block, fixed.mode, g, fixed.gamma, tip, slot, here, phase, touching, own.q, own.p, own.k
            )
            observed = observe(block, fixed.mode, tip, phase + tip.drive.omega * here, q2, p2)
            if purpose == _DEEPEST:
                deepest = max(deepest, observed.d)
                break
            own1 = Standing(q2, p2, k2, gq2, qr2)
            kinematics1 = ContactKinematics(
                observed.w + well_sign * fixed.rest_contact, observed.wv, observed.d, observed.dv,
                observed.c + well_sign * fixed.rest_center, observed.cv,
            )  # fmt: skip
            impulse, work, gross = impulse2, work2, gross2
            if purpose == _WHOLE:
                if not math.isfinite(kinematics1.d + kinematics1.dv):
                    failed = True
                    break
                event_ticks = span
                if touching:
                    if kinematics1.d <= 0.0:
                        event = True
                        if kinematics.d > 0.0:
                            event_ticks = max(
                                1,
                                int(
                                    _first_downcrossing(
                                        kinematics.d, kinematics.dv, kinematics1.d, kinematics1.dv, length
                                    )
                                    * span
                                ),
                            )
                else:
                    after = held.t + span
                    safe_gap, safe_center = safe_until(block, fixed, held, own, after)
                    if after > min(safe_gap, safe_center):
                        subintervals, subinterval = inner_samples(
                            block, fixed, tip, own, k2, phase, span, length
                        )
                        if after > safe_gap:
                            onset_time = _first_contact_onset(block.kinematics, subintervals, subinterval)
                            if onset_time >= 0.0:
                                event, event_ticks = True, min(span, int(onset_time / tick))
                                entered = event_ticks < 1
                if entered:
                    break
                if event_ticks < span:
                    span, length = event_ticks, event_ticks * tick
                    here, slot, purpose = length, fixed.variable_slot, _CUT
                    continue
            if event and not found:
                event_ticks, found = (
                    _refine_onset(clock, span, whole, kinematics1, (clock.step >> clock.max_halvings) * tick),
                    True,
                )
                if event_ticks != span:
                    span, length = event_ticks, event_ticks * tick
                    here, slot, purpose = length, fixed.variable_slot, _CUT
                    continue
            if touching:
                deepest = max(deepest, kinematics1.d)
                turn = (
                    _turning_point(kinematics.d, kinematics.dv, kinematics1.d, kinematics1.dv, length)
                    if kinematics.dv > 0.0
                    else -1.0
                )
                if turn > 0.0 and (
                    _update_extrema(
                        kinematics.d,
                        deepest,
                        kinematics.d,
                        kinematics.dv,
                        kinematics1.d,
                        kinematics1.dv,
                        length,
                    )[1]
                    > deepest
                ):
                    here, slot, purpose = turn * length, fixed.variable_slot, _DEEPEST
                    continue
            break
        return Taken(
            own1, kinematics1, span, length, event, entered, failed, deepest, safe_gap, safe_center, subintervals, subinterval,
            impulse, work, gross,
        )  # fmt: skip

    return take_and_cut_step


def _acceptance_functions(functions: Functions) -> tuple[Any, Any]:
    """Device functions of what is kept of a step."""
    energies = energies_function(functions)

    @device
    def accumulate_step(block, fixed, held, well_sign, step, counted, accumulators):
        """Enter a step in the statistics; the first thread keeps the record of accumulators."""
        if block.lane == 0:
            if held.touching:
                accumulators.impulse += step.impulse
                accumulators.work += step.work
                accumulators.gross_work += step.gross
                accumulators.deepest = step.deepest
            _accumulate_displacement(accumulators, held.kinematics, step.kinematics, step.length)
            if counted:
                _count_zero_crossings_in_step(
                    accumulators, fixed.clock, held.t, step.length, held.kinematics, step.kinematics, block.kinematics,
                    well_sign * fixed.rest_center, step.subintervals, step.subinterval,
                )  # fmt: skip

    @device
    def monitor_energy(block, fixed, held, step, t, well_sign, touching, status, accumulators):
        """Add up the energy of the modes; every sixteenth step it decides about an early end."""
        own = step.own
        pressed = touching and not step.event
        linear, high, power, high_power = energies(block, fixed, own, step.kinematics, pressed)
        if block.lane == 0 and fixed.high:
            span = (t - held.energy_tick) * fixed.clock.tick
            _accumulate_energy(accumulators, linear, high, power, high_power, span)
        far = well_sign < 0.0 and step.kinematics.w > fixed.clock.decide_reach and step.kinematics.c > 0.0
        if far and not (touching or step.event) and (held.steps & 15) == 0:
            energy = linear + tension_energy(fixed.gamma, own.gq, own.qr)
            if energy < fixed.clock.decide_energy:
                status = _EARLY_STOP
        return t, status

    return accumulate_step, monitor_energy


def step_function(functions: Functions) -> Any:
    """The device function that takes a run one step further."""
    change_well, safe_until, inner_samples = _look_ahead_functions(functions)
    take_and_cut_step = _step_and_cut_function(functions, safe_until, inner_samples)
    accumulate_step, monitor_energy = _acceptance_functions(functions)
    synchronise = functions.synchronise

    @device
    def advance_one_step(block, fixed, held, accumulators):
        """The run after one more step."""
        clock = fixed.clock
        own, well_sign, energy_tick = change_well(block, fixed, held, accumulators)
        steps = held.steps + 1
        level = _flight_halvings(clock, 2.0 * own.gq + own.qr, fixed.rest_stretch)
        if held.touching:
            elapsed = (held.t - held.onset) * clock.tick
            level = max(level, _contact_halvings(clock, elapsed, held.kinematics.d, held.kinematics.dv))
        span, slot = clock.step >> level, level
        if held.t + span > clock.end:
            span, slot = clock.end - held.t, fixed.variable_slot
        phase = fixed.phase + _TWO_PI * ((held.t % clock.period) / clock.period)
        step = take_and_cut_step(block, fixed, held, own, well_sign, span, slot, phase)
        if step.failed or step.entered:
            status = _DIVERGED if step.failed else _STEP_LIMIT if steps >= clock.max_steps else _RUNNING
            onset = held.t if step.entered else held.onset
            if block.lane == 0 and step.entered:
                accumulators.touching, accumulators.onset = 1, held.t
            return Held(
                held.t, well_sign, own, held.kinematics, held.touching or step.entered, step.safe_gap,
                step.safe_center, onset, held.deepest, energy_tick, steps, status,
            )  # fmt: skip
        counted = held.touching or held.t + step.span > step.safe_center
        accumulate_step(block, fixed, held, well_sign, step, counted, accumulators)
        t, kinematics = held.t + step.span, step.kinematics
        status = _RUNNING if t < clock.end else _OK
        touching, onset, deepest = held.touching != step.event, held.onset, step.deepest
        safe_gap, safe_center = step.safe_gap, step.safe_center
        if step.event:
            safe_gap, safe_center = t, t
            if held.touching:
                if block.lane == 0:
                    _close_impact(accumulators, None, 0, fixed.tip.law, t, clock.tick)
                deepest = 0.0
                kinematics = ContactKinematics(
                    kinematics.w,
                    kinematics.wv,
                    min(kinematics.d, 0.0),
                    kinematics.dv,
                    kinematics.c,
                    kinematics.cv,
                )
            else:
                onset = t
                if block.lane == 0:
                    accumulators.touching, accumulators.onset = 1, t
        counting = Held(
            held.t, held.well_sign, held.own, held.kinematics, held.touching, held.safe_gap, held.safe_center,
            held.onset, held.deepest, energy_tick, steps, held.status,
        )  # fmt: skip
        energy_tick, status = monitor_energy(
            block, fixed, counting, step, t, well_sign, touching, status, accumulators
        )
        if counted and clock.decide_crossings >= 0:
            synchronise()
            if accumulators.zero_crossings_last_quarter > clock.decide_crossings:
                status = _EARLY_STOP
        if status == _RUNNING and steps >= clock.max_steps:
            status = _STEP_LIMIT
        return Held(
            t,
            well_sign,
            step.own,
            kinematics,
            touching,
            safe_gap,
            safe_center,
            onset,
            deepest,
            energy_tick,
            steps,
            status,
        )

    return advance_one_step
