"""Curves of periodic motions in states and parameters, followed by steps of arc length.

Each point is predicted along the tangent of the curve and corrected on the plane across it (Keller, in Applications of
Bifurcation Theory, 1977).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from snapbeam.dynamics.approaches import between_contacts, carried
from snapbeam.dynamics.flow import Flow
from snapbeam.dynamics.shooting import Family, OrbitNotFoundError, newton
from snapbeam.dynamics.stroboscope import Stroboscope
from snapbeam.util.singular_values import svd
from snapbeam.util.validation import within

_Array = NDArray[np.float64]
_SHORTEST = 1e-7
"""Shortest distance between points, over the longest."""
_CLOSED = 8
"""Points after which a curve may close."""


class Point(NamedTuple):
    """One point of a curve."""

    y: _Array
    """State, and the parameters over their ranges."""
    tangent: _Array
    came: Any
    """Result of the map at the point."""
    table: _Array
    """Derivative of the equations, shape (n, n + 1) for n equations."""
    iterations: int
    residual: float


class Equations:
    """Equations that have a curve of solutions, one fewer than unknowns."""

    iterations: int = 14
    """Maximum number of iterations of Newton's method."""
    easy, hard = 4, 9
    """Iterations up to which the step grows, and from which on it shrinks."""
    easier: tuple[float, ...] = (1.0,)
    """Factors of the tolerance that are tried one after the other."""
    tolerance: float

    def residual(self, y: _Array) -> _Array:
        """Residual of the equations, shape (n,)."""
        raise NotImplementedError

    def derivative(self, y: _Array) -> tuple[_Array, Any, _Array]:
        """Residual, result of the map and derivative of the residual, shape (n, n + 1)."""
        raise NotImplementedError

    def correct(self, guess: _Array, row: _Array, before: _Array, known: _Array | None = None) -> Point:
        """The point on the plane through *guess* across *row*, its tangent like *before*; *known*: first derivative."""

        def residual(y: _Array) -> _Array:
            return np.append(self.residual(y), row @ (y - guess))

        def derivative(y: _Array) -> tuple[_Array, _Array]:
            found, _, table = self.derivative(y)
            return np.append(found, row @ (y - guess)), np.vstack([table, row])

        first = None if known is None else np.vstack([known, row])
        for easier in self.easier:
            try:
                shot = newton(residual, derivative, guess, easier * self.tolerance, self.iterations, first)
                break
            except OrbitNotFoundError:
                # light impacts make the multipliers rough; what is left counts as error
                if easier == self.easier[-1]:
                    raise
                first = None
        _, came, table = self.derivative(shot.x)
        if not np.isfinite(table).all():
            raise OrbitNotFoundError("a run beside the orbit failed")
        return Point(shot.x, tangent_of(table, before), came, table, shot.iterations, shot.residual)

    def between(self, one: Point, other: Point, part: float) -> Point:
        """The point at a part of the way between two."""
        along = other.y - one.y
        nearer = one if part < 0.5 else other
        row = along / np.linalg.norm(along)
        return self.correct(one.y + part * along, row, one.tangent, nearer.table)

    def halved(
        self, one: Point, other: Point, is_before: Callable[[Point], bool], most: int, tolerance: float = 0.0
    ) -> tuple[Point, Point]:
        """The points on both sides of a change between two, by halving, as far as points are found."""
        sides, parts, size = [one, other], [0.0, 1.0], float(np.linalg.norm(other.y - one.y))
        for _ in range(most):
            part = 0.5 * (parts[0] + parts[1])
            try:
                spot = self.between(one, other, part)
            except OrbitNotFoundError:
                break
            side = 0 if is_before(spot) else 1
            sides[side], parts[side] = spot, part
            if (parts[1] - parts[0]) * size < tolerance:
                break
        return sides[0], sides[1]

    def observed(self, point: Point) -> tuple[Equations, Point]:
        """Equations and point at the phase from which the next one is sought."""
        return self, point

    def prepare(self, last: Point, is_first: bool) -> _Array | None:
        """A derivative for the search of the next point."""
        return last.table

    def require_next(self, last: Point, point: Point) -> None:
        """Refuse a point that does not follow the last one."""

    def events(self, last: Point, point: Point, number: int) -> list[Any]:
        """Special points between two points, of which *number* is that of the first."""
        return []

    def end_at(self, last: Point, point: Point) -> tuple[str, bool] | None:
        """Reason why the curve ends with the step between two points, and whether it has the second one; None: it goes on."""
        return None

    def has_returned(self, point: Point, first: tuple[Any, Point], near: float) -> bool:
        """Return whether the curve has returned to its first point within a distance, in the same direction."""
        return False


def tangent_of(table: _Array, before: _Array) -> _Array:
    """Unit tangent of a curve, in the direction of *before*."""
    found: _Array = svd(table)[2][-1]
    return found if found @ before >= 0.0 else -found


