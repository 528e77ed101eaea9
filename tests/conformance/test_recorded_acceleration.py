"""Recorded accelerations: their integrals, a shaken structure against SciPy, a record of a known motion."""

from __future__ import annotations

import math

import numpy as np
import pytest
from mixed_oracle import Around, MixedBeam, Tip, solve
from oracle import LEVEL, LOCATION
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicHermiteSpline, CubicSpline
from several_oracle import hertz

import snapbeam as sb
from snapbeam.model import default_values
from snapbeam.model.drive.base import Scale
from snapbeam.model.drive.shock import GRAVITY
from snapbeam.solver.excitation import motion_of
from snapbeam.util.validation import InputError

RATE = 2000.0
RECORD = np.random.default_rng(4).standard_normal(400).cumsum() * 0.1


def test_velocity_and_displacement_are_the_integrals() -> None:
    motion = sb.RecordedAcceleration(record=RECORD, sampling_frequency=RATE)
    columns = {"": np.zeros(1)}
    t = np.linspace(0.0, motion.duration, 3001)
    moved, gained, a = motion_of(motion, Scale(1e-3, 100.0), t[-1])(t)
    spline = CubicSpline(np.arange(RECORD.size) / RATE, RECORD)
    speed = spline.antiderivative()(t) - spline.antiderivative(2)(t[-1]) / t[-1]
    np.testing.assert_allclose(gained, speed, rtol=0.0, atol=1e-12 * np.abs(speed).max())
    np.testing.assert_allclose(moved, CubicSpline(t, speed).antiderivative()(t), rtol=0.0, atol=1e-7)
    assert abs(moved[-1]) < 1e-12
    np.testing.assert_allclose(a, spline(t), rtol=0.0, atol=1e-11)
    assert np.abs(a).max() <= motion.peak_acceleration(columns, Scale(1e-3, 100.0))[0]
    highest, fastest = motion.bounds(columns, Scale(1e-3, 100.0))
    assert moved.max() <= highest[0]
    assert -moved.min() <= motion.mirrored_bounds(columns, Scale(1e-3, 100.0))[0]
    assert np.abs(gained).max() <= fastest[0]


def test_units_identity_and_refusals() -> None:
    motion = sb.RecordedAcceleration.from_g(RECORD, RATE)
    np.testing.assert_allclose(motion.record, GRAVITY * RECORD, rtol=1e-15)
    assert motion == sb.RecordedAcceleration(record=GRAVITY * RECORD, sampling_frequency=RATE)
    assert motion != sb.RecordedAcceleration.from_g(RECORD, 2.0 * RATE)
    assert len({motion, sb.RecordedAcceleration.from_g(RECORD, RATE)}) == 1
    with pytest.raises(InputError, match="record of 3 samples: must hold at least 4"):
        sb.RecordedAcceleration(record=[0.0, 1.0, 0.0], sampling_frequency=RATE)
    with pytest.raises(InputError, match="record"):
        sb.RecordedAcceleration(record=[0.0, 1.0, np.nan, 0.0], sampling_frequency=RATE)
    with pytest.raises(InputError, match="'recorded_acceleration' in a sum"):
        motion + sb.Sine(frequency_ratio=1.0, velocity_amplitude=0.1)


def shaken(direction: str = "up", **parts) -> sb.System:
    """Two masses on springs whose base moves by a record."""
    model = sb.ReducedModel.from_matrices(
        [[1.0, 0.0], [0.0, 0.5]], [[9e3, -3e3], [-3e3, 6e3]], contact_shape=[1.0, 0.0], base_shape=[1.0, 1.0],
        damping_ratio=0.02, length_scale=1e-3,
    )  # fmt: skip
    base = sb.BaseExcitation(
        motion=sb.RecordedAcceleration(record=RECORD, sampling_frequency=RATE), direction=direction, **parts
    )
    return sb.System(model, base_excitation=base)


