"""Questions of dynamics to beams whose ends are shaken or whose load changes in time."""

from __future__ import annotations

import math

import numpy as np
import pytest

import snapbeam as sb
from snapbeam.dynamics.stroboscope import Stroboscope
from snapbeam.model import default_values

DAMPING = 0.02
MODEL = sb.ReducedModel.from_beam(default_values.BEAM, modes=2, damping_ratio=DAMPING)
STRIKER = sb.Shaker(frequency_ratio=1.2, velocity_amplitude=0.1)
BASE = sb.BaseExcitation(motion=sb.AccelerationSine(frequency_ratio=1.2, acceleration_amplitude=0.2, phase=0.7))
LOAD = sb.AxialLoadModulation(motion=sb.HarmonicForce(frequency_ratio=2.4, amplitude=1.0, phase=-0.3))
SHAKEN = {
    "base": sb.System(MODEL, base_excitation=BASE),
    "load": sb.System(MODEL, axial_load=LOAD),
    "both": sb.System(MODEL, base_excitation=BASE, axial_load=LOAD),
    "struck": sb.System(MODEL, contacts=[sb.Contact(default_values.CONTACT, STRIKER)], base_excitation=BASE),
    "struck under a load": sb.System(MODEL, contacts=[sb.Contact(default_values.CONTACT, STRIKER)], axial_load=LOAD),
}


LONG = [
    pytest.param(name, marks=pytest.mark.slow) for name in ("base", "both", "load", "struck", "struck under a load")
]
"""Systems whose exponents take long."""


@pytest.mark.parametrize("name", LONG)
def test_exponents_add_up_to_the_damping(name):
    """-2 sum zeta omega, whatever shakes the beam; times of impacts move to the error of level standard."""
    found = sb.dynamics.lyapunov_spectrum(SHAKEN[name], periods=20, transient=5, k=4).exponent.values.ravel()
    expected = -2.0 * DAMPING * float(MODEL.omega.sum())
    assert found.sum() == pytest.approx(expected, rel=1e-8 if "struck" not in name else 1e-6)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["both", "base"])
def test_an_orbit_is_one_of_the_run_itself(name):
    """From the orbit a recorded run comes back to it, period after period; the multipliers' product is known."""
    system = SHAKEN[name].replace(**{"base_excitation.acceleration_amplitude": 0.02})
    exact = sb.Integration(accuracy="reference")
    orbit = sb.dynamics.periodic_orbit(system, integration=exact, transient=300)
    flow = Stroboscope(system, exact)
    lost = math.exp(-2.0 * DAMPING * float(MODEL.omega.sum()) * flow.period)
    assert float(np.prod(orbit.multipliers).real) == pytest.approx(lost, rel=1e-8)
    start = system.replace(initial_state=flow.state(orbit.coordinates))
    times = flow.period * np.arange(1, 6) * (1.0 - 1e-13)
    run = sb.simulate(start, exact.replace(cycles=6), sample_times=times)
    seen = run.dataset.midspan_displacement.values
    assert np.ptp(seen) < 1e-8
    assert abs(seen[0]) > 0.5


@pytest.mark.slow
def test_periods_one_by_one_are_periods_at_once():
    """Each begins at the phases of base and load."""
    flow = Stroboscope(SHAKEN["both"])
    begun = flow.coordinates()
    once = flow.advance(begun, 6).states
    here = begun
    for _ in range(6):
        here = flow.advance(here, 1).states
    np.testing.assert_allclose(here, once, atol=1e-9)


@pytest.mark.parametrize(
    ("system", "words"),
    [
        (sb.System(MODEL, base_excitation=BASE, axial_load=sb.AxialLoadModulation(motion=sb.HarmonicForce(frequency_ratio=1.7317, amplitude=1.0))),
         "axial_load: no common period with base_excitation; the ratio of its frequency .* is 1.44308333333"),
        (sb.System(MODEL, axial_load=sb.AxialLoadModulation(motion=sb.RampForce(change=1.0, duration=3.0))),
         "axial_load: a motion of type 'ramp_force' does not repeat"),
        (sb.System(MODEL, base_excitation=sb.BaseExcitation(motion=sb.Chirp(start_ratio=0.8, stop_ratio=1.2, velocity_amplitude=0.1, sweep_cycles=9.0))),
         "base_excitation: a motion of type 'chirp' does not repeat"),
    ],
)  # fmt: skip
def test_what_does_not_repeat_is_refused(system, words):
    """A section needs a common period."""
    with pytest.raises(sb.InputError, match=words):
        sb.dynamics.lyapunov_spectrum(system, periods=20, transient=5)


@pytest.mark.slow
def test_a_map_at_a_phase_of_the_base():
    """It is the map of the base that begins at this phase, also beside a stop."""
    flow = Stroboscope(SHAKEN["base"], phase=1.0)
    shifted = Stroboscope(SHAKEN["base"].replace(**{"base_excitation.phase": 1.0}))
    x = shifted.coordinates()
    np.testing.assert_allclose(flow.advance(x, 3).states, shifted.advance(x, 3).states, atol=1e-12)
    stop = sb.Striker(drive=sb.FixedStop(), gap=5e-5)
    beside = Stroboscope(
        sb.System(MODEL, contacts=[sb.Contact(default_values.CONTACT, stop)], base_excitation=BASE), phase=1.0
    )
    assert float(beside.starting(x[0]).initial_state.phase) == 1.0


def test_a_start_with_a_tip_of_its_own_keeps_all_parts():
    """Holding the tip where the start says takes nothing else away: the base goes on moving, the load changing."""
    start = sb.State(amplitude=MODEL.well_amplitude, striker_position=-1.2 * MODEL.length_scale)
    system = sb.System(
        MODEL,
        contacts=[sb.Contact(default_values.CONTACT, STRIKER)],
        initial_state=start,
        base_excitation=BASE,
        axial_load=LOAD,
    )
    held = Stroboscope(system).system
    assert held.base_excitation == BASE and held.axial_load == LOAD
    assert np.isnan(held.initial_state.striker_position) and held.get("contact.gap") > 0.0
