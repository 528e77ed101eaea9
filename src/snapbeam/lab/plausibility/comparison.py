"""A measured run beside a simulated one: do the two shakers do the same."""

from __future__ import annotations

from snapbeam.core.findings import Severity
from snapbeam.lab.plausibility.kinds import Kind, table

__all__ = ["KINDS"]

NOTE, DOUBT, WRONG = Severity.INFO, Severity.WARNING, Severity.ERROR

KINDS = table(
    Kind(
        "comparison.turned_over", WRONG,
        "the motion of both shakers from the start on, with either sign",
        "the simulated shaker moves down where the measured one moves up (correlation {correlation:.2f} from the start "
        "on): the drive was recorded by a vibrometer that is upside down against the camera; make it again with "
        "camera (--camera) or polarity (--polarity) -1",
        ("camera", "polarity"),
    ),
    Kind(
        "comparison.shifted", DOUBT,
        "the phase of both shakers, where the start of the excitation is known",
        "the shakers are {shift:+.2f} cycles apart counted from the start of each: start (--start) is wrong, or the "
        "drive is of another test; the measured clock was shifted by as much",
        ("start",),
    ),
    Kind(
        "comparison.no_start", NOTE,
        "whether the start of the excitation was given, or seen in the shaker",
        "without start (--start), and with a shaker that moves from the first sample on, it is not known which cycle "
        "is the first: the runs are aligned within a cycle only",
        ("start",),
    ),
    Kind(
        "comparison.amplitude", DOUBT,
        "the amplitude of both shakers",
        "the measured shaker moves {ratio:.3f} times as far as the simulated one: another test, or another scale",
    ),
    Kind(
        "comparison.gaps", NOTE,
        "share of the cycles that were measured",
        "{share_percent:.0f} % of the compared cycles were not measured",
    ),
)  # fmt: skip
