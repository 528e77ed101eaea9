"""
Three kinds of waveform
=======================

Fig. 4: intrawell without a period, one snap-through, several. The parameters are searched for by a rule (see
:mod:`snapbeam.paper.recipes.fig4`). The left column of the paper is measured; here it is a synthetic
recording of the same runs, drawn as a camera at 10 000 frames a second would see them and tracked as a
measured one. Your own recordings go there with ``paper.fig4(measured=[...])``.
"""

from snapbeam import paper

figure = paper.fig4(results=paper.shared_results())
