"""Laws of a user in the core: those of the package written in Python, through Numba and through ctypes; errors, NaN, sweeps."""

from __future__ import annotations

import builtins
import math
from dataclasses import dataclass

import numpy as np
import pytest
from core_systems import beam, stop

import snapbeam as sb
from snapbeam import _core
from snapbeam.model import default_values
from snapbeam.model.contact.base import LAWS, ContactLaw
from snapbeam.model.local_force import LOCAL_FORCES
from snapbeam.model.quantity import RUN, quantity
from snapbeam.solver import channels, user_laws
from snapbeam.util.diagnostics import DiagnosticWarning
from snapbeam.util.validation import InputError

STIFFNESS = default_values.CONTACT.stiffness
NATIVE = sb.Integration(cycles=2, engine="native")


@dataclass(frozen=True)
class OwnHertz(ContactLaw):  # the force alone
    stiffness: float = quantity("N/m^1.5", "stiffness", low=0.0, scope=RUN)
    worst: float = quantity("m", "penetration that is refused", low=0.0, scope=RUN, default=1.0)
    name = "own_hertz"

    def time_scale(self, mass, velocity):
        return sb.HertzContact(self.stiffness).time_scale(mass, velocity)

    @staticmethod
    def force(law, penetration):
        if penetration > law.worst:
            raise ArithmeticError("too deep")
        return law.stiffness * penetration * math.sqrt(penetration)


@dataclass(frozen=True)
class OwnHuntCrossley(ContactLaw):
    stiffness: float = quantity("N/m^1.5", "stiffness", low=0.0, scope=RUN)
    damping_factor: float = quantity("s/m", "damping factor", low=0.0, scope=RUN)
    name = "own_hunt_crossley"
    rate_dependent = True
    force = staticmethod(sb.HertzContact.force)
    energy = staticmethod(sb.HertzContact.energy)
    slope = staticmethod(sb.HertzContact.slope)

    @staticmethod
    def damping_coefficient(law, penetration):
        return law.damping_factor * law.stiffness * penetration * math.sqrt(penetration)


@dataclass(frozen=True)
class OwnKelvinVoigt(ContactLaw):  # begins with a jump
    linear_stiffness: float = quantity("N/m", "stiffness", low=0.0, scope=RUN)
    linear_damping: float = quantity("N s/m", "damping", low=0.0, scope=RUN)
    name = "own_kelvin_voigt"
    rate_dependent = True
    force = staticmethod(sb.KelvinVoigt.force)
    time_scale = sb.KelvinVoigt.time_scale
    damping_coefficient = staticmethod(sb.KelvinVoigt.damping_coefficient)


@dataclass(frozen=True)
class OwnElasticPlastic(ContactLaw):
    loading_stiffness: float = quantity("N/m", "stiffness on first loading", low=0.0, scope=RUN)
    unloading_stiffness: float = quantity("N/m", "stiffness below", low=0.0, scope=RUN)
    name = "own_elastic_plastic"
    memory = "indentation"
    force = staticmethod(sb.ElasticPlasticContact.force)
    energy = staticmethod(sb.ElasticPlasticContact.energy)
    yield_penetration = staticmethod(sb.ElasticPlasticContact.yield_penetration)
    impact_duration = sb.ElasticPlasticContact.impact_duration
    time_scale = sb.ElasticPlasticContact.time_scale

    @staticmethod
    def slope(law, penetration):  # the larger of both, so that the steps are the same
        return law.unloading_stiffness

    @staticmethod
    def memory_after(law, deepest):
        stiffer = law.unloading_stiffness - law.loading_stiffness
        if deepest * stiffer < law.indentation * law.loading_stiffness * (1.0 - 1e-6):
            raise ArithmeticError("has not yielded")
        return (deepest + law.indentation) * (1.0 - law.loading_stiffness / law.unloading_stiffness)


