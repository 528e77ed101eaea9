"""Pictures of design: probabilities, quantile thresholds, sensitivities, fronts."""

from snapbeam.figures.design.probability import plot_probability

__all__ = ["plot_probability"]
