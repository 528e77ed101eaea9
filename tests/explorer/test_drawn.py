"""Figures of Matplotlib as plots of the page: same numbers, scales, names and colours."""

from __future__ import annotations

import matplotlib.pyplot as plt
import numpy as np
import pytest
from matplotlib.patches import Patch

pytest.importorskip("bokeh")

from bokeh import models

from snapbeam.explorer.drawn import Drawn, plain, thinned
from snapbeam.explorer.style import look_of


@pytest.fixture
def axes():
    """Axes of a figure that is closed again."""
    figure, made = plt.subplots()
    yield made
    plt.close(figure)


def _sources(axes, theme="default"):
    plot = Drawn(axes, look_of(theme)).plots[0][0]
    return plot, [each.data_source.data for each in plot.renderers if isinstance(each, models.GlyphRenderer)]


def test_lines_points_and_areas_keep_their_numbers(axes):
    x, y = np.array([1.0, 2.0, 4.0]), np.array([1e-3, 1.0, 30.0])
    axes.set_yscale("log")
    axes.plot(x, y, "--", color="black", marker="s", label="curve")
    axes.scatter(x, 2.0 * y, c=y)
    axes.fill_between(x, y, 2.0 * y, alpha=0.3)
    axes.vlines(x, y, 3.0 * y)
    axes.axvline(3.0)
    axes.set_xlabel(r"$\omega_1$ of $\mathrm{beam}$")
    axes.legend(handles=[axes.lines[0], Patch(facecolor="red", label="other")])
    plot, sources = _sources(axes)
    assert isinstance(plot.y_scale, models.LogScale) and plot.xaxis.axis_label == "ω₁ of beam"
    for points in (y, 2.0 * y):
        assert any(
            "y" in each and np.array_equal(each["y"], points) and np.array_equal(each["x"], x) for each in sources
        )
    shapes = [each for each in sources if "ys" in each and np.isfinite(each["ys"][0]).all()]
    assert any(np.isin(np.concatenate((y, 2.0 * y)), each["ys"][0]).all() for each in shapes)
    assert any(np.array_equal([part[1] for part in each["ys"]], 3.0 * y) for each in shapes)
    assert [each.location for each in plot.center if isinstance(each, models.Span)] == [3.0]
    (legend,) = plot.legend
    assert [str(each.label.value) for each in legend.items] == ["curve", "other"]
    first, second = (each.renderers for each in legend.items)
    assert np.array_equal(first[0].data_source.data["y"], y) and first[0].glyph.line_dash == [6]
    assert second[0].glyph.fill_color == "#ff0000ff"


def test_cells_keep_their_edges_and_colours_with_a_scale(axes):
    drawn = axes.pcolormesh([0.0, 1.0, 3.0], [0.0, 1.0], [[2.0, 5.0]], cmap="gray", vmin=2.0, vmax=5.0)
    axes.figure.colorbar(drawn, label="force (N)")
    made = Drawn(axes, look_of("default"))
    assert len(made.plots) == 1, "the scale is no plot of its own"
    plot = made.plots[0][0]
    data = plot.renderers[0].data_source.data
    assert data["left"].tolist() == [0.0, 1.0] and data["right"].tolist() == [1.0, 3.0]
    assert data["color"] == ["#000000ff", "#ffffffff"]
    (bar,) = [each for each in plot.above if isinstance(each, models.ColorBar)]
    assert (bar.color_mapper.low, bar.color_mapper.high, bar.title) == (2.0, 5.0, "force (N)")


def test_shared_axes_share_a_range_and_black_turns_in_the_dark():
    figure, axes = plt.subplots(2, 1, sharex=True)
    for each in axes:
        each.plot([0.0, 1.0], [1.0, 2.0], color="black")
    (upper, _), (lower, _) = Drawn(axes[1], look_of("dark")).plots
    plt.close(figure)
    assert upper.x_range is lower.x_range and upper.y_range is not lower.y_range
    assert upper.renderers[0].glyph.line_color == "#ffffffff"


def test_a_long_line_keeps_its_extremes():
    x = np.arange(300_000.0)
    y = np.sin(x)
    y[123_456], y[222_222] = 7.0, -9.0
    kept_x, kept_y = thinned(x, y)
    assert kept_x.size <= 20_000 and (np.diff(kept_x) > 0).all()
    assert kept_x[kept_y.argmax()] == 123_456 and kept_x[kept_y.argmin()] == 222_222


@pytest.mark.parametrize(
    ("given", "text"),
    [
        (r"Modal $\dot\alpha_{1}\,/\,\omega_1|\alpha_{1,\mathrm{well}}|$", "Modal α\u0307₁/ω₁|α 1,well|"),
        (r"$10^{-3}\,b$", "10⁻³b"), (r"$V_\mathrm{QS1}$", "V QS1"), ("N/m$^{1.5}$, $x_s$", "N/m^1.5, xₛ"), ("plain", "plain"),
    ],
)  # fmt: skip
def test_formulas_become_text(given, text):
    assert plain(given) == text
