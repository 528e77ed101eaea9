"""Refined maps: the points where classes meet are run, the others inferred; both are said."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr
from small_map import swept

import snapbeam as sb
from snapbeam.model.parameters import lookup
from snapbeam.sweeps.compute import SweepReport
from snapbeam.sweeps.points import Grid
from snapbeam.sweeps.refine import refine, refined_grid
from snapbeam.sweeps.tasks import ResultTable
from snapbeam.util.status_codes import RunStatus
from snapbeam.util.validation import InputError


class DrawnWork:
    """Classes read off a picture of them, in place of runs."""

    integers, numbers = ("response_class", "status"), ("peak_force",)

    def __init__(self, grid, classify):
        self.setup = type("Setup", (), {"points": grid})
        self.classify = classify

    def unfinished(self, size, status=RunStatus.NOT_RUN):
        return ResultTable(np.full((size, 2), status, dtype=np.int32), np.full((size, 1), np.nan))

    def values(self, name, columns):
        return columns.integers[:, self.integers.index(name)]


class DrawnRunner:
    """Counts what is asked for."""

    def __init__(self, grid, classify):
        self.work = DrawnWork(grid, classify)
        self.chunk = 10
        self.asked = []

    def complete(self, stage, progress=None):
        which = np.arange(stage.size) if stage.which is None else stage.which
        points = stage.points.take(which)
        self.asked.append((stage.name, points))
        classes = self.work.classify(**short(points))
        rows = ResultTable(
            np.stack((classes, np.zeros_like(classes)), axis=1).astype(np.int32), np.ones((stage.size, 1))
        )
        return type("Rows", (), {"read": lambda _, a, b: ResultTable(rows.integers[a:b], rows.numbers[a:b])})()


def short(points):
    return {lookup(name).short: values for name, values in points.items()}


def grid_of(across, upward):
    return Grid({"drive.frequency_ratio": across, "drive.velocity_amplitude": upward})


def truth(grid, classify):
    return classify(**short(grid.take(np.arange(grid.size)))).reshape(grid.shape)


def disc(velocity_amplitude, frequency_ratio=1.1):
    inside = (frequency_ratio - 1.1) ** 2 + (velocity_amplitude - 0.9) ** 2 < 0.62**2
    return np.where(inside, 2, 0)


def test_a_smooth_boundary_costs_its_length():
    coarse = grid_of(np.linspace(0.0, 2.0, 11), np.linspace(0.0, 2.0, 9))
    book = DrawnRunner(coarse, disc)
    grid, results = refine(book, 4)
    assert grid.shape == (161, 129)
    np.testing.assert_array_equal(results.columns.integers[:, 0].reshape(grid.shape), truth(grid, disc))
    assert results.computed.mean() < 0.2
    status = results.columns.integers[:, 1].reshape(grid.shape)
    np.testing.assert_array_equal(status == RunStatus.FILLED, ~results.computed)
    np.testing.assert_array_equal(np.isnan(results.columns.numbers[:, 0]), ~results.computed.ravel())
    seen = np.concatenate(
        [np.stack([p["drive.frequency_ratio"], p["drive.velocity_amplitude"]], 1) for _, p in book.asked]
    )
    assert len(np.unique(seen, axis=0)) == len(seen) == results.computed.sum()


def test_a_surprise_on_the_border_spreads():
    """A tongue that enters between the corners of cells is followed as far as it is seen."""

    def tongue(frequency_ratio, velocity_amplitude):
        left = velocity_amplitude < 0.5
        spike = (np.abs(velocity_amplitude - 1.25) < 0.3) & (frequency_ratio < 7.5)
        return np.where((frequency_ratio < 1.5) & left | spike, 3, 0)

    coarse = grid_of(np.arange(9.0), np.arange(0.0, 5.0, 2.0))
    grid, results = refine(DrawnRunner(coarse, tongue), 1)
    found = results.columns.integers[:, 0].reshape(grid.shape)
    np.testing.assert_array_equal(found, truth(grid, tongue))


def test_axes_of_one_point_and_one_axis():
    single = Grid({"drive.velocity_amplitude": np.linspace(0.0, 2.0, 5)})
    grid, results = refine(DrawnRunner(single, disc), 3)
    assert grid.shape == (33,)
    np.testing.assert_array_equal(results.columns.integers[:, 0], truth(grid, disc))
    assert results.computed.sum() < 16
    flat = grid_of(np.array([1.1]), np.linspace(0.0, 2.0, 5))
    grid, results = refine(DrawnRunner(flat, disc), 2)
    assert grid.shape == (1, 17)
    np.testing.assert_array_equal(results.columns.integers[:, 0].reshape(grid.shape), truth(grid, disc))
    np.testing.assert_array_equal(refined_grid(single).axes["drive.velocity_amplitude"], np.linspace(0.0, 2.0, 9))


def test_three_axes():
    def ball(frequency_ratio, velocity_amplitude, location):
        return np.where(frequency_ratio**2 + velocity_amplitude**2 + location**2 < 0.5, 1, 0)

    names = ("drive.frequency_ratio", "drive.velocity_amplitude", "contact.location")
    axes = {name: np.linspace(0.0, 1.0, 5) for name in names}
    grid, results = refine(DrawnRunner(Grid(axes), ball), 2)
    np.testing.assert_array_equal(results.columns.integers[:, 0].reshape(grid.shape), truth(grid, ball))
    assert results.computed.mean() < 0.6


def test_whole_numbers_and_words_have_nothing_between_them():
    """Each number of modes and each side is refined by itself; a structure's own axis like any other."""

    def by_structure(velocity_amplitude, modes, side, beam_thickness):
        level = 0.2 + 0.1 * (modes == 8) + 0.05 * (side == "above") + 300.0 * beam_thickness
        return np.where(velocity_amplitude > level, 3, 0)

    coarse = Grid(
        {
            "drive.velocity_amplitude": np.linspace(0.0, 1.0, 9),
            "model.modes": np.array([1, 8]),
            "contact.side": np.array(["below", "above"]),
            "beam.thickness": np.linspace(3e-4, 5e-4, 3),
        }
    )
    assert coarse.shape == (2, 2, 3, 9), "counted with the structure outermost"
    book = DrawnRunner(coarse, by_structure)
    grid, results = refine(book, 3)
    assert {name: values.size for name, values in grid.axes.items()} == {
        "drive.velocity_amplitude": 65, "model.modes": 2, "contact.side": 2, "beam.thickness": 17,
    }  # fmt: skip
    found = results.columns.integers[:, 0].reshape(grid.shape)
    np.testing.assert_array_equal(found, truth(grid, by_structure))
    assert results.computed.mean() < 0.3
    with pytest.raises(InputError, match="needs an axis of at least two real numbers"):
        refine(DrawnRunner(Grid({"model.modes": np.array([1, 8])}), by_structure), 1)


