"""How results show themselves: pictures and tables, looked up by name when somebody asks for one.

Nothing of a drawing library is loaded before, and no room below the figures knows one.
"""

from __future__ import annotations

import html
import sys
from collections.abc import Iterable, Sequence
from importlib import import_module
from importlib.abc import MetaPathFinder
from importlib.util import find_spec
from typing import Any

__all__ = ["DatasetFigures", "add_accessor", "html_table", "plotter"]


def plotter(name: str) -> Any:
    """A function of :mod:`snapbeam.plot`."""
    return getattr(import_module("snapbeam.plot"), name)


def html_table(title: str, rows: Iterable[Sequence[object]]) -> str:
    """A table as notebooks show it."""
    lines = [
        "<tr>"
        + "".join(f"<td style='text-align:left'>{html.escape(str(cell))}</td>" for cell in row)
        + "</tr>"
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


class _WhenImported(MetaPathFinder):
    """Adds ``dataset.snapbeam`` when xarray is imported; snapbeam does not import it before it is needed."""

    def find_spec(self, fullname: str, path: Any, target: Any = None) -> Any:
        if fullname != "xarray":
            return None
        sys.meta_path.remove(self)
        spec = find_spec(fullname)
        if spec is not None and spec.loader is not None:
            load = spec.loader.exec_module

            def loaded(module: Any) -> None:
                load(module)
                module.register_dataset_accessor("snapbeam")(DatasetFigures)

            spec.loader.exec_module = loaded  # type: ignore[method-assign]
        return spec


def add_accessor() -> None:
    """Give every dataset of xarray the accessor ``snapbeam``, now or as soon as xarray is imported."""
    xarray = sys.modules.get("xarray")
    if xarray is None:
        sys.meta_path.insert(0, _WhenImported())
    elif not hasattr(xarray.Dataset, "snapbeam"):
        xarray.register_dataset_accessor("snapbeam")(DatasetFigures)
