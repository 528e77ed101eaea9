"""A block of threads that marches one trajectory: what it shares, its barrier and its sums.

A sum has one order, fixed by the number of threads, and every thread reads the same bits back.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

from numba import config, cuda

from snapbeam.engines.cuda.layout import WARP

__all__ = ["PARTS", "SIMULATED", "Block", "device", "shared", "stride_of", "sums", "synchroniser"]

SIMULATED = bool(config.ENABLE_CUDASIM)
"""Whether Numba's simulator stands in for a device."""
PARTS = 4
"""Partial sums that every thread adds up for itself at the end of a sum over the block."""


def device(function: Callable[..., Any]) -> Any:
    """Compile for the device, always within the caller: arrays held in registers cannot cross a call."""
    options: dict[str, Any] = {} if SIMULATED else {"forceinline": True}
    return cuda.jit(device=True, **options)(function)


def shared(function: Any) -> Any:
    """A function that the CPU engine compiled, for use on the device, where it is compiled anew.

    The simulator's arrays are none that compiled code takes: there the function runs as plain Python.
    """
    return function.py_func if SIMULATED else function


def stride_of(threads: int) -> int:
    """Length of a row of terms to be summed; rows begin in different banks of the shared memory."""
    return max(threads, PARTS) + PARTS


class Block(NamedTuple):
    """What the threads of a block have in common, and each one's place in it."""

    lane: int
    terms: Any
    """Shared, from this thread's place on: four rows of numbers to be summed, :func:`stride_of` apart."""
    portion: Any
    """Shared: the terms of the partial sum that falls to this thread, PARTS apart."""
    parts: Any
    """Shared: the partial sums."""
    values: Any
    """Shared, from this thread's place on: q of its mode."""
    near: Any
    """Shared: q of the modes that the tension couples to this one."""
    coupling: Any
    """This mode's column of G, over the modes it is coupled to; in registers."""
    flows: Any
    """Flows of all modes over the parts of each length of step, shape (flows, 4, threads)."""
    turns: Any
    """Sine and cosine of the drive's turn at each kick, for each length of step, shape (slots, 2, TURNS)."""
    seen: Any
    """What a look inside a step saw, shape (pieces + 1, 4)."""


def synchroniser(threads: int) -> Any:
    """A barrier for the block: cheaper where the block is a part of one warp."""
    if SIMULATED or threads > WARP:

        @device
        def synchronise():
            cuda.syncthreads()
    else:
        members = (1 << threads) - 1

        @device
        def synchronise():
            cuda.syncwarp(members)

    return synchronise


def _gather(threads: int, synchronise: Any) -> Any:
    """From terms to partial sums, *count* numbers a thread."""
    stride, span = stride_of(threads), max(threads, PARTS)
    if threads >= 4 * PARTS:

        @device
        def gather(block, count):
            synchronise()
            if block.lane < PARTS * count:
                total = block.portion[0]
                for row in range(PARTS, span, PARTS):
                    total += block.portion[row]
                block.parts[block.lane] = total
            synchronise()
    else:

        @device
        def gather(block, count):
            synchronise()
            for i in range(block.lane, PARTS * count, threads):
                at = (i // PARTS) * stride + i % PARTS - block.lane
                total = block.terms[at]
                for row in range(PARTS, span, PARTS):
                    total += block.terms[at + row]
                block.parts[i] = total
            synchronise()

    return gather


def sums(threads: int, synchronise: Any) -> tuple[Any, Any, Any, Any]:
    """Sums over the block of one, two, three and four numbers a thread."""
    stride = stride_of(threads)
    gather = _gather(threads, synchronise)

    @device
    def total(block, which):
        at = which * PARTS
        return (block.parts[at] + block.parts[at + 1]) + (block.parts[at + 2] + block.parts[at + 3])

    @device
    def sum_one(block, a):
        block.terms[0] = a
        gather(block, 1)
        return total(block, 0)

    @device
    def sum_two(block, a, b):
        block.terms[0] = a
        block.terms[stride] = b
        gather(block, 2)
        return total(block, 0), total(block, 1)

    @device
    def sum_three(block, a, b, c):
        block.terms[0] = a
        block.terms[stride] = b
        block.terms[2 * stride] = c
        gather(block, 3)
        return total(block, 0), total(block, 1), total(block, 2)

    @device
    def sum_four(block, a, b, c, d):
        block.terms[0] = a
        block.terms[stride] = b
        block.terms[2 * stride] = c
        block.terms[3 * stride] = d
        gather(block, 4)
        return total(block, 0), total(block, 1), total(block, 2), total(block, 3)

    return sum_one, sum_two, sum_three, sum_four
