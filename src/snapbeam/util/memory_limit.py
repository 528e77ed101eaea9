"""A limit of the process's memory (``ulimit -v``): libraries that it leaves no room for are not loaded.

OpenBLAS ends the process, or sends it a signal, if it finds no room for the buffers of its threads; the loader of other
libraries raises an ImportError, after which some packages do without the library and fail later, with other words.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence
from contextlib import suppress
from importlib.abc import MetaPathFinder
from pathlib import Path

MB = 10**6
_LIBRARY = 24 * MB
"""Address space for a module and the libraries that it loads, unless one of these."""
_LIBRARIES = {"h5py": 60 * MB, "av": 200 * MB, "cv2": 250 * MB}
_THREAD = 45 * MB
"""Address space of a thread of OpenBLAS: its buffer and its stack."""
_BLAS = {"numpy": 60 * MB, "scipy": 100 * MB}
"""Packages that have an OpenBLAS each, and their address space without its threads."""
_LOADERS = {"numpy": ("numpy",), "scipy.linalg": (_SCIPY := ("scipy.linalg", "scipy.special")), "scipy.special": _SCIPY}
"""Modules that load it, with those after which it is loaded.  The loader does not end if it finds no room for a buffer."""
_PROGRAM = 850 * MB
"""Address space that suffices for commands on the paper's beam, with figures and animations, without threads of OpenBLAS."""


def limit() -> float:
    """Limit of the address space of the process, bytes; infinite if there is none."""
    with suppress(ImportError, OSError, ValueError):
        import resource

        soft = resource.getrlimit(resource.RLIMIT_AS)[0]
        if soft != resource.RLIM_INFINITY:
            return float(soft)
    return float("inf")


def sufficient() -> int:
    """Address space that suffices for a command with a small result, bytes."""
    return _PROGRAM + len(_BLAS) * _THREAD * _blas_threads()


def not_sufficient(said: str = "") -> str:
    """One sentence on a lack of memory: the limit, if there is one, and the need *said* by the error."""
    text = f"the memory is not sufficient{f' ({said})' if said else ''}"
    allowed = limit()
    if allowed == float("inf"):
        return text
    need = f"a command needs about {sufficient() / MB:.0f} MB and the size of its results"
    return f"{text}: the process is limited to {allowed / MB:.0f} MB (ulimit -v), {need}"


def refuse_libraries_without_room() -> None:
    """Raise a MemoryError from now on when a module is imported for which a limit leaves no room."""
    if limit() < float("inf") and _used() is not None:
        sys.meta_path.insert(0, _Room())


def _blas_threads() -> int:
    for name in ("OPENBLAS_NUM_THREADS", "GOTO_NUM_THREADS", "OMP_NUM_THREADS"):
        with suppress(ValueError):
            if (count := int(os.environ.get(name, "0"))) > 0:
                return min(count, _cores())
    return _cores()


def _cores() -> int:
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def _used() -> int | None:
    """Address space that the process has, bytes; None if the system does not tell."""
    try:
        return int(Path("/proc/self/statm").read_bytes().split()[0]) * os.sysconf("SC_PAGE_SIZE")
    except (OSError, ValueError):
        return None


class _Room(MetaPathFinder):
    """Finds nothing, but raises a MemoryError before a module is looked for."""

    def find_spec(self, name: str, path: Sequence[str] | None, target: object = None) -> None:
        need = _LIBRARIES.get(name, _LIBRARY)
        if not sys.modules.keys() & set(_LOADERS.get(name, sys.modules)):
            need = _BLAS[name.partition(".")[0]] + _THREAD * _blas_threads()
        used = _used()
        if used is not None and limit() - used < need:
            raise MemoryError
