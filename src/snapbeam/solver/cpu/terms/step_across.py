"""A step across a jump of a drive's velocity, taken in two parts.

Of a drive without jumps nothing of this is compiled.
"""

from __future__ import annotations

from typing import Any

from numba.extending import overload

from snapbeam.solver.compilation import INLINE_HERE, called, inlined
from snapbeam.solver.contact_force import mark_of
from snapbeam.solver.cpu.mode_lanes import acceleration_rows
from snapbeam.solver.cpu.state import variable_slot
from snapbeam.solver.cpu.step import Step, StepIncrement, observe, prepare, take_step
from snapbeam.solver.cpu.terms.discontinuities import APART, discontinuity_within, jumps_of
from snapbeam.solver.cpu.terms.further_contact_events import add_stored_contacts, store_further_contacts
from snapbeam.solver.physics import tension_factors
from snapbeam.solver.terms.interface import (
    add_stored_loss,
    add_to_tension,
    does_work,
    store_loss,
    total_work,
    update_forces,
)

_NEAR = 0.5
"""Ticks: a jump so near behind the end of a step counts as within it."""


@inlined
def in_succession(layout, one, two):
    """The results of two parts of a step."""
    return StepIncrement(
        two.gq, two.qr, one.impulse + two.impulse, one.work + two.work, one.gross + two.gross, one.lost + two.lost,
        one.dissipated + two.dissipated,
        total_work(layout.terms, one.external, two.external),
    )  # fmt: skip


@called
def _in_two_parts(memory, blocks, layout, stages, run, tip, step, length, with_energy):
    """The *step* as a part of *length* seconds, which ends at the jump, and the rest."""
    drive, at = run.tip.drive, variable_slot(run)
    to_jump = Step(
        0, at, length, step.phase - APART, step.touching, step.q, step.p, step.k, step.q1, step.p1, step.k1, step.r
    )  # fmt: skip
    prepare(memory, layout, stages, drive, to_jump.length, at)
    one = take_step(memory, blocks, layout, stages, tip, to_jump, with_energy)
    store_further_contacts(memory, layout.others)
    store_loss(memory, layout.terms)
    phase = step.phase + drive.omega * length + APART
    if does_work(layout.terms):
        update_forces(memory, layout.size, layout.terms, drive, phase, step.q1)
        along_g, along_r = tension_factors(layout.gamma, one.gq, one.qr)
        along_g, along_r = add_to_tension(memory, layout.terms, along_g, along_r)
        acceleration_rows(memory, layout, along_g, along_r, step.r, step.k1)
    rest = Step(
        0, at, step.length - length, phase, step.touching, step.q1, step.p1, step.k1, step.q1, step.p1, step.k1, step.r
    )  # fmt: skip
    prepare(memory, layout, stages, drive, rest.length, at)
    two = take_step(memory, blocks, layout, stages, tip, rest, with_energy)
    add_stored_contacts(memory, layout.others)
    add_stored_loss(memory, layout.terms)
    return in_succession(layout, one, two)


def taken_across(
    memory: Any,
    blocks: Any,
    layout: Any,
    stages: Any,
    run: Any,
    tip: Any,
    t: int,
    step: Any,
    done: Any,
    with_energy: Any,
) -> Any:
    """Result of a step from tick *t*; if the drive jumps within the step, the step is repeated in two parts."""
    raise TypeError("taken_across runs in compiled code only")


@overload(taken_across, jit_options=INLINE_HERE)
def _taken_across(memory, blocks, layout, stages, run, tip, t, step, done, with_energy):
    if not jumps_of(tip.types[tip.fields.index("drive")].instance_class.owner):
        return lambda memory, blocks, layout, stages, run, tip, t, step, done, with_energy: done

    def implementation(memory, blocks, layout, stages, run, tip, t, step, done, with_energy):
        clock = run.clock
        # a part of a step may end at the jump itself, where rounding decides which velocity is read
        after = discontinuity_within(tip.drive, run.phase, clock.period, t, step.length / clock.tick + _NEAR)
        if after < 0.0:
            return done
        length = min(after * clock.tick, step.length)
        return _in_two_parts(memory, blocks, layout, stages, run, tip, step, length, with_energy)

    return implementation


def mark_at_jump(
    memory: Any, blocks: Any, layout: Any, stages: Any, run: Any, tip: Any, t: int, step: Any, deepest: float
) -> float:
    """The maximum penetration of a contact so far, or the maximum force, with that at a jump within a step."""
    raise TypeError("mark_at_jump runs in compiled code only")


@called
def _mark(memory, blocks, layout, stages, run, tip, step, length, deepest):
    q, p, at = run.spare, run.spare + layout.size, variable_slot(run)
    to_jump = Step(
        0, at, length, step.phase - APART, step.touching, step.q, step.p, step.k, q, p, run.spare + 2 * layout.size, step.r
    )  # fmt: skip
    prepare(memory, layout, stages, run.tip.drive, length, at)
    take_step(memory, blocks, layout, stages, tip, to_jump, None)
    phase = step.phase + tip.drive.omega * length
    before = observe(memory, layout, tip, phase - APART, q, p)
    behind = observe(memory, layout, tip, phase + APART, q, p)
    return max(deepest, max(mark_of(tip.law, before.d, before.dv), mark_of(tip.law, behind.d, behind.dv)))


@overload(mark_at_jump, jit_options=INLINE_HERE)
def _mark_at_jump(memory, blocks, layout, stages, run, tip, t, step, deepest):
    if not jumps_of(tip.types[tip.fields.index("drive")].instance_class.owner):
        return lambda memory, blocks, layout, stages, run, tip, t, step, deepest: deepest

    def implementation(memory, blocks, layout, stages, run, tip, t, step, deepest):
        tick = run.clock.tick
        after = discontinuity_within(tip.drive, run.phase, run.clock.period, t, step.length / tick)
        if after < 0.0:
            return deepest
        return _mark(memory, blocks, layout, stages, run, tip, step, after * tick, deepest)

    return implementation
