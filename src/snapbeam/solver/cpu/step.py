"""The step in the mode-lane layout: the modes of a run eight at a time, their rows in memory.

``solver/step.py`` explains the step.  This file has the operations that it is built from, its input and its results.
"""

from __future__ import annotations

from typing import Any, NamedTuple

from numba import types
from numba.extending import overload

from snapbeam.solver.compilation import INLINE_HERE, called, compiled, inlined
from snapbeam.solver.contact_force import contact_force, damping_coefficient
from snapbeam.solver.cpu.mode_lanes import (
    acceleration_rows,
    beam_signals,
    flow_coefficients,
    flow_rows,
    kick_and_flow_rows,
    kick_row,
    kick_rows,
    modal_energy,
    signals,
    tension_rows,
    tension_rows_twice,
)
from snapbeam.solver.cpu.terms.further_contacts import (
    accumulate_damped_contacts,
    add_damped_contacts,
    evaluate_contacts,
    with_further_contact_gross_work,
    with_further_contact_loss,
    with_further_contact_work,
)
from snapbeam.solver.cpu.terms.velocity_block import (
    IMPULSE_IN_KICK,
    LOST_IN_KICK,
    VELOCITY,
    acts,
    add_impulses,
    add_velocity_dependent,
    enter_contact,
    open_first_contact,
    rest_in_kick,
    solve_velocity_block,
)
from snapbeam.solver.excitation import tip_motion, turned_motion
from snapbeam.solver.physics import sincos
from snapbeam.solver.simd import WIDTH, dot, fma, load, store
from snapbeam.solver.splitting import TURNS
from snapbeam.solver.step import ContactIncrement, InnerProducts, Primitives, build_step, rotate_phase
from snapbeam.solver.step_control import ContactKinematics
from snapbeam.solver.terms.interface import (
    ExternalWork,
    add_to_tension,
    add_work,
    after_flow,
    before_flow,
    begin_kick,
    does_work,
    has_state,
    needs_tension_product,
    no_external_work,
    update_forces,
)


class Step(NamedTuple):
    """One step to take: how long, from where to where, and whether in contact."""

    ticks: int
    at: int
    """Memory offset of the coefficients that :func:`prepare` wrote for this length."""
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
    """Results of a step: g.q and q.Gq at its end, and changes over the step."""

    gq: float
    qr: float
    impulse: float
    work: float
    """Work of the strikers."""
    gross: float
    lost: float
    """In the contact."""
    dissipated: float
    external: ExternalWork
    """Work of the terms."""


@inlined
def nothing_done(layout):
    """The results of no step."""
    return StepIncrement(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, no_external_work(layout.terms))


@called
def prepare(memory, layout, stages, drive, length, at):
    """Prepare a step of *length* at offset *at*: its distinct flows, and the rotation of the drive at each kick."""
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
def _free_accelerations(memory, layout, velocity_block, spare, step):
    if velocity_block is None:
        return step.k, step.k1
    size, k, k1 = layout.size, spare, spare + layout.size
    for row in range(0, size, WIDTH):
        store(memory, k + row, load(memory, step.k + row))
        store(memory, k1 + row, load(memory, step.k1 + row))
    add_velocity_dependent(memory, size, velocity_block, step.q, step.p, k)
    add_velocity_dependent(memory, size, velocity_block, step.q1, step.p1, k1)
    add_damped_contacts(memory, size, layout.others, k, k1)
    return k, k1


@inlined
def with_velocity_dependent(memory, layout, spare, step):
    """A free step for the samples inside it: with the velocity-dependent forces in the accelerations of its ends."""
    k, k1 = _free_accelerations(memory, layout, layout.velocity_block, spare, step)
    return Step(
        step.ticks, step.at, step.length, step.phase, step.touching, step.q, step.p, k, step.q1, step.p1, k1, step.r
    )  # fmt: skip


# The operations that the step is built from.


