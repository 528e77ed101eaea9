"""Bifurcation curves: folds, flips, Neimark-Sacker points and grazing of periodic orbits continued in two parameters.

With the return map P^m(x; lambda, mu) and its derivative J, a curve solves P^m(x) = x and g(x, lambda, mu) = 0.  At a
fold (flip) J - I (J + I) is singular; g then is the last unknown of the system bordered by two vectors b and c,

    [J -/+ I  b] [v]   [0]
    [  c^T    0] [g] = [1],

which is zero where the matrix is singular, and smooth (Govaerts, Numerical Methods for Bifurcations of Dynamical
Equilibria, SIAM, 2000).  At a Neimark-Sacker point g = |mu|^2 - 1 of the pair nearest to the unit circle.  A grazing orbit
touches a tip at zero relative velocity: g is the gap at that turning point (di Bernardo, Budd, Champneys and Kowalczyk,
Piecewise-smooth Dynamical Systems, Springer, 2008).

At points of codimension two, with the critical vectors J v = sigma v and w J = sigma w, w v = 1, and the derivatives B and C of
the map (Kuznetsov, Elements of Applied Bifurcation Theory, Springer, 2004): w v = 0 before that scaling at the resonances 1:1 (of
a fold) and 1:2 (of a flip); w C(v, v, v)/6 + w B(v, (I - J)^-1 B(v, v))/2 = 0 at a generalized flip; the angle of the pair is
2 pi/3 and pi/2 at the resonances 1:3 and 1:4 of a Neimark-Sacker curve.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from snapbeam.dynamics.branches import SpecialPoint
from snapbeam.dynamics.flow import AdvancedStates, Flow, Stroboscope, dimensionless, fixed_parameters
from snapbeam.dynamics.periodic_orbits import (
    Family,
    OrbitNotFoundError,
    Return,
    jacobian,
    newton,
    orbit_tolerance,
    penetrations,
    turning_points,
)
from snapbeam.model.contact.hertz import HertzContact
from snapbeam.model.parameters import ratio_of
from snapbeam.model.quantity import numbered, split_name
from snapbeam.util.diagnostics import counting
from snapbeam.util.singular_values import pinv, svd
from snapbeam.util.validation import InputError, checked, instance, integer, interval, shown, within

if TYPE_CHECKING:
    import xarray as xr

_Array = NDArray[np.float64]
CURVES = ("fold", "flip", "Neimark-Sacker", "grazing")
_TOLERANCE = 1e-9
_SHORTEST, _LONGEST = 1e-6, 1.0
_DIFFERENCE = 1e-5
"""Step of differences, in units of the well's amplitude and of the ranges of the parameters."""
_EASIER = (1.0, 30.0, 1000.0)
"""Factors of the tolerance that are tried one after the other."""
_ITERATIONS = 25
_EASY, _HARD = 5, 10
_HALVINGS = 40
_FINE = 1e-5
"""Relative error of tangents at level "reference"."""
_NORMAL_FORM = 1e-3
"""Step of the differences of second and third order, in units of the well's amplitude."""
_WITHOUT_FORCE = 1e-30
"""Stiffness, N/m^1.5, of a contact that is only recorded."""
_ROOM = 1e-6
"""Gap of a grazing orbit with other impacts under Newton's law, over b: beyond the tip there is no such orbit."""


class _Plane(Family):
    """A flow over two parameters that differ between runs."""

    def __init__(self, flow: Flow, names: tuple[str, str]) -> None:
        super().__init__(flow)
        self.names = names

    def advance(
        self, x: _Array, periods: int, value: Any = None, tangents: _Array | None = None
    ) -> AdvancedStates:
        """Take states some periods on, at values of the two parameters, shape (2,) or (runs, 2)."""
        values = np.broadcast_to(value, (len(x), 2))
        points = {name: np.ascontiguousarray(values[:, k]) for k, name in enumerate(self.names)}
        return self.flow.advance(x, periods, tangents=tangents, points=points)


