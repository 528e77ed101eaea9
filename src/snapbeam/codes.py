"""Integer labels that kernels, maps and files share, and what they mean in words."""

from __future__ import annotations

from enum import IntEnum

__all__ = ["ResponseClass", "RunStatus"]


class ResponseClass(IntEnum):
    """The kind of response of one run (section 4.2 of the paper).

    Decided from the zero crossings of the displacement at the centre of the beam: none is intrawell;
    more than n/5 in the last quarter (n cycles) is continuous interwell; anything else is transient,
    1 if it ends about the well it started in and 2 if about the other.
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

    @property
    def is_interwell(self) -> bool:
        """Whether the beam snapped through at least once."""
        return self in (ResponseClass.TRANSIENT_1, ResponseClass.TRANSIENT_2, ResponseClass.CONTINUOUS)


_LABELS = {
    ResponseClass.UNKNOWN: "unknown",
    ResponseClass.INTRAWELL: "intrawell",
    ResponseClass.TRANSIENT_1: "transient interwell 1",
    ResponseClass.TRANSIENT_2: "transient interwell 2",
    ResponseClass.CONTINUOUS: "continuous interwell",
}


class RunStatus(IntEnum):
    """How a run ended.  All but ``OK``, ``DECIDED`` and ``INFERRED`` leave the response class unknown."""

    OK = 0
    DECIDED = 1
    RUNNING = 2
    NOT_FINITE = 3
    STEP_LIMIT = 4
    NOT_RUN = 5
    INFERRED = 6

    @property
    def advice(self) -> str:
        """What happened and what to do about it."""
        return _ADVICE[self]


_ADVICE = {
    RunStatus.OK: "ran to its last cycle",
    RunStatus.DECIDED: "ended early because its response class was certain; statistics stop at decided_at",
    RunStatus.RUNNING: "not finished: the run was interrupted before its last cycle",
    RunStatus.NOT_FINITE: "the state left the finite numbers; use a smaller step, and check that the "
    "contact stiffness, the damping and the drive are meant in SI units",
    RunStatus.STEP_LIMIT: "used more steps than allowed, as happens when the contact is far stiffer than the "
    "default step expects; use a larger step or a softer contact",
    RunStatus.NOT_RUN: "never started: the task that held this point failed or was skipped",
    RunStatus.INFERRED: "not run: the points around it in a refined map are all of this class",
}
