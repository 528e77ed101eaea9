"""Sweeps, shocks, noise, sums and records: beams struck by them against an independent solution."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
import pytest
from extended_oracle import Tip, differences, follow, missing
from oracle import LEVEL, PaperBeam
from test_timed_drives import smooth

import snapbeam as sb
from snapbeam.model import default_values

HERTZ = 4e8
Motion = Callable[[float], tuple[float, float]]


class Case(NamedTuple):
    """A drive, what it is by its formula (m, m/s over s), one cycle (s), and where the formula has a corner."""

    drive: sb.Drive
    motion: Motion
    cycle: float
    breaks: tuple[float, ...] = ()


def chirp(first: float, spacing: str) -> Case:
    """The angle is the integral of the frequency, written as such: -cos and powers of the ratio by themselves."""
    drive = sb.Chirp(start_ratio=0.9, stop_ratio=1.9, velocity_amplitude=0.25, sweep_cycles=1.7, sweep_type=spacing)
    low, high, cycle = 0.9 * first, 1.9 * first, 2.0 * math.pi / (0.9 * first)
    length, speed = 1.7 * cycle, 0.25 * LEVEL * first

    def motion(t: float) -> tuple[float, float]:
        x = min(t / length, 1.0)
        if spacing == "linear":
            rate, turned = low + (high - low) * x, length * (low * x + 0.5 * (high - low) * x * x)
            bend = (high - low) / length
        else:
            ratio = high / low
            rate, turned = low * ratio**x, length * low * (ratio**x - 1.0) / math.log(ratio)
            bend = rate * math.log(ratio) / length
        turned += high * max(t - length, 0.0)
        bend = bend if t < length else 0.0
        return speed / rate * math.sin(turned), speed * (math.cos(turned) - bend / rate**2 * math.sin(turned))

    return Case(drive, motion, cycle, (length,))


def shock(first: float) -> Case:
    drive = sb.HalfSine(displacement_amplitude=0.9, duration=0.4)
    cycle = 2.0 * math.pi / first
    end, top = 0.4 * cycle, 0.9 * LEVEL

    def motion(t: float) -> tuple[float, float]:
        if t >= end:
            return 0.0, 0.0
        return top * math.sin(math.pi * t / end), top * math.pi / end * math.cos(math.pi * t / end)

    return Case(drive, motion, cycle, (end,))


def shares(seed: int) -> np.ndarray:
    """64 numbers in [0, 1) from a seed: the counter's multiples, two rounds of shift and multiplication, mod 2^32."""
    x = (np.arange(64, dtype=np.uint64) * np.uint64(2246822519) + np.uint64(374761393)) % np.uint64(2**32)
    x = (x + np.uint64(seed * 2654435769 % 2**32)) % np.uint64(2**32)
    for shift, factor in ((16, 2146121005), (15, 2221713035)):
        x = ((x ^ (x >> np.uint64(shift))) * np.uint64(factor)) % np.uint64(2**32)
    return np.asarray((x ^ (x >> np.uint64(16))) / 2.0**32)


def noise(first: float) -> Case:
    drive = sb.BandLimitedNoise(low_ratio=0.6, high_ratio=2.2, velocity_rms=0.2, seed=11, ramp_up_cycles=0.8)
    cycle, drawn = 2.0 * math.pi / (1.4 * first), shares(11)
    rates = first * (0.6 + 1.6 / 32.0 * (np.arange(32) + drawn[::2]))
    phases, speed, rise = (2.0 * math.pi * drawn[1::2], 0.2 * LEVEL * first * math.sqrt(2.0 / 32.0), 0.8 * cycle)

    def motion(t: float) -> tuple[float, float]:
        angles = rates * t + phases
        moved, rate = speed * float(np.sum(np.sin(angles) / rates)), speed * float(np.sum(np.cos(angles)))
        e, slope = smooth(min(t / rise, 1.0))
        return e * moved, e * rate + slope / rise * moved

    return Case(drive, motion, cycle, (rise,))


def two_sines(first: float) -> Case:
    drive = sb.Sine(frequency_ratio=1.2, velocity_amplitude=0.2) + sb.Sine(
        frequency_ratio=2.7, velocity_amplitude=0.1, phase=0.7
    )
    one, two, unit = 1.2 * first, 2.7 * first, LEVEL * first
    # the second begins at zero displacement too

    def motion(t: float) -> tuple[float, float]:
        moved = 0.2 * unit / one * math.sin(one * t)
        moved += 0.1 * unit / two * (math.sin(two * t + 0.7) - math.sin(0.7))
        return moved, 0.2 * unit * math.cos(one * t) + 0.1 * unit * math.cos(two * t + 0.7)

    return Case(drive, motion, 2.0 * math.pi / one)


