"""The CUDA engine's kernel: the march of :mod:`snapbeam.kernels.cpu`, a block of threads a trajectory.

A block takes a run from the queue, marches it to its end, enters what it found and takes the next.  After a
*budget* of steps every block lays down its run, wherever it is, and the kernel returns; the next call
goes on from the same bits.  So a call is short, whatever the runs are: the host can show progress, be
interrupted, and share the device with a display.

The first thread keeps the books (counts and numbers of a run); all threads make the same decisions.
"""

from __future__ import annotations

import math
from functools import cache
from typing import Any

from numba import cuda, float64, int64

from snapbeam.codes import RunStatus
from snapbeam.kernels.cpu_step import Impactor
from snapbeam.kernels.cuda_step import PARTS, SIMULATED, Block, Mode, functions, shared, stride_of
from snapbeam.kernels.fields import Counts, Numbers, Reals, Ticks
from snapbeam.kernels.march_parts import (
    PIECES,
    Clock,
    contact_level,
    count_in_step,
    finish_impact,
    first_entry,
    flight_level,
    safe_for,
    seen_from,
    track_extremes,
)
from snapbeam.kernels.physics import contact_energy, mode_energy, tension_energy, tension_factors
from snapbeam.kernels.statistics import extremes, first_fall, sign_of, turning_point

__all__ = ["KEPT", "MARKS", "STRUCTURE", "march_kernel"]

STRUCTURE = ("omega", "omega_squared", "omega_damped", "damping", "g", "center", "shift")
"""Rows of the structure, by their names in :class:`snapbeam.kernels.rows.Layout`."""
MARKS = 3
"""Integers, and"""
KEPT = 7
"""floats that a run laid down keeps beside its counts and numbers."""

_OK, _DECIDED, _RUNNING = int(RunStatus.OK), int(RunStatus.DECIDED), int(RunStatus.RUNNING)
_NOT_FINITE, _STEP_LIMIT = int(RunStatus.NOT_FINITE), int(RunStatus.STEP_LIMIT)
_TWO_PI = 2.0 * math.pi
# What a pass through a step is for.
_WHOLE, _CUT, _DEEPEST = 0, 1, 2

_first_entry, _count_in_step = shared(first_entry), shared(count_in_step)
_finish_impact, _track_extremes = shared(finish_impact), shared(track_extremes)


class _Unrecorded:
    """The part of :class:`snapbeam.kernels.march_parts.Outputs` that an impact is written to: no room."""
