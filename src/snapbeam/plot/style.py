"""One style for all figures: column widths of a journal, one font, colours that colour-blind readers distinguish."""

from __future__ import annotations

import io
import os
import re
import textwrap
from collections.abc import Collection, Iterable, Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import matplotlib as mpl
import numpy as np
from cmcrameri import cm
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.collections import PathCollection
from matplotlib.colors import BoundaryNorm, ListedColormap, LogNorm
from matplotlib.figure import Figure
from matplotlib.legend import Legend
from matplotlib.lines import Line2D
from matplotlib.ticker import AutoLocator, LogLocator, MaxNLocator, NullFormatter
from numpy.typing import ArrayLike, NDArray

from snapbeam.model.parameters import PHYSICAL, lookup
from snapbeam.plot.units import given_in_units, ratio_name
from snapbeam.util.diagnostics import Diagnostic, Severity
from snapbeam.util.files import MADE_BY, atomic_path, check_writable
from snapbeam.util.si_prefixes import prefixed
from snapbeam.util.status_codes import ResponseClass, is_of_matrices
from snapbeam.util.validation import InputError, choice, finite_array, within

if TYPE_CHECKING:
    import xarray as xr

COLUMN_WIDTHS = {"single": 90.0, "double": 190.0}
"""Widths of one and of two columns of a page, mm."""

FIGURE_SUFFIXES = (".png", ".pdf", ".svg")

# Chosen so that any two differ clearly in colour (CIE 1976 colour difference) for normal vision and under
# simulated protanopia, deuteranopia and tritanopia (Machado, Oliveira and Fernandes 2009, severity 1); the
# tests keep the difference above 28 and the five lightnesses at least 8 apart.
CLASS_COLORS = {
    ResponseClass.INTRAWELL: "#B03A27",
    ResponseClass.TRANSIENT_1: "#16245E",
    ResponseClass.TRANSIENT_2: "#70BBF0",
    ResponseClass.CONTINUOUS: "#C3DD8A",
    ResponseClass.UNKNOWN: "#858585",
}
"""Colour of each response class: red, dark blue, light blue, green; grey where the class is unknown."""

BEAM_COLOR = "#000000"
SHAKER_COLOR = "#B03A27"
CENTER_COLOR = "#70BBF0"

SERIES_COLORS = ("#16245E", "#B03A27", "#70BBF0", "#858585", "#000000")
"""Colours of curves and regions that are no response classes, in their order."""

_SCALE_OF_LABEL = re.compile(r"\(\$?b\$? = ")
_SCALE_OF_TITLE = re.compile(r", \$b\$\s=\s[^,\n]*")
_NO_BREAK = re.compile(r"(?<=\$) (?==)|(?<==) | (?=\()| (?=%)|(?<=from) |(?<=the) | (?=well)")
"""Spaces of a title that a line does not end at: about equals signs, before brackets and in the name of a well."""

_RC: Any = {
    "axes.axisbelow": True,
    "axes.labelsize": 8,
    "axes.linewidth": 0.6,
    "axes.titlesize": 8,
    "figure.constrained_layout.use": True,
    "figure.dpi": 150,
    "font.family": ["DejaVu Sans"],  # by name: a generic family is another font once the context has ended
    "font.size": 8,
    "legend.fontsize": 7,
    "legend.columnspacing": 1.4,
    "legend.frameon": False,
    "legend.handlelength": 1.4,
    "lines.linewidth": 0.9,
    "mathtext.fontset": "dejavusans",
    "path.simplify_threshold": 0.5,
    "pdf.fonttype": 42,
    "savefig.dpi": 300,
    "svg.fonttype": "none",
    "svg.hashsalt": "snapbeam",
    "xtick.labelsize": 7,
    "xtick.major.width": 0.6,
    "ytick.labelsize": 7,
    "ytick.major.width": 0.6,
}


_STYLES: dict[str, tuple[tuple[float, float], float, str]] = {
    "elsevier": ((90.0, 190.0), 8.0, "DejaVu Sans"),
    "ieee": ((88.9, 181.9), 8.0, "STIXGeneral"),
    "nature": ((89.0, 183.0), 7.0, "DejaVu Sans"),
    "slides": ((130.0, 254.0), 12.0, "DejaVu Sans"),
    "talk": ((130.0, 254.0), 12.0, "DejaVu Sans"),
}
"""Widths of one and of two columns, mm; size of labels, points; font."""
_BASE = dict(_RC)


