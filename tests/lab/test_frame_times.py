"""Times, scales and layout that recordings state: read, or refused with what contradicts."""

from __future__ import annotations

from fractions import Fraction

import av
import h5py
import numpy as np
import pytest
import tifffile
from cine_file import write_cine

from snapbeam import lab
from snapbeam.lab.camera import open_recording
from snapbeam.lab.frame_times import numbers_of_stamps
from snapbeam.util.diagnostics import diagnostics_of
from snapbeam.util.validation import InputError

SHAPE = (24, 36)
NUMBERS = [0, 1, 2, 5, 6, 7, 8, 12, 13, 14, 15, 16]  # frames 3, 4 and 9 to 11 are lost
FRAMES = np.random.default_rng(8).integers(0, 255, (len(NUMBERS), *SHAPE), dtype=np.uint8)
SCALE = {"pixel_size": 1e-5}


def imagej(path, frames=FRAMES, resolution=(1.0, 1.0), **told):
    tifffile.imwrite(path, frames, imagej=True, resolution=resolution, metadata={"axes": "TYX", **told})
    return path


@pytest.mark.parametrize(
    ("told", "rate"),
    [
        ({"finterval": 0.25, "tunit": "ms"}, 4000.0),
        ({"finterval": 125.0, "tunit": "\\u00B5s"}, 8000.0),
        ({"finterval": 125.0, "tunit": "usec"}, 8000.0),
        ({"finterval": 0.02, "tunit": "sec"}, 50.0),
        ({"finterval": 0.5, "tunit": "min"}, 1.0 / 30.0),
        ({"finterval": 1e-3}, 1000.0),
        ({"fps": 3000.0}, 3000.0),
        ({"finterval": 0.333, "tunit": "ms", "fps": 3000.0}, 1e3 / 0.333),
    ],
)
def test_frame_interval_of_imagej_has_a_unit(tmp_path, told, rate):
    with open_recording(imagej(tmp_path / "a.tif", **told), **SCALE) as recording:
        assert recording.frame_rate == pytest.approx(rate)


@pytest.mark.parametrize(
    ("told", "words"),
    [
        ({"finterval": 0.25, "fps": 4000.0}, r"finterval = 0\.25 s: 4 Hz, fps: 4000 Hz"),
        ({"finterval": 0.25, "tunit": "ms", "fps": 30.0}, r"finterval = 0\.25 ms: 4000 Hz, fps: 30 Hz"),
        ({"finterval": 2.0, "tunit": "frame"}, "finterval = 'frame'"),
    ],
)
def test_contradicting_rates_of_imagej_are_asked_for(tmp_path, told, words):
    path = imagej(tmp_path / "a.tif", **told)
    with pytest.raises(InputError, match=words):
        open_recording(path, **SCALE)
    with open_recording(path, frame_rate=4000.0, **SCALE) as recording:
        assert [one.code for one in recording.diagnostics] == ["recording.contradiction"]


@pytest.mark.parametrize("unit", ["\\u00B5m", "um", "micron", "microns", "\\u03BCm"])
def test_pixels_that_are_not_square(tmp_path, unit):
    path = imagej(tmp_path / "a.tif", resolution=(1.0 / 30.0, 1.0 / 8.0), unit=unit, fps=1000.0)
    with open_recording(path) as recording:
        assert recording.pixel_size == pytest.approx(8e-6, rel=1e-6)
        assert recording.pixel_width == pytest.approx(30e-6, rel=1e-6)
        field = lab.full_field(recording, (6, 16), block=12)
        assert np.diff(field.position) == pytest.approx(12 * 30e-6, rel=1e-6)
        turned = lab.full_field(recording, (6, 24), block=12, motion="columns")
        assert np.diff(turned.position) == pytest.approx(12 * 8e-6, rel=1e-6)
        assert turned.attrs["pixel_size"] == pytest.approx(30e-6, rel=1e-6)
    with open_recording(path, pixel_size=2e-5) as recording:
        assert recording.pixel_size == recording.pixel_width == 2e-5


