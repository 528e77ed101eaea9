"""An axial load that changes: an independent solution, its work, slow unbuckling, and parametric resonance."""

from __future__ import annotations

import math

import numpy as np
import pytest
from around_oracle import Surroundings, live
from oracle import PaperBeam
from test_moving_base import ledger, model

import snapbeam as sb
from snapbeam.util.validation import InputError


@pytest.mark.slow
@pytest.mark.parametrize("modes", [1, 3, 8])
def test_against_an_independent_solution(modes) -> None:
    """With a base beside it: several motions, each by its own clock."""
    beam, cycles = PaperBeam(modes), 3
    first = float(beam.omega[0])
    size = 0.3 * beam.gamma * beam.rest[0] ** 2
    hardest = 0.1 * 0.335e-3 * first**2

    def base(t: float) -> tuple[float, float, float]:
        return 0.0, 0.0, -hardest * math.sin(0.9 * first * t)

    around = Surroundings(base, lambda t: size * math.sin(1.7 * first * t + 0.4))
    times = np.linspace(0.0, cycles * 2.0 * math.pi / (0.9 * first), 801) * (1.0 - 1e-13)
    truth = live(beam, around, times)
    system = sb.System(
        model(modes),
        base_excitation=sb.BaseExcitation(motion=sb.AccelerationSine(frequency_ratio=0.9, acceleration_amplitude=0.1)),
        axial_load=sb.AxialLoadModulation(motion=sb.HarmonicForce(frequency_ratio=1.7, amplitude=size, phase=0.4)),
    )
    for accuracy, bound in (("standard", 1e-3), ("reference", 1e-7)):
        run = sb.simulate(system, sb.Integration(cycles=cycles, accuracy=accuracy), sample_times=times)
        data = run.dataset
        np.testing.assert_allclose(data.midspan_displacement, truth.midspan_displacement, rtol=0.0, atol=bound)
        for name in ("base_work", "load_work"):
            wanted = getattr(truth, name)
            own = data["base_work" if name == "base_work" else "load_work"]
            np.testing.assert_allclose(own, wanted, rtol=0.0, atol=10 * bound * np.abs(wanted).max())
        assert ledger(run) < 1e-4


@pytest.mark.slow
def test_slow_unbuckling() -> None:
    """A load that falls slowly takes the well with it, quasi-statically."""
    beam = model(1)
    excess = float(beam.nonlinear_stiffness * beam.well_amplitude[0] ** 2)
    ramp = sb.RampForce(change=-0.5 * excess, duration=60.0)
    run = sb.simulate(sb.System(beam, axial_load=sb.AxialLoadModulation(motion=ramp)), sb.Integration(cycles=80))
    # quasi-statically alpha^2 = (P - P_cr)/gamma
    assert float(run.dataset.midspan_displacement[-1]) == pytest.approx(-math.sqrt(0.5), abs=2e-3)
    assert ledger(run) < 1e-4
    assert float(run.dataset.load_change[-1]) == pytest.approx(-0.5 * excess)


def test_refusals() -> None:
    with pytest.raises(InputError, match="must be a force"):
        sb.AxialLoadModulation(motion=sb.Sine(frequency_ratio=1.0, velocity_amplitude=0.1))
    plain = sb.ReducedModel.from_matrices(
        [[1.0]], [-1.0], contact_shape=[1.0], nonlinear_stiffness=1.0, well_amplitude=[-1.0]
    )
    load = sb.AxialLoadModulation(motion=sb.HarmonicForce(frequency_ratio=2.0, amplitude=1.0))
    with pytest.raises(InputError, match="has its load in its stiffness"):
        sb.System(plain, axial_load=load)
    system = sb.System(model(1), axial_load=load)
    assert sb.System.from_mapping(system.to_mapping()) == system
    assert system.replace(**{"axial_load.amplitude": 2.0}).get("axial_load.amplitude") == 2.0


def test_time_at_the_changed_load() -> None:
    """A ramp of 2.5 periods, 4 periods at the changed value, 2.5 periods back."""
    ramp = sb.RampForce(change=-0.7, duration=2.5, hold_periods=4.0)
    system = sb.System(model(1), axial_load=sb.AxialLoadModulation(motion=ramp))
    period = 1.0 / model(1).natural_frequencies[0]
    times = np.arange(0.0, 12.0, 0.25) * period
    run = sb.simulate(system, sb.Integration(cycles=12), sample_times=times)
    load, cycle = run.dataset.load_change.values, run.dataset.time.values / period
    held = np.isclose(load, -0.7, rtol=0.0, atol=1e-12)
    assert cycle[held][0] == pytest.approx(2.5) and cycle[held][-1] == pytest.approx(6.5)
    assert held[(cycle > 2.6) & (cycle < 6.4)].all()
    assert load[cycle > 9.05] == pytest.approx(0.0, abs=1e-12)
    there, back = load[(cycle > 0.1) & (cycle < 2.4)], load[(cycle > 6.6) & (cycle < 8.9)]
    np.testing.assert_allclose(there, back[::-1], rtol=0.0, atol=1e-9)


def test_a_force_is_added_to_forces_only():
    harmonic, sine = (
        sb.HarmonicForce(frequency_ratio=1.0, amplitude=0.1),
        sb.Sine(frequency_ratio=1.0, velocity_amplitude=0.1),
    )
    for one, other in ((harmonic, sine), (sine, harmonic)):
        with pytest.raises(InputError, match="a force is no motion"):
            one + other
