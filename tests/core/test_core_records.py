"""Records, output states and restarts of the native core: what is asked for changes no bit of a run."""

from __future__ import annotations

import math
import threading

import numpy as np
import pytest
from core_systems import arrays, beam, crowded, stop, struck

import snapbeam as sb
from snapbeam import _core
from snapbeam.solver import native

HOW = sb.Integration(cycles=3, engine="native")


def simulated(system, **options):
    return sb.simulate(system, HOW, **options)


def same(one, other):
    return all(np.array_equal(one[name].values, other[name].values, equal_nan=True) for name in one.data_vars)


@pytest.mark.parametrize("modes", [1, 3, 16])
def test_a_run_in_pieces_is_the_run(modes, monkeypatch):
    """Full buffers and small budgets: the state goes on to the bit, and no instant is lost."""
    system = crowded(modes)
    times = np.linspace(0.0, 3.0 / (1.21 * beam(modes).reference_frequency), 2001) * (1.0 - 1e-13)
    whole = simulated(system, sample_times=times).dataset
    for samples, budget in ((400, 200_000), (20_000, 37)):
        monkeypatch.setattr(native, "_SAMPLES", samples)
        monkeypatch.setattr(native, "_BUDGET", budget)
        assert same(whole, simulated(system, sample_times=times).dataset)


@pytest.mark.sampled(3)
@pytest.mark.parametrize("modes", [1, 3, 16])
def test_a_run_is_the_point_of_a_sweep_whatever_is_sampled(modes):
    system = crowded(modes)
    swept = sb.sweep(system, {"drive.frequency_ratio": [1.21, 1.4]}, HOW)
    for times in (None, np.linspace(0.0, 0.01, 500)):
        summary = simulated(system, **({} if times is None else {"sample_times": times})).summary
        for name in swept.data_vars:
            own = dict(summary).get(str(name))
            if isinstance(own, (int, float)):
                found = float(swept[name].values[0])
                assert own == found or (math.isnan(own) and math.isnan(found)), name


@pytest.mark.parametrize("modes", [1, 3, 16])
def test_advanced_in_pieces(modes):
    """A state has everything: modes, well, times in contact."""
    system = struck(modes, stop(sb.KelvinVoigt(2e5, 1.0)))
    whole, state = sb.advance(system, periods=4, integration=HOW), None
    for _ in range(4):
        state = sb.advance(system, state, integration=HOW)
    assert state is not None
    np.testing.assert_array_equal(whole.amplitude, state.amplitude)
    np.testing.assert_array_equal(whole.velocity, state.velocity)


def test_impacts_are_those_of_the_summary():
    run = simulated(struck(8, stop(sb.HuntCrossley(3e8, 2.0))))
    table = run.impacts
    assert table.sizes["impact"] == run.summary.impacts > 3
    assert float(table.impulse.sum()) == pytest.approx(run.summary.impulse, rel=1e-12)
    assert table.peak_force.values.max() == pytest.approx(run.summary.peak_force)


def test_a_raised_error_stops_the_threads():
    """Progress may raise, as an interrupt does; what ran until then has the status of an interrupted run."""
    found = arrays(struck(16), 4000, {"drive.frequency_ratio": np.linspace(0.9, 1.2, 6)})

    def stop_at_once(done: int, runs: int) -> None:
        raise KeyboardInterrupt

    begun = threading.active_count()
    with pytest.raises(KeyboardInterrupt):
        _core.integrate(found.problem, found.batch, "modes", "", 2, stop_at_once)
    assert threading.active_count() == begun
    status = found.batch["statistics"][:, 0]
    assert set(status.tolist()) <= {2.0, -1.0} and 2.0 in status


@pytest.mark.filterwarnings("ignore::snapbeam.util.diagnostics.DiagnosticWarning")
def test_a_law_left_behind_ends_the_run():
    """Thrown into a magnet, the displacement leaves the range in which the law is valid."""
    model = beam(2)
    start = sb.State(amplitude=-model.well_amplitude, velocity=6.0 * model.well_amplitude * 500.0)
    magnet = sb.MagneticForce(strength=2e-10, gap=6e-4, location=0.5)
    summary = sb.simulate(sb.System(model, forces=[magnet], initial_state=start), HOW).summary
    assert summary.status is sb.RunStatus.DIVERGED
