"""Probabilities that statistics exceed values, means and quantiles: against runs of each sample, one by one."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats
from small import small_system

import snapbeam as sb
from snapbeam.uncertainty.monte_carlo import outcome_named
from snapbeam.util.validation import InputError, InputTypeError

U = sb.uncertainty
SPREAD = U.ParameterUncertainty(
    of={
        "contact.stiffness": U.LogNormal(0.3),
        "beam.buckling_level": U.Normal(0.03, relative=True),
        "velocity_amplitude": U.Normal(0.05, relative=True),
    }
)
HOW = sb.Integration(cycles=12, threads=1)
AXES = {"velocity_amplitude": [0.08, 0.2]}
COUNT = 24


@pytest.fixture(scope="module")
def one_by_one() -> list[list[sb.Run]]:
    system = small_system()
    return [
        [
            sb.simulate(each, HOW)
            for each in U.sample_systems(system.replace(**{"drive.velocity_amplitude": v}), SPREAD, COUNT)
        ]
        for v in AXES["velocity_amplitude"]
    ]


def test_fractions_means_and_quantiles_are_those_of_the_runs(one_by_one) -> None:
    force = np.array([[run.summary.peak_force for run in runs] for runs in one_by_one])
    metres = np.array(
        [[run.summary.peak_midspan_displacement * run.system.scale.length for run in runs] for runs in one_by_one]
    )
    limit, reach = float(np.median(force)), float(np.quantile(metres, 0.6))
    asked = [f"peak_force > {limit:.17g}", f"peak_midspan_displacement<{1e6 * reach:.17g} um"]
    ds = U.probability_map(
        small_system(), AXES, SPREAD, COUNT, outcomes=asked, statistics=["peak_force", "peak_midspan_displacement"],
        quantiles=(0.1, 0.5), integration=HOW,
    )  # fmt: skip
    assert (ds["runs"] == COUNT).all()
    above, below = ds["probability"].values[:, -2:].T
    assert above == pytest.approx((force > limit).mean(axis=1)) and below == pytest.approx(
        (metres < reach).mean(axis=1)
    )
    low, high = stats.binomtest(int((force[0] > limit).sum()), COUNT).proportion_ci(0.95, method="wilson")
    assert ds["probability_low"].values[0, -2] == pytest.approx(low)
    assert ds["probability_high"].values[0, -2] == pytest.approx(high)
    for name, values in (("peak_force", force), ("peak_midspan_displacement", metres)):
        assert ds[name].values == pytest.approx(values.mean(axis=1), rel=1e-9)
        mean = values.mean(axis=1)
        ends = np.exp(stats.t.interval(0.95, COUNT - 1, np.log(mean), stats.sem(values, axis=1) / mean))
        assert np.array([ds[f"{name}_low"], ds[f"{name}_high"]]) == pytest.approx(np.array(ends), rel=1e-9)
        found = ds[f"{name}_quantile"].values
        assert found == pytest.approx(np.quantile(values, (0.1, 0.5), axis=1, method="inverted_cdf").T, rel=1e-9)
    assert ds["peak_midspan_displacement"].attrs["units"] == "m"


def test_runs_do_not_end_early_where_a_statistic_is_asked_for() -> None:
    """Over many cycles a run whose end is certain would end early, with fewer impacts."""
    many = sb.Integration(cycles=60, early_termination=True)
    system = small_system().replace(**{"drive.velocity_amplitude": 0.55})
    ds = U.probability_map(system, {"velocity_amplitude": [0.55]}, SPREAD, 4, statistics="impacts", integration=many)
    runs = [sb.simulate(each, sb.Integration(cycles=60)) for each in U.sample_systems(system, SPREAD, 4)]
    assert float(ds["impacts"].item()) == np.mean([run.summary.impacts for run in runs])


def test_a_quantity_given_as_an_object_is_of_whole_runs() -> None:
    """The statistic by name and as an object gives the same; the object's runs ended early."""
    system, how = small_system().replace(**{"drive.velocity_amplitude": 0.55}), sb.Integration(cycles=60)
    spread = U.ParameterUncertainty(of={"contact.stiffness": U.LogNormal(0.3)})
    found = [
        U.sensitivity(system, each, spread, samples=2, integration=how)["effect"].values
        for each in ("impulse", U.StatisticQoI("impulse"))
    ]
    assert found[0] == pytest.approx(found[1], rel=1e-12)


def test_the_threshold_of_a_force(one_by_one) -> None:
    """The amplitude at which the peak force exceeds a value in half of the runs lies where the counted fraction crosses a half."""
    force = np.median([[run.summary.peak_force for run in runs] for runs in one_by_one], axis=1)
    asked = f"peak_force > {force.mean():.6g} N"
    options = U.QuantileSearchSettings(probabilities=(0.5,), runs=80, outcome=asked)
    bounds = (0.08, 0.2)
    th = U.quantile_threshold(small_system(), "velocity_amplitude", bounds, None, SPREAD, options, integration=HOW)
    at = [float(th["threshold_low"].item()), float(th["threshold_high"].item())]
    assert bounds[0] < at[0] < float(th["threshold"].item()) < at[1] < bounds[1]
    ds = U.probability_map(
        small_system(), {"velocity_amplitude": at}, SPREAD, 40, outcomes=asked, integration=HOW
    ).sel(outcome=asked)  # fmt: skip
    assert float(ds["probability_low"][0]) < 0.5 < float(ds["probability_high"][1])


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ("peak_force", "or a statistic beyond a value"),
        ("peak_force > 60 m", "must be in N"),
        ("peak_force > 60 per cent", "peak_force > 60 per cent"),
        ("peak_displacement > 3 N", "must be in m"),
        ("response_class > 1", "peak_force"),
        ("peak_force_contact_2 > 1 N", "several"),
        ("peak_force > inf", "not a number"),
    ],
)
def test_refused_outcomes(given: str, words: str) -> None:
    with pytest.raises(InputError, match=words):
        U.probability_map(small_system(), AXES, SPREAD, 4, outcomes=given, integration=HOW)


def test_names_are_written_one_way() -> None:
    assert outcome_named("  peak_force>60N ")[0] == "peak_force > 60N"
    assert U.SamplingPlan(outcome="peak_force>=1 kN").outcome == "peak_force >= 1 kN"
    with pytest.raises(InputTypeError):
        outcome_named(3)
    for quantiles in ((), (0.5, 0.5), 1.0):
        with pytest.raises(InputError, match="quantiles"):
            U.probability_map(small_system(), AXES, SPREAD, 4, statistics="impacts", quantiles=quantiles)
