"""The packages that make installs: each with its version and hashes, and complete."""

from __future__ import annotations

import re
import tomllib
from importlib.metadata import PackageNotFoundError, requires

import pytest
from locked import ROOT, locked, normal
from packaging.requirements import Requirement

EXTRAS = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"][
    "optional-dependencies"
]


def test_each_package_has_a_version_and_hashes():
    found = locked(list(EXTRAS))
    assert len(found) > 100
    for name, lines in found.items():
        first, *rest = lines.splitlines()
        assert re.match(rf"{name}==[\w.]+ (;.* )?\\$", first), first
        assert len([line for line in rest if re.search("--hash=sha256:[0-9a-f]{64}", line)]) >= 1, name


@pytest.mark.parametrize("extras", [[], ["dev", "lab", "cluster", "video"]], ids=["run", "test"])
def test_nothing_is_missing(extras):
    """``make`` installs these packages without asking what else they need."""
    found = locked(extras)
    assert {"numpy", "zarr", "hatchling"} <= found.keys() and "jax" not in found
    for name in found:
        try:
            needed = [Requirement(each) for each in requires(name) or []]
        except PackageNotFoundError:  # of another platform
            continue
        for each in needed:
            if each.marker is None or each.marker.evaluate({"extra": ""}):
                assert normal(each.name) in found, f"{name} needs {each.name}"
