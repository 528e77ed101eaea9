"""Damage done on purpose: file systems that are small or read-only, and a count of what was tried."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from collections import Counter
from pathlib import Path

import pytest
from small_map import contact, model, small, whole, work

import snapbeam

__all__ = ["contact", "model", "small", "whole", "work"]

sys.path.insert(0, str(Path(__file__).parent))
PACKAGE = Path(snapbeam.__file__).parent
_tried = pytest.StashKey[Counter]()


def pytest_configure(config):
    config.stash[_tried] = Counter()


def pytest_terminal_summary(terminalreporter, config):
    """Print what was tried: the figures of the docs' page on what the package survives."""
    if counts := config.stash.get(_tried, None):
        terminalreporter.section("tried on purpose")
        for name, count in sorted(counts.items()):
            terminalreporter.line(f"{count:8d}  {name}")


@pytest.fixture
def tried(request):
    """Count something that was tried: ``tried("kills of a worker", 5)``."""

    def count(name, number=1):
        request.config.stash[_tried][name] += number

    return count


@pytest.fixture
def mounted(tmp_path):
    """Mount file systems, where this process may, and take them off again: ``mounted("disk", "size=600k")``."""
    places = []

    def mount(name, options):
        place = tmp_path / name
        place.mkdir()
        command = ["mount", "-t", "tmpfs", "-o", options, "tmpfs", str(place)]
        try:
            done = subprocess.run(command, capture_output=True).returncode == 0
        except OSError:
            done = False
        if not done:
            pytest.skip("no file system can be mounted here")
        places.append(place)
        return place

    yield mount
    for place in places:
        subprocess.run(["umount", "-l", str(place)], check=True)


@pytest.fixture
def read_only():
    """Make what was mounted read-only."""

    def remount(place):
        subprocess.run(["mount", "-o", "remount,ro", str(place)], check=True)

    return remount


@pytest.fixture
def copied(tmp_path):
    """A copy of the package, in a folder to put on the path."""

    def copy(folder=tmp_path / "site"):
        shutil.copytree(PACKAGE, folder / "snapbeam", ignore=shutil.ignore_patterns("__pycache__"))
        return folder

    return copy


@pytest.fixture
def python():
    """Run a script in a fresh interpreter: ``python(script, path, **environment)``."""

    def run(script, path, timeout=300, **environment):
        env = os.environ | {"PYTHONPATH": str(path), "PYTHONDONTWRITEBYTECODE": "1"} | environment
        return subprocess.run([sys.executable, "-c", script], env=env, capture_output=True, text=True, timeout=timeout)

    run.package = PACKAGE.parent
    return run
