"""
Resonances
==========

Fig. B.10: maximum displacement at the contact over frequency, for two amplitudes at which the beam does not snap
through.
"""

from snapbeam import paper
from snapbeam.paper.recipes.figB10 import maxima

results = paper.shared_results()
figure = paper.figB10(results=results)

# %%
# The two highest maxima of each curve:

for ds in results["figB10"].values():
    for level, drive in enumerate(ds.velocity_amplitude.values):
        peaks = ", ".join(f"{ratio:.2f}" for ratio, _ in maxima(ds, level)[:2])
        print(f"N = {ds.attrs['modes']}, V = {drive:g}: Omega = {peaks}")
