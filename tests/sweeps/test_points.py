"""Points: grids over any mixture of parameters, lists from tables, how they are counted, and what is refused."""

from __future__ import annotations

import itertools

import numpy as np
import pandas as pd
import pytest
import xarray as xr

import snapbeam as sb
from snapbeam.model.parameter_file import Config
from snapbeam.sweeps.points import Grid, PointList, points_of
from snapbeam.util.validation import InputError

MIXED = {
    "frequency_ratio": [0.8, 1.2, 1.6],
    "beam.thickness": [3e-4, 4e-4],
    "drive.velocity_amplitude": np.linspace(0.1, 0.4, 4),
    "modes": [1, 3],
    "contact.side": ["below", "above"],
    "early_termination": [False, True],
}


def test_a_mapping_makes_a_grid() -> None:
    grid = points_of(MIXED)
    assert isinstance(grid, Grid)
    assert list(grid.axes) == [
        "drive.frequency_ratio", "beam.thickness", "drive.velocity_amplitude", "model.modes", "contact.side",
        "integration.early_termination",
    ]  # fmt: skip
    assert grid.dims == (
        "frequency_ratio", "beam_thickness", "velocity_amplitude", "modes", "side", "early_termination",
    )  # fmt: skip
    assert grid.size == 3 * 2 * 4 * 2 * 2 * 2
    assert [values.dtype.kind for values in grid.axes.values()] == ["f", "f", "f", "i", "U", "b"]


def test_counting_keeps_the_runs_of_a_structure_together() -> None:
    """Axes of the structure outermost, each group in the order it was given; every combination once."""
    grid = points_of(MIXED)
    assert grid.order == (
        "beam.thickness", "model.modes", "contact.side", "integration.early_termination", "drive.frequency_ratio",
        "drive.velocity_amplitude",
    )  # fmt: skip
    assert grid.shape == (2, 2, 2, 2, 3, 4)
    points = grid.take(np.arange(grid.size))
    rows = list(zip(*(points[name].tolist() for name in grid.order), strict=True))
    assert rows == list(itertools.product(*(grid.axes[name].tolist() for name in grid.order)))
    some = grid.take(np.array([7, 190, 0]))
    for name in grid.order:
        np.testing.assert_array_equal(some[name], points[name][[7, 190, 0]])


def test_arrays_come_back_with_the_dimensions_as_they_were_given() -> None:
    grid = points_of(MIXED)
    points = grid.take(np.arange(grid.size))
    assert grid.arranged(np.arange(grid.size)).shape == (3, 2, 4, 2, 2, 2)
    for at, name in enumerate(grid.axes):
        values = grid.arranged(points[name])
        expected = grid.axes[name].reshape([-1 if i == at else 1 for i in range(6)])
        np.testing.assert_array_equal(values, np.broadcast_to(expected, values.shape))
    vectors = grid.arranged(np.stack((np.arange(grid.size), -np.arange(grid.size)), axis=1))
    assert vectors.shape == (3, 2, 4, 2, 2, 2, 2)
    np.testing.assert_array_equal(vectors[..., 0], -vectors[..., 1])


def test_coordinates_say_what_they_are() -> None:
    coords = points_of(MIXED).coordinates()
    dims, values, labels = coords["beam_thickness"]
    assert dims == ("beam_thickness",)
    assert values.tolist() == [3e-4, 4e-4]
    assert labels == {
        "units": "m", "long_name": "thickness in the direction of bending", "parameter": "beam.thickness",
    }  # fmt: skip
    assert coords["frequency_ratio"][2]["units"] == "1"


COLUMNS = {"frequency_ratio": [0.8, 1.2, 1.6], "modes": [3, 1, 3], "who": ["a", "b", "c"]}


@pytest.mark.parametrize(
    "table",
    [
        pd.DataFrame(COLUMNS),
        xr.Dataset({name: ("test", values) for name, values in COLUMNS.items()}),
        xr.Dataset({"frequency_ratio": ("point", COLUMNS["frequency_ratio"]), "modes": ("point", COLUMNS["modes"])},
                   coords={"who": ("point", COLUMNS["who"])}),
    ],
    ids=["data frame", "dataset", "coordinates"],
)  # fmt: skip
def test_a_table_makes_a_list(table) -> None:
    points = points_of(table)
    assert isinstance(points, PointList)
    assert points.dims == ("point",) and points.shape == (3,) and points.size == 3
    assert points.names == ("drive.frequency_ratio", "model.modes")
    assert points.columns["model.modes"].tolist() == [3, 1, 3]
    assert points.labels["who"].tolist() == ["a", "b", "c"]
    taken = points.take(np.array([2, 0]))
    assert {name: values.tolist() for name, values in taken.items()} == {
        "drive.frequency_ratio": [1.6, 0.8], "model.modes": [3, 3],
    }  # fmt: skip
    coords = points.coordinates()
    assert coords["modes"][0] == ("point",) and coords["modes"][2]["parameter"] == "model.modes"
    assert coords["who"][1].tolist() == ["a", "b", "c"]


