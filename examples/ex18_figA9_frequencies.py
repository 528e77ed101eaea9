"""
Convergence of the natural frequencies
======================================

Fig. A.9: relative error of the first ten frequencies of the reduced model against the exact ones.
"""

from snapbeam import paper

figure = paper.figA9(results=paper.shared_results())
