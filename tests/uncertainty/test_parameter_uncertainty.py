"""Draws: numbered, the same whatever else is drawn, correlated as asked, refused where they make no system."""

from __future__ import annotations

import math

import numpy as np
import pytest
from small import small_system

import snapbeam as sb
from snapbeam.uncertainty.distributions import uncertainty_from_mapping
from snapbeam.uncertainty.monte_carlo import trials_of
from snapbeam.util.validation import InputError

NUMBERS = np.arange(4000)


def test_draws_hang_on_their_number_alone() -> None:
    spread = sb.uncertainty.ParameterUncertainty(
        of={"contact.stiffness": sb.uncertainty.LogNormal(0.2), "location": sb.uncertainty.Normal(1e-3)}, seed=3
    )
    turned = sb.uncertainty.ParameterUncertainty(
        of={"location": sb.uncertainty.Normal(1e-3), "contact.stiffness": sb.uncertainty.LogNormal(0.2)}, seed=3
    )
    whole = spread.normals(NUMBERS[:50])
    np.testing.assert_array_equal(spread.normals(np.array([41, 7, 41])), whole[[41, 7, 41]])
    np.testing.assert_array_equal(turned.normals(NUMBERS[:50])[:, ::-1], whole)


@pytest.mark.parametrize(
    ("each", "mean", "sd"),
    [
        (sb.uncertainty.Normal(0.02, relative=True), 0.2, 0.004),
        (sb.uncertainty.Normal(0.01), 0.2, 0.01),
        (sb.uncertainty.UniformTolerance(0.1, relative=True), 0.2, 0.02 / math.sqrt(3.0)),
        (sb.uncertainty.LogNormal(0.1), 0.2 * math.exp(0.005), 0.2 * math.exp(0.005) * math.sqrt(math.expm1(0.01))),
        (sb.uncertainty.UniformRange(0.1, 0.5), 0.3, 0.4 / math.sqrt(12.0)),
    ],
)
def test_moments(each, mean: float, sd: float) -> None:
    spread = sb.uncertainty.ParameterUncertainty(of={"velocity_amplitude": each})
    values = each.at(np.full(NUMBERS.size, 0.2), spread.normals(NUMBERS)[:, 0])
    assert values.mean() == pytest.approx(mean, abs=4.0 * sd / math.sqrt(NUMBERS.size))
    assert values.std() == pytest.approx(sd, rel=0.05)


def test_correlation() -> None:
    of = {
        "beam.thickness": sb.uncertainty.Normal(1e-6),
        "beam.buckling_level": sb.uncertainty.Normal(1e-6),
        "location": sb.uncertainty.Normal(0.01),
    }
    matrix = np.array([[1.0, -0.8, 0.0], [-0.8, 1.0, 0.0], [0.0, 0.0, 1.0]])
    scores = sb.uncertainty.ParameterUncertainty(of=of, correlation=matrix, phase=True).normals(NUMBERS)
    np.testing.assert_allclose(np.corrcoef(scores.T)[:3, :3], matrix, atol=0.06)
    assert scores.shape == (NUMBERS.size, 4)


def test_sampled_systems_are_the_samples_of_their_numbers() -> None:
    """Each has the values of its number, the same frequency in Hz, and a start of its own."""
    system = small_system()
    spread = sb.uncertainty.ParameterUncertainty(
        of={"beam.buckling_level": sb.uncertainty.Normal(0.02, relative=True)}, displacement=1e-6, seed=5
    )
    drawn = sb.uncertainty.sample_systems(system, spread, 4)
    level = system.get("beam.buckling_level") * (1.0 + 0.02 * spread.normals(np.arange(4))[:, 0])
    np.testing.assert_allclose([each.get("beam.buckling_level") for each in drawn], level, rtol=1e-12)
    hertz = [each.get("drive.frequency_ratio") * each.model.reference_frequency for each in (system, *drawn)]
    np.testing.assert_allclose(hertz, hertz[0], rtol=1e-12)
    starts = [each.start_state.amplitude for each in drawn]
    assert len({tuple(each) for each in starts}) == 4
    again = sb.uncertainty.sample_systems(system, spread, 2)
    np.testing.assert_array_equal([each.start_state.amplitude for each in again], starts[:2])
    with pytest.raises(InputError, match="count = 0"):
        sb.uncertainty.sample_systems(system, spread, 0)


