"""scipy.integrate with a compiled right-hand side; the stepping is Python's."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray
from scipy.integrate import odeint, solve_ivp

from benchmarks.cases import Case
from benchmarks.peers import Method, Solver
from benchmarks.peers.rhs import compiled_system

__all__ = ["METHODS"]

_Array = NDArray[np.float64]


def _prepare(solver: str, weight: float, case: Case, tolerance: float) -> Solver:
    system = compiled_system(case, weight)
    function = system.function

    @njit(error_model="numpy")
    def slope(t: float, u: _Array, memory: _Array) -> _Array:
        du = np.empty(u.size)
        function(t, u.ctypes, du.ctypes, memory.ctypes)
        return du

    options: dict[str, Any] = {"rtol": tolerance, "atol": tolerance, "args": (system.memory,)}

    def solve(times: _Array) -> _Array:
        if solver == "odeint":
            with np.errstate(all="ignore"):
                return np.asarray(
                    odeint(
                        slope,
                        system.initial_state,
                        times,
                        (system.memory,),
                        rtol=tolerance,
                        atol=tolerance,
                        tfirst=True,
                        mxstep=10**8,
                    )
                )
        result = solve_ivp(slope, (0.0, times[-1]), system.initial_state, solver, t_eval=times, **options)
        return np.asarray(result.y.T)

    def sample(times: _Array) -> _Array:
        return np.asarray(system.coordinates(solve(times)) @ case.at_contact)

    def advance(end: float) -> None:
        solve(np.array([0.0, end]))

    return Solver(sample, advance)


METHODS = (
    Method("scipy DOP853", (1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-10), partial(_prepare, "DOP853", 10.0)),
    Method("scipy LSODA", (1e-7, 1e-8, 1e-9, 1e-10, 1e-12), partial(_prepare, "LSODA", 400.0)),
    Method("scipy odeint", (1e-7, 1e-8, 1e-9, 1e-10, 1e-12), partial(_prepare, "odeint", 400.0)),
)
