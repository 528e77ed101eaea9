"""One step of one trajectory, or of two side by side: a composition of kicks and exact linear flows."""

from __future__ import annotations

from typing import NamedTuple

from snapbeam.engines.cpu.push import ContactIncrement, apply_contact_loss, no_contact_increment
from snapbeam.engines.cpu.rows import (
    acceleration_rows,
    beam_signals,
    dot,
    flow_coefficients,
    flow_rows,
    kick_and_flow,
    kick_rows,
    modal_energy,
    signals,
    tension_rows,
    tension_rows_twice,
)
from snapbeam.engines.cpu.strikers.force import (
    with_further_contact_work,
    with_further_contact_gross_work,
    evaluate_contacts,
)
from snapbeam.engines.cpu.world.around import around_kick
from snapbeam.engines.cpu.world.circuit import (
    CircuitIncrement,
    kick_source,
    no_circuit_increment,
    circuit_acceleration_rows,
)
from snapbeam.engines.cpu.world.forced import ExternalWork, changed_load, enter_forces, no_external_work
from snapbeam.engines.scalar.compile import called, compiled, inlined
from snapbeam.engines.scalar.composition import TURNS
from snapbeam.engines.scalar.contact import contact_force, is_rate_dependent
from snapbeam.engines.scalar.decisions import ContactKinematics
from snapbeam.engines.scalar.lanes import WIDTH, load, store
from snapbeam.engines.scalar.physics import sincos, tension_factors
from snapbeam.engines.scalar.tip import tip_motion, turned_motion

__all__ = [
    "StepIncrement",
    "Step",
    "observe",
    "prepare",
    "take_step",
    "take_two",
    "with_circuit_acceleration",
]


class Step(NamedTuple):
    """One step to take: how long, from where to where, and whether in contact."""

    ticks: int
    at: int
    """Where what :func:`prepare` wrote for this length begins."""
    length: float
    """Seconds."""
    phase: float
    """Argument of the drive at the beginning."""
    touching: bool
    q: int
    p: int
    k: int
    q1: int
    p1: int
    k1: int
    r: int


class StepIncrement(NamedTuple):
    """What a step gave: g.q and q.Gq at its end, and quadratures of the order of the step."""

    gq: float
    qr: float
    impulse: float
    work: float
    """Of the strikers."""
    gross: float
    lost: float
    """In the contact."""
    dissipated: float
    given: ExternalWork
    """By a moving base and a changing axial load."""
    tap: CircuitIncrement
    """What a circuit did."""


