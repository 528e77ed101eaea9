"""What is released: archives that hold what they must and nothing else, and one version everywhere."""

from __future__ import annotations

import importlib.util
import re
import subprocess
import sys
import tarfile
import tomllib
import zipfile
from pathlib import Path

import pytest

import snapbeam as sb

ROOT = Path(__file__).parents[2]
sys.path.insert(0, str(Path(__file__).parent))
import alone  # noqa: E402


def test_one_version_everywhere():
    for name, pattern in (
        ("CITATION.cff", r"^version: (\S+)$"), ("docs/citing.md", r"version = \{(\S+)\}"),
        ("src/snapbeam/_version.py", r'^__version__ = "(\S+)"$'),
    ):  # fmt: skip
        found = re.search(pattern, (ROOT / name).read_text(encoding="utf-8"), re.MULTILINE)
        assert found and found[1] == sb.__version__, name


def test_no_machine_is_named():
    """No path of a machine, no host of packages in what is released."""
    for folder in ("docs", "examples", "benchmarks", ".github"):
        for path in (ROOT / folder).rglob("*"):
            if path.suffix in (".md", ".py", ".yml", ".rst", ".toml") and "_build" not in path.parts:
                text = path.read_text(encoding="utf-8")
                assert not re.search(r"(?<![\w/.])/(work|root|home|opt)/|/simple/", text), path


@pytest.fixture(scope="module")
def archives(tmp_path_factory):
    if importlib.util.find_spec("hatchling") is None:
        pytest.skip("hatchling is not installed: make dist builds with it")
    folder = tmp_path_factory.mktemp("dist")
    for kind in ("wheel", "sdist"):
        subprocess.run(
            [sys.executable, "-m", "hatchling", "build", "-t", kind, "-d", str(folder)], cwd=ROOT, check=True,
            capture_output=True,
        )  # fmt: skip
    return next(folder.glob("*.tar.gz")), next(folder.glob("*.whl"))


@pytest.mark.slow
def test_archives_hold_what_they_must(archives):
    source, wheel = archives
    names = zipfile.ZipFile(wheel).namelist()
    for needed in ("snapbeam/py.typed", "snapbeam/paper/claims/topics/beam.toml"):
        assert needed in names
    assert all(name.startswith(("snapbeam/", "snapbeam-")) for name in names)
    with tarfile.open(source) as archive:
        held = {name.partition("/")[2] for name in archive.getnames()}
    for needed in (
        "pyproject.toml",
        "README.md",
        "LICENSE",
        "CITATION.cff",
        "docs/index.md",
        "tests/conftest.py",
    ):
        assert needed in held
    assert not [name for name in held if "_build" in name or name.endswith(".pyc")]


@pytest.fixture(scope="module")
def code(tmp_path_factory):
    return tmp_path_factory.mktemp("code")


@pytest.mark.slow
@pytest.mark.parametrize(
    ("which", "extra"), [("source", ""), ("wheel", ""), *(("wheel", extra) for extra in alone.EXTRAS)]
)
def test_each_runs_alone(which, extra, archives, code):
    """In a fresh environment, from nothing but the archive and what it says it needs."""
    source, wheel = archives
    alone.try_alone(source if which == "source" else wheel, extra, code)


def test_every_extra_is_tried():
    """Those that are for users in fresh environments; the others are tools for working on snapbeam."""
    stated = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    tools = {"explorer-test", "docs", "dev", "bench", "bench-fortran"}
    assert set(stated["optional-dependencies"]) == set(alone.EXTRAS) | tools
    assert set(alone.USES) == {"", *alone.EXTRAS}
