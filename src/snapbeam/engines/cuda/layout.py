"""How a structure, and what a kernel is given, lie on a CUDA device."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components

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
]

_Array = NDArray[np.float64]
_Integers = NDArray[np.int64]

MOST_MODES = 128
"""Modes, and threads of a block, that the kernel is built for."""
WARP = 32
FEWEST_THREADS = 16
"""Of a block on a device, where fewer would leave lanes of the warp idle all the same."""
STRUCTURE = ("omega", "omega_squared", "omega_damped", "damping", "g", "center", "shift", "high")
"""Rows of the structure."""
MARKS = 6
"""Integers, and"""
KEPT = 9
"""floats that a run laid down keeps beside its book."""

RESIDENT_WARPS = 12
"""Warps of a multiprocessor that the kernel's use of registers leaves room for: 168 registers a thread, with
which nothing is spilled in the innermost loop."""
# Beyond so many coupled modes, a mode's column of G takes what registers there are.
_REGISTER_COLUMNS = 16


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
    order: _Integers
    """Mode that each thread takes, shape (modes,): coupled modes stand together."""
    values: _Array
    """The rows named in :data:`STRUCTURE`, shape (8, threads)."""
    coupling: _Array
    """Column j: G's entries between mode j and the modes coupled to it, shape (columns, threads)."""
    places: _Integers
    """Where each mode stands in shared memory, and the first that it is coupled to, shape (2, threads)."""

    def across(self, values: _Array) -> _Array:
        """Numbers of modes, shape (..., N), as threads hold them, shape (..., threads)."""
        out = np.zeros((*values.shape[:-1], self.threads))
        out[..., : self.order.size] = values[..., self.order]
        return out

    def back(self, values: _Array) -> _Array:
        """What threads hold, shape (..., threads), as numbers of modes, shape (..., N)."""
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
