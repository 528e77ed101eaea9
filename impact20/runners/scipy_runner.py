"""SciPy's solve_ivp, with events or through the contacts; right-hand side compiled by Numba."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp

from impact20 import Array, Case
from impact20.runners import Result, has_restitution, tolerances
from impact20.runners.compiled import indicators, rhs
from impact20.runners.flat import initial_state, pack, set_states
from impact20.runners.hybrid import Segment, drive, outputs, through

PACKAGE = "scipy"


def settings(case: Case) -> list[dict[str, Any]]:
    """DOP853 and LSODA with events; DOP853 and RK45 through the contacts."""
    found = tolerances(case, "DOP853", (1e-5, 1e-7, 1e-9, 1e-11, 1e-13), events=True)
    found += tolerances(case, "LSODA", (1e-6, 1e-8, 1e-10, 1e-12), events=True)
    if not has_restitution(case):
        found += tolerances(case, "DOP853", (1e-5, 1e-7, 1e-9, 1e-11), events=False)
        found += tolerances(case, "RK45", (1e-5, 1e-7, 1e-9), events=False)
    return found


def prepare(case: Case, setting: dict[str, Any]) -> Callable[[], Result]:
    """A solve of the case."""
    p, n = pack(case), len(case.stiffness)
    options = {"method": setting["method"], "rtol": setting["tolerance"], "atol": setting["tolerance"] * 1e-1}

    def slope(t: float, u: Array) -> Array:
        du = np.empty_like(u)
        rhs(t, u, du, p)
        return du

    if not setting["events"]:

        def solve() -> Result:
            set_states(case, p, through(case, ""), case.pulse is not None)
            run = solve_ivp(slope, (0.0, case.horizon), initial_state(case), t_eval=case.times, **options)
            return Result(outputs(case, run.y.T), None, run.nfev, run.y[:, -1])

        return solve

    found = np.empty(len(case.tips))
    watching = []
    for j in range(len(case.tips)):

        def event(t: float, u: Array, j: int = j) -> float:
            indicators(t, u, found, p)
            return float(found[j])

        event.terminal, event.direction = True, -1  # type: ignore[attr-defined]
        watching.append(event)
    # A step is no longer than a sixth of the drive's radian, or events in pairs are jumped over.
    longest = 1.0 / max([case.frequency, *[tip.frequency for tip in case.tips], 0.5])

    def segment(states: tuple[int, ...], pulse: bool, t: float, u: Array, end: float, times: Array) -> Segment:
        set_states(case, p, states, pulse)
        run = solve_ivp(slope, (t, end), u, events=watching, dense_output=times.size > 0, max_step=longest, **options)
        reached = times[times <= run.t[-1]]
        passed = case.output @ run.sol(reached)[:n] if reached.size else np.empty(0)
        hit = [j for j in range(len(watching)) if run.status == 1 and len(run.t_events[j])]
        return Segment(float(run.t[-1]), run.y[:, -1], passed, hit[0] if hit else -1, run.nfev)

    return lambda: drive(case, segment)
