"""A user's laws and statistics in the native core: as functions of C, by Numba or, without it, called back by ctypes.

A function of a law gets x, y and the law's own numbers.  Its address is one of the numbers of the channel (``core/laws.hpp: User``), so
that the core has one law of each kind for all of them.  One of a statistic gets what it held and the numbers of a step.
"""

from __future__ import annotations

import ctypes
import functools
import math
import re
import struct
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from snapbeam.model.contact.base import ContactLaw
from snapbeam.model.local_force import LocalForce
from snapbeam.solver.statistics import CompletedStep, Statistic
from snapbeam.util.diagnostics import Diagnostic, tell
from snapbeam.util.packages import needs
from snapbeam.util.validation import InputError

_FAR = 1e300
"""End of a range that has none."""
MOST_NUMBERS = 55
"""Constants of a law, at most."""


class Function:
    """A function of C, of some doubles and a pointer to more, that calls one in Python; an error in it becomes NaN and is kept.

    *arguments* makes those in Python of those in C; *compiled* makes, of Numba, the function compiled and what to call after an error,
    the function of C.
    """

    def __init__(self, name: str, function: Callable[..., float], doubles: int, arguments: Any, compiled: Any) -> None:  # fmt: skip
        self.name = name
        self.error: tuple[BaseException, tuple[Any, ...]] | None = None

        def called(*given: Any) -> float:
            if self.error is not None:
                return math.nan
            of = arguments(*given)
            try:
                return float(function(*of))
            except BaseException as error:
                self.error = error, of
                return math.nan

        double = ctypes.c_double
        self._called = ctypes.CFUNCTYPE(double, *[double] * doubles, ctypes.POINTER(double))(called)
        self.why_slow, self._compiled = _compile(function, doubles, compiled, self._called)
        self.address = int(
            self._compiled.address if self._compiled else ctypes.cast(self._called, ctypes.c_void_p).value or 0
        )

    def check(self) -> None:
        """Raise the error that the function raised in the core."""
        if self.error is not None:
            (error, of), self.error = self.error, None
            words = ", ".join(f"{each:g}" if isinstance(each, float) else str(each) for each in of)
            raise InputError(f"{self.name}({words}): {type(error).__name__}: {error}") from error


def _compile(function: Any, doubles: int, compiled: Any, called: Any) -> tuple[str, Any]:
    """The reason why Numba does not compile a function, or the function compiled; where it raises an error it calls *called*."""
    try:
        import numba
    except ImportError:
        return needs("compiling it", "Numba", "laws"), None
    real = numba.types.float64
    try:
        made = compiled(numba, numba.njit(function), called)
        return "", numba.cfunc(real(*[real] * doubles, numba.types.CPointer(real)))(made)
    except Exception as error:
        lines = [line.strip() for line in re.sub(r"\x1b\[[0-9;]*m", "", str(error)).splitlines()]
        reasons = [line for line in lines if line and not line.startswith("Failed in")] or [type(error).__name__]
        return f"Numba cannot compile {function.__name__} ({reasons[0]})", None


@functools.cache  # an address stays valid
def _function(function: Callable[..., float], numbers: Any, arguments: int) -> Function:
    """A function of a law's numbers, and perhaps of x and y."""
    count, taken = len(numbers._fields), arguments + 1

    def compiled(numba: Any, physics: Any, called: Any) -> Any:
        from numba.np.unsafe.ndarray import to_fixed_tuple

        @numba.njit
        def law(given):
            return numbers(*to_fixed_tuple(numba.carray(given, count), count))

        def of_numbers(x, y, given):
            try:
                return float(physics(*(law(given), x, y)[:taken]))
            except Exception:
                return called(x, y, given)

        return of_numbers

    return Function(
        f"{numbers.owner.__name__}.{function.__name__}", function, 2,
        lambda x, y, given: (numbers(*given[:count]), x, y)[:taken], compiled,
    )  # fmt: skip


