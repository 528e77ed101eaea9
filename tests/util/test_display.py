"""How results show themselves: datasets, notebooks, progress."""

from __future__ import annotations

import sys
import time

import pytest

import snapbeam as sb
from snapbeam.model import default_values
from snapbeam.util.diagnostics import counting, sharing
from snapbeam.util.work_rate import WorkRate


@pytest.fixture(scope="module")
def system():
    striker = sb.Shaker(frequency_ratio=1.21, velocity_amplitude=0.18)
    return sb.System(
        sb.ReducedModel.from_beam(default_values.BEAM, modes=1), contacts=[sb.Contact(default_values.CONTACT, striker)]
    )


def test_short_words_and_tables(system):
    run = sb.simulate(system, sb.Integration(cycles=3))
    for value in (run, run.summary, system, system.model):
        assert len(repr(value)) < 400
    html = run._repr_html_() + system._repr_html_() + run.summary._repr_html_()
    assert "<table>" in html and "thickness = 400 µm" in html and "peak contact force" in html


def test_progress_in_words(system, capsys):
    axes = {"velocity_amplitude": [0.1, 0.2, 0.3]}
    plain = sb.sweep(system, axes, sb.Integration(cycles=3))
    capsys.readouterr()
    told = sb.sweep(system, axes, sb.Integration(cycles=3), progress=True)
    assert "sweep: 3 of 3 points" in capsys.readouterr().err
    assert told.response_class.equals(plain.response_class)
    sb.simulate(system, sb.Integration(cycles=3), progress=True)
    assert "run: 100 %" in capsys.readouterr().err
    assert counting(None, "a") is counting(False, "a") is sharing(None, "a") is None
    for check in (counting, sharing):
        with pytest.raises(sb.InputTypeError, match="progress = 3: must be True or callable"):
            check(3, "a")


def test_progress_that_nobody_asked_for(system, capsys, monkeypatch):
    """A terminal shows the call of a user that takes long, once; not what is a part of it, and nothing with False."""
    axes = {"velocity_amplitude": [0.1, 0.2]}
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True)
    sb.sweep(system, axes, sb.Integration(cycles=3))
    assert capsys.readouterr().err == ""  # in less than two seconds
    monkeypatch.setattr("snapbeam.util.diagnostics._WAIT", 0.0)
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True)
    sb.sweep(system, axes, sb.Integration(cycles=3))
    assert capsys.readouterr().err.count("\n") == 1
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True)
    sb.sweep(system, axes, sb.Integration(cycles=3), progress=False)
    sb.simulate(system, sb.Integration(cycles=3), progress=lambda share: None)
    assert capsys.readouterr().err == ""
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True)
    sb.dynamics.find_attractors(system, 4, progress=False)
    sb.simulate([system, system], sb.Integration(cycles=3))
    lines = capsys.readouterr().err.rstrip().split("\n")
    assert [line.split("\r")[-1].strip() for line in lines] == ["simulate: 2 of 2 runs"]


def test_codes_in_words(system):
    found = sb.sweep(system, {"velocity_amplitude": [0.01, 0.5]}, sb.Integration(cycles=3))
    found["status"][0] = sb.RunStatus.STEP_LIMIT
    assert found.snapbeam.meanings("status").values.tolist() == ["step_limit", "ok"]
    assert found.snapbeam.meanings("response_class").values[0] == "intrawell"
    assert (found.snapbeam.meanings("status") == "step_limit").dims == ("velocity_amplitude",)
    with pytest.raises(sb.InputError, match="name = 'impacts': must be a variable of codes: response_class, status"):
        found.snapbeam.meanings("impacts")


def test_several_systems_at_once(system):
    others = [system, system.replace(**{"drive.velocity_amplitude": 0.3}), system.replace(**{"model.modes": 2})]
    seen = []
    runs = sb.simulate(others, sb.Integration(cycles=5), progress=lambda done, total: seen.append((done, total)))
    assert seen == [(1, 3), (2, 3), (3, 3)]
    for one, run in zip(others, runs, strict=True):
        alone = sb.simulate(one, sb.Integration(cycles=5))
        assert run.system == one and dict(run.summary) == pytest.approx(dict(alone.summary), nan_ok=True)
        assert run.dataset.midspan_displacement.equals(alone.dataset.midspan_displacement)
    with pytest.raises(sb.InputTypeError, match=r"system\[1\] = 3: must be a System"):
        sb.simulate([system, 3])
    assert sb.simulate([]) == []


@pytest.fixture(scope="module")
def free(system):
    """Without snap-through, so that every analysis ends soon."""
    return system.replace(**{
        "model.damping_ratio": 0.05, "drive.frequency_ratio": 1.6, "drive.velocity_amplitude": 0.03,
    })  # fmt: skip


def test_progress_of_dynamics(free, capsys):
    """``progress=True`` writes a line that ends with the whole."""
    orbit = sb.dynamics.periodic_orbit(free)
    calls = {
        "Lyapunov spectrum: 32 of 32 periods": lambda: sb.dynamics.lyapunov_spectrum(free, periods=32, progress=True),
        "largest Lyapunov exponent: 32 of 32 periods": lambda: sb.dynamics.largest_lyapunov(
            free, periods=32, progress=True
        ),
        "bifurcation diagram: 2 of 2 values": lambda: sb.dynamics.bifurcation_diagram(
            free, "velocity_amplitude", [0.02, 0.03], sweeps=("up",), periods=(5, 4), progress=True
        ),
        "lifetimes: 1 of 1 points": lambda: sb.dynamics.lifetime_map(
            free, integration=sb.Integration(cycles=60), initial_conditions=8, progress=True
        ),
        "branch: 3 of 3 orbits": lambda: sb.dynamics.continuation(
            orbit, "velocity_amplitude", (0.02, 0.05), max_points=3, progress=True
        ),
    }  # fmt: skip
    for words, call in calls.items():
        capsys.readouterr()
        call()
        assert words in capsys.readouterr().err
    found = sb.dynamics.find_attractors(free, 8, progress=True)
    assert "attractors: 4 of 4 parts" in capsys.readouterr().err
    grid = {"amplitude[1]": [-1.1, -1.0], "velocity[1]": [0.0, 0.05]}
    sb.dynamics.basins_of_attraction(found, grid, progress=True)
    assert "basins: " in (line := capsys.readouterr().err) and line.endswith("periods      \n")


def test_progress_of_uncertainty(system, capsys):
    uncertain = sb.uncertainty.ParameterUncertainty(of={"drive.velocity_amplitude": sb.uncertainty.Normal(0.02)})
    how = sb.Integration(cycles=3)
    sb.uncertainty.sensitivity(system, "peak_force", uncertain, samples=4, integration=how, progress=True)
    assert "sensitivity: 8 of 8 runs" in capsys.readouterr().err


def test_rate_of_the_later_half(monkeypatch):
    """A delay in the first half of the work, as at the start of a worker, is left out after it."""
    now = [0.0]
    monkeypatch.setattr(time, "monotonic", lambda: now[0])
    rate = WorkRate()
    for seconds, done in ((0.0, 10), (40.0, 20), (41.0, 30), (42.0, 40)):
        now[0] = seconds
        rate.report(done)
    assert rate.per_second == pytest.approx(10.0)
    rate.report(5)
    assert rate.per_second is None
