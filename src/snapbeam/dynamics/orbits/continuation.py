"""Branches of periodic orbits: pseudo-arclength continuation in any parameter, and what happens on the way.

With the return map P^m(x; lambda), a branch solves P^m(x; lambda) = x; each orbit is predicted along the tangent of the
branch and corrected on the plane across it (Keller, in Applications of Bifurcation Theory, 1977).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from snapbeam.core.findings import tell
from snapbeam.core.kinds import checked
from snapbeam.core.validate import InputError, choice, integer, positive, shown
from snapbeam.dynamics.flow import Flow
from snapbeam.dynamics.orbits.branch import Branch, SpecialPoint
from snapbeam.dynamics.orbits.corrector import Corrector, Spot
from snapbeam.dynamics.orbits.events import between as events_between
from snapbeam.dynamics.orbits.events import grazing_end
from snapbeam.dynamics.orbits.orbit import OrbitNotFoundError, PeriodicOrbit
from snapbeam.dynamics.orbits.shooting import Family

__all__ = ["continuation", "switch_branch"]

_Array = NDArray[np.float64]
_TOLERANCE = 1e-10
_EASY, _HARD = 4, 9
"""Iterations up to which the step grows, and from which on it shrinks."""


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
) -> Branch:
    """Follow a periodic orbit, stable or not, along one parameter.

    Folds, period doublings (flips), Neimark-Sacker bifurcations, branch points and grazing are located between the
    orbits that they are found between.  The branch ends at a limit of the parameter, when it closes, at *max_points* orbits,
    or where no orbit is found, as under a law of restitution where it grazes; ``branch.end`` says which.

    Parameters
    ----------
    orbit : Orbit
        Of :func:`periodic_orbit`, or of a branch.
    name : str
        Parameter, by dotted name or the name in datasets.
    bounds : pair of float
        Least and greatest value.
    direction : {"up", "down"}
        Which way the parameter goes at first.
    max_points : int
        Orbits at most.
    step, max_step : float
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
    low, high = _limits(bounds)
    begun = orbit.flow.value(name)
    if not low <= begun <= high:
        raise InputError(f"between = ({low:g}, {high:g}): must hold the orbit's own {name} = {begun:g}")
    choice("direction", direction, ("up", "down"))
    count = integer("max_points", max_points, 2, 10**6)
    length, max_step = positive("step", step), positive("max_step", max_step)
    tell(orbit.diagnostics)
    corrector = Corrector(
        Family(orbit.flow, name), orbit.period, high - low, positive("tolerance", tolerance)
    )
    y = np.append(orbit.coordinates, begun / corrector.span)
    came, slope = corrector.derivatives(y)
    sign = np.zeros(y.size)
    sign[-1] = 1.0 if direction == "up" else -1.0
    first = Spot(y, corrector.tangent(came, slope, sign), came, slope, orbit.iterations)
    return _follow(corrector, first, (low, high), count, min(length, max_step), max_step)


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
    spots, events = [first], list[SpecialPoint]()
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
                raise OrbitNotFoundError("the next orbit is too far away, or on another branch")
            if over is None and not limit[0] <= spot.y[-1] <= limit[1]:
                raise OrbitNotFoundError("the corrected orbit is beyond the limit")
            if not corrector.family.flow.smooth and spot.came.impacts != last.came.impacts:
                raise OrbitNotFoundError("another number of impacts: it grazes")
        except OrbitNotFoundError as error:
            length *= 0.5
            if length < shortest:
                end = f"no further orbit: {error}"
                grazing = grazing_end(corrector, spots)
                if grazing is not None:
                    events.append(grazing)
                    end = "grazing"
                break
            continue
        events += events_between(corrector, last, spot, len(spots) - 1)
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


def switch_branch(
    special_point: SpecialPoint, name: str, bounds: tuple[float, float], *, size: float = 0.01
) -> PeriodicOrbit:
    """An orbit of the branch that is born at a flip or a branch point, *size* away from it.

    At a flip it has twice the period.  It is sought on the plane at that distance along the critical eigenvector.

    Parameters
    ----------
    special_point : Event
    name, between
        As of :func:`continuation`.
    size : float
        Distance, in units of the well's amplitude.

    Returns
    -------
    Orbit
        From which :func:`continuation` goes on.

    Raises
    ------
    InputError
        For an event at which no other branch is born.
    OrbitNotFoundError
        If there is none at that distance; try another.
    """
    if not isinstance(special_point, SpecialPoint) or special_point.kind not in ("flip", "branch point"):
        raise InputError(f"event = {shown(special_point)}: must be a flip or a branch point")
    low, high = _limits(bounds)
    orbit, span = special_point.orbit, high - low
    doubled = special_point.kind == "flip"
    values, vectors = np.linalg.eig(orbit.jacobian)
    vector = vectors[:, np.argmin(np.abs(values - (-1.0 if doubled else 1.0)))].real
    row = np.append(vector / np.linalg.norm(vector), 0.0)
    flow: Flow = orbit.flow
    corrector = Corrector(Family(flow, name), orbit.period * (2 if doubled else 1), span, _TOLERANCE)
    guess = np.append(orbit.coordinates, special_point.value / span) + positive("size", size) * row
    spot = corrector.correct(guess, row, row)
    return corrector.orbit(spot)