def plot_style(name: str) -> None:
    """Choose widths, font and sizes of text and lines of all figures from now on.

    Parameters
    ----------
    name : {"elsevier", "ieee", "nature", "slides", "talk"}
        Columns of 90 and 190 mm, the default; of 88.9 and 181.9 mm with a serif font; of 89 and 183 mm with smaller text;
        of 130 and 254 mm with larger text, for slides or a talk.

    Raises
    ------
    InputError
        For another name.

    Examples
    --------
    >>> import snapbeam as sb
    >>> sb.plot.plot_style("ieee")
    >>> f"{25.4 * sb.plot.new_figure('single').get_figwidth():.1f} mm"
    '88.9 mm'
    >>> sb.plot.plot_style("elsevier")
    """
    widths, size, font = _STYLES[choice("name", name, tuple(_STYLES))]
    COLUMN_WIDTHS.update(zip(COLUMN_WIDTHS, widths, strict=True))
    scale = size / _BASE["font.size"]
    scaled = ("size", "width", "linewidth")  # of text and lines
    _RC.update({key: scale * _BASE[key] for key in _BASE if key.endswith(scaled)})
    _RC.update({"font.family": [font], "mathtext.fontset": "stix" if font == "STIXGeneral" else "dejavusans"})


def figure_style() -> AbstractContextManager[None]:
    """Return a context in which Matplotlib draws in the style of this package.

    Matplotlib loads its backend first.  In a notebook the backend switches ``rcParams["interactive"]`` on, and the end
    of the context would switch it off again if the backend were loaded inside.

    Examples
    --------
    >>> import snapbeam as sb
    >>> with sb.plot.figure_style():
    ...     figure = sb.plot.new_figure("single")
    """
    import matplotlib.pyplot as plt

    if not plt.get_fignums():  # where there is a figure, the backend is loaded
        plt.draw_if_interactive()
    return mpl.rc_context(_RC)


def fix_ticks(*axes: Axes) -> None:
    """Give the ticks of *axes* the style of this package, at most seven along x, so that their numbers stay apart."""
    for ax in axes:
        ax.tick_params(labelsize=_RC["xtick.labelsize"], width=_RC["xtick.major.width"])
        for axis in (ax.xaxis, ax.yaxis):  # further ticks are copies of these, also of their font
            axis.get_major_ticks(1), axis.get_minor_ticks(1)
        locator = ax.xaxis.get_major_locator()
        if isinstance(locator, AutoLocator):
            locator.set_params(nbins=6, steps=[1, 2, 5, 10])


def new_figure(width: str = "single", height: float = 75.0) -> Figure:
    """Return an empty figure in the style of this package, known to pyplot so that notebooks show it.

    Parameters
    ----------
    width : {"single", "double"}
        One column (90 mm) or two (190 mm), unless :func:`snapbeam.plot.plot_style` chose others.
    height : float
        Height, mm, at most 10,000, for columns of 90 mm; in proportion for others.

    Examples
    --------
    >>> import snapbeam as sb
    >>> figure = sb.plot.new_figure("double", height=60.0)
    >>> f"{25.4 * figure.get_figwidth():.0f} mm"
    '190 mm'
    """
    import matplotlib.pyplot as plt

    millimetres = COLUMN_WIDTHS[choice("width", width, tuple(COLUMN_WIDTHS))]
    tall = within("height", height, 0.0, 1e4, closed="right", unit="mm")
    tall *= COLUMN_WIDTHS["single"] / _STYLES["elsevier"][0][0]
    with figure_style():
        return plt.figure(figsize=(millimetres / 25.4, tall / 25.4))


