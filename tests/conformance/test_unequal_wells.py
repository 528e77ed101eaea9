"""Unequal wells: an independent solution, SciPy's minimisation, the limit of equal ones, the mirror image."""

from __future__ import annotations

import math

import numpy as np
import pytest
import xarray as xr
from extended_oracle import Tip, follow
from oracle import LEVEL, LOCATION
from uneven_beam import UnevenBeam

import snapbeam as sb
from snapbeam.model import default_values
from snapbeam.solver.assemble import make_ensemble
from snapbeam.util.status_codes import RunStatus
from snapbeam.util.validation import InputError

HERTZ = 4e8
GIVEN = {
    "an initial shape": {"rise": 1e-5},
    "a crooked one that pushes back": {"rise": -8e-6, "skew": 6e-6},
    "a side load": {"force": 0.05, "at": 0.35},
}


def imperfection(rise: float = 0.0, skew: float = 0.0, force: float = 0.0, at: float = 0.5) -> sb.Imperfection:
    return sb.Imperfection(midspan_amplitude=rise, antisymmetric_amplitude=skew, point_load=force, point_location=at)


def model_of(modes: int, **given: float) -> sb.ReducedModel:
    return sb.ReducedModel.from_beam(default_values.BEAM, modes=modes, imperfection=imperfection(**given))


def struck_system(model: sb.ReducedModel, ratio: float, velocity: float, **more) -> sb.System:
    drive = sb.Sine(frequency_ratio=ratio, velocity_amplitude=velocity)
    return sb.System(
        model, contacts=[sb.Contact(default_values.CONTACT, sb.Striker(drive=drive, location=LOCATION, **more))]
    )


@pytest.mark.slow
@pytest.mark.parametrize("given", GIVEN.values(), ids=GIVEN)
@pytest.mark.parametrize(("modes", "cycles"), [(1, 4), (3, 2), (8, 1)])
def test_independent_solution(modes, cycles, given) -> None:
    """The paper's coordinates with the energy's gradient as it is written, DOP853."""
    if modes == 1 and ("skew" in given):
        pytest.skip("one mode is symmetric")
    beam = UnevenBeam(modes, **given)
    model = model_of(modes, **given)
    np.testing.assert_allclose(model.well_amplitude, beam.rest, rtol=0.0, atol=1e-12 * abs(beam.rest[0]))
    np.testing.assert_allclose(2.0 * math.pi * model.natural_frequencies, beam.omega, rtol=1e-9)
    first = 2.0 * math.pi * model.reference_frequency
    omega, velocity = 1.21 * first, 0.4
    stroke = velocity * LEVEL * first / omega
    tip = Tip(
        lambda t, _: (stroke * math.sin(omega * t), stroke * omega * math.cos(omega * t)), lambda d, _: HERTZ * d**1.5
    )
    times = np.linspace(0.0, cycles * 2.0 * math.pi / omega, 801) * (1.0 - 1e-13)
    truth = follow(beam, tip, times)
    for accuracy, bound in (("standard", 1e-3), ("reference", 1e-7)):
        run = sb.simulate(
            struck_system(model, 1.21, velocity), sb.Integration(cycles=cycles, accuracy=accuracy), sample_times=times
        )
        data = run.dataset
        np.testing.assert_allclose(data.displacement_at_striker, truth.displacement_at_striker, rtol=0.0, atol=bound)
        np.testing.assert_allclose(data.midspan_displacement, truth.midspan_displacement, rtol=0.0, atol=bound)
        ledger = data.energy_beam + data.energy_contact + data.energy_dissipated - data.striker_work
        assert np.ptp(ledger.values) < 1e-4 * data.attrs["gross_work"]
    assert run.summary.zero_crossings > 0 or cycles == 1


