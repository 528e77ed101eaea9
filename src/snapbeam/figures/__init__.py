"""Pictures of results; they compute nothing."""

from snapbeam.figures.dynamics import (
    plot_basins,
    plot_diagram,
    plot_exponents,
    plot_lifetimes,
    plot_section,
    plot_survival,
)
from snapbeam.figures.point_list import plot_points
from snapbeam.figures.response_map import class_handles, plot_response_map
from snapbeam.figures.run import plot_run
from snapbeam.figures.schematic import plot_system
from snapbeam.figures.series import plot_energies, plot_modal_amplitudes, plot_phase_portrait, plot_spectrum
from snapbeam.figures.statistic import plot_statistic
from snapbeam.figures.style import CLASS_COLORS, house_style, new_figure, save_figure
from snapbeam.figures.threshold import plot_threshold
from snapbeam.lab.compare.dots import MeasuredPoints, read_measured_points

__all__ = [
    "CLASS_COLORS",
    "MeasuredPoints",
    "class_handles",
    "house_style",
    "new_figure",
    "plot_basins",
    "plot_diagram",
    "plot_energies",
    "plot_exponents",
    "plot_lifetimes",
    "plot_modal_amplitudes",
    "plot_phase_portrait",
    "plot_points",
    "plot_response_map",
    "plot_run",
    "plot_section",
    "plot_spectrum",
    "plot_statistic",
    "plot_survival",
    "plot_system",
    "plot_threshold",
    "read_measured_points",
    "save_figure",
]
