"""What a run with several strikers says of each: where its tip is, how deep it presses, and its force."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from snapbeam.engines.driven import motions_of, tip_of
from snapbeam.engines.ensemble import Ensemble
from snapbeam.engines.outputs import Recorded
from snapbeam.engines.scalar.several import OFFSET, REST, SIGN
from snapbeam.model.system import System

__all__ = ["strikers_of"]

_Array = NDArray[np.float64]


def strikers_of(
    ensemble: Ensemble, system: System, recorded: Recorded, values: _Array, first: _Array
) -> dict[str, _Array]:
    """Series of shape (samples, strikers), the first one's in column 0, and the energy that all contacts store.

    *first* is where the first tip is, over b.  The engine writes down the first contact; those of the others follow
    from where the beam is and their motions.
    """
    others, length = ensemble.others, system.scale.length
    assert others is not None and system.striker is not None
    count, samples = 1 + len(system.further_contacts), recorded.times.size
    force, depth, tip = (np.zeros((samples, count)) for _ in range(3))
    energy = values[:, 3].copy()
    sign = ensemble.structure.sign
    force[:, 0], depth[:, 0], tip[:, 0] = values[:, 1], values[:, 0] / length, first
    for j, each in enumerate(system.further_contacts):
        numbers, row = others.numbers[0, j], others.rows[others.places[0, j]]
        reached = recorded.q @ row
        motion, _ = tip_of(system, j + 2, recorded.times)
        motion = motion + numbers[SIGN] * _follows(ensemble, system, recorded)
        pressed = numbers[OFFSET] + motion - reached
        contact: Any = each.contact
        kind = contact.numbers_type()
        law = kind(*(getattr(contact, name) for name in kind._fields))
        touching = np.maximum(pressed, 0.0)
        force[:, j + 1] = [contact.force(law, d) if d > 0.0 else 0.0 for d in touching.tolist()]
        energy += [contact.energy(law, d) if d > 0.0 else 0.0 for d in touching.tolist()]
        depth[:, j + 1] = pressed / length
        tip[:, j + 1] = sign * numbers[SIGN] * (numbers[REST] + numbers[OFFSET] + motion) / length
    return {
        "striker_forces": force,
        "striker_penetrations": depth,
        "striker_displacements": tip,
        "energy_contact": energy,
    }


def _follows(ensemble: Ensemble, system: System, recorded: Recorded) -> _Array:
    """What a base does to tips that stand in space, in its frame, as seen from the first striker's side."""
    if system.base_excitation is None or system.base_excitation.striker_on_base:
        return np.zeros(recorded.times.size)
    moved = motions_of(ensemble, system, recorded.times)["base"][0]
    return np.asarray(-ensemble.structure.sign * moved)
