"""An independent solution of one mode under Newton's law of impact: every hit an event, chatter that ends in sticking.

The paper's beam on its first buckling mode, its numbers written out from the closed forms.  A flight is a Taylor series
of the mode, as long as its last terms are below rounding, and the gap to the tip another, divided by the time since the
bodies parted, so that a hop of a billionth of a period has digits as a long flight has.  Hits follow the law, and once
what is left of a chatter would be over within a millionth of a period the beam is carried by the tip, until the force
that this takes would have to pull.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray
from oracle import LEVEL, PaperBeam

Array = NDArray[np.float64]
_SOON = 1e-6
"""Of the period of the first mode: what is left of a chatter that has ended."""
_STILL = 1e-12
"""Of the tip's greatest speed: relative velocities that are rounding."""
_TERMS = 26
_PARTS = 24
"""Pieces of a series that are searched for a first closing, or for a largest value above zero, each."""


class Bounced(NamedTuple):
    """What came of a run."""

    displacement: Array
    """At the contact point, of b, at the times asked for."""
    hits: int
    impulse: Array
    """Of each hit, N s."""
    striker_on_base: float
    """Seconds for which the beam was carried by the tip."""


class Mode(NamedTuple):
    """The first mode, its shape at the tip, and the tip's motion ``start + stroke sin(omega t)``."""

    e: float
    phi: float
    mass: float
    stiffness: float
    gamma: float
    damping: float
    omega: float
    stroke: float
    start: float
    period: float


@njit(cache=True)
def _horner(c, s, low):
    total = 0.0
    for i in range(c.size - 1, low - 1, -1):
        total = total * s + c[i]
    return total


@njit(cache=True)
def _slope(c, s, low):
    total = 0.0
    for i in range(c.size - 1, low, -1):
        total = total * s + (i - low) * c[i]
    return total


@njit(cache=True)
def _series(mode, t, a, v):
    """Coefficients in time of the mode and of the gap (positive: pressed in) from time *t* on."""
    q, square, gap = np.zeros(_TERMS), np.zeros(_TERMS), np.zeros(_TERMS)
    q[0], q[1] = a, v
    for n in range(_TERMS - 2):
        cube = 0.0
        for i in range(n + 1):
            square[n] += q[i] * q[n - i]
        for i in range(n + 1):
            cube += square[i] * q[n - i]
        pull = -(mode.stiffness * q[n] + mode.gamma * cube) / mode.mass - mode.damping * (n + 1) * q[n + 1]
        q[n + 2] = pull / ((n + 1) * (n + 2))
    sine, cosine, scale = math.sin(mode.omega * t), math.cos(mode.omega * t), mode.stroke
    for n in range(_TERMS):
        turn = (sine, cosine, -sine, -cosine)[n % 4]
        gap[n] = scale * turn - mode.phi * q[n]
        scale *= mode.omega / (n + 1)
    gap[0] += mode.start
    return q, gap


@njit(cache=True)
def _reach(mode, q, scale):
    """How long the series of the mode, and that of the tip, hold to rounding."""
    reach = 4.0 / mode.omega
    for n in (_TERMS - 2, _TERMS - 1):
        if q[n] != 0.0:
            reach = min(reach, (1e-18 * scale / abs(q[n])) ** (1.0 / n))
    return reach


@njit(cache=True)
def _between(c, low, left, right, of_slope):
    """A zero of a series, or of its slope, between two times where it has two signs."""
    f = _slope(c, left, low) if of_slope else _horner(c, left, low)
    for _ in range(200):
        middle = 0.5 * (left + right)
        if middle == left or middle == right:
            break
        g = _slope(c, middle, low) if of_slope else _horner(c, middle, low)
        if (g > 0.0) == (f > 0.0):
            left = middle
        else:
            right = middle
    return right


@njit(cache=True)
def _closing(gap, low, begin, end):
    """First time at which a gap that is open closes, or -1."""
    for part in range(_PARTS):
        left = begin + (end - begin) * part / _PARTS
        right = begin + (end - begin) * (part + 1) / _PARTS
        if _slope(gap, left, low) > 0.0 and _slope(gap, right, low) < 0.0:
            top = _between(gap, low, left, right, True)
            if _horner(gap, top, low) > 0.0:
                right = top
        if _horner(gap, left, low) <= 0.0 and _horner(gap, right, low) > 0.0:
            return _between(gap, low, left, right, False)
    return -1.0


@njit(cache=True)
def _tip(mode, t):
    turn = mode.omega * t
    return mode.start + mode.stroke * math.sin(turn), mode.stroke * mode.omega * math.cos(turn)


