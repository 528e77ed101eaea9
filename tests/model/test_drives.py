"""What every drive promises: a displacement that begins without a jump, its derivatives, its bounds."""

from __future__ import annotations

import math

import numpy as np
import pytest

import snapbeam as sb
from snapbeam.model.drive.base import HORIZON, Scale
from snapbeam.solver.excitation import motion_of
from snapbeam.util.validation import InputError

SCALE = Scale(0.335e-3, 514.0)
DRIVES = {
    "burst": sb.Burst(
        frequency_ratio=1.3,
        velocity_amplitude=0.2,
        duration_cycles=6.0,
        ramp_up_cycles=2.0,
        ramp_down_cycles=1.5,
        retraction=0.4,
    ),
    "linear chirp": sb.Chirp(start_ratio=0.5, stop_ratio=3.0, velocity_amplitude=0.2, sweep_cycles=7.0),
    "falling chirp": sb.Chirp(
        start_ratio=3.0, stop_ratio=0.5, velocity_amplitude=0.2, sweep_cycles=20.0, sweep_type="log"
    ),
    "shock": sb.HalfSine(displacement_amplitude=0.4, duration=0.7),
    "noise": sb.BandLimitedNoise(low_ratio=0.5, high_ratio=3.0, velocity_rms=0.2, seed=7, ramp_up_cycles=2.0),
    "two sines": sb.Sine(frequency_ratio=1.2, velocity_amplitude=0.2)
    + sb.Sine(frequency_ratio=2.4, velocity_amplitude=0.1, phase=0.7),
}


def sampled(drive: sb.Drive, count: int = 40001, cycles: float = 10.0):
    columns = {name: np.array([value]) for name, value in drive.values().items()}
    times = np.linspace(0.0, cycles * float(drive.cycle(columns, SCALE)[0]), count)
    moved, speed, bent = motion_of(drive, SCALE, times[-1])(times)
    bounds = [float(each[0]) for each in drive.bounds(columns, SCALE)]
    return times, moved, speed, bent, bounds


@pytest.mark.parametrize("name", DRIVES)
def test_promises(name) -> None:
    times, moved, speed, bent, (highest, fastest) = sampled(DRIVES[name], 10001 if name == "noise" else 40001)
    assert moved[0] == 0.0
    assert moved.max() <= highest * (1.0 + 1e-12)
    assert np.abs(speed).max() <= fastest * (1.0 + 1e-12)
    # velocity and acceleration are the derivatives, but where a shock or a sweep ends
    step = times[1]
    ends = {"shock": 0.7, "linear chirp": 7.0 / 0.5, "falling chirp": 20.0 / 3.0}
    end = ends.get(name, -1.0) * 2.0 * math.pi / SCALE.omega
    smooth = np.abs(times[1:-1] - end) > 3.0 * step
    slope = (moved[2:] - moved[:-2]) / (2.0 * step)
    assert np.abs(slope - speed[1:-1])[smooth].max() < 1e-4 * fastest
    curve = (speed[2:] - speed[:-2]) / (2.0 * step)
    assert np.abs(curve - bent[1:-1])[smooth].max() < 1e-3 * np.abs(bent).max()
    assert np.abs(moved).max() > 0.2 * highest * (0.2 if name == "noise" else 1.0)


def test_burst_comes_and_goes() -> None:
    times, moved, speed, _, _ = sampled(DRIVES["burst"])
    cycles = times * 1.3 * SCALE.omega / (2.0 * math.pi)
    amplitude = 0.2 * SCALE.length / 1.3
    inside = (cycles > 2.0) & (cycles < 4.5)
    expected = amplitude * np.sin(2.0 * math.pi * cycles)
    np.testing.assert_allclose(moved[inside], expected[inside], rtol=0.0, atol=1e-12 * amplitude)
    after = cycles > 7.0
    np.testing.assert_allclose(moved[after], -0.4 * SCALE.length, rtol=1e-12)
    assert (speed[after] == 0.0).all()
    with pytest.raises(
        InputError, match=r"ramp_up_cycles = 3, ramp_down_cycles = 1 with duration_cycles = 2: the ramps must"
    ):
        sb.Burst(frequency_ratio=1.0, velocity_amplitude=0.1, duration_cycles=2.0, ramp_up_cycles=3.0)


@pytest.mark.slow
def test_noise_is_its_seed() -> None:
    long = sb.BandLimitedNoise(low_ratio=1.0, high_ratio=2.0, velocity_rms=0.2, seed=7, ramp_up_cycles=0.01)
    _, moved, speed, _, _ = sampled(long, 5001, 200.0)
    assert np.sqrt(np.mean(speed**2)) == pytest.approx(0.2 * SCALE.length * SCALE.omega, rel=0.05)
    spectrum = np.abs(np.fft.rfft(speed * np.hanning(speed.size))) ** 2
    freq = np.arange(spectrum.size) / 200.0 * 1.5  # over f_1: 200 periods of the middle of the band
    assert spectrum[(freq > 0.95) & (freq < 2.05)].sum() > 0.999 * spectrum.sum()
    other = sampled(
        sb.BandLimitedNoise(low_ratio=1.0, high_ratio=2.0, velocity_rms=0.2, seed=8, ramp_up_cycles=0.01), 5001, 200.0
    )[1]
    assert abs(np.corrcoef(moved, other)[0, 1]) < 0.2
    again = sampled(long, 5001, 200.0)[1]
    np.testing.assert_array_equal(again, moved)
    with pytest.raises(InputError, match="low_ratio = 2: must be less than high_ratio = 1"):
        sb.BandLimitedNoise(low_ratio=2.0, high_ratio=1.0, velocity_rms=0.1)


def test_sines_by_other_amplitudes() -> None:
    """V = Omega A/b = a/Omega."""
    columns = {"frequency_ratio": np.array([1.6])}
    sine = sb.Sine(frequency_ratio=1.6, velocity_amplitude=0.24).numbers(
        columns | {"velocity_amplitude": np.array([0.24])}, SCALE
    )
    moved = sb.DisplacementSine(frequency_ratio=1.6, displacement_amplitude=0.15).numbers(
        columns | {"displacement_amplitude": np.array([0.15])}, SCALE
    )
    bent = sb.AccelerationSine(frequency_ratio=1.6, acceleration_amplitude=0.384).numbers(
        columns | {"acceleration_amplitude": np.array([0.384])}, SCALE
    )
    for other in (moved, bent):
        assert other["omega"][0] == sine["omega"][0]
        assert other["amplitude"][0] == pytest.approx(sine["amplitude"][0], rel=1e-14)
    assert HORIZON > 10**7
