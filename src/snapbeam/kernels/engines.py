"""The engines by name."""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from snapbeam.kernels import cpu_engine
from snapbeam.kernels.ensemble import Ensemble
from snapbeam.validate import choice

__all__ = ["ENGINES", "Engine", "resolve"]

ENGINES = ("auto", "cpu")


class Engine(Protocol):
    """An engine marches every run of an ensemble and returns its counts and numbers, a row a run."""

    def __call__(
        self,
        ensemble: Ensemble,
        threads: int | None = None,
        progress: Callable[[int, int], object] | None = None,
    ) -> tuple[NDArray[np.int64], NDArray[np.float64]]: ...


def resolve(name: str) -> tuple[str, Engine]:
    """The engine *name* stands for, and its own name."""
    choice("engine", name, ENGINES)
    return "cpu", cpu_engine.run_ensemble
