"""
Three kinds of waveform
=======================

Fig. 4: an aperiodic intrawell response, one snap-through, and several. A rule selects the parameters (see
:mod:`snapbeam.paper.recipes.fig4`). The left column of the paper is measured; here it is a synthetic
recording of the same runs at 10 000 frames per second, tracked like a measured one. To show your own recordings, use
``paper.fig4(measured=[...])``.
"""

from snapbeam import paper

figure = paper.fig4(results=paper.shared_results())
