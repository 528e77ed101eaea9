"""The CUDA engine on this machine's device: right, how fast, how it scales, and the map of Fig. 7B.

    python -m benchmarks.gpu                      everything, on a real device (about ten minutes)
    python -m benchmarks.gpu --only map           one part of: conformance throughput host scaling fig_7b
    NUMBA_ENABLE_CUDASIM=1 python -m benchmarks.gpu --smoke
                                                  a tiny version of every part, in Numba's simulator

Prints every row and writes it to gpu.json (``-o``) as soon as it is measured.  Times are of the whole call of
the engine, data moved to and from the device included; the kernel's compilation is timed by itself.
"""

from __future__ import annotations

import argparse
import json
import math
import os
import platform
import sys
import time
import warnings
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any, Protocol

import numpy as np
from numba import NumbaPerformanceWarning

import snapbeam as sb
from snapbeam.model import default_values
from snapbeam.solver.assemble import make_ensemble
from snapbeam.solver.cpu import driver as cpu_engine
from snapbeam.solver.cuda import driver as cuda_engine
from snapbeam.solver.cuda.driver import Options
from snapbeam.solver.cuda.layout import device_structure
from snapbeam.solver.ensemble import Ensemble
from snapbeam.solver.splitting import COMPOSITIONS
from snapbeam.solver.statistics import statistics_of
from snapbeam.util.status_codes import ResponseClass

CONTACT = sb.HertzContact(stiffness=4e8)
LOCATION = 1 / 2.1
PAIRS = ((0.3, 0.2), (0.625, 0.1), (1.21, 0.05), (1.21, 0.18), (1.625, 0.3), (3.0, 0.4))
COMPARED = ("max_displacement", "min_displacement", "gross_work", "contact_time_fraction")
COUNTED = ("steps", "zero_crossings", "impacts")
SEED = 20240118
# Double-precision multiply-adds a multiprocessor ends per clock, by compute capability; 2 elsewhere.
FP64_LANES = {(6, 0): 32, (7, 0): 32, (8, 0): 32, (9, 0): 64, (10, 0): 64}


class Add(Protocol):
    """Print and keep a row of the table *title*."""

    def __call__(self, title: str, /, **row: Any) -> None: ...


def model_of(modes: int) -> sb.ReducedModel:
    """The paper's beam."""
    return sb.ReducedModel.from_beam(default_values.BEAM, modes=modes, damping_ratio=0.005)


def ensemble_of(
    modes: int, ratio: Any, velocity: Any, cycles: int, *, early_termination: bool = False
) -> Ensemble:
    """Runs at points of the plane of frequency ratio and velocity amplitude."""
    shaker = sb.Shaker(frequency_ratio=1.0, velocity_amplitude=0.1, location=LOCATION)
    points = {
        "drive.frequency_ratio": np.asarray(ratio, float),
        "drive.velocity_amplitude": np.asarray(velocity, float),
    }
    return make_ensemble(
        sb.System(model_of(modes), contacts=[sb.Contact(CONTACT, shaker)]),
        sb.Integration(cycles=cycles, early_termination=early_termination),
        points,
    )


def sample(runs: int, slowest: float = 0.1) -> tuple[Any, Any]:
    """Random points of the plane of Fig. 6, from a frequency ratio on."""
    draw = np.random.default_rng(SEED)
    return draw.uniform(slowest, 4.0, runs), draw.uniform(0.01, 0.65, runs)


def timed(function: Callable[[], Any]) -> tuple[float, Any]:
    """Seconds and result."""
    began = time.perf_counter()
    result = function()
    return time.perf_counter() - began, result


def _options(warps: int | None = None) -> Options:
    return Options(most_blocks=1, fewest_threads=1) if cuda_engine.simulated() else Options(warps=warps)


def integrate(ensemble: Ensemble) -> tuple[float, dict[str, Any]]:
    """Seconds and statistics of an integration on the device; the kernel must have been compiled before."""
    seconds, accumulators_of_runs = timed(lambda: cuda_engine.run_ensemble(ensemble, options=_options()))
    return seconds, measured(ensemble, accumulators_of_runs)


def measured(ensemble: Ensemble, accumulators_of_runs: Any) -> dict[str, Any]:
    """Statistics of runs, and their steps."""
    return {**statistics_of(ensemble, accumulators_of_runs), "steps": accumulators_of_runs["steps"]}


