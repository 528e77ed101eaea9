"""Pictures of design: probabilities, quantile thresholds, sensitivities, fronts."""

from snapbeam.figures.design.front import plot_designs
from snapbeam.figures.design.probability import plot_probability
from snapbeam.figures.design.quantiles import plot_quantiles
from snapbeam.figures.design.sensitivity import plot_tornado

__all__ = ["plot_designs", "plot_probability", "plot_quantiles", "plot_tornado"]