@pytest.mark.slow
@pytest.mark.parametrize("side", ["below", "left"])
def test_tracking_takes_the_size_of_a_pixel_along_the_motion(tmp_path, side):
    time = np.arange(120) / 5e3
    motion = 5e-5 * np.sin(2.0 * np.pi * 90.0 * time) * (time > 0.004)
    camera = lab.SyntheticCamera(shape=(176, 64), pixel_size=12e-6)
    stage = lab.SyntheticStage(shaker_width=0.4e-3)
    synthetic = lab.render_recording(time, motion - 3e-4, np.full(120, -9e-4), camera=camera, stage=stage)
    with open_recording(synthetic.write(tmp_path / "a.cihx"), frame_rate=5e3, pixel_size=12e-6) as one:
        frames = np.stack(list(one))
    along, across = 1.0 / 12.0, 1.0 / 24.0
    resolution = (across, along)
    if side == "left":
        frames, resolution = frames.transpose(0, 2, 1)[:, :, ::-1], (along, across)
    path = imagej(tmp_path / "a.tif", np.ascontiguousarray(frames).astype(np.uint16), resolution, unit="um", fps=5000.0)
    with open_recording(path) as recording:
        tracked = lab.track(recording, side=side, shaker=True)
    found = tracked.displacement_mm.values
    assert tracked.attrs["pixel_size"] == pytest.approx(12e-6, rel=1e-6)
    assert np.nanmax(found) - np.nanmin(found) == pytest.approx(0.1, rel=0.05)


@pytest.mark.parametrize(
    ("shape", "axes", "words"),
    [
        ((3, 4), "TCYX", "3 .time., 4 .channel."),
        ((4, 3), "TZYX", "4 .time., 3 .depth."),
        ((12,), "CYX", "12 .channel."),
        ((12,), "ZYX", "12 .depth."),
    ],
)
@pytest.mark.parametrize("kind", ["imagej", "ome"])
def test_channels_and_slices_are_no_frames(tmp_path, shape, axes, words, kind):
    path = tmp_path / ("a.tif" if kind == "imagej" else "a.ome.tif")
    pictures = FRAMES.reshape(*shape, *SHAPE)
    tifffile.imwrite(path, pictures, imagej=kind == "imagej", photometric="minisblack", metadata={"axes": axes})
    with pytest.raises(InputError, match=words):
        open_recording(path, frame_rate=1e3, **SCALE)


def test_slices_that_imagej_made_of_a_video_are_frames(tmp_path):
    path = imagej(tmp_path / "a.tif", axes="ZYX", finterval=0.5, tunit="ms")
    with open_recording(path, **SCALE) as recording:
        assert len(recording) == FRAMES.shape[0] and recording.frame_rate == pytest.approx(2000.0)
    imagej(path, axes="ZYX", finterval=0.5, tunit="ms", spacing=3.0)
    with pytest.raises(InputError, match="must be frames over time alone"):
        open_recording(path, **SCALE)


@pytest.mark.parametrize("order", [">", "<"])
def test_frames_behind_one_page_as_imagej_writes_large_files(tmp_path, order):
    path = tmp_path / "a.tif"
    deep = FRAMES.astype(np.uint16) * 257
    told = f"ImageJ=1.54f\nimages={len(deep)}\nframes={len(deep)}\nfinterval=0.2\ntunit=ms\nunit=\\u00B5m\n"
    tifffile.imwrite(
        path, deep[0], description=told, metadata=None, resolution=(0.125, 0.125), resolutionunit=1, byteorder=order
    )  # fmt: skip
    whole = path.read_bytes() + deep[1:].astype(f"{order}u2").tobytes()
    path.write_bytes(whole)
    with open_recording(path) as recording:
        assert recording.frame_rate == pytest.approx(5000.0) and recording.pixel_size == pytest.approx(8e-6)
        np.testing.assert_array_equal(np.stack(list(recording)), deep)
    path.write_bytes(whole[:-100])
    with pytest.raises(InputError, match="says 12 images and holds 1: it is cut short"):
        open_recording(path)


def test_times_and_sizes_of_ome(tmp_path):
    path = tmp_path / "a.ome.tif"

    def write(**told):
        tifffile.imwrite(path, FRAMES, photometric="minisblack", metadata={"axes": "TYX", **told})
        return path

    sizes = {"PhysicalSizeX": 20.0, "PhysicalSizeXUnit": "µm", "PhysicalSizeY": 0.01, "PhysicalSizeYUnit": "mm"}
    with open_recording(write(**sizes, TimeIncrement=0.4, TimeIncrementUnit="ms")) as recording:
        assert recording.frame_rate == pytest.approx(2500.0)
        assert (recording.pixel_size, recording.pixel_width) == pytest.approx((1e-5, 2e-5))
    stamps = {"DeltaT": [0.4 * k for k in NUMBERS], "DeltaTUnit": ["ms"] * len(NUMBERS)}
    with open_recording(write(**sizes, Plane=stamps)) as recording:
        assert recording.numbers.tolist() == NUMBERS
        assert recording.frame_rate == pytest.approx(2500.0)
    with pytest.raises(InputError, match=r"TimeIncrement: 1000 Hz, time stamps DeltaT: 2500 Hz"):
        open_recording(write(**sizes, TimeIncrement=1.0, TimeIncrementUnit="ms", Plane=stamps))


