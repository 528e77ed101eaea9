"""Invariant manifolds of saddle orbits in the stroboscopic section, and the points where a stable and an unstable one cross.

A branch of the one-dimensional manifold of a saddle x* with the multiplier sigma and its eigenvector v is covered by the images of
one fundamental segment, x* + delta sigma^s v with 0 <= s < 1: the point of age k + s is P^k of it.  Points are inserted into
the segment wherever neighbours at that age are too far apart, or the curve turns too much between them (Hobson, J. Comput.
Phys. 104 (1993) 14).  The stable manifold is that of the inverse map: the motion backwards in time, or, of a system without
such a motion and of a map, what Newton's method finds along the curve.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from snapbeam.dynamics.flow import Flow
from snapbeam.dynamics.periodic_orbits import PeriodicOrbit, periodic_orbit
from snapbeam.dynamics.results import labelled, of_flow
from snapbeam.dynamics.shooting import OrbitNotFoundError
from snapbeam.dynamics.stroboscope import Stroboscope
from snapbeam.model.contact.restitution import INSTEAD_OF_RESTITUTION
from snapbeam.util.diagnostics import Diagnostic, sharing, tell
from snapbeam.util.validation import InputError, checked, choice, instance, integer, interval, positive, shown, within

if TYPE_CHECKING:
    import xarray as xr

_Array = NDArray[np.float64]
_BEGUN = 5
"""Points of a fundamental segment at first."""
_NEAR_SADDLE = 1e-5
"""Distance from the saddle at which the segment begins, in units of the well's amplitude: the curve bends with its square."""
_NEWTON = 10
_LONGEST = 0.25
"""Longest first step of Newton's method, in units of the well's amplitude."""
_SAME = 1e-11
"""Distance, in units of the well's amplitude, at which the image of an inverse image counts as met."""
_CLOSEST = 1e-3
"""Distance of neighbours, over the maximum one, below which the curve may turn by any angle."""
_POINTS = 20_000
"""Maximum number of points of a branch."""
_PARTS = 10
"""Parts of the chord between a point that is known and one whose inverse image is not found."""
_REACH = 6
"""Neighbours of a known point whose inverse images are sought from it."""
_MOST_PARTS = 16
"""Parts into which a chord is divided at once, at most."""
_FINEST = 1e-12
"""Difference of ages below which no point is inserted."""
_SHARE = 2**22
"""Pairs of segments that are compared at once."""


class _Clock(NamedTuple):
    """Time limit and progress of one branch, a part of a longer computation."""

    end: float
    """Time of the end, s, as of ``time.monotonic``."""
    report: Callable[[float], object] | None
    begun: float
    """Share of the computation that was done before the branch."""
    part: float
    """Share of the computation that the branch is."""

    @property
    def is_over(self) -> bool:
        """Return whether the time is over."""
        return time.monotonic() > self.end

    def tell(self, share: float) -> None:
        """Report a share of the branch."""
        if self.report is not None:
            self.report(self.begun + self.part * share)

    def half(self, number: int) -> _Clock:
        """The first (0) or second (1) half."""
        return self._replace(begun=self.begun + 0.5 * self.part * number, part=0.5 * self.part)


def _clock(max_seconds: float | None, progress: Callable[[float], object] | bool | None, what: str) -> _Clock:
    """A clock that begins now."""
    end = np.inf if max_seconds is None else time.monotonic() + positive("max_seconds", max_seconds)
    return _Clock(end, sharing(progress, what), 0.0, 1.0)


class _Resolution(NamedTuple):
    """Length and resolution of a branch."""

    length: float
    distance: float
    turn: float
    points: int


def _resolution(max_arclength: float, max_distance: float, max_turn: float, max_points: int) -> _Resolution:
    """The arguments of :func:`invariant_manifold`, checked."""
    return _Resolution(
        within("max_arclength", max_arclength, 0.0, 1e4, closed="right"),
        within("max_distance", max_distance, 1e-6, 1.0, closed="both"),
        within("max_turn", max_turn, 1e-3, 1.0, closed="both"),
        integer("max_points", max_points, 10, 10**6),
    )


