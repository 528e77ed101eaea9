"""Run the comparison: `python -m impact20 [--quick] [--only SOLVER ...] [--problems NAME ...] [--out FOLDER] [--budget SECONDS]`."""

from __future__ import annotations

import argparse
import importlib.metadata
import json
import platform
import signal
import time
from pathlib import Path
from typing import Any

import numpy as np

from impact20 import FOLDER, Case, Problem, load, names, studies
from impact20.report import write_report
from impact20.runners import REGISTER, CannotRun, Result, runner

BUDGET = 12.0
"""Processor seconds that the search of one solver on one case may take before tighter settings are left out."""
QUICK = ("bouncing_ball", "unilateral_spring", "viscous_sphere", "two_stops", "impact_oscillator", "beam_1")


class TooLong(Exception):
    """A setting took longer than its budget."""


def _stop(number: int, frame: Any) -> None:
    raise TooLong


def energy(case: Case, state: Any) -> float:
    """Energy of a conservative case outside contact, or with a contact that stores (2/5) k d^(5/2), k d^2/2.

    U = sum k x^2/2 - load . x; the conservative cases have no cubic term.
    """
    n = len(case.stiffness)
    x, v = np.asarray(state[:n]), np.asarray(state[n : 2 * n])
    total = 0.5 * v @ v + 0.5 * case.stiffness @ (x * x) - (case.load @ x if case.load is not None else 0.0)
    for tip in case.tips:
        d = -tip.gap - tip.row @ x
        if tip.law == "power" and d > 0:
            total += tip.stiffness * d ** (tip.exponent + 1) / (tip.exponent + 1)
    return float(total)


def timed(solve: Any) -> tuple[Result, float]:
    """Result and processor time of the least of some warm runs."""
    result = solve()
    least, spent = np.inf, 0.0
    for _ in range(5):
        begin = time.process_time()
        result = solve()
        took = time.process_time() - begin
        least, spent = min(least, took), spent + took
        if spent > 0.2:
            break
    return result, least


def measure(module: Any, problem: Problem, case: Case, setting: dict[str, Any]) -> dict[str, Any]:
    """Error, cost and events of one setting."""
    row: dict[str, Any] = {"setting": setting}
    reference = problem.references[case.name]
    if problem.kind == "trajectory":
        result, row["seconds"] = timed(module.prepare(case, setting))
        row["error"] = float(np.max(np.abs(result.values - np.array(reference["values"])))) / case.scale
        if result.impacts is not None and case.count_impacts:
            row["missed_impacts"] = reference["impacts"] - result.impacts
        if result.evaluations is not None:
            row["evaluations"] = int(result.evaluations)
        if case.conservative and result.state is not None:
            begin = energy(case, np.concatenate((case.start, case.speed)))
            row["energy_error"] = abs(energy(case, result.state) / begin - 1)
        return row

    def many(cases: Any) -> Any:
        if hasattr(module, "solve_many"):
            return module.solve_many(cases, setting)
        return [module.prepare(each, setting)().values for each in cases]

    many([case])
    begin = time.process_time()
    if problem.kind == "threshold":
        found = studies.threshold(case, problem.study, many, ahead=3 if hasattr(module, "solve_many") else 1)
        row["error"] = abs(found / reference["threshold"] - 1)
    else:
        runs = studies.snapped(many(studies.replicas_of(case, problem.study)))
        row["error"] = float(np.mean(runs != np.array(reference["snapped"], dtype=bool)))
        row["coverage"] = studies.coverage(runs, problem.study["blocks"])
    row["seconds"] = time.process_time() - begin
    return row


