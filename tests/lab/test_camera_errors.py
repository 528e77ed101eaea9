"""Errors of camera, file and settings that leave every frame as it should look; each is told or right."""

import types

import camera_scenes
import imageio_ffmpeg
import numpy as np
import pytest

from snapbeam.lab import open_recording
from snapbeam.lab.tracking.diagnostics import never_touching, open_shift
from snapbeam.lab.tracking.frame_order import find_order
from snapbeam.lab.tracking.measure import Touch, exposure_blur, find_rest
from snapbeam.lab.tracking.settings import EdgeShape
from snapbeam.lab.tracking.survey import border_bar
from snapbeam.util.diagnostics import diagnostics_of


def motion(count=240, noise=0.03, seed=0):
    """Rows [px] of a beam that is struck again and again and of a striker."""
    frame = np.arange(count)
    rng = np.random.default_rng(seed)
    striker = 60.0 + 5.0 * np.sin(2.0 * np.pi * frame / 120.0)
    share = np.clip((np.mod(frame, 50) - 7.0) / 43.0, 0.0, 1.0)
    gap = 40.0 * share * (1.0 - share)
    rows = striker - gap + noise * rng.standard_normal(count)
    return rows, striker + noise * rng.standard_normal(count)


@pytest.mark.parametrize("at", [75, 140, 170])
def test_frames_lost_and_shown_twice_are_located(at):
    whole = motion(noise=0.02)
    assert find_order(*whole) == ((), (), (), ())
    for count in (1, 2):
        order = find_order(*(np.delete(one, np.arange(at, at + count)) for one in whole))
        assert order.missing == (at,) and order.many == (count,) and not order.repeated
    shown = np.arange(240)
    shown[at] = at - 1
    order = find_order(*(one[shown] for one in whole))
    assert order.repeated == (at,) and not order.missing


@pytest.mark.parametrize("at", [75, 140, 170])
def test_a_knocked_camera_exchanged_frames_and_joined_recordings_need_no_steady_drive(at):
    """Two cycles of the drive: jumps of striker and beam in one frame, alike or each by its own."""
    whole = motion(260, noise=0.02)
    (order,) = find_order(*(one + 1.5 * (np.arange(260) >= at) for one in whole)).clock
    assert order == ("knocked", {"first": at, "size": pytest.approx(1.5, abs=0.1)})
    (order,) = find_order(
        *(one + size * (np.arange(260) >= at) for one, size in zip(whole, (3.0, -1.0), strict=True))
    ).clock
    assert order == (
        "jump",
        {"first": at, "beam": pytest.approx(3.0, abs=0.1), "striker": pytest.approx(-1.0, abs=0.1)},
    )
    shown = np.arange(260)
    shown[[at, at + 1]] = at + 1, at
    ((kind, numbers),) = find_order(*(one[shown] for one in whole)).clock
    assert kind == "frames_exchanged" and numbers == {"frames": 1, "first": at}


def test_a_jump_of_one_edge_is_not_one_of_the_picture():
    """As of a striker whose edge is found elsewhere while it touches."""
    beam, striker = motion(noise=0.02)
    assert find_order(beam, striker + 1.0 * (np.arange(240) >= 140)) == ((), (), (), ())


def test_every_tenth_frame_lost_and_every_seventh_a_copy():
    whole = motion()
    keep = np.delete(np.arange(240), np.arange(30, 240, 10))
    order = find_order(*(one[keep] for one in whole))
    assert len(order.missing) >= 3 and not order.repeated
    shown = np.arange(240)
    shown[30::7] -= 1
    order = find_order(*(one[shown] for one in whole))
    assert len(order.repeated) >= 3 and not order.missing


def test_no_frame_of_a_good_recording_is_taken_for_lost():
    assert all(find_order(*motion(seed=seed)) == ((), (), (), ()) for seed in range(60))
    beam, _ = motion()
    assert find_order(beam, np.full(240, np.nan)) == ((), (), (), ())


def fast(per_cycle, seed, lost=()):
    """Beam and striker of a smooth fast motion, with little noise, apart from each other."""
    rng = np.random.default_rng(seed)
    turn = 2.0 * np.pi * np.delete(np.arange(601.0), lost)[:600] / per_cycle
    first, second, third = rng.uniform(0.0, 2.0 * np.pi, 3)
    beam = 60.0 + 20.0 * np.sin(turn + first) + 7.0 * np.sin(2.0 * turn + second)
    noise = 0.013 * rng.standard_normal((2, turn.size))
    return beam + noise[0], 100.0 + 10.0 * np.sin(1.3 * turn + third) + noise[1]


