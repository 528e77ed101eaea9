"""A figure of Matplotlib as figures of the page: its lines, points, areas and cells, to zoom into and to click on."""

from __future__ import annotations

import re
import textwrap
import unicodedata
from colorsys import hls_to_rgb, rgb_to_hls
from typing import Any

import numpy as np
from bokeh import models
from matplotlib import collections, image, lines, patches, text, ticker
from matplotlib.axes import Axes
from matplotlib.colors import to_hex, to_rgba
from matplotlib.transforms import IdentityTransform
from numpy.typing import NDArray

from snapbeam.explorer import style

_DASHES = {"-": "solid", "--": "dashed", "-.": "dashdot", ":": "dotted"}
_MARKERS = {
    "s": "square", "^": "triangle", "v": "inverted_triangle", "x": "x", "X": "x", "+": "cross", "D": "diamond", "d": "diamond", "*": "star",
    "_": "dash", "|": "dash",
}  # fmt: skip
_pixels = IdentityTransform()
_NOWHERE = np.full((3, 2), np.nan)
"""Points of an entry of the legend alone; without any the browser draws no sample."""
_PIXELS = 1.6
"""Pixels of the page for a point of the printed figure."""
_SAMPLES = 20_000
"""Samples of a line; of a longer one the extremes of each part are drawn."""
_CELLS = 20_000
"""Cells of unequal size that are drawn one by one."""
_LIGHT = 0.55
"""Least lightness of a colour on a dark page."""
_LINE = 48
"""Characters of a line of a label."""
_SUPERSCRIPT = str.maketrans("0123456789-in", "⁰¹²³⁴⁵⁶⁷⁸⁹⁻ⁱⁿ")
_SUBSCRIPT = str.maketrans("0123456789-aehijklmnoprstuvx", "₀₁₂₃₄₅₆₇₈₉₋ₐₑₕᵢⱼₖₗₘₙₒₚᵣₛₜᵤᵥₓ")


def plain(label: str) -> str:
    r"""A text of Matplotlib without its formulas: ``$\omega_1$`` is ω₁."""

    def formula(found: re.Match[str]) -> str:
        words = re.sub(r"\\(?:mathrm|text|mathit|mathbf)\s*", "", found[1])
        words = re.sub(r"\\([A-Za-z]+) ?", _symbol, words)
        words = re.sub(r"([" + "".join(_ACCENTS.values()) + r"])\{?(\w)\}?", r"\2\1", words)
        words = re.sub(r"\{([^{}]*)\{([^{}]*)\}([^{}]*)\}", r"{\1\2\3}", words)
        words = re.sub(r"([_^])(?:\{([^{}]*)\}|(\w))", _script, words)
        return re.sub(r"\\[,;! ]|[{}]", "", words)

    return unicodedata.normalize("NFC", re.sub(r"\$([^$]*)\$", formula, label))


_ACCENTS = {"dot": "\u0307", "ddot": "\u0308", "bar": "\u0304", "hat": "\u0302"}
_SYMBOLS = {
    "leq": "≤", "le": "≤", "geq": "≥", "ge": "≥", "times": "×", "cdot": "·", "pm": "±", "infty": "∞", "partial": "∂"
}  # fmt: skip


def _symbol(found: re.Match[str]) -> str:
    kind = "CAPITAL" if found[1][0].isupper() else "SMALL"
    name = {"lambda": "lamda"}.get(found[1].lower(), found[1])
    try:
        return unicodedata.lookup(f"GREEK {kind} LETTER {name.upper()}")
    except KeyError:
        return (_SYMBOLS | _ACCENTS).get(found[1], "")


def _script(found: re.Match[str]) -> str:
    """An index or a power in the small digits that there are, or beside its letter."""
    words = found[2] or found[3] or ""
    table = _SUPERSCRIPT if found[1] == "^" else _SUBSCRIPT
    small = words.strip("{}")
    if all(ord(each) in table for each in small):
        return small.translate(table)
    return f"{'^' if found[1] == '^' else ' '}{small}"


def lines_of(label: str) -> str:
    """A label in lines that a figure has room for."""
    return "\n".join(textwrap.fill(line, _LINE) for line in plain(label).split("\n"))


