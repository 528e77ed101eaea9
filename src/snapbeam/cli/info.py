"""``snapbeam info``: what a file holds and what made it."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from snapbeam.cli.console import door, out

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["info", "open_result"]


@door
def info(
    file: Annotated[Path, typer.Argument(help="NetCDF file written by snapbeam.", metavar="FILE")],
) -> None:
    """Say what a map or a run holds and what made it: parameters, version, command, time."""
    from snapbeam.cli.summary import class_table, parameter_table, status_lines

    dataset = open_result(file)
    console = out()
    sizes = ", ".join(f"{name} {size}" for name, size in dataset.sizes.items())
    console.print(f"[bold]{file.name}[/]: {sizes}" if sizes else f"[bold]{file.name}[/]")
    names = [str(name) for name in (*dataset.coords, *dataset.data_vars)]
    for name in names:
        variable = dataset[name]
        units = variable.attrs.get("units")
        about = variable.attrs.get("long_name", "")
        console.print(
            f"  {name:<{max(map(len, names)) + 2}}{about}{f' ({units})' if units not in (None, '1') else ''}"
        )
    if "response" in dataset:
        console.print(class_table(dataset), *status_lines(dataset), sep="\n")
    console.print(parameter_table(dataset.attrs))


def open_result(file: Path) -> xr.Dataset:
    """Return the dataset in a file, read into memory; refuse what is no NetCDF file of results."""
    import xarray as xr

    from snapbeam.core.validate import InputError

    if not file.is_file():
        raise InputError(f"file = {str(file)!r}: no such file")
    try:
        return xr.load_dataset(file, engine="h5netcdf")
    except (OSError, ValueError) as error:
        raise InputError(f"file = {str(file)!r}: is no NetCDF file of results") from error
