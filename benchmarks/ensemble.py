"""Throughput over a random sample of the plane of Fig. 6, per run and core."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

import snapbeam as sb
from benchmarks.cases import CONTACT, model_of
from benchmarks.report import save, table
from benchmarks.timing import measure
from snapbeam.model import default_values
from snapbeam.solver import native
from snapbeam.solver.assemble import make_ensemble
from snapbeam.solver.ensemble import Ensemble
from snapbeam.util.status_codes import RunStatus

__all__ = ["ensemble_of", "run", "sample"]

_SEED = 20240118


def sample(size: int) -> dict[str, np.ndarray]:
    """Points of the plane: Omega in 0.1 to 4, V in 0 to 0.65, uniform, seed fixed."""
    random = np.random.default_rng(_SEED)
    return {
        "frequency_ratio": random.uniform(0.1, 4.0, size),
        "velocity_amplitude": random.uniform(0.0, 0.65, size),
        "location": np.full(size, default_values.LOCATION),
    }


def ensemble_of(
    modes: int, points: dict[str, np.ndarray], early: bool, cycles: int = default_values.CYCLES
) -> Ensemble:
    """The runs of *points* at level standard."""
    system = sb.System(
        model_of(modes), contacts=[sb.Contact(CONTACT, sb.Shaker(frequency_ratio=1.0, velocity_amplitude=0.1))]
    )
    columns = {
        "drive.frequency_ratio": points["frequency_ratio"],
        "drive.velocity_amplitude": points["velocity_amplitude"],
        "contact.location": points["location"],
    }
    return make_ensemble(system, sb.Integration(cycles=cycles, early_termination=early), columns)


def run(folder: Path, quick: bool) -> None:
    """Measure and write ``ensemble``."""
    records = []
    for modes, size in ((32, 24 if quick else 400), (1, 200 if quick else 2000)):
        for early in (False, True):
            records.append(_throughput(modes, size, early, 1 if quick else 3))
    data: dict[str, Any] = {"seed": _SEED, "cycles": default_values.CYCLES, "records": records}
    rows = [
        [
            r["modes"],
            "on" if r["early_termination"] else "off",
            r["runs"],
            f"{r['milliseconds']:.3g} (+{100 * r['spread']:.0f} %)",
            f"{100 * r['decided']:.0f} %",
            f"{100 * r['saved']:.0f} %",
        ]
        for r in records
    ]
    text = table(
        ("modes", "early termination", "runs", "ms per run and core", "runs that ended early", "simulated time saved"),
        rows,
    )
    save(folder, "ensemble", quick, data, text)


def _throughput(modes: int, size: int, early: bool, repeats: int) -> dict[str, Any]:
    ensemble = ensemble_of(modes, sample(size), early)
    timing = measure(lambda: native.run_ensemble(ensemble, 1), repeats)
    accumulators_of_runs = native.run_ensemble(ensemble, 1)
    whole = ensemble.runs["tick"] * ensemble.runs["end"]
    decided = accumulators_of_runs["status"] == RunStatus.EARLY_STOP
    lasted = np.where(decided, accumulators_of_runs["early_stop_time"], whole)
    work = ensemble.work
    return {
        "modes": modes,
        "runs": size,
        "early_termination": early,
        "milliseconds": 1e3 * timing.seconds / size,
        "spread": timing.spread,
        "decided": float(decided.mean()),
        "saved": float(1.0 - np.sum(work * lasted / whole) / work.sum()),
    }
