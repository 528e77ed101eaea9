"""
The beam and the shaker
=======================

Fig. 2 of the paper: the buckled beam in its initial well (solid) and in the other well (dashed), the shaker,
and their symbols. The model gives the shapes.
"""

from snapbeam import paper

figure = paper.fig2(results=paper.shared_results())
