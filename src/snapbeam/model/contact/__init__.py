"""Laws of contact, one a file: what happens where the striker touches the beam."""

from snapbeam.model.contact.base import LAWS, ContactLaw, LawProperties
from snapbeam.model.contact.hertz import HertzContact
from snapbeam.model.contact.hunt_crossley import HuntCrossley
from snapbeam.model.contact.kelvin_voigt import KelvinVoigt
from snapbeam.model.contact.layered import LayeredHertz
from snapbeam.model.contact.power_law import PowerLaw
from snapbeam.model.contact.restitution import Restitution
from snapbeam.model.contact.stress import bending_stress, hertz_stress

__all__ = [
    "LAWS",
    "ContactLaw",
    "HertzContact",
    "HuntCrossley",
    "LawProperties",
    "KelvinVoigt",
    "LayeredHertz",
    "PowerLaw",
    "Restitution",
    "bending_stress",
    "hertz_stress",
]
