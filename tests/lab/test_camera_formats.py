"""Every kind of file that cameras and their programs write gives back the pictures that went in, or says why not."""

import numpy as np
import pytest
from cine_file import write_cine
from mistakes.headers import HEADERS, images, with_pixels

from snapbeam import InputError
from snapbeam.lab import open_recording, write_photron

SCALES = {"frame_rate": 10_000.0, "pixel_size": 12e-6}


def pictures(high=4095, shape=(5, 20, 34), seed=0):
    kind = np.uint8 if high < 256 else np.uint16
    return np.random.default_rng(seed).integers(0, high, shape, endpoint=True).astype(kind)


def read(path, **scales):
    """The frames of a recording, what it says of itself, and the codes of its diagnostics."""
    with open_recording(path, **(SCALES | scales)) as recording:
        return np.stack(list(recording)), recording, {one.code for one in recording.diagnostics}


@pytest.mark.parametrize("high", [255, 4095])
def test_phantom(tmp_path, high):
    data = pictures(high)
    path = write_cine(tmp_path / "a.cine", data, frame_rate=20_000, exposure=20e-6)
    found, recording, _ = read(path, frame_rate=None)
    # 12 bits fill the 16 that ffmpeg gives: their upper ones are the camera's
    np.testing.assert_array_equal(found if high == 255 else found >> 4, data)
    assert recording.frame_rate == 20_000.0
    assert recording.exposure == pytest.approx(20e-6)
    assert recording.max_value == (255 if high == 255 else 65535)


# Levels of the library pycine (pycine.linLUT) for light of 12 bits, by packed levels of 10 bits.
PYCINE = {
    1: 5, 30: 33, 64: 64, 100: 98, 140: 136, 146: 141, 150: 145, 200: 204, 300: 374, 400: 623, 500: 952, 600: 1368,
    700: 1872, 800: 2468, 900: 3159, 1000: 3947, 1014: 4064, 1015: 4095, 1023: 4095,
}  # fmt: skip


def test_packed_phantom_levels_are_proportional_to_light(tmp_path):
    """Packed 10 bits follow a curve of about light^0.52; read as linear, half the light was 73 % of full scale."""
    levels = np.arange(1024, dtype=np.uint16).reshape(1, 16, 64)
    write_cine(tmp_path / "a.cine", levels, frame_rate=20_000, exposure=20e-6, bits=10, packing=256)
    found, recording, codes = read(tmp_path / "a.cine", frame_rate=None)
    light = (found.ravel() >> 4).astype(int)
    for level, expected in PYCINE.items():
        assert abs(light[level] - expected) <= 1, level
    assert (np.diff(light) >= 0).all() and recording.max_value == 65535 and not codes
    half = np.searchsorted(light, 2064)
    assert half / 1023 == pytest.approx(0.72, abs=0.01)


@pytest.mark.parametrize(("bits", "packing"), [(12, 256), (14, 256), (12, 1024)])
def test_other_packings_of_phantom_say_how_to_export(tmp_path, bits, packing):
    path = write_cine(
        tmp_path / "a.cine", pictures(1023, (2, 16, 64)), frame_rate=20_000, exposure=20e-6, bits=bits, packing=packing
    )
    with pytest.raises(InputError, match=r"a\.cine.*export it as .*AVI.*TIFF.*--frame-rate"):
        open_recording(path, pixel_size=1e-5)


def test_a_phantom_file_that_cannot_be_read_says_how_to_export_it(tmp_path):
    path = write_cine(tmp_path / "a.cine", pictures(255), frame_rate=20_000, exposure=20e-6)
    for damage in (path.read_bytes()[:3000], path.read_bytes()[:4] + b"\x09" + path.read_bytes()[5:]):
        path.write_bytes(damage)
        with pytest.raises(InputError, match=r"a\.cine.*export it as .*AVI.*TIFF.*--frame-rate"):
            open_recording(path, pixel_size=1e-5)