def record(first: float) -> Case:
    """Samples of a sine that starts up, 5 microseconds apart: finer than what is asked for."""
    omega, velocity = 1.3 * first, 0.25
    cycle, stroke = 2.0 * math.pi / omega, velocity * LEVEL * first / omega

    def motion(t: float) -> tuple[float, float]:
        e, slope = smooth(min(t / cycle, 1.0))
        s, c = math.sin(omega * t), math.cos(omega * t)
        return stroke * e * s, stroke * (slope / cycle * s + e * omega * c)

    rows = np.array([motion(t) for t in np.arange(0.0, 6.0 * cycle, 5e-6)])
    drive = sb.RecordedMotion(
        displacement=rows[:, 0], velocity=rows[:, 1], sampling_frequency=2e5, frequency=omega / (2.0 * math.pi)
    )
    return Case(drive, motion, cycle)


CASES: dict[str, Callable[[float], Case]] = {
    "linear sweep": lambda first: chirp(first, "linear"),
    "logarithmic sweep": lambda first: chirp(first, "log"),
    "shock": shock,
    "noise": noise,
    "two sines": two_sines,
    "record": record,
}
CYCLES: dict[object, int] = {1: 3, 3: 3, 8: 1} | {("logarithmic sweep", 1): 2, ("shock", 3): 2}
"""As long as conditioning allows: after another cycle these two answer a relative change of 1e-10 by 1e-7 b."""


@pytest.mark.slow
@pytest.mark.parametrize("modes", [1, 3, 8])
@pytest.mark.parametrize("name", CASES)
def test_against_an_independent_solution(name, modes) -> None:
    beam = PaperBeam(modes)
    case = CASES[name](float(beam.omega[0]))
    cycles = CYCLES.get((name, modes), CYCLES[modes])
    times = np.linspace(0.0, cycles * case.cycle, 801) * (1.0 - 1e-6)
    tip = Tip(lambda t, _: case.motion(t), lambda d, _: HERTZ * d**1.5, breaks=case.breaks)
    truth = follow(beam, tip, times)
    model = sb.ReducedModel.from_beam(default_values.BEAM, modes=modes)
    system = sb.System(model, contacts=[sb.Contact(default_values.CONTACT, sb.Striker(drive=case.drive))])
    for accuracy, bound in (("standard", 1e-3), ("reference", 1e-7)):
        run = sb.simulate(system, sb.Integration(cycles=cycles, accuracy=accuracy), sample_times=times)
        data = run.dataset
        worst = differences(data, truth)
        print(name, modes, accuracy, worst)
        assert max(worst.values()) < bound, worst
        assert missing(data) < 1e-4
    assert run.summary.impacts > 0


SINE = sb.Sine(frequency_ratio=0.9442, velocity_amplitude=0.2631)
ENDS = {
    "alone": (sb.HalfSine(displacement_amplitude=1.50934, duration=0.427379), 10),
    "over a sine": (SINE + sb.HalfSine(displacement_amplitude=1.941, duration=1.8616), 4),
}


@pytest.mark.slow
@pytest.mark.parametrize("name", ["alone", "over a sine"])
def test_a_shock_that_ends_in_touch(name) -> None:
    """Its velocity jumps while it presses: no step goes across, or the ledger would miss a hundredth of its work."""
    drive, cycles = ENDS[name]
    model = sb.ReducedModel.from_beam(default_values.BEAM, modes=1)
    run = sb.simulate(
        sb.System(model, contacts=[sb.Contact(default_values.CONTACT, sb.Striker(drive=drive))]),
        sb.Integration(cycles=cycles),
    )
    data = run.dataset
    ends = (drive.parts_of_sum[1] if isinstance(drive, sb.SumDrive) else drive).duration / model.reference_frequency
    at = int(np.abs(data.time.values - ends).argmin())
    assert data.penetration_normalised.values[at] > 0.0
    np.testing.assert_allclose(data.time.values[at], ends, rtol=0.0, atol=1e-8)
    ledger = data.energy_beam + data.energy_contact + data.energy_dissipated - data.striker_work
    assert np.ptp(ledger.values) < 1e-4 * data.attrs["gross_work"]


@pytest.mark.slow
@pytest.mark.parametrize("name", ["one of two", "under a base"])
def test_a_shock_beside_other_motions_ends_with_a_step(name) -> None:
    """Whatever else moves, its time is its own."""
    model = sb.ReducedModel.from_beam(default_values.BEAM, modes=3)
    sine = sb.Sine(frequency_ratio=1.2, velocity_amplitude=0.2, phase=0.3)
    shock = sb.HalfSine(displacement_amplitude=0.3, duration=0.7)
    if name == "one of two":
        strikers = [sb.Striker(drive=sine), sb.Striker(drive=shock, location=0.3)]
        system = sb.System(model, contacts=[sb.Contact(default_values.CONTACT, each) for each in strikers])
    else:
        base = sb.BaseExcitation(motion=sb.AccelerationSine(frequency_ratio=0.9, acceleration_amplitude=0.2))
        system = sb.System(
            model, contacts=[sb.Contact(default_values.CONTACT, sb.Striker(drive=shock))], base_excitation=base
        )
    data = sb.simulate(system, sb.Integration(cycles=2)).dataset
    near = np.abs(data.time.values - 0.7 / model.reference_frequency)
    assert near.min() < 1e-8
