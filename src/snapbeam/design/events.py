"""What a run may come to, read from its class: outcomes that have a probability."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from snapbeam.core.codes import ResponseClass, RunStatus
from snapbeam.core.validate import InputError
from snapbeam.engines.each import rows_for
from snapbeam.engines.outcomes import STATISTICS
from snapbeam.model.system import System

__all__ = ["OUTCOMES", "Event", "reached", "require_held"]

Statistics = dict[str, NDArray[Any]]
_REACHED = (int(RunStatus.OK), int(RunStatus.EARLY_STOP))
_FIRST = (ResponseClass.INTRAWELL, ResponseClass.TRANSIENT_1)


class Event(NamedTuple):
    """Something that a run does or does not."""

    words: str
    happened: Callable[[Statistics], NDArray[np.bool_]]


OUTCOMES: dict[str, Event] = {
    "snap": Event("the beam snaps through at least once", lambda found: found["response_class"] > 0),
    "continuous": Event(
        "the beam snaps on at the end", lambda found: found["response_class"] == ResponseClass.CONTINUOUS
    ),
    "first_well": Event(
        "the beam ends about the well it began in", lambda found: np.isin(found["response_class"], _FIRST)
    ),
    "other_well": Event(
        "the beam ends about the other well",
        lambda found: found["response_class"] == ResponseClass.TRANSIENT_2,
    ),
}
"""Outcomes that every probability map has.  The last three exclude each other and one of them happens."""


def reached(found: Statistics) -> NDArray[np.bool_]:
    """Whether runs came to an end that says their class."""
    return np.isin(found["status"], _REACHED)


def require_held(names: Iterable[str], system: System) -> None:
    """Refuse statistics that runs of a system do not have: those of one of several strikers, if it is not there.

    Raises
    ------
    InputError
    """
    strikers = 0 if system.striker is None else 1 + len(system.further_contacts)
    held = rows_for(strikers)
    for name in names:
        if name in STATISTICS and name not in held:
            raise InputError(
                f"{name}: the system has {strikers} striker{'s' * (strikers != 1)}; each has its own "
                "statistics where there are several"
            )
