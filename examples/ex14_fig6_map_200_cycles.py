r"""
Frequency and amplitude, 200 cycles
===================================

Fig. 6: the response over frequency and amplitude for one mode and for 32. The light-blue band of one mode at
:math:`V` = 0.26 is the first impact: the shaker sets out at its greatest speed :math:`V b \omega_1`, the beam leaves at
twice that, and in the quartic potential of one mode that carries it over the barrier for :math:`V > 1/4` (a little more
with damping); just above, it has too little energy left to come back.
"""

import numpy as np

from snapbeam import paper
from snapbeam.sweeps.threshold import interwell_threshold, threshold_notch

results = paper.shared_results()
figure = paper.fig6(results=results)

# %%
# The notch of the interwell threshold, its lowest point between :math:`\Omega` = 0.8 and 2.2:

for ds in results["fig6"].values():
    ratio, step = (
        ds.frequency_ratio.values,
        float(np.diff(ds.velocity_amplitude).max()),
    )
    notch = threshold_notch(ratio, interwell_threshold(ds), step, (0.8, 2.2))
    print(
        f"N = {ds.attrs['modes']}: Omega = {notch.position:.2f}, V = {notch.height:.3f}"
    )
