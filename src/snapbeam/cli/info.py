"""``snapbeam info``: contents and provenance of a file."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.markup import escape

from snapbeam.cli.console import add_json, cli_command, file_line, notes, open_result, out
from snapbeam.util.validation import InputError, printable

if TYPE_CHECKING:
    import xarray as xr


@cli_command
def info(
    file: Annotated[Path, typer.Argument(help="NetCDF file written by snapbeam.", metavar="FILE")],
    export: Annotated[
        Path | None,
        typer.Option(
            help="File to write the contents to: a table (.csv), arrays for MATLAB (.mat), or records over time (.uff).",
            rich_help_panel="Output",
            metavar="FILE",
        ),
    ] = None,
) -> None:
    """Print the contents and the provenance of a file: parameters, version, command, time; or export the contents.

    Example: snapbeam info map.nc --export map.csv
    """
    from snapbeam.cli.summary import class_table, parameter_table, status_lines

    if file.suffix.lower() == ".toml":
        raise InputError(
            f"file = {str(file)!r}: is a parameter file, not a result; snapbeam simulate --config FILE --print-config "
            "prints its parameters, snapbeam equilibria --config FILE its structure"
        )
    dataset = open_result(file)
    if export is not None:
        _export(dataset, export)
        return
    add_json(
        sizes=dict(dataset.sizes), attributes=dict(dataset.attrs),
        variables={str(name): dict(each.attrs) for name, each in dataset.variables.items()},
    )  # fmt: skip
    console = out()
    sizes = ", ".join(f"{name} {size}" for name, size in dataset.sizes.items())
    head = f"[bold]{escape(printable(file.name))}[/]"
    console.print(f"{head}: {escape(printable(sizes))}" if sizes else head)
    names = [str(name) for name in (*dataset.coords, *dataset.data_vars)]
    for name in names:
        variable = dataset[name]
        units = variable.attrs.get("units")
        about = variable.attrs.get("long_name", "")
        text = f"  {name:<{max(map(len, names)) + 2}}{about}{f' ({units})' if units not in (None, '1') else ''}"
        console.print(printable(text), markup=False)
    if "response_class" in dataset:
        console.print(class_table(dataset), *status_lines(dataset), sep="\n")
    console.print(parameter_table(dataset.attrs))


def _export(dataset: xr.Dataset, path: Path) -> None:
    """Write a table or arrays, and print the names of the variables that a table does not contain."""
    from snapbeam.plot.units import in_units
    from snapbeam.util.tables import write_table

    left_out = write_table(in_units(dataset), path)
    if left_out:
        notes().print(f"not in the file, with other dimensions: {', '.join(left_out)}", markup=False)
    add_json(files=[path], left_out=left_out)
    out().print(f"Written: {file_line(path)}")
