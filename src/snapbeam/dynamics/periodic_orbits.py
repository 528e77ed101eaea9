"""Periodic orbits: found by shooting, stable or not, with their Floquet multipliers."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from snapbeam.dynamics.approaches import Passage, between_contacts, carried, passage_of
from snapbeam.dynamics.flow import Flow
from snapbeam.dynamics.results import multiplier_rows, of_flow
from snapbeam.dynamics.shooting import (
    Family,
    OrbitNotFoundError,
    jacobian,
    newton,
    orbit_tolerance,
    require_isolated_orbits,
)
from snapbeam.dynamics.stroboscope import Stroboscope, flow_of
from snapbeam.model.integration import Integration
from snapbeam.model.state import State
from snapbeam.model.system import System
from snapbeam.simulation.simulate import simulate
from snapbeam.util.display import plotter
from snapbeam.util.validation import InputError, InputTypeError, checked, choice, finite_array, integer, shown

if TYPE_CHECKING:
    import xarray as xr

_Array = NDArray[np.float64]
_Complex = NDArray[np.complex128]
_SAME = 1e-7
"""Distance, over the well's amplitude, below which an orbit closes after fewer periods already."""


@dataclass(frozen=True, eq=False)
class PeriodicOrbit:
    """A state that comes back after some periods of the drive.

    See Also
    --------
    snapbeam.dynamics.periodic_orbit, snapbeam.dynamics.continuation

    Examples
    --------
    >>> import snapbeam as sb
    >>> system = sb.paper.struck_beam(frequency_ratio=1.6, velocity_amplitude=0.03, damping_ratio=0.05)
    >>> orbit = sb.dynamics.periodic_orbit(system, transient=100)
    >>> orbit.is_stable, bool(abs(orbit.multipliers).max() < 1.0)
    (True, True)
    """

    flow: Flow
    coordinates: _Array
    """The state in the coordinates of the flow, shape (d,)."""
    period: int
    """Periods of the drive, m."""
    jacobian: _Array
    """Derivative of the return map, in those coordinates, shape (d, d)."""
    residual: float
    """Maximum coordinate of the state that came back less the one that set out."""
    iterations: int

    @cached_property
    def multipliers(self) -> _Complex:
        """Floquet multipliers, largest first, shape (d,)."""
        values = np.linalg.eigvals(self.jacobian).astype(np.complex128)
        order = np.lexsort((-values.imag, -np.round(np.abs(values), 12)))
        return values[order]

    @property
    def is_stable(self) -> bool:
        """True if every multiplier is inside the unit circle."""
        return bool(np.abs(self.multipliers[0]) < 1.0)

    @property
    def unstable(self) -> int:
        """Multipliers outside the unit circle."""
        return int((np.abs(self.multipliers) > 1.0).sum())

    @cached_property
    def log_determinant(self) -> float:
        """Logarithm of the product of the multipliers' sizes."""
        return float(np.linalg.slogdet(self.jacobian)[1])

    @cached_property
    def points(self) -> _Array:
        """The orbit once a period of the drive, shape (m, d)."""
        advanced = self.flow.advance(self.coordinates[None], self.period, every=True)
        assert advanced.every is not None
        return np.concatenate([self.coordinates[None], advanced.every[0, :-1]])

    @cached_property
    def minimal_period(self) -> int:
        """The fewest periods of the drive after which it closes already."""
        divisors = (divisor for divisor in range(1, self.period) if self.period % divisor == 0)
        return next((m for m in divisors if np.abs(self.points[m] - self.points[0]).max() < _SAME), self.period)

    @property
    def _centres(self) -> _Array:
        """Displacement of the centre over b, once a period of the drive."""
        system, space = self._stroboscope.system, self._stroboscope.space
        amplitudes = self.points[:, : space.modes] * space.scales[: space.modes]
        return np.asarray(amplitudes @ system.model.midspan_shape / system.scale.length)

    @property
    def state(self) -> State:
        """The state that comes back, for :func:`snapbeam.advance` and as a system's start."""
        return self._stroboscope.state(self.coordinates)

    @property
    def system(self) -> System:
        """The system, starting on the orbit."""
        return self._stroboscope.starting(self.coordinates)

    @cached_property
    def contact_summary(self) -> Passage:
        """Contacts of the orbit: impacts, closest approach to the tip, maximum displacement."""
        return passage_of(self._stroboscope, self.coordinates, self.period)

    @property
    def _stroboscope(self) -> Stroboscope:
        if not isinstance(self.flow, Stroboscope):
            raise InputTypeError("orbit: its flow is not a System")
        return self.flow

    def plot(self, kind: str = "phase_portrait", ax: Any = None, **options: Any) -> Any:
        """Draw the orbit over its whole period (``"phase_portrait"``), or its ``"multipliers"``; returns the axes."""
        if choice("kind", kind, ("phase_portrait", "multipliers")) == "multipliers":
            return plotter("plot_multipliers")(self.to_dataset(), ax=ax, **options)
        flow = self._stroboscope
        run = simulate(self.system, flow.during(self.period))
        return plotter("plot_phase_portrait")(run, ax=ax, **options)

    def to_dataset(self) -> xr.Dataset:
        """The orbit once a period, and its multipliers, labelled."""
        points = {"state": (("period", "coordinate"), self.points, "state once a period")}
        attrs = {"period": self.period, "residual": self.residual, "stable": int(self.is_stable)}
        return of_flow(self.flow, points | multiplier_rows(self.multipliers), attrs)

    def __repr__(self) -> str:
        kind = "stable" if self.is_stable else f"unstable ({self.unstable})"
        size = abs(self.multipliers[0])
        return f"<PeriodicOrbit of period {self.period}: {kind}, largest multiplier {size:.6g}>"