def test_arrays_of_numpy(tmp_path):
    for high in (255, 4095):
        np.save(tmp_path / "a.npy", pictures(high))
        np.testing.assert_array_equal(read(tmp_path / "a.npy")[0], pictures(high))
    with pytest.raises(InputError, match=r"frame rate is not in the file; give frame_rate \(--frame-rate\)"):
        open_recording(tmp_path / "a.npy", pixel_size=1e-5)
    np.save(tmp_path / "a.npy", pictures().astype(np.int64))
    with pytest.raises(InputError, match=r"type int64: must be .* unsigned integers of 8 or 16 bits or floating"):
        open_recording(tmp_path / "a.npy", **SCALES)
    np.save(tmp_path / "a.npy", np.array([{}], dtype=object), allow_pickle=True)
    with pytest.raises(InputError, match="cannot be read as a stack of pictures"):
        open_recording(tmp_path / "a.npy", **SCALES)


def test_arrays_of_hdf5(tmp_path):
    h5py = pytest.importorskip("h5py")
    data = pictures()
    with h5py.File(tmp_path / "a.h5", "w") as file:
        stack = file.create_dataset("run/frames", data=data, chunks=(1, 20, 34), compression="gzip")
        stack.attrs["frame_rate"], file.attrs["pixel_size"] = 5000.0, 20e-6
        file["time"] = np.arange(5.0)
    with open_recording(tmp_path / "a.h5", region=(2, 9, 3, 30)) as recording:
        np.testing.assert_array_equal(np.stack(list(recording)), data[:, 2:9, 3:30])
        assert recording.frame_rate == 5000.0 and recording.pixel_size == 20e-6
    with h5py.File(tmp_path / "a.h5", "a") as file:
        file["dark"] = data[:1]
    with pytest.raises(InputError, match=r"2 stacks of pictures \(dark, run/frames\); name one as in a\.h5::name"):
        open_recording(tmp_path / "a.h5")
    np.testing.assert_array_equal(read(tmp_path / "a.h5::run/frames", frame_rate=None)[0], data)
    with h5py.File(tmp_path / "a.h5", "a") as file:
        file["run/frames"].attrs["frame_rate"] = -5000.0
    with pytest.raises(InputError, match=r"'frame_rate' = .*must be a positive number"):
        open_recording(tmp_path / "a.h5::run/frames")


def test_colours_and_floating_point_numbers_in_tiff(tmp_path):
    tifffile = pytest.importorskip("tifffile")
    grey = pictures(255)
    tifffile.imwrite(tmp_path / "rgb.tif", np.repeat(grey[..., None], 3, axis=3), photometric="rgb")
    found, _, codes = read(tmp_path / "rgb.tif")
    np.testing.assert_array_equal(found, grey)
    assert codes == {"recording.colour"}
    for full in (1.0, 4095.0):
        shares = (grey / 255.0 * full).astype(np.float32)
        shares[0, 0, 0] = full
        tifffile.imwrite(tmp_path / "float.tif", shares, photometric="minisblack")
        found, recording, _ = read(tmp_path / "float.tif")
        np.testing.assert_allclose(found / recording.max_value, shares / full, atol=1e-5)
    shares[2] = np.nan
    tifffile.imwrite(tmp_path / "float.tif", shares, photometric="minisblack")
    with pytest.raises(InputError, match=r"float\.tif: pictures of numbers from"):
        open_recording(tmp_path / "float.tif", **SCALES)


def test_eight_bits_of_twelve_as_the_camera_s_program_saves_them(tmp_path):
    path = with_pixels(tmp_path, "showcase.cih")
    found, recording, codes = read(path, frame_rate=15_000.0)
    np.testing.assert_array_equal(found, images(75, 40, 640, 8))
    assert recording.max_value == 255 and codes == {"recording.contradiction"}
    assert recording.exposure == pytest.approx(65.060e-6)
    path.write_text(path.read_text().replace("Side : Higher", "Side : Lower"))
    with pytest.raises(InputError, match="lower 8 bits of 12 were stored, so bright pixels wrap around"):
        open_recording(path, **SCALES)


