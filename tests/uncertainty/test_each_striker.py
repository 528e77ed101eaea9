"""What one of several strikers does is asked for by its name: in sensitivities, goals and limits."""

from __future__ import annotations

import numpy as np
import pytest
from small import small_system

import snapbeam as sb
from snapbeam.model import default_values
from snapbeam.util.validation import InputError

GAP = 0.1 * default_values.BEAM.buckling_level
SPREAD = sb.uncertainty.ParameterUncertainty(of={"velocity_amplitude": sb.uncertainty.Normal(0.02, relative=True)})
HOW = sb.Integration(cycles=3, threads=1)


def between_two() -> sb.System:
    """The paper's beam under a stop."""
    one = small_system(3)
    stop = sb.Striker(drive=sb.FixedStop(), location=0.5, side="above", gap=GAP)
    return sb.System(
        one.model, contacts=[sb.Contact(default_values.CONTACT, one.striker), sb.Contact(default_values.CONTACT, stop)]
    )


@pytest.mark.slow
def test_a_statistic_of_one() -> None:
    """The effect of the drive on the stop's peak force is the difference of the runs a score up and down."""
    system = between_two()
    found = sb.uncertainty.sensitivity(system, "peak_force_contact_2", SPREAD, samples=2, integration=HOW)
    speed = system.get("drive.velocity_amplitude")
    ends = [
        sb.simulate(system.replace(**{"drive.velocity_amplitude": speed * share}), HOW).summary
        for share in (0.98, 1.02)
    ]
    wanted = [each.peak_force_contact_2 for each in ends]
    assert min(wanted) > 0.0 and wanted != [each.peak_force_contact_1 for each in ends]
    assert float(found["effect"][0]) == pytest.approx(0.5 * (wanted[1] - wanted[0]), rel=1e-6)
    assert found.attrs["quantity_units"] == "N" and found.attrs["quantity"] == "peak contact force, contact 2"


@pytest.mark.slow
def test_an_objective_and_a_constraint_of_one() -> None:
    """The estimate is the mean over the draws of that striker's peak force, not of the greater of both."""
    goal, limit = (
        sb.uncertainty.Objective(quantity="peak_force_contact_2"),
        sb.uncertainty.Constraint(quantity="impacts_contact_1", lower=1.0, probability=0.5),
    )
    problem = sb.uncertainty.design_problem(
        between_two(), {"velocity_amplitude": (0.1, 0.3)}, goal, limit, SPREAD, integration=HOW, samples=8
    )
    numbers = np.arange(8)
    estimate = problem.estimate([0.2], numbers)
    runs = problem.runs_of(np.array([[0.2]]), numbers)[0]
    assert estimate.objectives[0, 0] == pytest.approx(runs["peak_force_contact_2"].mean(), rel=1e-12)
    assert not np.array_equal(runs["peak_force_contact_2"], runs["peak_force"])
    assert goal.long_name == "mean peak contact force, contact 2" and goal._quantity.unit == "N"


def test_who_is_not_there_is_refused() -> None:
    with pytest.raises(InputError, match="1 striker;"):
        sb.uncertainty.sensitivity(small_system(), "peak_force_contact_2", SPREAD, integration=HOW)
    with pytest.raises(InputError, match="2 strikers"):
        sb.uncertainty.optimize_design(
            between_two(), {"velocity_amplitude": (0.1, 0.3)}, "peak_force_contact_3", [], SPREAD
        )
    with pytest.raises(InputError, match="statistic"):
        sb.uncertainty.sensitivity(between_two(), "peak_force_contact_0", SPREAD, integration=HOW)


def test_the_only_striker_is_the_first() -> None:
    """Its statistics are those of the whole, by either name, in every place that takes a statistic."""
    system = small_system()
    run = sb.simulate(system, HOW).summary
    assert run.peak_force_contact_1 == run["peak_force_contact_1"] == run.peak_force > 0.0
    assert "peak_force_contact_1" not in list(run)
    effects = [
        sb.uncertainty.sensitivity(system, name, SPREAD, samples=2, integration=HOW)["effect"].values
        for name in ("impulse", "impulse_contact_1")
    ]
    np.testing.assert_array_equal(*effects)
    chance = [
        sb.uncertainty.probability_map(
            system, {"velocity_amplitude": [0.2]}, SPREAD, 4, outcomes=f"{name} > {run.peak_force} N", integration=HOW
        )["probability"].values
        for name in ("peak_force", "peak_force_contact_1")
    ]
    np.testing.assert_array_equal(*chance)
    one, other = (sb.uncertainty.gradient(system, name, "damping_ratio", integration=HOW)
                  for name in ("impulse", "impulse_contact_1"))  # fmt: skip
    assert one.equals(other)
    found = sb.sweep(system, {"velocity_amplitude": [0.1, 0.2], "frequency_ratio": [0.7, 0.9]}, HOW)
    label = sb.plot.plot_statistic(found, "peak_force").get_figure().axes[-1].get_ylabel()
    assert sb.plot.plot_statistic(found, "peak_force_contact_1").get_figure().axes[-1].get_ylabel() == label
    alone = sb.System(system.model, base_excitation=sb.BaseExcitation(motion=sb.Shock(acceleration_g=5, duration_ms=1)))
    with pytest.raises(InputError, match="0 strikers"):
        sb.uncertainty.sensitivity(alone, "peak_force_contact_1", SPREAD, integration=HOW)


@pytest.mark.slow
def test_they_are_told_in_words() -> None:
    """Wherever a statistic is shown, the second striker's has its unit and its words."""
    found = sb.simulate(between_two(), HOW).summary
    line = next(each for each in found.to_text().splitlines() if each.startswith("peak_force_contact_2"))
    assert line.endswith("peak contact force, contact 2") and " N " in line
    assert "peak_force_contact_2" in sb.STATISTICS and "peak_force_contact_2" not in list(sb.STATISTICS)
    assert sb.STATISTICS.get("impulse_contact_4").unit == "N s"
    assert sb.STATISTICS.get("response_contact_2") is None
    with pytest.raises(KeyError):
        sb.STATISTICS["impacts_contact_x"]
