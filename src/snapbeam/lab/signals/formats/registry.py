"""Readers and writers by the end of a file's name."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from snapbeam.lab.signals.formats.arrays import read_numpy, write_npz
from snapbeam.lab.signals.formats.channel import Channel, Told
from snapbeam.lab.signals.formats.hdf5 import read_hdf5, write_hdf5
from snapbeam.lab.signals.formats.lvm import read_lvm
from snapbeam.lab.signals.formats.matlab import read_matlab
from snapbeam.lab.signals.formats.tables import read_csv, write_csv
from snapbeam.lab.signals.formats.tdms import read_tdms, write_tdms
from snapbeam.lab.signals.formats.uff import read_uff, write_uff
from snapbeam.lab.signals.formats.wav import read_wav, write_wav

__all__ = ["READERS", "WRITERS"]

READERS: dict[str, Callable[[Path, Told], list[Channel]]] = {
    ".csv": read_csv,
    ".txt": read_csv,
    ".asc": read_csv,
    ".dat": read_csv,
    ".tsv": read_csv,
    ".lvm": read_lvm,
    ".wav": read_wav,
    ".uff": read_uff,
    ".unv": read_uff,
    ".tdms": read_tdms,
    ".mat": read_matlab,
    ".h5": read_hdf5,
    ".hdf5": read_hdf5,
    ".nc": read_hdf5,
    ".npz": read_numpy,
    ".npy": read_numpy,
}
WRITERS: dict[str, Callable[[Path, Any, float | None], None]] = {
    ".csv": write_csv,
    ".wav": write_wav,
    ".uff": write_uff,
    ".tdms": write_tdms,
    ".h5": write_hdf5,
    ".npz": write_npz,
}