@pytest.mark.parametrize("seed", [pytest.param(seed, marks=pytest.mark.slow if seed > 1 else ()) for seed in range(6)])
def test_no_equilibrium_is_missed(seed) -> None:
    """Every minimum that 200 starts find is there, and every equilibrium is one."""
    rng = np.random.default_rng(seed)
    modes = int(rng.integers(1, 6))
    given = {"rise": LEVEL * rng.uniform(-0.12, 0.12), "force": rng.uniform(-0.3, 0.3), "at": rng.uniform(0.1, 0.9)}
    if modes > 1:
        given["skew"] = LEVEL * rng.uniform(-0.1, 0.1)
    if seed % 2 == 0:
        given = {name: 0.05 * value for name, value in given.items()} | {"at": given["at"]}
    beam, model = UnevenBeam(modes, **given), model_of(modes, **given)
    size, known = abs(beam.first[0]), np.array([each.amplitude for each in model.equilibria])
    for each in model.equilibria:
        tangent = beam.tangent(each.amplitude)
        assert np.abs(beam.gradient(each.amplitude)).max() < 1e-10 * np.abs(tangent).max() * size
        assert each.unstable_directions == (np.linalg.eigvalsh(tangent) < 0.0).sum()
        assert each.energy - model.equilibria[0].energy == pytest.approx(
            beam.energy(each.amplitude) - beam.energy(known[0]), rel=1e-9, abs=1e-16
        )
    stable = known[[each.is_stable for each in model.equilibria]]
    reached = set()
    for _ in range(200):
        end = beam.settled(rng.standard_normal(modes) * 1.5 * size / np.arange(1, modes + 1))
        distance = np.abs(stable - end).max(axis=1)
        assert distance.min() < 1e-8 * size
        reached.add(int(distance.argmin()))
    assert reached == set(range(len(stable)))
    assert model.is_bistable == (len(stable) == 2)


def test_nothing_is_bit_for_bit_the_perfect_beam() -> None:
    perfect = sb.ReducedModel.from_beam(default_values.BEAM, modes=3)
    system = struck_system(model_of(3), 1.21, 0.2)
    assert system == struck_system(perfect, 1.21, 0.2)
    assert system.model.imperfection is None


@pytest.mark.slow
def test_a_small_shape_recedes_to_the_perfect_beam() -> None:
    """The error falls in proportion to the shape: to the perfect beam's own solution."""
    run = sb.simulate(struck_system(model_of(3), 1.3, 0.15), sb.Integration(cycles=1, accuracy="reference"))
    errors = []
    for rise in (1e-9, 1e-10, 1e-11):
        near = sb.simulate(
            struck_system(model_of(3, rise=rise), 1.3, 0.15), sb.Integration(cycles=1, accuracy="reference")
        )
        errors.append(
            float(
                np.abs(near.final_state.amplitude - run.final_state.amplitude).max() / abs(run.final_state.amplitude[0])
            )
        )
    assert errors[0] < 1e-4
    assert errors[1] == pytest.approx(0.1 * errors[0], rel=0.05)
    assert errors[2] == pytest.approx(0.01 * errors[0], rel=0.1)


@pytest.mark.slow
def test_mirror_image() -> None:
    """The mirrored system's mirrored run, to the last bit."""
    given = {"rise": 9e-6, "skew": 4e-6, "force": 0.03, "at": 0.3}
    model = model_of(3, **given)
    mirrored = sb.ReducedModel.from_beam(default_values.BEAM, modes=3, imperfection=model.imperfection.mirrored)
    np.testing.assert_array_equal(mirrored.wells[::-1], -model.wells)
    for velocity in (0.1, 0.2, 0.35):
        below = sb.advance(struck_system(model, 1.3, velocity), periods=5)
        above = sb.advance(struck_system(mirrored, 1.3, velocity, side="above"), periods=5)
        np.testing.assert_array_equal(above.amplitude, -below.amplitude)
        np.testing.assert_array_equal(above.velocity, -below.velocity)
        np.testing.assert_array_equal(above.statistics["zero_crossings"], below.statistics["zero_crossings"])


def test_a_run_knows_nothing_of_the_others_of_its_batch() -> None:
    """Where the tip is at rest, to the last bit, whichever other places are asked for with it."""
    model = sb.ReducedModel.from_beam(
        default_values.BEAM,
        modes=3,
        imperfection=sb.Imperfection(
            midspan_amplitude=4e-6, antisymmetric_amplitude=3e-6, point_load=0.01, uniform_load=0.02
        ),
    )
    system = sb.System(
        model, contacts=[sb.Contact(default_values.CONTACT, sb.Shaker(frequency_ratio=1.3, velocity_amplitude=0.2))]
    )
    places = np.linspace(0.15, 0.85, 41)
    together = make_ensemble(system, sb.Integration(), {"contact.location": places})
    for i, place in enumerate(places):
        alone = make_ensemble(system, sb.Integration(), {"contact.location": np.array([place])})
        assert together.runs["rest_contact"][i] == alone.runs["rest_contact"][0]
        assert together.highest[i] == alone.highest[0]


