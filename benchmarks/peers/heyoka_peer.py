"""heyoka: a Taylor integrator compiled for these equations, with the contact located by events.

The force is smooth between the onset and the release, so two integrators take turns: one without the
contact, which stops where the penetration rises through zero, and one with it, which stops where it falls.
A Taylor series of d^(3/2) does not exist at d = 0; the contact is therefore entered and left at a small
penetration.
"""

from __future__ import annotations

from typing import Any

import heyoka as hy
import numpy as np
from numpy.typing import NDArray

from benchmarks.cases import Case
from benchmarks.peers import Method, Solver
from benchmarks.peers.equations import Equations, equations_of

__all__ = ["METHODS"]

_Array = NDArray[np.float64]
_EDGE = 4e-6
"""Penetration at which the contact is switched at a tolerance of one, m; it falls with its root."""


def _dot(weights: _Array, terms: list[Any]) -> Any:
    return hy.sum([float(w) * x for w, x in zip(weights, terms, strict=True) if w != 0.0])


def _system(e: Equations, touching: bool, edge: float) -> tuple[list[Any], Any]:
    count, rate = e.omega.size, float(e.omega[0])
    names = [f"q{i}" for i in range(count)] + [f"v{i}" for i in range(count)]
    variables = list(hy.make_vars(*names))
    q, v = variables[:count], variables[count:]
    r = [_dot(row, q) for row in e.tension]
    gq = _dot(e.g, q)
    qr = hy.sum([a * b for a, b in zip(q, r, strict=True)])
    depth = e.amplitude * hy.sin(e.drive * hy.time) - _dot(e.contact, q)
    stretch = 2.0 * gq + qr
    force = e.stiffness * depth**1.5 if touching else None
    equations = [(x, rate * speed) for x, speed in zip(q, v, strict=True)]
    for i in range(count):
        damping = 2.0 * float(e.damping_ratio[i] * e.omega[i])
        pull = -float(e.omega[i] ** 2) * q[i] - e.gamma * (float(e.g[i]) * qr + stretch * r[i])
        if force is not None:
            pull = pull + float(e.push[i]) * force
        equations.append((v[i], pull * (1.0 / rate) - damping * v[i]))
    return equations, depth - edge


def _prepare(case: Case, tolerance: float) -> Solver:
    e = equations_of(case)
    edge = _EDGE * tolerance**0.5
    count = e.omega.size
    phases = []
    for touching in (False, True):
        equations, gap = _system(e, touching, edge)
        direction = hy.event_direction.negative if touching else hy.event_direction.positive
        event = hy.t_event(gap, direction=direction)
        phases.append(
            hy.taylor_adaptive(equations, np.zeros(2 * count), tol=tolerance, t_events=[event], compact_mode=True)
        )

    def integrate(times: _Array | None, end: float) -> _Array | None:
        values = None if times is None else np.empty((times.size, count))
        state, at, touching, row = np.zeros(2 * count), 0.0, False, 0
        stops = np.array([end]) if times is None else times
        while row < stops.size:
            phase = phases[touching]
            phase.time = at
            phase.state[:] = state
            phase.reset_cooldowns()
            switched = False
            while row < stops.size:
                outcome = phase.propagate_until(float(stops[row]))[0]
                if outcome == hy.taylor_outcome.time_limit:
                    if values is not None:
                        values[row] = phase.state[:count]
                    row += 1
                    continue
                if int(outcome) >= 0 or int(outcome) == -1:
                    switched = True
                    break
                raise RuntimeError(f"heyoka stopped: {outcome}")
            state, at = phase.state.copy(), phase.time
            if switched:
                touching = not touching
        return values

    def sample(times: _Array) -> _Array:
        values = integrate(times, float(times[-1]))
        assert values is not None
        return values @ e.read_out

    def advance(end: float) -> None:
        integrate(None, end)

    return Solver(sample, advance)


def _prepare_many(cases: list[Case], tolerance: float) -> Solver:
    """All cases in the lanes of a batch integrator; each switches its own contact, a parameter, in an event.

    The cases differ in amplitude and frequency of the drive, which are parameters too.  The last batch is filled up
    with its last case.
    """
    every = [equations_of(case) for case in cases]
    e, lanes = every[0], hy.recommended_simd_size()
    edge, count, rate = _EDGE * tolerance**0.5, every[0].omega.size, float(every[0].omega[0])
    variables = list(hy.make_vars(*[f"q{i}" for i in range(count)], *[f"v{i}" for i in range(count)]))
    q, v = variables[:count], variables[count:]
    r = [_dot(row, q) for row in e.tension]
    gq, qr = _dot(e.g, q), hy.sum([a * b for a, b in zip(q, r, strict=True)])
    depth = hy.par[0] * hy.sin(hy.par[1] * hy.time) - _dot(e.contact, q)
    force = hy.par[2] * e.stiffness * (depth * depth + edge * edge) ** 0.75
    equations = [(x, rate * speed) for x, speed in zip(q, v, strict=True)]
    for i in range(count):
        damping = 2.0 * float(e.damping_ratio[i] * e.omega[i])
        pull = -float(e.omega[i] ** 2) * q[i] - e.gamma * (float(e.g[i]) * qr + (2.0 * gq + qr) * r[i])
        pull = pull + float(e.push[i]) * force
        equations.append((v[i], pull * (1.0 / rate) - damping * v[i]))

    def switch(integrator: Any, sign: int, lane: int) -> bool:
        integrator.pars[2, lane] = 1.0 if sign > 0 else 0.0
        return True

    integrator = hy.taylor_adaptive_batch(
        equations, np.zeros((2 * count, lanes)), tol=tolerance, compact_mode=True, pars=np.zeros((3, lanes)),
        t_events=[hy.t_event_batch(1e6 * depth, callback=switch, cooldown=1e-9)],
    )  # fmt: skip
    groups = [np.minimum(np.arange(at, at + lanes), len(cases) - 1) for at in range(0, len(cases), lanes)]

    def begin(group: Any) -> None:
        integrator.set_time(np.zeros(lanes))
        integrator.state[:] = 0.0
        integrator.pars[0], integrator.pars[1] = (
            [getattr(every[i], name) for i in group] for name in ("amplitude", "drive")
        )
        integrator.pars[2] = 1.0  # the tip sets out into the beam
        integrator.reset_cooldowns()

    def sample(times: _Array) -> _Array:
        found = np.empty((len(cases), times.shape[1]))
        for group in groups:
            begin(group)
            for row in range(times.shape[1]):
                integrator.propagate_until(np.ascontiguousarray(times[group, row]))
                found[group, row] = e.read_out @ integrator.state[:count]
        return found

    def advance(ends: _Array) -> None:
        for group in groups:
            begin(group)
            integrator.propagate_until(np.ascontiguousarray(ends[group]))

    return Solver(sample, advance)


METHODS = (
    Method(
        "heyoka Taylor", (1e-5, 1e-6, 1e-7, 1e-8, 1e-11, 1e-14), _prepare,
        f"batch of {hy.recommended_simd_size()}, compact mode", _prepare_many,
    ),
)  # fmt: skip
