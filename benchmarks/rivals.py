"""snapbeam beside its rivals as a rival's author would sign it: the same points, the same cycles, the same repeats.

The points are drawn from the plane of Fig. 6 by a fixed seed and spread over the share of time that the tip is in
contact, so that runs under sustained impact count as they occur.  Every method integrates every point to its end, early
decision is off, nothing is extrapolated.  Each method has the loosest of its tolerances that keeps e5 at or below 1e-3
at every well-conditioned point (or the tightest, if none does, and the table says so).  Rivals that can take many runs
do so.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.cases import Case
from benchmarks.ensemble import ensemble_of, sample
from benchmarks.peers import PEERS, Method, methods
from benchmarks.report import save, table
from benchmarks.timing import Timing, measure
from snapbeam.model import default_values
from snapbeam.solver import native

__all__ = ["chosen_points", "run"]

LIMIT = 1e-3
"""Greatest e5 that is accepted at a well-conditioned point."""
WELL = 1e-10
"""Response to a relative change of V by 1e-13 up to which a point is well-conditioned."""
_CANDIDATES = 400
_MODES = default_values.MODES


def chosen_points(count: int, cycles: int) -> tuple[dict[str, np.ndarray], np.ndarray]:
    """Points at equal steps of the share of time in contact, and that share."""
    points = sample(_CANDIDATES)
    ensemble = ensemble_of(_MODES, points, False, cycles)
    accumulators_of_runs = native.run_ensemble(ensemble, 1)
    share = accumulators_of_runs["contact_time"] / (ensemble.runs["tick"] * ensemble.runs["end"])
    order = np.argsort(share)[((np.arange(count) + 0.5) / count * _CANDIDATES).astype(int)]
    return {name: values[order] for name, values in points.items()}, share[order]


def run(folder: Path, quick: bool) -> None:
    """Measure and write ``rivals``."""
    count, cycles, repeats = (3, 4, 1) if quick else (12, default_values.CYCLES, 3)
    points, share = chosen_points(count, cycles)
    cases = [
        Case(_MODES, float(omega), float(speed))
        for omega, speed in zip(points["frequency_ratio"], points["velocity_amplitude"], strict=True)
    ]
    records = [_snapbeam(cases, points, cycles, repeats)]
    for peer in PEERS:
        found = methods(peer)
        if isinstance(found, str):
            print(found, flush=True)
            continue
        records += [_rival(method, cases, cycles, repeats, quick) for method in found]
    _print_errors(records)
    own = records[0]["seconds"]
    rows = []
    for r in sorted(records, key=lambda r: r["seconds"]):
        worst = _worst(cases, r["errors"])
        said = f"{worst:.1e}" + ("" if worst <= LIMIT else " (too large)")
        each = f"{r['seconds'] / count:.2g} (+{100 * r['spread']:.0f} %)"
        rows.append([r["method"], r["options"], said, each, f"{r['seconds'] / own:.2g}"])
    text = table(("method", "options", "maximum e5", "s per run", "ratio"), rows)
    text += (
        f"\n{count} points of {cycles} cycles, {_MODES} modes, {repeats} repeats of each method; the tip is in contact "
        f"for {100 * share.min():.0f} to {100 * share.max():.0f} % of the time. One core; early termination off.\n"
    )
    fair = sum(case.conditioning <= WELL for case in cases)
    text += f"e5 is the maximum over the {fair} well-conditioned points.\n"
    rivals = [r for r in records[1:] if _worst(cases, r["errors"]) <= LIMIT]
    if rivals:
        best = min(rivals, key=lambda r: r["seconds"])
        text += f"The fastest rival is {best['method']}: {best['seconds'] / own:.2g} times snapbeam's time.\n"
    data: dict[str, Any] = {
        "modes": _MODES, "cycles": cycles, "repeats": repeats, "limit": LIMIT,
        "points": {name: values.tolist() for name, values in points.items()}, "contact_time_fraction": share.tolist(),
        "records": records,
    }  # fmt: skip
    save(folder, "rivals", quick, data, text)


def _print_errors(records: list[dict[str, Any]]) -> None:
    for record in records:
        worst = ", ".join(f"{error:.0e}" for error in record["errors"])
        print(f"{record['method']} ({record['options']}): {record['seconds']:.3g} s; e5 {worst}", flush=True)


def _record(method: str, options: str, errors: list[float], timing: Timing) -> dict[str, Any]:
    return {
        "method": method, "options": options, "errors": errors, "seconds": timing.seconds,
        "spread": timing.spread, "repeats": timing.repeats,
    }  # fmt: skip


def _snapbeam(cases: list[Case], points: dict[str, np.ndarray], cycles: int, repeats: int) -> dict[str, Any]:
    """All points in one call, on one core, two runs side by side, as a map takes them."""
    errors = [case.error(case.displacement(case.default_plan())) for case in cases]
    ensemble = ensemble_of(_MODES, points, False, cycles)
    timing = measure(lambda: native.run_ensemble(ensemble, 1), repeats)
    return _record("snapbeam", "level standard, default step", errors, timing)


def _rival(method: Method, cases: list[Case], cycles: int, repeats: int, quick: bool) -> dict[str, Any]:
    """The points one after the other, or all at once where the method can; at its best tolerance."""
    tried = method.tolerances[:1] if quick else method.tolerances
    for tolerance in tried:  # from loose to tight: the loosest that is good costs least
        errors = _errors(method, cases, tolerance)
        if _worst(cases, errors) <= LIMIT:
            break
    options = f"{method.options}, tolerance {tolerance:g}".lstrip(", ")
    return _record(method.name, options, errors, _timed(method, cases, tolerance, cycles, repeats))


def _worst(cases: list[Case], errors: list[float]) -> float:
    """The greatest error at the points where one trajectory means something."""
    return max(e for case, e in zip(cases, errors, strict=True) if case.conditioning <= WELL)


def _errors(method: Method, cases: list[Case], tolerance: float) -> list[float]:
    if method.batch is not None:
        sampled = method.batch(cases, tolerance).sample(np.stack([case.times for case in cases]))
    else:
        sampled = [method.prepare(case, tolerance).sample(case.times) for case in cases]
    return [case.error(values) for case, values in zip(cases, sampled, strict=True)]


def _timed(method: Method, cases: list[Case], tolerance: float, cycles: int, repeats: int) -> Timing:
    """All points to their end: at once where the method can, else one after the other; compiled before."""
    if method.batch is not None:
        together = method.batch(cases, tolerance)
        ends = np.array([cycles * case.period for case in cases])
        together.advance(ends * 1e-3)
        return measure(lambda: together.advance(ends), repeats, warm=False)
    solvers = [method.prepare(case, tolerance) for case in cases]
    for case, each in zip(cases, solvers, strict=True):
        each.advance(1e-2 * case.period)

    def all_of_them() -> None:
        for case, each in zip(cases, solvers, strict=True):
            each.advance(cycles * case.period)

    return measure(all_of_them, repeats, warm=False)
