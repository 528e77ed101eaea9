"""Damping matrices that couple the linear modes: exact free decays, poles, energy, contact, other parts."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.linalg import expm

import snapbeam as sb
from snapbeam import InputError

pytestmark = pytest.mark.filterwarnings("ignore:engine = 'python'")
ENGINES = pytest.mark.parametrize("engine", ["native", "python"])


def matrices(modes: int, seed: int = 5, rank: int = 1) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """M, K and a C of some dampers between coordinates, whose modal form is far from diagonal."""
    rng = np.random.default_rng(seed)
    mass, stiffness = rng.standard_normal((2, modes, modes))
    dampers = rng.standard_normal((modes, rank))
    return (
        np.eye(modes) + 0.1 * mass @ mass.T / modes,
        np.diag(np.linspace(6.0, 6.0 + 3.0 * modes, modes) ** 2) + stiffness + stiffness.T,
        0.4 * (dampers @ dampers.T),
    )


def state_matrix(mass, stiffness, damping) -> np.ndarray:
    n = len(mass)
    below = -np.linalg.solve(mass, np.hstack((stiffness, damping)))
    return np.vstack((np.hstack((np.zeros((n, n)), np.eye(n))), below))


def let_go(mass, stiffness, damping, **more) -> sb.System:
    n = len(mass)
    model = sb.ReducedModel.from_matrices(
        mass, stiffness, contact_shape=np.ones(n), damping=damping, length_scale=0.1, **more
    )
    rng = np.random.default_rng(9)
    return sb.System(model, initial_state=sb.State(amplitude=rng.uniform(-0.1, 0.1, n), velocity=rng.uniform(-1, 1, n)))


def integrated(system: sb.System, **how):
    """Time (s), amplitudes and velocities in the coordinates of the matrices at the end, and the run."""
    run = sb.simulate(system, sb.Integration(**{"cycles": 4, "accuracy": "reference", "engine": "native"} | how))
    end = run.final_state
    return float(run.dataset.time[-1]), np.concatenate((end.amplitude, end.velocity)), run


def error(system: sb.System, mass, stiffness, damping, **how) -> float:
    """Distance of the end of a free decay from the matrix exponential, over the start, in energies."""
    time, found, run = integrated(system, **how)
    assert abs(run.dataset.attrs["energy_error"]) < 1e-8
    start = np.concatenate((system.initial_state.amplitude, system.initial_state.velocity))
    scale = np.concatenate((np.full(len(mass), 6.0), np.ones(len(mass))))
    exact = expm(state_matrix(mass, stiffness, damping) * time) @ start
    return float(np.linalg.norm(scale * (found - exact)) / np.linalg.norm(scale * start))


@pytest.mark.sampled(2)
@ENGINES
@pytest.mark.parametrize(("modes", "rank"), [(2, 1), (2, 2), (20, 1), (20, 20)])
def test_free_decay_by_the_matrix_exponential(engine: str, modes: int, rank: int) -> None:
    given = matrices(modes, rank=rank)
    system = let_go(*given)
    assert system.model.modal_damping.coefficients.size == rank
    assert error(system, *given, engine=engine) < 1e-9


CHAIN = np.array([[1.0, -1.0, 0.0], [-1.0, 2.0, -1.0], [0.0, -1.0, 1.0]]) * 40.0


@ENGINES
@pytest.mark.parametrize("dampers", [(0.3, 0.0, 0.1), (30.0, 1.0, 0.1)])
@pytest.mark.parametrize("support", [0.0, 100.0])
def test_rigid_and_overdamped_modes(engine: str, dampers, support: float) -> None:
    """Dampers to the ground on a free chain, and on one with supports."""
    given = np.eye(3), CHAIN + support * np.eye(3), np.diag(dampers)
    system = let_go(*given, reference_frequency=1.0)
    assert (system.model.modal_damping.ratio < 1.0).all()
    assert error(system, *given, engine=engine) < 2e-10


@pytest.mark.parametrize("modes", [2, 20])
def test_poles(modes: int) -> None:
    given = matrices(modes)
    exact = np.linalg.eigvals(state_matrix(*given))
    found = let_go(*given).poles()
    assert len(found) == 2 * modes
    assert max(np.abs(found - each).min() / abs(each) for each in exact) < 1e-12


def test_damping_of_rayleigh_is_that_of_ratios() -> None:
    """C = a M + b K couples no modes: the same numbers as the damping ratios of its modes, by every engine."""
    mass, stiffness, _ = matrices(6)
    damped = let_go(mass, stiffness, 0.2 * mass + 1e-3 * stiffness)
    model = damped.model
    assert model.modal_damping.coefficients.size == 0
    ratios = 0.1 / model.omega + 5e-4 * model.omega
    np.testing.assert_allclose(model.damping_ratio, ratios, rtol=1e-12)
    other = sb.ReducedModel.from_matrices(
        mass, stiffness, contact_shape=np.ones(6), damping_ratio=ratios, length_scale=0.1
    )
    np.testing.assert_allclose(other.damping_matrix, model.damping_matrix, atol=1e-11)
    one, two = (integrated(each)[1] for each in (damped, sb.System(other, initial_state=damped.initial_state)))
    np.testing.assert_allclose(one, two, atol=1e-12)


def test_matrices_reduced_to_few_modes() -> None:
    """The projection Phi^T C Phi of the damping, of dense and sparse matrices."""
    import scipy.sparse as sp
    from scipy.linalg import eigh

    mass, stiffness, damping = matrices(12)
    basis = eigh(stiffness, mass)[1][:, :4]
    for form in (np.asarray, sp.csr_array):
        model = sb.ReducedModel.from_matrices(
            form(mass), form(stiffness), contact_shape=np.ones(12), damping=form(damping), modes=4
        )
        turned = model.linear_modes.T @ model.damping @ model.linear_modes
        np.testing.assert_allclose(np.abs(turned), np.abs(basis.T @ damping @ basis), atol=1e-9)


def test_a_fixed_coordinate_takes_its_dampers_with_it() -> None:
    mass, stiffness, damping = matrices(4)
    held = stiffness.copy()
    held[1, 1] = 1e18
    free = [0, 2, 3]
    with pytest.warns(sb.DiagnosticWarning, match="fix the coordinates 1"):
        model = sb.ReducedModel.from_matrices(mass, held, contact_shape=np.ones(4), damping=damping)
    np.testing.assert_array_equal(model.damping, damping[np.ix_(free, free)])


def struck(modes: int, side: str = "below", **parts) -> tuple[sb.System, tuple[np.ndarray, ...]]:
    """A free structure that swings against a stop."""
    given = matrices(modes)
    model = sb.ReducedModel.from_matrices(
        given[0], given[1], contact_shape=np.ones(modes), damping=given[2], length_scale=0.1
    )
    striker = sb.Striker(drive=sb.FixedStop(), side=side, gap=0.02)
    state = sb.State(amplitude=np.zeros(modes), velocity=np.full(modes, 1.0 if side == "above" else -1.0))
    contact = sb.Contact(sb.KelvinVoigt(linear_stiffness=3e3, linear_damping=1.0), striker)
    return sb.System(model, contacts=[contact], initial_state=state, **parts), given


@pytest.mark.sampled(2)
@pytest.mark.parametrize(("modes", "cycles"), [(2, 6), (20, 2)])
@pytest.mark.parametrize("side", ["below", "above"])
def test_contact_by_another_integrator(modes: int, cycles: int, side: str) -> None:
    """Impacts on a lossy stop, by DOP853 with events at onset, release and where the stop ceases to press."""
    system, (mass, stiffness, damping) = struck(modes, side)
    time, found, run = integrated(system, cycles=cycles, engine="native")
    assert run.summary.impacts >= 1
    assert abs(run.dataset.attrs["energy_error"]) < 1e-7
    n, sign = modes, -1.0 if side == "below" else 1.0
    gap = 0.02
    inverse = np.linalg.inv(mass)

    def rate(t, s, pressing):
        push = np.zeros(n)
        if pressing:
            d, v = sign * s[:n].sum() - gap, sign * s[n:].sum()
            push -= sign * (3e3 * d + 1.0 * v)
        return np.concatenate((s[n:], inverse @ (push - damping @ s[n:] - stiffness @ s[:n])))

    def depth(t, s, pressing):
        return sign * s[:n].sum() - gap + 1e-15

    def force(t, s, pressing):
        return 3e3 * (sign * s[:n].sum() - gap) + sign * s[n:].sum()

    s = np.concatenate((system.initial_state.amplitude, system.initial_state.velocity))
    at, state = 0.0, "apart"
    while at < time:
        event = {"apart": depth, "pressing": force, "loose": depth}[state]
        event.terminal, event.direction = True, 1.0 if state == "apart" else -1.0
        part = solve_ivp(
            rate, (at, time), s, "DOP853", rtol=1e-12, atol=1e-13, events=event, args=(state == "pressing",),
            max_step=2e-3,
        )  # fmt: skip
        at, s = float(part.t[-1]), part.y[:, -1]
        if part.status == 1:
            state = {"apart": "pressing", "pressing": "loose", "loose": "apart"}[state]
    scale = np.concatenate((np.full(n, 6.0), np.ones(n)))
    assert np.linalg.norm(scale * (found - s)) < 1e-7 * np.sqrt(n)


def test_both_engines_with_a_circuit_and_a_local_damper() -> None:
    """Circuits without and with inertia are told from the damping of the structure."""
    n = 3
    mass, stiffness, damping = matrices(n)
    model = sb.ReducedModel.from_matrices(
        mass, stiffness, contact_shape=np.ones(n), damping=damping, length_scale=0.1, patch_shape=[1.0, 0.5, 0.0]
    )
    coil = sb.ElectromagneticHarvester(force_factor=0.5, resistance=3.0, coil_resistance=2.0)
    layer = sb.PiezoelectricHarvester(moment_per_volt=0.6, capacitance=0.3, resistance=2.0)
    start = sb.State(amplitude=[0.1, 0.0, -0.05], velocity=np.zeros(n))
    system = sb.System(
        model, harvesters=[coil, layer], forces=[sb.QuadraticDamping(coefficient=0.1)], initial_state=start
    )
    runs = [integrated(system, engine=engine, cycles=6) for engine in ("native", "python")]
    np.testing.assert_allclose(runs[0][1], runs[1][1], atol=1e-7)  # |v| v is not smooth
    native, python = (run.dataset for _, _, run in runs)
    energies = [name for name in native if "energy" in str(name) or "work" in str(name)]
    assert len(energies) >= 4
    for name in energies:
        np.testing.assert_allclose(native[name].values[..., -1], python[name].values[..., -1], rtol=1e-5)
    assert abs(native.attrs["energy_error"]) < 1e-8 and native["energy_dissipated"].values[-1] > 0.0


def test_a_sweep_is_its_runs(monkeypatch) -> None:
    """Runs side by side, with the damping of the structure as channels beside the contact."""
    monkeypatch.setenv("SNAPBEAM_ENGINE", "native")
    system, _ = struck(2)
    how = sb.Integration(cycles=5)
    found = sb.sweep(system, {"contact.gap": [0.01, 0.02, 0.03]}, how)
    for gap, peak in zip((0.01, 0.02, 0.03), found["peak_force"].values, strict=True):
        run = sb.simulate(system.replace(**{"contact.gap": gap}), how)
        assert peak == pytest.approx(run.summary.peak_force, rel=1e-12)


def test_unequal_wells_have_one_matrix() -> None:
    """The mirror image has the same C, and ratios of the modes about its own well; DOP853 across both wells."""
    n = 2
    mass, stiffness = np.eye(n), np.diag([-40.0, 900.0])
    damping = np.array([[0.5, 0.9], [0.9, 4.0]])
    model = sb.ReducedModel.from_matrices(
        mass, stiffness, contact_shape=[1.0, 0.3], damping=damping, nonlinear_stiffness=4e3, length_scale=0.1,
        transverse_force=[0.3, 0.2],
    )  # fmt: skip
    mirrored = model.mirrored
    np.testing.assert_array_equal(mirrored.damping_matrix, damping)
    for each in (model, mirrored):
        rates = np.diag(each.linear_modes.T @ damping @ each.linear_modes)
        np.testing.assert_allclose(each.damping_ratio, rates / (2.0 * each.omega), rtol=1e-12)
    assert not np.allclose(model.damping_ratio, mirrored.damping_ratio, rtol=1e-3)
    start = sb.State(amplitude=[-0.1, 0.0], velocity=[3.0, 1.0])

    def rate(t, s):
        a = s[:n]
        force = model.transverse_force - stiffness @ a - 4e3 * (a @ a) * a - damping @ s[n:]
        return np.concatenate((s[n:], force))

    for engine in ("native", "python"):
        system = sb.System(model, initial_state=start)
        time, found, run = integrated(system, engine=engine)
        exact = solve_ivp(
            rate, (0.0, time), np.concatenate((start.amplitude, start.velocity)), "DOP853", rtol=1e-12, atol=1e-13
        ).y[:, -1]
        np.testing.assert_allclose(found, exact, atol=1e-8)
        assert abs(run.dataset.attrs["energy_error"]) < 1e-8


@pytest.mark.parametrize(
    ("damping", "more", "message"),
    [
        (np.eye(2), {"damping_ratio": 0.01}, r"damping with damping_ratio = 0.01: must be one of the two"),
        (np.eye(3), {}, r"damping of shape \(3, 3\): must have the shape \(2, 2\)"),
        ([1.0, 2.0], {}, r"damping of shape \(2,\): must have the shape \(2, 2\)"),
        ([[1.0, 0.5], [0.2, 1.0]], {}, r"damping\[0, 1\] = 0.5, damping\[1, 0\] = 0.2: must be symmetric"),
        ([[1.0, np.inf], [np.inf, 1.0]], {}, r"damping.*must be finite"),
        ([[1.0, 2.0], [2.0, 1.0]], {}, r"damping: its lowest eigenvalue is -1; must be at least 0"),
        ([[-1e-3, 0.0], [0.0, 0.0]], {}, r"damping: its lowest eigenvalue is -0.001; must be at least 0"),
        (1e308 * np.eye(2), {"scale": 1e-9}, r"damping: its rates are beyond what a number holds"),
    ],
)
def test_what_is_refused(damping, more, message) -> None:
    scale = more.get("scale", 1.0)
    more = {name: value for name, value in more.items() if name != "scale"}
    with pytest.raises(InputError, match=message):
        sb.ReducedModel.from_matrices(scale * np.eye(2), [1.0, 2.0], contact_shape=[1.0, 1.0], damping=damping, **more)


def test_other_parts_of_the_package() -> None:
    system, (_, _, damping) = struck(2)
    same = sb.System.from_mapping(system.to_mapping())
    np.testing.assert_array_equal(same.model.damping, damping)
    assert same == system and same.hash == system.hash
    other = system.replace(**{"model.reference_frequency": 2.0})
    np.testing.assert_array_equal(other.model.damping, damping)
    with pytest.raises(InputError, match=r"model.damping_ratio = 0.01: cannot be changed, the model has a damping"):
        system.replace(**{"model.damping_ratio": 0.01})