class _CurvePoint(NamedTuple):
    """One point of a curve."""

    y: _Array
    """State, and the parameters over their ranges."""
    tangent: _Array
    came: Return
    table: _Array
    """Derivative of the equations, shape (d + 1, d + 2)."""
    iterations: int
    residual: float


class _Curve:
    """The equations of one curve."""

    def __init__(self, plane: _Plane, kind: str, period: int, spans: _Array, tolerance: float) -> None:
        self.plane, self.kind, self.period = plane, kind, period
        self.spans, self.tolerance = spans, tolerance
        flow = plane.flow
        rigid = isinstance(flow, Stroboscope) and any(each.law.impulsive for each in flow.system.contacts)
        self.room = _ROOM if kind == "grazing" and rigid else 0.0
        # no difference may reach across the gap that is kept
        self.difference = 0.1 * _ROOM if self.room else _DIFFERENCE
        self.borders: tuple[_Array, _Array] | None = None
        self._approaches: dict[bytes, tuple[float, int, float]] = {}
        """The last one, by its point."""

    def came(self, y: _Array) -> Return:
        """The return map and its derivative by the state."""
        return jacobian(self.plane, y[:-2], self.period, y[-2:] * self.spans)  # type: ignore[arg-type]

    def border(self, came: Return) -> None:
        """Take the singular vectors at a point of the curve as borders: the bordered matrix is regular nearby."""
        if self.kind in ("fold", "flip"):
            left, _, right = svd(self._singular(came))
            self.borders = left[:, -1], right[-1]

    def _singular(self, came: Return) -> _Array:
        sign = 1.0 if self.kind == "fold" else -1.0
        table: _Array = came.jacobian - sign * np.eye(len(came.x))
        return table

    def null_vectors(self, came: Return) -> tuple[_Array, _Array, float]:
        """Right and left vector of the bordered systems, which are critical ones on the curve, and g."""
        assert self.borders is not None
        size = len(came.x)
        table = np.zeros((size + 1, size + 1))
        table[:size, :size], table[:size, size], table[size, :size] = self._singular(came), *self.borders
        one = np.append(np.zeros(size), 1.0)
        right, left = np.linalg.solve(table, one), np.linalg.solve(table.T, one)
        return right[:-1], left[:-1], float(right[-1])

    def test(self, y: _Array, came: Return) -> float:
        """The function that is zero on the curve."""
        if self.kind == "grazing":
            return self._approach(y)[2]
        return _pair(came)[0] if self.kind == "Neimark-Sacker" else self.null_vectors(came)[2]

    def _approach(self, y: _Array) -> tuple[float, int, float]:
        """Instant (s), contact and gap over b, less the room to keep, of the turning point nearest to contact."""
        known = self._approaches.get(y.tobytes())
        if known is not None:
            return known
        turns = turning_points(self._stroboscope(y), y[:-2], self.period)
        if not turns.depth.size or not np.isfinite(turns.depth).all():
            raise OrbitNotFoundError("no gap turns back")
        at = int(np.argmin(np.abs(turns.depth)))
        found = float(turns.time[at]), int(turns.contact[at]), -float(turns.depth[at]) - self.room
        self._approaches = {y.tobytes(): found}
        return found

    def _slope_of_test(self, y: _Array, moves: _Array, beside: list[Return]) -> _Array:
        """Derivative of the test function by state and parameters, from the return map at y + moves and y - moves."""
        if self.kind != "grazing":
            tests = [
                self.test(*each) for each in zip(np.concatenate([y + moves, y - moves]), beside, strict=True)
            ]
        else:
            # the instant of a turning point changes the gap in second order only
            time, contact, _ = self._approach(y)
            tests = [
                -penetrations(self._stroboscope(each), each[:-2], self.period, np.array([time]))[0, contact]
                for each in np.concatenate([y + moves, y - moves])
            ]
        above, below = np.array(tests).reshape(2, -1)
        slope: _Array = (above - below) / (2.0 * self.difference)
        return slope

    def _stroboscope(self, y: _Array) -> Stroboscope:
        flow = self.at(y)
        assert isinstance(flow, Stroboscope)
        return flow

    def equations(self, y: _Array) -> tuple[_Array, Return]:
        """Residual of the orbit and of the condition, shape (d + 1,)."""
        came = self.came(y)
        return np.append(came.x - y[:-2], self.test(y, came)), came

    def derivative(self, y: _Array) -> tuple[_Array, Return, _Array]:
        """Residual, return map and the derivative of the residual, shape (d + 1, d + 2)."""
        size = y.size - 2
        moves = self.difference * np.eye(size + 2)
        came, *beside = self._all(np.concatenate([y[None], y + moves, y - moves]))
        table = np.empty((size + 1, size + 2))
        table[:size, :size] = came.jacobian - np.eye(size)
        for k in (size, size + 1):
            table[:size, k] = (beside[k].x - beside[k + size + 2].x) / (2.0 * self.difference)
        table[size] = self._slope_of_test(y, moves, beside)
        return np.append(came.x - y[:-2], self.test(y, came)), came, table

    def _all(self, y: _Array) -> list[Return]:
        """The return map and its derivative at several states and values at once."""
        if not self.plane.flow.smooth:
            return [self.came(each) for each in y]
        runs, size = len(y), y.shape[1] - 2
        tangents = np.tile(np.eye(size), (runs, 1, 1))
        advanced = self.plane.advance(y[:, :-2], self.period, y[:, -2:] * self.spans, tangents)
        assert advanced.tangents is not None
        impacts = advanced.statistics.get("impacts", np.full(runs, -1))
        return [
            Return(x, moved.T, int(hits))
            for x, moved, hits in zip(advanced.states, advanced.tangents, impacts, strict=True)
        ]

    def correct(self, guess: _Array, row: _Array, before: _Array, known: _Array | None = None) -> _CurvePoint:
        """The point of the curve on the plane through *guess* across *row*, as well as its residual allows.

        Raises
        ------
        OrbitNotFoundError
        """

        def residual(y: _Array) -> _Array:
            return np.append(self.equations(y)[0], row @ (y - guess))

        def derivative(y: _Array) -> tuple[_Array, _Array]:
            found, _, table = self.derivative(y)
            return np.append(found, row @ (y - guess)), np.vstack([table, row])

        first = None if known is None else np.vstack([known, row])
        for easier in _EASIER:
            try:
                shot = newton(residual, derivative, guess, easier * self.tolerance, _ITERATIONS, first)
                break
            except OrbitNotFoundError:
                # light impacts make the multipliers rough; what is left counts as error
                if easier == _EASIER[-1]:
                    raise
                first = None
        _, came, table = self.derivative(shot.x)
        if not np.isfinite(table).all():
            raise OrbitNotFoundError("a run beside the orbit failed")
        return _CurvePoint(shot.x, _tangent(table, before), came, table, shot.iterations, shot.residual)

    def at(self, y: _Array) -> Flow:
        """The flow at the parameters of a point."""
        values = dict(zip(self.plane.names, (y[-2:] * self.spans).tolist(), strict=True))
        flow: Flow = self.plane.flow
        if isinstance(flow, Stroboscope):
            return flow.changed(values)
        for name, value in values.items():
            flow = flow.neighbour(name, value)
        return flow

    def state(self, point: _CurvePoint, flow: Flow) -> _Array:
        """The state of a point at the phase at which another flow takes states."""
        if not isinstance(flow, Stroboscope) or flow is self.plane.flow:
            return point.y[:-2]
        here = self.at(point.y)
        assert isinstance(here, Stroboscope)
        return here.carried(point.y[:-2], flow.striker_phase)

    def between_contacts(self, point: _CurvePoint) -> tuple[_Curve, _CurvePoint]:
        """The point at the phase farthest from contacts, if one is near the phase of the flow; itself otherwise.

        Raises
        ------
        OrbitNotFoundError
        """
        flow, names = self.plane.flow, self.plane.names
        if (
            not isinstance(flow, Stroboscope)
            or not flow.jumps
            or any(flow.system.parameter(name).name.endswith(".phase") for name in names)
        ):
            return self, point
        here = self.at(point.y)
        assert isinstance(here, Stroboscope)
        phase = here.phase_between_contacts(point.y[:-2], self.period)
        if phase is None:
            return self, point
        plane = _Plane(Stroboscope(flow.system, flow.integration, phase), names)
        moved = _Curve(plane, self.kind, self.period, self.spans, self.tolerance)
        y = np.append(self.state(point, plane.flow), point.y[-2:])
        moved.border(moved.came(y))
        table = moved.derivative(y)[2]
        along = _tangent(table, np.append(np.zeros(y.size - 2), point.tangent[-2:]))
        return moved, moved.correct(y, along, along, table)

    def error(self, point: _CurvePoint, relative: float) -> _Array:
        """Uncertainty of the parameters from the residual and the error of the map's derivative."""
        size = point.y.size - 2
        steep = float(np.abs(point.came.jacobian).sum())
        # a gap follows from the run itself, a multiplier from the derivative of the map
        uncertain = self.room if self.kind == "grazing" else relative * steep
        off = np.append(np.full(size, point.residual), uncertain + point.residual)
        inverse = pinv(point.table)[size:]
        return np.asarray(np.abs(inverse) @ off * self.spans)


