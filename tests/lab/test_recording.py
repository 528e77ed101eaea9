"""Every kind of recording through the one reader, and every kind of damage through its refusals."""

import tracemalloc
import warnings
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from snapbeam import InputError
from snapbeam.lab.camera import open_recording, write_photron, write_video
from snapbeam.lab.photron import pack_12bit, read_header, unpack_12bit

REAL = Path(__file__).resolve().parents[3] / "shared" / "data" / "photron"
SCALES = {"frame_rate": 10_000.0, "pixel_size": 12e-6}


def frames(count=5, shape=(20, 34), high=4095, seed=0):
    kind = np.uint8 if high < 256 else np.uint16
    return np.random.default_rng(seed).integers(0, high, (count, *shape), endpoint=True).astype(kind)


@pytest.mark.parametrize(
    ("suffix", "depth", "high"), [(".cihx", 12, 4095), (".cih", 16, 4095), (".cihx", 8, 255), (".cih", 12, 4095)]
)
def test_photron_round_trip(tmp_path, suffix, depth, high):
    data = frames(high=high)
    path = write_photron(tmp_path / f"test{suffix}", data, bit_depth=depth, exposure=1e-5, skip=3, **SCALES)
    with open_recording(path, pixel_size=12e-6) as recording:
        np.testing.assert_array_equal(np.stack(list(recording)), data)
        np.testing.assert_array_equal(recording.frame(3), data[3])
        assert recording.frame_rate == pytest.approx(10_000.0)
        assert recording.metadata["record_rate"] == pytest.approx(30_000.0)
        assert recording.exposure == pytest.approx(1e-5)
        assert recording.max_value == high
        assert recording.time[-1] == pytest.approx(4e-4)
    with open_recording(path.with_suffix(".mraw"), pixel_size=1e-4, region=(3, 11, 5, 20)) as recording:
        np.testing.assert_array_equal(np.concatenate(list(recording.batches(2))), data[:, 3:11, 5:20])


@pytest.mark.parametrize(("suffix", "depth"), [(".cihx", 12), (".cih", 16)])
def test_pymraw_reads_what_was_written(tmp_path, suffix, depth):
    pymraw = pytest.importorskip("pyMRAW")
    data = frames()
    path = write_photron(tmp_path / f"test{suffix}", data, bit_depth=depth, exposure=1e-5, **SCALES)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        images, info = pymraw.load_video(str(path))
    np.testing.assert_array_equal(np.asarray(images), data)
    assert info["Record Rate(fps)"] == 10_000 and info["Total Frame"] == 5


def test_the_pixel_size_of_a_cihx_header_is_used_and_can_be_overridden(tmp_path):
    path = write_photron(tmp_path / "a.cihx", frames(), **SCALES)
    with open_recording(path) as recording:
        assert recording.pixel_size == pytest.approx(12e-6)
    with open_recording(path, pixel_size=1e-5, frame_rate=2.0) as recording:
        assert (recording.pixel_size, recording.frame_rate) == (1e-5, 2.0)
    assert "12 um" in repr(open_recording(path))


@given(st.lists(st.integers(0, 4095), min_size=2, max_size=40).filter(lambda one: len(one) % 2 == 0))
def test_packing_and_unpacking_are_inverse(values):
    pixels = np.array(values, dtype=np.uint16)
    np.testing.assert_array_equal(unpack_12bit(pack_12bit(pixels)), pixels)


def test_pixels_on_the_higher_side_are_shifted_down(tmp_path):
    data = frames()
    path = write_photron(tmp_path / "a.cih", data << 4, bit_depth=16, effective_bits=16, **SCALES)
    text = path.read_text().replace("EffectiveBit Depth : 16", "EffectiveBit Depth : 12")
    path.write_text(text.replace("Side : Lower", "Side : Higher"))
    with open_recording(path, pixel_size=1e-5) as recording:
        np.testing.assert_array_equal(np.stack(list(recording)), data)


