"""Pictures of threshold bands and of how sure a point of a map is."""

from __future__ import annotations

import matplotlib.pyplot as plt
import numpy as np
import pytest
import xarray as xr
from matplotlib.collections import PolyCollection
from matplotlib.colors import to_rgb
from matplotlib.patches import Rectangle

from snapbeam.plot.map import plot_response_map
from snapbeam.plot.style import CLASS_COLORS, save_figure
from snapbeam.plot.threshold import plot_threshold
from snapbeam.util.status_codes import ResponseClass
from snapbeam.util.validation import InputError

_KINDS = (
    "band_found",
    "no_interwell_in_range",
    "lowest_value_is_interwell",
    "highest_run_is_intrawell",
    "undecided",
    "not_searched",
)


@pytest.fixture(autouse=True)
def _close():
    yield
    plt.close("all")


@pytest.fixture
def curve():
    ratio = np.linspace(0.2, 3.0, 15)
    first = np.stack((0.2 + 0.05 * np.sin(ratio), 0.25 + 0.02 * ratio))
    first[0, 4] = np.nan
    dims = ("modes", "frequency_ratio")
    flags = {"flag_meanings": " ".join(_KINDS)}
    return xr.Dataset(
        {
            "lower_threshold": (dims, first),
            "upper_threshold": (dims, first + 0.03),
            "lower_threshold_min": (dims, first),
            "upper_threshold_max": (dims, first + 0.03),
            "outcome": (dims, np.where(np.isnan(first), 1, 0), flags),
        },
        {"modes": [1, 32], "frequency_ratio": ratio, "velocity_amplitude": np.linspace(0.0, 0.6, 61), "location": 0.4},
        {"cycles": 200},
    )


def test_band(curve):
    ax = plot_threshold(curve)
    lines = {line.get_label(): line for line in ax.lines}
    np.testing.assert_array_equal(lines["$N$ = 32"].get_ydata(), curve["lower_threshold"].values[1])
    quasi_static = lines[r"quasi-static, $V_\mathrm{QS1}$"]
    np.testing.assert_allclose(
        quasi_static.get_ydata(), curve["frequency_ratio"] * np.sin(np.pi * 0.4) ** 2, rtol=1e-12
    )
    assert ax.get_xlabel().startswith("Excitation frequency") and "V" in ax.get_ylabel()
    assert ax.get_title().replace("\u00a0", " ") == "200 cycles, $x_\\mathrm{s}$ = 0.4\nsteps of 0.01 in $V$"
    assert len([each for each in ax.collections if isinstance(each, PolyCollection)]) == 2
    assert ax.get_ylim() == pytest.approx((0.0, 1.4 * 0.34))
    (none,) = [line for line in ax.lines if line.get_marker() == "^"]
    assert none.get_xdata().tolist() == [curve["frequency_ratio"].values[4]]
    one = plot_threshold(curve.isel(modes=1), quasi_static=False)
    assert [line.get_xdata().size for line in one.lines] == [15], "the curve"


def texts_of(ax):
    return [text.get_text() for text in ax.get_legend().get_texts()]


def test_columns_without_an_answer_are_hatched(curve):
    one = curve.isel(modes=1).copy(deep=True)
    hatched = {"undecided": (2, "...."), "not searched": (7, "////")}
    assert not {"undecided: runs failed", "not searched"} & set(texts_of(plot_threshold(one)))
    for name in ("lower_threshold", "upper_threshold", "upper_threshold_max"):
        one[name][[2, 7]] = np.nan
    one["outcome"][2], one["outcome"][7] = 4, 5
    ax = plot_threshold(one)
    assert {"undecided: runs failed", "not searched"} <= set(texts_of(ax))
    assert "no interwell response in range" not in texts_of(ax)
    spans = {patch.get_hatch(): patch for patch in ax.patches}
    for at, hatch in hatched.values():
        centre = float(one["frequency_ratio"][at])
        assert spans[hatch].get_x() + 0.5 * spans[hatch].get_width() == pytest.approx(centre)