@pytest.mark.slow
def test_going_on_loses_no_bit() -> None:
    system = struck_system(model_of(3, rise=1e-5, skew=5e-6), 1.21, 0.25)
    once = sb.advance(system, periods=4)
    assert once.statistics["zero_crossings"] > 0
    twice = sb.advance(system, sb.advance(system, periods=2), periods=2)
    np.testing.assert_array_equal(twice.amplitude, once.amplitude)


def test_far_well_is_quiet() -> None:
    """At rest in either well nothing moves, as far as the kicks and flows of a step cancel (1e-9 at level standard)."""
    model = model_of(4, rise=1.5e-5, skew=3e-6)
    for well in model.wells:
        system = sb.System(model, initial_state=sb.State(amplitude=well))
        run = sb.simulate(system, sb.Integration(cycles=3, accuracy="reference"))
        drift = np.abs(run.final_state.amplitude - well).max() / abs(model.wells[0, 0])
        assert drift < 1e-13
        assert run.summary.zero_crossings == 0


def random_runs(modes: int, count: int, seed: int, cycles: int) -> tuple[int, int, set[int]]:
    """Runs with and without early decision, each of its own imperfection; decided, wrong, and the classes seen."""
    rng = np.random.default_rng(seed)
    decided = wrong = 0
    classes: set[int] = set()
    groups = max(1, count // 40)
    for _ in range(groups):
        given = {
            "rise": LEVEL * rng.uniform(-0.04, 0.04),
            "force": rng.uniform(-0.05, 0.05),
            "at": rng.uniform(0.2, 0.8),
        }
        if modes > 1:
            given["skew"] = LEVEL * rng.uniform(-0.03, 0.03)
        model = model_of(modes, **given)
        if not model.is_bistable:
            continue
        side = "above" if rng.random() < 0.5 else "below"
        columns = {"frequency_ratio": (0.3, 3.5), "velocity_amplitude": (0.02, 0.6), "location": (0.1, 0.9)}
        points = xr.Dataset({name: ("point", rng.uniform(*span, 40)) for name, span in columns.items()})
        system = struck_system(model, 1.2, 0.2, side=side)
        full, early = (
            sb.sweep(system, points, sb.Integration(cycles=cycles, early_termination=flag)) for flag in (False, True)
        )
        decided += int((early.status == RunStatus.EARLY_STOP).sum())
        wrong += int((early.response_class != full.response_class).sum())
        classes |= set(full.response_class.values.tolist())
    return decided, wrong, classes


@pytest.mark.slow
@pytest.mark.parametrize(("modes", "count", "cycles"), [(1, 1000, 60), (8, 1000, 60)])
def test_early_terminations(modes, count, cycles) -> None:
    decided, wrong, classes = random_runs(modes, count, 10 * modes, cycles)
    assert wrong == 0
    assert decided >= count // 10
    assert classes == {0, 1, 2, 3}


def test_refusals() -> None:
    with pytest.raises(InputError, match="needs two wells: this imperfection leaves one"):
        model_of(3, rise=2e-4).require_bistable("a map")
    with pytest.raises(InputError, match=r"antisymmetric_amplitude = .*: needs a second mode"):
        model_of(1, skew=1e-5)
    with pytest.raises(InputError, match="must ascend from 0 to 1"):
        sb.Imperfection(profile=[[0.0, 0.2, 0.4, 0.9], [0.0, 1e-5, 1e-5, 0.0]])
    with pytest.raises(InputError, match="well_amplitude with transverse_force"):
        sb.ReducedModel.from_matrices(
            [[1.0]], [-1.0], contact_shape=[1.0], nonlinear_stiffness=1.0, well_amplitude=[-1.0], transverse_force=[0.1]
        )