@pytest.mark.skipif(not (REAL / "beam.cihx").exists(), reason="the public recording is not beside the project")
def test_a_real_recording_that_contradicts_itself_asks_for_its_frame_rate():
    with pytest.raises(InputError, match="pixel size is not in the file"):
        open_recording(REAL / "beam.cihx", frame_rate=20.0)
    with pytest.raises(InputError, match=r"contradicts itself: every 2500th of 400.*frame_rate \(--frame-rate\)"):
        open_recording(REAL / "beam.cihx", pixel_size=1e-4)
    with open_recording(REAL / "beam.cihx", pixel_size=1e-4, frame_rate=20.0) as recording:
        assert len(recording) == 4 and recording.shape == (80, 1024)
        assert recording.time_step == pytest.approx(2500 / 50_000)
        assert {diagnostic.code for diagnostic in recording.diagnostics} == {"recording.contradiction"}
        assert recording.exposure == pytest.approx(5e-6)
        assert recording.max_value == 4095
        pixels = np.fromfile(REAL / "beam.mraw", dtype="<u2").reshape(4, 80, 1024)
        np.testing.assert_array_equal(np.stack(list(recording)), pixels)


def test_reading_takes_constant_memory(tmp_path):
    path = write_photron(tmp_path / "long.cihx", frames(1, (128, 128)), **SCALES)
    text = path.read_text().replace("<totalFrame>1<", "<totalFrame>40000<")
    path.write_text(text)
    with open(path.with_suffix(".mraw"), "r+b") as file:
        file.truncate(40_000 * 128 * 128 * 3 // 2)  # 983 MB of which nothing is on the disk
    tracemalloc.start()
    with open_recording(path) as recording:
        assert len(recording) == 40_000
        for batch in recording.batches(32, stop=3200):
            assert batch.shape == (32, 128, 128)
        assert recording.frame(39_999).max() == 0
    assert tracemalloc.get_traced_memory()[1] < 8e6
    tracemalloc.stop()


def test_video_round_trip_and_its_missing_frame_rate(tmp_path):
    data = frames(high=255)
    path = write_video(tmp_path / "a.avi", data, play_rate=25.0)
    with pytest.raises(InputError, match="plays at 25 Hz"):
        open_recording(path, pixel_size=1e-5)
    with open_recording(path, **SCALES) as recording:
        np.testing.assert_array_equal(np.stack(list(recording)), data)
        np.testing.assert_array_equal(recording.frame(1), data[1])
        np.testing.assert_array_equal(recording.frame(4), data[4])


def test_tiff_stack_with_and_without_imagej_scales(tmp_path):
    import tifffile

    data = frames()
    tifffile.imwrite(tmp_path / "plain.tif", data, photometric="minisblack")
    with pytest.raises(InputError, match="frame rate is not in the file"):
        open_recording(tmp_path / "plain.tif", pixel_size=1e-5)
    with open_recording(tmp_path / "plain.tif", **SCALES) as recording:
        np.testing.assert_array_equal(np.stack(list(recording)), data)
    tifffile.imwrite(
        tmp_path / "scaled.tif", data, imagej=True, resolution=(0.125, 0.125),
        metadata={"axes": "TYX", "finterval": 2e-4, "unit": "um"},
    )  # fmt: skip
    with open_recording(tmp_path / "scaled.tif") as recording:
        assert recording.frame_rate == pytest.approx(5000.0)
        assert recording.pixel_size == pytest.approx(8e-6)
        np.testing.assert_array_equal(recording.frame(2), data[2])


def test_numbered_images_keep_their_holes(tmp_path):
    import cv2

    data = frames()
    for number, image in zip((8, 9, 10, 13, 14), data, strict=True):
        cv2.imwrite(str(tmp_path / f"run2_{number}.png"), image)
    with open_recording(tmp_path, **SCALES) as recording:
        assert recording.numbers.tolist() == [0, 1, 2, 5, 6]
        assert recording.time[-1] == pytest.approx(6e-4)
        np.testing.assert_array_equal(np.stack(list(recording)), data)
    with open_recording(tmp_path / "run2_*.png", **SCALES) as recording:
        assert len(recording) == 5
    (tmp_path / "run2_1000000000.png").write_bytes((tmp_path / "run2_8.png").read_bytes())
    with pytest.raises(InputError, match=r"run2_1000000000\.png"):
        open_recording(tmp_path, **SCALES)


def edit(path, old, new):
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new))


