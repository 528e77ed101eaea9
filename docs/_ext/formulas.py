"""Displayed formulas of docstrings, which are plain text for who reads them in a terminal, are set on the pages.

A formula stands in an indented paragraph of its own and has an equals sign; ``sqrt(2)/(k_i L)`` becomes
``\\sqrt{2}/(k_{i} L)``.
"""

from __future__ import annotations

import re
from typing import Any

__all__ = ["displayed", "setup", "to_latex"]

_GREEK = set(
    "alpha beta gamma delta chi kappa lambda mu nu omega phi pi rho sigma tau theta xi zeta "
    "Lambda Omega Phi Theta".split()
)
_FUNCTIONS = {"sin", "cos", "exp", "ln", "max", "arccos"}
_WORDS = {"integral of": r"\int ", "integral": r"\int ", "sum": r"\sum ", "for": r"\text{ for }"}
_TOKEN = re.compile(
    r"integral of|integral\b|sum_[a-z]\b|sum\b|sqrt\(|\^\(|\^[0-9]+(?:\.[0-9]+)?|\^[A-Za-z0-9]|"
    r"[A-Za-z]+[0-9]*(?:_[A-Za-z0-9]+)?'*|\s{2,}|."
)


def to_latex(text: str) -> str:
    """A formula in plain text as LaTeX."""
    found = []
    at = 0
    while at < len(text):
        match = _TOKEN.match(text, at)
        assert match is not None
        token, at = match[0], match.end()
        if token in ("sqrt(", "^("):
            end = _closing(text, at)
            inner = to_latex(text[at:end])
            found.append(rf"\sqrt{{{inner}}}" if token == "sqrt(" else f"^{{{inner}}}")
            at = end + 1
        elif token.startswith("^"):
            found.append(f"^{{{token[1:]}}}")
        elif token.startswith("sum_"):
            found.append(rf"\sum_{token[-1]} ")
        elif token in _WORDS:
            found.append(_WORDS[token])
        elif token[0].isalpha():
            found.append(_name(token))
        elif token.isspace():
            found.append(r"\qquad " if len(token) > 1 else " ")
        else:
            found.append({"*": r"\,", "{": r"\{", "}": r"\}"}.get(token, token))
    return "".join(found).strip()


def _closing(text: str, at: int) -> int:
    """Where the bracket closes that was opened before *at*."""
    depth = 1
    for place in range(at, len(text)):
        depth += {"(": 1, ")": -1}.get(text[place], 0)
        if depth == 0:
            return place
    raise ValueError(f"a bracket of {text!r} is not closed")


def _name(token: str) -> str:
    """A name with its index and its primes."""
    stem = token.rstrip("'")
    primes = "'" * (len(token) - len(stem))
    stem, _, index = stem.partition("_")
    letters = stem.rstrip("0123456789")
    index = stem[len(letters) :] + index
    head = "\\" + letters + " " if letters in _GREEK | _FUNCTIONS else letters
    if len(letters) > 1 and letters not in _GREEK | _FUNCTIONS:
        head = rf"\mathrm{{{letters}}}"
    if index in _GREEK:
        index = f"\\{index}"
    elif index.isalpha() and len(index) > 1 and index != "ij":  # a word, not two indices
        index = rf"\mathrm{{{index}}}"
    space = " " if head.endswith(" ") and not primes else ""
    return f"{head.strip()}{primes}_{{{index}}}" if index else f"{head.strip()}{primes}{space}"


def displayed(lines: list[str]) -> list[tuple[int, int]]:
    """First lines and ends of the displayed formulas of a docstring."""
    found, at = [], 0
    while at < len(lines):
        line = lines[at]
        before = next((each for each in reversed(lines[:at]) if each.strip()), "")
        alone = at > 0 and not lines[at - 1].strip() and _depth(line) >= 4 and _depth(line) > _depth(before)
        if line.strip() and alone and " = " in line and ">>>" not in line and not before.rstrip().endswith("::"):
            end = at
            while end < len(lines) and lines[end].strip():
                end += 1
            found.append((at, end))
            at = end
        at += 1
    return found


def _depth(line: str) -> int:
    return len(line) - len(line.lstrip())


def typeset(_app: Any, _what: str, _name_: str, _object: Any, _options: Any, lines: list[str]) -> None:
    """Put a directive in place of each displayed formula."""
    for first, end in reversed(displayed(lines)):
        indent = " " * (_depth(lines[first]) - 4)
        body = [to_latex(line.strip()) for line in lines[first:end]]
        many = " \\\\ ".join(body)
        text = rf"\begin{{gathered}} {many} \end{{gathered}}" if len(body) > 1 else many
        lines[first:end] = [f"{indent}.. math::", "", f"{indent}    {text}", ""]


def setup(app: Any) -> dict[str, bool]:
    """Connect to Sphinx."""
    app.setup_extension("sphinx.ext.autodoc")
    app.connect("autodoc-process-docstring", typeset, priority=400)
    return {"parallel_read_safe": True}
