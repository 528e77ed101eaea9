"""Strikers with a mass: the body as its own equation beside the beam's, a sphere on a beam, and its limits."""

from __future__ import annotations

import math

import numpy as np
import pytest
from extended_oracle import Tip, follow
from oracle import LEVEL, PaperBeam

import snapbeam as sb
from snapbeam.model import default_values
from snapbeam.util.validation import InputError

HERTZ = 4e8


def ledger(run: sb.Run) -> np.ndarray:
    data = run.dataset
    stored = data.energy_beam + data.energy_contact + data.energy_striker
    return (stored + data.energy_dissipated - data.striker_work).values


def compare(modes, striker, tip, period, cycles, at_standard, at_reference) -> sb.Run:
    times = np.linspace(0.0, cycles * period, 1201) * (1.0 - 1e-13)
    truth = follow(PaperBeam(modes), tip, times)
    system = sb.System(
        sb.ReducedModel.from_beam(default_values.BEAM, modes=modes),
        contacts=[sb.Contact(default_values.CONTACT, striker)],
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
        assert np.ptp(ledger(run)) < 1e-4 * run.dataset.attrs["gross_work"]
    return run


@pytest.mark.parametrize(("modes", "cycles"), [(1, 4), (3, 2), (8, 1)])
@pytest.mark.slow
def test_body_on_a_suspension(modes, cycles) -> None:
    """The physical body: m x'' + c x' + k x = F(t) - f, with the force that would move it alone as the drive says."""
    mass, frequency, zeta = 0.02, 30.0, 0.1
    spring = mass * (2.0 * math.pi * frequency) ** 2
    damper = 2.0 * zeta * math.sqrt(spring * mass)
    ratio, velocity = 1.21, 0.2
    first = float(PaperBeam(modes).omega[0])
    omega = ratio * first
    stroke = velocity * LEVEL * first / omega

    def body(t: float, z: np.ndarray, force: float) -> np.ndarray:
        s, c = math.sin(omega * t), math.cos(omega * t)
        drive = stroke * ((spring - mass * omega**2) * s + damper * omega * c)
        return np.array([z[1], (drive - damper * z[1] - spring * z[0] - force) / mass])

    tip = Tip(
        lambda t, z: (float(z[0]), float(z[1])), lambda d, _: HERTZ * d**1.5, body=body, state=(0.0, stroke * omega)
    )
    striker = sb.Striker(
        drive=sb.Sine(frequency_ratio=ratio, velocity_amplitude=velocity),
        mass=mass,
        suspension_stiffness=spring,
        suspension_damping=damper,
    )
    run = compare(modes, striker, tip, 2.0 * math.pi / omega, cycles, 1e-3, 1e-7)
    assert run.summary.impacts > 1


@pytest.mark.slow
@pytest.mark.parametrize("modes", [1, 3, 8])
def test_thrown_sphere(modes) -> None:
    """A free mass thrown at the beam from a distance."""
    mass, speed, gap = 2e-3, 0.4, 0.2 * LEVEL
    first = float(PaperBeam(modes).omega[0])
    v = speed * LEVEL * first

    def body(t: float, z: np.ndarray, force: float) -> np.ndarray:
        return np.array([z[1], -force / mass])

    tip = Tip(lambda t, z: (float(z[0]), float(z[1])), lambda d, _: HERTZ * d**1.5, body=body, state=(0.0, v), gap=gap)
    striker = sb.Striker(drive=sb.ConstantVelocity(speed=speed), mass=mass, gap=gap)
    run = compare(modes, striker, tip, 2.0 * math.pi / first, 2 if modes < 8 else 1, 1e-3, 1e-7)
    # momentum: what the sphere lost is the impulse on the beam
    assert run.summary.impulse == pytest.approx(-mass * float(run.final_state.striker_rate), rel=1e-6)


@pytest.mark.slow
def test_sphere_meets_a_free_mass() -> None:
    """Two free bodies: momentum and energy, and all of the exchange of equal masses."""
    for mass in (1e-3, 2e-3, 5e-3):
        model = sb.ReducedModel.from_matrices(
            [[2e-3]], [0.0], contact_shape=[1.0], length_scale=LEVEL, reference_frequency=80.0
        )
        striker = sb.Striker(drive=sb.ConstantVelocity(speed=0.3), mass=mass, gap=0.1 * LEVEL)
        run = sb.simulate(
            sb.System(
                model, contacts=[sb.Contact(default_values.CONTACT, striker)], initial_state=sb.State(amplitude=[0.0])
            ),
            sb.Integration(cycles=1, accuracy="reference"),
        )
        v = 0.3 * LEVEL * 2.0 * math.pi * 80.0
        beam, tip = float(run.final_state.velocity[0]), v + float(run.final_state.striker_rate)
        assert beam == pytest.approx(2.0 * mass / (mass + 2e-3) * v, rel=1e-9)
        assert tip == pytest.approx((mass - 2e-3) / (mass + 2e-3) * v, rel=1e-9, abs=1e-9 * v)
        assert run.impacts.sizes["impact"] == 1


@pytest.mark.slow
def test_heavy_body_is_the_shaker() -> None:
    model = sb.ReducedModel.from_beam(default_values.BEAM, modes=3)
    drive = sb.Sine(frequency_ratio=1.3, velocity_amplitude=0.15)

    def end(**more):
        system = sb.System(model, contacts=[sb.Contact(default_values.CONTACT, sb.Striker(drive=drive, **more))])
        return sb.simulate(system, sb.Integration(cycles=1, accuracy="reference")).final_state.amplitude

    shaker, scale = end(), abs(model.well_amplitude[0])
    errors = [
        np.abs(end(mass=mass, suspension_stiffness=100.0 * mass) - shaker).max() / scale for mass in (1e2, 1e4, 1e6)
    ]
    assert errors[0] > 30.0 * errors[1] > 900.0 * errors[2]
    assert errors[2] < 1e-7


@pytest.mark.slow
def test_going_on_and_mirror() -> None:
    model = sb.ReducedModel.from_beam(default_values.BEAM, modes=3)
    body = {"mass": 0.01, "suspension_stiffness": 300.0, "suspension_damping": 0.4}
    drive = sb.Sine(frequency_ratio=1.3, velocity_amplitude=0.25)
    below, above = (
        sb.System(model, contacts=[sb.Contact(default_values.CONTACT, sb.Striker(drive=drive, side=side, **body))])
        for side in ("below", "above")
    )
    once, mirrored = sb.advance(below, periods=3), sb.advance(above, periods=3)
    for name in ("amplitude", "velocity", "striker_shift", "striker_rate"):
        np.testing.assert_array_equal(getattr(mirrored, name), -getattr(once, name))
    step = sb.advance(below, sb.advance(below, periods=2))
    np.testing.assert_array_equal(step.amplitude, once.amplitude)
    assert float(once.striker_shift) != 0.0
    # from numbers alone, as a file keeps them
    names = ("amplitude", "velocity", "phase", "striker_position", "contact_time", "striker_shift", "striker_rate")
    middle = sb.advance(below, periods=2)
    plain = sb.State(**{name: getattr(middle, name) for name in names})
    np.testing.assert_allclose(
        sb.advance(below, plain).amplitude, once.amplitude, rtol=0.0, atol=1e-7 * abs(once.amplitude[0])
    )


def test_early_termination_is_off_and_refusals() -> None:
    model = sb.ReducedModel.from_beam(default_values.BEAM, modes=1)
    drive = sb.Sine(frequency_ratio=1.3, velocity_amplitude=0.25)
    with pytest.raises(InputError, match=r"must be less than .* the critical damping"):
        sb.Striker(drive=drive, mass=0.1, suspension_stiffness=10.0, suspension_damping=100.0)
    with pytest.raises(InputError, match="a striker without a mass moves as prescribed; give its mass"):
        sb.Striker(drive=drive, suspension_stiffness=10.0)
    system = sb.System(model, contacts=[sb.Contact(default_values.CONTACT, sb.Striker(drive=drive, mass=0.1))])
    assert sb.System.from_mapping(system.to_mapping()) == system
    assert system.replace(**{"contact.mass": 0.2}).get("contact.mass") == 0.2
