"""General-purpose integrators on the same equations; one that is not installed is left out with a line."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from benchmarks.cases import Case

__all__ = ["PEERS", "Method", "Solver", "methods"]


class Solver(NamedTuple):
    """One case, one tolerance, ready to run."""

    sample: Callable[[NDArray[np.float64]], NDArray[np.float64]]
    """Displacement of the contact point from rest, in b, at the instants given."""
    advance: Callable[[float], None]
    """Integrate from the start to an instant, recording nothing on the way."""


class Method(NamedTuple):
    """One integrator of one library."""

    name: str
    tolerances: tuple[float, ...]
    prepare: Callable[[Case, float], Solver]
    options: str = ""
    """How it is used, as tables print it."""
    batch: Callable[[list[Case], float], Solver] | None = None
    """Many cases at once, if it can: times and ends then have a row, or an entry, for each."""


PEERS = ("fixed_steps", "scipy", "numbalsoda", "boost", "heyoka", "diffrax")


def methods(peer: str) -> tuple[Method, ...] | str:
    """The methods of a peer, or why there are none."""
    from importlib import import_module

    try:
        module = import_module(f"benchmarks.peers.{peer}_peer")
    except ImportError as error:
        return f"{peer} left out: {error}"
    found: tuple[Method, ...] = module.METHODS
    return found
