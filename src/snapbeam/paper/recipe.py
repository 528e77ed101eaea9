"""A figure of the paper as a recipe, and the results that recipes and claims share."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

from snapbeam.util.validation import InputError, choice

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

SIZES = ("quick", "full")
DATA_VARIABLE = "SNAPBEAM_PAPER_DATA"
"""Environment variable with the folder of full-size data, for examples."""

Progress = Callable[[str, int, int], object]


class MissingResults(InputError):
    """Data that are not stored and were not to be computed."""


class Results:
    """Data of recipes, by name: read if stored, otherwise computed and cached.

    Parameters
    ----------
    size : {"quick", "full"}
        Small grids, few modes and few cycles, or those of the paper.
    read : path, optional
        Folder of stored data (``fig6.nc``, ...).  Data of another size raise an error; missing data are
        computed.
    write : path, optional
        Folder to which computed data are written.
    progress : callable, optional
        Called as ``progress(what, done, total)``.
    compute : bool
        True to compute missing data; otherwise they raise :class:`MissingResults`.
    """

    def __init__(
        self,
        size: str = "quick",
        *,
        read: str | os.PathLike[str] | None = None,
        write: str | os.PathLike[str] | None = None,
        progress: Progress | None = None,
        compute: bool = True,
    ) -> None:
        self._compute = compute
        self.size = choice("size", size, SIZES)
        self._read = None if read is None else Path(read)
        self._write = None if write is None else Path(write)
        self._progress = progress
        self._known: dict[str, dict[str, xr.Dataset]] = {}
        self._files: dict[str, Path] = {}
        for name, folder in (("read", self._read), ("write", self._write)):
            if folder is not None and not folder.is_dir():
                raise InputError(f"{name} = {str(folder)!r}: must be an existing folder")

    @property
    def is_full(self) -> bool:
        """True if the size is that of the paper."""
        return self.size == "full"

    def pick(self, quick: Any, full: Any) -> Any:
        """One of two settings, by the size."""
        return full if self.is_full else quick

    def progress(self, what: str) -> Callable[[int, int], object]:
        """Progress function of a map."""
        return lambda done, total: self._progress(what, done, total) if self._progress is not None else None

    def __getitem__(self, name: str) -> dict[str, xr.Dataset]:
        """The datasets of a recipe by their names."""
        from snapbeam.paper.store import load_results

        if name not in self._known:
            module = _module(name)
            stored = None if self._read is None else self._read / f"{name}.nc"
            if stored is not None and stored.is_file():
                self._known[name] = load_results(stored, self.size)
                self._files[name] = stored
            elif not self._compute:
                raise MissingResults(f"{name}: is not among the stored data")
            else:
                self._known[name] = module.compute(self)
                if self._write is not None:
                    self.save(name, self._write)
        return self._known[name]

    def save(self, name: str, folder: Path) -> Path:
        """Write the data of a recipe to a folder, if they are not there already; returns the file."""
        from snapbeam.paper.store import save_results

        target = folder / f"{name}.nc"
        data = self[name]
        there = self._files.get(name)
        if there is None or there.resolve() != target.resolve():
            save_results(data, target, self.size)
            self._files[name] = target
        return target


@cache
def shared_results() -> Results:
    """Full-size results stored in the folder that SNAPBEAM_PAPER_DATA names, or quick ones if it names none.

    Results of this process, which several figures share.
    """
    folder = os.environ.get(DATA_VARIABLE)
    return Results("full", read=folder) if folder else Results("quick")


@dataclass(frozen=True)
class Recipe:
    """Recipe of a figure of the paper or of a study: computation and drawing of its data.

    ``recipe()`` draws it, ``recipe.compute()`` gives the data, ``recipe.write(folder)`` writes the figure as
    PDF and PNG (and the video, for ``si5``) with the data.
    """

    name: str
    about: str
    package: str = "snapbeam.paper.recipes"
    """Package of its module."""

    def __call__(
        self,
        size: str = "quick",
        *,
        data: str | os.PathLike[str] | None = None,
        results: Results | None = None,
        **options: Any,
    ) -> Figure:
        """Draw the figure.

        Parameters
        ----------
        size : {"quick", "full"}
        data : path, optional
            Folder of stored data to draw from instead of computing them.
        results : Results, optional
            Results to share with other recipes; *size* and *data* are theirs then.
        **options
            Options of the recipe: ``measurements`` (fig6, fig7, fig8: a CSV table of measured responses, see
            :func:`snapbeam.sweeps.measured_points.read_measured_points`), ``measured`` (fig4: three files of measured runs).
        """
        return self._draw(Results(size, read=data) if results is None else results, options)

    def compute(self, size: str = "quick") -> dict[str, xr.Dataset]:
        """The data of the figure, as datasets by name."""
        return Results(size)[self.name]

    def write(
        self,
        folder: str | os.PathLike[str],
        size: str = "quick",
        *,
        data: str | os.PathLike[str] | None = None,
        results: Results | None = None,
        **options: Any,
    ) -> list[Path]:
        """Write the figure and its data to a folder that exists; returns the files.

        Parameters are those of drawing it.
        """
        from matplotlib.pyplot import close

        from snapbeam.plot.style import save_figure

        target = Path(folder)
        if not target.is_dir():
            raise InputError(f"folder = {str(folder)!r}: must be an existing folder")
        results = Results(size, read=data) if results is None else results
        figure = self._draw(results, options)
        files = [save_figure(figure, target / f"{self.name}{suffix}") for suffix in (".pdf", ".png")]
        close(figure)
        files.append(results.save(self.name, target))
        module = _module(self.name)
        if hasattr(module, "write_video"):
            files += module.write_video(results, target)
        return files

    def _draw(self, results: Results, options: Mapping[str, Any]) -> Figure:
        module = _module(self.name)
        allowed = getattr(module, "OPTIONS", ())
        for name in options:
            if name not in allowed:
                known = ", ".join(allowed) or "none"
                raise InputError(f"{name}: is not an option of {self.name}; its options are {known}")
        figure: Figure = module.draw(results, **options)
        return figure


def _module(name: str) -> Any:
    from snapbeam.paper import FIGURES

    choice("figure", name, tuple(FIGURES))
    return import_module(f"{FIGURES[name].package}.{name}")
