"""The command and the lines of Python that make exactly what is shown, to the last digit."""

from __future__ import annotations

import pprint
import shlex
from collections.abc import Mapping
from typing import Any

import numpy as np

from snapbeam import Integration, System
from snapbeam.config import config_from_mapping, config_text, lookup
from snapbeam.explorer.maps.source import integration_mapping

__all__ = ["map_command", "plain", "python_lines", "run_command", "system_toml"]

_CONFIG = "system.toml"


def plain(sections: Mapping[str, Mapping[str, Any]]) -> dict[str, dict[str, Any]]:
    """A system's sections as plain values, without what follows from others."""
    return {
        section: {
            name: value.tolist() if isinstance(value, (np.ndarray, np.generic)) else value
            for name, value in values.items()
            if value is not None
        }
        for section, values in sections.items()
    }


def _run_section(integration: Integration) -> dict[str, Any]:
    default = integration_mapping(Integration())
    return {
        name: value
        for name, value in integration_mapping(integration).items()
        if value is not None and value != default[name] and name != "engine"
    }


def system_toml(system: System, integration: Integration, comment: str = "") -> str:
    """A parameter file of a system, which ``--config`` reads back equal."""
    sections = plain(system.to_mapping())
    run = _run_section(integration)
    return config_text(config_from_mapping(sections | ({"run": run} if run else {})), comment)


def _value(value: Any) -> str:
    return repr(value) if isinstance(value, (int, float)) else str(value)


def run_command(values: Mapping[str, Any], file: str, on_map: bool) -> str:
    """The command that computes a point: of a file's map, or of a parameter file kept beside it."""
    if file and on_map:
        point = ",".join(f"{lookup(name).short}={_value(value)}" for name, value in values.items())
        source = ["--from", file, "--point", point]
    else:
        source = ["--config", _CONFIG]
        for name, value in values.items():
            source += ["--set", f"{name}={_value(value)}"]
    return shlex.join(["snapbeam", "simulate", *source, "-o", "run.nc", "--plot", "run.png"])


def map_command(axes: Mapping[str, tuple[float, float, int]], fixed: Mapping[str, Any]) -> str:
    """The command that computes a window on even axes, of a parameter file kept beside it."""
    parts = ["snapbeam", "map", "--config", _CONFIG]
    for name, value in fixed.items():
        parts += ["--set", f"{name}={_value(value)}"]
    for name, (first, last, count) in axes.items():
        parts += ["--sweep", f"{name}={first!r}:{last!r}:{count}"]
    return shlex.join([*parts, "-o", "window.nc", "--plot", "window.png"])


def python_lines(system: System, integration: Integration) -> str:
    """Lines of Python that compute a run of a system, with nothing beside them."""
    run = _run_section(integration)
    arguments = ", ".join(f"{name}={value!r}" for name, value in run.items())
    sections = plain(system.to_mapping())
    if "start" in sections:
        sections["start"] = {name: np.asarray(value).tolist() for name, value in sections["start"].items()}
    text = pprint.pformat(sections, width=100, sort_dicts=False)
    return (
        "import snapbeam as sb\n\n"
        f"system = sb.System.from_mapping({text})\n"
        f"run = sb.simulate(system, sb.Integration({arguments}))\n"
        "print(run.outcome)\n"
        'run.save("run.nc")\n'
    )