@pytest.mark.slow
@pytest.mark.parametrize("direction", ["up", "down"])
def test_a_shaken_structure_against_scipy(direction: str) -> None:
    system = shaken(direction)
    model = system.model
    sign = 1.0 if direction == "up" else -1.0
    spline = CubicSpline(np.arange(RECORD.size) / RATE, RECORD)
    scaled = np.diag([1.0, 2.0**0.5])  # M to the power -1/2
    squares, vectors = np.linalg.eigh(scaled @ model.stiffness @ scaled)
    omega = np.sqrt(squares)
    load = -sign * vectors.T @ np.linalg.inv(scaled) @ np.ones(2)

    def rate(t, y):
        return np.concatenate((y[2:], load * spline(t) - 2.0 * 0.02 * omega * y[2:] - omega**2 * y[:2]))

    cycles = int(0.99 * (RECORD.size - 1) / RATE * model.reference_frequency)
    times = np.linspace(0.0, cycles / model.reference_frequency * 0.999, 201)
    truth = solve_ivp(rate, (0.0, times[-1]), np.zeros(4), "DOP853", times, rtol=1e-11, atol=1e-15, max_step=1e-3)
    expected = (scaled @ vectors @ truth.y[:2])[0]
    run = sb.simulate(system, sb.Integration(cycles=cycles, accuracy="reference"), sample_times=times)
    got = run.dataset["modal_amplitude"].values[:, 0]
    np.testing.assert_allclose(got, expected, rtol=0.0, atol=1e-6 * np.abs(expected).max())
    with pytest.raises(InputError, match="recorded acceleration lasts"):
        sb.simulate(system, sb.Integration(cycles=cycles + 5))


@pytest.mark.slow
@pytest.mark.parametrize("side", ["below", "above"])
@pytest.mark.parametrize("on_base", [True, False])
def test_a_record_of_a_sine_acts_as_the_sine(side: str, on_base: bool) -> None:
    """A beam under a stop, on a base that moves as a sine given by a formula and by its record."""
    model = sb.ReducedModel.from_beam(default_values.BEAM, modes=3)
    first = model.reference_frequency
    omega, amplitude = 2.0 * math.pi * 0.9 * first, 0.2 * model.length_scale * (2.0 * math.pi * first) ** 2
    rate, periods = (180.0 * first, 9)  # whole periods, so that the sine's velocity has zero mean over the record
    t = np.arange(round(periods / 0.9 / first * rate) + 1) / rate
    stop = sb.Striker(drive=sb.FixedStop(), gap=2e-5, side=side)
    found = []
    for motion in (
        sb.AccelerationSine(frequency_ratio=0.9, acceleration_amplitude=0.2),
        sb.RecordedAcceleration(record=-amplitude * np.sin(omega * t), sampling_frequency=rate),
    ):
        base = sb.BaseExcitation(motion=motion, striker_on_base=on_base)
        system = sb.System(model, contacts=[sb.Contact(default_values.CONTACT, stop)], base_excitation=base)
        run = sb.simulate(
            system, sb.Integration(cycles=5, accuracy="reference"), sample_times=np.linspace(0.0, 4.0 / first, 120)
        )
        found.append(run.dataset["midspan_displacement"].values)
        assert run.summary.impacts > 0
    np.testing.assert_allclose(found[1], found[0], rtol=0.0, atol=1e-5)


