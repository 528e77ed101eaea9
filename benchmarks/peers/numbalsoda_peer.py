"""numbalsoda: dop853 (Fortran) and lsoda (C++), compiled throughout."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np
from numbalsoda import dop853, lsoda
from numpy.typing import NDArray

from benchmarks.cases import Case
from benchmarks.peers import Method, Solver
from benchmarks.peers.rhs import compiled_system

__all__ = ["METHODS"]

_Array = NDArray[np.float64]
_MOST_STEPS = 10**8


def _prepare(solver: Any, weight: float, case: Case, tolerance: float) -> Solver:
    system = compiled_system(case, weight)

    def solve(times: _Array) -> _Array:
        states, success = solver(
            system.address,
            system.initial_state,
            times,
            system.memory,
            rtol=tolerance,
            atol=tolerance,
            mxstep=_MOST_STEPS,
        )
        return np.asarray(states) if success else np.full_like(states, np.nan)

    def sample(times: _Array) -> _Array:
        return np.asarray(system.coordinates(solve(times)) @ case.at_contact)

    def advance(end: float) -> None:
        solve(np.array([0.0, end]))

    return Solver(sample, advance)


METHODS = (
    Method("numbalsoda dop853", (1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-10), partial(_prepare, dop853, 10.0)),
    Method("numbalsoda lsoda", (1e-7, 1e-8, 1e-9, 1e-10, 1e-12), partial(_prepare, lsoda, 400.0)),
)