class StepData(NamedTuple):
    """All numbers that a step reads; its state is the row of q."""

    memory: Any
    blocks: Any
    layout: Any
    stages: Any
    tip: Any
    step: Step
    with_energy: Any
    """None: energy dissipated in the modes is not computed."""
    flows: int
    gamma: float
    in_contact: bool
    sine: float
    """Sine of the phase of the drive at the beginning, if in contact."""
    cosine: float


@inlined
def _step_data(memory, blocks, layout, stages, tip, step, with_energy):
    sine, cosine = 0.0, 1.0
    if step.touching:
        sine, cosine = sincos(step.phase)
    return StepData(
        memory, blocks, layout, stages, tip, step, with_energy, stages.flows, layout.gamma, step.touching, sine, cosine
    )  # fmt: skip


@inlined
def _zero(data):
    return 0.0


@inlined
def _begin(data):
    return data.step.q, no_external_work(data.layout.terms)


@inlined
def _kick_weight(data, stage):
    return data.memory[data.stages.kick + stage] * data.step.length


@inlined
def _argument(data, stage):
    """Argument of the drive at a kick."""
    step = data.step
    return step.phase + data.memory[data.stages.elapsed + stage] * step.length * data.tip.drive.omega


@inlined
def _tip_motion(data, stage):
    memory, drive = data.memory, data.tip.drive
    turns = data.step.at + ((data.flows + 1) // 2) * 4 * data.layout.size
    sine, cosine = rotate_phase(data.sine, data.cosine, memory[turns + stage], memory[turns + TURNS + stage])
    return turned_motion(drive, memory, _argument(data, stage), sine, cosine)


@inlined
def _contact_product(data, q):
    if data.in_contact:
        return dot(data.memory, data.layout.size, data.layout.contact, q)
    return 0.0


@inlined
def _form_products(data, stage, q):
    cq, gq, qr = _contact_product(data, q), 0.0, 0.0
    if stage > 0:
        gq, qr = tension_rows(data.memory, data.blocks, data.layout, q, data.step.r)
    return InnerProducts(cq, gq, qr, data.step.r)


@inlined
def _form_products_of_two(a, b, stage, q_a, q_b):
    """The same for two runs, with G read only once."""
    cq_a, cq_b = _contact_product(a, q_a), _contact_product(b, q_b)
    gq_a, qr_a, gq_b, qr_b = 0.0, 0.0, 0.0, 0.0
    if stage > 0:
        gq_a, qr_a, gq_b, qr_b = tension_rows_twice(
            a.memory, a.blocks, a.layout, q_a, a.step.r, b.layout, q_b, b.step.r
        )
    return InnerProducts(cq_a, gq_a, qr_a, a.step.r), InnerProducts(cq_b, gq_b, qr_b, b.step.r)


@inlined
def _where_closed(data, force):
    return force


@inlined
def _flow(memory, layout, flow, q, p, q1, p1, with_energy):
    """Apply a flow; returns the energy that it dissipates in the modes."""
    before_flow(memory, layout.size, layout.terms, flow, q, p)
    if with_energy is None:
        flow_rows(memory, layout.size, flow, q, p, q1, p1)
        after_flow(memory, layout.size, layout.terms, q1, p1)
        return 0.0
    before = modal_energy(memory, layout, q, p)
    flow_rows(memory, layout.size, flow, q, p, q1, p1)
    after_flow(memory, layout.size, layout.terms, q1, p1)
    return before - modal_energy(memory, layout, q1, p1)


@inlined
def _later_kick(memory, layout, step, flow, last, weight, along_g, along_r, r, force, with_energy):
    """A kick after the first, and the flow after it unless it is the last."""
    q1, p1, k1 = step.q1, step.p1, step.k1
    if with_energy is None:
        if not last and not has_state(layout.terms):
            kick_and_flow_rows(memory, layout, flow, weight, along_g, along_r, r, force, q1, p1)
            return 0.0
    acceleration_rows(memory, layout, along_g, along_r, r, k1)
    kick_rows(memory, layout, weight, k1, force, p1, p1)
    if last:
        return 0.0
    return _flow(memory, layout, flow, q1, p1, q1, p1, with_energy)


@inlined
def _kick_and_flow(data, stage, q, weight, along_g, along_r, r, force):
    memory, layout, step, energy = data.memory, data.layout, data.step, data.with_energy
    if stage == 0:
        p = step.p if layout.velocity_block is None else step.p1
        kick_rows(memory, layout, weight, step.k, force, p, step.p1)
        return step.q1, _flow(memory, layout, step.at, step.q, step.p1, step.q1, step.p1, energy)
    flow = step.at + min(stage, data.flows - 1 - stage) * 4 * layout.size
    last = stage == data.flows
    return step.q1, _later_kick(memory, layout, step, flow, last, weight, along_g, along_r, r, force, energy)


@inlined
def _update_terms(data, stage, weight):
    memory, layout, drive, step = data.memory, data.layout, data.tip.drive, data.step
    argument = _argument(data, stage)
    q = step.q1 if stage > 0 else step.q
    update_forces(memory, layout.size, layout.terms, drive, argument, q)
    begin_kick(memory, layout.terms, weight, stage == 0)
    open_first_contact(memory, layout.velocity_block)
    evaluate_contacts(memory, layout.size, layout.others, drive, argument, q, weight, stage == 0)


@inlined
def _add_to_tension(data, along_g, along_r):
    return add_to_tension(data.memory, data.layout.terms, along_g, along_r)


def _force_of_contact(data: Any, penetration: float, velocity: float) -> float:
    """The contact force in a kick, of any law; that of a law that loses energy is left to the velocity block."""
    raise TypeError("_force_of_contact runs in compiled code only")


@inlined
def _enter_lossy_contact(data, penetration, velocity):
    """Leave the first contact to the velocity block."""
    law = data.tip.law
    # at the very onset rounding leaves a penetration of either sign
    at = max(penetration, 0.0)
    enter_contact(
        data.memory, data.layout.velocity_block.first, contact_force(law, at), damping_coefficient(law, at), velocity
    )  # fmt: skip
    return 0.0


@overload(_force_of_contact, jit_options=INLINE_HERE)
def _force_of_contact_by_law(data, penetration, velocity):
    tip = data.types[data.fields.index("tip")]
    law = tip.types[tip.fields.index("law")]
    if law.instance_class.owner.rate_dependent:
        return lambda data, penetration, velocity: _enter_lossy_contact(data, penetration, velocity)
    return lambda data, penetration, velocity: contact_force(data.tip.law, penetration)


@inlined
def _whole_acceleration(memory, layout, step, stage, along_g, along_r, force, kick):
    """The acceleration of a kick, contact included, as the row *kick*; of the first kick that of the last step."""
    if stage > 0:
        acceleration_rows(memory, layout, along_g, along_r, step.r, kick)
    for row in range(0, layout.size, WIDTH):
        k = load(memory, kick + row) if stage > 0 else load(memory, step.k + row)
        store(memory, kick + row, fma(force, load(memory, layout.contact + row), k))


def _exchange_energy(
    data: Any, stage: int, weight: float, along_g: float, along_r: float, contact: Any, surroundings: Any
) -> Any:
    """Work of the terms, and the impulses of forces that depend on velocities, which p1 then includes."""
    raise TypeError("_exchange_energy runs in compiled code only")


@overload(_exchange_energy, jit_options=INLINE_HERE)
def _exchange_by_layout(data, stage, weight, along_g, along_r, contact, surroundings):
    layout = data.types[data.fields.index("layout")]
    kinds = dict(zip(layout.fields, layout.types, strict=True))
    works = any(hasattr(each.instance_class, "kick_work") for each in kinds["terms"])
    if kinds["velocity_block"] == types.none and not works:
        return lambda data, stage, weight, along_g, along_r, contact, surroundings: (contact, surroundings)
    return lambda data, stage, weight, along_g, along_r, contact, surroundings: _exchange(
        data, data.layout.velocity_block, stage, weight, along_g, along_r, contact, surroundings
    )


@inlined
def _first_contact_of_block(memory, first, weight, contact):
    """The first contact with its impulse in a kick that the velocity block has solved."""
    if first is None:
        return contact
    impulse, work = (
        memory[first + IMPULSE_IN_KICK],
        memory[first + IMPULSE_IN_KICK] * memory[first + VELOCITY],
    )
    return ContactIncrement(
        contact.force,
        contact.impulse + impulse,
        contact.work + work,
        contact.gross + (abs(work) if weight > 0.0 else -abs(work)),
        contact.lost + memory[first + LOST_IN_KICK],
    )


@inlined
def _exchange(data, velocity_block, stage, weight, along_g, along_r, contact, work):
    memory, layout, step = data.memory, data.layout, data.step
    size, p = layout.size, step.p if stage == 0 else step.p1
    kick, active = kick_row(layout), False
    if velocity_block is not None:
        active = acts(memory, velocity_block.channels, False)
    if active or does_work(layout.terms):
        _whole_acceleration(memory, layout, step, stage, along_g, along_r, contact.force, kick)
    if velocity_block is not None:
        if active:
            solve_velocity_block(memory, size, velocity_block, weight, kick, p)
        else:
            rest_in_kick(memory, velocity_block)
    if does_work(layout.terms):
        if stage == 0 and needs_tension_product(layout.terms):
            tension_rows(memory, data.blocks, layout, step.q, step.r)
        work = add_work(memory, size, layout.terms, weight, layout.g, step.r, kick, p, work)
    if velocity_block is not None:
        if active or stage == 0:
            add_impulses(memory, size, velocity_block, p, step.p1)
        accumulate_damped_contacts(memory, layout.others, weight)
        contact = _first_contact_of_block(memory, velocity_block.first, weight, contact)
    return contact, work


_STEP = build_step(
    Primitives(
        zero=_zero,
        begin=_begin,
        kick_weight=_kick_weight,
        tip_motion=_tip_motion,
        form_products=_form_products,
        where_closed=_where_closed,
        kick_and_flow=_kick_and_flow,
        update_terms=_update_terms,
        add_to_tension=_add_to_tension,
        force_of_contact=_force_of_contact,
        exchange_energy=_exchange_energy,
    )
)
_take_step, _begin_step, _take_stage = _STEP.take_step, _STEP.begin_step, _STEP.take_stage


@inlined
def _results(memory, layout, increment):
    """The results of a step, with the work of further contacts."""
    contact = increment.contact
    work = with_further_contact_work(memory, layout.others, contact.work)
    gross = with_further_contact_gross_work(memory, layout.others, contact.gross)
    lost = with_further_contact_loss(memory, layout.others, contact.lost)
    return StepIncrement(
        increment.gq, increment.qr, contact.impulse, work, gross, lost, increment.dissipated, increment.surroundings
    )  # fmt: skip


@called
def take_step(memory, blocks, layout, stages, tip, step, with_energy):
    """Advance (q, p) with acceleration k by a step into (q1, p1, k1).

    The dissipated energy is computed unless *with_energy* is None; nothing else depends on it, to the last bit.
    """
    _, increment = _take_step(_step_data(memory, blocks, layout, stages, tip, step, with_energy))
    return _results(memory, layout, increment)


@compiled
def take_two_steps(memory, blocks, stages, layout_a, tip_a, step_a, layout_b, tip_b, step_b):
    """A step of each of two runs, stage by stage in turn: :func:`take_step` twice, bit for bit.

    A single run leaves the processor waiting for sums most of the time; the other one uses that time.
    """
    a = _step_data(memory, blocks, layout_a, stages, tip_a, step_a, None)
    b = _step_data(memory, blocks, layout_b, stages, tip_b, step_b, None)
    (q_a, increment_a), (q_b, increment_b) = _begin_step(a), _begin_step(b)
    for stage in range(stages.flows + 1):
        products_a, products_b = _form_products_of_two(a, b, stage, q_a, q_b)
        q_a, increment_a = _take_stage(a, stage, q_a, products_a, increment_a)
        q_b, increment_b = _take_stage(b, stage, q_b, products_b, increment_b)
    return _results(memory, layout_a, increment_a), _results(memory, layout_b, increment_b)