def _without_contact_force(grazing: SpecialPoint, names: tuple[str, str]) -> Flow:
    """The flow of a grazing orbit, with contacts that exert no force where the orbit has no other impact.

    Such an orbit is the one without contact on both sides of the curve, and the curve the same under every law.
    """
    orbit = grazing.orbit
    flow = orbit.flow
    if not isinstance(flow, Stroboscope):
        raise InputError(
            f"special_point = {grazing!r}: must be of a System, since the gap of a map is not known"
        )
    depth, summary = turning_points(flow, orbit.coordinates, orbit.period).depth, orbit.contact_summary
    # the turning point that grazes is free, or it is in an impact, on whichever side of the gap rounding puts it
    touches = bool(depth.size) and not np.isclose(summary.clearance, np.abs(depth).min(), rtol=1e-2, atol=0.0)
    if not depth.size or summary.impacts > int(touches):
        return flow
    for name in names:
        section, field = split_name(flow.system.parameter(name).name)
        kind, number = numbered(section)
        if kind == "contact" and field in flow.system.contacts[number - 1].law.numbers_type()._fields:
            raise InputError(
                f"names = {shown(names)}: {name} does not change where an orbit without other impacts grazes; choose another parameter"
            )
    recorded = [replace(each, law=HertzContact(_WITHOUT_FORCE)) for each in flow.system.contacts]
    return Stroboscope(flow.system.replace(contacts=recorded), flow.integration, flow.phase)


