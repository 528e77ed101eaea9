"""Branches of periodic orbits: pseudo-arclength continuation in any parameter, with its special points.

With the return map P^m(x; lambda), a branch solves P^m(x; lambda) = x; each orbit is predicted along the tangent of the
branch and corrected on the plane across it (Keller, in Applications of Bifurcation Theory, 1977).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from snapbeam.dynamics.arclength import OrbitEquations, Point, distances, follow, tangent_of
from snapbeam.dynamics.flow import Flow
from snapbeam.dynamics.periodic_orbits import PeriodicOrbit, orbit_at
from snapbeam.dynamics.results import multiplier_rows, of_flow, parameter_labels, reported
from snapbeam.dynamics.shooting import Family, OrbitNotFoundError, Return, jacobian, orbit_tolerance
from snapbeam.dynamics.stroboscope import Stroboscope
from snapbeam.util.display import plotter
from snapbeam.util.validation import InputError, checked, choice, integer, interval, shown, within

if TYPE_CHECKING:
    import xarray as xr

SPECIAL_POINTS = ("fold", "flip", "Neimark-Sacker", "branch point", "grazing")
_LOCATED = 1e-9
"""Tolerance of a multiplier at an event."""
_CRITICAL = 1e-3
"""Distance of the critical multiplier at an event from where it is in theory, at most."""
_HALVINGS = 20
_TOUCHES = 5e-3
"""Clearance, over the length scale, below which a branch that goes no further ends by grazing."""
_Array = NDArray[np.float64]
_TOLERANCE = 1e-10


@dataclass(frozen=True, eq=False)
class SpecialPoint:
    """A special point of a branch: a bifurcation or a grazing orbit.

    See Also
    --------
    snapbeam.dynamics.switch_branch, snapbeam.dynamics.bifurcation_curve

    Examples
    --------
    >>> import snapbeam as sb
    >>> system = sb.paper.struck_beam(frequency_ratio=1.6, velocity_amplitude=0.03, damping_ratio=0.05)
    >>> orbit = sb.dynamics.periodic_orbit(system, transient=100)
    >>> branch = sb.dynamics.continuation(orbit, "velocity_amplitude", (0.02, 0.3), max_points=12)
    >>> [(point.kind, round(point.value, 4)) for point in branch.special_points]
    [('fold', 0.0379)]
    """

    kind: str
    """One of :data:`SPECIAL_POINTS`."""
    orbit: PeriodicOrbit
    value: float
    """Value of the parameter."""
    index: int
    """Number of the orbit of the branch that it comes after."""
    error: float = math.nan
    """Uncertainty of the value at these steps; NaN: unknown."""

    def __repr__(self) -> str:
        off = "" if math.isnan(self.error) else f" ± {self.error:.1g}"
        return f"<{self.kind} at {self.value:.8g}{off}>"


@dataclass(frozen=True, eq=False)
class Branch:
    """Orbits that follow each other along a parameter.

    See Also
    --------
    snapbeam.dynamics.continuation, snapbeam.dynamics.SpecialPoint

    Examples
    --------
    >>> import snapbeam as sb
    >>> system = sb.paper.struck_beam(frequency_ratio=1.6, velocity_amplitude=0.03, damping_ratio=0.05)
    >>> orbit = sb.dynamics.periodic_orbit(system, transient=100)
    >>> branch = sb.dynamics.continuation(orbit, "velocity_amplitude", (0.02, 0.3), max_points=5)
    >>> len(branch.orbits), branch.termination_reason
    (5, '5 orbits, the maximum (max_points)')
    """

    name: str
    """Name of the parameter."""
    orbits: list[PeriodicOrbit]
    special_points: list[SpecialPoint]
    termination_reason: str
    """Reason why the branch ends."""
    impacts: list[int]
    """Number of impacts of each orbit within its period."""
    tangents: list[NDArray[np.float64]]

    def __repr__(self) -> str:
        low, high = self.values.min(), self.values.max()
        text = f"{len(self.orbits)} orbits of period {self.orbits[0].period}, {self.name} from {low:.6g} to {high:.6g}"
        return f"<Branch: {text}, {len(self.special_points)} special points, end: {self.termination_reason}>"

    @cached_property
    def values(self) -> NDArray[np.float64]:
        """Values of the parameter along the branch."""
        return np.array([orbit.flow.value(self.name) for orbit in self.orbits])

    @cached_property
    def is_stable(self) -> NDArray[np.bool_]:
        """Stability of each orbit."""
        return np.array([orbit.is_stable for orbit in self.orbits])

    def plot(self, variable: str | None = None, ax: Any = None, **options: Any) -> Any:
        """Draw the branch: ``"midspan_displacement"`` over the parameter, or ``"multipliers"``; returns the axes."""
        return plotter("plot_dataset")(self.to_dataset(), variable, ax, **options)

    def to_dataset(self) -> xr.Dataset:
        """Return the branch as a dataset.

        Over ``orbit``: the parameter, the state, the multipliers, stability, impacts and the mid-span displacement,
        once and at every ``return``.  Over ``special_point``: kind, value, error, state and the orbit before it.
        """
        first, special = self.orbits[0], self.special_points
        seen = [orbit_at(orbit, first.flow) for orbit in self.orbits]
        values = np.array([orbit.multipliers for orbit in self.orbits])
        short, labels = parameter_labels(first.flow, self.name)
        states = np.array([orbit.coordinates for orbit in seen])
        steps = np.linalg.norm(np.diff(states, axis=0), axis=1)
        there = [orbit_at(point.orbit, first.flow).coordinates for point in special]
        off = labels | {"long_name": f"by how much it may be off at these steps: {labels['long_name']}"}
        words = "state of the orbit at the phase of observation of the first orbit"
        variables = {"state": (("orbit", "coordinate"), states, words)} | multiplier_rows(values, "orbit") | {
            "stable": ("orbit", self.is_stable, "whether every multiplier is inside the unit circle"),
            "impacts": ("orbit", np.array(self.impacts, np.int32), "impacts within the period"),
            "arclength": ("orbit", np.append(0.0, np.cumsum(steps)), "length of the branch in states"),
            "residual": ("orbit", [orbit.residual for orbit in self.orbits], "of the return"),
            "special_point_kind": (
                "special_point", [point.kind for point in special], {"long_name": "kind of the special point"}
            ),
            "special_point_index": ("special_point", [point.index for point in special], "orbit before it"),
            "special_point_value": ("special_point", [point.value for point in special], labels),
            "special_point_error": ("special_point", np.array([point.error for point in special], float), off),
            "special_point_state": (
                ("special_point", "coordinate"), np.reshape(there, (-1, states.shape[1])), "state of the orbit there"
            ),
        }  # fmt: skip
        if isinstance(first.flow, Stroboscope):
            centers = np.array([orbit._centres for orbit in seen])
            variables["midspan_displacement"] = ("orbit", centers[:, 0], "centre displacement there, over b")
            words = "centre displacement once a period of the drive, over b"
            variables["midspan_returns"] = (("orbit", "return"), centers, words)
        coords = {short: ("orbit", self.values, labels | {"parameter": self.name})}
        attrs = {
            "title": "branch of periodic orbits", "parameter": short, "period": first.period,
            "termination_reason": self.termination_reason,
        }  # fmt: skip
        return of_flow(first.flow, variables, attrs, coords, (short,))


# Special points, located between two orbits of a branch, with an error.
#
# The error of a value holds what is left of the bracket, what the residual of the orbit moves, and what the error of the
# return map's derivative moves; that of the steps themselves, which other steps show, it does not hold.


_FINE, _ROUNDING = 1e-5, 1e-13
"""Relative error of tangents at level "reference", and of what is known exactly."""
_ACROSS = 10.0
"""Maximum ratio of the change of multipliers across a branch to that along it; above it, an orbit is inaccurate."""


class _Orbits(OrbitEquations):
    """Equations of the orbits over one parameter."""

    def _value(self, y: _Array) -> float:
        return float(self.values(y)[0])

    def residual(self, y: _Array) -> _Array:
        """Residual of the return, shape (d,)."""
        there = self.family.advance(y[None, :-1], self.period, self.values(y)).states[0]
        return np.asarray(there - y[:-1])

    def derivative(self, y: _Array) -> tuple[_Array, Return, _Array]:
        """Residual, return map and derivative, shape (d, d + 1)."""
        came = jacobian(self.family, y[:-1], self.period, self.values(y))
        slope = self.family.slope(y[:-1], self.period, self.values(y), _DIFFERENCE * self.spans) * self.spans
        return came.x - y[:-1], came, np.column_stack([came.jacobian - np.eye(len(came.x)), slope])

    def orbit(self, point: Point) -> PeriodicOrbit:
        """Orbit of the flow at its parameter value."""
        came, x = point.came, self.state(point.y)
        residual = float(np.abs(came.x - x).max())
        return PeriodicOrbit(self.flow_at(point.y), x, self.period, came.jacobian, residual, point.iterations)

    def require_next(self, last: Point, point: Point) -> None:
        """Refuse another number of impacts where the derivatives jump between such orbits."""
        flow = self.family.flow
        if isinstance(flow, Stroboscope) and flow.jumps and point.came.impacts != last.came.impacts:
            raise OrbitNotFoundError("another number of impacts: it grazes")

    def events(self, last: Point, point: Point, number: int) -> list[SpecialPoint]:
        """Special points between two orbits."""
        found = []
        up, flip, pair = (b - a for a, b in zip(_counts(last.came), _counts(point.came), strict=True))
        if last.tangent[-1] * point.tangent[-1] < 0.0:
            found.append(_located(self, last, point, "fold", number))
        elif up % 2:
            found.append(_located(self, last, point, "branch point", number))
        if flip % 2:
            found.append(_located(self, last, point, "flip", number))
        if pair and not (up or flip):
            found.append(_located(self, last, point, "Neimark-Sacker", number))
        if last.came.impacts != point.came.impacts:
            found.append(_grazing(self, last, point, number))
        return [event for event in found if event is not None]

    def has_returned(self, point: Point, first: tuple[_Orbits, Point], near: float) -> bool:
        """Return whether the branch has returned to its first orbit, in the same direction."""
        if not abs(point.y[-1] - first[1].y[-1]) < near:
            return False
        try:
            begun = self.seen(*first)
        except OrbitNotFoundError:
            return False  # at this phase the first orbit is in contact: it is another one
        return bool(np.linalg.norm(point.y - begun.y) < near and point.tangent @ begun.tangent > 0.9)


def _counts(came: Return) -> tuple[int, int, int]:
    """Real multipliers above 1, real ones below -1, and others outside the unit circle."""
    values = np.linalg.eigvals(came.jacobian)
    real = np.abs(values.imag) < 1e-12 * np.maximum(np.abs(values), 1e-300)
    out = np.abs(values) > 1.0
    sets = real & (values.real > 1.0), real & (values.real < -1.0), out & ~real
    return int(sets[0].sum()), int(sets[1].sum()), int(sets[2].sum())


def _test(spot: Point, kind: str) -> float:
    """Test function, zero at a special point."""
    if kind == "fold":
        return float(spot.tangent[-1])
    values = np.linalg.eigvals(spot.came.jacobian)
    if kind == "Neimark-Sacker":
        pairs = np.abs(values[np.abs(values.imag) > 1e-12])
        return float(pairs[np.argmin(np.abs(pairs - 1.0))] - 1.0) if pairs.size else np.nan
    sign = -1.0 if kind == "flip" else 1.0
    size = values.size
    # the determinant changes its sign with one real multiplier, whatever the others do
    logs = np.linalg.slogdet(spot.came.jacobian - sign * np.eye(size))
    near = values[np.argmin(np.abs(values - sign))]
    return float(logs[0].real * abs(near - sign))


def _located(orbits: _Orbits, one: Point, other: Point, kind: str, at: int) -> SpecialPoint | None:
    """An event between two orbits, by the Illinois form of false position; None where no multiplier is critical."""
    low, high, f_low, f_high = 0.0, 1.0, _test(one, kind), _test(other, kind)
    if not f_low * f_high < 0.0:
        return None
    best, side = one if abs(f_low) < abs(f_high) else other, 0
    part, off = (0.0 if best is one else 1.0), 1.0
    for _ in range(_HALVINGS):
        steep = (f_high - f_low) / (high - low)
        tried = low - f_low / steep
        try:
            spot = orbits.between(one, other, tried)
        except OrbitNotFoundError:
            off = high - low
            break
        value = _test(spot, kind)
        best, part = spot, tried
        off = min(2.0 * abs(value / steep), high - low)
        if not abs(value) > _LOCATED or high - low < 1e-9:
            break
        if value * f_high > 0.0:
            high, f_high = tried, value
            f_low *= 0.5 if side == 1 else 1.0
            side = 1
        else:
            low, f_low = tried, value
            f_high *= 0.5 if side == -1 else 1.0
            side = -1
    orbit = orbits.orbit(best)
    critical = max(_CRITICAL, 10.0 * _derivative_error(orbits.family.flow))
    if not _distance(orbit.multipliers, kind) < critical:
        return None  # what seems to change its sign jumps, as where an impact passes the phase of observation
    # a derivative that is off moves the place at which a multiplier seems to pass, and so does an orbit off its own
    off += _ACROSS * _unsettled(best) / float(np.linalg.norm(other.y - one.y))
    off += _derivative_error(orbits.family.flow) * abs(1.0 / (_test(other, kind) - _test(one, kind)))
    found = orbits._value(best.y)
    error = _moved(orbits, (one, best, other), part, off) + float(orbits.spans[0]) * _unsettled(best)
    return SpecialPoint(kind, orbit, found, at, error)


def _distance(multipliers: NDArray[np.complex128], kind: str) -> float:
    """Distance of the critical multiplier from its value at the special point."""
    if kind == "Neimark-Sacker":
        return float(np.abs(np.abs(multipliers) - 1.0).min())
    return float(np.abs(multipliers - (-1.0 if kind == "flip" else 1.0)).min())


def _derivative_error(flow: Flow) -> float:
    """Relative error of the return map's derivative."""
    return _FINE if isinstance(flow, Stroboscope) else _ROUNDING


