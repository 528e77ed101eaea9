"""Displacement along a beam by image correlation, and its modes: known motions of speckle and of edges, with noise."""

from __future__ import annotations

import numpy as np
import pytest
import tifffile

import snapbeam as sb
from snapbeam import InputError, lab
from snapbeam.model import default_values

RATE, PIXEL = 1500.0, 250e-6  # Hz, m: the whole beam in 640 pixels
WIDTH, HEIGHT, ROWS = 640, 96, (30, 60)
FINE = 8  # points of a pixel
MODEL = sb.ReducedModel.from_beam(default_values.BEAM, modes=4, damping_ratio=0.005)
TIME = np.arange(40) / RATE
FIRST = 3  # columns left of the beam's end


def speckle(rng):
    """Levels of a speckle pattern with dots of some three pixels, finer than the pixels along the motion."""
    grains = rng.standard_normal((HEIGHT * FINE, WIDTH))
    ky, kx = np.fft.fftfreq(HEIGHT * FINE)[:, None] * FINE, np.fft.fftfreq(WIDTH)[None]
    smooth = np.fft.ifft2(np.fft.fft2(grains) * np.exp(-2.0 * (np.pi * 1.3) ** 2 * (kx**2 + ky**2))).real
    return 0.5 + 0.15 * smooth / smooth.std()


def bar(rng):
    """A bright bar with two blurred edges and no texture."""
    row = (np.arange(HEIGHT * FINE) + 0.5) / FINE - 0.5
    level = 0.2 + 0.6 / (1.0 + np.exp(-(row - 38.0) / 0.5)) / (1.0 + np.exp((row - 52.0) / 0.5))
    return np.broadcast_to(level[:, None], (HEIGHT * FINE, WIDTH))


def frames(pattern, shift, noise, rng):
    """Frames of a pattern that is shifted by rows *shift* (frames, columns), integrated over each pixel."""
    fine = (np.arange(HEIGHT * FINE) + 0.5) / FINE - 0.5
    out = np.empty((shift.shape[0], HEIGHT, WIDTH), dtype=np.uint16)
    for k, rows in enumerate(shift):
        moved = np.stack([np.interp(fine - each, fine, pattern[:, j]) for j, each in enumerate(rows)], axis=1)
        light = moved.reshape(HEIGHT, FINE, WIDTH).mean(1) + noise * rng.standard_normal((HEIGHT, WIDTH))
        out[k] = np.clip(np.round(4095 * light), 0, 4095)
    return out


def moved(seed, pattern, noise, folder, size=1.0):
    """A recording, its true displacement [m] over time and columns, and the amplitudes of its modes."""
    rng = np.random.default_rng(seed)
    place = (np.arange(WIDTH) - FIRST) * PIXEL / default_values.BEAM.length
    shapes = np.where((place >= 0.0) & (place <= 1.0), MODEL.shape_at(np.clip(place, 0.0, 1.0)).T, 0.0)
    turn = 2.0 * np.pi * TIME[:, None]
    amplitude = np.sin(turn * [120.0, 200.0, 310.0, 500.0] + [0.0, 1.0, 2.0, 0.5]) * [3e-3, 1e-3, 4e-4, 1e-4]
    amplitude *= size * (TIME >= 8 / RATE)[:, None]
    truth = amplitude @ shapes
    path = folder / "frames.tif"
    tifffile.imwrite(path, frames(pattern(rng), -truth / PIXEL, noise, rng))
    return path, truth, amplitude


