"""A run of the CUDA engine: what stays the same in it, where it stands, how it begins, is laid down and ends."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

from snapbeam.solver.contact_force import contact_energy, contact_force
from snapbeam.solver.cuda.layout import device, shared
from snapbeam.solver.cuda.step import Functions, Mode
from snapbeam.solver.excitation import Tip, numbers_of, tip_about_well
from snapbeam.solver.physics import (
    mode_energy,
    mode_power,
    tension_acceleration,
    tension_energy,
    tension_factors,
)
from snapbeam.solver.step_control import (
    SUBINTERVALS,
    Clock,
    ContactKinematics,
    accumulate_energy,
    begin_statistics,
    clock_of,
    close_impact,
)
from snapbeam.util.status_codes import RunStatus

_OK, _EARLY_STOP, _RUNNING = int(RunStatus.OK), int(RunStatus.EARLY_STOP), int(RunStatus.INTERRUPTED)
_TWO_PI = 2.0 * math.pi

_close_impact, _begin_statistics = shared(close_impact), shared(begin_statistics)
_accumulate_energy = shared(accumulate_energy)
_clock_of, _tip_about_well = shared(clock_of), shared(tip_about_well)


class Fixed(NamedTuple):
    """Constants of a run."""

    tip: Tip
    clock: Clock
    phase: float
    rest_contact: float
    rest_center: float
    tip_speed: float
    shortest_subinterval: float
    step_subintervals: int
    step_time: float
    mode: Mode
    g: float
    """Element of g of this thread's mode, in the first well."""
    shift: float
    gamma: float
    rest_stretch: float
    variable_slot: int
    step_sampling_slot: int
    high: bool
    """True if some modes count as high, so that the modal energies are summed."""


class Standing(NamedTuple):
    """State of the mode of a thread, and the sums of the tension."""

    q: float
    p: float
    k: float
    gq: float
    qr: float


class Held(NamedTuple):
    """State of the integrator within a run."""

    t: int
    well_sign: float
    own: Standing
    kinematics: ContactKinematics
    touching: bool
    safe_gap: int
    safe_center: int
    onset: int
    deepest: float
    energy_tick: int
    steps: int
    status: int


def energies_function(functions: Functions) -> Any:
    """The device function of the energy of the modes, of the high ones, and of the rates of both."""
    sum_four = functions.sum_four

    @device
    def energies(block, fixed, own, kinematics, pressed):
        force = contact_force(fixed.tip.law, kinematics.d) if pressed else 0.0
        energy = mode_energy(fixed.mode.omega, own.q, own.p)
        power = mode_power(fixed.mode.damping, own.k, fixed.mode.contact, force, own.p)
        return sum_four(block, energy, fixed.mode.high * energy, power, fixed.mode.high * power)

    return energies


def run_functions(functions: Functions, threads: int, max_halvings: int) -> tuple[Any, Any, Any, Any, Any]:
    """Device functions: run_constants_of, begin, restore_state, save_state, finish."""
    begin, finish = _begin_and_finish_functions(functions)
    restore_state, save_state = _save_and_restore_functions()

    return _run_constants_function(functions, threads, max_halvings), begin, restore_state, save_state, finish


def _run_constants_function(functions: Functions, threads: int, max_halvings: int) -> Any:
    """The device function of what stays the same in a run."""
    prepare, flow_into, distinct = functions.prepare, functions.flow_into, functions.distinct

    @device
    def run_constants_of(block, structure, kernel_input, i, fresh):
        """Constants of run *i*, and its prepared steps if it is *fresh*."""
        lane, record = block.lane, kernel_input.runs[i]
        mode = Mode(
            structure[0, lane], structure[1, lane], structure[2, lane], structure[3, lane],
            structure[5, lane], kernel_input.contact_rows[record.contact_row, lane], structure[7, lane],
        )  # fmt: skip
        tip = Tip(
            record.offset,
            numbers_of(kernel_input.law, kernel_input.law_numbers, i),
            numbers_of(kernel_input.drive, kernel_input.drive_numbers, i),
        )
        clock = _clock_of(record, kernel_input.max_steps)
        step_time = clock.step * clock.tick
        fastest = tip.drive.omega
        for j in range(threads):
            fastest = max(fastest, structure[0, j])
        shortest_subinterval = _TWO_PI / (SUBINTERVALS * fastest)
        step_subintervals = max(4, math.ceil(step_time / shortest_subinterval))
        step_sampling_slot = (max_halvings + 2) * distinct
        if fresh:
            for level in range(clock.max_halvings + 1):
                prepare(block, mode, tip.drive.omega, step_time / (1 << level), level)
            flow_into(block, mode, step_time / step_subintervals, step_sampling_slot)
        return Fixed(
            tip, clock, record.phase, record.rest_contact, record.rest_center, record.tip_speed,
            shortest_subinterval, step_subintervals, step_time, mode, structure[4, lane], structure[6, lane],
            kernel_input.gamma, kernel_input.stretch, max_halvings + 1, step_sampling_slot, kernel_input.high,
        )  # fmt: skip

    return run_constants_of


