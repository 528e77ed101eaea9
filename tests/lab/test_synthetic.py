"""The synthetic camera: what it draws is what it says it draws."""

import math

import numpy as np
import pytest
from lab_waveforms import PIXEL, impacts

from snapbeam import InputError
from snapbeam.lab.camera import open_recording
from snapbeam.lab.synthetic import SyntheticCamera, SyntheticStage, render_recording, render_vibrometer

STILL = (np.array([0.0, 0.01]), np.zeros(2), np.full(2, -0.2e-3))
CAMERA = SyntheticCamera(frame_rate=5000.0, pixel_size=PIXEL, shape=(120, 48))


def column_light(picture, level_out, level_in):
    """Rows covered by the object, from the light of a column: area is kept whatever the blur."""
    return ((picture - level_out) / (level_in - level_out)).sum(axis=0)


def test_areas_are_kept_by_blur_pixels_and_exposure():
    stage = SyntheticStage(shaker_width=1e-6, marker_thickness=0.0)
    for blur in (0.3, 0.8, 3.0):
        camera = SyntheticCamera(
            frame_rate=5000.0, pixel_size=PIXEL, shape=(120, 48), snr_db=math.inf, blur=blur, bit_depth=16
        )
        picture = render_recording(*STILL, camera=camera, stage=stage).frame(0) / 65535
        covered = column_light(picture, stage.background, stage.beam)
        np.testing.assert_allclose(covered[:10], 0.4e-3 / PIXEL, atol=0.01)


def test_the_truth_is_the_mean_over_the_exposure():
    time = np.linspace(0.0, 0.02, 4001)
    beam = 0.2e-3 * np.sin(2.0 * np.pi * 90.0 * time)
    recording = render_recording(time, beam, beam - 0.1e-3, camera=CAMERA, rest_frames=3)
    truth = recording.truth
    assert len(recording) == 3 + 100
    exposure, frame = CAMERA.exposure, 1.0 / CAMERA.frame_rate
    start = (np.arange(len(recording)) - 3) * frame
    omega = 2.0 * np.pi * 90.0
    exact = 0.2 * (np.cos(omega * start) - np.cos(omega * (start + exposure))) / (omega * exposure)
    np.testing.assert_allclose(truth["displacement_mm"].values[3:], exact[3:], atol=2e-7)
    np.testing.assert_array_equal(truth["displacement_mm"].values[:3], 0.0)
    np.testing.assert_allclose(truth["penetration_mm"].values, -0.1, atol=1e-9)
    stage = SyntheticStage(marker_thickness=0.0, shaker_width=1e-6)
    camera = SyntheticCamera(frame_rate=5000.0, pixel_size=PIXEL, shape=(120, 48), snr_db=math.inf, bit_depth=16)
    moving = render_recording(time, beam, beam - 0.1e-3, camera=camera, stage=stage, rest_frames=3).frame(3)
    picture = column_light(moving / 65535, stage.background, stage.beam)
    np.testing.assert_allclose(picture[:3], 0.4e-3 / PIXEL, atol=0.01)


def test_noise_has_the_promised_strength_and_seed():
    stage = SyntheticStage()
    first = render_recording(*STILL, camera=CAMERA, stage=stage, rng=4)
    background = first.frame(2)[:15].astype(float)
    noise = background.std()
    assert 20.0 * np.log10((stage.beam - stage.background) * 4095 / noise) == pytest.approx(30.0, abs=0.3)
    np.testing.assert_array_equal(first.frame(2), render_recording(*STILL, camera=CAMERA, rng=4).frame(2))
    assert (first.frame(2) != render_recording(*STILL, camera=CAMERA, rng=5).frame(2)).mean() > 0.9
    assert (first.frame(2) != first.frame(3)).mean() > 0.9


@pytest.mark.parametrize("side", ["above", "left", "right"])
def test_a_shaker_on_another_side_sees_the_turned_picture(side):
    time, beam, shaker, *_ = impacts(2)
    quiet = {"frame_rate": 5000.0, "pixel_size": PIXEL, "snr_db": math.inf}
    upright = render_recording(time, beam, shaker, camera=SyntheticCamera(shape=(120, 48), **quiet)).frame(40)
    shape = (120, 48) if side == "above" else (48, 120)
    sign = 1.0 if side == "left" else -1.0
    stage = SyntheticStage(side=side)
    turned = render_recording(
        time, sign * beam, sign * shaker, camera=SyntheticCamera(shape=shape, **quiet), stage=stage
    )
    expected = {"above": upright[::-1], "left": upright[::-1].T, "right": upright.T}[side]
    np.testing.assert_array_equal(turned.frame(40), expected)