@dataclass(frozen=True)
class Broken(ContactLaw):
    stiffness: float = quantity("N/m^1.5", "stiffness", low=0.0, scope=RUN)
    name = "broken"

    def time_scale(self, mass, velocity):
        return 1e-4

    @staticmethod
    def force(law, penetration):
        return law.stiffness * penetration * (1.0 if penetration < 1e-6 else math.nan)


@dataclass(frozen=True, kw_only=True)
class OwnSpring(sb.LocalForce):
    stiffness: float = quantity("N/m", "stiffness", low=0.0)
    cubic_stiffness: float = quantity("N/m^3", "cubic stiffness", default=0.0)
    name = "own_spring"
    force = staticmethod(sb.LocalSpring.force)
    energy = staticmethod(sb.LocalSpring.energy)


@dataclass(frozen=True, kw_only=True)
class OwnMagnet(sb.LocalForce):  # valid on one side only, where the function has a pole
    strength: float = quantity("N m^2", "strength")
    gap: float = quantity("m", "gap")
    name = "own_magnet"
    force = staticmethod(sb.MagneticForce.force)
    energy = staticmethod(sb.MagneticForce.energy)
    displacement_range = staticmethod(sb.MagneticForce.displacement_range)


@dataclass(frozen=True, kw_only=True)
class OwnDrag(sb.LocalForce):
    coefficient: float = quantity("N s^2/m^2", "coefficient", low=0.0)
    name = "own_drag"
    dissipative = True
    damping_force = staticmethod(sb.QuadraticDamping.damping_force)
    damping_coefficient = staticmethod(sb.QuadraticDamping.damping_coefficient)


@dataclass(frozen=True, kw_only=True)
class OwnSpringAndDrag(OwnSpring):
    coefficient: float = quantity("N s^2/m^2", "coefficient", low=0.0)
    name = "own_spring_and_drag"
    dissipative = True
    damping_force = staticmethod(sb.QuadraticDamping.damping_force)
    damping_coefficient = staticmethod(sb.QuadraticDamping.damping_coefficient)


OWN = {table: {name: kind for name, kind in each.items() if kind.__module__ == __name__} for table, each in (("laws", LAWS), ("forces", LOCAL_FORCES))}  # fmt: skip
for _table, _of in ((LAWS, "laws"), (LOCAL_FORCES, "forces")):  # other modules list the laws of the package
    for _name in OWN[_of]:
        del _table[_name]


@pytest.fixture(autouse=True)
def registered(monkeypatch):
    for table, of in ((LAWS, "laws"), (LOCAL_FORCES, "forces")):
        for name, kind in OWN[of].items():
            monkeypatch.setitem(table, name, kind)


HERTZ, PLACE = sb.HertzContact(STIFFNESS), {"location": 0.37}
SPRING = {"stiffness": 20.0, "cubic_stiffness": 1e7, **PLACE}
MAGNET = {"strength": 1e-9, "gap": 1.3e-3, **PLACE}
DRAG = {"coefficient": 0.2, **PLACE}
SAME = {
    "hertz": ((HERTZ,), (OwnHertz(STIFFNESS),)),
    "hunt_crossley": ((sb.HuntCrossley(STIFFNESS, 2.0),), (OwnHuntCrossley(STIFFNESS, 2.0),)),
    "kelvin_voigt": ((sb.KelvinVoigt(2e5, 1.0),), (OwnKelvinVoigt(2e5, 1.0),)),
    "elastic_plastic": ((sb.ElasticPlasticContact(1e5, 4e5),), (OwnElasticPlastic(1e5, 4e5),)),
    "spring": ((HERTZ, sb.LocalSpring(**SPRING)), (HERTZ, OwnSpring(**SPRING))),
    "magnet": ((HERTZ, sb.MagneticForce(**MAGNET)), (HERTZ, OwnMagnet(**MAGNET))),
    "drag": ((HERTZ, sb.QuadraticDamping(**DRAG)), (HERTZ, OwnDrag(**DRAG))),
    "both": (
        (HERTZ, sb.LocalSpring(**SPRING), sb.QuadraticDamping(**DRAG)),
        (HERTZ, OwnSpringAndDrag(**(SPRING | DRAG))),
    ),
}
"""The package's laws, and the same of a user."""


