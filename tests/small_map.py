"""A small cheap sweep over frequency ratio and velocity amplitude, and its results computed in one go."""

from __future__ import annotations

from dataclasses import fields
from typing import Any

import numpy as np
import pytest
import xarray as xr

import snapbeam as sb
from snapbeam.sweeps.setup import SweepSetup, sweep_setup
from snapbeam.sweeps.tasks import MemoryRunner, PointWork, Stage

BEAM = sb.Beam(
    length=0.161, thickness=0.4e-3, width=15e-3, density=7800.0, young_modulus=200e9, buckling_level=0.335e-3
)
CONTACT = sb.HertzContact(stiffness=4e8)
AXES = {"frequency_ratio": np.linspace(0.4, 2.0, 5), "velocity_amplitude": np.linspace(0.05, 0.6, 4)}
CYCLES = 3
OF_SWEEP = ("cluster", "refine_levels", "replicates", "output", "progress")
OF_CHECKPOINT = tuple(field.name for field in fields(sb.CheckpointOptions))


def requested(
    model: sb.ReducedModel, contact: sb.ContactLaw | None, *, side: str = "below", **given: Any
) -> tuple[sb.System, Any, sb.Integration]:
    """System, axes and integration of a sweep with a sinusoidal shaker.

    *given* contains values of ``frequency_ratio``, ``velocity_amplitude`` and ``location``, of which an array is an
    axis and a number is a parameter of the system, and the fields of an integration.
    """
    values = {name: given.pop(name) for name in ("frequency_ratio", "velocity_amplitude")}
    values["location"] = given.pop("location", 1.0 / 2.1)
    axes: Any = {name: value for name, value in values.items() if np.ndim(value)}
    own = {"frequency_ratio": 1.0, "velocity_amplitude": 0.0, "location": 0.5}
    shaker = sb.Shaker(**own | {name: value for name, value in values.items() if name not in axes}, side=side)
    if not axes:
        axes = xr.Dataset({"location": ("point", [values["location"]])})
    return sb.System(model, contacts=[sb.Contact(contact, shaker)]), axes, sb.Integration(**given)


def setup_of(model: sb.ReducedModel, contact: sb.ContactLaw | None, **given: Any) -> SweepSetup:
    """The same sweep, checked."""
    return sweep_setup(*requested(model, contact, **given))


def swept(model: sb.ReducedModel, contact: sb.ContactLaw | None, **given: Any) -> xr.Dataset:
    """The sweep of :func:`requested`, with arguments of ``sb.sweep`` and the fields of ``sb.CheckpointOptions``."""
    how = {name: given.pop(name) for name in OF_SWEEP if name in given}
    kept = {name: given.pop(name) for name in OF_CHECKPOINT if name in given}
    system, axes, integration = requested(model, contact, **given)
    dataset = sb.sweep(system, axes, integration, checkpoint=sb.CheckpointOptions(**kept), **how)
    return dataset if isinstance(axes, dict) else dataset.isel(point=0)


@pytest.fixture(scope="session")
def model():
    return sb.ReducedModel.from_beam(BEAM, modes=1, damping_ratio=0.005)


@pytest.fixture(scope="session")
def contact():
    return CONTACT


@pytest.fixture(scope="session")
def small(model):
    """Arguments of :func:`swept` for twenty runs of one mode."""
    return {"model": model, "contact": CONTACT, "cycles": CYCLES, **AXES}


@pytest.fixture(scope="session")
def work(small):
    return PointWork(setup_of(**small))


@pytest.fixture(scope="session")
def whole(work):
    """Rows of the small sweep, computed in one go."""
    grid = work.setup.points
    return MemoryRunner(work, 1).complete(Stage("base", grid, grid.size)).read(0, grid.size)
