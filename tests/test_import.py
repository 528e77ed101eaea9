"""Importing the package costs little and brings nothing along that most runs do not need."""

from __future__ import annotations

import subprocess
import sys

import pytest

HEAVY = ("matplotlib", "dask", "distributed", "cv2", "av", "pandas", "zarr", "typer", "rich", "pydantic")


@pytest.mark.parametrize("module", ["snapbeam", "snapbeam.cli"])
def test_import_is_light(module):
    script = f"import sys, {module}; print(*[m for m in {HEAVY!r} if m in sys.modules])"
    loaded = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, check=True
    ).stdout.split()
    allowed = {"typer", "rich"} if module == "snapbeam.cli" else set()
    assert set(loaded) <= allowed
