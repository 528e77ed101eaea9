"""Motions as functions of time: of a striker, a base, an axial load or a force."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from snapbeam.model.drive.base import Drive, Scale
from snapbeam.model.drive.components import Motion
from snapbeam.model.quantity import numbered, split_name
from snapbeam.model.striker import Striker
from snapbeam.model.system import System

_Array = NDArray[np.float64]


def own_columns(columns: Mapping[str, _Array], section: str, runs: int) -> dict[str, _Array]:
    """Parameters of a section, of which there may be none."""
    own = {field: values for name, values in columns.items() for of, field in [split_name(name)] if of == section}
    return own or {"": np.zeros(runs)}


def motion_of(drive: Drive, scale: Scale, until: float, columns: Mapping[str, _Array] | None = None) -> Motion:
    """Displacement (m), velocity (m/s) and acceleration (m/s^2) of a drive at times since it began, up to one of them, s.

    *columns* contains its parameters, those of one run, if they are not its own.
    """
    own = drive.columns() if columns is None else columns
    return Motion(drive.components_until(own, scale, np.array([until])))


def started(
    system: System, own: Mapping[str, _Array], phase: _Array, clock: _Array
) -> tuple[dict[str, _Array], _Array]:
    """Parameters of a motion of each run, and the seconds that it has gone on at the start.

    A motion alone goes on at the phase of the state, in place of its own; several share the clock of the run.
    """
    if len(system.moving) < 2 and "phase" in own:
        return {**own, "phase": phase}, np.zeros(phase.size)
    return dict(own), phase / clock


def carried(system: System, striker: Striker) -> float:
    """Share of the motion of the base in that of a tip, in the frame of the ends and as the tip pushes."""
    base = system.base_excitation
    if base is None or base.striker_on_base:
        return 0.0
    return -1.0 if (base.direction == "up") == (striker.side == "below") else 1.0


def side_of(system: System, section: str, drive: Drive) -> float:
    """-1 for a record of a striker above the beam, which was made in space; other motions are positive as it pushes."""
    kind, number = numbered(section)
    above = drive.recorded and kind == "drive" and system.contacts[number - 1].striker.side == "above"
    return -1.0 if above else 1.0


def displacements(drive: Drive, own: Mapping[str, _Array], scale: Scale, times: _Array) -> _Array:
    """Displacement of a drive with the parameters of each run at a time of each, s; in m, shape (runs,)."""
    which: Any = np.arange(times.size)
    return Motion(drive.components_until(own, scale, times), which)(times)[0]
