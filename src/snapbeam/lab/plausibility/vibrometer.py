"""A vibrometer's record against itself and against what was set."""

from __future__ import annotations

from snapbeam.core.findings import Severity
from snapbeam.lab.plausibility.kinds import Kind, table

__all__ = ["KINDS"]

NOTE, DOUBT, WRONG = Severity.INFO, Severity.WARNING, Severity.ERROR

KINDS = table(
    Kind(
        "vibrometer.noisy", DOUBT,
        "the sine against noise and distortion together",
        "sine to noise and distortion {sinad_db:.1f} dB, not above {limit_db:g} dB: noise",
    ),
    Kind(
        "vibrometer.distorted", DOUBT,
        "the sine against noise and distortion together",
        "sine to noise and distortion {sinad_db:.1f} dB, not above {limit_db:g} dB: distortion",
    ),
    Kind(
        "vibrometer.dropout", DOUBT,
        "stretches in which the record leaves its steady sine by far more than its noise",
        "{count:.0f} dropout(s) or spike(s), {total_ms:.3g} ms together, the first at {at:.6g} s: left out of the "
        "fit, and bridged by the steady motion in displacement and drive",
    ),
    Kind(
        "vibrometer.dropout_in_start", WRONG,
        "values that stand still, or jump, while the shaker starts",
        "a dropout of {total_ms:.3g} ms in the start-up at {at:.6g} s: what the shaker did there is not known, so no "
        "drive can be made of this record",
    ),
    Kind(
        "vibrometer.clipped", DOUBT,
        "tops of the mean cycle flatter than a sine's, or levels hit exactly again and again",
        "the tops are cut off over {share_percent:.0f} % of the cycle: the amplitude is taken from the rest of it, "
        "with a wider standard error; choose a larger range on the vibrometer",
    ),
    Kind(
        "vibrometer.unsteady", DOUBT,
        "amplitude and phase cycle by cycle after the start-up",
        "the motion does not stay steady (cycles stray by {stray_percent:.1f} %): the standard error of the amplitude "
        "is that of its parts",
    ),
    Kind(
        "vibrometer.hum", NOTE,
        "lines that are in the rest before the start as they are in the motion",
        "a line of {frequency:.3f} Hz with {share_percent:.1f} % of the amplitude is there at rest too (mains); taken "
        "out",
    ),
    Kind(
        "vibrometer.second_line", DOUBT,
        "lines beside the drive and its harmonics that are not in the rest before the start",
        "beside the drive there is a line of {frequency:.4g} Hz with {share_percent:.1f} % of its amplitude: the "
        "shaker moves at two frequencies, or the record holds hum and no rest to tell it by; what it may pull is in "
        "the standard errors",
    ),
    Kind(
        "vibrometer.interrupted", WRONG,
        "motion at the same frequency before or after the longest stretch of it",
        "the motion stops and begins again: {outside_ms:.3g} ms of it lie outside the longest stretch, and are not in "
        "its start-up or its displacement; cut the record, or record again",
    ),
    Kind(
        "vibrometer.frequency", DOUBT,
        "the frequency found, against the one set",
        "the shaker moves at {found:.6g} Hz, not at the frequency (--frequency) of {stated:g} Hz that was set",
        ("frequency",),
    ),
    Kind(
        "vibrometer.amplitude", DOUBT,
        "the amplitude found, against the one set",
        "the amplitude is {found:.5g}, {share_percent:+.1f} % off the amplitude (--amplitude) of {stated:.5g} that was "
        "set: check range and sensitivity (--sensitivity)",
        ("amplitude", "sensitivity"),
    ),
    Kind(
        "vibrometer.slow_start", NOTE,
        "how well the start of the motion is told",
        "the shaker starts so gently that its start is known to {uncertainty_ms:.2g} ms only",
    ),
    Kind(
        "vibrometer.no_rest", NOTE,
        "rest before the motion",
        "the record begins in motion: its start-up is not in it",
    ),
)  # fmt: skip
