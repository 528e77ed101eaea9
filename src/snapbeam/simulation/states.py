"""States from the coordinates of an engine."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from snapbeam.model.state import ModalState, State
from snapbeam.solver.ensemble import FAR_AWAY, Ensemble

_Array = NDArray[np.float64]
_Integers = NDArray[np.int64]


def _units(ensemble: Ensemble) -> Any:
    """Return the factors from the coordinates of circuits to volts or amperes."""
    units = np.array([each.unit for each in ensemble.circuits] or [1.0])
    return units if units.size > 1 else units[0]


def states_of(
    ensemble: Ensemble, q: _Array, p: _Array, well_sign: _Integers, contact_ticks: _Integers, ticks: _Integers
) -> State:
    """Return the states of the runs of an ensemble, a batch of shape (runs,).

    *q* and *p*, of shape (runs, N), are coordinates of the linear modes about the well *well_sign*; *contact_ticks*, of
    shape (runs, strikers), is the time since each contact began, and *ticks* the time, in ticks.
    """
    structure, runs, offset = ensemble.structure, ensemble.runs, ensemble.runs["offset"][:, 0]
    far = (well_sign < 0)[:, None]
    first = np.where(far, q + structure.shift, q)
    # the phase of a periodic drive is reduced to one period
    turned = (ticks % runs["period"] if ensemble.comes_round else ticks) / runs["period"]
    tick = runs["tick"]
    return State(
        amplitude=structure.amplitudes(first),
        velocity=structure.velocities(p),
        phase=runs["phase"] + 2.0 * math.pi * turned,
        striker_position=np.where(offset > FAR_AWAY, structure.sign * (runs["rest_contact"][:, 0] + offset), np.nan),
        contact_time=np.where(contact_ticks < 0, -1.0, contact_ticks * tick[:, None]),
        striker_shift=structure.bodies_of(q),
        striker_rate=structure.bodies_of(p),
        indentation=structure.indentations_of(q),
        circuit=structure.circuits_of(q) * _units(ensemble),
        modal=ModalState(q, p, well_sign.astype(np.float64), offset.copy(), structure.hash),
    )
