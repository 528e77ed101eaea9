"""The explorer: a map in the browser; click on a point, see its run, watch the beam.

It computes through the public interface alone, and draws with Bokeh what the figures draw with Matplotlib.
"""

from snapbeam.explorer.start import Explorer, explore, serve

__all__ = ["Explorer", "explore", "serve"]
