"""Quantile thresholds: the limiting distribution, coverage, bias, falling probabilities, the quasi-static threshold."""

from __future__ import annotations

import numpy as np
import pytest
from small import small_system

import snapbeam as sb
from snapbeam.uncertainty.quantiles import critical, crossing, isotonic, local_crossing, rises, search, spans
from snapbeam.util.validation import InputError

LEVELS = np.array([0.05, 0.5, 0.95])
MIDDLE, SCALE = 0.4, 0.05
TRUE = MIDDLE + SCALE * np.log(LEVELS / (1.0 - LEVELS))


def logistic(v):
    return 1.0 / (1.0 + np.exp(-(v - MIDDLE) / SCALE))


def runs_of(truth, seed: int, runs: int, rounds: int = 4):
    generator = np.random.default_rng(seed)

    def ask(columns, values, numbers):
        return generator.random(values.size) < truth(values), np.zeros(values.size, dtype=bool)

    return search(ask, 1, (0.0, 1.0), sb.uncertainty.QuantileSearchSettings(runs=runs, rounds=rounds, seed=seed))[0]


def test_the_limiting_distribution_is_that_of_single_runs() -> None:
    """The statistic of 1500 sets of 300 runs, against the published quantiles."""
    generator = np.random.default_rng(1)
    found = []
    for _ in range(1500):
        v = np.sort(generator.random(300))
        hits = (generator.random(300) < v).astype(float)
        at = int(np.searchsorted(v, 0.5))
        held = np.concatenate([np.minimum(isotonic(hits[:at]), 0.5), np.maximum(isotonic(hits[at:]), 0.5)])
        best = isotonic(hits)
        with np.errstate(divide="ignore", invalid="ignore"):
            logs = [np.nansum(np.where(hits == 1.0, np.log(p), np.log1p(-p))) for p in (best, held)]
        found.append(2.0 * (logs[0] - logs[1]))
    for confidence in (0.5, 0.8, 0.95):
        assert (np.array(found) <= critical(confidence)).mean() == pytest.approx(confidence, abs=0.03)


def test_isotonic_by_hand() -> None:
    np.testing.assert_allclose(isotonic([0, 1, 0, 1, 1]), [0.0, 0.5, 0.5, 1.0, 1.0])
    value, low, high = crossing([3.0, 1.0, 2.0, 4.0], [1, 0, 0, 1], 0.5)
    assert value == 2.5 and low <= 2.0 and high >= 3.0
    assert crossing([1.0, 2.0], [0, 0], 0.5).value == np.inf
    assert crossing([1.0, 2.0], [1, 1], 0.5).value == -np.inf


def test_a_step_is_found_sharply() -> None:
    runs = runs_of(lambda v: v > 0.437, 3, 400)
    for level in LEVELS:
        value, low, high = crossing(runs.values, runs.hits, level)
        assert low <= 0.437 <= high and abs(value - 0.437) < 1e-3
    low, high = crossing(runs.values, runs.hits, 0.5)[1:]
    assert high - low < 2e-3


@pytest.mark.slow
def test_a_logistic_threshold_is_recovered() -> None:
    """400 trials of 400 runs: 93 to 97 % of the intervals hold the truth; the median has no bias."""
    found, value = np.empty((400, 3, 2)), np.empty((400, 3))
    for trial in range(400):
        runs = runs_of(logistic, trial, 400)
        for i, level in enumerate(LEVELS):
            _, *limits = crossing(runs.values, runs.hits, level)
            found[trial, i] = limits
            value[trial, i] = local_crossing(
                runs.values, runs.hits, level, max(limits[0], 0.0), min(limits[1], 1.0), 3.0
            )
    covered = (found[..., 0] <= TRUE) & (found[..., 1] >= TRUE)
    print("covered", covered.mean(axis=0), covered.mean(), "bias", (value - TRUE).mean(axis=0))
    assert 0.93 <= covered.mean() <= 0.97
    half = 0.5 * np.diff(found, axis=-1)[..., 0].mean(axis=0)
    bias = (value - TRUE).mean(axis=0)
    error = value.std(axis=0) / 20.0
    assert abs(bias[1]) < 3.0 * error[1] and abs(bias[1]) < 0.05 * half[1]
    assert (np.abs(bias) < 0.15 * half).all()


