"""What is refused of a sweep before any run, and what is doubtful about it."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from snapbeam.config.parameters import lookup
from snapbeam.core.findings import Finding
from snapbeam.core.validate import InputError
from snapbeam.engines.assemble import cycles_of, run_columns
from snapbeam.engines.clock import require_resolved
from snapbeam.model.system import System
from snapbeam.sweeps.points import Points

if TYPE_CHECKING:
    from snapbeam.sweeps.setup import SweepSetup

__all__ = ["findings_of", "require_every_structure", "require_parameters"]


def require_parameters(system: System, points: Points) -> None:
    """Refuse axes over what the system does not have."""
    first = {name: values[0] for name, values in points.take(np.zeros(1, dtype=np.int64)).items()}
    for name, value in first.items():
        plain = value.item() if isinstance(value, np.generic) else value
        if name.startswith("run."):
            continue
        if not name.startswith("start.") and lookup(name).is_run and name not in system.parameters:
            if name == "striker.gap" and system.striker is not None:
                continue
            raise InputError(f"{name}: no parameter of this system; it has {', '.join(system.parameters)}")
        system.replace(**{name: plain})
    if (
        system.striker is None
        and system.start is None
        and not any(name.startswith("start.") for name in first)
    ):
        raise InputError("striker = None: a beam that nothing strikes needs a start to move from")


def findings_of(system: System, points: Points) -> Iterator[Finding]:
    """What is doubtful about the system, or at the ends of what is swept."""
    yield from system.findings()
    columns = points.axes if points.axes else points.take(np.arange(points.size))
    for name, values in columns.items():
        if values.dtype.kind != "f" or name.startswith(("run.", "start.")):
            continue
        for end in (values.min(), values.max()):
            yield from system.replace(**{name: float(end)}).findings()


def require_every_structure(setup: SweepSetup) -> None:
    """Refuse structures that are none, starts that do not fit them, and steps that do not resolve some run.

    Before any run: a sweep does not end in the middle of the night because its last beam is not buckled.
    """
    names = setup.points.names
    stepped = setup.integration.step is not None or "run.step" in names
    if not stepped and all(lookup(name).is_run and not name.startswith("start.") for name in names):
        return
    columns = setup.points.take(np.arange(setup.points.size))
    for system, integration, _, points in setup.groups(columns):
        setup.start_of(system, points)
        if stepped:
            own = {name: values for name, values in points.items() if not name.startswith("start.")}
            require_resolved(system, integration, cycles_of(system, run_columns(system, own)))