class _Segment(NamedTuple):
    """The fundamental segment of one branch."""

    flow: Flow
    periods: int
    """Periods of the map that keeps the branch: twice those of the orbit for a negative multiplier."""
    saddle: _Array
    vector: _Array
    factor: float
    """Growth of the distance from the saddle per application of the map or of its inverse."""
    inverse: bool

    def begin(self, ages: _Array) -> _Array:
        """Points of the segment, at ages from 0 to 1."""
        return self.saddle + self.factor ** ages[:, None] * self.vector

    def image(self, states: _Array, near: _Array) -> _Array:
        """Images of states; under an inverse map without a flow by Newton's method from *near*; NaN where it fails."""
        backward = self.flow.inverse if self.inverse and isinstance(self.flow, Stroboscope) else None
        if not self.inverse or backward is not None:
            return (backward or self.flow).advance(states, self.periods).states
        x, left = near.copy(), np.arange(len(states))
        found, size = np.full_like(x, np.nan), np.full(len(states), np.inf)
        eye = np.eye(x.shape[1])
        for _ in range(_NEWTON):
            came = self.flow.advance(x[left], self.periods, tangents=np.tile(eye, (left.size, 1, 1)))
            assert came.tangents is not None
            apart, slopes = states[left] - came.states, came.tangents.transpose(0, 2, 1)
            now = np.abs(apart).max(axis=1)
            met = now < _SAME
            found[left[met]] = x[left[met]]
            # a step that brings the image no nearer leads away: those are sought later from nearer states
            going = ~met & (now < size[left]) & np.isfinite(slopes).all(axis=(1, 2))
            going[going] = np.linalg.matrix_rank(slopes[going]) == x.shape[1]
            step = np.linalg.solve(slopes[going], apart[going][..., None])[..., 0]
            near_enough = np.linalg.norm(step, axis=1) < _LONGEST
            size[left] = now
            left = left[going][near_enough]
            if not left.size:
                break
            x[left] += step[near_enough]
        return found


def _grow(segment: _Segment, fine: _Resolution, clock: _Clock) -> tuple[_Array, _Array, str]:
    """Age and state of the points of a branch, and the reason for its end."""
    ages = np.linspace(0.0, 1.0, _BEGUN)
    levels = [(ages, segment.begin(ages))]
    length = np.zeros(1)
    while True:
        found = _next_level(segment, levels, fine.length - float(length[-1]), fine, clock)
        if not isinstance(found, str):
            levels.append(found)
        age = np.concatenate(
            [*(k + own[:-1] for k, (own, _) in enumerate(levels)), len(levels) - 1 + levels[-1][0][-1:]]
        )
        states = np.concatenate([*(known[:-1] for _, known in levels), levels[-1][1][-1:]])
        length = np.linalg.norm(np.diff(states, axis=0), axis=1).cumsum()
        end = 1 + int(np.searchsorted(length, fine.length))
        clock.tell(min(float(length[-1]) / fine.length, 1.0))
        if isinstance(found, str) or end < len(states):
            return age[: end + 1], states[: end + 1], "max_arclength" if end < len(states) else str(found)


_Levels = list[tuple[_Array, _Array]]
"""Ages within the segment and states of its images."""


