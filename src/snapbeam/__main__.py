"""``python -m snapbeam`` and the command ``snapbeam``: the program."""

from __future__ import annotations

import sys

__all__ = ["main"]


def main() -> None:
    """Run the program; an interrupt while it is still being loaded ends it as one later does."""
    try:
        from snapbeam.cli.app import main as run
    except KeyboardInterrupt:
        sys.exit(130)
    run()


if __name__ == "__main__":
    main()
