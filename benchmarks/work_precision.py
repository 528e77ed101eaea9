"""Error against time of a single run: snapbeam's levels and the general-purpose integrators."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from benchmarks.cases import POINTS, Case
from benchmarks.charts import work_precision_chart
from benchmarks.peers import PEERS, methods
from benchmarks.report import save, table
from benchmarks.timing import measure
from snapbeam.model import default_values
from snapbeam.solver import native

__all__ = ["LIMIT", "run"]

LIMIT = 1e-3
"""e5 that level standard stands for."""
_CYCLES = 200


def run(folder: Path, quick: bool, peers: Sequence[str] = PEERS) -> None:
    """Measure, write ``work_precision`` and draw it."""
    records: list[dict[str, Any]] = []
    conditioning = {}
    for point in POINTS:
        case = Case(default_values.MODES, *point)
        conditioning[case.label] = {"conditioning": case.conditioning, "check": _check(case)}
        records += _snapbeam(case, quick)
    for peer in peers:
        found = methods(peer)
        if isinstance(found, str):
            print(found, flush=True)
            continue
        for point in POINTS:
            records += _peer(Case(default_values.MODES, *point), found, quick)
    data = {"modes": default_values.MODES, "cycles": _CYCLES, "points": conditioning, "records": records}
    save(folder, "work_precision", quick, data, _tables(records, conditioning))
    work_precision_chart(data, folder / "work_precision.png")


def _record(case: Case, method: str, setting: str, error: float, timing: Any, factor: float) -> dict[str, Any]:
    record = {
        "point": case.label,
        "method": method,
        "setting": setting,
        "e5": error,
        "seconds": timing.seconds * factor,
        "spread": timing.spread,
        "wall_seconds": timing.wall * factor,
        "repeats": timing.repeats,
    }
    print(f"{case.label} {method} {setting}: e5 {error:.1e}, {record['seconds']:.4g} s", flush=True)
    return record


def _snapbeam(case: Case, quick: bool) -> list[dict[str, Any]]:
    settings = [("standard", factor) for factor in (2.0, 1.0, 0.5, 0.25)]
    settings += [("reference", factor) for factor in (4.0, 2.0, 1.0)]
    records = []
    for level, factor in settings:
        plan = case.default_plan(level).scaled(factor)
        ensemble = case.ensemble(plan, _CYCLES)
        timing = measure(lambda ensemble=ensemble: native.run_ensemble(ensemble, 1), 1 if quick else 5)
        setting = f"{1e6 * plan.step:.3g} us" + (", default" if factor == 1.0 else "")
        error = case.error(case.displacement(plan))
        records.append(_record(case, f"snapbeam {level}", setting, error, timing, 1.0))
    return records


def _peer(case: Case, found: Sequence[Any], quick: bool) -> list[dict[str, Any]]:
    cycles, repeats = (5, 1) if quick else (_CYCLES, 5)
    every = 2 if quick else 1
    records = []
    for method in found:
        for tolerance in method.tolerances[::every]:
            solver = method.prepare(case, tolerance)
            error = case.error(solver.sample(case.times))
            solver.advance(case.period)
            timing = measure(lambda solver=solver: solver.advance(cycles * case.period), repeats, warm=False)
            records.append(_record(case, method.name, f"{tolerance:g}", error, timing, _CYCLES / cycles))
    return records


def _check(case: Case) -> dict[str, float]:
    """How far solutions of other libraries, at a tight tolerance, are from the reference."""
    found = {}
    for peer, name, tolerance in (("scipy", "scipy DOP853", 1e-12), ("heyoka", "heyoka Taylor", 1e-15)):
        available = methods(peer)
        if not isinstance(available, str):
            method = next(method for method in available if method.name == name)
            found[name] = case.error(method.prepare(case, tolerance).sample(case.times))
    return found


def _fastest(records: list[dict[str, Any]], point: str, method: str) -> dict[str, Any] | None:
    good = [r for r in records if r["point"] == point and r["method"] == method and r["e5"] <= LIMIT]
    return min(good, key=lambda r: r["seconds"]) if good else None


def _tables(records: list[dict[str, Any]], conditioning: dict[str, Any]) -> str:
    ours = {r["point"]: r for r in records if r["method"] == "snapbeam standard" and r["setting"].endswith("default")}
    rows: list[list[object]] = []
    for method in dict.fromkeys(r["method"] for r in records):
        for point, own in ours.items():
            best = own if method == "snapbeam standard" else _fastest(records, point, method)
            if best is None:
                rows.append([method, point, "-", f"above {LIMIT:g}", "-", "-"])
                continue
            ratio = best["seconds"] / own["seconds"]
            mark = " (smaller error)" if best["e5"] < own["e5"] else ""
            seconds = f"{best['seconds']:.3g} (+{100 * best['spread']:.0f} %)"
            rows.append([method, point, best["setting"], f"{best['e5']:.1e}{mark}", seconds, f"{ratio:.3g}"])
    text = table(("method", "(Omega, V)", "step or tolerance", "e5", "s per 200 cycles", "ratio"), rows)
    checks = [
        [point, f"{facts['conditioning']:.0e}"]
        + [f"{facts['check'][name]:.0e}" if name in facts["check"] else "-" for name in _CHECKS]
        for point, facts in conditioning.items()
        if math.isfinite(facts["conditioning"])
    ]
    header = ("(Omega, V)", "conditioning", *(f"reference against {name}" for name in _CHECKS))
    return text + "\n" + table(header, checks)


_CHECKS = ("scipy DOP853", "heyoka Taylor")
