"""Pages that make themselves: the command line, the keys of parameter files, variables and codes.

They are read off the program, the table of parameters and the table of statistics, so that they cannot fall behind.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

__all__ = ["command_line", "parameter_tables", "setup", "variable_tables", "write_pages"]

_SECTIONS = {
    "beam": "The beam. Of `buckling_level` and `axial_load` one is given.",
    "model": "The reduced model.",
    "ends": "How the ends of the beam are held; clamped and rigid where nothing is given.",
    "imperfection": "What makes the wells unequal; a section that is nothing is a perfect beam.",
    "contact": "The law of contact, by `law`: `hertz` (the default) or `restitution`. Hertz's stiffness may be "
    "given by the materials in its place: `radius` of the sphere (m), `young_modulus` (Pa) and `poisson_ratio`, two "
    "numbers each, of sphere and beam.",
    "striker": "The striker's tip. `location_m` (m) may stand for `location`.",
    "drive": "How the tip moves, by `kind`: `sine`, or, from Python, `recorded`. `frequency_hz` (Hz) and "
    "`velocity_m_s` (m/s) may stand for the ratios.",
    "base": "The motion of what both ends are mounted on, by `kind`; a section that is left out is a base at rest.",
    "axial": "How the axial load changes, by `kind`: `sine` or `ramp`; a section that is left out is a constant load.",
    "harvester": "A circuit that taps the beam, by `kind`: `piezo` or `coil`.",
    "run": "How runs are integrated.",
}


def _cell(text: object) -> str:
    return str(text).replace("|", "\\|").replace("\n", " ")


def _table(header: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    lines = ["| " + " | ".join(header) + " |", "|" + " --- |" * len(header)]
    lines += ["| " + " | ".join(_cell(value) for value in row) + " |" for row in rows]
    return "\n".join(lines) + "\n"


def parameter_tables() -> str:
    """Every key of a parameter file, section by section, from the table of parameters."""
    from snapbeam.model.parameter_file import Config
    from snapbeam.model.parameters import parameters

    given = Config().system.parameters
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
            scope = "run" if row.is_run else "structure"
            rows.append((f"`{key}`", meaning, unit, limits, shown or "–", scope))
        header = ("key", "meaning", "unit", "allowed", "default", "scope")
        parts.append(f"## [{section}]\n\n{words}\n\n" + _table(header, rows))
    return "\n".join(parts)


def _number(value: Any) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    return f"{value:.6g}" if isinstance(value, (int, float)) else str(value)


def variable_tables() -> str:
    """Variables of runs, impacts and maps, and what the codes mean."""
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
        "Variables of maps, and entries of `run.outcome`.\n",
        _table(("variable", "kind", "unit", "meaning"), statistics),
        "## Response classes\n", _table(("code", "name", "class"), classes),
        "## Statuses of runs\n", _table(("code", "name", "what happened, and what to do"), statuses),
    ))  # fmt: skip


def command_line() -> str:
    """Every command with every option, as the program itself describes them."""
    import typer.main

    from snapbeam.cli.app import app

    group: Any = typer.main.get_command(app)
    parts = []
    for name, command in group.commands.items():
        words = "\n\n".join(_paragraphs(command.help or ""))
        parts.append(f"## snapbeam {name}\n\n{words}\n")
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
    return "\n".join(parts)


def _paragraphs(text: str) -> list[str]:
    """Paragraphs of a command's help; an example is set as a command."""
    found = []
    for part in text.split("\n\n"):
        plain = " ".join(line.strip() for line in part.splitlines())
        if plain.startswith("Example: "):
            found.append(f"```\n{plain.removeprefix('Example: ')}\n```")
        elif plain:
            found.append(_options_as_code(plain))
    return found


def _options_as_code(text: str) -> str:
    """Words with options set as code; as words their two hyphens would become a dash."""
    return re.sub(r"(?<![\w`-])(--[a-z][\w-]*)", r"`\1`", text)


def write_pages(folder: Path) -> None:
    """Write the generated parts into a folder; a file that has not changed is left alone."""
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
