"""Mistakes in headers of cameras, in what is asked of a calibration, and in single frames."""

from __future__ import annotations

import numpy as np
from lab_waveforms import BUCKLING_LEVEL, FRAME_RATE, PIXEL, impacts

import snapbeam.lab as lab
from snapbeam import Beam, ReducedModel
from snapbeam.lab.tracking.settings import FrameFlag

from .case import Case, Outcome, off
from .headers import with_pixels

TIMES = "Time step of a Photron header"
ANTISYMMETRIC = "Calibration above b/r = 6.2"
JUMPS = "Jumps of the striker"


def rate_of(header, right=None, **opened):
    """The frame rate read from a header, against the right one."""

    def look(folder):
        with lab.open_recording(with_pixels(folder, header), pixel_size=PIXEL, **opened) as recording:
            if right is not None:
                assert recording.frame_rate == right, recording.frame_rate
            return Outcome(recording.diagnostics)

    return look


def reciprocal(folder):
    path = with_pixels(folder, "beam_2k.cih")
    with lab.open_recording(path, pixel_size=PIXEL) as recording:
        assert abs(recording.exposure * 119_149.0 - 1.0) < 1e-9
        return Outcome(recording.diagnostics)


def high_arch(**shapes):
    """A beam whose level is 7 radii of gyration, so that its first mode about a well is antisymmetric."""

    def look(folder):
        beam = Beam(
            length=0.161, thickness=0.4e-3, width=15e-3, density=7800.0, young_modulus=200e9,
            buckling_level=7.0 * 0.4e-3 / np.sqrt(12.0),
        )  # fmt: skip
        well = ReducedModel.from_beam(beam, 12).natural_frequencies[:2]
        straight = ReducedModel.from_beam(beam.replace(axial_load=0.0), 12).natural_frequencies[:2]
        measured = lab.Measurements(
            straight_frequencies=straight, straight_frequencies_se=1e-3 * straight, lower_well_frequencies=well[: shapes.pop("count", 2)],
            **shapes,
        )  # fmt: skip
        found = lab.calibrate(measured)
        error = found.standard_errors.get("buckling_level", np.inf)
        return Outcome(found.diagnostics, "", off(found.values["buckling_level"], beam.buckling_level, error))

    return look


def jumping(folder):
    """The beam hidden in single frames in which the striker is seen 40 px away."""
    time, beam, shaker, *_ = impacts(4)
    camera = lab.SyntheticCamera(frame_rate=FRAME_RATE, pixel_size=PIXEL, shape=(192, 96), lens="disk")
    stage = lab.SyntheticStage(shaker_width=0.8e-3)
    good = lab.render_recording(time, beam, shaker, camera=camera, stage=stage, rest_frames=24)
    moved = lab.render_recording(time, beam, shaker - 40.0 * PIXEL, camera=camera, stage=stage, rest_frames=24)
    wrong = (60, 130, 200)
    frames = [(moved if k in wrong else good).frame(k) for k in range(len(good))]
    path = lab.write_photron(
        folder / "jumps.cihx", np.stack(frames), bit_depth=12, frame_rate=FRAME_RATE, pixel_size=PIXEL
    )
    with lab.open_recording(path) as recording:
        tracked = lab.track(recording, rest_displacement=-BUCKLING_LEVEL)
    flags = tracked["flags"].values[list(wrong)]
    assert np.isnan(tracked["shaker_displacement_mm"].values[list(wrong)]).all()
    assert ((flags & FrameFlag.JUMP) != 0).all()
    miss = tracked["shaker_displacement_mm"].values
    ratio = off(miss, good.truth["shaker_displacement_mm"].values, tracked["shaker_stderr_mm"].values)
    return Outcome(tuple(lab.diagnostics_of(tracked)), "", ratio)


def half_the_exposure(folder):
    """The camera's times are the middles of its exposures, in the signal that is aligned too."""
    frequency, exposure = 98.0, 0.9 / FRAME_RATE
    record = lab.render_vibrometer(frequency, 0.03, duration=0.4, onset=0.05, start_up=0.01, snr_db=60.0)
    moved = lab.displacement_from_velocity(record)
    time = moved["time"].values
    shaker = -BUCKLING_LEVEL - 2e-4 + moved.values
    camera = lab.SyntheticCamera(
        frame_rate=FRAME_RATE, pixel_size=6e-6, shape=(160, 96), lens="disk", exposure=exposure, snr_db=40.0
    )
    stage = lab.SyntheticStage(shaker_width=0.2e-3, beam_thickness=0.1e-3, tip_radius=0.6e-3,
                               marker_distance=0.09e-3, marker_thickness=0.06e-3)  # fmt: skip
    beam = np.full(time.size, -BUCKLING_LEVEL) + 6e-5 * np.sin(2.0 * np.pi * 31.0 * time)
    drawn = lab.render_recording(time, beam, shaker, camera=camera, stage=stage)
    with lab.open_recording(drawn.write(folder / "a.cihx")) as recording:
        tracked = lab.track(recording, rest_displacement=-BUCKLING_LEVEL, rest_frames=5)
    found = lab.align(_seen(tracked), record, frequency)
    rest = drawn.truth.attrs["rest_frames"] / FRAME_RATE
    return Outcome(found.diagnostics, "", off(found.delay, rest, found.delay_se))


def _seen(tracked):
    from snapbeam.lab.vibrometer import shaker_signal

    return shaker_signal(tracked)


CASES = (
    Case(TIMES, "a header that says every 100th of 15,000 frames was saved, and that there are 75",
         rate_of("showcase.cih"), "refused", words="frame_rate",
         sees="frames saved, frames recorded and the step between them"),
    Case(TIMES, "the same, and the frame rate is given", rate_of("showcase.cih", 15_000.0, frame_rate=15_000.0),
         "right", "recording.contradiction"),
    Case(TIMES, "a header that says 4 frames, a skip of 2500 and 400 recorded", rate_of("contradiction.cihx"),
         "refused", words="frame_rate", sees="frames saved, frames recorded and the step between them"),
    Case(TIMES, "the same, and the frame rate is given", rate_of("contradiction.cihx", 5000.0, frame_rate=5000.0),
         "right", "recording.contradiction"),
    Case(TIMES, "a shutter of 119149.0, which is one over seconds", reciprocal, "right", "recording.shutter"),
    Case(ANTISYMMETRIC, "two frequencies about a well", high_arch(), "flagged", "calibration.antisymmetric"),
    Case(ANTISYMMETRIC, "one frequency about a well", high_arch(count=1), "flagged", "calibration.undetermined"),
    Case(ANTISYMMETRIC, "the same two, and their shapes are given (--lower-well 159a,165s)",
         high_arch(lower_well_shape=["antisymmetric", "symmetric"]), "right",
         sees="the shape says which mode of the model is meant"),
    Case(JUMPS, "a striker 40 px off in single frames", jumping, "right",
         sees="no motion leaves both neighbours for a frame", code="camera.jumps"),
    Case("Half the exposure", "camera and vibrometer aligned, with an exposure of 0.9 of a frame", half_the_exposure,
         "right", sees="a frame shows the middle of its exposure"),
)  # fmt: skip
