"""The engines by name: the native core, and the equations in Python."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from snapbeam.solver.ensemble import Ensemble
from snapbeam.solver.statistics import OutputStates, Recorded

Progress = Callable[[int, int], object]


class Engine(Protocol):
    """Interface of a solver."""

    def run_ensemble(
        self, ensemble: Ensemble, threads: int | None = None, progress: Progress | None = None
    ) -> NDArray[Any]:
        """Integrate every run of an ensemble; a record of accumulators a run."""
        ...

    def integrate_with_output_states(
        self, ensemble: Ensemble, threads: int | None = None, progress: Progress | None = None
    ) -> OutputStates:
        """Integrate as :meth:`run_ensemble`, with the states at every output time."""
        ...

    def record(
        self,
        ensemble: Ensemble,
        times: NDArray[np.float64],
        in_contact: bool,
        progress: Callable[[float], object] | None = None,
    ) -> Iterator[Recorded]:
        """Integrate one run and return its records, one part after the other."""
        ...


def engine_of(ensemble: Ensemble) -> Engine:
    """The engine that an ensemble was arranged for."""
    if ensemble.systems:
        from snapbeam.solver import python_engine

        return python_engine
    from snapbeam.solver import native

    return native
