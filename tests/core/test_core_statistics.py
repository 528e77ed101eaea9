"""Statistics of the native core: peaks inside steps, energies, orders of convergence."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from core_systems import beam, crowded, stop, struck

import snapbeam as sb
from snapbeam.solver import native
from snapbeam.solver.assemble import make_ensemble

PEAKS = (
    "peak_velocity",
    "peak_midspan_velocity",
    "max_displacement",
    "min_displacement",
    "max_midspan_displacement",
    "peak_force",
)


@pytest.mark.parametrize("modes", [1, 2, 8, 32])
def test_peaks_lie_inside_steps(modes):
    """At the default level within 1e-4 of the peak of the same motion at level reference, sampled 40,000 times."""
    system = struck(modes)
    run = sb.simulate(system, sb.Integration(cycles=2, engine="native"))
    times = np.linspace(0.0, 2.0 / (1.21 * beam(modes).reference_frequency), 40_001) * (1.0 - 1e-13)
    fine = sb.simulate(
        system, sb.Integration(cycles=2, engine="native", accuracy="reference"), sample_times=times
    ).dataset
    model = system.model
    speed = model.length_scale * 2.0 * np.pi * model.reference_frequency
    place, middle = model.shape_at(1 / 2.1), model.midspan_shape
    amplitude, velocity = fine.modal_amplitude.values, fine.modal_velocity.values
    expected = {
        "peak_velocity": np.abs(velocity @ place).max() / speed,
        "peak_midspan_velocity": np.abs(velocity @ middle).max() / speed,
        "max_displacement": (amplitude @ place).max() / model.length_scale,
        "min_displacement": (amplitude @ place).min() / model.length_scale,
        "max_midspan_displacement": (amplitude @ middle).max() / model.length_scale,
        "peak_force": fine.contact_force.values.max(),
    }
    for name, value in expected.items():
        assert run.summary[name] == pytest.approx(value, rel=1e-4, abs=1e-5), name


@pytest.mark.parametrize("modes", [2, 8])
def test_peaks_of_strong_motions(modes):
    """Velocities and displacements, whose accelerations change within a step as no free mode's do, where trajectories agree to 1e-6 b: within 1e-4."""
    random, runs = np.random.default_rng(modes), 120
    columns = {
        "drive.frequency_ratio": random.uniform(0.2, 3.9, runs),
        "drive.velocity_amplitude": random.uniform(0.03, 0.9, runs),
        "contact.location": random.uniform(0.3, 0.7, runs),
    }
    found, exact = (
        native.run_ensemble(make_ensemble(struck(modes), sb.Integration(cycles=4, accuracy=accuracy), columns), 1)
        for accuracy in ("standard", "reference")
    )
    agree = np.abs(found["displacement"] - exact["displacement"]) < 1e-6 * beam(modes).length_scale
    assert agree.mean() > 0.3
    span = exact["max_displacement"] - exact["min_displacement"]
    for name, scale in {
        "peak_velocity": exact["peak_velocity"], "peak_midspan_velocity": exact["peak_midspan_velocity"],
        "max_displacement": span, "min_displacement": span,
    }.items():  # fmt: skip
        assert (np.abs(found[name] - exact[name])[agree] < 1e-4 * scale[agree]).all(), name


@pytest.mark.sampled(2)
@pytest.mark.parametrize("modes", [1, 4, 8, 16])
def test_energy_balance(modes):
    """The works of all channels and the losses add up: 1e-6 of the gross work at level reference."""
    for system in (struck(modes), struck(modes, stop(sb.KelvinVoigt(2e5, 1.0))), crowded(modes)):
        run = sb.simulate(system, sb.Integration(cycles=2, engine="native", accuracy="reference"))
        assert run.summary.status is sb.RunStatus.OK
        assert abs(run.dataset.attrs["energy_error"]) < 1e-6


@pytest.mark.parametrize(
    ("accuracy", "order", "lossy"),
    [("standard", 4, False), ("standard", 4, True), ("reference", 6, False), ("reference", 6, True)],
)
def test_order_of_convergence(accuracy, order, lossy):
    """Free motion between local forces: every halving of the step divides the error by two to the order."""
    forces: list[sb.LocalForce] = [sb.LocalSpring(stiffness=20.0, cubic_stiffness=1e7, location=0.35)]
    if lossy:
        forces.append(sb.CoulombFriction(friction_force=2e-3, smoothing_velocity=0.1, location=0.45))
        forces.append(sb.CoulombFriction(friction_force=1e-3, smoothing_velocity=0.2, location=0.3))
    model = beam(3)
    start = sb.State(amplitude=model.well_amplitude * 1.3, velocity=np.zeros(3))
    base = sb.BaseExcitation(motion=sb.DisplacementSine(frequency_ratio=0.9, displacement_amplitude=0.05))
    system = sb.System(model, forces=forces, base_excitation=base, initial_state=start)
    cycle = 1.0 / (0.9 * model.reference_frequency)
    ends = []
    for count in (40, 80, 160, 320):
        how = sb.Integration(cycles=1, engine="native", accuracy=accuracy, step=cycle / count * (1.0 + 1e-9))
        ends.append(sb.simulate(system, how, sample_times=[cycle * (1.0 - 1e-12)]).dataset.modal_amplitude.values[-1])
    errors = [np.abs(each - ends[-1]).max() for each in ends[:3]]
    floor = 1e-13 * np.abs(ends[-1]).max()
    for coarse, fine in itertools.pairwise(errors):
        if fine > 30.0 * floor:
            assert np.log2(coarse / fine) > order - 0.7
    assert errors[0] > errors[-1]


@pytest.mark.parametrize("modes", [1, 8])
def test_early_termination_keeps_the_class(modes):
    points = {"drive.frequency_ratio": [0.8, 1.2, 1.6], "drive.velocity_amplitude": [0.05, 0.15, 0.3]}
    how = sb.Integration(cycles=40, engine="native")
    early, whole = (sb.sweep(struck(modes), points, how.replace(early_termination=each)) for each in (True, False))
    np.testing.assert_array_equal(early.response_class, whole.response_class)
    assert (early.status == int(sb.RunStatus.EARLY_STOP)).any()


def test_a_kelvin_voigt_contact_releases_where_its_force_is_zero():
    """A free mass on the law: the coefficient of restitution and the time of contact in closed form."""
    law, mass = sb.KelvinVoigt(1e5, 6.0), 0.05
    matrices = sb.ReducedModel.from_matrices(
        [[mass]], [[1e-6]], contact_shape=[1.0], damping_ratio=0.0, reference_frequency=10.0
    )
    start = sb.State(amplitude=np.zeros(1), velocity=np.array([-0.3]))
    system = sb.System(
        matrices,
        contacts=[sb.Contact(law, sb.Striker(drive=sb.FixedStop(), side="below", gap=1e-6))],
        initial_state=start,
    )
    run = sb.simulate(system, sb.Integration(cycles=1, engine="native", accuracy="reference"))
    after = float(run.dataset.modal_velocity.values[np.argmax(run.dataset.time.values), 0])
    assert after == pytest.approx(0.3 * law.restitution(mass), rel=1e-7)
    omega, zeta = np.sqrt(1e5 / mass), 6.0 / (2.0 * np.sqrt(1e5 * mass))
    damped = np.sqrt(1.0 - zeta**2)
    lasts = np.arctan2(2.0 * zeta * damped, 2.0 * zeta**2 - 1.0) / (omega * damped)
    assert float(run.impacts.duration.values[0]) == pytest.approx(lasts, rel=1e-6)
