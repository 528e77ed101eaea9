"""Every equilibrium of a structure with one tension term under a constant transverse force, and none missed."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from snapbeam.util.validation import InputError

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
        """True if the equilibrium is a well."""
        return self.unstable_directions == 0

    def __repr__(self) -> str:
        kinds = {0: "well", 1: "saddle"}
        kind = kinds.get(self.unstable_directions, f"{self.unstable_directions} unstable directions")
        return f"<Equilibrium: {kind} at {self.energy:.6g} J>"


def equilibria_of(stiffness: _Array, gamma: float, force: _Array) -> list[tuple[_Array, int]]:
    """All solutions alpha of K0 alpha + gamma (alpha . alpha) alpha = B, with their numbers of negative eigenvalues.

    With the eigenvalues kappa_i of K0, (N,) or (N, N), and B in its eigenvectors, alpha_i = B_i/(kappa_i + gamma s),
    where s = alpha . alpha solves one secular equation,

        h(s) = sum B_i^2/(kappa_i + gamma s)^2 - s = 0.

    Between two of its poles h is convex and has no root or two; beyond the last it falls, with one root, the well of
    minimum energy.  So all roots are found: the minimum value between two poles decides.  Where B_i = 0 and kappa_i < 0
    a pair with alpha_i of either sign may branch off at kappa_i + gamma s = 0.

    The tangent stiffness is K0 + gamma s and 2 gamma alpha alpha^T, of rank one: it has as many negative eigenvalues as
    there are kappa_i + gamma s < 0, less one where h rises.
    """
    if stiffness.ndim == 1:
        kappa, turned, axes = stiffness, force, None
    else:
        kappa, axes = np.linalg.eigh(stiffness)
        turned = axes.T @ force
    if gamma == 0.0:
        found = [(turned / kappa, int((kappa < 0.0).sum()))]
    else:
        stiff = np.abs(kappa)
        turned = np.where(np.abs(turned) < _NO_FORCE * stiff * np.sqrt(stiff / gamma), 0.0, turned)
        if not np.abs(turned).max(initial=0.0) < _MOST_FORCE:
            raise InputError(f"transverse_force: must be less than {_MOST_FORCE:g} N in each mode")
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
    at: _Array = (kappa if origin < 0 else kappa - kappa[origin]) + gamma * shift
    return at


@np.errstate(divide="ignore")
def _roots(kappa: _Array, force: _Array, gamma: float) -> list[tuple[int, float, bool]]:
    """The roots of the secular equation, each as a pole and the distance from it, and whether h rises there."""
    pushed = np.flatnonzero(force != 0.0)
    squares = force * force
    poles = [int(i) for i in pushed[np.argsort(-kappa[pushed], kind="stable")] if kappa[i] <= 0.0]
    edges = ([] if poles and kappa[poles[0]] == 0.0 else [-1]) + poles
    place = {i: 0.0 if i < 0 else -float(kappa[i]) / gamma for i in edges}

    squares = squares[pushed]
    from_pole = {i: (kappa if i < 0 else kappa - kappa[i])[pushed] for i in edges}

    def value(origin: int, shift: float) -> float:
        gap = from_pole[origin] + gamma * shift
        return float((squares / gap**2).sum()) - place[origin] - shift

    def slope(origin: int, shift: float) -> float:
        gap = from_pole[origin] + gamma * shift
        return -2.0 * gamma * float((squares / gap**3).sum()) - 1.0

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


def _lowest(slope: Callable[[int, float], float], left: int, right: int, width: float) -> tuple[int, float] | None:
    """Minimum of the convex function between two edges, from the nearer edge; None if it is at the left end."""
    if slope(left, 0.5 * width) > 0.0:
        if left < 0 and slope(left, 0.0) >= 0.0:
            return None
        return left, _distance(lambda t: slope(left, t), 0.5 * width, pole=left >= 0)
    return right, -_distance(lambda t: -slope(right, -t), 0.5 * width, pole=True)


def _bracketed(
    value: Callable[[int, float], float], slope: Callable[[int, float], float], origin: int, reach: float, sign: float
) -> tuple[int, float, bool]:
    """The root between a pole, or 0, and a place at the distance *reach* where the function is negative."""
    shift = sign * _distance(lambda t: -value(origin, sign * t), reach, pole=origin >= 0)
    for _ in range(_POLISHINGS):
        steep = slope(origin, shift)
        if not abs(value(origin, shift)) < _SMALL * abs(shift * steep):
            break
        shift -= value(origin, shift) / steep
    return origin, shift, sign < 0.0


def _distance(function: Callable[[float], float], reach: float, pole: bool) -> float:
    """Return the root in (0, *reach*] of a function that is negative near 0 and positive at *reach*.

    If 0 is a pole of the function, the search is in the logarithm of the distance.
    """
    from scipy.optimize import brentq

    if not function(reach) > 0.0:
        return reach
    if not pole:
        return 0.0 if function(0.0) >= 0.0 else float(brentq(function, 0.0, reach, xtol=1e-300, rtol=_ROUNDING))
    low = high = math.log(reach)
    if not function(math.exp(high)) > 0.0:  # a fold, where the function touches 0: a matter of rounding
        return reach
    while function(math.exp(low)) > 0.0:
        low -= 4.0
        if low < _LEAST:
            return math.exp(_LEAST)
    return math.exp(brentq(lambda u: function(math.exp(u)), low, high, xtol=1e-15, rtol=_ROUNDING))


_ROUNDING = 4.0 * float(np.finfo(np.float64).eps)
_LEAST = -700.0
_NO_FORCE = 1e-20
"""Force on a mode that no digit of an equilibrium shows, over that at its own buckling level."""
_MOST_FORCE = 1e100
_POLISHINGS = 2
_SMALL = 1e-6


def _branches(kappa: _Array, force: _Array, gamma: float) -> list[tuple[_Array, int]]:
    """The pairs that branch off in a mode without a transverse force of its own."""
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


# ----------------------------------------------------------------------------------------------------
# The wells of a structure under a transverse force, the saddle between them and what it takes to cross.


@dataclass(frozen=True, eq=False)
class Landscape:
    """Equilibria of a structure: wells and saddles."""

    equilibria: tuple[Equilibrium, ...]
    """Equilibria, ordered by energy."""
    lower: Equilibrium
    """The well whose centre is lower; the only one if there is one only."""
    upper: Equilibrium
    saddle: Equilibrium | None
    """The lowest between two wells; None if there is one well only."""

    @property
    def deepest(self) -> Equilibrium:
        """The well of minimum energy."""
        return self.lower if self.lower.energy <= self.upper.energy else self.upper

    @property
    def is_bistable(self) -> bool:
        """True if there are two wells."""
        return self.saddle is not None


def tangent_stiffness(stiffness: _Array, gamma: float, alpha: _Array, elongation: _Array | None = None) -> _Array:
    """K0 + gamma (s S + 2 S alpha alpha^T S), shape (..., N, N), with s = alpha . S alpha; S is the identity by default."""
    k0 = np.diag(stiffness) if stiffness.ndim == 1 else stiffness
    matrix = np.eye(alpha.shape[-1]) if elongation is None else elongation
    pulled = product(elongation, alpha)
    outer = pulled[..., :, None] * pulled[..., None, :]
    tangent: _Array = k0 + gamma * (dot(alpha, pulled)[..., None, None] * matrix + 2.0 * outer)
    return tangent


def dot(one: _Array, other: _Array) -> _Array:
    """Inner products of the last axes, one by one, so that none depends on the others of a batch."""
    return np.asarray((one[..., None, :] @ other[..., :, None])[..., 0, 0])


def product(matrix: _Array | None, alpha: _Array) -> _Array:
    """Products of a matrix, the identity by default, with vectors of shape (..., N), one by one."""
    return alpha if matrix is None else np.asarray((matrix @ alpha[..., None])[..., 0])


class Condensed(NamedTuple):
    """A structure in the coordinates r that its elongation r . r consists of; the others follow from them."""

    stiffness: _Array
    force: _Array
    back: _Array
    """alpha per unit of r, shape (N, R)."""
    rest: _Array
    """alpha at r = 0, shape (N,)."""
    unstable: int
    """Negative eigenvalues of the stiffness of the other coordinates."""


def condensed(stiffness: _Array, force: _Array, elongation: _Array) -> Condensed:
    """Eliminate the coordinates that do not change the elongation alpha . S alpha, by static condensation."""
    full = np.diag(stiffness) if stiffness.ndim == 1 else stiffness
    value, axes = np.linalg.eigh(elongation)
    stretched = value > 1e-12 * value[-1]
    own, other = axes[:, stretched] / np.sqrt(value[stretched]), axes[:, ~stretched]
    if not other.size:
        return Condensed(own.T @ full @ own, own.T @ force, own, np.zeros(force.size), 0)
    held = other.T @ full @ other
    kappa = np.linalg.eigvalsh(held)
    if np.abs(kappa).min() <= 1e-14 * max(float(np.abs(full).max()), 1e-300):
        raise InputError(
            "stiffness: is singular for a motion that elongation_matrix does not change; add a spring, or leave "
            "elongation_matrix out"
        )
    follow = -np.linalg.solve(held, other.T @ full @ own)
    rest = other @ np.linalg.solve(held, other.T @ force)
    back = own + other @ follow
    reduced = back.T @ full @ back
    return Condensed(0.5 * (reduced + reduced.T), back.T @ force, back, rest, int((kappa < 0.0).sum()))


def landscape_of(
    stiffness: _Array, gamma: float, force: _Array, midspan_shape: _Array, elongation: _Array | None = None
) -> Landscape:
    """All distinct equilibria under the transverse force B.

    At most two of them are stable: beyond the second eigenvalue of K0 + gamma s the term 2 gamma alpha alpha^T, of rank
    one, cannot make up for two negative ones.
    """
    found = []
    if elongation is None:
        solved = equilibria_of(stiffness, gamma, force)
    else:
        own = condensed(stiffness, force, elongation)
        solved = [
            (own.rest + own.back @ r, unstable + own.unstable)
            for r, unstable in equilibria_of(own.stiffness, gamma, own.force)
        ]
    for alpha, unstable in solved:
        alpha.setflags(write=False)
        bent = stiffness * alpha if stiffness.ndim == 1 else stiffness @ alpha
        square = float(alpha @ (alpha if elongation is None else elongation @ alpha))
        energy = 0.5 * float(alpha @ bent) + 0.25 * gamma * square * square - float(force @ alpha)
        found.append(Equilibrium(amplitude=alpha, energy=energy, unstable_directions=unstable))
    found.sort(key=lambda each: each.energy)
    wells = [each for each in found if each.is_stable]
    if not wells:
        raise InputError("transverse_force: no equilibrium is stable; must push a structure that stiffens")
    saddles = [each for each in found if each.unstable_directions == 1] or [
        each for each in found if not each.is_stable
    ]
    if len(wells) < 2:
        return Landscape(tuple(found), wells[0], wells[0], None)
    lower, upper = sorted(wells[:2], key=lambda each: float(midspan_shape @ each.amplitude))
    if not float(midspan_shape @ lower.amplitude) < float(midspan_shape @ upper.amplitude):
        raise InputError("midspan_shape: must tell the two wells apart, but both lie at the same height")
    return Landscape(tuple(found), lower, upper, saddles[0])


# ----------------------------------------------------------------------------------------------------
# What it takes a structure with unequal wells to pass a height: the bound behind early termination, with a transverse force.


_HALVINGS = 120
_BESIDE = 1e-9


def least_energy_through(stiffness: _Array, gamma: float, force: _Array, shapes: _Array, heights: _Array) -> _Array:
    """Minimum potential energy, J, (runs,), of any amplitudes with c . alpha = r, of *shapes* c and *heights* r, m.

    With S_cc = sum c_i^2/(K0_i - mu), S_cB = sum c_i B_i/(K0_i - mu) and S_BB alike, it is the maximum value of

        (r - S_cB)^2/(2 S_cc) - S_BB/2 - mu^2/(4 gamma)

    over mu below the first zero of S_cc.  For every mu, gamma s^2/4 >= -mu s/2 - mu^2/(4 gamma), s = alpha . alpha, so
    that the minimum of the remaining quadratic form on the plane is a lower bound.  It is attained: the bound is
    concave in mu, its slope is -(s + mu/gamma)/2 with the s of the minimising shape, and vanishes at mu = -gamma s.
    Without B it is that of equal wells.
    """
    squares = shapes * shapes
    different, which = np.unique(squares, axis=0, return_inverse=True)
    high = np.array([pinned_load(row, stiffness) for row in different])[which.ravel()]
    scale = float(np.abs(stiffness).max()) + float(np.abs(force).max()) ** (2.0 / 3.0) * gamma ** (1.0 / 3.0)

    def shape(mu: _Array) -> _Array:
        # at a pole the shape is a limit: beside it is near enough to say which way the bound rises
        gap = stiffness - mu[:, None]
        gap = np.where((gap == 0.0).any(axis=1)[:, None], gap - _BESIDE * scale, gap)
        first = np.sum(squares / gap, axis=1)
        held = (heights - np.sum(shapes * force / gap, axis=1)) / first
        found: _Array = (force + held[:, None] * shapes) / gap
        return found

    def rises(mu: _Array) -> NDArray[np.bool_]:
        alpha = shape(mu)
        up: NDArray[np.bool_] = -np.sum(alpha * alpha, axis=1) > mu / gamma
        return up

    with np.errstate(divide="ignore", invalid="ignore"):
        low = np.minimum(high, 0.0) - scale
        for _ in range(_HALVINGS):
            falls = ~rises(low)
            if not falls.any():
                break
            low = np.where(falls, high - 2.0 * (high - low), low)
        for _ in range(_HALVINGS):
            middle = 0.5 * (low + high)
            up = rises(middle)
            low, high = np.where(up, middle, low), np.where(up, high, middle)
        low = np.where((stiffness == low[:, None]).any(axis=1), low - _BESIDE * scale, low)
        gap = stiffness - low[:, None]
        first = np.sum(squares / gap, axis=1)
        off = heights - np.sum(shapes * force / gap, axis=1)
        value: _Array = 0.5 * off * off / first - 0.5 * np.sum(force * force / gap, axis=1) - low * low / (4.0 * gamma)
    return np.where(np.isfinite(value), value, -np.inf)


def pinned_load(square: _Array, k0: _Array) -> float:
    """Return the buckling load of the structure pinned at a point, less the present load.

    It is the lower of the first zero of S_cc and the load of the first mode with a node at the point.
    """
    touched = square > 1e-20 * square.max()
    free = np.sort(k0[~touched])
    poles = np.sort(k0[touched])
    lowest_free = float(free[0]) if free.size else np.inf
    if poles.size < 2:
        return lowest_free if np.isfinite(lowest_free) else float(poles[0] + 1e6 * abs(poles[0]))
    gap = poles[1] - poles[0]
    low, high = poles[0] + 1e-13 * gap, poles[1] - 1e-13 * gap
    # rises from -infinity to infinity; halved here: scipy.optimize would take a quarter of a second of each start
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        if np.sum(square[touched] / (k0[touched] - middle)) > 0.0:
            high = middle
        else:
            low = middle
    return min(float(0.5 * (low + high)), lowest_free)