def _moved(orbits: _Orbits, spots: tuple[Point, Point, Point], part: float, off: float) -> float:
    """Change of the parameter, by the parabola through three orbits, if the place of the middle one is off by *off*."""
    first, middle, last = (float(spot.y[-1]) for spot in spots)
    if not 1e-6 < part < 1.0 - 1e-6:
        return abs(last - first) * float(orbits.spans[0]) * off
    rise, fall = (middle - first) / part, (last - middle) / (1.0 - part)
    bend = fall - rise
    slope = rise + bend * part
    return (abs(slope) * off + abs(bend) * off**2) * float(orbits.spans[0])


def _unsettled(point: Point) -> float:
    """Estimated error of an orbit, as a state and over the parameter range, from its closure error."""
    table = np.vstack([point.table, point.tangent])
    residual = max(float(np.linalg.norm(point.came.x - point.y[:-1])), _ROUNDING)
    least = float(np.linalg.svd(table, compute_uv=False)[-1])
    return residual / least if least > 0.0 else float("nan")


def _grazing(orbits: _Orbits, one: Point, other: Point, at: int) -> SpecialPoint:
    """Special point at which the number of impacts changes between two orbits, by bisection."""
    sides = orbits.halved(one, other, lambda spot: spot.came.impacts == one.came.impacts, _HALVINGS)
    width = abs(float(sides[1].y[-1] - sides[0].y[-1])) * float(orbits.spans[0])
    found = orbits._value(sides[1].y)
    error = width + float(orbits.spans[0]) * _unsettled(sides[1])
    return SpecialPoint("grazing", orbits.orbit(sides[1]), found, at, error)