_Seen = tuple[_Curve, _CurvePoint]
"""A point, and the curve at whose phase of observation it is seen."""


def _pair(came: Return) -> tuple[float, float]:
    """|mu|^2 - 1 of the complex pair nearest to the unit circle, and the cosine of its angle."""
    values = np.linalg.eigvals(came.jacobian)
    pairs = values[values.imag > 1e-9]
    if not pairs.size:
        raise OrbitNotFoundError("the pair of multipliers has become real, as at the resonances 1:1 and 1:2")
    pair = pairs[np.argmin(np.abs(np.abs(pairs) - 1.0))]
    return float(np.abs(pair) ** 2 - 1.0), float(pair.real / np.abs(pair))


def _tangent(table: _Array, before: _Array) -> _Array:
    """Unit tangent of the curve, in the direction of *before*."""
    found: _Array = svd(table)[2][-1]
    return found if found @ before >= 0.0 else -found


# Points of codimension two between two points of a curve.


def _monitors(curve: _Curve, one: _CurvePoint, point: _CurvePoint) -> dict[str, float]:
    """Functions that change their sign at points of codimension two, from the point *one* on."""
    found, came = dict[str, float](), point.came
    signs = {
        kind: float(np.linalg.slogdet(came.jacobian - sign * np.eye(len(came.x)))[0])
        for kind, sign in _SIGNS.items()
    }
    if curve.kind == "grazing":
        return {f"grazing {kind}": sign for kind, sign in signs.items()}
    if curve.kind == "Neimark-Sacker":
        cosine = _pair(came)[1]
        found |= {"resonance 1:3": cosine + 0.5, "resonance 1:4": cosine}
    else:
        right, left, _ = curve.null_vectors(came)
        found["resonance 1:1" if curve.kind == "fold" else "resonance 1:2"] = float(left @ right)
        found["fold-flip"] = signs["flip" if curve.kind == "fold" else "fold"]
    if curve.kind == "fold":
        # at a cusp the curve goes on in the states and turns back in the plane of the parameters
        found["cusp"] = float(point.tangent[-2:] @ one.tangent[-2:])
    elif curve.kind == "flip":
        found["generalized flip"] = _flip_coefficient(curve, point)
    if came.impacts >= 0:
        found[f"grazing {curve.kind}"] = 1.0 if came.impacts == one.came.impacts else -1.0
    return found


