"""How kernels are compiled, and how the compiled code is kept between runs.

Numba keeps compiled functions on disk and compiles them again when the file they stand in changes.  The
kernels are compiled into each other across files, so here the name under which they are kept holds a
fingerprint of all of them: a change anywhere, or another version of the package, never meets old code.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from pathlib import Path
from typing import Any

from numba import njit
from numba.core.caching import IndexDataCacheFile

__all__ = ["compiled", "inlined"]


def _fingerprint() -> str:
    """Of the source of every kernel that is kept on disk, in 16 hexadecimal digits."""
    digest = hashlib.sha256()
    package = Path(__file__).parents[2]
    for folder in ("core/codes.py", "engines/*.py", "engines/scalar/*.py", "engines/cpu/*.py"):
        for path in sorted(package.glob(folder)):
            digest.update(path.read_bytes())
    return digest.hexdigest()[:16]


_FINGERPRINT = _fingerprint()


def _compile(function: Callable[..., Any], **options: Any) -> Any:
    options |= {"error_model": "numpy", "nogil": True, "_nrt": False}
    dispatcher = njit(cache=True, **options)(function)
    cache = dispatcher._cache
    try:
        cache._cache_file = IndexDataCacheFile(
            cache_path=cache._cache_path,
            filename_base=f"{cache._impl.filename_base}-{_FINGERPRINT}",
            source_stamp=cache._impl.locator.get_source_stamp(),
        )
    except AttributeError:  # no place to keep compiled code, or a Numba that keeps it otherwise
        return njit(**options)(function)
    return dispatcher


def compiled(function: Callable[..., Any]) -> Any:
    """Compile a kernel: no Python objects, no global lock, division as the processor does it.

    Nor reference counts, which cost an atomic operation whenever an array is passed on: a kernel allocates nothing,
    and its arrays belong to its caller.
    """
    return _compile(function)


def inlined(function: Callable[..., Any]) -> Any:
    """As :func:`compiled`, and always written into its callers."""
    return _compile(function, forceinline=True)