@pytest.mark.parametrize(
    ("old", "new", "field"),
    [
        ("<width>34<", "<width>35<", "mraw"),
        ("<width>34<", "<width>-34<", "imageDataInfo/resolution/width"),
        ("<width>34<", "<width>wide<", "imageDataInfo/resolution/width"),
        ("<height>20<", "<height><", "imageDataInfo/resolution/height"),
        ("<totalFrame>5<", "<totalFrame>0<", "frameInfo/totalFrame"),
        ("<totalFrame>5<", "<totalFrame>6<", "truncated"),
        ("<totalFrame>5<", "<totalFrame>4<", "larger than its header says"),
        ("<bit>12<", "<bit>10<", "imageDataInfo/colorInfo/bit"),
        ("<depth>12<", "<depth>14<", "imageDataInfo/effectiveBit/depth"),
        ("<side>Lower<", "<side>Middle<", "imageDataInfo/effectiveBit/side"),
        ("<skipFrame>1<", "<skipFrame>0<", "frameInfo/skipFrame"),
        ("<recordRate>10000<", "<recordRate>-1<", "recordInfo/recordRate"),
        ("<recordRate>10000<", "<recordRate>nan<", "recordInfo/recordRate"),
        ("<shutterSpeed>100000<", "<shutterSpeed>0<", "recordInfo/shutterSpeed"),
        ("<type>Mono<", "<type>Color<", "imageDataInfo/colorInfo/type"),
        ("<fileFormat>MRaw<", "<fileFormat>Avi<", "imageFileInfo/fileFormat"),
        ("<recordRate>10000</recordRate>", "", "frame rate"),
        ("</cih>", "", "no <cih>"),
        ("</imageDataInfo>", "", "not well-formed"),
        ("<sizeOfPixel>12.0<", "<sizeOfPixel>-2<", "sizeOfPixel"),
    ],
)
def test_damaged_headers_name_file_and_field(tmp_path, old, new, field):
    path = write_photron(tmp_path / "bad.cihx", frames(), exposure=1e-5, **SCALES)
    edit(path, old, new)
    with pytest.raises(InputError, match=r"bad\.") as caught:
        open_recording(path)
    assert field in str(caught.value)


def test_damaged_files_are_refused(tmp_path):
    path = write_photron(tmp_path / "a.cih", frames(), **SCALES)
    mraw = path.with_suffix(".mraw")
    mraw.write_bytes(mraw.read_bytes()[:-1])
    with pytest.raises(InputError, match=r"a\.mraw: is truncated: 6799 bytes"):
        open_recording(path, pixel_size=1e-5)
    mraw.unlink()
    with pytest.raises(InputError, match=r"a\.mraw: cannot be read"):
        open_recording(path, pixel_size=1e-5)
    for name, text in (("b.avi", b"RIFF not a video"), ("c.tif", b"II*\0 no"), ("d.mp4", b""), ("e.cih", b"")):
        (tmp_path / name).write_bytes(text)
        with pytest.raises(InputError, match=name):
            open_recording(tmp_path / name, **SCALES)
    for name in ("missing.cihx", "picture.xyz"):
        with pytest.raises(InputError, match=name):
            open_recording(tmp_path / name, **SCALES)
    (tmp_path / "empty").mkdir()
    with pytest.raises(InputError, match="no numbered image"):
        open_recording(tmp_path / "empty", **SCALES)
    (tmp_path / "f.xyz").write_bytes(b"1")
    with pytest.raises(InputError, match="unknown kind of recording"):
        open_recording(tmp_path / "f.xyz", **SCALES)


def test_a_truncated_video_is_refused_or_shorter_but_never_wrong(tmp_path):
    data = frames(40, (64, 64), high=255)
    path = write_video(tmp_path / "a.avi", data, play_rate=25.0)
    whole = path.read_bytes()
    for share in (0.1, 0.5, 0.9):
        path.write_bytes(whole[: int(share * len(whole))])
        try:
            with open_recording(path, **SCALES) as recording:
                got = list(recording)
        except InputError as error:
            assert "a.avi" in str(error)
        else:
            np.testing.assert_array_equal(np.stack(got)[:-1], data[: len(got) - 1])


