"""Periodic orbits: found by shooting, stable or not, with their Floquet multipliers."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from snapbeam.core.findings import Diagnostic, tell, to_json
from snapbeam.core.kinds import checked
from snapbeam.core.validate import InputError, InputTypeError, finite_array, integer, positive, shown
from snapbeam.dynamics.flow import Flow, Stroboscope, flow_of
from snapbeam.dynamics.orbits.passage import Passage, passage_of
from snapbeam.dynamics.orbits.shooting import Family, OrbitNotFoundError, jacobian, newton
from snapbeam.model.integration import Integration
from snapbeam.model.state import State
from snapbeam.model.system import System

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["OrbitNotFoundError", "PeriodicOrbit", "periodic_orbit", "shoot"]

_Array = NDArray[np.float64]
_Complex = NDArray[np.complex128]
_SAME = 1e-7
"""Distance, over the well's amplitude, below which an orbit closes after fewer periods already."""


@dataclass(frozen=True, eq=False)
class PeriodicOrbit:
    """A state that comes back after some periods of the drive."""

    flow: Flow
    coordinates: _Array
    """The state in the coordinates of the flow, shape (d,)."""
    period: int
    """Periods of the drive, m."""
    jacobian: _Array
    """Derivative of the return map, in those coordinates, shape (d, d)."""
    residual: float
    """Greatest coordinate of the state that came back less the one that set out."""
    iterations: int

    @cached_property
    def multipliers(self) -> _Complex:
        """Floquet multipliers, largest first, shape (d,)."""
        values = np.linalg.eigvals(self.jacobian).astype(np.complex128)
        order = np.lexsort((-values.imag, -np.round(np.abs(values), 12)))
        return values[order]

    @property
    def is_stable(self) -> bool:
        """Whether every multiplier is inside the unit circle."""
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
        marched = self.flow.march(self.coordinates[None], self.period, every=True)
        assert marched.every is not None
        return np.concatenate([self.coordinates[None], marched.every[0, :-1]])

    @cached_property
    def minimal_period(self) -> int:
        """The fewest periods of the drive after which it closes already."""
        for divisor in range(1, self.period):
            if self.period % divisor == 0:
                apart = np.abs(self.points[divisor] - self.points[0]).max()
                if apart < _SAME:
                    return divisor
        return self.period

    @property
    def state(self) -> State:
        """The state that comes back, for :func:`snapbeam.advance` and as a system's start."""
        return self._stroboscope.state(self.coordinates)

    @property
    def system(self) -> System:
        """The system, starting on the orbit."""
        return self._stroboscope.starting(self.state)

    @cached_property
    def contact_summary(self) -> Passage:
        """What it does on its way: impacts, how near it passes the tip, how far it goes."""
        return passage_of(self._stroboscope, self.coordinates, self.period)

    @property
    def diagnostics(self) -> tuple[Diagnostic, ...]:
        """What is doubtful about the multipliers."""
        return getattr(self.flow, "diagnostics", ())

    @property
    def _stroboscope(self) -> Stroboscope:
        if not isinstance(self.flow, Stroboscope):
            raise InputTypeError("orbit: is of a flow that is no System")
        return self.flow

    def to_dataset(self) -> xr.Dataset:
        """The orbit once a period, and its multipliers, labelled."""
        import xarray as xr

        names = getattr(self.flow, "names", tuple(f"x[{i + 1}]" for i in range(self.coordinates.size)))
        values = self.multipliers
        return xr.Dataset(
            {
                "state": (
                    ("period", "coordinate"),
                    self.points,
                    {"units": "1", "long_name": "state once a period"},
                ),
                "multiplier_real": (
                    "multiplier",
                    values.real,
                    {"units": "1", "long_name": "Floquet multiplier"},
                ),
                "multiplier_imag": (
                    "multiplier",
                    values.imag,
                    {"units": "1", "long_name": "its imaginary part"},
                ),
            },
            {"coordinate": list(names)},
            {
                "period": self.period,
                "residual": self.residual,
                "stable": int(self.is_stable),
                "diagnostics": to_json(self.diagnostics),
            },
        )

    def __repr__(self) -> str:
        kind = "stable" if self.is_stable else f"unstable ({self.unstable})"
        size = abs(self.multipliers[0])
        return f"<Orbit of period {self.period}: {kind}, largest multiplier {size:.6g}>"


