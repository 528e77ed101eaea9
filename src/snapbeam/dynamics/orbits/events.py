"""What happens on a branch of periodic orbits, located between the orbits that it is found between, with an error.

The error of a value holds what is left of the bracket, what the residual of the orbit moves, and what the error of the
return map's derivative moves; that of the steps themselves, which other steps show, it does not hold.
"""

from __future__ import annotations

import numpy as np

from snapbeam.dynamics.flow import Flow, Stroboscope
from snapbeam.dynamics.orbits.branch import SpecialPoint
from snapbeam.dynamics.orbits.corrector import Corrector, Spot
from snapbeam.dynamics.orbits.orbit import OrbitNotFoundError, PeriodicOrbit
from snapbeam.dynamics.orbits.shooting import Return

__all__ = ["between", "grazing_end"]

_LOCATED = 1e-9
"""Of a multiplier at an event."""
_HALVINGS = 20
_TOUCHES = 5e-3
"""Clearance, over the length scale, below which a branch that goes no further ends by grazing."""
_FINE, _ROUNDING = 1e-5, 1e-13
"""Relative error of tangents at level "reference", and of what is known exactly."""
_ACROSS = 10.0
"""How much faster multipliers may change across a branch than along it: an orbit that closes badly is off across."""


def _counts(came: Return) -> tuple[int, int, int]:
    """Real multipliers above 1, real ones below -1, and others outside the unit circle."""
    values = np.linalg.eigvals(came.jacobian)
    real = np.abs(values.imag) < 1e-12 * np.maximum(np.abs(values), 1e-300)
    out = np.abs(values) > 1.0
    return (
        int((real & (values.real > 1.0)).sum()), int((real & (values.real < -1.0)).sum()), int((out & ~real).sum())
    )  # fmt: skip


def between(corrector: Corrector, one: Spot, other: Spot, at: int) -> list[SpecialPoint]:
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


def _located(corrector: Corrector, one: Spot, other: Spot, kind: str, at: int) -> SpecialPoint | None:
    """An event between two orbits, by the Illinois form of false position."""
    low, high, f_low, f_high = 0.0, 1.0, _test(one, kind), _test(other, kind)
    if not f_low * f_high < 0.0:
        return None
    best, side = one if abs(f_low) < abs(f_high) else other, 0
    part, off = (0.0 if best is one else 1.0), 1.0
    for _ in range(_HALVINGS):
        steep = (f_high - f_low) / (high - low)
        tried = low - f_low / steep
        try:
            spot = _between_at(corrector, one, other, tried)
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
    orbit = corrector.orbit(best)
    # a derivative that is off moves the place at which a multiplier seems to pass, and so does an orbit off its own
    off += _ACROSS * _unsettled(corrector, best) / float(np.linalg.norm(other.y - one.y))
    off += _derivative_error(corrector.family.flow, orbit) * abs(
        1.0 / (_test(other, kind) - _test(one, kind))
    )
    found = float(best.y[-1]) * corrector.span
    error = _moved(corrector, (one, best, other), part, off) + corrector.span * _unsettled(corrector, best)
    return SpecialPoint(kind, orbit, found, at, error)


def _derivative_error(flow: Flow, orbit: PeriodicOrbit) -> float:
    """Relative error of the return map's derivative."""
    if not isinstance(flow, Stroboscope):
        return _ROUNDING
    return max([_FINE, *(float(told.numbers["relative_error"]) for told in orbit.diagnostics)])


def _moved(corrector: Corrector, spots: tuple[Spot, Spot, Spot], part: float, off: float) -> float:
    """How far the parameter moves if the place between the first and the last orbit is off by *off*.

    It is read off the parabola through the three, since at a fold the parameter moves with the square alone.
    """
    first, middle, last = (float(spot.y[-1]) for spot in spots)
    if not 1e-6 < part < 1.0 - 1e-6:
        return abs(last - first) * corrector.span * off
    rise, fall = (middle - first) / part, (last - middle) / (1.0 - part)
    bend = fall - rise
    slope = rise + bend * part
    return (abs(slope) * off + abs(bend) * off**2) * corrector.span


def _unsettled(corrector: Corrector, spot: Spot) -> float:
    """How far an orbit may be off, as a state and over the range of the parameter, since it closes no better."""
    table = corrector.bordered(spot.came, spot.slope, spot.tangent)
    residual = max(float(np.linalg.norm(spot.came.x - spot.y[:-1])), _ROUNDING)
    least = float(np.linalg.svd(table, compute_uv=False)[-1])
    return residual / least if least > 0.0 else float("nan")


def _grazing(corrector: Corrector, one: Spot, other: Spot, at: int) -> SpecialPoint:
    """Where the number of impacts changes between two orbits, by halving."""
    sides = [one, other]
    low, high = 0.0, 1.0
    for _ in range(_HALVINGS):
        part = 0.5 * (low + high)
        try:
            spot = _between_at(corrector, one, other, part)
        except OrbitNotFoundError:
            break
        if spot.came.impacts == one.came.impacts:
            low, sides[0] = part, spot
        else:
            high, sides[1] = part, spot
    width = abs(float(sides[1].y[-1] - sides[0].y[-1])) * corrector.span
    found = float(sides[1].y[-1]) * corrector.span
    error = width + corrector.span * _unsettled(corrector, sides[1])
    return SpecialPoint("grazing", corrector.orbit(sides[1]), found, at, error)


def grazing_end(corrector: Corrector, spots: list[Spot]) -> SpecialPoint | None:
    """The grazing that a branch ends at, if its last orbit passes the tip without room to spare.

    The room left, over how fast it went along the branch, is by how much the place is off.
    """
    last = spots[-1]
    if not isinstance(corrector.family.flow, Stroboscope):
        return None
    orbit = corrector.orbit(last)
    scratch = orbit.contact_summary.clearance
    if not scratch < _TOUCHES:
        return None
    error, found = float("nan"), float(last.y[-1]) * corrector.span
    for before in reversed(spots[:-1]):
        way = abs(float(before.y[-1]) * corrector.span - found)
        fell = corrector.orbit(before).contact_summary.clearance - scratch
        if fell > max(scratch, _ROUNDING):
            error = 2.0 * scratch * way / fell + corrector.span * _unsettled(corrector, last)
            break
    return SpecialPoint("grazing", orbit, found, len(spots) - 1, error)
