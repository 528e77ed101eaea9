"""``snapbeam probability`` and ``snapbeam design``: questions under tolerances, from one parameter file."""

from snapbeam.cli.design.optimum import design
from snapbeam.cli.design.probability import probability

__all__ = ["design", "probability"]
