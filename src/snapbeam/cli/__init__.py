"""The command line."""

from snapbeam.cli.app import app, main

__all__ = ["app", "main"]
