"""The CUDA engine on this machine's device: right, how fast, how it scales, and the map of Fig. 7B.

    python -m benchmarks.gpu                      everything, on a real device (about ten minutes)
    python -m benchmarks.gpu --only map           one part of: conformance throughput scaling map
    NUMBA_ENABLE_CUDASIM=1 python -m benchmarks.gpu --smoke
                                                  a tiny version of every part, in Numba's simulator

Writes what it measured to gpu.json (``-o``) and prints it as tables.  Times are of the whole call of the
engine, data moved to and from the device included; the kernel's compilation is timed by itself.
"""

from __future__ import annotations

import argparse
import json
import math
import os
import platform
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

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
AIM_SECONDS = 60.0
# Double-precision multiply-adds a multiprocessor ends per clock, by compute capability; 2 elsewhere.
FP64_LANES = {(6, 0): 32, (7, 0): 32, (8, 0): 32, (9, 0): 64, (10, 0): 64}


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


def integrate(ensemble: Ensemble, warps: int | None = None) -> tuple[float, dict[str, Any]]:
    """Seconds and statistics of an integration on the device; the kernel must have been compiled before."""
    simulated = cuda_engine.simulated()
    options = Options(warps=warps) if not simulated else Options(most_blocks=1, fewest_threads=1)
    seconds, accumulators_of_runs = timed(lambda: cuda_engine.run_ensemble(ensemble, options=options))
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


def conformance(smoke: bool) -> dict[str, Any]:
    """Trajectories against the CPU engine while chaos lets them be compared, then class shares."""
    rows = []
    for modes in (1,) if smoke else (1, 2, 8, 32, 128):
        for ratio, velocity in PAIRS[5:] if smoke else PAIRS:
            ensemble = ensemble_of(modes, [ratio], [velocity], 1)
            _, found = integrate(ensemble)
            expected = measured(ensemble, cpu_engine.run_ensemble(ensemble))
            error = max(abs(float(found[name][0] / expected[name][0]) - 1.0) for name in COMPARED)
            same = all(int(found[name][0]) == int(expected[name][0]) for name in COUNTED)
            rows.append(
                {"modes": modes, "frequency_ratio": ratio, "velocity_amplitude": velocity,
                 "impacts": int(found["impacts"][0]), "same_counts": same, "error": error}
            )  # fmt: skip
    if smoke:
        return {"first_cycle": rows}
    ratio, velocity = (x.ravel() for x in np.meshgrid(np.linspace(0.1, 4, 40), np.linspace(0.01, 0.65, 26)))
    ensemble = ensemble_of(32, ratio, velocity, 200, early_termination=True)
    shares = []
    for found in (integrate(ensemble)[1], statistics_of(ensemble, cpu_engine.run_ensemble(ensemble))):
        classes = found["response_class"]
        shares.append([float(np.mean(classes == kind)) for kind in ResponseClass])
    table = []
    for kind, gpu, cpu in zip(ResponseClass, *shares, strict=True):
        middle = 0.5 * (gpu + cpu)
        sigma = math.sqrt(2.0 * middle * (1.0 - middle) / ratio.size)
        table.append(
            {"class": kind.label, "cuda": gpu, "cpu": cpu, "standard_error": sigma,
             "within_three": abs(gpu - cpu) <= 3.0 * sigma + 1e-12}
        )  # fmt: skip
    return {"first_cycle": rows, "class_shares": table, "runs": int(ratio.size)}


