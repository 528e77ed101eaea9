"""The problems of impact20: files, references by two codes, runners on the quick ones."""

import json
import math
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parents[2]))

from impact20 import FOLDER, closed_form, extrapolation, integrated, load, matrices, names, studies
from impact20.report import ratios
from impact20.runners import CannotRun, runner

ROOT = Path(__file__).parents[2]
CHEAP = [
    ("bouncing_ball", "lossy"),
    ("bouncing_ball", "zeno"),
    ("two_stops", "lossy"),
    ("viscous_sphere", "hertz"),
    ("viscous_sphere", "hunt_crossley"),
    ("viscous_sphere", "kelvin_voigt"),
    ("impact_oscillator", "grazing"),
    ("striker_with_mass", "spheres"),
]


def case_named(problem, name):
    return next(case for case in load(problem).cases if case.name == name)


def test_twenty_problems_state_what_they_are():
    assert len(names()) == 20
    for name in names():
        problem = load(name)
        assert problem.reason
        assert "x" in problem.equations
        assert 1 <= problem.difficulty <= 5
        for case in problem.cases:
            assert problem.references[case.name]["agreement"] < 1e-6, (name, case.name)
            assert case.scale > 0
            sizes = {len(case.stiffness), len(case.damping), len(case.start), len(case.speed), len(case.output)}
            assert sizes == {len(case.stiffness)}
            if problem.kind == "trajectory":
                assert len(problem.references[case.name]["values"]) == case.samples


def test_problems_and_references_do_not_import_snapbeam():
    code = (
        "import sys, impact20.references, impact20.matrices\n"
        "assert not any(name.split('.')[0] == 'snapbeam' for name in sys.modules)"
    )
    subprocess.run([sys.executable, "-c", code], cwd=ROOT, check=True)


@pytest.mark.sampled(2)
@pytest.mark.parametrize(("problem", "name"), CHEAP)
def test_two_codes_reproduce_the_stored_reference(problem, name):
    case, stored = case_named(problem, name), load(problem).references[name]
    second, impacts, _ = integrated.solve(case)
    values = np.array(stored["values"])
    assert np.max(np.abs(second - values)) < 1e-9 * case.scale
    if case.count_impacts:
        assert impacts == stored["impacts"]
    if np.finfo(np.longdouble).eps < 1e-18:
        first = extrapolation.solve(case)
        assert np.max(np.abs(first.values - values)) < 1e-13 * case.scale
        if case.count_impacts:
            assert first.impacts == stored["impacts"]


@pytest.mark.parametrize("problem", sorted(closed_form.SOLUTIONS))
def test_references_meet_the_exact_solutions(problem):
    compared = 0
    for case in load(problem).cases:
        exact = closed_form.SOLUTIONS[problem](case)
        known = ~np.isnan(exact)
        compared += int(known.sum())
        stored = np.array(load(problem).references[case.name]["values"])
        assert np.all(np.abs(exact - stored)[known] < 1e-12)
    assert compared >= 10


def test_hunt_crossley_leaves_with_the_exact_restitution():
    # (1 + e) D = ln((1 + D)/(1 - e D)) with D = chi v; the slope of the last outputs is e.
    case = case_named("viscous_sphere", "hunt_crossley")
    stored = np.array(load("viscous_sphere").references["hunt_crossley"]["values"])
    e = (stored[-1] - stored[-2]) / (case.times[-1] - case.times[-2])
    d = case.tips[0].factor
    assert (1 + e) * d == pytest.approx(math.log((1 + d) / (1 - e * d)), abs=1e-11)


@pytest.mark.parametrize("modes", [1, 8])
def test_matrices_are_those_of_the_data_files(modes):
    made = matrices.buckled_beam(modes)
    stored = json.loads((FOLDER / "data" / f"beam_{modes}.json").read_text(encoding="utf-8"))
    # Eigenvectors depend on the linear algebra library beyond some digits.
    for key in ("stiffness", "damping", "gradient", "coupling"):
        assert np.allclose(made["structure"][key], stored["structure"][key], rtol=1e-9, atol=1e-6)
    # 83.933 Hz with one mode, 81.92 Hz with eight (the source's frequencies).
    assert 1 / stored["unit_of_time_s"] / (2 * math.pi) == pytest.approx({1: 83.933, 8: 81.92}[modes], abs=5e-3)


