"""Exact natural frequencies of a beam between rotational springs, straight or buckled.

With Lambda the load after bending, phi and alpha the first buckling mode and its amplitude,

    E I v'''' + Lambda v'' - 2 gamma alpha^2 (integral of phi' v') phi'' = rho S omega^2 v

(alpha = 0 for the straight beam), under E I v'' = k_left v' at the left end and -k_right v' at the right one.  Its
solutions are sines, exponentials and, of the buckled beam, phi'' itself, which solves the left side without the last
term.  The determinant of what they must fulfil changes its sign at every frequency; the reduced model, whose
frequencies are a little too high, says where to look.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from snapbeam.core.validate import InputError
from snapbeam.model.beam import Beam

__all__ = ["spring_natural_frequency"]

_Array = NDArray[np.float64]
_NODES = 16
_ABOVE = 1e-8
_STEPS = 60


def spring_natural_frequency(beam: Beam, count: int, reduced: _Array) -> _Array:
    """The first *count* frequencies, Hz, near those of a reduced model, which are upper bounds of them.

    Raises
    ------
    InputError
        If one is not found where the reduced model says.
    """
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
