"""A recorded motion of the shaker as the drive."""

import numpy as np
import pytest

import snapbeam as sb
from snapbeam.model import default_values

RATE = 20_000.0


@pytest.fixture(scope="module")
def model():
    return sb.ReducedModel.from_beam(default_values.BEAM, modes=4)


def sine_record(model, ratio, amplitude, cycles, side="below"):
    first = model.reference_frequency
    frequency = ratio * first
    omega = 2.0 * np.pi * frequency
    stroke = amplitude * model.length_scale * first / frequency
    sign = 1.0 if side == "below" else -1.0
    t = np.arange(int((cycles + 0.5) / frequency * RATE)) / RATE
    return sb.Striker(
        drive=sb.RecordedMotion(
            displacement=sign * stroke * np.sin(omega * t),
            velocity=sign * stroke * omega * np.cos(omega * t),
            sampling_frequency=RATE,
            frequency=frequency,
        ),
        side=side,
    )


@pytest.mark.slow
@pytest.mark.parametrize("side", ["below", "above"])
def test_a_recorded_sine_is_the_sinusoidal_shaker(model, side):
    shaker = sb.Shaker(frequency_ratio=1.21, velocity_amplitude=0.05, side=side)
    times = np.linspace(0.0, 7.9 / (1.21 * model.reference_frequency), 900)
    exact = sb.simulate(
        sb.System(model, contacts=[sb.Contact(default_values.CONTACT, shaker)]),
        sb.Integration(cycles=8),
        sample_times=times,
    )
    drive = sine_record(model, 1.21, 0.05, 8, side)
    run = sb.simulate(
        sb.System(model, contacts=[sb.Contact(default_values.CONTACT, drive)]),
        sb.Integration(cycles=8),
        sample_times=times,
    )
    assert run.summary.impacts == exact.summary.impacts
    for name, bound in (("displacement_at_striker", 1e-5), ("striker_displacement", 1e-8)):
        assert float(abs(run.dataset[name] - exact.dataset[name]).max()) < bound


def test_the_whole_record_is_the_default_and_more_is_refused(model):
    drive = sine_record(model, 1.0, 0.05, 3)
    run = sb.simulate(sb.System(model, contacts=[sb.Contact(default_values.CONTACT, drive)]))
    assert run.dataset.attrs["cycles"] == pytest.approx(drive.drive.duration * drive.drive.frequency)
    assert run.dataset.attrs["drive_type"] == "recorded_motion"
    with pytest.raises(sb.InputError, match=r"cycles = 9.*at most the 3\.\d cycles"):
        sb.simulate(sb.System(model, contacts=[sb.Contact(default_values.CONTACT, drive)]), sb.Integration(cycles=9))


def test_the_energy_balance_closes(model):
    drive = sine_record(model, 1.21, 0.18, 6)
    ds = sb.simulate(
        sb.System(model, contacts=[sb.Contact(default_values.CONTACT, drive)]), sb.Integration(cycles=6)
    ).dataset
    residual = ds.energy_beam + ds.energy_contact + ds.energy_dissipated - ds.striker_work
    assert float(abs(residual).max()) < 1e-4 * ds.attrs["gross_work"]


def test_bad_records_are_refused():
    wave = np.sin(np.linspace(0.0, 6.0, 50))
    good = {"sampling_frequency": 100.0, "frequency": 1.0}
    with pytest.raises(sb.InputError, match="does not belong to displacement"):
        sb.Striker(drive=sb.RecordedMotion(displacement=wave, velocity=wave, **good))
    with pytest.raises(sb.InputError, match="at least 4 samples"):
        sb.Striker(drive=sb.RecordedMotion(displacement=wave, velocity=wave[:-1], **good))
    with pytest.raises(sb.InputError, match="must be finite"):
        sb.Striker(drive=sb.RecordedMotion(displacement=np.full(9, np.nan), velocity=np.zeros(9), **good))


@pytest.mark.slow
def test_samples_reach_the_end_of_the_last_cycle_whatever_ticks_it_lies_between(tmp_path):
    """A run ends on a tick: up to 1.4e-9 of its length from the end of the cycles that are asked for."""
    model = sb.ReducedModel.from_beam(default_values.BEAM, modes=1, damping_ratio=0.03)
    for ratio in np.linspace(0.9, 1.6, 15):
        drive = sine_record(model, ratio, 0.01, 3)
        times = np.linspace(0.0, 2.0 / drive.drive.frequency, 41)
        system = sb.System(model, contacts=[sb.Contact(default_values.CONTACT, drive)])
        run = sb.simulate(system, sb.Integration(cycles=2), sample_times=times)
        assert run.dataset["time"].values == pytest.approx(times, abs=1e-8 * times[-1])
        run.save(tmp_path / f"{ratio}.nc", content="states")
        stored = sb.load(tmp_path / f"{ratio}.nc")
        assert stored.dataset["cycle"].values == pytest.approx([0.0, 1.0, 2.0], abs=1e-8)