def thinned(x: NDArray[Any], y: NDArray[Any]) -> tuple[NDArray[Any], NDArray[Any]]:
    """A line of at most some samples, the least and the largest of each part of a longer one."""
    if x.size <= _SAMPLES:
        return x, y
    parts = np.array_split(np.arange(x.size), _SAMPLES // 2)
    kept = np.unique([part[find(y[part])] for part in parts for find in (np.argmin, np.argmax)])
    return x[kept], y[kept]


class Drawn:
    """The axes of a figure of Matplotlib as ``plots`` of the page, each with its place in the figure.

    Axes that share an abscissa share a range and a cursor.
    """

    def __init__(self, axes: Axes, look: style.Look) -> None:
        self.look = look
        found: Any = axes.get_figure(root=True)
        found.canvas.draw()  # places, limits and colours are known from here on
        self.size = found.get_size_inches()
        self.plots: list[tuple[Any, Any]] = []
        self._groups: list[tuple[Axes, Any, Any]] = []
        bars = {art.colorbar.ax for each in found.axes for art in [*each.collections, *each.images] if art.colorbar}
        kept = [each for each in found.axes if each not in bars and each.get_visible()]
        kept.sort(key=lambda each: (-round(each.get_position().y1, 2), each.get_position().x0))
        self._own = found.legends if len(kept) == 1 else []
        for each in kept:
            self.plots.append((self._plot(each), each.get_position()))

    def _color(self, color: Any) -> str | None:
        """A colour for the page; on a dark one greys are turned, and dark colours are made lighter."""
        red, green, blue, alpha = to_rgba(color)
        if alpha == 0.0:
            return None
        if self.look.name == "dark":
            hue, light, much = rgb_to_hls(red, green, blue)
            grey = max(red, green, blue) - min(red, green, blue) < 0.03
            red, green, blue = hls_to_rgb(hue, 1.0 - light if grey else max(light, _LIGHT), much)
        return str(to_hex((red, green, blue, alpha), keep_alpha=True))

    def _plot(self, axes: Any) -> Any:
        low, high = axes.get_xlim()
        group = next((held for held in self._groups if axes in axes.get_shared_x_axes().get_siblings(held[0])), None)
        if group is None:
            line = models.Span(dimension="height", line_color=self.look.accent)
            group = axes, models.Range1d(low, high, reset_start=low, reset_end=high), line
            self._groups.append(group)
        _, x_range, line = group
        plot = style.figure(
            self.look, x_range=x_range, y_range=axes.get_ylim(), height=120, tools="pan,box_zoom,wheel_zoom,reset",
            x_axis_type="log" if axes.get_xscale() == "log" else "linear", active_scroll="wheel_zoom",
            y_axis_type="log" if axes.get_yscale() == "log" else "linear", name=f"result-plot{len(self.plots) + 1 if self.plots else ''}",
            x_axis_label=lines_of(axes.get_xlabel()), y_axis_label=lines_of(axes.get_ylabel()), title=plain(axes.get_title()),
        )  # fmt: skip
        overlay = [line, models.Span(dimension="width", line_color=self.look.faint)]
        plot.add_tools(models.CrosshairTool(visible=False, overlay=overlay))
        plot.title.visible = bool(plot.title.text)
        for mine, theirs in ((plot.xaxis, axes.xaxis), (plot.yaxis, axes.yaxis)):
            if isinstance(theirs.get_major_locator(), ticker.FixedLocator):
                at = [float(place) for place in theirs.get_majorticklocs()]
                words = [plain(label.get_text()) for label in theirs.get_ticklabels()]
                mine.ticker = at
                mine.major_label_overrides = {place: word for place, word in zip(at, words, strict=False) if word}
        named: dict[str, list[Any]] = {}
        titles = (axes.patch, axes.title, axes._left_title, axes._right_title, *axes.spines.values())
        for art in sorted(axes.get_children(), key=lambda each: each.get_zorder()):
            if art.get_visible() and art not in titles:
                for renderer in self._artist(plot, axes, art):
                    named.setdefault(str(art.get_label()), []).append(renderer)
        items = []
        for legend in filter(None, (axes.get_legend(), *self._own)):
            for handle, words in zip(legend.legend_handles, legend.get_texts(), strict=False):
                label = words.get_text()
                drawn = named.get(label) or self._artist(plot, axes, handle, empty=True)
                items.append(models.LegendItem(label=plain(label), renderers=drawn))
        if items:
            plot.add_layout(models.Legend(items=items))
            style.legend(plot, self.look, ncols=2)
        return plot

    def _artist(self, plot: Any, axes: Axes, art: Any, empty: bool = False) -> list[Any]:
        """Draw one artist; *empty* for an entry of the legend alone."""
        kind = type(art)

        def placed(points: Any, transform: Any) -> NDArray[Any]:
            points = np.asarray(points, dtype=np.float64).reshape(-1, 2)
            return points if transform == axes.transData else (transform - axes.transData).transform(points)

        def columns(polygons: list[Any]) -> dict[str, Any]:
            kept = [_NOWHERE] if empty else [each for each in polygons if len(each)]
            return {"xs": [each[:, 0] for each in kept], "ys": [each[:, 1] for each in kept]}

        if issubclass(kind, lines.Line2D):
            return self._line(plot, axes, art, placed, empty)
        if issubclass(kind, collections.QuadMesh) and not empty:
            return self._cells(plot, art)
        if issubclass(kind, image.AxesImage) and not empty:
            left, right, low, high = art.get_extent()
            colors = art.to_rgba(art.get_array(), bytes=True, norm=True)
            colors = colors if art.origin == "lower" else colors[::-1]
            return [self._image(plot, art, colors, (left, right, low, high))]
        if issubclass(kind, patches.Patch):
            shape = art.get_path().interpolated(1).to_polygons(art.get_transform())
            data = columns([placed(each, _pixels) for each in shape])
            return [plot.patches(
                "xs", "ys", source=models.ColumnDataSource(data), fill_color=self._color(art.get_facecolor()),
                line_color=self._color(art.get_edgecolor()) if art.get_linewidth() else None,
                hatch_pattern="/" if art.get_hatch() else None, hatch_color=self.look.faint,
            )]  # fmt: skip
        if issubclass(kind, (collections.PathCollection, collections.RegularPolyCollection)):
            at = placed(art.get_offsets(), art.get_offset_transform())
            sizes = np.sqrt(art.get_sizes()) * _PIXELS if len(art.get_sizes()) else np.array([6.0])
            faces = [self._color(each) for each in art.get_facecolors()] or [None]
            edges = [self._color(each) for each in art.get_edgecolors()] or [None]
            data = {"x": at[:, 0], "y": at[:, 1]} | {
                name: [each[i % len(each)] for i in range(len(at))]
                for name, each in (("size", sizes), ("fill", faces), ("edge", edges))
            }
            if empty:
                return [plot.scatter([np.nan], [np.nan], size=6, fill_color=faces[0], line_color=edges[0])]
            return [plot.scatter(
                "x", "y", size="size", fill_color="fill", line_color="edge", source=models.ColumnDataSource(data)
            )]  # fmt: skip
        if issubclass(kind, collections.Collection):
            return self._paths(plot, art, placed, columns)
        if issubclass(kind, text.Text) and art.get_text() and not empty:
            box = art.get_window_extent()
            ((x, y),) = placed([box.x0, box.y0], _pixels)
            if issubclass(kind, text.Annotation) and art.arrow_patch is not None:
                path = placed(art.arrow_patch.get_path().vertices, art.arrow_patch.get_transform())
                plot.line(*path.T, line_color=self.look.faint)
            plot.add_layout(models.Label(
                x=float(x), y=float(y), text=plain(art.get_text()), text_color=self._color(art.get_color()),
                text_font_size=self.look.font(11),
            ))  # fmt: skip
        return []

    def _line(self, plot: Any, axes: Axes, art: Any, placed: Any, empty: bool) -> list[Any]:
        points = np.column_stack([np.asarray(each, dtype=np.float64) for each in art.get_data(orig=False)])
        color, wide = self._color(art.get_color()), _PIXELS * art.get_linewidth()
        look = {"line_color": color, "line_alpha": art.get_alpha() or 1.0, "line_width": wide}
        dashes = _DASHES.get(str(art.get_linestyle()))
        (x_in, y_in), (x, y) = art.get_transform().contains_branch_seperately(axes.transData), points.T
        if x_in != y_in and not empty and x.size == 2:  # a line across the axes
            across = models.Span(
                dimension="height" if x_in else "width", location=float((x if x_in else y)[0]), line_dash=dashes, **look
            )  # fmt: skip
            plot.add_layout(across)
            return []
        if empty:
            points = _NOWHERE
        x, y = thinned(*placed(points, art.get_transform()).T)
        made = []
        if dashes is not None and art.get_linewidth():
            steps = str(art.get_drawstyle()).partition("-")[2]
            draw = {"": plot.line, "pre": plot.step, "mid": plot.step, "post": plot.step}[steps]
            mode = {"mode": {"pre": "before", "mid": "center", "post": "after"}[steps]} if steps else {}
            made.append(draw(x, y, line_dash=dashes, **mode, **look))
        kind = art.get_marker()
        if kind not in (None, "", " ", "None", "none"):
            size = art.get_markersize() * _PIXELS * (0.6 if kind == "." else 1.0)
            made.append(plot.scatter(
                x, y, marker=_MARKERS.get(str(kind), "circle"), size=max(size, 2.5), alpha=art.get_alpha() or 1.0,
                fill_color=self._color(art.get_markerfacecolor()), angle=0.5 * np.pi if kind == "|" else 0.0,
                line_color=self._color(art.get_markeredgecolor()) if art.get_markeredgewidth() else None,
            ))  # fmt: skip
        return made

    def _paths(self, plot: Any, art: Any, placed: Any, columns: Any) -> list[Any]:
        """Draw lines or areas."""
        faces, edges = (list(map(self._color, each)) for each in (art.get_facecolors(), art.get_edgecolors()))
        made = []
        groups = [[path] for path in art.get_paths()]
        if max(map(len, (faces, edges, art.get_linewidths(), art.get_linestyles()))) <= 1:  # all look the same
            groups = [[path for group in groups for path in group]]
        for at, group in enumerate(groups):
            parts = [part for path in group for part in path.to_polygons(closed_only=False)]
            polygons = [placed(each, art.get_transform()) for each in parts]
            fill = faces[at % len(faces)] if faces else None
            edge = edges[at % len(edges)] if edges else None
            widths = art.get_linewidths()
            data = models.ColumnDataSource(columns(polygons))
            line = {"line_color": edge, "line_width": _PIXELS * float(widths[at % len(widths)]) if len(widths) else 1.0}
            if fill is None and not art.get_hatch():
                _, sequence = art.get_linestyles()[at % len(art.get_linestyles())]
                dashes = " ".join(str(max(round(_PIXELS * each), 1)) for each in sequence or ())
                line["line_dash"] = dashes or "solid"
                made.append(plot.multi_line("xs", "ys", source=data, **line))
            else:
                hatch = {"hatch_pattern": "/", "hatch_color": edge or self.look.faint} if art.get_hatch() else {}
                made.append(plot.patches("xs", "ys", source=data, fill_color=fill, **line, **hatch))
        return made

    def _cells(self, plot: Any, art: Any) -> list[Any]:
        corners = art.get_coordinates()
        x, y = corners[0, :, 0], corners[:, 0, 1]
        colors = np.round(255.0 * art.get_facecolors()).astype(np.uint8).reshape(y.size - 1, x.size - 1, 4)
        equal = all(np.allclose(np.diff(each), (each[-1] - each[0]) / (each.size - 1)) for each in (x, y))
        if equal or colors[..., 0].size > _CELLS:
            return [self._image(plot, art, colors, (x[0], x[-1], y[0], y[-1]))]
        left, low = np.meshgrid(x[:-1], y[:-1])
        right, high = np.meshgrid(x[1:], y[1:])
        data = {"left": left.ravel(), "right": right.ravel(), "low": low.ravel(), "high": high.ravel()}
        data["color"] = [to_hex(each / 255.0, keep_alpha=True) for each in colors.reshape(-1, 4)]
        self._bar(plot, art)
        return [plot.quad(
            "left", "right", "low", "high", fill_color="color", line_color="color", source=models.ColumnDataSource(data)
        )]  # fmt: skip

    def _image(self, plot: Any, art: Any, colors: NDArray[np.uint8], extent: tuple[float, ...]) -> Any:
        left, right, low, high = map(float, extent)
        self._bar(plot, art)
        packed = np.ascontiguousarray(colors).view(np.uint32)[..., 0]
        return plot.image_rgba(image=[packed], x=left, y=low, dw=right - left, dh=high - low)

    def _bar(self, plot: Any, art: Any) -> None:
        """Draw the scale of colours, if there is one."""
        bar = art.colorbar
        if bar is None:
            return
        upright = bar.orientation == "vertical"
        axis = bar.ax.yaxis if upright else bar.ax.xaxis
        log = axis.get_scale() == "log"
        low, high = sorted(float(each) for each in (bar.vmin, bar.vmax))
        values = np.geomspace(low, high, 256) if log else np.linspace(low, high, 256)
        mapper = models.LogColorMapper if log else models.LinearColorMapper
        colors = [to_hex(each) for each in art.cmap(art.norm(values))]
        ticks = [float(each) for each in axis.get_majorticklocs() if low <= each <= high]
        words = dict(zip(axis.get_majorticklocs(), axis.get_ticklabels(), strict=False))
        plot.add_layout(
            models.ColorBar(
                color_mapper=mapper(palette=colors, low=low, high=high), title=plain(axis.get_label_text()),
                ticker=models.FixedTicker(ticks=ticks), background_fill_color=None, height=12, padding=8,
                major_label_overrides={each: plain(words[each].get_text()) for each in ticks},
                major_label_text_color=self.look.text, title_text_color=self.look.text,
                title_text_font_size=self.look.font(12), title_text_font_style="normal",
            ), "above",
        )  # fmt: skip
