"""The optional parts are self-contained: the rest of snapbeam neither imports nor names them, and works without them."""

from __future__ import annotations

import ast
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import snapbeam
from snapbeam.parts import PARTS

ROOT = Path(__file__).parents[1]
SOURCE = Path(snapbeam.__file__).parent
TESTS = ROOT / "tests"
NAMED = re.compile(rf"\bsnapbeam\.({'|'.join(PARTS)})\b")


def parsed(file: Path) -> ast.Module:
    return ast.parse(file.read_text(encoding="utf-8"), str(file))


def imported(tree: ast.Module, package: str) -> set[str]:
    """Return the full names of all imported modules and of all names imported from them."""
    found = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            found |= {name.name for name in node.names}
        elif isinstance(node, ast.ImportFrom):
            base = package.split(".")[: len(package.split(".")) - node.level + 1] if node.level else []
            module = ".".join([*base, *([node.module] if node.module else [])])
            found |= {module, *(f"{module}.{name.name}" for name in node.names)}
    return found


def docstrings(tree: ast.Module) -> set[ast.AST]:
    """Return the string constants that stand alone as statements."""
    return {node.value for node in ast.walk(tree) if isinstance(node, ast.Expr)}


def uses(file: Path, package: str) -> set[str]:
    """Return the parts that a module imports, reads as attributes of snapbeam, or names in a string."""
    tree = parsed(file)
    texts = set(imported(tree, package))
    left_out = docstrings(tree)
    for node in ast.walk(tree):
        if isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name):
            if node.value.id in ("sb", "snapbeam"):
                texts.add(f"snapbeam.{node.attr}")
        elif isinstance(node, ast.Constant) and isinstance(node.value, str) and node not in left_out:
            texts.add(node.value)
    return {found[1] for text in texts for found in NAMED.finditer(text)}


def package_of(file: Path) -> str:
    return ".".join(file.relative_to(SOURCE.parent).parent.parts)


CORE = [
    file
    for file in sorted([*SOURCE.rglob("*.py"), *SOURCE.rglob("*.pyi")])
    if file.relative_to(SOURCE).parts[0] not in (*PARTS, "parts.py")
]


def test_modules_of_tests_have_different_names() -> None:
    """Two of one name cannot be collected together, which shows only where the extras of both are installed."""
    names = [file.name for file in TESTS.rglob("test_*.py")]
    assert {name for name in names if names.count(name) > 1} == set()


def test_every_import_of_a_part_is_found(tmp_path: Path) -> None:
    file = tmp_path / "module.py"
    for text in (
        "import snapbeam.lab", "from snapbeam import lab", "from snapbeam.lab.camera import Recording",
        "from ..lab import track", "from .. import lab", "import_module('snapbeam.lab.cli')", "sb.lab.track",
        "def f():\n    from snapbeam.lab import track", "COMMANDS = {'track': 'snapbeam.lab.cli.track:track'}",
    ):  # fmt: skip
        file.write_text(text, encoding="utf-8")
        assert uses(file, "snapbeam.plot") == {"lab"}, text
    for text in ('"""See :mod:`snapbeam.lab`."""', "from snapbeam import plot", "from .lab_coats import lab"):
        file.write_text(text, encoding="utf-8")
        assert uses(file, "snapbeam.plot") == set(), text


def test_the_core_neither_imports_nor_names_a_part() -> None:
    assert len(CORE) > 100
    found = {str(file.relative_to(SOURCE)): uses(file, package_of(file)) for file in CORE}
    assert {name: parts for name, parts in found.items() if parts} == {}


def test_tests_of_a_part_are_in_its_folder() -> None:
    """A test module outside ``tests/PART`` that imports the part could not be collected without it."""
    found = {}
    for file in sorted(TESTS.rglob("*.py")):
        folder = file.relative_to(TESTS).parts[0]
        parts = {name.split(".")[1] for name in imported(parsed(file), "tests") if NAMED.match(name)} - {folder}
        if parts:
            found[str(file.relative_to(TESTS))] = parts
    assert found == {}


def without(part: str, folder: Path) -> Path:
    """Copy the repository to a folder, without a part and its tests."""
    copy = folder / f"without_{part}"
    copy.mkdir()
    for name in ("src", "tests"):
        shutil.copytree(
            ROOT / name, copy / name, ignore=shutil.ignore_patterns("__pycache__", "*.egg-info", "*.nb[ic]")
        )
    for file in ROOT.iterdir():
        if file.is_file() and not file.name.startswith("."):
            shutil.copy(file, copy)
    for name in ("docs", "examples", "benchmarks", "impact20", "studies"):
        (copy / name).symlink_to(ROOT / name, target_is_directory=True)
    shutil.rmtree(copy / "src" / "snapbeam" / part)
    shutil.rmtree(copy / "tests" / part)
    return copy


def in_copy(copy: Path, *arguments: str) -> str:
    """Run Python in a copy, with the package of the copy; return what it prints."""
    done = subprocess.run(
        [sys.executable, *arguments], cwd=copy, capture_output=True, text=True, encoding="utf-8", timeout=1800,
        env={**os.environ, "PYTHONPATH": str(copy / "src"), "COLUMNS": "120"},
    )  # fmt: skip
    assert done.returncode == 0, f"{arguments}\n{done.stdout[-4000:]}\n{done.stderr[-4000:]}"
    return done.stdout


def commands_of(part: str) -> list[str]:
    from importlib import import_module

    return list(import_module(f"snapbeam.{part}.cli").COMMANDS)


def works_without(part: str, copy: Path) -> None:
    """Import the package and show its help."""
    code = f"import snapbeam, snapbeam.parts; print(snapbeam.__file__); print({part!r} in snapbeam.parts.installed_parts())"
    place, left = in_copy(copy, "-c", code).split()
    assert Path(place).is_relative_to(copy) and left == "False"
    shown = in_copy(copy, "-m", "snapbeam", "--help")
    assert re.search(r"\bsimulate\b", shown)
    for command in commands_of(part):
        assert not re.search(rf"^\W*{command} ", shown, re.MULTILINE), command


@pytest.mark.slow
@pytest.mark.parametrize("part", PARTS)
def test_works_without_a_part(tmp_path: Path, part: str) -> None:
    works_without(part, without(part, tmp_path))


@pytest.mark.slow
@pytest.mark.parametrize("part", PARTS)
def test_works_without_each_part(tmp_path: Path, part: str) -> None:
    copy = without(part, tmp_path)
    works_without(part, copy)
    collected = in_copy(copy, "-m", "pytest", "-q", "-n", "0", "-p", "no:cacheprovider", "--collect-only", "tests")
    assert re.search(r"\d{3,} tests collected", collected)
    in_copy(
        copy, "-m", "pytest", "-q", "-n", "0", "-p", "no:cacheprovider", "-m", "not slow", "tests/test_import.py",
        "tests/model", "tests/cli/test_app.py::test_version_and_help",
    )  # fmt: skip
