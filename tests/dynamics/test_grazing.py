"""Grazing with Hertz's law: how much a light touch shifts the motion in time, exactly and as powers of the overlap.

A mass m that turns back with an acceleration a where it overlaps a stop by p if nothing held it: in contact it is
m d'' = -m a - k_c d^(3/2), with the one length p* = (m a/k_c)^(2/3).  Below p* the shift goes with p^2, above it with
p^(1/2) (Nordmark, J. Sound Vib. 145 (1991) 279, for a rigid stop).
"""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.optimize import brentq
from scipy.special import beta

import snapbeam as sb
from snapbeam.dynamics.approaches import passage_of
from snapbeam.dynamics.stroboscope import Stroboscope

SWING = 1.0
STIFFNESS = 1e9
"""k_c over m omega^2: p* is 1e-6 of the swing."""
OVERLAP = (1.0 / STIFFNESS) ** (2.0 / 3.0)
"""p*, with m = omega = swing = 1, so that a = 1 where it turns back."""


def shift(over: float) -> float:
    """How much earlier the engine's oscillator is back at its height, having touched a stop *over* short of its end."""
    model = sb.ReducedModel.from_matrices([[1.0]], [1.0], contact_shape=[1.0], length_scale=1.0)
    stop = sb.Striker(drive=sb.FixedStop(), gap=SWING - over)
    system = sb.System(model, contacts=[sb.Contact(sb.HertzContact(STIFFNESS), stop)])
    start = sb.State(amplitude=np.array([SWING]), velocity=np.zeros(1))
    back = sb.advance(system, start, 1, integration=sb.Integration(accuracy="reference"))
    q, p = float(back.amplitude[0]), float(back.velocity[0])
    assert math.hypot(q, p) == pytest.approx(SWING, rel=1e-10), "the stop takes no energy"
    return -math.atan2(p, q)


def exact(over: float) -> float:
    """The same by quadrature: half a contact lasts the integral of 1/speed up to the greatest penetration."""
    gap = SWING - over

    def left(depth: float) -> float:
        return (over - depth) * (SWING + gap + depth) - 0.8 * STIFFNESS * depth**2.5

    most = brentq(left, 0.0, over, xtol=1e-24, rtol=1e-15)

    def pace(angle: float) -> float:
        """Of depth = most sin^2(angle), by which the root at the end is taken out."""
        sine, cosine = math.sin(angle), math.cos(angle)
        fall = -math.expm1(5.0 * math.log(sine)) / cosine**2
        square = most * (2.0 * gap + most * (1.0 + sine**2)) + 0.8 * STIFFNESS * most**2.5 * fall
        return 2.0 * most * sine / math.sqrt(square)

    held = 2.0 * quad(pace, 0.0, 0.5 * math.pi, epsabs=0.0, epsrel=1e-11)[0]
    return 4.0 * math.asin(math.sqrt(0.5 * over / SWING)) - held


@pytest.mark.slow
@pytest.mark.parametrize("start", [(-0.95, 0.0), (-0.95, 0.3), (0.0, 0.2), (-0.8, -0.4)])
def test_the_clearance_of_a_motion_that_does_not_repeat(start: tuple[float, float]) -> None:
    """The first swing of a damped oscillator towards the stop, in closed form; the ends of the run are no turning points."""
    zeta = 0.05
    model = sb.ReducedModel.from_matrices([[1.0]], [1.0], contact_shape=[1.0], length_scale=1.0, damping_ratio=zeta)
    stop = sb.Striker(drive=sb.FixedStop(), gap=1.0)
    history = sb.HarmonicForce(amplitude=1e-9, frequency_ratio=0.25)
    system = sb.System(
        model, contacts=[sb.Contact(sb.HertzContact(STIFFNESS), stop)],
        forces=[sb.ExternalForce(shape=[1.0], history=history)],
    )  # fmt: skip
    flow = Stroboscope(system, sb.Integration(accuracy="reference"))
    found = passage_of(flow, np.array(start) / flow.space.scales, 1)
    w = math.sqrt(1.0 - zeta**2)
    time = np.linspace(0.0, flow.period, 400_001)
    x = np.exp(-zeta * time) * (start[0] * np.cos(w * time) + (start[1] + zeta * start[0]) / w * np.sin(w * time))
    inner = x[1:-1]
    least = inner[(inner <= x[:-2]) & (inner < x[2:])].min()
    assert found.clearance == pytest.approx(1.0 + least, abs=1e-7)


def test_the_shift_is_the_exact_one() -> None:
    for share in (0.01, 0.3, 1.0, 3.0, 30.0, 1e3, 1e5):
        assert shift(share * OVERLAP) == pytest.approx(exact(share * OVERLAP), rel=1e-6)


def test_slopes_two_and_a_half_and_their_crossover() -> None:
    """2 far below p*, 1/2 far above; the two straight lines cross at 1.42 p*."""

    def slope(share: float) -> float:
        return math.log(shift(1.1 * share * OVERLAP) / shift(share / 1.1 * OVERLAP)) / (2.0 * math.log(1.1))

    assert slope(0.005) == pytest.approx(2.0, abs=3e-3)
    assert slope(1e4) == pytest.approx(0.5, abs=5e-3)
    assert slope(1.0) == pytest.approx(1.25, abs=0.06), "half way between the two, at p* itself"
    time = math.sqrt(OVERLAP / SWING)
    light = shift(0.005 * OVERLAP) / time / 0.005**2
    hard = shift(1e4 * OVERLAP) / time / math.sqrt(1e4)
    # first order in the force: 2.4/sqrt(2) B(7/2, 1/2); all of the flight beyond the stop is saved: 2 sqrt(2)
    assert light == pytest.approx(2.4 / math.sqrt(2.0) * beta(3.5, 0.5), rel=3e-3)
    assert hard == pytest.approx(2.0 * math.sqrt(2.0), rel=0.01)
    assert (hard / light) ** (2.0 / 3.0) == pytest.approx(1.42, abs=0.03)
