"""Pictures of dynamics: lifetimes, bifurcation diagrams with branches, exponents, sections, basins."""

from snapbeam.figures.dynamics.diagram import plot_diagram
from snapbeam.figures.dynamics.lifetimes import plot_lifetimes, plot_survival
from snapbeam.figures.dynamics.states import plot_basins, plot_edge, plot_exponents, plot_section

__all__ = [
    "plot_basins",
    "plot_diagram",
    "plot_edge",
    "plot_exponents",
    "plot_lifetimes",
    "plot_section",
    "plot_survival",
]
