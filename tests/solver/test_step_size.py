"""The default steps: what they resolve, and the error they leave where there are many modes."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

import snapbeam as sb
from snapbeam.model import default_values
from snapbeam.solver import step_size
from snapbeam.solver.step_size import choose_base_step, flight_step


@pytest.mark.parametrize("modes", [1, 2, 5, 16, 32, *(pytest.param(n, marks=pytest.mark.slow) for n in (48, 64, 128))])
@pytest.mark.parametrize("accuracy", ["standard", "reference"])
def test_steps_in_contact_resolve_the_impact_and_the_fastest_mode(modes: int, accuracy: str) -> None:
    model = sb.ReducedModel.from_beam(default_values.BEAM, modes)
    plan = choose_base_step(model, default_values.CONTACT, accuracy=accuracy)
    longest = plan.contact
    assert longest * model.omega.max() <= math.pi
    if accuracy == "reference":
        assert plan.step * model.omega.max() <= 4.0
    speed = 0.2 * model.length_scale * 2.0 * math.pi * model.reference_frequency
    mass = min(model.contact_mass(x) for x in np.linspace(0.02, 0.5, 25))
    assert longest <= default_values.CONTACT.impact_duration(mass, speed) / 6.0 * (1.0 + 1e-12)
    assert plan.shortest < longest


def test_steps_a_period_are_those_of_the_page() -> None:
    page = (Path(__file__).parents[2] / "docs" / "method.md").read_text(encoding="utf-8").splitlines()
    at = next(i for i, line in enumerate(page) if line.startswith("| steps a period"))
    columns = zip(*([int(x) for x in page[k].split("|")[2:-1]] for k in (at - 2, at)), strict=True)
    for modes, steps in columns:
        model = sb.ReducedModel.from_beam(default_values.BEAM, modes, damping_ratio=0.005)
        plan = choose_base_step(model, default_values.CONTACT)
        assert round(1.0 / (plan.step * model.natural_frequencies[0])) == steps


# without damping the highest of 128 modes keep what an impact gives them: the warning about the energy balance is right
@pytest.mark.filterwarnings("ignore:the energy-balance error")
@pytest.mark.parametrize("modes", [64, pytest.param(128, marks=pytest.mark.slow)])
def test_many_modes_are_as_good_as_few(modes: int) -> None:
    """A snap-through within five cycles; with steps that the impact alone decides, 128 modes are off by 3e-2."""
    model = sb.ReducedModel.from_beam(default_values.BEAM, modes)
    shaker = sb.Shaker(frequency_ratio=1.21, velocity_amplitude=0.18)
    times = np.linspace(0.0, 5.0 / (1.21 * model.reference_frequency), 101)[1:] * (1.0 - 1e-12)
    fine, coarse = (
        sb.simulate(
            sb.System(model, contacts=[sb.Contact(default_values.CONTACT, shaker)]),
            sb.Integration(cycles=5, accuracy=level),
            sample_times=times,
        ).dataset.displacement_at_striker
        for level in ("reference", "standard")
    )
    error = np.abs(coarse - fine).max()
    assert float(error) < 1e-3


def test_a_step_does_not_depend_on_what_was_chosen_before(monkeypatch) -> None:
    """A reference frequency that is given, as the paper's, moves the step; the matrices are equal with and without it."""
    monkeypatch.setattr(step_size, "_CHOSEN", type(step_size._CHOSEN)())
    own = sb.ReducedModel.from_beam(default_values.BEAM, modes=4, damping_ratio=0.005)
    given = sb.ReducedModel.from_beam(default_values.BEAM, modes=4, damping_ratio=0.005, reference_frequency=82.75)
    alone = flight_step(own, 4, 2.5e-7)
    step_size._CHOSEN.clear()
    assert flight_step(given, 4, 2.5e-7) != alone
    assert flight_step(own, 4, 2.5e-7) == alone


@pytest.mark.parametrize("frequency", [0.02, 3e-7, 2e-290])
def test_a_low_reference_frequency_does_not_lengthen_the_steps(frequency):
    own = sb.ReducedModel.from_beam(default_values.BEAM, modes=2)
    given = sb.ReducedModel.from_beam(default_values.BEAM, modes=2, reference_frequency=frequency)
    assert flight_step(given, 4, 2.5e-7) == flight_step(own, 4, 2.5e-7)


