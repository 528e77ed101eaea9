"""``snapbeam look``: settings of a recording, made over its picture in the browser."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from snapbeam.cli.console import cli_command
from snapbeam.explorer.cli import Browser, Port, until_stopped
from snapbeam.lab.cli import options as lab
from snapbeam.lab.cli.options import option

_SETTINGS = "Settings"


@cli_command
def look(
    recording: lab.RecordingFile,
    settings: Annotated[Path | None, option("File of settings to begin with.", _SETTINGS, "FILE")] = None,
    output: Annotated[Path, option("File to write.", _SETTINGS, "FILE", "--output", "-o")] = Path("look.toml"),
    port: Port = None,
    browser: Browser = True,
) -> None:
    """Set region and scales over the picture of a recording, in the browser.

    The page shows what tracking finds by itself. Region, marks, contact, pixel size, frames and frame rate are set over
    the picture, and written to a file for snapbeam track --settings.

    Example: snapbeam look test.cihx -o test.toml
    """
    from snapbeam.lab.batch import read_settings
    from snapbeam.lab.look import BEGIN

    sections = read_settings(settings, {})
    lab.check_files((".toml",), BEGIN, output=output)
    from snapbeam.explorer.server import serve_shared
    from snapbeam.lab.look_page import Looked

    looked = Looked(recording, output, sections)
    until_stopped(lambda ready: serve_shared(looked, port=port, ready=ready), browser)
