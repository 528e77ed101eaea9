"""Advance states by periods of the excitation."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from snapbeam.model.integration import Integration
from snapbeam.model.state import FIELDS, ModalState, State
from snapbeam.model.system import System
from snapbeam.simulation.request import require_motion
from snapbeam.simulation.states import states_of
from snapbeam.solver import native
from snapbeam.solver.assemble import make_ensemble
from snapbeam.solver.engines import engine_of
from snapbeam.solver.ensemble import Ensemble
from snapbeam.solver.statistics import OutputStates, statistics_of
from snapbeam.util.diagnostics import counting
from snapbeam.util.status_codes import RunStatus
from snapbeam.util.validation import InputError, InputTypeError, finite_array, flag, instance, positive, shown

_Array = NDArray[np.float64]

_REACHED = (int(RunStatus.OK), int(RunStatus.EARLY_STOP))
_STATISTICS = (
    "status", "zero_crossings", "impacts", "peak_force", "impulse", "striker_work", "gross_work", "energy_dissipated",
    "min_displacement", "max_displacement", "min_midspan_displacement", "max_midspan_displacement", "contact_time_fraction",
)  # fmt: skip
"""Statistics of the time that a state was advanced over."""


def advance(
    system: System,
    state: State | None = None,
    periods: float = 1,
    tangent: ArrayLike | None = None,
    *,
    integration: Integration | None = None,
    save_every_period: bool = False,
    progress: Callable[[int, int], object] | bool | None = None,
) -> State:
    """Advance a state, or a batch of states, by periods of the excitation.

    A step ends at every whole period, and the motion depends only on the state there: two calls of one period are
    bitwise identical with one call of two, or equal to rounding under motions that do not repeat and if several parts
    move, where the phase of a state counts the periods. :func:`~snapbeam.simulate` has no such steps and agrees to its
    error.

    Parameters
    ----------
    system : System
        System whose states are advanced.
    state : State, optional
        State or batch, which all cores integrate in parallel; the initial state by default.
    periods : float
        Periods, greater than 0, of the first striker that moves, or else of the base or the axial load; without an
        excitation, of the first mode.
    tangent : array_like of shape (..., k, 2, N), optional
        Small changes of amplitudes (m^0.5) and velocities (m^0.5/s), k for each state or for all, advanced by the exact
        derivatives of every step and of the times of events, with finer steps at both ends of a contact; under a user's
        law by differences. Strikers with mass, indentations and circuits begin unchanged in each call and are not returned.
    integration : Integration, optional
        Solver settings, without early termination.
    save_every_period : bool
        Return the state after each period, along a new first dimension. The ``statistics`` are those of all periods,
        except the status.
    progress : callable or bool, optional
        Report of states, as in :func:`snapbeam.sweep`.

    Returns
    -------
    State
        The advanced state, with its ``statistics`` and ``tangent``. A contact that has not ended is not an impact. If a
        state could not be reached, it is NaN, and ``statistics["status"]`` gives the reason.

    See Also
    --------
    snapbeam.simulate, snapbeam.State

    Examples
    --------
    >>> import snapbeam as sb
    >>> from snapbeam import paper
    >>> system = paper.struck_beam(frequency_ratio=1.6, velocity_amplitude=0.03, damping_ratio=0.05)
    >>> state = sb.advance(system, periods=20)
    >>> state = sb.advance(system, state, periods=1)
    >>> state.amplitude.shape
    (1,)
    """
    instance("system", system, System, "a System")
    if state is not None and not isinstance(state, State):
        raise InputTypeError(f"state = {shown(state)}: must be a State")
    integration = instance(
        "integration", Integration() if integration is None else integration, Integration, "an Integration"
    )
    span = positive("periods", periods)
    save_every_period = flag("save_every_period", save_every_period)
    report = counting(progress, "advance", "states")
    if state is None:
        require_motion(system)
        state = system.start_state
    if state.modes != system.model.modes:
        raise InputError(f"state of {state.modes} modes: must have the {system.model.modes} modes of the model")
    if tangent is not None and integration.engine == "python":
        raise InputError("tangent with engine = 'python': must be left out; engine = 'native' has derivatives")
    if save_every_period and not float(span).is_integer():
        raise InputError(f"periods = {span:g} with save_every_period = True: must be an integer")
    flat = state.flat
    if integration.tolerance is not None:
        raise InputError(
            f"tolerance = {integration.tolerance:g}: applies to simulate; give step, or accuracy = 'reference'"
        )
    ensemble = make_ensemble(system, integration.replace(early_termination=False), start=flat, periods=span)
    vectors = None
    ends = engine_of(ensemble).integrate_with_output_states(ensemble, integration.threads, report)
    if tangent is not None:
        given = _checked_tangent(tangent, flat)
        reached = np.isin(ends.accumulators_of_runs["status"], _REACHED)
        given[~reached] = np.nan
        if reached.any():
            given[reached] = _tangents(system, flat[reached], span, given[reached], integration)
        vectors = given.reshape((*state.batch, *given.shape[1:]))
    found = _states(ensemble, ends, save_every_period)
    passed = statistics_of(ensemble, ends.accumulators_of_runs)
    kept = {name: passed[name] for name in _STATISTICS}
    return _shaped(found, state.batch, save_every_period, kept, vectors)


def _tangents(system: System, begun: State, span: float, tangents: _Array, integration: Integration) -> _Array:
    """Tangents of shape (runs, k, 2, N) some periods on, period by period: their own steps are finer than those of the motion."""
    how, structure = integration.replace(early_termination=False), None
    q = p = np.empty(0)
    while span > 0.0:
        part = min(span, 1.0)
        ensemble = make_ensemble(system, how, start=begun, periods=part)
        if structure is None:  # circuits, bodies and indentations begin unchanged
            structure = ensemble.structure
            pairs = [structure.to_modal(structure.equilibrium + each, each) for each in np.eye(begun.modes)]
            q, p = (tangents[:, :, i] @ np.array([pair[i] for pair in pairs]) for i in (0, 1))
        q, p = native.tangents(ensemble, q, p, integration.threads)
        span -= part
        if span > 0.0:
            begun = advance(system, begun, part, integration=integration)
    return tangents if structure is None else structure.velocities(np.stack((q, p), axis=2))


def _checked_tangent(tangent: ArrayLike, flat: State) -> _Array:
    given = finite_array("tangent", tangent)
    shape = (2, flat.modes)
    if given.ndim < 3 or given.shape[-2:] != shape:
        raise InputError(f"tangent of shape {given.shape}: must have the shape (..., k, 2, {flat.modes})")
    try:
        return np.array(np.broadcast_to(given.reshape(-1, *given.shape[-3:]), (flat.batch[0], *given.shape[-3:])))
    except ValueError:
        raise InputError(
            f"tangent of shape {given.shape}: must have the batch {flat.batch} of the states before (k, 2, N)"
        ) from None


def _states(ensemble: Ensemble, ends: OutputStates, every: bool) -> list[State]:
    """Return the states after each period, or after the last one, with their status; NaN if a run did not reach it."""
    count, accumulators = ends.q.shape[1], ends.accumulators_of_runs
    failed = ~np.isin(accumulators["status"], _REACHED)
    found = []
    for at in range(count) if every else (count - 1,):
        ticks = np.minimum((at + 1) * ensemble.runs["output_interval"], ensemble.runs["end"])
        q, p = ends.q[:, at].copy(), ends.p[:, at].copy()
        lost = failed & ((accumulators["time"] < ticks) | (at == count - 1))
        q[lost], p[lost] = 0.0, 0.0
        state = states_of(ensemble, q, p, ends.well_sign[:, at], ends.contact_ticks[:, at], ticks)
        amplitude, velocity = state.amplitude.copy(), state.velocity.copy()
        amplitude[lost], velocity[lost] = np.nan, np.nan
        status: Any = np.where(lost, accumulators["status"], int(RunStatus.OK)).astype(np.int8)
        found.append(replace(state, amplitude=amplitude, velocity=velocity, statistics={"status": status}))
    return found


def _shaped(
    found: list[State], batch: tuple[int, ...], every: bool, passed: dict[str, Any], tangent: _Array | None
) -> State:
    """Return states as one batch of the requested shape."""
    shape = (len(found), *batch) if every else batch
    arrays = {}
    for name in FIELDS:
        stacked = np.stack([getattr(state, name) for state in found])
        arrays[name] = stacked.reshape((*shape, *stacked.shape[2:]))
    modal = None
    if all(state.modal is not None for state in found):
        parts: dict[str, Any] = {}
        for name in ("q", "p", "well_sign", "offset"):
            stacked = np.stack([getattr(state.modal, name) for state in found])
            parts[name] = stacked.reshape((*shape, *stacked.shape[2:]))
        assert found[0].modal is not None
        modal = ModalState(**parts, structure=found[0].modal.structure)
    statistics = {name: values.reshape(batch) for name, values in passed.items()}
    if every:
        status = [np.asarray(state.statistics["status"]) for state in found if state.statistics is not None]
        statistics["status"] = np.stack(status).reshape(shape)
    return State(**arrays, tangent=tangent, statistics=statistics, modal=modal)
