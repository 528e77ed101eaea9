"""Equilibria over a parameter: pull-in, buckling, and a snap-through that another method finds."""

from __future__ import annotations

import math

import numpy as np
import pytest

import snapbeam as sb
from snapbeam.cli.app import app
from snapbeam.model import default_values
from snapbeam.model.equilibrium_paths import paths_over_parameter
from snapbeam.model.potential import Potential
from snapbeam.util.validation import InputError

BEAM = default_values.BEAM


@pytest.mark.parametrize("side", [1.0, pytest.param(-1.0, marks=pytest.mark.slow)])
def test_pull_in_voltage(side: float) -> None:
    """V^2 = 8 k g^3/(27 eps_0 A) at a third of the gap; the frequency goes to zero there."""
    k, gap, area, mass = 2.0, 3e-6, 4e-8, 1e-9
    plate = sb.ReducedModel.from_matrices([[mass]], [[k]], contact_shape=[1.0], length_scale=gap)
    electrode = sb.ElectrostaticForce(voltage=1.0, area=area, gap=side * gap, label="electrode")
    system = sb.System(plate, forces=[electrode])
    found = sb.model.equilibrium_branches(system, "force.electrode.voltage", (0.0, 8.0))
    exact = math.sqrt(8.0 * k * gap**3 / (27.0 * 8.8541878188e-12 * area))
    assert found.critical_kind.values.tolist() == ["limit"]
    assert float(found.critical_value[0]) == pytest.approx(exact, rel=1e-9)
    assert float(found.critical_displacement[0]) == pytest.approx(side * gap / 3.0, rel=1e-5)
    voltage, place = found.force_voltage.values, found.midspan_displacement.values
    pull = 8.8541878188e-12 * area * voltage**2 / 2.0
    np.testing.assert_allclose(k * np.abs(place) * (gap - np.abs(place)) ** 2, pull, atol=1e-9 * k * gap**3)
    stable = found.unstable_directions.values == 0
    assert (np.abs(place[stable]) <= gap / 3.0 * (1.0 + 1e-6)).all() and (~stable).any()
    soft = k - 2.0 * pull / (gap - np.abs(place)) ** 3
    expected = np.sqrt(np.maximum(soft, 0.0) / mass) / (2.0 * math.pi)
    np.testing.assert_allclose(found.natural_frequency.values[stable, 0], expected[stable], atol=1e-3 * expected.max())
    assert np.isnan(found.natural_frequency.values[~stable]).all()
    assert found.attrs["incomplete_branches"] == 0
    ax = found.snapbeam.plot()
    assert ax.get_xlabel() == "Voltage of the electrode $V$ (V)"
    small = found.assign(force_voltage=1e-6 * found.force_voltage, critical_value=1e-6 * found.critical_value)
    ax = small.snapbeam.plot()
    assert ax.get_xlabel() == "Voltage of the electrode $V$ (µV)"
    (point,) = [line for line in ax.lines if line.get_label() == "limit point"]
    assert point.get_xdata()[0] == pytest.approx(exact, rel=1e-9)


@pytest.mark.slow
def test_critical_points_need_no_search(monkeypatch: pytest.MonkeyPatch) -> None:
    """What becomes of a beam beyond a critical point follows from its motion, without the wells that it may come to."""
    searched: list[int] = []
    before = Potential._starts
    monkeypatch.setattr(Potential, "_starts", lambda self, count: searched.append(count) or before(self, count))
    model = sb.ReducedModel.from_beam(BEAM, modes=2)
    magnet = sb.MagneticForce(strength=1e-9, gap=-2.9 * BEAM.buckling_level, location=0.5)
    found = sb.model.equilibrium_branches(sb.System(model, forces=[magnet]), "force.strength", (1e-10, 4e-7))
    outcomes = found.critical_outcome.values[found.critical_unstable_directions.values == 0]
    assert sorted(outcomes.tolist()) == ["another well", "pull-in"]
    searches = searched.count(512)
    # at most twice a value: the second call asks whether the energy falls without bound
    assert 5 <= searches <= 10, searches


@pytest.mark.slow
def test_motions_settle_in_wells_that_nobody_looked_for() -> None:
    """As descent, which knows the wells, tells; next to a magnet nothing settles."""
    model = sb.ReducedModel.from_beam(BEAM, modes=2)
    gap = 3.1 * BEAM.buckling_level
    potential = Potential.of(model, [sb.MagneticForce(strength=6e-8, gap=gap, location=0.4)])
    rng, center = np.random.default_rng(5), model.midspan_shape
    outcomes = []
    for _ in range(25):
        alpha = rng.uniform(-1.5, 3.4) * BEAM.buckling_level * center / float(center @ center)
        alpha = alpha + 0.1 * rng.uniform(-1.0, 1.0, 2) * np.abs(potential.size).max()
        if potential.holds(alpha):
            outcomes.append(potential.settles(alpha))
            assert outcomes[-1] == (potential.descent(alpha) is not None)
    assert True in outcomes and False in outcomes


