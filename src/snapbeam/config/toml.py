"""Reading and writing parameter files."""

from __future__ import annotations

import os
import tomllib
from typing import Any

import numpy as np
import tomli_w

from snapbeam.config.parameters import row_of
from snapbeam.config.physical import PHYSICAL
from snapbeam.config.settings import Config, config_from_mapping
from snapbeam.core.files import atomic_path, check_writable
from snapbeam.core.validate import InputError, file_path, instance

__all__ = ["config_text", "dump_config", "load_config"]


def load_config(path: str | os.PathLike[str]) -> Config:
    """Read a parameter file.

    Raises
    ------
    InputError
        If it cannot be read or is no TOML, and for anything :func:`config_from_mapping` refuses.
    """
    file = file_path("config", path)
    try:
        sections = tomllib.loads(file.read_text(encoding="utf-8"))
    except OSError as error:
        raise InputError(f"config = {str(path)!r}: cannot be read, {error.strerror or error}") from error
    except (tomllib.TOMLDecodeError, UnicodeDecodeError, RecursionError) as error:
        raise InputError(f"config = {str(path)!r}: is no TOML, {error}") from error
    except ValueError as error:  # an integer of thousands of digits
        raise InputError(f"config = {str(path)!r}: cannot be read, {error}") from error
    return config_from_mapping(sections, file.name)


def dump_config(config: Config, path: str | os.PathLike[str], comment: str = "") -> None:
    """Write what was given to a parameter file, whole or not at all, each key with what it means.

    Parameters
    ----------
    config : Config
    path : path
        Ends in ``.toml``.
    comment : str
        Lines to stand at the top.
    """
    target = check_writable(path, "path", (".toml",))
    with atomic_path(target) as temporary:
        temporary.write_text(config_text(config, comment), encoding="utf-8")


def config_text(config: Config, comment: str = "") -> str:
    """What was given, as the text of a parameter file."""
    instance("config", config, Config, "a Config")
    instance("comment", comment, str, "text")
    lines = [f"# {line}" for line in comment.splitlines()]
    for section, values in config.to_mapping().items():
        lines += [""] if lines else []
        lines.append(f"[{section}]")
        for name, value in values.items():
            row = row_of(f"{section}.{name}")
            physical = PHYSICAL.get(f"{section}.{name}")
            if row is not None:
                unit = "" if row.quantity.unit == "1" else f", {row.quantity.unit}"
                lines.append(f"# {row.quantity.long_name}{unit}")
            elif physical is not None:
                lines.append(f"# {physical.words}, {physical.unit}")
            lines.append(tomli_w.dumps({name: _plain(value)}).rstrip("\n"))
    return "\n".join(lines) + "\n"


def _plain(value: Any) -> Any:
    return value.tolist() if isinstance(value, (np.ndarray, np.generic)) else value
