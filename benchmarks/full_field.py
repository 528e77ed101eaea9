"""Image correlation beside pyidi and trackpy on the same speckle recording: ``python -m benchmarks.full_field``.

pyidi (1.4) and trackpy (0.7) are not installed by ``make``: ``pip install pyidi trackpy``.
"""

from __future__ import annotations

import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

_Array = NDArray[np.float64]
PIXEL = 250e-6  # m
COUNT, HEIGHT, WIDTH, BLOCK, ROWS, REST = 200, 96, 640, 16, (30, 60), 8
FINE = 8


def recording(noise: float, seed: int = 1) -> tuple[NDArray[np.uint16], _Array]:
    """Frames of a speckle pattern that bends by less than a pixel, and the true shift [px] over frames and columns."""
    rng = np.random.default_rng(seed)
    ky, kx = np.fft.fftfreq(HEIGHT * FINE)[:, None] * FINE, np.fft.fftfreq(WIDTH)[None]
    grains = np.fft.fft2(rng.standard_normal((HEIGHT * FINE, WIDTH)))
    pattern = np.fft.ifft2(grains * np.exp(-2.0 * (np.pi * 1.3) ** 2 * (kx**2 + ky**2))).real
    pattern = 0.5 + 0.15 * pattern / pattern.std()
    shape = 0.5 * (1.0 - np.cos(2.0 * np.pi * np.arange(WIDTH) / WIDTH))
    truth = 0.8 * np.sin(2.0 * np.pi * np.maximum(np.arange(COUNT) - REST, 0) / 40.0)[:, None] * shape
    fine = (np.arange(HEIGHT * FINE) + 0.5) / FINE - 0.5
    frames = np.empty((COUNT, HEIGHT, WIDTH), dtype=np.uint16)
    for k, shift in enumerate(truth):
        moved = np.stack([np.interp(fine - each, fine, pattern[:, j]) for j, each in enumerate(shift)], axis=1)
        light = moved.reshape(HEIGHT, FINE, WIDTH).mean(1) + noise * rng.standard_normal((HEIGHT, WIDTH))
        frames[k] = np.clip(np.round(4095 * light), 0, 4095)
    return frames, truth


def with_snapbeam(frames: NDArray[np.uint16], folder: Path) -> _Array:
    """Shift of each block over the frames, px."""
    import tifffile

    from snapbeam import lab

    path = folder / "frames.tif"
    if not path.exists():
        tifffile.imwrite(path, frames)
    with lab.open_recording(path, frame_rate=1e3, pixel_size=PIXEL) as opened:
        field = lab.full_field(opened, ROWS, block=BLOCK, rest_frames=REST)
    return np.asarray(-field["displacement"].values / PIXEL)


def with_pyidi(frames: NDArray[np.uint16], folder: Path) -> _Array:
    """The same by the Lucas-Kanade method of pyidi, with the same blocks and the mean at rest as its reference."""
    import pyidi

    method: Any = pyidi.LucasKanade(pyidi.VideoReader(frames, root=str(folder)))
    middle = sum(ROWS) // 2
    method.set_points(np.array([[middle, BLOCK * k + BLOCK // 2] for k in range(WIDTH // BLOCK)]))
    size = (ROWS[1] - ROWS[0] + 1, BLOCK - 1)
    method.configure(roi_size=size, reference_image=(0, REST), verbose=0, show_pbar=False)
    return np.asarray(method.get_displacements(autosave=False))[:, :, 0].T


def with_trackpy(frames: NDArray[np.uint16], truth: _Array) -> _Array:
    """Errors of single dots that trackpy follows, px."""
    import trackpy

    trackpy.quiet()
    dots = trackpy.link(trackpy.batch(frames[:, ROWS[0] - 8 : ROWS[1] + 8], 7, processes=1), 3, memory=1)
    first = dots[dots.frame == 0].set_index("particle")
    dots = dots[dots.frame >= REST].join(first[["y", "x"]], on="particle", rsuffix="_0", how="inner")
    column = np.clip(np.round(dots.x_0.to_numpy()).astype(int), 0, WIDTH - 1)
    return np.asarray(dots.y - dots.y_0) - truth[dots.frame.to_numpy().astype(int), column]


def main() -> None:
    """Print root mean square errors and seconds."""
    for noise in (0.01, 0.04):
        frames, truth = recording(noise)
        mean = truth.reshape(COUNT, -1, BLOCK).mean(2)
        with tempfile.TemporaryDirectory() as name:
            folder = Path(name)
            ways: dict[str, Callable[[], _Array]] = {
                "snapbeam": lambda: with_snapbeam(frames, folder) - mean,  # noqa: B023
                "pyidi": lambda: with_pyidi(frames, folder) - mean,  # noqa: B023
                "trackpy": lambda: with_trackpy(frames, truth),  # noqa: B023
            }
            for way, measure in ways.items():
                try:
                    measure()  # what is compiled is compiled
                    begun = time.perf_counter()
                    error = measure()
                    took = time.perf_counter() - begun
                except ImportError as missing:
                    print(f"{way} left out: {missing}", file=sys.stderr)
                    continue
                error = error[REST:] if error.ndim == 2 else error
                print(f"noise {noise}: {way}, {np.sqrt(np.mean(error**2)):.4f} px, {took:.2f} s")


if __name__ == "__main__":
    main()