def made(law, *forces, modes=3):
    """A beam between a shaker and a stop."""
    shaker = sb.Shaker(frequency_ratio=1.21, velocity_amplitude=0.18, location=1 / 2.1)
    return sb.System(beam(modes), contacts=[sb.Contact(law, shaker), stop(law)], forces=list(forces))


@pytest.fixture
def without_numba(monkeypatch):
    """Functions of C by ctypes alone."""
    found = builtins.__import__

    def without(name, globals=None, *more, **named):
        if name == "numba" and globals is not None and globals.get("__name__") == user_laws.__name__:
            raise ImportError(name)
        return found(name, globals, *more, **named)

    monkeypatch.setattr(user_laws, "_function", user_laws._function.__wrapped__)
    monkeypatch.setattr(builtins, "__import__", without)


def check_same(name: str) -> None:
    given, own = (sb.simulate(made(*parts), NATIVE) for parts in SAME[name])
    for each in ("modal_amplitude", "modal_velocity"):
        found, wanted = (run.dataset[each].values for run in (own, given))
        assert np.abs(found - wanted).max() < 1e-9 * np.abs(wanted).max()
    for key, wanted in given.summary.items():
        if isinstance(wanted, float | int):
            assert own.summary[key] == pytest.approx(wanted, rel=1e-7, abs=1e-18, nan_ok=True), key
    np.testing.assert_allclose(own.final_state.indentation, given.final_state.indentation, rtol=1e-9)
    assert given.summary["impacts"] > 0


@pytest.mark.sampled(3)
@pytest.mark.parametrize("layout", ["runs", "modes", "thread"])
@pytest.mark.parametrize("name", SAME)
def test_a_users_law_is_the_packages(name, layout, monkeypatch):
    monkeypatch.setenv("SNAPBEAM_LAYOUT", layout)
    check_same(name)


@pytest.mark.sampled(3)
@pytest.mark.parametrize("layout", ["runs", "modes", "thread"])
@pytest.mark.parametrize("name", ["hertz", "elastic_plastic", "both"])
def test_without_numba_python_is_called(name, layout, monkeypatch, without_numba):
    monkeypatch.setenv("SNAPBEAM_LAYOUT", layout)
    monkeypatch.setattr("snapbeam.util.diagnostics._told", set())
    sb.simulate(made(*SAME[name][0]), NATIVE)  # imports what it needs: not within the warnings that are caught
    with pytest.warns(DiagnosticWarning, match=r"calls Python for every force.*\[laws\]"):
        check_same(name)


def test_a_sweep_of_a_users_parameter():
    """More runs than lanes, and a number of runs that does not fill them."""
    stiffnesses = np.geomspace(1e8, 3e9, 13)
    found = [
        sb.sweep(made(kind(STIFFNESS)), {"contact.stiffness": stiffnesses}, NATIVE)
        for kind in (sb.HertzContact, OwnHertz)
    ]
    assert len(set(found[1].peak_force.values.tolist())) == 13
    for name in ("peak_force", "impacts", "max_displacement", "status"):
        np.testing.assert_allclose(found[1][name], found[0][name], rtol=1e-9)


REFERENCE = sb.Integration(cycles=6, accuracy="reference", engine="native")
HYSTERESIS = (sb.ElasticPlasticContact, OwnElasticPlastic)


@pytest.mark.parametrize("modes", [1, 3])
def test_a_users_memory(modes):
    """Impacts that deepen the indentations and impacts that do not, of the package's law and of the same of a user."""
    given, own = (sb.simulate(made(kind(1e5, 2e5), modes=modes), REFERENCE) for kind in HYSTERESIS)
    for found, wanted in (
        (own.final_state.indentation, given.final_state.indentation),
        (own.impacts.impulse, given.impacts.impulse),
        (own.impacts.duration, given.impacts.duration),
        (own.summary.energy_lost_contact, given.summary.energy_lost_contact),
        (own.dataset.energy_contact, given.dataset.energy_contact),
    ):
        np.testing.assert_allclose(found, wanted, rtol=1e-9, atol=1e-9 * np.abs(wanted).max())
    assert given.impacts.impulse.size > 4 and (given.final_state.indentation > 0.0).all()
    assert given.summary.energy_lost_contact > 0.0


