"""Every public name has an example in its docstring, and the examples give what they show."""

from __future__ import annotations

import pytest
from docstring_examples import check_examples

import snapbeam as sb


@pytest.mark.parametrize(
    "space",
    [sb, *(pytest.param(each, marks=pytest.mark.slow) for each in (sb.dynamics, sb.uncertainty, sb.plot))],
    ids=lambda space: space.__name__,
)
def test_examples(space, tmp_path, monkeypatch) -> None:
    monkeypatch.chdir(tmp_path)
    check_examples(space)
