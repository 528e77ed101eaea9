"""Write `references.toml`: `python -m impact20.references`, or the names of some problems after it."""

import sys
import tomllib
from dataclasses import replace
from typing import Any

import numpy as np
import tomli_w

from impact20 import FOLDER, Case, Problem, closed_form, extrapolation, integrated, load, names, studies

CHANGE = 1e-8
"""Relative change of start, speed and amplitudes that the conditioning is measured with."""
PART = 1e-3
"""Difference of the two codes, over the scale, from which on a single trajectory means nothing."""


def perturbed(case: Case) -> Case:
    """The case with start, speeds, loads and amplitudes larger by the relative change."""
    f = 1 + CHANGE
    return replace(
        case,
        start=case.start * f,
        speed=case.speed * f,
        load=None if case.load is None else case.load * f,
        harmonic=None if case.harmonic is None else case.harmonic * f,
        pulse=None if case.pulse is None else case.pulse * f,
        tips=tuple(replace(tip, amplitude=tip.amplitude * f) for tip in case.tips),
    )


def trajectory(problem: Problem, case: Case) -> dict[str, Any]:
    """Values of the first code, the agreement of both, and the conditioning.

    `agreement` is the largest difference at the output times over the scale, `exact_difference` that to the closed form,
    `conditioning` the largest change of an output over the scale per relative change of the data.
    """
    first = extrapolation.solve(case)
    second, impacts, _ = integrated.solve(case)
    moved, _, _ = integrated.solve(perturbed(case))
    row: dict[str, Any] = {
        "values": first.values.tolist(),
        "agreement": float(np.max(np.abs(first.values - second)) / case.scale),
        "conditioning": float(f"{np.max(np.abs(moved - second)) / case.scale / CHANGE:.3g}"),
    }
    if case.count_impacts:
        if first.impacts != impacts:
            raise RuntimeError(f"{problem.name} {case.name}: {first.impacts} and {impacts} impacts")
        row |= {"impacts": first.impacts, "last_impact": first.last_impact}
    if problem.name in closed_form.SOLUTIONS:
        exact = closed_form.SOLUTIONS[problem.name](case)
        if not np.all(np.isnan(exact)):
            row["exact_difference"] = float(np.nanmax(np.abs(exact - first.values)) / case.scale)
    if len(case.stiffness) == 1 and case.truss is None:
        row |= parting(case)
    return row


def parting(case: Case) -> dict[str, float]:
    """The output time at which the two codes part within three horizons, or how far they still agree."""
    longer = replace(case, horizon=3 * case.horizon, samples=3 * case.samples)
    difference = np.abs(extrapolation.solve(longer).values - integrated.solve(longer)[0]) / case.scale
    beyond = np.flatnonzero(difference > PART)
    return {"parted_at": float(longer.times[beyond[0]])} if beyond.size else {"agree_until": longer.horizon}


def study(problem: Problem) -> dict[str, Any]:
    """Result of a threshold or of replicas by both codes."""
    case = problem.cases[0]
    if problem.kind == "threshold":
        found = [
            studies.threshold(case, problem.study, solve)
            for solve in (lambda c: extrapolation.solve(c).values, lambda c: integrated.solve(c)[0])
        ]
        return {"threshold": found[0], "agreement": abs(found[0] / found[1] - 1)}
    cases = studies.replicas_of(case, problem.study)
    second = studies.snapped([integrated.solve(each, 1e-9, 1e-11)[0] for each in cases])
    # The slower code takes every fortieth replica.
    first = studies.snapped([extrapolation.solve(each).values for each in cases[::40]])
    return {
        "snapped": second.astype(int).tolist(),
        "share": float(second.mean()),
        "coverage": studies.coverage(second, problem.study["blocks"]),
        "agreement": float(np.mean(first != second[::40])),
    }


def references(problem: Problem) -> dict[str, dict[str, Any]]:
    """References of all cases of a problem."""
    if problem.kind != "trajectory":
        return {problem.cases[0].name: study(problem)}
    return {case.name: trajectory(problem, case) for case in problem.cases}


def main(wanted: list[str]) -> None:
    """Compute the references and write the file after each problem."""
    target = FOLDER / "references.toml"
    known = set(names())
    table = tomllib.loads(target.read_text(encoding="utf-8")) if target.exists() else {}
    table = {name: rows for name, rows in table.items() if name in known}
    for name in wanted or names():
        table[name] = references(load(name))
        ordered = {each: table[each] for each in names() if each in table}
        target.write_text(tomli_w.dumps(ordered), encoding="utf-8")
        for case, row in table[name].items():
            numbers = {key: value for key, value in row.items() if key not in ("values", "snapped")}
            print(name, case, numbers, flush=True)


if __name__ == "__main__":
    main(sys.argv[1:])
