"""What questions of dynamics cost: diagrams, branches, basins and lifetime maps, and a peer's way beside one of them.

A busy machine gives wall-clock times that say nothing, so processor time stands beside them and the load with both.
"""

from __future__ import annotations

import os
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import xarray as xr

import snapbeam as sb
from benchmarks.cases import model_of
from benchmarks.impacts import ways
from benchmarks.report import save, table
from snapbeam.model.default_values import CONTACT

__all__ = ["run"]

_SEED = 40417
_VALUES, _ORBITS, _SIDE = 400, 500, 300
_PLANE, _STARTS, _CYCLES = (64, 40), 32, 1000


class Seconds(NamedTuple):
    """What a call took."""

    cpu: float
    """Of processor time."""
    wall: float
    load: float
    """Processes that waited for a processor, in the mean over a minute, when it ended."""


class Cost(NamedTuple):
    """One question."""

    question: str
    done: int
    whole: int
    seconds: Seconds
    error: float
    """Standard error of the processor time, where what was done is a random sample of the whole; else 0."""
    target: float
    """Wall-clock seconds on two cores that it is meant to stay below."""

    @property
    def scaled(self) -> float:
        """Seconds of processor time of the whole."""
        return self.seconds.cpu * self.whole / self.done


def _system(modes: int, ratio: float, velocity: float, damping: float = 0.005) -> sb.System:
    shaker = sb.Shaker(frequency_ratio=ratio, velocity_amplitude=velocity)
    system = sb.System(model_of(modes), contacts=[sb.Contact(CONTACT, shaker)])
    return system.replace(**{"model.damping_ratio": damping})


def _seconds(call: Callable[[], Any]) -> tuple[Seconds, Any]:
    begun, clock = time.process_time(), time.perf_counter()
    found = call()
    taken = time.process_time() - begun
    return Seconds(taken, time.perf_counter() - clock, os.getloadavg()[0]), found


def _diagram(share: float) -> Cost:
    """Up and down over the velocity amplitude, 8 modes, 100 periods left out and 32 kept at each value."""
    values = np.linspace(0.01, 0.3, _VALUES)[:: round(1.0 / share)]
    system = _system(8, 1.4, 0.01)
    sb.dynamics.bifurcation_diagram(system, "velocity_amplitude", values[:2], periods=(2, 4))
    seconds, _ = _seconds(lambda: sb.dynamics.bifurcation_diagram(system, "velocity_amplitude", values))
    return Cost(f"diagram of {_VALUES} amplitudes, up and down, N = 8", values.size, _VALUES, seconds, 0.0, 60.0)


def _branch(share: float) -> Cost:
    """Orbits of 32 modes and two periods at level "reference", every one with its multipliers."""
    system = _system(32, 3.5, 0.06)
    orbit = sb.dynamics.periodic_orbit(system, period=2, transient=2000)
    most = round(_ORBITS * share)
    seconds, branch = _seconds(
        lambda: sb.dynamics.continuation(orbit, "velocity_amplitude", (0.005, 0.6), max_points=most, max_step=2e-4)
    )
    return Cost(f"branch of {_ORBITS} orbits, N = 32", len(branch.orbits), _ORBITS, seconds, 0.0, 60.0)


def _basins(share: float) -> Cost:
    """States of one mode that tap or rest, or go on for 200 cycles."""
    side = round(_SIDE * share**0.5)
    found = sb.dynamics.find_attractors(_system(1, 1.6, 0.03, 0.05), 40, transient=300)
    plane = {"amplitude[1]": np.linspace(-1.6, 1.6, side), "velocity[1]": np.linspace(-1.0, 1.0, side)}
    sb.dynamics.basins_of_attraction(found, {name: values[:2] for name, values in plane.items()}, periods=2)
    seconds, _ = _seconds(lambda: sb.dynamics.basins_of_attraction(found, plane, periods=200))
    return Cost(f"basins of {_SIDE} x {_SIDE} states, N = 1, 200 cycles", side**2, _SIDE**2, seconds, 0.0, 120.0)


def _lifetimes(share: float) -> Cost:
    """A random sample of the points of the map: each is computed whole, alone."""
    whole = _PLANE[0] * _PLANE[1]
    count = max(3, round(whole * share))
    draw = np.random.default_rng(_SEED)
    ratio, velocity = draw.uniform(0.1, 4.0, count), draw.uniform(0.01, 0.65, count)
    system = _system(32, 1.6, 0.3)
    how = sb.Integration(cycles=_CYCLES)
    times = []
    for k in range(count):
        point = xr.Dataset(
            {"frequency_ratio": ("point", ratio[k : k + 1]), "velocity_amplitude": ("point", velocity[k : k + 1])}
        )
        times.append(
            _seconds(lambda at=point: sb.dynamics.lifetime_map(system, at, how, initial_conditions=_STARTS))[0]
        )
    cpu = np.array([each.cpu for each in times])
    error = float(np.std(cpu, ddof=1)) * count**0.5
    total = Seconds(float(cpu.sum()), sum(each.wall for each in times), times[-1].load)
    words = f"lifetime map {_PLANE[0]} x {_PLANE[1]} x {_STARTS} starts, N = 32, {_CYCLES} cycles"
    return Cost(words, count, whole, total, error, 3600.0)


def run(folder: Path, quick: bool) -> None:
    """Measure, and write ``dynamics``."""
    shares = (0.05, 0.05, 0.04, 0.002) if quick else (1.0, 1.0, 1.0, 0.1)
    costs = [measure(share) for measure, share in zip((_diagram, _branch, _basins, _lifetimes), shares, strict=True)]
    rows = []
    for cost in costs:
        error = f" ± {cost.error * cost.whole / cost.done:.2g}" if cost.error else ""
        part = "all" if cost.done >= cost.whole else f"{cost.done} of {cost.whole}"
        took = cost.seconds
        told = (part, f"{took.cpu:.3g}", f"{took.wall:.3g}", f"{took.load:.0f}", f"{cost.scaled:.3g}{error}")
        rows.append([cost.question, *told, f"{cost.target:g}"])
    text = table(
        (
            "question",
            "measured",
            "processor time of that, s",
            "wall clock, s",
            "load",
            "processor time of the whole, s",
            "meant to stay below, s on two cores",
        ),
        rows,
    )
    text += (
        "\nOne thread. Where a part was measured the whole is scaled from it; the points of the lifetime map are drawn "
        "at random, ± is the standard error of the draw. Load: processes that wanted one of the machine's cores.\n\n"
    )
    found = ways(*((20, 50, 2) if quick else (400, 200, 5)))
    text += table(
        ("oscillator under restitution, orbits of one impact in a period", "µs of processor time a period", "error"),
        [[way.name, f"{1e6 * way.cpu / way.periods:.3g}", f"{way.error:.1g}"] for way in found],
    )
    text += "\nDynamicalSystems.jl takes the last way in compiled code; no time of it for impacts is published.\n"
    data = {
        "costs": [cost._asdict() | {"seconds": cost.seconds._asdict(), "scaled": cost.scaled} for cost in costs],
        "impacts": [way._asdict() for way in found],
    }
    save(folder, "dynamics", quick, data, text)
