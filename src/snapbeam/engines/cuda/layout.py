"""How a structure, and what a kernel is given, lie on a CUDA device."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numba import float64, int64
from numpy.typing import NDArray

from snapbeam.engines.ensemble import Ensemble

__all__ = [
    "FEWEST_THREADS",
    "KEPT",
    "MARKS",
    "MOST_MODES",
    "RESIDENT_WARPS",
    "STRUCTURE",
    "WARP",
    "DeviceStructure",
    "device_structure",
    "launch_bounds",
    "signature",
]

_Array = NDArray[np.float64]
_Integers = NDArray[np.int64]

MOST_MODES = 128
"""Modes, and threads of a block, that the kernel is built for."""
WARP = 32
FEWEST_THREADS = 16
"""Of a block on a device, where fewer would leave lanes of the warp idle all the same."""
STRUCTURE = ("omega", "omega_squared", "omega_damped", "damping", "g", "center", "shift")
"""Rows of the structure, by their names in :class:`snapbeam.engines.cpu.rows.Layout`."""
MARKS = 4
"""Integers, and"""
KEPT = 8
"""floats that a run laid down keeps beside its counts and numbers."""

RESIDENT_WARPS = 12
"""Warps of a multiprocessor that the kernel's use of registers leaves room for: 168 registers a thread, with
which nothing is spilled in the innermost loop."""
# Beyond so many coupled modes, a mode's column of G takes what registers there are.
_REGISTER_COLUMNS = 16


def signature() -> tuple[Any, ...]:
    """Numba's types of the kernel's arguments."""
    row, table = int64[::1], int64[:, ::1]
    reals2, reals3, reals4 = float64[:, ::1], float64[:, :, ::1], float64[:, :, :, ::1]
    return (
        reals2, table, reals2, float64, float64, reals2, reals3, reals2, table, row, row,
        row, table, reals2, reals3, reals4, reals4, reals3, table, reals2,
        int64, int64, int64, int64,
    )  # fmt: skip


def launch_bounds(threads: int, columns: int, warps: int = RESIDENT_WARPS) -> tuple[int, int]:
    """Threads of a block, and how many blocks a multiprocessor is to hold, which the registers are cut for."""
    if columns > _REGISTER_COLUMNS:
        return threads, 1
    return threads, max(1, warps * WARP // max(threads, WARP))


class DeviceStructure(NamedTuple):
    """A structure as the kernel reads it: modes side by side, padded to the threads of a block."""

    threads: int
    """Threads of a block: a power of two, on a device 16 at least."""
    columns: int
    """Modes that one mode is coupled to, at most, a power of two."""
    rows: _Integers
    """Row of :class:`snapbeam.engines.cpu.memory.Packed` that each thread takes, shape (modes,)."""
    values: _Array
    """The rows named in :data:`snapbeam.engines.cuda.march.STRUCTURE`, shape (7, threads)."""
    coupling: _Array
    """Column j: G's entries between mode j and the modes coupled to it, shape (columns, threads)."""
    places: _Integers
    """Where each mode stands in shared memory, and the first that it is coupled to, shape (2, threads)."""

    def across(self, rows: _Array) -> _Array:
        """Padded rows of shape (..., rows) as threads hold them, shape (..., threads)."""
        out = np.zeros((*rows.shape[:-1], self.threads))
        out[..., : self.rows.size] = rows[..., self.rows]
        return out


def _power_of_two(number: int) -> int:
    return 1 << max(0, number - 1).bit_length()


def device_structure(ensemble: Ensemble, fewest_threads: int = FEWEST_THREADS) -> DeviceStructure:
    """Arrange the structure of an ensemble for the device.

    Coupled modes stand together; sets of them begin in different banks of the shared memory.
    """
    packed = ensemble.packed
    order = np.argsort(packed.rows)
    rows = packed.rows[order]
    block = np.searchsorted(packed.blocks[::3], rows, side="right") - 1
    begins, count = np.unique(block, return_index=True, return_counts=True)[1:]
    first, size = begins[block], count[block]
    threads = max(fewest_threads, _power_of_two(rows.size))
    columns = max(4, _power_of_two(int(count.max())))
    coupling = np.zeros((columns, threads))
    full = packed.model.tension_matrix[np.ix_(order, order)]
    for j in range(rows.size):
        coupling[: size[j], j] = full[first[j] : first[j] + size[j], j]
    places = np.zeros((2, threads), dtype=np.int64)
    places[0] = np.arange(threads) + block[-1]
    places[0, : rows.size] = np.arange(rows.size) + block
    places[1, : rows.size] = first + block
    structure = DeviceStructure(threads, columns, rows, np.empty(0), coupling, places)
    layout, memory = packed.layout, packed.memory
    starts = [getattr(layout, name) for name in STRUCTURE]
    values = structure.across(np.array([memory[at : at + layout.size] for at in starts]))
    values[STRUCTURE.index("omega_damped"), rows.size :] = 1.0
    return structure._replace(values=values)
