"""Periodic orbits: found by shooting, stable or not, with their Floquet multipliers."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from snapbeam.dynamics.flow import AdvancedStates, Flow, Stroboscope, fixed_parameters, flow_of
from snapbeam.model.integration import Integration
from snapbeam.model.state import State
from snapbeam.model.system import System
from snapbeam.simulation.run import Run
from snapbeam.simulation.simulate import simulate
from snapbeam.util.cores import usable_cores
from snapbeam.util.differences import differences
from snapbeam.util.display import plotter
from snapbeam.util.singular_values import svd
from snapbeam.util.validation import (
    InputError,
    InputTypeError,
    checked,
    choice,
    finite_array,
    integer,
    shown,
    within,
)

if TYPE_CHECKING:
    import xarray as xr

_LARGEST_ERROR = 1e-3
"""Error of a derivative by differences beyond which it counts as unknown."""
_SPLIT = 16
"""Tangents from which on they are shared among threads."""
_LONGEST = 0.25
"""Longest step of Newton's method, in units of the well's amplitude."""
_ROUNDING = 1e-10
"""Residual below which Newton's method can only have stopped by rounding."""
LARGEST_TOLERANCE = 1e-3
"""Maximum tolerance of an orbit: with a larger one the guess itself would count as an orbit."""
_SLOW = 0.25
"""Factor by which a step must lessen the residual, or else the derivative is computed again."""
_SAMPLES = 400
"""A period."""
_Array = NDArray[np.float64]
_Complex = NDArray[np.complex128]
_SAME = 1e-7
"""Distance, over the well's amplitude, below which an orbit closes after fewer periods already."""
_ITERATIONS = 14
_DIFFERENCE = 2e-6
"""Step of the difference by the parameter, over its range."""


# Newton shooting: states that a flow brings back, and the derivative of the flow there.


class OrbitNotFoundError(RuntimeError):
    """Error if no orbit was found; the message states the cause and a remedy.

    Examples
    --------
    >>> import snapbeam as sb
    >>> from snapbeam import paper
    >>> model = sb.ReducedModel.from_beam(paper.BEAM, modes=1, damping_ratio=0.05)
    >>> shaker = sb.Shaker(frequency_ratio=1.6, velocity_amplitude=0.03)
    >>> system = sb.System(model, contacts=[sb.Contact(paper.CONTACT, shaker)])
    >>> try:
    ...     sb.dynamics.periodic_orbit(system, [5.0, 3.0], iterations=2)
    ... except sb.dynamics.OrbitNotFoundError as error:
    ...     print(type(error).__name__)
    OrbitNotFoundError
    """


class Shot(NamedTuple):
    """Result of Newton's method."""

    x: _Array
    jacobian: _Array
    """Jacobian of the return map at *x*, or near it."""
    residual: float
    iterations: int
    exact: bool
    """True if the derivative was evaluated at *x* itself."""


class Family:
    """A flow over one parameter, at any value of it.

    Parameters
    ----------
    flow : Flow
    name : str, optional
        Parameter that may be changed; without one the flow stays as it is.
    """

    def __init__(self, flow: Flow, name: str | None = None) -> None:
        self.flow = flow
        self.name = name
        self._beside = name is not None and (
            not isinstance(flow, Stroboscope) or flow.system.parameter(name).is_run
        )

    def advance(
        self, x: _Array, periods: int, value: float | None = None, tangents: _Array | None = None
    ) -> AdvancedStates:
        """Take states of shape (runs, d) some periods on, at one value of the parameter."""
        if value is None or self.name is None:
            return self.flow.advance(x, periods, tangents=tangents)
        if self._beside:
            points = {self.name: np.full(len(x), value)}
            return self.flow.advance(x, periods, tangents=tangents, points=points)
        return self.at(value).advance(x, periods, tangents=tangents)

    def at(self, value: float) -> Flow:
        """The flow at a value of the parameter."""
        assert self.name is not None
        return self.flow.neighbour(self.name, value)

    def slope(self, x: _Array, periods: int, value: float, step: float) -> _Array:
        """Derivative by the parameter of where the flow brings one state, shape (d,)."""
        if self._beside and isinstance(self.flow, Stroboscope):
            assert self.name is not None
            return self.flow.slope(x, periods, self.name, value, step)
        above, below = (self.advance(x[None], periods, value + sign * step).states[0] for sign in (1.0, -1.0))
        change: _Array = (above - below) / (2.0 * step)
        return change


