"""Poincare sections and bifurcation diagrams: on the section to rounding, the same as by other ways."""

from __future__ import annotations

import math

import numpy as np
import pytest
from test_orbits import system_of

import snapbeam as sb


def test_a_stroboscopic_section_is_that_of_advance() -> None:
    system = system_of(2, 1.4, 0.02)
    ds = sb.dynamics.poincare_section(system, periods=12, transient=0, integration=sb.Integration(accuracy="reference"))
    how = sb.Integration(accuracy="reference")
    every = sb.advance(system, periods=12, save_every_period=True, integration=how)
    size = abs(every.amplitude[0, 0])
    np.testing.assert_allclose(ds["modal_amplitude"].values[1:], every.amplitude, rtol=0.0, atol=1e-6 * size)
    assert ds["drive_phase"].values == pytest.approx(0.0, abs=1e-9) or np.cos(ds["drive_phase"]).min() > 1.0 - 1e-9


def test_an_impact_section_is_on_the_contact() -> None:
    ds = sb.dynamics.poincare_section(system_of(1, 1.6, 0.03), "impact", 40, transient=2000)
    assert ds.sizes["point"] == 40
    tip = ds["displacement_at_striker"].values
    assert tip.std() < 1e-3 * abs(tip.mean()), "the response is of period 1: every impact is alike"
    assert ds["drive_phase"].values.std() < 1e-3


def test_a_section_at_a_level_is_on_it() -> None:
    ds = sb.dynamics.poincare_section(system_of(1, 1.6, 0.3), ("midspan_displacement", 0.0, "up"), 60, transient=0)
    assert ds.sizes["point"] >= 2
    np.testing.assert_allclose(ds["midspan_displacement"].values, 0.0, atol=1e-7)
    assert (ds["midspan_velocity"].values > 0.0).all()


def test_a_section_leaves_out_the_transient() -> None:
    """A response of period 1 is one point; the transient that 100 periods leave at zeta = 0.01 is not part of it."""
    system = system_of(1, 1.6, 0.03, 0.01)
    ds = sb.dynamics.poincare_section(system, periods=30)
    soon = sb.dynamics.poincare_section(system, periods=30, transient=100)
    spread, before = (float(np.ptp(each["midspan_displacement"].values)) for each in (ds, soon))
    assert spread < 1e-5 and before > 1e-3
    assert ds.attrs["transient"] > 200 and "16 time constants" in ds.attrs["termination_reason"]


def test_passages_say_how_near_they_are() -> None:
    ds = sb.dynamics.poincare_section(system_of(1, 1.6, 0.3), ("midspan_displacement", 0.0, "up"), 30, transient=0)
    assert "Chandrupatla" in ds.attrs["termination_reason"]
    assert np.abs(ds["midspan_displacement"].values).max() <= 1.01 * ds.attrs["level_error"] + 1e-15
    assert ds.attrs["level_error"] < 1e-7


def test_sweeps_meet_the_branch() -> None:
    """Both sweeps come back after a period, and one of them is on the orbit that is found from rest."""
    system = system_of(1, 1.6, 0.03, 0.02)
    values = np.linspace(0.02, 0.06, 5)
    ds = sb.dynamics.bifurcation_diagram(system, "velocity_amplitude", values, periods=(400, 16))
    assert ds["midspan_displacement"].dims == ("sweep", "velocity_amplitude", "period")
    assert (ds["minimal_period"] == 1).all() and not ds["failed"].any()
    orbit = sb.dynamics.periodic_orbit(system.replace(**{"drive.velocity_amplitude": 0.04}), transient=300)
    model = orbit.flow.system.model
    center = float(model.midspan_shape @ orbit.state.amplitude) / orbit.flow.system.scale.length
    swept = ds["midspan_displacement"].sel(velocity_amplitude=0.04, method="nearest")
    assert np.abs(swept.values - center).max(axis=-1).min() < 1e-3
    np.testing.assert_allclose(ds["impacts_per_period"], 1.0, atol=0.02)


@pytest.mark.slow
def test_sweeps_show_hysteresis_and_starts_what_they_miss() -> None:
    """Snapped through on the way up, the beam stays in the far well on the way down."""
    system = system_of(1, 1.6, 0.03, 0.05)
    ds = sb.dynamics.bifurcation_diagram(
        system, "velocity_amplitude", [0.03, 0.4], periods=(150, 16), initial_conditions=2
    )
    assert list(ds["sweep"].values) == ["up", "down", "start 0", "start 1"]
    weak = ds["midspan_displacement"].sel(velocity_amplitude=0.03).isel(period=-1)
    assert float(weak.sel(sweep="up")) < 0.0 and float(weak.sel(sweep="start 0")) < 0.0
    again = sb.dynamics.bifurcation_diagram(
        system, "velocity_amplitude", [0.03, 0.4], sb.Integration(threads=1), periods=(150, 16), initial_conditions=2
    )
    for name in ds.data_vars:
        np.testing.assert_array_equal(ds[name].values, again[name].values, err_msg=str(name))


def test_approaches_are_told() -> None:
    ds = sb.dynamics.bifurcation_diagram(
        system_of(8, 1.4, 0.03), "velocity_amplitude", [0.03, 0.031], sweeps=["up"], periods=(600, 8), grazing=True
    )
    assert (ds["clearance"] > 0.0).any() and (ds["min_penetration"] > 0.0).all()


def test_a_parameter_of_the_structure_may_be_swept() -> None:
    system = system_of(1, 1.6, 0.03, 0.05)
    ds = sb.dynamics.bifurcation_diagram(system, "model.damping_ratio", [0.04, 0.05], sweeps=["down"], periods=(200, 4))
    plain = sb.dynamics.bifurcation_diagram(system, "velocity_amplitude", [0.03], sweeps=["up"], periods=(200, 4))
    one = ds["midspan_displacement"].sel(damping_ratio=0.05).values.ravel()
    np.testing.assert_allclose(one, plain["midspan_displacement"].values.ravel(), atol=1e-6)


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda s: sb.dynamics.poincare_section(s, "nowhere"), "section"),
        (
            lambda s: sb.dynamics.poincare_section(s, ("midspan_displacement", 5.0, "up"), 3, transient=0),
            "is never met",
        ),
        (lambda s: sb.dynamics.poincare_section(s, ("contact_force", 0.0, "up")), "section[0]"),
        (lambda s: sb.dynamics.bifurcation_diagram(s, "contact.type", [1.0, 2.0]), "contact.type"),
        (lambda s: sb.dynamics.bifurcation_diagram(s, "velocity_amplitude", [0.2, 0.1]), "strictly increasing"),
        (lambda s: sb.dynamics.bifurcation_diagram(s, "velocity_amplitude", [0.1, 0.2], sweeps=[]), "sweeps"),
        (lambda s: sb.dynamics.bifurcation_diagram(s, "velocity_amplitude", [0.1, 0.2], periods=3), "periods = 3"),
    ],
)
def test_refusals(call, words: str) -> None:
    with pytest.raises(sb.InputError) as error:
        call(system_of(1, 1.6, 0.03))
    assert words in str(error.value)


def test_points_of_a_period() -> None:
    from snapbeam.dynamics.flow import minimal_period

    turn = np.arange(24) * 2.0 * math.pi
    for m in (1, 2, 3, 5):
        assert int(minimal_period(np.cos(turn / m)[:, None])) == m
    assert int(minimal_period(np.random.default_rng(0).normal(size=(24, 1)))) == 0
