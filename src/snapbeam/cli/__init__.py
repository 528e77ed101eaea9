"""The command line ``snapbeam``: the door for people."""

from snapbeam.cli.app import app, main

__all__ = ["app", "main"]
