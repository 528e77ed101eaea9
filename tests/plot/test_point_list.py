"""Pictures of lists of points."""

from __future__ import annotations

import matplotlib.pyplot as plt
import numpy as np
import pytest
import xarray as xr
from matplotlib.colors import to_rgb

from snapbeam import InputError
from snapbeam.plot.map import plot_points, plot_response_map, plot_statistic
from snapbeam.plot.style import CLASS_COLORS
from snapbeam.sweeps.measured_points import MeasuredPoints
from snapbeam.util.status_codes import ResponseClass


@pytest.fixture
def points() -> xr.Dataset:
    """Thirty points over three parameters and one word; no run is made."""
    rng = np.random.default_rng(4)
    count = 30
    force = rng.uniform(1.0, 9.0, count)
    force[3] = np.nan
    coords = {
        "velocity_amplitude": rng.uniform(0.05, 0.4, count), "frequency_ratio": rng.uniform(0.5, 2.0, count),
        "beam_thickness": rng.choice([3.9e-4, 4.1e-4], count), "side": rng.choice(["below", "above"], count),
    }  # fmt: skip
    full = {"beam_thickness": "beam.thickness", "side": "contact.side"}
    return xr.Dataset(
        {"response_class": ("point", rng.integers(0, 4, count).astype("i1")), "peak_force": ("point", force)},
        coords={
            name: ("point", values, {"parameter": full.get(name, f"drive.{name}")}) for name, values in coords.items()
        }
        | {"location": 0.4762},
        attrs={"cycles": 20, "modes": 2},
    )


@pytest.fixture(autouse=True)
def closed():
    yield
    plt.close("all")


def test_each_point_stands_where_its_values_are(points):
    ax = plot_response_map(points)
    drawn = ax.collections[0]
    np.testing.assert_array_equal(
        drawn.get_offsets(), np.c_[points["frequency_ratio"].values, points["velocity_amplitude"].values]
    )
    wanted = [to_rgb(CLASS_COLORS[ResponseClass(int(kind))]) for kind in points["response_class"].values]
    np.testing.assert_allclose(drawn.get_facecolors()[:, :3], wanted)
    assert "Excitation frequency" in ax.get_xlabel() and "Velocity amplitude" in ax.get_ylabel()
    assert ax.figure.legends[0].get_texts()[0].get_text().startswith(ResponseClass.INTRAWELL.label)


def test_any_two_parameters_words_among_them(points):
    ax = plot_points(points, across="side", upward="beam_thickness")
    assert [text.get_text() for text in ax.get_xticklabels()] == ["above", "below"]
    at = ax.collections[0].get_offsets()
    np.testing.assert_array_equal(at[:, 0], points["side"].values == "below")
    np.testing.assert_array_equal(at[:, 1], points["beam_thickness"].values)


def test_a_statistic_of_a_list(points):
    ax = plot_statistic(points, "peak_force")
    filled, hollow = ax.collections[:2]
    assert filled.get_offsets().shape == (29, 2)
    np.testing.assert_allclose(hollow.get_offsets(), [[points["frequency_ratio"][3], points["velocity_amplitude"][3]]])


def test_what_lies_over_the_points(points):
    kind = np.array([ResponseClass.INTRAWELL], dtype=np.int8)
    dots = MeasuredPoints(np.array([1.0]), np.array([0.2]), np.array([0.4762]), kind)
    ax = plot_response_map(points, quasi_static_line=True, measurements=dots)
    labels = [text.get_text() for text in ax.figure.legends[0].get_texts()]
    assert "measured, 1" in labels and any("QS1" in label for label in labels)
    with pytest.raises(InputError, match="need velocity amplitude"):
        plot_points(points, across="velocity_amplitude", upward="frequency_ratio", quasi_static_line=True)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"name": "nothing"}, "the points have response_class, peak_force"),
        ({"across": "gap"}, "the points are given by"),
        ({"across": "side", "upward": "side"}, "over two parameters"),
    ],
)
def test_refused_by_name(points, options, words):
    with pytest.raises(InputError, match=words):
        plot_points(points, **options)
