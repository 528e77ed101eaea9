"""Systems and ensembles for the native core."""

from __future__ import annotations

from typing import Any

import numpy as np

import snapbeam as sb
from snapbeam.model import default_values
from snapbeam.solver import native
from snapbeam.solver.assemble import make_ensemble


def beam(modes: int) -> sb.ReducedModel:
    return sb.ReducedModel.from_beam(default_values.BEAM, modes=modes)


def struck(modes: int, *more: sb.Contact, **parts: Any) -> sb.System:
    shaker = sb.Shaker(frequency_ratio=1.21, velocity_amplitude=0.18, location=1 / 2.1)
    return sb.System(beam(modes), contacts=[sb.Contact(default_values.CONTACT, shaker), *more], **parts)


def stop(law: sb.ContactLaw, location: float = 0.4, gap: float = 5e-5) -> sb.Contact:
    return sb.Contact(law, sb.Striker(drive=sb.FixedStop(), side="above", location=location, gap=gap))


def crowded(modes: int) -> sb.System:
    """A system in which every kind of channel acts."""
    return struck(
        modes,
        stop(sb.KelvinVoigt(2e5, 1.0)),
        stop(sb.HuntCrossley(3e8, 2.0), 0.6, 8e-5),
        stop(sb.PowerLaw(1.0, 1.7), 0.3, 1e-4),
        forces=[
            sb.LocalSpring(stiffness=20.0, cubic_stiffness=1e7, location=0.35),
            sb.MagneticForce(strength=1e-9, gap=1.3e-3, location=0.5),
            sb.QuadraticDamping(coefficient=0.2, location=0.55),
            sb.CoulombFriction(friction_force=2e-3, smoothing_velocity=0.02, location=0.45),
            sb.ExternalForce(history=sb.HarmonicForce(frequency_ratio=0.7, amplitude=0.02), location=0.4),
        ],
        base_excitation=sb.BaseExcitation(
            motion=sb.DisplacementSine(frequency_ratio=1.7, displacement_amplitude=0.02), striker_on_base=False
        ),
        axial_load=sb.AxialLoadModulation(motion=sb.HarmonicForce(frequency_ratio=2.0, amplitude=2.0)),
    )


def arrays(system: sb.System, cycles: int = 2, points: dict[str, Any] | None = None, **settings: Any) -> native._Arrays:
    """The arrays that the core gets."""
    how = sb.Integration(cycles=cycles, engine="native", **settings)
    found = {name: np.asarray(values, float) for name, values in (points or {}).items()}
    return native._Arrays(make_ensemble(system, how, found))
