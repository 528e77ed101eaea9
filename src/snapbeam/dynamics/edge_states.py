"""Edge states: the state on the border between snapping and not, tracked by bisection of full states."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from snapbeam.dynamics.flow import Flow, minimal_period
from snapbeam.dynamics.periodic_orbits import PeriodicOrbit, shoot, state_of
from snapbeam.dynamics.results import multiplier_rows, of_flow, reported
from snapbeam.dynamics.shooting import OrbitNotFoundError, require_isolated_orbits
from snapbeam.dynamics.stroboscope import Stroboscope, flow_of
from snapbeam.model.integration import Integration
from snapbeam.model.state import State
from snapbeam.model.system import System
from snapbeam.util.display import plotter
from snapbeam.util.validation import InputError, checked, integer, positive

if TYPE_CHECKING:
    import xarray as xr

_Array = NDArray[np.float64]
_PIECES = 16
"""States between the two that are tried at once."""
_ROUNDS = 300
"""Maximum number of rounds of one bisection; 16 to this power is more than the range of floating-point numbers."""
_REPEATS = 1e-3
"""Maximum change of a coordinate between periods that count as a repetition."""
_FARTHEST = 0.1
"""Maximum of diverge_threshold, over the distance of the first two states."""


@dataclass(frozen=True, eq=False)
class EdgeState:
    """A motion on the border between two outcomes.

    See Also
    --------
    snapbeam.dynamics.edge_tracking

    Examples
    --------
    >>> import snapbeam as sb
    >>> system = sb.paper.struck_beam(frequency_ratio=1.6, velocity_amplitude=0.03, damping_ratio=0.05)
    >>> edge = sb.dynamics.edge_tracking(system, [-0.9, 0.0], [-1.0, 1.3], periods=25)
    >>> edge.orbit.period, edge.orbit.is_stable
    (1, False)
    """

    flow: Flow
    states: _Array
    """States once a period, shape (periods, d)."""
    distance: _Array
    """Distance between the two states that enclose it, once a period, shape (periods,)."""
    orbit: PeriodicOrbit | None
    """The unstable orbit that it comes to, if it comes to one."""
    termination_reason: str
    """Reason why the tracking stopped, result of the bisection, and reason why there is no orbit."""

    def plot(self, ax: Any = None, **options: Any) -> Any:
        """Draw the motion once a period, and the unstable orbit that it settles on; returns the axes."""
        return plotter("plot_dataset")(self.to_dataset(), None, ax, **options)

    def to_dataset(self) -> xr.Dataset:
        """The motion, labelled."""
        settled = np.empty((0, self.flow.dimension)) if self.orbit is None else self.orbit.points
        values = np.empty(0, dtype=complex) if self.orbit is None else self.orbit.multipliers
        words = "unstable orbit that it settles on, once a period"
        variables = {
            "state": (("period", "coordinate"), self.states, "state on the border once a period"),
            "distance": ("period", self.distance, "distance of the two that hold it"),
            "orbit_state": (("orbit_period", "coordinate"), settled, words),
        }
        period = 0 if self.orbit is None else self.orbit.period
        attrs = {"title": "edge state", "period": period, "termination_reason": self.termination_reason}
        return of_flow(self.flow, variables | multiplier_rows(values), attrs)

    def __repr__(self) -> str:
        end = "on no orbit" if self.orbit is None else f"on {self.orbit!r}".replace("<", "").replace(">", "")
        return f"<EdgeState over {len(self.states)} periods, {end}, end: {self.termination_reason}>"


@checked
def edge_tracking(
    system: System | Flow,
    u1: State | ArrayLike,
    u2: State | ArrayLike,
    *,
    periods: int = 60,
    horizon: int = 40,
    bisect_threshold: float = 1e-9,
    diverge_threshold: float = 1e-5,
    outcome: Callable[[Flow, _Array, int], NDArray[np.bool_]] | None = None,
    integration: Integration | None = None,
    progress: Callable[[int, int], object] | bool | None = None,
) -> EdgeState:
    """Follow the border between snapping and not (Skufca, Yorke and Eckhardt, Phys. Rev. Lett. 96 (2006) 174101).

    Bisection between *u1* and *u2* finds two states of different outcome, *bisect_threshold* apart. Both are integrated
    until they are *diverge_threshold* apart; then the bisection repeats.

    Parameters
    ----------
    system : System, or a Flow
        System, or any other flow.
    u1, u2 : State or array_like of shape (d,)
        State from which the beam does not leave its well within *horizon* periods, and one from which it does.
    periods : int
        Periods to follow the border.
    horizon : int
        Periods until the outcome is evaluated.
    bisect_threshold, diverge_threshold : float
        Distances over the well's amplitude, the second at most a tenth of that of *u1* and *u2*; or rounding stops it.
    outcome : callable, optional
        ``outcome(flow, states, horizon) -> bool array``, in place of snapping.
    integration, progress : optional
        Solver settings, and report of periods as in :func:`snapbeam.sweep`.

    Returns
    -------
    EdgeState
        Edge state, with the unstable periodic orbit on which the motion settles, if any, and ``termination_reason``.

    See Also
    --------
    snapbeam.dynamics.EdgeState, snapbeam.dynamics.basins_of_attraction

    Examples
    --------
    >>> import snapbeam as sb
    >>> system = sb.paper.struck_beam(frequency_ratio=1.6, velocity_amplitude=0.03, damping_ratio=0.05)
    >>> edge = sb.dynamics.edge_tracking(system, [-0.9, 0.0], [-1.0, 1.3], periods=25)
    >>> edge.termination_reason
    '25 periods; it settled on an orbit of period 1'
    """
    flow = flow_of(system, integration, "reference")
    total, ahead = integer("periods", periods, 2, 10**6), integer("horizon", horizon, 1, 10**6)
    near, far = (positive("bisect_threshold", bisect_threshold), positive("diverge_threshold", diverge_threshold))
    if not near < far:
        raise InputError(f"bisect_threshold = {near:g}: must be less than diverge_threshold = {far:g}")

    def snaps(states: _Array) -> NDArray[np.bool_]:
        return np.asarray((_snaps if outcome is None else outcome)(flow, states, ahead), dtype=bool)

    low, high = state_of(flow, "u1", u1), state_of(flow, "u2", u2)
    told = snaps(np.stack([low, high]))
    if told[0] or not told[1]:
        raise InputError(
            f"u1, u2: the outcomes within {ahead} periods are {bool(told[0])} and {bool(told[1])}; must be "
            "False and True"
        )
    apart = float(np.abs(high - low).max())
    if not far <= _FARTHEST * apart:
        raise InputError(
            f"diverge_threshold = {far:g}: must be at most {_FARTHEST:g} times the distance of u1 and u2, {apart:.3g}"
        )
    states: list[_Array] = []
    distances, closest = [], 0.0
    stopped = f"{total} periods"
    begin = True
    report = reported(progress, "edge tracking", "periods")
    for period in range(total):
        if begin:
            bracket = _bisect(low, high, near, snaps)
            if bracket is None:
                stopped = (
                    f"after {period} periods the two states have the same outcome within {ahead} periods; "
                    "increase horizon"
                )
                break
            low, high = bracket
            closest = max(closest, float(np.abs(high - low).max()))
        low, high = flow.advance(np.stack([low, high]), 1).states
        size = float(np.abs(high - low).max())
        if not np.isfinite(size):
            if not states:
                raise InputError("a run failed on the border; look at its status with sb.advance")
            stopped = f"a run failed on the border after {period} periods; look at its status with sb.advance"
            break
        states.append(0.5 * (low + high))
        distances.append(size)
        if size == 0.0:
            stopped = f"after {period + 1} periods the two states are equal to rounding; increase bisect_threshold"
            break
        begin = size > far
        report(period + 1, total)
    if len(states) < total:
        report(len(states), len(states))
    if closest > near:
        stopped += (
            f"; rounding stopped the bisection at a distance of {closest:.2g}, "
            f"bisect_threshold = {near:g} was not reached"
        )
    path = np.array(states).reshape(-1, flow.dimension)
    orbit, words = _settled(flow, path)
    return EdgeState(flow, path, np.array(distances), orbit, f"{stopped}; {words}")


def kicked(flow: Stroboscope, size: float | None, horizon: int) -> tuple[_Array, _Array]:
    """The start of a system, and the same with a velocity of the first mode, *size* or doubled until the beam snaps."""
    quiet = flow.coordinates()[0]
    towards = -np.sign(quiet[0]) or 1.0
    sizes = [0.1 * 2.0**k for k in range(8)] if size is None else [positive("kick", size)]
    rows = np.repeat(quiet[None], len(sizes) + 1, axis=0)
    rows[1:, flow.space.modes] += towards * np.array(sizes)
    told = _snaps(flow, rows, integer("horizon", horizon, 1, 10**6))
    if told[0]:
        raise InputError(f"the start: it snaps within {horizon} periods by itself; take a weaker drive")
    if not told.any():
        raise InputError(
            f"kick (--initial-velocity) = {sizes[-1]:g}: does not snap within {horizon} periods; take a harder one"
        )
    return quiet, rows[int(np.argmax(told))]


def _snaps(flow: Flow, states: _Array, horizon: int) -> NDArray[np.bool_]:
    advanced = flow.advance(states, horizon)
    if "zero_crossings" not in advanced.statistics:
        raise InputError("outcome: is needed for a flow that is not a System")
    if not np.isfinite(advanced.states).all():
        raise InputError("a run failed, so its outcome is unknown; look at its status with sb.advance")
    crossed = np.asarray(advanced.statistics["zero_crossings"] > 0)
    if isinstance(flow, Stroboscope):
        # on the border's way some have crossed before they are looked at again
        shape, first = flow.system.model.midspan_shape, flow.coordinates()[0]
        side = states[:, : flow.space.modes] @ shape * float(first[: flow.space.modes] @ shape)
        crossed |= side < 0.0
    return crossed


def _bisect(
    low: _Array, high: _Array, near: float, snaps: Callable[[_Array], NDArray[np.bool_]]
) -> tuple[_Array, _Array] | None:
    """Two states on a line, *near* or up to rounding, of which the second snaps; None if the ends have one outcome."""
    parts = np.linspace(0.0, 1.0, _PIECES + 1)
    for _ in range(_ROUNDS):
        size = float(np.abs(high - low).max())
        rows = low + parts[:, None] * (high - low)
        rows[-1] = high
        told = snaps(rows)
        if told[0] or not told[-1]:
            return None
        at = int(np.argmax(told))
        low, high = rows[at - 1], rows[at]
        left = float(np.abs(high - low).max())
        if left <= near or not left < size:
            break
    return low, high


def _settled(flow: Flow, path: _Array) -> tuple[PeriodicOrbit | None, str]:
    """The unstable orbit of the last stretch that repeats (motions may leave it and come back), and what was found."""
    long = int(np.clip(len(path) // 3, 4, 40))
    if len(path) < 4:
        return None, "too few periods to look for an orbit"
    ends = range(len(path), long - 1, -(long // 2))
    periods = minimal_period(np.stack([path[end - long : end] for end in ends]), _REPEATS)
    if not periods.any():
        return None, f"no orbit: no {long} periods repeat to {_REPEATS:g} after {long // 2} or fewer; increase periods"
    at = int(np.argmax(periods > 0))
    period, end = int(periods[at]), ends[at]
    try:
        require_isolated_orbits(flow)
        orbit = shoot(flow, path[end - 1], period, 1e-10)
    except (InputError, OrbitNotFoundError) as error:
        return None, f"no orbit of period {period}: {error}"
    left = f", and left it after {end} periods or later" if at else ""
    return orbit, f"it settled on an orbit of period {period}{left}"
