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
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from snapbeam.dynamics.approaches import penetrations, turning_points
from snapbeam.dynamics.arclength import OrbitEquations, Point, distances, follow, tangent_of
from snapbeam.dynamics.branches import SpecialPoint
from snapbeam.dynamics.flow import Flow
from snapbeam.dynamics.results import multiplier_rows, of_flow, parameter_labels, reported
from snapbeam.dynamics.shooting import Family, OrbitNotFoundError, Return, impacts_of, jacobian, orbit_tolerance
from snapbeam.dynamics.stroboscope import Stroboscope
from snapbeam.model.contact.hertz import HertzContact
from snapbeam.model.parameters import ratio_of
from snapbeam.model.quantity import numbered, split_name
from snapbeam.util.singular_values import pinv, svd
from snapbeam.util.validation import InputError, checked, instance, integer, interval, shown, within

if TYPE_CHECKING:
    import xarray as xr

_Array = NDArray[np.float64]
CURVES = ("fold", "flip", "Neimark-Sacker", "grazing")
_TOLERANCE = 1e-9
_SHORTEST = 1e-6
"""Minimum distance between points."""
_DIFFERENCE = 1e-5
"""Step of differences, in units of the well's amplitude and of the ranges of the parameters."""
_HALVINGS = 40
_FINE = 1e-5
"""Relative error of tangents at level "reference"."""
_NORMAL_FORM = 1e-3
"""Step of the differences of second and third order, in units of the well's amplitude."""
_WITHOUT_FORCE = 1e-30
"""Stiffness, N/m^1.5, of a contact that is only recorded."""
_ROOM = 1e-6
"""Gap of a grazing orbit with other impacts under Newton's law, over b: beyond the tip there is no such orbit."""


@dataclass(eq=False)
class _Curve(OrbitEquations):
    """Equations of the orbits over two parameters that have a special point."""

    iterations, easy, hard = 25, 5, 10
    easier = (1.0, 30.0, 1000.0)

    def __post_init__(self) -> None:
        flow = self.family.flow
        rigid = isinstance(flow, Stroboscope) and any(each.law.impulsive for each in flow.system.contacts)
        self.room = _ROOM if self.kind == "grazing" and rigid else 0.0
        # no difference may reach across the gap that is kept
        self.difference = 0.1 * _ROOM if self.room else _DIFFERENCE
        self.borders: tuple[_Array, _Array] | None = None
        self._approaches: dict[bytes, tuple[float, int, float]] = {}
        """The last one, by its point."""

    def came(self, y: _Array) -> Return:
        """The return map and its derivative by the state."""
        return jacobian(self.family, y[:-2], self.period, self.values(y))

    def begin(self, y: _Array) -> None:
        """Take the singular vectors at a point of the curve as borders."""
        self.border(self.came(y))

    def prepare(self, last: Point, is_first: bool) -> _Array | None:
        """The derivative at the last point, with whose borders the next one is sought."""
        self.border(last.came)
        return None if is_first else last.table

    def border(self, came: Return) -> None:
        """Take the singular vectors at a point of the curve as borders: the bordered matrix is regular nearby."""
        if self.kind in ("fold", "flip"):
            left, _, right = svd(self._singular(came))
            self.borders = left[:, -1], right[-1]

    def _singular(self, came: Return) -> _Array:
        sign = 1.0 if self.kind == "fold" else -1.0
        return np.asarray(came.jacobian - sign * np.eye(len(came.x)))

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
        turns = turning_points(self._seen(y), y[:-2], self.period)
        if not turns.depth.size or not np.isfinite(turns.depth).all():
            raise OrbitNotFoundError("no gap turns back")
        at = int(np.argmin(np.abs(turns.depth)))
        found = float(turns.time[at]), int(turns.contact[at]), -float(turns.depth[at]) - self.room
        self._approaches = {y.tobytes(): found}
        return found

    def _slope_of_test(self, y: _Array, moves: _Array, came: Return, beside: list[Return]) -> _Array:
        """Derivative of the test function by state and parameters, from the return map at y, y + moves and y - moves."""
        places = np.concatenate([y[None], y + moves, y - moves])
        if self.kind != "grazing":
            tests = [self.test(*each) for each in zip(places, [came, *beside], strict=True)]
        else:
            # the instant of a turning point changes the gap in second order only
            time, contact, _ = self._approach(y)
            tests = [
                -penetrations(self._seen(each), each[:-2], self.period, np.array([time]))[0, contact] for each in places
            ]
        sides = (np.array(tests[1:]) - tests[0]).reshape(2, -1) * [[1.0], [-1.0]] / self.difference
        # across a touch the motion is another one: the derivative is that of the side without it
        alike = np.reshape([each.impacts == came.impacts for each in beside], (2, -1)) | (self.kind != "grazing")
        weights = np.where(alike.any(axis=0), alike, True)
        return np.asarray((sides * weights).sum(axis=0) / weights.sum(axis=0))

    def _seen(self, y: _Array) -> Stroboscope:
        flow = self.flow_at(y)
        assert isinstance(flow, Stroboscope)
        return flow

    def residual(self, y: _Array) -> _Array:
        """Residual of the orbit and of the condition, shape (d + 1,)."""
        came = self.came(y)
        return np.append(came.x - y[:-2], self.test(y, came))

    def derivative(self, y: _Array) -> tuple[_Array, Return, _Array]:
        """Residual, return map and the derivative of the residual, shape (d + 1, d + 2)."""
        size = y.size - 2
        moves = self.difference * np.eye(size + 2)
        came, *beside = self._all(np.concatenate([y[None], y + moves, y - moves]))
        table = np.empty((size + 1, size + 2))
        table[:size, :size] = came.jacobian - np.eye(size)
        slope = self.family.slope(y[:-2], self.period, self.values(y), self.difference * self.spans)
        table[:size, size:] = slope * self.spans
        table[size] = self._slope_of_test(y, moves, came, beside)
        return np.append(came.x - y[:-2], self.test(y, came)), came, table

    def _all(self, y: _Array) -> list[Return]:
        """The return map and its derivative at several states and values at once."""
        tangents = np.tile(np.eye(y.shape[1] - 2), (len(y), 1, 1))
        advanced = self.family.advance(y[:, :-2], self.period, self.values(y), tangents)
        assert advanced.tangents is not None
        rows = zip(advanced.states, advanced.tangents, impacts_of(advanced), strict=True)
        return [Return(x, moved.T, int(hits)) for x, moved, hits in rows]

    def events(self, last: Point, point: Point, number: int) -> list[tuple[str, Point]]:
        """Points of codimension two between two points, by halving."""
        ahead, found = _monitors(self, last, point), []
        for kind, begun in _monitors(self, last, last).items():
            if begun * ahead[kind] < 0.0:

                def is_before(spot: Point, kind: str = kind, begun: float = begun) -> bool:
                    return begun * _monitors(self, last, spot)[kind] > 0.0

                found.append((kind, self.halved(last, point, is_before, _HALVINGS, self.tolerance)[1]))
        return found

    def has_returned(self, point: Point, first: tuple[_Curve, Point], near: float) -> bool:
        """Return whether the curve has returned to its first point, in the same direction."""
        return bool(
            np.linalg.norm(point.y[-2:] - first[1].y[-2:]) < near
            and np.linalg.norm(self.state(point.y) - first[0].state(first[1].y, self.family.flow)) < near
            and point.tangent[-2:] @ first[1].tangent[-2:] > 0.0
        )

    def error(self, point: Point, relative: float) -> _Array:
        """Uncertainty of the parameters from the residual and the error of the map's derivative."""
        size = point.y.size - 2
        steep = float(np.abs(point.came.jacobian).sum())
        # a gap follows from the run itself, a multiplier from the derivative of the map
        uncertain = self.room if self.kind == "grazing" else relative * steep
        off = np.append(np.full(size, point.residual), uncertain + point.residual)
        inverse = pinv(point.table)[size:]
        return np.asarray(np.abs(inverse) @ off * self.spans)


