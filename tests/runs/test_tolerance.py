"""Error on request: what is asked is what is measured, as far as the conditioning allows."""

from __future__ import annotations

import json
import warnings

import numpy as np
import pytest

import snapbeam as sb
from snapbeam import paper
from snapbeam.engines.assemble import make_ensemble, plans_of
from snapbeam.engines.cpu import driver as cpu_engine
from snapbeam.runs.samples import joined
from snapbeam.runs.tolerance import PERTURBATION

CONTACT = sb.HertzContact(stiffness=4e8)
CYCLES = 4


def model_of(modes: int) -> sb.ReducedModel:
    return sb.ReducedModel.from_beam(paper.BEAM, modes=modes, damping_ratio=0.005)


def shaker_at(omega: float, speed: float, **given) -> sb.Shaker:
    return sb.Shaker(frequency_ratio=omega, velocity_amplitude=speed, location=1 / 2.1, **given)


def both(run: sb.Run) -> np.ndarray:
    return np.column_stack((run.dataset.displacement, run.dataset.center_displacement))


@pytest.mark.parametrize("tolerance", [1e-3, 1e-6])
@pytest.mark.parametrize(
    ("modes", "omega", "speed"),
    [(1, 1.21, 0.18), (1, 0.7, 0.4), (8, 1.625, 0.3), (8, 0.7, 0.4), (32, 1.21, 0.18), (32, 3.0, 0.5)],
)
def test_error_is_within_the_request(modes: int, omega: float, speed: float, tolerance: float) -> None:
    """Against order 6 at a third of the step or less, at the contact point and at the centre."""
    model, shaker = model_of(modes), shaker_at(omega, speed)
    times = np.linspace(0.0, CYCLES / (omega * model.reference_freq), 30 * CYCLES + 1)
    run = sb.simulate(model, shaker, CONTACT, CYCLES, tolerance=tolerance, sample_times=times)
    assert run.accuracy is not None
    assert run.accuracy.reached
    assert run.accuracy.horizon == pytest.approx(times[-1])
    assert run.accuracy.estimated_error <= tolerance
    fine = sb.simulate(model, shaker, CONTACT, CYCLES, accuracy="reference", sample_times=times)
    if run.accuracy.step / 3.0 < fine.dataset.attrs["step"]:
        fine = sb.simulate(model, shaker, CONTACT, CYCLES, tolerance=1e-9, sample_times=times)
    assert np.abs(both(run) - both(fine)).max() <= tolerance


def test_chaos_shortens_the_horizon() -> None:
    """N = 8 at (0.3, 0.2): a change of V by 1e-13 is felt by the whole beam within five cycles."""
    model, shaker = model_of(8), shaker_at(0.3, 0.2)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)
        run = sb.simulate(model, shaker, CONTACT, 5, tolerance=1e-6, sample_times=[0.01])
    found = run.accuracy
    assert found is not None
    assert found.conditioning > 1e-3
    assert 0.0 < found.horizon < 0.5 * 5 / (0.3 * model.reference_freq)
    assert found.estimated_error <= 1e-6
    separation = sb.conditioning(model, shaker, CONTACT, 5)
    late = separation.separation.sel(time=slice(2.0 * found.horizon, None))
    assert float(late.max()) > 1e-7


def test_a_request_beyond_reach_is_said(monkeypatch) -> None:
    """What the finest steps do not meet is a warning and a shorter horizon, not a claim."""
    monkeypatch.setattr("snapbeam.runs.tolerance._FINE", (("map", 1.0),))
    monkeypatch.setattr("snapbeam.runs.tolerance._ROUGH", (("map", 4.0), ("map", 2.0)))
    model, shaker = model_of(8), shaker_at(0.7, 0.4)
    with pytest.warns(RuntimeWarning, match="met only up to"):
        run = sb.simulate(model, shaker, CONTACT, 5, tolerance=5e-5, sample_times=[0.01])
    assert run.accuracy is not None
    assert not run.accuracy.reached
    assert run.accuracy.estimated_error <= 5e-5
    assert run.accuracy.horizon < 5 / (0.7 * model.reference_freq)


