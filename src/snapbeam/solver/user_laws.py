"""A user's laws in the native core: their static methods as functions of C, by Numba or, without it, called back by ctypes.

A function gets x, y and the law's own numbers.  Its address is one of the numbers of the channel (``core/laws.hpp: User``), so that the
core has one law of each kind for all of them.
"""

from __future__ import annotations

import ctypes
import functools
import math
import re
import struct
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np

from snapbeam.model.contact.base import ContactLaw
from snapbeam.model.local_force import LocalForce
from snapbeam.util.diagnostics import Diagnostic, tell
from snapbeam.util.validation import InputError

_C = ctypes.CFUNCTYPE(ctypes.c_double, ctypes.c_double, ctypes.c_double, ctypes.POINTER(ctypes.c_double))
_FAR = 1e300
"""End of a range that has none."""
MOST_NUMBERS = 55
"""Constants of a law, at most."""


class _Function:
    """A scalar function of a law's numbers, x and perhaps y, as a function of C; an error in it becomes NaN and is kept."""

    def __init__(self, function: Callable[..., float], numbers: Any, arguments: int) -> None:
        self.name = f"{numbers.owner.__name__}.{function.__name__}"
        self.error: tuple[BaseException, tuple[Any, ...]] | None = None
        count = len(numbers._fields)

        def called(x: float, y: float, given: Any) -> float:
            of = (numbers(*given[:count]), x, y)[: arguments + 1]
            try:
                return float(function(*of))
            except BaseException as error:
                self.error = self.error or (error, of)
                return math.nan

        self._called = _C(called)
        self.why_slow, self._compiled = _compile(function, numbers, arguments, self._called)
        address = (
            self._compiled.address if self._compiled else ctypes.cast(self._called, ctypes.c_void_p).value
        )
        self.bits: float = struct.unpack("d", struct.pack("Q", address))[0]

    def check(self) -> None:
        """Raise the error that the function raised in the core."""
        if self.error is not None:
            (error, (law, *at)), self.error = self.error, None
            words = ", ".join(f"{each:g}" for each in at)
            raise InputError(f"{self.name}({law}, {words}): {type(error).__name__}: {error}") from error


def _compile(function: Any, numbers: Any, arguments: int, called: Any) -> tuple[str, Any]:
    """The reason why Numba does not compile a function, or the function compiled; where it raises an error it calls *called*."""
    try:
        import numba
    except ImportError:
        return "Numba is not installed; install numba", None
    from numba.np.unsafe.ndarray import to_fixed_tuple

    count = len(numbers._fields)

    @numba.njit
    def law(given):
        return numbers(*to_fixed_tuple(numba.carray(given, count), count))

    def of_x(x, y, given):
        try:
            return float(physics(law(given), x))
        except Exception:
            return called(x, y, given)

    def of_both(x, y, given):
        try:
            return float(physics(law(given), x, y))
        except Exception:
            return called(x, y, given)

    real = numba.types.float64
    try:
        physics = numba.njit(function)
        compiled = numba.cfunc(real(real, real, numba.types.CPointer(real)))(
            of_x if arguments == 1 else of_both
        )
    except Exception as error:
        lines = [line.strip() for line in re.sub(r"\x1b\[[0-9;]*m", "", str(error)).splitlines()]
        reasons = [line for line in lines if line and not line.startswith("Failed in")] or [
            type(error).__name__
        ]
        return f"Numba cannot compile {function.__name__} ({reasons[0]})", None
    return "", compiled


_function = functools.cache(_Function)  # an address stays valid


@dataclass(frozen=True)
class UserLaw:
    """A law of a user as the core gets it, before the law's own numbers."""

    kind: str
    """Law of the core that calls it."""
    functions: tuple[_Function, ...]
    head: tuple[float, ...]
    limited: bool = False


def contact_law(law: ContactLaw) -> UserLaw:
    """The functions of a contact law of one's own.

    Raises
    ------
    InputError
        If its force depends on the history, or if it has more constants than the core takes.
    """
    kind: Any = type(law)
    if kind.impulsive or kind.memory:
        way = "a law without impulses" if kind.impulsive else "engine = 'python'"
        raise InputError(
            f"{kind.__name__}: a law of one's own with a memory or of impulses is not integrated by engine = 'native'; use {way}"
        )
    missing = kind.missing_hooks()
    hooks = [None if name in missing else (getattr(kind, name), 1) for name in ("force", "energy", "slope")]
    damping = (kind.damping_coefficient, 1) if kind.rate_dependent else None
    return _law_of(
        kind, "lossy contact" if damping else "contact", [*hooks, None, damping], (0.0, math.inf), 0.0
    )


def local_force(force: LocalForce, largest: float) -> UserLaw:
    """The functions of a local force of one's own; *largest* is the displacement that it may reach, m or rad."""
    kind: Any = type(force)
    elastic = [(getattr(kind, name), 1) if force.is_conservative else None for name in ("force", "energy")]
    lossy = [(getattr(kind, name), 2) if kind.dissipative else None for name in ("damping_force", "damping_coefficient")]  # fmt: skip
    core, span = ("lossy force" if kind.dissipative else "force"), 1e-4 * largest
    limits = force.displacement_range(force.numbers)
    return _law_of(
        kind,
        core,
        [*elastic, None, *lossy],
        limits,
        span if force.is_conservative else 0.0,
        kind.is_limited(),
    )


def _law_of(kind: Any, core: str, hooks: Iterable[Any], limits: tuple[float, float], span: float, limited: bool = False) -> UserLaw:  # fmt: skip
    numbers = kind.numbers_type()
    count = len(numbers._fields)
    if count > MOST_NUMBERS:
        raise InputError(
            f"{kind.__name__}: has {count} constants, more than {MOST_NUMBERS}; use fewer, or engine = 'python'"
        )
    made = [None if hook is None else _function(hook[0], numbers, hook[1]) for hook in hooks]
    functions = tuple(each for each in made if each is not None)
    reasons = dict.fromkeys(each.why_slow for each in functions if each.why_slow)
    tell(
        Diagnostic(
            "law.slow", f"{kind.__name__}: the solver calls Python for every force, which is slow: {each}"
        )
        for each in reasons
    )
    low, high = np.clip(limits, -_FAR, _FAR).tolist()
    addresses = [0.0 if each is None else each.bits for each in made]
    return UserLaw(core, functions, (*addresses, low, high, span, float(count)), limited)
