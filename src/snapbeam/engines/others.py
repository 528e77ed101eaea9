"""The strikers beside the first one, for every run of an ensemble."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from snapbeam.engines.ensemble import FurtherContactTable
from snapbeam.engines.scalar.several import LAW, NUMBERS, OFFSET, REST, SIGN, SPEED
from snapbeam.engines.scalar.tip import tip_motion
from snapbeam.engines.structure import Structure
from snapbeam.model.drive import Drive
from snapbeam.model.system import System

__all__ = ["others_of"]

_Array = NDArray[np.float64]


def others_of(
    system: System, structure: Structure, columns: Mapping[str, _Array], runs: int
) -> FurtherContactTable | None:
    """Where they are and what they touch by; their motions are in the ensemble's drive.

    A striker stands where its tip touches the beam at rest in the first well, or its gap away from that.
    """
    if not system.further_contacts:
        return None
    count = len(system.further_contacts)
    numbers, places = np.zeros((runs, count, NUMBERS)), np.zeros((runs, count), dtype=np.int64)
    rows: list[_Array] = []
    for j, each in enumerate(system.further_contacts):
        number, striker = j + 2, each.striker
        assert system.striker is not None
        sign = 1.0 if striker.side == system.striker.side else -1.0
        location = columns[f"striker_{number}.location"]
        different, which = np.unique(location, return_inverse=True)
        shapes = np.array([structure.model.shape_at(float(x)) for x in different])
        places[:, j] = len(rows) + which
        rows += [sign * structure.row_of_beam(structure.row(shape)) for shape in shapes]
        numbers[:, j, REST] = sign * structure.sign * structure.rests(shapes)[which]
        begun = _begun(striker.drive, columns, f"drive_{number}", system, runs)
        gap = columns.get(f"striker_{number}.gap", np.full(runs, np.nan))
        numbers[:, j, OFFSET] = np.where(np.isnan(gap), -begun, -gap)
        numbers[:, j, SIGN] = sign
        numbers[:, j, SPEED] = _speed(striker.drive, columns, f"drive_{number}", system, runs)
        names = type(each.contact).numbers_type()._fields
        for k, name in enumerate(names):
            numbers[:, j, LAW + k] = columns[f"contact_{number}.{name}"]
    return FurtherContactTable(
        tuple(type(each.contact) for each in system.further_contacts), numbers, places, np.array(rows)
    )


def _own(columns: Mapping[str, _Array], section: str, runs: int) -> dict[str, _Array]:
    names = len(section) + 1
    own = {name[names:]: values for name, values in columns.items() if name.startswith(f"{section}.")}
    return own or {"": np.zeros(runs)}


def _begun(drive: Drive, columns: Mapping[str, _Array], section: str, system: System, runs: int) -> _Array:
    """How far the tip is from its mid-position at the start, m."""
    own = _own(columns, section, runs)
    phase = columns.get(f"{section}.phase", np.zeros(runs))
    if not phase.any():
        return np.zeros(runs)
    found, kind = drive.numbers(own, system.scale), drive.integrated_as or type(drive)
    made: Any = kind.numbers_type()
    table = np.stack([found[name] for name in kind.number_names], axis=1)
    return np.array(
        [tip_motion(made(*row), np.empty(0), at)[0] for row, at in zip(table, phase, strict=True)]
    )


def _speed(drive: Drive, columns: Mapping[str, _Array], section: str, system: System, runs: int) -> _Array:
    """Greatest speed of the tip in the frame of the ends, m/s."""
    speed = drive.bounds(_own(columns, section, runs), system.scale)[1]
    base = system.base_excitation
    if base is not None and not base.striker_on_base:
        speed = speed + base.motion.bounds(_own(columns, "base", runs), system.scale)[1]
    return speed
