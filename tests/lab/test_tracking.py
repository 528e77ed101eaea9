"""Tracking of rendered recordings whose truth is known, to the accuracy that is promised."""

import time as clock

import numpy as np
import pytest
from lab_waveforms import BUCKLING_LEVEL, FRAME_RATE, PIXEL, errors_px, impacts, rms

from snapbeam import InputError
from snapbeam.lab.camera import open_recording
from snapbeam.lab.synthetic import SyntheticCamera, SyntheticStage, render_recording
from snapbeam.lab.tracking.settings import FrameFlag
from snapbeam.lab.tracking.track import contact_onsets, track, tracking_quality, tracking_report
from snapbeam.simulation.dataset import check_trajectory
from snapbeam.util.diagnostics import diagnostics_of, doubtful

STICKER = {"shaker_width": 0.8e-3}
PLAIN_TIP = {"shaker_width": 1.0e-3, "tip_radius": 0.6e-3, "marker_thickness": 0.0}


def rendered(motion=None, *, snr=30.0, stage=STICKER, shape=(160, 64), seed=0, light=(0.15, 0.1), **options):
    options.setdefault("rest_frames", 20)
    time, beam, shaker, *_ = impacts(5) if motion is None else motion
    camera = SyntheticCamera(frame_rate=FRAME_RATE, pixel_size=PIXEL, shape=shape, snr_db=snr, light=light)
    return render_recording(time, beam, shaker, camera=camera, stage=SyntheticStage(**stage), rng=seed, **options)


def followed(recording, folder, name="a.cihx", **options):
    path = recording.write(folder / name)
    options.setdefault("rest_displacement", 1e-3 * float(recording.truth["displacement_mm"][0]))
    with open_recording(path, frame_rate=FRAME_RATE, pixel_size=PIXEL) as read:
        return track(read, buckling_level=BUCKLING_LEVEL, **options)


@pytest.mark.sampled(2)
@pytest.mark.parametrize(("seed", "name"), [(0, "a.cihx"), pytest.param(1, "b.cih", marks=pytest.mark.slow)])
@pytest.mark.parametrize("stage", [STICKER, PLAIN_TIP], ids=["sticker", "tip"])
@pytest.mark.parametrize(
    ("snr", "error", "bias"), [pytest.param(30.0, 0.1, 0.05, marks=pytest.mark.slow), (15.0, 0.3, None)]
)
def test_displacements_within_the_promised_error(tmp_path, name, snr, error, bias, stage, seed):
    recording = rendered(snr=snr, stage=stage, seed=seed)
    tracked = followed(recording, tmp_path, name)
    assert (tracked["flags"] != 0).mean() <= 0.01
    for variable in ("displacement_mm", "shaker_displacement_mm"):
        miss = errors_px(tracked, recording.truth, variable)
        assert rms(miss) <= error
        assert bias is None or abs(np.nanmean(miss)) <= bias
    beam = errors_px(tracked, recording.truth, "displacement_mm")
    slow = np.abs(np.gradient(tracked["beam_row"])) < 0.03  # where the instant, left open by lamps, does not matter
    stated = np.nanmedian(tracked["displacement_stderr_mm"][slow]) / (PIXEL * 1e3)
    assert stated == pytest.approx(np.nanstd(beam), rel=0.25)


@pytest.mark.slow
def test_a_sticker_that_is_not_looked_for_does_not_mislead(tmp_path):
    recording = rendered(stage=PLAIN_TIP | {"marker_thickness": 0.25e-3})
    tracked = followed(recording, tmp_path, marker=False)
    assert tracked.attrs["shaker_mark"] == "tip"
    assert rms(errors_px(tracked, recording.truth, "shaker_displacement_mm")) < 0.1
    assert (tracked["flags"] != 0).mean() < 0.01


