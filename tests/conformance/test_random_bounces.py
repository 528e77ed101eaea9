"""Newton's law of impact at random: coefficients from 0 to 1, slow and fast drives, chatter, against bouncing.py.

``pytest tests/conformance/test_random_bounces.py -m slow -s --seed 7 --draws 2000`` draws others and prints what the
documentation says of them.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
import pytest
from bouncing import Bouncer

import snapbeam as sb
from snapbeam.model import default_values

MODEL = sb.ReducedModel.from_beam(default_values.BEAM, 1, damping_ratio=0.005)
LIMIT = {"standard": 1e-6, "reference": 1e-9}
CARRIED = {"standard": 2e-8, "reference": 1e-10}
"""What a level is allowed as a relative change of the drive, where a run is sensitive; at level reference 5.6e-11 measured, a 29th
of it with half the step, and a 2200th with a quarter."""
CHAOTIC = 1e-7
"""Response to a relative change of the drive by 1e-13, of the buckling level, from which cycles are not compared."""
_A_CYCLE = 64
"""Times at which a cycle is compared."""


class Bounced(NamedTuple):
    """One run."""

    separation: np.ndarray
    """Response to a relative change of the drive by 1e-13, up to the end of each cycle, of the buckling level."""
    error: dict[str, np.ndarray]
    """Largest in each cycle, by level, of the buckling level."""
    words: str


class Drawn(NamedTuple):
    """What is struck how."""

    coefficient: float
    ratio: float
    velocity: float
    location: float


def drawn(rng: np.random.Generator) -> Drawn:
    """Any coefficient from 0 to 1, with those at which much happens more often, and any point; one in ten is slow."""
    coefficient = float(rng.choice([0.0, 0.02, 0.1, 0.3, 0.7, 0.9, 1.0, rng.uniform()]))
    ratio, velocity = float(rng.uniform(0.1, 4.0)), float(rng.uniform(0.02, 0.65))
    location = float(rng.uniform(0.2, 0.5))
    if rng.uniform() < 0.1:
        ratio = 0.01
    return Drawn(coefficient, ratio, velocity, location)


def bounced(of: Drawn) -> Bounced:
    """One run at both levels, against the oracle; no impulse of it pulls."""
    coefficient, ratio, velocity, location = of
    cycles = 1 if ratio < 0.2 else max(2, round(8.0 * ratio))
    own = Bouncer(ratio, velocity, coefficient, location)
    times = np.linspace(0.0, cycles * 2.0 * math.pi / own.omega, _A_CYCLE * cycles + 1)[1:] * (1.0 - 1e-12)
    truth = own.run(times)
    system = sb.System(
        MODEL,
        contacts=[
            sb.Contact(
                sb.Restitution(coefficient),
                sb.Shaker(frequency_ratio=ratio, velocity_amplitude=velocity, location=location),
            )
        ],
    )
    words = f"e {coefficient:.4g}, Omega {ratio:.4g}, V {velocity:.4g}, x {location:.4g}, {truth.hits} hits"
    error = {}
    for level in LIMIT:
        run = sb.simulate(system, sb.Integration(cycles=cycles, accuracy=level), sample_times=times)
        off = np.abs(run.dataset.displacement_at_striker.values - truth.displacement)
        error[level] = off.reshape(cycles, _A_CYCLE).max(axis=1)
        impulse = run.impacts.impulse.values
        assert not impulse.size or np.nanmin(impulse) >= 0.0, words
    change = sb.perturbation_growth(system, sb.Integration(cycles=cycles))
    ends = np.searchsorted(change.cycle.values, np.arange(1, cycles + 1) - 1e-6)
    return Bounced(change.separation.values[ends], error, words)


def judge(runs: list[Bounced]) -> None:
    """Within the limits, or what the conditioning makes of a tiny change of the drive; the figures are printed."""
    regular = [run.separation <= CHAOTIC for run in runs]
    cycles, compared = sum(r.size for r in regular), sum(int(r.sum()) for r in regular)
    print(f"{compared} of {cycles} cycles are compared, {sum(r.all() for r in regular)} of {len(runs)} runs whole")
    beyond = []
    for level, limit in LIMIT.items():
        errors = np.concatenate([run.error[level][here] for run, here in zip(runs, regular, strict=True)])
        print(
            f"{level}: median {np.median(errors):.1e}; {(errors > limit).sum()} cycles beyond {limit:g}, "
            f"worst {errors.max():.1e}"
        )
        for run, here in zip(runs, regular, strict=True):
            allowed = np.maximum(limit, CARRIED[level] / 1e-13 * run.separation)
            if np.any(here & ~(run.error[level] <= allowed)):
                first = int(np.argmax(here & ~(run.error[level] <= allowed)))
                beyond.append((level, run.words, first + 1, run.error[level][first], run.separation[first]))
    print(*beyond, sep="\n")
    assert not beyond


@pytest.mark.slow
def test_many_bounces(request: pytest.FixtureRequest) -> None:
    rng = np.random.default_rng(int(request.config.getoption("--seed")))
    judge([bounced(drawn(rng)) for _ in range(int(request.config.getoption("--draws")))])
