"""``python -m studies NAME [--full] [-o FOLDER]``."""

import typer

import studies  # noqa: F401  so that the studies are known by name
from snapbeam.paper.cli import reproduce

if __name__ == "__main__":
    typer.run(reproduce)
