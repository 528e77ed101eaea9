"""Every public name of ``snapbeam.lab`` has an example in its docstring, and the examples give what they show."""

from __future__ import annotations

import pytest
from docstring_examples import check_examples

from snapbeam import lab


@pytest.mark.slow
def test_examples(tmp_path, monkeypatch) -> None:
    monkeypatch.chdir(tmp_path)
    check_examples(lab)
