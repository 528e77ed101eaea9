"""
The location of the shaker
==========================

Fig. 8: start positions, and maps over location and amplitude at three frequencies, up to twice the
quasi-static threshold (dashed). Dash-dot: the fractions of it that the paper gives for one mode.
"""

from snapbeam import paper

figure = paper.fig8(results=paper.shared_results())
