"""Second reference: SciPy's DOP853 in double precision, with its own located events and a restart at each."""

from collections.abc import Callable
from math import cos, pi, sin
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from impact20 import Array, Case


def _acceleration(case: Case, t: float, x: Array, v: Array, z: float) -> Array:
    """Everything but the contacts."""
    total = (case.load if case.load is not None else 0.0) - case.stiffness * x - case.damping * v
    if case.coupling is not None:
        gx = case.coupling.dot(x)
        if case.gradient is None:
            total = total - case.gamma * x.dot(gx) * gx
        else:
            q = x.dot(gx)
            total = total - case.gamma * (q * case.gradient + (2 * case.gradient.dot(x) + q) * gx)
    if case.harmonic is not None:
        total = total + sin(case.frequency * t + case.phase) * case.harmonic
    if case.truss is not None:
        total = total - case.truss[0] * (x - case.truss[1] * x / np.sqrt(1 + x**2))
    if case.circuit is not None:
        total = total - case.circuit[0] * z
    return np.asarray(total)


def solve(case: Case, rtol: float = 1e-13, atol: float = 1e-15) -> tuple[Array, int, float]:
    """Output values, number of impacts and time of the last one."""
    n = len(case.stiffness)
    tips = case.tips

    def penetration(j: int, t: float, u: Array) -> tuple[float, float]:
        tip = tips[j]
        angle = tip.frequency * t + tip.phase
        d = tip.amplitude * sin(angle) - tip.gap - tip.row.dot(u[:n])
        return d, tip.amplitude * tip.frequency * cos(angle) - tip.row.dot(u[n : 2 * n])

    def force(j: int, t: float, u: Array) -> float:
        tip = tips[j]
        d, rate = penetration(j, t, u)
        if tip.law == "kelvin_voigt":
            return tip.stiffness * d + tip.damping * rate
        return tip.stiffness * max(d, 0.0) ** tip.exponent * (1 + tip.factor * rate)

    def right(touching: frozenset[int], pulse: bool) -> Callable[[float, Array], Array]:
        def slope(t: float, u: Array) -> Array:
            out = np.empty_like(u)
            out[:n] = u[n : 2 * n]
            a = _acceleration(case, t, u[:n], u[n : 2 * n], u[-1])
            if pulse and case.pulse is not None:
                a = a + sin(pi * t / case.pulse_duration) * case.pulse
            for j in touching:
                a = a + force(j, t, u) * tips[j].row
            out[n : 2 * n] = a
            if case.circuit is not None:
                out[-1] = case.circuit[0] * u[n] - case.circuit[1] * u[-1]
            return out

        return slope

    def event_of(j: int, touching: bool) -> Any:
        def onset(t: float, u: Array) -> float:
            return float(penetration(j, t, u)[0])

        def release(t: float, u: Array) -> float:
            return float(force(j, t, u) if tips[j].law == "kelvin_voigt" else penetration(j, t, u)[0])

        event: Any = release if touching else onset
        event.terminal, event.direction = True, -1 if touching else 1
        return event

    u = np.concatenate((case.start, case.speed, [0.0] if case.circuit else []))
    t, touching, at, values = 0.0, set(), 0, np.zeros(case.samples)
    for j, tip in enumerate(tips):
        d, rate = penetration(j, 0.0, u)
        if tip.law != "restitution" and (d > 0 or (d == 0 and rate > 0)):
            touching.add(j)
    impacts, last = len(touching), 0.0
    times = case.times
    # A step no longer than this cannot jump over a pair of events that the periods of drive and first mode allow.
    quick = max([case.frequency, *[tip.frequency for tip in tips], 1.0])
    while at < case.samples:
        pulse = case.pulse is not None and t < case.pulse_duration
        end = min(times[-1], case.pulse_duration) if pulse else times[-1]
        run = solve_ivp(
            right(frozenset(touching), pulse), (t, end), u, method="DOP853", rtol=rtol, atol=atol,
            events=[event_of(j, j in touching) for j in range(len(tips))], dense_output=True, max_step=0.25 / quick,
        )  # fmt: skip
        if run.status < 0:
            raise RuntimeError(run.message)
        t = float(run.t[-1])
        while at < case.samples and times[at] <= t:
            values[at] = case.output.dot(run.sol(times[at])[:n])
            at += 1
        u = run.y[:, -1].copy()
        if run.status == 0:
            if not pulse:
                break
            continue
        for j in range(len(tips)):
            if not len(run.t_events[j]):
                continue
            tip = tips[j]
            if j in touching:
                touching.remove(j)
                continue
            impacts, last = impacts + 1, t
            if tip.law != "restitution":
                touching.add(j)
                continue
            speed = penetration(j, t, u)[1]
            square = tip.row.dot(tip.row)
            acceleration = _acceleration(case, t, u[:n], u[n : 2 * n], u[-1])
            angle = tip.frequency * t + tip.phase
            push = -tip.amplitude * tip.frequency**2 * sin(angle) - tip.row.dot(acceleration)
            if speed > 1e-8 or push <= 0:
                u[n : 2 * n] += tip.row * (1 + tip.coefficient) * speed / square
                u[:n] += tip.row * penetration(j, t, u)[0] / square
                # The event must start from below 0.
                u[:n] += tip.row * 1e-17 / square
                continue

            def reaction(when: float, tip: Any = tip) -> float:
                angle = tip.frequency * when + tip.phase
                place = np.array([(tip.amplitude * sin(angle) - tip.gap) / tip.row[0]])
                rate = np.array([tip.amplitude * tip.frequency * cos(angle) / tip.row[0]])
                own = -tip.amplitude * tip.frequency**2 * sin(angle)
                return float(own - tip.row.dot(_acceleration(case, when, place, rate, 0.0)))

            grid = np.linspace(t, times[-1], 20001)
            signs = np.array([reaction(when) for when in grid])
            below = np.flatnonzero(signs < 0)
            until = times[-1] if not below.size else brentq(reaction, grid[below[0] - 1], grid[below[0]], xtol=1e-15)
            while at < case.samples and times[at] <= until:
                values[at] = (tip.amplitude * sin(tip.frequency * times[at] + tip.phase) - tip.gap) / tip.row[0]
                at += 1
            t = until
            angle = tip.frequency * t + tip.phase
            u = np.array(
                [
                    (tip.amplitude * sin(angle) - tip.gap) / tip.row[0],
                    tip.amplitude * tip.frequency * cos(angle) / tip.row[0],
                ]
            )
    return values, impacts, last