class Return(NamedTuple):
    """Image of a state under the return map, with the derivative by the state."""

    x: _Array
    jacobian: _Array
    """Shape (d, d)."""
    impacts: int
    """Impacts on the way; -1 if unknown."""


def jacobian(family: Family, x: _Array, periods: int, value: float | None = None) -> Return:
    """One state some periods on, with the derivative of where it comes to."""
    size = x.size
    if not family.flow.smooth:
        return _by_differences(family, x, periods, value)
    shares = min(usable_cores(), max(1, size // _SPLIT))
    shares = next(count for count in range(shares, 0, -1) if size % count == 0)
    tangents = np.eye(size).reshape(shares, size // shares, size)
    advanced = family.advance(np.repeat(x[None], shares, axis=0), periods, value, tangents)
    assert advanced.tangents is not None
    return Return(advanced.states[0], advanced.tangents.reshape(size, size).T, _impacts(advanced))


def require_isolated_orbits(flow: Flow) -> None:
    """Refuse a system whose periodic orbits form a continuum.

    Raises
    ------
    InputError
    """
    if isinstance(flow, Stroboscope) and flow.has_memory:
        raise InputError(
            "contact: a periodic motion keeps any indentation that its impacts do not deepen, so that orbits and attractors are not "
            "isolated; follow the motion by sb.dynamics.poincare_section or sb.advance"
        )


def _by_differences(family: Family, x: _Array, periods: int, value: float | None) -> Return:
    """Jacobian as :func:`jacobian`, from neighbouring states with the same number of impacts."""

    def advance_rows(rows: _Array, runs: NDArray[np.intp]) -> tuple[_Array, _Array | None]:
        beside = family.advance(rows, periods, value)
        return beside.states, beside.statistics.get("impacts")

    advanced = family.advance(x[None], periods, value)
    slopes, error = differences(advance_rows, x[None], np.eye(x.size)[None])
    # of a failed run there is nothing but NaN, which Newton's method reports
    if error.max() > _LARGEST_ERROR and np.isfinite(slopes).all():
        raise OrbitNotFoundError(
            "the derivative of the map is not known beside the orbit: an impact grazes, or is at the phase of observation; take "
            "another phase"
        )
    return Return(advanced.states[0], slopes[0].T, _impacts(advanced))


def _impacts(advanced: AdvancedStates) -> int:
    return int(advanced.statistics["impacts"][0]) if "impacts" in advanced.statistics else -1


def newton(
    residual: Callable[[_Array], _Array],
    derivative: Callable[[_Array], tuple[_Array, _Array]],
    x: _Array,
    tolerance: float,
    iterations: int,
    first: _Array | None = None,
    deflate: tuple[_Array, ...] = (),
) -> Shot:
    """A root of *residual* by Newton's method, its derivative kept by Broyden's updates as long as steps gain by it.

    Parameters
    ----------
    residual, derivative : callable
        r(x), and r(x) with its derivative.
    first : array, optional
        A derivative to begin with.
    deflate : tuple of arrays
        Roots to stay away from (Farrell, Birkisson and Funke, SIAM J. Sci. Comput. 37 (2015) A2026).

    Raises
    ------
    OrbitNotFoundError
    """
    fresh = first is None
    if first is None:
        r, slope = derivative(x)
    else:
        r, slope = residual(x), first
    size = float(np.abs(r).max())
    for count in range(iterations):
        if not np.isfinite(size):
            raise OrbitNotFoundError("a run failed on the way; begin nearer to the orbit")
        if size <= tolerance and not (deflate and _near(x, deflate)):
            return Shot(x, slope, size, count, fresh)
        try:
            step: NDArray[Any] = np.linalg.solve(slope, -r)
        except np.linalg.LinAlgError:
            raise OrbitNotFoundError(
                "the derivative is singular, as it is at a fold; change the parameter a little"
            ) from None
        step = _deflated(x, step, deflate)
        reach = float(np.abs(step).max())
        if reach > _LONGEST:
            step *= _LONGEST / reach
        found = residual(x + step)
        new = float(np.abs(found).max())
        if not new < size * (_SLOW if not fresh else 1.0) and new > tolerance:
            if not fresh:
                # the kept derivative no longer serves
                r, slope = derivative(x)
                size, fresh = float(np.abs(r).max()), True
                continue
            for _ in range(6):
                if deflate or new < size:
                    break
                step *= 0.5
                found = residual(x + step)
                new = float(np.abs(found).max())
            else:
                raise OrbitNotFoundError(
                    f"Newton's method stopped after {count + 1} iterations, since no step reduces the residual of "
                    f"{size:.2g}, in units of the well's amplitude; {_advice(size, tolerance)}"
                )
        slope = slope + np.outer(found - r - slope @ step, step) / float(step @ step)
        x, r, size, fresh = x + step, found, new, False
    raise OrbitNotFoundError(
        f"no convergence in {iterations} iterations, the residual is {size:.2g} in units of the well's amplitude; "
        f"{_advice(size, tolerance)}, or more iterations"
    )


def _advice(residual: float, tolerance: float) -> str:
    if residual <= _ROUNDING:
        return f"this is rounding: increase tolerance = {tolerance:g} above the residual"
    return "begin nearer to the orbit (a longer transient), try another period"


def orbit_tolerance(value: float) -> float:
    """The tolerance of an orbit.

    Raises
    ------
    InputError
        Unless it is between 0 and 1e-3.
    """
    return within("tolerance", value, 0.0, LARGEST_TOLERANCE, closed="right")


def _near(x: _Array, known: tuple[_Array, ...]) -> bool:
    return any(float(np.abs(x - other).max()) < 1e-6 for other in known)


def _deflated(x: _Array, step: _Array, known: tuple[_Array, ...]) -> _Array:
    """Newton's step of the residual times a product of (1 + 1/|x - root|^2)."""
    along = 0.0
    for other in known:
        away = x - other
        square = float(away @ away)
        if square == 0.0:
            raise OrbitNotFoundError("the guess is an orbit that is to be left out; begin elsewhere")
        along += -2.0 * float(away @ step) / (square * (square + 1.0))
    if along == 1.0:
        return step
    return step / (1.0 - along)


# What a run does within its periods: impacts, how near it passes the tip without touching, how far it goes.


class Passage(NamedTuple):
    """Some periods of a run."""

    impacts: int
    clearance: float
    """Minimum gap, over the length scale b, at which the beam turns back from a tip without touching; NaN: never."""
    min_penetration: float
    """Maximum penetration of the lightest impact, over b; NaN: none."""
    min_impulse: float
    """Minimum impulse of an impact, N s; NaN: none."""
    peak_displacement: float
    """Maximum distance of the contact point from the straight beam, over b."""
    crossings: int


def passage_of(flow: Stroboscope, coordinates: _Array, periods: int) -> Passage:
    """Follow one state for some periods and look at every approach."""
    run, depths, impacts = _followed(flow, coordinates, periods)
    time = run.dataset["time"].values
    # a turning point within a contact, or as near to one as a sample, is part of it
    turns, spacing = (
        turning_points(flow, coordinates, periods, periodic=False),
        1.000001 * (time[1] - time[0]),
    )
    free = np.isfinite(turns.depth)
    deepest = []
    for onset, duration, contact in impacts:
        within_contact = (turns.time >= onset - spacing) & (turns.time <= onset + duration + spacing)
        free &= ~(within_contact & (turns.contact == contact))
        inside = depths[(time >= onset) & (time <= onset + duration), contact]
        deepest.append(float(inside.max(initial=0.0)))
    return Passage(
        impacts=len(impacts),
        # beyond the tip by less than a contact that a step sees: as far off
        clearance=float(np.abs(turns.depth[free]).min()) if free.any() else np.nan,
        min_penetration=min(deepest, default=np.nan),
        min_impulse=float(run.impacts["impulse"].values.min()) if impacts else np.nan,
        peak_displacement=float(np.abs(run.dataset["displacement_at_striker"].values).max()),
        crossings=int(run.summary.zero_crossings),
    )


class TurningPoints(NamedTuple):
    """Maxima of the penetrations of a motion."""

    time: _Array
    """s."""
    depth: _Array
    """Penetration over b; negative for a gap."""
    contact: NDArray[np.intp]


def _followed(
    flow: Stroboscope, coordinates: _Array, periods: int, times: _Array | None = None
) -> tuple[Run, _Array, list[tuple[float, float, int]]]:
    """A run, its penetrations over b, shape (times, contacts), and onset (s), duration (s) and contact of its impacts."""
    if times is None:
        times = np.linspace(0.0, periods * flow.period, _SAMPLES * periods + 1)
    integration = flow.integration.replace(cycles=periods * flow.cycles_per_period, early_termination=False)
    run = simulate(flow.starting(flow.state(coordinates)), integration, sample_times=times)
    several = len(run.system.contacts) > 1
    depths = run.dataset["striker_penetrations" if several else "penetration_normalised"].values
    table = run.impacts
    contacts = table["striker"].values.astype(int) - 1 if several else [0] * table.sizes["impact"]
    impacts = zip(table["onset"].values.tolist(), table["duration"].values.tolist(), contacts, strict=True)
    return run, depths.reshape(times.size, -1), list(impacts)


def penetrations(flow: Stroboscope, coordinates: _Array, periods: int, times: _Array) -> _Array:
    """Penetrations over b at instants of a motion (s, increasing), shape (times, contacts); gaps are negative."""
    return _followed(flow, coordinates, periods, times)[1]


def turning_points(
    flow: Stroboscope, coordinates: _Array, periods: int, *, periodic: bool = True
) -> TurningPoints:
    """Turning points of the gaps of a motion, by the quartic through the five nearest samples, sampled once more there.

    Of a *periodic* motion the samples go on from its end to its beginning.  An impact that lasts no time is no turning point: the
    velocity jumps.
    """
    end, count = periods * flow.period, _SAMPLES * periods
    _, depth, impacts = _followed(flow, coordinates, periods)
    depth, spacing = depth[:-1] if periodic else depth, end / count
    turns = (depth >= np.roll(depth, 1, axis=0)) & (depth > np.roll(depth, -1, axis=0))
    if not periodic:
        turns[[0, -1]] = False
    at, contact = np.nonzero(turns)
    for onset, duration, touched in impacts:
        if duration == 0.0:
            apart = np.abs((spacing * at - onset + 0.5 * end) % end - 0.5 * end)
            at, contact = (each[(contact != touched) | (apart > 2.0 * spacing)] for each in (at, contact))
    if not at.size:
        return TurningPoints(np.empty(0), np.empty(0), contact)
    nearest = np.arange(-2, 3)
    middle = at if periodic else np.clip(at, 2, len(depth) - 3)
    place, _ = _maximum(depth[(middle[:, None] + nearest) % len(depth), contact[:, None]])
    finer = spacing / _SAMPLES
    time = spacing * (middle + place)
    times, back = np.unique((time[:, None] + finer * nearest) % end, return_inverse=True)
    depth = penetrations(flow, coordinates, periods, times)
    place, top = _maximum(depth[back.reshape(at.size, 5), contact[:, None]])
    return TurningPoints((time + finer * place) % end, top, contact)


def _maximum(values: _Array) -> tuple[_Array, _Array]:
    """Place, in units of the spacing, and height of the maximum of the quartics through rows of five samples."""
    place, top = np.zeros(len(values)), values[:, 2].copy()
    for i, row in enumerate(values):
        curve = np.polynomial.Polynomial.fit(np.arange(-2.0, 3.0), row - row[2], 4).convert()
        roots = curve.deriv().roots()
        inner = roots.real[(np.abs(roots.imag) < 1e-9) & (np.abs(roots.real) <= 2.0)]
        if inner.size:
            place[i] = inner[np.argmax(curve(inner))]
            top[i] += curve(place[i])
    return place, top


@dataclass(frozen=True, eq=False)
class PeriodicOrbit:
    """A state that comes back after some periods of the drive.

    Examples
    --------
    >>> import snapbeam as sb
    >>> from snapbeam import paper
    >>> model = sb.ReducedModel.from_beam(paper.BEAM, modes=1, damping_ratio=0.05)
    >>> shaker = sb.Shaker(frequency_ratio=1.6, velocity_amplitude=0.03)
    >>> system = sb.System(model, contacts=[sb.Contact(paper.CONTACT, shaker)])
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
        """Contacts of the orbit: impacts, closest approach to the tip, maximum displacement."""
        return passage_of(self._stroboscope, self.coordinates, self.period)

    @property
    def _stroboscope(self) -> Stroboscope:
        if not isinstance(self.flow, Stroboscope):
            raise InputTypeError("orbit: its flow is not a System")
        return self.flow

    def plot(self, kind: str = "phase_portrait", ax: Any = None, **options: Any) -> Any:
        """Draw the orbit over its whole period, or its Floquet multipliers.

        Parameters
        ----------
        kind : {"phase_portrait", "multipliers"}
        ax : matplotlib.axes.Axes, optional
        **options
            Options of :func:`snapbeam.plot.plot_phase_portrait` or :func:`snapbeam.plot.plot_multipliers`.

        Returns
        -------
        matplotlib.axes.Axes
        """
        if choice("kind", kind, ("phase_portrait", "multipliers")) == "multipliers":
            return plotter("plot_multipliers")(self.to_dataset(), ax=ax, **options)
        flow = self._stroboscope
        cycles = self.period * flow.cycles_per_period
        run = simulate(self.system, flow.integration.replace(cycles=cycles, early_termination=False))
        return plotter("plot_phase_portrait")(run, ax=ax, **options)

    def to_dataset(self) -> xr.Dataset:
        """The orbit once a period, and its multipliers, labelled."""
        from snapbeam.util.datasets import xr

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
                **fixed_parameters(self.flow),
                "period": self.period,
                "residual": self.residual,
                "stable": int(self.is_stable),
            },
        )

    def __repr__(self) -> str:
        kind = "stable" if self.is_stable else f"unstable ({self.unstable})"
        size = abs(self.multipliers[0])
        return f"<PeriodicOrbit of period {self.period}: {kind}, largest multiplier {size:.6g}>"


def orbit_at(orbit: PeriodicOrbit, flow: Flow) -> PeriodicOrbit:
    """An orbit at the phase at which another flow takes states; its derivative stays that at its own phase."""
    if not isinstance(flow, Stroboscope) or not isinstance(orbit.flow, Stroboscope):
        return orbit
    phase = flow.striker_phase
    if phase == orbit.flow.striker_phase:
        return orbit
    moved = Stroboscope(orbit.flow.system, orbit.flow.integration, phase)
    return replace(orbit, flow=moved, coordinates=orbit.flow.carried(orbit.coordinates, phase))


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
    """Find the periodic orbit near a state, stable or not, by Newton shooting with exact tangents.

    The tip's mid-position is fixed in space, where it is at the system's start.  Solves P^m(x) = x for the map P over
    one period of the drive.

    Parameters
    ----------
    system : System, or a Flow
    guess : State, array_like of shape (d,) or PeriodicOrbit, optional
        A state near the orbit, at the phase; the system's start by default.
    period : int
        Periods of the drive after which it closes, m.
    integration : Integration, optional
        ``accuracy="reference"`` by default: an orbit is only as accurate as the steps.
    phase : float, optional
        Of the drive at which the orbit is seen, rad.  By default that at which a run begins; under a law that
        is not smooth, where a contact is near that, the phase farthest from all contacts.  ``orbit.flow.phase``
        contains it.
    transient : int
        Transient periods to integrate from the guess, so that it approaches the attractor.
    tolerance : float
        Maximum coordinate that may remain, in units of the well's amplitude and of omega_1 times it; at most 1e-3.
    iterations : int
        Maximum number of iterations of Newton's method.  It also stops where no step reduces the residual.
    deflate : sequence of PeriodicOrbit
        Orbits that are known and are not to be found again.

    Returns
    -------
    PeriodicOrbit

    Raises
    ------
    InputError
        If the system has no excitation, or a number is out of range.
    OrbitNotFoundError
        If no orbit is found; the message states the cause and a remedy.

    Examples
    --------
    >>> import snapbeam as sb
    >>> from snapbeam import paper
    >>> model = sb.ReducedModel.from_beam(paper.BEAM, modes=1, damping_ratio=0.05)
    >>> shaker = sb.Shaker(frequency_ratio=1.6, velocity_amplitude=0.03)
    >>> system = sb.System(model, contacts=[sb.Contact(paper.CONTACT, shaker)])
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
            flow = Stroboscope(flow.system, flow.integration, phase)
    elif phase is not None:
        raise InputError(f"phase = {shown(phase)}: is for a System")
    periods = integer("period", period, 1, 10_000)
    allowed = orbit_tolerance(tolerance)
    x = _guess_of(flow, guess)
    before = integer("transient", transient, 0, 10**7)
    if before:
        x = flow.advance(x[None], before).states[0]
        if not np.isfinite(x).all():
            raise OrbitNotFoundError("the run from the guess failed; see its status with sb.advance")
    if not all(isinstance(orbit, PeriodicOrbit) for orbit in deflate):
        raise InputTypeError(f"deflate = {shown(deflate)}: must be orbits, as periodic_orbit gives")
    most = integer("iterations", iterations, 1, 10_000)
    orbit = None
    try:
        orbit = shoot(flow, x, periods, allowed, most, deflate=_points(deflate, flow))
    except OrbitNotFoundError as error:
        if phase is not None or _seen_between_contacts(flow, x, periods) is None:
            coarse = isinstance(flow, Stroboscope) and flow.integration.accuracy != "reference"
            if not coarse:
                raise
            raise OrbitNotFoundError(f"{error}, or use accuracy = 'reference'") from None
    if phase is None:
        moved = _seen_between_contacts(flow, x if orbit is None else orbit.coordinates, periods)
        if moved is not None:
            orbit = shoot(*moved, periods, allowed, most, deflate=_points(deflate, moved[0]))
    assert orbit is not None
    return orbit


def _points(orbits: Sequence[PeriodicOrbit], flow: Flow) -> tuple[_Array, ...]:
    return tuple(point for orbit in orbits for point in orbit_at(orbit, flow).points)


def _seen_between_contacts(flow: Flow, x: _Array, periods: int) -> tuple[Stroboscope, _Array] | None:
    """The map and the state at the phase farthest from contacts, if one is near the phase of the flow."""
    if not isinstance(flow, Stroboscope):
        return None
    phase = flow.phase_between_contacts(x, periods)
    if phase is None:
        return None
    return Stroboscope(flow.system, flow.integration, phase), flow.carried(x, phase)


def _guess_of(flow: Flow, guess: State | ArrayLike | PeriodicOrbit | None) -> _Array:
    if isinstance(guess, PeriodicOrbit):
        return np.array(orbit_at(guess, flow).coordinates)
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
        return family.advance(at[None], period).states[0] - at

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


# Orbits on planes across a branch: the prediction along its tangent is corrected there (Keller 1977).


class Spot(NamedTuple):
    """One orbit of a branch."""

    y: _Array
    """State, and the parameter over its range."""
    tangent: _Array
    came: Return
    slope: _Array
    """Derivative of the return map by the parameter over its range."""
    iterations: int


@dataclass(frozen=True, eq=False)
class Corrector:
    """Finds orbits on planes across a branch."""

    family: Family
    period: int
    span: float
    tolerance: float

    def bordered(self, came: Return, slope: _Array, row: _Array) -> _Array:
        """Derivative of the equations of an orbit and a plane."""
        size = slope.size
        table = np.empty((size + 1, size + 1))
        table[:size, :size] = came.jacobian - np.eye(size)
        table[:size, size] = slope
        table[size] = row
        return table

    def derivatives(self, y: _Array) -> tuple[Return, _Array]:
        """The return map and its derivatives at a state and a value."""
        value = float(y[-1]) * self.span
        came = jacobian(self.family, y[:-1], self.period, value)
        step = _DIFFERENCE * self.span
        return came, self.family.slope(y[:-1], self.period, value, step) * self.span

    def correct(
        self, guess: _Array, row: _Array, before: _Array, known: tuple[Return, _Array] | None = None
    ) -> Spot:
        """The orbit on the plane through *guess* across *row*; its tangent goes on as *before* does.

        Raises
        ------
        OrbitNotFoundError
        """

        def residual(y: _Array) -> _Array:
            value = float(y[-1]) * self.span
            there = self.family.advance(y[None, :-1], self.period, value).states[0]
            return np.append(there - y[:-1], row @ (y - guess))

        def derivative(y: _Array) -> tuple[_Array, _Array]:
            came, slope = self.derivatives(y)
            return np.append(came.x - y[:-1], row @ (y - guess)), self.bordered(came, slope, row)

        first = None if known is None else self.bordered(*known, row)
        shot = newton(residual, derivative, guess, self.tolerance, _ITERATIONS, first)
        came, slope = self.derivatives(shot.x)
        if not np.isfinite(came.jacobian).all() or not np.isfinite(slope).all():
            raise OrbitNotFoundError("a run beside the orbit failed")
        return Spot(shot.x, self.tangent(came, slope, before), came, slope, shot.iterations)

    def tangent(self, came: Return, slope: _Array, before: _Array) -> _Array:
        """Unit tangent of the branch, in the direction of *before*."""
        wanted = np.zeros(slope.size + 1)
        wanted[-1] = 1.0
        try:
            found = np.linalg.solve(self.bordered(came, slope, before), wanted)
        except np.linalg.LinAlgError:
            return before
        return found / np.linalg.norm(found)

    def between_contacts(self, spot: Spot) -> tuple[Corrector, Spot]:
        """The orbit at the phase farthest from contacts, if one is near the phase of the flow; itself otherwise."""
        flow, name = self.family.flow, self.family.name
        if (
            not isinstance(flow, Stroboscope)
            or not flow.jumps
            or name is None
            or flow.system.parameter(name).name.endswith(".phase")
        ):
            return self, spot
        here = self.family.at(float(spot.y[-1]) * self.span)
        assert isinstance(here, Stroboscope)
        phase = here.phase_between_contacts(spot.y[:-1], self.period)
        if phase is None:
            return self, spot
        moved = replace(self, family=Family(Stroboscope(flow.system, flow.integration, phase), name))
        return moved, moved.seen(self, spot)

    def seen(self, other: Corrector, spot: Spot) -> Spot:
        """An orbit of another corrector at the phase of this one.

        Raises
        ------
        OrbitNotFoundError
        """
        if other.family.flow is self.family.flow:
            return spot
        assert isinstance(self.family.flow, Stroboscope)
        here = other.family.at(float(spot.y[-1]) * self.span)
        assert isinstance(here, Stroboscope)
        guess = np.append(here.carried(spot.y[:-1], self.family.flow.striker_phase), spot.y[-1])
        row = np.append(np.zeros(guess.size - 1), 1.0)
        found = self.correct(guess, row, row)
        along = svd(self.bordered(found.came, found.slope, row)[:-1])[2][-1]
        return found._replace(tangent=along if along[-1] * spot.tangent[-1] >= 0.0 else -along)

    def orbit(self, spot: Spot) -> PeriodicOrbit:
        """Orbit of the flow at its parameter value."""
        came, x = spot.came, spot.y[:-1]
        residual = float(np.abs(came.x - x).max())
        flow = self.family.at(float(spot.y[-1]) * self.span)
        return PeriodicOrbit(flow, x, self.period, came.jacobian, residual, spot.iterations)
