"""A recording's file against itself: times that contradict each other, pictures that were not kept as taken."""

from __future__ import annotations

from snapbeam.core.findings import Severity
from snapbeam.lab.plausibility.kinds import Kind, table

__all__ = ["KINDS", "LOSSY_ERROR"]

NOTE, DOUBT = Severity.INFO, Severity.WARNING

LOSSY_ERROR = 0.15
"""Standard error [px] of an edge in a video that throws detail away; measured 0.06 to 0.14 px."""

KINDS = table(
    Kind(
        "recording.rate_dependent", DOUBT,
        "the compression of a video or of images",
        "the file's compression throws detail away: edges lie 0.06 to 0.14 px off however little they scatter; "
        "standard errors are raised to {error_px:.2f} px; save the recording uncompressed",
    ),
    Kind(
        "recording.rate_given", NOTE,
        "the frame rate that was given, against the header's",
        "frame_rate (--frame-rate) = {given:g} Hz is taken, the file says {stated:g} Hz",
        ("frame_rate",),
    ),
    Kind(
        "recording.contradiction", NOTE,
        "frames saved, frames recorded and the step between them, against each other",
        "the header contradicts itself about the step between frames; frame_rate (--frame-rate) = {given:g} Hz is "
        "taken as given",
        ("frame_rate",),
    ),
    Kind(
        "recording.shutter", NOTE,
        "the exposure against the time between frames",
        "a shutter of {stated:g} s cannot be: read as its reciprocal, {exposure_us:.4g} us",
    ),
    Kind(
        "recording.no_exposure", NOTE,
        "the exposure against the time between frames",
        "a shutter of {stated:g} s cannot be within a frame of {frame_us:.4g} us: the exposure is not known",
    ),
    Kind(
        "recording.two_exposures", NOTE,
        "two fields of the exposure, against each other",
        "the header gives exposures of {first_us:.4g} and {second_us:.4g} us; the second is taken",
    ),
    Kind(
        "recording.curve", DOUBT,
        "the camera's curve and edge enhancement in the header",
        "the camera's settings bend edges (curve of gamma {gamma:g}, edge enhancement {enhance:g}): switch both "
        "off, or undo the curve with gamma (--gamma)",
        ("gamma",),
    ),
    Kind(
        "recording.colour", NOTE,
        "pictures in colour",
        "pictures in {channels:.0f} colours are turned to grey",
    ),
    Kind(
        "recording.mosaic", DOUBT,
        "grey levels of every other pixel, against their neighbours",
        "pixels lie under a mosaic of colour filters (levels {spread_percent:.0f} % apart): each kind is "
        "brought to the same mean, which is right for grey things in white light only",
    ),
)  # fmt: skip
