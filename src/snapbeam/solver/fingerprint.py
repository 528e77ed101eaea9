"""A fingerprint of what the engine computes, to tell files apart that two of them made.

A version number does not say by which steps a number was found.  The mark does: a few short, well-conditioned runs are
integrated at both levels of accuracy, with one to twelve modes, and how many steps they took and what came of them, to
nine digits, is hashed.  Another text of the same engine has the same mark; other steps, or another engine, have not.
"""

from __future__ import annotations

import hashlib
from functools import cache

import numpy as np

from snapbeam.model.default_values import BEAM, CONTACT
from snapbeam.model.drive.sine import Sine
from snapbeam.model.integration import ACCURACIES, Integration
from snapbeam.model.reduced_model import ReducedModel
from snapbeam.model.striker import Contact, Striker
from snapbeam.model.system import System
from snapbeam.solver.assemble import make_ensemble
from snapbeam.solver.cpu import driver

_CASES = ((1, 1.4, 0.02), (4, 1.21, 0.05), (12, 1.4, 0.02))
"""Modes, frequency ratio, velocity amplitude: three cycles of each are conditioned to 1e-11 or better."""
_HASHED_LEVEL = {"standard": "map", "reference": "reference"}
"""Names of the accuracy levels in the hash: they are those of the version that first stored a fingerprint."""
_KEPT = ("max_displacement", "min_displacement", "total_impulse", "contact_time", "peak_force")


@cache
def solver_fingerprint() -> str:
    """Sixteen hexadecimal digits that are equal where engine and default steps are."""
    digest = hashlib.sha256()
    for modes, ratio, velocity in _CASES:
        system = System(
            ReducedModel.from_beam(BEAM, modes=modes, damping_ratio=0.005),
            contacts=[
                Contact(CONTACT, Striker(drive=Sine(frequency_ratio=ratio, velocity_amplitude=velocity)))
            ],
        )
        for accuracy in ACCURACIES:
            accumulators = driver.run_ensemble(
                make_ensemble(system, Integration(cycles=3, accuracy=accuracy)), 1
            )[0]
            digest.update(
                f"{modes} {_HASHED_LEVEL[accuracy]} {int(accumulators['steps'])} {int(accumulators['impacts'])}".encode()
            )
            for name in _KEPT:
                digest.update(np.format_float_scientific(float(accumulators[name]), precision=8).encode())
    return digest.hexdigest()[:16]
