"""Stroboscopic map of a system over one period of its drive."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from snapbeam.dynamics.clock import Clock
from snapbeam.dynamics.coordinates import Coordinates
from snapbeam.dynamics.flow import AdvancedStates, Flow, held_in_space, joined
from snapbeam.model.integration import Integration
from snapbeam.model.parameter_axes import ratios_of
from snapbeam.model.state import State
from snapbeam.model.system import System
from snapbeam.simulation.states import states_of
from snapbeam.solver import native
from snapbeam.solver.assemble import make_ensemble, plans_of, run_columns
from snapbeam.solver.engines import engine_of
from snapbeam.solver.ensemble import Ensemble
from snapbeam.solver.statistics import statistics_of
from snapbeam.util.status_codes import RunStatus
from snapbeam.util.validation import InputError, InputTypeError, instance, integer, shown

_Array = NDArray[np.float64]
_REACHED = (int(RunStatus.OK), int(RunStatus.EARLY_STOP))
_BYTES = 2**27
"""Maximum memory of the stored states."""
TIME_CONSTANTS = 16.0
"""Time constants of the slowest decay after which a motion counts as settled: free vibration has fallen to 1e-7."""
_LONGEST = 20_000
"""Maximum number of periods that the damping chooses."""


@dataclass(frozen=True, eq=False)
class Stroboscope:
    """The map of a system over the common period of its motions, at a phase, rad, its tips held at mid-positions."""

    system: System
    integration: Integration = field(default_factory=Integration)
    phase: float | None = None
    backward: bool = False
    """True of the inverse map, which integrates backwards in time."""

    def __post_init__(self) -> None:
        instance("system", self.system, System, "a System")
        instance("integration", self.integration, Integration, "an Integration")
        if self.integration.tolerance is not None:
            raise InputError(
                f"tolerance = {self.integration.tolerance:g}: is for one run; give steps, or accuracy = 'reference'"
            )
        Clock(self.system).cycles_per_period  # noqa: B018  refuses motions without a common period
        object.__setattr__(self, "system", held_in_space(self.system))

    @cached_property
    def space(self) -> Coordinates:
        """Coordinates of the states."""
        return Coordinates(self.system, self.integration)

    @cached_property
    def clock(self) -> Clock:
        """Period and phase at which states are taken."""
        return Clock(self.system, self.phase)

    @property
    def dimension(self) -> int:
        """Coordinates of a state."""
        return self.space.dimension

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the coordinates."""
        return self.space.names

    @property
    def period(self) -> float:
        """Common period of all motions, s."""
        return self.clock.period

    @property
    def jumps(self) -> bool:
        """True if the derivatives of the map may jump, by a contact force that does, depends on the velocity or has a memory."""
        return any(each.law.is_dissipative for each in self.system.contacts)

    @cached_property
    def inverse(self) -> Stroboscope | None:
        """The inverse map; None if a part of the system, as a damped contact, cannot be integrated backwards in time."""
        possible = native.reversed_in_time(make_ensemble(self.system, self.integration)) is not None
        return replace(self, backward=not self.backward) if possible else None

    @property
    def with_half_step(self) -> Stroboscope:
        """The flow with steps of half the length."""
        step = plans_of(self.system, self.integration, run_columns(self.system, {}))[0].step
        return replace(self, integration=self.integration.replace(step=0.5 * step))

    def changed(self, values: Mapping[str, float]) -> Stroboscope:
        """The flow of the system with parameters changed, by dotted names or the names in datasets."""
        for name in values:
            self.clock.require_free(name)
        changes = {self.system.parameter(name).name: value for name, value in values.items()}
        return replace(self, system=self.system.replace(**changes))

    def value(self, name: str) -> float:
        """A parameter of the system."""
        return float(self.system.get(self.system.parameter(name).name))

    def coordinates(self, state: State | None = None) -> _Array:
        """A state, or a batch of them, in the coordinates of the flow, shape (runs, d); the start by default."""
        if state is None:
            state = self.system.start_state
        else:
            self.clock.require_phase(state)
        if state.modes != self.space.modes:
            raise InputError(f"state of {state.modes} modes: must have the {self.space.modes} modes of the model")
        return self.space.of(state.flat)

    def state(self, coordinates: ArrayLike) -> State:
        """States of coordinates of shape (..., d), at the phase at which the system is seen."""
        return State(
            **self.space.arrays(np.asarray(coordinates, dtype=np.float64)),
            phase=np.array(self.clock.state_phase),
            striker_position=np.array(self._striker_position),
        )

    def starting(self, coordinates: ArrayLike) -> System:
        """The system that begins with a state, at the phase at which the system is seen."""
        return self.clock.starting(self.state(coordinates))

    def during(self, periods: int) -> Integration:
        """Settings of a run over some periods."""
        cycles = periods * self.clock.cycles_per_period
        return self.integration.replace(cycles=cycles, early_termination=False)

    @cached_property
    def _striker_position(self) -> float:
        """Mid-position of the tip, m; NaN without a striker."""
        if self.system.striker is None:
            return math.nan
        ensemble = make_ensemble(self.system, self.integration)
        run, sign = ensemble.runs[0], ensemble.structure.sign
        return float(sign * (run["rest_contact"][0] + run["offset"][0]))

    def advance(
        self,
        states: ArrayLike | AdvancedStates,
        periods: int = 1,
        *,
        tangents: _Array | None = None,
        every: bool = False,
        points: Mapping[str, _Array] | None = None,
    ) -> AdvancedStates:
        """Advance as :meth:`Flow.advance`; a run does not depend on the runs that are integrated with it."""
        begun = states.hidden if isinstance(states, AdvancedStates) else self._begun(states)
        if tangents is not None and periods > 1:
            # period by period along this motion, which that of the finer steps of derivatives would leave
            came = self.advance(states, periods, every=True, points=points)
            for start in (begun, *(came.hidden_every or ())[:-1]):
                tangents = self._advance_part(start, 1, False, points, tangents).tangents
            kept = came if every else replace(came, every=None, hidden_every=None)
            return replace(kept, tangents=tangents)
        count, size = begun.batch[0], 2 * 8 * (self.space.modes + 16)
        share = max(1, _BYTES // (size * periods * self.clock.cycles_per_period))
        parts = [slice(at, min(at + share, count)) for at in range(0, count, share)]
        found = [
            self._advance_part(
                begun[part] if len(parts) > 1 else begun,
                periods,
                every,
                None if points is None else {name: values[part] for name, values in points.items()},
                None if tangents is None else tangents[part],
            )
            for part in parts
        ]
        return found[0] if len(found) == 1 else joined(found)

    def _begun(self, states: ArrayLike) -> State:
        try:
            rows = np.atleast_2d(np.asarray(states, dtype=np.float64))
        except (TypeError, ValueError, OverflowError):
            raise InputTypeError(f"states = {shown(states)}: must be an array of numbers, a row a run") from None
        if rows.ndim != 2 or rows.shape[1] != self.dimension:
            raise InputError(f"states of shape {rows.shape}: must have the shape (runs, {self.dimension})")
        # a failed state stands still and stays lost
        lost = ~np.asarray(np.isfinite(rows).all(axis=1))
        passed: dict[str, Any] = {"status": np.where(lost, int(RunStatus.DIVERGED), int(RunStatus.OK)).astype(np.int8)}
        arrays = self.space.arrays(np.where(lost[:, None], 0.0, rows))
        return State(**arrays, phase=np.array(self.clock.given_phase), statistics=passed)

    def _ensemble(self, begun: State, periods: int, points: Mapping[str, _Array]) -> Ensemble:
        """Runs of some periods from a batch of states."""
        for name in points:
            self.clock.require_free(name)
        named = {self.system.parameter(name).name: np.asarray(each) for name, each in points.items()}
        own = ratios_of(self.system, named)
        if own:
            self.clock.require_period(own)
        how = self.during(periods)
        ensemble = make_ensemble(self.system, how, own, start=begun.flat, periods=how.cycles)
        found = native.reversed_in_time(ensemble) if self.backward else ensemble
        assert found is not None
        return found

    def slope(self, x: _Array, periods: int, values: Mapping[str, float], name: str, step: float) -> _Array:
        """Derivative of the map of one state by a parameter, shape (d,): of a run's numbers a difference, or exact."""
        begun, moved = self._begun(x[None]), np.zeros((1, 1, self.dimension))
        given = {key: np.array([value]) for key, value in values.items()}
        points = [given, *(given | {name: np.array([values[name] + sign * step])} for sign in (1.0, -1.0))]
        for _ in range(periods):
            here, above, below = (self._ensemble(begun, 1, each) for each in points)
            # a motion with other pieces, or jumps in another order: a difference between runs
            if not (native.unchanged(above, below) and native.differentiable(above, below)):
                ends = [self.advance(x[None], periods, points=each) for each in points[1:]]
                return np.asarray((ends[0].states - ends[1].states)[0] / (2.0 * step))
            moved = self._moved(here, moved, np.zeros(1, bool), (above, below, 2.0 * step))
            begun = self._advance_part(begun, 1, False, given, None).hidden
            # the gap says where the tip is, whatever the parameter moves
            begun = replace(begun, striker_position=np.array(np.nan), modal=None)
        return np.asarray(moved[0, 0])

    def _advance_part(
        self, begun: State, periods: int, every: bool, points: Mapping[str, _Array] | None, tangents: _Array | None
    ) -> AdvancedStates:
        ensemble = self._ensemble(begun, periods, points or {})
        seen = engine_of(ensemble).integrate_with_output_states(ensemble, self.integration.threads)
        if self.backward:  # when a contact began is known forwards alone: its penetration decides
            ticks = np.where(seen.contact_ticks > 0.0, np.nan, seen.contact_ticks)
            seen = seen._replace(p=-seen.p, contact_ticks=ticks)
        status = seen.accumulators_of_runs["status"]
        failed = ~np.isin(status, _REACHED)
        if begun.statistics is not None:
            failed |= ~np.isin(begun.statistics["status"], _REACHED)
        passed = np.where(failed, np.where(status == 0, int(RunStatus.DIVERGED), status), 0)
        cycles = self.clock.cycles_per_period
        each = slice(cycles - 1 if every else -1, None, cycles)
        whole = self.space.of_modal(ensemble, seen.q[:, each], seen.p[:, each], seen.well_sign[:, each])
        whole[failed] = np.nan

        def after(index: int) -> State:
            q, p = (np.where(failed[:, None], 0.0, values[:, index]) for values in (seen.q, seen.p))
            well_sign = np.where(failed, 1.0, seen.well_sign[:, index])
            found = states_of(ensemble, q, p, well_sign, seen.contact_ticks[:, index], ensemble.runs["end"])
            # after a period every motion is where it began
            return replace(found, phase=ensemble.runs["phase"].copy(), statistics={"status": passed})

        return AdvancedStates(
            whole[:, -1],
            whole if every else None,
            None if tangents is None else self._moved(ensemble, tangents, failed),
            statistics_of(ensemble, seen.accumulators_of_runs),
            after(-1),
            tuple(after(index) for index in range(seen.q.shape[1])[each]) if every else None,
        )

    def _moved(
        self,
        ensemble: Ensemble,
        tangents: _Array,
        failed: NDArray[np.bool_],
        beside: tuple[Ensemble, Ensemble, float] | None = None,
    ) -> _Array:
        """Small changes of shape (runs, k, d) of the coordinates at the end of runs, NaN of those that failed."""
        q, p = self.space.modal_directions(ensemble)
        sense = -1.0 if self.backward else 1.0
        q, p = native.tangents(ensemble, tangents @ q, tangents @ (sense * p), self.integration.threads, beside)
        p = sense * p
        one, none = np.ones(q.shape[:2], np.int64), np.zeros_like(q)
        found: _Array = self.space.of_modal(ensemble, q, p, one) - self.space.of_modal(ensemble, none, none, one)
        found[failed] = np.nan
        return found


def flow_of(system: System | Flow, integration: Integration | None = None, accuracy: str = "standard") -> Flow:
    """The flow that a system makes, or one that is one; *accuracy* is meant where no integration is given."""
    if isinstance(system, System):
        return Stroboscope(system, Integration(accuracy=accuracy) if integration is None else integration)
    instance("system", system, Flow, "a System, or a Flow that takes states a period on")
    if integration is not None:
        raise InputTypeError("integration: is for a System; a Flow brings its own")
    return system


def settling_periods(
    flow: Flow, given: Any = None, rates: Iterable[float] = (), least: int = 200, name: str = "transient", low: int = 0
) -> tuple[int, str]:
    """Periods after which a motion is settled, and the rule: *given*, or by the slowest mode or decay *rates*, 1/s."""
    if given is not None:
        return integer(name, given, low, 10**7), "as given"
    known = list(rates)
    if isinstance(flow, Stroboscope):
        model = flow.system.struck_model
        decay = model.damping_ratio * model.omega if model.damping is None else -flow.system.poles().real
        known.append(float(np.min(decay)))
    if not known:
        return least, f"{least} periods"
    slowest = min(known)
    wanted = TIME_CONSTANTS / (slowest * flow.period) if slowest > 0.0 else math.inf
    rule = f"{TIME_CONSTANTS:g} time constants of the slowest decay"
    if wanted > _LONGEST:
        return _LONGEST, f"the maximum of {_LONGEST} periods; {rule} would be {wanted:.3g}"
    if wanted < least:
        return least, f"the minimum of {least} periods; {rule} are {wanted:.3g}"
    return math.ceil(wanted), rule
