"""Docstrings: examples that give what they show, descriptions that begin with what they describe, neighbours."""

from __future__ import annotations

import inspect
import re
from collections.abc import Iterator
from pathlib import Path

import prose
import pytest
from docstring_examples import check_examples

import snapbeam as sb

FOLDERS = ("dynamics", "model", "simulation", "solver", "sweeps", "uncertainty")
"""Packages whose descriptions are checked."""
OPENINGS = prose.CLAUSES | set(
    """
    Across After Along And As At Because Before Between By During For From Given In Including Increasing Into Is It Of On
    Only Over Per Since So Than Then There These They This Through To Under Until Which While Whose With Within Without
    """.split()
)
"""First words of a description that names no object and gives no order."""
DESCRIBED = ("Attributes", "Other Parameters", "Parameters", "Returns", "Yields")


def entries(docstring: str, sections: tuple[str, ...] = DESCRIBED) -> Iterator[tuple[str, str]]:
    """Name or type, and description, of what some sections of a docstring list."""
    blocks = re.split(r"^(\w[\w ]*)\n-{3,}$", inspect.cleandoc(docstring), flags=re.MULTILINE)
    for title, block in zip(blocks[1::2], blocks[2::2], strict=True):
        if title in sections:
            for name, text in re.findall(r"^(\S.*)\n?((?:(?: .*)?\n)*)", block.strip("\n") + "\n", re.MULTILINE):
                yield name, " ".join(text.split())


def refused(docstring: str) -> list[str]:
    """Openings that describe nothing: of the docstring itself and of its entries."""
    texts = [docstring, *(text for _, text in entries(docstring))]
    words = (re.match(r"\W*(\w+)", text) for text in texts)
    return [word[1] for word in words if word and word[1] in OPENINGS]


def public() -> Iterator[tuple[str, object]]:
    """The public names of those packages."""
    for space in (sb, sb.dynamics, sb.model, sb.uncertainty):
        for name in dir(space):
            value = getattr(space, name)
            package = getattr(value, "__module__", "").partition(".")[2].partition(".")[0]
            if not name.startswith("_") and callable(value) and package in FOLDERS:
                yield f"{space.__name__}.{name}", value


@pytest.mark.parametrize(
    "space",
    [sb, *(pytest.param(each, marks=pytest.mark.slow) for each in (sb.dynamics, sb.uncertainty, sb.plot))],
    ids=lambda space: space.__name__,
)
def test_examples(space, tmp_path, monkeypatch) -> None:
    monkeypatch.chdir(tmp_path)
    check_examples(space)


def test_openings_are_read() -> None:
    """The rule sees the summary, the entries of every section of descriptions, and their first words alone."""
    docstring = """Whether a beam snaps.

    Parameters
    ----------
    rate : float
        Of the drive, Hz.
    low, high : float
        ``level`` limits, of the drive.
    empty : int

    Returns
    -------
    array of shape (n,)
        Over ``point``: forces.

    Raises
    ------
    InputError
        For a rate of 0.
    """
    assert [name for name, _ in entries(docstring)] == [
        "rate : float",
        "low, high : float",
        "empty : int",
        "array of shape (n,)",
    ]
    assert [bool(text) for _, text in entries(docstring)] == [True, True, False, True]
    assert refused(docstring) == ["Whether", "Of", "Over"]


@pytest.mark.parametrize("folder", FOLDERS)
def test_descriptions_begin_with_a_noun_or_an_imperative(folder: str) -> None:
    """Summaries, descriptions of parameters, attributes and results, docstrings of constants."""
    root = Path(sb.__file__).parent / folder
    found = [(place, words) for place, text in prose.docstrings(root) if (words := refused(text))]
    assert found == []


def test_parameters_are_described() -> None:
    missing = [
        (place, name)
        for place, value in public()
        for name, text in entries(inspect.getdoc(value) or "", ("Attributes", "Parameters"))
        if not text or re.fullmatch(r"\w\.", text)  # a letter and a full stop begin a list in reStructuredText
    ]
    assert missing == []


def test_see_also() -> None:
    """Every public name refers to its neighbours, which are public too."""
    wrong = []
    for place, value in public():
        names = [name for line, _ in entries(inspect.getdoc(value) or "", ("See Also",)) for name in line.split(", ")]
        if not names or place in names or not all(_is_public(name) for name in names):
            wrong.append((place, names))
    assert wrong == []


def _is_public(name: str) -> bool:
    value: object = sb
    for part in name.split(".")[1:]:
        value = getattr(value, part, None)
    return name.startswith("snapbeam.") and callable(value)
