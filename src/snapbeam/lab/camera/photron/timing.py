"""When the frames of a Photron recording were taken: every field that says something, held against the others."""

from __future__ import annotations

import math
from dataclasses import dataclass

from snapbeam.core.findings import Diagnostic
from snapbeam.lab.camera.photron.fields import Fields
from snapbeam.lab.plausibility.recording import KINDS

__all__ = ["Timing", "read_timing"]


@dataclass(frozen=True)
class Timing:
    """The rates of a recording.

    ``record_rate`` [Hz] is the camera's, ``skip`` the step between saved frames as the header has it;
    ``frame_rate`` [Hz] that of the saved frames, None where it is missing or the header contradicts itself,
    and then ``question`` says what it says.  ``exposure`` [s] or None.
    """

    record_rate: float | None
    skip: int
    frame_rate: float | None
    question: str
    exposure: float | None
    diagnostics: tuple[Diagnostic, ...]


def read_timing(fields: Fields, frames: int) -> Timing:
    """The timing of a recording that holds *frames* frames.

    A step between saved frames must agree with how many were recorded and how many are left: every
    ``skip``-th of ``recorded`` frames makes recorded/skip.  The shutter is a time in seconds, or its
    reciprocal, as it stands in .cihx and in .cih files that were written from those; no exposure is longer
    than a frame.
    """
    rate = fields.positive("record_rate")
    skip = fields.integer("skip", 1, 2**40, default=1)
    recorded = fields.integer("recorded", 0, 2**50, default=0)
    question = ""
    frame_rate = None if rate is None else rate / skip
    if rate is not None and skip > 1 and recorded > 0 and abs(math.ceil(recorded / skip) - frames) > 1:
        question = (
            f"the header contradicts itself: every {skip}th of {recorded} recorded frames would be "
            f"{math.ceil(recorded / skip)} frames, but there are {frames}; frame_rate (--frame-rate) is "
            f"{rate:g} Hz if no frame was left out, {rate / skip:g} Hz if every {skip}th was kept"
        )
        if frames < recorded:
            step = recorded / frames
            question += f", {rate / step:g} Hz if these {frames} are spread over all {recorded}"
        frame_rate = None
    if rate == 1.0 and "Generated sequence" in fields.text("comment", ""):
        question = (
            "the file was made by a program that writes 1 frame per second where it is not told "
            "another rate; give frame_rate (--frame-rate) in Hz"
        )
        frame_rate = None
    exposure, diagnostics = _exposure(fields, rate)
    return Timing(rate, skip, frame_rate, question, exposure, diagnostics)


def _exposure(fields: Fields, rate: float | None) -> tuple[float | None, tuple[Diagnostic, ...]]:
    stated = fields.positive("shutter")
    longest = math.inf if rate is None else 1.01 / rate
    diagnostics: list[Diagnostic] = []
    exposure = stated if not fields.xml or stated is None else 1.0 / stated
    if exposure is not None and exposure > longest:
        other = 1.0 / exposure
        if other <= longest:
            diagnostics.append(KINDS["shutter"].found(stated=exposure, exposure_us=1e6 * other))
            exposure = other
        else:
            diagnostics.append(KINDS["no_exposure"].found(stated=exposure, frame_us=1e6 / (rate or math.nan)))
            exposure = None
    nsec = fields.number("shutter_nsec")
    if nsec is not None and nsec > 0.0 and 1e-9 * nsec <= longest:
        if exposure is not None and abs(1e-9 * nsec / exposure - 1.0) > 0.02:
            diagnostics.append(KINDS["two_exposures"].found(first_us=1e6 * exposure, second_us=1e-3 * nsec))
        exposure = 1e-9 * nsec
    return exposure, tuple(diagnostics)
