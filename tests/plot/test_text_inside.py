"""Every kind of figure, drawn by its default call: text is inside and apart, legends name what occurs, once."""

from __future__ import annotations

import functools
import re
from collections import Counter
from itertools import combinations

import matplotlib.pyplot as plt
import numpy as np
import pytest
import xarray as xr
from every_kind import RESULTS, SYSTEM
from matplotlib.axes import Axes
from matplotlib.colors import to_rgba
from matplotlib.figure import Figure
from matplotlib.legend import Legend
from matplotlib.text import Text

import snapbeam as sb
from snapbeam.plot.dataset import _KINDS, figures_of
from snapbeam.plot.style import COLUMN_WIDTHS, save_figure

RAW_NAME = re.compile(r"[a-z][_.][a-z]|\w\[")
"""Parts of the name of a parameter or variable in a program."""


@functools.cache
def computed(result: str) -> xr.Dataset:
    return RESULTS[result]()


@pytest.fixture(autouse=True)
def closed():
    yield
    plt.close("all")


@pytest.fixture(params=["elsevier", *(pytest.param(name, marks=pytest.mark.slow) for name in ("ieee", "talk"))])
def style(request):
    sb.plot.plot_style(request.param)
    yield request.param
    sb.plot.plot_style("elsevier")


def outside(figure: Figure) -> float:
    """How far the drawing, with its text, extends beyond the canvas, inches."""
    figure.draw_without_rendering()
    drawn = figure.get_tightbbox()
    return float(np.max([*-drawn.min, *(drawn.max - figure.get_size_inches())]))


def resized(figure: Figure, width: str) -> Figure:
    """A figure at the width of columns, laid out anew when it is drawn."""
    if not has_width(figure, width):
        figure.set_size_inches(COLUMN_WIDTHS[width] / 25.4, figure.get_figheight())
        if len(figure.axes) > 2:  # the layout of several panels follows the size in two draws
            figure.draw_without_rendering()
    return figure


def has_width(figure: Figure, width: str) -> bool:
    return abs(25.4 * figure.get_figwidth() - COLUMN_WIDTHS[width]) < 1e-6


def legends_of(figure: Figure) -> list[Legend]:
    return [*figure.legends, *(ax.get_legend() for ax in figure.axes if ax.get_legend() is not None)]


def texts_of(figure: Figure) -> list[Text]:
    """Every text that is seen; an axis also has numbers for ticks beyond its ends."""
    axes = [axis for ax in figure.axes for axis in (ax.xaxis, ax.yaxis)]
    numbers = [tick for axis in axes for tick in (*axis.majorTicks, *axis.minorTicks)]
    seen = [tick for axis in axes for tick in axis._update_ticks()]
    beyond = {id(label) for tick in numbers if tick not in seen for label in (tick.label1, tick.label2)}
    return [
        each
        for each in figure.findobj(Text)
        if each.get_visible() and each.get_text().strip() and id(each) not in beyond
    ]


def colors_of(ax: Axes) -> np.ndarray:
    """Every colour that something in the axes has, of shape (n, 3)."""
    found = [np.ones((1, 3))]  # white is paper
    for line in ax.lines:
        if np.isfinite(np.asarray(line.get_ydata(), dtype=float)).any():
            found += [to_rgba(each)[:3] for each in (line.get_color(), line.get_markeredgecolor())]
    for each in (*ax.collections, *ax.patches):
        for color in (each.get_facecolor(), each.get_edgecolor()):
            found.append(np.reshape(to_rgba(color) if np.ndim(color) == 1 else color, (-1, 4))[:, :3])
    return np.concatenate([np.reshape(each, (-1, 3)) for each in found])


def color_of_entry(handle: object) -> np.ndarray:
    get = next(getattr(handle, name) for name in ("get_color", "get_facecolor") if hasattr(handle, name))
    color = get()
    return np.reshape(to_rgba(color) if isinstance(color, str) or np.ndim(color) == 1 else color, (-1, 4))[0]


def check(figure: Figure, words: str) -> None:
    assert outside(figure) < 0.01, words
    width, height = figure.bbox.size
    texts = texts_of(figure)
    boxes = [(each.get_text(), each.get_window_extent()) for each in texts]
    fonts = {(*each.get_fontfamily(), each.get_math_fontfamily()) for each in texts}
    assert len(fonts) == 1 and not {"serif", "sans-serif"}.intersection(*fonts), (
        f"{words}: another font outside the context"
    )
    for text, box in boxes:
        assert not RAW_NAME.search(re.sub(r"\$.*?\$", "", text)), f"{words}: {text!r} is a name of a program"
        inside = min(box.x0, box.y0, width - box.x1, height - box.y1)
        assert inside > -1.5, f"{words}: {text!r} is cut off by {-inside:.0f} px"
    for (one, a), (other, b) in combinations(boxes, 2):
        overlap = min(a.x1, b.x1) - max(a.x0, b.x0), min(a.y1, b.y1) - max(a.y0, b.y0)
        assert min(overlap) < 2.0, f"{words}: {one!r} over {other!r}, {overlap}"
    names = Counter(each.get_text() for legend in legends_of(figure) for each in legend.get_texts())
    names += Counter(each for ax in figure.axes for each in (ax.get_xlabel(), ax.get_ylabel(), ax.get_title()) if each)
    assert not (twice := [name for name, count in names.items() if count > 1]), f"{words}: twice {twice}"
    drawn = np.concatenate([colors_of(ax) for ax in figure.axes])
    for legend in legends_of(figure):
        for handle, text in zip(legend.legend_handles, legend.get_texts(), strict=True):
            color = color_of_entry(handle)[:3]
            assert np.abs(drawn - color).max(axis=1).min() < 0.01, f"{words}: {text.get_text()} does not occur"


