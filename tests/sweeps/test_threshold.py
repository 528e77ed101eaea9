"""Threshold curves against full maps: what is promised, what is missed, what is saved."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
import xarray as xr
from typer.testing import CliRunner

import snapbeam as sb
from snapbeam.cli import app
from snapbeam.core.validate import InputError
from snapbeam.model.paper_values import BEAM, CONTACT
from snapbeam.sweeps.search import Responses, search_everything_below, search_fast


def samples_of(classes):
    asked = []

    def ask(columns, rows):
        asked.extend(zip(columns.tolist(), rows.tolist(), strict=True))
        return classes[columns, rows]

    samples = Responses(*classes.shape, ask)
    return samples, asked


def bands(columns=48, rows=128, seed=0):
    """Classes with a wavy threshold, holes above it and isolated interwell points below it."""
    rng = np.random.default_rng(seed)
    x = np.linspace(0.0, 4.0, columns)
    level = 35.0 + 14.0 * np.sin(2.3 * x) - 18.0 * np.exp(-(((x - 1.2) / 0.2) ** 2))
    height = np.arange(rows) - level[:, None]
    interwell = height >= 0.0
    interwell &= ~((height < 8.0) & (rng.random(height.shape) < 0.3))
    interwell |= (height < 0.0) & (height > -3.0) & (rng.random(height.shape) < 0.2)
    return np.where(interwell, 2, 0).astype(np.int8)


@pytest.mark.parametrize("seed", range(5))
def test_fast_search_of_drawn_maps(seed):
    classes = bands(seed=seed)
    samples, asked = samples_of(classes)
    search_fast(samples, classes.size // 10)
    assert len(asked) == len(set(asked)) == samples.runs <= classes.size // 10
    true = np.where((classes > 0).any(axis=1), (classes > 0).argmax(axis=1), classes.shape[1])
    error = samples.first() - true
    assert (error >= 0).all()
    assert np.mean(error <= 1) >= 0.9


@pytest.mark.parametrize("share", [0.005, 0.02, 0.05])
def test_fast_search_never_spends_more(share):
    classes = bands()
    samples, asked = samples_of(classes)
    budget = int(share * classes.size)
    search_fast(samples, budget)
    assert len(asked) <= budget


@pytest.mark.parametrize("seed", range(3))
def test_exhaustive_search_misses_nothing_below(seed):
    classes = bands(seed=seed)
    samples, asked = samples_of(classes)
    search_everything_below(samples, 8, 16)
    true = (classes > 0).argmax(axis=1)
    np.testing.assert_array_equal(samples.first(), true)
    assert all(samples.known[column, : row + 1].all() for column, row in enumerate(true))
    assert len(asked) < 0.7 * classes.size


def test_columns_without_a_boundary():
    classes = np.zeros((6, 40), dtype=np.int8)
    classes[1] = 2
    classes[2, 17:] = 3
    classes[4, 39] = 1
    for search in (lambda s: search_fast(s, 200), lambda s: search_everything_below(s, 5, 5)):
        samples, _ = samples_of(classes)
        search(samples)
        assert samples.first().tolist() == [40, 0, 17, 40, 39, 40]
        assert samples.top().tolist() == [40, 0, 17, 40, 39, 40]


AXES = {"frequency_ratio": np.linspace(0.3, 3.5, 20), "velocity_amplitude": np.linspace(0.005, 0.64, 128)}


def compare(model, cycles, axes, minimum):
    """Both searches beside the full map: agreement, misses, savings."""
    full = sb.response_map(model, CONTACT, cycles=cycles, early_decision=True, **axes)
    interwell = (full["response"] > 0).transpose(..., "velocity_amplitude").values
    amplitude = axes["velocity_amplitude"]
    true = np.where(interwell.any(axis=1), amplitude[interwell.argmax(axis=1)], np.nan)
    resolution = float(np.diff(amplitude).max()) * (1.0 + 1e-9)
    fast = sb.threshold_curve(model, CONTACT, cycles=cycles, **axes)
    slow = sb.threshold_curve(model, CONTACT, cycles=cycles, search="exhaustive", **axes)
    np.testing.assert_array_equal(slow["first_interwell"], true)
    assert fast.attrs["runs"] <= 0.1 * interwell.size == 0.1 * fast.attrs["runs_of_full_map"]
    missed = ~(np.isclose(fast["first_interwell"], true, rtol=0.0, atol=resolution, equal_nan=True))
    print(
        f"N = {model.modes}, {cycles} cycles, {missed.size} columns: fast agrees in "
        f"{100.0 * (1.0 - missed.mean()):.0f} % ({int(missed.sum())} missed) with "
        f"{100.0 * fast.attrs['runs'] / interwell.size:.1f} % of the runs; exhaustive in 100 % with "
        f"{100.0 * slow.attrs['runs'] / interwell.size:.1f} %"
    )
    assert missed.mean() <= 1.0 - minimum
    for curve in (fast, slow):
        known = curve["computed"].transpose(..., "velocity_amplitude").values
        found = curve["response"].transpose(..., "velocity_amplitude").values
        np.testing.assert_array_equal(
            found[known], full["response"].transpose(..., "velocity_amplitude").values[known]
        )
        assert (found[~known] == -1).all()
        above = (curve["velocity_amplitude"] >= curve["always_interwell"]).transpose(
            ..., "velocity_amplitude"
        )
        assert (found[known & above.values] > 0).all()
    return fast, slow


def test_one_mode_against_the_full_map():
    fast, _ = compare(sb.ReducedModel.from_beam(BEAM, modes=1), 10, AXES, 0.9)
    assert fast.attrs["search"] == "fast" and "isolated interwell points below" in fast.attrs["may_miss"]
    assert set(np.unique(fast["outcome"])) <= {0, 1, 2, 3}
    assert (fast["last_intrawell"] < fast["first_interwell"]).all()


def test_along_location():
    axes = {"location": np.linspace(0.1, 0.5, 12), "frequency_ratio": 0.8}
    compare(
        sb.ReducedModel.from_beam(BEAM, modes=2),
        6,
        axes | {"velocity_amplitude": AXES["velocity_amplitude"]},
        0.75,
    )


@pytest.mark.slow
@pytest.mark.parametrize("modes", [1, 32])
def test_two_hundred_cycles_against_the_full_map(modes):
    axes = {
        "frequency_ratio": np.linspace(0.13, 3.97, 40),
        "velocity_amplitude": np.linspace(0.005, 0.64, 128),
    }
    compare(sb.ReducedModel.from_beam(BEAM, modes=modes), 200, axes, 0.9)


def test_several_numbers_of_modes(contact):
    models = [sb.ReducedModel.from_beam(BEAM, modes=n) for n in (1, 2)]
    axes = {"frequency_ratio": np.linspace(0.5, 1.5, 4), "velocity_amplitude": np.linspace(0.02, 0.6, 40)}
    seen = []
    both = sb.threshold_curve(
        models, contact, cycles=4, **axes, share=0.2, progress=lambda done, total: seen.append((done, total))
    )
    assert both["first_interwell"].dims == ("modes", "frequency_ratio")
    assert both["modes"].values.tolist() == [1, 2]
    assert both["reference_freq"].values == pytest.approx([83.93, 83.93], abs=0.01)
    assert seen[-1] == (64, 64) and all(a[0] <= b[0] for a, b in itertools.pairwise(seen))
    alone = sb.threshold_curve(models[1], contact, cycles=4, **axes, share=0.2)
    np.testing.assert_array_equal(both["first_interwell"].sel(modes=2), alone["first_interwell"])


def test_what_is_refused(model, contact):
    ratio, amplitude = [0.5, 1.0], [0.1, 0.2, 0.3]
    for arguments, message in (
        ({"frequency_ratio": 1.0, "velocity_amplitude": amplitude}, "one of them must be an array"),
        ({"frequency_ratio": ratio, "velocity_amplitude": amplitude, "location": [0.3, 0.4]}, "not 2 arrays"),
        ({"frequency_ratio": ratio, "velocity_amplitude": 0.3}, "at least two amplitudes"),
        ({"frequency_ratio": ratio, "velocity_amplitude": amplitude, "search": "best"}, "search = 'best'"),
        ({"frequency_ratio": ratio, "velocity_amplitude": amplitude, "share": 0.0}, "share = 0.0"),
    ):
        with pytest.raises(InputError, match=message):
            sb.threshold_curve(model, contact, **arguments)
    with pytest.raises(InputError, match=r"numbers of modes \[1, 1\] must differ"):
        sb.threshold_curve([model, model], contact, frequency_ratio=ratio, velocity_amplitude=amplitude)
    with pytest.raises(InputError, match="must be a ReducedModel or a list"):
        sb.threshold_curve([], contact, frequency_ratio=ratio, velocity_amplitude=amplitude)


def test_command(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    command = ["threshold", "--modes", "1,2", "--cycles", "3", "--frequency-ratio", "0.5:2:5"]
    done = CliRunner().invoke(app, [*command, "--velocity-amplitude", "0.02:0.6:30", "--plot", "t.png"])
    assert done.exit_code == 0, done.output
    assert "30 runs" in done.stdout and "10.0 % of a full map's 300" in done.stdout
    assert (
        "N = 2: lowest threshold V = " in done.stdout
        and "It may miss isolated interwell points" in done.stdout
    )
    curve = xr.load_dataset("threshold.nc", engine="h5netcdf")
    assert curve["first_interwell"].shape == (2, 5) and curve.attrs["search"] == "fast"
    assert (tmp_path / "t.png").stat().st_size > 10_000
    refused = CliRunner().invoke(app, ["threshold", "--modes", "1,x"])
    assert refused.exit_code == 2 and "whole numbers separated by commas, such as 1,32" in refused.stderr
