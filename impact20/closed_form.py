"""Exact solutions, in SI units."""

from math import gamma, pi, sqrt


def bouncing_ball(height: float, gravity: float, restitution: float, bounces: int) -> dict[str, float]:
    """Time of the last bounce and speed after it."""
    fall = sqrt(2 * height / gravity)
    flights = sum(2 * fall * restitution**n for n in range(1, int(bounces)))
    return {"time": fall + flights, "speed": sqrt(2 * gravity * height) * restitution**bounces}


def linear_stop(mass: float, stiffness: float, stop_stiffness: float, speed: float) -> dict[str, float]:
    """Largest force of the stop, time in contact, time of the second peak, impulse of the first contact."""
    rate = sqrt((stiffness + stop_stiffness) / mass)
    force = stop_stiffness * speed / rate
    second = 1.5 * pi / rate + pi * sqrt(mass / stiffness)
    return {"force": force, "duration": pi / rate, "second_peak": second, "impulse": 2 * force / rate}


def hertz_wall(mass: float, contact_stiffness: float, speed: float) -> dict[str, float]:
    """Largest force and time in contact."""
    depth = (1.25 * mass * speed**2 / contact_stiffness) ** 0.4
    duration = 2 * depth / speed * sqrt(pi) * gamma(1.4) / gamma(0.9)
    return {"force": contact_stiffness * depth**1.5, "duration": duration}
