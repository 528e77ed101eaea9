"""Softening springs and other laws without a rising potential: equilibria inside their range, runs, and runs that leave it."""

from __future__ import annotations

import dataclasses
import math
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import snapbeam as sb
from snapbeam.model import default_values
from snapbeam.model.quantity import quantity

LEVEL = default_values.BEAM.buckling_level
BASE = sb.BaseExcitation(motion=sb.AccelerationSine(frequency_ratio=0.8, acceleration_amplitude=0.02))


def model_of(modes: int = 1) -> sb.ReducedModel:
    return sb.ReducedModel.from_beam(default_values.BEAM, modes=modes, damping_ratio=0.03)


def spring(stiffness: float, end: float) -> sb.LocalSpring:
    """A softening spring whose force falls to zero at a displacement."""
    return sb.LocalSpring(stiffness=stiffness, cubic_stiffness=-stiffness / end**2, location=0.5)


@pytest.mark.parametrize("stiffness", [35.0, 260.0])
@pytest.mark.parametrize("end", [1.25 * LEVEL, 2.2 * LEVEL])
def test_wells_of_one_mode(stiffness, end):
    """alpha^2 = -(K0 + k phi^2)/(gamma + k_3 phi^4), as long as the centre is within the range of the spring."""
    model, law = model_of(), spring(stiffness, end)
    row = float(model.midspan_shape[0])
    linear = float(model.stiffness[0]) + stiffness * row**2
    square = -linear / (model.nonlinear_stiffness + law.cubic_stiffness * row**4)
    potential = sb.System(model, forces=[law]).potential
    assert law.displacement_range(law.numbers) == pytest.approx((-end, end), rel=1e-14)
    assert [each.unstable_directions for each in potential.equilibria] == [0, 0, 1]
    found = [float(each.amplitude[0]) for each in potential.wells]
    assert found == pytest.approx([-math.sqrt(square), math.sqrt(square)], rel=1e-11)
    assert abs(potential.center(potential.wells[0])) < end


def test_wells_outside_the_range_are_not_wells():
    """The wells of the structure lie beyond where the force falls to zero: the straight shape alone is left, unstable."""
    model = model_of(2)
    system = sb.System(model, forces=[spring(40.0, 0.7 * LEVEL)])
    assert [each.unstable_directions for each in system.potential.equilibria] == [1]
    with pytest.raises(
        sb.InputError, match=r"outside the displacements of a law \(valid from .*; give an initial_state"
    ):
        print(system.start_state)
    # the advice works
    assert system.replace(initial_state=sb.State(amplitude=[0.0, 0.0])).start_state.amplitude[0] == 0.0


def test_a_law_that_pushes_away_everywhere():
    """Weaker than the tension it has no limit; stronger, the potential falls without bound, and only the saddle is left."""
    model = model_of()
    row, tension = float(model.midspan_shape[0]), model.nonlinear_stiffness
    for share, expected in ((0.4, [0, 0, 1]), (1.7, [1])):
        law = sb.LocalSpring(stiffness=0.0, cubic_stiffness=-share * tension / row**4, location=0.5)
        found = sb.System(model, forces=[law]).potential.equilibria
        assert [each.unstable_directions for each in found] == expected
    # in a matrix structure without tension the wells are next to hilltops
    two = sb.ReducedModel.from_matrices(np.eye(2), np.diag([3.0, 5.0]), contact_shape=[1.0, 0.0], length_scale=1.0)
    law = sb.LocalSpring(stiffness=0.0, cubic_stiffness=-2.0)
    found = sb.System(two, forces=[law]).potential.equilibria
    places = sorted(float(each.amplitude[0]) for each in found)
    assert places == pytest.approx([-math.sqrt(1.5), 0.0, math.sqrt(1.5)], abs=1e-10)


@dataclasses.dataclass(frozen=True, kw_only=True)
class _Softening(sb.LocalForce):
    """F = -k u exp(-(u/w)^2), valid everywhere, without a range of its own."""

    stiffness: float = quantity("N/m", "stiffness", low=0.0)
    width: float = quantity("m", "width", low=0.0)

    @staticmethod
    def force(law: Any, displacement: float) -> float:
        return -law.stiffness * displacement * math.exp(-((displacement / law.width) ** 2))

    @staticmethod
    def energy(law: Any, displacement: float) -> float:
        return -0.5 * law.stiffness * law.width**2 * math.exp(-((displacement / law.width) ** 2))


def test_a_law_of_ones_own_that_is_not_finite_far_away():
    """A law without a range needs none where the potential rises; the wells are roots of the force balance."""
    model = model_of()
    potential = sb.System(model, forces=[_Softening(stiffness=90.0, width=0.8 * LEVEL, location=0.5)]).potential
    for each in potential.equilibria:
        assert (
            abs(float(potential.gradient(each.amplitude)[0])) <= 1e-10 * np.abs(potential.terms(each.amplitude)).max()
        )
    assert sum((-1) ** each.unstable_directions for each in potential.equilibria) == 1


@pytest.mark.parametrize("voltage", [3e-5, 0.7, 40.0])
def test_a_weak_electrode_far_away(voltage):
    """The saddle is closer to the electrode than the amplitudes can tell, or it is found."""
    electrode = sb.ElectrostaticForce(voltage=voltage, area=2e-9, gap=-5.0 * LEVEL, location=0.5)
    potential = sb.System(model_of(2), forces=[electrode]).potential
    assert [potential.center(each) / LEVEL for each in potential.wells] == pytest.approx([-1.0, 1.0], abs=1e-6)


def test_runs_and_orbits():
    """A run against SciPy, one that leaves the range, and a forced orbit that closes."""
    model, law = model_of(), spring(120.0, 1.5 * LEVEL)
    system = sb.System(model, forces=[law], base_excitation=BASE)
    well = system.potential.wells[1].amplitude
    omega = 2.0 * math.pi * model.reference_frequency
    row, mass, damping = (float(model.midspan_shape[0]), float(model.mass[0, 0]), float(model.damping_matrix[0, 0]))

    def rate(t, y):
        force = row * law.force_at(row * y[0])
        elastic = float(model.stiffness[0]) * y[0] + model.nonlinear_stiffness * y[0] ** 3
        return [y[1], (force - elastic - damping * y[1]) / mass]

    free = system.replace(base_excitation=None, initial_state=None)
    begin = sb.State(amplitude=0.8 * well, velocity=0.1 * omega * well)
    came = sb.advance(free, begin, periods=7, integration=sb.Integration(accuracy="reference"))
    end = 7.0 / model.reference_frequency
    exact = solve_ivp(
        rate, (0.0, end), [float(begin.amplitude[0]), float(begin.velocity[0])], method="DOP853", rtol=1e-11, atol=1e-16
    )
    assert float(came.amplitude[0]) == pytest.approx(exact.y[0, -1], abs=1e-5 * abs(float(well[0])))
    assert float(came.velocity[0]) == pytest.approx(exact.y[1, -1], abs=1e-5 * omega * abs(float(well[0])))

    leaves = system.replace(initial_state=sb.State(amplitude=well, velocity=2.5 * omega * well))
    run = sb.simulate(leaves, sb.Integration(cycles=4))
    assert run.summary.status is sb.RunStatus.DIVERGED
    assert "displacements that its law is valid for" in run.dataset.attrs["status"]

    orbit = sb.dynamics.periodic_orbit(system, sb.State(amplitude=well), transient=60)
    flow = orbit.flow
    assert np.abs(flow.advance(orbit.coordinates[None]).states - orbit.coordinates).max() < 1e-9
    assert np.abs(orbit.multipliers).max() < 1.0