def device_facts() -> dict[str, Any]:
    """What the times were measured on."""
    import numba
    import numba_cuda
    from numba import cuda

    facts: dict[str, Any] = {
        "snapbeam": sb.__version__,
        "numba": numba.__version__,
        "numba_cuda": numba_cuda.__version__,
        "python": platform.python_version(),
        "simulated": cuda_engine.simulated(),
    }
    if cuda_engine.simulated():
        return facts
    device = cuda.get_current_device()
    lanes = FP64_LANES.get(tuple(device.compute_capability), 2)
    clock = device.CLOCK_RATE * 1e3
    name = device.name.decode() if isinstance(device.name, bytes) else device.name
    return facts | {
        "device": name,
        "compute_capability": list(device.compute_capability),
        "multiprocessors": device.MULTIPROCESSOR_COUNT,
        "clock_hz": clock,
        "fp64_limit_flops": 2.0 * lanes * device.MULTIPROCESSOR_COUNT * clock,
    }


def flops_per_step(ensemble: Ensemble) -> float:
    """Operations no flight step gets by without: tension product, sums, kicks and flows of its stages."""
    structure = device_structure(ensemble)
    coupled = 2.0 * np.count_nonzero(structure.coupling)
    modes = structure.order.size
    return float(COMPOSITIONS[ensemble.order].flow.size * (coupled + 16.0 * modes))


def conformance(smoke: bool, add: Add) -> None:
    """Trajectories against the CPU engine while chaos lets them be compared, then class shares."""
    for modes in (1,) if smoke else (1, 2, 8, 32, 128):
        for ratio, velocity in PAIRS[5:] if smoke else PAIRS:
            ensemble = ensemble_of(modes, [ratio], [velocity], 1)
            _, found = integrate(ensemble)
            expected = measured(ensemble, cpu_engine.run_ensemble(ensemble))
            error = max(abs(float(found[name][0] / expected[name][0]) - 1.0) for name in COMPARED)
            same = all(int(found[name][0]) == int(expected[name][0]) for name in COUNTED)
            add(
                "first_cycle",
                modes=modes, frequency_ratio=ratio, velocity_amplitude=velocity,
                impacts=int(found["impacts"][0]), same_counts=same, error=error, right=same and error < 1e-6,
            )  # fmt: skip
    if smoke:
        return
    ratio, velocity = (x.ravel() for x in np.meshgrid(np.linspace(0.1, 4, 40), np.linspace(0.01, 0.65, 26)))
    ensemble = ensemble_of(32, ratio, velocity, 200, early_termination=True)
    shares = []
    for found in (integrate(ensemble)[1], statistics_of(ensemble, cpu_engine.run_ensemble(ensemble))):
        classes = found["response_class"]
        shares.append([float(np.mean(classes == kind)) for kind in ResponseClass])
    for kind, gpu, cpu in zip(ResponseClass, *shares, strict=True):
        middle = 0.5 * (gpu + cpu)
        sigma = math.sqrt(2.0 * middle * (1.0 - middle) / ratio.size)
        add(
            "class_shares",
            response_class=kind.label, runs=ratio.size, cuda=gpu, cpu=cpu, standard_error=sigma,
            right=abs(gpu - cpu) <= 3.0 * sigma + 1e-12,
        )  # fmt: skip


def throughput(smoke: bool, add: Add) -> None:
    """Runs of 200 cycles over the plane of Fig. 6: all cores of the host, then shares of the registers."""
    runs, cycles, modes = (2, 1, 1) if smoke else (4096, 200, 32)
    limit, slowest = device_facts().get("fp64_limit_flops"), 3.0 if smoke else 0.1
    for early in (False,) if smoke else (False, True):
        ensemble = ensemble_of(modes, *sample(runs, slowest), cycles, early_termination=early)
        flops = flops_per_step(ensemble)
        warm_up = ensemble_of(modes, [4.0], [0.1], 1, early_termination=early)
        host = 0.0
        for warps in (0, None) if smoke else (0, 8, 12, 16):  # 0: the CPU engine
            run = (
                cpu_engine.run_ensemble
                if warps == 0
                else partial(cuda_engine.run_ensemble, options=_options(warps))
            )
            compiling, _ = timed(partial(run, warm_up))
            seconds, found = timed(partial(run, ensemble))
            steps, host = float(found["steps"].sum()), seconds if warps == 0 else host
            add(
                "rows",
                early_termination=early, engine=f"{os.cpu_count()} cores" if warps == 0 else f"cuda, {warps} warps",
                compile_s=compiling, seconds=seconds, ms_per_run=1e3 * seconds / runs,
                steps_per_second=steps / seconds, host_over_this=host / seconds,
                share_of_fp64_limit=steps * flops / seconds / limit if limit and warps != 0 else math.nan,
            )  # fmt: skip


