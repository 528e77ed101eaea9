"""
Frequency and amplitude, 1000 cycles
====================================

Fig. 7: the map of Fig. 6 after 1000 cycles, with the quasi-static threshold of one mode (dashed), and, below, the
points that changed their class since cycle 200.
"""

import snapbeam as sb
from snapbeam import paper

results = paper.shared_results()
figure = paper.fig7(results=results)

# %%
# Class fractions after 200 and after 1000 cycles:

for name, long in results["fig7"].items():
    for ds in (results["fig6"][name], long):
        shares = [
            f"{kind.label} {100 * float((ds.response_class == kind).mean()):.1f} %"
            for kind in sb.ResponseClass
        ]
        print(
            f"N = {ds.attrs['modes']}, {ds.attrs['cycles']} cycles:",
            ", ".join(shares[1:]),
        )