def _next_level(
    segment: _Segment, levels: _Levels, length: float, fine: _Resolution, clock: _Clock
) -> tuple[_Array, _Array] | str:
    """Ages and states of the image of the last level up to a length, points inserted, or the reason why there is none."""
    room = fine.points - sum(len(own) for own, _ in levels)
    ages, before = levels[-1]
    states = np.full_like(before, np.nan)
    while ages.size <= room:
        if clock.is_over:
            return "max_seconds"
        lost = np.asarray(np.isnan(states).any(axis=1))
        # what lies beyond the length that is wanted is not sought
        known = states[: int(np.argmax(lost)) if lost.any() else None]
        reached = np.linalg.norm(np.diff(known, axis=0), axis=1).cumsum() > length
        if reached.any():
            end = 2 + int(np.argmax(reached))
            ages, before, states, lost = ages[:end], before[:end], states[:end], lost[:end]
        if lost.any():
            sought = np.flatnonzero(lost)
            if segment.inverse and not lost.all():
                # far from what is known Newton's method fails
                sought = sought[np.abs(sought[:, None] - np.flatnonzero(~lost)).min(axis=1) <= _REACH]
            # the segments join: the inverse image of the first point is next to the last one
            near = before[-1:] if lost.all() else _between(ages[sought], ages[~lost], states[~lost])
            states[sought] = segment.image(before[sought], np.broadcast_to(near, before[sought].shape))
            still = np.asarray(np.isnan(states).any(axis=1))
            if still.any() and not segment.inverse:
                return "a run failed"
            if still.all():
                return "the inverse map does not converge"
            if still.sum() < lost.sum():
                continue
            places = np.flatnonzero(still[1:] != still[:-1])
            parts, words = np.full(places.size, _PARTS), "the inverse map does not converge"
        else:
            places, parts = _gaps(states, fine)
            words = "the map jumps, or the curve bends too sharply for max_distance and max_turn"
            if not places.size:
                return ages, states
        if (np.diff(ages)[places] < _FINEST).any():
            return words
        at = np.repeat(places, parts - 1)
        part = np.concatenate([np.arange(1, count) / count for count in parts])
        new = ages[at] + part * (ages[at + 1] - ages[at])
        inserted = segment.begin(new)
        for own, images in levels[1:]:
            inserted = segment.image(inserted, _between(new, own, images))
        ages, before = np.insert(ages, at + 1, new), np.insert(before, at + 1, inserted, axis=0)
        states = np.insert(states, at + 1, np.nan, axis=0)
    return "max_points"


def _between(wanted: _Array, ages: _Array, states: _Array) -> _Array:
    """States at ages by straight lines between known ones, and on beyond the last."""
    found = np.stack([np.interp(wanted, ages, column) for column in states.T], axis=1)
    if ages.size > 1:
        chord = states[-1] - states[-2]
        beyond = np.maximum(wanted - ages[-1], 0.0) / (ages[-1] - ages[-2])
        found += np.minimum(beyond, _LONGEST / max(float(np.linalg.norm(chord)), _SAME))[:, None] * chord
    return found


