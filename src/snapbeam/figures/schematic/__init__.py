"""What a system looks like: drawn from the system itself."""

from snapbeam.figures.schematic.drawing import plot_system

__all__ = ["plot_system"]
