"""Poles of small oscillations: closed forms of one mode with circuits, and the ring-down of a run."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest

import snapbeam as sb
from snapbeam.model import default_values


def oscillator(damping_ratio: float = 0.0) -> sb.ReducedModel:
    return sb.ReducedModel.from_matrices(
        [[2.0]], [8.0], contact_shape=[1.0], patch_shape=[1.0], damping_ratio=damping_ratio, reference_frequency=1.0
    )


@pytest.mark.parametrize("resistance", [0.01, 0.7, 1e5])
def test_piezo_circuit_of_one_mode(resistance: float) -> None:
    """Roots of (m s^2 + c s + k)(C s + 1/R) + theta^2 s."""
    theta, capacitance = 0.6, 0.3
    layer = sb.PiezoelectricHarvester(moment_per_volt=theta, capacitance=capacitance, resistance=resistance)
    found = sb.System(oscillator(0.02), harvesters=[layer]).poles()
    mass, stiffness, loss = 2.0, 8.0, 2.0 * 0.02 * np.sqrt(16.0)
    exact = np.roots(np.polyadd(np.polymul([mass, loss, stiffness], [capacitance, 1.0 / resistance]), [theta**2, 0.0]))
    for root in exact:
        assert np.abs(found - root).min() < 1e-9 * abs(root)


@dataclass(frozen=True, kw_only=True)
class Damper(sb.LocalForce):
    """A linear damper, F = -c v."""

    coefficient: float = sb.quantity("N s/m", "coefficient of the damper", low=0.0)
    dissipative = True

    @staticmethod
    def damping_force(law, displacement: float, velocity: float) -> float:
        return -law.coefficient * velocity

    @staticmethod
    def damping_coefficient(law, displacement: float, velocity: float) -> float:
        return law.coefficient


def test_dampers_at_points() -> None:
    """Two local dampers at rest add their coefficients: 2 s^2 + (0.3 + 0.5) s + 8 = 0."""
    found = sb.System(oscillator(), forces=[Damper(coefficient=0.3), Damper(coefficient=0.5)]).poles()
    np.testing.assert_allclose(np.sort_complex(found), np.sort_complex(np.roots([2.0, 0.8, 8.0])), rtol=1e-10)


def test_coils_damp() -> None:
    """Each coil without inductance adds K^2/R; two at once add up."""
    coil = sb.ElectromagneticHarvester(force_factor=0.5, resistance=3.0, coil_resistance=2.0)
    found = sb.System(oscillator(), harvesters=[coil, coil]).poles()
    exact = np.roots([2.0, 2.0 * 0.25 / 5.0, 8.0])
    np.testing.assert_allclose(np.sort_complex(found), np.sort_complex(exact), rtol=1e-10)


def test_about_every_well_with_forces() -> None:
    """Without damping the poles are the natural frequencies of the potential; a saddle has a positive one."""
    model = sb.ReducedModel.from_beam(default_values.BEAM, modes=3, damping_ratio=0.0)
    magnet = sb.MagneticForce(strength=2e-9, gap=1e-3, location=0.4)
    system = sb.System(model, forces=[sb.LocalSpring(stiffness=20.0, location=0.3), magnet])
    potential = system.potential
    for well in potential.wells:
        frequencies = np.abs(system.poles(well))[::2] / (2.0 * np.pi)
        np.testing.assert_allclose(frequencies, potential.natural_frequencies(well), rtol=1e-9)
    saddle = next(each for each in potential.equilibria if each.unstable_directions == 1)
    assert (system.poles(saddle).real > 1.0).sum() == 1


@pytest.mark.slow
def test_ring_down_of_a_run() -> None:
    """A small motion about the well with a piezo circuit is a sum of exponentials of the three poles."""
    model = sb.ReducedModel.from_beam(default_values.BEAM, modes=1, damping_ratio=0.01)
    layer = sb.PiezoelectricHarvester(moment_per_volt=2e-3, capacitance=60e-9, resistance=2e4, patch_end=0.25)
    system = sb.System(model, harvesters=[layer])
    start = sb.State(amplitude=(1.0 - 1e-5) * model.well_amplitude)
    times = np.linspace(0.0, 20.0, 4001)[:-1] / model.reference_frequency
    run = sb.simulate(
        system.replace(initial_state=start), sb.Integration(cycles=20, accuracy="reference"), sample_times=times
    )
    motion = run.dataset.modal_amplitude.values[:, 0] - model.well_amplitude[0]
    design = np.exp(np.outer(times, system.poles()))
    rest = motion - (design @ np.linalg.lstsq(design, motion.astype(complex), rcond=None)[0]).real
    assert np.abs(rest).max() < 1e-4 * np.abs(motion).max()
