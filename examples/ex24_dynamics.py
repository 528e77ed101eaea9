"""
Lifetimes, bifurcations, basins and edge states
===============================================

A class after several hundred cycles is one sample.  This example computes four more robust results with one and two
modes: the lifetime of snap-through, the motions over the amplitude of the shaker, their basins, and unstable orbits.
"""

# %%
# How long does snap-through last?
# --------------------------------
# 120 initial conditions at two points of the plane of Fig. 6, two modes.  Lines are exponentials with the estimated
# lifetimes. Runs that still snap at the end are right-censored.

import numpy as np
import xarray as xr

import snapbeam as sb
from snapbeam import paper
from snapbeam.plot.dynamics import plot_basins, plot_diagram, plot_survival

shaker = sb.Shaker(frequency_ratio=1.21, velocity_amplitude=0.25)
two = sb.System(
    sb.ReducedModel.from_beam(paper.BEAM, modes=2),
    contacts=[sb.Contact(paper.CONTACT, shaker)],
)
points = xr.Dataset(
    {
        "frequency_ratio": ("point", [1.21, 2.5]),
        "velocity_amplitude": ("point", [0.25, 0.55]),
    }
)
lifetimes = sb.dynamics.lifetime_map(
    two, points, sb.Integration(cycles=300), initial_conditions=120
)
for i in range(2):
    one = lifetimes.isel(point=i)
    print(
        f"{float(one.lifetime):.0f} cycles "
        f"({float(one.lifetime_low):.0f} to {float(one.lifetime_high):.0f})"
    )
plot_survival(lifetimes, labels=["1.21, 0.25", "2.5, 0.55"])

# %%
# Which motions exist, and where do they begin?
# ---------------------------------------------
# One mode with more damping and a slow shaker, so that few motions exist. The bifurcation diagram is swept up and down. The
# stable and unstable orbits of a branch, and their bifurcations, are plotted over it.

shaker = sb.Shaker(frequency_ratio=1.6, velocity_amplitude=0.05)
one = sb.System(
    sb.ReducedModel.from_beam(paper.BEAM, modes=1, damping_ratio=0.03),
    contacts=[sb.Contact(paper.CONTACT, shaker)],
)
diagram = sb.dynamics.bifurcation_diagram(
    one, "velocity_amplitude", np.linspace(0.02, 0.3, 113)
)
limits = ("velocity_amplitude", (0.02, 0.3))
orbit = sb.dynamics.periodic_orbit(one, transient=300)
branches = [
    sb.dynamics.continuation(orbit, *limits, max_step=0.06),
    sb.dynamics.continuation(orbit, *limits, direction="down"),
]
flip = next(point for point in branches[0].special_points if point.kind == "flip")
doubled = sb.dynamics.switch_branch(flip, *limits)
branches.append(sb.dynamics.continuation(doubled, "velocity_amplitude", (0.02, 0.17)))
weak = sb.dynamics.periodic_orbit(
    one.replace(**{"drive.velocity_amplitude": 0.03}), transient=300
)
branches.append(sb.dynamics.continuation(weak, *limits))
for branch in branches:
    for point in branch.special_points:
        print(
            f"{point.kind:12s} V = {point.value:.6f}, period {branch.orbits[0].period}"
        )
plot_diagram(diagram, branches=[branch.to_dataset() for branch in branches])

# %%
# Which initial states go to which motion?
# ----------------------------------------
# Initial states of the mode in the plane of displacement and velocity. The mid-position of the tip is fixed.

found = sb.dynamics.find_attractors(one, 100)
grid = {
    "amplitude[1]": np.linspace(-0.98, 2.0, 80),
    "velocity[1]": np.linspace(-1.5, 1.5, 80),
}
basins = sb.dynamics.basins_of_attraction(found, grid)
entropy = sb.dynamics.basin_entropy(basins.basin, 5)
print(
    f"{len(found.attractors)} attractors, "
    f"basin entropy {entropy.basin:.3f} ± {entropy.basin_error:.3f}"
)
plot_basins(basins)
