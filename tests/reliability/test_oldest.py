"""The bounds of the dependencies are stated so that they can be installed and tested (make test-oldest)."""

from __future__ import annotations

import tomllib

import pytest
from oldest import PYPROJECT, oldest

SETS = ["lab", "cluster", "video", "test"]


def test_every_dependency_has_a_lower_bound_that_can_be_installed():
    stated = tomllib.loads(PYPROJECT.read_text(encoding="utf-8"))
    known = stated["project"]["optional-dependencies"] | stated["dependency-groups"]
    count = len(stated["project"]["dependencies"]) + sum(len(known[each]) for each in SETS)
    assert len(oldest(SETS)) == count
    assert "typer==0.17.5" in oldest([])


@pytest.mark.parametrize("text", ["numpy", "numpy<3", "numpy~=2.0", "numpy>=2.0; python_version < '3.12'"])
def test_other_bounds_are_refused(tmp_path, text):
    file = tmp_path / "pyproject.toml"
    file.write_text(f'[project]\ndependencies = ["{text}"]\n', encoding="utf-8")
    with pytest.raises(ValueError, match="must be name>=version"):
        oldest([], file)


def test_the_source_distribution_holds_what_builds_and_tests_it():
    excluded = tomllib.loads(PYPROJECT.read_text(encoding="utf-8"))["tool"]["scikit-build"]["sdist"]["exclude"]
    for name in (
        "Makefile",
        "src",
        "tests",
        "constraints.txt",
        "requirements-dev.txt",
        "CMakeLists.txt",
        "build_backend",
    ):
        assert f"!/{name}" in excluded