@contextmanager
def frame(
    ax: Axes | None, dataset: xr.Dataset | None = None, width: str = "single", height: float = 72.0,
    axes: Collection[str] = (),
) -> Iterator[Axes]:  # fmt: skip
    """Axes to draw on in the style of this package, with its ticks in the end.

    They are those that were given, or of a new figure whose title states the fixed parameters of the dataset: all but
    those along *axes*.
    """
    with figure_style():
        new = ax is None
        if ax is None:
            ax = new_figure(width, height).add_subplot()
            if dataset is not None:
                set_title(ax, caption(dataset, 2, axes))
        yield ax
        say_scale_once(ax)
        fix_ticks(ax)
        if new and (scale := _scale()) != 1.0:
            _enlarge(ax, scale)


def _scale() -> float:
    """Size of text and lines over that of the first style."""
    return float(_RC["font.size"] / _BASE["font.size"])


def _enlarge(ax: Axes, scale: float) -> None:
    """Enlarge the markers, and the lines of a width of their own, of the figure of *ax* and of its legends."""
    figure = ax.get_figure(root=True)
    assert figure is not None
    drawn: list[Any] = [each for own in figure.axes for each in (*own.lines, *own.collections)]
    for legend in figure.findobj(Legend):
        drawn += legend.findobj(Line2D) + legend.findobj(PathCollection)
    for each in drawn:
        if isinstance(each, PathCollection):
            each.set_sizes(scale**2 * np.asarray(each.get_sizes()))
        elif isinstance(each, Line2D):
            each.set_markersize(scale * each.get_markersize())
            if each.get_linewidth() != _RC["lines.linewidth"]:
                each.set_linewidth(scale * each.get_linewidth())


def say_scale_once(ax: Axes) -> None:
    """Take the length scale b out of the title of *ax* where the label of an axis has it."""
    figure = ax.get_figure(root=True)
    assert figure is not None
    labels = [text for each in figure.axes for text in (each.get_xlabel(), each.get_ylabel())]
    if any(_SCALE_OF_LABEL.search(text) for text in labels):
        ax.title.set_text(_SCALE_OF_TITLE.sub("", ax.get_title()))


def extend_title(ax: Axes, words: str) -> None:
    """Write a further line below the fixed parameters in the title."""
    set_title(ax, f"{ax.get_title()}\n{words}".strip())


def contains(dataset: xr.Dataset, words: str, *names: str) -> None:
    """Raise an InputError unless a dataset has the variables of a kind of result."""
    if not set(names) <= set(map(str, dataset.variables)):
        raise InputError(f"no {words} among {list(map(str, dataset.variables))}")


def color_of(number: int, count: int, last: float = 0.85) -> Any:
    """Colour of one of several curves in an order, such as those of modes."""
    return cm.batlow(last * number / max(count - 1, 1))


def marker_size(points: int) -> float:
    """Size of the markers of a curve, points, so that those of many do not run into one another."""
    return float(np.clip(120.0 / max(points, 1), 1.2, 3.0))


def color_bar(mesh: Any, ax: Axes, label: str, **options: Any) -> None:
    """Draw the colour bar of cells or dots beside their axes."""
    bar = ax.figure.colorbar(mesh, ax=ax, label=label, **options)
    if isinstance(mesh.norm, LogNorm):
        plain_decades(bar.ax.yaxis, *mesh.get_clim())
    fix_ticks(bar.ax)


def plain_decades(axis: Axis, low: float, high: float) -> None:
    """Write plain numbers at a few ticks along a logarithmic axis of fewer than three decades, or a part of one."""
    if 0.0 < low < high < 1e3 * low and ((1e-3 <= low and high < 1e5) or high < 3.0 * low):
        few = LogLocator(subs=(1.0, 2.0, 5.0)) if high > 5.0 * low else MaxNLocator(4)
        axis.set_major_locator(few)
        axis.set_major_formatter("{x:g}")
        axis.set_minor_formatter(NullFormatter())


def set_title(ax: Axes, text: str) -> None:
    """Write the title of *ax*, which ``ax.set_title`` replaces; it continues on a new line at the edge of the figure."""
    ax.set_title(_NO_BREAK.sub("\u00a0", text), loc="center", fontsize=_RC["legend.fontsize"], wrap=True)


