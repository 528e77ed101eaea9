"""Agreement with an independent solution of Eq. (11) over the first impacts.

Runs are chosen where the problem itself is well-conditioned; chaotic ones promise nothing to any integrator.
"""

from __future__ import annotations

import math
from functools import cache

import numpy as np
import pytest
from oracle import PaperBeam, Solution

import snapbeam as sb
from snapbeam.model import default_values

# modes, (Omega, V), cycles, error of w in b measured at the default step
CASES = [
    (1, (1.21, 0.18), 6, 1e-6),
    (1, (1.21, 0.05), 4, 2e-7),
    (1, (1.625, 0.3), 6, 7e-6),
    (1, (1.4, 0.02), 4, 3e-9),
    (2, (1.21, 0.18), 6, 6e-6),
    (2, (1.21, 0.05), 4, 1.6e-8),
    (2, (2.5, 0.2), 6, 5e-7),
    (2, (1.4, 0.02), 4, 1.4e-9),
    (8, (1.21, 0.18), 1, 4e-7),
    (8, (1.21, 0.05), 1, 4e-7),
    (8, (1.625, 0.3), 1, 2.5e-7),
    (8, (1.4, 0.02), 1, 4e-8),
]
DEAR = [
    (32, (1.21, 0.18), 2, 2.9e-7),
    (32, (1.21, 0.05), 2, 3e-7),
    (32, (1.625, 0.3), 2, 2.1e-7),
    (32, (1.4, 0.02), 2, 4.4e-8),
]
SAMPLES = 3000


@cache
def solved(modes: int, ratio: float, velocity: float, cycles: int) -> Solution:
    beam = PaperBeam(modes)
    end = 2.0 * math.pi * cycles / (ratio * float(beam.omega[0]))
    return beam.solve(ratio, velocity, np.linspace(0.0, end, SAMPLES))


@pytest.mark.sampled(2)
@pytest.mark.parametrize(
    ("modes", "pair", "cycles", "measured"),
    [*CASES, *(pytest.param(*case, marks=[pytest.mark.slow] if case[1][1] < 0.1 else []) for case in DEAR)],
)
def test_trajectory(modes, pair, cycles, measured) -> None:
    """The displacements at the shaker and at the centre, and every impact, at the default step."""
    truth = solved(modes, *pair, cycles)
    model = sb.ReducedModel.from_beam(default_values.BEAM, modes=modes)
    shaker = sb.Shaker(frequency_ratio=pair[0], velocity_amplitude=pair[1])
    # the two ends of the run differ by rounding
    times = truth.time * (1.0 - 1e-13)
    run = sb.simulate(
        sb.System(model, contacts=[sb.Contact(default_values.CONTACT, shaker)]),
        sb.Integration(cycles=cycles),
        sample_times=times,
    )
    bound = min(1e-3, 3.0 * measured)
    np.testing.assert_allclose(run.dataset.displacement_at_striker, truth.displacement, rtol=0.0, atol=bound)
    np.testing.assert_allclose(run.dataset.midspan_displacement, truth.midspan_displacement, rtol=0.0, atol=bound)

    assert run.impacts.sizes["impact"] == len(truth.impacts)
    onset, duration, peak = truth.impacts.T
    np.testing.assert_allclose(run.impacts.onset, onset, rtol=0.0, atol=8e-7 + 0.01 * bound)
    # the last may be cut by the end of the run; an impact of one mode is the least resolved: 0.8 %
    np.testing.assert_allclose(run.impacts.duration[:-1], duration[:-1], rtol=1e-2)
    np.testing.assert_allclose(run.impacts.peak_force[:-1], peak[:-1], rtol=3e-3)


@pytest.mark.parametrize(("modes", "pair", "cycles", "measured"), [CASES[0], CASES[4], CASES[8], DEAR[0]])
def test_reference_accuracy(modes, pair, cycles, measured) -> None:
    """Order 6 and short steps are closer by more than a hundred."""
    truth = solved(modes, *pair, cycles)
    model = sb.ReducedModel.from_beam(default_values.BEAM, modes=modes)
    shaker = sb.Shaker(frequency_ratio=pair[0], velocity_amplitude=pair[1])
    times = truth.time * (1.0 - 1e-13)
    run = sb.simulate(
        sb.System(model, contacts=[sb.Contact(default_values.CONTACT, shaker)]),
        sb.Integration(cycles=cycles, accuracy="reference"),
        sample_times=times,
    )
    error = np.abs(run.dataset.displacement_at_striker.values - truth.displacement).max()
    assert error < max(measured / 100.0, 1e-9)


@pytest.mark.parametrize(("modes", "pair", "cycles", "measured"), [*CASES[::2], DEAR[0]])
def test_statistics(integrate_ensemble, model_of, modes, pair, cycles, measured) -> None:
    """What an engine says of the same runs."""
    truth = solved(modes, *pair, cycles)
    found = integrate_ensemble(
        model_of(modes), frequency_ratio=pair[0], velocity_amplitude=pair[1], cycles=cycles
    ).statistics
    # of b: what a cubic through the flight steps may miss, and what may lie between two samples
    cubic, grid = 5e-5 + measured, 2e-3
    for name, values in (("displacement", truth.displacement), ("midspan_displacement", truth.midspan_displacement)):
        assert -cubic <= found[f"max_{name}"][0] - values.max() < grid
        assert -cubic <= values.min() - found[f"min_{name}"][0] < grid
    assert found["impacts"][0] == len(truth.impacts)
    assert found["contact_time_fraction"][0] == pytest.approx(truth.impacts[:, 1].sum() / truth.time[-1], rel=1e-2)
    assert found["peak_force"][0] == pytest.approx(truth.impacts[:, 2].max(), rel=3e-3)
    sign = np.sign(truth.midspan_displacement)
    assert found["zero_crossings"][0] == np.count_nonzero(sign[1:] != sign[:-1])
