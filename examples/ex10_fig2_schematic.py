"""
The beam and the shaker
=======================

Fig. 2 of the paper: the buckled beam in the well it starts in (solid) and in the other (dashed), and the
shaker, with their symbols. The shapes are those of the model.
"""

from snapbeam import paper

figure = paper.fig2(results=paper.shared_results())
