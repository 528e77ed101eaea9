"""Pictures of design: probabilities, quantile thresholds, sensitivities, fronts."""

from snapbeam.figures.design.probability import plot_probability
from snapbeam.figures.design.quantiles import plot_quantiles

__all__ = ["plot_probability", "plot_quantiles"]
