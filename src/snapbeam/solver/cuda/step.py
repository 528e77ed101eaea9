"""One step of one trajectory on a CUDA device, and a look inside it: a thread a mode, a block a trajectory.

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

from snapbeam.solver.contact_force import contact_force
from snapbeam.solver.cuda.layout import device, sums, synchroniser
from snapbeam.solver.physics import (
    decay_less_one,
    rotation,
    shaker_motion,
    sincos,
    sincos_cosm1,
    tension_acceleration,
    tension_factors,
    turned,
)
from snapbeam.solver.simd import fma
from snapbeam.solver.splitting import COMPOSITIONS
from snapbeam.solver.step_control import ContactKinematics

__all__ = ["Functions", "Mode", "functions"]


class Mode(NamedTuple):
    """What a thread knows of its mode."""

    omega: float
    omega_squared: float
    omega_damped: float
    damping: float
    center: float
    contact: float
    high: float


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


@cache
def functions(order: int, threads: int, columns: int) -> Functions:
    """The device functions for a composition, a number of threads and of coupled modes (at most)."""
    composition = COMPOSITIONS[order]
    stages, kick_weights, which_flow = composition.flow.size, composition.kick, composition.distinct
    distinct = (stages + 1) // 2
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
    def evaluate_contacts(block, tip, slot, stage, sine0, cosine0, cq):
        """Contact force at a kick, and the velocity of the tip."""
        sine, cosine = block.turns[slot, 0, stage], block.turns[slot, 1, stage]
        sine, cosine = sine0 * cosine + cosine0 * sine, cosine0 * cosine - sine0 * sine
        motion, velocity = shaker_motion(tip.drive.amplitude, tip.drive.omega, sine, cosine)
        return contact_force(tip.law, tip.offset + motion - cq), velocity

    @device
    def take_step(block, mode, g, gamma, tip, slot, length, phase, touching, q, p, k):
        """As :func:`snapbeam.solver.cpu.step.take_step`, of this thread's mode.

        Returns q, p and k at the end, g.q and q.Gq there, and the step's impulse, work and gross work.
        """
        kick = cuda.const.array_like(kick_weights)
        flow_of = cuda.const.array_like(which_flow)
        sine0, cosine0 = 0.0, 1.0
        impulse, work, gross, force = 0.0, 0.0, 0.0, 0.0
        weight = kick[0] * length
        if touching:
            sine0, cosine0 = sincos(phase)
            cq = sum_one(block, mode.contact * q)
            force, velocity = evaluate_contacts(block, tip, slot, 0, sine0, cosine0, cq)
            impulse = weight * force
            work = weight * force * velocity
            gross = weight * abs(force * velocity)
        p = fma(weight, fma(force, mode.contact, k), p)
        gq, qr = 0.0, 0.0
        for stage in range(1, stages + 1):
            flow = block.flows[slot * distinct + flow_of[stage - 1]]
            moved = turned(q, flow[0, block.lane], flow[1, block.lane], p)
            p = turned(p, flow[3, block.lane], flow[2, block.lane], q)
            q = moved
            r = tension(block, q)
            weight = kick[stage] * length
            if touching:
                gq, qr, cq = sum_three(block, g * q, r * q, mode.contact * q)
                force, velocity = evaluate_contacts(block, tip, slot, stage, sine0, cosine0, cq)
                impulse += weight * force
                work += weight * force * velocity
                gross += weight * abs(force * velocity)
            else:
                gq, qr = sum_two(block, g * q, r * q)
            along_g, along_r = tension_factors(gamma, gq, qr)
            k = tension_acceleration(along_g, along_r, g, r)
            p = fma(weight, fma(force, mode.contact, k), p)
        return q, p, k, gq, qr, impulse, work, gross

    @device
    def sample_inside_step(block, mode, tip, at, pieces, piece, phase, q, p, k, k1):
        """As :func:`snapbeam.solver.cpu.events.sample_inside_step`; *at* is the flow over one piece."""
        contact0, contact1, center0, center1 = sum_four(
            block, mode.contact * k, mode.contact * k1, mode.center * k, mode.center * k1
        )
        turn_sine, turn_cosine = sincos(tip.drive.omega * piece)
        sine, cosine = sincos(phase)
        flow, half = block.flows[at], 0.5 * piece
        for i in range(pieces + 1):
            w, rate, c, c_rate = sum_four(
                block, mode.contact * q, mode.contact * p, mode.center * q, mode.center * p
            )
            done = i / pieces
            if block.lane == 0:
                owed = half if i > 0 else 0.0
                motion, velocity = shaker_motion(tip.drive.amplitude, tip.drive.omega, sine, cosine)
                block.seen[i, 0] = tip.offset + motion - w
                block.seen[i, 1] = velocity - rate - owed * ((1.0 - done) * contact0 + done * contact1)
                block.seen[i, 2] = c
                block.seen[i, 3] = c_rate + owed * ((1.0 - done) * center0 + done * center1)
            kick = piece if i > 0 else half
            p = fma(kick * (1.0 - done), k, fma(kick * done, k1, p))
            moved = turned(q, flow[0, block.lane], flow[1, block.lane], p)
            p = turned(p, flow[3, block.lane], flow[2, block.lane], q)
            q = moved
            sine, cosine = sine * turn_cosine + cosine * turn_sine, cosine * turn_cosine - sine * turn_sine
        synchronise()

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
