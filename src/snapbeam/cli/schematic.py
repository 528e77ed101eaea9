"""``snapbeam schematic``: the schematic of a system."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from snapbeam.cli.console import add_json, check_pictures, cli_command, file_line, out
from snapbeam.cli.parameter_options import (
    BEAM,
    BOUNDARY,
    CONTACT,
    DRIVE,
    IMPERFECTION,
    MODEL,
    STRIKER,
    configured,
    with_parameters,
)


@cli_command
@with_parameters(*BEAM, *BOUNDARY, *IMPERFECTION, *MODEL, *CONTACT, *STRIKER, *DRIVE)
def schematic(
    given: Any,
    output: Annotated[
        Path, typer.Option("--output", "-o", help="Figure file to write: .png, .pdf or .svg.", metavar="FILE")
    ],
) -> None:
    """Draw a schematic of the system: beam, wells, boundary conditions, strikers and excitation."""
    check_pictures(("output", output))
    from snapbeam.plot.schematic import plot_system
    from snapbeam.plot.style import save_figure

    system = configured(given).system
    save_figure(plot_system(system), output)
    add_json(system=system.hash, files=[output])
    console = out()
    console.print(system.describe())
    console.print(f"Written: {file_line(output)}")
