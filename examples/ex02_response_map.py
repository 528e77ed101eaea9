"""
A map of response types
=======================

Frequency and amplitude of the shaker decide whether the beam stays in its well (intrawell), snaps through and
settles (transient interwell) or continues to snap through (continuous interwell). This example has a coarse grid
and four modes; ``make map`` computes 32 modes on a finer grid.
"""

import numpy as np

import snapbeam as sb
from snapbeam import paper
from snapbeam.plot.map import plot_response_map

shaker = sb.Shaker(
    frequency_ratio=1.0, velocity_amplitude=0.1, location=paper.LOCATION
)
system = sb.System(
    sb.ReducedModel.from_beam(paper.BEAM, modes=4, damping_ratio=paper.DAMPING_RATIO),
    contacts=[sb.Contact(paper.CONTACT, shaker)],
)
axes = {
    "frequency_ratio": np.linspace(0.1, 4.0, 16),
    "velocity_amplitude": np.linspace(0.02, 0.65, 12),
}
ds = sb.sweep(system, axes, sb.Integration(cycles=80))

# %%
# The dashed line is the quasi-static threshold of one mode, :math:`V_\mathrm{QS1} = \Omega \sin^2 \pi x_s`
# (Eq. 21). At low frequency the boundary of the intrawell responses follows it. At higher frequency, impacts need much lower amplitudes.

ax = plot_response_map(ds, quasi_static_line=True)

# %%
# The interwell threshold is one line of xarray:

snapped = ds.response_class >= sb.ResponseClass.TRANSIENT_1
threshold = ds.velocity_amplitude.where(snapped).min("velocity_amplitude")
print(
    f"lowest at Omega = {float(threshold.idxmin('frequency_ratio')):.2f}: "
    f"V = {float(threshold.min()):.3f}"
)
