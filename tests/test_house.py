"""The measures of the house: short files and functions, few arguments, rooms that hold little."""

from __future__ import annotations

import ast
import inspect
import statistics
from pathlib import Path

import snapbeam as sb

SOURCE = Path(sb.__file__).parent
FILES = sorted(path for path in SOURCE.rglob("*.py"))
DOORS = {"response_map", "long_map"}
"""Functions of version 0.1, whose arguments stay."""
VALUES = {"ReducedModel", "State"}
"""Values, not functions: what they hold is given by name."""


def test_files_are_short() -> None:
    lengths = {path: len(path.read_text(encoding="utf-8").splitlines()) for path in FILES}
    assert statistics.median(lengths.values()) < 150
    assert [str(path.relative_to(SOURCE)) for path, lines in lengths.items() if lines > 400] == []


def test_functions_are_short() -> None:
    long = [
        f"{path.relative_to(SOURCE)}: {node.name}"
        for path in FILES
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef)
        and (node.end_lineno or 0) - node.lineno >= 120
    ]
    assert long == []


def test_rooms_hold_little() -> None:
    count: dict[Path, int] = {}
    for path in FILES:
        if path.name != "__init__.py":
            count[path.parent] = count.get(path.parent, 0) + 1
    assert {str(room.relative_to(SOURCE)): n for room, n in count.items() if n > 16} == {}


def test_public_functions_take_few_arguments() -> None:
    many = {
        name: len(inspect.signature(value).parameters)
        for name in sb.__all__
        if callable(value := getattr(sb, name)) and name not in DOORS | VALUES
        if not (isinstance(value, type) and issubclass(value, BaseException))
        and len(inspect.signature(value).parameters) > 9
    }
    assert many == {}


def test_no_prefix_stands_for_a_room() -> None:
    """Three files of a folder whose names begin alike would be a folder of their own."""
    for room in {path.parent for path in FILES}:
        first = [path.stem.split("_")[0] for path in room.glob("*_*.py") if not path.stem.startswith("_")]
        assert {word for word in first if first.count(word) > 2} == set(), room
