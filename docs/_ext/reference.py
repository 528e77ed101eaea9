"""Generated reference pages: commands, keys of parameter files, variables and codes.

The text comes from the program itself: its commands, its table of parameters and its table of statistics.
"""

from __future__ import annotations

import dataclasses
import re
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

__all__ = ["command_line", "parameter_tables", "setup", "variable_tables", "write_pages"]

_SECTIONS = {
    "beam": "Geometry and material. Give one of `buckling_level` and `axial_load`.",
    "model": "The reduced model.",
    "boundary": "Stiffness of the supports; without this section both ends are clamped.",
    "imperfection": "Initial deflection and constant transverse loads, which make the wells unequal; without this section the "
    "beam is perfect.",
    "contact": "The contact law, selected by `type`: {laws}. You can give materials instead of `stiffness`: `radius` of the "
    "sphere (m), `young_modulus` (Pa) and `poisson_ratio`, the last two as lists of two numbers, of sphere and beam. You can "
    "give `restitution` and `speed` (m/s) instead of `damping_factor`.",
    "striker": "The striker. `location_m` (m) can replace `location`.",
    "drive": "The motion of the striker, selected by `type`: {drives}. `frequency_hz` (Hz) and `velocity_m_s` (m/s) can "
    "replace the ratios. A recorded motion is available from Python and with `--recorded-drive` only.",
    "base_excitation": "The motion of the base, selected by `type` as in `[drive]`; without this section the base is at rest.",
    "axial_load": "The change of the axial load in time, selected by `type`: {loads}; without this section the load is "
    "constant.",
    "harvester": "The circuit of an energy harvester, selected by `type`: {harvesters}.",
    "integration": "Solver settings.",
}


def _cell(text: object) -> str:
    return str(text).replace("|", "\\|").replace("\n", " ")