def throughput(smoke: bool, facts: dict[str, Any]) -> dict[str, Any]:
    """Runs of 200 cycles over the plane of Fig. 6: all cores of the host, then shares of the registers."""
    runs, cycles, modes = (2, 1, 1) if smoke else (16_384, 200, 32)
    rows, slowest = [], 3.0 if smoke else 0.1
    hosts = []
    for early in (False,) if smoke else (False, True):
        host = ensemble_of(modes, *sample(max(1, runs // 8), slowest), cycles, early_termination=early)
        cpu_engine.run_ensemble(ensemble_of(modes, [4.0], [0.1], 1, early_termination=early))
        seconds, found = timed(lambda host=host: cpu_engine.run_ensemble(host))
        hosts.append(
            {"early_termination": early, "cores": os.cpu_count(), "runs": host.size, "seconds": seconds,
             "ms_per_run": 1e3 * seconds / host.size, "steps_per_second": float(found["steps"].sum()) / seconds}
        )  # fmt: skip
    for early in (False,) if smoke else (False, True):
        for warps in (None,) if smoke else (8, 12, 16):
            ensemble = ensemble_of(modes, *sample(runs, slowest), cycles, early_termination=early)
            compiling, _ = timed(lambda warps=warps: integrate(ensemble_of(modes, [4.0], [0.1], 1), warps))
            seconds, found = integrate(ensemble, warps)
            steps = float(found["steps"].sum())
            rate = steps * flops_per_step(ensemble) / seconds
            row = {
                "early_termination": early, "warps": warps, "compile_s": compiling, "seconds": seconds,
                "ms_per_run": 1e3 * seconds / runs, "steps_per_second": steps / seconds, "flops": rate,
                "host_over_device": hosts[early]["ms_per_run"] * runs / (1e3 * seconds),
            }  # fmt: skip
            if "fp64_limit_flops" in facts:
                row["share_of_fp64_limit"] = rate / facts["fp64_limit_flops"]
            rows.append(row)
    return {"runs": runs, "cycles": cycles, "modes": modes, "host": hosts, "rows": rows}


def scaling(smoke: bool) -> dict[str, Any]:
    """Time against the number of modes, and against the number of trajectories."""
    by_modes, by_runs = [], []
    slowest = 3.0 if smoke else 0.1
    runs, cycles = (1, 1) if smoke else (8192, 50)
    for modes in (1,) if smoke else (1, 2, 4, 8, 16, 32, 64, 128):
        if not smoke:
            integrate(ensemble_of(modes, [2.0], [0.1], 1))
        ensemble = ensemble_of(modes, *sample(runs, slowest), cycles)
        seconds, found = integrate(ensemble)
        steps = float(found["steps"].sum())
        by_modes.append(
            {
                "modes": modes,
                "seconds": seconds,
                "ms_per_run": 1e3 * seconds / runs,
                "ns_per_step": 1e9 * seconds / steps,
            }
        )
    for count in (1, 2) if smoke else (1_000, 10_000, 100_000, 1_000_000):
        seconds, _ = integrate(ensemble_of(1 if smoke else 32, *sample(count, slowest), 1 if smoke else 2))
        by_runs.append({"runs": count, "seconds": seconds, "us_per_run": 1e6 * seconds / count})
    return {"by_modes": by_modes, "by_runs": by_runs, "cycles": cycles}


def fig_7b(smoke: bool, output: Path) -> dict[str, Any]:
    """The whole map of Fig. 7B through the public interface, and whether it takes less than a minute."""
    points, cycles, modes = ((2, 1), 1, 1) if smoke else ((400, 130), 1000, 32)
    shaker = sb.Shaker(frequency_ratio=1.0, velocity_amplitude=0.1, location=LOCATION)
    axes = {
        "frequency_ratio": np.linspace(3.0 if smoke else 0.1, 4.0, points[0]),
        "velocity_amplitude": np.linspace(0.005, 0.65, points[1]) if points[1] > 1 else [0.3],
    }
    results = []
    if not smoke:
        integrate(ensemble_of(modes, [2.0], [0.1], 1))
    for early in (False,) if smoke else (True, False):
        seconds, dataset = timed(
            lambda early=early: sb.sweep(
                sb.System(model_of(modes), contacts=[sb.Contact(CONTACT, shaker)]),
                axes,
                sb.Integration(cycles=cycles, engine="cuda", early_termination=early),
                progress=_progress,
            )
        )
        classes = np.asarray(dataset["response_class"])
        results.append(
            {"early_termination": early, "points": int(classes.size), "cycles": cycles, "seconds": seconds,
             "aim_seconds": AIM_SECONDS, "within_aim": seconds <= AIM_SECONDS,
             "shares": {kind.label: float(np.mean(classes == kind)) for kind in ResponseClass}}
        )  # fmt: skip
        if not smoke:
            dataset.to_netcdf(
                output.with_name(f"fig_7b_{'decided' if early else 'whole'}.nc"), engine="h5netcdf"
            )
    return {"maps": results}


def _progress(done: int, total: int) -> None:
    print(f"\r{done:>8d} of {total}", end="" if done < total else "\n", file=sys.stderr, flush=True)


def show(title: str, rows: list[dict[str, Any]]) -> None:
    """Rows as a table."""
    if not rows:
        return
    print(f"\n{title}")
    cells = [[f"{v:.4g}" if isinstance(v, float) else str(v) for v in row.values()] for row in rows]
    names = list(rows[0])
    widths = [max(len(names[i]), *(len(row[i]) for row in cells)) for i in range(len(names))]
    for line in [names, *cells]:
        print("  " + "  ".join(text.rjust(width) for text, width in zip(line, widths, strict=True)))


def main(arguments: list[str] | None = None) -> int:
    """Measure, print, write; 0 if nothing that was compared differs."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("-o", "--output", type=Path, default=Path("gpu.json"))
    parser.add_argument("--smoke", action="store_true", help="a tiny version, for the simulator")
    parser.add_argument("--only", choices=("conformance", "throughput", "scaling", "map"))
    options = parser.parse_args(arguments)
    reason = cuda_engine.refusal(1)
    if reason is not None:
        print(f"no benchmark of the CUDA engine here: {reason}", file=sys.stderr)
        return 2
    if cuda_engine.simulated() and not options.smoke:
        print("in Numba's simulator only --smoke ends in reasonable time", file=sys.stderr)
        return 2
    if options.smoke:
        sys.setswitchinterval(1e-5)  # the simulator's threads wait for each other at every barrier
    facts = device_facts()
    results: dict[str, Any] = {"facts": facts}
    parts: dict[str, Callable[[], dict[str, Any]]] = {
        "conformance": lambda: conformance(options.smoke),
        "throughput": lambda: throughput(options.smoke, facts),
        "scaling": lambda: scaling(options.smoke),
        "map": lambda: fig_7b(options.smoke, options.output),
    }
    show("device", [facts])
    for name, part in parts.items():
        if options.only in (None, name):
            results[name] = part()
            for title, rows in results[name].items():
                if isinstance(rows, list):
                    show(f"{name}: {title}", rows)
            options.output.write_text(json.dumps(results, indent=2), encoding="utf-8")
    compared = results.get("conformance", {})
    right = all(row["error"] < 1e-6 for row in compared.get("first_cycle", []))
    right &= all(row["within_three"] for row in compared.get("class_shares", []))
    return 0 if right else 1


if __name__ == "__main__":
    sys.exit(main())
