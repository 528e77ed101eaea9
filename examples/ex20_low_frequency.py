r"""
Slow shakers
============

How the interwell threshold approaches the quasi-static one, :math:`V_\mathrm{QS1}` of Eq. (21).
"""

from snapbeam import paper

figure = paper.low_frequency(results=paper.shared_results())