DEEP = {
    "HuntCrossley": (sb.HuntCrossley(4e8, 100.0), 0.18, None),
    "HuntCrossley, light body": (sb.HuntCrossley(4e8, 100.0), 0.18, 1e-4),
    "KelvinVoigt, light body": (sb.KelvinVoigt(1e5, 1000.0), 0.18, 1e-4),
    "PowerLaw": (sb.PowerLaw(1.0, 3.0), 0.05, None),
}
"""Laws far stiffer, or with far more damping, than at usual speeds: where a striker begins so deep (over b), with a mass (kg)."""


@pytest.mark.filterwarnings(
    "ignore:engine = .python", "ignore:the energy-balance error"
)  # over work that is small beside what such contacts store
@pytest.mark.parametrize("kind", DEEP)
def test_steps_of_a_deep_contact(kind: str) -> None:
    """Errors against the Python engine: up to 8 b of the power law, and 3e-4 b of the others, with the contact steps of usual speeds."""
    law, depth, mass = DEEP[kind]
    model = sb.ReducedModel.from_beam(default_values.BEAM, 5)
    drive = sb.DisplacementSine(frequency_ratio=2.0, displacement_amplitude=depth, phase=math.pi / 2.0)
    system = sb.System(model, contacts=[sb.Contact(law, sb.Striker(drive=drive, location=0.4, gap=0.0, mass=mass))])
    times = np.linspace(0.0, 0.5 / model.reference_frequency, 61)[1:] * (1.0 - 1e-9)
    python, reference, standard = (
        sb.simulate(system, how, sample_times=times).dataset["modal_amplitude"].values @ model.shape_at(0.4)
        for how in (
            sb.Integration(cycles=1, engine="python"),
            *(sb.Integration(cycles=1, accuracy=level) for level in ("reference", "standard")),
        )
    )
    size = max(model.length_scale, np.abs(python).max())
    assert np.abs(reference - python).max() < 1e-7 * size
    assert np.abs(standard - python).max() < 1e-5 * size


def test_steps_of_a_motion_far_above_the_barrier_without_contacts() -> None:
    """Of a beam on a strongly shaken base: 6e-6 b while the energy was evaluated at contacts alone."""
    model = sb.ReducedModel.from_beam(default_values.BEAM, 16)
    shaken = sb.BaseExcitation(motion=sb.AccelerationSine(frequency_ratio=0.7, acceleration_amplitude=10.0))
    system = sb.System(model, base_excitation=shaken)
    times = np.linspace(0.0, 6.0 / (0.7 * model.reference_frequency), 201)[1:] * (1.0 - 1e-9)
    levels = (sb.Integration(cycles=6, accuracy=level) for level in ("reference", "standard"))
    runs = (sb.simulate(system, how, sample_times=times).dataset["modal_amplitude"].values for how in levels)
    fine, coarse = (amplitude @ model.shape_at(0.4) for amplitude in runs)
    assert np.abs(fine).max() > 4.0 * model.length_scale
    assert np.abs(coarse - fine).max() < 1.5e-6 * model.length_scale


@pytest.mark.parametrize("step", [None, 1e-4])
def test_contact_steps_of_a_dataset_are_those_of_the_run(step: float | None) -> None:
    """Steps in contact are no longer than stated, and as long in the middle of an impact."""
    model = sb.ReducedModel.from_beam(default_values.BEAM, 2)
    shaker = sb.Shaker(frequency_ratio=1.21, velocity_amplitude=0.18)
    system = sb.System(model, contacts=[sb.Contact(default_values.CONTACT, shaker)])
    data = sb.simulate(system, sb.Integration(cycles=3, step=step)).dataset
    pressed = data["contact_force"].values > 0.0
    steps = np.diff(data["time"].values)[pressed[1:] & pressed[:-1]]
    assert data.attrs["longest_contact_step"] / 2.0 < steps.max() <= data.attrs["longest_contact_step"] * (1.0 + 1e-9)
    assert data.attrs["shortest_contact_step"] <= data.attrs["longest_contact_step"] <= data.attrs["step"]