@njit(cache=True)
def _pressed(mode, t):
    """Relative acceleration that closes the gap, of a beam in touch at the tip's own velocity, m/s^2."""
    place, rate = _tip(mode, t)
    a, v = place / mode.phi, rate / mode.phi
    own = -(mode.stiffness * a + mode.gamma * a**3) / mode.mass - mode.damping * v
    return -mode.stroke * mode.omega**2 * math.sin(mode.omega * t) - mode.phi * own


@njit(cache=True)
def _released(mode, t, end):
    """When the force of a tip that carries the beam would have to pull."""
    step = 2e-3 * min(mode.period, 2.0 * math.pi / mode.omega)
    if _pressed(mode, t) <= 0.0:
        return t
    while t < end:
        if _pressed(mode, t + step) < 0.0:
            left, right = t, t + step
            for _ in range(200):
                middle = 0.5 * (left + right)
                if middle == left or middle == right:
                    break
                if _pressed(mode, middle) < 0.0:
                    right = middle
                else:
                    left = middle
            return min(end, right)
        t += step
    return end


@njit(cache=True)
def _bounce(mode, rest, times, found, impulses):
    """Fills in *found* and *impulses*; hits, seconds carried, and whether the impulses found room."""
    end, t, a, v, hits, striker_on_base, k = times[-1], 0.0, rest, 0.0, 0, 0.0, 0
    rounding = _STILL * mode.stroke * mode.omega
    while t < end:
        # in touch: a hit, or carried on
        place, rate = _tip(mode, t)
        closing = rate - mode.phi * v
        if closing > rounding:
            if hits == impulses.size:
                return hits, striker_on_base, False
            impulses[hits] = (1.0 + mode.e) * closing * mode.mass / mode.phi**2
            hits += 1
            a, v = place / mode.phi, v + (1.0 + mode.e) * closing / mode.phi
        away, pressed = mode.phi * v - rate, _pressed(mode, t)
        if mode.e < 1.0 and pressed > 0.0 and 2.0 * away / (pressed * (1.0 - mode.e)) < _SOON * mode.period:
            until = _released(mode, t, end)
            while k < times.size and times[k] <= until:
                found[k] = _tip(mode, times[k])[0]
                k += 1
            striker_on_base, t = striker_on_base + until - t, until
            place, rate = _tip(mode, t)
            a, v = place / mode.phi, rate / mode.phi
            if t >= end:
                break
        # a flight; bodies that part from rest are apart by less than rounding at first
        touching, still = True, abs(_tip(mode, t)[1] - mode.phi * v) <= rounding
        blind = t + (1e-3 * mode.period if still else 0.0)
        while t < end:
            q, gap = _series(mode, t, a, v)
            length = min(_reach(mode, q, abs(rest)), end - t)
            low = 1 if touching and not still else 0
            begin = min(max(blind - t, 0.0), length)
            hit = _closing(gap, low, begin, length)
            stop = hit if hit >= 0.0 else length
            while k < times.size and times[k] <= t + stop:
                found[k] = mode.phi * _horner(q, times[k] - t, 0)
                k += 1
            a, v = _horner(q, stop, 0), _slope(q, stop, 0)
            t, touching = t + stop, False
            if hit >= 0.0:
                break
    while k < times.size:
        found[k] = mode.phi * a
        k += 1
    return hits, striker_on_base, True


class Bouncer:
    """The first mode, and a tip that moves as it is told."""

    def __init__(self, ratio: float, velocity: float, coefficient: float, location: float) -> None:
        beam = PaperBeam(1)
        phi, rest, own = float(beam.shape(location * 0.161)[0]), float(beam.rest[0]), float(beam.omega[0])
        self.omega, self.rest = ratio * own, rest
        self.mode = Mode(
            e=coefficient,
            phi=phi,
            mass=float(beam.mass[0, 0]),
            stiffness=float(beam.stiffness[0]),
            gamma=float(beam.gamma),
            damping=float(beam.damping[0, 0]),
            omega=self.omega,
            stroke=velocity * LEVEL * own / self.omega,
            start=phi * rest,
            period=2.0 * math.pi / own,
        )

    def run(self, times: Array) -> Bounced:
        """From rest in touch to the last of *times*."""
        scratch, done = 1000, False
        while not done:
            found, impulses = np.empty(times.size), np.empty(scratch)
            hits, striker_on_base, done = _bounce(self.mode, self.rest, times, found, impulses)
            scratch *= 10
        return Bounced(found / LEVEL, hits, impulses[:hits], striker_on_base)
