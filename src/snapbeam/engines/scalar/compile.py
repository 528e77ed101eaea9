"""How kernels are compiled, and how the compiled code is kept between runs.

Functions are compiled into the kernel that calls them, across files and with the law of contact and the drive that
it marches; a kernel is what is kept on disk.  Numba alone would keep it until the file that it stands in changes.
Here it is kept under a fingerprint of everything that it bakes in (:mod:`~snapbeam.engines.scalar.fingerprint`), with a
check sum (:mod:`~snapbeam.engines.scalar.kept_code`).
"""

from __future__ import annotations

import gc
import logging
from collections.abc import Callable
from functools import cache
from typing import Any

from numba import njit, typeof
from numba.core import event
from numba.core.registry import CPUDispatcher
from numba.extending import overload

from snapbeam.engines.scalar.fingerprint import fingerprint
from snapbeam.engines.scalar.kept_code import keep_code
from snapbeam.engines.scalar.parts import pipeline

__all__ = ["INLINE", "INLINE_HERE", "called", "compiled", "inlined", "kernel", "overloaded", "ready"]

_LOG = logging.getLogger("snapbeam")
_OPTIONS: dict[str, Any] = {"error_model": "numpy", "nogil": True, "_nrt": False}
_PART: dict[str, Any] = {"no_cpython_wrapper": True, "no_cfunc_wrapper": True, **pipeline()}
INLINE: dict[str, Any] = {"error_model": "numpy", "forceinline": True}
"""Options of an overload that is to be written into its callers, on every engine."""
INLINE_HERE: dict[str, Any] = {**INLINE, **_PART}
"""The same, for what only the processor's engine calls."""


def overloaded(function: Any) -> Callable[[Any], Any]:
    """As :func:`numba.extending.overload`, inlined on every engine, and on the processor as a part of its kernel."""

    def register(implementation: Any) -> Any:
        overload(function, jit_options=INLINE)(implementation)
        overload(function, jit_options=INLINE_HERE, target="cpu")(implementation)
        return implementation

    return register


class _Part(CPUDispatcher):
    """A part of a kernel; Python can call it too, through a kernel that does nothing else."""

    def __call__(self, *arguments: Any) -> Any:
        return _by_itself(self)(*arguments)


@cache
def _by_itself(part: Any) -> Any:
    return njit(**_OPTIONS)(lambda *arguments: part(*arguments))


def compiled(function: Callable[..., Any], **options: Any) -> Any:
    """Compile a function that kernels call: no Python objects, no global lock, division as the processor does it.

    Nor reference counts, which cost an atomic operation whenever an array is passed on: a kernel allocates nothing,
    and its arrays belong to its caller.
    """
    part = njit(**options, **_PART, **_OPTIONS)(function)
    if type(part) is CPUDispatcher:  # under NUMBA_DISABLE_JIT it is the function itself
        part.__class__ = _Part
    return part


def called(function: Callable[..., Any]) -> Any:
    """As :func:`compiled`, for what is long and rarely needed: never forced into its callers.

    What is merely compiled is written into a caller that is inlined itself, since Numba's options pass on from there.
    """
    return compiled(function, forceinline=False)


def inlined(function: Callable[..., Any]) -> Any:
    """As :func:`compiled`, and always written into its callers."""
    return compiled(function, forceinline=True)


@cache
def kernel(function: Callable[..., Any], kinds: tuple[type, ...]) -> Any:
    """A kernel for some laws of contact and drives, kept on disk under the fingerprint of what it bakes in."""
    dispatcher = njit(**_OPTIONS)(function)
    mark = fingerprint(kinds)
    return dispatcher if mark is None else keep_code(dispatcher, mark)


class _Telling(event.Listener):
    """Says once that a kernel is being compiled."""

    def __init__(self, name: str) -> None:
        self.name = name
        self.told = False

    def on_start(self, event: Any) -> None:
        if not self.told:
            self.told = True
            _LOG.info("compiling %s, once on this machine: 10 to 20 s on a free core", self.name)

    def on_end(self, event: Any) -> None:
        """Nothing to say."""


def ready(march: Any, *arguments: Any) -> None:
    """Compile a kernel for such arguments, or fetch it from the disk, before anything is timed; says so in the log."""
    collecting = gc.isenabled()
    gc.disable()  # a compiler's garbage has no cycles worth a tenth of the time
    try:
        with event.install_listener("numba:compile", _Telling(march.py_func.__name__)):
            march.compile(tuple(typeof(value) for value in arguments))
    finally:
        if collecting:
            gc.enable()
