"""The ends of a beam: clamped, pinned, or anything between."""

from __future__ import annotations

from snapbeam.model.ends.ends import CLAMPED, BoundaryConditions

__all__ = ["CLAMPED", "BoundaryConditions"]
