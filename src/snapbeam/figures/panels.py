"""Parts that figures of several panels share: letters, cells of response classes, one legend."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.colors import BoundaryNorm, ListedColormap
from matplotlib.figure import Figure
from matplotlib.legend import Legend
from numpy.typing import ArrayLike, NDArray

from snapbeam.core.validate import InputError, finite_array
from snapbeam.figures.style import CLASS_COLORS

__all__ = ["cell_edges", "class_cells", "figure_legend", "panel_letters"]

_Array = NDArray[np.float64]


def panel_letters(axes: Iterable[Axes], first: str = "A", *, offset: float = -16.0) -> None:
    """Write a bold capital beside the upper left corner of each of *axes*, *offset* points to its right."""
    for at, ax in enumerate(axes):
        ax.annotate(
            chr(ord(first) + at),
            (0.0, 1.0),
            (offset, 3.0),
            xycoords="axes fraction",
            textcoords="offset points",
            fontsize=9,
            fontweight="bold",
            ha="right",
            va="bottom",
            annotation_clip=False,
        )


def cell_edges(points: ArrayLike, low: float = -np.inf, high: float = np.inf) -> _Array:
    """Borders midway between the points of an axis; the outermost as far out as the next one in."""
    x = finite_array("points", points, 1)
    if x.size < 2:
        raise InputError(f"points = {x.tolist()}: must be at least two")
    middle = 0.5 * (x[1:] + x[:-1])
    first, last = max(2.0 * x[0] - middle[0], low), min(2.0 * x[-1] - middle[-1], high)
    return np.concatenate([[first], middle, [last]])


def class_cells(ax: Axes, x: ArrayLike, y: ArrayLike, kinds: ArrayLike) -> None:
    """Colour cells by their response class.

    Parameters
    ----------
    x, y : array_like
        Borders of the cells, of shapes (columns + 1,) and (rows + 1,), or both (rows + 1, columns + 1).
    kinds : array_like, shape (rows, columns)
        :class:`~snapbeam.ResponseClass` of each.
    """
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
