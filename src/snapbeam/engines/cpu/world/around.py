"""What surrounds the beam, at a kick: the work that is given to it and the circuit that taps it."""

from __future__ import annotations

from typing import Any

from numba.extending import overload

from snapbeam.engines.cpu.rows import acceleration_rows, tension_rows
from snapbeam.engines.cpu.world.circuit import apply_tap, lean_kick, tap_of
from snapbeam.engines.cpu.world.forced import worked
from snapbeam.engines.scalar.compile import INLINE_HERE, inlined
from snapbeam.engines.scalar.lanes import WIDTH, fma, load, store

__all__ = ["around_kick", "accumulate_environment_work"]


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