def test_a_list_cannot_be_refined(small):
    points = xr.Dataset({"frequency_ratio": ("point", [1.0, 1.5])})
    shaker = sb.Shaker(frequency_ratio=1.0, velocity_amplitude=0.3)
    system = sb.System(small["model"], contacts=[sb.Contact(small["contact"], shaker)])
    with pytest.raises(InputError, match="refine_levels: a list of points cannot be refined; give axes"):
        sb.sweep(system, points, sb.Integration(cycles=1), refine_levels=1)


def test_computed_points_are_those_of_a_full_map(tmp_path, small):
    """Bit for bit, in memory and through a store, whole, resumed and cut into other tasks."""
    refined = swept(**small, refine_levels=2)
    assert dict(refined.sizes) == {"frequency_ratio": 17, "velocity_amplitude": 13}
    computed = refined["computed"]
    assert 0.2 < float(computed.mean()) < 1.0
    fine = dict(small, **{name: refined[name].values for name in refined.dims})
    full = swept(**fine)
    for name in full.data_vars:
        xr.testing.assert_equal(refined[name].where(computed), full[name].where(computed))
    assert refined.attrs["points_computed"] == int(computed.sum())
    inferred = ~computed.values
    assert (refined["status"].values[inferred] == RunStatus.FILLED).all()
    assert (refined["response_class"].values[inferred] >= 0).all()
    wrong = int((refined["response_class"] != full["response_class"]).sum())
    print(f"{wrong} of {int(inferred.sum())} inferred points differ from the full map")
    swept(**small, path=tmp_path / "store", points_per_task=7)
    report = SweepReport()
    stored = swept(**small, path=tmp_path / "store", refine_levels=2, output=tmp_path / "m.nc", report=report)
    xr.testing.assert_equal(stored.load(), refined)
    assert report.resumed == 3 and report.computed > 1
    again = SweepReport()
    swept(**small, path=tmp_path / "store", refine_levels=2, report=again)
    assert again.computed == 0 and again.resumed == report.tasks
    checked = SweepReport()
    swept(**small, path=tmp_path / "store", refine_levels=2, check_checkpoint=True, report=checked)
    assert checked.computed == 0 and not checked.damaged and checked.missing == 0


def test_levels_are_checked(small):
    with pytest.raises(InputError, match="refine_levels = 11: must be an integer in"):
        swept(**small, refine_levels=11)
