"""Acceptance of a step by type of contact law: integrated force or jump of the velocity."""

from __future__ import annotations

from typing import Any

from numba.extending import overload

from snapbeam.solver.compilation import INLINE_HERE
from snapbeam.solver.cpu.events import accept_step
from snapbeam.solver.cpu.restitution import accept_step_restitution


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
    """State of a run after a step, and the step taken; *outputs* receives the recording, or is None."""
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
