"""Unequal wells: damping, poles and starts are those about the well that the first striker pushes away from."""

import math

import numpy as np
import pytest

import snapbeam as sb
from snapbeam.dynamics.attractors import spread_states
from snapbeam.dynamics.stroboscope import Stroboscope, settling_periods
from snapbeam.model import default_values
from snapbeam.solver.assemble import make_ensemble
from snapbeam.sweeps.replicates import Replicates, perturbed_start

RATIO = np.array([0.01, 0.05, 0.002])
SIDES = [(side, height) for side in ("below", "above", None) for height in (1e-5, -1e-5)]


def _system(side: str | None, height: float, **more) -> sb.System:
    """A beam with an uneven initial shape, alone or with a striker on one side."""
    uneven = sb.Imperfection(midspan_amplitude=height, antisymmetric_amplitude=0.5 * height)
    model = sb.ReducedModel.from_beam(default_values.BEAM, modes=3, damping_ratio=RATIO, imperfection=uneven)
    striker = sb.Striker(drive=sb.Sine(frequency_ratio=1.21, velocity_amplitude=0.3), side=side or "below")
    contacts = [] if side is None else [sb.Contact(default_values.CONTACT, striker)]
    return sb.System(model, contacts=contacts, **more)


@pytest.mark.parametrize(("side", "height"), SIDES)
def test_poles_have_the_damping_that_runs_have(side: str | None, height: float) -> None:
    system = _system(side, height)
    structure = make_ensemble(system, sb.Integration()).structure
    assert structure.model is system.struck_model
    found = system.poles("lower" if structure.sign > 0.0 else "upper")[::2]
    np.testing.assert_allclose(np.abs(found), structure.omega, rtol=1e-9)
    np.testing.assert_allclose(-found.real / np.abs(found), RATIO, rtol=1e-8)


@pytest.mark.parametrize("height", [1e-5, -1e-5])
def test_settling_takes_the_slowest_decay_of_runs(height: float) -> None:
    system = _system("above", height)
    slowest = (RATIO * make_ensemble(system, sb.Integration()).structure.omega).min()
    flow = Stroboscope(system)
    assert settling_periods(flow, least=1)[0] == math.ceil(16.0 / (slowest * flow.period))


@pytest.mark.parametrize("height", [1e-5, -1e-5])
def test_damping_without_a_striker_does_not_depend_on_the_start(height: float) -> None:
    system = _system(None, height)
    starts = [system.replace(initial_well=well) for well in ("lower", "upper")]
    rows = [make_ensemble(each, sb.Integration()).structure for each in starts]
    rows.append(make_ensemble(system, sb.Integration(), periods=1).structure)  # as a motion that goes on
    assert len({each.hash for each in rows}) == 1
    assert rows[0].sign == (1.0 if system.model.reference_well == "lower" else -1.0)
    mirrored = make_ensemble(_system(None, -height), sb.Integration()).structure
    assert (mirrored.hash == rows[0].hash) == (mirrored.sign == rows[0].sign) and mirrored.sign == -rows[0].sign


@pytest.mark.parametrize("well", ["lower", "upper"])
def test_small_decay_in_either_well_is_that_of_the_poles(well: str) -> None:
    """Energy of a free decay of the first mode in one well, against its pole."""
    system = _system(None, 1e-5, initial_well=well)
    equilibrium = system.potential.well(well)
    modes = system.potential.linear_modes(equilibrium)
    pole = min(system.poles(well), key=lambda s: abs(abs(s) - modes.omega[0]))
    small = 1e-4 * float(np.abs(equilibrium.amplitude).max())
    start = sb.State(amplitude=equilibrium.amplitude + small * modes.vectors[:, 0] / np.abs(modes.vectors[:, 0]).max())
    duration = 20.0 * Stroboscope(system).period
    end = sb.advance(system, start, 20, integration=sb.Integration(accuracy="reference"))
    row = modes.vectors[:, 0] @ system.model.mass
    first = row @ (start.amplitude - equilibrium.amplitude)
    last = row @ (end.amplitude - equilibrium.amplitude)
    rate = row @ end.velocity
    size = math.hypot(last, (rate - pole.real * last) / pole.imag)
    begun = math.hypot(first, pole.real * first / pole.imag)
    assert math.log(size / begun) / duration == pytest.approx(pole.real, rel=2e-3)


@pytest.mark.parametrize("height", [1e-5, -1e-5])
def test_mirror_images_begin_as_mirror_images(height: float) -> None:
    below, above = _system("below", height), _system("above", -height)
    first, second = (perturbed_start(each, Replicates(2), 1) for each in (below, above))
    np.testing.assert_allclose(first.amplitude, -second.amplitude, rtol=1e-9, atol=1e-15)
    np.testing.assert_allclose(first.velocity, -second.velocity, rtol=1e-9, atol=1e-15)
    spread = [spread_states(Stroboscope(each), 20) for each in (below, above)]
    np.testing.assert_allclose(*np.abs(spread), rtol=1e-9, atol=1e-12)
