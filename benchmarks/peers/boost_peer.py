"""Boost.odeint (C++): Dormand-Prince 5, Fehlberg 7(8) and Bulirsch-Stoer, compiled with the machine's own compiler."""

from __future__ import annotations

import ctypes
from functools import partial
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from benchmarks.cases import Case
from benchmarks.peers import Method, Solver
from benchmarks.peers.compiled import library
from benchmarks.peers.rhs import compiled_system

__all__ = ["METHODS"]

_Array = NDArray[np.float64]
_LIBRARY = library(Path(__file__).with_suffix(".cpp"), "-std=c++14")
_LIBRARY.version.restype = ctypes.c_char_p
_VERSION = _LIBRARY.version().decode().replace("_", ".")
_SOLVE = _LIBRARY.solve
_SOLVE.argtypes = [
    ctypes.c_int, ctypes.c_void_p, ctypes.c_void_p, ctypes.c_void_p, ctypes.c_int, ctypes.c_void_p, ctypes.c_int,
    ctypes.c_double, ctypes.c_void_p,
]  # fmt: skip


def _prepare(method: int, weight: float, case: Case, tolerance: float) -> Solver:
    system = compiled_system(case, weight)
    size = system.initial_state.size

    def solve(times: _Array, out: _Array | None) -> bool:
        when = np.ascontiguousarray(times, dtype=np.float64)
        failed = _SOLVE(
            method, system.address, system.memory.ctypes.data, system.initial_state.ctypes.data, size, when.ctypes.data, when.size,
            tolerance, None if out is None else out.ctypes.data,
        )  # fmt: skip
        return not failed

    def sample(times: _Array) -> _Array:
        states = np.empty((times.size, size))
        if not solve(times, states):
            states[:] = np.nan
        return np.asarray(system.coordinates(states) @ case.at_contact)

    def advance(end: float) -> None:
        solve(np.array([0.0, end]), None)

    return Solver(sample, advance)


_LEVELS = (1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-10)
METHODS = tuple(
    Method(f"Boost.odeint {name}", _LEVELS, partial(_prepare, number, 10.0), f"Boost {_VERSION}, -O3 -march=native")
    for number, name in enumerate(("dopri5", "fehlberg78", "Bulirsch-Stoer"))
)
