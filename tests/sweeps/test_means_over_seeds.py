"""Means over the seeds of a random motion, in Python, in a figure and in the summary of a map."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats

import snapbeam as sb
from snapbeam.cli.summary import map_facts, map_summary
from snapbeam.util.proportions import mean_interval
from snapbeam.util.validation import InputError

AXES = {"base_excitation.rms_g": [0.1, 0.2, 0.3], "base_excitation.seed": [0, 1, 2, 3]}

BEAM = sb.Beam(length=0.161, thickness=4e-4, width=0.015, density=7850.0, young_modulus=200e9, buckling_level=3.35e-4)


@pytest.fixture(scope="module")
def shaken():
    motion = sb.RecordedAcceleration.from_psd([(20, 0.01), (200, 0.01)], duration_s=1.0, ramp_up_s=0.05)
    model = sb.ReducedModel.from_beam(BEAM, modes=1, damping_ratio=0.02)
    layers = sb.PiezoelectricHarvester(moment_per_volt=-1e-4, capacitance=1e-7, resistance=1e4)
    system = sb.System(model, base_excitation=sb.BaseExcitation(motion=motion), harvesters=[layers])
    return sb.sweep(system, AXES, sb.Integration(cycles=20))


def test_means_and_intervals_are_scipys(shaken) -> None:
    found = sb.mean_over_seeds(shaken, confidence=0.9)
    assert found.attrs["seeds"] == 4 and found["peak_voltage"].dims == ("base_excitation_rms_g",)
    values = shaken["peak_voltage"].values
    mean, work = values.mean(axis=1), shaken["base_work"].values
    limits = stats.t.interval(0.9, 3, np.log(mean), stats.sem(values, axis=1) / mean)  # of a positive statistic
    assert found["peak_voltage"].values == pytest.approx(mean)
    assert [found[f"peak_voltage_{end}"].values for end in ("low", "high")] == pytest.approx(np.exp(limits))
    limits = stats.t.interval(0.9, 3, work.mean(axis=1), stats.sem(work, axis=1))  # of one of either sign
    assert [found[f"base_work_{end}"].values for end in ("low", "high")] == pytest.approx(np.array(limits))
    assert found["snap"].values == pytest.approx((shaken["response_class"].values > 0).mean(axis=1))


def test_a_mean_with_a_missing_value_has_no_limits() -> None:
    mean, low, high = mean_interval([[1.0, np.nan, 3.0], [2.0, 2.0, 5.0], [np.nan] * 3])
    assert mean[:2].tolist() == [2.0, 3.0] and np.isnan(mean[2])
    assert low[0] == -np.inf and high[0] == np.inf and np.isfinite([low[1], high[1]]).all() and high[2] == np.inf
    assert mean_interval([4.0])[1] == -np.inf and mean_interval([4.0], positive=True)[1] == 0.0


def test_values_without_spread_have_no_interval() -> None:
    """Twelve runs with 0 N, or with one number that is no binary fraction, do not make the mean certain."""
    for values in ([0.0] * 12, [0.1] * 12, [-0.1] * 7):
        assert mean_interval(values)[1:] == (-np.inf, np.inf)
        assert mean_interval(values, positive=True)[1:] == (0.0, np.inf)
    mean, low, high = mean_interval([[0.1] * 3, [0.1, 0.1, 0.2]])
    assert np.isinf(high[0]) and low[1] < mean[1] < high[1] < np.inf


@pytest.mark.parametrize("runs", [4, 8, 16])
@pytest.mark.parametrize("kind", ["uniform", "exponential", "impacts in half of the runs"])
def test_the_interval_of_a_positive_mean_covers_it(kind: str, runs: int) -> None:
    """It is never negative, and contains the mean more often than Student's, which is too narrow above."""
    rng = np.random.default_rng(3)
    values = rng.random((20_000, runs)) if kind == "uniform" else rng.exponential(1.0, (20_000, runs))
    truth = 1.0 if kind == "exponential" else 0.5
    if kind.startswith("impacts"):
        values *= rng.random(values.shape) < 0.5
    mean, low, high = mean_interval(values, positive=True)
    known = mean > 0.0  # else no run hit, and nothing tells how hard one would
    covered = ((low <= truth) & (truth <= high))[known].mean()
    _, lower, upper = mean_interval(values[known])
    assert (low[known] > 0.0).all() and covered > 0.92
    assert covered >= ((lower <= truth) & (truth <= upper)).mean() - 0.002


def test_the_figure_and_the_summary_have_the_mean(shaken) -> None:
    """The highest single run is not reported, nor drawn."""
    best, mean = (float(each["harvested_power_last_quarter"].max()) for each in (shaken, sb.mean_over_seeds(shaken)))
    assert best > 1.05 * mean
    words = " ".join(str(each) for each in map_summary(shaken, []).renderables)
    assert "4 seeds" in words and f"{1e6 * mean:.4g} µW" in words and "95 % interval of the mean" in words
    ax = sb.plot.plot_statistic(shaken, "harvested_power_last_quarter")
    (line,) = (each for each in ax.lines if each.get_label() == "mean")
    drawn = np.asarray(line.get_ydata())
    assert drawn / drawn.max() == pytest.approx(
        shaken["harvested_power_last_quarter"].mean("base_excitation_seed") / mean
    )
    assert "seeds" in ax.get_ylabel() and len(ax.collections) == 1
    only = shaken.isel(base_excitation_rms_g=1)
    assert len(sb.plot.plot_statistic(only, "peak_voltage").lines[0].get_xdata()) == 4


def test_a_map_without_seeds_is_refused(shaken) -> None:
    with pytest.raises(InputError, match="no map with an axis of seeds"):
        sb.mean_over_seeds(shaken.isel(base_excitation_seed=0))


def test_curves_over_an_axis_have_an_interval_each(shaken) -> None:
    layers = shaken.expand_dims({"harvester_resistance": [1e3, 1e4, 1e5]}, -1).copy(deep=True)
    layers["harvester_resistance"].attrs["parameter"] = "harvester.resistance"
    layers["harvested_power"] = layers["harvested_power"] * layers["harvester_resistance"] ** 0.25
    layers["harvested_power"].attrs = shaken["harvested_power"].attrs
    means = sb.mean_over_seeds(layers)["harvested_power"]
    ax = sb.plot.plot_statistic(layers, "harvested_power", over="resistance")
    assert ax.get_xlabel().endswith("(Ω)")
    assert [each.get_label() for each in ax.lines] == ["0.1 g", "0.2 g", "0.3 g"] and len(ax.collections) == 3
    for at, line in enumerate(ax.lines):
        drawn = np.asarray(line.get_ydata(), dtype=float)
        assert drawn / drawn[0] == pytest.approx(means[at].values / float(means[at, 0]))
    ax = sb.plot.plot_statistic(layers, "harvested_power", over="base_excitation.rms_g")
    assert [each.get_label() for each in ax.lines] == ["$R$ = 1000 Ω", "$R$ = 10 kΩ", "$R$ = 100 kΩ"]
    with pytest.raises(InputError, match="is not an axis of the figure"):
        sb.plot.plot_statistic(layers, "harvested_power", over="beam.thickness")


def test_the_highest_value_of_the_json_has_its_interval(shaken) -> None:
    found, means = map_facts(shaken, "peak_voltage")["highest"], sb.mean_over_seeds(shaken)
    at = int(means["peak_voltage"].values.argmax())
    assert found["point"] == {"base_excitation_rms_g": AXES["base_excitation.rms_g"][at]}
    assert found["interval"] == [float(means[f"peak_voltage_{end}"][at]) for end in ("low", "high")]
