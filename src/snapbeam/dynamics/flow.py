"""Maps that take batches of states over one period, and the initial conditions of their runs.

:class:`Flow` is the protocol of such a map.  That of a system is
:class:`~snapbeam.dynamics.stroboscope.Stroboscope`.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, replace
from typing import Any, Protocol, runtime_checkable

import numpy as np
from numpy.typing import ArrayLike, NDArray

from snapbeam.model.integration import Integration
from snapbeam.model.state import FIELDS, ModalState, State
from snapbeam.model.system import System
from snapbeam.solver.assemble import make_ensemble
from snapbeam.sweeps.replicates import MEASURING_ERROR, Replicates, perturbed_start
from snapbeam.util.validation import InputError, InputTypeError, flag, integer, nonnegative, shown

_Array = NDArray[np.float64]
_NOT_RUN: dict[str, Any] = {"tangent": None, "statistics": None, "modal": None}
"""Fields of a state that belong to the run that led to it."""

# Many starts of one system, each from its own number alone: a beam that rings faintly, a drive at any phase.


@dataclass(frozen=True, kw_only=True)
class InitialConditions:
    """Random initial conditions near the start of the system, or with another phase of the drive.

    Parameters
    ----------
    count : int
        Number of initial conditions, at least 1.
    displacement : float
        Root mean square of the mid-span displacement, m, with equal mean energy in every linear mode; by default the
        reading error of the paper's camera. A start that would press the beam into the tip is mirrored about rest.
    phase : bool
        Sample the phase of a sinusoidal drive of a single striker, in the half cycle in which the tip moves away.
    seed : int
        Seed: number s comes from Philox with the key (seed, s).

    See Also
    --------
    snapbeam.dynamics.lifetime_map, snapbeam.dynamics.bifurcation_diagram

    Examples
    --------
    >>> import snapbeam as sb
    >>> sb.dynamics.InitialConditions(count=64, displacement=1e-4, seed=1).count
    64
    """

    count: int = 32
    displacement: float = MEASURING_ERROR
    phase: bool = False
    seed: int = 0

    def __post_init__(self) -> None:
        integer("count", self.count, 1, 100_000)
        nonnegative("displacement", self.displacement, "m")
        flag("phase", self.phase)
        integer("seed", self.seed, 0, 2**63 - 1)
        if self.count > 1 and self.displacement == 0.0 and not self.phase:
            raise InputError(
                f"count = {self.count} with displacement = 0 and phase = False: all would be the same; set one of them"
            )

    def describe(self) -> dict[str, Any]:
        """Description of the initial conditions, for comparison."""
        return asdict(self) | {"side": "away from the tip"}

    def state(
        self, system: System, number: int, state: State | None = None, location: ArrayLike | None = None
    ) -> State:
        """Start *number*, or that added to *state*, of a system, or of runs if *location*, x_s/L, has several."""
        found = state if state is not None else system.start_state
        if location is not None and np.ndim(location):
            shape = (*np.broadcast_shapes(np.shape(location), found.batch), system.model.modes)
            amplitude, velocity = (np.broadcast_to(each, shape) for each in (found.amplitude, found.velocity))
            found = replace(found, amplitude=amplitude, velocity=velocity, **_NOT_RUN)
        if self.displacement > 0.0:
            rung = perturbed_start(system, Replicates(1, self.displacement, seed=self.seed), number, found)
            found = leaving(system, found, rung, location)
        if not self.phase:
            return found
        if len(system.moving) != 1 or system.striker is None or not system.striker.drive.harmonic:
            raise InputError(
                "phase = True: the half of a cycle in which no tip presses the beam is known for a single striker with a "
                "sinusoidal motion; leave phase out"
            )
        generator = np.random.Generator(np.random.Philox(key=[self.seed, number]).jumped())
        phase = math.pi * (1.0 + generator.random())
        return replace(found, phase=np.array(phase), contact_time=np.array(np.nan), **_NOT_RUN)


def leaving(system: System, rest: State, begun: State, location: ArrayLike | None = None) -> State:
    """A state beside *rest*, turned about it if it moved the beam towards the first tip, at *location* x_s/L."""
    striker = system.striker
    if striker is None:
        return begun
    at = np.asarray(striker.location if location is None else location, dtype=np.float64)
    change: list[NDArray[np.float64]] = [begun.amplitude - rest.amplitude, begun.velocity - rest.velocity]
    away = 1.0 if striker.side == "below" else -1.0
    reach = np.sum(system.model.shape_at(at) * change[0], axis=-1)
    turn = np.where(away * reach < 0.0, -1.0, 1.0)[..., None]
    amplitude, velocity = rest.amplitude + turn * change[0], rest.velocity + turn * change[1]
    return replace(begun, amplitude=amplitude, velocity=velocity, contact_time=np.array(np.nan), **_NOT_RUN)


def starts_of(given: InitialConditions | int) -> InitialConditions:
    """Starts, or that many of them."""
    if isinstance(given, InitialConditions):
        return given
    if isinstance(given, (bool, np.bool_)) or not isinstance(given, (int, np.integer)):
        raise InputTypeError(f"initial_conditions = {shown(given)}: must be InitialConditions, or their number")
    return InitialConditions(count=int(given))


def held_in_space(system: System) -> System:
    """The system with the mid-position of its first tip fixed in space, where it is at its own start, for any start."""
    if system.striker is None:
        return system
    offset, without_gap = (
        float(make_ensemble(each, Integration()).runs["offset"][0, 0])
        for each in (system, system.replace(**{"contact.gap": 0.0, "initial_state": None}))
    )
    held = system.replace(**{"contact.gap": without_gap - offset})
    start = system.initial_state
    if start is None or np.isnan(start.striker_position).all():
        return held
    none = np.array(np.nan)
    return held.replace(initial_state=replace(start, striker_position=none, contact_time=none))


@dataclass(frozen=True, eq=False)
class AdvancedStates:
    """States after a number of periods."""

    states: _Array
    """States after the last period, shape (runs, d); NaN where a run failed."""
    every: _Array | None
    """States after each period, shape (runs, periods, d), if requested."""
    tangents: _Array | None
    """Small changes that were carried along, shape (runs, k, d)."""
    statistics: Mapping[str, NDArray[Any]] = field(default_factory=dict)
    """Statistics of the motion, by name, shape (runs,)."""
    hidden: Any = None
    """State of the solver for a bitwise exact restart."""
    hidden_every: tuple[Any, ...] | None = None
    """The same after each period, with *every*."""

    def beginnings(self, later: AdvancedStates) -> AdvancedStates:
        """States at the beginnings of the periods of *later*, a continuation of this result, ordered by period."""
        assert later.every is not None
        states = np.concatenate([self.states, *later.every.transpose(1, 0, 2)[:-1]])
        if later.hidden_every is None:
            return AdvancedStates(states, None, None, hidden=states)
        return AdvancedStates(states, None, None, hidden=_joined_states([self.hidden, *later.hidden_every[:-1]]))


def joined(parts: list[AdvancedStates]) -> AdvancedStates:
    """Parts of an ensemble that were integrated one after the other."""
    first = parts[0]

    def of(name: str) -> Any:
        arrays = [getattr(part, name) for part in parts]
        return None if arrays[0] is None else np.concatenate(arrays)

    statistics = {name: np.concatenate([part.statistics[name] for part in parts]) for name in first.statistics}
    every = first.hidden_every and tuple(
        _joined_states(list(each)) for each in zip(*(part.hidden_every or () for part in parts), strict=True)
    )
    hidden = _joined_states([part.hidden for part in parts])
    return AdvancedStates(of("states"), of("every"), of("tangents"), statistics, hidden, every)


def _joined_states(states: list[State]) -> State:
    arrays: dict[str, Any] = {name: np.concatenate([getattr(each, name) for each in states]) for name in FIELDS}
    modals = [each.modal for each in states]
    first = modals[0]
    assert first is not None
    parts: dict[str, Any] = {
        name: np.concatenate([getattr(each, name) for each in modals]) for name in ("q", "p", "well_sign", "offset")
    }
    status = np.concatenate([np.asarray((each.statistics or {})["status"]) for each in states])
    return State(**arrays, statistics={"status": status}, modal=ModalState(**parts, structure=first.structure))


@runtime_checkable
class Flow(Protocol):
    """A map of states of *dimension* numbers, applied once a period."""

    @property
    def dimension(self) -> int:
        """Numbers of a state, d."""
        ...

    @property
    def period(self) -> float:
        """Time that the map takes, s, or 1 for a map without time."""
        ...

    def advance(
        self,
        states: ArrayLike | AdvancedStates,
        periods: int = 1,
        *,
        tangents: _Array | None = None,
        every: bool = False,
        points: Mapping[str, _Array] | None = None,
    ) -> AdvancedStates:
        """Take states (runs, d) and *tangents* (runs, k, d) some periods on; *points*: parameters of the runs."""
        ...

    def changed(self, values: Mapping[str, float]) -> Flow:
        """The flow with parameters changed, by name."""
        ...

    def value(self, name: str) -> float:
        """A parameter."""
        ...


def minimal_period(rows: _Array, tolerance: float = 1e-4) -> NDArray[np.int64]:
    """Number of periods after which states of shape (..., periods, d) repeat, at most half of them, else 0."""
    keep = rows.shape[-2]
    found = np.zeros(rows.shape[:-2], dtype=np.int64)
    for m in range(keep // 2, 0, -1):
        apart = np.abs(rows[..., m:, :] - rows[..., :-m, :]).max(axis=(-1, -2))
        found = np.where(apart < tolerance, m, found)
    return found
