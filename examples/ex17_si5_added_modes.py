r"""
Effect of the number of modes
=============================

Supplementary video SI5: the map over location at :math:`\Omega` = 1.625 as modes are added. Six of its
frames; ``snapbeam reproduce si5`` writes the video.
"""

from snapbeam import paper

figure = paper.si5(results=paper.shared_results())
