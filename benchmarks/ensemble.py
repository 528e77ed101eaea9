"""Throughput over a random sample of the plane of Fig. 6, per run and core."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.cases import CONTACT, Case, model_of
from benchmarks.peers import methods
from benchmarks.report import save, table
from benchmarks.timing import Timing, measure
from snapbeam import paper
from snapbeam.core.codes import RunStatus
from snapbeam.engines.columns import Counts, Numbers, Reals, Ticks
from snapbeam.engines.cpu import driver as cpu_engine
from snapbeam.engines.ensemble import Ensemble, make_ensemble
from snapbeam.engines.plan import plan_steps

__all__ = ["run", "sample"]

_SEED = 20240118
_PEER_CYCLES = 20
_PEER_TOLERANCE = 1e-6


def sample(size: int) -> dict[str, np.ndarray]:
    """Points of the plane: Omega in 0.1 to 4, V in 0 to 0.65, uniform, seed fixed."""
    random = np.random.default_rng(_SEED)
    return {
        "frequency_ratio": random.uniform(0.1, 4.0, size),
        "velocity_amplitude": random.uniform(0.0, 0.65, size),
        "location": np.full(size, paper.LOCATION),
    }


def ensemble_of(
    modes: int, points: dict[str, np.ndarray], early: bool, cycles: int = paper.CYCLES
) -> Ensemble:
    """The runs of *points* at level "map"."""
    model = model_of(modes)
    return make_ensemble(
        model,
        CONTACT,
        plan_steps(model, CONTACT),
        **points,
        side="below",
        cycles=cycles,
        reference_freq=model.reference_freq,
        early_decision=early,
    )


def run(folder: Path, quick: bool) -> None:
    """Measure and write ``ensemble``."""
    records = []
    for modes, size in ((32, 24 if quick else 400), (1, 200 if quick else 2000)):
        for early in (False, True):
            records.append(_throughput(modes, size, early, 1 if quick else 3))
    data: dict[str, Any] = {"seed": _SEED, "cycles": paper.CYCLES, "records": records}
    data["scipy"] = _scipy(2 if quick else 6, records)
    rows = [
        [
            r["modes"],
            "on" if r["early_decision"] else "off",
            r["runs"],
            f"{r['milliseconds']:.3g} (+{100 * r['spread']:.0f} %)",
            f"{100 * r['decided']:.0f} %",
            f"{100 * r['saved']:.0f} %",
        ]
        for r in records
    ]
    text = table(
        ("modes", "early decision", "runs", "ms per run and core", "runs decided", "simulated time saved"),
        rows,
    )
    s = data["scipy"]
    text += (
        f"\nscipy DOP853 (compiled right-hand side, tolerance {_PEER_TOLERANCE:g}) on {s['runs']} points, "
        f"{_PEER_CYCLES} cycles extrapolated to {paper.CYCLES}: {s['milliseconds']:.4g} ms per run, "
        f"{s['ratio']:.4g} times snapbeam's {s['snapbeam_milliseconds']:.3g} ms on the same points with "
        f"early decision, {s['ratio_without']:.4g} times without.\n"
    )
    save(folder, "ensemble", quick, data, text)


def _time(ensemble: Ensemble, repeats: int) -> tuple[Timing, np.ndarray, np.ndarray]:
    timing = measure(lambda: cpu_engine.run_ensemble(ensemble, threads=1), repeats)
    counts, numbers = cpu_engine.run_ensemble(ensemble, threads=1)
    return timing, counts, numbers


def _throughput(modes: int, size: int, early: bool, repeats: int) -> dict[str, Any]:
    ensemble = ensemble_of(modes, sample(size), early)
    timing, counts, numbers = _time(ensemble, repeats)
    whole = ensemble.reals[:, Reals.TICK] * ensemble.ticks[:, Ticks.END]
    decided = counts[:, Counts.STATUS] == RunStatus.DECIDED
    lasted = np.where(decided, numbers[:, Numbers.DECIDED_AT], whole)
    work = ensemble.work
    return {
        "modes": modes,
        "runs": size,
        "early_decision": early,
        "milliseconds": 1e3 * timing.seconds / size,
        "spread": timing.spread,
        "decided": float(decided.mean()),
        "saved": float(1.0 - np.sum(work * lasted / whole) / work.sum()),
    }


def _scipy(size: int, records: list[dict[str, Any]]) -> dict[str, Any]:
    """scipy on a few points, evenly spread over the frequencies of the sample, and snapbeam on the same."""
    points = sample(records[0]["runs"])
    order = np.argsort(points["frequency_ratio"])
    chosen = order[((np.arange(size) + 0.5) / size * order.size).astype(int)]
    few = {name: values[chosen] for name, values in points.items()}
    ours = {early: _time(ensemble_of(32, few, early), 3)[0].seconds / size for early in (False, True)}
    found = methods("scipy")
    assert not isinstance(found, str)
    method = next(m for m in found if m.name == "scipy DOP853")
    seconds = 0.0
    for omega, speed in zip(few["frequency_ratio"], few["velocity_amplitude"], strict=True):
        case = Case(32, float(omega), float(speed))
        solver = method.prepare(case, _PEER_TOLERANCE)
        solver.advance(0.1 * case.period)
        timing = measure(lambda: solver.advance(_PEER_CYCLES * case.period), 1, warm=False)  # noqa: B023
        seconds += timing.seconds * paper.CYCLES / _PEER_CYCLES
    return {
        "runs": size,
        "milliseconds": 1e3 * seconds / size,
        "snapbeam_milliseconds": 1e3 * ours[True],
        "snapbeam_milliseconds_without": 1e3 * ours[False],
        "ratio": seconds / size / ours[True],
        "ratio_without": seconds / size / ours[False],
    }
