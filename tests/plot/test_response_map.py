"""The picture of a map: one cell a run, in the colour of its class, with borders where they belong."""

from __future__ import annotations

import matplotlib.pyplot as plt
import numpy as np
import pytest
from matplotlib.colors import to_rgb

from snapbeam.plot.map import class_handles, plot_response_map
from snapbeam.plot.style import CLASS_COLORS, save_figure
from snapbeam.sweeps.measured_points import MeasuredPoints
from snapbeam.util.status_codes import ResponseClass
from snapbeam.util.validation import InputError


@pytest.fixture(autouse=True)
def _close():
    yield
    plt.close("all")


def legend_texts(ax):
    return [text.get_text() for text in ax.figure.legends[0].get_texts()]


def test_cells(synthetic_map):
    ax = plot_response_map(synthetic_map)
    mesh = ax.collections[0]
    assert mesh.get_array().size == synthetic_map["response_class"].size
    corners = mesh.get_coordinates()
    x, y = synthetic_map["frequency_ratio"].values, synthetic_map["velocity_amplitude"].values
    np.testing.assert_allclose(corners[0, 1:-1, 0], 0.5 * (x[1:] + x[:-1]))
    np.testing.assert_allclose(corners[[0, -1], 0, 1], [0.0, y[-1] + 0.5 * (y[-1] - y[-2])])
    assert ax.get_xlim() == pytest.approx((0.05, 4.05))
    assert ax.get_xlabel() == r"Excitation frequency $\Omega$"
    assert ax.get_title().replace("\u00a0", " ") == r"$N$ = 32, 200 cycles, $x_\mathrm{s}$ = 0.4762"


def test_every_pixel_of_a_cell_has_its_colour(synthetic_map, tmp_path):
    """Compare the rendered image with the array, at the centre of each cell and near its borders."""
    ax = plot_response_map(synthetic_map, legend=False)
    path = save_figure(ax.figure, tmp_path / "map.png")
    image = plt.imread(path)[..., :3]
    ax.figure.set_dpi(300)
    ax.figure.canvas.draw()
    x, y = synthetic_map["frequency_ratio"].values, synthetic_map["velocity_amplitude"].values
    wanted = np.array(
        [[to_rgb(CLASS_COLORS[ResponseClass(k)]) for k in row] for row in synthetic_map["response_class"].values]
    )
    for share in (-0.3, 0.0, 0.3):
        places = np.stack(np.meshgrid(x + share * (x[1] - x[0]), y + share * (y[1] - y[0]), indexing="ij"), axis=-1)
        inside = places[..., 1] > 0.005
        pixels = ax.transData.transform(places.reshape(-1, 2)).reshape(places.shape)
        seen = image[image.shape[0] - 1 - pixels[..., 1].astype(int), pixels[..., 0].astype(int)]
        np.testing.assert_allclose(seen[inside], wanted[inside], atol=2.0 / 255.0)


def test_legend_counts_the_runs(synthetic_map):
    texts = legend_texts(plot_response_map(synthetic_map, quasi_static_line=True))
    kinds = synthetic_map["response_class"].values
    share = 100.0 * (kinds == ResponseClass.INTRAWELL).mean()
    assert texts[0] == f"intrawell, {share:.1f} %"
    assert texts[-1].startswith("quasi-static, ")
    assert [text.split(",")[0] for text in texts[:5]] == [
        "intrawell",
        "transient interwell 1",
        "transient interwell 2",
        "continuous interwell",
        "unknown",
    ]
    known = synthetic_map.where(synthetic_map["response_class"] >= 0, 0).astype(np.int8).assign_attrs(modes=1)
    assert not any(text.startswith("unknown") for text in legend_texts(plot_response_map(known)))


def test_threshold_line(synthetic_map):
    line = plot_response_map(synthetic_map, quasi_static_line=True).lines[-1]
    ratio, velocity = line.get_data()
    np.testing.assert_allclose(velocity, ratio * np.sin(np.pi / 2.1) ** 2)
    location = np.linspace(0.02, 0.98, 40)
    across = synthetic_map.rename(frequency_ratio="location", location="frequency_ratio")
    across = across.assign_coords(location=location, frequency_ratio=0.625)
    ax = plot_response_map(across.transpose(), quasi_static_line=True)
    place, velocity = ax.lines[-1].get_data()
    np.testing.assert_allclose(velocity, 0.625 * np.sin(np.pi * place) ** 2)
    assert ax.get_xlabel().startswith("Striker location")
    nameless = synthetic_map.drop_vars("location")
    with pytest.raises(InputError, match="quasi_static_line: needs the map's location"):
        plot_response_map(nameless, quasi_static_line=True)


