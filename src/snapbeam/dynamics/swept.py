"""A parameter that is swept up and down: states once a period (bifurcation diagram) and statistics (hysteresis)."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from snapbeam.dynamics.approaches import passage_of
from snapbeam.dynamics.clock import frequencies_of
from snapbeam.dynamics.flow import InitialConditions, minimal_period, starts_of
from snapbeam.dynamics.results import fixed_parameters, labelled, reported
from snapbeam.dynamics.stroboscope import Stroboscope, settling_periods
from snapbeam.model.integration import Integration
from snapbeam.model.parameters import lookup, ratio_of
from snapbeam.model.quantity import numbered
from snapbeam.model.system import System
from snapbeam.simulation.simulate import simulate
from snapbeam.solver.assemble import make_ensemble, run_columns
from snapbeam.solver.statistics import rows_for
from snapbeam.util.status_codes import ResponseClass, RunStatus
from snapbeam.util.validation import InputError, InputTypeError, axis, checked, choice, flag, instance, integer, shown

if TYPE_CHECKING:
    import xarray as xr

_Array = NDArray[np.float64]
SWEEPS = ("up", "down")
_PASSAGE = 4
"""Periods that approaches are looked at in."""


class _Axis:
    """The parameter of sweeps and its values."""

    def __init__(self, system: System, name: str, values: ArrayLike) -> None:
        instance("system", system, System, "a System")
        row = system.parameter(name)
        if row.quantity.kind is not float:
            raise InputError(f"name = {shown(name)}: must be a parameter that is a number")
        self.name, self.short = row.name, row.short
        low, high, closed = row.quantity.low, row.quantity.high, row.quantity.closed
        self.values = axis(row.short, values, low, high, closed=closed)
        self._labels = {"units": row.quantity.unit, "long_name": row.quantity.long_name, "parameter": row.name}

    def order(self, kind: str) -> range:
        """Numbers of the values in the order of a sweep."""
        return range(self.values.size)[:: 1 if kind == "up" else -1]

    def dataset(
        self, kinds: list[str], variables: dict[str, tuple[Any, Any, Any]], attrs: dict[str, Any]
    ) -> xr.Dataset:
        """Results over the sweeps, the parameter and further dimensions."""
        found = {name: (("sweep", self.short, *more), table, words) for name, (more, table, words) in variables.items()}
        coords = {"sweep": kinds, self.short: (self.short, self.values, self._labels)}
        return labelled(found, coords, attrs | {"parameter": self.short})


@checked
def bifurcation_diagram(
    system: System,
    name: str,
    values: ArrayLike,
    integration: Integration | None = None,
    *,
    sweeps: Sequence[str] = SWEEPS,
    initial_conditions: InitialConditions | int = 0,
    periods: tuple[int | None, int] = (None, 32),
    grazing: bool = False,
    progress: Callable[[int, int], object] | bool | None = None,
) -> xr.Dataset:
    """Compute a bifurcation diagram: states once a period over one parameter that is swept up and down.

    Each sweep continues from the last state: sweeps differ where attractors coexist; random starts show further ones.

    Parameters
    ----------
    system : System
        System whose parameter is swept.
    name : str
        Parameter, by any of its names.
    values : array_like
        Values of the parameter, strictly increasing, in its unit.
    integration : Integration, optional
        Solver settings.
    sweeps : sequence of {"up", "down"}
        Directions in their order.
    initial_conditions : InitialConditions or int
        Further starts at every value; none by default.
    periods : pair of int
        Periods to discard (None: 16 time constants of the slowest mode, in [200, 20,000]) and to record, at each value.
    grazing : bool
        Sample every approach in four of the recorded periods densely: ``clearance``, ``min_penetration``.
    progress : callable or bool, optional
        Report of values, as in :func:`snapbeam.sweep`.

    Returns
    -------
    xarray.Dataset
        Variables over ``sweep``, the parameter and ``period``: displacements over b and velocities over b omega_1 of
        the centre and of the contact point, at the phase of the start. Over ``sweep`` and the parameter:
        ``impacts_per_period``, ``crossings_per_period``, ``minimal_period`` (0: none seen), ``failed``; NaN follow.

    See Also
    --------
    snapbeam.dynamics.hysteresis, snapbeam.dynamics.continuation, snapbeam.plot.plot_diagram

    Examples
    --------
    >>> import snapbeam as sb
    >>> system = sb.paper.struck_beam(frequency_ratio=1.6, velocity_amplitude=0.03, damping_ratio=0.05)
    >>> diagram = sb.dynamics.bifurcation_diagram(system, "velocity_amplitude", [0.02, 0.03, 0.04])
    >>> dict(diagram.sizes)
    {'sweep': 2, 'velocity_amplitude': 3, 'period': 32}
    """
    swept = _Axis(system, name, values)
    kinds = [choice("sweeps", kind, SWEEPS) for kind in sweeps]
    try:
        given, keep = periods
    except (TypeError, ValueError):
        raise InputTypeError(f"periods = {shown(periods)}: must be a pair, periods to leave out and to keep") from None
    integer("periods[1]", keep, 2, 10**6)
    flag("grazing", grazing)
    asked = isinstance(initial_conditions, InitialConditions) or initial_conditions
    many = starts_of(initial_conditions) if asked else None
    if not kinds and many is None:
        raise InputError("sweeps = (): must be at least one, or initial_conditions at least 1")
    flow = Stroboscope(system, Integration() if integration is None else integration)
    leave, rule = settling_periods(flow, given, name="periods[0]")
    count, further = swept.values.size, 0 if many is None else many.count
    report, total = reported(progress, "bifurcation diagram", "values"), count * (bool(kinds) + further)
    rows = np.empty((len(kinds) + further, count, keep, flow.dimension))
    counts = np.empty((len(rows), count, 2))
    x = np.repeat(flow.coordinates(), len(kinds), axis=0)
    side_by_side = np.arange(len(kinds))
    for step in range(count if kinds else 0):
        at = np.array([swept.order(kind)[step] for kind in kinds])
        rows[side_by_side, at], counts[side_by_side, at] = _recorded(flow, swept, x, at, leave, keep)
        x = rows[side_by_side, at, -1]
        report(step + 1, total)
    for number in range(further):
        assert many is not None
        location = swept.values if swept.name == "contact.location" else None
        state = many.state(flow.system, number, flow.system.start_state, location)
        begun = np.broadcast_to(flow.coordinates(state), (count, flow.dimension))
        place = len(kinds) + number
        rows[place], counts[place] = _recorded(flow, swept, begun, np.arange(count), leave, keep)
        report(count * (bool(kinds) + number + 1), total)
    labels = [*kinds, *(f"start {number}" for number in range(further))]
    dataset = _diagram(flow, swept, labels, rows, counts, grazing)
    reason = f"{leave} periods left out ({rule}) and {keep} kept at each value"
    return dataset.assign_attrs(periods_left_out=leave, termination_reason=reason)


def _recorded(
    flow: Stroboscope, swept: _Axis, x: _Array, at: NDArray[np.int64], leave: int, keep: int
) -> tuple[_Array, _Array]:
    """States that some runs keep, shape (runs, keep, d), and impacts and crossings a period."""
    values, periods = swept.values[at], leave + keep
    if lookup(swept.name).is_run:
        found = [flow.advance(x, periods, every=True, points={swept.name: values})]
    else:
        found = [
            flow.changed({swept.name: float(value)}).advance(each[None], periods, every=True)
            for each, value in zip(x, values, strict=True)
        ]
    every = np.concatenate([each.every[:, leave:] for each in found if each.every is not None])
    names = "impacts", "zero_crossings"
    counts = [np.concatenate([each.statistics[name] for each in found]) for name in names]
    return every, np.stack(counts, axis=1) / periods


def _diagram(
    flow: Stroboscope, swept: _Axis, labels: list[str], rows: _Array, counts: _Array, grazing: bool
) -> xr.Dataset:
    system, n = flow.system, flow.space.modes
    model, scale, full = system.model, system.scale, rows * flow.space.scales
    parts = {
        "displacement": (full[..., :n], scale.length, "b"),
        "velocity": (full[..., n : 2 * n], scale.length * scale.omega, "b omega_1"),
    }
    location = 0.5 if system.striker is None else system.striker.location
    shapes = {
        "midspan_{}": ("mid-span", model.midspan_shape),
        "{}_at_striker": ("contact point's", model.shape_at(location)),
    }
    found: dict[str, tuple[Any, Any, Any]] = {
        name.format(what): (("period",), values @ shape / unit, f"{words} {what} once a period, over {over}")
        for name, (words, shape) in shapes.items()
        for what, (values, unit, over) in parts.items()
    }
    known = np.asarray(np.isfinite(rows).all(axis=(-1, -2)))
    seen = np.where(known[..., None], counts, np.nan)
    periods = np.where(known, minimal_period(np.where(np.isfinite(rows), rows, 0.0)), 0)
    found |= {
        "impacts_per_period": ((), seen[..., 0], "impacts per period of the drive"),
        "crossings_per_period": ((), seen[..., 1], "zero crossings of mid-span per period"),
        "minimal_period": ((), periods, "periods after which it repeats; 0: not seen to"),
        "failed": ((), ~known, "whether a run failed there"),
    }
    if grazing and system.striker is not None:
        near = np.full((*known.shape, 2), np.nan)
        for at in map(tuple, np.argwhere(known)):
            here = flow.changed({swept.name: float(swept.values[at[-1]])})
            passage = passage_of(here, rows[at][-1], _PASSAGE)
            near[at] = passage.clearance, passage.min_penetration
        words = "minimum gap at which the beam turns back without contact, over b"
        found["clearance"] = ((), near[..., 0], words)
        found["min_penetration"] = ((), near[..., 1], "penetration of the lightest impact, over b")
    attrs = fixed_parameters(flow, swept.short)
    return swept.dataset(labels, found, attrs | {"title": "bifurcation diagram", "system_hash": system.hash})


@checked
def hysteresis(
    system: System,
    name: str,
    values: ArrayLike,
    integration: Integration | None = None,
    *,
    sweeps: Sequence[str] = SWEEPS,
    progress: Callable[[int, int], object] | bool | None = None,
) -> xr.Dataset:
    """Compute every statistic over one parameter, swept up and then down, and carry the state on.

    Each value is one run of :func:`snapbeam.simulate` from the last state before it: modes, phase of the excitation,
    strikers and circuit. An excitation that does not repeat (a record, a chirp, noise) restarts at each value, and only
    the state of the structure is carried on. Statistics named ``last_quarter`` leave out a transient.

    Parameters
    ----------
    system : System
        System, in the initial state of the first value.
    name : str
        Parameter, by any of its names.
    values : array_like
        Values of the parameter, strictly increasing, in its unit.
    integration : Integration, optional
        Solver settings; ``cycles`` at each value.
    sweeps : sequence of {"up", "down"}
        Directions in their order.
    progress : callable or bool, optional
        Report of values, as in :func:`snapbeam.sweep`.

    Returns
    -------
    xarray.Dataset
        The :data:`snapbeam.STATISTICS` over ``sweep`` and the parameter; after a failed run NOT_RUN, UNKNOWN and NaN.

    Raises
    ------
    InputError
        Before the first run, if *name* is not a numeric parameter, a value is out of range or exceeds the recorded
        motion, or a restart would shift the tip by a jump.

    See Also
    --------
    snapbeam.dynamics.bifurcation_diagram, snapbeam.sweep

    Examples
    --------
    >>> import snapbeam as sb
    >>> system = sb.paper.struck_beam(frequency_ratio=1.6, velocity_amplitude=0.03, damping_ratio=0.05)
    >>> found = sb.dynamics.hysteresis(system, "velocity_amplitude", [0.02, 0.03], sb.Integration(cycles=20))
    >>> found["peak_force"].dims
    ('sweep', 'velocity_amplitude')
    """
    swept = _Axis(system, name, values)
    kinds = [choice("sweeps", kind, SWEEPS) for kind in sweeps]
    if not kinds or len(set(kinds)) < len(kinds):
        raise InputError(f"sweeps = {shown(sweeps)}: must contain 'up', 'down' or both, each once")
    settings = Integration() if integration is None else integration
    if settings.early_termination:
        raise InputError("early_termination = True: ends runs before their last state; set early_termination = False")
    restarts, begun, count = _restarts(system), system.start_state.phase, swept.values.size
    for value in swept.values:
        make_ensemble(system.replace(**{swept.name: float(value)}), settings)
    told = reported(progress, "hysteresis", "values")
    rows = rows_for(len(system.contacts))
    tables: dict[str, Any] = {
        key: np.full((len(kinds), count), _MISSING.get(key, np.nan if each.dtype == "float64" else 0), each.dtype)
        for key, each in rows.items()
    }
    state = system.initial_state
    places = [(i, k) for i, kind in enumerate(kinds) for k in swept.order(kind)]
    attrs: dict[str, Any] = {}
    for done, (i, k) in enumerate(places, 1):
        here = system.replace(**{swept.name: float(swept.values[k]), "initial_state": state})
        run = simulate(here, settings, sample_times=[0.0])
        attrs = attrs or dict(run.dataset.attrs)  # of the first run: later ones begin where the one before ended
        for key, table in tables.items():
            table[i, k] = run.summary[key]
        state = run.final_state
        told(done, len(places))
        if state is None:
            break
        if restarts:
            state = dataclasses.replace(state, phase=begun, modal=None)
    left_out = _OF_ONE_RUN | {swept.short, lookup(ratio_of(swept.name)).short}
    attrs = {key: value for key, value in attrs.items() if key not in left_out}
    variables = {
        key: ((), table, {"units": rows[key].unit, "long_name": rows[key].long_name}) for key, table in tables.items()
    }
    return swept.dataset(kinds, variables, attrs | {"title": "statistics swept up and down"})


def _restarts(system: System) -> bool:
    """Return True if an excitation does not repeat, so that every excitation restarts at each value."""
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


_OF_ONE_RUN = {"title", "response_class", "status", "system_hash", "parameter_hash", "gross_work", "energy_error"}
"""Attributes of a run that do not hold for all runs."""


_MISSING = {"response_class": int(ResponseClass.UNKNOWN), "status": int(RunStatus.NOT_RUN)}
"""Values of statistics of a run that was not computed."""