def test_sixteen_bits_of_twelve_and_the_step_between_frames(tmp_path):
    path = with_pixels(tmp_path, "switch.cih")
    with pytest.raises(InputError, match=r"every 36th of 677 .* 19 frames, but there are 12; frame_rate \(--frame"):
        open_recording(path, pixel_size=1e-5)
    found, recording, _ = read(path, frame_rate=60_000.0)
    np.testing.assert_array_equal(found, images(12, 368, 896, 16))
    assert recording.max_value == 4095 and recording.exposure == pytest.approx(1.25e-6)


def test_a_step_that_the_numbers_of_frames_bear_out_is_used(tmp_path):
    path = with_pixels(tmp_path, "switch.cih")
    path.write_text(path.read_text().replace("Frame : 677", "Frame : 432"))
    _, recording, codes = read(path, frame_rate=None)
    assert recording.frame_rate == pytest.approx(60_000.0 / 36) and not codes


def test_a_rate_that_a_program_made_up_is_asked_for(tmp_path):
    for name in ("generated.cih", "images.cih"):
        with pytest.raises(InputError, match=r"writes 1 frame per second where it is not told.*--frame-rate"):
            open_recording(with_pixels(tmp_path, name), pixel_size=1e-5)


@pytest.mark.parametrize(("kind", "suffix"), [("PNG", "png"), ("TIFF", "tif")])
def test_a_header_whose_pixels_are_in_images(tmp_path, kind, suffix):
    path = with_pixels(tmp_path, "images.cih")
    if kind == "TIFF":
        tifffile = pytest.importorskip("tifffile")
        for k, one in enumerate(images(10, 128, 256, 16)):
            tifffile.imwrite(tmp_path / f"images{k:06d}.tif", one)
        path.write_text(path.read_text().replace("File Format : PNG", "File Format : TIFF"))
    found, recording, _ = read(path)
    np.testing.assert_array_equal(found, images(10, 128, 256, 16))
    assert recording.max_value == 4095 and recording.frame_rate == 10_000.0
    (tmp_path / f"images000004.{suffix}").unlink()
    with pytest.raises(InputError, match=rf"says 10 frames of 128 x 256 pixels; beside it are 9 \.{suffix} images"):
        open_recording(path, **SCALES)


def test_raw_pixels_of_a_cihx_header(tmp_path):
    """Pixels that no program has turned to colours: grey ones stay, a mosaic of filters is evened out and said."""
    grey = pictures(3000, (3, 40, 60)) // 60 + 2000
    path = write_photron(tmp_path / "raw.cihx", grey, bit_depth=12, **SCALES)
    text = path.read_text()
    assert "<type>Mono</type>" in text
    path.write_text(text.replace("<type>Mono</type>", "<type>Raw</type>"))
    found, _, codes = read(path)
    np.testing.assert_array_equal(found, grey)
    assert not codes
    mosaic = grey.copy()
    mosaic[:, ::2, ::2] //= 2
    path = write_photron(tmp_path / "raw.cihx", mosaic, bit_depth=12, **SCALES)
    path.write_text(path.read_text().replace("<type>Mono</type>", "<type>Raw</type>"))
    found, _, codes = read(path)
    assert codes == {"recording.mosaic"}
    kinds = [found[:, y::2, x::2].mean() for y in (0, 1) for x in (0, 1)]
    assert np.ptp(kinds) < 0.01 * np.mean(kinds)
    path.write_text(path.read_text().replace("<type>Raw</type>", "<type>Color</type>"))
    with pytest.raises(InputError, match="must be Mono or Raw; save the recording in grey levels"):
        open_recording(path, **SCALES)


def test_every_retyped_header_is_tried():
    assert set(HEADERS) == {
        "showcase.cih",
        "switch.cih",
        "beam_2k.cih",
        "generated.cih",
        "images.cih",
        "contradiction.cihx",
    }
