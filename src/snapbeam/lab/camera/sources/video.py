"""Video files and Phantom's .cine, decoded by PyAV."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from snapbeam.core.validate import InputError
from snapbeam.lab.camera.sources.base import FrameSource
from snapbeam.lab.plausibility.recording import KINDS, LOSSY_ERROR

__all__ = ["LOSSLESS", "VIDEO_SUFFIXES", "VideoSource"]

VIDEO_SUFFIXES = (".avi", ".mp4", ".mov", ".mkv", ".cine")
LOSSLESS = (
    "rawvideo", "ffv1", "huffyuv", "ffvhuff", "utvideo", "magicyuv", "lagarith", "png", "tiff", "bmp", "qtrle",
    "v210", "v410", "r210", "r10k", "zmbv", "flashsv",
)  # fmt: skip
"""Names of the codecs that give back the pictures that went in."""


class VideoSource(FrameSource):
    """A video file, decoded by PyAV.

    The rate in a video file is how fast it plays, seldom how fast it was recorded; it stands in the metadata
    as ``playback_rate`` and is no frame rate.
    """

    def __init__(self, path: Path) -> None:
        super().__init__(path)
        import av

        self._av = av
        self._decoder: Iterator[NDArray[np.integer]] | None = None
        self._next = 0
        self._container: Any = None
        try:
            with av.open(str(path)) as container:
                if not container.streams.video:
                    raise InputError(f"{path}: holds no video stream")
                stream = container.streams.video[0]
                count = sum(1 for packet in container.demux(stream) if packet.size)
                codec = stream.codec_context.name
                if path.suffix.lower() == ".cine":
                    self._cine(stream, container.metadata)
                else:
                    playback = stream.average_rate
                    rate = None if playback is None else float(playback)
                    self.metadata = {"format": f"video ({codec})", "playback_rate": rate}
                if codec not in LOSSLESS:
                    self.diagnostics += (KINDS["lossy"].found(error_px=LOSSY_ERROR),)
                    self.edge_error = LOSSY_ERROR
                name = stream.codec_context.pix_fmt or ""
                self.shape = (stream.codec_context.height, stream.codec_context.width)
        except (av.error.FFmpegError, OSError) as error:
            way_out = ""
            if path.suffix.lower() == ".cine":
                way_out = (
                    "; export it as an uncompressed AVI or as 16-bit TIFF images, and give frame_rate "
                    "(--frame-rate)"
                )
            raise InputError(f"{path}: cannot be read as a video ({error}){way_out}") from None
        if count == 0 or 0 in self.shape:
            raise InputError(f"{path}: the video holds no frame")
        if name not in ("gray", "gray8") and re.search(r"rgb|bgr|bayer|gbr|pal8", name):
            self.diagnostics += (KINDS["colour"].found(channels=3),)
        deep = re.search(r"(9|10|12|14|16|48)(le|be)", name)
        self._format = "gray16le" if deep else "gray"
        self.max_value = 65535 if deep else 255
        self.numbers = np.arange(count)

    def _cine(self, stream: Any, metadata: dict[str, str]) -> None:
        """What the header of a Phantom recording says: how fast it was recorded, for once."""
        rate = stream.average_rate or stream.base_rate or stream.guessed_rate
        self.frame_rate = float(rate) if rate else float(1 / stream.time_base)
        told = {**metadata, **stream.metadata}
        shutter = float(told.get("shutter_ns", 0))
        self.exposure = 1e-9 * shutter if 0.0 < 1e-9 * shutter <= 1.01 / self.frame_rate else None
        self.metadata = {"format": "Phantom cine", "record_rate": self.frame_rate}

    def _frames(self) -> Iterator[NDArray[np.integer]]:
        self._container = self._av.open(str(self.path))
        for frame in self._container.decode(video=0):
            yield frame.to_ndarray(format=self._format)

    def read(self, start: int, stop: int, rows: tuple[int, int]) -> NDArray[np.integer]:
        out = np.empty(
            (stop - start, rows[1] - rows[0], self.shape[1]), np.uint16 if self.max_value > 255 else np.uint8
        )
        if self._decoder is None or self._next > start:
            self.close()
            self._decoder, self._next = self._frames(), 0
        try:
            while self._next < stop:
                frame = next(self._decoder, None)
                if frame is None:
                    raise InputError(f"{self.path}: ends after frame {self._next} of {self.numbers.size}")
                if frame.shape != self.shape:
                    raise InputError(
                        f"{self.path}: frame {self._next} is of shape {frame.shape}, not {self.shape}"
                    )
                if self._next >= start:
                    out[self._next - start] = frame[rows[0] : rows[1]]
                self._next += 1
        except self._av.error.FFmpegError as error:
            raise InputError(f"{self.path}: frame {self._next} cannot be decoded ({error})") from None
        return out

    def close(self) -> None:
        if self._container is not None:
            self._container.close()
            self._container = None
        self._decoder = None
