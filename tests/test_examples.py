"""Every example runs as it stands."""

from __future__ import annotations

import runpy
from pathlib import Path

import matplotlib.pyplot as plt
import pytest

DEAR = {"ex24_dynamics", "ex25_design", "ex27_bifurcation_curves"}
"""Examples that take seconds."""
EXAMPLES = sorted((Path(__file__).parent.parent / "examples").glob("ex*.py"))


def test_there_are_examples():
    assert EXAMPLES


@pytest.mark.parametrize(
    "path", [pytest.param(path, marks=pytest.mark.slow if path.stem in DEAR else (), id=path.stem) for path in EXAMPLES]
)
def test_example(path, capsys):
    runpy.run_path(str(path))
    assert plt.get_fignums() or capsys.readouterr().out
    plt.close("all")
