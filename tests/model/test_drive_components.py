"""Components of every drive: their sum is the motion of an independent formula, and smooth between the jumps it names."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import quad, solve_ivp
from scipy.interpolate import CubicHermiteSpline, CubicSpline

import snapbeam as sb
from snapbeam.model.drive.base import Scale
from snapbeam.model.drive.components import Motion, Pieces, Sweep, Tone, in_pieces
from snapbeam.solver.excitation import displacements, motion_of

SCALE = Scale(length=2e-4, omega=500.0)
TIMES = np.arange(4000) / 1e4
RECORD = 3.0 * np.sin(700.0 * TIMES) + np.cos(330.0 * TIMES)
DRIVES = [
    sb.Sine(frequency_ratio=1.3, velocity_amplitude=0.2, phase=0.4),
    sb.DisplacementSine(frequency_ratio=0.7, displacement_amplitude=0.3),
    sb.Sine(frequency_ratio=1.2, velocity_amplitude=0.1) + sb.Sine(frequency_ratio=1.8, velocity_amplitude=0.02, phase=0.9),
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
    sb.RampForce(change=-2.0, duration=3.0, hold_periods=4.0),
    sb.model.HalfSineForce(peak=-2.0, duration=0.7),
    sb.model.BurstForce(frequency_ratio=1.1, amplitude=0.2, duration_cycles=6.0, ramp_up_cycles=2.0),
    sb.model.ChirpForce(start_ratio=0.5, stop_ratio=2.0, amplitude=0.1, sweep_cycles=4.0),
    sb.model.NoiseForce(low_ratio=0.5, high_ratio=3.0, rms=0.2, seed=7),
    sb.HarmonicForce(frequency_ratio=1.4, amplitude=0.3, phase=1.0) + sb.RampForce(change=1.0, duration=2.0),
    sb.model.AccelerationChirp(start_ratio=2.0, stop_ratio=0.5, acceleration_amplitude=0.1, sweep_cycles=9.0, sweep_type="log"),
]  # fmt: skip


B, W = SCALE
PERIOD = 2.0 * math.pi / W


def rise(x: float) -> float:
    x = min(max(x, 0.0), 1.0)
    return x**3 * (10.0 - 15.0 * x + 6.0 * x * x)


def swept(first: float, last: float, duration: float, size: float, logarithmic: bool, power: int = 1):
    def rate(t: float) -> float:
        x = min(t / duration, 1.0)
        return first * (last / first) ** x if logarithmic else first + (last - first) * x

    return lambda t: size / rate(t) ** power * math.sin(quad(rate, 0.0, t, points=[min(duration, t)], epsabs=1e-11, limit=200)[0])  # fmt: skip


def shocked(pulse):
    """Displacement of a body whose acceleration is a *pulse* of 11 ms."""
    kinks = [0.0, 2.2e-3, 5.5e-3, 8.8e-3, 11e-3, 0.2]

    def moved(t: float) -> float:
        y = np.zeros(2)
        for begin, end in pairwise(kinks):
            if begin < t:
                y = solve_ivp(lambda s, y: (y[1], pulse(s / 11e-3)), (begin, min(t, end)), y, "DOP853", rtol=1e-12, atol=1e-14).y[:, -1]  # fmt: skip
        return float(y[0])

    return moved


G = 20.0 * 9.80665
SPLINE = CubicSpline(TIMES, RECORD)
NOISE = DRIVES[11]
FORMULAS = [
    lambda t: 0.2 * B / 1.3 * math.sin(1.3 * W * t + 0.4),
    lambda t: 0.3 * B * math.sin(0.7 * W * t),
    lambda t: 0.1 * B / 1.2 * math.sin(1.2 * W * t) + 0.02 * B / 1.8 * (math.sin(1.8 * W * t + 0.9) - math.sin(0.9)),
    swept(0.5 * W, 2.0 * W, 8.0 * PERIOD, 0.1 * B * W, False),
    swept(2.0 * W, 0.5 * W, 4.5 * PERIOD, 0.1 * B * W, True),
    lambda t: (
        0.2 * B / 1.1 * math.sin(1.1 * W * t) * rise(1.1 * t / PERIOD / 2.0) * rise(6.0 - 1.1 * t / PERIOD)
        - 0.5 * B * rise(1.1 * t / PERIOD - 6.0)
    ),
    lambda t: 0.4 * B * math.sin(math.pi * t / (0.7 * PERIOD)) * (t < 0.7 * PERIOD),
    shocked(lambda x: G * math.sin(math.pi * x) if x <= 1.0 else 0.0),
    shocked(lambda x: G * math.sin(math.pi * x) ** 2 if x <= 1.0 else 0.0),
    shocked(lambda x: G * max(min(x / 0.2, 1.0, (1.0 - x) / 0.2), 0.0)),
    lambda t: 0.1 * B * W * t,
    lambda t: (
        rise(t / (PERIOD / 1.75)) * 0.2 * B * math.sqrt(2.0 / 32.0)
        * sum(math.sin((0.5 + 2.5 / 32.0 * j) * W * t + phase) / (0.5 + 2.5 / 32.0 * j)
              for j, phase in NOISE._sines().reshape(2, -1).T.tolist())
    ),
    lambda t: (
        0.1 * B / 1.2 * (math.sin(1.2 * W * t + 1.0) - math.sin(1.0))
        + 0.2 * B * math.sin(math.pi * t / (0.5 * PERIOD)) * (t < 0.5 * PERIOD)
    ),
    lambda t: CubicHermiteSpline(TIMES, 1e-5 * np.sin(300.0 * TIMES), 3e-3 * np.cos(300.0 * TIMES))(t),
    lambda t: SPLINE.antiderivative(2)(t) - SPLINE.antiderivative(2)(TIMES[-1]) * t / TIMES[-1],
    lambda t: 0.1 + 0.3 * math.sin(1.4 * W * t + 0.2),
    lambda t: -0.4,
    SPLINE,
    lambda t: -2.0 * rise(t / (3.0 * PERIOD)) * (1.0 - rise(t / (3.0 * PERIOD) - 1.0 - 4.0 / 3.0)),
    lambda t: -2.0 * math.sin(math.pi * t / (0.7 * PERIOD)) * (t < 0.7 * PERIOD),
    lambda t: 0.2 * math.sin(1.1 * W * t) * rise(1.1 * t / PERIOD / 2.0) * rise(6.0 - 1.1 * t / PERIOD),
    swept(0.5 * W, 2.0 * W, 8.0 * PERIOD, 0.1, False, 0),
    lambda t: (
        rise(t / (PERIOD / 1.75)) * 0.2 * math.sqrt(2.0 / 32.0)
        * sum(math.sin((0.5 + 2.5 / 32.0 * j) * W * t + phase) for j, phase in NOISE._sines().reshape(2, -1).T.tolist())
    ),
    lambda t: 0.3 * math.sin(1.4 * W * t + 1.0) + rise(t / (2.0 * PERIOD)),
    swept(2.0 * W, 0.5 * W, 4.5 * PERIOD, 0.1 * B * W * W, True, 2),
]  # fmt: skip
EVERY = pytest.mark.parametrize("drive", DRIVES, ids=lambda each: each.name)


@pytest.mark.parametrize(
    ("drive", "formula"), list(zip(DRIVES, FORMULAS, strict=True)), ids=[each.name for each in DRIVES]
)
def test_components_are_the_motion(drive, formula):
    times = np.random.default_rng(3).uniform(0.0, 0.2, 40)
    wanted = np.array([float(formula(t)) for t in times])
    found = motion_of(drive, SCALE, 0.2)(times)[0]
    np.testing.assert_allclose(found, wanted, rtol=0.0, atol=1e-9 * np.abs(wanted).max())


def jumps_of(drive) -> list[float]:
    return sorted(float(each[0]) for each in drive.jumps(drive.columns(), SCALE).values())


@EVERY
def test_rate_and_acceleration_are_the_derivatives(drive):
    """Their integrals from jump to jump, by Simpson's rule; the acceleration of a load ramp has kinks."""
    motion = motion_of(drive, SCALE, 0.2)
    ends = [0.0, *(t for t in jumps_of(drive) if 0.0 < t < 0.2), 0.2]
    for begin, end in (each for each in pairwise(ends) if each[1] - each[0] > 1e-9):
        edge = 1e-12 * (end - begin)
        knots = np.array([begin + edge, *TIMES[(TIMES > begin + 1e-9) & (TIMES < end - 1e-9)], end - edge])
        middle, h = 0.5 * (knots[1:] + knots[:-1]), np.diff(knots)
        (w, v, a), (_, v_middle, a_middle) = motion(knots), motion(middle)
        for gained, rate, between, close in ((w, v, v_middle, 1e-5), (v, a, a_middle, 2e-4)):
            change = h / 6.0 * (rate[1:] + 4.0 * between + rate[:-1])
            allowed = close * h.max() * np.abs(rate).max() + 1e-12 * np.abs(gained).max()
            assert np.abs(np.diff(gained) - change).max() <= allowed


