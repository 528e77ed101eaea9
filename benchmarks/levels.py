"""The two named levels: their error over random points of the plane of Fig. 6, for few modes and many."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.cases import REQUEST_POINTS, Case
from benchmarks.report import save, table

__all__ = ["run"]

_SEED = 5
_MODES = (1, 2, 4, 8, 16, 32, 64, 128)
_RANDOM = 14
_PROMISED = {"standard": 1e-3, "standard, half the step length": 1e-3, "reference": 1e-8}
_WELL = 1e-10
"""Response to a relative change of V by 1e-13, of the buckling level, up to which a point is well-conditioned: the same
as for the random beams of tests/conformance."""


def _points(count: int) -> list[tuple[float, float]]:
    """The points of the requests, and random ones; seed fixed."""
    random = np.random.default_rng(_SEED)
    frequency, velocity = random.uniform(0.4, 4.0, _RANDOM), random.uniform(0.05, 0.65, _RANDOM)
    drawn = zip(frequency.round(3), velocity.round(3), strict=True)
    return [*REQUEST_POINTS, *((float(a), float(b)) for a, b in drawn)][:count]


def run(folder: Path, quick: bool) -> None:
    """Measure and write ``levels``."""
    points = _points(3 if quick else len(REQUEST_POINTS) + _RANDOM)
    records: list[dict[str, Any]] = []
    for modes in (1, 8) if quick else _MODES:
        for point in points:
            case = Case(modes, *point)
            for level in _PROMISED:
                name, halved, _ = level.partition(", half")
                plan = case.default_plan(name).scaled(0.5 if halved else 1.0)
                error = case.error(case.displacement(plan))
                records.append(
                    {
                        "modes": modes,
                        "point": case.label,
                        "level": level,
                        "error": error,
                        "conditioning": case.conditioning,
                    }
                )
    save(folder, "levels", quick, {"seed": _SEED, "points": points, "records": records}, _words(records))


def _words(records: list[dict[str, Any]]) -> str:
    """The table: well-conditioned points apart from the others."""
    rows: list[list[object]] = []
    for modes in dict.fromkeys(r["modes"] for r in records):
        for level, promised in _PROMISED.items():
            here = [r for r in records if (r["modes"], r["level"]) == (modes, level)]
            fair = [r for r in here if r["conditioning"] <= _WELL]
            errors = np.array([r["error"] for r in fair])
            worst = sorted(fair, key=lambda r: -float(r["error"]))[:2]
            others = [r for r in here if r["conditioning"] > _WELL]
            rows.append(
                [
                    modes,
                    level,
                    f"{np.median(errors):.0e}",
                    f"{int((errors <= promised).sum())} of {len(fair)}",
                    ", ".join(f"{r['error']:.1e} at {r['point']}" for r in worst),
                    f"{sum(r['error'] <= promised for r in others)} of {len(others)}",
                ]
            )
    heads = ("modes", "level", "median e5", "within 1e-3 or 1e-8", "two largest", "ill-conditioned within the limit")
    count = len({r["point"] for r in records})
    return table(heads, rows) + (
        f"\n{count} points: those of the requests, and random ones. Well-conditioned are those at which the response "
        "to a relative change of V by 1e-13 stays below 1e-10; of the others, the share within the same limits. "
        'Measured against half the steps of level "reference", so that the errors of that level itself are known to '
        "about a sixtieth of them.\n"
    )
