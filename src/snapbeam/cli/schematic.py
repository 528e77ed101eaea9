"""``snapbeam schematic``: the schematic of a system."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from snapbeam.cli.console import answer, door, file_line, out
from snapbeam.cli.parameter_options import (
    BEAM,
    CONTACT,
    DRIVE,
    ENDS,
    IMPERFECTION,
    MODEL,
    STRIKER,
    configured,
    with_parameters,
)

__all__ = ["schematic"]


@door
@with_parameters(*BEAM, *ENDS, *IMPERFECTION, *MODEL, *CONTACT, *STRIKER, *DRIVE)
def schematic(
    given: Any,
    output: Annotated[
        Path, typer.Option("--output", "-o", help="Picture to write: .png, .pdf or .svg.", metavar="FILE")
    ],
) -> None:
    """Draw what is studied: beam and wells, what strikes it, how it is held, and how it moves."""
    from snapbeam.cli.console import check_pictures

    check_pictures(("output", output))
    from snapbeam.plot.schematic import plot_system
    from snapbeam.plot.style import save_figure

    system = configured(given).system
    save_figure(plot_system(system), output)
    answer(system=system.hash, files=[output])
    console = out()
    console.print(system.describe())
    console.print(f"Written: {file_line(output)}")
