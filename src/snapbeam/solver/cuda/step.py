"""One step of one trajectory on a CUDA device, and samples inside it: a thread a mode, a block a trajectory.

What belongs to a mode (its state, its row of the tension matrix, the flow of its oscillator) stays with its
thread.  Whatever belongs to the trajectory comes out of sums over the block, which every thread reads back
as the same bits; all decisions hang on such sums, so the threads of a block never part ways, however
unlike its neighbours a trajectory steps.  A sum has one order, fixed by the number of threads.
"""

from __future__ import annotations

import math
from functools import cache
from typing import Any, NamedTuple

from numba import cuda

from snapbeam.solver.cuda.layout import device, sums, synchroniser
from snapbeam.solver.physics import (
    decay_less_one,
    rotation,
    shaker_motion,
    sincos,
    sincos_cosm1,
    tension_acceleration,
    turned,
)
from snapbeam.solver.simd import fma
from snapbeam.solver.splitting import COMPOSITIONS
from snapbeam.solver.step import InnerProducts, Primitives, build_step, flow_mode, kick_mode, rotate_phase
from snapbeam.solver.step_control import ContactKinematics


class Mode(NamedTuple):
    """Coefficients of the mode of a thread."""

    omega: float
    omega_squared: float
    omega_damped: float
    damping: float
    center: float
    contact: float
    high: float


class BlockState(NamedTuple):
    """Displacement, velocity, and acceleration at the last kick of a thread's mode."""

    q: float
    p: float
    k: float


class BlockStepData(NamedTuple):
    """All numbers that a step reads."""

    block: Any
    flows: int
    gamma: float
    tip: Any
    in_contact: bool
    g: float
    """Element of g of this thread's mode, in the current well."""
    contact: float
    slot: int
    """Which of the prepared lengths of step this one has."""
    length: float
    sine: float
    """Sine of the phase of the drive at the beginning, if in contact."""
    cosine: float
    q: float
    p: float
    k: float


class Functions(NamedTuple):
    """The device functions for one composition and one size of block."""

    distinct: int
    """Distinct flows of a step."""
    synchronise: Any
    sum_one: Any
    sum_four: Any
    tension: Any
    flow_into: Any
    prepare: Any
    observe: Any
    take_step: Any
    sample_inside_step: Any


def _flows(order: int, threads: int, synchronise: Any) -> tuple[Any, Any]:
    """The exact flow of a mode over a time, and all that a step of one length needs."""
    composition = COMPOSITIONS[order]
    stages, weights, elapsed = composition.flow.size, composition.flow, composition.elapsed
    distinct = (stages + 1) // 2

    @device
    def flow_into(block, mode, length, at):
        sine, _, less_one = sincos_cosm1(mode.omega_damped * length)
        if mode.damping * abs(length) > 4.0 or mode.omega_damped == 0.0:
            over = sine / mode.omega_damped if mode.omega_damped > 0.0 else length
            lost = math.expm1(-mode.damping * length)
        else:
            over = sine / mode.omega_damped
            lost = decay_less_one(mode.damping * length)
        a11, a12, a21, a22 = rotation(mode.damping, mode.omega_squared, over, less_one, lost)
        block.flows[at, 0, block.lane] = a11
        block.flows[at, 1, block.lane] = a12
        block.flows[at, 2, block.lane] = a21
        block.flows[at, 3, block.lane] = a22

    @device
    def prepare(block, mode, drive_omega, length, slot):
        flow = cuda.const.array_like(weights)
        passed = cuda.const.array_like(elapsed)
        for i in range(distinct):
            flow_into(block, mode, flow[i] * length, slot * distinct + i)
        i = block.lane
        while i <= stages:
            sine, cosine = sincos(passed[i] * (length * drive_omega))
            block.turns[slot, 0, i] = sine
            block.turns[slot, 1, i] = cosine
            i += threads
        synchronise()

    return flow_into, prepare


