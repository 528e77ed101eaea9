"""One step of one trajectory, or of two side by side: a composition of kicks and exact linear flows."""

from __future__ import annotations

from typing import Any, NamedTuple

from numba.extending import overload

from snapbeam.solver.compilation import INLINE_HERE, called, compiled, inlined
from snapbeam.solver.contact_force import contact_force, is_rate_dependent, kick_force
from snapbeam.solver.cpu.dot import dot
from snapbeam.solver.cpu.mode_lanes import (
    acceleration_rows,
    beam_signals,
    flow_coefficients,
    flow_rows,
    kick_and_flow,
    kick_rows,
    modal_energy,
    signals,
    tension_rows,
    tension_rows_twice,
)
from snapbeam.solver.cpu.terms.base_and_load import (
    ExternalWork,
    changed_load,
    enter_forces,
    no_external_work,
    shaken_along,
    worked,
)
from snapbeam.solver.cpu.terms.circuit import (
    CircuitIncrement,
    apply_tap,
    circuit_acceleration_rows,
    kick_source,
    lean_kick,
    no_circuit_increment,
    tap_of,
)
from snapbeam.solver.cpu.terms.further_contacts import (
    evaluate_contacts,
    struck_along,
    with_further_contact_gross_work,
    with_further_contact_work,
)
from snapbeam.solver.cpu.terms.second_well import pushed_along
from snapbeam.solver.excitation import tip_motion, turned_motion
from snapbeam.solver.physics import sincos, tension_factors
from snapbeam.solver.simd import WIDTH, fma, load, store
from snapbeam.solver.splitting import TURNS
from snapbeam.solver.step_control import ContactKinematics

__all__ = [
    "ContactIncrement",
    "Step",
    "StepIncrement",
    "accumulate_environment_work",
    "apply_contact_loss",
    "around_kick",
    "no_contact_increment",
    "observe",
    "prepare",
    "take_step",
    "take_two",
    "with_circuit_acceleration",
]


# ----------------------------------------------------------------------------------------------------
# The contact within a step: its force at a kick, and what it did so far.


class ContactIncrement(NamedTuple):
    """The contact within a step: the force at the present kick, and its quadratures so far."""

    force: float
    impulse: float
    work: float
    gross: float
    lost: float
    penetration: float
    """At the present kick, and the tip's velocity there: of a law that loses energy."""
    velocity: float


