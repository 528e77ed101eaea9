r"""
What the paper leaves open
==========================

One map, and the points that change class when something is changed that the paper does not state, or that
should not matter: the ninth decimal of the drive, the step, the contact stiffness, how damping is applied,
what :math:`\omega_1` normalises one mode.
"""

from snapbeam import paper
from snapbeam.sweeps.threshold import compare_maps

results = paper.shared_results()
figure = paper.sensitivity(results=results)

# %%
# What chaos does by itself, a change of the drive in the ninth decimal, is the measure for the others:

data = results["sensitivity"]
for name in ("perturbed", "half_step", "soft_contact", "buckling_damping"):
    difference = compare_maps(data["base"], data[name])
    print(
        f"{name}: {100 * difference.changed:.1f} % change class, "
        f"threshold times {difference.threshold:.3f}"
    )
