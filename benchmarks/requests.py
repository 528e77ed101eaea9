"""Error on request: what a tolerance asked of simulate gives, measured."""

from __future__ import annotations

import math
import time
import warnings
from pathlib import Path
from typing import Any

import numpy as np

import snapbeam as sb
from benchmarks.cases import CONTACT, ERROR_CYCLES, REQUEST_POINTS, Case
from benchmarks.charts import requests_chart
from benchmarks.report import save, table

__all__ = ["run"]

_TOLERANCES = (1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8)


def run(folder: Path, quick: bool) -> None:
    """Measure and write ``requests``, and draw it."""
    records: list[dict[str, Any]] = []
    tolerances = _TOLERANCES[1::3] if quick else _TOLERANCES
    for modes in (1, 8, 32):
        for point in REQUEST_POINTS:
            case = Case(modes, *point)
            for tolerance in tolerances:
                records.append(_measured(case, tolerance))
    rows = []
    for modes in (1, 8, 32):
        for point in REQUEST_POINTS:
            case = Case(modes, *point)
            cells: list[object] = [modes, case.label]
            for tolerance in tolerances:
                r = next(
                    r for r in records if (r["modes"], r["point"], r["tolerance"]) == (modes, case.label, tolerance)
                )
                short = "" if r["horizon"] > 0.999 else f" to {r['horizon'] * ERROR_CYCLES:.1f} cycles"
                cells.append(f"{r['error']:.0e}{short}{'' if r['reached'] else ' (short)'}")
            rows.append([*cells, f"{r['conditioning']:.0e}"])
    header = ("modes", "(Omega, V)", *(f"tolerance {t:g}" for t in tolerances), "conditioning")
    data = {"cycles": ERROR_CYCLES, "records": records}
    worst = max(r["error"] / r["tolerance"] for r in records)
    held = sum(r["reached"] for r in records)
    within = (
        f"All {len(records)} requests are met"
        if held == len(records)
        else f"{held} of {len(records)} requests are met; (short) marks a shorter verified time"
    )
    text = table(header, rows) + (
        f"\n{within} up to the predictability horizon; the maximum error is {worst:.2g} of the tolerance.\n"
    )
    save(folder, "requests", quick, data, text)
    requests_chart(data, folder / "requests.png")


def _measured(case: Case, tolerance: float) -> dict[str, Any]:
    begun = time.perf_counter()
    run, accuracy = _simulate(case, tolerance)
    seconds = time.perf_counter() - begun
    reference = case.default_plan("reference")
    finer = reference._replace(step=min(reference.step, accuracy.step / 3.0))
    truth = case.displacement(finer) + case.at_rest
    until = case.times <= accuracy.predictability_horizon
    error = float(np.abs(run - truth)[until].max())
    return {
        "modes": case.modes,
        "point": case.label,
        "tolerance": tolerance,
        "error": error if math.isfinite(error) else None,
        "estimate": accuracy.estimated_error,
        "horizon": accuracy.predictability_horizon / case.times[-1],
        "conditioning": accuracy.perturbation_growth,
        "reached": accuracy.reached,
        "order": accuracy.order,
        "step": accuracy.step,
        "seconds": seconds,
    }


def _simulate(case: Case, tolerance: float) -> tuple[np.ndarray, sb.ErrorEstimate]:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)
        run = sb.simulate(
            sb.System(case.model, contacts=[sb.Contact(CONTACT, case.shaker)]),
            sb.Integration(cycles=ERROR_CYCLES, tolerance=tolerance),
            sample_times=case.times,
        )
    assert run.accuracy is not None
    return run.dataset["displacement_at_striker"].values, run.accuracy
