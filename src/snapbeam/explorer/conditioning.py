"""How far a run can be trusted: what becomes of a neighbour that differs by 1e-9."""

from __future__ import annotations

from typing import Any

import numpy as np

import snapbeam as sb
from snapbeam import Run, RunStatus
from snapbeam.explorer.jobs import Token

__all__ = ["NEIGHBOUR", "conditioned"]

NEIGHBOUR = 1e-9
"""Relative change of the striker's amplitude."""
_APART = 0.1
"""Displacement over b from which two runs count as apart."""
_MOST_CYCLES = 2000


def conditioned(run: Run, token: Token) -> str:
    """Words for it, computed of a neighbour of *run*."""
    system, integration = run.system, run.integration
    striker = system.striker
    if (
        striker is None
        or not striker.drive.harmonic
        or run.summary.status not in (RunStatus.OK, RunStatus.EARLY_STOP)
    ):
        return ""
    cycles = integration.cycles_or_default
    if cycles > _MOST_CYCLES:
        return ""
    token.check()
    found = sb.perturbation_growth(system, integration, accuracy="standard", perturbation=NEIGHBOUR)
    token.check()
    apart = np.flatnonzero(found["separation"].values > _APART)
    amplitude = system.parameters["drive.velocity_amplitude"]
    neighbour = system.replace(**{"drive.velocity_amplitude": amplitude * (1.0 + NEIGHBOUR)})
    other: Any = sb.simulate(neighbour, integration, sample_times=[0.0], progress=token.check).summary
    same = other.response_class is run.summary.response_class and other.final_well == run.summary.final_well
    ends = "ends in the same class and well" if same else f"ends elsewhere: {other.response_class.label}"
    if not apart.size:
        near = f"a neighbour {NEIGHBOUR:.0e} away in V stays within {_APART:g} b"
        return f"well conditioned: {near} for all {cycles} cycles"
    cycle = float(found["cycle"][apart[0]])
    return f"separates after {cycle:.3g} cycles: a neighbour {NEIGHBOUR:.0e} away in V {ends}"
