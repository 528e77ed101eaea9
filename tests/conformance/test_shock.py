"""Shock pulses: their integrals, the response spectrum of a half-sine in closed form, an arch against scipy."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import cumulative_simpson, solve_ivp

import snapbeam as sb
from snapbeam.model.base_excitation import rigid_mass
from snapbeam.model.drive.base import Scale
from snapbeam.model.drive.shock import GRAVITY, SHAPES
from snapbeam.model.parameter_file import load_config
from snapbeam.solver.excitation import motion_of
from snapbeam.util.validation import InputError

BEAM = sb.Beam(length=5e-4, thickness=2e-6, width=2e-5, density=2330.0, young_modulus=160e9, axial_load=0.0)


@pytest.mark.parametrize("shape", SHAPES)
def test_velocity_and_displacement_are_the_integrals(shape: str) -> None:
    """After the pulse at the velocity change of IEC 60068-2-27: 2 A D/pi, A D/2, A (D - r)."""
    shock = sb.Shock(acceleration_g=50.0, duration_ms=11.0, shape=shape)
    columns = {name: np.array([value]) for name, value in shock.values().items()}
    t = np.linspace(0.0, 20e-3, 40001)
    moved, gained, a = motion_of(shock, Scale(1e-3, 100.0), t[-1])(t)
    speed = cumulative_simpson(a, x=t, initial=0.0)
    np.testing.assert_allclose(gained, speed, rtol=0.0, atol=1e-7 * speed.max())
    moved = cumulative_simpson(gained, x=t, initial=0.0)
    np.testing.assert_allclose(moved, moved, rtol=0.0, atol=1e-7 * moved.max())
    peak, duration = 50.0 * GRAVITY, 11e-3
    change = {"half_sine": 2.0 / math.pi, "haversine": 0.5, "trapezoid": 0.9}[shape] * peak * duration
    assert gained[-1] == pytest.approx(change, rel=1e-12)
    assert shock.bounds(columns, Scale(1e-3, 100.0))[1][0] == pytest.approx(change, rel=1e-12)
    assert a.max() == pytest.approx(peak, rel=1e-6)


def test_units_and_refusals() -> None:
    shock = sb.Shock.from_si(2.0 * GRAVITY, 3e-3, shape="trapezoid", rise_fraction=0.2)
    assert shock.acceleration_g == pytest.approx(2.0, rel=1e-15)
    assert shock.duration_ms == pytest.approx(3.0, rel=1e-15)
    for wrong, words in (
        ({"acceleration_g": -1.0}, "acceleration_g = -1.0: must"),
        ({"duration_ms": 0.0}, "duration_ms = 0.0: must"),
        ({"shape": "sawtooth"}, "shape = 'sawtooth': must be"),
        ({"rise_fraction": 0.6}, "rise_fraction = 0.6: must"),
    ):
        with pytest.raises(InputError, match=words):
            sb.Shock(**({"acceleration_g": 1.0, "duration_ms": 1.0} | wrong))


def test_in_a_parameter_file(tmp_path) -> None:
    """The shock of a file moves the base, and its level may be an axis in g."""
    path = tmp_path / "arch.toml"
    path.write_text(
        "extends = 'paper'\n[base_excitation]\ntype = 'shock'\nacceleration_g = 5000\nduration_ms = 0.2\nshape = 'haversine'\n"
    )
    system = load_config(path).system
    assert system.striker is None
    assert system.base_excitation.motion == sb.Shock(acceleration_g=5000, duration_ms=0.2, shape="haversine")
    assert system.replace(**{"base_excitation.acceleration_g": 10}).base_excitation.motion.acceleration_g == 10


@pytest.mark.slow
def test_response_spectrum_of_a_half_sine() -> None:
    """Greatest relative displacement of a linear structure over A/omega^2, during the pulse and after it."""
    frequency = 40.0
    omega = 2.0 * math.pi * frequency
    mass = sb.ReducedModel.from_matrices([[1.0]], [omega**2], contact_shape=[1.0], base_shape=[1.0], length_scale=1e-3)
    peak = 5.0 * GRAVITY
    for cycles in (0.2, 0.8, 2.3):
        duration = cycles / frequency
        rate = math.pi / duration
        ratio = rate / omega
        at = 2.0 * math.pi * np.arange(1, 20) / (omega + rate)
        at = at[at < duration]
        during = np.abs((np.sin(rate * at) - ratio * np.sin(omega * at)) / (1.0 - ratio**2))
        after = abs(2.0 * ratio * math.cos(0.5 * omega * duration) / (1.0 - ratio**2))
        exact = max(after, during.max(initial=0.0))
        shock = sb.Shock.from_si(peak, duration)
        system = sb.System(mass, base_excitation=sb.BaseExcitation(motion=shock))
        summary = sb.simulate(system, sb.Integration(cycles=5, accuracy="reference")).summary
        found = max(-summary.min_midspan_displacement, summary.max_midspan_displacement)
        assert found * 1e-3 * omega**2 / peak == pytest.approx(exact, rel=1e-5), cycles


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore:the lowest mode about the equilibrium")
@pytest.mark.filterwarnings("ignore:this imperfection leaves one well")
@pytest.mark.parametrize(("shape", "level"), [("half_sine", 5000.0), ("trapezoid", 2e5)])
def test_arch_against_scipy(shape: str, level: float) -> None:
    """The silicon arch under 0.2 ms: 5000 g, and a shock so strong that the arch snaps."""
    modes = 3
    model = sb.ReducedModel.from_beam(
        BEAM, modes=modes, damping_ratio=0.05, imperfection=sb.Imperfection(midspan_amplitude=6e-6)
    )
    motion = sb.Shock(acceleration_g=level, duration_ms=0.2, shape=shape)
    system = sb.System(model, base_excitation=sb.BaseExcitation(motion=motion))
    end = 0.22e-3
    times = np.linspace(0.0, end, 441) * (1.0 - 1e-12)
    cycles = math.ceil(end * model.reference_frequency)
    run = sb.simulate(system, sb.Integration(cycles=cycles), sample_times=times)
    row = rigid_mass(model)
    inverse = np.linalg.inv(model.mass)
    duration, rise = 0.2e-3, 0.02e-3

    def acceleration(t: float) -> float:
        if t >= duration:
            return 0.0
        if shape == "half_sine":
            return level * GRAVITY * math.sin(math.pi * t / duration)
        return level * GRAVITY * min(t / rise, 1.0, (duration - t) / rise)

    def rates(t: float, y: np.ndarray) -> np.ndarray:
        a, v = y[:modes], y[modes:]
        force = (
            model.transverse_force
            - model.stiffness * a
            - model.nonlinear_stiffness * (a @ a) * a
            - model.damping_matrix @ v
            - acceleration(t) * row
        )
        return np.concatenate((v, inverse @ force))

    start = np.concatenate((model.well_amplitude, np.zeros(modes)))
    truth = solve_ivp(rates, (0.0, end), start, "DOP853", times, rtol=1e-10, atol=1e-18, max_step=2e-6)
    exact = model.midspan_shape @ truth.y[:modes] / model.length_scale
    assert run.dataset.attrs["reference_well"] == run.dataset.attrs["initial_well"] == "only"
    error = np.abs(run.dataset.midspan_displacement.values - exact).max()
    assert error < 1e-6
    assert run.summary.min_midspan_displacement == pytest.approx(exact.min(), abs=0.03)
    snapped = bool(run.summary.min_midspan_displacement < 0.0)
    assert snapped == (level > 1e5)
