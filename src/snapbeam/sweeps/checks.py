"""What is refused of a sweep before any run, and what is doubtful about it."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np

from snapbeam.config.parameters import lookup
from snapbeam.core.findings import Diagnostic
from snapbeam.core.validate import InputError
from snapbeam.engines.assemble import cycles_of, run_columns
from snapbeam.engines.clock import require_resolved
from snapbeam.model.system import System
from snapbeam.sweeps.points import Grid, Points

if TYPE_CHECKING:
    from snapbeam.sweeps.setup import SweepSetup

__all__ = ["diagnostics_of", "require_every_structure", "require_parameters"]


def require_parameters(system: System, points: Points) -> None:
    """Refuse axes over what the system does not have, by its first point."""
    first = {name: values[0] for name, values in points.take(np.zeros(1, dtype=np.int64)).items()}
    for name in first:
        if name.startswith(("run.", "start.")) or not lookup(name).is_run or name in system.parameters:
            continue
        section, _, field = name.partition(".")
        if field != "gap" or section not in {each.partition(".")[0] for each in system.parameters}:
            raise InputError(f"{name}: no parameter of this system; it has {', '.join(system.parameters)}")
    if (
        system.striker is None
        and system.initial_state is None
        and not system.moving
        and not any(name.startswith("start.") for name in first)
    ):
        raise InputError("striker = None: a beam that nothing strikes needs a start to move from")
    _at(system, first)


def _at(system: System, point: dict[str, Any]) -> System:
    """The system at a point."""
    plain = {name: value.item() if isinstance(value, np.generic) else value for name, value in point.items()}
    return system.replace(**{name: value for name, value in plain.items() if not name.startswith("run.")})


def diagnostics_of(system: System, points: Points) -> Iterator[Diagnostic]:
    """What is doubtful about the system, or at the ends of what is swept."""
    yield from system.diagnostics()
    for number in _ends(points):
        point = {name: values[0] for name, values in points.take(np.array([number])).items()}
        yield from _at(system, point).diagnostics()


def _ends(points: Points) -> list[int]:
    """Points at which some number is least or greatest."""
    if isinstance(points, Grid):
        corners = [(0,) * len(points.shape)]
        corners += [
            tuple(size - 1 if i == at else 0 for i in range(len(points.shape)))
            for at, size in enumerate(points.shape)
        ]
        return [int(np.ravel_multi_index(corner, points.shape)) for corner in corners]
    numbers = [values for values in points.columns.values() if values.dtype.kind in "if"]
    return sorted({int(at) for values in numbers for at in (values.argmin(), values.argmax())})


def require_every_structure(setup: SweepSetup) -> None:
    """Refuse structures that are none, starts that do not fit them, and steps that do not resolve some run.

    Before any run: a sweep does not end in the middle of the night because its last beam is not buckled.
    """
    names = setup.points.names
    stepped = setup.integration.step is not None or "integration.step" in names
    if not stepped and all(lookup(name).is_run and not name.startswith("start.") for name in names):
        return
    columns = setup.points.take(np.arange(setup.points.size))
    for system, integration, _, points in setup.groups(columns):
        setup.start_of(system, points)
        if stepped:
            own = {name: values for name, values in points.items() if not name.startswith("start.")}
            require_resolved(system, integration, cycles_of(system, run_columns(system, own)))
