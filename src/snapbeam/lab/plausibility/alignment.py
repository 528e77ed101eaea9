"""Camera and vibrometer against each other: direction, amplitude, clocks."""

from __future__ import annotations

from snapbeam.core.findings import Severity
from snapbeam.lab.plausibility.kinds import Kind, table

__all__ = ["KINDS"]

NOTE, DOUBT, WRONG = Severity.INFO, Severity.WARNING, Severity.ERROR

KINDS = table(
    Kind(
        "alignment.polarity", NOTE,
        "the start of the motion in both records",
        "the vibrometer counts as negative what is positive for the camera; a drive made with this alignment is turned "
        "over (polarity, --polarity, says otherwise)",
        ("polarity",),
    ),
    Kind(
        "alignment.polarity_open", DOUBT,
        "the start of the motion in both records",
        "whether the vibrometer counts the camera's direction as positive cannot be told, for the start of the motion "
        "is not in both records, or fits both ways; give polarity (--polarity) 1 or -1",
        ("polarity",),
    ),
    Kind(
        "alignment.cycle_open", DOUBT,
        "the start of the motion in both records",
        "whole cycles of {period_ms:.5g} ms remain open: the start of the motion is not in both records, or does not "
        "tell them apart; give near (--near), a delay known to half a cycle",
        ("near",),
    ),
    Kind(
        "alignment.amplitude", DOUBT,
        "the amplitude seen by the camera, against the vibrometer's",
        "the camera sees {gain:.4f} +- {error:.4f} times the vibrometer's amplitude: pixel_size (--pixel-size), "
        "sensitivity (--sensitivity) or the plane of focus is wrong; amplitude_from (--amplitude-from) camera takes "
        "the camera's",
        ("pixel_size", "sensitivity", "amplitude_from"),
    ),
    Kind(
        "alignment.clocks", NOTE,
        "the frequency of the same motion on both clocks",
        "the clocks differ by {difference:.1e}",
    ),
)  # fmt: skip
