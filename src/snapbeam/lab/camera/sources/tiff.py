"""TIFF files of many pages."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from snapbeam.core.validate import InputError
from snapbeam.lab.camera.sources.base import FrameSource, grey_of, scaled_floats
from snapbeam.lab.plausibility.recording import KINDS, LOSSY_ERROR

__all__ = ["TIFF_SUFFIXES", "TiffSource", "float_range"]

TIFF_SUFFIXES = (".tif", ".tiff")
_LENGTH_UNITS = {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "um": 1e-6, "micron": 1e-6, "µm": 1e-6, "\\u00b5m": 1e-6}


def _is_picture(shape: tuple[int, ...], dtype: Any) -> bool:
    """Whether a page holds grey levels, or colours in its last axis, of a kind that is read."""
    size = len(shape) == 2 or (len(shape) == 3 and shape[-1] in (3, 4))
    return size and all(shape) and (dtype.kind == "f" or (dtype.kind == "u" and dtype.itemsize <= 2))


def float_range(pictures: list[NDArray[Any]], path: Path) -> float:
    """What full scale is in pictures of floating point numbers: 1, or the next of 8, 10, 12, 14 and 16 bits.

    Raises
    ------
    InputError
        If the numbers are no grey levels.
    """
    top = float(np.max([one.max() for one in pictures]))  # NaN if any is
    low = float(np.min([one.min() for one in pictures]))
    if not (np.isfinite(top) and low >= 0.0 and 0.0 < top <= 65535.0):
        raise InputError(
            f"{path}: pictures of numbers from {low:g} to {top:g}: must lie in [0, 1], or be grey levels up to 65535"
        )
    return next(full for full in (1.0, 255.0, 1023.0, 4095.0, 16383.0, 65535.0) if top <= full)


class TiffSource(FrameSource):
    """A TIFF file of many pages.  ImageJ's frame interval and calibrated pixel size are used if present."""

    def __init__(self, path: Path) -> None:
        super().__init__(path)
        import tifffile

        try:
            self._file = tifffile.TiffFile(path)
            pages = self._file.pages
            count = len(pages)
            first = pages[0] if count else None
            if first is None or first.dtype is None or not _is_picture(first.shape, first.dtype):
                kind = "no page" if first is None else f"pages of shape {first.shape} and type {first.dtype}"
                raise InputError(
                    f"{path}: holds {kind}; a recording has pages of grey levels or red, green and blue, unsigned "
                    "integers of 8 or 16 bits or floating point numbers"
                )
            self.shape = (int(first.shape[0]), int(first.shape[1]))
            self._dtype = first.dtype
            self._colors = first.ndim == 3
            if self._colors:
                self.diagnostics += (KINDS["colour"].found(channels=first.shape[2]),)
            if str(getattr(first.compression, "name", "NONE")).upper() in (
                "JPEG",
                "OJPEG",
                "JPEG2000",
                "WEBP",
            ):
                self.diagnostics += (KINDS["lossy"].found(error_px=LOSSY_ERROR),)
                self.edge_error = LOSSY_ERROR
            self._imagej(self._file.imagej_metadata or {}, first)
        except InputError:
            raise
        except Exception as error:  # a damaged file makes tifffile raise many kinds
            raise InputError(f"{path}: cannot be read as a TIFF file ({error})") from None
        self.numbers = np.arange(count)
        self._full = 0.0
        if self._dtype.kind == "f":
            self._full = float_range([self._page(k) for k in {0, count // 2, count - 1}], path)
            self.max_value = 65535
        else:
            self.max_value = int(np.iinfo(self._dtype).max)

    def _imagej(self, values: dict[str, Any], page: Any) -> None:
        self.metadata = {
            "format": "TIFF stack",
            **{k: v for k, v in values.items() if k in ("fps", "finterval")},
        }
        interval = values.get("finterval")
        if isinstance(interval, (int, float)) and interval > 0.0:
            self.frame_rate = 1.0 / float(interval)
        unit = _LENGTH_UNITS.get(str(values.get("unit", "")))
        resolution = page.tags.get("XResolution")
        if unit is not None and resolution is not None and resolution.value[0] > 0:
            self.pixel_size = unit * resolution.value[1] / resolution.value[0]

    def _page(self, index: int) -> NDArray[Any]:
        try:
            image = self._file.pages[index].asarray()
        except Exception as error:  # a damaged page makes tifffile raise many kinds
            raise InputError(f"{self.path}: page {index} cannot be read ({error})") from None
        if image.shape[:2] != self.shape or (image.ndim == 3) != self._colors:
            raise InputError(f"{self.path}: page {index} is of shape {image.shape}, not {self.shape}")
        return grey_of(image) if self._colors else image

    def read(self, start: int, stop: int, rows: tuple[int, int]) -> NDArray[np.integer]:
        kind = np.uint16 if self._full else self._dtype
        out = np.empty((stop - start, rows[1] - rows[0], self.shape[1]), dtype=kind)
        for index in range(start, stop):
            image = self._page(index)[rows[0] : rows[1]]
            levels = scaled_floats(image, self._full) if self._full else image
            if levels is None:
                raise InputError(
                    f"{self.path}: page {index} holds numbers outside 0 to {self._full:g}, the range of the others"
                )
            out[index - start] = levels
        return out

    def close(self) -> None:
        self._file.close()
