"""Branches of periodic orbits: pseudo-arclength continuation in any parameter, and what happens on the way.

With the return map P^m(x; lambda), a branch solves P^m(x; lambda) = x; each orbit is predicted along the tangent of the
branch and corrected on the plane across it (Keller, in Applications of Bifurcation Theory, 1977).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from snapbeam.core.findings import tell
from snapbeam.core.kinds import checked
from snapbeam.core.validate import InputError, choice, integer, positive, shown
from snapbeam.dynamics.flow import Flow, Stroboscope
from snapbeam.dynamics.orbits.branch import Branch, Event
from snapbeam.dynamics.orbits.orbit import NoOrbit, Orbit
from snapbeam.dynamics.orbits.shooting import Family, Return, jacobian, newton

__all__ = ["continue_orbit", "switch_branch"]

_Array = NDArray[np.float64]
_TOLERANCE = 1e-10
_ITERATIONS = 14
_DIFFERENCE = 2e-6
"""Of the difference by the parameter, over its range."""
_EASY, _HARD = 4, 9
"""Iterations up to which the step grows, and from which on it shrinks."""
_LOCATED = 1e-9
"""Of a multiplier at an event."""
_HALVINGS = 20
_TOUCHES = 5e-3
"""Clearance, over the length scale, below which a branch that goes no further ends by grazing."""


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
        NoOrbit
        """

        def residual(y: _Array) -> _Array:
            value = float(y[-1]) * self.span
            there = self.family.march(y[None, :-1], self.period, value).states[0]
            return np.append(there - y[:-1], row @ (y - guess))

        def derivative(y: _Array) -> tuple[_Array, _Array]:
            came, slope = self.derivatives(y)
            return np.append(came.x - y[:-1], row @ (y - guess)), self.bordered(came, slope, row)

        first = None if known is None else self.bordered(*known, row)
        shot = newton(residual, derivative, guess, self.tolerance, _ITERATIONS, first)
        came, slope = self.derivatives(shot.x)
        if not np.isfinite(came.jacobian).all() or not np.isfinite(slope).all():
            raise NoOrbit("a run beside the orbit failed")
        return Spot(shot.x, self.tangent(came, slope, before), came, slope, shot.iterations)

    def tangent(self, came: Return, slope: _Array, before: _Array) -> _Array:
        """Of the branch, of length one, towards where *before* points."""
        wanted = np.zeros(slope.size + 1)
        wanted[-1] = 1.0
        try:
            found = np.linalg.solve(self.bordered(came, slope, before), wanted)
        except np.linalg.LinAlgError:
            return before
        return found / np.linalg.norm(found)

    def orbit(self, spot: Spot) -> Orbit:
        """As an orbit of the flow at its value."""
        came, x = spot.came, spot.y[:-1]
        residual = float(np.abs(came.x - x).max())
        flow = self.family.at(float(spot.y[-1]) * self.span)
        return Orbit(flow, x, self.period, came.jacobian, residual, spot.iterations)


@checked
def continue_orbit(
    orbit: Orbit,
    name: str,
    between: tuple[float, float],
    *,
    direction: str = "up",
    most: int = 500,
    step: float = 0.01,
    longest: float = 0.02,
    tolerance: float = _TOLERANCE,
) -> Branch:
    """Follow a periodic orbit, stable or not, along one parameter.

    Folds, period doublings (flips), Neimark-Sacker bifurcations, branch points and grazing are located between the
    orbits that they are found between.  The branch ends at a limit of the parameter, when it closes, at *most* orbits,
    or where no orbit is found, as under a law of restitution where it grazes; ``branch.end`` says which.

    Parameters
    ----------
    orbit : Orbit
        Of :func:`periodic_orbit`, or of a branch.
    name : str
        Parameter, by dotted name or the name in datasets.
    between : pair of float
        Least and greatest value.
    direction : {"up", "down"}
        Which way the parameter goes at first.
    most : int
        Orbits at most.
    step, longest : float
        First and greatest distance between orbits, in units of the well's amplitude for the state and of the range
        for the parameter.
    tolerance : float
        As of :func:`periodic_orbit`.

    Returns
    -------
    Branch

    Raises
    ------
    InputError
        For bad input.
    """
    low, high = _limits(between)
    begun = orbit.flow.value(name)
    if not low <= begun <= high:
        raise InputError(f"between = ({low:g}, {high:g}): must hold the orbit's own {name} = {begun:g}")
    choice("direction", direction, ("up", "down"))
    count = integer("most", most, 2, 10**6)
    length, longest = positive("step", step), positive("longest", longest)
    tell(orbit.findings)
    corrector = Corrector(
        Family(orbit.flow, name), orbit.period, high - low, positive("tolerance", tolerance)
    )
    y = np.append(orbit.coordinates, begun / corrector.span)
    came, slope = corrector.derivatives(y)
    sign = np.zeros(y.size)
    sign[-1] = 1.0 if direction == "up" else -1.0
    first = Spot(y, corrector.tangent(came, slope, sign), came, slope, orbit.iterations)
    return _follow(corrector, first, (low, high), count, min(length, longest), longest)


