"""How time grows with the number of runs and with the number of modes."""

from __future__ import annotations

import resource
import time
from pathlib import Path
from typing import Any

from benchmarks.cases import Case
from benchmarks.charts import scaling_chart
from benchmarks.ensemble import ensemble_of, sample
from benchmarks.report import save, table
from benchmarks.timing import measure
from snapbeam import _core
from snapbeam.solver import native
from snapbeam.solver.step_size import composition_of

__all__ = ["run"]

_MODES = (1, 2, 4, 8, 16, 32, 64, 128)
_CYCLES = 10


def run(folder: Path, quick: bool) -> None:
    """Measure, write ``scaling`` and draw it."""
    sizes = (1000, 10_000) if quick else (1000, 10_000, 100_000, 1_000_000)
    runs = [_trajectories(size) for size in sizes]
    modes = [_modes(count, 3 if quick else 10) for count in _MODES]
    text = table(
        ("runs", "microseconds per run", "growth of peak memory, MiB"),
        [[r["runs"], f"{r['microseconds']:.3g}", f"{r['growth_mib']:.0f}"] for r in runs],
    )
    text += f"\nN = 1, {_CYCLES} cycles a run, random points of the plane of Fig. 6, all cores.\n\n"
    text += table(
        ("modes", "ms per 200 cycles", "flight step, us", "ns per kick"),
        [
            [r["modes"], f"{r['milliseconds']:.3g}", f"{1e6 * r['step']:.3g}", f"{r['nanoseconds_per_kick']:.3g}"]
            for r in modes
        ],
    )
    data = {"runs": runs, "modes": modes}
    save(folder, "scaling", quick, data, text)
    scaling_chart(data, folder / "scaling.png")


def _peak_mib() -> float:
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0


def _trajectories(size: int) -> dict[str, Any]:
    native.run_ensemble(ensemble_of(1, sample(10), False, _CYCLES))
    before = _peak_mib()
    begun = time.perf_counter()
    native.run_ensemble(ensemble_of(1, sample(size), False, _CYCLES))
    seconds = time.perf_counter() - begun
    return {"runs": size, "microseconds": 1e6 * seconds / size, "growth_mib": _peak_mib() - before}


def _modes(count: int, repeats: int) -> dict[str, Any]:
    case = Case(count, 1.21, 0.18)
    plan = case.default_plan()
    ensemble = case.ensemble(plan, 200)
    timing = measure(lambda: native.run_ensemble(ensemble, 1), repeats)
    accumulators_of_runs = native.run_ensemble(ensemble, 1)
    kicks = int(accumulators_of_runs["steps"][0]) * len(_core.COMPOSITIONS[composition_of(plan.order)][0])
    return {
        "modes": count,
        "milliseconds": 1e3 * timing.seconds,
        "spread": timing.spread,
        "step": plan.step,
        "nanoseconds_per_kick": 1e9 * timing.seconds / kicks,
    }
