"""snapbeam over a C++ program of fixed steps, written for the paper's beam alone: N = 1, 8 and 32, in turns.

The points are those of ``rivals``.  A one-mode program integrates eight runs in a register.  The program is timed at steps of
16 us and at the longest steps that keep e5 at or below 1e-3 at every well-conditioned point.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from benchmarks.cases import Case
from benchmarks.ensemble import ensemble_of
from benchmarks.peers import methods
from benchmarks.report import save, table
from benchmarks.rivals import LIMIT, WELL, chosen_points
from benchmarks.timing import measure
from snapbeam.model import default_values
from snapbeam.solver import native

__all__ = ["run"]

_STEP = 16e-6


def run(folder: Path, quick: bool) -> None:
    """Measure and write ``fixed_steps``."""
    found = methods("fixed_steps")
    if isinstance(found, str):
        print(found, flush=True)
        return
    from benchmarks.peers.fixed_steps_peer import Program

    (method,) = found
    cycles, repeats = (4, 1) if quick else (default_values.CYCLES, 5)
    records, rows = [], []
    for modes, count in ((1, 48), (8, 48), (32, 12)):
        points, _ = chosen_points(8 if quick else count, cycles)
        cases = [
            Case(modes, float(omega), float(speed))
            for omega, speed in zip(points["frequency_ratio"], points["velocity_amplitude"], strict=True)
        ]
        fair = [case for case in cases if case.conditioning <= WELL]
        own = np.array([case.error(case.displacement(case.default_plan())) for case in fair])
        errors = {
            step: np.array([case.error(method.prepare(case, step).sample(case.times)) for case in fair])
            for step in method.tolerances
        }
        good = [step for step, found in errors.items() if found.max() <= LIMIT]
        ensemble = ensemble_of(modes, points, False, cycles)
        native.run_ensemble(ensemble, 1)
        for step in dict.fromkeys((_STEP, good[0] if good else min(errors))):
            program = Program(cases, step)
            theirs, ours = [], []
            for _ in range(repeats):
                theirs.append(measure(lambda: program.advance(cycles), 1, warm=False).seconds)  # noqa: B023
                ours.append(measure(lambda: native.run_ensemble(ensemble, 1), 1, warm=False).seconds)  # noqa: B023
            record = {
                "modes": modes, "step": step, "runs": len(cases), "well_conditioned": len(fair),
                "program_error": [float(np.median(errors[step])), float(errors[step].max())],
                "error": [float(np.median(own)), float(own.max())],
                "program_seconds": min(theirs) / len(cases), "seconds": min(ours) / len(cases),
            }  # fmt: skip
            records.append(record)
            rows.append([
                str(modes), f"{1e6 * step:g}", *("{:.0e}, {:.0e}".format(*record[name]) for name in ("program_error", "error")),
                f"{1e3 * record['program_seconds']:.2g}", f"{1e3 * record['seconds']:.2g}",
                f"{record['seconds'] / record['program_seconds']:.2g}",
            ])  # fmt: skip
            print(*rows[-1], flush=True)
    head = (
        "N", "step of the program, us", "its e5: median, maximum", "snapbeam's e5", "ms per run, program", "snapbeam", "ratio",
    )  # fmt: skip
    text = table(head, rows)
    text += f"\n{cycles} cycles; one core; early termination off; e5 at the well-conditioned points.\n"
    save(folder, "fixed_steps", quick, {"cycles": cycles, "limit": LIMIT, "records": records}, text)