def test_hz_and_metres_per_second_are_held() -> None:
    """A beam buckled further has a higher first frequency: the same shaker strikes it at another ratio."""
    system = small_system()
    spread = sb.uncertainty.ParameterUncertainty(of={"beam.buckling_level": sb.uncertainty.Normal(0.02, relative=True)})
    numbers = np.arange(5)
    points = {"drive.frequency_ratio": np.full(5, 1.3)}
    for held in ("physical", "normalised"):
        trials = trials_of(system, sb.uncertainty.ParameterUncertainty(of=spread.of, hold_fixed=held), None)
        found = trials.columns(points, numbers)
        hz, speed = [], []
        for i in range(5):
            drawn = system.replace(**{"beam.buckling_level": found["beam.buckling_level"][i]})
            hz.append(found["drive.frequency_ratio"][i] * drawn.scale.omega / (2.0 * math.pi))
            ratio = found.get("drive.velocity_amplitude", np.full(5, system.get("drive.velocity_amplitude")))[i]
            speed.append(ratio * drawn.scale.omega * drawn.scale.length)
        nominal = 1.3 * system.scale.omega / (2.0 * math.pi)
        assert (np.ptp(hz) < 1e-9 * nominal) == (held == "physical")
        if held == "physical":
            np.testing.assert_allclose(hz, nominal, rtol=1e-12)
            np.testing.assert_allclose(
                speed, system.get("drive.velocity_amplitude") * system.scale.omega * system.scale.length, rtol=1e-12
            )


def test_a_ringing_start_never_presses_the_tip() -> None:
    """Beside a tip that is drawn back, nothing touches at the start: an overlap would shoot the beam away."""
    system = small_system(velocity_amplitude=0.001)
    trials = trials_of(
        system, sb.uncertainty.ParameterUncertainty(displacement=5e-6, phase=True), sb.Integration(cycles=2)
    )
    found = trials.statistics({"drive.velocity_amplitude": np.full(200, 0.001)}, np.arange(200))
    assert (found["response_class"] == sb.ResponseClass.INTRAWELL).all()
    assert found["peak_force"].max() < 1.0


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: sb.uncertainty.ParameterUncertainty(of={"beam.thicknes": sb.uncertainty.Normal(1.0)}), "thickness"),
        (lambda: sb.uncertainty.ParameterUncertainty(of={"beam.thickness": 0.01}), "distribution"),
        (
            lambda: sb.uncertainty.ParameterUncertainty(of={"model.modes": sb.uncertainty.Normal(1.0)}),
            "cannot be uncertain",
        ),
        (
            lambda: sb.uncertainty.ParameterUncertainty(of={"integration.step": sb.uncertainty.Normal(1.0)}),
            "cannot be uncertain",
        ),
        (
            lambda: sb.uncertainty.ParameterUncertainty(of={"drive.phase": sb.uncertainty.Normal(1.0)}, phase=True),
            "one of the two",
        ),
        (
            lambda: sb.uncertainty.ParameterUncertainty(
                of={"location": sb.uncertainty.Normal(0.1)}, correlation=[[1.0, 0.2], [0.2, 1.0]]
            ),
            "shape",
        ),
        (lambda: sb.uncertainty.ParameterUncertainty(displacement=-1.0), "displacement"),
        (lambda: sb.uncertainty.ParameterUncertainty(hold_fixed="hz"), "hold_fixed"),
        (lambda: sb.uncertainty.Normal(0.0), "standard_deviation"),
        (lambda: sb.uncertainty.UniformRange(2.0, 1.0), "less than high"),
    ],
)
def test_refusals(make, words: str) -> None:
    with pytest.raises(InputError, match=words):
        make()


def test_draws_out_of_range_are_refused() -> None:
    trials = trials_of(
        small_system(), sb.uncertainty.ParameterUncertainty(of={"location": sb.uncertainty.Normal(0.5)}), None
    )
    with pytest.raises(InputError, match="out of range"):
        trials.columns({}, np.arange(100))


def test_files() -> None:
    table = {
        "beam": {"thickness": {"normal": 0.01, "relative": True}},
        "drive.velocity_amplitude": {"uniform": 0.02},
        "contact.stiffness": {"lognormal": 0.3},
        "phase": True,
        "seed": 4,
    }
    spread = uncertainty_from_mapping(table)
    assert spread.of["beam.thickness"] == sb.uncertainty.Normal(0.01, relative=True)
    assert spread.of["contact.stiffness"] == sb.uncertainty.LogNormal(0.3)
    assert spread.parameters[-1] == "drive.phase" and spread.seed == 4
    for bad in ({"beam.thickness": {"normal": 1.0, "uniform": 2.0}}, {"beam.thickness": 3.0}, {"phases": True}):
        with pytest.raises(InputError):
            uncertainty_from_mapping(bad)


def test_a_width_that_is_meant_as_a_share_names_relative() -> None:
    """5 % of a thickness, written as 0.05, is 50 mm."""
    written = uncertainty_from_mapping({"beam.thickness": {"uniform": 0.05}})
    with pytest.raises(InputError, match=r"0\.05 m is in the unit of the parameter; .* set relative = true"):
        trials_of(small_system(), written, None).columns({}, NUMBERS[:50])
