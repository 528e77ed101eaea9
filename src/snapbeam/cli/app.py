"""The program: its commands, its version and how it ends."""

from __future__ import annotations

from typing import Annotated

import typer

from snapbeam.cli.calibrate import calibrate
from snapbeam.cli.campaign import campaign
from snapbeam.cli.compare import compare
from snapbeam.cli.design import design, probability
from snapbeam.cli.draw import draw
from snapbeam.cli.dynamics import dynamics
from snapbeam.cli.explore import explore
from snapbeam.cli.frequencies import frequencies
from snapbeam.cli.identify import identify
from snapbeam.cli.info import info
from snapbeam.cli.map import compute_map
from snapbeam.cli.paper import paper
from snapbeam.cli.plot import plot
from snapbeam.cli.simulate import simulate
from snapbeam.cli.threshold import threshold
from snapbeam.cli.track import track
from snapbeam.cli.vibrometer import vibrometer
from snapbeam.core.provenance import __version__

__all__ = ["app", "main"]

app = typer.Typer(
    name="snapbeam",
    help="Impact dynamics of bistable buckled beams: what a shaker that hits a buckled beam makes it do.",
    epilog="Every parameter left out takes the value of Rouleau et al., J. Sound Vib. (2024), 118291.",
    no_args_is_help=True,
    rich_markup_mode="markdown",
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)
app.command("map")(compute_map)
app.command("threshold")(threshold)
app.command("simulate")(simulate)
app.command("probability")(probability)
app.command("design")(design)
app.add_typer(dynamics, name="dynamics")
app.command("frequencies")(frequencies)
app.command("plot")(plot)
app.command("explore")(explore)
app.command("draw")(draw)
app.command("paper")(paper)
app.command("track")(track)
app.command("vibrometer")(vibrometer)
app.command("identify")(identify)
app.command("calibrate")(calibrate)
app.command("compare")(compare)
app.command("campaign")(campaign)
app.command("info")(info)


def _print_version(wanted: bool) -> None:
    if wanted:
        typer.echo(f"snapbeam {__version__}")
        raise typer.Exit


@app.callback()
def _program(
    version: Annotated[
        bool,
        typer.Option("--version", help="Print the version and stop.", callback=_print_version, is_eager=True),
    ] = False,
) -> None:
    pass


def main() -> None:
    """Run the program on the arguments of the process."""
    app()
