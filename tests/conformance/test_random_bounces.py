"""Newton's law of impact at random: coefficients from 0 to 1, slow and fast drives, chatter, against bouncing.py.

``pytest tests/conformance/test_random_bounces.py -m slow -s --seed 7 --draws 2000`` draws others and prints what the
documentation says of them.
"""

from __future__ import annotations

import math

import numpy as np
import pytest
from bouncing import Bouncer

import snapbeam as sb
from snapbeam import paper

MODEL = sb.ReducedModel.from_beam(paper.BEAM, 1, damping_ratio=0.005)
LIMIT = {"map": 1e-6, "reference": 1e-9}
CARRIED = {"map": 1e-8, "reference": 1e-11}
"""What a level is allowed as a relative change of the drive, where a run is sensitive."""
CHAOTIC = 1e-7
"""Response to a relative change of the drive by 1e-13, of the buckling level, from which runs are not compared."""


def bounced(rng: np.random.Generator) -> tuple[float, dict[str, float], str]:
    """Conditioning of one run, its error at each level, and what it was; no impulse of it pulls."""
    coefficient = float(rng.choice([0.0, 0.02, 0.1, 0.3, 0.7, 0.9, 1.0, rng.uniform()]))
    ratio, velocity = float(rng.uniform(0.1, 4.0)), float(rng.uniform(0.02, 0.65))
    location = float(rng.uniform(0.2, 0.5))
    if rng.uniform() < 0.1:
        ratio = 0.01
    cycles = 1 if ratio < 0.2 else max(1, round(2.0 * ratio))
    own = Bouncer(ratio, velocity, coefficient, location)
    times = np.linspace(0.0, cycles * 2.0 * math.pi / own.omega, 201)[1:] * (1.0 - 1e-12)
    truth = own.run(times)
    system = sb.System(
        MODEL,
        contact=sb.Restitution(coefficient),
        striker=sb.Shaker(frequency_ratio=ratio, velocity_amplitude=velocity, location=location),
    )
    words = f"e {coefficient:.3f}, Omega {ratio:.3f}, V {velocity:.3f}, x {location:.3f}, {truth.hits} hits"
    error = {}
    for level in LIMIT:
        run = sb.simulate(system, sb.Integration(cycles=cycles, accuracy=level), sample_times=times)
        error[level] = float(np.abs(run.dataset.displacement.values - truth.displacement).max())
        impulse = run.impacts.impulse.values
        assert not impulse.size or np.nanmin(impulse) >= 0.0, words
    return float(sb.conditioning(system, cycles).separation[-1]), error, words


def judge(runs: list[tuple[float, dict[str, float], str]]) -> None:
    """Within the limits, or what the conditioning makes of a tiny change of the drive; the figures are printed."""
    regular = [run for run in runs if run[0] <= CHAOTIC]
    print(f"{len(regular)} of {len(runs)} runs are compared")
    for level, limit in LIMIT.items():
        median = float(np.median([error[level] for _, error, _ in regular]))
        outside = [run for run in regular if run[1][level] > limit]
        print(
            f"{level}: median {median:.1e}; {len(outside)} beyond {limit:g}, worst {max(outside, default=None)}"
        )
        for separation, error, words in regular:
            assert error[level] <= max(limit, CARRIED[level] / 1e-13 * separation), (
                level,
                separation,
                error,
                words,
            )


def test_some_bounces() -> None:
    rng = np.random.default_rng(2026)
    judge([bounced(rng) for _ in range(12)])


@pytest.mark.slow
def test_many_bounces(request: pytest.FixtureRequest) -> None:
    rng = np.random.default_rng(int(request.config.getoption("--seed")))
    judge([bounced(rng) for _ in range(int(request.config.getoption("--draws")))])
