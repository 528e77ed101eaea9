"""Every equilibrium of a structure with one tension term under a constant side force, and none missed."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

__all__ = ["Equilibrium", "equilibria_of"]

_Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False, kw_only=True)
class Equilibrium:
    """A shape in which a structure can rest.

    Attributes
    ----------
    amplitude : array of shape (N,)
        alpha.
    energy : float
        Potential energy, J, 0 for the straight structure.
    unstable_directions : int
        Negative eigenvalues of the tangent stiffness: 0 in a well, 1 at a saddle.
    """

    amplitude: _Array
    energy: float
    unstable_directions: int

    @property
    def is_stable(self) -> bool:
        """Whether it is a well."""
        return self.unstable_directions == 0

    def __repr__(self) -> str:
        kinds = {0: "well", 1: "saddle"}
        kind = kinds.get(self.unstable_directions, f"{self.unstable_directions} unstable directions")
        return f"<Equilibrium: {kind} at {self.energy:.6g} J>"


def equilibria_of(stiffness: _Array, gamma: float, force: _Array) -> list[tuple[_Array, int]]:
    """All solutions alpha of K0 alpha + gamma (alpha . alpha) alpha = B.

    With the eigenvalues kappa_i of K0 and B in its eigenvectors, alpha_i = B_i/(kappa_i + gamma s), where
    s = alpha . alpha solves one secular equation,

        h(s) = sum B_i^2/(kappa_i + gamma s)^2 - s = 0.

    Between two of its poles h is convex and has no root or two; beyond the last it falls, with one root, the well of
    least energy.  So all roots are found: the least value between two poles decides.  Where B_i = 0 and kappa_i < 0 a
    pair with alpha_i of either sign may branch off at kappa_i + gamma s = 0.

    The tangent stiffness is K0 + gamma s and 2 gamma alpha alpha^T, of rank one: it has as many negative
    eigenvalues as there are kappa_i + gamma s < 0, less one where h rises.

    Parameters
    ----------
    stiffness : array of shape (N,) or (N, N)
        K0.
    gamma : float
        At least 0.
    force : array of shape (N,)
        B.

    Returns
    -------
    list of pairs
        alpha, shape (N,), and the number of negative eigenvalues there.
    """
    if stiffness.ndim == 1:
        kappa, turned, axes = stiffness, force, None
    else:
        kappa, axes = np.linalg.eigh(stiffness)
        turned = axes.T @ force
    if gamma == 0.0:
        found = [(turned / kappa, int((kappa < 0.0).sum()))]
    else:
        found = [_amplitude(kappa, turned, gamma, *root) for root in _roots(kappa, turned, gamma)]
        found += _branches(kappa, turned, gamma)
    return found if axes is None else [(axes @ each, index) for each, index in found]


def _amplitude(
    kappa: _Array, force: _Array, gamma: float, origin: int, shift: float, rises: bool
) -> tuple[_Array, int]:
    """alpha at s = s_origin + shift, the pole of mode *origin*, or 0 for -1; and how unstable it is."""
    alpha = np.zeros_like(force)
    pushed, gap = force != 0.0, _gap(kappa, gamma, origin, shift)
    alpha[pushed] = (force / gap)[pushed]
    return alpha, int((gap < 0.0).sum()) - int(rises)


def _gap(kappa: _Array, gamma: float, origin: int, shift: float) -> _Array:
    """kappa_i + gamma s, exact for the mode whose pole is near."""
    with np.errstate(divide="ignore"):
        at: _Array = (kappa if origin < 0 else kappa - kappa[origin]) + gamma * shift
    return at


def _roots(kappa: _Array, force: _Array, gamma: float) -> list[tuple[int, float, bool]]:
    """The roots of the secular equation, each as a pole and the distance from it, and whether h rises there."""
    pushed = np.flatnonzero(force != 0.0)
    squares = force * force
    poles = [int(i) for i in pushed[np.argsort(-kappa[pushed], kind="stable")] if kappa[i] <= 0.0]
    edges = ([] if poles and kappa[poles[0]] == 0.0 else [-1]) + poles
    place = {i: 0.0 if i < 0 else -float(kappa[i]) / gamma for i in edges}

    def value(origin: int, shift: float) -> float:
        gap = _gap(kappa, gamma, origin, shift)[pushed]
        with np.errstate(divide="ignore"):
            return float(np.sum(squares[pushed] / gap**2)) - place[origin] - shift

    def slope(origin: int, shift: float) -> float:
        gap = _gap(kappa, gamma, origin, shift)[pushed]
        with np.errstate(divide="ignore"):
            return -2.0 * gamma * float(np.sum(squares[pushed] / gap**3)) - 1.0

    found: list[tuple[int, float, bool]] = []
    for left, right in pairwise(edges):
        width = place[right] - place[left]
        if width <= 0.0:
            continue
        low = _lowest(slope, left, right, width)
        if low is None or value(*low) >= 0.0:
            continue
        from_left = low[1] if low[0] == left else width + low[1]
        from_right = low[1] if low[0] == right else low[1] - width
        found.append(_bracketed(value, slope, left, from_left, +1.0))
        found.append(_bracketed(value, slope, right, -from_right, -1.0))
    last = edges[-1]
    beyond = math.sqrt(float(squares.sum())) ** (2.0 / 3.0) / gamma ** (2.0 / 3.0) + 1e-300
    while value(last, beyond) > 0.0:
        beyond *= 2.0
    found.append(_bracketed(value, slope, last, beyond, +1.0))
    return found


def _lowest(
    slope: Callable[[int, float], float], left: int, right: int, width: float
) -> tuple[int, float] | None:
    """Where the convex function between two edges is least, from the nearer of them; None if at the left end."""
    if slope(left, 0.5 * width) > 0.0:
        if left < 0 and slope(left, 0.0) >= 0.0:
            return None
        return left, _distance(lambda t: slope(left, t), 0.5 * width, pole=left >= 0)
    return right, -_distance(lambda t: -slope(right, -t), 0.5 * width, pole=True)


def _bracketed(
    value: Callable[[int, float], float],
    slope: Callable[[int, float], float],
    origin: int,
    reach: float,
    sign: float,
) -> tuple[int, float, bool]:
    """The root between a pole, or 0, and a place at the distance *reach* where the function is negative."""
    shift = sign * _distance(lambda t: -value(origin, sign * t), reach, pole=origin >= 0)
    for _ in range(_POLISHINGS):
        change = value(origin, shift) / slope(origin, shift)
        if not abs(change) < _SMALL * abs(shift):
            break
        shift -= change
    return origin, shift, sign < 0.0


def _distance(function: Callable[[float], float], reach: float, pole: bool) -> float:
    """The root in (0, *reach*] of a function that is negative near 0 and positive at *reach*, by its logarithm if
    0 is a pole of it."""
    from scipy.optimize import brentq

    if not function(reach) > 0.0:
        return reach
    if not pole:
        return (
            0.0 if function(0.0) >= 0.0 else float(brentq(function, 0.0, reach, xtol=1e-300, rtol=_ROUNDING))
        )
    low = math.log(reach)
    while function(math.exp(low)) > 0.0:
        low -= 4.0
        if low < _LEAST:
            return math.exp(_LEAST)
    return math.exp(brentq(lambda u: function(math.exp(u)), low, math.log(reach), xtol=1e-15, rtol=_ROUNDING))


_ROUNDING = 4.0 * float(np.finfo(np.float64).eps)
_LEAST = -700.0
_POLISHINGS = 2
_SMALL = 1e-6


def _branches(kappa: _Array, force: _Array, gamma: float) -> list[tuple[_Array, int]]:
    """The pairs that branch off in a mode without a side force of its own."""
    found = []
    for i in np.flatnonzero((force == 0.0) & (kappa < 0.0)):
        alpha = np.zeros_like(force)
        pushed = force != 0.0
        gap = kappa - kappa[i]
        if (gap[pushed] == 0.0).any():
            continue
        alpha[pushed] = force[pushed] / gap[pushed]
        square = -float(kappa[i]) / gamma - float(alpha @ alpha)
        if square > 0.0:
            for sign in (-1.0, 1.0):
                one = alpha.copy()
                one[i] = sign * math.sqrt(square)
                found.append((one, int((gap < 0.0).sum())))
    return found
