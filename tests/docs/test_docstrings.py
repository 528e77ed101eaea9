"""Every public name has an example in its docstring, and the examples give what they show."""

from __future__ import annotations

import doctest
import inspect

import pytest

import snapbeam as sb
from snapbeam import lab

SPACES = {"snapbeam": sb, "dynamics": sb.dynamics, "uncertainty": sb.uncertainty, "plot": sb.plot, "lab": lab}


def names(space: str) -> list[str]:
    """The classes and functions of a namespace; modules and constants are described on the pages."""
    of = SPACES[space]
    return [name for name in dir(of) if not name.startswith("_") and callable(getattr(of, name))]


@pytest.mark.parametrize("space", SPACES)
def test_examples(space: str, tmp_path, monkeypatch) -> None:
    monkeypatch.chdir(tmp_path)
    parser, lines = doctest.DocTestParser(), []
    runner = doctest.DocTestRunner(optionflags=doctest.NORMALIZE_WHITESPACE | doctest.ELLIPSIS)
    without = []
    for name in names(space):
        text = inspect.getdoc(getattr(SPACES[space], name)) or ""
        examples = parser.get_doctest(text, {}, f"{space}.{name}", None, None)
        if not examples.examples:
            without.append(name)
        runner.run(examples, out=lines.append)
    assert not lines, "".join(lines)
    assert not without, f"no example: {', '.join(without)}"