def test_isolated_points_are_markers(curve, tmp_path):
    """A point whose neighbours have no threshold was invisible: a line needs two points."""
    one = curve.isel(modes=1).copy(deep=True)
    gaps = np.array([1, 2, 3, 5, 6, 7, 8, 9, 10, 11, 12, 13])
    for name in curve.data_vars:
        if name != "outcome":
            one[name][gaps] = np.nan
    one["outcome"][gaps] = 1
    ax = plot_threshold(one, quasi_static=False)
    (alone,) = [line for line in ax.lines if line.get_marker() == "."]
    assert np.flatnonzero(np.isfinite(alone.get_ydata())).tolist() == [0, 4, 14]
    empty = plot_threshold(one.assign(lower_threshold=one["lower_threshold"] * np.nan), quasi_static=False)
    with_points, without = (
        plt.imread(save_figure(each.figure, tmp_path / f"{number}.png"))[..., :3]
        for number, each in enumerate((ax, empty))
    )
    red = np.array(to_rgb("#B03A27"))
    counts = [int((np.abs(image - red).max(axis=-1) < 0.02).sum()) for image in (with_points, without)]
    assert counts[0] > counts[1] + 100


def test_bands_that_are_open(curve):
    """A band whose highest run is intrawell reaches the end of the range; failed runs widen it by dotted lines."""
    one = curve.isel(modes=1).copy(deep=True)
    one["upper_threshold"][9] = one["upper_threshold_max"][9] = np.nan
    one["outcome"][9] = 3
    one["lower_threshold_min"][5] = 0.1
    ax = plot_threshold(one)
    assert ax.get_ylim()[1] == pytest.approx(0.6)
    band = next(each for each in ax.collections if isinstance(each, PolyCollection))
    assert band.get_datalim(ax.transData).y1 == pytest.approx(0.6)
    assert "left open by failed runs" in texts_of(ax)
    assert "left open by failed runs" not in texts_of(plot_threshold(curve))


def test_what_is_no_threshold(curve):
    with pytest.raises(InputError, match="no threshold curve among"):
        plot_threshold(curve.drop_vars("lower_threshold"))


def test_paler_where_repeats_disagree(synthetic_map, tmp_path):
    kinds = synthetic_map["response_class"]
    classes = xr.DataArray([int(k) for k in ResponseClass], dims="class_code")
    share = xr.where(kinds == classes, 1.0, 0.0)
    unsure = (kinds["frequency_ratio"] > 2.0) & (kinds["velocity_amplitude"] < 0.1)
    share = xr.where(unsure, 0.5 * share + 0.5 * (classes == 3), share)
    share = share.transpose(*kinds.dims, "class_code").assign_coords(class_code=classes)
    ax = plot_response_map(synthetic_map.assign(class_fraction=share), legend=False)
    path = save_figure(ax.figure, tmp_path / "map.png")
    image = plt.imread(path)[..., :3]
    ax.figure.set_dpi(300)
    ax.figure.canvas.draw()

    def seen(x, y):
        column, row = ax.transData.transform((x, y)).astype(int)
        return image[image.shape[0] - 1 - row, column]

    color = np.array(to_rgb(CLASS_COLORS[ResponseClass.INTRAWELL]))
    np.testing.assert_allclose(seen(1.0, 0.01667), color, atol=0.02)
    np.testing.assert_allclose(seen(3.0, 0.01667), color + 0.425 * (1.0 - color), atol=0.02)


def test_legend_says_how_many_disagree(synthetic_map):
    kinds = synthetic_map["response_class"]
    classes = xr.DataArray([int(k) for k in ResponseClass], dims="class_code")
    share = xr.where(kinds == classes, 1.0, 0.0).assign_coords(class_code=classes)
    ax = plot_response_map(synthetic_map.assign(class_fraction=share))
    texts = [text.get_text() for text in ax.figure.legends[0].get_texts()]
    assert texts[-1] == "repeats agree, 100 to 25 %;\n0.0 % of cells are split"


def test_the_legends_shades_are_those_of_the_map(synthetic_map):
    kinds = synthetic_map["response_class"]
    classes = xr.DataArray([int(k) for k in ResponseClass], dims="class_code")
    share = xr.where(kinds == classes, 1.0, 0.0).assign_coords(class_code=classes)
    ax = plot_response_map(synthetic_map.assign(class_fraction=share))
    ax.figure.canvas.draw()
    legend = ax.figure.legends[0]
    shades = [each for each in legend.findobj(Rectangle) if each is not legend.legendPatch][-4:]
    color = np.array(to_rgb(CLASS_COLORS[ResponseClass.INTRAWELL]))
    for agree, shade in zip((1.0, 0.75, 0.5, 0.25), shades, strict=True):
        white = 0.85 * (1.0 - agree)  # as the map lays it over its cells
        np.testing.assert_allclose(shade.get_facecolor()[:3], color + white * (1.0 - color), atol=1e-9)