_SIGNS = {"fold": 1.0, "flip": -1.0}
"""Critical multipliers."""


def _flip_coefficient(curve: _Curve, point: _CurvePoint) -> float:
    """The cubic coefficient of the normal form of a flip; NaN where the states beside the orbit have other impacts.

    A doubled orbit is stable if it is positive.
    """
    right, left, _ = curve.null_vectors(point.came)
    x, v, w = point.y[:-2], right / np.linalg.norm(right), left * np.linalg.norm(right) / (left @ right)

    def images(directions: _Array) -> _Array:
        values = np.broadcast_to(point.y[-2:] * curve.spans, (len(directions), 2))
        came = curve.plane.advance(x + _NORMAL_FORM * directions, curve.period, values)
        same = np.asarray(came.statistics.get("impacts", np.zeros(1))).max(initial=0) == max(
            point.came.impacts, 0
        )
        return came.states if same else np.full_like(came.states, np.nan)

    twice, above, below, beyond = images(np.array([2.0, 1.0, -1.0, -2.0])[:, None] * v)
    here = images(np.zeros((1, x.size)))[0]
    bend = (above - 2.0 * here + below) / _NORMAL_FORM**2
    third = (twice - 2.0 * above + 2.0 * below - beyond) / (2.0 * _NORMAL_FORM**3)
    h = np.linalg.solve(np.eye(x.size) - point.came.jacobian, bend)
    size = max(float(np.linalg.norm(h)), 1e-300)
    both = images(np.array([v + h / size, -v - h / size, v - h / size, h / size - v]))
    mixed = size * (both[0] + both[1] - both[2] - both[3]) / (4.0 * _NORMAL_FORM**2)
    return float(w @ third / 6.0 + w @ mixed / 2.0)


def _between(curve: _Curve, one: _CurvePoint, other: _CurvePoint) -> list[tuple[str, _CurvePoint]]:
    """Points of codimension two between two points, by halving."""
    found = []
    ahead = _monitors(curve, one, other)
    for kind, begun in _monitors(curve, one, one).items():
        if not begun * ahead[kind] < 0.0:
            continue
        low, high, nearest = 0.0, 1.0, other
        along = other.y - one.y
        row = along / np.linalg.norm(along)
        for _ in range(_HALVINGS):
            part = 0.5 * (low + high)
            try:
                nearest = curve.correct(one.y + part * along, row, one.tangent, one.table)
            except OrbitNotFoundError:
                break
            if begun * _monitors(curve, one, nearest)[kind] > 0.0:
                low = part
            else:
                high = part
            if (high - low) * np.linalg.norm(along) < curve.tolerance:
                break
        found.append((kind, nearest))
    return found