def _grazing_end(points: list[tuple[_Orbits, Point]]) -> SpecialPoint | None:
    """The grazing that a branch ends at, if its last orbit passes the tip; the error is the room left over its rate."""
    orbits, last = points[-1]
    if not isinstance(orbits.family.flow, Stroboscope):
        return None
    orbit, span = orbits.orbit(last), float(orbits.spans[0])
    scratch = orbit.contact_summary.clearance
    if not scratch < _TOUCHES:
        return None
    error = float("nan")
    for by, before in reversed(points[:-1]):
        way = abs(float(before.y[-1] - last.y[-1])) * span
        fell = by.orbit(before).contact_summary.clearance - scratch
        if fell > max(scratch, _ROUNDING):
            error = 2.0 * scratch * way / fell + span * _unsettled(last)
            break
    return SpecialPoint("grazing", orbit, orbits._value(last.y), len(points) - 1, error)


_SHORTEST = 1e-8
"""Minimum distance between orbits."""
_DIFFERENCE = 2e-6
"""Step of the difference by the parameter, over its range."""


@checked
def continuation(
    orbit: PeriodicOrbit,
    name: str,
    bounds: tuple[float, float],
    *,
    direction: str = "up",
    max_points: int = 500,
    step: float = 0.01,
    max_step: float = 0.02,
    tolerance: float = _TOLERANCE,
    progress: Callable[[int, int], object] | bool | None = None,
) -> Branch:
    """Follow a periodic orbit, stable or not, along one parameter.

    Folds, period doublings (flips), Neimark-Sacker bifurcations, branch points and grazing are located. The branch ends
    at a limit of the parameter, when it closes, at *max_points* orbits, or where no orbit is found, such as at grazing
    under a law of restitution; ``branch.termination_reason`` gives the reason.

    Parameters
    ----------
    orbit : PeriodicOrbit
        First orbit, of :func:`periodic_orbit` or of a branch.
    name : str
        Parameter, by any of its names.
    bounds : pair of float
        Minimum and maximum value.
    direction : {"up", "down"}
        Direction of the parameter at first.
    max_points : int
        Maximum number of orbits.
    step, max_step : float
        First and maximum distance between orbits, in units of the well's amplitude for the state and of the range
        for the parameter; between 1e-8 and 1.
    tolerance : float
        Tolerance of the orbits, as in :func:`periodic_orbit`.
    progress : callable or bool, optional
        Report of orbits, as in :func:`snapbeam.sweep`.

    Returns
    -------
    Branch

    See Also
    --------
    snapbeam.dynamics.switch_branch, snapbeam.dynamics.bifurcation_curve, snapbeam.dynamics.bifurcation_diagram

    Examples
    --------
    >>> import snapbeam as sb
    >>> system = sb.paper.struck_beam(frequency_ratio=1.6, velocity_amplitude=0.03, damping_ratio=0.05)
    >>> orbit = sb.dynamics.periodic_orbit(system, transient=100)
    >>> branch = sb.dynamics.continuation(orbit, "velocity_amplitude", (0.02, 0.032))
    >>> float(branch.values.max())
    0.032
    """
    low, high = interval("bounds", bounds)
    begun = orbit.flow.value(name)
    if not low <= begun <= high:
        raise InputError(f"bounds = ({low:g}, {high:g}): must contain the orbit's own {name} = {begun:g}")
    choice("direction", direction, ("up", "down"))
    count = integer("max_points", max_points, 2, 10**6)
    step, max_step = distances(step, max_step, _SHORTEST)
    span = np.array([high - low])
    orbits = _Orbits(Family(orbit.flow, name), orbit.period, span, orbit_tolerance(tolerance))
    y = np.append(orbit.coordinates, begun / span)
    _, came, table = orbits.derivative(y)
    towards = np.append(np.zeros(y.size - 1), 1.0 if direction == "up" else -1.0)
    report = reported(progress, "branch", "orbits")
    path = follow(
        orbits,
        Point(y, tangent_of(table, towards), came, table, orbit.iterations, orbit.residual),
        limits=np.array([[low, high]]) / span,
        max_points=count,
        step=step,
        max_step=max_step,
        progress=report,
    )
    if len(path.points) < count:
        report(len(path.points), len(path.points))
    points, special, end = path.points, path.events, path.end
    grazing = _grazing_end(points) if end.startswith("no further") else None
    if grazing is not None:
        special, end = [*special, grazing], "grazing"
    impacts, followed = [point.came.impacts for _, point in points], [by.orbit(point) for by, point in points]
    return Branch(name, followed, special, end, impacts, [point.tangent for _, point in points])


