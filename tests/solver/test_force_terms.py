"""A term of the solver is one file; the other files of the solver do not name it."""

from __future__ import annotations

import ast
import re
from pathlib import Path
from typing import NamedTuple

import pytest
from numba import njit

import snapbeam.solver
from snapbeam.solver.compilation import inlined
from snapbeam.solver.terms.interface import center_from_barrier, does_work

SOLVER = Path(snapbeam.solver.__file__).parent

TERMS = {
    "second_well": (r"SecondWell|terms\.second_well|UnequalWells|unequal_wells", 4),
    "base_excitation": ("BaseExcitation|base_(excitation|load|acceleration|work|sign|follow|hardest)", 7),
    "local_force": ("LocalForce|local_force", 7),
    "axial_load": ("AxialLoad|axial_load|load_(change|work)", 4),
}
"""Of each term, the names that belong to it, and in how many other files of the solver they are; the aim is 0.  Two are the
channels of the native core and its driver, one is the engine in Python, which name every part once."""


def names_in(path: Path) -> set[str]:
    """Identifiers and strings in a file, without docstrings."""
    found: set[str] = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Constant) and isinstance(node.value, str) and " " not in node.value:
            found.add(node.value)
        elif isinstance(node, (ast.Import, ast.ImportFrom)):
            found |= {getattr(node, "module", None) or "", *(each.name for each in node.names)}
        else:
            found |= {
                value
                for field in ("id", "attr", "arg", "name")
                if isinstance(value := getattr(node, field, None), str)
            }
    return found


@pytest.mark.parametrize("term", TERMS)
def test_files_that_name_a_term(term):
    pattern, allowed = TERMS[term]
    own = {SOLVER / "terms" / f"{term}.py", SOLVER / "terms" / "__init__.py"}
    naming = [
        path.relative_to(SOLVER).as_posix()
        for path in sorted(SOLVER.rglob("*.py"))
        if path not in own and any(re.search(pattern, name) for name in names_in(path))
    ]
    assert len(naming) == allowed, f"{term}: {naming}; write the number into TERMS if it is lower"


class Offset(NamedTuple):
    level: float

    @staticmethod
    @inlined
    def center_from_barrier(term, center):
        return center - term.level


class Factor(NamedTuple):
    factor: float

    @staticmethod
    @inlined
    def center_from_barrier(term, center):
        return center * term.factor

    @staticmethod
    @inlined
    def kick_work(memory, size, term, weight, g, r, kick, p):
        return 0.0


class Silent(NamedTuple):
    number: float


@njit
def divided(terms, center):
    return center_from_barrier(terms, center), does_work(terms)


@pytest.mark.parametrize(
    ("terms", "expected"),
    [
        ((), (5.0, False)),
        ((Silent(7.0),), (5.0, False)),
        ((Offset(2.0), Silent(7.0), Factor(10.0)), (30.0, True)),
        ((Factor(10.0), Offset(2.0)), (48.0, True)),
    ],
)
def test_an_operation_calls_the_terms_in_order(terms, expected):
    assert divided(terms, 5.0) == expected


def test_an_operation_is_for_compiled_code():
    with pytest.raises(TypeError, match="compiled code only"):
        center_from_barrier((), 5.0)