@pytest.mark.sampled(4)
@EVERY
def test_only_a_named_time_has_a_jump(drive):
    """The displacement has no jump at any time, the velocity none but at a named time."""
    motion, jumps = motion_of(drive, SCALE, 0.2), jumps_of(drive)
    dense = np.linspace(0.0, 0.2, 200_001)
    w, v, _ = motion(dense)
    step = dense[1]
    far = (
        np.all([np.abs(dense[1:] - at) > 1.5 * step for at in jumps], axis=0)
        if jumps
        else np.ones(dense.size - 1, bool)
    )
    _, fastest, hardest = np.abs(motion(dense)).max(axis=1)
    assert np.abs(np.diff(w)).max() <= 1.001 * step * fastest
    assert np.abs(np.diff(v))[far].max() <= 1.001 * step * hardest


def test_a_named_jump_is_there():
    """A half-sine stops at its end: the velocity jumps by pi A/T, the displacement does not."""
    drive = DRIVES[6]
    (at,) = jumps_of(drive)
    (w, v, _), (after, speed, _) = motion_of(drive, SCALE, 0.2)(at - 1e-12), motion_of(drive, SCALE, 0.2)(at)
    assert v == pytest.approx(-math.pi * 0.4 * B / (0.7 * PERIOD), rel=1e-9)
    assert abs(w) < 1e-9 * B and after == 0.0 and speed == 0.0


