"""Integer labels that the core, maps and files share, and what they mean in words."""

from __future__ import annotations

from collections.abc import Mapping
from enum import IntEnum
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from snapbeam.util.validation import InputError, finite_array, shown


class ResponseClass(IntEnum):
    """The kind of response of one run (section 4.2 of the paper).

    From the zero crossings of the displacement at the centre: none is intrawell; more than n/5 in the last quarter (n
    cycles) is continuous interwell; else transient, 1 if it ends about the well it started in and 2 if about the other.
    A beam with one well has the same codes with the names of :meth:`label_of`: it snapped if its centre came more than
    half of the way from the flat shape to the mirror image of its rest.

    Examples
    --------
    >>> import snapbeam as sb
    >>> sb.ResponseClass(1).label
    'transient interwell 1'
    """

    UNKNOWN = -1
    INTRAWELL = 0
    TRANSIENT_1 = 1
    TRANSIENT_2 = 2
    CONTINUOUS = 3

    @property
    def label(self) -> str:
        """The name used in tables and legends."""
        return _LABELS[self]

    def label_of(self, wells: int) -> str:
        """The name used in tables and legends of a beam with one well or two."""
        return _ONE_WELL_LABELS.get(self, self.label) if wells == 1 else self.label

    @property
    def is_interwell(self) -> bool:
        """True if the beam snapped through at least once."""
        return self in (ResponseClass.TRANSIENT_1, ResponseClass.TRANSIENT_2, ResponseClass.CONTINUOUS)


_LABELS = {
    ResponseClass.UNKNOWN: "unknown",
    ResponseClass.INTRAWELL: "intrawell",
    ResponseClass.TRANSIENT_1: "transient interwell 1",
    ResponseClass.TRANSIENT_2: "transient interwell 2",
    ResponseClass.CONTINUOUS: "continuous interwell",
}


_ONE_WELL_LABELS = {
    ResponseClass.INTRAWELL: "no snap-through",
    ResponseClass.TRANSIENT_1: "snapped and returned",
    ResponseClass.TRANSIENT_2: "snapped, inverted at the end",
    ResponseClass.CONTINUOUS: "continuous snap-through",
}


def wells_of(attrs: Mapping[str, Any]) -> int:
    """Number of wells of the beam of a dataset, from its attributes."""
    found = np.asarray(attrs.get("wells", 2))
    if found.size != 1 or found.dtype.kind not in "iuf" or found.item() not in (1, 2):
        raise InputError(f"attribute wells = {shown(attrs['wells'])}: must be 1 or 2")
    return int(found.item())


def is_of_matrices(attrs: Mapping[str, Any]) -> bool:
    """Return whether the structure of a dataset was given by matrices: its contact is at their row, at no location."""
    return '"contact_shape"' in str(attrs.get("system", ""))


class RunStatus(IntEnum):
    """Status of a run.  All but ``OK``, ``EARLY_STOP`` and ``FILLED`` leave the response class unknown.

    Examples
    --------
    >>> import snapbeam as sb
    >>> sb.RunStatus(0).name
    'OK'
    """

    OK = 0
    EARLY_STOP = 1
    INTERRUPTED = 2
    DIVERGED = 3
    STEP_LIMIT = 4
    NOT_RUN = 5
    FILLED = 6
    ENERGY_ERROR = 7

    @property
    def advice(self) -> str:
        """Cause of the status, and the remedy."""
        return _ADVICE[self]


_ADVICE = {
    RunStatus.OK: "ran to its last cycle",
    RunStatus.EARLY_STOP: "ended early because its response class was certain; statistics stop at early_stop_time",
    RunStatus.INTERRUPTED: "not finished: the run was interrupted before its last cycle",
    RunStatus.DIVERGED: "the state left the finite numbers, or a local force the displacements that its law is valid for, "
    "as at pull-in or where the force of a softening spring falls to zero; use a smaller step, and check that the contact "
    "stiffness, the damping and the drive are meant in SI units",
    RunStatus.STEP_LIMIT: "used more steps than allowed, as happens when the contact is far stiffer than the "
    "default step expects; increase max_steps, or use a larger step or a softer contact",
    RunStatus.NOT_RUN: "never started: the task that held this point failed or was skipped",
    RunStatus.ENERGY_ERROR: "ended with more energy than the striker put in, so that its steps were too long for what "
    "the beam did; use accuracy = 'reference' or a smaller step",
    RunStatus.FILLED: "not run: the points around it in a refined map are all of this class",
}


def classify(
    zero_crossings: ArrayLike, zero_crossings_last_quarter: ArrayLike, cycles: ArrayLike, final_well: ArrayLike
) -> NDArray[np.int8]:
    """Class of a response by the rules of section 4.2 of the paper.

    The rules are those of :class:`ResponseClass`, with n = cycles/4.

    Parameters
    ----------
    zero_crossings, zero_crossings_last_quarter : array_like of int
    cycles : array_like
        Cycles of excitation of the run, 4 n.
    final_well : array_like
        +1 if the run ended in the well opposite to the one it started in, -1 if in the same.

    Returns
    -------
    int8 array of the broadcast shape, values of :class:`ResponseClass`

    Examples
    --------
    >>> import snapbeam as sb
    >>> codes = sb.classify([40, 2, 0], [10, 0, 0], [40, 40, 40], [1, 1, -1])
    >>> [sb.ResponseClass(code).label for code in codes]
    ['continuous interwell', 'transient interwell 2', 'intrawell']
    """
    given = {
        "zero_crossings": zero_crossings,
        "zero_crossings_last_quarter": zero_crossings_last_quarter,
        "cycles": cycles,
        "final_well": final_well,
    }
    arrays = [finite_array(name, value) for name, value in given.items()]
    try:
        total, last, duration, side = np.broadcast_arrays(*arrays)
    except ValueError:
        shapes = ", ".join(f"{name} {array.shape}" for name, array in zip(given, arrays, strict=True))
        raise InputError(f"shapes that do not go together: {shapes}") from None
    if (total % 1.0 != 0.0).any() or (last % 1.0 != 0.0).any():
        raise InputError("zero_crossings, zero_crossings_last_quarter: must be whole numbers")
    if (np.abs(side) != 1.0).any():
        raise InputError("final_well: must be +1 or -1")
    if (total < 0).any() or (last < 0).any() or (last > total).any():
        raise InputError("zero_crossings: must be at least zero_crossings_last_quarter, and both at least 0")
    if (duration <= 0).any():
        raise InputError(f"cycles = {duration.min()!r}: must be greater than 0")
    return class_of(total, last, duration, side)


def class_of(total: Any, last: Any, duration: Any, side: Any) -> NDArray[np.int8]:
    """Response class as :func:`classify`, from counts of the solver: unchecked, and undefined for a failed run."""
    result = np.where(side > 0, ResponseClass.TRANSIENT_2, ResponseClass.TRANSIENT_1)
    result = np.where(last * 20 > duration, ResponseClass.CONTINUOUS, result)
    result = np.where(total == 0, ResponseClass.INTRAWELL, result)
    return result.astype(np.int8)
