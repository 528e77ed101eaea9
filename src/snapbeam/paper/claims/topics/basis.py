"""Section 3.1: the buckling modes as a basis, and what another basis would do."""

from __future__ import annotations

import math
from functools import cache
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

import snapbeam as sb
from snapbeam.model.buckling_modes import BucklingModes
from snapbeam.model.default_values import BEAM, MODES
from snapbeam.paper.claims.claim_result import ClaimResult, Quantity, above, below, found
from snapbeam.paper.system import paper_model

if TYPE_CHECKING:
    from snapbeam.paper.recipe import Results

_Array = NDArray[np.float64]


@cache
def _quadrature() -> tuple[_Array, _Array]:
    """Nodes along the beam, m, and weights, exact for the products of the first 32 modes."""
    at, weight = np.polynomial.legendre.leggauss(240)
    return 0.5 * BEAM.length * (at + 1.0), 0.5 * BEAM.length * weight


def apex(results: Results) -> ClaimResult:
    """20a: Eq. (2) against the static solution of Eq. (11), its integrals by quadrature."""
    x, weight = _quadrature()
    modes = BucklingModes(BEAM.length, 1)
    stiffness = BEAM.bending_stiffness * float(weight @ modes.curvature(x)[0] ** 2) - BEAM.axial_load
    alpha = math.sqrt(-stiffness / BEAM.nonlinear_stiffness)
    height = alpha * float(modes.shape(0.5 * BEAM.length)[0])
    off = Quantity(abs(height / BEAM.buckling_level - 1.0), 1e-9)
    return found(below(off.value, 1e-8), off=off, height=1e3 * height)


def wavenumbers(results: Results) -> ClaimResult:
    """20b: the wavenumbers of Eq. (7) make the matrix of Eq. (6) singular."""

    def smallest(z: float) -> float:
        matrix = np.array(
            [
                [0.0, 1.0, 0.0, 1.0],
                [z, 0.0, 1.0, 0.0],
                [math.sin(z), math.cos(z), 1.0, 1.0],
                [z * math.cos(z), -z * math.sin(z), 1.0, 0.0],
            ]
        )
        scaled = matrix / np.linalg.norm(matrix, axis=1, keepdims=True)
        return float(np.linalg.svd(scaled, compute_uv=False)[-1])

    z = BucklingModes(BEAM.length, MODES).wavenumber * BEAM.length
    at = max(smallest(float(value)) for value in z)
    between = min(smallest(float(value)) for value in 0.5 * (z[1:] + z[:-1]))
    return found(below(at, 1e-6 * between), at=Quantity(at, 1e-15), between=between)


def orthogonality(results: Results) -> ClaimResult:
    """20c: Eq. (9), by quadrature."""
    x, weight = _quadrature()
    slope = BucklingModes(BEAM.length, MODES).slope(x)
    worst = float(np.abs((slope * weight) @ slope.T - np.eye(MODES)).max())
    return found(below(worst, 1e-9), worst=Quantity(worst, 1e-12))


def checkerboard(results: Results) -> ClaimResult:
    """20d: the mass matrix couples modes of one parity and no others, by quadrature."""
    x, weight = _quadrature()
    shape = BucklingModes(BEAM.length, MODES).shape(x)
    mass = (shape * weight) @ shape.T
    relative = np.abs(mass) / np.sqrt(np.outer(np.diag(mass), np.diag(mass)))
    same = np.add.outer(np.arange(MODES), np.arange(MODES)) % 2 == 0
    across, within = float(relative[~same].max()), float(relative[same].min())
    lopsided = float(np.abs(mass - mass.T).max() / np.abs(mass).max())
    return found(
        below(across, 1e-9) & below(lopsided, 1e-9) & above(within, 0.01),
        across=Quantity(across, 1e-12), within=within,
    )  # fmt: skip


def no_buckling_level(results: Results) -> ClaimResult:
    """18: buckling modes do not depend on the buckling level, the dynamic modes about a well do."""
    x = np.linspace(0.01, 0.99, 99)
    few = 4
    shapes, dynamic = [], []
    for level in (BEAM.buckling_level, 2.0 * BEAM.buckling_level):
        model = sb.ReducedModel.from_beam(BEAM.replace(buckling_level=level), modes=MODES)
        phi = np.array([model.shape_at(float(at)) for at in x])
        shapes.append(phi[:, :few] / np.abs(phi[:, :few]).max(axis=0))
        psi = phi @ model.linear_modes
        # symmetric and antisymmetric modes change places: one of each parity is followed
        psi = psi[:, [int(np.flatnonzero(model.parity == parity)[0]) for parity in (1, -1)]]
        at = np.argmax(np.abs(psi), axis=0)
        dynamic.append(psi / psi[at, range(2)])
    buckling = float(np.abs(shapes[1] - shapes[0]).max())
    change = float(np.abs(dynamic[1] - dynamic[0]).max())
    return found(
        below(buckling, 1e-12) & above(change, 0.01),
        buckling=Quantity(buckling, 1e-15), dynamic=Quantity(change, 1e-6),
    )  # fmt: skip


def dynamic_basis(results: Results) -> ClaimResult:
    """13: the wells of a basis of dynamic modes, and of the basis of buckling modes."""
    from scipy.optimize import minimize

    model = paper_model(results.pick(32, 64))
    depth, rest = model.saddle_energy - model.well_energy, model.well_amplitude
    gaps, errors, counts = [], [], (2, 4, 8, 16)
    for count in counts:
        basis = model.linear_modes[:, :count]
        start = basis.T @ model.mass @ (-2.0 * rest)
        scale = float(np.abs(start).max())

        def energy(u: _Array, basis: _Array = basis, scale: float = scale) -> float:
            return float(model.potential_energy(rest + basis @ (u * scale))) / depth

        coarse, fine = (
            float(minimize(energy, start / scale, method="BFGS", options={"gtol": gtol}).fun) for gtol in (1e-7, 1e-9)
        )
        gaps.append(fine - model.well_energy / depth)
        errors.append(abs(coarse - fine) + 1e-8)
    own = float(abs(np.diff(model.potential_energy(model.wells))[0])) / depth
    unequal = above(Quantity(gaps[0], errors[0]), 1e-3)
    for gap, error in zip(gaps, errors, strict=True):
        unequal &= above(Quantity(gap, error), 0.0)
    return found(
        unequal & below(own, 1e-12),
        gap=Quantity(gaps[0], errors[0]), own=own, listed=tuple(zip(counts, (100.0 * g for g in gaps), strict=True)),
        error=max(errors),
    )  # fmt: skip


ROWS = {
    "13": dynamic_basis,
    "18": no_buckling_level,
    "20a": apex,
    "20b": wavenumbers,
    "20c": orthogonality,
    "20d": checkerboard,
}
