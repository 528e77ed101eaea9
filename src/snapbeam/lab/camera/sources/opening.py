"""The source for a path, chosen by its suffix."""

from __future__ import annotations

from pathlib import Path

from snapbeam.core.validate import InputError
from snapbeam.lab.camera.photron.header import read_header
from snapbeam.lab.camera.sources.arrays import ARRAY_SUFFIXES, ArraySource
from snapbeam.lab.camera.sources.base import FrameSource
from snapbeam.lab.camera.sources.images import ImageSource, images_of_header
from snapbeam.lab.camera.sources.photron import PhotronSource
from snapbeam.lab.camera.sources.tiff import TIFF_SUFFIXES, TiffSource
from snapbeam.lab.camera.sources.video import VIDEO_SUFFIXES, VideoSource

__all__ = ["RECORDING_SUFFIXES", "open_source"]

RECORDING_SUFFIXES = (".cih", ".cihx", ".mraw", *VIDEO_SUFFIXES, *TIFF_SUFFIXES, *ARRAY_SUFFIXES)
"""Ends of names of recordings that are one file."""


def open_source(path: Path) -> FrameSource:
    """The source for a path.

    Raises
    ------
    InputError
        If there is no such file, or it is of no known kind.
    """
    try:
        return _open_source(path)
    except ImportError as error:
        raise InputError(f"{path}: reading it needs {error.name} (pip install 'snapbeam[lab]')") from error


def _open_source(path: Path) -> FrameSource:
    if path.is_dir() or any(mark in path.name for mark in "*?["):
        return ImageSource(path)
    name, _, dataset = str(path).partition("::")  # a dataset's name may hold "/"
    path = path if path.exists() else Path(name)
    dataset, suffix = dataset.replace("\\", "/"), path.suffix.lower()
    if not path.exists():
        raise InputError(f"{path}: no such file")
    if suffix == ".mraw":
        headers = [path.with_suffix(one) for one in (".cihx", ".cih") if path.with_suffix(one).exists()]
        if not headers:
            raise InputError(f"{path}: its header {path.stem}.cihx or {path.stem}.cih is not beside it")
        path, suffix = headers[0], headers[0].suffix.lower()
    if suffix in (".cih", ".cihx"):
        header = read_header(path)
        return images_of_header(header) if header.image_suffix else PhotronSource(header)
    if suffix in VIDEO_SUFFIXES:
        return VideoSource(path)
    if suffix in TIFF_SUFFIXES:
        return TiffSource(path)
    if suffix in ARRAY_SUFFIXES:
        return ArraySource(path, dataset)
    raise InputError(
        f"{path}: unknown kind of recording; known are {', '.join(RECORDING_SUFFIXES)}, a folder of numbered images "
        "or a pattern such as 'test_*.png'"
    )
