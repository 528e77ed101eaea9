"""Public names; each is loaded when it is first used."""

from .dataset import plot_dataset as plot_dataset
from .dynamics import plot_attractors as plot_attractors
from .dynamics import plot_backbone as plot_backbone
from .dynamics import plot_basins as plot_basins
from .dynamics import plot_diagram as plot_diagram
from .dynamics import plot_exponents as plot_exponents
from .dynamics import plot_lifetimes as plot_lifetimes
from .dynamics import plot_multipliers as plot_multipliers
from .dynamics import plot_section as plot_section
from .dynamics import plot_survival as plot_survival
from .force_displacement import plot_force_displacement as plot_force_displacement
from .map import class_handles as class_handles
from .map import plot_points as plot_points
from .map import plot_response_map as plot_response_map
from .map import plot_statistic as plot_statistic
from .run import plot_energies as plot_energies
from .run import plot_modal_amplitudes as plot_modal_amplitudes
from .run import plot_phase_portrait as plot_phase_portrait
from .run import plot_run as plot_run
from .run import plot_spectrum as plot_spectrum
from .schematic import plot_system as plot_system
from .style import CLASS_COLORS as CLASS_COLORS
from .style import figure_style as figure_style
from .style import new_figure as new_figure
from .style import save_figure as save_figure
from .threshold import plot_threshold as plot_threshold
