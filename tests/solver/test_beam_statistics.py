"""Statistics of a beam that a striker with mass meets: of the beam at the striker, not of the gap between the two."""

from __future__ import annotations

import math

import numpy as np
import pytest

import snapbeam as sb
from snapbeam.model import default_values
from snapbeam.model.state import rest_state
from snapbeam.solver.statistics import Statistic, register_statistic, unregister_statistic
from snapbeam.sweeps.replicates import Replicates, perturbed_start

MODEL = sb.ReducedModel.from_beam(default_values.BEAM, modes=3)
MASS = 0.02
SUSPENDED = sb.Striker(
    drive=sb.Sine(frequency_ratio=1.21, velocity_amplitude=0.2),
    mass=MASS,
    suspension_stiffness=MASS * (2.0 * math.pi * 30.0) ** 2,
    suspension_damping=0.1,
)
SPHERE = sb.Striker(drive=sb.ConstantVelocity(speed=0.4), mass=2e-3, gap=1e-4)
STOP = sb.Striker(drive=sb.FixedStop(), location=0.3, side="above", gap=5e-5)
STRUCK = {"suspended": [SUSPENDED], "sphere": [SPHERE], "two strikers": [SUSPENDED, STOP]}


def recorded(system: sb.System, how: sb.Integration) -> sb.Run:
    """A run with so many instants that its samples give the same statistics."""
    ratio = 1.21 if system.striker.drive.name == "sine" else 1.0
    end = how.cycles / (MODEL.reference_frequency * ratio)
    return sb.simulate(system, how, sample_times=np.linspace(0.0, end * (1.0 - 1e-12), 20001))


def assert_of_beam(run: sb.Run) -> None:
    data, outcome = run.dataset, run.summary
    for part, place in (("", "{}_at_striker"), ("midspan_", "midspan_{}")):
        w, v = data[place.format("displacement")].values, data[place.format("velocity")].values
        seen = {
            "min_": (w.min(), 2e-4), "max_": (w.max(), 2e-4), "peak_": (np.abs(w).max(), 2e-4),
            "rms_": (math.sqrt(np.mean(w * w)), 2e-3),
        }  # fmt: skip
        for name, (wanted, bound) in seen.items():
            assert getattr(outcome, f"{name}{part}displacement") == pytest.approx(wanted, abs=bound)
        assert getattr(outcome, f"peak_{part}velocity") == pytest.approx(np.abs(v).max(), rel=5e-3)
        assert getattr(outcome, f"rms_{part}velocity") == pytest.approx(math.sqrt(np.mean(v * v)), rel=2e-2)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["suspended", "two strikers"])
def test_statistics_are_those_of_the_recorded_beam(name) -> None:
    run = recorded(
        sb.System(MODEL, contacts=[sb.Contact(default_values.CONTACT, each) for each in STRUCK[name]]),
        sb.Integration(cycles=6),
    )
    assert run.summary.impacts > 1
    assert_of_beam(run)


@pytest.mark.slow
def test_a_sphere_that_flies_away_leaves_no_trace_in_the_statistics() -> None:
    """Neither in the package's own statistics nor in a registered one nor in the share of energy of high modes."""
    own = Statistic(
        "own_peak", "float64", "m", "maximum displacement at the end of a step",
        lambda reading, held: held, update=_peak,
    )  # fmt: skip
    register_statistic(own)
    try:
        how = sb.Integration(cycles=6, high_frequency_ratio=2.0)
        run = recorded(sb.System(MODEL, contacts=[sb.Contact(default_values.CONTACT, SPHERE)]), how)
    finally:
        unregister_statistic("own_peak")
    assert float(run.final_state.striker_rate) < -0.1, "it flies away"
    assert_of_beam(run)
    peak = float(np.abs(run.dataset.displacement_at_striker).max()) * MODEL.length_scale
    assert run.summary["own_peak"] == pytest.approx(peak, rel=5e-3)
    back = MODEL.linear_modes.T @ MODEL.mass
    q = (run.dataset.modal_amplitude.values - rest_state(MODEL, SPHERE).amplitude) @ back.T
    p = run.dataset.modal_velocity.values @ back.T
    energy = 0.5 * (p * p + (MODEL.omega * q) ** 2)
    high = MODEL.omega > 2.0 * 2.0 * math.pi * MODEL.reference_frequency
    assert high.any() and not high.all()
    share = energy[:, high].sum() / energy.sum()
    assert run.summary.high_frequency_energy_fraction == pytest.approx(share, rel=0.05)


def _peak(held: float, step: tuple) -> float:
    return max(held, abs(step.displacement[1]))


@pytest.mark.slow
def test_energy_in_a_circuit_is_not_in_the_modes() -> None:
    """All modes of the beam are high here, so that their share is 1, whatever energy the circuit stores."""
    coil = sb.ElectromagneticHarvester(force_factor=3.0, resistance=50.0, inductance=0.5)
    start = sb.State(amplitude=0.8 * MODEL.mirrored.well_amplitude)
    system = sb.System(MODEL, harvesters=[coil], initial_state=start)
    run = sb.simulate(system, sb.Integration(cycles=4, high_frequency_ratio=0.2))
    assert float(run.dataset.energy_circuit.max()) > 1e-3 * float(run.dataset.energy_beam.max())
    assert run.summary.high_frequency_energy_fraction == pytest.approx(1.0, rel=1e-12)


def test_replicates_keep_the_state_of_the_striker() -> None:
    start = sb.State(amplitude=MODEL.well_amplitude, striker_shift=-1e-4, striker_rate=0.03)
    system = sb.System(MODEL, contacts=[sb.Contact(default_values.CONTACT, SUSPENDED)], initial_state=start)
    begun = perturbed_start(system, Replicates(2), 1)
    assert float(begun.striker_shift) == -1e-4 and float(begun.striker_rate) == 0.03
    assert (begun.amplitude != start.amplitude).all()