def video(path, codec, numbers=NUMBERS, rate=25, pixels="gray", base=None):
    base = base or Fraction(1, rate)
    with av.open(str(path), "w") as container:
        stream = container.add_stream(codec, rate=rate)
        stream.height, stream.width = SHAPE
        stream.pix_fmt, stream.time_base = pixels, base
        for number, picture in zip(numbers, FRAMES, strict=False):
            frame = av.VideoFrame.from_ndarray(picture, format="gray")
            frame.pts, frame.time_base = number, base
            container.mux(stream.encode(frame))
        container.mux(stream.encode())
    return path


@pytest.mark.parametrize("rate", [25, 400])
@pytest.mark.parametrize(
    ("name", "codec", "pixels"),
    [("a.avi", "ffv1", "gray"), ("a.mkv", "ffv1", "gray"), ("a.mov", "png", "gray"), ("a.mp4", "libx264", "yuv420p")],
)
def test_time_stamps_and_empty_chunks_tell_lost_frames(tmp_path, name, codec, pixels, rate):
    path = video(tmp_path / name, codec, rate=rate, pixels=pixels)
    with open_recording(path, frame_rate=6e3, **SCALE) as recording:
        assert recording.numbers.tolist() == NUMBERS
        assert recording.time[-1] == pytest.approx(16 / 6e3)
        (told,) = [one for one in recording.diagnostics if one.code == "recording.frames_missing"]
        assert (told.numbers["frames"], told.numbers["places"], told.numbers["first"]) == (5.0, 2.0, 2.0)
        field = lab.full_field(recording, (6, 16), block=12)
    assert field.sizes["time"] == 17
    lost = ~np.isfinite(field.displacement.values).any(1)
    assert set(np.setdiff1d(np.arange(17), NUMBERS)) <= set(np.flatnonzero(lost))
    assert "recording.frames_missing" in field.attrs["diagnostics"]
    whole = video(tmp_path / name, codec, range(len(NUMBERS)), rate=rate, pixels=pixels)
    with open_recording(whole, frame_rate=6e3, **SCALE) as recording:
        assert recording.numbers.tolist() == list(range(len(NUMBERS)))
        assert "recording.frames_missing" not in {one.code for one in recording.diagnostics}


def test_stamps_coarser_than_frames(tmp_path):
    path = tmp_path / "a.mkv"  # counts milliseconds
    with open_recording(video(path, "ffv1", range(12), 3000), frame_rate=3e3, **SCALE) as recording:
        assert recording.numbers.tolist() == list(range(12))
    with pytest.raises(InputError, match=r"12 frames at 3000 Hz end .*, and stamps of 0\.001 s do not tell where"):
        open_recording(video(path, "ffv1", [*range(6), *range(16, 22)], 3000), frame_rate=3e3, **SCALE)


@pytest.mark.parametrize(("tick", "step"), [(1e-3, 1.43e-3), (1e-3, 2.5e-3), (1.0 / 600.0, 1.0 / 240.0), (0.0, 1e-4)])
@pytest.mark.parametrize("stated", [True, False])
def test_numbers_from_rounded_stamps(tick, step, stated):
    stated = stated or step < 2.0 * tick  # else a tick more need not be a frame
    rng = np.random.default_rng(3)
    numbers = np.flatnonzero(rng.random(4000) > 0.03)
    numbers -= numbers[0]
    times = numbers * step
    times = np.rint(times / tick) * tick if tick else times + 0.05 * step * rng.standard_normal(times.size)
    found, each = numbers_of_stamps("a.mkv", times, tick, step if stated else None)
    assert found.tolist() == numbers.tolist()
    assert each == pytest.approx(step, rel=1e-3)


def test_uneven_and_backward_stamps_are_refused():
    times = np.arange(50) * 0.01
    for change, words in ((0.005, "uneven"), (-0.015, "must increase")):
        bad = times.copy()
        bad[20] += change
        with pytest.raises(InputError, match=words):
            numbers_of_stamps("a.mp4", bad, 1e-5, 0.01)
    with pytest.raises(InputError, match=r"leap by 100\.01 s after frame 24"):
        numbers_of_stamps("a.mp4", times + 100.0 * (times > 0.245), 1e-5, 0.01)


