"""Exact natural frequencies of the clamped-clamped beam, straight or buckled.

Scaled by L, by the radius of gyration r and by sqrt(E I/(rho S L^4)), small motions about the equilibrium
obey, with p = P L^2/(E I) below the critical load and p = 4 pi^2 and the buckling level b/r above it,

    v'''' + p v'' - omega^2 v = -sigma cos(2 pi x) * integral of cos(2 pi x) v,    sigma = 4 pi^4 (b/r)^2

(sigma = 0 for the straight beam; Nayfeh and Emam, Nonlinear Dyn. 54, 2008, for the buckled one).  The
left side has the wavenumbers s1 = 2 theta and s2 with s1^2 - s2^2 = p and s1 s2 = omega.  Every equation
is solved in eta = theta - theta_0 >= 0, theta_0 = sqrt(max(p, 0))/2, where s2 is free of cancellation, and
is written so that each root has an interval of its own, known in advance: none is missed or found twice.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from snapbeam.model.beam import Beam
from snapbeam.model.buckling_modes import MAX_MODES
from snapbeam.util.validation import InputError, instance, integer

# ----------------------------------------------------------------------------------------------------
# Exact natural frequencies of a beam between rotational springs, straight or buckled.
#
# With Lambda the load after bending, phi and alpha the first buckling mode and its amplitude,
#
#     E I v'''' + Lambda v'' - 2 gamma alpha^2 (integral of phi' v') phi'' = rho S omega^2 v
#
# (alpha = 0 for the straight beam), under E I v'' = k_left v' at the left end and -k_right v' at the right one.  Its
# solutions are sines, exponentials and, of the buckled beam, phi'' itself, which solves the left side without the last
# term.  The determinant of what they must fulfil changes its sign at every frequency; the reduced model, whose
# frequencies are a little too high, says where to look.


_NODES = 16
_ABOVE = 1e-8
_STEPS = 60


def spring_natural_frequency(beam: Beam, count: int, reduced: _Array) -> _Array:
    """The first *count* frequencies, Hz, near those of a reduced model, which are upper bounds of them."""
    balance = _balance_of(beam)
    found: list[float] = []
    for at in range(count):
        top, width = float(reduced[at]) * (1.0 + _ABOVE), 1e-8
        low = top
        for _ in range(_STEPS):
            low = top * (1.0 - width)
            floor = found[-1] * (1.0 + 1e-9) if found else 0.0
            if low <= floor:
                raise InputError(f"count = {count}: frequency {at + 1} of this beam could not be located")
            if balance(low) * balance(top) < 0.0:
                break
            width *= 1.6
        from scipy.optimize import brentq

        found.append(float(brentq(balance, low, top, xtol=1e-13 * top, rtol=4.0 * np.finfo(np.float64).eps)))
    return np.array(found)


def _balance_of(beam: Beam) -> Callable[[float], float]:
    """The determinant over frequencies in Hz; lengths over L, loads over E I/L^2."""
    length, stiff = beam.length, beam.bending_stiffness
    unit = math.sqrt(stiff / beam.mass_per_length) / length**2
    modes = beam.buckling_modes(1)
    load = min(beam.axial_load, beam.critical_load) * length**2 / stiff
    springs = [
        None if each is None else each * length / stiff
        for each in (beam.boundary.left_rotational_stiffness, beam.boundary.right_rotational_stiffness)
    ]
    nodes, weights = np.polynomial.legendre.leggauss(_NODES)
    panels = np.linspace(0.0, 1.0, 257)
    half = 0.5 * np.diff(panels)
    x = (panels[:-1, None] + half[:, None] * (1.0 + nodes)).ravel()
    weight = (half[:, None] * weights).ravel()
    # phi'' over its own root mean square, and the weight of the last term in it
    bent = modes.curvature(np.concatenate((x, [0.0, 1.0])) * length)[0]
    norm = math.sqrt(float(np.sum(weight * bent[:-2] ** 2)))
    bent = bent / norm
    if beam.is_buckled:
        alpha = beam.buckling_level / float(modes.shape(0.5 * length)[0])
        sigma = 2.0 * beam.nonlinear_stiffness * alpha**2 * norm**2 * length**5 / stiff
    else:
        sigma = 0.0
    wave = float(modes.wavenumber[0]) * length
    slope = modes.slope(np.array([0.0, length]))[0]
    third = -(wave**2) * (slope - _mean_slope(modes, length)) * length / norm / length**2

    def balance(freq: float) -> float:
        omega = 2.0 * math.pi * freq / unit
        root = math.sqrt(0.25 * load * load + omega * omega)
        first, second = math.sqrt(0.5 * load + root), math.sqrt(root - 0.5 * load)
        rows = []
        for end, spring in ((0.0, springs[0]), (1.0, springs[1])):
            outward = 1.0 if end == 0.0 else -1.0
            values = [_values(end, first, second, order) for order in range(3)]
            own = [float(bent[-2 if end == 0.0 else -1]), float(third[0 if end == 0.0 else 1])]
            rows.append([*values[0], own[0]])
            # v'' - k v' = 0, or v' = 0 between clamps; of phi'' the two derivatives are third and fourth ones of phi
            fourth = -(wave**2) * own[0]
            if spring is None:
                rows.append([*values[1], own[1]])
            else:
                rows.append(
                    [
                        *(b - outward * spring * a for a, b in zip(values[1], values[2], strict=True)),
                        fourth - outward * spring * own[1],
                    ]
                )
        if sigma == 0.0:
            matrix = np.array(rows)[:, :4]
        else:
            seen = [float(np.sum(weight * bent[:-2] * each)) for each in _values(x, first, second, 0)]
            rows.append([*(sigma * each for each in seen), sigma - omega * omega])
            matrix = np.array(rows)
        matrix = matrix / np.abs(matrix).max(axis=1, keepdims=True)
        return float(np.linalg.det(matrix))

    return balance


def _mean_slope(modes: object, length: float) -> float:
    """phi' less what of it solves phi''' + k^2 phi' = 0: the slope of the straight part."""
    parts = getattr(modes, "_parts", None)
    return 0.0 if parts is None else float(parts[1, 0]) / length


