"""``python -m snapbeam`` and the command ``snapbeam``: the program."""

from __future__ import annotations

import io
import sys

from snapbeam.util import interrupts


def main() -> None:
    """Run the program."""
    interrupts.install()  # before the imports of the program, which take seconds
    from snapbeam.util import memory_limit

    for stream in (sys.stdout, sys.stderr):  # where the locale has no micro sign: escapes
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")
    memory_limit.refuse_libraries_without_room()
    try:
        from snapbeam.cli.app import main as run

        run()
    except SystemExit as ended:
        interrupts.end(ended.code)
        raise
    except (MemoryError, ImportError) as error:  # of a limit of memory the loader makes an ImportError
        if isinstance(error, ImportError) and memory_limit.limit() >= memory_limit.sufficient():
            raise
        sys.exit(f"error: {memory_limit.not_sufficient()}")


if __name__ == "__main__":
    main()