def test_replicas_are_those_of_the_formula_and_their_intervals_cover():
    problem = load("replicas")
    cases = studies.replicas_of(problem.cases[0], problem.study)
    amplitudes = np.array([studies.velocity_of(case) for case in cases])
    base = studies.velocity_of(problem.cases[0])
    assert amplitudes.size == 1000
    assert amplitudes.mean() == pytest.approx(base, rel=1e-2)
    found = np.array(problem.references["share"]["snapped"], dtype=bool)
    assert 0.05 < found.mean() < 0.95
    assert studies.coverage(found, problem.study["blocks"]) == problem.references["share"]["coverage"]
    for i in (0, 500, 999):
        assert bool(studies.snapped([integrated.solve(cases[i])[0]])[0]) == found[i]


@pytest.mark.parametrize("problem", ["bouncing_ball", "two_stops", "viscous_sphere", "sticking"])
def test_scipy_runner_reproduces_the_references(problem):
    module = runner("SciPy")
    for case in load(problem).cases:
        setting = {"method": "DOP853", "tolerance": 1e-11, "events": True}
        result = module.prepare(case, setting)()
        stored = load(problem).references[case.name]
        assert np.max(np.abs(result.values - np.array(stored["values"]))) < 1e-7 * case.scale
        if case.count_impacts:
            assert result.impacts == stored["impacts"]


SNAPBEAM = """
import numpy as np
from impact20 import load, names
from impact20.runners import runner
module = runner("snapbeam")
for problem in sorted({*names()} - {"finite_elements_200", "threshold", "replicas"}):
    for case in load(problem).cases:
        stored, solve = load(problem).references[case.name], module.prepare(case, {"method": "reference", "step": 1.0})
        for result in (solve(), solve()):
            # conditioning: largest change of an output per relative change of the data
            allowed = max(1e-6, 1e-9 * stored["conditioning"]) * case.scale
            assert np.max(np.abs(result.values - np.array(stored["values"]))) < allowed, case
            assert not case.count_impacts or result.impacts == stored["impacts"], case
"""


@pytest.mark.slow
def test_snapbeam_runner_reproduces_the_references():
    """In a process of its own: the runner defines a force, which every later table of parameters would have."""
    done = subprocess.run([sys.executable, "-c", SNAPBEAM], cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


def test_events_are_needed_for_restitution():
    with pytest.raises(CannotRun):
        runner("SciPy").prepare(load("two_stops").cases[0], {"method": "RK45", "tolerance": 1e-6, "events": False})()


def test_unknown_name_is_refused():
    with pytest.raises(ValueError, match="must be one of"):
        load("no_such_problem")


@pytest.mark.slow
def test_runner_of_the_readme_runs():
    text = (FOLDER / "README.md").read_text(encoding="utf-8")
    code = text.split("```python\n", 1)[1].split("```", 1)[0]
    own = {}
    exec(compile(code, "README.md", "exec"), own)
    assert len(code.splitlines()) < 40
    problem = load("unilateral_spring")
    case = problem.cases[0]
    stored = np.array(problem.references["stop"]["values"])
    errors = [
        float(np.max(np.abs(own["prepare"](case, setting)().values - stored))) for setting in own["settings"](case)
    ]
    assert errors[1] < 1e-3
    assert errors[1] < errors[0] / 5
    with pytest.raises(CannotRun):
        own["prepare"](load("two_stops").cases[0], own["settings"](case)[0])


def test_the_readmes_state_the_stored_results():
    """Number of cases, range of the ratios of single runs and of many, and the fastest solvers."""
    content = json.loads((FOLDER / "results" / "results.json").read_text(encoding="utf-8"))
    found = [*ratios(content, 1e-3), *ratios(content, 1e-6)]
    single = [row for row in found if not row[0].startswith("replicas")]
    least, most = min(single, key=lambda row: row[1]), max(single, key=lambda row: row[1])
    words = f"{least[1]:.1f} to {most[1]:.0f} times"
    assert {row[2] for row in found} == {"Boost.odeint", "numbalsoda", "heyoka"}
    at_best = f"cheapest in {sum(row[1] < 1.0 for row in ratios(content, 1e-6))} of {len(ratios(content, 1e-6))} cases"
    own = (FOLDER / "README.md").read_text(encoding="utf-8")
    for page in (
        own,
        *((FOLDER.parent / name).read_text(encoding="utf-8") for name in ("README.md", "docs/accuracy_and_speed.md")),
    ):
        assert words in page and at_best in page
    assert f"1e-6 in all {len(ratios(content, 1e-6))} cases" in own
    assert len(ratios(content, 1e-6)) == sum(
        "rows" in case for problem in content["results"]["snapbeam"].values() for case in problem.values()
    )
