"""The engines by name."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from importlib.util import find_spec
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from snapbeam.model.contact.base import ContactLaw
from snapbeam.model.drive.base import Drive
from snapbeam.model.drive.sine import Sine
from snapbeam.model.integration import ENGINES
from snapbeam.solver.cpu import driver as cpu
from snapbeam.solver.ensemble import Ensemble
from snapbeam.solver.restrictions import is_native
from snapbeam.solver.statistics import OutputStates, Recorded
from snapbeam.util.validation import InputError, choice

_FEWEST_RUNS = 2000
"""A device integrates one run slower than a core does, but over a thousand at a time: fewer do not fill it."""
_FEWEST_CYCLES = 2_000_000
"""Cycles of all runs, more than a minute of a core's work: with fewer, compiling the kernel costs more."""

Progress = Callable[[int, int], object]


class Engine(Protocol):
    """Interface of a solver; unsupported operations raise an error with a reason."""

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

    def integrate_tangents(
        self,
        ensemble: Ensemble,
        tangents: NDArray[np.float64],
        threads: int | None = None,
        progress: Progress | None = None,
    ) -> tuple[OutputStates, NDArray[np.float64]]:
        """Integrate as :meth:`integrate_with_output_states`, with tangents."""
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
    """The engine that an ensemble was arranged for, of those that run on the processor."""
    if ensemble.systems:
        from snapbeam.solver import python_engine

        return python_engine
    if ensemble.channels is None:
        return cpu
    from snapbeam.solver import native

    return native


def resolve(
    name: str,
    *,
    runs: int = 1,
    cycles: float = 1,
    modes: int = 1,
    law: type[ContactLaw] | None = None,
    drive: type[Drive] = Sine,
    striker_with_mass: bool = False,
    unequal_wells: bool = False,
    environment: bool = False,
    several_strikers: bool = False,
) -> tuple[str, Engine]:
    """The engine that *name* stands for, and its own name.

    ``"auto"`` is the CUDA engine where a device can be used, what is studied is something for it and the work pays
    for it, else the CPU's: at least 2000 runs and two million cycles in all, at most 128 modes.

    Parameters
    ----------
    name : {"auto", "cpu", "cuda", "native", "python"}
    runs : int
        How many there are to integrate.
    cycles : float
        Of each.
    modes : int
        Modes of the model.
    law, drive : type
        Of contact, and of the striker.
    striker_with_mass : bool
        Whether the striker is a body with a mass.
    unequal_wells : bool
        Whether the wells are unequal.
    environment : bool
        Whether a base moves, the axial load changes, an external or local force acts, or there is a harvester.
    several_strikers : bool
        Whether several strikers strike.

    Raises
    ------
    InputError
        For another name, or for ``"cuda"`` without a device: the message says what is missing.
    """
    choice("engine", name, ENGINES)
    if is_native(name):
        from snapbeam.solver import native

        return "native", native
    if name == "python":
        from snapbeam.solver import python_engine

        return "python", python_engine
    pays = runs >= _FEWEST_RUNS and runs * cycles >= _FEWEST_CYCLES
    if name == "cuda" or (name == "auto" and pays and find_spec("numba_cuda")):
        from snapbeam.solver.cuda import driver as cuda

        reason = cuda.refusal(modes, law, drive)
        if striker_with_mass:
            reason = "a striker with a mass is integrated by the CPU engine alone"
        if unequal_wells:
            reason = "a beam with unequal wells is integrated by the CPU engine alone"
        if environment:
            reason = "a moving base, a changing axial load, an external or local force and a harvester are integrated by the CPU engine alone"
        if several_strikers:
            reason = "several strikers are integrated by the CPU engine alone"
        if reason is None and (name == "cuda" or not cuda.simulated()):
            return "cuda", cuda
        if name == "cuda":
            raise InputError(f"engine = 'cuda': {reason}; use engine='cpu' or 'auto'")
    return "cpu", cpu