def _begin_and_finish_functions(functions: Functions) -> tuple[Any, Any]:
    """Device functions: how a run begins, and how it ends."""
    sum_one, sum_four, tension = functions.sum_one, functions.sum_four, functions.tension
    observe, energies = functions.observe, energies_function(functions)

    @device
    def with_tension(block, fixed, well_sign, q, p):
        """Return the part of a state that belongs to this thread, with the sums of the tension."""
        g = well_sign * fixed.g
        r = tension(block, q)
        gq, qr, _, _ = sum_four(block, g * q, r * q, 0.0, 0.0)
        along_g, along_r = tension_factors(fixed.gamma, gq, qr)
        return Standing(q, p, tension_acceleration(along_g, along_r, g, r), gq, qr)

    @device
    def begin(block, fixed, kernel_input, i, accumulators):
        lane, record = block.lane, kernel_input.runs[i]
        q, p = kernel_input.starts[record.start_row, 0, lane], kernel_input.starts[record.start_row, 1, lane]
        well_sign = record.well_sign
        own = with_tension(block, fixed, well_sign, q, p)
        tip = _tip_about_well(fixed.tip, well_sign, fixed.rest_contact)
        observed = observe(block, fixed.mode, tip, fixed.phase, q, p)
        kinematics = ContactKinematics(
            observed.w + well_sign * fixed.rest_contact, observed.wv, observed.d, observed.dv,
            observed.c + well_sign * fixed.rest_center, observed.cv,
        )  # fmt: skip
        energy = sum_one(block, mode_energy(fixed.mode.omega, q, p)) + tension_energy(
            fixed.gamma, own.gq, own.qr
        )
        touching = kinematics.d > 0.0 or (kinematics.d == 0.0 and kinematics.dv > 0.0)
        linear, high, power, high_power = energies(block, fixed, own, kinematics, touching)
        if lane == 0:
            if fixed.high:
                _accumulate_energy(accumulators, linear, high, power, high_power, 0.0)
            accumulators.status, accumulators.touching, accumulators.onset = _RUNNING, int(touching), 0
            _begin_statistics(
                accumulators,
                kinematics.c,
                kinematics,
                fixed.tip.law,
                energy + contact_energy(fixed.tip.law, kinematics.d),
            )
        return Held(0, well_sign, own, kinematics, touching, 0, 0, 0, max(kinematics.d, 0.0), 0, 0, _RUNNING)

    @device
    def finish(block, fixed, held, accumulators):
        linear, high, power, high_power = energies(block, fixed, held.own, held.kinematics, held.touching)
        if block.lane == 0:
            clock, law = fixed.clock, fixed.tip.law
            span = (held.t - held.energy_tick) * clock.tick
            if fixed.high:
                _accumulate_energy(accumulators, linear, high, power, high_power, span)
            if held.touching:
                _close_impact(accumulators, None, 0, law, held.t, clock.tick)
            if held.status == _EARLY_STOP:
                accumulators.early_stop_time = held.t * clock.tick
            accumulators.energy = (
                linear
                + tension_energy(fixed.gamma, held.own.gq, held.own.qr)
                + contact_energy(law, held.kinematics.d)
            )
            accumulators.displacement, accumulators.center = held.kinematics.w, held.kinematics.c
            accumulators.time, accumulators.status, accumulators.steps = held.t, held.status, held.steps

    return begin, finish


def _save_and_restore_functions() -> tuple[Any, Any]:
    """Device functions: save a run that is interrupted, and restore it."""

    @device
    def restore_state(block, index, kernel_output, accumulators):
        """Restore the state of an interrupted run."""
        lane, marks, reals, modes = block.lane, kernel_output.marks, kernel_output.reals, kernel_output.modes
        own = Standing(
            modes[index, 0, lane],
            modes[index, 1, lane],
            modes[index, 2, lane],
            reals[index, 6],
            reals[index, 7],
        )
        kinematics = ContactKinematics(
            reals[index, 0],
            reals[index, 1],
            reals[index, 2],
            reals[index, 3],
            reals[index, 4],
            reals[index, 5],
        )
        return Held(
            accumulators.time, float(marks[index, 2]), own, kinematics, accumulators.touching != 0,
            marks[index, 0], marks[index, 1], accumulators.onset, reals[index, 8], marks[index, 3], accumulators.steps, _RUNNING,
        )  # fmt: skip

    @device
    def save_state(block, index, kernel_output, accumulators, held):
        lane = block.lane
        own, kinematics = held.own, held.kinematics
        (
            kernel_output.modes[index, 0, lane],
            kernel_output.modes[index, 1, lane],
            kernel_output.modes[index, 2, lane],
        ) = (
            own.q,
            own.p,
            own.k,
        )
        if lane == 0:
            marks, reals = kernel_output.marks, kernel_output.reals
            marks[index, 0], marks[index, 1], marks[index, 2] = (
                held.safe_gap,
                held.safe_center,
                int(held.well_sign),
            )
            marks[index, 3] = held.energy_tick
            reals[index, 0], reals[index, 1], reals[index, 2] = kinematics.w, kinematics.wv, kinematics.d
            reals[index, 3], reals[index, 4], reals[index, 5] = kinematics.dv, kinematics.c, kinematics.cv
            reals[index, 6], reals[index, 7], reals[index, 8] = own.gq, own.qr, held.deepest
            accumulators.time, accumulators.status, accumulators.steps = held.t, held.status, held.steps
            accumulators.touching, accumulators.onset = int(held.touching), held.onset

    return restore_state, save_state
