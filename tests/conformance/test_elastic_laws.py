"""Elastic contacts beside Hertz's: springs, powers and a layer between a sphere and the beam."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest
from extended_oracle import Tip, differences, follow, missing
from oracle import LEVEL, PaperBeam
from scipy.optimize import brentq

import snapbeam as sb
from snapbeam.model import default_values

RATIO, VELOCITY = 1.21, 0.18


def through_a_layer(depth: float, _: float) -> float:
    """The force under which Hertz's contact and the layer together give way by as much, as a root of that sum."""
    if depth <= 0.0:
        return 0.0

    def left(root: float) -> float:
        return (root * root / 4e8) ** (2.0 / 3.0) + root / math.sqrt(1e10) - depth

    most = math.sqrt(min(4e8 * depth**1.5, 1e10 * depth**2))
    return float(brentq(left, 0.0, most, xtol=1e-14 * most, rtol=1e-15)) ** 2


LAWS: dict[str, tuple[sb.ContactLaw, Callable[[float, float], float]]] = {
    "spring": (sb.PowerLaw.from_stiffness(2e6, 1.0), lambda d, _: 2e6 * d),
    "cone": (sb.PowerLaw.from_stiffness(4e11, 2.0), lambda d, _: 4e11 * d * d),
    "power 3.5": (sb.PowerLaw.from_stiffness(1e18, 3.5), lambda d, _: 1e18 * max(d, 0.0) ** 3.5),
    "layer": (sb.LayeredHertz(stiffness=4e8, layer_stiffness=1e10), through_a_layer),
}
CYCLES = {1: 3, 3: 2, 8: 1}


@pytest.mark.slow
@pytest.mark.parametrize("modes", CYCLES)
@pytest.mark.parametrize("name", LAWS)
def test_against_an_independent_solution(name: str, modes: int) -> None:
    """1e-3 b at level *standard*, 1e-7 b at level *reference*, and a ledger that closes to 1e-4 of the gross work."""
    law, force = LAWS[name]
    beam, cycles = PaperBeam(modes), CYCLES[modes]
    first = float(beam.omega[0])
    omega, stroke = RATIO * first, VELOCITY * LEVEL / RATIO
    times = np.linspace(0.0, 2.0 * math.pi * cycles / omega, 801) * (1.0 - 1e-13)
    tip = Tip(lambda t, _: (stroke * math.sin(omega * t), stroke * omega * math.cos(omega * t)), force)
    truth = follow(beam, tip, times)
    model = sb.ReducedModel.from_beam(default_values.BEAM, modes=modes)
    shaker = sb.Shaker(frequency_ratio=RATIO, velocity_amplitude=VELOCITY)
    for accuracy, bound in (("standard", 1e-3), ("reference", 1e-7)):
        run = sb.simulate(
            sb.System(model, contacts=[sb.Contact(law, shaker)]),
            sb.Integration(cycles=cycles, accuracy=accuracy),
            sample_times=times,
        )
        data = run.dataset
        worst = differences(data, truth)
        print(name, modes, accuracy, worst)
        assert max(worst.values()) < bound, worst
        assert missing(data) < 1e-4
    assert run.summary.impacts > 0
