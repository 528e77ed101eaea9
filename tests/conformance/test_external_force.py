"""Forces and moving bases of structures given by matrices, against independent solutions; input that is refused."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import snapbeam as sb
from snapbeam.solver.assemble import make_ensemble
from snapbeam.util.validation import InputError, InputTypeError

MASS, STIFFNESS = np.array([[2.0, 0.3], [0.3, 1.0]]), np.array([[400.0, -100.0], [-100.0, 300.0]])
ROW, BASE = np.array([0.2, 1.0]), np.array([1.0, 0.7])


def model(**more) -> sb.ReducedModel:
    return sb.ReducedModel.from_matrices(MASS, STIFFNESS, contact_shape=[1.0, 0.5], damping_ratio=[0.02, 0.05], **more)


def truth(reduced: sb.ReducedModel, row, force, times):
    """Amplitudes by another integrator, from the matrices alone."""
    inverse, damping = np.linalg.inv(MASS), reduced.damping_matrix

    def rate(t, y):
        return np.concatenate((y[2:], inverse @ (row * force(t) - STIFFNESS @ y[:2] - damping @ y[2:])))

    found = solve_ivp(rate, (0.0, times[-1]), np.zeros(4), method="DOP853", rtol=1e-11, atol=1e-14, t_eval=times)
    return found.y[:2].T


def held_against(system: sb.System, row, force, bound: float, cycles: int = 6) -> None:
    leads = system.primary_excitation
    assert leads is not None
    columns = {name: np.array([value]) for name, value in leads[1].values().items()}
    times = np.linspace(0.0, cycles * float(leads[1].cycle(columns, system.scale)[0]) * 0.999, 301)
    integration = sb.Integration(cycles=cycles)
    run = sb.simulate(system, integration, sample_times=times)
    expected = truth(system.model, row, force, times)
    got = run.dataset["modal_amplitude"].values
    np.testing.assert_allclose(got, expected, rtol=0.0, atol=bound * np.abs(expected).max())
    assert abs(run.dataset.attrs["energy_error"]) < 1e-6


@pytest.mark.slow
def test_harmonic_force_with_a_mean():
    w = 2.0 * math.pi * model().reference_frequency
    force = sb.HarmonicForce(frequency_ratio=1.3, amplitude=2.0, mean=0.5, phase=0.7)
    system = sb.System(model(), forces=[sb.ExternalForce(history=force, shape=ROW)])
    held_against(system, ROW, lambda t: 0.5 + 2.0 * math.sin(1.3 * w * t + 0.7), 1e-5)


@pytest.mark.slow
def test_recorded_and_constant_force():
    first = model().reference_frequency
    rate = 60.0 * first
    t = np.arange((8 * 60) + 1) / rate
    samples = np.sin(9.0 * t) + 0.5 * np.cos(31.0 * t) - 0.2
    system = sb.System(
        model(), forces=[sb.ExternalForce(history=sb.RecordedForce(record=samples, sampling_frequency=rate), shape=ROW)]
    )
    held_against(system, ROW, lambda t: math.sin(9.0 * t) + 0.5 * math.cos(31.0 * t) - 0.2, 2e-4)  # of the samples
    with pytest.raises(InputError, match="the recorded force lasts"):
        sb.simulate(system, sb.Integration(cycles=9))
    constant = sb.ExternalForce(history=sb.ConstantForce(force=-3.0))
    held_against(sb.System(model(), forces=[constant]), np.array([1.0, 0.5]), lambda t: -3.0, 1e-5)


@pytest.mark.slow
def test_moving_base():
    reduced = model(base_shape=BASE)
    w = 2.0 * math.pi * reduced.reference_frequency
    motion = sb.AccelerationSine(frequency_ratio=0.8, acceleration_amplitude=0.3)
    system = sb.System(reduced, base_excitation=sb.BaseExcitation(motion=motion))
    held_against(system, -MASS @ BASE, lambda t: -0.3 * w * w * math.sin(0.8 * w * t), 1e-5)


@pytest.mark.slow
def test_forces_along_different_rows_beside_a_moving_base():
    """Each has its own frequency and phase, and a record its own samples."""
    reduced = model(base_shape=BASE)
    w, other = 2.0 * math.pi * reduced.reference_frequency, np.array([1.0, -0.4])
    t = np.arange(8 * 200 + 1) / (200.0 * reduced.reference_frequency)
    record = np.sin(9.0 * t) + 0.5 * np.cos(31.0 * t)
    system = sb.System(
        reduced,
        base_excitation=sb.BaseExcitation(
            motion=sb.AccelerationSine(frequency_ratio=0.8, acceleration_amplitude=0.3), direction="down"
        ),
        forces=[
            sb.ExternalForce(
                history=sb.HarmonicForce(frequency_ratio=1.3, amplitude=2.0, mean=0.5, phase=0.7), shape=ROW
            ),
            sb.LocalSpring(stiffness=0.0, shape=[1.0, 0.0]),
            sb.ExternalForce(
                history=sb.RecordedForce(record=record, sampling_frequency=200.0 * reduced.reference_frequency),
                shape=other,
            ),
        ],
    )

    def push(t):
        return (
            -MASS @ BASE * (0.3 * w * w * math.sin(0.8 * w * t))
            + ROW * (0.5 + 2.0 * math.sin(1.3 * w * t + 0.7))
            + other * (math.sin(9.0 * t) + 0.5 * math.cos(31.0 * t))
        )

    held_against(system, 1.0, push, 1e-5)
    hashes = {
        make_ensemble(each, sb.Integration(cycles=1)).structure.hash
        for each in (system, system.replace(**{"force.3.shape": ROW}))
    }
    assert len(hashes) == 2


@pytest.mark.slow
def test_force_on_a_beam_beside_a_stop():
    """The force of a row equals the base excitation of the same row."""
    from snapbeam.model import default_values

    beam = sb.ReducedModel.from_beam(default_values.BEAM, modes=3)
    force = sb.ExternalForce(history=sb.HarmonicForce(frequency_ratio=0.9, amplitude=0.4), location=0.4)
    stop = sb.Contact(default_values.CONTACT, sb.Striker(drive=sb.FixedStop(), gap=1e-5))
    run = sb.simulate(
        sb.System(beam, contacts=[stop], forces=[force]),
        sb.Integration(cycles=6, accuracy="reference"),
        sample_times=np.linspace(0.0, 0.01, 50),
    )
    assert abs(run.dataset.attrs["energy_error"]) < 1e-9
    assert float(run.dataset["force_work"][-1]) != 0.0
    np.testing.assert_allclose(
        run.dataset["external_force"],
        0.4 * np.sin(0.9 * 2.0 * math.pi * beam.reference_frequency * run.dataset["time"]),
        atol=1e-12,
    )


@pytest.mark.slow
def test_weight_of_a_free_mass_on_a_moving_stop():
    """Between impacts a free mass falls; it meets a stop that moves as a sine."""
    ball = sb.ReducedModel.from_matrices([[0.5]], [0.0], contact_shape=[1.0], reference_frequency=10.0)
    weight = sb.ExternalForce(history=sb.ConstantForce(force=-0.5 * 9.81))
    free = sb.simulate(
        sb.System(ball, forces=[weight]), sb.Integration(cycles=3), sample_times=np.linspace(0.0, 0.29, 30)
    )
    t = free.dataset["time"].values
    np.testing.assert_allclose(free.dataset["modal_amplitude"][:, 0], -4.905 * t * t, atol=1e-12)
    table = sb.Striker(drive=sb.DisplacementSine(frequency_ratio=1.0, displacement_amplitude=0.001), gap=0.01)
    system = sb.System(ball, contacts=[sb.Contact(sb.HertzContact(stiffness=1e8), table)], forces=[weight])
    run = sb.simulate(system, sb.Integration(cycles=20, accuracy="reference"))
    assert run.summary.impacts >= 3
    assert abs(run.dataset.attrs["energy_error"]) < 1e-8


def test_file_and_dotted_names(tmp_path):
    force = sb.ExternalForce(history=sb.HarmonicForce(frequency_ratio=1.3, amplitude=2.0), shape=ROW)
    system = sb.System(model(base_shape=BASE), forces=[force])
    system.save(tmp_path / "forced.toml")
    assert sb.System.load(tmp_path / "forced.toml") == system
    stronger = system.replace(**{"force.amplitude": 3.0, "force.shape": [0.0, 1.0]})
    assert stronger.get("force.amplitude") == 3.0
    assert stronger.model.base_shape is not None
    assert system.replace(**{"model.damping_ratio": 0.1}).model.base_shape.tolist() == BASE.tolist()


def test_refusals():
    harmonic = sb.HarmonicForce(frequency_ratio=1.0, amplitude=1.0)
    with pytest.raises(InputError, match="give base_shape"):
        sb.System(model(), base_excitation=sb.BaseExcitation(motion=sb.AccelerationSine(frequency_ratio=1.0, acceleration_amplitude=1.0)))  # fmt: skip
    with pytest.raises(InputError, match=r"base_shape of shape \(3,\)"):
        model(base_shape=[1.0, 1.0, 1.0])
    with pytest.raises(InputError, match=r"force\.shape of shape \(3,\): must be \(2,\)"):
        sb.System(model(), forces=[sb.ExternalForce(history=harmonic, shape=[1.0, 0.0, 0.0])])
    with pytest.raises(InputError, match="has no length; give shape"):
        sb.System(model(), forces=[sb.ExternalForce(history=harmonic, location=0.5)])
    with pytest.raises(InputTypeError, match="such as HarmonicForce"):
        sb.ExternalForce(history=sb.FixedStop())
    with pytest.raises(InputError, match="a base needs a motion"):
        sb.BaseExcitation(motion=harmonic)
    with pytest.raises(InputError, match="at least 4"):
        sb.RecordedForce(record=[1.0, 2.0], sampling_frequency=10.0)
