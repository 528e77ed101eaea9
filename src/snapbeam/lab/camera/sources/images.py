"""Numbered images, one a frame."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from snapbeam.core.validate import InputError
from snapbeam.lab.camera.photron.header import CameraHeader
from snapbeam.lab.camera.sources.base import FrameSource, grey_of, scaled_floats
from snapbeam.lab.camera.sources.photron import take_header
from snapbeam.lab.camera.sources.tiff import TIFF_SUFFIXES, float_range
from snapbeam.lab.plausibility.recording import KINDS, LOSSY_ERROR

__all__ = ["IMAGE_SUFFIXES", "ImageSource", "images_of_header", "load_image"]

IMAGE_SUFFIXES = (*TIFF_SUFFIXES, ".png", ".bmp", ".jpg", ".jpeg")


def load_image(file: Path, *, grey: bool = True) -> NDArray[Any]:
    """One picture of 8 or 16 bits or floating point numbers, (height, width), or with colours last.

    Raises
    ------
    InputError
        If the file is no such picture.
    """
    import cv2

    try:
        raw = np.fromfile(file, dtype=np.uint8)
    except OSError as error:
        raise InputError(f"{file}: cannot be read ({error.strerror})") from None
    image = cv2.imdecode(raw, cv2.IMREAD_UNCHANGED) if raw.size else None
    if image is None:
        raise InputError(f"{file}: cannot be read as an image")
    if image.dtype not in (np.uint8, np.uint16, np.float32, np.float64):
        raise InputError(f"{file}: pixels of type {image.dtype}: must be 8 or 16 bits or floating point")
    if image.ndim == 3:
        image = image[..., 2::-1]
    return grey_of(image) if grey and image.ndim == 3 else image


def images_of_header(header: CameraHeader) -> FrameSource:
    """The numbered images beside a header that says its pixels are in images.

    Those whose names begin with the header's; where there are none, all of that kind in its folder.

    Raises
    ------
    InputError
        If they are missing, or their number or size is not what the header says.
    """
    folder = header.path.parent
    kinds = (".tif", ".tiff") if header.image_suffix == ".tif" else (header.image_suffix,)
    kinds = (".jpg", ".jpeg") if header.image_suffix == ".jpg" else kinds
    beside = sorted(one for one in folder.iterdir() if one.suffix.lower() in kinds)
    own = [one for one in beside if one.name.startswith(header.path.stem)] or beside
    if not own:
        raise InputError(
            f"{header.path}: its pixels are in {header.image_suffix} images, but none is beside it"
        )
    source = ImageSource(header.path, own)
    if len(own) != header.frame_count or source.shape != (header.height, header.width):
        raise InputError(
            f"{header.path}: says {header.frame_count} frames of {header.height} x {header.width} pixels; beside it "
            f"are {len(own)} {header.image_suffix} images of {source.shape[0]} x {source.shape[1]}"
        )
    found = source.diagnostics
    take_header(source, header)
    source.diagnostics += found
    if source.max_value > header.max_value and header.effective_side == "lower":
        source.max_value = header.max_value
    return source


class ImageSource(FrameSource):
    """Numbered images, one a frame: a folder, or a pattern such as ``test_*.tif``.

    The last number in each name is the number of its frame; a number that is absent is a frame that is
    missing, and stays one.
    """

    def __init__(self, path: Path, names: list[Path] | None = None) -> None:
        super().__init__(path)
        folder, pattern = (path, "*") if path.is_dir() else (path.parent, path.name)
        if names is None:
            names = [one for one in sorted(folder.glob(pattern)) if one.suffix.lower() in IMAGE_SUFFIXES]
        numbered: dict[int, Path] = {}
        for one in names:
            digits = re.findall(r"\d+", one.stem)
            if not digits:
                raise InputError(f"{one}: an image of a recording carries its number in its name")
            number = int(digits[-1])
            if number in numbered or number >= 2**40:
                why = "doubles one" if number in numbered else "is too large"
                raise InputError(f"{one}: the number {number} {why} in {folder}")
            numbered[number] = one
        if not numbered:
            raise InputError(f"{path}: holds no numbered image ({', '.join(IMAGE_SUFFIXES)})")
        order = sorted(numbered)
        if order[-1] - order[0] > 20 * len(order) + 1000:
            after = int(np.argmax(np.diff(order))) + 1
            raise InputError(
                f"{numbered[order[after]]}: the number {order[after]} follows {order[after - 1]}; too many "
                "frames would be missing, so number the images of one recording in a row"
            )
        self._files = [numbered[number] for number in order]
        self.numbers = np.array(order, dtype=np.int64) - order[0]
        self._full = 0.0
        first = self._load(0)
        self.shape = (first.shape[0], first.shape[1])
        self._dtype = first.dtype
        if first.dtype.kind == "f":
            count = len(self._files)
            self._full = float_range([self._load(k) for k in {0, count // 2, count - 1}], path)
            self.max_value = 65535
        else:
            self.max_value = int(np.iinfo(first.dtype).max)
        self.metadata = {"format": "numbered images", "first_number": order[0]}
        if any(one.suffix.lower() in (".jpg", ".jpeg") for one in self._files):
            self.diagnostics += (KINDS["lossy"].found(error_px=LOSSY_ERROR),)
            self.edge_error = LOSSY_ERROR

    def _load(self, index: int) -> NDArray[Any]:
        image = load_image(self._files[index], grey=False)
        if image.ndim == 3:
            if not any(one.code == KINDS["colour"].code for one in self.diagnostics):
                self.diagnostics += (KINDS["colour"].found(channels=image.shape[2]),)
            image = grey_of(image)
        return image

    def read(self, start: int, stop: int, rows: tuple[int, int]) -> NDArray[np.integer]:
        kind = np.uint16 if self._full else self._dtype
        out = np.empty((stop - start, rows[1] - rows[0], self.shape[1]), dtype=kind)
        for index in range(start, stop):
            image = self._load(index)
            if image.shape != self.shape or image.dtype != self._dtype:
                raise InputError(
                    f"{self._files[index]}: shape {image.shape} and type {image.dtype} differ from the first "
                    f"frame's {self.shape} and {self._dtype}"
                )
            part = image[rows[0] : rows[1]]
            levels = scaled_floats(part, self._full) if self._full else part
            if levels is None:
                raise InputError(f"{self._files[index]}: holds numbers outside 0 to {self._full:g}")
            out[index - start] = levels
        return out