def orbit_at(orbit: PeriodicOrbit, flow: Flow) -> PeriodicOrbit:
    """An orbit at the phase at which another flow takes states; its derivative stays that at its own phase."""
    if not isinstance(flow, Stroboscope) or not isinstance(orbit.flow, Stroboscope):
        return orbit
    phase = flow.clock.striker_phase
    if phase == orbit.flow.clock.striker_phase:
        return orbit
    moved = replace(orbit.flow, phase=phase)
    return replace(orbit, flow=moved, coordinates=carried(orbit.flow, orbit.coordinates, phase))


@checked
def periodic_orbit(
    system: System | Flow,
    guess: State | ArrayLike | PeriodicOrbit | None = None,
    period: int = 1,
    integration: Integration | None = None,
    *,
    phase: float | None = None,
    transient: int = 0,
    tolerance: float = 1e-10,
    iterations: int = 40,
    deflate: Sequence[PeriodicOrbit] = (),
) -> PeriodicOrbit:
    """Find the periodic orbit near a state, stable or not, by Newton shooting with exact tangents.

    Solves P^m(x) = x for the map P over one period of the drive. The tip's mid-position is fixed in space.

    Parameters
    ----------
    system : System, or a Flow
        System, or any other flow.
    guess : State, array_like of shape (d,) or PeriodicOrbit, optional
        State near the orbit; the system's start by default.
    period : int
        Periods of the drive after which the orbit closes, m.
    integration : Integration, optional
        Solver settings; ``accuracy="reference"`` by default, since an orbit is only as accurate as the steps.
    phase : float, optional
        Phase of the drive at which the orbit is seen, rad: by default that at which a run begins or, under a law that
        is not smooth with a contact near it, the phase farthest from all contacts.
    transient : int
        Periods to integrate from the guess first.
    tolerance : float
        Maximum residual of a coordinate, in units of the well's amplitude and of omega_1 times it; at most 1e-3.
    iterations : int
        Maximum number of Newton iterations.
    deflate : sequence of PeriodicOrbit
        Known orbits that are not to be found again.

    Returns
    -------
    PeriodicOrbit

    Raises
    ------
    InputError
        If the system has no excitation, or a number is out of range.
    OrbitNotFoundError
        If no orbit is found; the message states the cause and a remedy.

    See Also
    --------
    snapbeam.dynamics.continuation, snapbeam.dynamics.find_attractors

    Examples
    --------
    >>> import snapbeam as sb
    >>> system = sb.paper.struck_beam(frequency_ratio=1.6, velocity_amplitude=0.03, damping_ratio=0.05)
    >>> orbit = sb.dynamics.periodic_orbit(system, transient=100)
    >>> orbit.period, orbit.residual < 1e-10
    (1, True)
    """
    flow = flow_of(system, integration, "reference")
    require_isolated_orbits(flow)
    if isinstance(flow, Stroboscope):
        if flow.system.primary_excitation is None:
            raise InputError("contacts = []: a beam without excitation has no orbit except its equilibrium")
        if phase is not None:
            flow = replace(flow, phase=phase)
    elif phase is not None:
        raise InputError(f"phase = {shown(phase)}: is for a System")
    periods = integer("period", period, 1, 10_000)
    allowed = orbit_tolerance(tolerance)
    x = orbit_at(guess, flow).coordinates if isinstance(guess, PeriodicOrbit) else state_of(flow, "guess", guess)
    before = integer("transient", transient, 0, 10**7)
    if before:
        x = flow.advance(x[None], before).states[0]
        if not np.isfinite(x).all():
            raise OrbitNotFoundError("the run from the guess failed; see its status with sb.advance")
    if not all(isinstance(orbit, PeriodicOrbit) for orbit in deflate):
        raise InputTypeError(f"deflate = {shown(deflate)}: must be orbits, as periodic_orbit gives")
    most = integer("iterations", iterations, 1, 10_000)

    def shot(flow: Flow, x: _Array) -> PeriodicOrbit:
        left_out = tuple(point for orbit in deflate for point in orbit_at(orbit, flow).points)
        return shoot(flow, x, periods, allowed, most, deflate=left_out)

    try:
        orbit = shot(flow, x)
        x = orbit.coordinates
    except OrbitNotFoundError as error:
        if phase is not None or between_contacts(flow, x, periods) is None:
            if not isinstance(flow, Stroboscope) or flow.integration.accuracy == "reference":
                raise
            raise OrbitNotFoundError(f"{error}, or use accuracy = 'reference'") from None
    moved = between_contacts(flow, x, periods) if phase is None else None
    if moved is not None:
        assert isinstance(flow, Stroboscope) and moved.phase is not None
        orbit = shot(moved, carried(flow, x, moved.phase))
    return orbit