@pytest.mark.slow
def test_files_of_every_kind_hold_the_same_frames(tmp_path):
    recording = render_recording(*STILL, camera=CAMERA, rest_frames=0)
    for name in ("a.cihx", "b.cih", "c.avi"):
        path = recording.write(tmp_path / name)
        with open_recording(path, frame_rate=5000.0, pixel_size=PIXEL) as read:
            got = np.stack(list(read)).astype(float)
            expected = np.stack(list(recording)).astype(float)
            np.testing.assert_allclose(got, expected * (255 / 4095 if name == "c.avi" else 1), atol=0.501)
            if name != "c.avi":
                assert read.exposure == pytest.approx(CAMERA.exposure)


def test_spoiled_frames_are_spoiled_and_marked():
    options = {"glare_frames": [2], "blurred_frames": [3], "repeated_frames": [4], "blank_frames": [5]}
    spoiled = render_recording(*STILL, camera=CAMERA, **options)
    whole = render_recording(*STILL, camera=CAMERA)
    assert spoiled.truth["disturbed"].values[:7].tolist() == [0, 0, 1, 1, 1, 1, 0]
    assert (spoiled.frame(2) == 4095).mean() > 0.05
    assert (
        np.abs(np.diff(spoiled.frame(3)[:, :8].mean(1))).max()
        < 0.5 * np.abs(np.diff(whole.frame(3)[:, :8].mean(1))).max()
    )
    np.testing.assert_array_equal(spoiled.frame(4), spoiled.frame(3))
    assert spoiled.frame(5).max() == 0
    np.testing.assert_array_equal(spoiled.frame(6), whole.frame(6))


@pytest.mark.parametrize(
    ("call", "name"),
    [
        (lambda: SyntheticCamera(frame_rate=0.0), "frame_rate"),
        (lambda: SyntheticCamera(exposure=1.0), "exposure"),
        (lambda: SyntheticCamera(bit_depth=20), "bit_depth"),
        (lambda: SyntheticCamera(snr_db=float("nan")), "snr_db"),
        (lambda: SyntheticCamera(shape=(0, 64)), "shape"),
        (lambda: SyntheticStage(beam=0.12), "beam"),
        (lambda: SyntheticStage(side="front"), "side"),
        (lambda: render_recording([0.0, 1.0], [0.0], [0.0, 0.0]), "beam_displacement"),
        (lambda: render_recording([0.0, 0.0], [0.0, 0.0], [0.0, 0.0]), "time"),
        (lambda: render_recording([0.0, 1e-9], [0.0, 0.0], [0.0, 0.0]), "exposure"),
        (lambda: render_recording([0.0, 1.0], [0.0, float("nan")], [0.0, 0.0]), "beam_displacement"),
        (lambda: render_recording([0.0, 1.0], [0.0, 9e-3], [0.0, 0.0]), "shape"),
        (lambda: render_recording(*STILL, camera=CAMERA, glare_frames=[999]), "glare_frames"),
        (lambda: render_recording(*STILL, camera=CAMERA).frame(999), "index"),
        (lambda: render_vibrometer(100.0, 0.1, duration=1.0, sampling_frequency=300.0), "sampling_frequency"),
        (lambda: render_vibrometer(100.0, 0.1, duration=1.0, onset=2.0), "onset"),
    ],
)
def test_impossible_requests_are_refused_by_name(call, name):
    with pytest.raises(InputError, match=name):
        call()


def test_vibrometer_signal_has_the_promised_sine_noise_and_start():
    signal = render_vibrometer(80.0, 0.05, duration=2.0, onset=0.2, start_up=0.05, snr_db=20.0, distortion=0.02, rng=1)
    time, velocity = signal["time"].values, signal.values
    assert signal.attrs["units"] == "m/s"
    quiet = velocity[time < 0.2]
    assert quiet.std() == pytest.approx(0.05 / np.sqrt(2.0) / 10.0, rel=0.05)
    late = time > 1.0
    angle = 2.0 * np.pi * 80.0 * (time[late] - 0.2)
    design = np.stack([np.cos(angle), np.sin(angle), np.cos(2 * angle)], axis=1)
    fitted = np.linalg.lstsq(design, velocity[late], rcond=None)[0]
    np.testing.assert_allclose(fitted, [0.05, 0.0, 0.001], atol=2e-4)
    assert np.abs(velocity[(time > 0.2) & (time < 0.21)]).max() < 0.8 * 0.05