def save_figure(figure: Figure | Axes, path: str | os.PathLike[str]) -> Path:
    """Write a figure, or the one that axes are in, to PNG (300 dots per inch), PDF or SVG, by the suffix.

    The file is whole or not there.

    Raises
    ------
    InputError
        If the path cannot be written or has another suffix.

    Examples
    --------
    >>> import snapbeam as sb
    >>> from snapbeam import paper
    >>> system = paper.struck_beam(frequency_ratio=1.2, velocity_amplitude=0.18)
    >>> run = sb.simulate(system, sb.Integration(cycles=20))
    >>> sb.plot.save_figure(run.plot(), "run.pdf").name
    'run.pdf'
    """
    target = check_writable(path, "plot", FIGURE_SUFFIXES)
    if isinstance(figure, Axes):
        whole = figure.get_figure(root=True)
        assert whole is not None
        figure = whole
    kind = target.suffix.lower().lstrip(".")
    stamp = {"pdf": {"Creator": MADE_BY, "CreationDate": None}, "svg": {"Creator": MADE_BY, "Date": None}}.get(
        kind, {"Description": MADE_BY}
    )
    whole_file = io.BytesIO()  # Matplotlib's PDF writer fails in other ways when the disk is full
    try:
        with figure_style():
            figure.savefig(whole_file, format=kind, metadata=stamp)
    except InputError:
        raise
    except (ArithmeticError, TypeError, ValueError) as error:  # of ticks beyond the range of numbers, in many words
        raise InputError(
            f"plot = {str(path)!r}: Matplotlib cannot draw the figure, whose numbers may be too large, too small or too "
            f"close to each other ({str(error).splitlines()[0] if str(error) else type(error).__name__})"
        ) from error
    with atomic_path(target) as temporary:
        temporary.write_bytes(whole_file.getvalue())
    return target


# ----------------------------------------------------------------------------------------------------
# Captions: the beam, the drive and the response class, with prefixes of the units.


def beam_text(attrs: Any) -> str:
    """Short description of the beam from the attributes of a file; empty without one."""
    attrs = {name.removeprefix("fixed_"): value for name, value in attrs.items()}  # those of designs are fixed
    if not {"beam_length", "beam_thickness"} <= set(attrs):
        return ""
    words = [f"beam {prefixed(attrs['beam_length'], 'm')} × {prefixed(attrs['beam_thickness'], 'm')}"]
    # an arch without axial load: the height of its centre at rest
    if scale := attrs.get("beam_buckling_level") or attrs.get("length_scale"):
        words.append(f"$b$ = {prefixed(scale, 'm')}")
    return ", ".join(words)


def caption(dataset: xr.Dataset, lines: int = 1, axes: Collection[str] = ()) -> str:
    """Beam, modes, cycles of a map, fixed parameters and class of a run, in one or two lines.

    *axes* are the parameters along the axes, which are not fixed.
    """
    attrs = dataset.attrs
    axes = {*axes, str(attrs.get("parameter", ""))}  # a parameter that is raised or swept
    axes |= set(map(ratio_name, axes))
    frequency, length = (attrs.get(name, np.nan) for name in ("reference_frequency", "length_scale"))
    parts = ["" if any(name.startswith("beam") for name in axes) else beam_text(attrs)]
    how = [f"$N$ = {int(attrs['modes'])}"] if "modes" in attrs and "modes" not in axes else []
    how += (
        [f"{int(attrs['cycles'])} cycles"]
        if {"response_class", "lower_threshold"} & set(dataset.variables) and "cycles" in attrs
        else []
    )
    given = _fixed_in_units(dataset, axes)
    for name, symbol, scale, unit in (
        ("frequency_ratio", r"\Omega", frequency, "Hz"),
        ("velocity_amplitude", "V", 2.0 * np.pi * frequency * length, "m/s"),
        ("location", r"x_\mathrm{s}", np.nan, ""),
    ):
        if name in given or (name == "location" and is_of_matrices(attrs)):
            continue
        if (value := fixed_value(dataset, name, axes)) is not None:
            physical = f" ({prefixed(value * scale, unit)})" if np.isfinite(scale) else ""
            how.append(f"${symbol}$ = {value:.4g}{physical}")
    how += given.values()
    how += base_and_load(dataset, axes)
    if "initial_well" in attrs and attrs["initial_well"] != "only":
        well = str(attrs["initial_well"])
        how.append(f"from {well}" if well[-1].isdigit() else f"from the {well} well")
    parts.append(", ".join(how))
    text = ("\n" if lines > 1 else ", ").join(part for part in parts if part)
    kind = attrs.get("response_class")
    return f"{text}: {kind}" if isinstance(kind, str) and text else text


