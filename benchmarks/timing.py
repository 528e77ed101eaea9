"""Clocks and the facts of the machine that they ran on."""

from __future__ import annotations

import os
import platform
import time
from collections.abc import Callable
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import NamedTuple

import numpy as np

from snapbeam import _core

__all__ = ["Timing", "machine", "measure"]

_PACKAGES = ("snapbeam", "numpy", "numba", "scipy", "numbalsoda", "heyoka", "diffrax", "jax")


class Timing(NamedTuple):
    """Repeated calls of one thing.

    Each call counts with the lesser of its wall-clock and processor times, so that other work on the machine
    disturbs least; on a quiet one they are equal for whatever runs in one thread.
    """

    seconds: float
    """Of the fastest call."""
    spread: float
    """How much longer the median took, relative."""
    wall: float
    """Wall-clock time of the fastest call."""
    repeats: int


def measure(call: Callable[[], object], repeats: int, *, warm: bool = True) -> Timing:
    """Time *call*, after one call that is not counted if *warm* (compilation, caches)."""
    if warm:
        call()
    walls, lesser = [], []
    for _ in range(repeats):
        wall, cpu = time.perf_counter(), time.process_time()
        call()
        cpu = time.process_time() - cpu
        walls.append(time.perf_counter() - wall)
        lesser.append(min(walls[-1], cpu))
    best = min(lesser)
    return Timing(best, float(np.median(lesser) / best - 1.0), min(walls), repeats)


def _processor() -> str:
    try:
        for line in Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines():
            if line.startswith("model name"):
                return line.partition(":")[2].strip()
    except OSError:
        pass
    return platform.processor() or platform.machine()


def _installed(package: str) -> str:
    try:
        return version(package)
    except PackageNotFoundError:
        return "not installed"


def machine() -> dict[str, str | int | float]:
    """Processor, cores, versions, and how busy the machine is; nothing that tells whose it is."""
    facts: dict[str, str | int | float] = {
        "processor": _processor(),
        "cores": os.cpu_count() or 1,
        "vectors": _core.instruction_sets()[0],
        "python": platform.python_version(),
    }
    facts |= {package: _installed(package) for package in _PACKAGES}
    if hasattr(os, "getloadavg"):
        facts["load_before"] = round(os.getloadavg()[0], 2)
    return facts
