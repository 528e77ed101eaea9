"""Figures and tables of results.

The functions of :mod:`snapbeam.plot` are found by name when a figure is requested, because Matplotlib loads slowly.
"""

from __future__ import annotations

import html
from collections.abc import Iterable, Sequence
from importlib import import_module
from typing import Any

import numpy as np

from snapbeam.util.validation import InputError, shown


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
    """Figures of a dataset, as ``dataset.snapbeam``."""

    def __init__(self, dataset: Any) -> None:
        self._dataset = dataset

    def plot(self, variable: str | None = None, ax: Any = None, **options: Any) -> Any:
        """Draw the dataset; see :func:`snapbeam.plot.plot_dataset`."""
        return plotter("plot_dataset")(self._dataset, variable, ax, **options)

    def meanings(self, name: str) -> Any:
        """Text in place of the codes of a variable, such as ``ok`` and ``diverged`` of ``status``: an xarray.DataArray."""
        codes = self._dataset[name] if name in self._dataset else None
        if codes is None or "flag_values" not in codes.attrs:
            coded = [str(each) for each, item in self._dataset.variables.items() if "flag_values" in item.attrs]
            raise InputError(f"name = {shown(name)}: must be a variable of codes: {', '.join(coded) or 'it has none'}")
        known = dict(zip(np.ravel(codes.attrs["flag_values"]), codes.attrs["flag_meanings"].split(), strict=True))
        words = np.array([known.get(each, "") for each in codes.values.ravel()], dtype=object)
        return codes.copy(data=words.reshape(codes.shape)).drop_attrs()
