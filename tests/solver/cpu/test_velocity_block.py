"""Kicks by forces that depend on velocities, against the integrated equation."""

from __future__ import annotations

import numpy as np
import pytest
from numba import njit
from scipy.integrate import solve_ivp

from snapbeam.solver.cpu.terms.velocity_block import (
    DAMPING,
    ELASTIC,
    IMPULSE_IN_KICK,
    LOST_IN_KICK,
    VELOCITY,
    ContactDamping,
    VelocityBlock,
    _integrate,
)

MOBILITY, SPEED, PUSH, STRIKER = 3.0, -0.2, 40.0, 0.7


def kick(elastic: float, damping: float, weight: float) -> tuple[float, float, float]:
    """Velocity after a kick by one contact, impulse and loss; places 0: M, v, a; 20: the contact."""
    memory = np.zeros(32)
    memory[0], memory[1], memory[2] = MOBILITY, SPEED, PUSH
    memory[20 + ELASTIC], memory[20 + DAMPING], memory[20 + VELOCITY] = elastic, damping, STRIKER
    block = VelocityBlock((0,), (ContactDamping(20, 0),), 0, 20)
    njit(lambda memory, weight: _integrate(memory, block, weight))(memory, weight)
    return memory[1], memory[20 + IMPULSE_IN_KICK], memory[20 + LOST_IN_KICK]


# mobility times damping times weight: 1e-4, 0.3, 1 (exact) and 1.5 (in parts); then a contact that opens in the kick
@pytest.mark.parametrize(
    ("elastic", "damping", "weight", "within"),
    [
        (5.0, 1.0, 3e-5, 1e-14),
        (5.0, 20.0, 5e-3, 1e-14),
        (5.0, 20.0, -5e-3, 1e-14),
        (0.0, 30.0, 1.0 / 90.0, 1e-14),
        (5.0, 100.0, 5e-3, 1e-5),
        (-20.0, 20.0, 2e-2, 2e-3),
    ],
)
def test_one_contact(elastic, damping, weight, within):
    """v' = a + M D,  D = max(0, F + C (V - v))."""

    def rates(t, y):
        force = max(0.0, elastic + damping * (STRIKER - y[0]))
        return [PUSH + MOBILITY * force, force, (force - elastic) * (STRIKER - y[0])]

    exact = solve_ivp(rates, (0.0, weight), [SPEED, 0.0, 0.0], method="DOP853", rtol=1e-13, atol=1e-16).y[
        :, -1
    ]
    assert kick(elastic, damping, weight) == pytest.approx(tuple(exact), rel=within, abs=1e-16)
