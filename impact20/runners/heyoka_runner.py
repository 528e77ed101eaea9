"""heyoka: Taylor series compiled for the equations of each state of the contacts, with terminal events.

A series of d^(3/2) does not exist at d = 0: such contacts begin and end at a small penetration, which falls with the
root of the tolerance.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import heyoka as hy
import numpy as np

from impact20 import Array, Case
from impact20.runners import CannotRun, Result, tolerances
from impact20.runners.hybrid import Segment, drive

PACKAGE = "heyoka"


def settings(case: Case) -> list[dict[str, Any]]:
    """Taylor's method over tolerances."""
    return tolerances(case, "Taylor", (1e-6, 1e-9, 1e-12, 1e-15))


def _dot(weights: Array, terms: list[Any]) -> Any:
    return hy.sum([float(w) * x for w, x in zip(weights, terms, strict=True) if w != 0.0] or [hy.expression(0.0)])


def prepare(case: Case, setting: dict[str, Any]) -> Callable[[], Result]:
    """A solve of the case; integrators are compiled when their state of contact first comes up."""
    n, tolerance = len(case.stiffness), setting["tolerance"]
    singular = any(tip.law in ("power", "hunt_crossley") and tip.exponent % 1 for tip in case.tips)
    # Force left out at the edge: stiffness edge^1.5.
    edge = 1e-2 * case.scale * (tolerance / max(tip.stiffness for tip in case.tips)) ** 0.5 if singular else 0.0
    x, v = ([hy.make_vars(f"{name}{i}") for i in range(n)] for name in "xv")
    z = hy.make_vars("z")
    made: dict[tuple[tuple[int, ...], bool], Any] = {}

    def build(states: tuple[int, ...], pulse: bool) -> Any:
        accelerations = [-float(case.stiffness[i]) * x[i] - float(case.damping[i]) * v[i] for i in range(n)]

        def add(vector: Array | None, factor: Any) -> None:
            if vector is not None:
                for i in np.flatnonzero(vector):
                    accelerations[i] = accelerations[i] + float(vector[i]) * factor

        if case.coupling is not None:
            r = [_dot(row, x) for row in case.coupling]
            along = hy.sum([a * b for a, b in zip(x, r, strict=True)])
            gx = _dot(case.gradient, x) if case.gradient is not None else 0.0
            for i in range(n):
                pull = (2.0 * gx + along) * r[i]
                if case.gradient is not None:
                    pull = pull + float(case.gradient[i]) * along
                accelerations[i] = accelerations[i] - case.gamma * pull
        add(case.load, hy.expression(1.0))
        add(case.harmonic, hy.sin(case.frequency * hy.time + case.phase))
        if pulse:
            add(case.pulse, hy.sin((np.pi / case.pulse_duration) * hy.time))
        if case.truss is not None:
            accelerations[0] = accelerations[0] - case.truss[0] * x[0] * (
                1.0 - case.truss[1] * (1.0 + x[0] ** 2) ** -0.5
            )
        if case.circuit is not None:
            accelerations[0] = accelerations[0] - case.circuit[0] * z
        events = []
        for state, tip in zip(states, case.tips, strict=True):
            d = -1.0 * _dot(tip.row, x) - tip.gap
            rate = -1.0 * _dot(tip.row, v)
            if tip.amplitude:
                angle = tip.frequency * hy.time + tip.phase
                d = d + tip.amplitude * hy.sin(angle)
                rate = rate + tip.amplitude * tip.frequency * hy.cos(angle)
            ends = edge - d
            if state == 3:
                ends = d + 0.0
            elif state:
                if tip.law == "kelvin_voigt":
                    f = tip.stiffness * d + tip.damping * rate
                    ends = f
                else:
                    f = tip.stiffness * d**tip.exponent
                    ends = d - edge
                    if tip.factor:
                        f = f * (1.0 + tip.factor * rate)
                add(tip.row, f)
            events.append(hy.t_event(ends, direction=hy.event_direction.negative))
        equations = [(a, b + 0.0) for a, b in zip(x, v, strict=True)] + list(zip(v, accelerations, strict=True))
        if case.circuit is not None:
            equations.append((z, case.circuit[0] * v[0] - case.circuit[1] * z))
        return hy.taylor_adaptive(
            equations, np.zeros(len(equations)), tol=tolerance, t_events=events, compact_mode=n > 4
        )

    def segment(states: tuple[int, ...], pulse: bool, t: float, u: Array, end: float, times: Array) -> Segment:
        if (states, pulse) not in made:
            made[states, pulse] = build(states, pulse)
        integrator = made[states, pulse]
        integrator.time = t
        integrator.state[:] = u
        integrator.reset_cooldowns()
        passed: list[float] = []
        for stop in [*times, end]:
            outcome = integrator.propagate_until(float(stop))[0]
            if outcome != hy.taylor_outcome.time_limit:
                hit = -int(outcome) - 1
                if not 0 <= hit < len(case.tips):
                    raise CannotRun(f"stopped: {outcome}")
                return Segment(integrator.time, integrator.state.copy(), np.array(passed), hit, 0)
            if len(passed) < times.size:
                passed.append(float(case.output @ integrator.state[:n]))
        return Segment(integrator.time, integrator.state.copy(), np.array(passed), -1, 0)

    return lambda: drive(case, segment, edge)
