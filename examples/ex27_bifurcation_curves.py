"""
Bifurcation curves over a response map
======================================

An orbit with one impact per period is continued in the velocity amplitude; its fold and its flip (period doubling) are
then continued in frequency and velocity. Between frequency ratios of 1.4 and 2 the intrawell region ends near the flip.
"""

import numpy as np

import snapbeam as sb
from snapbeam import paper

model = sb.ReducedModel.from_beam(paper.BEAM, modes=1, damping_ratio=0.05)
shaker = sb.Shaker(frequency_ratio=1.6, velocity_amplitude=0.03)
system = sb.System(model, contacts=[sb.Contact(paper.CONTACT, shaker)])

orbit = sb.dynamics.periodic_orbit(system, transient=100)
branch = sb.dynamics.continuation(orbit, "velocity_amplitude", (0.01, 0.3))
names, bounds = ("frequency_ratio", "velocity_amplitude"), ((1.0, 2.2), (0.01, 0.3))
curves = [
    sb.dynamics.bifurcation_curve(point, names, bounds)
    for point in branch.special_points
    if point.value > 0.03  # the other fold is where the orbit grazes
]
for curve in curves:
    errors = curve["velocity_amplitude_error"]
    print(
        f"{curve.attrs['kind']}: {curve.sizes['point']} points, errors up to {errors.max():.1g}"
    )

axes = {
    "frequency_ratio": np.linspace(1.0, 2.2, 49),
    "velocity_amplitude": np.linspace(0.01, 0.3, 45),
}
ax = sb.plot.plot_response_map(sb.sweep(system, axes, sb.Integration(cycles=100)))
sb.plot.plot_bifurcation_curve(curves, ax)
