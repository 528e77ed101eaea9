"""Exact solutions, in SI units."""

from math import asin, atan2, gamma, pi, sqrt


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


def two_sided_stop(
    mass: float, stiffness: float, gap: float, speed: float, restitution: float, impacts: int
) -> dict[str, float]:
    """Time of the last impact and speed after it."""
    rate = sqrt(stiffness / mass)
    time = asin(gap * rate / speed) / rate
    fast = restitution * sqrt(speed**2 - (rate * gap) ** 2)
    for _ in range(int(impacts) - 1):
        time += 2 * atan2(rate * gap, fast) / rate
        fast *= restitution
    return {"time": time, "speed": fast}


def two_masses(mass: float, second_mass: float, contact_stiffness: float, speed: float) -> dict[str, float]:
    """Largest force, time in contact, speed of the second sphere after the impact."""
    relative = hertz_wall(mass * second_mass / (mass + second_mass), contact_stiffness, speed)
    return {**relative, "second_speed": 2 * mass * speed / (mass + second_mass)}
