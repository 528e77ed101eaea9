"""The tables of diagnostics: every diagnostic that the code looks up exists."""

from __future__ import annotations

import re
from pathlib import Path

from snapbeam.lab import diagnostics


def test_every_diagnostic_that_is_looked_up_exists() -> None:
    used = set()
    for file in Path(diagnostics.__file__).parent.rglob("*.py"):
        for found in re.finditer(r'(KINDS_[A-Z]+)\["(\w+)"\]', file.read_text(encoding="utf-8")):
            used.add((found[1], found[2]))
    assert len(used) > 30
    assert {(table, key) for table, key in used if key not in getattr(diagnostics, table)} == set()
