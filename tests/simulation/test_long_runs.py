"""Runs that may take over a minute say so before they begin."""

from __future__ import annotations

import subprocess
import sys
import warnings

import numpy as np
import pytest

import snapbeam as sb
from snapbeam.model import default_values
from snapbeam.simulation.simulate import prepared
from snapbeam.solver.step_size import long_run, long_sweep
from snapbeam.util.cores import usable_cores
from snapbeam.util.diagnostics import DiagnosticWarning


def announced(stiffness=default_values.CONTACT.stiffness, damping_ratio=0.005, frequency_ratio=1.2, **integration):
    """Warnings of a run that is prepared and not begun."""
    model = sb.ReducedModel.from_beam(default_values.BEAM, modes=1, damping_ratio=damping_ratio)
    shaker = sb.Shaker(frequency_ratio=frequency_ratio, velocity_amplitude=0.18)
    system = sb.System(model, contacts=[sb.Contact(sb.HertzContact(stiffness), shaker)])
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        run = prepared(system, sb.Integration(**integration), None)
    words = [str(each.message) for each in said if each.category is DiagnosticWarning]
    return [text for text in words if text.startswith("the run has")], run


@pytest.mark.parametrize(
    "given",
    [
        {"stiffness": 3e27, "cycles": 2},
        {"stiffness": 1e20, "cycles": 1000},
        {"step": 1e-9, "cycles": 40},
        {"stiffness": 1e20, "frequency_ratio": 1e-3, "cycles": 1},
    ],
    ids=["stiff", "many cycles", "short steps", "slow drive"],
)
def test_a_long_run_is_announced(given):
    (text,), run = announced(**given)
    steps = float(run.ensemble.runs["end"][0]) / 2**20
    assert f"{steps:.3g} steps" in text and ("minutes" in text or "hours" in text)


def test_a_short_run_is_not_announced():
    assert announced(cycles=50)[0] == [] and announced(stiffness=1e20, cycles=2)[0] == []


def test_the_bound_grows_with_steps_and_modes():
    assert long_run(1, 1e-5, 1e6, "") == [] and long_run(500, 1e-5, 1e5, "") == []
    assert long_run(1, 1e-5, 3e8, "")[0].numbers["seconds"] > 60.0
    assert long_run(500, 1e-5, 3e6, "")[0].numbers["seconds"] > 60.0
    assert not long_run(1, 1e-5, 1e6, "") and long_run(1, 1e-5, float("inf"), "")


@pytest.mark.slow
def test_the_command_says_it_before_the_run(tmp_path):
    words = ["simulate", "--modes", "1", "--cycles", "50000", "--contact-stiffness", "1e15", "-o", "a.nc"]
    with subprocess.Popen(
        [sys.executable, "-m", "snapbeam", *words], cwd=tmp_path, stderr=subprocess.PIPE, text=True
    ) as process:
        assert process.stderr is not None
        try:
            lines = iter(process.stderr.readline, "")
            assert any("note: the run has" in line for line in lines), "the run ended, or began, without a word"
        finally:
            process.kill()


def sweep_announced(compute, **integration):
    """Announcement of a sweep that ends before its first run."""

    class Begun(Exception):
        pass

    def begun(*numbers, **named):
        raise Begun

    model = sb.ReducedModel.from_beam(default_values.BEAM, modes=1, damping_ratio=0.005)
    shaker = sb.Shaker(frequency_ratio=1.2, velocity_amplitude=0.18)
    system = sb.System(model, contacts=[sb.Contact(default_values.CONTACT, shaker)])
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        with pytest.raises(Begun), pytest.MonkeyPatch.context() as patch:
            patch.setattr("snapbeam.sweeps.setup.SweepSetup.integrate", begun)
            patch.setattr("snapbeam.dynamics.lifetimes.LifetimeWork.compute", begun)
            patch.setattr("snapbeam.util.diagnostics._told", set())  # the same words are told once
            compute(system, sb.Integration(**integration))
    words = [str(each.message) for each in said if each.category is DiagnosticWarning]
    return [text for text in words if "runs of" in text]


SPEEDS, RATIOS = np.linspace(0.05, 0.6, 60), np.linspace(0.3, 3.0, 60)


@pytest.mark.parametrize("threads", [1, None])
def test_a_long_map_and_a_long_threshold_are_announced(threads):
    def field(system, integration):
        return sb.sweep(system, {"frequency_ratio": RATIOS, "velocity_amplitude": SPEEDS}, integration)

    def limit(system, integration):
        return sb.threshold(system, "velocity_amplitude", SPEEDS, {"frequency_ratio": RATIOS}, integration)

    for compute in (field, limit):
        (text,) = sweep_announced(compute, cycles=20_000, threads=threads)
        assert "3600 runs of" in text and f"on {threads or usable_cores()} core" in text
        assert sweep_announced(compute, cycles=5, threads=threads) == []


def test_long_lifetimes_and_probabilities_are_announced():
    """Also the runs from many initial conditions, and the samples of a probability map."""

    def lifetimes(system, integration):
        axes = {"frequency_ratio": RATIOS[:20]}
        return sb.dynamics.lifetime_map(
            system, axes, integration, initial_conditions=50,
            settings=sb.dynamics.LifetimeSettings(settling_cycles=2),
        )  # fmt: skip

    def probabilities(system, integration):
        of = {"contact.stiffness": sb.uncertainty.Normal(0.1, relative=True)}
        plan = sb.uncertainty.SamplingPlan(half_width=None, initial_runs=50)
        return sb.uncertainty.probability_map(
            system,
            {"frequency_ratio": RATIOS[:20]},
            sb.uncertainty.ParameterUncertainty(of=of),
            plan,
            integration=integration,
        )

    for compute in (lifetimes, probabilities):
        (text,) = sweep_announced(compute, cycles=40_000, threads=1)
        assert "1000 runs of" in text and "on 1 core" in text
        assert sweep_announced(compute, cycles=5, threads=1) == []


def test_the_time_of_a_map_falls_with_cores():
    one, four = (long_sweep(1000, 1e6, 1.0, cores)[0].numbers["seconds"] for cores in (1, 4))
    assert one == 4.0 * four and long_sweep(10, 1e6, 1.0, 1) == []
