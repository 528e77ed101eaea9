"""MATLAB files of versions 4 and 5, read in a process of their own.

SciPy's compiled reader trusts the tags in the file: a damaged file may end the process that reads it.
"""

from __future__ import annotations

import io
import json
import math
import os
import signal
import subprocess
import sys
import zlib
from contextlib import suppress
from pathlib import Path
from typing import Any, Literal

import numpy as np

from snapbeam.util.input_files import refuse_inflated
from snapbeam.util.validation import InputError

_LONGEST = 60.0
"""Seconds for a small file."""
_WORK = 6
"""Seconds of processor time for a small file: SciPy does not end if sizes of version 4 are negative."""
_SLOWEST = 1e6
"""Bytes of a file for each further second."""


def read_version_5(path: Path) -> dict[str, Any]:
    """Arrays of numbers and texts of a MATLAB file of version 4 or 5, by name; fields of structures as ``name/field``.

    Raises
    ------
    InputError
        If the file cannot be read, its content is out of proportion (:func:`~snapbeam.util.input_files.refuse_inflated`),
        or its reader crashes or takes over 6 s of processor time, or 60 s, and a second for each megabyte.
    """
    longest = _LONGEST + path.stat().st_size / _SLOWEST
    folders = os.pathsep.join(each or os.getcwd() for each in sys.path)
    try:
        ended = subprocess.run(
            [sys.executable, "-P", "-m", __name__, str(path)],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            env=os.environ | {"PYTHONPATH": folders, "OPENBLAS_NUM_THREADS": "1"},
            timeout=longest,
            check=False,
        )
    except subprocess.TimeoutExpired:
        raise InputError(f"{path}: is damaged: its reader did not end within {longest:.0f} s") from None
    if ended.returncode and -ended.returncode == getattr(signal, "SIGXCPU", 0):
        raise InputError(f"{path}: is damaged: its reader did not end within {_work(path)} s of processor time")
    line, _, content = ended.stdout.partition(b"\n")
    if ended.returncode or not line:
        raise InputError(f"{path}: is damaged: its reader crashed (status {ended.returncode})")
    found = json.loads(line)
    if "refused" in found:
        raise InputError(found["refused"])
    stream = io.BytesIO(content)
    return {name: np.lib.format.read_array(stream, allow_pickle=False) for name in found["names"]}


def _work(path: Path) -> int:
    return _WORK + math.ceil(path.stat().st_size / _SLOWEST)


def _load(path: Path) -> dict[str, Any]:
    from scipy.io import loadmat

    refuse_inflated("path", path, _stated_size(path))
    loaded = loadmat(path, squeeze_me=True, struct_as_record=True, chars_as_strings=True)
    values: dict[str, Any] = {}

    def take(name: str, item: Any, depth: int) -> None:
        array = np.asarray(item)
        if array.dtype.names and depth < 4:
            for key in array.dtype.names:
                inner = array[key]
                nested = inner.dtype == object and inner.ndim == 0
                take(f"{name}/{key}", inner.item() if nested else inner, depth + 1)
        elif array.dtype.kind in "iufU":
            values[name] = array

    for name, item in loaded.items():
        if not name.startswith("__"):
            take(name, item, 0)
    return values


def _stated_size(path: Path) -> int:
    """Bytes of the variables of a MATLAB file of version 4 or 5 as its headers state them, 8 for a number or an element.

    The numbers in structures and cells are not counted in any header: each may take one byte in the file.
    """
    from scipy.io import whosmat

    variables = whosmat(path)
    size = sum(8 * abs(math.prod(map(int, shape))) for _, shape, _ in variables)
    arrays = {"double", "single", "logical", "char"}
    if all(kind in arrays or kind.lstrip("u").startswith("int") for *_, kind in variables):
        return size
    with open(path, "rb") as file:
        order: Literal["little", "big"] = "little" if file.read(128)[126:] == b"IM" else "big"
        while len(tag := file.read(8)) == 8:
            kind, length = (int.from_bytes(tag[at : at + 4], order) for at in (0, 4))
            start = file.tell()
            if kind == 15:  # a compressed element, whose own tag states its length
                inner = zlib.decompressobj().decompress(file.read(min(length, 64)), 8)
                size += 8 * int.from_bytes(inner[4:8], order)
            file.seek(start + length)
    return size


def _send(path: Path) -> None:
    """Write the arrays of a file, or a refusal, to the standard output."""
    with suppress(ImportError, OSError, ValueError):  # a crash leaves no image of the memory
        import resource

        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
        resource.setrlimit(resource.RLIMIT_CPU, (_work(path), _work(path) + 1))
    output = sys.stdout.buffer
    try:
        values = _load(path)
    except Exception as error:
        reason = str(error) if isinstance(error, InputError) else f"{type(error).__name__}: {error}"
        output.write(json.dumps({"refused": reason}).encode() + b"\n")
        return
    output.write(json.dumps({"names": list(values)}).encode() + b"\n")
    for array in values.values():
        np.lib.format.write_array(output, np.asarray(array), allow_pickle=False)


if __name__ == "__main__":
    _send(Path(sys.argv[1]))
