r"""
Slow shakers
============

At low frequency the interwell threshold approaches the quasi-static threshold :math:`V_\mathrm{QS1}` of Eq. (21).
"""

from snapbeam import paper

figure = paper.low_frequency(results=paper.shared_results())
