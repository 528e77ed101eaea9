"""Runs of beams whose ends turn or give way: an independent solution, the limits of clamps and hinges, equilibria."""

from __future__ import annotations

import math

import numpy as np
import pytest
from extended_oracle import Tip, follow
from oracle import LEVEL, LOCATION
from sprung_beam import BENDING, SprungBeam

import snapbeam as sb
from snapbeam.model import default_values

HERTZ, UNIT = 4e8, BENDING / 0.161
SLOW = pytest.mark.slow
ENDS = {
    "springs of their own": (3.0 * UNIT, 40.0 * UNIT, None),
    "pinned": (0.0, 0.0, None),
    "a clamp and a hinge": (None, 0.0, None),
    "supports that give": (None, None, 2e6),
}


def model_of(modes: int, left: float | None, right: float | None, axial: float | None = None):
    beam = default_values.BEAM.replace(
        boundary=sb.BoundaryConditions(
            left_rotational_stiffness=left, right_rotational_stiffness=right, axial_support_stiffness=axial
        )
    )
    return sb.ReducedModel.from_beam(beam, modes=modes)


def struck(model: sb.ReducedModel, velocity: float = 0.3) -> sb.System:
    drive = sb.Sine(frequency_ratio=1.21, velocity_amplitude=velocity)
    return sb.System(model, contacts=[sb.Contact(default_values.CONTACT, sb.Striker(drive=drive, location=LOCATION))])


@pytest.mark.sampled(2)
@pytest.mark.parametrize("ends", ENDS.values(), ids=ENDS)
@pytest.mark.parametrize(("modes", "cycles"), [pytest.param(1, 3, marks=SLOW), (3, 2), pytest.param(8, 1, marks=SLOW)])
def test_independent_solution(modes, cycles, ends) -> None:
    if ends[2] is not None:
        cycles = min(cycles, 1)  # two answer a relative change of 1e-10 by more than 1e-7 b
    beam, model = SprungBeam(modes, *ends), model_of(modes, *ends)
    np.testing.assert_allclose(2.0 * math.pi * model.natural_frequencies, beam.omega, rtol=1e-9)
    first = float(beam.omega[0])
    omega = 1.21 * first
    stroke = 0.3 * LEVEL * first / omega
    tip = Tip(
        lambda t, _: (stroke * math.sin(omega * t), stroke * omega * math.cos(omega * t)), lambda d, _: HERTZ * d**1.5
    )
    times = np.linspace(0.0, cycles * 2.0 * math.pi / omega, 801) * (1.0 - 1e-13)
    truth = follow(beam, tip, times)
    for accuracy, bound in (("standard", 1e-3), ("reference", 1e-7)):
        run = sb.simulate(struck(model), sb.Integration(cycles=cycles, accuracy=accuracy), sample_times=times)
        data = run.dataset
        worst = max(
            float(np.abs(data[name].values - getattr(truth, name)).max())
            for name in ("displacement_at_striker", "midspan_displacement", "penetration_normalised")
        )
        print(modes, ends, accuracy, worst)
        assert worst < bound
        ledger = data.energy_beam + data.energy_contact + data.energy_dissipated - data.striker_work
        assert np.ptp(ledger.values) < 1e-4 * data.attrs["gross_work"]
    assert run.summary.impacts > 0


def end_of(model: sb.ReducedModel) -> np.ndarray:
    """Displacements at eleven places after one cycle, over b: the sign of a shape does not matter."""
    run = sb.simulate(struck(model, 0.15), sb.Integration(cycles=1, accuracy="reference"))
    shapes = np.array([model.shape_at(x) for x in np.linspace(0.05, 0.95, 11)])
    return np.asarray(shapes @ run.final_state.amplitude) / model.length_scale


def test_stiff_springs_recede_to_clamps() -> None:
    clamped = end_of(sb.ReducedModel.from_beam(default_values.BEAM, modes=3))
    errors = [np.abs(end_of(model_of(3, k * UNIT, k * UNIT)) - clamped).max() for k in (1e4, 1e6, 1e8)]
    assert errors[0] > 30.0 * errors[1] > 900.0 * errors[2]
    assert errors[2] < 1e-6


def test_soft_springs_recede_to_hinges() -> None:
    pinned = end_of(model_of(3, 0.0, 0.0))
    errors = [np.abs(end_of(model_of(3, k * UNIT, k * UNIT)) - pinned).max() for k in (1e-2, 1e-4, 1e-6)]
    assert errors[0] > 30.0 * errors[1] > 900.0 * errors[2]
    assert errors[2] < 1e-4


def test_firm_supports_recede_to_rigid_ones() -> None:
    rigid = end_of(sb.ReducedModel.from_beam(default_values.BEAM, modes=3))
    errors = [np.abs(end_of(model_of(3, None, None, k)) - rigid).max() for k in (1e10, 1e12, 1e14)]
    assert errors[0] > 30.0 * errors[1] > 900.0 * errors[2]
    assert errors[2] < 1e-4


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(2))
def test_no_equilibrium_is_missed(seed) -> None:
    """Uneven and on springs: every minimum that 200 starts of SciPy's minimisation find is listed, and no other."""
    from scipy.optimize import minimize

    rng, modes = np.random.default_rng(seed), 4
    left, right = rng.uniform(0.5, 60.0, 2) * UNIT
    beam = SprungBeam(modes, left, right)
    force, at = rng.uniform(-0.01, 0.01), rng.uniform(0.2, 0.8)
    model = sb.ReducedModel.from_beam(
        default_values.BEAM.replace(
            boundary=sb.BoundaryConditions(left_rotational_stiffness=left, right_rotational_stiffness=right)
        ),
        modes=modes,
        imperfection=sb.Imperfection(point_load=force, point_location=at),
    )
    side, size = force * beam.shape(at * 0.161), abs(beam.rest[0])
    scale = size**2 * float(np.abs(beam.stiffness).max())

    def energy(y: np.ndarray) -> tuple[float, np.ndarray]:
        a = size * y
        s = float(a @ a)
        value = 0.5 * np.sum(beam.stiffness * a * a) + 0.25 * beam.gamma * s * s - side @ a
        return float(value) / scale, (beam.stiffness * a + beam.gamma * s * a - side) * size / scale

    # displacements tell shapes of either sign
    places = np.linspace(0.1, 0.9, 9)
    own = np.array([beam.shape(x * 0.161) for x in places])
    listed = np.array([model.shape_at(x) for x in places])
    stable = [listed @ each.amplitude / LEVEL for each in model.equilibria if each.is_stable]
    reached = set()
    for _ in range(200):
        start = rng.standard_normal(modes) * 1.5 / np.arange(1, modes + 1)
        found = minimize(energy, start, jac=True, method="BFGS", options={"gtol": 1e-13}).x
        away = [float(np.abs(own @ (size * found) / LEVEL - each).max()) for each in stable]
        assert min(away) < 1e-4
        reached.add(int(np.argmin(away)))
    assert reached == set(range(len(stable)))
    assert model.is_bistable == (len(stable) == 2)
