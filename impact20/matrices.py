"""Matrices of the beams and of the bar, from stated formulas: `python -m impact20.matrices` writes `data/`.

Nothing here comes from a solver.  Every structure is given in its linear modes, normalised to unit modal mass.
"""

import json
from math import pi, sqrt
from typing import Any

import numpy as np
from scipy.linalg import eigh
from scipy.optimize import brentq

from impact20 import FOLDER, Array

DAMPING = 0.005
BASE = 0.2
"""Acceleration amplitude of the base over b omega_1^2."""


def buckled_beam(modes: int) -> dict[str, Any]:
    """A steel beam between clamps, buckled, on its first buckling modes.

    SI data: length 0.161 m, thickness 0.4 mm, width 15 mm, density 7800 kg/m3, Young's modulus 200 GPa, height of
    the centre b = 0.335 mm; contact stiffness 4e8 N/m^1.5 at x = length/2.1.  Buckling modes with
    integral(phi_i' phi_j') = delta_ij have the wavenumbers k_i L = (i + 1) pi (i odd) and tan(k_i L/2) = k_i L/2 (i
    even), the amplitude sqrt(2/L)/k_i, and

        m_ij = rho S (delta_ij + c_ij)/(k_i k_j),  c_ij = 2 (both odd), 2/3 (both even), 0 (mixed),
        U = sum (E I k_i^2 - P) a_i^2/2 + gamma (a . a)^2/4,  gamma = E S/(2 L),  P = P_cr + pi^2 E S b^2/(4 L^2).

    About the lower well a_0 = (-sqrt((P - P_cr)/gamma), 0, ...) the stiffness is K_11 = 2 gamma a_0^2,
    K_ii = E I (k_i^2 - k_1^2); its modes V (V^T m V = 1) give G = V^T V and g = V^T a_0.  Units: length b, time
    1/omega_1, mass such that the modal mass is 1 for a displacement w = row . x in b.
    """
    length, thickness, width, density, young, level = 0.161, 0.4e-3, 15e-3, 7800.0, 200e9, 0.335e-3
    area, inertia = thickness * width, width * thickness**3 / 12
    wave = []
    for i in range(1, modes + 1):
        if i % 2:
            wave.append((i + 1) * pi / length)
        else:  # the (i/2)-th root of tan z = z, z = k L/2
            n = i // 2
            root = brentq(lambda z: np.sin(z) - z * np.cos(z), n * pi + 1e-9, (n + 0.5) * pi, xtol=1e-15, rtol=1e-15)
            wave.append(2 * root / length)
    k = np.array(wave)
    odd = np.arange(1, modes + 1) % 2 == 1
    coupled = np.where(np.outer(odd, odd), 2.0, np.where(np.outer(~odd, ~odd), 2.0 / 3.0, 0.0))
    mass = density * area * (np.eye(modes) + coupled) / np.outer(k, k)
    extra = pi**2 * young * area * level**2 / (4 * length**2)  # P - P_cr
    gamma = young * area / (2 * length)
    well = np.zeros(modes)
    well[0] = -sqrt(extra / gamma)
    stiffness = young * inertia * (k**2 - k[0] ** 2)
    stiffness[0] = 2 * gamma * well[0] ** 2

    def shape(at: float) -> Array:
        xi = at * length - length / 2
        even = -2 * xi / length + np.sin(k * xi) / np.sin(k * length / 2)
        return sqrt(2 / length) / k * np.where(odd, 1 - np.cos(k * at * length), even)

    # The parities do not couple in the mass matrix: two eigenvalue problems keep their zeros exact.
    squares, vectors = np.zeros(modes), np.zeros((modes, modes))
    for block in (np.flatnonzero(odd), np.flatnonzero(~odd)):
        if block.size:
            found, basis = eigh(np.diag(stiffness[block]), mass[np.ix_(block, block)])
            squares[block] = found
            vectors[np.ix_(block, block)] = basis
    order = np.argsort(squares)
    omega, vectors = np.sqrt(squares[order]), vectors[:, order]
    signs = np.sign(vectors.T @ shape(1 / 2.1))
    vectors = vectors * signs
    # q = b q* sqrt(kg): with x = q/b and time 1/omega_1 the cubic term scales with gamma b^2/omega_1^2.
    first = omega[0]
    struck, centre = vectors.T @ shape(1 / 2.1), vectors.T @ shape(0.5)
    # integral(phi_i) over the length: sqrt(2/L)/k_i L (odd), 0 (even); a base of acceleration a loads rho S a integral(phi).
    participation = vectors.T @ (density * area * np.where(odd, sqrt(2 * length) / k, 0.0))
    push = 4e8 * sqrt(level) / first**2  # f/(b omega_1^2) = push d*^1.5, 1/kg
    return {
        "structure": {
            "stiffness": ((omega / first) ** 2).tolist(),
            "damping": (2 * DAMPING * omega / first).tolist(),
            "gamma": gamma * level**2 / first**2,
            "coupling": (vectors.T @ vectors).tolist(),
            "gradient": (vectors.T @ well / level).tolist(),
        },
        # w/b = row . x; the force along the same row has unit mass 1 kg.
        "rows": {
            "contact": struck.tolist(),
            "centre": centre.tolist(),
            "stop": (-struck).tolist(),
            # Inertial load of a base with the acceleration amplitude BASE.
            "base": (BASE * participation).tolist(),
        },
        "contact_stiffness": push,
        "unit_of_time_s": 1 / first,
        "unit_of_length_m": level,
        "note": buckled_beam.__doc__,
    }


