"""``snapbeam reproduce``: a figure of the paper, or the table of its claims, from nothing."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Annotated, Any

import typer

from snapbeam.cli import parameter_options as opt
from snapbeam.cli.console import add_json, cli_command, duration, file_line, notes, out, read_overlay
from snapbeam.util.files import check_writable
from snapbeam.util.validation import InputError, choice

COMMANDS = {"reproduce": "snapbeam.paper.cli:reproduce"}
"""Module and function of each command, by name."""


@cli_command
def reproduce(
    figure: Annotated[
        str,
        typer.Argument(
            help="fig2 to fig8, figA9, figB10, si5 (an animation); low_frequency, resonance, waveforms, transients, "
            "windows, disturbances, sensitivity (further runs of the claims); "
            "claims (table of the paper's statements and their verdicts); or all.",
            metavar="FIGURE",
        ),
    ],
    full: Annotated[
        bool,
        typer.Option(
            "--full/--quick",
            help="Size of the computation: that of the paper, up to about an hour, or a sketch in seconds.",
        ),
    ] = False,
    output: Annotated[
        Path, typer.Option("--output", "-o", help="Folder to write to; made if missing.", metavar="DIR")
    ] = Path(),
    data: Annotated[
        Path | None,
        typer.Option(
            help="Folder of stored data (fig6.nc, ...) to draw and measure from; missing data are computed.",
            metavar="DIR",
        ),
    ] = None,
    stored: Annotated[
        bool,
        typer.Option(
            "--stored",
            help="For claims: use the full-size data of --data if available, otherwise sketches, which each row marks.",
        ),
    ] = False,
    measurements: opt.Measurements = None,
    measured: Annotated[
        list[Path] | None,
        typer.Option(help="NetCDF file of a measured run, for fig4; give it three times.", metavar="FILE"),
    ] = None,
) -> None:
    """Compute and draw a figure of the paper, or measure its claims.

    Example: snapbeam reproduce fig6 --full -o figures
    """
    import matplotlib

    matplotlib.use("Agg")
    from snapbeam.paper import FIGURES
    from snapbeam.paper.claims import write_claims
    from snapbeam.paper.claims.table import summary
    from snapbeam.paper.recipe import Results

    choice("figure", figure, (*FIGURES, "claims", "all"))
    try:
        output.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"output = {str(output)!r}: cannot be made, {error.strerror or error}") from error
    size = "full" if full else "quick"
    results = Results(size, read=data, write=output if full else None, progress=_Tell())
    names = [name for name in FIGURES if figure in (name, "all")]
    _check_measured(figure, names, measurements, measured)
    _check_targets(output, names, claims=figure in ("claims", "all"))
    written: list[Path] = []
    for name in names:
        start = time.monotonic()
        given: dict[str, Any] = (
            {"measurements": measurements} if measurements is not None and name in ("fig6", "fig7", "fig8") else {}
        )
        if measured and name == "fig4":
            given["measured"] = [str(file) for file in measured]
        files = FIGURES[name].write(output, results=results, **given)
        written += files
        took = duration(time.monotonic() - start)
        if full:
            out().print(f"{name}: {FIGURES[name].about} ({size}, {took})")
        else:
            out().print(f"{name}: quick sketch, {_computed(results, name)} ({took}); with --full {FIGURES[name].about}")
        for file in files:
            out().print(f"  {file_line(file)}")
    if figure in ("claims", "all"):
        if stored:
            kept = Results("full", read=data, progress=_Tell(), compute=False)
            rows, files = write_claims(output, kept, Results("quick", progress=_Tell()))
        else:
            rows, files = write_claims(output, results)
        written += files
        add_json(claims=summary(rows))
        out().print(f"claims ({'stored' if stored else size}): {summary(rows)}")
        for file in files:
            out().print(f"  {file_line(file)}")

    add_json(figure=figure, size=size, files=written)


def _computed(results: Any, name: str) -> str:
    """Modes and cycles that were run for a figure, from the attributes of its data."""
    words = []
    for key, symbol in (("modes", "N = {}"), ("cycles", "{} cycles")):
        found = sorted({float(each.attrs[key]) for each in results[name].values() if key in each.attrs})
        if found:
            words.append(symbol.format(" and ".join(f"{value:g}" for value in found)))
    return ", ".join(words) or "with a small grid"


def _check_measured(figure: str, names: list[str], measurements: Path | None, measured: list[Path] | None) -> None:
    """Refuse, before anything is computed, measured responses and runs that cannot be shown."""
    from snapbeam.model.default_values import BEAM
    from snapbeam.paper.recipes.fig4 import read_measured
    from snapbeam.paper.system import paper_model

    if measurements is not None:
        if not {"fig6", "fig7", "fig8"} & set(names):
            raise InputError(f"measurements: {figure} shows no measured responses; fig6, fig7 and fig8 do")
        read_overlay(measurements, paper_model(1).reference_frequency, BEAM.buckling_level)
    if measured:
        if "fig4" not in names:
            raise InputError(f"measured: {figure} shows no measured run; fig4 does")
        if len(measured) != 3:
            raise InputError(f"measured: {len(measured)} files; fig4 shows three")
        for file in measured:
            read_measured(file)


def _check_targets(folder: Path, names: list[str], claims: bool) -> None:
    """Refuse, before anything is computed, files that cannot be written or are not to be replaced."""
    from snapbeam.paper.claims.table import BEGINS

    for name in names:
        for suffix in (".pdf", ".png", ".nc"):
            check_writable(folder / f"{name}{suffix}")
    for name, begin in BEGINS.items() if claims else ():
        check_writable(folder / name, begin=begin)


class _Tell:
    """Says on standard error how far each map is, a line for each tenth of the work."""

    def __init__(self) -> None:
        self.tenths: dict[str, int] = {}
        self.start: dict[str, float] = {}

    def __call__(self, what: str, done: int, total: int) -> None:
        self.start.setdefault(what, time.monotonic())
        tenths = 10 * done // total if total else 10
        if tenths > self.tenths.get(what, 0):
            self.tenths[what] = tenths
            elapsed = duration(time.monotonic() - self.start[what])
            notes().print(f"{what}: {done} of {total}, {elapsed}")