@pytest.mark.filterwarnings("ignore:.*is it given in Hz")
@pytest.mark.parametrize("kind", ["a second striker", "a sum of sines", "one sine"])
@pytest.mark.parametrize("ratio", [50.0, 400.0])
def test_no_impact_of_a_fast_striker_is_missed(kind: str, ratio: float) -> None:
    """A tip that moves many times in a step of the beam alone; up to half of the impacts were missed."""
    model = sb.ReducedModel.from_beam(default_values.BEAM, 3)
    drive: sb.Drive = sb.Sine(frequency_ratio=ratio, velocity_amplitude=0.5)
    gap, contacts = 0.9 * 0.5 / ratio * model.length_scale, []
    if kind == "a sum of sines":
        drive = sb.Sine(frequency_ratio=0.2, velocity_amplitude=1e-6) + drive
    elif kind == "a second striker":
        slow = sb.Striker(drive=sb.Sine(frequency_ratio=0.2, velocity_amplitude=0.01), location=0.3, gap=1.0)
        contacts = [sb.Contact(default_values.CONTACT, slow)]
    contacts += [sb.Contact(default_values.CONTACT, sb.Striker(drive=drive, location=0.45, gap=gap))]
    system = sb.System(model, contacts=contacts)
    cycles = 1 if kind != "one sine" else int(ratio / 0.2)
    fine = 1.0 / (40.0 * ratio * model.reference_frequency)
    found, wanted = (sb.simulate(system, sb.Integration(cycles=cycles, step=step)).summary for step in (None, fine))
    assert found.impacts == wanted.impacts > 30
    assert found["impulse"] == pytest.approx(wanted["impulse"], rel=1e-3)


@pytest.mark.filterwarnings("ignore:engine = .python")
@pytest.mark.parametrize("amplitude", [0.5, 5.0, 30.0])
def test_steps_follow_the_energy_with_one_well_too(amplitude: float) -> None:
    """A hardening oscillator of three modes; at ten times the length that normalises energy appeared from nothing."""
    stiffness = np.diag([1e4, 5e4, 2e5])
    model = sb.ReducedModel.from_matrices(
        np.eye(3), stiffness, contact_shape=[1.0, 0.5, 0.2], nonlinear_stiffness=1e4, damping_ratio=np.zeros(3)
    )
    start = sb.State(amplitude=amplitude * np.array([1.0, 0.1, 0.05]), velocity=np.zeros(3))
    system = sb.System(model, initial_state=start)
    times = np.linspace(0.0, 0.06, 61)[1:]
    found, wanted = (
        sb.simulate(system, sb.Integration(cycles=1, engine=engine), sample_times=times)
        .dataset["modal_amplitude"]
        .values
        for engine in ("native", "python")
    )
    assert np.abs(found - wanted).max() < 1e-3 * amplitude


@pytest.mark.parametrize("stiffness", [1e4, 1e6, 1e8])
def test_steps_in_contact_resolve_the_suspension_of_a_striker(stiffness: float) -> None:
    """A light body on a spring, stiff or soft, keeps the balance of energy; kicks came in resonance with it."""
    model = sb.ReducedModel.from_beam(default_values.BEAM, 3)
    drive = sb.Sine(frequency_ratio=0.9, velocity_amplitude=0.05)
    body = sb.Striker(drive=drive, location=0.45, mass=1e-6, suspension_stiffness=stiffness, gap=0.0)
    system = sb.System(model, contacts=[sb.Contact(sb.KelvinVoigt(5e3, 0.0), body)])
    data = sb.simulate(system, sb.Integration(cycles=3)).dataset
    assert abs(data.attrs["energy_error"]) < 1e-6
    turn = math.sqrt(stiffness / 1e-6) * data.attrs["longest_contact_step"]
    assert turn < math.pi * (1.0 + 1e-9)


def test_the_step_of_a_dataset_is_that_of_its_run() -> None:
    """Fitted to the cycle, and accepted as the step of the next run."""
    model = sb.ReducedModel.from_beam(default_values.BEAM, 2)
    shaker = sb.Shaker(frequency_ratio=9.7, velocity_amplitude=0.18)
    system = sb.System(model, contacts=[sb.Contact(default_values.CONTACT, shaker)])
    step = sb.simulate(system, sb.Integration(cycles=2)).dataset.attrs["step"]
    in_a_cycle = 1.0 / (9.7 * model.reference_frequency) / step
    assert in_a_cycle == pytest.approx(round(in_a_cycle), rel=1e-12)
    again = sb.simulate(system, sb.Integration(cycles=2, step=step)).dataset.attrs["step"]
    assert again == pytest.approx(step, rel=1e-12)