@EVERY
def test_bounds_are_not_exceeded(drive):
    columns = drive.columns()
    w, v, a = motion_of(drive, SCALE, 0.2)(np.linspace(0.0, 0.2, 20_001))
    tight = 1.0 + 1e-9
    highest, fastest = drive.bounds(columns, SCALE)
    assert w.max() <= highest[0] * tight + 1e-15
    assert -w.min() <= drive.mirrored_bounds(columns, SCALE)[0] * tight + 1e-15
    assert np.abs(v).max() <= fastest[0] * tight
    if type(drive).can_excite_base():
        assert np.abs(a).max() <= drive.peak_acceleration(columns, SCALE)[0] * tight


def test_runs_have_their_own_components():
    """Every kind of component, with numbers that all runs share and numbers of each: as each run alone."""
    runs = np.arange(3)
    own, shared = 1.0 + 0.3 * runs, np.array([0.7])
    window = in_pieces((np.zeros(1), {0: own, 1: 0.1 * own}), (0.4 * own, {2: shared}))
    components = [
        Tone(own, shared, 0.2, own, window), Tone(shared, own), Sweep(own, 3.0 * own, 5.0 * own, own, True),
        Sweep(own, 3.0 * own, 3.0 * own, own, True), Pieces(np.array([[0.0, 0.5]]), np.arange(12.0).reshape(1, 2, 6), own),
    ]  # fmt: skip
    times = np.array([0.1, 0.45, 2.0])
    together = Motion(components, runs)(times)
    np.testing.assert_allclose(
        together, np.stack([Motion(components, run)(times[run]) for run in range(3)], 1), rtol=1e-14
    )


def test_displacements_of_several_runs():
    """At a time of each they are those of the runs alone."""
    drive = sb.Burst(frequency_ratio=1.1, velocity_amplitude=0.2, duration_cycles=6.0)
    columns = drive.columns() | {"frequency_ratio": np.array([0.8, 1.1, 1.9])}
    own = {name: np.broadcast_to(values, 3) for name, values in columns.items()}
    times = np.array([0.01, 0.02, 0.03])
    wanted = [
        motion_of(sb.Burst(frequency_ratio=r, velocity_amplitude=0.2, duration_cycles=6.0), SCALE, t)(t)[0]
        for r, t in zip((0.8, 1.1, 1.9), times, strict=True)
    ]
    np.testing.assert_allclose(displacements(drive, own, SCALE, times), wanted, rtol=1e-13)
