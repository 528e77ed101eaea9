"""What a part of the bench leaves behind: data as JSON, a table to print and to include in the docs."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from benchmarks.timing import machine
from snapbeam.util.files import atomic_path

__all__ = ["describe", "load", "save", "table"]


def table(header: Sequence[str], rows: Sequence[Sequence[object]]) -> str:
    """A Markdown table."""
    lines = ["| " + " | ".join(header) + " |", "|" + "---|" * len(header)]
    lines += ["| " + " | ".join(str(cell) for cell in row) + " |" for row in rows]
    return "\n".join(lines) + "\n"


def describe(facts: dict[str, Any], quick: bool) -> str:
    """The machine in a line."""
    versions = ", ".join(
        f"{name} {facts[name]}"
        for name in ("python", "numpy", "numba", "scipy", "numbalsoda", "heyoka", "diffrax", "jax")
        if facts.get(name) not in (None, "not installed")
    )
    busy = f"; load before the run {facts['load_before']}" if "load_before" in facts else ""
    note = " Quick run: few repeats, short runs." if quick else ""
    return f"{facts['processor']} ({facts['vectors']}), {facts['cores']} cores{busy}; {versions}.{note}\n"


def save(folder: Path, name: str, quick: bool, data: dict[str, Any], text: str) -> None:
    """Write ``name.json`` and ``name.inc``, and print the table."""
    facts = machine()
    words = text + "\n" + describe(facts, quick)
    folder.mkdir(parents=True, exist_ok=True)
    with atomic_path(folder / f"{name}.json") as temporary:
        temporary.write_text(json.dumps({"machine": facts, "quick": quick} | data, indent=1) + "\n", encoding="utf-8")
    with atomic_path(folder / f"{name}.inc") as temporary:
        temporary.write_text(words, encoding="utf-8")
    print(f"\n## {name}\n\n{words}", flush=True)


def load(folder: Path, name: str) -> dict[str, Any]:
    """What :func:`save` wrote."""
    found: dict[str, Any] = json.loads((folder / f"{name}.json").read_text(encoding="utf-8"))
    return found