def test_buckling_is_a_bifurcation() -> None:
    """The straight beam branches at E I (2 pi/L)^2; the mode's amplitude follows from the tension beyond it."""
    critical = BEAM.critical_load

    def potential(load: float) -> Potential:
        beam = BEAM.replace(axial_load=load)
        return Potential.of(sb.ReducedModel.from_beam(beam, modes=3), ())

    paths = paths_over_parameter("beam.axial_load", "N", potential, (0.5 * critical, 1.9 * critical))
    kinds = [(path.value[at], kind) for path in paths for at, kind in path.singular]
    assert len(kinds) == 1 and kinds[0][1] == "bifurcation"
    assert kinds[0][0] == pytest.approx(critical, rel=1e-9)
    assert all(path.complete for path in paths) and sum(path.secondary for path in paths) == 2
    for path in paths:
        for load, alpha in zip(path.value[::7], path.amplitude[::7], strict=True):
            if path.secondary and load > 1.01 * critical:
                level = BEAM.replace(axial_load=load).buckling_level
                model = sb.ReducedModel.from_beam(BEAM.replace(axial_load=load), modes=3)
                assert abs(float(model.midspan_shape @ alpha)) == pytest.approx(level, rel=1e-8)


@pytest.mark.slow
def test_a_limit_point_is_the_snap_through_force() -> None:
    """Over a constant force at the centre, as force_displacement finds it."""
    model = sb.ReducedModel.from_beam(BEAM, modes=3, imperfection=sb.Imperfection(midspan_amplitude=4e-6))
    spring = sb.LocalSpring(stiffness=20.0, location=0.3)
    push = sb.ExternalForce(history=sb.ConstantForce(force=0.0), location=0.45, label="push")
    system = sb.System(model, forces=[spring, push])
    curve = sb.force_displacement(system, 0.45)
    limits = curve.critical_force.values[curve.critical_kind.values == "limit"]
    end = 1.2 * float(np.abs(limits).max())
    found = sb.model.equilibrium_branches(system, "force.push.force", (-end, end))
    own = found.critical_value.values[found.critical_kind.values == "limit"]
    np.testing.assert_allclose(np.sort(own), np.sort(limits), rtol=1e-6)


@pytest.mark.slow
def test_no_equilibrium_in_the_range() -> None:
    """Beyond pull-in over the whole range."""
    plate = sb.ReducedModel.from_matrices([[1e-9]], [[2.0]], contact_shape=[1.0], length_scale=3e-6)
    system = sb.System(plate, forces=[sb.ElectrostaticForce(voltage=1.0, area=4e-8, gap=3e-6)])
    with pytest.raises(InputError, match=r"force\.voltage: there is no equilibrium at any of 5 values from 8 to 9 V"):
        sb.model.equilibrium_branches(system, "force.voltage", (8.0, 9.0))


@pytest.mark.slow
def test_a_parameter_that_changes_the_modes() -> None:
    """The centre of a longer beam is at its own buckling level, though its modes have another norm."""
    system = sb.System(sb.ReducedModel.from_beam(BEAM, modes=2))
    found = sb.model.equilibrium_branches(system, "beam.length", (0.1, 0.3))
    stable = found.unstable_directions.values == 0
    place = np.abs(found.midspan_displacement.values)
    np.testing.assert_allclose(place[stable], BEAM.buckling_level, rtol=1e-9)
    assert place[~stable].max() < 1e-9 * BEAM.buckling_level
    first = found.natural_frequency.values[stable, 0]
    for length, frequency in zip(found.beam_length.values[stable][::9], first[::9], strict=True):
        model = sb.ReducedModel.from_beam(BEAM.replace(length=length), modes=2)
        assert frequency == pytest.approx(model.reference_frequency, rel=1e-7)


@pytest.mark.slow
@pytest.mark.parametrize("side", [1.0, pytest.param(-1.0, marks=pytest.mark.slow)])
def test_what_becomes_of_the_wells_under_a_magnet(side: float) -> None:
    """The far well snaps over to the near one before that one is pulled in; over a shorter range neither ends."""
    model = sb.ReducedModel.from_beam(BEAM, modes=1)
    gap = 3.4 * side * BEAM.buckling_level
    system = sb.System(model, forces=[sb.MagneticForce(strength=1e-9, gap=gap, location=0.5)])
    calls: list[tuple[int, int]] = []
    found = sb.model.equilibrium_branches(
        system, "force.strength", (0.0, 8e-7), progress=lambda *each: calls.append(each)
    )
    ends = sorted(zip(found.critical_value.values, found.critical_outcome.values.tolist(), strict=True))
    assert [each for _, each in ends] == ["another well", "pull-in"]
    assert [side * value < 0.0 for value in found.critical_displacement.values] == [True, False] or side < 0.0
    assert calls[-1][0] == calls[-1][1] > 0
    short = sb.model.equilibrium_branches(system, "force.strength", (0.0, 0.6 * float(ends[0][0])))
    assert short.sizes["critical_point"] == 0 and short.sizes["stable_part"] == 2
    assert (short.stable_end_kind == "none").all()
    between = sb.model.equilibrium_branches(system, "force.strength", (0.0, float(0.5 * (ends[0][0] + ends[1][0]))))
    kinds = sorted(map(tuple, between.stable_end_kind.values.tolist()))
    assert sorted(sum(each != "none" for each in own) for own in kinds) == [0, 1]


