"""The CUDA engine's kernel: the integration of :mod:`snapbeam.solver.cpu`, a block of threads a trajectory.

A block takes a run from the queue, integrates it to its end, enters what it found and takes the next.  After a
*budget* of steps every block lays down its run, wherever it is, and the kernel returns; the next call
goes on from the same bits.  So a call is short, whatever the runs are: the host can show progress, be
interrupted, and share the device with a display.

The first thread keeps the record of accumulators of a run; all threads make the same decisions.
"""

from __future__ import annotations

from functools import cache
from typing import Any, NamedTuple

import numpy as np
from numba import cuda, float64, int64, typeof

from snapbeam.model.contact.base import ContactLaw
from snapbeam.model.drive.base import Drive
from snapbeam.solver.cuda.control import step_function
from snapbeam.solver.cuda.layout import PARTS, RESIDENT_WARPS, SIMULATED, Block, launch_bounds, stride_of
from snapbeam.solver.cuda.state import run_functions
from snapbeam.solver.cuda.step import functions
from snapbeam.solver.ensemble import RUN
from snapbeam.solver.statistics import empty_accumulators
from snapbeam.util.status_codes import RunStatus

_RUNNING = int(RunStatus.INTERRUPTED)


class DeviceInput(NamedTuple):
    """Input of a kernel on the device."""

    runs: Any
    law_numbers: Any
    drive_numbers: Any
    contact_rows: Any
    starts: Any
    law: Any
    drive: Any
    gamma: float
    stretch: float
    max_steps: int
    high: bool
    """True if some modes count as high."""


class DeviceState(NamedTuple):
    """States of the runs that each block interrupted."""

    slots: Any
    """Run of each block, or -1."""
    marks: Any
    reals: Any
    modes: Any


class DeviceWorkspace(NamedTuple):
    """Work arrays of a block."""

    flows: Any
    turns: Any
    kinematics: Any


@cache
def integrate_kernel(
    order: int, threads: int, columns: int, max_halvings: int, warps: int = RESIDENT_WARPS
) -> Any:
    """The kernel for a composition, a number of threads, of coupled modes (at most) and of halvings."""
    step_functions = functions(order, threads, columns)
    run_constants_of, begin, restore_state, save_state, finish = run_functions(
        step_functions, threads, max_halvings
    )
    advance_one_step, synchronise = step_function(step_functions), step_functions.synchronise
    stride, partial, scratch = stride_of(threads), 4 * PARTS, 2 * threads + columns
    sums = 4 * stride

    def march(
        structure,
        places,
        coupling,
        kernel_input,
        queue_order,
        queue,
        kernel_output,
        work,
        accumulators_of_runs,
        budget,
    ):
        lane, index = cuda.threadIdx.x, cuda.blockIdx.x
        terms = cuda.shared.array(sums, float64)
        parts = cuda.shared.array(partial, float64)
        values = cuda.shared.array(scratch, float64)
        drawn = cuda.shared.array(1, int64)
        i = lane
        while i < max(sums, scratch):
            if i < sums:
                terms[i] = 0.0
            if i < scratch:
                values[i] = 0.0
            i += threads
        column = cuda.local.array(columns, float64)
        for j in range(columns):
            column[j] = coupling[j, lane]
        block = Block(
            lane, terms[lane:], terms[lane % partial // PARTS * stride + lane % PARTS :], parts,
            values[places[0, lane] :], values[places[1, lane] :], column,
            work.flows[index], work.turns[index], work.kinematics[index],
        )  # fmt: skip
        run = kernel_output.slots[index]
        left = budget
        synchronise()
        while left > 0:
            fresh = run < 0
            if fresh:
                if lane == 0:
                    drawn[0] = cuda.atomic.add(queue, 0, 1)
                synchronise()
                place = drawn[0]
                synchronise()
                if place >= queue_order.size:
                    break
                run = queue_order[place]
            accumulators = accumulators_of_runs[run]
            fixed = run_constants_of(block, structure, kernel_input, run, fresh)
            if fresh:
                held = begin(block, fixed, kernel_input, run, accumulators)
            else:
                held = restore_state(block, index, kernel_output, accumulators)
            synchronise()
            while held.status == _RUNNING and left > 0:
                left -= 1
                held = advance_one_step(block, fixed, held, accumulators)
            if held.status == _RUNNING:
                save_state(block, index, kernel_output, accumulators, held)
            else:
                finish(block, fixed, held, accumulators)
                if lane == 0:
                    cuda.atomic.add(queue, 1, 1)
                run = -1
        if lane == 0:
            kernel_output.slots[index] = run

    bounds = {} if SIMULATED else {"launch_bounds": launch_bounds(threads, columns, warps)}
    return cuda.jit(**bounds)(march)


def signature(law: type[ContactLaw], drive: type[Drive]) -> tuple[Any, ...]:
    """Numba's types of the kernel's arguments, for a law of contact and a drive."""
    laws, drives = law.numbers_type(), drive.numbers_type()

    def table(dimensions: int, kind: Any = np.float64) -> Any:
        return np.zeros((1,) * dimensions, dtype=kind)

    kernel_input = DeviceInput(
        np.zeros(1, dtype=RUN), table(2), table(2), table(2), table(3), laws(*[0.0] * len(laws._fields)),
        drives(*[0.0] * len(drives._fields)), 0.0, 0.0, 0, False,
    )  # fmt: skip
    kernel_output = DeviceState(table(1, np.int64), table(2, np.int64), table(2), table(3))
    work = DeviceWorkspace(table(4), table(4), table(3))
    whole = table(1, np.int64)
    arguments = (
        table(2),
        table(2, np.int64),
        table(2),
        kernel_input,
        whole,
        whole,
        kernel_output,
        work,
        empty_accumulators(1),
        0,
    )
    return tuple(typeof(argument) for argument in arguments)
