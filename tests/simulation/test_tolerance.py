"""Error on request: what is asked is what is measured, as far as the conditioning allows."""

from __future__ import annotations

import json
import warnings

import numpy as np
import pytest

import snapbeam as sb
from snapbeam.model import default_values
from snapbeam.simulation.dataset import joined
from snapbeam.simulation.tolerance import PERTURBATION, _perturbed
from snapbeam.solver import native
from snapbeam.solver.assemble import make_ensemble, plans_of, run_columns

CONTACT = sb.HertzContact(stiffness=4e8)
CYCLES = 4


def model_of(modes: int) -> sb.ReducedModel:
    return sb.ReducedModel.from_beam(default_values.BEAM, modes=modes, damping_ratio=0.005)


def shaker_at(omega: float, speed: float, **given) -> sb.Shaker:
    return sb.Shaker(frequency_ratio=omega, velocity_amplitude=speed, location=1 / 2.1, **given)


def both(run: sb.Run) -> np.ndarray:
    return np.column_stack((run.dataset.displacement_at_striker, run.dataset.midspan_displacement))


@pytest.mark.sampled(3)
@pytest.mark.parametrize("tolerance", [1e-3, 1e-6])
@pytest.mark.parametrize(
    ("modes", "omega", "speed"),
    [(1, 1.21, 0.18), (1, 0.7, 0.4), (8, 1.625, 0.3), (8, 0.7, 0.4), (32, 1.21, 0.18), (32, 3.0, 0.5)],
)
def test_error_is_within_the_request(modes: int, omega: float, speed: float, tolerance: float) -> None:
    """Against order 6 at a third of the step or less, at the contact point and at the centre."""
    model, shaker = model_of(modes), shaker_at(omega, speed)
    times = np.linspace(0.0, CYCLES / (omega * model.reference_frequency), 30 * CYCLES + 1)
    run = sb.simulate(
        sb.System(model, contacts=[sb.Contact(CONTACT, shaker)]),
        sb.Integration(cycles=CYCLES, tolerance=tolerance),
        sample_times=times,
    )
    assert run.accuracy is not None
    assert run.accuracy.reached
    assert run.accuracy.predictability_horizon == pytest.approx(times[-1])
    assert run.accuracy.estimated_error <= tolerance
    fine = sb.simulate(
        sb.System(model, contacts=[sb.Contact(CONTACT, shaker)]),
        sb.Integration(cycles=CYCLES, accuracy="reference"),
        sample_times=times,
    )
    if run.accuracy.step / 3.0 < fine.dataset.attrs["step"]:
        fine = sb.simulate(
            sb.System(model, contacts=[sb.Contact(CONTACT, shaker)]),
            sb.Integration(cycles=CYCLES, tolerance=1e-9),
            sample_times=times,
        )
    assert np.abs(both(run) - both(fine)).max() <= tolerance


def test_chaos_shortens_the_horizon() -> None:
    """N = 8 at (0.3, 0.2): a change of V by 1e-13 is felt by the whole beam within five cycles."""
    model, shaker = model_of(8), shaker_at(0.3, 0.2)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)
        run = sb.simulate(
            sb.System(model, contacts=[sb.Contact(CONTACT, shaker)]),
            sb.Integration(cycles=5, tolerance=1e-6),
            sample_times=[0.01],
        )
    found = run.accuracy
    assert found is not None
    assert found.perturbation_growth > 1e-3
    assert 0.0 < found.predictability_horizon < 0.5 * 5 / (0.3 * model.reference_frequency)
    assert found.estimated_error <= 1e-6
    separation = sb.perturbation_growth(
        sb.System(model, contacts=[sb.Contact(CONTACT, shaker)]), sb.Integration(cycles=5)
    )
    late = separation.separation.sel(time=slice(2.0 * found.predictability_horizon, None))
    assert float(late.max()) > 1e-7


def test_a_request_beyond_reach_is_said(monkeypatch) -> None:
    """What the finest steps do not meet is a warning and a shorter horizon, not a claim."""
    monkeypatch.setattr("snapbeam.simulation.tolerance._FINE", (("standard", 1.0),))
    monkeypatch.setattr("snapbeam.simulation.tolerance._ROUGH", (("standard", 4.0), ("standard", 2.0)))
    model, shaker = model_of(8), shaker_at(0.7, 0.4)
    with pytest.warns(RuntimeWarning, match="met only up to"):
        run = sb.simulate(
            sb.System(model, contacts=[sb.Contact(CONTACT, shaker)]),
            sb.Integration(cycles=5, tolerance=5e-5),
            sample_times=[0.01],
        )
    assert run.accuracy is not None
    assert not run.accuracy.reached
    assert run.accuracy.estimated_error <= 5e-5
    assert run.accuracy.predictability_horizon < 5 / (0.7 * model.reference_frequency)


