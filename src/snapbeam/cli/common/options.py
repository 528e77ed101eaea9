"""The options that several commands share beside parameters."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from snapbeam.cli.common.parameter_options import parse_count, parse_number

__all__ = ["count_option", "number_option", "parse_window"]

_OUTPUT = "Output"


def number_option(about: str, panel: str) -> Any:
    """An option that takes a number."""
    return typer.Option(help=about, rich_help_panel=panel, parser=parse_number, metavar="NUMBER")


def count_option(about: str, panel: str) -> Any:
    """An option that takes a whole number."""
    return typer.Option(help=about, rich_help_panel=panel, parser=parse_count, metavar="COUNT")


Threads = Annotated[int | None, count_option("Processor cores to use; all by default.", "Integration")]
Plot = Annotated[
    Path | None,
    typer.Option(
        "--plot", help="Picture to write: .png, .pdf or .svg.", rich_help_panel=_OUTPUT, metavar="FILE"
    ),
]
Dots = Annotated[
    Path | None,
    typer.Option(
        help="CSV of measured responses to lay over the picture: columns frequency_ratio or frequency_hz, "
        "velocity_amplitude or velocity_m_s, location (optional), response.",
        rich_help_panel=_OUTPUT,
        metavar="FILE",
    ),
]
ThresholdLine = Annotated[
    bool,
    typer.Option(
        "--quasi-static-line", help="Draw the quasi-static threshold V_QS1 (Eq. 21).", rich_help_panel=_OUTPUT
    ),
]
Window = Annotated[
    str | None,
    typer.Option(help="Cycles to draw, first:last.", rich_help_panel=_OUTPUT, metavar="FIRST:LAST"),
]


def parse_window(text: str | None) -> tuple[float, float] | None:
    """Return ``first:last`` as two numbers."""
    from snapbeam.core.validate import InputError, finite

    if text is None:
        return None
    try:
        first, last = (finite("window", float(part)) for part in text.split(":"))
    except ValueError:
        raise InputError(f"window = {text!r}: must be first:last, in cycles, such as 0:10") from None
    if not first < last:
        raise InputError(f"window = {text!r}: first must be less than last")
    return first, last