def test_a_users_memory_goes_on():
    """Cycle by cycle as in one go, and from a state that was kept."""
    given, own = (made(kind(1e5, 2e5)) for kind in HYSTERESIS)
    whole = sb.advance(own, periods=4, save_every_period=True)
    wanted = sb.advance(given, periods=4, save_every_period=True)
    np.testing.assert_allclose(whole.indentation, wanted.indentation, rtol=1e-9)
    assert (whole.indentation[-1] > whole.indentation[0]).any() and (whole.indentation[0] > 0.0).any()
    state = own.start_state
    for i in range(4):
        state = sb.advance(own, state)
        np.testing.assert_allclose(state.indentation, whole[i].indentation, rtol=1e-9)
        np.testing.assert_allclose(state.amplitude, whole[i].amplitude, rtol=1e-9)


def test_a_sweep_of_a_users_memory():
    """Runs side by side turn back at different times: a function is called where its own run has yielded."""
    axes = {"velocity_amplitude": np.linspace(0.05, 0.3, 13), "contact.unloading_stiffness": [2e5, 4e5]}
    given, own = (sb.sweep(made(kind(1e5, 4e5)), axes, REFERENCE) for kind in HYSTERESIS)
    assert (own.status == sb.RunStatus.OK).all()
    for name in ("impacts", "impulse", "peak_force", "energy_lost_contact", "max_displacement"):
        np.testing.assert_allclose(own[name], given[name], rtol=1e-9)
    assert len(set(own.energy_lost_contact.values.ravel().tolist())) > 13


@dataclass(frozen=True)
class OwnDent(OwnElasticPlastic):  # without energy and slope
    name = ""  # listed under no name
    energy = staticmethod(ContactLaw.energy)
    slope = staticmethod(ContactLaw.slope)


def test_a_users_memory_without_energy_and_slope():
    """They follow by quadrature and differences; the motion needs neither."""
    given, own = (sb.simulate(made(kind(1e5, 2e5)), REFERENCE) for kind in (sb.ElasticPlasticContact, OwnDent))
    np.testing.assert_allclose(own.final_state.indentation, given.final_state.indentation, rtol=1e-7)
    assert own.summary.energy_lost_contact == pytest.approx(given.summary.energy_lost_contact, rel=1e-3)


@pytest.mark.parametrize("hook", ["yield_penetration", "memory_after"])
def test_an_exception_of_a_memory_is_raised(hook, monkeypatch):
    def broken(law, deepest=0.0):
        if law.indentation >= 0.0:
            raise ArithmeticError("no surface")
        return 0.0

    monkeypatch.setattr(OwnElasticPlastic, hook, staticmethod(broken))
    with pytest.raises(InputError, match=r"OwnElasticPlastic\.broken\(.*no surface"):
        sb.sweep(made(OwnElasticPlastic(1e5, 4e5)), {"velocity_amplitude": [0.1, 0.2]}, NATIVE)
    monkeypatch.setattr(OwnElasticPlastic, hook, staticmethod(lambda law, deepest=0.0: math.nan))
    run = sb.simulate(made(OwnElasticPlastic(1e5, 4e5)), NATIVE)
    assert run.summary.status == sb.RunStatus.DIVERGED


@dataclass(frozen=True)
class OwnLossyDent(OwnElasticPlastic):
    name = ""
    rate_dependent = True

    @staticmethod
    def damping_coefficient(law, penetration):
        return 1e6 * penetration


