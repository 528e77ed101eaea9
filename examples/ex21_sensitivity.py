r"""
Unspecified properties of the paper's model
===========================================

This example shows one map and the points whose class depends on a property that the paper does not state: the ninth
decimal of the drive, the step, the contact stiffness, the kind of damping, and the :math:`\omega_1` that normalises the model
of one mode.
"""

from snapbeam import paper
from snapbeam.sweeps.threshold import compare_maps

results = paper.shared_results()
figure = paper.sensitivity(results=results)

# %%
# A change of the drive in the ninth decimal shows the effect of chaos alone. Compare the other changes with it:

data = results["sensitivity"]
for name in ("perturbed", "half_step", "soft_contact", "buckling_damping"):
    difference = compare_maps(data["base"], data[name])
    print(
        f"{name}: {100 * difference.changed:.1f} % change class, "
        f"threshold times {difference.threshold:.3f}"
    )