def clamped_beam_and_sphere(modes: int = 16, ratio: float = 0.2) -> dict[str, Any]:
    """A straight clamped beam on its first vibration modes, and a free sphere as the last coordinate.

    cos z cosh z = 1; phi(x) = cosh zx - cos zx - s (sinh zx - sin zx), s = (cosh z - cos z)/(sinh z - sin z), which has
    integral(phi^2) = 1.  Units: length of the beam for x, mass of the beam, first angular frequency; omega_i =
    (z_i/z_1)^2.  The sphere's mass is *ratio*; in its coordinate x_s sqrt(ratio) the modal mass is 1, too.
    """
    roots = []
    for i in range(1, modes + 1):
        middle = (i + 0.5) * pi
        roots.append(brentq(lambda z: np.cos(z) - 1 / np.cosh(z), middle - 0.1, middle + 0.1, xtol=1e-15, rtol=1e-15))
    z = np.array(roots)
    s = (np.cosh(z) - np.cos(z)) / (np.sinh(z) - np.sin(z))
    # sinh and cosh of large arguments cancel: exponentials of -zx and z(x - 1), with 1 - s and 1 + s written out.
    rest = (np.cos(z) - np.sin(z) - np.exp(-z)) / (np.sinh(z) - np.sin(z))  # 1 - s

    def shape(x: float) -> Array:
        rising = rest * np.exp(z * x) / 2
        return rising + (1 + s) * np.exp(-z * x) / 2 - np.cos(z * x) + s * np.sin(z * x)

    omega = (z / z[0]) ** 2
    row, centre = shape(0.4), shape(0.5)
    return {
        "structure": {"stiffness": [*(omega**2).tolist(), 0.0], "damping": [*(2 * DAMPING * omega).tolist(), 0.0]},
        # The penetration is the sphere's displacement less the beam's: d = x_s/sqrt(ratio) - phi . q = -row . x.
        "rows": {
            "contact": [*row.tolist(), -1 / sqrt(ratio)],
            "centre": [*centre.tolist(), 0.0],
            "sphere": [0.0] * modes + [1 / sqrt(ratio)],
        },
        "note": clamped_beam_and_sphere.__doc__,
    }


def bar(elements: int = 199, ratio: float = 0.5) -> dict[str, Any]:
    """A free-fixed bar of linear finite elements with consistent mass, and a sphere: 200 coordinates.

    Units: length, mass and wave speed of the bar are 1; h = 1/elements.  K = tridiag(-1, 2, -1)/h and M = h
    tridiag(1, 4, 1)/6 with the halves 1/h and h/3 at the free end; the fixed end is left out.  The sphere of mass
    *ratio* is the last coordinate, x_s sqrt(ratio).  Modal damping 0.002.  The modes of (K, M) serve as coordinates; the
    matrices themselves are stated here for codes that use them.
    """
    h = 1.0 / elements
    k = (np.diag(np.full(elements, 2.0)) - np.eye(elements, k=1) - np.eye(elements, k=-1)) / h
    m = (np.diag(np.full(elements, 4.0)) + np.eye(elements, k=1) + np.eye(elements, k=-1)) * h / 6
    k[0, 0], m[0, 0] = 1 / h, h / 3
    squares, vectors = eigh(k, m)
    struck = vectors[0]
    vectors = vectors * np.where(struck < 0, -1.0, 1.0)
    return {
        "structure": {
            "stiffness": [*squares.tolist(), 0.0],
            "damping": [*(2 * 0.002 * np.sqrt(squares)).tolist(), 0.0],
        },
        "rows": {
            "contact": [*vectors[0].tolist(), -1 / sqrt(ratio)],
            "end": [*vectors[0].tolist(), 0.0],
            "sphere": [0.0] * elements + [1 / sqrt(ratio)],
        },
        "note": bar.__doc__,
    }


def write() -> None:
    """Write the data files."""
    folder = FOLDER / "data"
    folder.mkdir(exist_ok=True)
    made = {f"beam_{n}": buckled_beam(n) for n in (1, 4, 8, 32)}
    made |= {"sphere_on_beam": clamped_beam_and_sphere(), "bar_200": bar()}
    for name, content in made.items():
        (folder / f"{name}.json").write_text(json.dumps(content, indent=0) + "\n", encoding="utf-8")


if __name__ == "__main__":
    write()