@pytest.mark.sampled(5)
@pytest.mark.parametrize("result", RESULTS)
def test_the_default_figure(result: str, style: str) -> None:
    """In three styles, at both widths of each."""
    dataset = computed(result)
    figure = dataset.snapbeam.plot().get_figure(root=True)
    check(figure, f"{result}, {style}")
    for width in [each for each in COLUMN_WIDTHS if not has_width(figure, each)]:
        check(resized(figure, width), f"{result}, {style}, {width} column")


@pytest.mark.slow
@pytest.mark.parametrize("result", RESULTS)
def test_the_text_of_every_figure_is_inside(result: str) -> None:
    """All but the default one, of one column; a figure that fits there fits two."""
    dataset = computed(result)
    for name in list(figures_of(dataset)[1])[1:]:
        figure = dataset.snapbeam.plot(name).get_figure(root=True)
        assert outside(resized(figure, "single")) < 0.01, f"{name} of a single column"
        plt.close(figure)


@pytest.mark.slow
def test_every_kind_of_result_is_drawn_here() -> None:
    """A new kind fails here until a small result of it is among those of ``every_kind``; one is drawn in ``tests/lab``."""
    assert {figures_of(each())[0] for each in RESULTS.values()} == {kind.words for kind in _KINDS} - {
        "frequency response"
    }


GALLERY = ("run", "map", "map of a line", "attractors", "probability map", "lifetimes")


@pytest.mark.sampled(5)
@pytest.mark.parametrize(
    "result", [pytest.param(name, marks=pytest.mark.slow if name == "run" else ()) for name in GALLERY]
)
def test_files_are_small_and_have_their_fonts(result: str, style: str, tmp_path) -> None:
    """Vector files have their fonts embedded as TrueType and are below 2 MB."""
    dataset = computed(result)
    for name in figures_of(dataset)[1]:
        figure = dataset.snapbeam.plot(name).get_figure(root=True)
        for suffix in (".pdf", ".svg"):
            file = save_figure(figure, tmp_path / f"figure{suffix}")
            assert file.stat().st_size < 2e6, f"{name}{suffix}"
        text = (tmp_path / "figure.pdf").read_bytes()
        assert b"/FontFile2" in text and b"/Type3" not in text, name
        plt.close(figure)


def test_text_of_the_schematic_is_inside_the_canvas() -> None:
    assert outside(SYSTEM.plot()) < 0.01


def test_a_talk_has_larger_markers() -> None:
    sizes = []
    for name in ("elsevier", "talk"):
        sb.plot.plot_style(name)
        ax = RESULTS["attractors"]().snapbeam.plot()
        legend = ax.figure.legends[0].get_lines()
        sizes.append([line.get_markersize() for line in (*ax.lines, *legend)])
    sb.plot.plot_style("elsevier")
    np.testing.assert_allclose(sizes[1], 1.5 * np.array(sizes[0]))


@pytest.mark.parametrize(
    ("name", "x", "y"),
    [
        ("impact section", "drive_phase", "velocity_at_striker"),
        ("section at a level", "drive_phase", "midspan_velocity"),
        ("stroboscopic section", "midspan_displacement", "midspan_velocity"),
    ],
)
def test_a_section_is_drawn_over_what_differs(name: str, x: str, y: str) -> None:
    """The displacement at a level is the level, and at an impact that of the striker."""
    section = RESULTS[name]()
    (line,) = section.snapbeam.plot().lines
    np.testing.assert_array_equal(line.get_xdata(), section[x].values)
    np.testing.assert_array_equal(line.get_ydata(), section[y].values)


def test_hysteresis_draws_the_motion_and_names_the_well_of_its_first_run() -> None:
    """The status is drawn only if asked for; the sweep ends in another well than it began in."""
    found = RESULTS["hysteresis"]()
    assert len(set(found["final_well"].values.ravel())) == 2
    ax = found.snapbeam.plot()
    assert ax.get_ylabel().replace("\n", " ").startswith("Maximum distance of mid-span")
    assert ax.get_title().replace("\u00a0", " ").endswith("from the lower well")
    assert list(figures_of(found)[1])[-1] == "status"


@pytest.mark.slow
def test_a_branch_passes_through_its_special_points() -> None:
    found = RESULTS["branch"]()
    ax = found.snapbeam.plot()
    solid = next(line for line in ax.lines if line.get_linestyle() == "-")
    folds = [line for line in ax.lines if line.get_label() == "fold"]
    assert len(folds) == found.sizes["special_point"] > 0
    for fold in folds:
        at = np.flatnonzero(solid.get_xdata() == fold.get_xdata()[0])
        other = [line for line in ax.lines if line.get_linestyle() == "--"]
        assert any(fold.get_ydata()[0] == line.get_ydata()[at[0]] for line in (solid, *other))