def _fixed_in_units(dataset: xr.Dataset, axes: Collection[str]) -> dict[str, str]:
    """Texts of fixed values that were given in physical units, by their ratio; those of the base are told elsewhere."""
    found, given = {}, given_in_units(dataset.attrs)
    for name, each in PHYSICAL.items():
        short, ratio = lookup(name).short, lookup(each.parameter).short
        value = fixed_value(dataset, short, axes) if short in dataset.coords else None
        if value is None and name in given and fixed_value(dataset, ratio, axes) is not None:
            value = given[name]
        if value is not None and not name.startswith("base_excitation"):
            plain = {"um": "µm", "g": "$g$"}.get(each.unit)
            text = f"{value:.4g} {plain}" if plain else prefixed(value, each.unit, 4)
            found[ratio] = rf"$x_\mathrm{{s}}$ = {text}" if ratio == "location" else text
    return found


def fixed_value(dataset: xr.Dataset, name: str, axes: Collection[str] = ()) -> float | None:
    """Value of a parameter that is the same in the whole dataset; None if it differs or is not known."""
    if name in dataset.coords:
        return float(dataset[name].squeeze()) if dataset[name].size == 1 and name not in axes else None
    value = dataset.attrs.get(name, dataset.attrs.get(f"fixed_{name}"))  # the second of designs
    return None if name in axes or value is None else float(value)


_GRAVITY = 9.80665


def base_and_load(dataset: xr.Dataset, axes: Collection[str] = ()) -> list[str]:
    """The base excitation in Hz, g and ms, and the load resistance of a harvester."""
    attrs, words = dataset.attrs, []
    omega = 2.0 * np.pi * attrs.get("reference_frequency", np.nan)
    unit = omega**2 * attrs.get("length_scale", np.nan)
    names = ("frequency_ratio", "acceleration_amplitude")
    for name in (*(f"base_excitation_{each}" for each in names), "harvester_resistance"):
        if (value := fixed_value(dataset, name, axes)) is None:
            continue
        if name.endswith("resistance"):
            words.append(f"$R$ = {prefixed(value, 'Ω')}")
        elif name.endswith("ratio") and np.isfinite(omega):
            words.append(f"base {prefixed(value * omega / (2.0 * np.pi), 'Hz')}")
        elif name.endswith("amplitude") and np.isfinite(unit):
            words.append(f"{float(f'{value * unit / _GRAVITY:.3g}'):.6g} $g$")
    of_shock = {"acceleration_g": "{:.6g} $g$", "duration_ms": "{:.4g} ms"}
    for kind, texts in (("shock", of_shock), ("random", {"rms_g": "{:.4g} $g$ rms"})):
        values = {name: fixed_value(dataset, f"base_excitation_{name}", axes) for name in texts}
        told = [texts[name].format(value) for name, value in values.items() if value is not None]
        words += [f"{kind} {', '.join(told)}"] if told else []
    return words


# ----------------------------------------------------------------------------------------------------
# Parts that figures of several panels share: letters, cells of response classes, one legend.


_Array = NDArray[np.float64]


def panel_letters(axes: Iterable[Axes], first: str = "A", *, offset: float = -16.0) -> None:
    """Write a bold capital next to the upper left corner of each of *axes*, *offset* points to its right."""
    for at, ax in enumerate(axes):
        ax.annotate(
            chr(ord(first) + at), (0.0, 1.0), (offset, 3.0), xycoords="axes fraction", textcoords="offset points",
            fontsize=9 * _scale(), fontweight="bold", ha="right", va="bottom", annotation_clip=False,
        )  # fmt: skip


def cell_edges(points: ArrayLike, low: float = -np.inf, high: float = np.inf) -> _Array:
    """Borders midway between the points of an axis; the outermost as far out as the next one in."""
    x = finite_array("points", points, 1)
    if x.size < 2:
        raise InputError(f"points = {x.tolist()}: must be at least two")
    middle = 0.5 * (x[1:] + x[:-1])
    first, last = max(2.0 * x[0] - middle[0], low), min(2.0 * x[-1] - middle[-1], high)
    return np.concatenate([[first], middle, [last]])


