"""The time step in a layout of plain Python numbers, against an independent integration."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from snapbeam import HertzContact
from snapbeam.solver.excitation import Tip
from snapbeam.solver.physics import rotation
from snapbeam.solver.splitting import COMPOSITIONS
from snapbeam.solver.step import InnerProducts, Primitives, build_step, flow_mode, kick_mode

OMEGA, DAMPING, GAMMA, G, C = 300.0, 6.0, 4e4, 0.7, 1.3
"""One mode: natural frequency and decay rate (1/s), tension stiffness, g and c; G = 1."""
AMPLITUDE, RATE = 0.02, 500.0
"""Amplitude (m) and angular frequency of the striker."""
START, DURATION = (0.1, -20.0), 0.02
LAW = HertzContact(stiffness=2e5)


class State(NamedTuple):
    q: float
    p: float
    k: float


class StepData(NamedTuple):
    composition: object
    flows: int
    gamma: float
    tip: Tip
    in_contact: bool
    time: float
    length: float
    state: State


def tension(q: float) -> float:
    return -GAMMA * (q * q * G + (2.0 * G * q + q * q) * q)


def tip_motion(data, stage):
    angle = RATE * (data.time + data.composition.elapsed[stage] * data.length)
    return AMPLITUDE * math.sin(angle), AMPLITUDE * RATE * math.cos(angle)


def form_products(data, stage, state):
    return InnerProducts(C * state.q, G * state.q, state.q * state.q, state.q)


def flow_matrix(time):
    damped = math.sqrt(OMEGA**2 - DAMPING**2)
    sine, less_one = math.sin(damped * time) / damped, math.cos(damped * time) - 1.0
    return rotation(DAMPING, OMEGA**2, sine, less_one, math.expm1(-DAMPING * time))


def kick_and_flow(data, stage, state, weight, along_g, along_r, r, force):
    k = along_g * G + along_r * r if stage > 0 else state.k
    q, p = state.q, kick_mode(weight, k, C, force, state.p)
    if stage < data.flows:
        q, p = flow_mode(q, p, *flow_matrix(data.composition.flow[stage] * data.length))
    return State(q, p, k), 0.0


take_step = build_step(
    Primitives(
        zero=lambda data: 0.0,
        begin=lambda data: (data.state, None),
        kick_weight=lambda data, stage: data.composition.kick[stage] * data.length,
        tip_motion=tip_motion,
        form_products=form_products,
        where_closed=lambda data, force: force,
        kick_and_flow=kick_and_flow,
    ),
    lambda function: function,
).take_step


def integrate(order, steps, in_contact):
    """State at the end, and impulse and work of the contact."""
    composition, length = COMPOSITIONS[order], DURATION / steps
    tip = Tip(0.5, LAW.numbers_type()(LAW.stiffness), None)
    state, impulse, work = State(*START, tension(START[0])), 0.0, 0.0
    for i in range(steps):
        data = StepData(composition, composition.flow.size, GAMMA, tip, in_contact, i * length, length, state)
        state, increment = take_step(data)
        impulse, work = impulse + increment.contact.impulse, work + increment.contact.work
    return np.array([state.q, state.p, impulse, work])


@pytest.fixture(scope="module", params=[False, True], ids=["free", "in contact"])
def exact(request):
    def derivative(t, y):
        q, p = y[:2]
        penetration = 0.5 + AMPLITUDE * math.sin(RATE * t) - C * q
        force = LAW.stiffness * penetration**1.5 if request.param else 0.0
        velocity = AMPLITUDE * RATE * math.cos(RATE * t)
        acceleration = -(OMEGA**2) * q - 2.0 * DAMPING * p + tension(q) + C * force
        return [p, acceleration, force, force * velocity]

    solution = solve_ivp(
        derivative, (0.0, DURATION), [*START, 0.0, 0.0], method="DOP853", rtol=1e-13, atol=1e-13
    )
    return request.param, solution.y[:, -1]


@pytest.mark.parametrize("order", [4, 6])
def test_the_step_has_the_order_of_its_composition(exact, order):
    """State, impulse and work converge with the order of the composition to an independent solution."""
    in_contact, expected = exact
    scale = np.maximum(np.abs(expected), 1e-12)
    coarse, fine = (np.abs(integrate(order, n, in_contact) - expected) / scale for n in (24, 48))
    assert coarse.max() < 1e-5
    assert fine.max() < coarse.max() / 2 ** (order - 1)
