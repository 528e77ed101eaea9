"""How kernels are compiled, and how the compiled code is kept between runs.

Functions are compiled into the kernel that calls them, across files and with the law of contact and the drive that
it marches; a kernel is what is kept on disk.  Numba alone would keep it until the file that it stands in changes.
Here it is kept under a fingerprint of everything that it bakes in: every file of the engines, the codes, the
law's and the drive's own files, and the versions of Numba and NumPy.
"""

from __future__ import annotations

import hashlib
import inspect
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import numba
import numpy as np
from numba import njit
from numba.core.caching import FunctionCache, IndexDataCacheFile

__all__ = ["INLINE", "compiled", "fingerprint", "inlined", "kernel"]

_OPTIONS: dict[str, Any] = {"error_model": "numpy", "nogil": True, "_nrt": False}
INLINE: dict[str, Any] = {"error_model": "numpy", "forceinline": True}
"""Options of an overload that is to be written into its callers."""

_PACKAGE = Path(__file__).parents[2]
_BAKED_IN = ("core/codes.py", "engines/**/*.py")


@cache
def _package_fingerprint() -> str:
    digest = hashlib.sha256()
    for pattern in _BAKED_IN:
        for path in sorted(_PACKAGE.glob(pattern)):
            digest.update(path.relative_to(_PACKAGE).as_posix().encode())
            digest.update(path.read_bytes())
    digest.update(f"{numba.__version__} {np.__version__}".encode())
    return digest.hexdigest()


@cache
def fingerprint(kinds: tuple[type, ...]) -> str | None:
    """Of everything that a kernel for these laws and drives bakes in, in 20 hexadecimal digits.

    None if the source of one of them cannot be read, as of a class typed at a prompt, or if it stands for functions
    from anywhere, as statistics that were registered do: such a kernel is compiled anew in every process.
    """
    digest = hashlib.sha256(_package_fingerprint().encode())
    for kind in kinds:
        if getattr(kind, "rows", ()):
            return None
        for each in kind.__mro__[:-1]:
            try:
                source = inspect.getsourcefile(each)
                data = Path(source).read_bytes() if source is not None else None
            except (TypeError, OSError):
                data = None
            if data is None:
                return None
            digest.update(f"{each.__module__}.{each.__qualname__}".encode())
            digest.update(data)
    return digest.hexdigest()[:20]


def compiled(function: Callable[..., Any]) -> Any:
    """Compile a function that kernels call: no Python objects, no global lock, division as the processor does it.

    Nor reference counts, which cost an atomic operation whenever an array is passed on: a kernel allocates nothing,
    and its arrays belong to its caller.
    """
    return njit(**_OPTIONS)(function)


def inlined(function: Callable[..., Any]) -> Any:
    """As :func:`compiled`, and always written into its callers."""
    return njit(forceinline=True, **_OPTIONS)(function)


@cache
def kernel(function: Callable[..., Any], kinds: tuple[type, ...]) -> Any:
    """A kernel for some laws of contact and drives, kept on disk under the fingerprint of what it bakes in."""
    dispatcher = njit(**_OPTIONS)(function)
    mark = fingerprint(kinds)
    if mark is None:
        return dispatcher
    try:
        dispatcher.enable_caching()
        cache_of: FunctionCache = dispatcher._cache
        cache_of._cache_file = IndexDataCacheFile(
            cache_path=cache_of._cache_path,
            filename_base=f"{cache_of._impl.filename_base}-{mark}",
            source_stamp=cache_of._impl.locator.get_source_stamp(),
        )
    except (
        AttributeError,
        RuntimeError,
    ):  # no place to keep compiled code, or a Numba that keeps it otherwise
        return njit(**_OPTIONS)(function)
    return dispatcher