@pytest.mark.slow
@pytest.mark.parametrize("per_cycle", [15, 25, 60])
def test_the_turning_points_of_a_fast_motion_are_no_lost_frames(per_cycle):
    """A cubic over ten frames is too stiff there; a lost frame is found all the same."""
    assert all(find_order(*fast(per_cycle, seed)) == ((), (), (), ()) for seed in range(40))
    found = [find_order(*fast(per_cycle, seed, [300])).missing for seed in range(40)]
    assert np.mean([any(299 <= at <= 301 for at in places) for places in found]) > 0.9
    assert all(len(places) <= 1 for places in found)


def test_few_frames_are_at_rest_only_beside_others_at_rest():
    beam, striker = motion()
    error = np.full(240, 0.03)
    for given in ((0, 1), (100, 102), (60, 63)):
        assert not find_rest(beam[10:], error[10:], striker[10:], given).found
    still = np.concatenate([np.full(20, beam[0]) + 0.03 * np.random.default_rng(1).standard_normal(20), beam])
    error = np.full(260, 0.03)
    for given in ((0, 1), (0, 3), (17, 20)):
        assert find_rest(still, error, np.full(260, np.nan), given).found


def test_image_lag_is_told_by_the_blur_of_fast_frames():
    beam = motion(noise=0.0)[0]
    step = np.abs(np.gradient(beam))
    rng = np.random.default_rng(2)
    for share, told in ((0.0, False), (0.15, True), (0.3, True)):
        more = step**2 * (0.5**2 / 12.0 + share * (1.0 - share))
        width = np.sqrt(1.0 + more) + 0.01 * rng.standard_normal(beam.size)
        assert (exposure_blur(beam, width, 0.5)[0] > 0.0) == told
    assert exposure_blur(beam, width, 0.5)[0] == pytest.approx(0.3, abs=0.08)


def test_light_shorter_than_the_exposure_is_told_by_the_blur_of_fast_frames():
    beam = motion(noise=0.0)[0]
    rng = np.random.default_rng(2)
    for share, stated, told in ((0.9, 0.9, 0.0), (0.1, 0.9, 0.45), (0.1, None, 0.0), (0.1, 0.1, 0.0)):
        width = np.sqrt(1.0 + np.gradient(beam) ** 2 * share**2 / 12.0) + 0.005 * rng.standard_normal(beam.size)
        assert exposure_blur(beam, width, stated)[:2] == (0.0, told)


def test_edges_too_noisy_to_show_a_pulse_leave_the_instant_open_and_raise_no_alarm():
    beam = motion(noise=0.0)[0]
    square = np.gradient(beam) ** 2 * 0.9**2 / 12.0
    rng = np.random.default_rng(12)
    scatters = rng.uniform(0.01, 0.05, 500)
    good, pulsed = (
        [exposure_blur(beam, np.sqrt(1.0 + share * square) + s * rng.standard_normal(240), 0.9) for s in scatters]
        for share in (1.0, 0.0)
    )
    assert sum(one.pulse > 0.0 for one in good) <= 2 and np.mean([one.late < 0.1 for one in good]) > 0.95
    assert np.mean([5.0 * one.late > 0.45 for one in pulsed]) > 0.9
    assert 300 < sum(one.pulse > 0.0 for one in pulsed) < 500


def test_a_bar_along_the_border_is_told_from_the_background():
    beam = np.rint(20.0 + 4.0 * np.sin(np.arange(30))).astype(int)
    light = np.zeros((30, 60, 24), dtype=bool)
    for frame, row in zip(light, beam, strict=True):
        frame[row : row + 12] = True
    assert border_bar(~light) == 0  # the background ends at a beam that moves
    light[:, :5] = True
    assert border_bar(light) == 6


def test_background_between_a_fixed_line_and_the_beam_is_no_bar():
    """Nor where the camera drifts, which moves the line by a few pixels."""
    light = np.zeros((30, 80, 24), dtype=bool)
    for k, frame in enumerate(light):
        line, beam = 12 + round(3.0 * (k / 29.0) ** 3), 40 + int(8.0 * np.sin(0.4 * k))
        frame[line : line + 4] = True
        frame[beam : beam + 12] = True
    assert border_bar(~light) == 0


