"""Other searchers drive a design by asking and telling; run where they are installed."""

from __future__ import annotations

import runpy
from pathlib import Path

import pytest

SEARCHERS = Path(__file__).parents[2] / "examples" / "searchers"


@pytest.mark.parametrize(("package", "file"), [("optuna", "with_optuna.py"), ("pymoo", "with_pymoo.py")])
def test_searcher(package: str, file: str, capsys: pytest.CaptureFixture[str]) -> None:
    pytest.importorskip(package)
    runpy.run_path(str(SEARCHERS / file))
    assert "m/s" in capsys.readouterr().out
