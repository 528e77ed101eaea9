"""The engines by name."""

from __future__ import annotations

from collections.abc import Callable
from importlib.util import find_spec
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from snapbeam.core.validate import InputError, choice
from snapbeam.engines.cpu import driver as cpu_engine
from snapbeam.engines.ensemble import Ensemble

__all__ = ["ENGINES", "Engine", "resolve"]

ENGINES = ("auto", "cpu", "cuda")

_FEWEST_RUNS = 2000
"""A device marches one run slower than a core does, but over a thousand at a time: fewer do not fill it."""
_FEWEST_CYCLES = 2_000_000
"""Cycles of all runs, more than a minute of a core's work: with fewer, compiling the kernel costs more."""


class Engine(Protocol):
    """An engine marches every run of an ensemble and returns its counts and numbers, a row a run."""

    def __call__(
        self,
        ensemble: Ensemble,
        threads: int | None = None,
        progress: Callable[[int, int], object] | None = None,
    ) -> tuple[NDArray[np.int64], NDArray[np.float64]]: ...


def resolve(
    name: str, *, runs: int = 1, cycles: int = 1, modes: int = 1, restitution: bool = False
) -> tuple[str, Engine]:
    """The engine that *name* stands for, and its own name.

    ``"auto"`` is the CUDA engine where a device can be used and the work pays for it, else the CPU's: at
    least 2000 runs and two million cycles in all, at most 128 modes, no law of restitution.

    Parameters
    ----------
    name : {"auto", "cpu", "cuda"}
    runs, cycles : int
        How many runs there are to march, and the cycles of each.
    modes : int
        Modes of the model.
    restitution : bool
        Whether impacts follow Newton's law of restitution.

    Raises
    ------
    InputError
        For another name, or for ``"cuda"`` without a device: the message says what is missing.
    """
    choice("engine", name, ENGINES)
    if name == "cuda" or (
        name == "auto"
        and runs >= _FEWEST_RUNS
        and runs * cycles >= _FEWEST_CYCLES
        and find_spec("numba_cuda")
    ):
        from snapbeam.engines.cuda import driver as cuda_engine

        reason = cuda_engine.refusal(modes, restitution)
        if reason is None and (name == "cuda" or not cuda_engine.simulated()):
            return "cuda", cuda_engine.run_ensemble
        if name == "cuda":
            raise InputError(f"engine = 'cuda': {reason}; use engine='cpu' or 'auto'")
    return "cpu", cpu_engine.run_ensemble
