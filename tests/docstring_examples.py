"""Run the examples in the docstrings of a namespace."""

from __future__ import annotations

import doctest
import inspect
from types import ModuleType

import matplotlib.pyplot as plt


def check_examples(module: ModuleType) -> None:
    """Every class and function of a namespace has an example in its docstring that gives what it shows."""
    parser, lines = doctest.DocTestParser(), []
    runner = doctest.DocTestRunner(optionflags=doctest.NORMALIZE_WHITESPACE | doctest.ELLIPSIS)
    without = []
    for name in dir(module):
        value = getattr(module, name)
        if name.startswith("_") or not callable(value):
            continue  # modules and constants are described on the pages
        text = inspect.getdoc(value) or ""
        examples = parser.get_doctest(text, {}, f"{module.__name__}.{name}", None, None)
        if not examples.examples:
            without.append(name)
        runner.run(examples, out=lines.append)
        plt.close("all")
    assert not lines, "".join(lines)
    assert not without, f"no example: {', '.join(without)}"
