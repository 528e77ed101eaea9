"""``snapbeam explore``: a map in the browser."""

from __future__ import annotations

import contextlib
import os
from collections.abc import Callable
from pathlib import Path
from typing import Annotated, NoReturn

import typer

from snapbeam.cli.console import INTERRUPTED, cli_command, out, write_json_now
from snapbeam.util.validation import InputError

COMMANDS = {"explore": "snapbeam.explorer.cli:explore"}
"""Module and function of each command, by name."""
Port = Annotated[
    int | None, typer.Option(help="Port; by default 8760 or the next free one; 0 for any free one.", min=0, max=65535)
]
Browser = Annotated[bool, typer.Option("--browser/--no-browser", help="Open the page in the browser.")]


@cli_command
def explore(
    file: Annotated[
        Path | None,
        typer.Argument(help="NetCDF file or checkpoint of a map; by default the paper's beam.", metavar="[MAP]"),
    ] = None,
    config: Annotated[
        Path | None,
        typer.Option("--config", help="TOML file of the initial system, if no map is given.", metavar="FILE"),
    ] = None,
    against: Annotated[
        Path | None,
        typer.Option("--against", help="Another map, whose difference from the first is shown.", metavar="MAP"),
    ] = None,
    port: Port = None,
    address: Annotated[str, typer.Option(help="Address to serve on.")] = "127.0.0.1",
    allow_remote: Annotated[
        bool, typer.Option("--allow-remote", help="Allow an address that other machines can reach.")
    ] = False,
    token: Annotated[
        str | None,
        typer.Option(
            help="Token in the address of the page; by default a stored one of this user, or a random one with --allow-remote."
        ),
    ] = None,
    browser: Browser = True,
) -> None:
    """Open a map in the browser; click on a point to simulate it and to see the beam.

    Example: snapbeam explore map.nc
    """
    from snapbeam.util.hdf5 import open_hdf5
    from snapbeam.util.netcdf import split_group

    if file is not None and config is not None:
        raise InputError(f"config = {str(config)!r}: a map holds its own system; give one of the two")
    if token is not None and len(token) < 16:
        raise InputError("token: must have at least 16 characters")
    if file is not None and os.path.isfile(stored := split_group(file)[0]):
        open_hdf5(stored, "map").close()  # what is no result is refused before Panel is loaded, which takes seconds
    system = integration = None
    if config is not None:
        from snapbeam.model.parameter_file import load_config

        settings = load_config(config)
        system, integration = settings.system, settings.integration

    from snapbeam.explorer.server import serve

    until_stopped(
        lambda ready: serve(
            file, address=address, port=port, allow_remote=allow_remote, token=token, system=system,
            integration=integration, against=against, ready=ready,
        ),
        browser,
    )  # fmt: skip


def until_stopped(serve: Callable[[Callable[[str], None]], None], browser: bool) -> NoReturn:
    """Serve until Ctrl+C; print the address of the page, and open it in the *browser*."""

    def ready(url: str) -> None:
        write_json_now(url=url)
        out().print(f"Explorer at {url}", markup=False)
        out().print("Press Ctrl+C to stop it.", markup=False)
        if browser:
            import webbrowser

            webbrowser.open(url)

    with contextlib.suppress(KeyboardInterrupt):  # the server may also end by itself at Ctrl+C
        serve(ready)
    out().print("stopped")
    raise typer.Exit(INTERRUPTED)
