"""
A waveform and its contact force
================================

Fig. 3: beam and shaker over six cycles, one penetration closer, and the force of Hertz's law,
:math:`f = k_c d^{3/2}`. The overlap is about a hundredth of the buckling level; what looks like one impact
is a hard one and softer ones after it, as waves come back from the clamps.
"""

from snapbeam import paper

figure = paper.fig3(results=paper.shared_results())