def test_a_list_needs_no_order_and_may_repeat() -> None:
    points = points_of(pd.DataFrame({"velocity_amplitude": [0.3, 0.1, 0.3]}))
    assert points.columns["drive.velocity_amplitude"].tolist() == [0.3, 0.1, 0.3]


def test_one_value_of_a_dataset_holds_for_all() -> None:
    points = points_of(xr.Dataset({"frequency_ratio": ("p", [1.0, 2.0]), "location": 0.3}))
    assert points.columns["contact.location"].tolist() == [0.3, 0.3]


def test_lists_are_told_apart() -> None:
    def described(values):
        return points_of(pd.DataFrame({"velocity_amplitude": values})).describe()

    assert described([0.1, 0.2]) == described(np.array([0.1, 0.2]))
    assert described([0.1, 0.2]) != described([0.2, 0.1])
    assert described([0.1, 0.2])["drive.velocity_amplitude"]["points"] == 2


def frame(**columns) -> pd.DataFrame:
    return pd.DataFrame(columns)


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({}, "axes: must name at least one parameter to sweep"),
        ([1.0, 2.0], r"axes = \[1.0, 2.0\]: must be a mapping of parameters to values, an xarray.Dataset or a table"),
        ({"modes": 3}, "modes = 3: must be an array; put a single value into the system"),
        ({"modes": [1, 2], "model.modes": [1, 2]}, r"model\.modes: is given twice among the axes"),
        ({"beam.thicknes": [1e-4, 2e-4]}, r"beam\.thicknes: is not a parameter; did you mean 'beam\.thickness'"),
        ({3: [1, 2]}, "3: is not a parameter"),
        ({"integration.engine": ["native", "python"]}, r"integration\.engine: cannot be swept"),
        ({"threads": [1, 2]}, "threads: cannot be swept"),
        ({"integration.tolerance": [1e-3, 1e-2]}, r"integration\.tolerance: cannot be swept"),
        ({"drive.displacement": [1.0, 2.0]}, r"drive\.displacement: cannot be swept"),
        ({"location": [0.5, 0.4]}, r"location\[0\] = 0.5, location\[1\] = 0.4: must be strictly increasing"),
        ({"location": [0.5, 1.0]}, r"location = 1.0: must be a number in \(0, 1\)"),
        ({"velocity_amplitude": [-0.1, 0.1]}, r"velocity_amplitude = -0.1: must be .* \[0, inf\)"),
        ({"location": [0.5, np.nan]}, r"location\[1\] = .*nan.*: must be finite"),
        ({"location": []}, r"location = \[\]: must hold at least one point"),
        ({"location": [[0.1, 0.2]]}, r"location of shape \(1, 2\): must be a number or a one-dimensional array"),
        ({"modes": [1.5, 2.0]}, r"modes = 1.5: must be an integer in \[1, 256\]"),
        ({"contact.side": ["below", "left"]}, "side = 'left': must be one of 'below', 'above'"),
        ({"contact.side": ["below", "below"]}, "must differ from each other"),
        ({"frequency_ratio": ["a", "b"]}, "frequency_ratio = .*must be an array of numbers"),
        (frame(frequency_ratio=[1.0, -1.0]), r"frequency_ratio\[1\] = -1.0: must be a finite number greater than 0"),
        (frame(modes=[1.5, 2.0]), r"modes\[0\] = 1.5: must be an integer"),
        (frame(who=["a", "b"]), "points with who: must contain a parameter"),
        (frame(frequency_ratio=[]), r"points of lengths .*: must be equal, and at least one"),
        (
            frame(velocity_amplitud=[0.1], location=[0.3]),
            "velocity_amplitud: is not a parameter; did you mean 'velocity_ampl",
        ),
        (
            pd.DataFrame({"frequency_ratio": [1.0], "drive.frequency_ratio": [2.0]}),
            r"drive\.frequency_ratio: is given twice among the points",
        ),
        (xr.Dataset({"location": (("x", "y"), np.full((2, 2), 0.3))}), r"location of shape \(2, 2\): a list of points"),
        (
            xr.Dataset({"location": ("x", [0.3, 0.4]), "modes": ("y", [1, 2, 3])}),
            r"points of lengths .*: must be equal",
        ),
    ],
)
def test_refusals(given, message: str) -> None:
    with pytest.raises(InputError, match=message):
        points_of(given)


