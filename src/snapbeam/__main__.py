"""``python -m snapbeam`` and the command ``snapbeam``: the program."""

from __future__ import annotations

import io
import sys

from snapbeam.util import interrupts


def main() -> None:
    """Run the program."""
    for stream in (sys.stdout, sys.stderr):  # where the locale has no micro sign: escapes
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")
    interrupts.install()  # before the imports of the program, which take seconds
    from snapbeam.cli.app import main as run

    try:
        run()
    except SystemExit as ended:
        interrupts.end(ended.code)
        raise


if __name__ == "__main__":
    main()
