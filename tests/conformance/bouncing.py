"""An independent solution of one mode under Newton's law of impact: every hit an event, chatter that ends in sticking.

The paper's beam on its first buckling mode, its numbers written out from the closed forms; flights by DOP853 with the
closing of the gap as an event, hits by the law, and once what is left of a chatter would be over within a millionth of
a period the beam is carried by the tip, until the force that this takes would have to pull.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from oracle import LEVEL, PaperBeam
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

Array = NDArray[np.float64]
_SOON = 1e-6
"""Of the period of the first mode: what is left of a chatter that has ended."""


_STILL = 1e-12
"""Of the tip's greatest speed: relative velocities that are rounding."""


class Bounced(NamedTuple):
    """What came of a run."""

    displacement: Array
    """At the contact point, of b, at the times asked for."""
    hits: int
    impulse: Array
    """Of each hit, N s."""
    carried: float
    """Seconds for which the beam was carried by the tip."""


class Bouncer:
    """The first mode, and a tip that moves as it is told."""

    def __init__(self, ratio: float, velocity: float, coefficient: float, location: float) -> None:
        beam = PaperBeam(1)
        self.e, self.phi = coefficient, float(beam.shape(location * 0.161)[0])
        self.mass, self.stiffness = float(beam.mass[0, 0]), float(beam.stiffness[0])
        self.gamma, self.damping = float(beam.gamma), float(beam.damping[0, 0])
        self.omega = ratio * float(beam.omega[0])
        self.stroke = velocity * LEVEL * float(beam.omega[0]) / self.omega
        self.rest, self.start = float(beam.rest[0]), self.phi * float(beam.rest[0])
        self.period = 2.0 * math.pi / float(beam.omega[0])

    def pull_back(self, a: float, rate: float) -> float:
        """What the mode does by itself: its acceleration."""
        return -(self.stiffness * a + self.gamma * a**3) / self.mass - self.damping * rate

    def tip(self, t: float) -> tuple[float, float, float]:
        """Where the tip is, its velocity and acceleration."""
        turn = self.omega * t
        sine, cosine = math.sin(turn), math.cos(turn)
        return (
            self.start + self.stroke * sine,
            self.stroke * self.omega * cosine,
            -self.stroke * self.omega**2 * sine,
        )

    def force(self, t: float) -> float:
        """What the tip pushes with if it carries the beam, over the modal mass and the shape."""
        place, rate, acceleration = self.tip(t)
        return acceleration / self.phi - self.pull_back(place / self.phi, rate / self.phi)

    def pressed(self, t: float) -> float:
        """Relative acceleration that closes the gap, of a beam in touch at the tip's own velocity, m/s^2."""
        return self.phi * self.force(t)

    def run(self, times: Array) -> Bounced:
        """From rest in touch to the last of *times*."""
        end, t, y = float(times[-1]), 0.0, np.array([self.rest, 0.0])
        found, impulses, carried = np.empty(times.size), [], 0.0
        while t < end:
            # in touch: a hit, or carried on
            closing = self.tip(t)[1] - self.phi * y[1]
            if closing > _STILL * self.stroke * self.omega:
                impulses.append((1.0 + self.e) * closing * self.mass / self.phi**2)
                y = np.array([self.tip(t)[0] / self.phi, y[1] + (1.0 + self.e) * closing / self.phi])
            away = self.phi * y[1] - self.tip(t)[1]
            pressed = self.pressed(t)
            over = (
                self.e < 1.0
                and pressed > 0.0
                and 2.0 * away / (pressed * (1.0 - self.e)) < _SOON * self.period
            )
            if over:
                until = self.released(t, end)
                inside = (times >= t) & (times <= until)
                found[inside] = [self.tip(s)[0] for s in times[inside]]
                carried, t = carried + until - t, until
                place, rate, _ = self.tip(t)
                y = np.array([place, rate]) / self.phi
                if t >= end:
                    break
            t, y = self.flown(t, y, end, times, found)
        return Bounced(found / LEVEL, len(impulses), np.array(impulses), carried)

    def released(self, t: float, end: float) -> float:
        """When the force of a tip that carries the beam would have to pull."""
        grid = np.arange(t, end + 1e-3 * self.period, 2e-3 * min(self.period, 2.0 * math.pi / self.omega))
        force = np.array([self.force(s) for s in grid])
        below = np.flatnonzero(force[1:] < 0.0)
        if not below.size:
            return end
        low, high = grid[below[0]], grid[below[0] + 1]
        return min(end, float(brentq(self.force, low, high, xtol=1e-17)) if force[below[0]] > 0.0 else low)

    def flown(self, t: float, y: Array, end: float, times: Array, found: Array) -> tuple[float, Array]:
        """A flight until the gap closes; fills in what is asked for on the way."""

        def flight(_: float, z: Array) -> Array:
            return np.array([z[1], self.pull_back(z[0], z[1])])

        # bodies that part from rest are apart by less than rounding at first
        still = abs(self.tip(t)[1] - self.phi * float(y[1])) <= _STILL * self.stroke * self.omega
        blind = t + (1e-3 * self.period if still else 0.0)

        def gap(s: float, z: Array) -> float:
            if s < blind:
                return -LEVEL
            return self.tip(s)[0] - self.phi * float(z[0])

        gap.terminal, gap.direction = True, 1.0  # type: ignore[attr-defined]
        scale = abs(self.rest) * np.array([1.0, 2.0 * math.pi / self.period])
        part = solve_ivp(
            flight, (t, end), y, "DOP853", rtol=1e-12, atol=1e-14 * scale, max_step=self.period / 200.0,
            first_step=min(1e-7 * self.period, 0.5 * (end - t)), events=gap, dense_output=True,
        )  # fmt: skip
        assert part.success, part.message
        stop = float(part.t[-1])
        inside = (times >= t) & (times <= stop)
        if inside.any():
            found[inside] = self.phi * part.sol(times[inside])[0]
        return stop, part.y[:, -1]
