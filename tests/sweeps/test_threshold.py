"""Threshold bands: exact on the grid, failed runs unknown, columns without an answer marked as such."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
import xarray as xr
from threshold_grids import AMPLITUDE, SYSTEM, stand_in, thresholds_of
from typer.testing import CliRunner

import snapbeam as sb
from snapbeam.cli.app import app
from snapbeam.util.validation import InputError

RUNNER = CliRunner()


def brute_force(full: xr.Dataset, along: str) -> tuple[np.ndarray, np.ndarray]:
    """Both curves of a full map, column by column in plain Python."""
    values = full[along].values
    table = full["response_class"].transpose(..., along).values
    curves = np.full((2, *table.shape[:-1]), np.nan)
    for at in np.ndindex(table.shape[:-1]):
        column = [kind > 0 for kind in table[at]]
        for row in reversed(range(len(column))):
            if column[row]:
                curves[(0, *at)] = values[row]
                if all(column[row:]):
                    curves[(1, *at)] = values[row]
    return curves[0], curves[1]


@pytest.mark.parametrize(
    ("along", "values", "over", "modes", "cycles"),
    [
        # a coarse grid: 12 columns of 10 amplitudes
        ("velocity_amplitude", np.linspace(0.02, 0.6, 10), {"frequency_ratio": np.linspace(0.8, 1.6, 12)}, 2, 20),
        # the grid of docs/sweeps.md: two axes beside the one that is raised, one of few points
        (
            "velocity_amplitude",
            np.linspace(0.02, 0.6, 30),
            {"contact.gap": [0.0, 5e-5], "frequency_ratio": np.linspace(0.8, 2.0, 7)},
            2,
            12,
        ),
        ("frequency_ratio", np.linspace(0.2, 3.0, 14), {"location": [0.3, 0.47]}, 1, 12),
        ("location", np.linspace(0.2, 0.5, 9), {"frequency_ratio": [0.9, 1.3, 1.8]}, 3, 12),
        ("contact.gap", np.linspace(-5e-5, 1e-4, 7), {"model.damping_ratio": [0.002, 0.01]}, 1, 12),
        ("velocity_amplitude", [0.1, 0.3, 0.5], {"frequency_ratio": np.linspace(0.8, 1.6, 5)}, 1, 12),
    ],
    ids=["coarse", "documentation", "along frequency", "along location", "along gap", "three values"],
)  # fmt: skip
def test_thresholds_are_those_of_the_full_map(along, values, over, modes, cycles):
    system = SYSTEM.replace(**{"model.modes": modes})
    asked = sb.Integration(cycles=cycles, early_termination=True)
    full = sb.sweep(system, {**over, along: values}, asked)
    found = sb.threshold(system, along, values, over, sb.Integration(cycles=cycles))
    short = found.attrs["parameter"]
    first, always = brute_force(full, short)
    np.testing.assert_array_equal(found["lower_threshold"], first)
    np.testing.assert_array_equal(found["upper_threshold"], always)
    np.testing.assert_array_equal(found["lower_threshold_min"], first)
    np.testing.assert_array_equal(found["upper_threshold_max"], always)
    np.testing.assert_array_equal(
        found["response_class"], full["response_class"].transpose(*found["response_class"].dims)
    )
    assert found.attrs["runs"] == full["response_class"].size and not found["failed_runs"].any()
    assert set(np.unique(found["outcome"])) <= {0, 1, 2, 3}
    np.testing.assert_array_equal(found["outcome"] == 1, np.isnan(first))
    assert np.isfinite(first).any()


KINDS = [
    # column, outcome, first, always, first_min, always_max, last intrawell
    ("iiXXX", "band_found", 0.3, 0.3, 0.3, 0.3, 0.2),
    ("iXiXX", "band_found", 0.2, 0.4, 0.2, 0.4, 0.1),
    ("iiiii", "no_interwell_in_range", np.nan, np.nan, np.nan, np.nan, 0.5),
    ("XiXXX", "lowest_value_is_interwell", 0.1, 0.3, 0.1, 0.3, np.nan),
    ("iXXXi", "highest_run_is_intrawell", 0.2, np.nan, 0.2, np.nan, 0.1),
    ("i?XXX", "band_found", 0.3, 0.3, 0.2, 0.3, 0.1),
    ("?iXXX", "band_found", 0.3, 0.3, 0.1, 0.3, 0.2),
    ("iX?XX", "band_found", 0.2, 0.2, 0.2, 0.4, 0.1),
    ("iiXX?", "band_found", 0.3, 0.3, 0.3, np.nan, 0.2),
    ("iii?i", "undecided", np.nan, np.nan, 0.4, np.nan, 0.5),
    ("?????", "not_searched", np.nan, np.nan, 0.1, np.nan, np.nan),
]


def test_what_failed_runs_leave_open(monkeypatch):
    found = thresholds_of(monkeypatch, " ".join(row[0] for row in KINDS))
    names = "lower_threshold upper_threshold lower_threshold_min upper_threshold_max last_intrawell".split()
    for name, expected in zip(names, np.array([row[2:] for row in KINDS]).T, strict=True):
        np.testing.assert_array_equal(found[name], expected, err_msg=name)
    flags = found["outcome"].attrs["flag_meanings"].split()
    assert [flags[code] for code in found["outcome"].values] == [row[1] for row in KINDS]
    assert found["failed_runs"].values.tolist() == [row[0].count("?") for row in KINDS]
    np.testing.assert_array_equal(found["status"] == sb.RunStatus.DIVERGED, found["response_class"] < 0)


def test_runs_of_an_engine_that_fail():
    """A start far outside the finite range fails; it is neither intrawell nor interwell."""
    asked = sb.Integration(cycles=12)
    far = {"initial_state.amplitude[1]": [-1.0, 1e103]}
    found = sb.threshold(SYSTEM, "velocity_amplitude", AMPLITUDE, far, asked)
    assert found["outcome"].values.tolist() == [0, 5]
    assert found["failed_runs"].values.tolist() == [0, 5]
    assert (found["status"][1] == sb.RunStatus.DIVERGED).all() and (found["response_class"][1] == -1).all()
    found = sb.threshold(
        SYSTEM, "initial_state.amplitude[1]", [-1.1, -0.9, 1e103], {"velocity_amplitude": [0.1, 0.3]}, asked
    )
    assert found["outcome"].values.tolist() == [4, 2]
    np.testing.assert_array_equal(found["lower_threshold"], [np.nan, -1.1])
    np.testing.assert_array_equal(found["lower_threshold_min"], [1e103, -1.1])
    np.testing.assert_array_equal(found["upper_threshold"], [np.nan, -1.1])
    np.testing.assert_array_equal(found["upper_threshold_max"], [np.nan, np.nan])


def test_several_numbers_of_modes():
    axes = {"modes": [1, 2], "frequency_ratio": np.linspace(0.5, 1.5, 4)}
    amplitude, asked, seen = np.linspace(0.02, 0.6, 8), sb.Integration(cycles=4), []
    both = sb.threshold(
        SYSTEM, "velocity_amplitude", amplitude, axes, asked, progress=lambda done, total: seen.append((done, total))
    )
    assert both["lower_threshold"].dims == ("modes", "frequency_ratio")
    assert both["modes"].values.tolist() == [1, 2]
    assert both["reference_frequency"].values == pytest.approx([83.93, 83.93], abs=0.01)
    assert both.attrs["runs"] == 64
    assert seen[-1] == (64, 64) and all(a[0] <= b[0] for a, b in itertools.pairwise(seen))
    two = SYSTEM.replace(**{"model.modes": 2})
    alone = sb.threshold(two, "velocity_amplitude", amplitude, {"frequency_ratio": axes["frequency_ratio"]}, asked)
    np.testing.assert_array_equal(both["lower_threshold"].sel(modes=2), alone["lower_threshold"])


@pytest.mark.parametrize(
    ("parameter", "values", "axes", "message"),
    [
        ("modes", [1, 2], {"frequency_ratio": [0.5, 1.0]}, "parameter = 'modes': must be a real number"),
        ("velocity_amplitude", AMPLITUDE, [1.0], "axes = .*: must map parameters to arrays"),
        ("velocity_amplitude", 0.3, {"frequency_ratio": [0.5, 1.0]}, "at least two values to choose from"),
        ("velocity_amplitude", np.ndarray, {}, "at least two values to choose from"),
        ("velocity_amplitude", [0.3, 0.1], {"frequency_ratio": [0.5, 1.0]}, "must be strictly increasing"),
    ],
)
def test_what_is_refused(parameter, values, axes, message):
    with pytest.raises(InputError, match=message):
        sb.threshold(SYSTEM, parameter, values, axes)


def test_command(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    command = ["threshold", "--modes", "1,2", "--cycles", "3", "--frequency-ratio", "0.5:2:5"]
    done = RUNNER.invoke(app, [*command, "--velocity-amplitude", "0.02:0.6:30", "--plot", "t.png"])
    assert done.exit_code == 0, done.output
    assert "300 runs in" in done.stdout and "N = 2: lowest threshold V = " in done.stdout
    curve = xr.load_dataset("threshold.nc", engine="h5netcdf")
    assert curve["lower_threshold"].shape == (2, 5) and curve.attrs["runs"] == 300
    assert (tmp_path / "t.png").stat().st_size > 10_000
    refused = RUNNER.invoke(app, ["threshold", "--modes", "1,x"])
    assert refused.exit_code == 2 and "whole numbers separated by commas, such as 1,32" in refused.stderr


def test_command_on_a_coarse_grid(tmp_path, monkeypatch):
    """The former default search ran one point a column here and called most columns not interwell."""
    monkeypatch.chdir(tmp_path)
    axes = ["--frequency-ratio", "0.8:1.6:12", "--velocity-amplitude", "0.02:0.6:10"]
    done = RUNNER.invoke(app, ["threshold", "--modes", "2", "--cycles", "30", *axes])
    assert done.exit_code == 0, done.output
    curve = xr.load_dataset("threshold.nc", engine="h5netcdf")
    full = sb.sweep(
        SYSTEM.replace(**{"model.modes": 2}),
        {"frequency_ratio": curve["frequency_ratio"].values, "velocity_amplitude": curve["velocity_amplitude"].values},
        sb.Integration(cycles=30),
    )  # fmt: skip
    first, _ = brute_force(full, "velocity_amplitude")
    np.testing.assert_array_equal(curve["lower_threshold"], first)
    assert np.isfinite(first).all(), "every column has interwell runs"
    assert "no interwell response" not in done.stdout
    assert f"lowest threshold V = {first.min():.4g} at Omega = " in done.stdout


def test_command_counts_only_what_was_run(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    stand_in(monkeypatch, "iiXXX iXiXX iiiii iXXXi i?XXX iiXX? iii?i ?????")
    axes = ["--frequency-ratio", "1:2:8", "--velocity-amplitude", "0.1:0.5:5"]
    done = RUNNER.invoke(app, ["threshold", "--modes", "1", "--cycles", "1", *axes, "--plot", "t.png"])
    assert done.exit_code == 0, done.output
    for text in (
        "lowest threshold V = 0.2 at Omega = 1.143; band 0.05 wide on average over 4 points, in steps of 0.1",
        "no interwell response in range: extend the values of velocity_amplitude, at 1 of 8 points",
        "undecided: no run is interwell, but runs failed, at 1 of 8 points",
        "not searched: no run has a response class, at 1 of 8 points",
        "highest run is intrawell, at 1 of 8 points",
        "failed runs leave the threshold open, down to V = 0.2, at 1 of 8 points",
        "failed runs leave the top of the band open, at 1 of 8 points",
        "8 failed (DIVERGED)",
    ):
        assert text in " ".join(done.stdout.split()), text
    assert (tmp_path / "t.png").stat().st_size > 10_000
