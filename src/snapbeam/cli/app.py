"""The program ``snapbeam`` with its commands."""

from __future__ import annotations

from collections.abc import Iterator, MutableMapping
from importlib import import_module
from typing import Annotated, Any

import typer

from snapbeam.cli.short_help import ShortHelpCommand, ShortHelpGroup
from snapbeam.parts import installed_parts
from snapbeam.util.packages import extra_of, needs

# Module and function of each command.
_COMMANDS = {
    "simulate": "snapbeam.cli.simulate:simulate",
    "map": "snapbeam.cli.map:compute_map",
    "threshold": "snapbeam.cli.threshold:threshold",
    "dynamics": "snapbeam.cli.dynamics:dynamics",
    "probability": "snapbeam.cli.uncertainty:probability",
    "design": "snapbeam.cli.uncertainty:design",
    "frequencies": "snapbeam.cli.frequencies:frequencies",
    "equilibria": "snapbeam.cli.equilibria:equilibria",
    "plot": "snapbeam.cli.plot:plot",
    "schematic": "snapbeam.cli.schematic:schematic",
    "info": "snapbeam.cli.info:info",
}


class _Commands(MutableMapping[str, Any]):
    """Commands by name, first of the core, then of the optional parts; each is imported on first use."""

    def __init__(self) -> None:
        self._core: dict[str, Any] = dict(_COMMANDS)
        self._parts: dict[str, str] | None = None

    def _of_parts(self) -> dict[str, str]:
        if self._parts is None:
            self._parts = {
                command: place
                for part in installed_parts()
                for command, place in import_module(f"snapbeam.{part}.cli").COMMANDS.items()
            }
        return self._parts

    def __getitem__(self, name: str) -> Any:
        found = self._core.get(name) or self._of_parts()[name]
        if isinstance(found, str):
            found = self._core[name] = _load_command(name, found)
        return found

    def __setitem__(self, name: str, command: Any) -> None:
        self._core[name] = command

    def __delitem__(self, name: str) -> None:
        del self._core[name]

    def __contains__(self, name: object) -> bool:
        return name in self._core or name in self._of_parts()

    def __iter__(self) -> Iterator[str]:
        return iter(dict.fromkeys((*_COMMANDS, *self._of_parts())))

    def __len__(self) -> int:
        return len(list(iter(self)))


def _load_command(name: str, place: str) -> Any:
    module, _, attribute = place.partition(":")
    try:
        found = getattr(import_module(module), attribute)
    except ModuleNotFoundError as error:
        extra = extra_of(error.name)
        if extra is None:
            raise
        raise typer.BadParameter(needs(f"snapbeam {name}", error.name, extra)) from error
    if isinstance(found, typer.Typer):
        command: Any = typer.main.get_group(found)
    else:
        alone = typer.Typer(rich_markup_mode="markdown", pretty_exceptions_enable=False, add_completion=False)
        alone.command(name, cls=ShortHelpCommand)(found)
        command = typer.main.get_command(alone)
    command.name = name
    return command


class _Program(ShortHelpGroup):
    def __init__(self, **options: Any) -> None:
        super().__init__(**options)
        self.commands = _Commands()

    def list_commands(self, ctx: Any) -> list[str]:
        return list(self.commands)


app = typer.Typer(
    name="snapbeam",
    cls=_Program,
    help="Impact dynamics of buckled, bistable beams.",
    epilog="Every parameter left out takes the value of Rouleau et al., J. Sound Vib. (2024), 118291.",
    no_args_is_help=True,
    rich_markup_mode="markdown",
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)


def _print_version(wanted: bool) -> None:
    if wanted:
        from snapbeam._version import __version__

        typer.echo(f"snapbeam {__version__}")
        raise typer.Exit


@app.callback()
def _program(
    version: Annotated[
        bool, typer.Option("--version", help="Print the version and stop.", callback=_print_version, is_eager=True)
    ] = False,
) -> None:
    pass


def main() -> None:
    """Run the program on the arguments of the process."""
    app()
