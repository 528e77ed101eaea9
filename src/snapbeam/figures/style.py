"""One house style for every picture: widths of a journal, one font, colours anyone can tell apart."""

from __future__ import annotations

import os
from contextlib import AbstractContextManager
from pathlib import Path
from typing import Any

import matplotlib as mpl
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from snapbeam.core.codes import ResponseClass
from snapbeam.core.files import atomic_path, check_writable
from snapbeam.core.foreign import MADE_BY
from snapbeam.core.validate import choice, positive

__all__ = [
    "BEAM_COLOR",
    "CENTER_COLOR",
    "CLASS_COLORS",
    "COLUMN_WIDTHS",
    "FIGURE_SUFFIXES",
    "SHAKER_COLOR",
    "fix_ticks",
    "house_style",
    "new_figure",
    "save_figure",
]

COLUMN_WIDTHS = {"single": 90.0, "double": 190.0}
"""Widths of one and of two columns of a page, mm."""

FIGURE_SUFFIXES = (".png", ".pdf", ".svg")

# Chosen so that any two differ clearly in colour (CIE 1976 colour difference) for normal vision and under
# simulated protanopia, deuteranopia and tritanopia (Machado, Oliveira and Fernandes 2009, severity 1); the
# tests hold the difference above 28 and the five lightnesses at least 8 apart.
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

_RC: Any = {
    "axes.axisbelow": True,
    "axes.labelsize": 8,
    "axes.linewidth": 0.6,
    "axes.titlesize": 8,
    "figure.constrained_layout.use": True,
    "figure.dpi": 150,
    "font.family": "sans-serif",
    "font.sans-serif": ["DejaVu Sans"],
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


def house_style() -> AbstractContextManager[None]:
    """Return a context in which Matplotlib draws in the house style."""
    return mpl.rc_context(_RC)


def fix_ticks(*axes: Axes) -> None:
    """Give the ticks of *axes* the house style for good; Matplotlib makes them only when it draws."""
    for ax in axes:
        ax.tick_params(labelsize=_RC["xtick.labelsize"], width=_RC["xtick.major.width"])


def new_figure(width: str = "single", height: float = 75.0) -> Figure:
    """Return an empty figure in the house style, known to pyplot so that notebooks show it.

    Parameters
    ----------
    width : {"single", "double"}
        One column (90 mm) or two (190 mm).
    height : float
        Height, mm.
    """
    import matplotlib.pyplot as plt

    millimetres = COLUMN_WIDTHS[choice("width", width, tuple(COLUMN_WIDTHS))]
    with house_style():
        return plt.figure(figsize=(millimetres / 25.4, positive("height", height, "mm") / 25.4))


def axes_or_new(ax: Axes | None, width: str = "single", height: float = 72.0) -> Axes:
    """The axes that were given, or those of a new figure."""
    return new_figure(width, height).add_subplot() if ax is None else ax


def save_figure(figure: Figure | Axes, path: str | os.PathLike[str]) -> Path:
    """Write a figure, or the one that axes are in, to PNG (300 dots per inch), PDF or SVG, by the suffix.

    The file is whole or not there.

    Raises
    ------
    InputError
        If the path cannot be written or has another suffix.
    """
    target = check_writable(path, "plot", FIGURE_SUFFIXES)
    if isinstance(figure, Axes):
        whole = figure.get_figure(root=True)
        assert whole is not None
        figure = whole
    kind = target.suffix.lower().lstrip(".")
    stamp = {
        "pdf": {"Creator": MADE_BY, "CreationDate": None},
        "svg": {"Creator": MADE_BY, "Date": None},
    }.get(kind, {"Description": MADE_BY})
    with house_style(), atomic_path(target) as temporary:
        figure.savefig(temporary, format=kind, metadata=stamp)
    return target