@checked
def bifurcation_curve(
    special_point: SpecialPoint,
    names: tuple[str, str],
    bounds: tuple[tuple[float, float], tuple[float, float]],
    *,
    max_points: int = 200,
    step: float = 0.01,
    max_step: float = 0.03,
    tolerance: float = _TOLERANCE,
    progress: Callable[[int, int], object] | bool | None = None,
) -> xr.Dataset:
    """Follow a fold, flip, Neimark-Sacker point or grazing of periodic orbits in two parameters, to both sides.

    Points of codimension two are located on the way: cusps, fold-flips (multipliers +1 and -1), generalized flips, the
    resonances 1:1 to 1:4, and grazing at a bifurcation.  Where the grazing approach is the only contact, its force is left out on
    the grazing curve, so that the orbit is defined on both sides of it.  With other impacts under Newton's law, the orbit on a
    grazing curve keeps a gap of 1e-6 b.

    Parameters
    ----------
    special_point : SpecialPoint
        Of a branch (:func:`continuation`).
    names : (str, str)
        Two parameters that can differ between runs, by dotted name or the name in datasets.
    bounds : pair of pairs of float
        Minimum and maximum value of each.
    max_points : int
        Points at most, to either side.
    step, max_step : float
        First and maximum distance between points, in units of the well's amplitude for the state and of the range
        for each parameter; between 1e-6 and 1.
    tolerance : float
        Of orbit and condition, as in :func:`periodic_orbit`; up to 1,000 times as much where light impacts make the
        multipliers rough, which the errors then contain.
    progress : callable, optional
        Called as ``progress(done, total)`` with points; True writes a line to standard error.

    Returns
    -------
    xarray.Dataset
        Over ``point``: both parameters, their errors at these steps, the state, the multipliers, impacts, residual.  Over
        ``special_point``: kind and parameters of points of codimension two.  On a grazing curve the attribute ``kept_gap`` is the gap
        of its orbits over b, and ``contact_force`` tells whether they have one; without it the multipliers are those of the
        motion without contact.

    Raises
    ------
    InputError
        If the type of the point is not supported, or a parameter, its bounds or a step is out of range.
    OrbitNotFoundError
        If not even the first point is found with both parameters.

    Examples
    --------
    >>> import snapbeam as sb
    >>> from snapbeam import paper
    >>> model = sb.ReducedModel.from_beam(paper.BEAM, modes=1, damping_ratio=0.05)
    >>> shaker = sb.Shaker(frequency_ratio=1.6, velocity_amplitude=0.03)
    >>> system = sb.System(model, contacts=[sb.Contact(paper.CONTACT, shaker)])
    >>> orbit = sb.dynamics.periodic_orbit(system, transient=100)
    >>> branch = sb.dynamics.continuation(orbit, "velocity_amplitude", (0.02, 0.3), max_points=12)
    >>> curve = sb.dynamics.bifurcation_curve(
    ...     branch.special_points[0],
    ...     ("frequency_ratio", "velocity_amplitude"),
    ...     ((1.5, 1.7), (0.02, 0.1)),
    ... )
    >>> curve.attrs["kind"]
    'fold'
    """
    instance("special_point", special_point, SpecialPoint, "a special point of a branch")
    if special_point.kind not in CURVES:
        raise InputError(f"special_point = {special_point!r}: must be one of {', '.join(CURVES)}")
    flow = special_point.orbit.flow
    if special_point.kind == "grazing":
        flow = _without_contact_force(special_point, names)
    own = list(names)
    if isinstance(flow, Stroboscope):
        rows = [flow.system.parameter(name) for name in names]
        own = [ratio_of(row.name) for row in rows]
        for row in rows:
            if not row.is_run:
                raise InputError(f"names = {shown(names)}: {row.name} cannot differ between runs")
    if len(names) != 2 or len(set(own)) < 2:
        raise InputError(f"names = {shown(names)}: must be two different parameters")
    if len(bounds) != 2:
        raise InputError(f"bounds = {shown(bounds)}: must be a minimum and a maximum of each parameter")
    limits = np.array([interval(f"bounds[{k}]", pair) for k, pair in enumerate(bounds)])
    begun = np.array([flow.value(name) for name in names])
    for k, name in enumerate(names):
        within(name, float(begun[k]), *limits[k], closed="both")
    count = integer("max_points", max_points, 2, 10**6)
    length, longest = (
        within(words, value, _SHORTEST, _LONGEST, closed="both")
        for words, value in (("step", step), ("max_step", max_step))
    )
    spans = limits[:, 1] - limits[:, 0]
    curve = _Curve(
        _Plane(flow, (names[0], names[1])),
        special_point.kind,
        special_point.orbit.period,
        spans,
        orbit_tolerance(tolerance),
    )
    y = np.append(special_point.orbit.coordinates, begun / spans)
    curve.border(curve.came(y))
    # the special point was located with other steps of differences: once more, across the curve
    table = curve.derivative(y)[2]
    first = curve.correct(y, _tangent(table, np.ones(y.size)), np.ones(y.size), table)
    report = counting(progress, "bifurcation curve", "points")
    sides, special, ends = [], [], []
    for sign in (-1.0, 1.0):
        start = first._replace(tangent=sign * first.tangent)
        points, events, end = _follow(
            curve, start, limits / spans[:, None], count, min(length, longest), longest, report
        )
        sides.append(points)
        special += events
        ends.append(end)
    points = [*reversed(sides[0][1:]), *sides[1]]
    return _dataset(curve, names, points, special, ends, flow)


