"""The same quantities by SciPy's DOP853 in dimensionless form, with located events and a restart at each event."""

from collections.abc import Callable
from math import sqrt
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp

Right = Callable[[float, np.ndarray], list[float]]


def _until(
    right: Right, start: list[float], index: int, direction: int, limit: float
) -> tuple[float, np.ndarray]:
    def crossing(_time: float, state: np.ndarray) -> float:
        return float(state[index])

    event: Any = crossing
    event.terminal, event.direction = True, direction
    run = solve_ivp(right, (0.0, limit), start, method="DOP853", rtol=1e-13, atol=1e-15, events=event)
    if run.status != 1:
        raise RuntimeError(f"no event before the dimensionless time {limit}")
    return float(run.t_events[0][0]), run.y_events[0][0]


def bouncing_ball(height: float, gravity: float, restitution: float, bounces: int) -> dict[str, float]:
    """Lengths in units of the height, times in units of sqrt(height/gravity)."""
    time, state = 0.0, [1.0, 0.0]
    for _ in range(int(bounces)):
        span, end = _until(lambda t, y: [y[1], -1.0], state, 0, -1, 10.0)
        time += span
        state = [0.0, -restitution * end[1]]
    return {"time": time * sqrt(height / gravity), "speed": state[1] * sqrt(height * gravity)}


def linear_stop(mass: float, stiffness: float, stop_stiffness: float, speed: float) -> dict[str, float]:
    """Times in units of sqrt(mass/stop_stiffness); the third state is the impulse."""
    unit, ratio = sqrt(mass / stop_stiffness), stiffness / stop_stiffness

    def closed(_time: float, y: np.ndarray) -> list[float]:
        return [y[1], -(1 + ratio) * y[0], y[0]]

    def free(_time: float, y: np.ndarray) -> list[float]:
        return [y[1], -ratio * y[0], 0.0]

    rise, peak = _until(closed, [0.0, 1.0, 0.0], 1, -1, 10.0)
    fall, end = _until(closed, [float(v) for v in peak], 0, -1, 10.0)
    away, back = _until(free, [0.0, float(end[1]), 0.0], 0, 1, 1e3)
    again, _ = _until(closed, [0.0, float(back[1]), 0.0], 1, -1, 10.0)
    return {
        "force": peak[0] * stop_stiffness * speed * unit,
        "duration": (rise + fall) * unit,
        "second_peak": (rise + fall + away + again) * unit,
        "impulse": end[2] * mass * speed,
    }


def hertz_wall(mass: float, contact_stiffness: float, speed: float) -> dict[str, float]:
    """Lengths in units of (mass speed^2/stiffness)^(2/5)."""
    length = (mass * speed**2 / contact_stiffness) ** 0.4

    def right(_time: float, y: np.ndarray) -> list[float]:
        return [y[1], -(max(y[0], 0.0) ** 1.5)]

    rise, peak = _until(right, [0.0, 1.0], 1, -1, 10.0)
    fall, _ = _until(right, [float(v) for v in peak], 0, -1, 10.0)
    force = contact_stiffness * (length * peak[0]) ** 1.5
    return {"force": force, "duration": (rise + fall) * length / speed}


def two_sided_stop(
    mass: float, stiffness: float, gap: float, speed: float, restitution: float, impacts: int
) -> dict[str, float]:
    """Lengths in units of the gap, measured from the stop ahead; times in units of sqrt(mass/stiffness)."""
    unit = sqrt(mass / stiffness)
    time, state = 0.0, [1.0, -speed * unit / gap]
    for _ in range(int(impacts)):
        span, end = _until(lambda t, y: [y[1], 1.0 - y[0]], state, 0, -1, 100.0)
        time += span
        state = [2.0, restitution * float(end[1])]
    return {"time": time * unit, "speed": -state[1] * gap / unit}


def two_masses(mass: float, second_mass: float, contact_stiffness: float, speed: float) -> dict[str, float]:
    """Penetration, its rate and the speed of the second sphere; lengths in units of (mass speed^2/stiffness)^(2/5)."""
    length, ratio = (mass * speed**2 / contact_stiffness) ** 0.4, mass / second_mass

    def right(_time: float, y: np.ndarray) -> list[float]:
        force = max(y[0], 0.0) ** 1.5
        return [y[1], -(1 + ratio) * force, ratio * force]

    rise, peak = _until(right, [0.0, 1.0, 0.0], 1, -1, 10.0)
    fall, end = _until(right, [float(v) for v in peak], 0, -1, 10.0)
    force = contact_stiffness * (length * peak[0]) ** 1.5
    return {"force": force, "duration": (rise + fall) * length / speed, "second_speed": float(end[2]) * speed}
