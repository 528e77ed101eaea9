"""Methods of the model that take a number refuse what is not finite."""

from __future__ import annotations

import math

import numpy as np
import pytest

import snapbeam as sb
from snapbeam.model import default_values

MODEL = sb.ReducedModel.from_beam(default_values.BEAM, modes=2)
SYSTEM = sb.System(MODEL, forces=[sb.MagneticForce(strength=1e-9, gap=1.3e-3, location=0.5)])
LAWS = [
    sb.HertzContact(4e8), sb.KelvinVoigt(2e5, 1.0), sb.HuntCrossley(3e8, 2.0), sb.PowerLaw(1.0, 1.7),
    sb.LayeredHertz(4e8, 1e12),
]  # fmt: skip
BAD = [math.nan, math.inf, -math.inf]


@pytest.mark.parametrize("bad", BAD)
def test_amplitudes(bad):
    for given in (np.full(2, bad), np.array([0.1, bad]), np.array([[0.1, bad], [0.2, 0.3]])):
        with pytest.raises(sb.InputError, match=r"amplitude.*must be finite"):
            MODEL.pulled(given)
    for wrong in (bad, 0.1, np.zeros(3), np.zeros((2, 2, 2))):
        with pytest.raises(sb.InputError, match="amplitude"):
            MODEL.pulled(wrong)
    assert (MODEL.pulled(np.array([[1.0], [0.5]])) == [[1.0], [0.5]]).all()


@pytest.mark.parametrize("bad", [*BAD, 1e200])
def test_a_descent_from_nowhere_ends(bad):
    """Newton's steps from amplitudes that are not finite never became short: it did not return."""
    for ask in (SYSTEM.potential.descent, SYSTEM.potential.settles):
        if math.isfinite(bad):
            with np.errstate(all="ignore"):
                assert not ask(np.array([bad, 0.0]))
        else:
            with pytest.raises(sb.InputError, match=r"alpha.*must be finite"):
                ask(np.array([0.0, bad]))


POTENTIALS = [sb.System(MODEL).potential, SYSTEM.potential]


@pytest.mark.parametrize("potential", POTENTIALS, ids=["beam", "magnet"])
def test_forces_and_energies_of_amplitudes(potential):
    here = np.array([1e-5, -2e-5])
    for name in ("energy", "gradient", "terms", "tangent", "holds", "descent", "settles"):
        ask = getattr(potential, name)
        for bad in BAD:
            for given in ([bad, 0.0], [[0.0, 0.0], [0.0, bad]]):
                with pytest.raises(sb.InputError, match=r"alpha\[.*must be finite"):
                    ask(given)
        for wrong in (0.1, [], [0.1], np.zeros(3), np.zeros((2, 3))):
            with pytest.raises(sb.InputError, match=r"alpha of shape .*2 modes"):
                ask(wrong)
        with pytest.raises(sb.InputTypeError, match="alpha"):
            ask("ab")
    for name in ("energy", "gradient", "terms", "tangent"):
        with pytest.raises(sb.InputError, match=r"alpha = .* not finite"):
            getattr(potential, name)([1e200, 0.0])
        several = getattr(potential, name)([here, here])
        one = getattr(potential, name)(list(here))
        assert np.isfinite(one).all()
        np.testing.assert_allclose(np.moveaxis(several, 1 if name == "terms" else 0, 0)[1], one, rtol=1e-12)


def test_a_matrix_in_modes():
    potential = SYSTEM.potential
    for bad in BAD:
        with pytest.raises(sb.InputError, match=r"matrix\[1, 0\].*must be finite"):
            potential.in_modes([[1.0, 0.0], [bad, 1.0]])
    for wrong in (1.0, [1.0, 2.0], np.eye(3), np.zeros((2, 2, 3))):
        with pytest.raises(sb.InputError, match=r"matrix of shape .*2 rows"):
            potential.in_modes(wrong)
    np.testing.assert_allclose(potential.in_modes(MODEL.mass), np.eye(2), atol=1e-12)


@pytest.mark.parametrize("law", LAWS, ids=lambda law: law.name)
@pytest.mark.parametrize("bad", BAD)
def test_mass_and_velocity_of_an_impact(law, bad):
    for name in ("impact_duration", "time_scale", "max_penetration"):
        ask = getattr(law, name, None)
        if ask is not None:
            for given, word in (((bad, 0.1), "mass"), ((1e-3, bad), "velocity"), ((-1e-3, 0.1), "mass")):
                with pytest.raises(sb.InputError, match=word):
                    ask(*given)
            assert ask(1e-3, 0.1) > 0.0


