"""One step of one trajectory: a composition of kicks and exact linear flows, and a look inside it."""

from __future__ import annotations

from typing import NamedTuple

from snapbeam.engines.cpu.rows import (
    acceleration_rows,
    dot,
    flow_coefficients,
    flow_rows,
    glide,
    kick_and_flow,
    kick_rows,
    modal_energy,
    signals,
    tension_rows,
    tension_rows_twice,
)
from snapbeam.engines.scalar.compile import compiled, inlined
from snapbeam.engines.scalar.composition import TURNS
from snapbeam.engines.scalar.lanes import WIDTH, lanes_sum, load, store
from snapbeam.engines.scalar.physics import (
    contact_force,
    recorded_motion,
    shaker_motion,
    sincos,
    tension_factors,
)

__all__ = ["Done", "Impactor", "Step", "look_inside", "observe", "prepare", "take_step", "take_two"]


class Impactor(NamedTuple):
    """The shaker's tip and its contact, seen from the side it pushes from.

    ``penetration = offset + A sin(omega t) - row . q``; the contact's row carries the sign of the side.
    """

    offset: float
    amplitude: float
    omega: float
    stiffness: float


@compiled
def prepare(memory, layout, stages, impactor, length, at):
    """What a step of *length* needs, from *at* on: its distinct flows and the drive's turn at each kick."""
    size = layout.size
    for i in range((stages.flows + 1) // 2):
        flow_coefficients(memory, layout, memory[stages.flow + i] * length, at)
        at += 4 * size
    for i in range(0, TURNS, WIDTH):
        sine, cosine = sincos(load(memory, stages.elapsed + i) * (length * impactor.omega))
        store(memory, at + i, sine)
        store(memory, at + TURNS + i, cosine)


@inlined
def _tip(memory, layout, impactor, phase):
    """Displacement of the shaker since the start and its velocity, sinusoidal or as recorded."""
    if layout.drive_samples > 0:
        at = min(phase / (impactor.omega * layout.drive_interval), layout.drive_samples - 1.0)
        i = min(int(at), layout.drive_samples - 2)
        row = layout.drive + 2 * i
        return recorded_motion(
            at - i, layout.drive_interval, memory[row], memory[row + 1], memory[row + 2], memory[row + 3]
        )
    sine, cosine = sincos(phase)
    return shaker_motion(impactor.amplitude, impactor.omega, sine, cosine)


@compiled
def observe(memory, layout, impactor, phase, q, p):
    """Contact point from rest and its rate; penetration and its rate; centre from rest and its rate."""
    motion, velocity = _tip(memory, layout, impactor, phase)
    w, rate, c, c_rate = signals(memory, layout, q, p)
    return w, rate, impactor.offset + motion - w, velocity - rate, c, c_rate


class Step(NamedTuple):
    """One step to take: how long, from where to where, and whether in contact."""

    ticks: int
    at: int
    """Where what :func:`prepare` wrote for this length begins."""
    length: float
    """Seconds."""
    phase: float
    """Of the drive at the beginning."""
    touching: bool
    q: int
    p: int
    k: int
    q1: int
    p1: int
    k1: int
    r: int


class Done(NamedTuple):
    """What a step gave: g.q and q.Gq at its end, and quadratures of the order of the step."""

    gq: float
    qr: float
    impulse: float
    work: float
    """Of the shaker."""
    gross: float
    dissipated: float


@inlined
def _push(memory, layout, stages, impactor, step, turns, stage, sine0, cosine0, here):
    """Contact force at a stage, and the velocity of the shaker."""
    if layout.drive_samples > 0:
        now = step.phase + memory[stages.elapsed + stage] * step.length * impactor.omega
        motion, velocity = _tip(memory, layout, impactor, now)
    else:
        sine, cosine = memory[turns + stage], memory[turns + TURNS + stage]
        sine, cosine = sine0 * cosine + cosine0 * sine, cosine0 * cosine - sine0 * sine
        motion, velocity = shaker_motion(impactor.amplitude, impactor.omega, sine, cosine)
    penetration = impactor.offset + motion - dot(memory, layout.size, layout.contact, here)
    return contact_force(impactor.stiffness, penetration), velocity


@inlined
def _first(memory, layout, step, weight, force):
    """The kick that begins a step, with the acceleration known from the last one, and the flow after it."""
    kick_rows(memory, layout, weight, step.k, force, step.p, step.p1)
    flow_rows(memory, layout.size, step.at, step.q, step.p1, step.q1, step.p1)


@inlined
def _last(memory, layout, step, weight, along_g, along_r, force):
    """The kick that ends a step; its acceleration is kept for the next one."""
    acceleration_rows(memory, layout, along_g, along_r, step.r, step.k1)
    kick_rows(memory, layout, weight, step.k1, force, step.p1, step.p1)


@compiled
def take_step(memory, blocks, layout, stages, impactor, step, ledger):
    """Advance (q, p) with tension acceleration k by a step into (q1, p1, k1); dissipation if *ledger*."""
    last, size = stages.flows, layout.size
    q1, p1, k1, r = step.q1, step.p1, step.k1, step.r
    turns = step.at + ((last + 1) // 2) * 4 * size
    sine0, cosine0 = 0.0, 1.0
    if step.touching:
        sine0, cosine0 = sincos(step.phase)
    impulse, work, gross, dissipated = 0.0, 0.0, 0.0, 0.0
    gq, qr, force = 0.0, 0.0, 0.0
    for stage in range(last + 1):
        weight = memory[stages.kick + stage] * step.length
        if step.touching:
            here = q1 if stage > 0 else step.q
            force, velocity = _push(
                memory, layout, stages, impactor, step, turns, stage, sine0, cosine0, here
            )
            impulse += weight * force
            work += weight * force * velocity
            gross += weight * abs(force * velocity)
        if stage == 0:
            if ledger:
                kick_rows(memory, layout, weight, step.k, force, step.p, p1)
                dissipated += modal_energy(memory, layout, step.q, p1)
            _first(memory, layout, step, weight, force)
            if ledger:
                dissipated -= modal_energy(memory, layout, q1, p1)
            continue
        gq, qr = tension_rows(memory, blocks, layout, q1, r)
        along_g, along_r = tension_factors(layout.gamma, gq, qr)
        if stage == last:
            _last(memory, layout, step, weight, along_g, along_r, force)
            break
        flow = step.at + min(stage, last - 1 - stage) * 4 * size
        if ledger:
            acceleration_rows(memory, layout, along_g, along_r, r, k1)
            kick_rows(memory, layout, weight, k1, force, p1, p1)
            dissipated += modal_energy(memory, layout, q1, p1)
            flow_rows(memory, size, flow, q1, p1, q1, p1)
            dissipated -= modal_energy(memory, layout, q1, p1)
        else:
            kick_and_flow(memory, layout, flow, weight, along_g, along_r, r, force, q1, p1)
    return Done(gq, qr, impulse, work, gross, dissipated)


@compiled
def take_two(memory, blocks, stages, layout_a, impactor_a, a, layout_b, impactor_b, b):
    """A step of each of two trajectories, stage by stage in turn: :func:`take_step` twice, bit for bit.

    A single trajectory leaves the processor waiting for sums most of the time; the other one uses that time.
    """
    last, size = stages.flows, layout_a.size
    turns = ((last + 1) // 2) * 4 * size
    sine_a, cosine_a, sine_b, cosine_b = 0.0, 1.0, 0.0, 1.0
    if a.touching:
        sine_a, cosine_a = sincos(a.phase)
    if b.touching:
        sine_b, cosine_b = sincos(b.phase)
    impulse_a, work_a, gross_a, gq_a, qr_a, force_a = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    impulse_b, work_b, gross_b, gq_b, qr_b, force_b = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for stage in range(last + 1):
        weight_a, weight_b = memory[stages.kick + stage] * a.length, memory[stages.kick + stage] * b.length
        if a.touching:
            here = a.q1 if stage > 0 else a.q
            force_a, velocity = _push(
                memory, layout_a, stages, impactor_a, a, a.at + turns, stage, sine_a, cosine_a, here
            )
            impulse_a += weight_a * force_a
            work_a += weight_a * force_a * velocity
            gross_a += weight_a * abs(force_a * velocity)
        if b.touching:
            here = b.q1 if stage > 0 else b.q
            force_b, velocity = _push(
                memory, layout_b, stages, impactor_b, b, b.at + turns, stage, sine_b, cosine_b, here
            )
            impulse_b += weight_b * force_b
            work_b += weight_b * force_b * velocity
            gross_b += weight_b * abs(force_b * velocity)
        if stage == 0:
            _first(memory, layout_a, a, weight_a, force_a)
            _first(memory, layout_b, b, weight_b, force_b)
            continue
        gq_a, qr_a, gq_b, qr_b = tension_rows_twice(memory, blocks, layout_a, a.q1, a.r, layout_b, b.q1, b.r)
        along_ga, along_ra = tension_factors(layout_a.gamma, gq_a, qr_a)
        along_gb, along_rb = tension_factors(layout_b.gamma, gq_b, qr_b)
        if stage == last:
            _last(memory, layout_a, a, weight_a, along_ga, along_ra, force_a)
            _last(memory, layout_b, b, weight_b, along_gb, along_rb, force_b)
            break
        flow = min(stage, last - 1 - stage) * 4 * size
        kick_and_flow(memory, layout_a, a.at + flow, weight_a, along_ga, along_ra, a.r, force_a, a.q1, a.p1)
        kick_and_flow(memory, layout_b, b.at + flow, weight_b, along_gb, along_rb, b.r, force_b, b.q1, b.p1)
    return Done(gq_a, qr_a, impulse_a, work_a, gross_a, 0.0), Done(
        gq_b, qr_b, impulse_b, work_b, gross_b, 0.0
    )


@compiled
def look_inside(memory, layout, impactor, flow, pieces, piece, phase, q, p, k, k1, parts, with_center, seen):
    """Follow a free step in *pieces* short ones, each one exact linear flow, and note what is seen.

    The tension's acceleration, known at both ends of the step, is taken as linear in between: exact
    enough for signals whose fastest mode the pieces resolve.  Row i of *seen* becomes the penetration, its
    rate, and, if *with_center*, the displacement of the centre from rest and its rate; *parts* is room to work in.
    """
    glide(memory, layout, flow, pieces, piece, q, p, k, k1, with_center, parts)
    size = layout.size
    contact0, contact1 = dot(memory, size, layout.contact, k), dot(memory, size, layout.contact, k1)
    center0, center1 = dot(memory, size, layout.center, k), dot(memory, size, layout.center, k1)
    turn_sine, turn_cosine = sincos(impactor.omega * piece)
    sine, cosine = sincos(phase)
    w, rate, c, c_rate = signals(memory, layout, q, p)
    # kicks stand on the borders of the pieces, half a kick at the first; seen rates are half a kick ahead
    for i in range(pieces + 1):
        done, owed = i / pieces, 0.5 * piece
        if i == 0:
            owed = 0.0
        else:
            at = 4 * WIDTH * (i - 1)
            w, rate = lanes_sum(load(parts, at)), lanes_sum(load(parts, at + WIDTH))
            if with_center:
                c, c_rate = lanes_sum(load(parts, at + 2 * WIDTH)), lanes_sum(load(parts, at + 3 * WIDTH))
        motion, velocity = shaker_motion(impactor.amplitude, impactor.omega, sine, cosine)
        if layout.drive_samples > 0:
            motion, velocity = _tip(memory, layout, impactor, phase + i * piece * impactor.omega)
        seen[i, 0] = impactor.offset + motion - w
        seen[i, 1] = velocity - rate - owed * ((1.0 - done) * contact0 + done * contact1)
        seen[i, 2] = c
        seen[i, 3] = c_rate + owed * ((1.0 - done) * center0 + done * center1)
        sine, cosine = sine * turn_cosine + cosine * turn_sine, cosine * turn_cosine - sine * turn_sine