@inlined
def no_contact_increment():
    """The contact of a step that has not begun."""
    return ContactIncrement(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


def apply_contact_loss(
    memory: Any,
    layout: Any,
    tip: Any,
    step: Any,
    stage: int,
    weight: float,
    along_g: float,
    along_r: float,
    push: Any,
) -> Any:
    """The contact of a law that loses energy, once the tension's acceleration is known; *push* of any other law.

    Of the first kick that acceleration is the row that the last step left.
    """
    raise TypeError("apply_contact_loss runs in compiled code only")


@inlined
def _damped(memory, layout, tip, step, stage, weight, along_g, along_r, push):
    if not step.touching:
        return ContactIncrement(
            0.0, push.impulse, push.work, push.gross, push.lost, push.penetration, push.velocity
        )
    size, contact = layout.size, layout.contact
    if stage == 0:
        rate, along = dot(memory, size, contact, step.p), dot(memory, size, contact, step.k)
    else:
        rate = dot(memory, size, contact, step.p1)
        along = along_g * dot(memory, size, contact, layout.g) + along_r * dot(memory, size, contact, step.r)
        along = pushed_along(memory, size, layout.unequal_wells, contact, along)
        along = struck_along(memory, size, layout.others, contact, along)
        along = shaken_along(memory, size, layout.forced, contact, along)
    mobility = dot(memory, size, contact, contact)
    given = kick_force(tip.law, push.penetration, push.velocity - rate, mobility, along, weight)
    force, velocity = given.impulse, push.velocity
    return ContactIncrement(
        force,
        push.impulse + weight * force,
        push.work + weight * force * velocity,
        push.gross + weight * abs(force * velocity),
        push.lost + given.lost,
        push.penetration,
        push.velocity,
    )


@overload(apply_contact_loss, jit_options=INLINE_HERE)
def _apply_contact_loss(memory, layout, tip, step, stage, weight, along_g, along_r, push):
    law = tip.types[tip.fields.index("law")]
    if not law.instance_class.owner.rate_dependent:
        return lambda memory, layout, tip, step, stage, weight, along_g, along_r, push: push

    def implementation(memory, layout, tip, step, stage, weight, along_g, along_r, push):
        return _damped(memory, layout, tip, step, stage, weight, along_g, along_r, push)

    return implementation


# ----------------------------------------------------------------------------------------------------
# What surrounds the beam, at a kick: the work that is given to it and the circuit that taps it.


@inlined
def _whole_kick(memory, layout, step, stage, along_g, along_r, force, kick):
    """The acceleration of a kick, contact included, as a row; of the first kick of a step the one that was kept."""
    if stage > 0:
        acceleration_rows(memory, layout, along_g, along_r, step.r, kick)
    for row in range(0, layout.size, WIDTH):
        k = load(memory, kick + row) if stage > 0 else load(memory, step.k + row)
        store(memory, kick + row, fma(force, load(memory, layout.contact + row), k))


def around_kick(
    memory: Any,
    blocks: Any,
    layout: Any,
    tip: Any,
    step: Any,
    stage: int,
    weight: float,
    along: Any,
    given: Any,
) -> Any:
    """Work given in the step with a kick that is about to be made, and what the circuit then has done.

    *along* is what the tension pulls along g and r with, and the contact force; *given* is the work so far and the tap
    so far.  The circuit's impulse is given to p here, the kick itself is left to the caller; of the first kick of a
    step p1 then holds p with that impulse.
    """
    raise TypeError("around_kick runs in compiled code only")


@overload(around_kick, jit_options=INLINE_HERE)
def _around_kick(memory, blocks, layout, tip, step, stage, weight, along, given):
    forced = hasattr(layout.types[layout.fields.index("forced")], "fields")
    circuit = hasattr(layout.types[layout.fields.index("circuit")], "fields")
    if not forced and not circuit:
        return lambda memory, blocks, layout, tip, step, stage, weight, along, given: given
    drive = tip.types[tip.fields.index("drive")]
    with_load = any(part == "load" for part, _ in drive.instance_class.owner.parts)

    if not circuit:

        def work_alone(memory, blocks, layout, tip, step, stage, weight, along, given):
            along_g, along_r, force = along
            _whole_kick(memory, layout, step, stage, along_g, along_r, force, layout.forced.kick)
            if with_load and stage == 0:
                tension_rows(memory, blocks, layout, step.q, step.r)
            p = step.p if stage == 0 else step.p1
            work, tap = given
            work = worked(
                memory, layout.size, layout.forced, weight, layout.g, step.r, layout.forced.kick, p, work
            )
            return work, tap

        return work_alone

    if not forced:

        def tap_alone(memory, blocks, layout, tip, step, stage, weight, along, given):
            along_g, along_r, force = along
            size, circuit = layout.size, layout.circuit
            _whole_kick(memory, layout, step, stage, along_g, along_r, force, circuit.kick)
            p = step.p if stage == 0 else step.p1
            work, tap = given
            tap = tap_of(memory, size, circuit, circuit.own, p, weight, tap)
            apply_tap(memory, size, circuit, circuit.own, p, step.p1, tap)
            return work, tap

        return tap_alone

    def both(memory, blocks, layout, tip, step, stage, weight, along, given):
        along_g, along_r, force = along
        size, circuit = layout.size, layout.circuit
        _whole_kick(memory, layout, step, stage, along_g, along_r, force, circuit.kick)
        p = step.p if stage == 0 else step.p1
        work, tap = given
        tap = tap_of(memory, size, circuit, circuit.own, p, weight, tap)
        lean_kick(memory, size, circuit, weight, tap)
        if with_load and stage == 0:
            tension_rows(memory, blocks, layout, step.q, step.r)
        work = worked(memory, size, layout.forced, weight, layout.g, step.r, circuit.kick, p, work)
        apply_tap(memory, size, circuit, circuit.own, p, step.p1, tap)
        return work, tap

    return both


@inlined
def accumulate_environment_work(forced, accumulators, given):
    """Enter the work given in a step in the statistics."""
    if forced is None:
        return
    accumulators.base_work += given.base
    accumulators.load_work += given.load
    accumulators.gross_work += given.gross


# ----------------------------------------------------------------------------------------------------


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
    """Row in memory of the modal displacements at the beginning; p: of the velocities, k: of the tension's acceleration."""
    p: int
    k: int
    q1: int
    """The same rows at the end."""
    p1: int
    k1: int
    r: int
    """Row of the product of the tension matrix with q."""


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

    Of a law that loses energy, what its force is to follow from, in :func:`~snapbeam.solver.cpu.step.apply_contact_loss`.
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
def _first(memory, layout, step, weight, force, with_energy):
    """The kick that begins a step, with the acceleration known from the last one, and the flow after it."""
    kick_rows(memory, layout, weight, step.k, force, kick_source(layout.circuit, step), step.p1)
    if with_energy is None:
        flow_rows(memory, layout.size, step.at, step.q, step.p1, step.q1, step.p1)
        return 0.0
    before = modal_energy(memory, layout, step.q, step.p1)
    flow_rows(memory, layout.size, step.at, step.q, step.p1, step.q1, step.p1)
    return before - modal_energy(memory, layout, step.q1, step.p1)


@inlined
def _kick(memory, layout, stages, step, stage, weight, along_g, along_r, force, with_energy):
    """The kick of a stage after the first, and the flow after it unless it is the last."""
    q1, p1, k1, r = step.q1, step.p1, step.k1, step.r
    if stage == stages.flows:
        # the acceleration is kept for the next step
        acceleration_rows(memory, layout, along_g, along_r, r, k1)
        kick_rows(memory, layout, weight, k1, force, p1, p1)
        return 0.0
    flow = step.at + min(stage, stages.flows - 1 - stage) * 4 * layout.size
    if with_energy is None:
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
def take_step(memory, blocks, layout, stages, tip, step, with_energy):
    """Advance (q, p) with tension acceleration k by a step into (q1, p1, k1).

    Dissipation is added up unless *with_energy* is None; nothing else depends on it, to the last bit.
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
            dissipated += _first(memory, layout, step, weight, push.force, with_energy)
            continue
        gq, qr = tension_rows(memory, blocks, layout, step.q1, step.r)
        along_g, along_r = tension_factors(layout.gamma, gq, qr)
        along_g, along_r = changed_load(memory, layout.forced, along_g, along_r)
        push = apply_contact_loss(memory, layout, tip, step, stage, weight, along_g, along_r, push)
        given = around_kick(
            memory, blocks, layout, tip, step, stage, weight, (along_g, along_r, push.force), given
        )
        dissipated += _kick(
            memory, layout, stages, step, stage, weight, along_g, along_r, push.force, with_energy
        )
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