@pytest.mark.slow
@pytest.mark.parametrize("case", ["a moving base", "a second striker", "four records"])
def test_records_beside_other_motions(case: str) -> None:
    """Each by its own samples and their rate, from the first: against SciPy, and the run must end with the shortest."""
    model, ends = sb.ReducedModel.from_beam(default_values.BEAM, modes=2), (None, None, None)
    first, cycles = 2.0 * math.pi * model.reference_frequency, 2
    reach, ratio, lasts = 0.1 * LEVEL, 1.21, 2.4 / model.reference_frequency
    rates = {name: n * model.reference_frequency for name, n in (("tip", 90.0), ("base", 130.0), ("force", 70.0))}
    at = {name: np.arange(int(lasts * rate)) / rate for name, rate in rates.items()}
    turned = ratio * first * at["tip"]
    moved, speed = reach * np.sin(turned), reach * ratio * first * np.cos(turned)
    shaken = 0.1 * LEVEL * first**2 * np.sin(2.3 * first * at["base"])
    pushed = 0.01 * np.cos(1.7 * first * at["force"])
    record = sb.RecordedMotion(
        displacement=moved, velocity=speed, sampling_frequency=rates["tip"], frequency=ratio * model.reference_frequency
    )
    tip, acceleration = CubicHermiteSpline(at["tip"], moved, speed), CubicSpline(at["base"], shaken)
    drift = float(acceleration.antiderivative(2)(at["base"][-1])) / at["base"][-1]

    def recorded(sign: float):
        """The record counts in space, a tip as it pushes."""
        return lambda t: (sign * float(tip(t)), sign * float(tip(t, 1)))

    def sine(t: float) -> tuple[float, float]:
        w = 1.6 * first
        return 0.05 * LEVEL * math.sin(w * t), 0.05 * LEVEL * w * math.cos(w * t)

    def base(t: float) -> tuple[float, float, float]:
        if case == "four records":
            velocity = acceleration.antiderivative()(t) - drift
            return (float(acceleration.antiderivative(2)(t)) - drift * t, float(velocity), float(acceleration(t)))
        s, c, w, hardest = (math.sin(0.7 * first * t), math.cos(0.7 * first * t), 0.7 * first, 0.15 * LEVEL * first**2)
        return hardest / w**2 * s, hardest / w * c, -hardest * s

    force = CubicSpline(at["force"], pushed)
    tips = [Tip(recorded(1.0), lambda d, v: hertz(d), LOCATION)]
    strikers = [sb.Striker(drive=record, location=LOCATION)]
    around, own = Around(), {}
    if case != "a moving base":
        tips.append(Tip(recorded(-1.0), lambda d, v: hertz(d), 0.3, -1.0, 0.1 * LEVEL))
        strikers.append(sb.Striker(drive=record, location=0.3, side="above", gap=0.1 * LEVEL))
    if case == "a second striker":
        tips[0] = Tip(sine, lambda d, v: hertz(d), LOCATION)
        strikers[0] = sb.Striker(
            drive=sb.DisplacementSine(frequency_ratio=1.6, displacement_amplitude=0.05), location=LOCATION
        )
    else:
        around = Around(base=base, striker_on_base=False)
        motion = sb.AccelerationSine(frequency_ratio=0.7, acceleration_amplitude=0.15)
        if case == "four records":
            around = Around(base=base, striker_on_base=False, forces=((0.4, lambda t: float(force(t))),))
            motion = sb.RecordedAcceleration(record=shaken, sampling_frequency=rates["base"])
            history = sb.RecordedForce(record=pushed, sampling_frequency=rates["force"])
            own["forces"] = [sb.ExternalForce(history=history, location=0.4)]
        own["base_excitation"] = sb.BaseExcitation(motion=motion, striker_on_base=False)
    times = np.linspace(0.0, cycles / 1.6 / model.reference_frequency, 301) * (1.0 - 1e-13)
    truth = solve(MixedBeam(2, ends, {}), tips, around, times)
    system = sb.System(model, contacts=[sb.Contact(default_values.CONTACT, each) for each in strikers], **own)
    for accuracy, bound in (("standard", 1e-3), ("reference", 1e-6)):
        run = sb.simulate(system, sb.Integration(cycles=cycles, accuracy=accuracy), sample_times=times)
        found = [run.dataset[name] for name in ("displacement_at_striker", "midspan_displacement")]
        np.testing.assert_allclose(np.stack(found, 1), truth[:, :2], rtol=0.0, atol=bound)
        assert abs(run.dataset.attrs["energy_error"]) < 1e-4
    assert run.summary.impacts > 0
    if case != "a moving base":
        assert run.summary.impacts_contact_2 > 0
    with pytest.raises(InputError, match="recorded"):
        sb.simulate(system, sb.Integration(cycles=5))
