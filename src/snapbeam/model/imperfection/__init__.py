"""What makes the two wells unequal: an initial shape, a side load; the equilibria that are then left."""

from __future__ import annotations

from snapbeam.model.imperfection.equilibria import Equilibrium
from snapbeam.model.imperfection.imperfection import Imperfection

__all__ = ["Equilibrium", "Imperfection"]
