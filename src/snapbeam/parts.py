"""The optional parts of snapbeam: packages with commands, plots and tests of their own.

The rest of snapbeam imports none of them. A part lists its commands in the dictionary ``COMMANDS`` of its module
``cli``. Deleting the folder of a part removes its commands and nothing else.
"""

from __future__ import annotations

from importlib import import_module
from importlib.util import find_spec
from types import ModuleType

PARTS = (
    "lab",  # camera recordings, vibrometer signals, free decays, calibration, comparison with simulations
    "explorer",  # interactive maps in the browser
    "paper",  # figures and claims of the source paper
)
"""Name of the package of each part."""

_SIGNALS = "lab"
"""The part that reads files of measured signals."""


def installed_parts() -> list[str]:
    """Names of the parts whose folder exists."""
    return [name for name in PARTS if find_spec(f"snapbeam.{name}") is not None]


def load_part(name: str) -> ModuleType:
    """Import a part."""
    if name not in PARTS or find_spec(f"snapbeam.{name}") is None:
        raise AttributeError(f"module 'snapbeam' has no attribute {name!r}")
    return import_module(f"snapbeam.{name}")


def signal_files() -> ModuleType:
    """Readers of files of measured signals, by which the core reads records of drives."""
    from snapbeam.util.validation import InputError

    if _SIGNALS not in installed_parts():
        raise InputError(f"file: reading records needs the part snapbeam.{_SIGNALS}, which is not installed")
    return import_module(f"snapbeam.{_SIGNALS}.signal_files")