def test_named_levels() -> None:
    """(1.21, 0.18), 32 modes, five cycles: standard within 1e-3, reference within 1e-8."""
    model, shaker = model_of(32), shaker_at(1.21, 0.18)
    times = np.linspace(0.0, 5 / (1.21 * model.reference_frequency), 101)
    system = sb.System(model, contacts=[sb.Contact(CONTACT, shaker)])
    levels = {
        name: sb.simulate(system, sb.Integration(cycles=5, accuracy=name), sample_times=times)
        for name in ("standard", "reference")
    }
    step = levels["reference"].dataset.attrs["step"]
    reference = sb.Integration(cycles=5, accuracy="reference")
    (plan,) = plans_of(system, reference, run_columns(system, {}))
    assert 0.9 * plan.step < step <= plan.step  # fitted to the cycle
    ensemble = make_ensemble(system, reference, plan=plan._replace(step=0.5 * step))
    recorded = joined(list(native.record(ensemble, times, False)))
    alpha = ensemble.structure.amplitudes(recorded.q)
    truth = alpha @ model.shape_at(1 / 2.1) / model.length_scale
    assert np.abs(levels["standard"].dataset.displacement_at_striker.values - truth).max() < 1e-3
    assert np.abs(levels["reference"].dataset.displacement_at_striker.values - truth).max() < 1e-8


def test_report_travels_with_the_run() -> None:
    model = model_of(2)
    run = sb.simulate(
        sb.System(model, contacts=[sb.Contact(CONTACT, shaker_at(1.21, 0.18))]),
        sb.Integration(cycles=2, tolerance=1e-4),
    )
    assert run.accuracy is not None
    attrs = run.dataset.attrs
    assert attrs["accuracy_tolerance"] == 1e-4
    assert attrs["accuracy_reached"] == 1
    assert attrs["step"] == run.accuracy.step
    assert attrs["order"] == run.accuracy.order
    json.dumps(attrs)
    assert (
        sb.simulate(
            sb.System(model, contacts=[sb.Contact(CONTACT, shaker_at(1.21, 0.18))]), sb.Integration(cycles=2)
        ).accuracy
        is None
    )


def test_mirror_image_is_judged_alike() -> None:
    model = model_of(4)
    below = sb.simulate(
        sb.System(model, contacts=[sb.Contact(CONTACT, shaker_at(1.625, 0.3))]),
        sb.Integration(cycles=2, tolerance=1e-5),
        sample_times=[0.01],
    )
    above = sb.simulate(
        sb.System(model, contacts=[sb.Contact(CONTACT, shaker_at(1.625, 0.3, side="above"))]),
        sb.Integration(cycles=2, tolerance=1e-5),
        sample_times=[0.01],
    )
    assert below.accuracy == above.accuracy


def test_free_vibration() -> None:
    """Without a shaker the start is what is perturbed."""
    model = model_of(4)
    start = (0.9 * np.asarray(model.well_amplitude), np.zeros(4))
    run = sb.simulate(
        sb.System(model, initial_state=sb.State(amplitude=start[0], velocity=start[1])),
        sb.Integration(cycles=3, tolerance=1e-8),
        sample_times=[0.01],
    )
    assert run.accuracy is not None
    assert run.accuracy.reached
    assert 0.0 < run.accuracy.perturbation_growth < 1e-11


def test_conditioning_is_a_growing_response() -> None:
    """It grows in time, is linear in a small perturbation, and zero where nothing is driven."""
    model, shaker = model_of(2), shaker_at(1.21, 0.18)
    small = sb.perturbation_growth(
        sb.System(model, contacts=[sb.Contact(CONTACT, shaker)]), sb.Integration(cycles=3), perturbation=1e-9
    )
    large = sb.perturbation_growth(
        sb.System(model, contacts=[sb.Contact(CONTACT, shaker)]), sb.Integration(cycles=3), perturbation=1e-8
    )
    assert (np.diff(small.separation) >= 0.0).all()
    assert float(large.separation[-1]) == pytest.approx(10.0 * float(small.separation[-1]), rel=0.02)
    assert small.separation.attrs["units"] == "1"
    assert small.attrs["perturbation"] == 1e-9
    assert (
        sb.perturbation_growth(
            sb.System(model, contacts=[sb.Contact(CONTACT, shaker)]), sb.Integration(cycles=1)
        ).attrs["perturbation"]
        == PERTURBATION
    )


@pytest.mark.parametrize("given", [{"step": 1e-5}, {"accuracy": "reference"}])
def test_tolerance_excludes_a_step(given: dict) -> None:
    with pytest.raises(sb.InputError, match="give one"):
        sb.Integration(cycles=1, tolerance=1e-3, **given)


