"""Components of every drive: their sum is the motion that the drive's own formula gives."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import quad

import snapbeam as sb
from snapbeam.model.axial_load import HarmonicLoad, LoadRamp
from snapbeam.model.drive.base import Scale
from snapbeam.model.drive.components import Pieces, Tone

SCALE = Scale(length=2e-4, omega=500.0)
TIMES = np.arange(4000) / 1e4
RECORD = 3.0 * np.sin(700.0 * TIMES) + np.cos(330.0 * TIMES)
DRIVES = [
    sb.Sine(frequency_ratio=1.3, velocity_amplitude=0.2, phase=0.4),
    sb.DisplacementSine(frequency_ratio=0.7, displacement_amplitude=0.3),
    sb.TwoTone(frequency_ratio=1.2, velocity_amplitude=0.1, second_ratio=1.8, second_amplitude=0.02, second_phase=0.9),
    sb.Chirp(start_ratio=0.5, stop_ratio=2.0, velocity_amplitude=0.1, sweep_cycles=4.0),
    sb.Chirp(start_ratio=2.0, stop_ratio=0.5, velocity_amplitude=0.1, sweep_cycles=9.0, sweep_type="log"),
    sb.Burst(frequency_ratio=1.1, velocity_amplitude=0.2, duration_cycles=6.0, ramp_up_cycles=2.0, retraction=0.5),
    sb.HalfSine(displacement_amplitude=0.4, duration=0.7),
    sb.Shock(acceleration_g=20.0, duration_ms=11.0),
    sb.Shock(acceleration_g=20.0, duration_ms=11.0, shape="haversine"),
    sb.Shock(acceleration_g=20.0, duration_ms=11.0, shape="trapezoid", rise_fraction=0.2),
    sb.ConstantVelocity(speed=0.1),
    sb.BandLimitedNoise(low_ratio=0.5, high_ratio=3.0, velocity_rms=0.2, seed=7),
    sb.Sine(frequency_ratio=1.2, velocity_amplitude=0.1, phase=1.0) + sb.HalfSine(displacement_amplitude=0.2, duration=0.5),
    sb.RecordedMotion(
        displacement=1e-5 * np.sin(300.0 * TIMES), velocity=3e-3 * np.cos(300.0 * TIMES), sampling_frequency=1e4, frequency=50.0
    ),
    sb.RecordedAcceleration(record=RECORD, sampling_frequency=1e4),
    sb.HarmonicForce(frequency_ratio=1.4, amplitude=0.3, mean=0.1, phase=0.2),
    sb.ConstantForce(force=-0.4),
    sb.RecordedForce(record=RECORD, sampling_frequency=1e4),
    HarmonicLoad(frequency_ratio=2.0, amplitude=3.0, phase=0.3),
    LoadRamp(change=-2.0, duration=3.0, hold_periods=4.0),
]  # fmt: skip


def of_pieces(each: Pieces, t: float) -> tuple[float, float]:
    """Value and slope of pieces."""
    i = max(int(np.searchsorted(each.begins[0], t, side="right")) - 1, 0)
    powers = np.polynomial.Polynomial(each.coefficients[0, i])
    gain = float(np.max(each.gain))
    return gain * powers(t - each.begins[0, i]), gain * powers.deriv()(t - each.begins[0, i])


def of_component(each, t: float) -> tuple[float, float]:
    """Value and slope of a component."""
    if isinstance(each, Pieces):
        return of_pieces(each, t)
    if isinstance(each, Tone):
        a, rate, phase, mean = (float(np.max(x)) for x in each[:4])
        value, slope = mean + a * math.sin(rate * t + phase), a * rate * math.cos(rate * t + phase)
        w, dw = (1.0, 0.0) if each.window is None else of_pieces(each.window, t)
        return w * value, w * slope + dw * value
    speed, first, last, duration = (float(np.max(x)) for x in each[:4])

    def rate(at: float) -> float:
        share = min(at / duration, 1.0)
        return first * (last / first) ** share if each.exponential else first + (last - first) * share

    angle, now = (
        quad(rate, 0.0, t, points=[min(duration, t)], epsabs=1e-11, epsrel=1e-11, limit=200)[0],
        rate(t),
    )
    change = (
        0.0
        if t >= duration
        else now * math.log(last / first) / duration
        if each.exponential
        else (last - first) / duration
    )
    return speed / now * math.sin(angle), speed * math.cos(angle) - speed * change / now**2 * math.sin(angle)


@pytest.mark.parametrize("drive", DRIVES, ids=lambda each: each.name)
def test_components_are_the_motion(drive):
    columns = {name: np.array([value]) for name, value in drive.values().items()} or {"": np.zeros(1)}
    numbers, kind = drive.numbers(columns, SCALE), drive.integrated_as or type(drive)
    table = kind.numbers_type()(*(float(numbers[name][0]) for name in kind.number_names))
    components, memory, phase = (
        drive.components(columns, SCALE),
        drive.samples(),
        float(getattr(drive, "phase", 0.0)),
    )
    values = []
    for t in np.random.default_rng(3).uniform(0.0, 0.2, 40):
        argument = float(numbers["omega"][0]) * t + phase
        if kind.harmonic:
            own = table.amplitude * math.sin(argument), table.amplitude * table.omega * math.cos(argument)
        else:
            own = kind.motion(table, memory, argument)
        values.append((own, np.sum([of_component(each, t) for each in components], axis=0)))
    expected, found = np.array(values)[:, 0], np.array(values)[:, 1]
    for k in range(2):
        assert np.abs(found[:, k] - expected[:, k]).max() <= 1e-7 * np.abs(expected[:, k]).max() + 1e-300