def test_points_lie_where_they_were_measured(synthetic_map):
    dots = MeasuredPoints(
        np.array([1.0, 2.0, 3.0]),
        np.array([0.2, 0.3, 0.4]),
        np.array([np.nan, 0.476, 0.3]),
        np.array([0, 2, 3], dtype=np.int8),
    )
    with pytest.warns(UserWarning, match="1 of 3 measured points do not belong to location = 0.4762"):
        ax = plot_response_map(synthetic_map, measurements=dots)
    points = ax.collections[-1]
    np.testing.assert_allclose(points.get_offsets(), [[1.0, 0.2], [2.0, 0.3]])
    colors = [to_rgb(CLASS_COLORS[kind]) for kind in (ResponseClass.INTRAWELL, ResponseClass.TRANSIENT_2)]
    np.testing.assert_allclose(points.get_facecolors()[:, :3], colors)
    assert legend_texts(ax)[-1] == "measured, 2"


def test_points_outside_are_reported(synthetic_map):
    dots = MeasuredPoints(np.array([9.0]), np.array([0.2]), np.array([np.nan]), np.array([0], dtype=np.int8))
    with pytest.warns(UserWarning, match="1 of 1 measured points lie outside the map"):
        plot_response_map(synthetic_map, measurements=dots)


def test_what_is_no_map_of_two_axes(synthetic_map):
    with pytest.raises(InputError, match="no variable 'response_class'"):
        plot_response_map(synthetic_map.drop_vars("response_class"))
    with pytest.raises(InputError, match="this one has none"):
        plot_response_map(synthetic_map.isel(frequency_ratio=0, velocity_amplitude=0))
    deep = synthetic_map.drop_vars("location").expand_dims(location=[0.3, 0.4])
    with pytest.raises(InputError, match="select one value of location, by --at location=VALUE or"):
        plot_response_map(deep)
    assert plot_response_map(deep.isel(location=[1])).get_title().endswith("0.4")


@pytest.mark.parametrize("dpi", [72, 150, 300])
def test_legend_fits_the_column(synthetic_map, dpi):
    ax = plot_response_map(synthetic_map, quasi_static_line=True)
    ax.figure.set_dpi(dpi)
    ax.figure.canvas.draw()
    box, page = ax.figure.legends[0].get_window_extent(), ax.figure.bbox
    assert page.x0 <= box.x0 and box.x1 <= page.x1 and page.y0 <= box.y0
    assert box.y1 <= ax.get_tightbbox().y0


def test_in_axes_of_ones_own(synthetic_map):
    _, axes = plt.subplots(1, 2)
    assert plot_response_map(synthetic_map, axes[1]) is axes[1]
    assert len(axes[1].get_legend().get_texts()) == 5
    assert plot_response_map(synthetic_map, axes[0], legend=False).get_legend() is None
    assert [handle.get_label() for handle in class_handles()] == [kind.label for kind in ResponseClass if kind >= 0]


def test_classes_without_runs_are_not_in_the_legend():
    labels = [handle.get_label() for handle in class_handles(np.array([0, 0, 3, 0], dtype=np.int8))]
    assert labels == ["intrawell, 75.0 %", "continuous interwell, 25.0 %"]


def test_a_base_is_drawn_in_hz_and_g(synthetic_map):
    """Axes of ratios of a base become axes in Hz and g: with 50 Hz and 1 mm, a ratio of 0.1 is 5 Hz and 1.006 g."""
    names = {"frequency_ratio": "frequency_ratio", "velocity_amplitude": "acceleration_amplitude"}
    dataset = synthetic_map.rename({old: f"base_excitation_{new}" for old, new in names.items()})
    for new in names.values():
        dataset[f"base_excitation_{new}"].attrs["parameter"] = f"base_excitation.{new}"
    dataset.attrs |= {"reference_frequency": 50.0, "length_scale": 1e-3}
    ax = plot_response_map(dataset)
    assert {ax.get_xlabel(), ax.get_ylabel()} == {
        "Frequency of the base (Hz)",
        "Acceleration amplitude of the base (g)",
    }
    frequency = dataset["base_excitation_frequency_ratio"].values * 50.0
    level = dataset["base_excitation_acceleration_amplitude"].values * 1e-3 * (100.0 * np.pi) ** 2 / 9.80665
    corners = ax.collections[0].get_coordinates()
    along = {"Frequency of the base (Hz)": frequency, "Acceleration amplitude of the base (g)": level}
    x, y = along[ax.get_xlabel()], along[ax.get_ylabel()]
    np.testing.assert_allclose(corners[0, 1:-1, 0], 0.5 * (x[1:] + x[:-1]))
    np.testing.assert_allclose(corners[1:-1, 0, 1], 0.5 * (y[1:] + y[:-1]))
