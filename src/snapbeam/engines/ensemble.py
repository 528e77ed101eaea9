"""What an engine is asked for: many runs of one structure, in no engine's layout."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from snapbeam.engines.structure import Structure
from snapbeam.model.contact import ContactLaw
from snapbeam.model.drive import Drive, Scale

__all__ = ["Ensemble"]

_Array = NDArray[np.float64]
_Integers = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Ensemble:
    """Runs of one structure under one law of contact and one kind of drive, ready for any engine."""

    structure: Structure
    scale: Scale
    order: int
    """Of the composition."""
    law: type[ContactLaw]
    drive: type[Drive]
    runs: NDArray[Any]
    """Records of :data:`~snapbeam.engines.columns.RUN`, shape (runs,)."""
    law_numbers: _Array
    """Numbers of the law of each run, shape (runs, numbers)."""
    drive_numbers: _Array
    """Numbers of the drive likewise."""
    samples: _Array
    """What the drive looks up."""
    location: _Array
    """x_s of each run."""
    highest: _Array
    """Highest position that the tip of each run ever has, m; -inf without one."""
    contact_rows: _Array
    """V^T phi of every location, shape (locations, N), seen from the striker's side."""
    starts: _Array
    """q and p of every start, shape (starts, 2, N)."""
    max_steps: int
    high_omega: float
    """Angular frequency above which a mode counts as high, rad/s."""
    cycles: float
    """Cycles of excitation of each run."""

    @property
    def size(self) -> int:
        """Number of runs."""
        return int(self.runs.size)

    @property
    def first_side(self) -> _Integers:
        """-1 for a run that starts in the well away from which the striker pushes, +1 for the other one."""
        moved = np.array([float(start[0] @ self.structure.center) for start in self.starts])
        center = self.runs["home"] * self.runs["rest_center"] + moved[self.runs["start_row"]]
        if self.structure.uneven is not None:
            center = center - self.structure.uneven.level
        side: _Integers = np.where(center > 0.0, 1, -1)
        return side

    @property
    def work(self) -> _Array:
        """Expected work of each run in flight steps, shape (runs,)."""
        work: _Array = self.runs["end"] / self.runs["step"]
        return work

    @property
    def step_times(self) -> _Array:
        """Flight step of each run, s."""
        times: _Array = self.runs["step"] * self.runs["tick"]
        return times

    @property
    def finest(self) -> int:
        """Most halvings of the flight step that any run takes."""
        return int(self.runs["finest"].max())

    @property
    def fastest(self) -> float:
        """Greatest angular frequency of a mode or a drive, rad/s."""
        names = self.drive.number_names
        rate = names.index("fastest") if "fastest" in names else 0
        return max(float(self.structure.omega.max()), float(self.drive_numbers[:, rate].max()))
