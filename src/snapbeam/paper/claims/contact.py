"""Claims 12 and 16: two laws of contact as modes are added, and the contact stiffness."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from snapbeam.model.paper_values import CONTACT, LOCATION
from snapbeam.paper.claims.table import Claim
from snapbeam.paper.studies.sensitivity import tip_contact
from snapbeam.paper.system import paper_model, paper_run

if TYPE_CHECKING:
    from snapbeam.paper.recipe import Results

__all__ = ["restitution", "stiffness"]

_RESTITUTION = 0.7  # any value above 0 gives the same trend


def restitution(results: Results) -> list[Claim]:
    """Claim 12, on the impulse of the first impact: the shaker sets out against the beam at rest."""
    counts = results.pick((4, 8, 16), (16, 32, 64, 128, 256))
    omega, drive = 1.21, 0.18
    newton, hertz = [], []
    for modes in counts:
        model = paper_model(modes)
        speed = drive * float(model.length_scale or 0.0) * 2.0 * math.pi * paper_model(32).reference_freq
        newton.append((1.0 + _RESTITUTION) * model.contact_mass(LOCATION) * speed)
        run = paper_run(
            modes, omega, drive, 1, reference_freq=paper_model(32).reference_freq, sample_times=[0.0]
        )
        first = run.impacts.onset.values < 0.5 / (omega * paper_model(32).reference_freq)
        hertz.append(float(run.impacts.impulse.values[first].sum()))
    slope = float(np.polyfit(np.log(counts), np.log(newton), 1)[0])
    change = abs(hertz[-1] / hertz[-2] - 1.0)
    return [
        Claim(
            "12",
            "the law of restitution does not converge as modes are added, Hertz's law does",
            "does not; does",
            f"impulse of the first impact by restitution falls like N^{slope:.2f}; by Hertz's law, over the "
            f"first half "
            f"cycle, it changes by {100.0 * change:.2g} % from {counts[-2]} to {counts[-1]} modes",
            f"Hertz: {100.0 * abs(hertz[-2] / hertz[-3] - 1.0):.2g} % from {counts[-3]} to {counts[-2]} "
            f"modes",
            "holds" if slope < -0.7 and change < 0.02 else "fails",
            "Impulse given to the beam at rest, Omega = 1.21, V = 0.18: (1 + e) M v with the mass M met by "
            "the point for "
            "restitution (e = 0.7), integrated for Hertz's law.",
            f"The mass met falls from {1e3 * paper_model(counts[0]).contact_mass(LOCATION):.3f} g at "
            f"{counts[0]} modes to "
            f"{1e3 * paper_model(counts[-1]).contact_mass(LOCATION):.3f} g at {counts[-1]}, "
            "towards rho S L/N.",
        )
    ]


def stiffness(results: Results) -> list[Claim]:
    """Claim 16."""
    computed = tip_contact().stiffness
    modulus = _needed_modulus()
    return [
        Claim(
            "16",
            "the contact stiffness follows from the stated materials, a 5 mm sphere of polylactic acid on "
            "steel",
            f"{CONTACT.stiffness:.1e} N/m^1.5",
            f"{computed:.2e} N/m^1.5",
            "modulus of the sphere 3 to 4 GPa: "
            + " to ".join(f"{tip_contact(value).stiffness:.2e}" for value in (3e9, 4e9)),
            "holds" if abs(computed / CONTACT.stiffness - 1.0) < 0.1 else "fails",
            "Hertz's formula, R = 2.5 mm, moduli 3.5 and 200 GPa, Poisson ratios 0.36 and 0.3; agreement: "
            "within 10 %.",
            f"The printed value needs a modulus of {modulus / 1e9:.1f} GPa, or a radius, not a diameter, of "
            f"5 mm "
            f"({tip_contact(radius=5e-3).stiffness:.2e}). How little the map depends on it is measured in B.",
        )
    ]


def _needed_modulus() -> float:
    from scipy.optimize import brentq

    return float(brentq(lambda modulus: tip_contact(modulus).stiffness - CONTACT.stiffness, 1e9, 20e9))
