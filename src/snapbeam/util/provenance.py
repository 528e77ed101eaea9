"""Provenance of a file: version, libraries, command and parameters, without data about the machine.

Attributes made here go into every file the package writes, so that a result can be traced to the
numbers it came from.  They hold no host name, no user name and no directory.
"""

from __future__ import annotations

import dataclasses
import enum
import hashlib
import json
import math
import platform
import sys
from collections.abc import Mapping, Sequence
from datetime import UTC, datetime
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from snapbeam._version import __version__
from snapbeam.util.cores import instruction_set
from snapbeam.util.validation import InputError, InputTypeError, shown

__all__ = [
    "__version__", "arithmetic_hash", "array_hash", "canonical_json", "code_hash", "command_line", "created_now",
    "encodable", "made_by", "parameter_hash", "platform_name", "processor_name",
]  # fmt: skip


def platform_name() -> str:
    """Return the system, the processor family and the Python version: ``"Linux x86_64, Python 3.11.2"``."""
    return f"{platform.system()} {platform.machine()}, Python {platform.python_version()}"


def processor_name() -> str:
    """Return the family of the processor and the instruction set of the native core; one type rounds in one way."""
    return f"{platform.machine()} {instruction_set()}"


@cache
def code_hash() -> str:
    """Return the SHA-256 of every file of the package that a number depends on, in 16 hexadecimal digits."""
    from snapbeam import _core

    package = Path(__file__).parents[1]
    digest = hashlib.sha256(_core.SOURCES.encode())
    for name in ("util", "model", "solver", "simulation", "sweeps"):
        for path in sorted((package / name).rglob("*.py")):
            digest.update(path.relative_to(package).as_posix().encode() + b"\0")
            digest.update(path.read_bytes())
    return digest.hexdigest()[:16]


@cache
def arithmetic_hash() -> str:
    """Return the SHA-256 of how this process rounds, in 16 hexadecimal digits.

    NumPy and the library of linear algebra behind it choose their code by the processor, and are told to by settings
    such as ``OPENBLAS_CORETYPE``; a product of matrices then differs in its last digits.  What stands here is the hash
    of a few results that depend on that choice: products, sums and functions of fixed numbers, few enough of them that
    the number of threads does not matter.
    """
    numbers = np.arange(1.0, 1601.0)
    matrix = (numbers * 0.6180339887498949 % 1.0).reshape(40, 40)
    found = [matrix @ matrix, matrix @ matrix[0], matrix.T @ matrix[:, :7], matrix[0] @ matrix[1]]
    found += [np.sin(numbers), np.exp(-numbers / 97.0), np.tanh(numbers / 800.0), np.sqrt(numbers)]
    found += [np.asarray(numbers.sum()), np.asarray((1.0 / numbers).sum()), matrix.sum(axis=0)]
    digest = hashlib.sha256()
    for values in found:
        digest.update(np.ascontiguousarray(values).tobytes())
    return digest.hexdigest()[:16]


def created_now() -> str:
    """Return the present time in UTC to the second, as ISO 8601 writes it."""
    return datetime.now(UTC).replace(microsecond=0).isoformat().replace("+00:00", "Z")


def command_line(argv: Sequence[str] | None = None) -> str:
    r"""Return the command that runs, each absolute path in it shortened to its last part.

    Bytes of names that are not UTF-8, which no file format takes as text, are written as ``\xff``.

    Parameters
    ----------
    argv : sequence of str, optional
        The program and its arguments; ``sys.argv`` by default.
    """
    return " ".join(encodable(_without_directory(word)) for word in (sys.argv if argv is None else argv))


def encodable(text: str) -> str:
    r"""Return text with bytes of a file name that are not UTF-8 as ``\xff``, so that every file format takes it."""
    return text.encode("utf-8", "surrogateescape").decode("utf-8", "backslashreplace")


def _without_directory(word: str) -> str:
    name, equals, value = word.partition("=")
    if equals and name.startswith("-"):
        return f"{name}={_without_directory(value)}"
    if word.startswith(("/", "~", "\\")) or word[1:3] in (":\\", ":/"):
        return word.replace("\\", "/").rstrip("/").rsplit("/", 1)[-1]
    return word


def canonical_json(parameters: Any) -> str:
    """Return *parameters* as JSON in the one form that equal parameters share.

    Keys are sorted, numbers are written by value (``4``, ``4.0`` and ``np.float32(4)`` alike, a float to
    the last digit that tells it from its neighbours, negative zero as 0), arrays as lists, enumerations as
    their values, dataclasses as their fields.
    """
    return json.dumps(_canonical(parameters, "parameters"), sort_keys=True, separators=(",", ":"), allow_nan=False)


def _canonical(value: Any, name: str) -> Any:
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        value = {field.name: getattr(value, field.name) for field in dataclasses.fields(value)}
    if isinstance(value, enum.Enum):
        value = value.value
    if isinstance(value, Mapping):
        for key in value:
            if not isinstance(key, str):
                raise InputTypeError(f"{name}: key {key!r} must be text")
        return {key: _canonical(item, f"{name}.{key}") for key, item in value.items()}
    if isinstance(value, (np.ndarray, np.generic)):
        value = value.tolist()
    if value is None or isinstance(value, (str, bool)):
        return value
    if isinstance(value, (list, tuple)):
        return [_canonical(item, f"{name}[{at}]") for at, item in enumerate(value)]
    if isinstance(value, int):
        return value
    if isinstance(value, float):
        if not math.isfinite(value):
            raise InputError(f"{name} = {shown(value)}: must be finite")
        return int(value) if value.is_integer() and abs(value) < 2.0**53 else value
    raise InputTypeError(
        f"{name} = {shown(value)}: must be numbers, text or lists of these, not {type(value).__name__}"
    )


def parameter_hash(parameters: Any) -> str:
    """Return the SHA-256 of :func:`canonical_json`, in 64 hexadecimal digits: equal for equal parameters."""
    return hashlib.sha256(canonical_json(parameters).encode()).hexdigest()


def array_hash(values: Any) -> str:
    """Return the SHA-256 of an array's shape, kind and contents."""
    array = np.ascontiguousarray(values)
    digest = hashlib.sha256(f"{array.shape} {array.dtype.kind}".encode())
    plain = "".join(map(str, array.tolist())).encode() if array.dtype.kind in "OUS" else array.tobytes()
    digest.update(plain)
    return digest.hexdigest()


def made_by(parameters: Any = None, *, command: str | None = None) -> dict[str, str]:
    """Return the provenance attributes of a file.

    Parameters
    ----------
    parameters : mapping or dataclass, optional
        What the result was computed from; adds ``parameter_hash``.
    command : str, optional
        The call to record; the command line that runs by default.

    Returns
    -------
    dict of str
        ``snapbeam_version``, ``numpy_version``, ``platform``, ``command``, ``created``
        and, with *parameters*, ``parameter_hash``.
    """
    attributes = {
        "snapbeam_version": __version__,
        "numpy_version": np.__version__,
        "platform": platform_name(),
        "command": command_line() if command is None else command,
        "created": created_now(),
    }
    if parameters is not None:
        attributes["parameter_hash"] = parameter_hash(parameters)
    return attributes
