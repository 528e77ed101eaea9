"""Beams and points drawn anew from a seed, against an independent solution of each.

``pytest tests/conformance/test_random_beams.py -m slow --seed 7 --draws 200`` draws others.  What is said of the
accuracy in the documentation is what this prints: the shares of well-conditioned runs within the levels' errors.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
import pytest
from any_beam import AnyBeam, Endless, Numbers, drawn

import snapbeam as sb

pytestmark = pytest.mark.filterwarnings("ignore:b/r = :snapbeam.util.diagnostics.DiagnosticWarning")

WELL = 1e-10
"""Response to a relative change of the drive by 1e-13, of the buckling level, up to which a run is well-conditioned."""
LIMIT = {"standard": 1e-3, "reference": 1e-8}
CARRIED = 1e-8
"""What the reference and the independent solution are allowed, as a relative change of the drive, each."""


class Drawn(NamedTuple):
    """What came of one draw."""

    frequencies: float
    """Greatest relative difference of a natural frequency."""
    separation: float
    error: dict[str, float]
    words: str


def system_of(given: Numbers) -> sb.System:
    """The beam, and how it is struck."""
    beam = sb.Beam(
        length=given.length,
        thickness=given.thickness,
        width=given.width,
        density=given.density,
        young_modulus=given.young,
        buckling_level=given.level,
    )
    return sb.System(
        sb.ReducedModel.from_beam(beam, modes=given.modes, damping_ratio=given.damping_ratio),
        contacts=[
            sb.Contact(
                sb.HertzContact(stiffness=given.contact_stiffness),
                sb.Shaker(
                    frequency_ratio=given.frequency_ratio,
                    velocity_amplitude=given.velocity_amplitude,
                    location=given.location,
                ),
            )
        ],
    )


def solved(rng: np.random.Generator) -> Drawn | None:
    """One beam, by both; None where the independent solution does not get past a graze."""
    given = drawn(rng)
    own = AnyBeam(given)
    system = system_of(given)
    cycles = max(1, round(3.0 * given.frequency_ratio))
    end = 2.0 * math.pi * cycles / (given.frequency_ratio * float(own.omega[0]))
    times = np.linspace(0.0, end, 121)[1:] * (1.0 - 1e-12)
    try:
        truth = own.displacement(times)
    except Endless:
        return None
    error = {}
    for accuracy in LIMIT:
        run = sb.simulate(system, sb.Integration(cycles=cycles, accuracy=accuracy), sample_times=times)
        found = np.stack((run.dataset.displacement_at_striker.values, run.dataset.midspan_displacement.values), axis=1)
        error[accuracy] = float(np.abs(found - truth).max())
    return Drawn(
        float(np.abs(system.model.omega / own.omega - 1.0).max()),
        float(sb.perturbation_growth(system, sb.Integration(cycles=cycles)).separation[-1]),
        error,
        str(given),
    )


def judge(tried: list[Drawn | None]) -> None:
    """Of the well-conditioned runs 95 in 100 are within the limits of both levels, and all near them."""
    draws = [draw for draw in tried if draw is not None]
    assert len(draws) >= 0.98 * len(tried)
    well = [draw for draw in draws if draw.separation <= WELL]
    print(f"{len(well)} of {len(draws)} runs are well-conditioned")
    for accuracy, limit in LIMIT.items():
        worst = max(well, key=lambda draw: draw.error[accuracy])
        median = float(np.median([draw.error[accuracy] for draw in well]))
        print(f"{accuracy}: median error {median:.1e}, worst {worst.error[accuracy]:.1e} at {worst.words}")
        over = [draw for draw in well if draw.error[accuracy] > limit]
        print(f"{accuracy}: {len(over)} of {len(well)} beyond {limit:g}")
        assert len(over) <= 0.05 * len(well)
        for draw in over:
            assert draw.error[accuracy] <= max(5.0 * limit, CARRIED / 1e-13 * draw.separation), (accuracy, draw)
    assert max(draw.frequencies for draw in draws) < 1e-11


@pytest.mark.slow
def test_many_beams(request: pytest.FixtureRequest) -> None:
    rng = np.random.default_rng(int(request.config.getoption("--seed")))
    judge([solved(rng) for _ in range(int(request.config.getoption("--draws")))])


@pytest.mark.slow
def test_beams_with_up_to_forty_modes(request: pytest.FixtureRequest) -> None:
    """Level "standard" against level "reference": the independent solution takes too long with so many modes."""
    rng = np.random.default_rng(int(request.config.getoption("--seed")))
    errors = []
    for _ in range(int(request.config.getoption("--draws"))):
        given = drawn(rng, max_modes=40)
        system, cycles = system_of(given), max(1, round(3.0 * given.frequency_ratio))
        growth = sb.perturbation_growth(system, sb.Integration(cycles=cycles))
        if float(growth.separation[-1]) > WELL:
            continue
        end = cycles / (given.frequency_ratio * system.model.reference_frequency)
        times = np.linspace(0.0, end, 121)[1:] * (1.0 - 1e-12)
        runs = [
            sb.simulate(system, sb.Integration(cycles=cycles, accuracy=level), sample_times=times).dataset
            for level in LIMIT
        ]
        errors.append(
            max(
                float(np.abs(runs[0][name] - runs[1][name]).max())
                for name in ("displacement_at_striker", "midspan_displacement")
            )
        )
    beyond = [error for error in errors if error > LIMIT["standard"]]
    print(
        f"{len(errors)} well-conditioned: {len(beyond)} beyond 1e-3 b, median {np.median(errors):.1e}, worst {max(errors):.1e}"
    )
    assert len(beyond) <= 0.03 * len(errors)
    assert max(errors) < 10.0 * LIMIT["standard"]
