"""Exact solutions where there are any, of the dimensionless cases: displacement at the output times."""

from collections.abc import Callable
from math import asin, atan2, cos, exp, gamma, pi, sin, sqrt

import numpy as np

from impact20 import Array, Case


def bouncing_ball(case: Case) -> Array:
    """Parabolas between the impacts; from the accumulation of impacts on, rest."""
    e, fall = case.tips[0].coefficient, sqrt(2 * case.start[0])
    values = []
    for t in case.times:
        if t < fall:
            values.append(case.start[0] - t * t / 2)
            continue
        left, speed = t - fall, e * fall
        while speed > 1e-9 and left > 2 * speed:
            left -= 2 * speed
            speed *= e
        values.append(speed * left - left * left / 2 if speed > 1e-9 else 0.0)
    return np.array(values)


def unilateral_spring(case: Case) -> Array:
    """Arcs sin(w t)/w in contact and -sin(t) apart."""
    w = sqrt(1 + case.tips[0].stiffness)
    rest = np.mod(case.times, pi / w + pi)
    return np.where(rest < pi / w, np.sin(w * rest) / w, -np.sin(rest - pi / w))


def two_stops(case: Case) -> Array:
    """Arcs of sines between the stops at 1 and -1."""
    e, speed = case.tips[0].coefficient, case.speed[0]
    arrival, fast = asin(1 / speed), e * sqrt(speed**2 - 1)
    side, values = 1.0, []
    for t in case.times:
        if t < arrival:
            values.append(speed * sin(t))
            continue
        while True:
            # From side, with the velocity -side fast: x = side (cos s - fast sin s), which is -side after 2 atan(1/fast).
            flight = 2 * atan2(1.0, fast)
            if t - arrival <= flight:
                values.append(side * (cos(t - arrival) - fast * sin(t - arrival)))
                break
            arrival, side, fast = arrival + flight, -side, e * fast
    return np.array(values)


def viscous_sphere(case: Case) -> Array:
    """Flight before, NaN in contact, flight afterwards with the exact duration and restitution.

    Hertz: duration 2 d_max/v sqrt(pi) Gamma(7/5)/Gamma(9/10), d_max = (5/4)^(2/5).  Kelvin-Voigt: the force falls to 0
    at t = atan2(2 z s, 2 z^2 - 1)/s, z = c/2 and s = sqrt(1 - z^2), where the speed is exp(-z t).  Hunt-Crossley: the
    restitution e follows from (1 + e) D = ln((1 + D)/(1 - e D)), D = chi; the duration is no closed form.
    """
    tip = case.tips[0]
    start = 0.01
    if tip.law == "power":
        depth, e = 1.25**0.4, 1.0
        away, where = start + 2 * depth * sqrt(pi) * gamma(1.4) / gamma(0.9), 0.0
    elif tip.law == "kelvin_voigt":
        z = tip.damping / 2
        s = sqrt(1 - z * z)
        span = atan2(2 * z * s, 2 * z * z - 1) / s
        e = exp(-z * span)
        away, where = start + span, -exp(-z * span) * sin(s * span) / s
        e = -exp(-z * span) * (cos(s * span) - z / s * sin(s * span))
    else:
        return np.full(case.samples, np.nan)
    t = case.times
    return np.where(t < start, start - t, np.where(t > away, where + e * (t - away), np.nan))


def striker_with_mass(case: Case) -> Array:
    """Second sphere of two: it leaves with 2 m1/(m1 + m2) of the first one's speed (elastic)."""
    if case.name != "spheres":
        return np.full(case.samples, np.nan)
    second = 1 / case.tips[0].row[1] ** 2
    reduced = second / (1 + second)
    depth = (1.25 * reduced) ** 0.4
    span = 2 * depth * sqrt(pi) * gamma(1.4) / gamma(0.9)
    # Momentum: (x1 + m2 x2) = t; at separation x1 = x2 = t/(1 + m2).
    leave = span / (1 + second) + 2 / (1 + second) * (case.times - span)
    return np.where(case.times > span, leave, np.nan)


SOLUTIONS: dict[str, Callable[[Case], Array]] = {
    "bouncing_ball": bouncing_ball,
    "unilateral_spring": unilateral_spring,
    "two_stops": two_stops,
    "viscous_sphere": viscous_sphere,
    "striker_with_mass": striker_with_mass,
}