def _step_of(a: Any) -> CompletedStep:
    """A step of the numbers that the core passes, in the order of ``core/api.hpp: Completed``."""
    return CompletedStep(
        a[0], a[1], (a[2], a[3]), (a[4], a[5]), (a[6], a[7]), (a[8], a[9]), (a[10], a[11]), a[12] > 0.5
    )


@functools.cache
def _update(function: Callable[..., float]) -> Function:
    def compiled(numba: Any, update: Any, called: Any) -> Any:
        step_of = numba.njit(_step_of)

        def of_step(held, given):
            try:
                return float(update(held, step_of(given)))
            except Exception:
                return called(held, given)

        return of_step

    name = getattr(function, "__name__", type(function).__name__)
    return Function(name, function, 1, lambda held, given: (held, _step_of(given)), compiled)


def updates_of(statistics: Sequence[Statistic]) -> list[Function]:
    """The functions that the core calls after every step, of statistics with ``update``."""
    found = [_update(each.update) for each in statistics if each.update is not None]
    words = "statistic {!r}: the solver calls Python after every step, which is slow: {}"
    pairs = ((row.name, each.why_slow) for row, each in zip(statistics, found, strict=True) if each.why_slow)
    tell(Diagnostic("statistic.slow", words.format(*pair)) for pair in pairs)
    return found


@dataclass(frozen=True)
class UserLaw:
    """A law of a user as the core gets it, before the law's own numbers."""

    kind: str
    """Law of the core that calls it."""
    functions: tuple[Function, ...]
    head: tuple[float, ...]


def contact_law(law: ContactLaw) -> UserLaw:
    """The functions of a contact law of one's own.

    Raises
    ------
    InputError
        If it acts by impulses, if its force depends on both the history and the rate, or if it has more constants than the
        core takes.
    """
    kind: Any = type(law)
    if kind.impulsive:
        raise InputError(
            f"{kind.__name__}: a law of one's own of impulses is not integrated; use a law without impulses"
        )
    if kind.memory and kind.rate_dependent:
        raise InputError(
            f"{kind.__name__}: a law of one's own with memory and rate_dependent is not integrated by engine = 'native'; use "
            "engine = 'python'"
        )
    missing = kind.missing_hooks()
    hooks = [None if name in missing else (getattr(kind, name), 1) for name in ("force", "energy", "slope")]
    damping = (kind.damping_coefficient, 1) if kind.rate_dependent else None
    memory = [(kind.yield_penetration, 0), (kind.memory_after, 1)] if kind.memory else [None, None]
    core = "contact with memory" if kind.memory else "lossy contact" if damping else "contact"
    return _law_of(kind, core, [*hooks, None, damping, *memory], (0.0, math.inf), 0.0, _FAR)


def local_force(force: LocalForce, largest: float, fastest: float) -> UserLaw:
    """The functions of a local force of one's own, which may reach *largest* (m or rad) and *fastest*, per second."""
    kind: Any = type(force)
    elastic = [(getattr(kind, name), 1) if force.is_conservative else None for name in ("force", "energy")]
    lossy = [(getattr(kind, name), 2) if kind.dissipative else None for name in ("damping_force", "damping_coefficient")]  # fmt: skip
    core, span = ("lossy force" if kind.dissipative else "force"), 1e-4 * largest
    limits = force.displacement_range(force.numbers)
    return _law_of(
        kind, core, [*elastic, None, *lossy, None, None], limits, span if force.is_conservative else 0.0,
        min(force.reversal_speed(largest, fastest), _FAR),
    )  # fmt: skip


def _law_of(kind: Any, core: str, hooks: Iterable[Any], limits: tuple[float, float], span: float, reversal: float) -> UserLaw:  # fmt: skip
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
        Diagnostic("law.slow", f"{kind.__name__}: the solver calls Python for every force, which is slow: {each}")
        for each in reasons
    )
    low, high = np.clip(limits, -_FAR, _FAR).tolist()
    addresses = struct.unpack(
        f"{len(made)}d", struct.pack(f"{len(made)}Q", *(each.address if each else 0 for each in made))
    )
    return UserLaw(core, functions, (*addresses, low, high, span, reversal, float(count)))
