"""A picture that moves with its background, a frame rate that changes, a lamp that pulses: each is told, good ones are not."""

import dataclasses

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter, shift

from snapbeam.lab import SyntheticCamera, SyntheticStage, open_recording, render_recording, track
from snapbeam.lab.camera import write_photron
from snapbeam.lab.tracking.drive_clock import drive_clock
from snapbeam.util.diagnostics import diagnostics_of

CAMERA = SyntheticCamera(frame_rate=5e3, pixel_size=2e-5, shape=(180, 80), snr_db=32.0)
STAGE = SyntheticStage(shaker_width=0.6e-3)


def scene(path, *, camera=CAMERA, exposure=CAMERA.exposure, late=0.0, share=0.0, texture=0.03):
    """A tracked scene, its background textured, the picture moved by *share* of the beam's motion; and the true motion."""
    time = np.arange(9000) / 2e5
    since = np.maximum(time - 24 / CAMERA.frame_rate, 0.0)  # late light shows the rest where it is, too
    tip = -0.335e-3 + 1.2e-4 * np.sin(2.0 * np.pi * 120.0 * since)
    beam = tip + 6e-4 * np.clip(np.sin(2.0 * np.pi * 90.0 * since), 0.0, 1.0)
    truth = render_recording(
        time, beam, tip, camera=dataclasses.replace(CAMERA, exposure=exposure), stage=STAGE, rest_frames=0
    )
    seen = [np.interp(time + late, time, one) for one in (beam, tip)]
    shown = render_recording(
        time, *seen, camera=camera, stage=STAGE, rest_frames=0, zero_row=truth.truth.attrs["zero_row"]
    )
    frames = np.stack(list(shown)).astype(np.float64)
    grain = gaussian_filter(np.random.default_rng(3).standard_normal(frames.shape[1:]), 1.5)
    behind = np.clip(1.0 - np.abs(frames / 4095.0 - STAGE.background) / 0.3, 0.0, 1.0)
    frames += behind * grain * (texture * 4095.0 / grain.std())
    moved = -(truth.truth["displacement_mm"].values - truth.truth["displacement_mm"].values[0]) / 0.02
    if share:
        frames = np.stack(
            [shift(one, (-share * by, 0.0), order=1, mode="nearest") for one, by in zip(frames, moved, strict=False)]
        )
    frames = list(np.clip(np.rint(frames), 0, 4095).astype(np.uint16))
    write_photron(path, frames, frame_rate=5e3, pixel_size=2e-5, exposure=exposure, bit_depth=12)
    with open_recording(path) as recording:
        tracked = track(recording, rest_displacement=-0.335e-3)
    miss = tracked["displacement_mm"].values - truth.truth["displacement_mm"].values[: tracked.sizes["time"]]
    return tracked, (miss / tracked["displacement_stderr_mm"].values)[:-2]


def codes(tracked):
    return {one.code for one in diagnostics_of(tracked)}


@pytest.mark.slow
def test_a_stabiliser_is_told_by_its_background(tmp_path):
    good, _ = scene(tmp_path / "good.cihx")
    tracked, ratio = scene(tmp_path / "moved.cihx", share=0.28)
    assert "camera.background_moves" in codes(tracked) - codes(good)
    assert np.nanmax(np.abs(ratio)) < 5.0


@pytest.mark.slow
def test_a_lamp_that_pulses_is_told_by_edges_that_are_too_sharp(tmp_path):
    """The light of the last tenth of an exposure of 0.9 frames."""
    pulsed = dataclasses.replace(CAMERA, exposure=0.09 / 5e3)
    tracked, ratio = scene(tmp_path / "pulse.cihx", camera=pulsed, exposure=0.9 / 5e3, late=0.81 / 5e3, texture=0.0)
    assert "camera.pulse" in codes(tracked)
    assert np.nanmax(np.abs(ratio)) < 5.0


@pytest.mark.parametrize("halved", ["after", "before"])
def test_a_frame_rate_that_is_halved_is_told_by_the_drive(halved):
    told = []
    for k in range(20):
        rng = np.random.default_rng((11, k))
        frequency, at = rng.uniform(0.018, 0.05), int(rng.integers(200, 400))
        frames = np.arange(600.0)
        rows = 60.0 + 5.0 * np.sin(2.0 * np.pi * frequency * np.maximum(frames - 40.0, 0.0) + 0.7)
        rows += 0.03 * rng.standard_normal(600)
        assert "rate_changes" not in {name for name, _ in drive_clock(rows)}
        kept = np.r_[0:at, at:600:2] if halved == "after" else np.r_[0:at:2, at:600]
        ((name, numbers),) = drive_clock(rows[kept]) or [("", {})]
        first = at if halved == "after" else len(range(0, at, 2))
        told.append(name == "rate_changes" and abs(numbers["first"] - first) < 20)
    assert sum(told) >= 18
