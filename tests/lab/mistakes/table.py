"""The table of the documentation: what was wrong, what came of it, what it was seen by, what is said.

``python tests/lab/mistakes/table.py`` makes every case, measures it and writes docs/data/mistakes.md.
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))

from mistakes import decays, drives, others, scenes
from mistakes.case import Case, Outcome, looked
from mistakes.criteria import CRITERIA

FILE = Path(__file__).parents[3] / "docs" / "data" / "mistakes.md"
CASES = (*scenes.CASES, *drives.CASES, *decays.CASES, *others.CASES)
HEAD = "| Introduced error | Result | Criterion | Diagnostic |\n|---|---|---|---|\n"


def row(case: Case, outcome: Outcome) -> str:
    """One case as a row."""
    sees = case.sees or CRITERIA[case.code]
    if case.end == "refused":
        says = outcome.refusal
    else:
        said = [diagnostic for diagnostic in outcome.diagnostics if diagnostic.code == case.code]
        says = f"`{case.code}` {said[0].message}" if said else "—"
    cells = (case.mistake, case.end, sees, says)
    return "| " + " | ".join(cell.replace("|", "\\|").replace("\n", " ") for cell in cells) + " |\n"


def text(outcomes: dict[Case, Outcome]) -> str:
    """The whole table, a part a group."""
    parts = []
    for group in dict.fromkeys(case.group for case in outcomes):
        rows = (row(case, outcome) for case, outcome in outcomes.items() if case.group == group)
        parts.append(f"## {group}\n\n{HEAD}{''.join(rows)}")
    return "\n".join(parts)


def measured() -> dict[Case, Outcome]:
    """Every case with what came of it."""
    outcomes = {}
    for case in CASES:
        with tempfile.TemporaryDirectory() as folder:
            outcomes[case] = looked(case, Path(folder))
    return outcomes


if __name__ == "__main__":
    FILE.write_text(text(measured()), encoding="utf-8")