@pytest.mark.parametrize(
    "region", [(0, 0, 0, 5), (0, 21, 0, 5), (-1, 4, 0, 5), (0, 4, 5), (0, 4, 30, 36), (0, 4.5, 0, 3)]
)
def test_a_region_must_lie_in_the_frame(tmp_path, region):
    path = write_photron(tmp_path / "a.cihx", frames(), **SCALES)
    with pytest.raises(InputError, match="region"):
        open_recording(path, region=region)


@pytest.mark.parametrize(
    "scale", [{"frame_rate": 0.0}, {"pixel_size": -1.0}, {"frame_rate": float("nan")}, {"pixel_size": "12"}]
)
def test_scales_must_be_positive_numbers(tmp_path, scale):
    path = write_photron(tmp_path / "a.cihx", frames(), **SCALES)
    with pytest.raises(InputError, match=next(iter(scale))):
        open_recording(path, **scale)


def test_writing_refuses_what_it_cannot_hold_and_leaves_nothing_behind(tmp_path):
    good = frames()
    cases = [
        ([], {}, "empty"),
        ([good[0], good[0][:-1]], {}, r"frames\[1\]"),
        ([good[0].astype(float)], {}, "integers"),
        ([good[0] + np.uint16(4096)], {}, r"\[0, 4095\]"),
        ([frames(1, (3, 5))[0]], {}, "even number"),
        (good, {"bit_depth": 10}, "bit_depth"),
        (good, {"skip": 0}, "skip"),
        (good, {"comment": "two\nlines"}, "comment"),
    ]
    for data, options, message in cases:
        with pytest.raises(InputError, match=message):
            write_photron(tmp_path / "bad.cihx", data, **SCALES, **options)
    with pytest.raises(InputError, match="not an existing folder"):
        write_photron(tmp_path / "nowhere" / "a.cihx", good, **SCALES)
    assert list(tmp_path.iterdir()) == []


FUZZ = settings(
    max_examples=150, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture], derandomize=True
)


@pytest.mark.parametrize("suffix", [".cihx", ".cih"])
@FUZZ
@given(at=st.integers(0, 2000), junk=st.binary(max_size=12), cut=st.integers(0, 12), size=st.integers(-40, 40))
def test_a_damaged_recording_opens_or_is_refused_but_never_crashes(tmp_path, suffix, at, junk, cut, size):
    path = tmp_path / f"fuzz{suffix}"
    if not (tmp_path / f"whole{suffix}").exists():
        write_photron(tmp_path / f"whole{suffix}", frames(2, (4, 6)), **SCALES)
    text = (tmp_path / f"whole{suffix}").read_bytes()
    at %= len(text)
    path.write_bytes(text[:at] + junk + text[at + cut :])
    pixels = (tmp_path / "whole.mraw").read_bytes()
    path.with_suffix(".mraw").write_bytes(pixels[: len(pixels) + size] if size < 0 else pixels + b"\0" * (size // 8))
    try:
        with open_recording(path, pixel_size=1e-5) as recording:
            assert np.isfinite(recording.time).all()
            for batch in recording.batches(1, stop=1):
                assert batch.shape == (1, *recording.shape)
    except InputError as error:
        assert "fuzz" in str(error)


def test_header_fields_are_read_from_both_kinds(tmp_path):
    for suffix in (".cih", ".cihx"):
        path = write_photron(tmp_path / f"a{suffix}", frames(), exposure=1.25e-6, comment="run 7", **SCALES)
        header = read_header(path)
        assert header.exposure == pytest.approx(1.25e-6)
        assert header.comment == "run 7"
        assert header.frame_rate == pytest.approx(1e4)


def test_a_missing_library_is_named_with_its_cure(tmp_path, monkeypatch):
    import sys

    (tmp_path / "a.avi").write_bytes(b"RIFF")
    monkeypatch.setitem(sys.modules, "av", None)
    with pytest.raises(InputError, match=r"a\.avi: reading it needs av; install it in .*: pip install"):
        open_recording(tmp_path / "a.avi", **SCALES)