@called
def prepare(memory, layout, stages, drive, length, at):
    """What a step of *length* needs, from *at* on: its distinct flows and the drive's turn at each kick."""
    size = layout.size
    for i in range((stages.flows + 1) // 2):
        flow_coefficients(memory, layout, memory[stages.flow + i] * length, at)
        at += 4 * size
    for i in range(0, TURNS, WIDTH):
        sine, cosine = sincos(load(memory, stages.elapsed + i) * (length * drive.omega))
        store(memory, at + i, sine)
        store(memory, at + TURNS + i, cosine)


@compiled
def observe(memory, layout, tip, phase, q, p):
    """Beam at the striker from rest and its rate; penetration and its rate; centre from rest and its rate."""
    motion, velocity = tip_motion(tip.drive, memory, phase)
    w, rate, c, c_rate = signals(memory, layout, q, p)
    beam, beam_rate = beam_signals(memory, layout, q, p, w, rate)
    return ContactKinematics(beam, beam_rate, tip.offset + motion - w, velocity - rate, c, c_rate)


@inlined
def _begin_push(step, stages, size):
    """Sine and cosine of the drive at the beginning, and where its turns at the kicks stand."""
    sine, cosine = 0.0, 1.0
    if step.touching:
        sine, cosine = sincos(step.phase)
    return sine, cosine, step.at + ((stages.flows + 1) // 2) * 4 * size


@inlined
def _push(memory, layout, stages, tip, step, drive0, stage, weight, push):
    """The contact at a stage of a step in contact; *push* as it was if the step is a free one.

    Of a law that loses energy, what its force is to follow from, in :func:`~snapbeam.engines.cpu.push.apply_contact_loss`.
    """
    if not step.touching:
        return push
    here = step.q1 if stage > 0 else step.q
    sine0, cosine0, turns = drive0
    sine, cosine = memory[turns + stage], memory[turns + TURNS + stage]
    sine, cosine = sine0 * cosine + cosine0 * sine, cosine0 * cosine - sine0 * sine
    now = step.phase + memory[stages.elapsed + stage] * step.length * tip.drive.omega
    motion, velocity = turned_motion(tip.drive, memory, now, sine, cosine)
    penetration = tip.offset + motion - dot(memory, layout.size, layout.contact, here)
    if is_rate_dependent(tip.law):
        return ContactIncrement(0.0, push.impulse, push.work, push.gross, push.lost, penetration, velocity)
    force = contact_force(tip.law, penetration)
    return ContactIncrement(
        force,
        push.impulse + weight * force,
        push.work + weight * force * velocity,
        push.gross + weight * abs(force * velocity),
        0.0,
        0.0,
        0.0,
    )


@inlined
def _first(memory, layout, step, weight, force, ledger):
    """The kick that begins a step, with the acceleration known from the last one, and the flow after it."""
    kick_rows(memory, layout, weight, step.k, force, kick_source(layout.circuit, step), step.p1)
    if ledger is None:
        flow_rows(memory, layout.size, step.at, step.q, step.p1, step.q1, step.p1)
        return 0.0
    before = modal_energy(memory, layout, step.q, step.p1)
    flow_rows(memory, layout.size, step.at, step.q, step.p1, step.q1, step.p1)
    return before - modal_energy(memory, layout, step.q1, step.p1)


@inlined
def _kick(memory, layout, stages, step, stage, weight, along_g, along_r, force, ledger):
    """The kick of a stage after the first, and the flow after it unless it is the last."""
    q1, p1, k1, r = step.q1, step.p1, step.k1, step.r
    if stage == stages.flows:
        # the acceleration is kept for the next step
        acceleration_rows(memory, layout, along_g, along_r, r, k1)
        kick_rows(memory, layout, weight, k1, force, p1, p1)
        return 0.0
    flow = step.at + min(stage, stages.flows - 1 - stage) * 4 * layout.size
    if ledger is None:
        kick_and_flow(memory, layout, flow, weight, along_g, along_r, r, force, q1, p1)
        return 0.0
    acceleration_rows(memory, layout, along_g, along_r, r, k1)
    kick_rows(memory, layout, weight, k1, force, p1, p1)
    before = modal_energy(memory, layout, q1, p1)
    flow_rows(memory, layout.size, flow, q1, p1, q1, p1)
    return before - modal_energy(memory, layout, q1, p1)


@inlined
def _forces(memory, layout, stages, tip, step, stage):
    """Put the forces that follow from time, and those of other strikers, at hand for a kick."""
    now = step.phase + memory[stages.elapsed + stage] * step.length * tip.drive.omega
    enter_forces(layout.forced, memory, tip.drive, now)
    here = step.q1 if stage > 0 else step.q
    weight = memory[stages.kick + stage] * step.length
    evaluate_contacts(memory, layout.size, layout.others, tip.drive, now, here, weight, stage == 0)


@inlined
def _done(memory, layout, gq, qr, push, dissipated, given):
    """What a step gave, other strikers included."""
    work = with_further_contact_work(memory, layout.others, push.work)
    gross = with_further_contact_gross_work(memory, layout.others, push.gross)
    return StepIncrement(gq, qr, push.impulse, work, gross, push.lost, dissipated, given[0], given[1])


@inlined
def with_circuit_acceleration(memory, layout, spare, step):
    """A free step as it is looked into: with the circuit's part in the accelerations of its ends, if there is one."""
    k, k1 = circuit_acceleration_rows(memory, layout.size, layout.circuit, spare, step)
    return Step(
        step.ticks, step.at, step.length, step.phase, step.touching, step.q, step.p, k, step.q1, step.p1, k1, step.r
    )  # fmt: skip


@called
def take_step(memory, blocks, layout, stages, tip, step, ledger):
    """Advance (q, p) with tension acceleration k by a step into (q1, p1, k1).

    Dissipation is added up unless *ledger* is None; nothing else depends on it, to the last bit.
    """
    drive0 = _begin_push(step, stages, layout.size)
    push, gq, qr, dissipated, given = (
        no_contact_increment(),
        0.0,
        0.0,
        0.0,
        (no_external_work(), no_circuit_increment()),
    )
    for stage in range(stages.flows + 1):
        weight = memory[stages.kick + stage] * step.length
        push = _push(memory, layout, stages, tip, step, drive0, stage, weight, push)
        _forces(memory, layout, stages, tip, step, stage)
        if stage == 0:
            push = apply_contact_loss(memory, layout, tip, step, stage, weight, 0.0, 0.0, push)
            given = around_kick(
                memory, blocks, layout, tip, step, stage, weight, (0.0, 0.0, push.force), given
            )
            dissipated += _first(memory, layout, step, weight, push.force, ledger)
            continue
        gq, qr = tension_rows(memory, blocks, layout, step.q1, step.r)
        along_g, along_r = tension_factors(layout.gamma, gq, qr)
        along_g, along_r = changed_load(memory, layout.forced, along_g, along_r)
        push = apply_contact_loss(memory, layout, tip, step, stage, weight, along_g, along_r, push)
        given = around_kick(
            memory, blocks, layout, tip, step, stage, weight, (along_g, along_r, push.force), given
        )
        dissipated += _kick(memory, layout, stages, step, stage, weight, along_g, along_r, push.force, ledger)
    return _done(memory, layout, gq, qr, push, dissipated, given)


@compiled
def take_two(memory, blocks, stages, layout_a, tip_a, a, layout_b, tip_b, b):
    """A step of each of two trajectories, stage by stage in turn: :func:`take_step` twice, bit for bit.

    A single trajectory leaves the processor waiting for sums most of the time; the other one uses that time.
    """
    drive_a, drive_b = _begin_push(a, stages, layout_a.size), _begin_push(b, stages, layout_b.size)
    push_a, gq_a, qr_a = no_contact_increment(), 0.0, 0.0
    push_b, gq_b, qr_b = push_a, 0.0, 0.0
    given_a = (no_external_work(), no_circuit_increment())
    given_b = given_a
    for stage in range(stages.flows + 1):
        weight_a, weight_b = memory[stages.kick + stage] * a.length, memory[stages.kick + stage] * b.length
        push_a = _push(memory, layout_a, stages, tip_a, a, drive_a, stage, weight_a, push_a)
        push_b = _push(memory, layout_b, stages, tip_b, b, drive_b, stage, weight_b, push_b)
        _forces(memory, layout_a, stages, tip_a, a, stage)
        _forces(memory, layout_b, stages, tip_b, b, stage)
        if stage == 0:
            push_a = apply_contact_loss(memory, layout_a, tip_a, a, stage, weight_a, 0.0, 0.0, push_a)
            push_b = apply_contact_loss(memory, layout_b, tip_b, b, stage, weight_b, 0.0, 0.0, push_b)
            given_a = around_kick(
                memory, blocks, layout_a, tip_a, a, stage, weight_a, (0.0, 0.0, push_a.force), given_a
            )
            given_b = around_kick(
                memory, blocks, layout_b, tip_b, b, stage, weight_b, (0.0, 0.0, push_b.force), given_b
            )
            _first(memory, layout_a, a, weight_a, push_a.force, None)
            _first(memory, layout_b, b, weight_b, push_b.force, None)
            continue
        gq_a, qr_a, gq_b, qr_b = tension_rows_twice(memory, blocks, layout_a, a.q1, a.r, layout_b, b.q1, b.r)
        g_a, r_a = tension_factors(layout_a.gamma, gq_a, qr_a)
        g_b, r_b = tension_factors(layout_b.gamma, gq_b, qr_b)
        g_a, r_a = changed_load(memory, layout_a.forced, g_a, r_a)
        g_b, r_b = changed_load(memory, layout_b.forced, g_b, r_b)
        push_a = apply_contact_loss(memory, layout_a, tip_a, a, stage, weight_a, g_a, r_a, push_a)
        push_b = apply_contact_loss(memory, layout_b, tip_b, b, stage, weight_b, g_b, r_b, push_b)
        given_a = around_kick(
            memory, blocks, layout_a, tip_a, a, stage, weight_a, (g_a, r_a, push_a.force), given_a
        )
        given_b = around_kick(
            memory, blocks, layout_b, tip_b, b, stage, weight_b, (g_b, r_b, push_b.force), given_b
        )
        _kick(memory, layout_a, stages, a, stage, weight_a, g_a, r_a, push_a.force, None)
        _kick(memory, layout_b, stages, b, stage, weight_b, g_b, r_b, push_b.force, None)
    return (
        _done(memory, layout_a, gq_a, qr_a, push_a, 0.0, given_a),
        _done(memory, layout_b, gq_b, qr_b, push_b, 0.0, given_b),
    )