def state_of(flow: Flow, name: str, given: State | ArrayLike | None) -> _Array:
    """One state in the coordinates of a flow, shape (d,); the start of a system by default."""
    if given is None or isinstance(given, State):
        if not isinstance(flow, Stroboscope):
            raise InputTypeError(f"{name} = {shown(given)}: must be an array of {flow.dimension} numbers")
        if isinstance(given, State) and given.batch:
            raise InputError(f"{name}: a batch of shape {given.batch}: must be one state")
        return flow.coordinates(given)[0]
    row = finite_array(name, given)
    if row.shape != (flow.dimension,):
        raise InputError(f"{name} of shape {row.shape}: must be {flow.dimension} numbers")
    return row


def shoot(
    flow: Flow, x: _Array, period: int, tolerance: float, iterations: int = 40, deflate: tuple[_Array, ...] = ()
) -> PeriodicOrbit:
    """Newton's method for P^m(x) = x."""
    one, family = np.eye(x.size), Family(flow)

    def residual(at: _Array) -> _Array:
        return family.advance(at[None], period).states[0] - at

    def derivative(at: _Array) -> tuple[_Array, _Array]:
        came = jacobian(family, at, period)
        return came.x - at, came.jacobian - one

    shot = newton(residual, derivative, x, tolerance, iterations, deflate=deflate)
    came = jacobian(family, shot.x, period)
    return PeriodicOrbit(flow, shot.x, period, came.jacobian, float(np.abs(came.x - shot.x).max()), shot.iterations)