@pytest.mark.slow
@pytest.mark.parametrize(
    "side", [pytest.param("above", marks=pytest.mark.slow), "left", pytest.param("right", marks=pytest.mark.slow)]
)
def test_every_side_and_dark_objects_before_bright_light(tmp_path, side):
    time, beam, shaker, *_ = impacts(3)
    sign = 1.0 if side == "left" else -1.0
    dark = {"background": 0.8, "beam": 0.15, "shaker": 0.2, "marker": 0.6, "slope": 0.03}
    recording = rendered(
        (time, sign * beam, sign * shaker),
        shape=(160, 64) if side == "above" else (64, 160),
        stage=STICKER | dark | {"side": side},
    )
    tracked = followed(recording, tmp_path, side=side)
    assert tracked.attrs["objects"] == "dark" and not tracked["flags"].any()
    for variable in ("displacement_mm", "shaker_displacement_mm", "penetration_mm"):
        assert rms(errors_px(tracked, recording.truth, variable)) < 0.1
    assert tracked["penetration_normalised"].max() > -0.02


@pytest.mark.slow
def test_the_result_follows_the_schema_of_a_run(tmp_path):
    calls = []
    tracked = followed(rendered(), tmp_path, progress=lambda done, total: calls.append((done, total)))
    check_trajectory(tracked, ("displacement_at_striker", "striker_displacement", "penetration_normalised"))
    assert calls[-1] == (tracked.sizes["time"],) * 2 and calls == sorted(calls)
    np.testing.assert_allclose(tracked["displacement_at_striker"] * BUCKLING_LEVEL * 1e3, tracked["displacement_mm"])
    np.testing.assert_allclose(
        tracked["penetration_normalised"],
        tracked["striker_displacement"] - tracked["displacement_at_striker"],
        atol=1e-12,
    )
    np.testing.assert_allclose(np.diff(tracked["time"]), 1.0 / FRAME_RATE)
    assert ((tracked["confidence"] >= 0) & (tracked["confidence"] <= 1)).all()
    assert tracked["confidence"].median() > 0.8
    assert all(variable.attrs["units"] and variable.attrs["long_name"] for variable in tracked.data_vars.values())
    tracked.to_netcdf(tmp_path / "a.nc", engine="h5netcdf")


@pytest.mark.slow
def test_rest_is_the_facing_well_unless_given(tmp_path):
    recording = rendered()
    well = followed(recording, tmp_path, rest_displacement=None, location=1 / 2.1)
    expected = -0.5 * (1.0 - np.cos(2.0 * np.pi / 2.1))
    assert well["displacement_at_striker"][0] == pytest.approx(expected, abs=0.005)
    assert followed(recording, tmp_path, rest_displacement=0.0)["displacement_at_striker"][0] == pytest.approx(
        0.0, abs=0.005
    )


def test_trouble_is_flagged_and_never_filled_in(tmp_path):
    recording = rendered(glare_frames=[60, 61], blurred_frames=[80], repeated_frames=[100, 101], blank_frames=[120])
    tracked = followed(recording, tmp_path)
    flags = {k: FrameFlag(int(flag)) for k, flag in enumerate(tracked["flags"].values) if flag}
    assert flags == {
        60: FrameFlag.GLARE, 61: FrameFlag.GLARE, 80: FrameFlag.BLUR,
        100: FrameFlag.DROPPED, 101: FrameFlag.DROPPED, 120: FrameFlag.DROPPED,
    }  # fmt: skip
    lost = [60, 61, 100, 101, 120]
    assert tracked["displacement_at_striker"].isnull().values.nonzero()[0].tolist() == lost
    assert (tracked["valid"] == 0).values.nonzero()[0].tolist() == lost
    assert (tracked["confidence"][lost] == 0).all()
    assert rms(errors_px(tracked, recording.truth, "displacement_mm")) < 0.1
    quality = tracking_quality(tracked)
    assert quality["counts"]["dropped"] == 3 and quality["longest_gap"] == 2
    report = tracking_report(tracked)
    assert "glare: 2 frames - light saturates" in report and report.endswith("in frames: 2")
    assert quality["snr_db"] == pytest.approx(30.0, abs=1.0)


@pytest.mark.slow
def test_a_striker_that_never_touches_is_no_doubt_about_the_track(tmp_path):
    time, _, shaker, *_ = impacts(5)
    beam = -BUCKLING_LEVEL + 8.0 * PIXEL * np.exp(-20.0 * time) * np.sin(2.0 * np.pi * 190.0 * time)
    recording = rendered((time, beam, shaker - 20.0 * PIXEL), stage=PLAIN_TIP)
    tracked = followed(recording, tmp_path)
    codes = [one.code for one in diagnostics_of(tracked)]
    assert "camera.no_contact" in codes and not doubtful(diagnostics_of(tracked)), codes
    miss = errors_px(tracked, recording.truth, "shaker_displacement_mm")
    stated = tracked["shaker_stderr_mm"].values / (PIXEL * 1e3)
    assert np.nanmax(np.abs(miss) / stated) < 6.0 and np.nanmedian(stated) < 0.2


