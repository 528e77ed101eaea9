"""SUNDIALS' CVODE (Adams and BDF) through scikit-sundae, with its root finding; right-hand side compiled by Numba."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from sksundae.cvode import CVODE

from impact20 import Array, Case
from impact20.runners import CannotRun, Result, has_restitution, tolerances
from impact20.runners.compiled import indicators, rhs
from impact20.runners.flat import initial_state, pack, set_states
from impact20.runners.hybrid import Segment, drive, outputs, through

PACKAGE = "scikit-sundae"


def settings(case: Case) -> list[dict[str, Any]]:
    """Adams with events and through the contacts; BDF for the structures with many modes."""
    found = tolerances(case, "Adams", (1e-6, 1e-8, 1e-10, 1e-12), events=True)
    if not has_restitution(case):
        found += tolerances(case, "Adams", (1e-6, 1e-8, 1e-10, 1e-12), events=False)
        if 8 <= len(case.stiffness) < 100:
            found += tolerances(case, "BDF", (1e-6, 1e-8), events=False)
    return found


def prepare(case: Case, setting: dict[str, Any]) -> Callable[[], Result]:
    """A solve of the case."""
    p, n, count = pack(case), len(case.stiffness), len(case.tips)
    calls = [0]
    longest = 1.0 / max([case.frequency, *[tip.frequency for tip in case.tips], 0.5])

    def slope(t: float, y: Array, yp: Array) -> None:
        calls[0] += 1
        rhs(t, y, yp, p)

    def events(t: float, y: Array, out: Array) -> None:
        indicators(t, y, out, p)

    events.terminal, events.direction = [True] * count, [-1] * count  # type: ignore[attr-defined]
    options: dict[str, Any] = {
        "method": setting["method"], "rtol": setting["tolerance"], "atol": setting["tolerance"] * 1e-1,
        "max_num_steps": 10**7,
    }  # fmt: skip
    if not setting["events"]:
        smooth = CVODE(slope, **options)

        def solve() -> Result:
            calls[0] = 0
            set_states(case, p, through(case, ""), case.pulse is not None)
            run = smooth.solve(np.concatenate(([0.0], case.times)), initial_state(case))
            if len(run.t) < case.samples + 1:
                raise CannotRun(str(run.message))
            return Result(outputs(case, run.y[1:]), None, calls[0], run.y[-1])

        return solve
    watching = CVODE(slope, eventsfn=events, num_events=count, max_step=longest, **options)

    def segment(states: tuple[int, ...], pulse: bool, t: float, u: Array, end: float, times: Array) -> Segment:
        set_states(case, p, states, pulse)
        before = calls[0]
        asked = times[times > t]
        at_once = [case.output @ u[:n]] * (times.size - asked.size)
        stops = np.concatenate(([t], asked, [] if asked.size and asked[-1] == end else [end]))
        run = watching.solve(stops, u)
        # the events of earlier solves are kept
        ended = run.t_events is not None and len(run.t_events) > 0 and run.t_events[-1] > t
        at = float(run.t_events[-1] if ended else run.t[-1])
        state = np.array(run.y_events[-1] if ended else run.y[-1])
        kept = [case.output @ y[:n] for when, y in zip(run.t, run.y, strict=True) if when in set(asked)]
        hit = -1
        if ended:
            hit = int(np.flatnonzero(np.asarray(run.i_events[-1]) != 0)[0])
        return Segment(at, state, np.array([*at_once, *kept]), hit, calls[0] - before)

    return lambda: drive(case, segment)