def _limits(between: tuple[float, float]) -> tuple[float, float]:
    try:
        low, high = (float(value) for value in between)
    except (TypeError, ValueError):
        raise InputError(f"between = {shown(between)}: must be a least and a greatest number") from None
    if not low < high:
        raise InputError(f"between = ({low:g}, {high:g}): must be increasing")
    return low, high


def _follow(
    corrector: Corrector, first: Spot, limits: tuple[float, float], most: int, length: float, longest: float
) -> Branch:
    spots, events = [first], list[Event]()
    end = f"{most} orbits"
    shortest = 1e-7 * longest
    limit = tuple(value / corrector.span for value in limits)
    while len(spots) < most:
        last = spots[-1]
        guess = last.y + length * last.tangent
        over = next((value for value in limit if (guess[-1] - value) * (last.y[-1] - value) < 0.0), None)
        row = last.tangent
        if over is not None:
            # the last orbit stands at the limit itself
            guess = last.y + (over - last.y[-1]) / last.tangent[-1] * last.tangent
            guess[-1], row = over, np.append(np.zeros(guess.size - 1), 1.0)
        try:
            spot = corrector.correct(guess, row, last.tangent, (last.came, last.slope))
            turned = float(spot.tangent @ last.tangent)
            if np.linalg.norm(spot.y - last.y) > 3.0 * length or turned < 0.5:
                raise NoOrbit("the next orbit is too far away, or on another branch")
            if over is None and not limit[0] <= spot.y[-1] <= limit[1]:
                raise NoOrbit("the corrected orbit is beyond the limit")
            if not corrector.family.flow.smooth and spot.came.impacts != last.came.impacts:
                raise NoOrbit("another number of impacts: it grazes")
        except NoOrbit as error:
            length *= 0.5
            if length < shortest:
                end = f"no further orbit: {error}"
                if _grazes(corrector, last):
                    events.append(
                        Event(
                            "grazing",
                            corrector.orbit(last),
                            float(last.y[-1]) * corrector.span,
                            len(spots) - 1,
                        )
                    )
                    end = "grazing"
                break
            continue
        events += _between(corrector, last, spot, len(spots) - 1)
        spots.append(spot)
        if over is not None:
            end = "limit of the parameter"
            break
        if (
            len(spots) > 8
            and np.linalg.norm(spot.y - first.y) < 0.75 * length
            and spot.tangent @ first.tangent > 0.9
        ):
            end = "closed"
            break
        if spot.iterations <= _EASY and turned > 0.95:
            length = min(1.4 * length, longest)
        elif spot.iterations >= _HARD or turned < 0.8:
            length *= 0.6
    orbits = [corrector.orbit(spot) for spot in spots]
    assert corrector.family.name is not None
    impacts = [spot.came.impacts for spot in spots]
    return Branch(corrector.family.name, orbits, events, end, impacts, [spot.tangent for spot in spots])


def _grazes(corrector: Corrector, spot: Spot) -> bool:
    """Whether an orbit passes the tip without room to spare."""
    if not isinstance(corrector.family.flow, Stroboscope):
        return False
    passage = corrector.orbit(spot).passage
    return bool(passage.clearance < _TOUCHES)


# ---------------------------------------------------------------------- events


def _counts(came: Return) -> tuple[int, int, int]:
    """Real multipliers above 1, real ones below -1, and others outside the unit circle."""
    values = np.linalg.eigvals(came.jacobian)
    real = np.abs(values.imag) < 1e-12 * np.maximum(np.abs(values), 1e-300)
    out = np.abs(values) > 1.0
    return (
        int((real & (values.real > 1.0)).sum()), int((real & (values.real < -1.0)).sum()), int((out & ~real).sum())
    )  # fmt: skip


