"""Damage done on purpose: file systems that are small or read-only, and a count of what was tried."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from collections import Counter
from pathlib import Path

import numpy as np
import pytest

import snapbeam
import snapbeam as sb
from snapbeam.sweeps.compute.task import PointWork
from snapbeam.sweeps.compute.tasks import MemoryKeeper, Stage
from snapbeam.sweeps.doors import map_setup

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
    """A copy of the package without compiled code, in a folder to put on the path."""

    def copy(folder=tmp_path / "site"):
        shutil.copytree(PACKAGE, folder / "snapbeam", ignore=shutil.ignore_patterns("__pycache__"))
        return folder

    return copy


@pytest.fixture
def python():
    """Run a script in a fresh interpreter: ``python(script, path, **environment)``."""

    def run(script, path, timeout=300, **environment):
        env = os.environ | {"PYTHONPATH": str(path), "PYTHONDONTWRITEBYTECODE": "1"} | environment
        return subprocess.run(
            [sys.executable, "-c", script], env=env, capture_output=True, text=True, timeout=timeout
        )

    run.package = PACKAGE.parent
    return run


BEAM = sb.Beam(
    length=0.161, thickness=0.4e-3, width=15e-3, density=7800.0, young_modulus=200e9, buckling_level=0.335e-3
)
CONTACT = sb.HertzContact(stiffness=4e8)
AXES = {"frequency_ratio": np.linspace(0.4, 2.0, 5), "velocity_amplitude": np.linspace(0.05, 0.6, 4)}
CYCLES = 3


@pytest.fixture(scope="session")
def model():
    return sb.ReducedModel.from_beam(BEAM, modes=1, damping_ratio=0.005)


@pytest.fixture(scope="session")
def contact():
    return CONTACT


@pytest.fixture(scope="session")
def small(model):
    """Arguments of a map of twenty runs of one mode."""
    return {"model": model, "contact": CONTACT, "cycles": CYCLES, **AXES}


@pytest.fixture(scope="session")
def work(small):
    return PointWork(map_setup(**small))


@pytest.fixture(scope="session")
def whole(work):
    """Rows of the small map, computed in one go."""
    grid = work.setup.points
    return MemoryKeeper(work, 1).complete(Stage("base", grid, grid.size)).read(0, grid.size)
