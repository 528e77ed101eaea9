"""The equilibria of a perfect structure in closed form."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from snapbeam.model.imperfection.equilibria import Equilibrium

__all__ = ["perfect_equilibria"]

_Array = NDArray[np.float64]


def perfect_equilibria(stiffness: _Array, gamma: float) -> tuple[Equilibrium, ...]:
    """The straight state, and a pair along every eigenvector of K0 with an eigenvalue kappa < 0, by energy.

    Of the i-th such pair, alpha = +-sqrt(-kappa_i/gamma) and U = -kappa_i^2/(4 gamma); it is unstable towards
    all lower ones.
    """
    if stiffness.ndim == 1:
        kappa, axes = stiffness, np.eye(stiffness.size)
    else:
        kappa, axes = np.linalg.eigh(stiffness)
    order = np.argsort(kappa, kind="stable")
    buckled = [int(i) for i in order if kappa[i] < 0.0]
    found = []
    for below, i in enumerate(buckled if gamma > 0.0 else []):
        for sign in (-1.0, 1.0):
            alpha = sign * np.sqrt(-kappa[i] / gamma) * axes[:, i]
            energy = -(float(kappa[i]) ** 2) / (4.0 * gamma)
            found.append(Equilibrium(amplitude=alpha, energy=energy, unstable_directions=below))
    straight = np.zeros(kappa.size)
    found.append(Equilibrium(amplitude=straight, energy=0.0, unstable_directions=len(buckled)))
    return tuple(found)