WITH_LOSS = [
    *LAWS,
    sb.PowerLaw(1e-3, 8.0),
    sb.PowerLaw(1e4, 1.0),
    sb.ElasticPlasticContact(1e5, 2e5),
    sb.Restitution(0.6),
]


@pytest.mark.parametrize("law", WITH_LOSS, ids=lambda law: f"{law.name}-{getattr(law, 'exponent', '')}")
def test_impacts_at_the_ends_of_the_ranges_of_numbers(law):
    """A finite time, or a refusal that names the number; no error of the formula."""
    masses = [1e-30, 3e-17, 1e-3, 7e11, 1e30]
    for name in ("impact_duration", "time_scale", "max_penetration"):
        ask = getattr(law, name, None)
        if ask is None:
            continue
        for mass in masses:
            found = [ask(mass, velocity) for velocity in (1e-30, 2e-9, 0.2, 4e13, 1e30)]
            assert all(math.isfinite(each) and each >= 0.0 for each in found)
            try:
                assert 0.0 <= ask(mass, 0.0) < math.inf
            except sb.InputError as error:
                assert str(error).startswith("velocity = 0.0: must be")
        for mass, velocity, word in (
            (1e-40, 0.1, "mass"),
            (1e40, 0.1, "mass"),
            (1.0, 5e-324, "velocity"),
            (1.0, 1e200, "velocity"),
        ):
            with pytest.raises(sb.InputError, match=f"^{word} = .* must be a number in "):
                ask(mass, velocity)


def test_no_time_of_an_impact_at_rest():
    """Duration of a stiffening force grows without bound as the velocity falls."""
    for law in (sb.HertzContact(4e8), sb.PowerLaw(1.0, 1.7), sb.LayeredHertz(4e8, 1e12)):
        assert law.impact_duration(1e-3, 1e-20) > law.impact_duration(1e-3, 1e-10) > law.impact_duration(1e-3, 1.0)
        assert law.max_penetration(1e-3, 0.0) == 0.0
        with pytest.raises(sb.InputError, match=r"^velocity = "):
            law.impact_duration(1e-3, 0.0)


def test_loss_of_slow_and_lossy_impacts():
    law = sb.HuntCrossley(3e8, 2.0)
    assert law.restitution(1e-300) == 1.0
    speeds = np.geomspace(1e-12, 1e-2, 60)
    lost = 1.0 - np.array([law.restitution(speed) for speed in speeds])
    assert (np.diff(lost) >= 0.0).all()
    np.testing.assert_allclose(lost[20:] / (4.0 / 3.0 * speeds[20:]), 1.0, atol=2e-2)
    assert law.speed_for(1e-300) > law.speed_for(1e-3)
    with pytest.raises(sb.InputError, match="restitution"):
        law.speed_for(5e-324)


HARVESTERS = [
    sb.PiezoelectricHarvester(moment_per_volt=1e-5, capacitance=1e-9, resistance=1e5),
    sb.ElectromagneticHarvester(force_factor=0.1, resistance=10.0, inductance=1e-3, coil_resistance=2.0),
]


@pytest.mark.parametrize("harvester", HARVESTERS, ids=lambda each: each.name)
@pytest.mark.parametrize("name", ["loss", "share", "volts"])
def test_load_resistances(harvester, name):
    ask = getattr(harvester, name)
    for bad in BAD:
        with pytest.raises(sb.InputError, match=r"resistance\[1\] = .*must be finite"):
            ask([10.0, bad])
    for bad in (0.0, -3.0, [], [5.0, -1.0]):
        with pytest.raises(sb.InputError, match=r"resistance = .* greater than 0 ohm"):
            ask(bad)
    for bad in ("ab", None, 1j):
        with pytest.raises(sb.InputTypeError, match="resistance"):
            ask(bad)
    assert ask([10.0, 20.0, 30.0]).shape == (3,)
    assert float(ask(10.0)) == ask([20.0, 10.0])[1]


def test_resistances_whose_inverse_overflows_are_refused():
    with pytest.raises(sb.InputError, match="loss is not finite"):
        HARVESTERS[0].loss(5e-324)
