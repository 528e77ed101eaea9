"""What follows a step, by the law of contact: a force that is integrated, or a jump."""

from __future__ import annotations

from typing import Any

from numba.extending import overload

from snapbeam.engines.cpu.settling.elastic import settle
from snapbeam.engines.cpu.settling.newton import settle_newton
from snapbeam.engines.scalar.compile import INLINE_HERE

__all__ = ["after_step"]


def after_step(
    memory: Any,
    blocks: Any,
    place: Any,
    run: Any,
    now: Any,
    step: Any,
    done: Any,
    room: Any,
    book: Any,
    asked: Any,
    outputs: Any,
) -> Any:
    """Where a run stands after a step, and the step that was taken; *outputs* are what is recorded, or None."""
    raise TypeError("after_step runs in compiled code only")


@overload(after_step, jit_options=INLINE_HERE)
def _after_step(memory, blocks, place, run, now, step, done, room, book, asked, outputs):
    law = asked.types[asked.fields.index("law")]
    chosen = settle_newton if law.instance_class.owner.impulsive else settle

    def implementation(memory, blocks, place, run, now, step, done, room, book, asked, outputs):
        return chosen(memory, blocks, place, run, now, step, done, room, book, asked, outputs)

    return implementation
