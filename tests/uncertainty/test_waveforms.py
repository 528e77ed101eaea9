"""What a tracked waveform says of a beam: the truth is found, intervals cover, nothing beyond its horizon counts."""

from __future__ import annotations

import covering
import numpy as np
import pytest

import snapbeam as sb
from snapbeam.model import default_values
from snapbeam.model.parameter_axes import unit_of
from snapbeam.util.validation import InputError, InputTypeError

PRIOR = {"thickness": 0.03, "buckling_level": 0.03, "contact_stiffness": 0.3}
CYCLES, ERROR = 4, 5e-6


def nominal_system(modes: int = 1, velocity: float = 0.12) -> sb.System:
    model = sb.ReducedModel.from_beam(default_values.BEAM, modes, damping_ratio=0.005)
    shaker = sb.Shaker(frequency_ratio=1.4, velocity_amplitude=velocity, location=0.3)
    return sb.System(model, contacts=[sb.Contact(default_values.CONTACT, shaker)])


def measured(nominal: sb.System, logs: np.ndarray, draw: np.random.Generator) -> sb.uncertainty.Waveform:
    """The motion of another beam under the same shaker, with errors."""
    h, b, k = np.exp(logs)
    other = nominal.replace(
        **{
            "beam.thickness": h * default_values.BEAM.thickness,
            "beam.buckling_level": b * default_values.BEAM.buckling_level,
            "contact.stiffness": k * default_values.CONTACT.stiffness,
        }
    )
    drive = {}
    for name, unit in (("frequency_ratio", "frequency_hz"), ("velocity_amplitude", "velocity_m_s")):
        share = unit_of(nominal, f"drive.{unit}") / unit_of(other, f"drive.{unit}")
        drive[f"drive.{name}"] = getattr(nominal.striker.drive, name) * share
    period = 1.0 / (1.4 * unit_of(nominal, "drive.frequency_hz"))
    times = np.linspace(0.0, CYCLES * period * (1.0 - 1e-9), 40 * CYCLES)
    other = other.replace(**drive)
    run = sb.simulate(other, sb.Integration(cycles=CYCLES, accuracy="reference"), sample_times=times)
    seen = run.dataset.displacement_at_striker.values * other.scale.length + ERROR * draw.standard_normal(times.size)
    return sb.uncertainty.Waveform(system=nominal, time=times, displacement=seen, standard_error=ERROR)


def found(waveform: sb.uncertainty.Waveform, seed: int = 0) -> sb.uncertainty.Posterior:
    return sb.uncertainty.estimate_posterior(
        None, default_values.BEAM, PRIOR, waveforms=waveform, samples=200, rng=seed
    )


@pytest.mark.slow
def test_the_beam_and_the_contact_are_found() -> None:
    nominal, draw = nominal_system(), np.random.default_rng(3)
    logs = np.array([0.02, -0.015, 0.2])
    said = found(measured(nominal, logs, draw))
    assert said.effective_sample_size > 100.0
    assert said.parameters == ("beam.thickness", "beam.buckling_level", "contact.stiffness")
    truth = np.exp(logs) * [
        default_values.BEAM.thickness,
        default_values.BEAM.buckling_level,
        default_values.CONTACT.stiffness,
    ]
    for (middle, low, high), value, known in zip(said.interval(0.99).values(), truth, PRIOR.values(), strict=True):
        assert low < value < high
        assert (high - low) / middle < 5.15 * known
    middle, low, high = said.interval()["beam.buckling_level"]
    assert (high - low) / middle < 0.005


@pytest.mark.slow
def test_intervals_cover() -> None:
    """Beams and contacts from the prior: 95 % intervals hold the truth as often as they say; more trials are stored."""
    counted = covering.waveforms(20)
    assert counted.trials >= 17 and counted.all >= 0.85, counted


def test_what_is_beyond_the_horizon_does_not_count() -> None:
    nominal = nominal_system(modes=8, velocity=0.3)
    period = 1.0 / (1.4 * unit_of(nominal, "drive.frequency_hz"))
    times = np.linspace(0.0, 30 * period * (1.0 - 1e-9), 600)
    seen = np.zeros(times.size)
    seen[3] = np.nan
    near = sb.uncertainty.Waveform(system=nominal, time=times, displacement=seen, standard_error=1e-6)
    far = sb.uncertainty.Waveform(system=nominal, time=times, displacement=seen, standard_error=1e-6, drive_error=1e-6)
    assert period < near.horizon < far.horizon < 30 * period
    assert not near.used[3] and not near.used[times > near.horizon].any()
    with pytest.raises(InputError, match="nothing of the waveform can be known so well"):
        _ = sb.uncertainty.Waveform(system=nominal, time=times, displacement=seen, standard_error=1e-13).horizon


def test_from_a_tracked_run() -> None:
    nominal = nominal_system()
    run = sb.simulate(nominal, sb.Integration(cycles=2))
    for at in ("striker", "midspan"):
        waveform = sb.uncertainty.Waveform.from_dataset(run.dataset, nominal, 1e-6, at=at)
        assert np.abs(waveform.misfit({})).max() < 1e-6
    with pytest.raises(InputError, match="has no displacement"):
        sb.uncertainty.Waveform.from_dataset(run.dataset.drop_vars("displacement_at_striker"), nominal, 1e-6)


def test_refusals() -> None:
    nominal = nominal_system()
    given = {"system": nominal, "time": [0.0, 1e-3], "displacement": [0.0, 0.0], "standard_error": 1e-6}
    for change, words in (
        ({"system": nominal.replace(contacts=[])}, "must have a striker with a sine"),
        ({"time": [1e-3, 0.0]}, "ascending"),
        ({"displacement": [0.0]}, "must hold a number, or NaN, for each time"),
        ({"standard_error": 0.0}, "standard_error"),
        ({"at": "end"}, "at = 'end'"),
    ):
        with pytest.raises(InputError, match=words):
            sb.uncertainty.Waveform(**{**given, **change})
    waveform = sb.uncertainty.Waveform(**given)
    with pytest.raises(InputError, match="measured = None: give measurements, waveforms, or both"):
        sb.uncertainty.estimate_posterior(None, default_values.BEAM, PRIOR)
    with pytest.raises(InputTypeError, match="waveforms = 3"):
        sb.uncertainty.estimate_posterior(None, default_values.BEAM, PRIOR, waveforms=3)
    with pytest.raises(InputError, match="contact_stiffness must be one of"):
        from test_posterior import measured_of

        sb.uncertainty.estimate_posterior(measured_of(default_values.BEAM), default_values.BEAM, PRIOR)
    with pytest.raises(InputError, match="contact_stiffness is measured by itself"):
        sb.uncertainty.estimate_posterior(
            measured_of(default_values.BEAM), default_values.BEAM, PRIOR, waveforms=waveform
        )
