"""The present tree against a commit, in alternating processes: ``python -m benchmarks.regression COMMIT``.

The tree of the commit is installed into a folder of its own, which compiles its core, if it has one; its earlier solver needs Numba.  Of the
present tree, the core that is there is taken (``make core``).  Each case of ``systems`` is integrated by both, each with its own definition of the case and with one thread.  A process
counts with the least processor time of its repeats, a tree with the least of its processes.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from benchmarks.timing import machine

__all__ = ["compare", "main"]

_ROOT = Path(__file__).resolve().parents[1]
_SITE = "build/site"
PAPER = "the paper's"
DEFAULT = (
    f"{PAPER}, 1 mode", f"{PAPER}, 8 modes", f"{PAPER}, 32 modes",
    "`hunt_crossley`", "`band_limited_noise`", "a stop above, too", "a moving base", "a coil",
)  # fmt: skip
_WORKER = """
import json, sys, time
sys.path.insert(0, sys.argv[1])
from benchmarks import systems
name, runs, cycles, repeats = sys.argv[2], *map(int, sys.argv[3:])
parts = {} if name.startswith("the paper's") else systems.MODELS[name]
systems._MODES = int(name.split()[-2]) if name.startswith("the paper's") else 8
ensemble = systems._ensemble(parts, runs, cycles)
enough = 1
try:
    from snapbeam.solver.engines import engine_of
    engine = engine_of(ensemble)
except ImportError:  # before the native core: compiled in stages, after a number of steps
    from snapbeam.solver.cpu import driver as engine
    enough += int(engine.FEWEST_STEPS / ensemble.work.sum())
for _ in range(enough):
    steps = float(engine.run_ensemble(ensemble, 1)["steps"].sum())
times = []
for _ in range(repeats):
    begun = time.process_time()
    engine.run_ensemble(ensemble, 1)
    times.append(time.process_time() - begun)
simulated = float((ensemble.runs["tick"] * ensemble.runs["end"]).sum())
print(json.dumps({"time": min(times) / simulated, "step": min(times) / steps}))
"""


@contextmanager
def _checked_out(commit: str) -> Iterator[Path]:
    """A folder with the tree of a commit, and what it installs."""
    with tempfile.TemporaryDirectory() as folder:
        tree = Path(folder) / "tree"
        subprocess.run(
            ["git", "-C", str(_ROOT), "worktree", "add", "--quiet", "--detach", str(tree), commit], check=True
        )
        try:
            if not (tree / "CMakeLists.txt").exists():  # before the native core: nothing to compile here
                yield tree
                return
            pip = [sys.executable, "-m", "pip", "install", "--quiet", "--no-deps", "--no-build-isolation"]
            subprocess.run([*pip, "--target", str(tree / _SITE), str(tree)], check=True)
            yield tree
        finally:
            subprocess.run(["git", "-C", str(_ROOT), "worktree", "remove", "--force", str(tree)], check=True)


def _timed(tree: Path, case: str, size: tuple[int, int, int]) -> dict[str, float] | None:
    """Processor time of a case, per simulated second and per step; None if the tree does not have the case."""
    site = tree / _SITE
    environment = os.environ | {"PYTHONPATH": str(site if site.exists() else tree / "src")}
    done = subprocess.run(
        [sys.executable, "-c", _WORKER, str(tree), case, *map(str, size)],
        env=environment, cwd=tree, capture_output=True, text=True, check=False,
    )  # fmt: skip
    if done.returncode:
        reason = done.stderr.strip().splitlines()[-1]
        if reason == f"KeyError: {case!r}":
            return None
        raise RuntimeError(f"{case}: {reason}")
    found: dict[str, float] = json.loads(done.stdout.splitlines()[-1])
    return found


def compare(
    commit: str, cases: tuple[str, ...], processes: int, size: tuple[int, int, int]
) -> Iterator[tuple[str, float, float] | tuple[str, None, None]]:
    """Yield for each case the ratios, present over commit, of the times per simulated second and per step."""
    with _checked_out(commit) as other:
        for case in cases:
            found: dict[Path, list[dict[str, float]]] = {_ROOT: [], other: []}
            for _ in range(processes):
                for tree, results in found.items():
                    if (timed := _timed(tree, case, size)) is not None:
                        results.append(timed)
            if not all(found.values()):
                yield case, None, None
                continue
            least = {
                tree: {kind: min(each[kind] for each in results) for kind in ("time", "step")}
                for tree, results in found.items()
            }
            yield (case, least[_ROOT]["time"] / least[other]["time"], least[_ROOT]["step"] / least[other]["step"])


def main() -> None:
    """Print a table of ratios."""
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.regression", description="processor time over that of a commit"
    )
    parser.add_argument("commit")
    parser.add_argument("case", nargs="*", default=DEFAULT, help="names of `systems`; 'all'; default: eight cases")
    parser.add_argument("--processes", type=int, default=4, help="of each tree and case (4)")
    parser.add_argument("--quick", action="store_true", help="short runs: does everything work")
    arguments = parser.parse_args()
    cases = tuple(arguments.case)
    if cases == ("all",):
        from benchmarks.systems import MODELS

        cases = (*DEFAULT[:3], *MODELS)
    print(f"{machine()['processor']}; ratios: present tree over {arguments.commit}")
    size = (4, 4, 1) if arguments.quick else (24, 60, 3)
    for case, time, step in compare(arguments.commit, cases, arguments.processes, size):
        if time is None or step is None:
            print(f"{case:30s} not in both trees", flush=True)
        else:
            print(f"{case:30s} per simulated second {time:5.2f}, per step {step:5.2f}", flush=True)


if __name__ == "__main__":
    main()