def test_times_of_frames_of_phantom(tmp_path):
    path = tmp_path / "a.cine"
    options = {"frame_rate": 5000, "exposure": 1e-5, "bits": 8}
    write_cine(path, FRAMES, times=1.7e9 + np.array(NUMBERS) / 5000.0, **options)
    with open_recording(path, **SCALE) as recording:
        assert recording.numbers.tolist() == NUMBERS and recording.frame_rate == 5000.0
        np.testing.assert_array_equal(np.stack(list(recording)), FRAMES)
    late = np.arange(12) / 5000.0 + np.where(np.arange(12) > 5, 0.2, 0.0)
    write_cine(path, FRAMES, times=late, **options)
    with open_recording(path, **SCALE) as recording:
        assert recording.time == pytest.approx(late)
    write_cine(path, FRAMES, times=np.arange(12) / 2500.0, **options)
    with pytest.raises(InputError, match="header: 5000 Hz, time stamps of the frames: 2500 Hz"):
        open_recording(path, **SCALE)
    write_cine(path, FRAMES, times=np.arange(9) / 5000.0, **options)
    with pytest.raises(InputError, match="times of 9 frames and 12 frames"):
        open_recording(path, **SCALE)


def test_times_and_rates_of_hdf5(tmp_path):
    path = tmp_path / "a.h5"

    def write(unit, times, **attributes):
        with h5py.File(path, "w") as file:
            file["stack"] = FRAMES
            file["time"] = times
            file["time"].attrs["units"] = unit
            file.attrs.update(attributes)
        return path

    with open_recording(write("ms", 0.5 * np.array(NUMBERS)), **SCALE) as recording:
        assert recording.numbers.tolist() == NUMBERS and recording.frame_rate == pytest.approx(2000.0)
    with pytest.raises(InputError, match="fps: 25 Hz, times of the frames: 2000 Hz"):
        open_recording(write("ms", 0.5 * np.array(NUMBERS), fps=25.0), **SCALE)
    with pytest.raises(InputError, match=r"pixel_size 1e-05, pixel_size_m 2e-05"):
        open_recording(write("ms", 0.5 * np.array(NUMBERS), pixel_size=1e-5, pixel_size_m=2e-5))


@pytest.mark.slow
def test_lost_frames_of_a_video_shift_no_time_of_a_tracked_motion(tmp_path):
    time = np.arange(260) / 8e3
    motion = 8e-5 * np.sin(2.0 * np.pi * 110.0 * (time - 0.005)) * (time > 0.005)
    camera = lab.SyntheticCamera(shape=(176, 64), pixel_size=12e-6)
    stage = lab.SyntheticStage(shaker_width=0.4e-3)
    synthetic = lab.render_recording(time, motion - 3e-4, np.full(260, -8e-4), camera=camera, stage=stage)
    with open_recording(synthetic.write(tmp_path / "a.cihx"), frame_rate=8e3, pixel_size=12e-6) as recording:
        pictures, top = np.stack(list(recording)), recording.max_value
        whole = lab.track(recording)
    kept = np.delete(np.arange(len(pictures)), [100, 101, 102, 150, 190, 191])
    with av.open(str(tmp_path / "a.avi"), "w") as container:
        stream = container.add_stream("ffv1", rate=25)
        stream.height, stream.width, stream.pix_fmt = *pictures.shape[1:], "gray"
        for number in kept:
            grey = np.rint(pictures[number] * (255.0 / top)).astype(np.uint8)
            frame = av.VideoFrame.from_ndarray(grey, format="gray")
            frame.pts, frame.time_base = int(number), Fraction(1, 25)
            container.mux(stream.encode(frame))
        container.mux(stream.encode())
    with open_recording(tmp_path / "a.avi", frame_rate=8e3, pixel_size=12e-6) as recording:
        tracked = lab.track(recording)
    codes = {one.code for one in diagnostics_of(tracked)}
    assert "recording.frames_missing" in codes and "camera.frames_lost" not in codes
    assert tracked.sizes == whole.sizes
    off = tracked.displacement_mm.values - whole.displacement_mm.values
    assert np.isnan(off[[100, 101, 102, 150, 190, 191]]).all()
    assert np.nanmax(np.abs(off)) < 2e-3 and np.isfinite(off[kept]).mean() > 0.95
