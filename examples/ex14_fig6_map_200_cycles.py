r"""
Frequency and amplitude, 200 cycles
===================================

Fig. 6: the response over frequency and amplitude for one mode and for 32. The light-blue band of one mode at
:math:`V` = 0.26 is the first impact. The shaker starts at its maximum speed :math:`V b \omega_1`, and the beam leaves it at
twice that speed. In the quartic potential of one mode this is enough to pass the barrier for :math:`V > 1/4` (slightly more
with damping). Just above this value the beam has too little energy to return.
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
