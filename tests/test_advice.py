"""What messages of contacts and strikers advise: every advice, taken literally, is accepted."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest

import snapbeam as sb
from snapbeam.dynamics.lifetimes import require_excitation
from snapbeam.model import default_values
from snapbeam.model.parameter_file import config_from_mapping
from snapbeam.simulation.request import require_motion
from snapbeam.solver.restrictions import check_integrable

BEAM, HERTZ = default_values.BEAM, default_values.CONTACT
LOSSY = sb.HuntCrossley.from_restitution(HERTZ.stiffness, restitution=0.6, speed=0.07)
NEWTON = sb.Restitution(0.6)
SHAKER = sb.Shaker(frequency_ratio=1.6, velocity_amplitude=0.03)
STOP = sb.Striker(drive=sb.FixedStop(), gap=5e-5)
BASE = sb.BaseExcitation(motion=sb.AccelerationSine(frequency_ratio=0.8, acceleration_amplitude=0.02))


def model(modes: int = 1) -> sb.ReducedModel:
    return sb.ReducedModel.from_beam(BEAM, modes=modes, damping_ratio=0.05)


def system(*contacts: tuple[sb.ContactLaw, sb.Striker], modes: int = 1, **more: Any) -> sb.System:
    return sb.System(model(modes), contacts=[sb.Contact(*each) for each in contacts], **more)


def integrable(*contacts: tuple[sb.ContactLaw, sb.Striker], modes: int = 1) -> None:
    check_integrable(system(*contacts, modes=modes))


def backbone(given: sb.System) -> None:
    sb.dynamics.backbone_curve(given, max_points=3)


def of_file(**contact: Any) -> None:
    """A parameter file with one section [contact]."""
    names = ("length", "thickness", "width", "density", "young_modulus", "buckling_level")
    sections = {
        "beam": {name: getattr(BEAM, name) for name in names},
        "model": {"modes": contact.pop("modes"), "damping_ratio": 0.05},
        "contact": {"stiffness": HERTZ.stiffness, "location": 0.5, **contact},
        "drive": {"frequency_ratio": 1.6, "velocity_amplitude": 0.03},
    }
    check_integrable(config_from_mapping(sections).system)


def body(suspension: float = 0.0) -> sb.Striker:
    return sb.Striker(drive=sb.FixedStop(), gap=5e-5, mass=1e-3, suspension_stiffness=suspension)


INSTEAD = {"hertz": HERTZ, "'hunt_crossley' with restitution and speed": LOSSY}
"""Laws that messages on Newton's law advise, by their words."""
ADVICE: list[tuple[Callable[[], Any], str, list[Callable[[], Any]]]] = [
    (
        lambda: check_integrable(system((NEWTON, SHAKER)), "python"),
        "use engine = 'native', or type = 'hertz', or 'hunt_crossley' with restitution and speed",
        [
            lambda: check_integrable(system((NEWTON, SHAKER)), "native"),
            *(lambda law=law: check_integrable(system((law, SHAKER)), "python") for law in INSTEAD.values()),
        ],
    ),
    (
        lambda: sb.Striker(drive=sb.FixedStop(), gap=5e-5, suspension_stiffness=2.0),
        "give its mass",
        [lambda: integrable((HERTZ, body(2.0)))],
    ),
    (
        lambda: of_file(modes=1, type="hertz", restitution=0.6, speed=0.07),
        "restitution and speed make the loss of type = 'hunt_crossley'",
        [lambda: of_file(modes=1, type="hunt_crossley", restitution=0.6, speed=0.07)],
    ),
    (
        lambda: backbone(system((LOSSY, STOP))),
        "use a HertzContact or a PowerLaw",
        [lambda: backbone(system((HERTZ, STOP))), lambda: backbone(system((sb.PowerLaw(1e-3, 1.3), STOP)))],
    ),
    (
        lambda: backbone(system((HERTZ, SHAKER))),
        "system with drive: .* leave it out, or give a FixedStop",
        [lambda: backbone(system()), lambda: backbone(system((HERTZ, STOP)))],
    ),
    (
        lambda: backbone(system((HERTZ, body(0.0)))),
        "give suspension_stiffness",
        [lambda: backbone(system((HERTZ, body(2.0))))],
    ),
    (
        lambda: backbone(system((HERTZ, STOP), (HERTZ, STOP), base_excitation=BASE)),
        "system with base_excitation: .* leave it out",
        [lambda: backbone(system((HERTZ, STOP), (HERTZ, STOP)))],
    ),
    (
        lambda: require_excitation(system()),
        "give a striker, a base_excitation, an axial_load or a force that changes with time",
        [
            lambda: require_excitation(system((HERTZ, SHAKER))),
            lambda: require_excitation(system(base_excitation=BASE)),
            lambda: require_excitation(
                system(
                    forces=[
                        sb.ExternalForce(location=0.5, history=sb.HarmonicForce(amplitude=1e-3, frequency_ratio=0.9))
                    ]
                )
            ),
        ],
    ),
    (
        lambda: require_motion(system()),
        "needs an initial_state; give one, or a contact",
        [
            lambda: require_motion(system(initial_state=sb.State(amplitude=[0.0]))),
            lambda: require_motion(system((HERTZ, STOP))),
        ],
    ),
]


@pytest.mark.parametrize("number", range(len(ADVICE)))
def test_advice_is_accepted(number: int) -> None:
    refused, words, accepted = ADVICE[number]
    with pytest.raises(sb.InputError, match=words):
        refused()
    assert accepted
    for each in accepted:
        each()


@pytest.mark.slow
@pytest.mark.parametrize("law", INSTEAD.values(), ids=list(INSTEAD))
def test_stable_manifold_under_the_laws_that_are_advised(law: sb.ContactLaw) -> None:
    saddle = sb.dynamics.periodic_orbit(system((NEWTON, SHAKER)), [0.0, 0.0])
    with pytest.raises(
        sb.InputError, match=r"no inverse .* use type = 'hertz', or 'hunt_crossley' with restitution and speed"
    ):
        sb.dynamics.invariant_manifold(saddle, "stable", max_arclength=0.3)
    saddle = sb.dynamics.periodic_orbit(system((law, SHAKER)), [0.0, 0.0])
    found = sb.dynamics.invariant_manifold(saddle, "stable", max_arclength=0.3)
    assert found.attrs["stability"] == "stable" and found.sizes["point"] > 2
