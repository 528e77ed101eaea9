"""What was tried for the kernel, measured again: splittings, step lengths, and products of sixteen by sixteen."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from benchmarks.cases import Case, model_of
from benchmarks.report import save, table
from benchmarks.rhs import aligned
from benchmarks.timing import measure
from snapbeam.simulation.dataset import joined
from snapbeam.solver.cpu import driver as cpu_engine
from snapbeam.solver.cpu.memory import pack
from snapbeam.solver.cpu.mode_lanes import tension_rows
from snapbeam.solver.splitting import COMPOSITIONS, TURNS, Composition
from snapbeam.solver.step_size import Plan
from snapbeam.solver.structure import structure_of

__all__ = ["run"]

_Array = NDArray[np.float64]
_POINT = (1.21, 0.18)
_CONTACT_STEP = 12.5e-6
"""Longest step in contact, s, where the flight step is longer."""


def _splitting(flow: list[float], kick: list[float]) -> Composition:
    stages = len(flow)
    distinct = np.minimum(np.arange(stages), stages - 1 - np.arange(stages)).astype(np.int64)
    elapsed = np.zeros(TURNS)
    elapsed[1 : stages + 1] = np.cumsum(flow)
    elapsed[stages] = 1.0
    return Composition(np.array(flow), np.array(kick), elapsed, distinct)


def _lobatto(points: int) -> Composition:
    """Kicks at the nodes and with the weights of Gauss-Lobatto: SBAB_n of Laskar and Robutel (2001)."""
    if points == 4:
        nodes, weights = [-1.0, -math.sqrt(0.2), math.sqrt(0.2), 1.0], [1 / 12, 5 / 12, 5 / 12, 1 / 12]
    else:
        inner = math.sqrt(3 / 7)
        nodes, weights = [-1.0, -inner, 0.0, inner, 1.0], [1 / 20, 49 / 180, 16 / 45, 49 / 180, 1 / 20]
    return _splitting([float(gap) for gap in 0.5 * np.diff(nodes)], weights)


_SPLITTINGS: dict[str, tuple[Composition, tuple[float, ...]]] = {
    "Strang": (_splitting([1.0], [0.5, 0.5]), (6e-6, 8e-6, 12e-6)),
    "SBAB_3": (_lobatto(4), (25e-6, 35e-6, 50e-6)),
    "SBAB_4": (_lobatto(5), (25e-6, 35e-6, 50e-6)),
    "SRKN_6^b": (COMPOSITIONS[4], (35e-6, 50e-6, 70e-6)),
    "SRKN_11^b": (COMPOSITIONS[6], (50e-6, 70e-6, 100e-6)),
}
_STEPS = (40e-6, 45e-6, 50e-6, 55e-6, 60e-6, 65e-6, 70e-6, 75e-6, 80e-6, 87e-6, 100e-6)


def run(folder: Path, quick: bool) -> None:
    """Measure and write ``tried``."""
    case = Case(32, *_POINT)
    splittings = [
        _splitting_record(case, name, composition, step, 2 if quick else 7)
        for name, (composition, steps) in _SPLITTINGS.items()
        for step in steps
    ]
    energy_errors = [_energy_error(step, 20 if quick else 200) for step in _STEPS]
    products = _products()
    text = table(
        ("splitting", "kicks a step", "step, us", "e5", "ms per 200 cycles"),
        [
            [
                r["splitting"],
                r["kicks"],
                f"{1e6 * r['step']:.3g}",
                f"{r['e5']:.0e}",
                f"{r['milliseconds']:.3g}",
            ]
            for r in splittings
        ],
    )
    text += "\n" + table(
        ("step of SRKN_6^b, us", "energy residual over gross work"),
        [[f"{1e6 * r['step']:.3g}", f"{r['residual']:.0e}"] for r in energy_errors],
    )
    text += "\n" + table(
        ("product of two 16 x 16 blocks with a vector", "ns"),
        [[name, f"{value:.3g}"] for name, value in products.items()],
    )
    save(
        folder,
        "tried",
        quick,
        {"splittings": splittings, "energy_errors": energy_errors, "products": products},
        text,
    )


def _splitting_record(
    case: Case, name: str, composition: Composition, step: float, repeats: int
) -> dict[str, Any]:
    key = 100 + list(_SPLITTINGS).index(name)
    min_contact_halvings = max(0, round(math.log2(step / _CONTACT_STEP)))
    plan = Plan(key, step, min_contact_halvings, min_contact_halvings + 3)
    COMPOSITIONS[key] = composition
    try:
        ensemble = case.ensemble(plan, 200)
        timing = measure(lambda: cpu_engine.run_ensemble(ensemble, 1), repeats)
        error = case.error(case.displacement(plan))
    finally:
        del COMPOSITIONS[key]
    return {
        "splitting": name,
        "kicks": composition.flow.size,
        "step": step,
        "e5": error,
        "milliseconds": 1e3 * timing.seconds,
    }


def _energy_error(step: float, cycles: int) -> dict[str, float]:
    """Greatest residual of the energy of a run over its gross work, the shaker's transfers without sign."""
    worst = 0.0
    for point in (_POINT, (1.625, 0.3), (0.7, 0.4)):
        case = Case(32, *point)
        ensemble = case.ensemble(case.default_plan()._replace(step=step), cycles)
        end = float(ensemble.runs["tick"][0] * ensemble.runs["end"][0])
        times = np.linspace(0.0, end, 50 * cycles + 1)
        recorded = joined(list(cpu_engine.record(ensemble, times, False)))
        beam, contact, work, dissipated = recorded.values[:, 2:6].T
        residual = beam + contact + dissipated - work
        worst = max(
            worst,
            float(np.abs(residual - residual[0]).max() / recorded.accumulators_of_runs["gross_work"][0]),
        )
    return {"step": step, "residual": worst}


def _products() -> dict[str, float]:
    packed = pack(structure_of(model_of(32), "below"))
    layout, blocks = packed.layout, packed.blocks
    work, size = layout.work, layout.size
    full = np.zeros((2, 16, 16))
    strips = packed.memory[layout.tension : layout.tension + 512].reshape(2, 16, 16)
    full[:] = strips

    def strict(times, g, x, out):  # type: ignore[no-untyped-def]
        total = 0.0
        for i in range(times):
            x[0, 0] += 1e-30 * i
            for b in range(2):
                for row in range(16):
                    s = 0.0
                    for column in range(16):
                        s += g[b, row, column] * x[b, column]
                    out[b, row] = s
            total += out[0, 0]
        return total

    @njit(error_model="numpy")
    def explicit(times: int, memory: _Array) -> float:
        total = 0.0
        for i in range(times):
            memory[work] += 1e-30 * i
            gq, qr = tension_rows(memory, blocks, layout, work, work + size)
            total += gq + qr
        return total

    times, x, out = 20_000, np.full((2, 16), 1e-6), np.empty((2, 16))
    plain, fast = njit(strict), njit(strict, fastmath=True)
    found = {
        "Numba loops, strict": measure(lambda: plain(times, full, x, out), 7).seconds,
        "Numba loops, fastmath": measure(lambda: fast(times, full, x, out), 7).seconds,
    }
    for words, shift in (
        ("eight-wide registers, aligned (with both sums)", 0),
        ("the same, memory off by 8 bytes", 1),
    ):
        memory = aligned(work + 2 * size + 8)[shift : shift + work + 2 * size]
        memory[:work] = packed.memory[:work]
        memory[work : work + size] = 1e-6
        found[words] = measure(lambda memory=memory: explicit(times, memory), 7).seconds
    return {name: 1e9 * seconds / times for name, seconds in found.items()}