def class_cells(ax: Axes, x: ArrayLike, y: ArrayLike, kinds: ArrayLike) -> None:
    """Colour cells, borders *x* and *y* as of pcolormesh, by the response class of each, *kinds* (rows, columns)."""
    order = sorted(CLASS_COLORS)
    ax.pcolormesh(
        np.asarray(x),
        np.asarray(y),
        np.asarray(kinds),
        cmap=ListedColormap([CLASS_COLORS[kind] for kind in order]),
        norm=BoundaryNorm(np.arange(order[0] - 0.5, order[-1] + 1.0), len(order)),
        rasterized=True,
    )


def figure_legend(figure: Figure, handles: Sequence[Artist], columns: int = 4) -> Legend:
    """One legend for all panels, below them."""
    return figure.legend(handles=list(handles), loc="outside lower center", ncols=columns)


# ----------------------------------------------------------------------------------------------------
# Diagnostics of a measurement: a text box below its figure; warnings and errors are red.


_LINE = 2.9  # mm
_COLORS = {Severity.INFO: "0.35", Severity.WARNING: SHAKER_COLOR, Severity.ERROR: SHAKER_COLOR}


def legend_below(ax: Axes, handles: Sequence[Artist] | None = None) -> None:
    """Write a legend below, in up to three columns that fit; none without entries.

    It is one of the whole figure if no other axes stand in it, else of *ax*.
    """
    figure = ax.get_figure(root=True)
    assert figure is not None
    entries = ax.get_legend_handles_labels()[0] if handles is None else list(handles)
    places = {each.get_subplotspec() for each in figure.axes if each.get_label() != "<colorbar>"}
    alone = len(places) == 1 and figure.get_layout_engine() is not None
    room = figure.bbox.width if alone else 1.15 * ax.get_window_extent().width
    count = len(entries)
    for columns in (each for each in (3, 2, 1) if each in {-(-count // rows) for rows in range(1, count + 1)}):
        if alone:
            legend = figure.legend(handles=entries, loc="outside lower center", ncols=columns)
        else:
            legend = ax.legend(handles=entries, loc="upper center", bbox_to_anchor=(0.5, -0.17), ncols=columns)
        if columns == 1 or legend.get_window_extent().width <= room:
            break
        legend.remove()


def _lines(diagnostics: Iterable[Diagnostic], width: float, most: int) -> list[tuple[str, str]]:
    """Wrapped lines and their colours, the gravest diagnostics first, at most so many diagnostics."""
    order = {Severity.ERROR: 0, Severity.WARNING: 1, Severity.INFO: 2}
    chosen = sorted(diagnostics, key=lambda one: order[one.severity])
    out: list[tuple[str, str]] = []
    for one in chosen[:most]:
        text = f"{one.severity.value}: {one.message}"
        for k, line in enumerate(textwrap.wrap(text, int(width / (1.11 * _scale())))):
            out.append((line if k == 0 else f"    {line}", _COLORS[one.severity]))
    if len(chosen) > most:
        out.append((f"and {len(chosen) - most} more", "0.35"))
    return out


def figure_with(
    diagnostics: Iterable[Diagnostic], width: str = "single", height: float = 75.0, most: int = 6
) -> Figure:
    """A new figure for a picture of *height* [mm] and, along its lower edge, diagnostics, which axes are kept off."""
    lines = _lines(diagnostics, COLUMN_WIDTHS[width], most)
    room = _LINE * len(lines) + 2.0 if lines else 0.0
    figure = new_figure(width, height + room)
    size, tall, scale = *(25.4 * float(each) for each in figure.get_size_inches()), _scale()
    share = room * scale / tall
    engine = figure.get_layout_engine()
    if engine is not None and lines:
        engine.set(rect=(0.0, share, 1.0, 1.0 - share))  # type: ignore[call-arg]
    for k, (text, color) in enumerate(lines):
        y = share - (k + 0.9) * _LINE * scale / tall
        figure.text(1.5 / size, y, text, color=color, fontsize=6.0 * scale, va="baseline")
    return figure
