"""Local forces: springs and damping of one point, against an independent solution, and a law of one's own."""

from __future__ import annotations

import math
import re
import sys
from dataclasses import dataclass
from importlib import import_module, invalidate_caches
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import snapbeam as sb
from snapbeam.model import default_values
from snapbeam.model.base_excitation import rigid_mass
from snapbeam.model.local_force import LOCAL_FORCES
from snapbeam.util.validation import InputError

MODEL = sb.ReducedModel.from_beam(default_values.BEAM, modes=3, damping_ratio=0.01)


PAGE = Path(__file__).parents[2] / "docs" / "extending.md"
"""The law of friction is that of the page."""


@pytest.fixture(scope="module")
def friction(tmp_path_factory):
    """The law in a file of its own, as the page has it."""
    blocks = re.findall(r"```python\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL)
    folder = tmp_path_factory.mktemp("force")
    text = next(block for block in blocks if block.startswith("# own_force.py"))
    (folder / "own_force.py").write_text(text, encoding="utf-8")
    sys.path.insert(0, str(folder))
    invalidate_caches()
    try:
        yield import_module("own_force").DryFriction(friction_force=2e-3, smoothing_velocity=0.02, location=0.45)
    finally:
        sys.path.remove(str(folder))
        del sys.modules["own_force"]
        LOCAL_FORCES.pop("dry_friction", None)


def independent(system, start, times):
    """Integrate the amplitudes themselves, alpha'' from mass, damping and stiffness, by DOP853."""
    model, striker = system.model, system.striker
    mass, gamma = model.mass, model.nonlinear_stiffness
    inverse, stiffness = np.linalg.inv(mass), model.stiffness if model.stiffness.ndim == 2 else np.diag(model.stiffness)
    forces = [(each.row(model), each.numbers, type(each)) for each in system.forces]
    drive = None if system.base_excitation is None else system.base_excitation.motion
    rigid = None if drive is None else rigid_mass(model)

    if striker is not None:
        tip, side = model.shape_at(striker.location), 1.0 if striker.side == "below" else -1.0
        omega = striker.drive.frequency_ratio * system.scale.omega
        reach = striker.drive.velocity_amplitude * system.scale.length * system.scale.omega / omega

    def rate(t, y):
        alpha, velocity = np.split(y, 2)
        load = -stiffness @ alpha - gamma * (alpha @ alpha) * alpha - model.damping_matrix @ velocity
        if drive is not None:
            shaken = drive.frequency_ratio * system.scale.omega
            # the displacement of the base is a sine, its acceleration minus a sine
            peak = drive.acceleration_amplitude * system.scale.length * system.scale.omega**2
            load = load + rigid * peak * math.sin(shaken * t)
        if striker is not None:
            motion = reach * math.sin(omega * t)
            depth = motion - side * tip @ (alpha - start.amplitude)
            load = load + side * tip * system.contact_law.stiffness * max(depth, 0.0) ** 1.5
        for shape, law, kind in forces:
            u, v = shape @ alpha, shape @ velocity
            load = load + (kind.force(law, u) + kind.damping_force(law, u, v)) * shape
        return np.concatenate((velocity, inverse @ load))

    y0 = np.concatenate((start.amplitude, start.velocity))
    # of a system at rest SciPy would try a first step so long that the cubic force overflows
    first = 1e-6 * float(times[-1])
    found = solve_ivp(rate, (0.0, times[-1]), y0, "DOP853", times, rtol=1e-12, atol=1e-15, first_step=first)
    return found.y.T[:, : model.modes]


def struck_start(model, share):
    """At rest in the well, with a velocity of the first shape that reaches *share* of the barrier."""
    well = model.well_amplitude
    shape = np.zeros(model.modes)
    shape[0] = 1.0
    barrier = float(model.potential_energy(np.zeros(model.modes)) - model.potential_energy(well))
    speed = math.sqrt(2.0 * share * barrier / float(shape @ model.mass @ shape))
    return sb.State(amplitude=well, velocity=-speed * shape)


FORCES = {
    "spring": sb.LocalSpring(stiffness=40.0, cubic_stiffness=1e8, location=0.3),
    "rotation": sb.LocalSpring(stiffness=3e-3, location=0.5, coordinate="rotation"),
    "drag": sb.QuadraticDamping(coefficient=0.3, location=0.4),
    "magnet": sb.MagneticForce(strength=6e-9, gap=1.2e-3, location=0.45),
    "electrode": sb.ElectrostaticForce(voltage=30.0, area=2e-4, gap=-1.5e-3, location=0.6),
}


SLOW = pytest.mark.slow


@SLOW
@pytest.mark.parametrize(
    ("name", "share"),
    [
        *((name, 0.3) for name in (*FORCES, "friction")),
        *((name, 1.7) for name in ("spring", "rotation", "drag", "friction", "magnet", "electrode")),
    ],
)
def test_against_an_independent_solution(name, share, friction):
    """Free motion within a well and across both: displacements agree, and the energy balance closes."""
    force = FORCES.get(name, friction)
    start = struck_start(MODEL, share)
    system = sb.System(MODEL, forces=[force], initial_state=start)
    check_against_independent(system, start, 4, 1e-6)


def check_against_independent(system, start, cycles, tolerance):
    length = 1.0 / system.model.reference_frequency if system.striker is None else cycle_of(system)
    times = length * np.linspace(0.0, cycles, 16 * cycles + 1)
    run = sb.simulate(system, sb.Integration(cycles=cycles, accuracy="reference"), sample_times=times)
    expected = independent(system, start, times)
    error = np.abs(run.dataset["modal_amplitude"].values - expected).max() / np.abs(expected).max()
    assert error < tolerance
    balance = run.dataset["energy_beam"] + run.dataset["energy_dissipated"]
    if system.striker is not None:
        balance = balance + run.dataset["energy_contact"] - run.dataset["striker_work"]
        assert run.summary.impacts > 0
    if system.base_excitation is not None:
        balance = balance - run.dataset["base_work"]
    if any(each.dissipative for each in system.forces):
        balance = balance - run.dataset["local_force_work"]
        assert float(run.dataset["local_force_work"][-1]) < 0.0
    scale = max(float(abs(run.dataset["energy_beam"]).max()), run.dataset.attrs.get("gross_work", 0.0))
    assert float(abs(balance - balance[0]).max()) < 1e-7 * scale


def cycle_of(system):
    return 1.0 / (system.striker.drive.frequency_ratio * system.model.reference_frequency)


@pytest.mark.parametrize(
    ("names", "side"),
    [
        pytest.param(names, side, marks=[] if names == ("spring",) and side == "below" else SLOW)
        for names in (("spring", "magnet", "drag"), ("drag",), ("spring",), ("friction",))
        for side in ("below", "above")
    ],
)
def test_with_impacts(names, side, friction):
    """A shaker strikes; onset and release of each contact are located although the forces change the motion."""
    forces = [FORCES.get(name, friction) for name in names]
    striker = sb.Striker(drive=sb.Sine(frequency_ratio=1.21, velocity_amplitude=0.18), side=side, location=1 / 2.1)
    system = sb.System(MODEL, contacts=[sb.Contact(default_values.CONTACT, striker)], forces=forces)
    run = sb.simulate(system, sb.Integration(cycles=1, accuracy="reference"))
    start = sb.State(amplitude=run.dataset["modal_amplitude"].values[0], velocity=np.zeros(MODEL.modes))
    check_against_independent(system, start, 2, 1e-5)


@pytest.mark.parametrize("name", ["drag", pytest.param("rotation", marks=SLOW)])
def test_on_a_moving_base(name):
    """The works of the base and of the force, each to the last digits."""
    force, start = FORCES[name], struck_start(MODEL, 0.3)
    motion = sb.AccelerationSine(frequency_ratio=0.9, acceleration_amplitude=0.3)
    system = sb.System(MODEL, forces=[force], initial_state=start, base_excitation=sb.BaseExcitation(motion=motion))
    check_against_independent(system, start, 4, 1e-6)


def test_energy_of_quadratic_damping():
    """A free mass: v = v_0/(1 + c v_0 t/m) and the energy lost; measured 2.2e-8 of it, and a sixteenth with half the step."""
    mass, coefficient, speed = 0.01, 2.0, 0.4
    model = sb.ReducedModel.from_matrices(
        [[mass]], [0.0], contact_shape=[1.0], length_scale=1e-3, reference_frequency=10.0
    )
    drag = sb.QuadraticDamping(coefficient=coefficient)
    system = sb.System(model, forces=[drag], initial_state=sb.State(amplitude=[0.0], velocity=[speed]))
    run = sb.simulate(system, sb.Integration(cycles=2))
    exact = speed / (1.0 + coefficient * speed * run.dataset["time"].values / mass)
    np.testing.assert_allclose(run.dataset["modal_velocity"].values[:, 0], exact, rtol=1e-8)
    lost = 0.5 * mass * (speed**2 - exact[-1] ** 2)
    assert run.summary["local_force_work"] == pytest.approx(-lost, rel=4e-8)
    finer = sb.simulate(system, sb.Integration(cycles=2, step=0.5 * float(run.dataset.attrs["step"])))
    assert finer.summary["local_force_work"] == pytest.approx(-lost, rel=3e-9)


def test_file_and_dotted_names(tmp_path):
    system = sb.System(MODEL, forces=[FORCES["spring"]])
    system.save(tmp_path / "system.toml")
    assert sb.System.load(tmp_path / "system.toml") == system
    stiffer = system.replace(**{"force.stiffness": 50.0})
    assert stiffer.forces[0].stiffness == 50.0 and stiffer.hash != system.hash
    assert system.get("force.location") == 0.3


@pytest.mark.parametrize(
    ("force", "more", "words"),
    [
        (sb.LocalSpring(stiffness=1.0), {}, "force.location = None"),
        (sb.LocalSpring(stiffness=1.0, shape=[1.0, 0.0, 0.0]), {}, "leave shape out"),
        (3.0, {}, r"forces\[0\] = 3.0: must be an ExternalForce"),
    ],
)
def test_refusals(force, more, words):
    with pytest.raises(InputError, match=words):
        start = sb.State(amplitude=MODEL.well_amplitude)
        sb.simulate(sb.System(MODEL, forces=[force], initial_state=start, **more))


@SLOW
def test_coulomb_friction_of_an_oscillator():
    """Every cycle takes 4 F_c/k of the amplitude, until the smoothing is felt; and the same by DOP853."""
    mass, frequency, friction, smoothing, start = 2e-3, 80.0, 2e-3, 2e-5, 1e-3
    omega = 2.0 * math.pi * frequency
    spring = mass * omega**2
    model = sb.ReducedModel.from_matrices([[mass]], [spring], contact_shape=[1.0], length_scale=start)
    law = sb.CoulombFriction(friction_force=friction, smoothing_velocity=smoothing, shape=[1.0])
    system = sb.System(model, forces=[law], initial_state=sb.State(amplitude=[start]))
    cycles = 20
    times = np.arange(cycles + 1) / frequency * (1.0 - 1e-13)
    run = sb.simulate(system, sb.Integration(cycles=cycles, accuracy="reference"), sample_times=times)
    found = run.dataset["modal_amplitude"].values[:, 0]
    np.testing.assert_allclose(np.diff(found), -4.0 * friction / spring, rtol=2e-3)

    def rate(t, z):
        return [z[1], -(omega**2) * z[0] - friction / mass * math.tanh(z[1] / smoothing)]

    truth = solve_ivp(rate, (0.0, times[-1]), [start, 0.0], "LSODA", t_eval=times, rtol=1e-11, atol=1e-15)
    np.testing.assert_allclose(found, truth.y[0], rtol=0.0, atol=1e-6 * start)


@pytest.mark.sampled(3)
@pytest.mark.parametrize("own", [False, True])
@pytest.mark.parametrize("seed", range(3))
def test_friction_that_reverses_within_a_fraction_of_a_flight_step(own: bool, seed: int, friction) -> None:
    """A force too small to damp, of velocities that pass zero in a short time: the steps resolve that time."""
    rng = np.random.default_rng([40, seed])
    modes = 2 + seed
    sizes = rng.uniform(-1.0, 1.0, (modes, modes))
    mass = 0.2 * (np.eye(modes) + 0.3 * sizes @ sizes.T)
    omega = 2.0 * math.pi * np.sort(rng.uniform(8.0, 30.0, modes))
    root, (turn, _) = np.linalg.cholesky(mass), np.linalg.qr(rng.standard_normal((modes, modes)))
    stiffness = root @ turn @ np.diag(omega**2) @ turn.T @ root.T
    row, force, smoothing, length = rng.uniform(0.5, 1.0, modes), 5e-3, 2e-3, 5e-3
    model = sb.ReducedModel.from_matrices(
        mass, 0.5 * (stiffness + stiffness.T), contact_shape=row, base_shape=np.ones(modes), length_scale=length,
        damping_ratio=0.01, nonlinear_stiffness=1e5,
    )  # fmt: skip
    law = type(friction) if own else sb.CoulombFriction
    system = sb.System(
        model,
        forces=[law(friction_force=force, smoothing_velocity=smoothing, shape=row)],
        base_excitation=sb.BaseExcitation(motion=sb.AccelerationSine(frequency_ratio=0.9, acceleration_amplitude=0.3)),
        initial_state=sb.State(amplitude=length * row),
    )
    times = np.linspace(0.0, 2.0, 21)[1:] / model.reference_frequency * (1.0 - 1e-9)
    truth = independent(system, system.initial_state, times)
    for accuracy, most in (("reference", 1e-8), ("standard", 1e-4)):
        run = sb.simulate(system, sb.Integration(cycles=2, accuracy=accuracy), sample_times=times)
        error = np.abs(run.dataset["modal_amplitude"].values - truth).max()
        assert error < most * length, (accuracy, error / length)


@pytest.fixture
def own_drag():
    """Quadratic damping as a law of one's own."""

    @dataclass(frozen=True, kw_only=True)
    class OwnDrag(sb.LocalForce):
        coefficient: float = sb.quantity("kg/m", "drag", low=0.0)

        name = "own_drag"
        dissipative = True

        @staticmethod
        def damping_force(law, displacement, velocity):
            return -law.coefficient * abs(velocity) * velocity

        @staticmethod
        def damping_coefficient(law, displacement, velocity):
            return 2.0 * law.coefficient * abs(velocity)

    yield OwnDrag
    LOCAL_FORCES.pop("own_drag")


@pytest.mark.sampled(2)
@pytest.mark.parametrize("own", [False, True])
def test_drag_that_reverses_inside_a_step(own: bool, own_drag) -> None:
    """The force has a kink at zero velocity: a step ends close to it, so that level reference keeps its order."""
    mass, frequency, drag, start = 2e-3, 80.0, 2.0, 1e-3
    omega = 2.0 * math.pi * frequency
    model = sb.ReducedModel.from_matrices([[mass]], [mass * omega**2], contact_shape=[1.0], length_scale=start)
    law = (own_drag if own else sb.QuadraticDamping)(coefficient=drag, shape=[1.0])
    assert law.reversal_speed(start, start * omega) == 0.0
    system = sb.System(model, forces=[law], initial_state=sb.State(amplitude=[start]))
    times = np.linspace(0.0, 6.0 / frequency, 61) * (1.0 - 1e-13)
    run = sb.simulate(system, sb.Integration(cycles=6, accuracy="reference"), sample_times=times)

    def rate(t, z):
        return [z[1], -(omega**2) * z[0] - drag / mass * abs(z[1]) * z[1]]

    truth = solve_ivp(
        rate, (0.0, times[-1]), [start, 0.0], "DOP853", t_eval=times, rtol=1e-13, atol=1e-17, max_step=1e-5
    )
    np.testing.assert_allclose(run.dataset["modal_amplitude"].values[:, 0], truth.y[0], rtol=0.0, atol=1e-9 * start)


def test_speed_over_which_friction_reverses() -> None:
    friction = sb.CoulombFriction(friction_force=1.0, smoothing_velocity=2e-3)
    assert friction.reversal_speed(1e-3, 1.0) == pytest.approx(2e-3, rel=0.2)


@pytest.mark.filterwarnings("ignore:engine = 'python' is made to be read")
@pytest.mark.parametrize("engine", ["native", "python"])
def test_a_start_beyond_the_range_of_a_law(engine: str) -> None:
    """One start is refused by name; of a batch those runs end at once, and the others are what they are alone."""
    well = MODEL.well_amplitude
    end = 1.4 * abs(float(MODEL.midspan_shape @ well))
    spring = sb.LocalSpring(stiffness=5.0, cubic_stiffness=-5.0 / end**2, location=0.5)
    system = sb.System(MODEL, forces=[spring], initial_state=sb.State(amplitude=-1.5 * well))
    with pytest.raises(InputError, match=r"initial_state: the displacement .* of LocalSpring must be within"):
        sb.simulate(system, sb.Integration(cycles=1, engine=engine))
    inside = sb.State(amplitude=0.9 * well)
    alone = sb.advance(system, inside, 1, integration=sb.Integration(engine=engine))
    batch = sb.State(amplitude=np.stack((0.9 * well, -1.5 * well, 1.5 * well)))
    found = sb.advance(system, batch, 1, integration=sb.Integration(engine=engine))
    assert found.statistics["status"].tolist() == [sb.RunStatus.OK, sb.RunStatus.DIVERGED, sb.RunStatus.DIVERGED]
    assert np.isnan(found.amplitude[1:]).all()
    np.testing.assert_allclose(found.amplitude[0], alone.amplitude, rtol=1e-12, atol=0.0)