def test_named_levels() -> None:
    """(1.21, 0.18), 32 modes, five cycles: map within 1e-3, reference within 1e-8."""
    model, shaker = model_of(32), shaker_at(1.21, 0.18)
    times = np.linspace(0.0, 5 / (1.21 * model.reference_freq), 101)
    given = {"cycles": 5, "sample_times": times}
    levels = {
        name: sb.simulate(model, shaker, CONTACT, accuracy=name, **given) for name in ("map", "reference")
    }
    step = levels["reference"].dataset.attrs["step"]
    system, asked = sb.System(model, CONTACT, shaker), sb.Integration(cycles=5, accuracy="reference")
    (plan,) = plans_of(system, asked, {})
    assert plan.step == pytest.approx(step)
    ensemble = make_ensemble(system, asked, plan=plan._replace(step=0.5 * step))
    recorded = joined(list(cpu_engine.record(ensemble, times, False)))
    alpha = ensemble.structure.amplitudes(recorded.q)
    truth = alpha @ model.shape_at(1 / 2.1) / model.length_scale
    assert np.abs(levels["map"].dataset.displacement.values - truth).max() < 1e-3
    assert np.abs(levels["reference"].dataset.displacement.values - truth).max() < 1e-8


def test_report_travels_with_the_run() -> None:
    model = model_of(2)
    run = sb.simulate(model, shaker_at(1.21, 0.18), CONTACT, 2, tolerance=1e-4)
    assert run.accuracy is not None
    attrs = run.dataset.attrs
    assert attrs["accuracy_tolerance"] == 1e-4
    assert attrs["accuracy_reached"] == 1
    assert attrs["step"] == run.accuracy.step
    assert attrs["order"] == run.accuracy.order
    json.dumps(attrs)
    assert sb.simulate(model, shaker_at(1.21, 0.18), CONTACT, 2).accuracy is None


def test_mirror_image_is_judged_alike() -> None:
    model = model_of(4)
    below = sb.simulate(model, shaker_at(1.625, 0.3), CONTACT, 2, tolerance=1e-5, sample_times=[0.01])
    above = sb.simulate(
        model, shaker_at(1.625, 0.3, side="above"), CONTACT, 2, tolerance=1e-5, sample_times=[0.01]
    )
    assert below.accuracy == above.accuracy


def test_free_vibration() -> None:
    """Without a shaker the start is what is perturbed."""
    model = model_of(4)
    start = (0.9 * np.asarray(model.equilibrium), np.zeros(4))
    run = sb.simulate(model, cycles=3, initial_state=start, tolerance=1e-8, sample_times=[0.01])
    assert run.accuracy is not None
    assert run.accuracy.reached
    assert 0.0 < run.accuracy.conditioning < 1e-11


def test_conditioning_is_a_growing_response() -> None:
    """It grows in time, is linear in a small perturbation, and zero where nothing is driven."""
    model, shaker = model_of(2), shaker_at(1.21, 0.18)
    small = sb.conditioning(model, shaker, CONTACT, 3, perturbation=1e-9)
    large = sb.conditioning(model, shaker, CONTACT, 3, perturbation=1e-8)
    assert (np.diff(small.separation) >= 0.0).all()
    assert float(large.separation[-1]) == pytest.approx(10.0 * float(small.separation[-1]), rel=0.02)
    assert small.separation.attrs["units"] == "1"
    assert small.attrs["perturbation"] == 1e-9
    assert sb.conditioning(model, shaker, CONTACT, 1).attrs["perturbation"] == PERTURBATION


@pytest.mark.parametrize("given", [{"step": 1e-5}, {"accuracy": "reference"}])
def test_tolerance_excludes_a_step(given: dict) -> None:
    with pytest.raises(sb.InputError, match="give one"):
        sb.simulate(model_of(1), shaker_at(1.21, 0.18), CONTACT, 1, tolerance=1e-3, **given)


@pytest.mark.parametrize("tolerance", [0.0, -1e-3, 1e-12, 0.5, float("nan"), "tight"])
def test_refuses_tolerances_out_of_range(tolerance) -> None:
    with pytest.raises(sb.InputError, match="tolerance"):
        sb.simulate(model_of(1), shaker_at(1.21, 0.18), CONTACT, 1, tolerance=tolerance)
