"""The native core: integration of damped modes and scalar channels (``core/module.cpp``)."""

from collections.abc import Callable, Mapping
from typing import Any

def integrate(
    problem: Mapping[str, Any],
    batch: Mapping[str, Any],
    layout: str,
    set: str,
    threads: int,
    progress: Callable[[int, int], object] | None,
) -> None:
    """Integrate runs; writes into the arrays of *batch*."""

def moved_arguments(
    problem: Mapping[str, Any], batch: Mapping[str, Any], moved: Mapping[int, int]
) -> tuple[bytes, bytes]:
    """A problem and a batch as bytes, whose arrays lie at other addresses."""

def integrate_tangents(
    problem: Mapping[str, Any],
    batch: Mapping[str, Any],
    tangent: Mapping[str, Any],
    set: str,
    threads: int,
    progress: Callable[[int, int], object] | None,
) -> None:
    """Integrate runs with derivatives along ``DIRECTIONS`` directions; writes into the arrays of *batch* and *tangent*."""

def record(
    problem: Mapping[str, Any], batch: Mapping[str, Any], recorder: Mapping[str, Any], layout: str, set: str
) -> None:
    """Integrate one run with its records, until the room or the steps of *recorder* are used up."""

def law_values(law: int, arrays: Mapping[str, Any]) -> None:
    """Evaluate a law; writes into *arrays*."""

def kick_parts(composition: int, decay: float) -> float:
    """Parts of a kick in which forces of velocities are integrated, by the decay of the velocities within it."""

def instruction_sets() -> list[str]:
    """Return the instruction sets that this build and this processor have, best first."""

COMPOSITIONS: list[tuple[list[float], list[float]]]
"""Weights of the flows and of the kicks of a step, by the number of a composition."""
SOURCES: str
"""SHA-256 of the sources of the core."""
DIRECTIONS: int
"""Directions of derivatives in one pass."""
LOSSY: list[int]
"""Numbers of the laws whose force depends on a velocity."""
RUN_NUMBERS: int
"""Numbers of a run, statistics of a run, and sums of a channel: the lengths of rows."""
STATISTICS: int
OF_CHANNEL: int
