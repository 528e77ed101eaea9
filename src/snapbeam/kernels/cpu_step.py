"""One step of one trajectory: a composition of kicks and exact linear flows, and a look inside it."""

from __future__ import annotations

from typing import NamedTuple

from snapbeam.kernels.compile import compiled, inlined
from snapbeam.kernels.composition import TURNS
from snapbeam.kernels.lanes import WIDTH, load, store
from snapbeam.kernels.physics import (
    contact_force,
    recorded_motion,
    shaker_motion,
    sincos,
    tension_factors,
)
from snapbeam.kernels.rows import (
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
)

__all__ = ["Impactor", "look_inside", "observe", "prepare", "take_step"]


class Impactor(NamedTuple):
    """The shaker's tip and its contact, seen from the side it pushes from.

    ``penetration = offset + A sin(omega t) - row . q``; the contact's row carries the sign of the side.
    """

    offset: float
    amplitude: float
    omega: float
    stiffness: float


@compiled
def prepare(memory, layout, composition, impactor, length, at):
    """What a step of *length* needs, from *at* on: its distinct flows and the drive's turn at each kick."""
    size = layout.size
    for i in range((composition.flow.size + 1) // 2):
        flow_coefficients(memory, layout, composition.flow[i] * length, at)
        at += 4 * size
    for i in range(0, TURNS, WIDTH):
        sine, cosine = sincos(load(composition.elapsed, i) * (length * impactor.omega))
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


@compiled
def take_step(
    memory, blocks, layout, composition, impactor, at, length, phase, touching, ledger, q, p, k, q1, p1, k1, r
):
    """Advance (q, p) with tension acceleration k by *length* seconds into (q1, p1, k1).

    Returns g.q and q.Gq at the end, and the step's impulse, work of the shaker, gross work and
    dissipation; each of the four is a quadrature of the order of the step.
    """
    stages, size = composition.flow.size, layout.size
    turns = at + ((stages + 1) // 2) * 4 * size
    sine0, cosine0 = 0.0, 1.0
    if touching:
        sine0, cosine0 = sincos(phase)
    impulse, work, gross, dissipated = 0.0, 0.0, 0.0, 0.0
    gq, qr, force = 0.0, 0.0, 0.0
    for stage in range(stages + 1):
        weight = composition.kick[stage] * length
        here = q1 if stage > 0 else q
        if touching:
            if layout.drive_samples > 0:
                now = phase + composition.elapsed[stage] * length * impactor.omega
                motion, velocity = _tip(memory, layout, impactor, now)
            else:
                sine, cosine = memory[turns + stage], memory[turns + TURNS + stage]
                sine, cosine = sine0 * cosine + cosine0 * sine, cosine0 * cosine - sine0 * sine
                motion, velocity = shaker_motion(impactor.amplitude, impactor.omega, sine, cosine)
            tip = impactor.offset + motion
            force = contact_force(impactor.stiffness, tip - dot(memory, size, layout.contact, here))
            impulse += weight * force
            work += weight * force * velocity
            gross += weight * abs(force * velocity)
        if stage == 0:
            kick_rows(memory, layout, weight, k, force, p, p1)
            if ledger:
                dissipated += modal_energy(memory, layout, q, p1)
            flow_rows(memory, size, at, q, p1, q1, p1)
            if ledger:
                dissipated -= modal_energy(memory, layout, q1, p1)
            continue
        gq, qr = tension_rows(memory, blocks, layout, q1, r)
        along_g, along_r = tension_factors(layout.gamma, gq, qr)
        if stage == stages:
            acceleration_rows(memory, layout, along_g, along_r, r, k1)
            kick_rows(memory, layout, weight, k1, force, p1, p1)
            break
        flow = at + composition.distinct[stage] * 4 * size
        if ledger:
            acceleration_rows(memory, layout, along_g, along_r, r, k1)
            kick_rows(memory, layout, weight, k1, force, p1, p1)
            dissipated += modal_energy(memory, layout, q1, p1)
            flow_rows(memory, size, flow, q1, p1, q1, p1)
            dissipated -= modal_energy(memory, layout, q1, p1)
        else:
            kick_and_flow(memory, layout, flow, weight, along_g, along_r, r, force, q1, p1)
    return gq, qr, impulse, work, gross, dissipated


@compiled
def look_inside(memory, layout, impactor, flow, pieces, piece, phase, q, p, k, k1, q1, p1, seen):
    """Follow a free step in *pieces* short ones, each one exact linear flow, and note what is seen.

    The tension's acceleration, known at both ends of the step, is taken as linear in between: exact
    enough for signals whose fastest mode the pieces resolve.  Row i of *seen* becomes the penetration, its
    rate, the displacement of the centre from rest, and its rate.
    """
    for row in range(0, layout.size, WIDTH):
        store(memory, q1 + row, load(memory, q + row))
        store(memory, p1 + row, load(memory, p + row))
    size = layout.size
    contact0, contact1 = dot(memory, size, layout.contact, k), dot(memory, size, layout.contact, k1)
    center0, center1 = dot(memory, size, layout.center, k), dot(memory, size, layout.center, k1)
    turn_sine, turn_cosine = sincos(impactor.omega * piece)
    sine, cosine = sincos(phase)
    w, rate, c, c_rate = signals(memory, layout, q, p)
    # kicks stand on the borders of the pieces, half a kick at the first; seen rates are half a kick ahead
    half = 0.5 * piece
    for i in range(pieces + 1):
        done = i / pieces
        motion, velocity = shaker_motion(impactor.amplitude, impactor.omega, sine, cosine)
        if layout.drive_samples > 0:
            motion, velocity = _tip(memory, layout, impactor, phase + i * piece * impactor.omega)
        owed = half if i > 0 else 0.0
        seen[i, 0] = impactor.offset + motion - w
        seen[i, 1] = velocity - rate - owed * ((1.0 - done) * contact0 + done * contact1)
        seen[i, 2] = c
        seen[i, 3] = c_rate + owed * ((1.0 - done) * center0 + done * center1)
        if i == pieces:
            break
        kick = piece if i > 0 else half
        w, rate, c, c_rate = glide(memory, layout, flow, kick * (1.0 - done), k, kick * done, k1, q1, p1)
        sine, cosine = sine * turn_cosine + cosine * turn_sine, cosine * turn_cosine - sine * turn_sine