@pytest.mark.parametrize("seen", [0.0, 0.04, -0.1, 0.3])
@pytest.mark.parametrize("spread", [0.02, 0.15, 0.4])
def test_a_contact_bounds_the_curve_that_edges_leave_open(seen, spread):
    """The mean square of the shift by Bayes' rule, summed: none in 91 % of recordings, else normal about none."""
    shape, error = EdgeShape(0.01, 1.0, 0.3, 0.0, spread, 0.0), np.hypot(0.01, 0.03)
    shift = np.linspace(-12.0 * spread - 0.5, 12.0 * spread + 0.5, 200_001)
    curve = np.exp(-0.5 * ((shift / (2.0 * spread)) ** 2 + ((seen - shift) / error) ** 2))
    curve *= 0.09 / (2.0 * spread * np.sqrt(2.0 * np.pi)) * (shift[1] - shift[0])
    none = 0.91 * np.exp(-0.5 * (seen / error) ** 2)
    expected = np.sqrt((curve * shift**2).sum() / (curve.sum() + none))
    assert open_shift(shape, Touch(seen, 0.01, 8), 0.03) == pytest.approx(expected, rel=1e-4)
    assert open_shift(shape, Touch(np.nan, np.nan, 0), 0.03) == pytest.approx(0.3 * 2.0 * spread)


def test_a_gap_of_two_pixels_is_no_contact_unless_the_tip_merges():
    beam, striker = motion()
    depth = beam - striker
    for merged, told in ((0, True), (5, False)):
        rows = types.SimpleNamespace(row=beam, flagged=lambda flag, merged=merged: merged)
        assert (never_touching(depth - 2.0, rows) > 0.0) == told
        assert never_touching(depth, rows) == 0.0


def test_lossless_h264_is_not_called_lossy(tmp_path):
    frames = np.random.default_rng(0).integers(0, 255, (4, 32, 48)).astype(np.uint8)
    for name, option, lossy in (("whole.mp4", "-qp 0", False), ("lossy.mp4", "-crf 10", True)):
        writer = imageio_ffmpeg.write_frames(
            str(tmp_path / name), (48, 32), fps=25, quality=None, codec="libx264", macro_block_size=2,
            output_params=option.split(), pix_fmt_in="gray", pix_fmt_out="gray", ffmpeg_log_level="error",
        )  # fmt: skip
        writer.send(None)
        for frame in frames:
            writer.send(np.ascontiguousarray(frame))
        writer.close()
        with open_recording(tmp_path / name, frame_rate=1000.0, pixel_size=1e-5) as recording:
            assert ("recording.lossy" in [one.code for one in recording.diagnostics]) == lossy


EXPECTED = {
    "curved edge": "camera.curved",
    "striker seldom seen": "camera.striker_lost",
    "one repeated frame": "camera.frames_repeated",
    "every tenth lost": "camera.frames_lost",
    "every seventh a copy": "camera.frames_repeated",
    "frames lost now and then": "camera.frames_lost",
    "rest in motion": "camera.rest_moves",
    "pixel size in inches": "camera.rulers",
    "pixel size ten percent off": "camera.rulers",
    "image lag": "camera.lag",
    "swinging sticker": "camera.sticker_loose",
    "rod at the border": "camera.rod_cut",
}


@pytest.mark.slow
@pytest.mark.parametrize("kind", [*EXPECTED, "white bar at the edge", "tapered beam", "rotated camera", "gauge", ""])
def test_a_rendered_scene_is_told_or_right(kind, tmp_path):
    outcome = camera_scenes.judged(kind, np.random.default_rng((31, 1, sum(map(ord, kind)))), tmp_path)
    if kind in EXPECTED:
        assert EXPECTED[kind] in outcome.codes
    else:
        assert not outcome.flagged and outcome.ratio < 5.0


@pytest.mark.slow
def test_a_pixel_size_ten_percent_off_beside_a_gauge_and_impossible_motions_are_told(tmp_path):
    rng = np.random.default_rng((31, 4, sum(map(ord, "pixel size ten percent off"))))
    tracked, _ = camera_scenes.measured("pixel size ten percent off", rng, tmp_path, buckling_level=20e-6)
    codes = [one.code for one in diagnostics_of(tracked)]
    assert "camera.rulers" in codes and "camera.beyond" in codes