def search(module: Any, problem: Problem, case: Case, budget: float) -> dict[str, Any]:
    """All settings of a solver on a case, within the budget; or the reason why it cannot."""
    rows: list[dict[str, Any]] = []
    reason = ""
    begin = time.process_time()
    ahead = module.settings(case)
    # A threshold or replicas repeat one method many times: two tolerances of each method.
    if problem.kind != "trajectory" and len(ahead) > 4:
        ahead = ahead[1::2]
    skipped: set[str] = set()
    for setting in ahead:
        method = json.dumps({key: value for key, value in setting.items() if key not in ("tolerance", "step")})
        if method in skipped:
            continue
        if time.process_time() - begin > budget:
            break
        signal.signal(signal.SIGALRM, _stop)
        signal.alarm(int(10 * budget + 60))  # a timer of processor time would make process_time coarse
        try:
            rows.append(measure(module, problem, case, setting))
            if not np.isfinite(rows[-1]["error"]):
                rows.pop()
                reason = reason or "the result is not finite"
        except CannotRun as refusal:
            reason = str(refusal)
            skipped.add(method)
        except TooLong:
            reason = reason or f"a run takes more than {10 * budget + 60:.0f} s"
            skipped.add(method)
        except Exception as failure:  # a solver that fails at one tolerance may succeed at another
            reason = reason or f"{type(failure).__name__}: {str(failure).splitlines()[0][:100] if str(failure) else ''}"
        finally:
            signal.alarm(0)
    return {"rows": rows} if rows else {"reason": reason or "no setting finished"}


def version_of(module: Any) -> str:
    """Version of a runner's package."""
    if hasattr(module, "version"):
        return str(module.version())
    try:
        return importlib.metadata.version(module.PACKAGE)
    except importlib.metadata.PackageNotFoundError:
        return str(getattr(__import__(module.PACKAGE), "__version__", "unknown"))


def processor() -> str:
    """Name of the processor."""
    info = Path("/proc/cpuinfo")
    if info.exists():
        for line in info.read_text(encoding="utf-8").splitlines():
            if line.startswith("model name"):
                return line.split(":", 1)[1].strip()
    return platform.processor() or platform.machine()


def main() -> None:
    """Run and write JSON, table and figure."""
    parser = argparse.ArgumentParser(prog="python -m impact20", description=__doc__)
    parser.add_argument("--quick", action="store_true", help="six problems and a small budget: a minute or two")
    parser.add_argument("--only", nargs="+", choices=list(REGISTER), metavar="SOLVER", default=list(REGISTER))
    parser.add_argument("--problems", nargs="+", choices=names(), metavar="NAME")
    parser.add_argument("--out", type=Path, default=FOLDER / "results")
    parser.add_argument("--budget", type=float, help="processor seconds for the search of one solver on one case")
    given = parser.parse_args()
    wanted = given.problems or (list(QUICK) if given.quick else names())
    budget = given.budget or (2.0 if given.quick else BUDGET)
    given.out.mkdir(parents=True, exist_ok=True)
    target = given.out / "results.json"
    stored = json.loads(target.read_text(encoding="utf-8")) if target.exists() else {}
    results: dict[str, Any] = stored.get("results", {})
    versions: dict[str, str] = stored.get("versions", {})
    for solver in given.only:
        try:
            module = runner(solver)
        except (ImportError, OSError) as missing:
            if solver not in results:
                versions[solver] = f"not installed: {missing}"
            continue
        versions[solver] = version_of(module)
        for name in wanted:
            problem = load(name)
            for case in problem.cases:
                found = search(module, problem, case, budget)
                results.setdefault(solver, {}).setdefault(name, {})[case.name] = found
                rows = found.get("rows", [])
                best = min((row["error"] for row in rows), default=float("nan"))
                print(f"{solver:15s} {name:20s} {case.name:16s} {len(rows)} settings, least error {best:.1e} {found.get('reason', '')}", flush=True)  # fmt: skip
        content = {"processor": processor(), "python": platform.python_version(), "numpy": np.__version__, "versions": versions, "results": results}  # fmt: skip
        target.write_text(json.dumps(content, indent=1) + "\n", encoding="utf-8")
    write_report(given.out)


if __name__ == "__main__":
    main()
