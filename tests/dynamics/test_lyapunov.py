"""Lyapunov exponents: known systems, the exact sum, two trajectories, transients apart from what they settle on."""

from __future__ import annotations

import math

import numpy as np
import pytest
from doubles import henon, lorenz
from test_orbits import oscillator, system_of

import snapbeam as sb


def test_henon() -> None:
    """0.419, and the sum of both is ln b to rounding."""
    ds = sb.dynamics.lyapunov_spectrum(henon(), 2, 20_000, states=[[0.1, 0.1]])
    value, error = (float(ds[name][0, 0]) for name in ("exponent", "exponent_error"))
    assert value == pytest.approx(0.4192, abs=max(3.0 * error, 2e-3))
    assert float(ds["exponent"].sum()) == pytest.approx(math.log(0.3), abs=1e-10)
    other = sb.dynamics.largest_lyapunov(henon(), 20_000, states=[[0.1, 0.1]])
    assert float(other["exponent"][0]) == pytest.approx(value, abs=5e-3)


@pytest.mark.slow
def test_lorenz() -> None:
    """0.906, 0 and a sum of -(sigma + 1 + beta)."""
    ds = sb.dynamics.lyapunov_spectrum(lorenz(0.25, 25), 3, 1600, states=[[1.0, 1.0, 20.0]])
    values, errors = ds["exponent"].values[0], ds["exponent_error"].values[0]
    assert values[0] == pytest.approx(0.906, abs=max(3.0 * errors[0], 0.02))
    assert values[1] == pytest.approx(0.0, abs=0.02)
    assert values.sum() == pytest.approx(-(10.0 + 1.0 + 8.0 / 3.0), abs=1e-3)


@pytest.mark.parametrize("modes", [1, 3, 8, pytest.param(32, marks=pytest.mark.slow)])
def test_the_sum_of_all_exponents_is_that_of_damping(modes: int) -> None:
    """-2 sum zeta omega, whatever the drive does, with impacts on the way: to 2e-7 of it."""
    system, fine = system_of(modes, 1.4, 0.2), sb.Integration(accuracy="reference")
    ds = sb.dynamics.lyapunov_spectrum(system, 2 * modes, 20, transient=3, integration=fine)
    exact = -2.0 * float((system.model.damping_ratio * system.model.omega).sum())
    assert float(ds["exponent"].sum()) == pytest.approx(exact, rel=2e-7)
    assert bool((ds["exponent"].values[0, :-1] >= ds["exponent"].values[0, 1:] - 2.0 * abs(exact) / modes).all())


def test_a_periodic_orbit_has_the_exponents_of_its_multipliers() -> None:
    system = system_of(1, 1.6, 0.03)
    orbit = sb.dynamics.periodic_orbit(system, transient=1000)
    how = sb.Integration(accuracy="reference")
    ds = sb.dynamics.lyapunov_spectrum(system, 1, 400, transient=0, states=orbit.state, integration=how)
    expected = math.log(abs(orbit.multipliers[0])) / orbit.flow.period
    assert float(ds["exponent"][0, 0]) == pytest.approx(expected, rel=0.1)


@pytest.mark.slow
def test_transients_are_told_from_what_they_settle_on() -> None:
    """A beam that snaps for a while and then rings down: diverging first, contracting afterwards."""
    ds = sb.dynamics.lyapunov_spectrum(system_of(8, 1.625, 0.3), 1, 700, transient=0)
    last = int(ds["periods_snapping"][0])
    assert 5 < last < 650
    assert float(ds["exponent_snapping"][0, 0]) > 10.0
    assert float(ds["exponent_settled"][0, 0]) < 0.0


