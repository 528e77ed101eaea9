"""Probability maps: coverage, the runs that sequential allocation saves, agreement, resumption, dots."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats
from small import small_system

import snapbeam as sb
from snapbeam.sweeps.measured_points import MeasuredPoints
from snapbeam.uncertainty.measured_classes import class_counts
from snapbeam.uncertainty.monte_carlo import OUTCOMES
from snapbeam.uncertainty.probability import allocate
from snapbeam.util.proportions import proportion
from snapbeam.util.status_codes import ResponseClass
from snapbeam.util.validation import InputError

SPREAD = sb.uncertainty.ParameterUncertainty(
    of={"velocity_amplitude": sb.uncertainty.Normal(0.05, relative=True)}, phase=True, displacement=3e-6
)
AXES = {"frequency_ratio": [0.8, 1.4], "velocity_amplitude": np.linspace(0.06, 0.3, 4)}
HOW = sb.Integration(cycles=20, threads=1)


def coin(probability, seed: int = 0):
    """Draw s of point i is a hit where a number of its own is below the probability."""

    def ask(which, numbers):
        rank = np.array(
            [np.random.Generator(np.random.Philox(key=[seed, int(i) * 2**32 + int(s)])).random()
             for i, s in zip(which, numbers, strict=True)]
        )  # fmt: skip
        return np.stack([rank < probability[which]] * len(OUTCOMES)), np.zeros(which.size, dtype=bool)

    return ask


def test_wilson_is_scipys() -> None:
    for hits, runs in ((0, 10), (3, 17), (50, 50), (120, 400)):
        low, high = stats.binomtest(hits, runs).proportion_ci(0.95, method="wilson")
        _, mine, more = proportion(hits, runs)
        assert float(mine) == pytest.approx(low, abs=1e-12) and float(more) == pytest.approx(high, abs=1e-12)


def test_sequential_intervals_cover() -> None:
    """400 points of probabilities spread over (0, 1): 93 to 97 % of the intervals hold them though runs stop early."""
    truth = (np.arange(400) + 0.5) / 400.0
    allocation = sb.uncertainty.SamplingPlan(half_width=0.1)
    counts = allocate(coin(truth), 400, allocation)
    _, low, high = counts.limits(allocation, 0)
    assert 0.93 <= ((low <= truth) & (truth <= high)).mean() <= 0.97
    assert ((high - low) <= 0.2).all() and not counts.open.any()
    assert abs((counts.hits[0] / counts.runs - truth).mean()) < 0.005


def test_half_the_runs_of_a_uniform_map() -> None:
    """Steep borders, as of a response map: a half width of 0.05 everywhere for at most half the runs; both agree."""
    v, steep = np.linspace(0.0, 1.0, 60), 25.0
    truth = np.concatenate([1.0 / (1.0 + np.exp(-steep * (v - border))) for border in (0.3, 0.55, 0.8)])
    sequential = sb.uncertainty.SamplingPlan(half_width=0.05)
    counts = allocate(coin(truth), truth.size, sequential)
    _, low, high = counts.limits(sequential, 0)
    assert (0.5 * (high - low)).max() <= 0.05
    needed = 8
    while np.diff(np.ravel(proportion(needed // 2, needed)[1:]))[0] > 0.1:
        needed += 1
    assert counts.runs.sum() <= 0.5 * needed * truth.size
    uniform = sb.uncertainty.SamplingPlan(half_width=None, initial_runs=needed)
    other = allocate(coin(truth, seed=1), truth.size, uniform)
    _, below, above = other.limits(uniform, 0)
    assert ((below <= high) & (low <= above)).mean() >= 0.97


def test_a_total_is_kept_and_told() -> None:
    truth = np.linspace(0.01, 0.99, 50)
    counts = allocate(coin(truth), 50, sb.uncertainty.SamplingPlan(half_width=0.1, initial_runs=16, total_runs=2000))
    assert counts.runs.sum() == 2000
    assert counts.open.any() and not counts.open.all()


def test_failed_runs_widen_the_interval() -> None:
    share, low, high = proportion(5, 10, failed=10)
    assert float(share) == 0.5
    assert float(low) == pytest.approx(float(proportion(5, 20)[1])) and float(high) == pytest.approx(
        float(proportion(15, 20)[2])
    )


def test_map_of_a_beam() -> None:
    """Outcomes add up, threads and resumption change nothing, and a beam driven hard snaps."""
    runs = sb.uncertainty.SamplingPlan(half_width=0.15, initial_runs=16, max_runs=64)
    ds = sb.uncertainty.probability_map(small_system(), AXES, SPREAD, runs, integration=HOW)
    assert ds["probability"].dims == ("frequency_ratio", "velocity_amplitude", "outcome")
    ends = ds["hits"].sel(outcome=["continuous", "first_well", "other_well"]).sum("outcome")
    assert (ends == ds["runs"]).all() and (ds["runs_failed"] == 0).all()
    snap = ds["probability"].sel(outcome="snap")
    assert (snap.isel(velocity_amplitude=-1) == 1.0).all() and (snap.isel(velocity_amplitude=0) < 0.5).all()
    assert ds["reached"].all() and ds.attrs["runs_made"] == int(ds["runs"].sum())
    two = sb.uncertainty.probability_map(small_system(), AXES, SPREAD, runs, integration=HOW.replace(threads=2))
    assert two["hits"].equals(ds["hits"])


@pytest.mark.slow
def test_a_map_is_resumed_after_being_killed(tmp_path) -> None:
    """Killed after every point in turn: nothing is computed twice, and what comes out is what an unbroken map gives."""
    runs = sb.uncertainty.SamplingPlan(half_width=0.15, initial_runs=16, max_runs=64)
    whole = sb.uncertainty.probability_map(small_system(), AXES, SPREAD, runs, integration=HOW)
    store, seen = tmp_path / "map", 0

    class Killed(Exception):
        pass

    for _ in range(20):
        tally = sb.SweepReport()
        left = [40 + 7 * seen]

        def kill(done: int, total: int, left: list[int] = left) -> None:
            if done > left[0]:
                raise Killed

        keeping = sb.CheckpointOptions(store, points_per_task=16, report=tally)
        try:
            found = sb.uncertainty.probability_map(
                small_system(), AXES, SPREAD, runs, integration=HOW, checkpoint=keeping, progress=kill
            )
            break
        except Killed:
            seen += 1
    assert seen >= 3
    assert found["hits"].equals(whole["hits"]) and found["runs"].equals(whole["runs"])
    tally = sb.SweepReport()
    sb.uncertainty.probability_map(
        small_system(), AXES, SPREAD, runs, integration=HOW, checkpoint=sb.CheckpointOptions(store, report=tally)
    )
    assert tally.runs == 0
    with pytest.raises(InputError):
        other = sb.uncertainty.ParameterUncertainty(of=SPREAD.of, phase=True, displacement=3e-6, seed=9)
        sb.uncertainty.probability_map(small_system(), AXES, other, runs, integration=HOW, checkpoint=store)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"uncertainty": sb.uncertainty.ParameterUncertainty()}, "nothing is uncertain"),
        ({"runs": 0}, "initial_runs"),
        ({"runs": "many"}, "SamplingPlan"),
        ({"axes": {}}, "at least one parameter"),
        ({"uncertainty": "wide"}, "ParameterUncertainty"),
    ],
)
def test_refusals(change, words: str) -> None:
    given = {"system": small_system(), "axes": AXES, "uncertainty": SPREAD, "runs": 16} | change
    with pytest.raises(InputError, match=words):
        sb.uncertainty.probability_map(**given)


def test_measurements_are_judged_by_their_likelihood() -> None:
    """Dots drawn from a map agree with it, dots of one class everywhere do not."""
    ds = sb.uncertainty.probability_map(small_system(), AXES, SPREAD, 60, integration=HOW)
    counts = class_counts(ds)
    assert (counts.sum(axis=-1) == 60).all()
    generator = np.random.default_rng(2)
    omega, v = np.meshgrid(ds["frequency_ratio"], ds["velocity_amplitude"], indexing="ij")
    share = counts.reshape(-1, 4) / 60.0
    drawn = np.array([generator.choice(4, p=row / row.sum()) for row in share], dtype=np.int8)
    place = np.full(drawn.size, np.nan)
    good = sb.uncertainty.score_measurements(ds, MeasuredPoints(omega.ravel(), v.ravel(), place, drawn))
    assert good.attrs["p_value"] > 0.01
    low, high = good.attrs["log_likelihood_low"], good.attrs["log_likelihood_high"]
    assert low <= good.attrs["log_likelihood"] <= high
    never = np.full(drawn.size, ResponseClass.TRANSIENT_1, dtype=np.int8)
    bad = sb.uncertainty.score_measurements(ds, MeasuredPoints(omega.ravel(), v.ravel(), place, never))
    assert bad.attrs["p_value"] < 0.01 and bad.attrs["agree"] < good.attrs["agree"]
    with pytest.raises(InputError, match="outside"):
        sb.uncertainty.score_measurements(ds, MeasuredPoints(np.array([3.0]), np.array([0.1]), place[:1], never[:1]))