def block_means(truth, block):
    return truth[:, : WIDTH // block * block].reshape(TIME.size, -1, block).mean(2)


@pytest.mark.sampled(3)
@pytest.mark.parametrize(("pattern", "noise"), [(speckle, 0.01), (speckle, 0.04), (bar, 0.01)])
def test_standard_errors_cover_the_displacement(pattern, noise, tmp_path):
    """Two standard errors cover 88 to 98.5 % of all blocks and frames, and errors are hundredths of a pixel."""
    path, truth, _ = moved(1, pattern, noise, tmp_path)
    with lab.open_recording(path, frame_rate=RATE, pixel_size=PIXEL) as recording:
        field = lab.full_field(recording, ROWS, block=16, rest_frames=8)
    late = slice(8, None)
    miss = field.displacement.values[late] - block_means(truth, 16)[late]
    error = field.displacement_se.values[late]
    assert np.isfinite(miss).all()
    assert np.ptp(truth) > 2.5 * PIXEL
    assert 0.88 < np.mean(np.abs(miss) < 2.0 * error) < 0.985
    mesh = field.snapbeam.plot().collections[0]
    np.testing.assert_allclose(mesh.get_array(), 1e6 * field.displacement.T)
    assert np.sqrt(np.mean(miss**2)) < (0.02 if noise < 0.02 else 0.05) * PIXEL


def test_modes_follow_with_their_errors_and_phases(tmp_path):
    """Amplitudes of four modes within their errors; the phase of each by a sine."""
    path, _, amplitude = moved(2, speckle, 0.02, tmp_path)
    with lab.open_recording(path, frame_rate=RATE, pixel_size=PIXEL) as recording:
        field = lab.full_field(recording, ROWS, block=16, rest_frames=8)
    # blocks beyond the clamp do not move, and are no part of the beam
    field = field.sel(position=slice((FIRST + 8) * PIXEL, None))
    found = lab.modal_amplitudes(
        field, MODEL, contact=(FIRST + 322) * PIXEL, location=322 * PIXEL / default_values.BEAM.length
    )
    late = slice(8, None)
    miss = (found.modal_amplitude.values - amplitude)[late] / found.modal_amplitude_se.values[late]
    assert 0.88 < np.mean(np.abs(miss) < 2.0) < 0.99
    assert float(found.residual[late].mean()) < 0.03 * PIXEL and found.attrs["condition"] < 10.0
    signal = lab.make_signal(found.modal_amplitude.values[late, 0], "1", RATE, start=8 / RATE)
    fit = lab.fit_sine(signal, 120.0)
    phase = np.angle(np.exp(1j * (fit.phase + 0.5 * np.pi)))  # of sine from zero, at time 0
    assert abs(phase) < 5.0 * fit.phase_se + 0.02 and abs(fit.amplitude - 3e-3) < 5.0 * fit.amplitude_se + 1e-5


def test_columns_and_lost_blocks(tmp_path):
    """A beam that stands upright gives the same numbers; a block that is covered is lost, and found again."""
    path, truth, _ = moved(3, speckle, 0.02, tmp_path)
    pictures = tifffile.imread(path)
    pictures[20:25, :, 160:176] = 4095
    tifffile.imwrite(tmp_path / "upright.tif", np.ascontiguousarray(pictures.transpose(0, 2, 1)))
    with lab.open_recording(tmp_path / "upright.tif", frame_rate=RATE, pixel_size=PIXEL) as recording:
        field = lab.full_field(recording, ROWS, block=16, rest_frames=8, motion="columns")
    lost = ~np.isfinite(field.displacement.values)
    assert lost[20:25, 10].all() and lost.sum() == 5
    miss = field.displacement.values[25:, 10] - block_means(truth, 16)[25:, 10]
    assert np.abs(miss).max() < 5.0 * float(field.displacement_se.median())


def test_refusals(tmp_path):
    path = tmp_path / "even.tif"
    tifffile.imwrite(path, np.full((12, 40, 64), 1000, dtype=np.uint16))
    with lab.open_recording(path, frame_rate=RATE, pixel_size=PIXEL) as recording:
        for rows, more, words in (
            ((10, 30), {}, "no texture and no edge"),
            ((0, 30), {}, "at least 8 rows between 2 and 38 of the 40"),
            ((20, 24), {}, "at least 8 rows"),
            ((2, 38), {"block": 65}, "block = 65"),
            ((2, 38), {"rest_frames": 13}, "rest_frames = 13"),
            ((2, 38), {"motion": "up"}, "motion = 'up'"),
            ("all", {}, "rows = 'all'"),
        ):
            with pytest.raises(InputError, match=words):
                lab.full_field(recording, rows, **more)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"contact": 0.0}, "reaches from 0.562 to 1.43 of the length"),
        ({"modes": 5}, "modes = 5"),
        ({"position": np.linspace(0.079, 0.082, 20)}, r"modes = 4: their shapes cannot be told apart from 0.49"),
        ({"position": np.linspace(0.01, 0.15, 3)}, "with 3 blocks"),
    ],
)
def test_views_that_do_not_tell_modes_apart(change, words):
    import xarray as xr

    position = change.pop("position", np.linspace(0.01, 0.15, 30))
    zero = np.zeros((2, position.size))
    field = xr.Dataset(
        {"displacement": (("time", "position"), zero), "displacement_se": (("time", "position"), zero + 1e-6)},
        {"time": [0.0, 1.0], "position": position},
    )
    with pytest.raises(InputError, match=words):
        lab.modal_amplitudes(field, MODEL, **({"contact": 0.0805, "location": 0.5} | change))