def test_falling_is_seen_and_told() -> None:
    """A window of no snapping inside: not monotone, and the interval reaches across it."""
    runs = runs_of(lambda v: np.where((v > 0.5) & (v < 0.65), 0.05, logistic(v)), 5, 600, rounds=1)
    assert rises(runs.values, runs.hits) < 0.01
    first, last = spans(runs.values, runs.hits, 0.5)
    assert first < 0.42 and last > 0.6
    accused = []
    for seed in range(40):
        one = runs_of(logistic, seed, 200, rounds=1)
        accused.append(rises(one.values, one.hits, samples=200))
    assert (np.array(accused) < 0.05).mean() <= 0.15


def test_the_quasi_static_threshold() -> None:
    """One mode at Omega = 0.02: every quantile is V_QS1 within 2 %, less what the beam's inertia takes off it."""
    place = np.array([0.25, 0.4, 0.5])
    ds = sb.uncertainty.quantile_threshold(
        small_system(frequency_ratio=0.02), "velocity_amplitude", (1e-4, 0.03), {"location": place},
        options=sb.uncertainty.QuantileSearchSettings(runs=120), integration=sb.Integration(cycles=1, threads=1),
    )  # fmt: skip
    expected = sb.model.quasi_static_threshold(place, 0.02)
    np.testing.assert_allclose(ds["threshold"].sel(quantile=0.5), expected, rtol=0.03)
    assert ds["is_monotonic"].all() and (ds["outcome_of_search"] == 0).all()
    assert (ds["threshold_low"] <= ds["threshold"]).all() and (ds["threshold"] <= ds["threshold_high"]).all()


def test_tolerances_spread_the_threshold(tmp_path) -> None:
    spread = sb.uncertainty.ParameterUncertainty(of={"velocity_amplitude": sb.uncertainty.Normal(0.1, relative=True)})
    how, run = sb.uncertainty.QuantileSearchSettings(runs=120), sb.Integration(cycles=10, threads=1)
    arguments = (small_system(), "velocity_amplitude", (0.02, 0.4), {"frequency_ratio": [0.6, 1.4]}, spread, how)
    ds = sb.uncertainty.quantile_threshold(*arguments, integration=run, checkpoint=tmp_path / "store")
    assert (np.diff(ds["threshold"], axis=-1) > 0.0).all()
    again = sb.uncertainty.quantile_threshold(
        *arguments, integration=run.replace(threads=2), checkpoint=tmp_path / "store"
    )
    assert again.equals(ds)
    sure = sb.uncertainty.quantile_threshold(*arguments[:4], options=how, integration=run)
    np.testing.assert_allclose(ds["threshold"].sel(quantile=0.5), sure["threshold"].sel(quantile=0.5), rtol=0.1)


def test_out_of_range_is_told() -> None:
    ds = sb.uncertainty.quantile_threshold(
        small_system(), "velocity_amplitude", (1e-4, 1e-3), options=sb.uncertainty.QuantileSearchSettings(runs=120),
        integration=sb.Integration(cycles=3),
    )  # fmt: skip
    assert (ds["outcome_of_search"] == 1).all() and ds["threshold"].isnull().all()
    assert np.isinf(ds["threshold_high"]).all() and ds["threshold"].dims == ("quantile",)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"parameter": "beam.thickness"}, "may differ between runs"),
        ({"bounds": (0.3, 0.1)}, "less than the second"),
        ({"bounds": 0.3}, "two numbers"),
        ({"bounds": (-1.0, 0.1)}, "bounds"),
        ({"axes": {"velocity_amplitude": [0.1, 0.2]}}, "the parameter itself"),
        ({"options": 100}, "QuantileSearchSettings"),
    ],
)
def test_refusals(change, words: str) -> None:
    given = {"system": small_system(), "parameter": "velocity_amplitude", "bounds": (0.01, 0.3)} | change
    with pytest.raises(InputError, match=words):
        sb.uncertainty.quantile_threshold(**given)
    with pytest.raises(InputError):
        sb.uncertainty.QuantileSearchSettings(runs=20)
    with pytest.raises(InputError):
        sb.uncertainty.QuantileSearchSettings(probabilities=(0.5, 0.2))