def _table(header: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    lines = ["| " + " | ".join(header) + " |", "|" + " --- |" * len(header)]
    lines += ["| " + " | ".join(_cell(value) for value in row) + " |" for row in rows]
    return "\n".join(lines) + "\n"


def parameter_tables() -> str:
    """Return a table of the keys of each section of a parameter file."""
    from snapbeam.model.axial_load import LOADS
    from snapbeam.model.contact.base import LAWS
    from snapbeam.model.drive.base import DRIVES
    from snapbeam.model.harvester import HARVESTERS
    from snapbeam.model.parameter_file import Config
    from snapbeam.model.parameters import parameters

    given = Config().system.parameters
    types = {
        "contact": LAWS,
        "drive": {name: kind for name, kind in DRIVES.items() if name != "sum"},
        "base_excitation": {
            name: kind for name, kind in DRIVES.items() if name != "sum" and kind.can_excite_base()
        },
        "axial_load": LOADS,
        "harvester": HARVESTERS,
    }
    listed = {
        "laws": _listed(LAWS), "drives": _listed(types["drive"]), "loads": _listed(LOADS),
        "harvesters": _listed(HARVESTERS),
    }  # fmt: skip
    parts = []
    for section, words in _SECTIONS.items():
        rows = []
        for name, row in parameters().items():
            if row.section != section:
                continue
            default = given.get(name, row.default)
            shown = "" if default is None or row.quantity.kind is object else _number(default)
            unit = "" if row.quantity.unit == "1" else row.quantity.unit
            symbol = f"${row.quantity.symbol}$" if row.quantity.symbol else ""
            limits = row.limits.replace("inf", "∞")
            key = name.partition(".")[2]
            meaning = row.quantity.long_name + (f", {symbol}" if symbol else "")
            meaning += f"; in datasets `{row.short}`" if row.short != key else ""
            owners = ", ".join(
                f"`{each}`" for each, kind in types.get(section, {}).items() if key in _fields(kind)
            )
            level = "run" if row.is_run else "model"
            rows.append((f"`{key}`", meaning, unit, limits, shown or "–", level, owners))
        header = ["key", "meaning", "unit", "allowed", "default", "level", "types"]
        if not any(row[-1] for row in rows):
            header, rows = header[:-1], [row[:-1] for row in rows]
        parts.append(f"## [{section}]\n\n{words.format(**listed)}\n\n" + _table(header, rows))
    return "\n".join(parts)


def _listed(names: Iterable[str]) -> str:
    return ", ".join(f"`{name}`" for name in names)


def _fields(kind: Any) -> set[str]:
    """Names of the fields of a contact law, drive, load or harvester."""
    return {each.name for each in dataclasses.fields(kind)}


def _number(value: Any) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    return f"{value:.6g}" if isinstance(value, (int, float)) else str(value)


def variable_tables() -> str:
    """Return tables of the variables of runs, impacts and maps, and of the codes."""
    from snapbeam.simulation.dataset import IMPACT_COLUMNS, SCHEMA
    from snapbeam.solver.statistics import STATISTICS
    from snapbeam.util.status_codes import ResponseClass, RunStatus

    runs = [(f"`{name}`", ", ".join(row.dims), row.units, row.long_name) for name, row in SCHEMA.items()]
    impacts = [(f"`{name}`", unit, words) for name, unit, words in IMPACT_COLUMNS]
    statistics = [(f"`{row.name}`", row.dtype, row.unit, row.long_name) for row in STATISTICS.values()]
    classes = [(int(kind), kind.name, kind.label) for kind in ResponseClass]
    statuses = [(int(kind), kind.name, kind.advice) for kind in RunStatus]
    return "\n".join((
        "## A run\n", _table(("variable", "dimensions", "unit", "meaning"), runs),
        "## Impacts of a run\n", "Dimension `impact`.\n", _table(("variable", "unit", "meaning"), impacts),
        "## Statistics\n",
        "Variables of maps, and attributes of `run.summary`.\n",
        _table(("variable", "kind", "unit", "meaning"), statistics),
        "## Response classes\n", _table(("code", "name", "class"), classes),
        "## Statuses of runs\n", _table(("code", "name", "meaning and remedy"), statuses),
    ))  # fmt: skip


def command_line() -> str:
    """Return the help of each command and of each of its subcommands."""
    import typer.main

    from snapbeam.cli.app import app

    group: Any = typer.main.get_command(app)
    return "\n".join(
        part for name, command in group.commands.items() for part in _command(f"snapbeam {name}", command, 2)
    )


def _command(title: str, command: Any, level: int) -> list[str]:
    """Return the help of a command, its options by panel, and its subcommands."""
    words = "\n\n".join(_paragraphs(command.help or ""))
    parts = [f"{'#' * level} {title}\n\n{words}\n"]
    panels: dict[str, list[tuple[str, str]]] = {}
    for parameter in command.params:
        if parameter.name == "help":
            continue
        panel = getattr(parameter, "rich_help_panel", None) or (
            "Arguments" if parameter.param_type_name == "argument" else "Options"
        )
        flags = ", ".join(f"`{flag}`" for flag in [*parameter.opts, *parameter.secondary_opts])
        if parameter.param_type_name == "argument":
            flags = f"`{parameter.metavar or parameter.human_readable_name}`"
        elif parameter.metavar:
            flags += f" *{parameter.metavar}*"
        panels.setdefault(panel, []).append((flags, _options_as_code(parameter.help or "")))
    for panel, rows in panels.items():
        parts.append(f"**{panel}**\n\n" + _table(("option", "meaning"), rows))
    for name, each in getattr(command, "commands", {}).items():
        parts += _command(f"{title} {name}", each, level + 1)
    return parts


def _paragraphs(text: str) -> list[str]:
    """Return the paragraphs of a help text; an example becomes a code block."""
    found = []
    for part in text.split("\n\n"):
        plain = " ".join(line.strip() for line in part.splitlines())
        if plain.startswith("Example: "):
            found.append(f"```\n{plain.removeprefix('Example: ')}\n```")
        elif plain:
            found.append(_options_as_code(plain))
    return found


def _options_as_code(text: str) -> str:
    """Set options as code, so that their two hyphens do not become a dash."""
    return re.sub(r"(?<![\w`-])(--[a-z][\w-]*)", r"`\1`", text)


def write_pages(folder: Path) -> None:
    """Write the generated pages into a folder; unchanged files are not rewritten."""
    folder.mkdir(parents=True, exist_ok=True)
    pages = {"parameters": parameter_tables, "variables": variable_tables, "command_line": command_line}
    bench = folder.parent / "images" / "rivals.inc"
    pages["rivals"] = lambda: (
        bench.read_text(encoding="utf-8")
        if bench.exists()
        else "The comparison has not been run for this version: `python -m benchmarks rivals -o docs/images`.\n"
    )
    for name, make in pages.items():
        target, text = folder / f"{name}.md", make()
        if not target.exists() or target.read_text(encoding="utf-8") != text:
            target.write_text(text, encoding="utf-8")


def setup(app: Any) -> dict[str, Any]:
    """Connect to Sphinx."""
    app.connect("builder-inited", lambda app: write_pages(Path(app.srcdir) / "_generated"))
    return {"parallel_read_safe": True}
