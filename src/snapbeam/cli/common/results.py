"""Results as files and pictures: what commands read, write and draw."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import xarray as xr

__all__ = [
    "check_pictures",
    "draw_dynamics",
    "draw_map",
    "draw_run",
    "draw_threshold",
    "open_result",
    "read_overlay",
    "write_map",
]


def open_result(file: Path) -> xr.Dataset:
    """Return the dataset in a file, read into memory; refuse what is no NetCDF file of results."""
    from snapbeam.core.netcdf import read_netcdf

    return read_netcdf(file, "file")


def check_pictures(*pictures: tuple[str, Path | None]) -> None:
    """Refuse, before any work, pictures that cannot be written."""
    from snapbeam.core.files import check_writable

    for name, path in pictures:
        if path is not None:
            from snapbeam.figures.style import FIGURE_SUFFIXES

            check_writable(path, name, FIGURE_SUFFIXES)


def read_overlay(dots: Path | None, reference_frequency: float | None, buckling_level: float | None) -> Any:
    """Return the measured points of a CSV file, normalised, or None."""
    if dots is None:
        return None
    from snapbeam.lab.compare.dots import read_measured_points

    return read_measured_points(dots, reference_frequency=reference_frequency, buckling_level=buckling_level)


def write_map(dataset: xr.Dataset, path: Path) -> Path:
    """Write a dataset to a NetCDF file, whole or not at all."""
    from snapbeam.core.netcdf import write_netcdf

    write_netcdf(dataset, path)
    return path


def _save(drawn: Any, path: Path) -> Path:
    from snapbeam.figures import save_figure

    return save_figure(drawn, path)


def draw_map(dataset: xr.Dataset, path: Path, overlay: Any, threshold_line: bool) -> Path:
    """Draw a map to a picture file."""
    import matplotlib

    matplotlib.use("Agg")
    from snapbeam.figures import plot_response_map

    return _save(plot_response_map(dataset, dots=overlay, threshold_line=threshold_line), path)


def draw_threshold(dataset: xr.Dataset, path: Path) -> Path:
    """Draw a threshold to a picture file."""
    import matplotlib

    matplotlib.use("Agg")
    from snapbeam.figures import plot_threshold

    return _save(plot_threshold(dataset), path)


def draw_run(dataset: xr.Dataset, path: Path, window: tuple[float, float] | None) -> Path:
    """Draw a run to a picture file."""
    import matplotlib

    matplotlib.use("Agg")
    from snapbeam.figures import plot_run

    return _save(plot_run(dataset, window), path)


def draw_dynamics(dataset: xr.Dataset, path: Path, picture: str) -> Path:
    """Draw results of dynamics to a picture file."""
    import matplotlib

    matplotlib.use("Agg")
    from snapbeam.figures import dynamics as figures

    if picture == "branch":
        return _save(figures.plot_diagram(None, branches=[dataset]), path)
    plots: dict[str, Any] = {
        "lifetimes": figures.plot_lifetimes, "survival": figures.plot_survival, "diagram": figures.plot_diagram,
        "exponents": figures.plot_exponents, "section": figures.plot_section, "basins": figures.plot_basins,
        "edge": figures.plot_edge,
    }  # fmt: skip
    return _save(plots[picture](dataset), path)
