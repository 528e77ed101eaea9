"""The hardest moment of a contact: the deepest, or that of the greatest force where the rate counts too."""

from __future__ import annotations

from typing import Any

from numba.extending import overload

from snapbeam.engines.cpu.recording import record_aside
from snapbeam.engines.cpu.state import cut_slot
from snapbeam.engines.cpu.step import Step, observe, prepare, take_step
from snapbeam.engines.scalar.compile import INLINE_HERE, inlined
from snapbeam.engines.scalar.contact import felt_force
from snapbeam.engines.scalar.signals import cubic, turning_point, update_extrema

__all__ = ["locate_peak_force"]

_PARTS = 24
"""Of a step, at whose ends the force is looked at."""


def locate_peak_force(
    memory: Any,
    blocks: Any,
    layout: Any,
    stages: Any,
    run: Any,
    tip: Any,
    now: Any,
    step: Any,
    seen1: Any,
    sample: Any,
    accumulators: Any,
    outputs: Any,
) -> Any:
    """The greatest penetration of a contact so far, or the greatest force under a law that loses energy.

    Returns that and how many samples there are: a moment inside the step is one where the run is recorded.
    """
    raise TypeError("hardest_point runs in compiled code only")


@inlined
def aside(step, run, length, size):
    """*step*, cut to *length* and written to the spare rows: a look ahead."""
    return Step(
        0, cut_slot(run), length, step.phase, step.touching, step.q, step.p, step.k,
        run.spare, run.spare + size, run.spare + 2 * size, step.r
    )  # fmt: skip


@inlined
def _deepest_point(memory, blocks, layout, stages, run, tip, now, step, seen1, sample, accumulators, outputs):
    """The greatest penetration of a contact so far, its turning point within the step included.

    Returns that and how many samples there are: the turning point is one where the run is recorded.
    """
    seen, deepest = now.seen, max(accumulators.deepest, seen1.d)
    turn = turning_point(seen.d, seen.dv, seen1.d, seen1.dv, step.length) if seen.dv > 0.0 else -1.0
    if (
        turn > 0.0
        and update_extrema(seen.d, deepest, seen.d, seen.dv, seen1.d, seen1.dv, step.length)[1] > deepest
    ):
        part, size = turn * step.length, layout.size
        prepare(memory, layout, stages, run.struck.drive, part, cut_slot(run))
        ledger = None if outputs is None else True
        short = aside(step, run, part, size)
        here = take_step(memory, blocks, layout, stages, tip, short, ledger)
        there = step.phase + tip.drive.omega * part
        about = observe(memory, layout, tip, there, run.spare, run.spare + size)
        if outputs is not None:
            when = now.t * run.clock.tick + part
            sample = record_aside(
                memory, layout, tip, now, short, here, when, about, sample, accumulators, outputs
            )
        deepest = max(deepest, about.d)
    return deepest, sample


@inlined
def _greatest_force(
    memory, blocks, layout, stages, run, tip, now, step, seen1, sample, accumulators, outputs
):
    """The greatest force of a contact so far: looked for on the cubic through the step, then stepped to."""
    seen, law = now.seen, tip.law
    greatest = max(
        accumulators.deepest, max(felt_force(law, seen.d, seen.dv), felt_force(law, seen1.d, seen1.dv))
    )
    c0, c1, c2, c3 = cubic(seen.d, seen.dv, seen1.d, seen1.dv, step.length)
    best, at = greatest, 0.0
    for i in range(1, _PARTS):
        s = i / _PARTS
        d = c0 + s * (c1 + s * (c2 + s * c3))
        force = felt_force(law, d, (c1 + s * (2.0 * c2 + s * 3.0 * c3)) / step.length)
        if force > best:
            best, at = force, s
    if at > 0.0:
        part, size = at * step.length, layout.size
        prepare(memory, layout, stages, run.struck.drive, part, cut_slot(run))
        ledger = None if outputs is None else True
        short = aside(step, run, part, size)
        here = take_step(memory, blocks, layout, stages, tip, short, ledger)
        there = step.phase + tip.drive.omega * part
        about = observe(memory, layout, tip, there, run.spare, run.spare + size)
        if outputs is not None:
            when = now.t * run.clock.tick + part
            sample = record_aside(
                memory, layout, tip, now, short, here, when, about, sample, accumulators, outputs
            )
        greatest = max(greatest, felt_force(law, about.d, about.dv))
    return greatest, sample


@overload(locate_peak_force, jit_options=INLINE_HERE)
def _hardest_point(memory, blocks, layout, stages, run, tip, now, step, seen1, sample, accumulators, outputs):
    law = tip.types[tip.fields.index("law")]
    chosen = _greatest_force if law.instance_class.owner.rate_dependent else _deepest_point

    def implementation(
        memory, blocks, layout, stages, run, tip, now, step, seen1, sample, accumulators, outputs
    ):
        return chosen(
            memory, blocks, layout, stages, run, tip, now, step, seen1, sample, accumulators, outputs
        )

    return implementation
