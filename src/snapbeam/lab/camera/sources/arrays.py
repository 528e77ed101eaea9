"""Stacks of pictures in arrays: NumPy's .npy and HDF5."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from snapbeam.core.validate import InputError
from snapbeam.lab.camera.sources.base import FrameSource, grey_of, scaled_floats
from snapbeam.lab.camera.sources.tiff import float_range
from snapbeam.lab.plausibility.recording import KINDS

__all__ = ["ARRAY_SUFFIXES", "ArraySource"]

ARRAY_SUFFIXES = (".npy", ".h5", ".hdf5")
_RATES = ("frame_rate", "fps", "record_rate", "frame_rate_hz")
_SIZES = ("pixel_size", "pixel_size_m")


class ArraySource(FrameSource):
    """A stack (frames, height, width), or with red, green and blue last, read from the disk as needed.

    The attributes ``frame_rate`` [Hz], ``pixel_size`` [m] and ``exposure`` [s] of an HDF5 file are used.
    """

    def __init__(self, path: Path, dataset: str = "") -> None:
        super().__init__(path)
        self._file: Any = None
        try:
            self._stack = self._open(dataset)
        except InputError:
            self.close()
            raise
        except Exception as error:  # a damaged file makes both libraries raise many kinds
            self.close()
            raise InputError(f"{path}: cannot be read as a stack of pictures ({error})") from None
        shape, dtype = self._stack.shape, self._stack.dtype
        if not _is_stack(shape, dtype):
            self.close()
            raise InputError(
                f"{path}: an array of shape {shape} and type {dtype}: must be (frames, height, width), or with 3 "
                "colours last, of unsigned integers of 8 or 16 bits or floating point numbers"
            )
        self.shape = (int(shape[1]), int(shape[2]))
        self.numbers = np.arange(shape[0])
        self._colors = len(shape) == 4
        if self._colors:
            self.diagnostics += (KINDS["colour"].found(channels=shape[3]),)
        self._full = 0.0
        if dtype.kind == "f":
            self._full = float_range(
                [np.asarray(self._stack[k]) for k in {0, shape[0] // 2, shape[0] - 1}], path
            )
            self.max_value = 65535
        else:
            self.max_value = int(np.iinfo(dtype).max)

    def _open(self, dataset: str) -> Any:
        if self.path.suffix.lower() == ".npy":
            self.metadata = {"format": "NumPy stack"}
            return np.load(self.path, mmap_mode="r", allow_pickle=False)
        import h5py

        self._file = h5py.File(self.path, "r")
        found: dict[str, Any] = {}

        def visit(name: str, item: Any) -> None:
            if not isinstance(item, h5py.Dataset) or not _is_stack(item.shape, item.dtype):
                return
            if item.external or item.is_virtual:
                raise InputError(
                    f"{self.path}: {name!r} has its pictures in another file: copy them into this one"
                )
            found[name] = item

        self._file.visititems(visit)
        if dataset:
            if dataset not in found:
                raise InputError(
                    f"{self.path}: holds no stack {dataset!r}; its stacks are {', '.join(found) or 'none'}"
                )
            chosen = dataset
        elif len(found) == 1:
            chosen = next(iter(found))
        else:
            raise InputError(
                f"{self.path}: holds {len(found)} stacks of pictures ({', '.join(found) or 'none'}); name one as in "
                f"{self.path.name}::name"
            )
        levels = (found[chosen].attrs, found[chosen].parent.attrs, self._file.attrs)
        self.frame_rate = self._attribute(levels, _RATES)
        self.pixel_size = self._attribute(levels, _SIZES)
        self.exposure = self._attribute(levels, ("exposure",))
        self.metadata = {"format": "HDF5 stack", "dataset": chosen}
        return found[chosen]

    def _attribute(self, levels: tuple[Any, ...], names: tuple[str, ...]) -> float | None:
        for level in levels:
            for name in names:
                if name in level:
                    value = np.asarray(level[name])
                    if value.size != 1 or value.dtype.kind not in "iuf" or not value.item() > 0.0:
                        raise InputError(
                            f"{self.path}: attribute {name!r} = {level[name]!r}: must be a positive number"
                        )
                    return float(value.item())
        return None

    def read(self, start: int, stop: int, rows: tuple[int, int]) -> NDArray[np.integer]:
        part = np.asarray(self._stack[start:stop, rows[0] : rows[1]])
        if self._colors:
            part = grey_of(part)
        if not self._full:
            return part
        levels = scaled_floats(part, self._full)
        if levels is None:
            raise InputError(
                f"{self.path}: frames {start} to {stop - 1} hold numbers outside 0 to {self._full:g}"
            )
        return levels

    def close(self) -> None:
        if self._file is not None:
            self._file.close()
            self._file = None


def _is_stack(shape: tuple[int, ...], dtype: Any) -> bool:
    size = len(shape) == 3 or (len(shape) == 4 and shape[-1] in (3, 4))
    return size and all(shape) and (dtype.kind == "f" or (dtype.kind == "u" and dtype.itemsize <= 2))
