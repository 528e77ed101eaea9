"""numbalsoda's dop853 and lsoda: compiled throughout, without events."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numba import carray, cfunc
from numbalsoda import dop853, lsoda, lsoda_sig

from impact20 import Case
from impact20.runners import CannotRun, Result, tolerances
from impact20.runners.compiled import rhs
from impact20.runners.flat import initial_state, pack, set_states
from impact20.runners.hybrid import outputs, through

PACKAGE = "numbalsoda"
_ADDRESSES: dict[tuple[int, int], Any] = {}


def settings(case: Case) -> list[dict[str, Any]]:
    """Both methods over tolerances."""
    return [
        *tolerances(case, "dop853", (1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9, 1e-11, 1e-13)),
        *tolerances(case, "lsoda", (1e-6, 1e-8, 1e-10, 1e-12)),
    ]


def _function(size: int, length: int) -> Any:
    """Compile the right-hand side for arrays of these sizes, once."""
    if (size, length) not in _ADDRESSES:

        @cfunc(lsoda_sig)
        def slope(t, u, du, data):  # type: ignore[no-untyped-def]
            rhs(t, carray(u, (size,)), carray(du, (size,)), carray(data, (length,)))

        _ADDRESSES[size, length] = slope
    return _ADDRESSES[size, length]


def prepare(case: Case, setting: dict[str, Any]) -> Callable[[], Result]:
    """A solve of the case."""
    p, start = pack(case), initial_state(case)
    set_states(case, p, through(case, "no event location: a jump of the velocity cannot be done"), True)
    function = _function(start.size, p.size)
    method = {"dop853": dop853, "lsoda": lsoda}[setting["method"]]
    times = np.concatenate(([0.0], case.times))

    def solve() -> Result:
        states, success = method(
            function.address, start, times, p, rtol=setting["tolerance"], atol=setting["tolerance"] * 1e-1, mxstep=10**8
        )
        if not success:
            raise CannotRun("the integration failed")
        return Result(outputs(case, states[1:]), None, None, states[-1])

    return solve
