"""The wells of a structure under a side force, the saddle between them and what it takes to cross."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from snapbeam.core.validate import InputError
from snapbeam.model.imperfection.equilibria import Equilibrium, equilibria_of

__all__ = ["Landscape", "landscape_of", "tangent_stiffness"]

_Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Landscape:
    """Where a structure can rest."""

    equilibria: tuple[Equilibrium, ...]
    """By energy."""
    lower: Equilibrium
    """The well whose centre is lower; the only one if there is one only."""
    upper: Equilibrium
    saddle: Equilibrium | None
    """The lowest between two wells; None if there is one well only."""

    @property
    def deepest(self) -> Equilibrium:
        """The well of least energy."""
        return self.lower if self.lower.energy <= self.upper.energy else self.upper

    @property
    def is_bistable(self) -> bool:
        """Whether there are two wells."""
        return self.saddle is not None


def tangent_stiffness(stiffness: _Array, gamma: float, alpha: _Array) -> _Array:
    """K0 + gamma (s Id + 2 alpha alpha^T), shape (N, N)."""
    k0 = np.diag(stiffness) if stiffness.ndim == 1 else stiffness
    tangent: _Array = k0 + gamma * (float(alpha @ alpha) * np.eye(alpha.size) + 2.0 * np.outer(alpha, alpha))
    return tangent


def landscape_of(stiffness: _Array, gamma: float, force: _Array, midspan_shape: _Array) -> Landscape:
    """All equilibria under the side force B, told apart.

    At most two of them are stable: beyond the second eigenvalue of K0 + gamma s the term 2 gamma alpha alpha^T, of rank
    one, cannot make up for two negative ones.

    Raises
    ------
    InputError
        If no equilibrium is stable, or two wells cannot be told apart by the centre.
    """
    found = []
    for alpha, unstable in equilibria_of(stiffness, gamma, force):
        alpha.setflags(write=False)
        bent = stiffness * alpha if stiffness.ndim == 1 else stiffness @ alpha
        square = float(alpha @ alpha)
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
