"""Drives that do not repeat: an independent solution, going on from a state, the limit of a plain sine."""

from __future__ import annotations

import math

import numpy as np
import pytest
from extended_oracle import Tip, follow
from oracle import LEVEL, PaperBeam

import snapbeam as sb
from snapbeam.model import default_values

HERTZ = 4e8


def smooth(x: float) -> tuple[float, float]:
    return x**3 * (10.0 - 15.0 * x + 6.0 * x * x), 30.0 * x * x * (1.0 - x) ** 2


@pytest.mark.slow
@pytest.mark.parametrize(("modes", "at_standard", "at_reference"), [(1, 1e-3, 1e-7), (3, 1e-4, 1e-7), (8, 1e-5, 1e-8)])
def test_burst(modes, at_standard, at_reference) -> None:
    """Two cycles up, one as it is, half a cycle down, and the tip withdrawn."""
    beam, ratio, velocity = PaperBeam(modes), 1.21, 0.2
    omega = ratio * float(beam.omega[0])
    stroke, period = velocity * LEVEL * float(beam.omega[0]) / omega, 2.0 * math.pi / omega
    rise, length, fall, retreat = 1.0, 2.5, 0.5, 0.3

    def motion(t: float, _: object) -> tuple[float, float]:
        n = t / period
        e, slope, away, speed = 1.0, 0.0, 0.0, 0.0
        if n < rise:
            e, slope = smooth(n / rise)
            slope /= rise * period
        elif n > length:
            e = 0.0
            away, speed = (retreat * LEVEL * each for each in smooth(min(n - length, 1.0)))
            speed /= period
        elif n > length - fall:
            e, slope = smooth((length - n) / fall)
            slope /= -fall * period
        s, c = math.sin(omega * t), math.cos(omega * t)
        return stroke * e * s - away, stroke * (slope * s + e * omega * c) - speed

    cycles = {1: 4, 3: 3, 8: 1}[modes]
    times = np.linspace(0.0, cycles * period, 1201) * (1.0 - 1e-13)
    truth = follow(beam, Tip(motion, lambda d, _: HERTZ * d**1.5), times)
    drive = sb.Burst(
        frequency_ratio=ratio,
        velocity_amplitude=velocity,
        duration_cycles=length,
        ramp_up_cycles=rise,
        ramp_down_cycles=fall,
        retraction=retreat,
    )
    system = sb.System(
        sb.ReducedModel.from_beam(default_values.BEAM, modes=modes),
        contacts=[sb.Contact(default_values.CONTACT, sb.Striker(drive=drive))],
    )
    for accuracy, bound in (("standard", at_standard), ("reference", at_reference)):
        run = sb.simulate(system, sb.Integration(cycles=cycles, accuracy=accuracy), sample_times=times)
        np.testing.assert_allclose(
            run.dataset.displacement_at_striker, truth.displacement_at_striker, rtol=0.0, atol=bound
        )
        np.testing.assert_allclose(run.dataset.midspan_displacement, truth.midspan_displacement, rtol=0.0, atol=bound)
        np.testing.assert_allclose(
            run.dataset.penetration_normalised, truth.penetration_normalised, rtol=0.0, atol=bound
        )
        data = run.dataset
        ledger = data.energy_beam + data.energy_contact + data.energy_dissipated - data.striker_work
        assert np.ptp(ledger.values) < 1e-4 * data.attrs["gross_work"]


@pytest.mark.slow
def test_going_on_is_going_on() -> None:
    """Three calls of one period give what one of three gives, to rounding: time is part of the state."""
    drive = sb.Burst(
        frequency_ratio=1.3, velocity_amplitude=0.2, duration_cycles=2.0, ramp_up_cycles=0.5, ramp_down_cycles=0.5
    )
    system = sb.System(
        sb.ReducedModel.from_beam(default_values.BEAM, modes=3),
        contacts=[sb.Contact(default_values.CONTACT, sb.Striker(drive=drive))],
    )
    once = sb.advance(system, periods=3)
    step = sb.advance(system, sb.advance(system, sb.advance(system)))
    np.testing.assert_allclose(step.amplitude, once.amplitude, rtol=0.0, atol=1e-9 * abs(once.amplitude[0]))
    # the second half of the burst was there: a start anew would begin it again
    again = sb.advance(system, sb.advance(system, periods=2).with_modes(3), periods=1)
    np.testing.assert_array_equal(again.phase, step.phase)


@pytest.mark.slow
def test_one_tone_alone_is_the_sine() -> None:
    model = sb.ReducedModel.from_beam(default_values.BEAM, modes=3)
    one = sb.Sine(frequency_ratio=1.3, velocity_amplitude=0.2)
    two = one + sb.Sine(frequency_ratio=2.0, velocity_amplitude=0.0)
    ends = [
        sb.simulate(
            sb.System(model, contacts=[sb.Contact(default_values.CONTACT, sb.Striker(drive=drive))]),
            sb.Integration(cycles=2),
        ).final_state
        for drive in (two, one)
    ]
    np.testing.assert_allclose(ends[0].amplitude, ends[1].amplitude, rtol=0.0, atol=1e-9 * abs(model.well_amplitude[0]))


def test_other_amplitudes_and_a_stop() -> None:
    """Sines by displacement or acceleration are the sine, to the bit where their numbers are; a stop is V = 0."""
    model = sb.ReducedModel.from_beam(default_values.BEAM, modes=3)

    def end(drive):
        system = sb.System(model, contacts=[sb.Contact(default_values.CONTACT, sb.Striker(drive=drive))])
        return sb.simulate(system, sb.Integration(cycles=1)).final_state.amplitude

    sine = end(sb.Sine(frequency_ratio=2.0, velocity_amplitude=0.25))
    np.testing.assert_array_equal(end(sb.DisplacementSine(frequency_ratio=2.0, displacement_amplitude=0.125)), sine)
    np.testing.assert_array_equal(end(sb.AccelerationSine(frequency_ratio=2.0, acceleration_amplitude=0.5)), sine)
    np.testing.assert_array_equal(end(sb.FixedStop()), end(sb.Sine(frequency_ratio=1.0, velocity_amplitude=0.0)))