def _between(corrector: Corrector, one: Spot, other: Spot, at: int) -> list[Event]:
    """What happens between two orbits of a branch, located."""
    found = []
    up, flip, pair = (b - a for a, b in zip(_counts(one.came), _counts(other.came), strict=True))
    if one.tangent[-1] * other.tangent[-1] < 0.0:
        found.append(_located(corrector, one, other, "fold", at))
    elif up % 2:
        found.append(_located(corrector, one, other, "branch point", at))
    if flip % 2:
        found.append(_located(corrector, one, other, "flip", at))
    if pair and not (up or flip):
        found.append(_located(corrector, one, other, "Neimark-Sacker", at))
    if one.came.impacts != other.came.impacts:
        found.append(_grazing(corrector, one, other, at))
    return [event for event in found if event is not None]


def _test(spot: Spot, kind: str) -> float:
    """What vanishes at an event."""
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


def _between_at(corrector: Corrector, one: Spot, other: Spot, part: float) -> Spot:
    along = other.y - one.y
    row = along / np.linalg.norm(along)
    nearer = one if part < 0.5 else other
    return corrector.correct(one.y + part * along, row, one.tangent, (nearer.came, nearer.slope))


def _located(corrector: Corrector, one: Spot, other: Spot, kind: str, at: int) -> Event | None:
    """An event between two orbits, by the Illinois form of false position."""
    low, high, f_low, f_high = 0.0, 1.0, _test(one, kind), _test(other, kind)
    if not f_low * f_high < 0.0:
        return None
    best, side = one if abs(f_low) < abs(f_high) else other, 0
    for _ in range(_HALVINGS):
        part = (low * f_high - high * f_low) / (f_high - f_low)
        try:
            spot = _between_at(corrector, one, other, part)
        except NoOrbit:
            break
        value = _test(spot, kind)
        best = spot
        if not abs(value) > _LOCATED or high - low < 1e-9:
            break
        if value * f_high > 0.0:
            high, f_high = part, value
            f_low *= 0.5 if side == 1 else 1.0
            side = 1
        else:
            low, f_low = part, value
            f_high *= 0.5 if side == -1 else 1.0
            side = -1
    return Event(kind, corrector.orbit(best), float(best.y[-1]) * corrector.span, at)


def _grazing(corrector: Corrector, one: Spot, other: Spot, at: int) -> Event:
    """Where the number of impacts changes between two orbits, by halving."""
    low, high, best = 0.0, 1.0, other
    for _ in range(_HALVINGS):
        part = 0.5 * (low + high)
        try:
            spot = _between_at(corrector, one, other, part)
        except NoOrbit:
            break
        if spot.came.impacts == one.came.impacts:
            low = part
        else:
            high, best = part, spot
    return Event("grazing", corrector.orbit(best), float(best.y[-1]) * corrector.span, at)


@checked
def switch_branch(event: Event, name: str, between: tuple[float, float], *, size: float = 0.01) -> Orbit:
    """An orbit of the branch that is born at a flip or a branch point, *size* away from it.

    At a flip it has twice the period.  It is sought on the plane at that distance along the critical eigenvector.

    Parameters
    ----------
    event : Event
    name, between
        As of :func:`continue_orbit`.
    size : float
        Distance, in units of the well's amplitude.

    Returns
    -------
    Orbit
        From which :func:`continue_orbit` goes on.

    Raises
    ------
    InputError
        For an event at which no other branch is born.
    NoOrbit
        If there is none at that distance; try another.
    """
    if not isinstance(event, Event) or event.kind not in ("flip", "branch point"):
        raise InputError(f"event = {shown(event)}: must be a flip or a branch point")
    low, high = _limits(between)
    orbit, span = event.orbit, high - low
    doubled = event.kind == "flip"
    values, vectors = np.linalg.eig(orbit.jacobian)
    vector = vectors[:, np.argmin(np.abs(values - (-1.0 if doubled else 1.0)))].real
    row = np.append(vector / np.linalg.norm(vector), 0.0)
    flow: Flow = orbit.flow
    corrector = Corrector(Family(flow, name), orbit.period * (2 if doubled else 1), span, _TOLERANCE)
    guess = np.append(orbit.coordinates, event.value / span) + positive("size", size) * row
    spot = corrector.correct(guess, row, row)
    return corrector.orbit(spot)