def _follow(
    curve: _Curve,
    first: _CurvePoint,
    limits: _Array,
    max_points: int,
    length: float,
    longest: float,
    progress: Callable[[int, int], object] | None,
) -> tuple[list[_Seen], list[tuple[str, _CurvePoint]], str]:
    points, events = [(curve, first)], list[tuple[str, _CurvePoint]]()
    while len(points) < max_points:
        try:
            points[-1] = curve.between_contacts(points[-1][1])
        except (OrbitNotFoundError, np.linalg.LinAlgError):
            pass  # the next point is sought at the phase of this one
        curve, last = points[-1]
        guess, row, over = last.y + length * last.tangent, last.tangent, False
        shares = [
            (value - last.y[k - 2]) / (length * last.tangent[k - 2])
            for k in range(2)
            for value in limits[k]
            if (guess[k - 2] - value) * (last.y[k - 2] - value) < 0.0
        ]
        if shares:
            # the last point stands at the limit itself
            over, guess = True, last.y + min(shares) * length * last.tangent
            k = int(np.argmin(np.abs(guess[-2:, None] - limits).min(axis=1)))
            row = np.zeros(guess.size)
            row[k - 2] = 1.0
        try:
            curve.border(last.came)
            point = curve.correct(guess, row, last.tangent, last.table if points[1:] else None)
            turned = float(point.tangent @ last.tangent)
            if np.linalg.norm(point.y - last.y) > 3.0 * length or turned < 0.5:
                raise OrbitNotFoundError("the next point is too far away, or on another curve")
            if not over and not ((limits[:, 0] <= point.y[-2:]) & (point.y[-2:] <= limits[:, 1])).all():
                raise OrbitNotFoundError("the corrected point is beyond the limits")
        except (OrbitNotFoundError, np.linalg.LinAlgError) as error:
            length *= 0.5
            if length < _SHORTEST * longest:
                return points, events, f"no further point: {error}"
            continue
        events += _between(curve, last, point)
        points.append((curve, point))
        if progress is not None:
            progress(len(points), max_points)
        if over:
            return points, events, "limit of a parameter"
        if (
            len(points) > 8
            and np.linalg.norm(point.y[-2:] - first.y[-2:]) < 0.75 * length
            and np.linalg.norm(point.y[:-2] - points[0][0].state(first, curve.plane.flow)) < 0.75 * length
            and point.tangent[-2:] @ first.tangent[-2:] > 0.0
        ):
            return points, events, "closed"
        if point.iterations <= _EASY and turned > 0.95:
            length = min(1.4 * length, longest)
        elif point.iterations >= _HARD or turned < 0.8:
            length *= 0.6
    return points, events, f"{max_points} points, the maximum (max_points)"