@pytest.mark.slow
def test_a_flat_tip_without_sticker_merges_at_contact_and_says_so(tmp_path):
    recording = rendered(impacts(5, contact_frames=12.0), stage=PLAIN_TIP | {"tip_radius": 0.5})
    tracked = followed(recording, tmp_path)
    truth = recording.truth["penetration_mm"].values
    merged = (tracked["flags"].values & FrameFlag.MERGED) != 0
    assert merged[truth > -0.2 * PIXEL * 1e3].all()
    assert not merged[truth < -4.0 * PIXEL * 1e3].any()
    assert np.isnan(tracked["shaker_displacement_mm"].values[merged]).all()
    assert np.isfinite(tracked["displacement_mm"].values).all()
    assert rms(errors_px(tracked, recording.truth, "shaker_displacement_mm")) < 0.1


@pytest.mark.slow
def test_leaving_the_region_is_flagged(tmp_path):
    time, beam, shaker, *_ = impacts(4)
    up = beam + 45.0 * PIXEL * np.sin(np.pi * time / time[-1]) ** 2
    recording = rendered((time, up, shaker), zero_row=20.0, shape=(128, 64))
    tracked = followed(recording, tmp_path)
    gone = np.isnan(tracked["displacement_mm"].values)
    assert gone.any() and not gone.all()
    assert ((tracked["flags"].values[gone] & FrameFlag.OUT_OF_REGION) != 0).mean() > 0.95
    assert rms(errors_px(tracked, recording.truth, "displacement_mm")) < 0.1


@pytest.mark.slow
def test_frames_missing_from_the_numbering_stay_missing(tmp_path):
    import cv2

    recording = rendered()
    for number, image in enumerate(recording):
        if number not in (50, 51, 52):
            cv2.imwrite(str(tmp_path / f"f_{number:04d}.png"), image * 16)
    rest = 1e-3 * float(recording.truth["displacement_mm"][0])
    with open_recording(tmp_path, frame_rate=FRAME_RATE, pixel_size=PIXEL) as read:
        tracked = track(read, buckling_level=BUCKLING_LEVEL, rest_displacement=rest)
    assert tracked.sizes["time"] == len(recording)
    assert tracked["flags"].values.nonzero()[0].tolist() == [50, 51, 52]
    assert (tracked["flags"].values[50:53] == FrameFlag.DROPPED).all()
    assert rms(errors_px(tracked, recording.truth, "displacement_mm")) < 0.1


@pytest.mark.slow
def test_the_beam_alone_and_a_picture_of_the_background(tmp_path):
    recording = rendered(stage={"shaker_width": 1e-6, "marker_thickness": 0.0})
    path = recording.write(tmp_path / "a.cihx")
    with open_recording(path) as read:
        with pytest.raises(InputError, match="no shaker is seen"):
            track(read)
        tracked = track(read, shaker=False)
        assert "shaker_displacement_mm" not in tracked and "displacement_at_striker" not in tracked
        shifted = tracked["displacement_mm"] + recording.truth["displacement_mm"][0]
        assert rms(errors_px(tracked.assign(displacement_mm=shifted), recording.truth, "displacement_mm")) < 0.1
        lamp = np.tile(np.linspace(0.0, 300.0, 64), (160, 1))
        again = track(read, shaker=False, background=lamp)
        np.testing.assert_allclose(again["displacement_mm"], tracked["displacement_mm"], atol=0.1 * PIXEL * 1e3)


def test_frames_without_anything_to_find_are_refused(tmp_path):
    from snapbeam.lab.camera import write_photron

    rng = np.random.default_rng(0)
    cases = {
        "black": np.zeros((6, 64, 64), np.uint16),
        "noise": rng.integers(0, 4095, (6, 64, 64)).astype(np.uint16),
        "thin": np.where(np.arange(64)[:, None] == 5, 900, 10).astype(np.uint16) * np.ones((6, 1, 64), np.uint16),
    }
    for name, data in cases.items():
        path = write_photron(tmp_path / f"{name}.cihx", data, frame_rate=1e4, pixel_size=1e-5)
        with open_recording(path) as read, pytest.raises(InputError, match="recording"):
            track(read)


