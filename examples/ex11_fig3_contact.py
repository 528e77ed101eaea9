"""
A waveform and its contact force
================================

Fig. 3: beam and shaker over six cycles, one penetration on a larger scale, and the force of Hertz's law,
:math:`f = k_c d^{3/2}`. The overlap is about a hundredth of the buckling level; an apparent single
impact consists of a strong impact and weaker ones, because waves return from the clamps.
"""

from snapbeam import paper

figure = paper.fig3(results=paper.shared_results())