def _step(order: int, sum_one: Any, sum_two: Any, sum_three: Any, tension: Any) -> Any:
    """The device function of a step, built from the operations of a thread of the block."""
    composition = COMPOSITIONS[order]
    flows, kick_weights, which_flow = composition.flow.size, composition.kick, composition.distinct
    distinct = (flows + 1) // 2

    @device
    def zero(data):
        return 0.0

    @device
    def begin(data):
        return BlockState(data.q, data.p, data.k), None

    @device
    def kick_weight(data, stage):
        kick = cuda.const.array_like(kick_weights)
        return kick[stage] * data.length

    @device
    def tip_motion(data, stage):
        ahead, cosine_ahead = data.block.turns[data.slot, 0, stage], data.block.turns[data.slot, 1, stage]
        sine, cosine = rotate_phase(data.sine, data.cosine, ahead, cosine_ahead)
        return shaker_motion(data.tip.drive.amplitude, data.tip.drive.omega, sine, cosine)

    @device
    def form_products(data, stage, state):
        q, cq, gq, qr, r = state.q, 0.0, 0.0, 0.0, 0.0
        if stage == 0:
            if data.in_contact:
                cq = sum_one(data.block, data.contact * q)
        else:
            r = tension(data.block, q)
            if data.in_contact:
                gq, qr, cq = sum_three(data.block, data.g * q, r * q, data.contact * q)
            else:
                gq, qr = sum_two(data.block, data.g * q, r * q)
        return InnerProducts(cq, gq, qr, r)

    @device
    def where_closed(data, force):
        return force

    @device
    def kick_and_flow(data, stage, state, weight, along_g, along_r, r, force):
        which = cuda.const.array_like(which_flow)
        q, p, k = state.q, state.p, state.k
        if stage > 0:
            k = tension_acceleration(along_g, along_r, data.g, r)
        p = kick_mode(weight, k, data.contact, force, p)
        if stage < flows:
            flow, lane = data.block.flows[data.slot * distinct + which[stage]], data.block.lane
            q, p = flow_mode(q, p, flow[0, lane], flow[1, lane], flow[2, lane], flow[3, lane])
        return BlockState(q, p, k), 0.0

    take = build_step(
        Primitives(
            zero=zero,
            begin=begin,
            kick_weight=kick_weight,
            tip_motion=tip_motion,
            form_products=form_products,
            where_closed=where_closed,
            kick_and_flow=kick_and_flow,
        ),
        device,
    ).take_step

    @device
    def take_step(block, mode, g, gamma, tip, slot, length, phase, touching, q, p, k):
        """A step of this thread's mode.

        Returns q, p and k at the end, g.q and q.Gq there, and the step's impulse, work and gross work.
        """
        sine, cosine = 0.0, 1.0
        if touching:
            sine, cosine = sincos(phase)
        state, increment = take(
            BlockStepData(
                block, flows, gamma, tip, touching, g, mode.contact, slot, length, sine, cosine, q, p, k
            )
        )
        contact = increment.contact
        return (
            state.q, state.p, state.k, increment.gq, increment.qr, contact.impulse, contact.work, contact.gross
        )  # fmt: skip

    return take_step


@cache
def functions(order: int, threads: int, columns: int) -> Functions:
    """The device functions for a composition, a number of threads and of coupled modes (at most)."""
    distinct = (COMPOSITIONS[order].flow.size + 1) // 2
    synchronise = synchroniser(threads)
    sum_one, sum_two, sum_three, sum_four = sums(threads, synchronise)
    flow_into, prepare = _flows(order, threads, synchronise)

    @device
    def tension(block, q):
        """Return the row of G q of one mode; a sum over the block must follow before the next call."""
        block.values[0] = q
        synchronise()
        a, b, c, d = 0.0, 0.0, 0.0, 0.0
        for j in range(0, columns, 4):
            a = fma(block.coupling[j], block.near[j], a)
            b = fma(block.coupling[j + 1], block.near[j + 1], b)
            c = fma(block.coupling[j + 2], block.near[j + 2], c)
            d = fma(block.coupling[j + 3], block.near[j + 3], d)
        return (a + b) + (c + d)

    @device
    def observe(block, mode, tip, phase, q, p):
        sine, cosine = sincos(phase)
        motion, velocity = shaker_motion(tip.drive.amplitude, tip.drive.omega, sine, cosine)
        w, rate, c, c_rate = sum_four(
            block, mode.contact * q, mode.contact * p, mode.center * q, mode.center * p
        )
        return ContactKinematics(w, rate, tip.offset + motion - w, velocity - rate, c, c_rate)

    @device
    def sample_inside_step(block, mode, tip, at, subintervals, subinterval, phase, q, p, k, k1):
        """Sample as :func:`snapbeam.solver.cpu.events.sample_inside_step`; *at* is the flow over one subinterval."""
        contact0, contact1, center0, center1 = sum_four(
            block, mode.contact * k, mode.contact * k1, mode.center * k, mode.center * k1
        )
        turn_sine, turn_cosine = sincos(tip.drive.omega * subinterval)
        sine, cosine = sincos(phase)
        flow, half = block.flows[at], 0.5 * subinterval
        for i in range(subintervals + 1):
            w, rate, c, c_rate = sum_four(
                block, mode.contact * q, mode.contact * p, mode.center * q, mode.center * p
            )
            done = i / subintervals
            if block.lane == 0:
                remaining = half if i > 0 else 0.0
                motion, velocity = shaker_motion(tip.drive.amplitude, tip.drive.omega, sine, cosine)
                block.kinematics[i, 0] = tip.offset + motion - w
                block.kinematics[i, 1] = (
                    velocity - rate - remaining * ((1.0 - done) * contact0 + done * contact1)
                )
                block.kinematics[i, 2] = c
                block.kinematics[i, 3] = c_rate + remaining * ((1.0 - done) * center0 + done * center1)
            kick = subinterval if i > 0 else half
            p = fma(kick * (1.0 - done), k, fma(kick * done, k1, p))
            moved = turned(q, flow[0, block.lane], flow[1, block.lane], p)
            p = turned(p, flow[3, block.lane], flow[2, block.lane], q)
            q = moved
            sine, cosine = sine * turn_cosine + cosine * turn_sine, cosine * turn_cosine - sine * turn_sine
        synchronise()

    take_step = _step(order, sum_one, sum_two, sum_three, tension)
    return Functions(
        distinct,
        synchronise,
        sum_one,
        sum_four,
        tension,
        flow_into,
        prepare,
        observe,
        take_step,
        sample_inside_step,
    )