def _without_contact_force(grazing: SpecialPoint, names: tuple[str, str]) -> Flow:
    """The flow of a grazing orbit, without contact forces if it has no other impact: the curve is that of every law."""
    orbit = grazing.orbit
    flow = orbit.flow
    if not isinstance(flow, Stroboscope):
        raise InputError(f"special_point = {grazing!r}: must be of a System, since the gap of a map is not known")
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
    return replace(flow, system=flow.system.replace(contacts=recorded))


def _pair(came: Return) -> tuple[float, float]:
    """|mu|^2 - 1 of the complex pair nearest to the unit circle, and the cosine of its angle."""
    values = np.linalg.eigvals(came.jacobian)
    pairs = values[values.imag > 1e-9]
    if not pairs.size:
        raise OrbitNotFoundError("the pair of multipliers has become real, as at the resonances 1:1 and 1:2")
    pair = pairs[np.argmin(np.abs(np.abs(pairs) - 1.0))]
    return float(np.abs(pair) ** 2 - 1.0), float(pair.real / np.abs(pair))


# Points of codimension two between two points of a curve.


def _monitors(curve: _Curve, one: Point, point: Point) -> dict[str, float]:
    """Functions that change their sign at points of codimension two, from the point *one* on."""
    found, came = dict[str, float](), point.came
    signs = {
        kind: float(np.linalg.slogdet(came.jacobian - sign * np.eye(len(came.x)))[0]) for kind, sign in _SIGNS.items()
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


def _flip_coefficient(curve: _Curve, point: Point) -> float:
    """Cubic coefficient of a flip, positive if the doubled orbit is stable; NaN if states nearby have other impacts."""
    right, left, _ = curve.null_vectors(point.came)
    x, v, w = point.y[:-2], right / np.linalg.norm(right), left * np.linalg.norm(right) / (left @ right)

    def images(directions: _Array) -> _Array:
        came = curve.family.advance(x + _NORMAL_FORM * directions, curve.period, curve.values(point.y))
        same = (impacts_of(came) == point.came.impacts).all()
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

    Points of codimension two are located: cusps, fold-flips (multipliers +1 and -1), generalized flips, the resonances
    1:1 to 1:4, and grazing at a bifurcation. If the grazing approach is the only contact, a grazing curve leaves its
    force out: the orbit exists on both sides. With other impacts under Newton's law the orbit keeps a gap of 1e-6 b.

    Parameters
    ----------
    special_point : SpecialPoint
        First point of the curve, of a branch (:func:`continuation`).
    names : (str, str)
        Two parameters that can differ between runs.
    bounds : pair of pairs of float
        Minimum and maximum value of each.
    max_points : int
        Maximum number of points to either side.
    step, max_step : float
        First and maximum distance between points, in units of the well's amplitude for the state and of the range for
        each parameter; between 1e-6 and 1.
    tolerance : float
        Tolerance, as in :func:`periodic_orbit`; up to 1,000 times as much where light impacts roughen multipliers.
    progress : callable or bool, optional
        Report of points, as in :func:`snapbeam.sweep`.

    Returns
    -------
    xarray.Dataset
        Variables over ``point``: both parameters, their errors, the state, the multipliers, impacts, residual. Over
        ``special_point``: kind and parameters of points of codimension two. On a grazing curve the attribute
        ``kept_gap`` is the gap over b; ``contact_force`` is "left out" if the multipliers are those without contact.

    Raises
    ------
    InputError
        If the type of the point is not supported, or a number is out of range.
    OrbitNotFoundError
        If the first point is not found with both parameters.

    See Also
    --------
    snapbeam.dynamics.continuation, snapbeam.plot.plot_bifurcation_curve

    Examples
    --------
    >>> import snapbeam as sb
    >>> system = sb.paper.struck_beam(frequency_ratio=1.6, velocity_amplitude=0.03, damping_ratio=0.05)
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
    step, max_step = distances(step, max_step, _SHORTEST)
    spans = limits[:, 1] - limits[:, 0]
    orbit, family = special_point.orbit, Family(flow, *names)
    curve = _Curve(family, orbit.period, spans, orbit_tolerance(tolerance), special_point.kind)
    y = np.append(orbit.coordinates, begun / spans)
    curve.begin(y)
    # the special point was located with other steps of differences: once more, across the curve
    table = curve.derivative(y)[2]
    first = curve.correct(y, tangent_of(table, np.ones(y.size)), np.ones(y.size), table)
    report = reported(progress, "bifurcation curve", "points")
    back, ahead = (
        follow(
            curve,
            first._replace(tangent=sign * first.tangent),
            limits=limits / spans[:, None],
            max_points=count,
            step=step,
            max_step=max_step,
            progress=report,
            what="point",
        )
        for sign in (-1.0, 1.0)
    )
    points = [*reversed(back.points[1:]), *ahead.points]
    return _dataset(curve, points, [*back.events, *ahead.events], f"{back.end}; {ahead.end}")


def _dataset(
    curve: _Curve, seen: list[tuple[_Curve, Point]], special: list[tuple[str, Point]], ends: str
) -> xr.Dataset:
    flow = curve.family.flow
    points = [point for _, point in seen]
    relative = _FINE if isinstance(flow, Stroboscope) else 1e-9
    errors = np.array([curve.error(point, relative) for point in points])
    values = np.array([curve.values(point.y) for point in points])
    places = np.reshape([curve.values(point.y) for _, point in special], (-1, 2))
    of_kind, kinds = {"long_name": "kind of the point of codimension two"}, [kind for kind, _ in special]
    multipliers = np.array([np.linalg.eigvals(point.came.jacobian) for point in points])
    states = np.array([by.state(point.y, flow) for by, point in seen])
    words = "state of the orbit at the phase of observation of the special point"
    variables = {"state": (("point", "coordinate"), states, words)} | multiplier_rows(multipliers, "point") | {
        "impacts": ("point", np.array([p.came.impacts for p in points], np.int32), "impacts within the period"),
        "residual": ("point", np.array([p.residual for p in points]), "of the return and of the condition"),
        "special_point_kind": ("special_point", np.array(kinds, dtype=str), of_kind),
    }  # fmt: skip
    coords, shorts = {}, []
    for k, name in enumerate(curve.family.names):
        short, labels = parameter_labels(flow, name)
        shorts.append(short)
        coords[short] = ("point", values[:, k], labels | {"parameter": name})
        off = labels | {"long_name": f"by how much it may be off at these steps: {labels['long_name']}"}
        variables[f"{short}_error"] = ("point", errors[:, k], off)
        variables[f"special_point_{short}"] = ("special_point", places[:, k], labels)
    attrs: dict[str, Any] = {
        "title": f"bifurcation curve of periodic orbits: {curve.kind}", "kind": curve.kind, "parameters": shorts,
        "period": curve.period, "termination_reason": ends,
    }  # fmt: skip
    if curve.kind == "grazing":
        assert isinstance(flow, Stroboscope)
        left_out = flow.system.contacts[0].law == HertzContact(_WITHOUT_FORCE)
        attrs |= {"kept_gap": curve.room, "contact_force": "left out" if left_out else "included"}
    return of_flow(flow, variables, attrs, coords, shorts)