def switch_branch(
    special_point: SpecialPoint, name: str, bounds: tuple[float, float], *, size: float = 0.01
) -> PeriodicOrbit:
    """Find an orbit of the branch that begins at a flip or a branch point, *size* away from it.

    At a flip it has twice the period. Newton's method searches at that distance along the critical eigenvector.

    Parameters
    ----------
    special_point : SpecialPoint
        Flip or branch point of a branch.
    name, bounds
        Parameter and its limits, as in :func:`continuation`.
    size : float
        Distance, in units of the well's amplitude; between 1e-8 and 1.

    Returns
    -------
    PeriodicOrbit
        Start of the new branch, for :func:`continuation`.

    Raises
    ------
    InputError
        If no other branch begins at the point.
    OrbitNotFoundError
        If there is none at that distance; try another.

    See Also
    --------
    snapbeam.dynamics.continuation

    Examples
    --------
    >>> import snapbeam as sb
    >>> system = sb.paper.struck_beam(frequency_ratio=1.6, velocity_amplitude=0.15, damping_ratio=0.05)
    >>> orbit = sb.dynamics.periodic_orbit(system, [-0.69, -0.21])
    >>> branch = sb.dynamics.continuation(orbit, "velocity_amplitude", (0.145, 0.155))
    >>> flip = branch.special_points[0]
    >>> doubled = sb.dynamics.switch_branch(flip, "velocity_amplitude", (0.145, 0.155))
    >>> doubled.period
    2
    """
    if not isinstance(special_point, SpecialPoint) or special_point.kind not in ("flip", "branch point"):
        raise InputError(f"special_point = {shown(special_point)}: must be a flip or a branch point")
    low, high = interval("bounds", bounds)
    orbit, span = special_point.orbit, np.array([high - low])
    doubled = special_point.kind == "flip"
    values, vectors = np.linalg.eig(orbit.jacobian)
    vector = vectors[:, np.argmin(np.abs(values - (-1.0 if doubled else 1.0)))].real
    row = np.append(vector / np.linalg.norm(vector), 0.0)
    orbits = _Orbits(Family(orbit.flow, name), orbit.period * (2 if doubled else 1), span, _TOLERANCE)
    away = within("size", size, _SHORTEST, 1.0, closed="both") * row
    guess = np.append(orbit.coordinates, special_point.value / span) + away
    return orbits.orbit(orbits.correct(guess, row, row))