@dataclass(eq=False)
class OrbitEquations(Equations):
    """Equations of periodic orbits, P^m(x) = x, and further ones; the last unknowns: parameters over their ranges."""

    family: Family
    period: int
    spans: _Array
    tolerance: float
    kind: str = ""
    """Kind of special point that every orbit is."""

    def values(self, y: _Array) -> _Array:
        """Parameters of a point."""
        return np.asarray(y[..., -self.spans.size :] * self.spans)

    def flow_at(self, y: _Array) -> Flow:
        """The flow at the parameters of a point."""
        return self.family.at(self.values(y))

    def state(self, y: _Array, flow: Flow | None = None) -> _Array:
        """The state of a point, at the phase at which another flow takes states if one is given."""
        x = y[: -self.spans.size]
        if not isinstance(flow, Stroboscope) or flow is self.family.flow:
            return x
        here = self.flow_at(y)
        assert isinstance(here, Stroboscope)
        return carried(here, x, flow.clock.striker_phase)

    def observed(self, point: Point) -> tuple[OrbitEquations, Point]:
        """The orbit at the phase farthest from contacts, if one is near the phase of the flow; itself otherwise."""
        flow, names = self.family.flow, self.family.names
        if not isinstance(flow, Stroboscope) or not flow.jumps:
            return self, point
        if any(flow.system.parameter(name).name.endswith(".phase") for name in names):
            return self, point
        seen = between_contacts(self.flow_at(point.y), self.state(point.y), self.period)
        if seen is None:
            return self, point
        moved = replace(self, family=Family(replace(flow, phase=seen.phase), *names))
        return moved, moved.seen(self, point)

    def seen(self, other: OrbitEquations, point: Point) -> Point:
        """A point of other equations at the phase of these."""
        if other.family.flow is self.family.flow:
            return point
        count = self.spans.size
        y = np.append(other.state(point.y, self.family.flow), point.y[-count:])
        self.begin(y)
        table = self.derivative(y)[2]
        along = tangent_of(table, np.append(np.zeros(y.size - count), point.tangent[-count:]))
        return self.correct(y, along, along, table)

    def begin(self, y: _Array) -> None:
        """Adapt the equations to a point nearby."""


def distances(step: float, max_step: float, shortest: float) -> tuple[float, float]:
    """The first and the longest distance between two points of a curve, checked."""
    steps = {"step": step, "max_step": max_step}
    first, longest = (within(name, value, shortest, 1.0, closed="both") for name, value in steps.items())
    return first, longest


class Path(NamedTuple):
    """Points of a curve, each with the equations at whose phase it is seen, special points, and reason of the end."""

    points: list[tuple[Any, Point]]
    events: list[Any]
    end: str


def follow(
    equations: Equations,
    first: Point,
    *,
    limits: _Array,
    max_points: int,
    step: float,
    max_step: float,
    progress: Callable[[int, int], object],
    what: str = "orbit",
) -> Path:
    """Follow a curve in steps up to *max_step*; *limits*, (k, 2), are of the last k unknowns, *what* a point's noun."""
    points: list[tuple[Equations, Point]] = [(equations, first)]
    events: list[Any] = []
    count, length = len(limits), min(step, max_step)
    while len(points) < max_points:
        try:
            points[-1] = points[-1][0].observed(points[-1][1])
        except (OrbitNotFoundError, np.linalg.LinAlgError):
            pass  # the next point is sought at the phase of this one
        equations, last = points[-1]
        guess, row = last.y + length * last.tangent, last.tangent
        crossed = [
            ((value - last.y[k]) / last.tangent[k], k, value)
            for k in range(-count, 0)
            for value in limits[k]
            if (guess[k] - value) * (last.y[k] - value) < 0.0
        ]
        if crossed:
            # the last point stands at the limit itself
            part, k, value = min(crossed)
            guess, row = last.y + part * last.tangent, np.zeros(last.y.size)
            guess[k], row[k] = value, 1.0
        try:
            known = equations.prepare(last, len(points) == 1)
            point = equations.correct(guess, row, last.tangent, known)
            turned = float(point.tangent @ last.tangent)
            if np.linalg.norm(point.y - last.y) > 3.0 * length or turned < 0.5:
                raise OrbitNotFoundError(f"the next {what} is too far away, or on another branch")
            held = point.y[point.y.size - count :]
            if not crossed and not ((limits[:, 0] <= held) & (held <= limits[:, 1])).all():
                raise OrbitNotFoundError(f"the corrected {what} is beyond the limits")
            equations.require_next(last, point)
        except (OrbitNotFoundError, np.linalg.LinAlgError) as error:
            length *= 0.5
            if length < _SHORTEST * max_step:
                return Path(points, events, f"no further {what}: {error}")
            continue
        events += equations.events(last, point, len(points) - 1)
        ended = equations.end_at(last, point)
        if ended is None or ended[1]:
            points.append((equations, point))
            progress(len(points), max_points)
        if ended is not None or crossed:
            end = f"limit of {'the' if count == 1 else 'a'} parameter" if ended is None else ended[0]
            return Path(points, events, end)
        if len(points) > _CLOSED and equations.has_returned(point, points[0], 0.75 * length):
            return Path(points, events, "closed")
        if point.iterations <= equations.easy and turned > 0.95:
            length = min(1.4 * length, max_step)
        elif point.iterations >= equations.hard or turned < 0.8:
            length *= 0.6
    return Path(points, events, f"{max_points} {what}s, the maximum (max_points)")
