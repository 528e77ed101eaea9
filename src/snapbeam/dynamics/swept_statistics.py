"""Statistics over one parameter that is swept up and down, each value from the last state before it."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from snapbeam.dynamics.flow import frequencies_of
from snapbeam.model.integration import Integration
from snapbeam.model.parameters import lookup, ratio_of
from snapbeam.model.quantity import numbered
from snapbeam.model.system import System
from snapbeam.simulation.simulate import simulate
from snapbeam.solver.assemble import make_ensemble, run_columns
from snapbeam.solver.statistics import rows_for
from snapbeam.util.diagnostics import counting
from snapbeam.util.status_codes import ResponseClass, RunStatus
from snapbeam.util.validation import InputError, InputTypeError, axis, checked, choice, shown

if TYPE_CHECKING:
    import xarray as xr

_SWEEPS = ("up", "down")


@checked
def hysteresis(
    system: System,
    name: str,
    values: ArrayLike,
    integration: Integration | None = None,
    *,
    sweeps: Sequence[str] = _SWEEPS,
    progress: Callable[[int, int], object] | bool | None = None,
) -> xr.Dataset:
    """Compute every statistic over one parameter, swept up and then down, and carry the state on.

    Each value is one run of :func:`snapbeam.simulate` that begins with the last state of the run before it: modes, phase
    of the excitation, strikers and the circuit of a harvester.  If an excitation does not repeat, such as a record, a
    chirp or noise, every excitation restarts at each value, and only the state of the structure is carried on: all
    values are exposed to the same excitation.  The statistics whose names end in ``last_quarter`` leave out the
    transient of a value, if it is over after three quarters of its run.

    Parameters
    ----------
    system : System
        Its initial state is that of the first value of the first sweep.
    name : str
        Parameter, by dotted name or the name in datasets.
    values : array_like
        Strictly increasing, in the unit of the parameter.
    integration : Integration, optional
        Solver settings; ``cycles`` is the length of the run at each value.
    sweeps : sequence of {"up", "down"}
        One after the other; the second begins with the last state of the first.
    progress : callable, optional
        Called as ``progress(done, total)`` with values; True writes a line to standard error.

    Returns
    -------
    xarray.Dataset
        The :data:`snapbeam.STATISTICS` over ``sweep`` and the parameter.  After a run that failed, the other runs of the
        sweeps have the status NOT_RUN, the class UNKNOWN, and NaN.

    Raises
    ------
    InputError
        Before the first run: if *name* is not a numeric parameter, a value is out of range or exceeds the recorded
        motion, or a tip moves under an excitation that does not repeat, because the restart would shift the tip by a jump.

    Examples
    --------
    >>> import snapbeam as sb
    >>> from snapbeam import paper
    >>> model = sb.ReducedModel.from_beam(paper.BEAM, modes=1, damping_ratio=0.05)
    >>> shaker = sb.Shaker(frequency_ratio=1.6, velocity_amplitude=0.03)
    >>> system = sb.System(model, contacts=[sb.Contact(paper.CONTACT, shaker)])
    >>> found = sb.dynamics.hysteresis(system, "velocity_amplitude", [0.02, 0.03], sb.Integration(cycles=20))
    >>> found["peak_force"].dims
    ('sweep', 'velocity_amplitude')
    """
    from snapbeam.util.datasets import xr

    if not isinstance(system, System):
        raise InputTypeError(f"system = {shown(system)}: must be a System")
    row = system.parameter(name)
    if row.quantity.kind is not float:
        raise InputError(f"name = {shown(name)}: must be a parameter that is a number")
    points = axis(row.short, values, row.quantity.low, row.quantity.high, closed=row.quantity.closed)
    kinds = [choice("sweeps", kind, _SWEEPS) for kind in sweeps]
    if not kinds or len(set(kinds)) < len(kinds):
        raise InputError(f"sweeps = {shown(sweeps)}: must contain 'up', 'down' or both, each once")
    settings = Integration() if integration is None else integration
    if settings.early_termination:
        raise InputError(
            "early_termination = True: ends runs before their last state; set early_termination = False"
        )
    restarts = _restarts(system)
    begun = system.start_state.phase
    for value in points:
        make_ensemble(system.replace(**{row.name: float(value)}), settings)
    told = counting(progress, "hysteresis", "values")
    rows = rows_for(len(system.contacts))
    tables: dict[str, Any] = {
        key: np.full((len(kinds), points.size), _missing(key, each.dtype), each.dtype)
        for key, each in rows.items()
    }
    state, done = system.initial_state, 0
    for i, kind in enumerate(kinds):
        for k in range(points.size) if kind == "up" else reversed(range(points.size)):
            here = system.replace(**{row.name: float(points[k]), "initial_state": state})
            run = simulate(here, settings, sample_times=[0.0])
            for key, table in tables.items():
                table[i, k] = run.summary[key]
            state, done = run.final_state, done + 1
            if restarts and state is not None:
                state = dataclasses.replace(state, phase=begun, modal=None)
            if told is not None:
                told(done, len(kinds) * points.size)
            if state is None:
                break
        if state is None:
            break
    labels = {"units": row.quantity.unit, "long_name": row.quantity.long_name, "parameter": row.name}
    dims = ("sweep", row.short)
    swept = {row.short, lookup(ratio_of(row.name)).short}
    attrs = {key: value for key, value in run.dataset.attrs.items() if key not in _OF_ONE_RUN | swept}
    return xr.Dataset(
        {
            key: (dims, table, {"units": rows[key].unit, "long_name": rows[key].long_name})
            for key, table in tables.items()
        },
        {"sweep": kinds, row.short: (row.short, points, labels)},
        attrs | {"title": "statistics swept up and down", "parameter": row.short},
    )


def _restarts(system: System) -> bool:
    """Return True if an excitation does not repeat, so that every excitation restarts at each value.

    Raises
    ------
    InputError
        If a tip moves then.
    """
    motions = frequencies_of(system, run_columns(system, {}))
    single = [(section, drive) for section, drive, rates in motions if rates is None]
    if not single:
        return False
    base = system.base_excitation
    in_space = base is not None and system.striker is not None and not base.striker_on_base
    if in_space or any(numbered(section)[0] == "drive" for section, _ in system.moving):
        section, drive = single[0]
        raise InputError(
            f"{section}: a motion of type {drive.name!r} does not repeat, and its restart at each value would shift the "
            "tip of a striker by a jump; use sb.sweep, in which every value begins at rest"
        )
    return True


_OF_ONE_RUN = {
    "title",
    "response_class",
    "status",
    "system_hash",
    "parameter_hash",
    "gross_work",
    "energy_error",
}
"""Attributes of a run that do not hold for all runs."""


def _missing(name: str, kind: str) -> Any:
    """Value of a statistic of a run that was not computed."""
    if name == "response_class":
        return int(ResponseClass.UNKNOWN)
    if name == "status":
        return int(RunStatus.NOT_RUN)
    return np.nan if kind == "float64" else 0