@checked
def periodic_orbit(
    system: System | Flow,
    guess: State | ArrayLike | PeriodicOrbit | None = None,
    period: int = 1,
    integration: Integration | None = None,
    *,
    phase: float | None = None,
    transient: int = 0,
    tolerance: float = 1e-11,
    iterations: int = 40,
    deflate: Sequence[PeriodicOrbit] = (),
) -> PeriodicOrbit:
    """The periodic orbit near a state, stable or not, by Newton shooting with the tangent flow.

    The tip's mid-position is fixed in space, where it is at the system's start.  Solves P^m(x) = x for the map P over
    one period of the drive.

    Parameters
    ----------
    system : System, or a Flow
    guess : State, array_like of shape (d,) or Orbit, optional
        A state near the orbit, at the phase; the system's start by default.
    period : int
        Periods of the drive after which it closes, m.
    integration : Integration, optional
        ``accuracy="reference"`` by default: a derivative is no better than the steps it is taken of.  At level
        ``"standard"`` it is off by up to 2 %, which is warned of.
    phase : float, optional
        Of the drive at which the orbit is seen, rad; where no contact begins, ends or lasts no time.
    transient : int
        Periods to march from the guess first, which brings it to what attracts it.
    tolerance : float
        Greatest coordinate that may remain, in units of the well's amplitude and of omega_1 times it.
    iterations : int
    deflate : sequence of Orbit
        Orbits that are known and are not to be found again.

    Returns
    -------
    Orbit

    Raises
    ------
    InputError
        For bad input.
    OrbitNotFoundError
        If none is found: the message says why, and what to try.
    """
    flow = flow_of(system, integration, "reference")
    if isinstance(flow, Stroboscope):
        if flow.system.primary_excitation is None:
            raise InputError("striker = None: a beam that nothing moves has no orbit but rest")
        if phase is not None:
            flow = Stroboscope(flow.system, flow.integration, phase)
    elif phase is not None:
        raise InputError(f"phase = {shown(phase)}: is for a System")
    periods = integer("period", period, 1, 10_000)
    allowed = positive("tolerance", tolerance)
    x = _guess_of(flow, guess)
    before = integer("transient", transient, 0, 10**7)
    if before:
        x = flow.march(x[None], before).states[0]
        if not np.isfinite(x).all():
            raise OrbitNotFoundError("the run from the guess failed; see its status with sb.advance")
    tell(getattr(flow, "diagnostics", ()))
    if not all(isinstance(orbit, PeriodicOrbit) for orbit in deflate):
        raise InputTypeError(f"deflate = {shown(deflate)}: must be orbits, as periodic_orbit gives")
    known = tuple(point for orbit in deflate for point in orbit.points)
    return shoot(flow, x, periods, allowed, integer("iterations", iterations, 1, 10_000), deflate=known)


def _guess_of(flow: Flow, guess: State | ArrayLike | PeriodicOrbit | None) -> _Array:
    if isinstance(guess, PeriodicOrbit):
        return np.array(guess.coordinates)
    if guess is None or isinstance(guess, State):
        if not isinstance(flow, Stroboscope):
            raise InputTypeError(f"guess = {shown(guess)}: must be an array of {flow.dimension} numbers")
        if isinstance(guess, State) and guess.batch:
            raise InputError(f"guess: a batch of shape {guess.batch}: must be one state")
        return flow.coordinates(guess)[0]
    array = finite_array("guess", guess, 1)
    if array.size != flow.dimension:
        raise InputError(f"guess of {array.size} numbers: must have {flow.dimension}")
    return array


def shoot(
    flow: Flow,
    x: _Array,
    period: int,
    tolerance: float,
    iterations: int,
    first: _Array | None = None,
    deflate: tuple[_Array, ...] = (),
) -> PeriodicOrbit:
    """Newton's method for P^m(x) = x; *first* is a derivative of P^m to begin with."""
    one, family = np.eye(x.size), Family(flow)

    def residual(at: _Array) -> _Array:
        return family.march(at[None], period).states[0] - at

    def derivative(at: _Array) -> tuple[_Array, _Array]:
        came = jacobian(family, at, period)
        return came.x - at, came.jacobian - one

    shot = newton(
        residual, derivative, x, tolerance, iterations, None if first is None else first - one, deflate
    )
    came = jacobian(family, shot.x, period)
    return PeriodicOrbit(
        flow, shot.x, period, came.jacobian, float(np.abs(came.x - shot.x).max()), shot.iterations
    )
