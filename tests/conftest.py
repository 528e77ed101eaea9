"""Fixtures and options of all tests: results that a formula gives, so that plots and files need no simulation."""

from __future__ import annotations

import gc
import os
import signal
import sys
from collections import Counter

from blas_kernel import blas_kernel

os.environ.setdefault("MPLBACKEND", "Agg")
os.environ.update(blas_kernel())
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # the workers share the cores

import numpy as np
import pytest
import xarray as xr

from snapbeam.simulation.dataset import trajectory_dataset
from snapbeam.util.status_codes import ResponseClass


def pytest_addoption(parser):
    parser.addoption("--seed", type=int, default=7, help="of tests that draw at random (slow ones)")
    parser.addoption("--draws", type=int, default=50, help="how many such tests draw")


def pytest_configure():
    """Restore the signals that the caller ignores or blocks, such as a background job, since child processes inherit this."""
    if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
        signal.signal(signal.SIGINT, signal.default_int_handler)
    for name in ("SIGTERM", "SIGHUP"):
        if (number := getattr(signal, name, None)) and signal.getsignal(number) is signal.SIG_IGN:
            signal.signal(number, signal.SIG_DFL)
    if hasattr(signal, "pthread_sigmask"):
        signal.pthread_sigmask(signal.SIG_SETMASK, ())


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items):
    """Make the cases of a sampled test slow, but for every nth.

    The laboratory is first, whose files take longest, so that two workers end at about the same time.
    """
    quick: Counter[str] = Counter()
    for item in items:
        sampled = item.get_closest_marker("sampled")
        if sampled and not item.get_closest_marker("slow"):
            name = item.nodeid.partition("[")[0]
            if quick[name] % sampled.args[0]:
                item.add_marker("slow")
            quick[name] += 1
    items.sort(key=lambda item: "/tests/lab/" not in item.path.as_posix())


def pytest_collection_finish():
    """Leave the modules and the tests out of the garbage collection: each would look at all of them again."""
    gc.collect()
    gc.freeze()


@pytest.fixture(autouse=True)
def close_figures():
    """Close the figures of a test: Matplotlib warns of more than twenty open ones, in whatever test comes next."""
    yield
    if pyplot := sys.modules.get("matplotlib.pyplot"):
        pyplot.close("all")


@pytest.fixture
def synthetic_map():
    """A map over frequency ratio and velocity amplitude whose classes are known point by point."""
    ratio = np.linspace(0.1, 4.0, 40)
    velocity = np.linspace(0.01, 0.65, 25)
    x, y = np.meshgrid(ratio, velocity, indexing="ij")
    threshold = 0.10 + 0.06 * x - 0.09 * np.exp(-(((x - 1.2) / 0.3) ** 2))
    kinds = np.where(y > threshold, ResponseClass.TRANSIENT_2, ResponseClass.INTRAWELL)
    kinds = np.where((y > threshold) & (np.sin(37.0 * x * y) > 0.4), ResponseClass.TRANSIENT_1, kinds)
    kinds = np.where((x < 0.8) & (y > 0.9 * x + 0.15), ResponseClass.CONTINUOUS, kinds)
    kinds[-1, -1] = ResponseClass.UNKNOWN
    return xr.Dataset(
        {"response_class": (("frequency_ratio", "velocity_amplitude"), kinds.astype(np.int8))},
        {
            "frequency_ratio": ("frequency_ratio", ratio, {"units": "1"}),
            "velocity_amplitude": ("velocity_amplitude", velocity, {"units": "1"}),
            "location": 1.0 / 2.1,
        },
        {"modes": 32, "cycles": 200, "reference_frequency": 81.853, "beam_buckling_level": 0.335e-3},
    )


@pytest.fixture
def synthetic_run():
    """Ten cycles of a beam that is hit once a cycle and rings down between."""
    cycle = np.linspace(0.0, 10.0, 20_001)
    freq = 100.0
    phase = cycle % 1.0
    shaker = -1.0 + 0.15 * np.sin(2.0 * np.pi * cycle)
    depth = np.where((phase > 0.10) & (phase < 0.15), 4e-3 * np.sin(np.pi * (phase - 0.10) / 0.05), 0.0)
    beam = np.where(depth > 0.0, shaker - depth, shaker + 0.3 * np.sin(np.pi * ((phase - 0.15) % 1.0)) ** 2)
    return trajectory_dataset(
        cycle / freq,
        cycle,
        displacement_at_striker=beam,
        midspan_displacement=1.02 * beam,
        striker_displacement=shaker,
        penetration_normalised=shaker - beam,
        contact_force=4e8 * np.maximum(0.335e-3 * depth, 0.0) ** 1.5,
    )
