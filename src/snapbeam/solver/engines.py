"""The engines: the native core, and the equations in Python.

Each has ``run_ensemble`` (a record of accumulators a run), ``integrate_with_output_states`` (with the states at every
output time) and ``record`` (one run, its records one part after the other), as :mod:`snapbeam.solver.native` defines them.
"""

from __future__ import annotations

from types import ModuleType

from snapbeam.solver.ensemble import Ensemble


def engine_of(ensemble: Ensemble) -> ModuleType:
    """The engine that an ensemble was arranged for."""
    if ensemble.systems:
        from snapbeam.solver import python_engine

        return python_engine
    from snapbeam.solver import native

    return native