@pytest.mark.parametrize("tolerance", [0.0, -1e-3, 1e-12, 0.5, float("nan"), "tight"])
def test_refuses_tolerances_out_of_range(tolerance) -> None:
    with pytest.raises(sb.InputError, match="tolerance"):
        sb.simulate(
            sb.System(model_of(1), contacts=[sb.Contact(CONTACT, shaker_at(1.21, 0.18))]),
            sb.Integration(cycles=1, tolerance=tolerance),
        )


MOTIONS: dict[str, sb.Drive] = {
    "sine": sb.Sine(frequency_ratio=1.2, velocity_amplitude=0.2, phase=0.4),
    "by its displacement": sb.DisplacementSine(frequency_ratio=1.2, displacement_amplitude=0.2),
    "two sines": sb.Sine(frequency_ratio=1.2, velocity_amplitude=0.2)
    + sb.Sine(frequency_ratio=2.0, velocity_amplitude=0.1),
    "burst": sb.Burst(frequency_ratio=1.2, velocity_amplitude=0.2, duration_cycles=3.0, retraction=0.1),
    "chirp": sb.Chirp(start_ratio=0.8, stop_ratio=1.5, velocity_amplitude=0.2, sweep_cycles=5.0),
    "shock": sb.HalfSine(displacement_amplitude=0.3, duration=0.5),
    "noise": sb.BandLimitedNoise(low_ratio=0.5, high_ratio=2.0, velocity_rms=0.1),
    "flight": sb.ConstantVelocity(speed=0.1),
    "sum": sb.Sine(frequency_ratio=1.2, velocity_amplitude=0.2, phase=0.4)
    + sb.HalfSine(displacement_amplitude=0.3, duration=0.5),
}


def moved(system: sb.System, size: float | None, times: np.ndarray) -> np.ndarray:
    """Displacements of the tip, its drive changed by a relative *size*."""
    ensemble = make_ensemble(system, sb.Integration(cycles=1))
    ensemble = ensemble if size is None else _perturbed(ensemble, system, size)
    recorded = joined(list(native.record(ensemble, times, False)))
    return recorded.contacts[:, 0, 0] + recorded.q @ ensemble.contact_rows[0] - float(ensemble.runs["offset"][0, 0])


@pytest.mark.parametrize("name", MOTIONS)
@pytest.mark.parametrize("beside", [False, True])
def test_every_motion_is_changed(name: str, beside: bool) -> None:
    """What a run makes of a change of its drive is asked of every drive, alone and beside others; some stood still."""
    base = sb.BaseExcitation(motion=sb.AccelerationSine(frequency_ratio=0.9, acceleration_amplitude=0.1))
    striker = sb.Striker(drive=MOTIONS[name], gap=0.0)
    system = sb.System(model_of(1), contacts=[sb.Contact(CONTACT, striker)], base_excitation=base if beside else None)
    times = np.linspace(0.0, 0.012, 25)
    before, after = moved(system, None, times), moved(system, 0.5, times)
    assert np.ptp(before) > 0.0
    np.testing.assert_allclose(after, 1.5 * before, rtol=1e-9, atol=1e-15)


def test_all_that_drives_is_changed() -> None:
    """A base under a stop, a load, a second striker: the numbers of each."""
    stop = sb.Striker(drive=sb.FixedStop(), gap=1e-4)
    around = {
        "base_excitation": sb.BaseExcitation(motion=MOTIONS["chirp"]),
        "axial_load": sb.AxialLoadModulation(motion=sb.RampForce(change=2.0, duration=3.0)),
    }
    second = sb.Striker(drive=MOTIONS["noise"], location=0.3, gap=1e-4)
    contacts = [sb.Contact(CONTACT, stop), sb.Contact(CONTACT, second)]
    system = sb.System(model_of(1), contacts=contacts, **around)
    ensemble = make_ensemble(system, sb.Integration(cycles=1))
    changed = _perturbed(ensemble, system, 0.5)
    np.testing.assert_allclose(changed.channels.uses, 1.5 * ensemble.channels.uses)
    np.testing.assert_array_equal(changed.starts, ensemble.starts)


def test_what_drives_nothing_changes_the_start() -> None:
    stop = sb.Striker(drive=sb.FixedStop(), gap=1e-4)
    start = sb.State(amplitude=[-1e-4])
    system = sb.System(model_of(1), contacts=[sb.Contact(CONTACT, stop)], initial_state=start)
    ensemble = make_ensemble(system, sb.Integration(cycles=1))
    np.testing.assert_array_equal(_perturbed(ensemble, system, 0.5).starts, 1.5 * ensemble.starts)