@pytest.mark.sampled(4)
@pytest.mark.parametrize(
    ("options", "name"),
    [
        ({"buckling_level": 0.0}, "buckling_level"),
        ({"location": 1.5}, "location"),
        ({"side": "front"}, "side"),
        ({"objects": "grey"}, "objects"),
        ({"threshold": float("nan")}, "threshold"),
        ({"columns": 1}, "columns"),
        ({"contact_column": 70.0}, "contact_column"),
        ({"contact_column": 1.0}, "contact_column"),
        ({"rest_frames": 0}, "rest_frames"),
        ({"blur_limit": -1.0}, "blur_limit"),
        ({"background": np.zeros((3, 3))}, "background"),
        ({"rest_displacement": float("inf")}, "rest_displacement"),
    ],
)
def test_bad_parameters_are_refused_by_name(tmp_path, options, name):
    time, beam, shaker, *_ = impacts(1)
    with open_recording(rendered((time, beam, shaker)).write(tmp_path / "a.cihx")) as read:
        with pytest.raises(InputError, match=name):
            track(read, **options)


@pytest.mark.slow
@pytest.mark.parametrize("snr", [pytest.param(30.0, marks=pytest.mark.slow), 15.0])
@pytest.mark.parametrize("gap_px", [4.6, *(pytest.param(gap, marks=pytest.mark.slow) for gap in (9.0, 25.0))])
def test_onsets_of_isolated_impacts_within_one_frame(tmp_path, snr, gap_px):
    motion = impacts(6, gap_px=gap_px)
    recording = rendered(motion, snr=snr)
    tracked = followed(recording, tmp_path)
    found = contact_onsets(tracked, minimum_frames=2)
    expected = motion[3] + recording.truth.attrs["rest_frames"] / FRAME_RATE
    onsets = found["onset"].values[1:]
    assert motion[4] >= 0.3 and onsets.size == expected.size
    assert (np.abs(onsets - expected) <= 4.0 * found["onset_stderr"].values[1:]).all()
    assert np.median(np.abs(onsets - expected)) * FRAME_RATE <= 0.5
    np.testing.assert_allclose(found["duration"].values[1:-1] * FRAME_RATE, 4.3, atol=1.0 if snr == 30.0 else 3.0)
    speed = found["closing_speed"].values[1:] / (PIXEL * FRAME_RATE)
    np.testing.assert_allclose(speed, motion[4], rtol=0.35)
    assert found["bounded"].values[1:-1].all() and not found["bounded"].values[0]


@pytest.mark.slow
def test_a_contact_that_borders_on_lost_frames_is_not_bounded(tmp_path):
    tracked = followed(rendered(), tmp_path)
    onsets = contact_onsets(tracked)
    first = int(np.searchsorted(tracked["time"], onsets["onset"][1]))
    tracked["penetration_mm"][first - 1] = np.nan
    assert onsets["bounded"][1] == 1 and contact_onsets(tracked)["bounded"][1] == 0
    with pytest.raises(InputError, match="penetration_mm"):
        contact_onsets(tracked.drop_vars("penetration_mm"))
    with pytest.raises(InputError, match="tolerance"):
        contact_onsets(tracked, tolerance=-1.0)


@pytest.mark.slow
def test_a_full_size_recording_is_tracked_at_200_frames_a_second(tmp_path):
    time, beam, shaker, *_ = impacts(18, pixel=12e-6, rate=10_000.0)
    recording = render_recording(time, beam, shaker, camera=SyntheticCamera(), rng=2)
    with open_recording(recording.write(tmp_path / "a.cihx")) as read:
        start = clock.process_time()
        tracked = track(read, rest_displacement=1e-3 * float(recording.truth["displacement_mm"][0]))
        speed = len(read) / (clock.process_time() - start)
    assert speed >= 200.0
    miss = errors_px(tracked, recording.truth, "displacement_mm", 12e-6)
    assert rms(miss) <= 0.1 and abs(miss.mean()) <= 0.05 and not tracked["flags"].any()
