"""Marks that stand still tell how the camera drifts and how large a pixel is."""

import cv2
import numpy as np
import pytest
from lab_waveforms import BUCKLING_LEVEL, FRAME_RATE, PIXEL, impacts

import snapbeam.lab as lab
from snapbeam import InputError
from snapbeam.lab.camera import profile_shift
from snapbeam.lab.synthetic import Fixture

ROWS = np.arange(40.0)


def line(at):
    """A bright line over rows, as a lens blurs it."""
    return 200.0 + 1500.0 * np.exp(-0.5 * ((ROWS - at) / 1.6) ** 2)


def test_shifts_are_within_their_errors():
    rng = np.random.default_rng(0)
    true = rng.uniform(-6.0, 6.0, 400)
    gain, level = rng.uniform(0.8, 1.2, 400), rng.uniform(-50.0, 50.0, 400)
    profiles = gain[:, None] * np.array([line(19.7 + shift) for shift in true]) + level[:, None]
    profiles += 8.0 * rng.standard_normal(profiles.shape)
    found, error = profile_shift(profiles, line(19.7))
    ratio = (found - true) / error
    assert 0.6 < ratio.std() < 1.15  # a part of the error is that of pixels, of which this line has none
    assert abs(ratio.mean()) < 0.2
    assert np.median(error) < 0.02


@pytest.mark.parametrize(
    ("rows", "words"), [(10, "of 10 rows: must be at least 11"), (30, "shows nothing that could be followed")]
)
def test_a_mark_that_shows_no_shift_is_refused(rows, words):
    with pytest.raises(InputError, match=rf"fixed mark \(--fixed-mark\).*{words}"):
        profile_shift(np.ones((3, rows)), np.ones(rows))


def drawn(folder, drift):
    time, beam, shaker, *_ = impacts(4)
    camera = lab.SyntheticCamera(frame_rate=FRAME_RATE, pixel_size=PIXEL, shape=(192, 96), lens="disk", snr_db=40.0)
    scene = lab.render_recording(
        time, beam, shaker, camera=camera, stage=lab.SyntheticStage(shaker_width=0.8e-3),
        defects=lab.Defects(drift=drift, fixture=Fixture(18.0, 6.0, 0.8)), rest_frames=24,
    )  # fmt: skip
    return scene, scene.write(folder / "scene.cihx")


@pytest.mark.slow
def test_the_drift_of_the_camera_is_taken_out(tmp_path):
    scene, path = drawn(tmp_path, 3.0)
    truth = scene.truth["displacement_mm"].values
    misses = {}
    for name, marks in (("with", ((2, 36, 0, 20),)), ("without", ())):
        with lab.open_recording(path) as recording:
            found = lab.track(recording, rest_displacement=-BUCKLING_LEVEL, fixed_marks=marks)
        misses[name] = found["displacement_mm"].values - truth
        if marks:
            codes = {diagnostic.code: diagnostic for diagnostic in lab.diagnostics_of(found)}
            assert codes["camera.drift"].numbers["drift_px"] == pytest.approx(3.0, abs=0.1)
            assert np.nanmax(np.abs(misses[name]) / found["displacement_stderr_mm"].values) < 5.0
    assert np.nanmax(np.abs(misses["without"])) > 2.0 * PIXEL * 1e3
    assert np.nanmax(np.abs(misses["with"])) < 0.15 * PIXEL * 1e3


def spots(folder, first, second, scale=16):
    """Frames with two round spots, drawn sixteen times finer than the pixels."""
    fine = np.full((120 * scale, 100 * scale), 20.0)
    for row, column in (first, second):
        centre = (round((column + 0.5) * scale), round((row + 0.5) * scale))
        cv2.circle(fine, centre, round(2.7 * scale), 180.0, -1)
    frame = fine.reshape(120, scale, 100, scale).mean((1, 3))
    frame = frame + np.random.default_rng(0).standard_normal((3, *frame.shape))
    np.save(folder / "spots.npy", frame.astype(np.uint8))
    return folder / "spots.npy"


def test_the_size_of_a_pixel_from_two_marks(tmp_path):
    first, second = (20.25, 18.5), (98.75, 71.0)
    path = spots(tmp_path, first, second)
    true = 0.010 / np.hypot(second[0] - first[0], second[1] - first[1])
    with lab.open_recording(path, frame_rate=1000.0, pixel_size=1e-5) as recording:
        size, error = lab.pixel_size_from_marks(recording, (22, 17), (97, 73), 0.010)
        assert abs(size - true) < 3.0 * error
        assert error < 2e-3 * size
        with pytest.raises(InputError, match=r"first mark.*nothing stands out"):
            lab.pixel_size_from_marks(recording, (60, 20), (97, 73), 0.010)
        with pytest.raises(InputError, match="must be at least 24"):
            lab.pixel_size_from_marks(recording, (22, 17), (20, 19), 0.010)
        with pytest.raises(InputError, match=r"second mark.*inside the region"):
            lab.pixel_size_from_marks(recording, (22, 17), (119, 73), 0.010)
