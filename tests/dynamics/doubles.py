"""Systems whose dynamics are known, behind the same protocol as a beam's."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from snapbeam.dynamics.flow import AdvancedStates

Map = Callable[[np.ndarray, dict], np.ndarray]


class KnownMap:
    """A map and its derivative, for batches of states; parameters are numbers or one for each state."""

    def __init__(self, step: Map, slope: Map, dimension: int, period: float = 1.0, **values: float) -> None:
        self._step, self._slope = step, slope
        self.dimension, self.period, self.values = dimension, period, values
        self.names = tuple(f"x[{i + 1}]" for i in range(dimension))

    def advance(self, states, periods=1, *, tangents=None, every=False, points=None):
        x = np.array(states.hidden if isinstance(states, AdvancedStates) else states, dtype=float)
        of = self.values | dict(points or {})
        moved, seen = tangents, []
        for _ in range(periods):
            if moved is not None:
                moved = np.einsum("nij,nkj->nki", self._slope(x, of), moved)
            x = self._step(x, of)
            seen.append(x)
        return AdvancedStates(x, np.stack(seen, axis=1) if every else None, moved, {}, x)

    def changed(self, values):
        return KnownMap(self._step, self._slope, self.dimension, self.period, **(self.values | dict(values)))

    def value(self, name):
        return self.values[name]


def table(*rows):
    """A batch of matrices from entries that are numbers or one for each state."""
    size = max(np.size(entry) for row in rows for entry in row)
    return np.array([[np.broadcast_to(entry, size) for entry in row] for row in rows]).transpose(2, 0, 1)


def henon(a: float = 1.4, b: float = 0.3) -> KnownMap:
    """Largest exponent 0.419 (Henon 1976); the sum of both is ln b."""

    def step(x, of):
        return np.stack([1.0 - of["a"] * x[:, 0] ** 2 + x[:, 1], of["b"] * x[:, 0]], axis=1)

    def slope(x, of):
        return table([-2.0 * of["a"] * x[:, 0], 1.0], [of["b"], 0.0])

    return KnownMap(step, slope, 2, a=a, b=b)


def lorenz(interval: float = 0.1, pieces: int = 20) -> KnownMap:
    """The Lorenz system at its usual parameters over *interval*: exponents 0.906, 0 and -14.572."""
    sigma, rho, beta = 10.0, 28.0, 8.0 / 3.0

    def rate(x):
        return np.stack(
            [sigma * (x[:, 1] - x[:, 0]), x[:, 0] * (rho - x[:, 2]) - x[:, 1], x[:, 0] * x[:, 1] - beta * x[:, 2]], 1
        )

    def matrix(x):
        return table([-sigma, sigma, 0.0], [rho - x[:, 2], -1.0, -x[:, 0]], [x[:, 1], x[:, 0], -beta])

    def carry(x, frame):
        h = interval / pieces
        for _ in range(pieces):
            rates, slopes, at = [], [], x
            moved = frame
            for part in (0.5, 0.5, 1.0, 0.0):
                rates.append(rate(at))
                slopes.append(matrix(at) @ moved)
                at, moved = x + part * h * rates[-1], frame + part * h * slopes[-1]
            x = x + h / 6.0 * (rates[0] + 2.0 * rates[1] + 2.0 * rates[2] + rates[3])
            frame = frame + h / 6.0 * (slopes[0] + 2.0 * slopes[1] + 2.0 * slopes[2] + slopes[3])
        return x, frame

    def step(x, of):
        return carry(x, np.zeros((len(x), 3, 1)))[0]

    def slope(x, of):
        return carry(x, np.tile(np.eye(3), (len(x), 1, 1)))[1]

    return KnownMap(step, slope, 3, interval)


def grebogi() -> KnownMap:
    """Two fixed points, (0, -0.3) and (pi, 0.3), and a fractal border (Grebogi et al. 1983)."""

    def step(x, of):
        angle = x[:, 0] + 1.32 * np.sin(2.0 * x[:, 0]) - 0.9 * np.sin(4.0 * x[:, 0]) - x[:, 1] * np.sin(x[:, 0])
        angle = (angle + 0.5 * np.pi) % (2.0 * np.pi) - 0.5 * np.pi
        return np.stack([angle, -0.3 * np.cos(x[:, 0])], axis=1)

    def slope(x, of):
        first = 1.0 + 2.64 * np.cos(2.0 * x[:, 0]) - 3.6 * np.cos(4.0 * x[:, 0]) - x[:, 1] * np.cos(x[:, 0])
        return table([first, -np.sin(x[:, 0])], [0.3 * np.sin(x[:, 0]), 0.0])

    return KnownMap(step, slope, 2)


def pendulum(interval: float = 1.0, pieces: int = 40) -> KnownMap:
    """x'' + 0.1 x' + sin x = 0.5: a fixed point that 15 % of the starts go to, and a rotation (bSTAB's example)."""

    def rate(x):
        return np.stack([x[:, 1], -0.1 * x[:, 1] + 0.5 - np.sin(x[:, 0])], axis=1)

    def matrix(x):
        return table([0.0, 1.0], [-np.cos(x[:, 0]), -0.1])

    def carry(x, frame):
        h = interval / pieces
        for _ in range(pieces):
            rates, slopes, at, moved = [], [], x, frame
            for part in (0.5, 0.5, 1.0, 0.0):
                rates.append(rate(at))
                slopes.append(matrix(at) @ moved)
                at, moved = x + part * h * rates[-1], frame + part * h * slopes[-1]
            x = x + h / 6.0 * (rates[0] + 2.0 * rates[1] + 2.0 * rates[2] + rates[3])
            frame = frame + h / 6.0 * (slopes[0] + 2.0 * slopes[1] + 2.0 * slopes[2] + slopes[3])
        return x, frame

    rest = np.arcsin(0.5)

    def step(x, of):
        moved = carry(x, np.zeros((len(x), 2, 1)))[0]
        moved[:, 0] = (moved[:, 0] - rest + np.pi) % (2.0 * np.pi) - np.pi + rest
        return moved

    def slope(x, of):
        return carry(x, np.tile(np.eye(2), (len(x), 1, 1)))[1]

    return KnownMap(step, slope, 2, interval)


def duffing(damping: float = 0.15, force: float = 0.2, pieces: int = 40) -> KnownMap:
    """x'' + 0.15 x' - x + x^3 = 0.2 cos t over one period of the drive, by the classical Runge-Kutta method."""
    h = 2.0 * math.pi / pieces

    def rate(x, t):
        return np.stack([x[:, 1], -damping * x[:, 1] + x[:, 0] - x[:, 0] ** 3 + force * math.cos(t)], axis=1)

    def moved(x):
        for i in range(pieces):
            k1 = rate(x, i * h)
            k2 = rate(x + 0.5 * h * k1, (i + 0.5) * h)
            k3 = rate(x + 0.5 * h * k2, (i + 0.5) * h)
            k4 = rate(x + h * k3, (i + 1.0) * h)
            x = x + h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)
        return x

    def slope(x, of):
        small = 1e-6
        columns = [(moved(x + e) - moved(x - e)) / (2.0 * small) for e in small * np.eye(2)]
        return np.stack(columns, axis=2)

    return KnownMap(lambda x, of: moved(x), slope, 2, 2.0 * math.pi)