@pytest.mark.filterwarnings("ignore:engine = 'python' is made to be read")
def test_a_memory_and_a_rate_are_for_the_engine_in_python():
    system = made(OwnLossyDent(1e5, 4e5))
    with pytest.raises(InputError, match=r"memory and rate_dependent .* use engine = 'python'"):
        sb.simulate(system, NATIVE)
    run = sb.simulate(system, sb.Integration(cycles=1, engine="python"))
    assert run.summary.status == sb.RunStatus.OK and run.summary.energy_lost_contact > 0.0


def check_raised(system):
    for call in (lambda: sb.simulate(system, NATIVE), lambda: sb.sweep(system, {"contact.stiffness": [1e8, 2e8]}, NATIVE)):  # fmt: skip
        with pytest.raises(InputError, match=r"OwnHertz\.force\(.*too deep") as raised:
            call()
        assert isinstance(raised.value.__cause__, ArithmeticError)


def test_an_exception_is_raised_after_the_run():
    check_raised(made(OwnHertz(STIFFNESS, 1e-7)))
    assert sb.simulate(made(OwnHertz(STIFFNESS)), NATIVE).summary.status == sb.RunStatus.OK


@pytest.mark.filterwarnings("ignore:.*calls Python for every force")
def test_an_exception_in_python_is_raised_after_the_run(without_numba):
    check_raised(made(OwnHertz(STIFFNESS, 1e-7)))
    assert sb.simulate(made(OwnHertz(STIFFNESS)), NATIVE).summary.status == sb.RunStatus.OK


def test_a_force_that_is_not_a_number_ends_the_run():
    found = sb.sweep(made(Broken(1.0)), {"contact.stiffness": [1e4, 2e4, 3e4]}, NATIVE)
    assert (found.status == sb.RunStatus.DIVERGED).all()


def test_a_function_that_numba_cannot_compile_is_called(monkeypatch):
    """One that uses a table of Python objects."""
    table = {"stiffness": [STIFFNESS, "N/m^1.5"]}
    plain = OwnHertz.force
    monkeypatch.setattr(OwnHertz, "force", staticmethod(lambda law, d: plain(law, d) * table["stiffness"][0] / STIFFNESS))  # fmt: skip
    monkeypatch.setattr("snapbeam.util.diagnostics._told", set())
    with pytest.warns(DiagnosticWarning, match="Numba cannot compile"):
        check_same("hertz")


def test_values_of_a_force_alone():
    """Energy by a rule of Gauss, slope by differences."""
    law, x = OwnHertz(STIFFNESS), np.geomspace(1e-9, 1e-5, 9)
    own = user_laws.contact_law(law)
    fields = {name: np.empty(x.size) for name in ("force", "potential", "stiffness", "damping", "low", "high")}
    numbers = np.array([*own.head, *law.numbers()])
    _core.law_values(channels.USER_LAWS[own.kind], {"x": x, "y": x, "numbers": numbers, **fields})
    kind = sb.HertzContact
    np.testing.assert_allclose(fields["force"], [kind.force(law.numbers(), d) for d in x], rtol=1e-13)
    np.testing.assert_allclose(fields["potential"], [kind.energy(law.numbers(), d) for d in x], rtol=1e-12)
    np.testing.assert_allclose(fields["stiffness"], [kind.slope(law.numbers(), d) for d in x], rtol=1e-8)
    for count in (-1.0, 0.5, 3.0, 1e9):
        numbers[len(own.head) - 1] = count
        with pytest.raises(ValueError, match="numbers of a user's law"):
            _core.law_values(channels.USER_LAWS[own.kind], {"x": x, "y": x, "numbers": numbers, **fields})


def test_a_user_who_sums_what_the_core_calls_one_by_one():
    """A law with more constants than the core takes is refused."""
    body = {f"c{k}": quantity("1", "constant", default=1.0, scope=RUN) for k in range(60)}
    force = staticmethod(lambda law, penetration: law.c0 * penetration)
    kind = dataclass(frozen=True)(
        type("Long", (ContactLaw,), {"__annotations__": dict.fromkeys(body, float), **body, "force": force})
    )
    with pytest.raises(InputError, match="has 60 constants, more than 55"):
        user_laws.contact_law(kind())