def _dataset(
    curve: _Curve,
    names: tuple[str, str],
    seen: list[_Seen],
    special: list[tuple[str, _CurvePoint]],
    ends: list[str],
    flow: Flow,
) -> xr.Dataset:
    from snapbeam.util.datasets import xr

    points = [point for _, point in seen]
    relative = _FINE if isinstance(flow, Stroboscope) else 1e-9
    errors = np.array([curve.error(point, relative) for point in points])
    values = np.array([point.y[-2:] for point in points]) * curve.spans
    places = np.array([point.y[-2:] for _, point in special]).reshape(-1, 2) * curve.spans
    multipliers = np.array([np.linalg.eigvals(point.came.jacobian) for point in points])
    coordinates = getattr(flow, "names", tuple(f"x[{i + 1}]" for i in range(points[0].y.size - 2)))
    variables: dict[str, Any] = {
        "state": (
            ("point", "coordinate"),
            np.array([by.state(point, flow) for by, point in seen]),
            dimensionless("state of the orbit at the phase of observation of the special point"),
        ),
        "multiplier_real": (("point", "multiplier"), multipliers.real, dimensionless("Floquet multiplier")),
        "multiplier_imag": (("point", "multiplier"), multipliers.imag, dimensionless("its imaginary part")),
        "impacts": (
            "point",
            np.array([p.came.impacts for p in points], np.int32),
            dimensionless("impacts within the period"),
        ),
        "residual": (
            "point",
            np.array([point.residual for point in points]),
            dimensionless("of the return and of the condition"),
        ),
        "special_point_kind": (
            "special_point",
            np.array([kind for kind, _ in special], dtype=str),
            {"long_name": "kind of the point of codimension two"},
        ),
    }
    coords: dict[str, Any] = {"coordinate": list(coordinates)}
    shorts = []
    for k, name in enumerate(names):
        short, labels = name, {"units": "1", "long_name": name}
        if isinstance(flow, Stroboscope):
            row = flow.system.parameter(name)
            short, labels = row.short, {"units": row.quantity.unit, "long_name": row.quantity.long_name}
        shorts.append(short)
        coords[short] = ("point", values[:, k], labels | {"parameter": name})
        off = labels | {"long_name": f"by how much it may be off at these steps: {labels['long_name']}"}
        variables[f"{short}_error"] = ("point", errors[:, k], off)
        variables[f"special_point_{short}"] = ("special_point", places[:, k], labels)
    attrs = {
        **fixed_parameters(flow, *shorts),
        "title": f"bifurcation curve of periodic orbits: {curve.kind}",
        "kind": curve.kind,
        "parameters": shorts,
        "period": curve.period,
        "termination_reason": "; ".join(ends),
    }
    if curve.kind == "grazing":
        assert isinstance(flow, Stroboscope)
        left_out = flow.system.contacts[0].law == HertzContact(_WITHOUT_FORCE)
        attrs |= {"kept_gap": curve.room, "contact_force": "left out" if left_out else "included"}
    return xr.Dataset(variables, coords, attrs)
