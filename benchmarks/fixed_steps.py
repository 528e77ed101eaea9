"""snapbeam over a C++ program of fixed steps, written for the paper's beam alone: N = 1, 8 and 32, in turns.

The points are random ones of the plane of Fig. 6.  With one mode the program integrates 32 runs side by side, sorted by
length.  It is timed at steps of 16 us and at the longest steps that keep e5 at or below 1e-3 at every well-conditioned point.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from benchmarks.cases import Case
from benchmarks.ensemble import ensemble_of
from benchmarks.peers import methods
from benchmarks.report import save, table
from benchmarks.rivals import LIMIT, WELL
from benchmarks.timing import measure
from snapbeam.model import default_values
from snapbeam.solver import native

__all__ = ["run"]

_STEP = 16e-6
_SEED = 5
_JUDGED = 48
"""Points whose errors are measured."""


def run(folder: Path, quick: bool) -> None:
    """Measure and write ``fixed_steps``."""
    found = methods("fixed_steps")
    if isinstance(found, str):
        print(found, flush=True)
        return
    from benchmarks.peers.fixed_steps_peer import Program

    (method,) = found
    repeats, random = 1 if quick else 5, np.random.default_rng(_SEED)
    records, rows = [], []
    lengths = (4,) if quick else (default_values.CYCLES, 5)
    for modes, count in ((1, 480), (8, 48), (32, 24)):
        count = 8 if quick else count
        points = {
            "frequency_ratio": random.uniform(0.3, 3.9, count),
            "velocity_amplitude": random.uniform(0.03, 0.63, count),
            "location": np.full(count, default_values.LOCATION),
        }
        cases = [
            Case(modes, float(omega), float(speed))
            for omega, speed in zip(points["frequency_ratio"], points["velocity_amplitude"], strict=True)
        ]
        fair = [case for case in cases[:_JUDGED] if case.conditioning <= WELL]
        own = np.array([case.error(case.displacement(case.default_plan())) for case in fair])
        errors = {
            step: np.array([case.error(method.prepare(case, step).sample(case.times)) for case in fair])
            for step in method.tolerances
        }
        good = [step for step, found in errors.items() if found.max() <= LIMIT]
        for cycles in lengths if modes == 1 else lengths[:1]:
            ensemble = ensemble_of(modes, points, False, cycles)
            native.run_ensemble(ensemble, 1)
            for step in dict.fromkeys((_STEP, good[0] if good else min(errors))):
                program = Program(sorted(cases, key=lambda case: case.period), step)
                theirs, ours = [], []
                for _ in range(repeats):
                    theirs.append(measure(lambda: program.advance(cycles), 1, warm=False).seconds)  # noqa: B023
                    ours.append(measure(lambda: native.run_ensemble(ensemble, 1), 1, warm=False).seconds)  # noqa: B023
                record = {
                    "modes": modes, "cycles": cycles, "step": step, "runs": len(cases), "well_conditioned": len(fair),
                    "program_error": [float(np.median(errors[step])), float(errors[step].max())],
                    "error": [float(np.median(own)), float(own.max())],
                    "program_seconds": min(theirs) / len(cases), "seconds": min(ours) / len(cases),
                    "program_ns_per_step": 1e9 * min(theirs) / (cycles * sum(program.steps)),
                }  # fmt: skip
                records.append(record)
                rows.append([
                    str(modes), str(cycles), f"{1e6 * step:g}",
                    *("{:.0e}, {:.0e}".format(*record[name]) for name in ("program_error", "error")),
                    f"{record['program_ns_per_step']:.2g}", f"{1e3 * record['program_seconds']:.2g}",
                    f"{1e3 * record['seconds']:.2g}", f"{record['seconds'] / record['program_seconds']:.2f}",
                ])  # fmt: skip
                print(*rows[-1], flush=True)
    head = (
        "N", "cycles", "step of the program, us", "its e5: median, maximum", "snapbeam's e5", "ns per run and step, program",
        "ms per run, program", "snapbeam", "ratio",
    )  # fmt: skip
    text = table(head, rows)
    text += f"\n480, 48 and 24 runs; one core; early termination off; e5 at the well-conditioned points of the first {_JUDGED}.\n"
    save(folder, "fixed_steps", quick, {"limit": LIMIT, "seed": _SEED, "records": records}, text)
