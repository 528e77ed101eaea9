"""Input of every solver: many runs of one structure, independent of the memory layout."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from snapbeam.model.drive.base import Scale
from snapbeam.model.early_termination import passed_heights
from snapbeam.solver.structure import Structure

_REALS = (
    "phase",  # argument of the drive at the start, rad
    "tick",  # s
    "decide_energy",  # energy above the well below which a beam in the far well stays there; -inf: never decide
    "decide_reach",  # highest future position of the tip, or 0 if that is higher
    "lowest",  # height of a flight that is too low to be resolved, m
    "contact_step",  # longest step in contact, s
    "well_sign",  # +1 if q and p are counted from the first well, -1 from the other
)
_INTEGERS = (
    "step",  # ticks of a flight step
    "period",  # ticks in which the drive's argument makes one turn
    "output_interval",  # ticks from one state that is handed out to the next; the whole run if none is
    "end",
    "last_quarter",
    "decide_crossings",  # crossings in the last quarter beyond which it is continuous; -1: never decide
    "halvings",  # of the contact step, at most
    "start_row",
)
_OF_CONTACTS = (
    ("offset", np.float64),  # penetration of the tip at mid-stroke into the beam at rest
    ("rest_contact", np.float64),  # displacement of the contact point in the well that q is counted from
    ("contact_time", np.float64),  # s since the present contact began; negative: apart; NaN: the penetration decides
    ("contact_row", np.int64),
)


FAR_AWAY = -1e30
"""Penetration, m, of a tip that is not there."""


_Array = NDArray[np.float64]
_Integers = NDArray[np.int64]
Records = Any
"""Type of arrays with fields; with ``NDArray[Any]`` mypy tries every overload of NumPy, seconds for a line."""


class CircuitCoupling(NamedTuple):
    """A harvester's circuit, for every run, arrays of shape (runs,)."""

    rate: _Array
    """Decay rate, 1/s; without inertia, the ratio of the coordinate to the velocity of the coupling."""
    share: _Array
    """Fraction of the loss that is dissipated in the load."""
    volts: _Array
    """Voltage across the load, V, per unit of the circuit's coordinate."""
    unit: float
    """Volts or amperes of the circuit's state per unit of its coordinate."""


@dataclass(frozen=True, eq=False)
class Ensemble:
    """Runs of one structure, ready for any engine."""

    structure: Structure
    scale: Scale
    order: int
    """Order of the composition."""
    runs: Records
    """Records of :func:`~snapbeam.solver.ensemble.run_dtype`, shape (runs,)."""
    clock: _Array
    """Rate of the phase of each run, rad/s."""
    comes_round: bool
    """True if the phase repeats after one turn."""
    location: _Array
    """x_s of the first striker of each run."""
    highest: _Array
    """Highest position that the first tip of each run ever has, m; -inf without one."""
    contact_rows: _Array
    """V^T phi of every location of every contact, shape (rows, N), as its striker pushes: positive into the beam."""
    starts: _Array
    """q and p of every start, shape (starts, 2, N)."""
    max_steps: int
    high_omega: float
    """Angular frequency above which a mode counts as high, rad/s."""
    cycles: float
    """Cycles of excitation of each run."""
    circuits: tuple[CircuitCoupling, ...] = ()
    """Circuits of the harvesters."""
    contacts: int = 0
    impulsive: bool = False
    """True if a contact acts by impulses, without a force."""
    channels: Any = None
    """:class:`~snapbeam.solver.channels.Channels` for the native core; None with the Python engine."""
    on_gpu: bool = False
    """True if a GPU integrates the runs."""
    systems: tuple[Any, ...] = ()
    """The :class:`~snapbeam.System` of each run, for the Python engine."""

    @property
    def reach(self) -> _Array:
        """Displacement that the first contact point must pass so that the tip never meets it again, m; shape (runs,)."""
        if self.structure.wells_are_mirror_images:
            return np.maximum(self.highest, 0.0)
        return passed_heights(self.structure.model, self.location, self.highest)

    @property
    def has_striker(self) -> bool:
        """Return whether the ensemble has a striker."""
        return self.contacts > 0

    @property
    def size(self) -> int:
        """Number of runs."""
        return int(self.runs.size)

    @property
    def first_side(self) -> _Integers:
        """-1 for a run that starts in the well away from which the striker pushes, +1 for the other one."""
        moved = np.array([float(start[0] @ self.structure.center) for start in self.starts])
        center = self.runs["well_sign"] * self.structure.center_rest + moved[self.runs["start_row"]]
        return np.asarray(np.where(center - self.structure.dividing_height > 0.0, 1, -1))

    @property
    def work(self) -> _Array:
        """Expected work of each run in flight steps, shape (runs,)."""
        return np.asarray(self.runs["end"] / self.runs["step"])

    @property
    def step_times(self) -> _Array:
        """Flight step of each run, s."""
        return np.asarray(self.runs["step"] * self.runs["tick"])


def run_dtype(contacts: int = 1) -> np.dtype[Any]:
    """One run to an engine: a record by name, SI units, as the striker pushes, positive into the beam.

    What holds of contacts has shape (contacts,); without one, the only entry is the place at which the beam is observed.
    """
    fields: list[Any] = [(name, np.float64) for name in _REALS] + [(name, np.int64) for name in _INTEGERS]
    return np.dtype(fields + [(name, kind, (max(1, contacts),)) for name, kind in _OF_CONTACTS], align=True)
