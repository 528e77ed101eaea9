"""Shares of the time of a run by operation, sampled: ``python -m benchmarks.profile [N]``.

The kernel is compiled with the lines of its source, which changes no instruction, and sampled by ``perf``; ``addr2line`` tells
the functions that were inlined at each address.  Linux only; needs both programs.
"""

from __future__ import annotations

import argparse
import json
import os
import re
import shutil
import subprocess
import sys
import tempfile
from collections import Counter
from pathlib import Path

__all__ = ["OPERATIONS", "main"]

OPERATIONS = {
    "tension": ("tension_rows_twice", "tension_rows", "form_products"),
    "kicks and flows": ("kick_and_flow", "_kick_and_flow"),
    "contact force, motion of the striker": ("evaluate_contact", "_contact_product"),
    "preparation of steps of another length": ("prepare", "load_flows"),
    "proposal of a step": ("propose_step",),
    "search for contacts": ("detect_contact_event", "detect_contact_events"),
    "maximum force": ("locate_peak_force", "_locate_peak_force", "detect_deepest_points"),
    "energy of the modes": ("monitor_energy", "_monitor_energy"),
    "signals at the ends of steps": ("observe", "_observe"),
    "extremes, mean squares, crossings": (
        "accumulate_displacement", "count_zero_crossings_in_step", "_accumulate_displacement",
        "_accumulate_extremes", "_accumulate_zero_crossings",
    ),
}  # fmt: skip
"""The functions of an operation, in either layout."""

_WORKER = """
import json, sys, time
from numba.core import cpu, debuginfo
finalize = cpu.CPUTargetOptions.finalize
def with_lines(self, flags, options):
    finalize(self, flags, options)
    flags.debuginfo, flags.dbg_directives_only, flags.dbg_extend_lifetimes = True, True, False
cpu.CPUTargetOptions.finalize = with_lines
debuginfo.DIBuilder.emission_kind = property(lambda self: "LineTablesOnly", lambda self, value: None)
debuginfo.DIBuilder.mark_variable = lambda self, *arguments, **options: None
from benchmarks.ensemble import ensemble_of, sample
from snapbeam.solver.cpu import driver
modes, runs, cycles, folder = *map(int, sys.argv[1:4]), sys.argv[4]
ensemble = ensemble_of(modes, {name: values[:runs] for name, values in sample(400).items()}, False, cycles)
driver.FEWEST_STEPS = 0
packed = driver._packed(ensemble)
few = driver._few_modes_pay(ensemble, packed)
driver.run_ensemble(ensemble_of(modes, {name: values[:8] for name, values in sample(8).items()}, False, 1), 1)
kernel = driver._side_by_side(ensemble, packed)[0] if few else driver._kernel(driver.integrate_ensemble, ensemble)
(compiled,) = kernel.overloads.values()
library = compiled.library
open(folder + "/kernel.o", "wb").write(library._compiled_object)
functions = [each.name for each in library._final_module.functions if not each.is_declaration]
places = {name: library._codegen._engine.get_function_address(name) for name in functions}
begun = time.process_time()
steps = int(driver.run_ensemble(ensemble, 1)["steps"].sum())
print(json.dumps({"places": places, "step": (time.process_time() - begun) / steps}))
"""


def _sampled(folder: Path, arguments: list[str]) -> tuple[Counter[int], float]:
    """How often each place in the kernel was met, and seconds a step."""
    environment = os.environ | {"NUMBA_CACHE_DIR": str(folder / "cache"), "NUMBA_NUM_THREADS": "1"}
    command = ["perf", "record", "-q", "-F", "5000", "-e", "cpu-clock", "-o", str(folder / "samples")]
    done = subprocess.run(
        [*command, sys.executable, "-c", _WORKER, *arguments, str(folder)],
        env=environment, capture_output=True, text=True, check=True,
    )  # fmt: skip
    found = json.loads(done.stdout.splitlines()[-1])
    symbols = subprocess.run(
        ["nm", "-S", "--defined-only", str(folder / "kernel.o")], capture_output=True, text=True, check=True
    )
    parts = []
    for line in symbols.stdout.splitlines():
        fields = line.split()
        if len(fields) == 4 and found["places"].get(fields[3]):
            parts.append((found["places"][fields[3]], int(fields[0], 16), int(fields[1], 16)))
    script = subprocess.run(
        ["perf", "script", "-i", str(folder / "samples"), "-F", "ip"],
        capture_output=True, text=True, check=True,
    )  # fmt: skip
    count: Counter[int] = Counter()
    for text in script.stdout.split():
        address = int(text, 16)
        for begin, offset, size in parts:
            if begin <= address < begin + size:
                count[offset + address - begin] += 1
                break
    return count, float(found["step"])


def _operation(chain: list[str]) -> str:
    """The operation of a place: that of the outermost of its inlined functions that has one."""
    for function in reversed(chain):
        for operation, names in OPERATIONS.items():
            if function in names:
                return operation
    return "the rest"


def _shares(folder: Path, count: Counter[int]) -> Counter[str]:
    """Samples by operation."""
    places = sorted(count)
    lines = subprocess.run(
        ["addr2line", "-e", str(folder / "kernel.o"), "-j", ".ltext", "-i", "-f", "-a"],
        input="\n".join(map(hex, places)), capture_output=True, text=True, check=True,
    ).stdout  # fmt: skip
    found: Counter[str] = Counter()
    for block in re.split(r"^(?=0x[0-9a-f]{16}$)", lines, flags=re.MULTILINE)[1:]:
        address, *rest = block.splitlines()
        chain = [name.rpartition(".")[2] for name in rest[::2]]
        found[_operation(chain)] += count[int(address, 16)]
    return found


def main() -> None:
    """Print a table of shares."""
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.profile", description="shares of the time of a run"
    )
    parser.add_argument("modes", nargs="?", default="32")
    parser.add_argument("--runs", default="48")
    parser.add_argument("--cycles", default="120")
    arguments = parser.parse_args()
    if missing := [name for name in ("perf", "nm", "addr2line") if shutil.which(name) is None]:
        parser.error(f"{', '.join(missing)}: not installed; the profile needs Linux's perf and GNU binutils")
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        count, step = _sampled(folder, [arguments.modes, arguments.runs, arguments.cycles])
        shares = _shares(folder, count)
    total = sum(shares.values())
    print(f"{1e9 * step:.0f} ns a step and run; {total} samples")
    for operation in (*OPERATIONS, "the rest"):
        print(f"{operation:40s} {100.0 * shares[operation] / total:5.1f} %")


if __name__ == "__main__":
    main()
