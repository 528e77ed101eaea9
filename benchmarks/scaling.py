"""How time grows with the number of runs and with the number of modes."""

from __future__ import annotations

import resource
import time
from pathlib import Path
from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from benchmarks.cases import Case, model_of
from benchmarks.charts import scaling_chart
from benchmarks.ensemble import ensemble_of, sample
from benchmarks.report import save, table
from benchmarks.rhs import aligned
from benchmarks.timing import measure
from snapbeam.model.buckling_modes import BucklingModes
from snapbeam.solver.cpu import driver as cpu_engine
from snapbeam.solver.cpu.memory import pack
from snapbeam.solver.cpu.mode_lanes import acceleration_rows, tension_rows
from snapbeam.solver.physics import tension_factors
from snapbeam.solver.simd import WIDTH, fma, lanes_sum, load, splat, store
from snapbeam.solver.splitting import COMPOSITIONS
from snapbeam.solver.structure import structure_of

__all__ = ["run"]

_Array = NDArray[np.float64]
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
        (
            "modes",
            "ms per 200 cycles",
            "flight step, us",
            "ns per kick",
            "acceleration: rank one, undamped, ns",
            "modal, any modal damping, ns",
            "flops rank one",
            "flops modal",
        ),
        [
            [
                r["modes"],
                f"{r['milliseconds']:.3g}",
                f"{1e6 * r['step']:.3g}",
                f"{r['nanoseconds_per_kick']:.3g}",
                f"{r['rank_one_nanoseconds']:.3g}",
                f"{r['modal_nanoseconds']:.3g}",
                r["rank_one_flops"],
                r["modal_flops"],
            ]
            for r in modes
        ],
    )
    data = {"runs": runs, "modes": modes}
    save(folder, "scaling", quick, data, text)
    scaling_chart(data, folder / "scaling.png")


def _peak_mib() -> float:
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0


def _trajectories(size: int) -> dict[str, Any]:
    cpu_engine.run_ensemble(ensemble_of(1, sample(10), False, _CYCLES))
    before = _peak_mib()
    begun = time.perf_counter()
    cpu_engine.run_ensemble(ensemble_of(1, sample(size), False, _CYCLES))
    seconds = time.perf_counter() - begun
    return {"runs": size, "microseconds": 1e6 * seconds / size, "growth_mib": _peak_mib() - before}


def _modes(count: int, repeats: int) -> dict[str, Any]:
    case = Case(count, 1.21, 0.18)
    plan = case.default_plan()
    ensemble = case.ensemble(plan, 200)
    timing = measure(lambda: cpu_engine.run_ensemble(ensemble, 1), repeats)
    accumulators_of_runs = cpu_engine.run_ensemble(ensemble, 1)
    kicks = int(accumulators_of_runs["steps"][0]) * COMPOSITIONS[plan.order].flow.size
    rank_one, modal = _acceleration_times(count)
    odd, even = (count + 1) // 2, count // 2
    return {
        "modes": count,
        "milliseconds": 1e3 * timing.seconds,
        "spread": timing.spread,
        "step": plan.step,
        "nanoseconds_per_kick": 1e9 * timing.seconds / kicks,
        "rank_one_nanoseconds": rank_one,
        "modal_nanoseconds": modal,
        "rank_one_flops": 9 * count,
        "modal_flops": 2 * (odd**2 + even**2) + 7 * count,
    }


def _acceleration_times(count: int) -> tuple[float, float]:
    """ns of one acceleration without damping: by the rank-one mass matrix, and in linear modes."""
    model = model_of(count)
    assert model.beam is not None
    gamma, inertia = model.nonlinear_stiffness, 1.0 / model.beam.mass_per_length
    packed = pack(structure_of(model, "below"))
    layout, blocks = packed.layout, packed.blocks
    size, work = layout.size, layout.work
    memory = aligned(work + 3 * size)
    memory[:work] = packed.memory[:work]
    memory[work : work + size] = 1e-6
    q, r, p = work, work + size, work + 2 * size

    @njit(error_model="numpy")
    def modal(times: int, memory: _Array) -> float:
        total = 0.0
        for i in range(times):
            memory[q] += 1e-30 * i
            gq, qr = tension_rows(memory, blocks, layout, q, r)
            along_g, along_r = tension_factors(gamma, gq, qr)
            acceleration_rows(memory, layout, along_g, along_r, r, p)
            total += memory[p]
        return total

    # the same in y = alpha/k: odd modes, then even ones, each parity padded to whole registers
    k = BucklingModes(model.beam.length, count).wavenumber
    odd, even = (count + 1) // 2, count // 2
    half = -(-odd // WIDTH) * WIDTH
    whole = half + -(-even // WIDTH) * WIDTH
    flat = aligned(4 * whole)
    for begin, chosen in ((0, slice(0, None, 2)), (half, slice(1, None, 2))):
        wave = k[chosen] ** 2
        for row, values in enumerate(
            (wave, wave * np.asarray(model.stiffness)[chosen], np.full(wave.size, 1e-6))
        ):
            flat[row * whole + begin : row * whole + begin + wave.size] = values
    c_odd, c_even = 2.0 / (1.0 + 2.0 * odd), (2.0 / 3.0) / (1.0 + 2.0 / 3.0 * even)
    stiff, y, a = whole, 2 * whole, 3 * whole

    @njit(error_model="numpy")
    def parity(flat: _Array, begin: int, end: int, c: float, stretch: float) -> None:
        total = splat(0.0)
        for j in range(begin, end, WIDTH):
            pull = fma(stretch, load(flat, j), load(flat, stiff + j)) * load(flat, y + j)
            store(flat, a + j, pull)
            total = total + pull
        mean = c * lanes_sum(total)
        for j in range(begin, end, WIDTH):
            store(flat, a + j, inertia * (mean - load(flat, a + j)))

    @njit(error_model="numpy")
    def rank_one(times: int, flat: _Array) -> float:
        total = 0.0
        for i in range(times):
            flat[y] += 1e-30 * i
            squares = splat(0.0)
            for j in range(0, whole, WIDTH):
                here = load(flat, y + j)
                squares = fma(load(flat, j) * here, here, squares)
            stretch = gamma * lanes_sum(squares)
            parity(flat, 0, half, c_odd, stretch)
            parity(flat, half, whole, c_even, stretch)
            total += flat[a]
        return total

    times = 20_000
    first = measure(lambda: rank_one(times, flat), 7)
    second = measure(lambda: modal(times, memory), 7)
    return 1e9 * first.seconds / times, 1e9 * second.seconds / times