def host(smoke: bool, add: Add) -> None:
    """Processor time of one core for the runs of ``scaling``, a sample of them; needs no device."""
    for modes in (1,) if smoke else (1, 2, 4, 8, 16, 32, 64, 128):
        cpu_engine.run_ensemble(ensemble_of(modes, [4.0], [0.1], 1), threads=1)
        ensemble = ensemble_of(modes, *sample(1 if smoke else 64, 3.0 if smoke else 0.1), 1 if smoke else 50)
        began = time.process_time()
        steps = float(measured(ensemble, cpu_engine.run_ensemble(ensemble, threads=1))["steps"].sum())
        add(
            "by_modes",
            modes=modes,
            runs=ensemble.size,
            ns_per_step=1e9 * (time.process_time() - began) / steps,
        )


def scaling(smoke: bool, add: Add) -> None:
    """Time against the number of modes, and against the number of trajectories."""
    slowest = 3.0 if smoke else 0.1
    runs, cycles = (1, 1) if smoke else (8192, 50)
    for modes in (1,) if smoke else (1, 2, 4, 8, 16, 32, 64, 128):
        if not smoke:
            integrate(ensemble_of(modes, [2.0], [0.1], 1))
        seconds, found = integrate(ensemble_of(modes, *sample(runs, slowest), cycles))
        per_step = 1e9 * seconds / float(found["steps"].sum())
        add("by_modes", modes=modes, seconds=seconds, ms_per_run=1e3 * seconds / runs, ns_per_step=per_step)
    for count in (1, 2) if smoke else (1_000, 10_000, 100_000, 1_000_000):
        seconds, _ = integrate(ensemble_of(1 if smoke else 32, *sample(count, slowest), 1 if smoke else 2))
        add("by_runs", runs=count, seconds=seconds, us_per_run=1e6 * seconds / count)


def fig_7b(smoke: bool, add: Add) -> None:
    """Maps of the plane of Fig. 7B through the public interface: all its points decided early, an eighth whole."""
    cycles, modes = (1, 1) if smoke else (1000, 32)
    system = sb.System(
        model_of(modes),
        contacts=[
            sb.Contact(CONTACT, sb.Shaker(frequency_ratio=1.0, velocity_amplitude=0.1, location=LOCATION))
        ],
    )
    if not smoke:
        integrate(ensemble_of(modes, [2.0], [0.1], 1))
    for early, columns, rows in ((False, 2, 1),) if smoke else ((True, 400, 130), (False, 100, 65)):
        axes = {
            "frequency_ratio": np.linspace(3.0 if smoke else 0.1, 4.0, columns),
            "velocity_amplitude": np.linspace(0.005, 0.65, rows) if rows > 1 else [0.3],
        }
        integration = sb.Integration(cycles=cycles, engine="cuda", early_termination=early)
        seconds, dataset = timed(
            lambda axes=axes, integration=integration: sb.sweep(system, axes, integration)
        )
        classes = np.asarray(dataset["response_class"])
        shares = {kind.label: float(np.mean(classes == kind)) for kind in ResponseClass}
        add("maps", early_termination=early, points=classes.size, cycles=cycles, seconds=seconds, **shares)


def main(arguments: list[str] | None = None) -> int:
    """Measure, print, write; 0 if nothing that was compared differs."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("-o", "--output", type=Path, default=Path("gpu.json"))
    parser.add_argument("--smoke", action="store_true", help="a tiny version, for the simulator")
    parser.add_argument("--only", choices=("conformance", "throughput", "host", "scaling", "fig_7b"))
    options = parser.parse_args(arguments)
    reason = cuda_engine.refusal(1)
    if reason is not None and options.only != "host":
        print(f"no benchmark of the CUDA engine here: {reason}", file=sys.stderr)
        return 2
    if options.only != "host" and cuda_engine.simulated() and not options.smoke:
        print("in Numba's simulator only --smoke ends in reasonable time", file=sys.stderr)
        return 2
    if options.smoke:
        sys.setswitchinterval(1e-5)  # the simulator's threads wait for each other at every barrier
    warnings.simplefilter("ignore", NumbaPerformanceWarning)
    results: dict[str, Any] = {"facts": device_facts() if reason is None else {}}
    print(results["facts"])
    right = True

    def add(part: str, title: str, **row: Any) -> None:
        nonlocal right
        rows = results.setdefault(part, {}).setdefault(title, [])
        if not rows:
            print(f"\n{part}: {title}\n  " + "  ".join(f"{name:>12s}" for name in row))
        rows.append(row)
        right &= bool(row.get("right", True))
        cells = ((f"{x:.4g}" if isinstance(x, float) else str(x), len(name)) for name, x in row.items())
        print("  " + "  ".join(text.rjust(max(width, 12)) for text, width in cells), flush=True)
        options.output.write_text(json.dumps(results, indent=2), encoding="utf-8")

    for part in (conformance, throughput, host, scaling, fig_7b):
        if options.only in (None, part.__name__):
            part(options.smoke, partial(add, part.__name__))
    return 0 if right else 1


if __name__ == "__main__":
    sys.exit(main())