@pytest.mark.slow
def test_a_bifurcation_of_unstable_branches() -> None:
    """Of two buckled coordinates the second one branches off where the first is unstable already."""
    two = sb.ReducedModel.from_matrices(
        np.eye(2),
        np.diag([-3.0, -1.0]),
        contact_shape=[1.0, 0.0],
        nonlinear_stiffness=1.0,
        well_amplitude=[-(3**0.5), 0.0],
        length_scale=1.0,
    )
    row = sb.LocalSpring(stiffness=0.2, shape=[0.0, 1.0])
    found = sb.model.equilibrium_branches(sb.System(two, forces=[row]), "force.stiffness", (0.2, 2.0))
    (point,) = np.flatnonzero(np.abs(found.critical_value.values - 1.0) < 1e-6)
    assert found.critical_outcome.values[point] == "unstable"


def test_refusals() -> None:
    system = sb.System(sb.ReducedModel.from_beam(BEAM, modes=1))
    for parameter, values, message in (
        ("force.voltage", (0.0, 1.0), "parameter = 'force.voltage': must be a number that the potential energy"),
        ("model.modes", (1.0, 2.0), "parameter = 'model.modes': must be a number"),
        ("beam.buckling_level", (1e-4, 1e-5), "values"),
        ("beam.buckling_level", (-1e-4, 1e-4), "buckling_level = -0.0001"),
    ):
        with pytest.raises(InputError, match=message):
            sb.model.equilibrium_branches(system, parameter, values)


@pytest.mark.slow
def test_the_command(tmp_path, monkeypatch) -> None:
    from typer.testing import CliRunner

    monkeypatch.chdir(tmp_path)
    text = """
extends = "paper"
[model]
modes = 2
[[force]]
type = "magnetic_force"
strength = 1e-9
gap = 1e-3
location = 0.5
label = "magnet"
"""
    (tmp_path / "own.toml").write_text(text)
    command = [
        "equilibria",
        "--config",
        "own.toml",
        "--over",
        "force.magnet.strength=0:9e-8",
        "-o",
        "b.nc",
        "--plot",
        "b.png",
    ]
    done = CliRunner().invoke(app, command)
    assert done.exit_code == 0, done.output
    assert "limit point at strength of the magnet = " in done.output
    assert ": branch 0, a stable branch ends" in done.output or "does not end, strength of the magnet = " in done.output
    assert (tmp_path / "b.png").stat().st_size > 5_000
    refused = CliRunner().invoke(app, [*command, "--force-displacement"])
    assert refused.exit_code == 2
    refused = CliRunner().invoke(app, ["equilibria", "--config", "own.toml", "--over", "force.strength=1:2:3"])
    assert refused.exit_code == 2 and "must be first:last" in refused.output


@pytest.mark.slow
def test_branches_of_an_arch_over_its_thickness_take_few_reductions(monkeypatch: pytest.MonkeyPatch) -> None:
    """At a bifurcation the correction ends where its residual is rounding, and the fork is where a mode has no stiffness."""
    sizes = {"length": 500e-6, "width": 20e-6, "thickness": 2e-6}
    beam = sb.Beam(**sizes, young_modulus=160e9, density=2330.0, axial_load=0.0)
    arch = sb.System(sb.ReducedModel.from_beam(beam, 4, imperfection=sb.Imperfection(midspan_amplitude=6e-6)))
    made, replace = [], sb.System.replace
    monkeypatch.setattr(sb.System, "replace", lambda self, **new: (made.append(new), replace(self, **new))[1])
    found = sb.model.equilibrium_branches(arch, "beam.thickness", (2.05e-6, 2.09e-6))
    count = len(made)
    assert count < 11 * found.sizes["point"]
    for at in range(0, found.sizes["point"], 7):
        own = found.isel(point=at)
        terms = replace(arch, **{"beam.thickness": float(own.beam_thickness)}).potential.terms(own.amplitude.values)
        assert np.abs(terms.sum(0)).max() < 1e-10 * np.abs(terms).max()