@pytest.mark.slow
def test_two_trajectories_agree_and_serve_where_the_force_jumps() -> None:
    """Intrawell chaos: both estimates within their errors; under restitution both, and the pair of exponents is known."""
    system = system_of(8, 1.4, 0.01)
    tangent = sb.dynamics.lyapunov_spectrum(system, 1, 600, transient=300)
    pair = sb.dynamics.largest_lyapunov(system, 600, transient=300)
    value, other = float(tangent["exponent"][0, 0]), float(pair["exponent"][0])
    error = math.hypot(float(tangent["exponent_error"][0, 0]), float(pair["exponent_error"][0]))
    assert value > 5.0 * error
    assert other == pytest.approx(value, abs=4.0 * error)
    spectrum = sb.dynamics.lyapunov_spectrum(oscillator(1.7, 0.6), 2, 60, transient=200)
    rate = 1.7 / (2.0 * math.pi) * math.log(0.6)
    assert float(spectrum["exponent"].sum()) == pytest.approx(2.0 * rate, rel=1e-7)
    bouncing = sb.dynamics.largest_lyapunov(oscillator(1.7, 0.6), 60, transient=200)
    assert float(bouncing["exponent"][0]) * 2.0 * math.pi / 1.7 == pytest.approx(math.log(0.6), abs=0.02)


def test_a_map_of_exponents_is_that_of_its_points() -> None:
    axes = {"frequency_ratio": [1.5, 1.6], "velocity_amplitude": [0.02, 0.1, 0.3]}
    ds = sb.dynamics.lyapunov_spectrum(system_of(1, 1.6, 0.03), 1, 30, transient=20, axes=axes)
    one = sb.dynamics.lyapunov_spectrum(system_of(1, 1.5, 0.3), 1, 30, transient=20)
    assert ds["exponent"].dims == ("frequency_ratio", "velocity_amplitude", "exponent_number")
    chosen = ds["exponent"].sel(frequency_ratio=1.5, velocity_amplitude=0.3)
    assert float(chosen[0]) == float(one["exponent"][0, 0]), (
        "to the last bit, whatever other runs are integrated with it"
    )
    for name in ("exponent_error", "exponent_snapping", "exponent_settled"):
        np.testing.assert_array_equal(ds[name].sel(frequency_ratio=1.5, velocity_amplitude=0.3), one[name][0])
    alone = sb.dynamics.lyapunov_spectrum(
        system_of(1, 1.6, 0.03), 1, 30, transient=20, axes=axes, integration=sb.Integration(threads=1)
    )
    turned = {name: axes[name] for name in reversed(axes)}
    other = sb.dynamics.lyapunov_spectrum(system_of(1, 1.6, 0.03), 1, 30, transient=20, axes=turned)
    np.testing.assert_array_equal(alone["exponent"], ds["exponent"])
    np.testing.assert_array_equal(other["exponent"].transpose(*ds["exponent"].dims), ds["exponent"])


def test_refusals() -> None:
    with pytest.raises(sb.InputError, match="k = 3"):
        sb.dynamics.lyapunov_spectrum(system_of(1, 1.6, 0.03), 3)
    with pytest.raises(sb.InputError, match="another structure"):
        sb.dynamics.lyapunov_spectrum(system_of(1, 1.6, 0.03), axes={"model.damping_ratio": [0.01, 0.02]})
    with pytest.raises(sb.InputError, match="states"):
        sb.dynamics.lyapunov_spectrum(henon())


def test_one_run_is_what_it_is_among_many() -> None:
    """Few runs: derivatives of the map over each period. Many: tangents that are carried along."""
    system = system_of(2, 1.3, 0.4)
    begun = np.linspace(0.9, 1.0, 40)[:, None] * np.array([1.0, 0.0, 0.0, 0.0])
    options = {"periods": 20, "transient": 0}
    many = sb.dynamics.lyapunov_spectrum(system, 3, states=begun, **options)
    for run in (0, 39):
        alone = sb.dynamics.lyapunov_spectrum(system, 3, states=begun[run : run + 1], **options)
        np.testing.assert_allclose(alone.running[:, 0], many.running[:, run], rtol=1e-7)
        assert alone.periods_snapping[0] == many.periods_snapping[run]