def _values(x: _Array | float, first: float, second: float, order: int) -> list[_Array | float]:
    """Sine, cosine and the two exponentials, each from its own end, or a derivative of them."""
    turn = 0.5 * math.pi * order
    return [
        first**order * np.sin(first * x + turn),
        first**order * np.cos(first * x + turn),
        (-second) ** order * np.exp(-second * x),
        second**order * np.exp(-second * (1.0 - x)),
    ]


# ----------------------------------------------------------------------------------------------------


_Array = NDArray[np.float64]
_CRITICAL = 4.0 * math.pi**2
_RELATIVE = 4.0 * np.finfo(np.float64).eps
_MAX_COUNT = 1000


def exact_natural_frequencies(beam: Beam, count: int = 10) -> _Array:
    """Natural frequencies of the beam about its equilibrium, Hz, ascending, without any truncation.

    Of a beam whose ends turn, :mod:`snapbeam.model.natural_frequencies`; between clamps:

    - Antisymmetric motions do not feel the buckling level: tan(s1/2) = (s1/s2) tanh(s2/2).
    - Symmetric motions of the straight beam: tan(s1/2) = -(s2/s1) tanh(s2/2).
    - Symmetric motions of the buckled beam: the right side is a rank-one term, so the eigenvalues omega^2
      are the zeros of 1 + sigma R(omega^2), R the response of the unbuckled operator to cos(2 pi x),
      seen by cos(2 pi x).  R rises from -inf to +inf between the eigenvalues of that operator (those of
      the straight beam at its critical load), and one root lies in each interval between them.

    Parameters
    ----------
    beam : Beam
        Straight (any axial load up to the critical one, or tension) or buckled (any level).
    count : int
        Number of frequencies, 1 to 1000.

    Returns
    -------
    array of shape (count,)

    See Also
    --------
    snapbeam.Beam, snapbeam.ReducedModel
    """
    instance("beam", beam, Beam, "a Beam")
    count = integer("count", count, 1, _MAX_COUNT)
    if beam.boundary.is_elastic:
        return _between_springs(beam, integer("count", count, 1, MAX_MODES // 4))
    unit = math.sqrt(beam.bending_stiffness / beam.mass_per_length) / beam.length**2
    if beam.is_buckled:
        sigma = 4.0 * math.pi**4 * (beam.buckling_level / beam.radius_of_gyration) ** 2
        if beam.boundary.axial_support_stiffness is not None:
            sigma *= beam.nonlinear_stiffness / (beam.young_modulus * beam.area / (2.0 * beam.length))
        omega = _antisymmetric(_CRITICAL, count) + _symmetric_buckled(sigma, count)
    else:
        p = min(beam.axial_load * beam.length**2 / beam.bending_stiffness, _CRITICAL)
        omega = _antisymmetric(p, count) + [_omega(p, eta) for eta in _symmetric(p, count)]
    return np.sort(np.array(omega))[:count] * unit / (2.0 * math.pi)


def _between_springs(beam: Beam, count: int) -> _Array:
    from snapbeam.model.reduced_model import ReducedModel

    modes = min(MAX_MODES, max(4 * count, 24))
    return spring_natural_frequency(beam, count, ReducedModel.from_beam(beam, modes=modes).natural_frequencies)


def _wavenumbers(p: float, eta: float) -> tuple[float, float]:
    """s1 and s2 at theta = theta_0 + eta."""
    root = math.sqrt(max(p, 0.0))
    return root + 2.0 * eta, math.sqrt(4.0 * eta * (root + eta) + max(-p, 0.0))


def _omega(p: float, eta: float) -> float:
    s1, s2 = _wavenumbers(p, eta)
    return s1 * s2


def _root(function: Callable[[float], float], low: float, high: float) -> float:
    from scipy.optimize import brentq

    return float(brentq(function, low, high, xtol=1e-300, rtol=_RELATIVE, maxiter=500))


def _antisymmetric(p: float, count: int) -> list[float]:
    """omega of the antisymmetric motions; the m-th has theta in (m pi, (m + 1/2) pi)."""
    start = 0.5 * math.sqrt(max(p, 0.0))
    omega = []
    for m in range(1, count + 1):

        def balance(eta: float, base: float = m * math.pi - start) -> float:
            s1, s2 = _wavenumbers(p, eta)
            steep = s1 * math.tanh(0.5 * s2) / s2 if s2 > 0.0 else 0.5 * s1
            return eta - base - math.atan(steep)

        base = m * math.pi - start
        omega.append(_omega(p, _root(balance, max(base, 0.0), base + 0.5 * math.pi)))
    return omega


def _symmetric(p: float, count: int) -> list[float]:
    """eta of the symmetric motions without buckling; the m-th has theta in ((m - 1/2) pi, m pi)."""
    start = 0.5 * math.sqrt(max(p, 0.0))
    roots = []
    for m in range(1, count + 1):

        def balance(eta: float, base: float = m * math.pi - start) -> float:
            s1, s2 = _wavenumbers(p, eta)
            return eta - base + math.atan2(s2 * math.tanh(0.5 * s2), s1)

        base = m * math.pi - start
        roots.append(_root(balance, max(base - 0.5 * math.pi, 0.0), base))
    return roots


def _symmetric_buckled(sigma: float, count: int) -> list[float]:
    """omega of the symmetric motions of the buckled beam; the m-th lies between neighbouring poles.

    With t = tanh(s2/2), theta = pi + eta, D = s1 sin(eta) + s2 t cos(eta) (whose zeros are the poles) and
    B = 2 t sin(eta) (s1/s2 + s2/s1), omega^2 R = B/D - 1/2.
    """
    poles = _symmetric(_CRITICAL, count + 1)
    poles[0] = 0.0

    def balance(eta: float) -> float:
        """(1 + sigma R) D, which keeps the zeros and has no poles."""
        s1, s2 = _wavenumbers(_CRITICAL, eta)
        t = math.tanh(0.5 * s2)
        d = s1 * math.sin(eta) + s2 * t * math.cos(eta)
        b = 2.0 * t * math.sin(eta) * (s1 / s2 + s2 / s1)
        return d + sigma * (b - 0.5 * d) / (s1 * s2) ** 2

    omega = []
    for m in range(1, count + 1):
        # a root comes nowhere near the pole on its right: a step off it keeps clear of rounding
        left, right = poles[m - 1], poles[m] * (1.0 - 1e-12)
        if m == 1:
            # omega^2 -> sigma/6 as b -> 0; well below that and the first pole 1 + sigma R is negative
            left = min(1e-4 * sigma / (6.0 * 16.0 * math.pi**3), 1e-3 * right)
        # D is positive in the first interval and changes sign at each pole.  Where rounding hides the sign
        # just right of a pole, the root has not moved from it.
        sign = 1.0 if m % 2 else -1.0
        hidden = sign * balance(left) >= 0.0
        omega.append(_omega(_CRITICAL, left if hidden else _root(balance, left, right)))
    return omega
