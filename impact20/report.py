"""Table and figure of the stored results: `python -m impact20.report` draws them again."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from impact20 import FOLDER, names

TARGETS = (1e-3, 1e-6)


def best(rows: list[dict[str, Any]], target: float) -> dict[str, Any] | None:
    """The cheapest setting with an error at most *target* and no missed impact."""
    fit = [row for row in rows if row["error"] <= target and not row.get("missed_impacts")]
    return min(fit, key=lambda row: row["seconds"], default=None)


def table(content: dict[str, Any], target: float) -> str:
    """Milliseconds of the cheapest setting for each case and solver; a number in brackets is the least error instead."""
    solvers = [name for name in content["versions"] if name in content["results"]]
    lines = ["| problem, case | " + " | ".join(solvers) + " |", "|---|" + "---:|" * len(solvers)]
    for name in names():
        cases = {case for solver in solvers for case in content["results"][solver].get(name, {})}
        order = [case for solver in solvers[:1] for case in content["results"][solver].get(name, {})] or sorted(cases)
        for case in order:
            cells, times = [], {}
            for solver in solvers:
                found = content["results"][solver].get(name, {}).get(case, {"reason": "not run"})
                row = best(found.get("rows", []), target)
                if row is not None:
                    times[solver] = row["seconds"]
                    cells.append(f"{1e3 * row['seconds']:.3g}")
                elif "rows" in found:
                    cells.append(f"({min(each['error'] for each in found['rows']):.0e})")
                else:
                    cells.append("-")
            if times:
                winner = min(times, key=lambda solver: times[solver])
                cells[solvers.index(winner)] = f"**{cells[solvers.index(winner)]}**"
            lines.append(f"| {name}, {case} | " + " | ".join(cells) + " |")
    return "\n".join(lines)


def reasons(content: dict[str, Any]) -> str:
    """Why a solver did not run a case, each reason once."""
    lines = []
    for solver, problems in content["results"].items():
        found: dict[str, list[str]] = {}
        for name, cases in problems.items():
            for case, entry in cases.items():
                if "reason" in entry:
                    found.setdefault(entry["reason"], []).append(f"{name} {case}")
        lines += [f"- {solver}: {reason} ({', '.join(where)})" for reason, where in found.items()]
    for solver, version in content["versions"].items():
        if version.startswith("not installed"):
            lines.append(f"- {solver}: {version}")
    return "\n".join(lines)


def ratios(content: dict[str, Any], target: float, one: str = "snapbeam") -> list[tuple[str, float, str]]:
    """Cost of *one* over the cheapest other solver for each case that both reach, with the other's name."""
    found = []
    for name in names():
        for case, entry in content["results"].get(one, {}).get(name, {}).items():
            own = best(entry.get("rows", []), target)
            others = []
            for solver, problems in content["results"].items():
                row = best(problems.get(name, {}).get(case, {}).get("rows", []), target)
                if solver != one and row is not None:
                    others.append((row["seconds"], solver))
            if own is not None and others:
                seconds, solver = min(others)
                found.append((f"{name}, {case}", own["seconds"] / seconds, solver))
    return found


def figure(content: dict[str, Any], target: Path) -> None:
    """Cost against error of every setting, a panel for each problem (its last case)."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    fig, axes = plt.subplots(5, 4, figsize=(13, 14), layout="constrained")
    markers = "osD^v<>P"
    for axis, name in zip(axes.ravel(), names(), strict=True):
        for i, (solver, problems) in enumerate(content["results"].items()):
            entries = list(problems.get(name, {}).items())
            if not entries:
                continue
            case, entry = entries[-1]
            axis.set_title(f"{name}, {case}", fontsize=8)
            rows = entry.get("rows", [])
            points = sorted((max(row["error"], 1e-16), 1e3 * row["seconds"]) for row in rows)
            if points:
                axis.loglog(*zip(*points, strict=True), markers[i % 8], ms=4, color=f"C{i}", label=solver)
        axis.tick_params(labelsize=7)
        axis.grid(alpha=0.3)
    for axis in axes[-1]:
        axis.set_xlabel("error / scale", fontsize=8)
    for axis in axes[:, 0]:
        axis.set_ylabel("processor time (ms)", fontsize=8)
    handles: dict[str, Any] = {}
    for axis in axes.ravel():
        handles |= dict(zip(*reversed(axis.get_legend_handles_labels()), strict=True))
    fig.legend(handles.values(), handles.keys(), loc="outside lower center", ncols=8, fontsize=8)
    fig.savefig(target, dpi=110)
    plt.close(fig)


def write_report(folder: Path) -> None:
    """Write table.md and work_precision.png beside results.json."""
    content = json.loads((folder / "results.json").read_text(encoding="utf-8"))
    versions = ", ".join(f"{name} {v}" for name, v in content["versions"].items() if not v.startswith("not installed"))
    text = [
        f"Processor {content['processor']}, one core; Python {content['python']}, NumPy {content['numpy']}; {versions}.\n",
        "Processor time in milliseconds of the cheapest setting whose error is at most the target and that misses no impact; in",
        "brackets the minimum error if the target was missed; -: not run, for the reasons below the tables.",
    ]
    for target in TARGETS:
        text += [f"\nError at most {target:g} of the scale:\n", table(content, target)]
    text += ["\nWhy a case was not run:\n", reasons(content), ""]
    for target in TARGETS:
        found = ratios(content, target)
        if found:
            text += [f"\nCost of snapbeam over the cheapest other solver, error at most {target:g}:\n", "| case | ratio | other |", "|---|---:|---|"]  # fmt: skip
            text += [f"| {case} | {ratio:.3g} | {solver} |" for case, ratio, solver in found]
    (folder / "table.md").write_text("\n".join(text) + "\n", encoding="utf-8")
    figure(content, folder / "work_precision.png")


if __name__ == "__main__":
    write_report(FOLDER / "results")