def _gaps(states: _Array, fine: _Resolution) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Places after which points must be inserted, and into how many parts they divide the chord there."""
    chords = np.diff(states, axis=0)
    size = np.linalg.norm(chords, axis=1)
    with np.errstate(invalid="ignore", divide="ignore"):
        cosine = np.sum(chords[1:] * chords[:-1], axis=1) / (size[1:] * size[:-1])
        sharp = ~(cosine >= np.cos(fine.turn)) & (size[1:] + size[:-1] > _CLOSEST * fine.distance)
    missing = size > fine.distance
    longer = size[1:] > size[:-1]
    missing[1:] |= sharp & longer
    missing[:-1] |= sharp & ~longer
    places = np.flatnonzero(missing)
    return places, np.clip(np.ceil(size[places] / fine.distance), 2, _MOST_PARTS).astype(np.intp)


@checked
def invariant_manifold(
    orbit: PeriodicOrbit,
    stability: str = "unstable",
    *,
    max_arclength: float = 10.0,
    max_distance: float = 0.05,
    max_turn: float = 0.2,
    max_points: int = _POINTS,
    max_seconds: float | None = None,
    progress: Callable[[float], object] | bool | None = None,
) -> xr.Dataset:
    """One-dimensional stable or unstable manifold of a saddle orbit, in the stroboscopic section.

    The curve is off the chords of its points by about max_distance max_turn/8.

    Parameters
    ----------
    orbit : PeriodicOrbit
        Saddle orbit: one multiplier outside the unit circle for the unstable manifold, one inside for the stable one.
    stability : {"unstable", "stable"}
        Manifold to compute.
    max_arclength : float
        Length of each of the two branches, in units of the well's amplitude (velocities over omega_1 times it).
    max_distance : float
        Distance of neighbours, in these units; between 1e-6 and 1.
    max_turn : float
        Angle between successive chords, rad; between 0.001 and 1.
    max_points : int
        Maximum number of points of each branch.
    max_seconds : float, optional
        Time limit, s, of both branches. A stable manifold takes longer where the motion has no inverse in time
        (circuits, damped contacts, friction) or where *orbit* is that of a map: Newton's method.
    progress : callable, optional
        Called as ``progress(share)`` with the share of the length; True prints it with the time left.

    Returns
    -------
    xarray.Dataset
        Variables over ``point``: ``state`` over ``coordinate``, ``side`` (-1 or 1: the branch), ``arclength`` along the
        branch, ``age`` (applications of the return map or its inverse since the fundamental segment; of twice the
        period for a negative multiplier). Attributes: the multiplier, the estimated distance from the chord
        ``chord_error``, and for each branch the reason for its end, ``max_arclength`` or ``max_seconds``.

    Raises
    ------
    InputError
        If the manifold has more dimensions or none, or is a stable one under Newton's law, whose map has no inverse.

    See Also
    --------
    snapbeam.dynamics.homoclinic_points, snapbeam.dynamics.homoclinic_tangency, snapbeam.plot.plot_manifold

    Examples
    --------
    >>> import snapbeam as sb
    >>> system = sb.paper.struck_beam(frequency_ratio=1.6, velocity_amplitude=0.03, damping_ratio=0.05)
    >>> saddle = sb.dynamics.periodic_orbit(system, [0.0, 0.0])
    >>> curve = sb.dynamics.invariant_manifold(saddle, max_arclength=1.0)
    >>> curve.sizes["coordinate"], bool(curve["arclength"].max() <= 1.05)
    (2, True)
    """
    instance("orbit", orbit, PeriodicOrbit, "an orbit, as periodic_orbit gives")
    inverse = choice("stability", stability, ("unstable", "stable")) == "stable"
    fine = _resolution(max_arclength, max_distance, max_turn, max_points)
    return _manifold(orbit, inverse, fine, _clock(max_seconds, progress, f"{stability} manifold"))


def _manifold(orbit: PeriodicOrbit, inverse: bool, fine: _Resolution, clock: _Clock) -> xr.Dataset:
    """Both branches of a manifold."""
    stability = "stable" if inverse else "unstable"
    flow = orbit.flow
    if inverse and isinstance(flow, Stroboscope) and any(each.law.impulsive for each in flow.system.contacts):
        raise InputError(
            "stability = 'stable': under Newton's law the map has no inverse where the beam sticks to the tip; use "
            f"{INSTEAD_OF_RESTITUTION}"
        )
    values, vectors = np.linalg.eig(orbit.jacobian)
    size = np.abs(values)
    which = np.flatnonzero(size < 1.0 if inverse else size > 1.0)
    if which.size != 1:
        place = "inside" if inverse else "outside"
        raise InputError(
            f"orbit: the {stability} manifold has {which.size} dimensions, one for each multiplier {place} the unit circle; it "
            f"must have one (multipliers {shown([complex(round(v.real, 6), round(v.imag, 6)) for v in values])})"
        )
    value, vector = float(values[which[0]].real), np.ascontiguousarray(vectors[:, which[0]].real)
    twice = 2 if value < 0.0 else 1
    factor = abs(value) ** (-twice if inverse else twice)
    branches = []
    for number, side in enumerate((1, -1)):
        begun = side * _NEAR_SADDLE * vector / np.linalg.norm(vector)
        segment = _Segment(flow, twice * orbit.period, orbit.coordinates, begun, factor, inverse)
        branches.append((side, *_grow(segment, fine, clock.half(number))))
    ages, states = (np.concatenate([each[k] for each in branches]) for k in (1, 2))
    sides = np.concatenate([np.full(age.size, side, np.int8) for side, age, *_ in branches])
    steps = [np.linalg.norm(np.diff(known, axis=0), axis=1) for _, _, known, _ in branches]
    variables = {
        "state": (("point", "coordinate"), states, "state"),
        "side": ("point", sides, "branch"),
        "arclength": ("point", np.concatenate([np.append(0.0, np.cumsum(own)) for own in steps]), "length of the branch"),
        "age": ("point", ages, "applications of the map since the fundamental segment"),
        "saddle": ("coordinate", orbit.coordinates, "state of the orbit"),
    }  # fmt: skip
    attrs = {
        "title": f"{stability} manifold of a periodic orbit", "stability": stability,
        "multiplier": value, "period": orbit.period, "chord_error": fine.distance * fine.turn / 8.0,
        "termination_reason": "; ".join(reason for *_, reason in branches),
    }  # fmt: skip
    return of_flow(orbit.flow, variables, attrs)


@checked
def homoclinic_points(unstable: xr.Dataset, stable: xr.Dataset) -> xr.Dataset:
    """Points in which an unstable and a stable manifold cross, both in a plane.

    Parameters
    ----------
    unstable, stable : xarray.Dataset
        Manifolds of :func:`invariant_manifold`, with two coordinates; of two saddles the points are heteroclinic.

    Returns
    -------
    xarray.Dataset
        ``state`` over ``point``, known to the attribute ``chord_error``, ``arclength`` and ``stable_arclength``.

    See Also
    --------
    snapbeam.dynamics.invariant_manifold, snapbeam.dynamics.homoclinic_tangency

    Examples
    --------
    >>> import snapbeam as sb
    >>> system = sb.paper.struck_beam(frequency_ratio=1.6, velocity_amplitude=0.03, damping_ratio=0.05)
    >>> saddle = sb.dynamics.periodic_orbit(system, [0.0, 0.0])
    >>> both = [
    ...     sb.dynamics.invariant_manifold(saddle, kind, max_arclength=1.0) for kind in ("unstable", "stable")
    ... ]
    >>> sb.dynamics.homoclinic_points(*both).sizes["point"]
    0
    """
    from snapbeam.util.datasets import xr

    for name, given in (("unstable", unstable), ("stable", stable)):
        instance(name, given, xr.Dataset, "a dataset of invariant_manifold")
        if given.attrs.get("stability") != name or given.sizes.get("coordinate") != 2:
            raise InputError(f"{name}: must be the {name} manifold of an orbit of a map of the plane")
    u, s = (_chords(each) for each in (unstable, stable))
    found: list[list[float]] = []
    share = max(1, _SHARE // max(len(s[0]), 1))
    for at in range(0, len(u[0]), share):
        begin, way, length = (each[at : at + share, None] for each in u)
        apart = s[0][None] - begin
        # begin + a way = s + b chord, by Cramer's rule
        cross = way[..., 0] * s[1][None, :, 1] - way[..., 1] * s[1][None, :, 0]
        with np.errstate(divide="ignore", invalid="ignore"):
            a = (apart[..., 0] * s[1][None, :, 1] - apart[..., 1] * s[1][None, :, 0]) / cross
            b = (apart[..., 0] * way[..., 1] - apart[..., 1] * way[..., 0]) / cross
            i, j = np.nonzero((a >= 0.0) & (a < 1.0) & (b >= 0.0) & (b < 1.0))
        along = length[i, 0] + a[i, j] * np.hypot(*way[i, 0].T)
        along_stable = s[2][j] + b[i, j] * np.hypot(*s[1][j].T)
        found += np.column_stack([along, along_stable, begin[i, 0] + a[i, j, None] * way[i, 0]]).tolist()
    table = np.array(sorted(found)).reshape(-1, 4)
    return labelled(
        {
            "state": (("point", "coordinate"), table[:, 2:], "state"),
            "arclength": ("point", table[:, 0], "length of the unstable manifold"),
            "stable_arclength": ("point", table[:, 1], "length of the stable manifold"),
        },
        {"coordinate": unstable["coordinate"].values},
        {"title": "homoclinic points", "chord_error": unstable.attrs["chord_error"] + stable.attrs["chord_error"]},
    )


def _chords(manifold: xr.Dataset) -> tuple[_Array, _Array, _Array]:
    """Begin, direction and arclength of the chords of a manifold."""
    states, side = manifold["state"].values, manifold["side"].values
    same = side[1:] == side[:-1]
    return states[:-1][same], np.diff(states, axis=0)[same], manifold["arclength"].values[:-1][same]


_SHORTEST_STEP = 1.0 / 256.0
"""Part of the way to another value of a parameter in which an orbit is followed, at least."""


@checked
def homoclinic_tangency(
    orbit: PeriodicOrbit,
    name: str,
    bounds: tuple[float, float],
    *,
    max_arclength: float = 6.0,
    max_distance: float = 0.02,
    max_turn: float = 0.1,
    tolerance: float = 1e-3,
    max_seconds: float | None = None,
    progress: Callable[[float], object] | bool | None = None,
) -> xr.Dataset:
    """Bracket of the value of a parameter at which the manifolds of a saddle begin to cross.

    Up to *max_arclength* the manifolds cross at one end of the bracket only; it is halved to *tolerance* times the
    width of *bounds*. There chaotic transients and fractal basin boundaries begin (Guckenheimer and Holmes, Nonlinear
    Oscillations, Springer, 1983, section 4.5).

    Parameters
    ----------
    orbit : PeriodicOrbit
        Saddle of a map of the plane.
    name : str
        Parameter, by any of its names.
    bounds : pair of float
        Values with and without crossing, in either order of size.
    max_arclength, max_distance, max_turn : float
        Length and resolution of the manifolds, as in :func:`invariant_manifold`.
    tolerance : float
        Width of the bracket over that of *bounds*, between 1e-9 and 0.5.
    max_seconds : float, optional
        Time limit of the search, s; none by default. Each value takes the time of two manifolds.
    progress : callable, optional
        Called as ``progress(share)`` with the share of the values; True prints it with the time left.

    Returns
    -------
    xarray.Dataset
        Variables over ``value``, each value that was tried: ``crosses``. ``bracket`` over ``manifolds`` ("apart",
        "crossing"): the nearest values, NaN where none was found. The attribute ``termination_reason`` is
        ``tolerance``; otherwise the bracket is wider, with a :class:`~snapbeam.DiagnosticWarning`: ``max_seconds``, a
        crossing at both *bounds* or neither, a manifold that ends before *max_arclength*, a value without the saddle.

    Raises
    ------
    InputError
        If the orbit is not a saddle of the plane.
    OrbitNotFoundError
        If the saddle is not found at the lower bound.

    See Also
    --------
    snapbeam.dynamics.invariant_manifold, snapbeam.dynamics.homoclinic_points

    Examples
    --------
    >>> import snapbeam as sb
    >>> system = sb.paper.struck_beam(frequency_ratio=1.6, velocity_amplitude=0.03, damping_ratio=0.05)
    >>> saddle = sb.dynamics.periodic_orbit(system, [0.0, 0.0])
    >>> found = sb.dynamics.homoclinic_tangency(
    ...     saddle, "velocity_amplitude", (0.02, 0.03), max_arclength=0.5, max_seconds=1e-3
    ... )
    >>> found.attrs["termination_reason"], found["bracket"].values
    ('max_seconds', array([nan, nan]))
    """
    instance("orbit", orbit, PeriodicOrbit, "an orbit, as periodic_orbit gives")
    low, high = interval("bounds", bounds)
    width = within("tolerance", tolerance, 1e-9, 0.5, closed="both") * (high - low)
    fine = _resolution(max_arclength, max_distance, max_turn, _POINTS)
    total = 2 + int(np.ceil(np.log2((high - low) / width)))
    clock = _clock(max_seconds, progress, "homoclinic tangency")
    tried: dict[float, bool] = {}
    saddles = [orbit]

    def crosses(value: float) -> bool | str:
        """Return whether the manifolds cross, which *tried* keeps, or the reason why that is not known."""
        if clock.is_over:
            return "max_seconds"
        part = clock._replace(begun=len(tried) / total, part=1.0 / total)
        try:
            saddle = _continued(min(saddles, key=lambda each: abs(each.flow.value(name) - value)), name, value)
            saddles.append(saddle)
            both = [_manifold(saddle, inverse, fine, part.half(int(inverse))) for inverse in (False, True)]
        except (InputError, OrbitNotFoundError) as error:
            if not tried:
                raise
            return f"{name} = {value:g}: {error}; choose bounds nearer to that of the orbit"
        found = bool(homoclinic_points(*both).sizes["point"])
        for each in () if found else both:
            reason = str(each.attrs["termination_reason"])
            if "max_seconds" in reason:
                return "max_seconds"
            if reason != "max_arclength; max_arclength":
                return (
                    f"{name} = {value:g}: the {each.attrs['stability']} manifold ends before max_arclength = {max_arclength:g} ({reason}), so "
                    "that crossings may be missed; choose a smaller max_arclength"
                )
        tried[value] = found
        return found

    ends = [crosses(low), crosses(high)]
    reason = next((each for each in ends if isinstance(each, str)), "tolerance")
    if reason == "tolerance" and ends[0] == ends[1]:
        where = "both values" if ends[0] else "neither value"
        reason = f"bounds = {shown(bounds)}: the manifolds cross at {where}; give one with and one without crossing"
    while reason == "tolerance" and high - low > width:
        middle = 0.5 * (low + high)
        found = crosses(middle)
        if isinstance(found, str):
            reason = found
        else:
            low, high = (middle, high) if found == ends[0] else (low, middle)
    if clock.report is not None:
        clock.report(1.0)
    if reason not in ("tolerance", "max_seconds"):
        tell([Diagnostic("no-tangency", reason, {"values": float(len(tried))})])
    kept = [next((each for each in (low, high) if tried.get(each) is state), np.nan) for state in (False, True)]
    values = sorted(tried)
    labels = {"long_name": f"nearest values of {name}"}
    return labelled(
        {
            "crosses": ("value", np.array([tried[value] for value in values], bool), "the manifolds cross"),
            "bracket": ("manifolds", np.array(kept), labels),
        },
        {"value": ("value", np.array(values), {"long_name": name}), "manifolds": ["apart", "crossing"]},
        {
            "title": "homoclinic tangency", "parameter": name, "termination_reason": reason,
            "max_arclength": fine.length, "max_distance": fine.distance, "max_turn": fine.turn,
        },
    )  # fmt: skip


def _continued(orbit: PeriodicOrbit, name: str, value: float) -> PeriodicOrbit:
    """The orbit at another value of a parameter, in steps that Newton's method follows; its error where they become too short."""
    start = at = orbit.flow.value(name)
    step = value - start
    while at != value:
        to = value if abs(value - at) <= abs(step) else at + step
        try:
            orbit, at = periodic_orbit(orbit.flow.changed({name: to}), orbit.coordinates, orbit.period), to
        except OrbitNotFoundError:
            step *= 0.5
            if abs(step) < _SHORTEST_STEP * abs(value - start):
                raise
    return orbit
