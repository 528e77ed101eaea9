"""Cubic Hermite interpolation inside a step: roots, extremes and zero crossings of a signal.

Between two instants a signal is taken as the cubic that matches both values and both slopes (Hermite);
with s in [0, 1] and h the interval, u(s) = c0 + c1 s + c2 s^2 + c3 s^3.  Intervals are taken short enough that
the cubic turns at most once inside, which it does where its slopes at the ends have opposite signs; a
second turn, with slopes of one sign, is not located.
"""

from __future__ import annotations

import math

from snapbeam.solver.compilation import called, inlined

_OVERSHOOT = 0.15
"""Overshoot of a Hermite cubic beyond its end values over h(|v0| + |v1|), at most: 4/27, rounded up."""


@inlined
def hermite_overshoot_bound(v0, v1, h):
    """Upper bound of the overshoot of the cubic beyond the maximum and minimum of its end values."""
    return _OVERSHOOT * h * (abs(v0) + abs(v1))


@inlined
def cubic(u0, v0, u1, v1, h):
    """Coefficients (c0, c1, c2, c3) of the Hermite cubic in s on [0, 1]."""
    a, b = v0 * h, v1 * h
    rise = u1 - u0
    return u0, a, 3.0 * rise - 2.0 * a - b, a + b - 2.0 * rise


@inlined
def _at(c0, c1, c2, c3, s):
    return c0 + s * (c1 + s * (c2 + s * c3))


@called
def turning_point(u0, v0, u1, v1, h):
    """Location in (0, 1) of the turning point of the cubic for end slopes of opposite sign; otherwise -1."""
    if not v0 * v1 < 0.0:
        return -1.0
    _, c1, c2, c3 = cubic(u0, v0, u1, v1, h)
    low, high = 0.0, 1.0
    s = v0 / (v0 - v1)
    for _ in range(60):
        slope = c1 + s * (2.0 * c2 + s * 3.0 * c3)
        if slope == 0.0:
            break
        if slope * v0 > 0.0:
            low = s
        else:
            high = s
        curvature = 2.0 * c2 + 6.0 * c3 * s
        new = s - slope / curvature if curvature != 0.0 else -1.0
        if not (low < new < high):
            new = 0.5 * (low + high)
        if abs(new - s) < 1e-15:
            break
        s = new
    return s


@called
def root(c0, c1, c2, c3, low, high):
    """The root of the cubic in [low, high], whose ends must have opposite signs."""
    below = _at(c0, c1, c2, c3, low)
    s = 0.5 * (low + high)
    for _ in range(80):
        value = _at(c0, c1, c2, c3, s)
        if value == 0.0:
            break
        if value * below > 0.0:
            low = s
        else:
            high = s
        slope = c1 + s * (2.0 * c2 + s * 3.0 * c3)
        new = s - value / slope if slope != 0.0 else -1.0
        if not (low < new < high):
            new = 0.5 * (low + high)
        if abs(new - s) < 1e-15:
            break
        s = new
    return s


@inlined
def first_upcrossing(u0, v0, u1, v1, h):
    """Location in [0, 1] of the first upcrossing of zero by the cubic from a value <= 0; -1 if there is none."""
    if max(u0, u1) + hermite_overshoot_bound(v0, v1, h) <= 0.0:
        return -1.0
    c0, c1, c2, c3 = cubic(u0, v0, u1, v1, h)
    c0 = min(c0, 0.0)
    if u0 >= 0.0 and v0 > 0.0:
        return 0.0
    if v0 > 0.0 and v1 < 0.0:
        top = turning_point(u0, v0, u1, v1, h)
        if _at(c0, c1, c2, c3, top) > 0.0:
            return root(c0, c1, c2, c3, 0.0, top)
    if u1 > 0.0:
        if v0 < 0.0 and v1 > 0.0:
            bottom = turning_point(u0, v0, u1, v1, h)
            return root(c0, c1, c2, c3, bottom, 1.0)
        return root(c0, c1, c2, c3, 0.0, 1.0) if c0 < 0.0 else 0.0
    return -1.0


@inlined
def first_downcrossing(u0, v0, u1, v1, h):
    """Location in (0, 1) of the first downcrossing of zero by the cubic, from a start > 0 to an end <= 0."""
    c0, c1, c2, c3 = cubic(u0, v0, u1, v1, h)
    return root(c0, c1, c2, c3, 0.0, 1.0)


@inlined
def sign_of(u, otherwise):
    """-1 or 1, the sign of *u*; *otherwise* where it is exactly zero."""
    if u > 0.0:
        return 1
    if u < 0.0:
        return -1
    return otherwise


@inlined
def count_zero_crossings(side, u0, v0, u1, v1, h):
    """Zero crossings of the cubic, given the *side* (-1, 1; 0: none yet) it was on last.

    Returns how many, where in [0, 1] the last one is (-1 if none), and the side at the end.  A value
    of exactly zero is on the side that the signal was on before.
    """
    count, last = 0, -1.0
    if min(side * u0, side * u1) > hermite_overshoot_bound(v0, v1, h):
        return count, last, side
    turn = turning_point(u0, v0, u1, v1, h)
    c0, c1, c2, c3 = cubic(u0, v0, u1, v1, h)
    left = 0.0
    if turn > 0.0:
        middle = _at(c0, c1, c2, c3, turn)
        there = sign_of(middle, side)
        if there != side and side != 0:
            count = 1
            last = root(c0, c1, c2, c3, 0.0, turn) if u0 * middle < 0.0 else 0.0
        side, left, u0 = there, turn, middle
    there = sign_of(u1, side)
    if there != side and side != 0:
        count += 1
        last = root(c0, c1, c2, c3, left, 1.0) if u0 * u1 < 0.0 else left
    return count, last, there


@inlined
def update_extrema(low, high, u0, v0, u1, v1, h):
    """The range [low, high], extended to contain the cubic on [0, 1]."""
    lesser, greater, overshoot = min(u0, u1), max(u0, u1), hermite_overshoot_bound(v0, v1, h)
    if greater + overshoot > high or lesser - overshoot < low:
        turn = turning_point(u0, v0, u1, v1, h)
        if turn > 0.0:
            c0, c1, c2, c3 = cubic(u0, v0, u1, v1, h)
            value = _at(c0, c1, c2, c3, turn)
            if math.isfinite(value):
                lesser, greater = min(lesser, value), max(greater, value)
    return min(low, lesser), max(high, greater)
