"""Figures and tables of results.

The functions of :mod:`snapbeam.plot` are found by name when a figure is requested, because Matplotlib loads slowly.
"""

from __future__ import annotations

import html
from collections.abc import Iterable, Sequence
from importlib import import_module
from typing import Any


def plotter(name: str) -> Any:
    """A function of :mod:`snapbeam.plot`."""
    return getattr(import_module("snapbeam.plot"), name)


def html_table(title: str, rows: Iterable[Sequence[object]]) -> str:
    """A table as notebooks show it."""
    lines = [
        "<tr>" + "".join(f"<td style='text-align:left'>{html.escape(str(cell))}</td>" for cell in row) + "</tr>"
        for row in rows
    ]
    return f"<div><strong>{html.escape(title)}</strong><table>{''.join(lines)}</table></div>"


class DatasetFigures:
    """Figures of a dataset, as ``dataset.snapbeam``.

    Parameters
    ----------
    dataset : xarray.Dataset
    """

    def __init__(self, dataset: Any) -> None:
        self._dataset = dataset

    def plot(self, variable: str | None = None, ax: Any = None, **options: Any) -> Any:
        """Draw the dataset; see :func:`snapbeam.plot.plot_dataset`."""
        return plotter("plot_dataset")(self._dataset, variable, ax, **options)
