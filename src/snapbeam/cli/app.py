"""The program: its commands, its version and how it ends."""

from __future__ import annotations

from collections.abc import Iterator, MutableMapping
from importlib import import_module
from typing import Annotated, Any

import typer
from typer.core import TyperGroup

__all__ = ["app", "main"]

# Where each command stands; it is loaded when it is asked for, since what one needs another does without.
_COMMANDS = {
    "map": "map.compute_map",
    "threshold": "threshold.threshold",
    "probability": "design.probability.probability",
    "design": "design.optimum.design",
    "simulate": "simulate.simulate",
    "dynamics": "dynamics.dynamics",
    "frequencies": "frequencies.frequencies",
    "wells": "wells.wells",
    "plot": "plot.plot",
    "explore": "explore.explore",
    "draw": "draw.draw",
    "paper": "paper.paper",
    "track": "lab.track.track",
    "vibrometer": "lab.vibrometer.vibrometer",
    "identify": "lab.identify.identify",
    "calibrate": "lab.calibrate.calibrate",
    "compare": "lab.compare.compare",
    "campaign": "lab.campaign.campaign",
    "info": "info.info",
}


class _Commands(MutableMapping[str, Any]):
    """Commands by name, each loaded when it is looked at."""

    def __init__(self) -> None:
        self._places: dict[str, Any] = dict(_COMMANDS)

    def __getitem__(self, name: str) -> Any:
        if isinstance(self._places[name], str):
            self._places[name] = _loaded(name, self._places[name])
        return self._places[name]

    def __setitem__(self, name: str, command: Any) -> None:
        self._places[name] = command

    def __delitem__(self, name: str) -> None:
        del self._places[name]

    def __contains__(self, name: object) -> bool:
        return name in self._places

    def __iter__(self) -> Iterator[str]:
        return iter(self._places)

    def __len__(self) -> int:
        return len(self._places)


def _loaded(name: str, place: str) -> Any:
    module, _, attribute = place.rpartition(".")
    found = getattr(import_module(f"snapbeam.cli.{module}"), attribute)
    if isinstance(found, typer.Typer):
        command: Any = typer.main.get_group(found)
    else:
        alone = typer.Typer(rich_markup_mode="markdown", pretty_exceptions_enable=False, add_completion=False)
        alone.command(name)(found)
        command = typer.main.get_command(alone)
    command.name = name
    return command


class _Program(TyperGroup):
    def __init__(self, **options: Any) -> None:
        super().__init__(**options)
        self.commands = _Commands()

    def list_commands(self, ctx: Any) -> list[str]:
        return list(self.commands)


app = typer.Typer(
    name="snapbeam",
    cls=_Program,
    help="Impact dynamics of bistable buckled beams: what a shaker that hits a buckled beam makes it do.",
    epilog="Every parameter left out takes the value of Rouleau et al., J. Sound Vib. (2024), 118291.",
    no_args_is_help=True,
    rich_markup_mode="markdown",
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)


def _print_version(wanted: bool) -> None:
    if wanted:
        from snapbeam.core.version import __version__

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
