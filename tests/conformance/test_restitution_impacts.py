"""Impacts under a coefficient of restitution against an independent solution of one mode."""

from __future__ import annotations

import numpy as np
import pytest
from oracle import PaperBeam

import snapbeam as sb
from snapbeam.model import default_values


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(10))
def test_impacts_against_an_independent_solution(seed: int) -> None:
    """DOP853 with events, on the equation of the paper: onsets to 1e-7 s, the first impulses to 3e-5."""
    rng = np.random.default_rng(seed)
    coefficient, ratio = float(rng.uniform(0.5, 1.0)), float(rng.uniform(0.8, 4.0))
    velocity, location = float(rng.uniform(0.05, 0.65)), float(rng.uniform(0.25, 0.75))
    system = sb.System(
        sb.ReducedModel.from_beam(default_values.BEAM, modes=1),
        contacts=[
            sb.Contact(
                sb.Restitution(coefficient),
                sb.Shaker(frequency_ratio=ratio, velocity_amplitude=velocity, location=location),
            )
        ],
    )
    run = sb.simulate(system, sb.Integration(cycles=6), sample_times=[0.0])
    assert np.isnan(run.summary.peak_force), "an impact of no duration has no force"
    count = min(4, run.impacts.sizes["impact"])
    assert count > 0
    truth = PaperBeam(1).bounces(ratio, velocity, coefficient, location, count)
    np.testing.assert_allclose(run.impacts.onset[:count], truth[:, 0], rtol=0.0, atol=1e-7)
    np.testing.assert_allclose(run.impacts.impulse[:count], truth[:, 1], rtol=3e-5)
