"""From an engine's coordinates to states, and back without losing a bit."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from snapbeam.engines.ensemble import Ensemble
from snapbeam.model.state import ModalState, State

__all__ = ["states_of"]

_Array = NDArray[np.float64]
_Integers = NDArray[np.int64]


def states_of(
    ensemble: Ensemble, q: _Array, p: _Array, home: _Integers, contact_ticks: _Integers, ticks: _Integers
) -> State:
    """States of the runs of an ensemble, a batch of shape (runs,).

    *q* and *p* of shape (runs, N) are linear modes about the well *home*; *ticks* is when.
    """
    structure, runs = ensemble.structure, ensemble.runs
    far = (home < 0)[:, None]
    first = np.where(far, q + structure.shift, q)
    # a sine comes round after each turn; a record has an end
    turned = (ticks % runs["period"] if ensemble.drive.harmonic else ticks) / runs["period"]
    tick = runs["tick"]
    return State(
        amplitude=structure.amplitudes(first),
        velocity=structure.velocities(p),
        phase=runs["phase"] + 2.0 * math.pi * turned,
        striker_position=np.where(
            ensemble.highest > -np.inf, structure.sign * (runs["rest_contact"] + runs["offset"]), np.nan
        ),
        contact_time=np.where(contact_ticks >= 0, contact_ticks * tick, -1.0),
        striker_shift=structure.body_of(q),
        striker_rate=structure.body_of(p),
        modal=ModalState(q, p, home.astype(np.float64), np.array(runs["offset"]), structure.hash),
    )
