"""How results show themselves: pictures and tables, looked up by name when somebody asks for one.

Nothing of a drawing library is loaded before, and no room below the figures knows one.
"""

from __future__ import annotations

import html
import importlib.abc
import importlib.machinery
import sys
from collections.abc import Iterable, Sequence
from importlib import import_module
from typing import Any

__all__ = ["html_table", "plotter", "register_accessor"]


def plotter(name: str) -> Any:
    """A function of :mod:`snapbeam.figures`."""
    return getattr(import_module("snapbeam.figures"), name)


def html_table(title: str, rows: Iterable[Sequence[object]]) -> str:
    """A table as notebooks show it."""
    lines = [
        "<tr>"
        + "".join(f"<td style='text-align:left'>{html.escape(str(cell))}</td>" for cell in row)
        + "</tr>"
        for row in rows
    ]
    return f"<div><strong>{html.escape(title)}</strong><table>{''.join(lines)}</table></div>"


class _Accessor:
    """``dataset.snapbeam``: what can be asked of a run, a map or a threshold."""

    def __init__(self, dataset: Any) -> None:
        self._dataset = dataset

    def plot(self, variable: str | None = None, ax: Any = None, **options: Any) -> Any:
        """Draw the dataset: a run, a threshold, a map of classes, or, by its name, a statistic of a map.

        Options are those of the function of :mod:`snapbeam.figures` that draws it; returns the axes.
        """
        dataset = self._dataset
        if variable is not None and variable != "response" and "time" not in dataset.dims:
            return plotter("plot_statistic")(dataset, variable, ax=ax, **options)
        if "time" in dataset.dims:
            kind = "plot_run" if variable is None else f"plot_{variable}"
        else:
            kind = "plot_threshold" if "first_interwell" in dataset else "plot_response_map"
        return plotter(kind)(dataset, ax=ax, **options)


def _add(xarray: Any) -> None:
    if not hasattr(xarray.Dataset, "snapbeam"):
        xarray.register_dataset_accessor("snapbeam")(_Accessor)


class _AfterXarray(importlib.abc.MetaPathFinder):
    """Lets xarray be imported as ever, and adds the accessor to it then."""

    def find_spec(self, name: str, path: Any, target: Any = None) -> Any:
        if name != "xarray":
            return None
        sys.meta_path.remove(self)
        spec = importlib.machinery.PathFinder.find_spec(name, path)
        if spec is not None and spec.loader is not None:
            execute = spec.loader.exec_module

            def and_add(module: Any) -> None:
                execute(module)
                _add(module)

            spec.loader.exec_module = and_add  # type: ignore[method-assign]
        return spec


def register_accessor() -> None:
    """Give every dataset of xarray an attribute ``snapbeam``: at once, or when xarray is loaded."""
    if "xarray" in sys.modules:
        _add(sys.modules["xarray"])
    elif not any(isinstance(finder, _AfterXarray) for finder in sys.meta_path):
        sys.meta_path.insert(0, _AfterXarray())
