"""A small cheap map, and its results computed in one go."""

from __future__ import annotations

import numpy as np
import pytest

import snapbeam as sb
from snapbeam.sweeps.doors import map_setup
from snapbeam.sweeps.tasks import MemoryKeeper, PointWork, Stage

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