def test_axes_in_hz_keep_their_hz() -> None:
    """Axes in Hz and m are a grid of ratios; beside an axis that changes the frequency they stay in Hz."""
    system = Config().system.replace(**{"model.modes": 1})
    freq = system.model.reference_frequency
    grid = points_of({"frequency_hz": [50.0, 100.0], "contact.location_m": [0.04, 0.06]}, system)
    assert isinstance(grid, Grid)
    np.testing.assert_allclose(grid.axes["drive.frequency_ratio"] * freq, [50.0, 100.0], rtol=1e-14)
    np.testing.assert_allclose(grid.axes["contact.location"] * 0.161, [0.04, 0.06], rtol=1e-14)
    made = points_of({"beam.length": [0.1, 0.161], "drive.frequency_hz": [50.0, 100.0]}, system)
    assert isinstance(made, Grid)
    assert made.axes["drive.frequency_hz"].tolist() == [50.0, 100.0]
    assert made.dims == ("beam_length", "frequency_hz")
    with pytest.raises(InputError, match="given twice"):
        points_of({"frequency_hz": [50.0], "frequency_ratio": [1.0]}, system)


def test_a_sweep_over_the_length_at_fixed_hz() -> None:
    """Each run is that of its own structure at its own ratio, and the dataset says both."""
    system = Config().system.replace(**{"model.modes": 1})
    once = sb.Integration(cycles=3)
    axes = {"beam.length": [0.1, 0.161], "drive.frequency_hz": [50.0, 100.0], "drive.velocity_m_s": [0.03]}
    swept = sb.sweep(system, axes, once)
    assert swept.min_displacement.dims == ("beam_length", "frequency_hz", "velocity_m_s")
    assert "frequency_ratio" not in swept.attrs
    for length in (0.1, 0.161):
        own = system.replace(**{"beam.length": length})
        for hertz in (50.0, 100.0):
            at = {"beam_length": length, "frequency_hz": hertz}
            ratio = hertz / own.model.reference_frequency
            np.testing.assert_allclose(swept.frequency_ratio.sel(at), ratio, rtol=1e-14)
            speed = 0.03 / (own.scale.length * own.scale.omega)
            run = sb.sweep(own, {"frequency_ratio": [ratio], "velocity_amplitude": [speed]}, once)
            assert float(swept.min_displacement.sel(at).item()) == float(run.min_displacement.item())


def test_a_list_in_hz() -> None:
    """With a structure that differs each point has its own ratio; both are in the dataset."""
    system = Config().system.replace(**{"model.modes": 1})
    once = sb.Integration(cycles=2)
    first = system.model.reference_frequency
    swept = sb.sweep(system, frame(frequency_hz=[50.0, 100.0]), once)
    np.testing.assert_allclose(swept.frequency_ratio * first, [50.0, 100.0], rtol=1e-14)
    assert swept.frequency_hz.values.tolist() == [50.0, 100.0]
    lengths = [0.1, 0.161]
    swept = sb.sweep(system, frame(frequency_hz=[50.0, 100.0], **{"beam.length": lengths}), once)
    own = [system.replace(**{"beam.length": length}).model.reference_frequency for length in lengths]
    np.testing.assert_allclose(swept.frequency_ratio * own, [50.0, 100.0], rtol=1e-14)
    assert swept.frequency_hz.values.tolist() == [50.0, 100.0]


def test_axes_of_text_have_units() -> None:
    axes = points_of({"beam.thickness": "0.2mm:400um:3", "harvester.resistance": "1kΩ,1MOhm"}).axes
    np.testing.assert_allclose(axes["beam.thickness"], [2e-4, 3e-4, 4e-4], rtol=1e-12)
    np.testing.assert_allclose(axes["harvester.resistance"], [1e3, 1e6], rtol=1e-12)
    for text in ("1um,2Hz", "1 g"):
        with pytest.raises(InputError, match="does not fit; must be in m"):
            points_of({"beam.thickness": text})
    with pytest.raises(InputError, match="must be a number without a unit"):
        points_of({"drive.frequency_ratio": "1Hz,2Hz"})


@pytest.mark.parametrize(
    "axes",
    [
        {"frequency_hz": np.linspace(20.0, 300.0, 200_000), "velocity_m_s": np.linspace(0.01, 0.05, 200_000)},
        {"frequency_hz": np.linspace(20.0, 300.0, 200_000), "beam.length": np.linspace(0.1, 0.2, 200_000)},
    ],
)
def test_too_many_points_in_hz_are_refused_before_they_are_made(axes) -> None:
    with pytest.raises(InputError, match="points"):
        sb.sweep(Config().system.replace(**{"model.modes": 1}), axes, sb.Integration(cycles=1))
