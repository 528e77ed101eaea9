"""What follows a step, by the law of contact: a force that is integrated, or a jump."""

from __future__ import annotations

from typing import Any

from numba.extending import overload

from snapbeam.solver.compilation import INLINE_HERE
from snapbeam.solver.cpu.events import accept_step
from snapbeam.solver.cpu.restitution import accept_step_restitution

__all__ = ["accept_step_by_law"]


def accept_step_by_law(
    memory: Any,
    blocks: Any,
    workspace: Any,
    run: Any,
    now: Any,
    step: Any,
    done: Any,
    scratch: Any,
    accumulators: Any,
    kernel_input: Any,
    outputs: Any,
) -> Any:
    """Where a run stands after a step, and the step that was taken; *outputs* are what is recorded, or None."""
    raise TypeError("accept_step_by_law runs in compiled code only")


@overload(accept_step_by_law, jit_options=INLINE_HERE)
def _accept_step_by_law(
    memory, blocks, workspace, run, now, step, done, scratch, accumulators, kernel_input, outputs
):
    law = kernel_input.types[kernel_input.fields.index("law")]
    chosen = accept_step_restitution if law.instance_class.owner.impulsive else accept_step

    def implementation(
        memory, blocks, workspace, run, now, step, done, scratch, accumulators, kernel_input, outputs
    ):
        return chosen(
            memory, blocks, workspace, run, now, step, done, scratch, accumulators, kernel_input, outputs
        )

    return implementation