def turning_pendulum(longest: float = 8.0, step: float = 0.1) -> KnownMap:
    """The pendulum from a state to where its angle next comes upward through that of rest + pi, or *longest* after.

    Both of its attractors are fixed points of this map: rest, and the rotation where it comes round.
    """
    rest = math.asin(0.5)
    end = rest + math.pi

    def rate(x):
        return np.stack([x[:, 1], -0.1 * x[:, 1] + 0.5 - np.sin(x[:, 0])], axis=1)

    def moved(x, h):
        h = np.broadcast_to(h, len(x))[:, None]
        k1 = rate(x)
        k2 = rate(x + 0.5 * h * k1)
        k3 = rate(x + 0.5 * h * k2)
        k4 = rate(x + h * k3)
        return x + h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)

    def step_of(x, of):
        x = np.array(x, dtype=float)
        # an angle at the end is one at the beginning
        x[:, 0] = (x[:, 0] - rest + math.pi) % (2.0 * math.pi) - math.pi + rest
        flying = np.ones(len(x), dtype=bool)
        for _ in range(round(longest / step)):
            here = x[flying]
            there = moved(here, step)
            passed = (here[:, 0] < end) & (there[:, 0] >= end)
            part = np.full(passed.sum(), 0.5)
            for _ in range(6):
                at = moved(here[passed], part * step)
                part = part - (at[:, 0] - end) / (at[:, 1] * step)
            there[passed] = moved(here[passed], part * step)
            x[flying] = there
            flying[np.flatnonzero(flying)[passed]] = False
        x[:, 0] = (x[:, 0] - rest + math.pi - 1e-9) % (2.0 * math.pi) - math.pi + rest + 1e-9
        return x

    def slope(x, of):
        small = 1e-6
        x = np.asarray(x, dtype=float)
        columns = [(step_of(x + e, of) - step_of(x - e, of)) / (2.0 * small) for e in small * np.eye(2)]
        return np.stack(columns, axis=2)

    return KnownMap(step_of, slope, 2, longest)


def logistic(r: float = 3.2) -> KnownMap:
    """x -> r x (1 - x): its first flip at r = 3, its second at 1 + sqrt 6."""

    def step(x, of):
        return (of["r"] * x[:, 0] * (1.0 - x[:, 0]))[:, None]

    def slope(x, of):
        return table([of["r"] * (1.0 - 2.0 * x[:, 0])])

    return KnownMap(step, slope, 1, r=r)
