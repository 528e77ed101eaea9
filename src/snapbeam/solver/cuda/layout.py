"""Memory layout of a structure and of the kernel input on a CUDA device."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numba import config, cuda
from numpy.typing import NDArray
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components

from snapbeam.solver.ensemble import Ensemble

SIMULATED = bool(config.ENABLE_CUDASIM)
"""True if the Numba simulator replaces a device."""
PARTS = 4
"""Partial sums that every thread adds up for itself at the end of a sum over the block."""


_Array = NDArray[np.float64]
_Integers = NDArray[np.int64]

MOST_MODES = 128
"""Modes, and threads of a block, that the kernel is built for."""
WARP = 32
FEWEST_THREADS = 16
"""Minimum threads of a block on a device, because fewer leave lanes of the warp idle."""
STRUCTURE = ("omega", "omega_squared", "omega_damped", "damping", "g", "center", "shift", "high")
"""Rows of the structure."""
MARKS = 6
"""Integers, and"""
KEPT = 9
"""floats that a run laid down keeps beside its record of accumulators."""

RESIDENT_WARPS = 12
"""Warps of a multiprocessor that the kernel's use of registers leaves room for: 168 registers a thread, with
which nothing is spilled in the innermost loop."""
# Beyond so many coupled modes, a mode's column of G takes what registers there are.
_REGISTER_COLUMNS = 16


def launch_bounds(threads: int, columns: int, warps: int = RESIDENT_WARPS) -> tuple[int, int]:
    """Threads of a block, and how many blocks a multiprocessor is to hold, which limits the registers of a thread."""
    if columns > _REGISTER_COLUMNS:
        return threads, 1
    return threads, max(1, warps * WARP // max(threads, WARP))


class DeviceStructure(NamedTuple):
    """A structure as the kernel reads it: modes side by side, padded to the threads of a block."""

    threads: int
    """Threads of a block: a power of two, on a device 16 at least."""
    columns: int
    """Modes that one mode is coupled to, at most, a power of two."""
    order: _Integers
    """Mode that each thread takes, shape (modes,): coupled modes stand together."""
    values: _Array
    """The rows named in :data:`STRUCTURE`, shape (8, threads)."""
    coupling: _Array
    """Column j: G's entries between mode j and the modes coupled to it, shape (columns, threads)."""
    places: _Integers
    """Location of each mode in shared memory, and first mode coupled to it, shape (2, threads)."""

    def across(self, values: _Array) -> _Array:
        """Numbers of modes, shape (..., N), as threads hold them, shape (..., threads)."""
        out = np.zeros((*values.shape[:-1], self.threads))
        out[..., : self.order.size] = values[..., self.order]
        return out

    def back(self, values: _Array) -> _Array:
        """Convert values of threads, shape (..., threads), to values of modes, shape (..., N)."""
        out = np.empty((*values.shape[:-1], self.order.size))
        out[..., self.order] = values[..., : self.order.size]
        return out


def _power_of_two(number: int) -> int:
    return 1 << max(0, number - 1).bit_length()


def device_structure(ensemble: Ensemble, fewest_threads: int = FEWEST_THREADS) -> DeviceStructure:
    """Arrange the structure of an ensemble for the device.

    Coupled modes stand together; sets of them begin in different banks of the shared memory.
    """
    structure = ensemble.structure
    _, label = connected_components(csr_array(structure.coupling != 0.0), directed=False)
    order = np.argsort(label, kind="stable")
    block = label[order]
    begins, count = np.unique(block, return_index=True, return_counts=True)[1:]
    first, size = begins[block], count[block]
    modes = order.size
    threads = max(fewest_threads, _power_of_two(modes))
    columns = max(4, _power_of_two(int(count.max())))
    coupling = np.zeros((columns, threads))
    full = structure.coupling[np.ix_(order, order)]
    for j in range(modes):
        coupling[: size[j], j] = full[first[j] : first[j] + size[j], j]
    places = np.zeros((2, threads), dtype=np.int64)
    places[0] = np.arange(threads) + block[-1]
    places[0, :modes] = np.arange(modes) + block
    places[1, :modes] = first + block
    arranged = DeviceStructure(threads, columns, order, np.empty(0), coupling, places)
    omega, zeta = structure.omega, structure.damping_ratio
    rows = {
        "omega": omega,
        "omega_squared": omega * omega,
        "omega_damped": omega * np.sqrt(1.0 - zeta * zeta),
        "damping": zeta * omega,
        "g": structure.well,
        "center": structure.center,
        "shift": structure.shift,
        "high": (omega > ensemble.high_omega).astype(np.float64),
    }
    values = arranged.across(np.array([rows[name] for name in STRUCTURE]))
    values[STRUCTURE.index("omega_damped"), modes:] = 1.0
    return arranged._replace(values=values)


# A block of threads that integrates one trajectory: what it shares, its barrier and its sums.
#
# A sum has one order, fixed by the number of threads, and every thread reads the same bits back.


def device(function: Callable[..., Any]) -> Any:
    """Compile for the device, always within the caller: arrays held in registers cannot cross a call."""
    options: dict[str, Any] = {} if SIMULATED else {"forceinline": True}
    return cuda.jit(device=True, **options)(function)


def shared(function: Any) -> Any:
    """A function that the CPU engine compiled, for use on the device, where it is compiled again.

    The simulator's arrays are none that compiled code takes: there the function runs as plain Python.
    """
    return function.py_func if SIMULATED else function


def stride_of(threads: int) -> int:
    """Length of a row of terms to be summed; rows begin in different banks of the shared memory."""
    return max(threads, PARTS) + PARTS


class Block(NamedTuple):
    """Data shared by the threads of a block, and the location of each thread in it."""

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
    """Column of G of this mode, over the modes coupled to it; in registers."""
    flows: Any
    """Flows of all modes over the parts of each length of step, shape (flows, 4, threads)."""
    turns: Any
    """Sine and cosine of the drive's turn at each kick, for each length of step, shape (slots, 2, TURNS)."""
    kinematics: Any
    """Samples inside a step, shape (subintervals + 1, 4)."""


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
