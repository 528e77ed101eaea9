"""The two layouts of the CPU engine, in turns in one process: eight modes of a run in a register, or eight runs."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.charts import layouts_chart
from benchmarks.ensemble import ensemble_of, sample
from benchmarks.report import save, table
from benchmarks.timing import measure
from snapbeam.solver.cpu import driver
from snapbeam.solver.cpu.run_lanes.layout import MOST
from snapbeam.solver.ensemble import Ensemble

__all__ = ["run"]

_MODES = (1, 2, 3, 4, 6, 8, 12, 16)


def run(folder: Path, quick: bool) -> None:
    """Measure and write ``layouts``: nanoseconds a step, and how many times as many the first layout takes."""
    size, cycles, repeats = (40, 10, 1) if quick else (480, 200, 3)
    records = []
    for modes in _MODES:
        for early in (False, True) if modes == 1 else (False,):
            made = ensemble_of(modes, sample(size if modes < 8 else size // 4), early, cycles)
            records.append(_in_turns(modes, early, made, repeats))
    rows = [
        [
            r["modes"],
            "on" if r["early"] else "off",
            f"{r['modes_wide']:.0f}",
            f"{r['runs_wide']:.0f}",
            f"{r['ratio']:.2f}",
        ]
        for r in records
    ]
    head = ("modes", "early termination", "eight modes of a run, ns a step", "eight runs, ns a step", "ratio")
    save(folder, "layouts", quick, {"records": records}, table(head, rows))
    layouts_chart(folder / "layouts.png", [r for r in records if not r["early"]])


def _in_turns(modes: int, early: bool, ensemble: Ensemble, repeats: int) -> dict[str, Any]:
    """Each layout in turn, so that what else the machine does meets both."""
    accumulators_of_runs, times = {}, {False: np.inf, True: np.inf}
    for few in (False, True) * (repeats + 1):
        driver.FEWEST_STEPS, driver.FEW_MODES = 0.0, MOST if few else 0
        timing = measure(lambda: driver.run_ensemble(ensemble, 1), 1, warm=few not in accumulators_of_runs)
        accumulators_of_runs[few] = (
            driver.run_ensemble(ensemble, 1) if few not in accumulators_of_runs else accumulators_of_runs[few]
        )
        times[few] = min(times[few], timing.seconds)
    for name in accumulators_of_runs[False].dtype.names:
        np.testing.assert_array_equal(
            accumulators_of_runs[True][name], accumulators_of_runs[False][name], err_msg=name
        )
    steps = float(accumulators_of_runs[False]["steps"].sum())
    return {
        "modes": modes,
        "early": early,
        "runs": ensemble.size,
        "modes_wide": 1e9 * times[False] / steps,
        "runs_wide": 1e9 * times[True] / steps,
        "ratio": times[False] / times[True],
    }
