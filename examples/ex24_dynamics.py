"""
How long, how likely, and where orbits are born
===============================================

A class after some hundred cycles is one sample.  Here are four questions to one mode and to two whose answers hold: how
long snapping lasts, which motions there are over the amplitude of the shaker, which of them is reached from where, and
what the orbits are that no run settles on.
"""

# %%
# How long does snapping last?
# ----------------------------
# 120 starts at two points of the plane of Fig. 6, two modes.  Lines are exponentials with the lifetimes found;
# what still snaps at the end counts as such.

import numpy as np
import xarray as xr

import snapbeam as sb
from snapbeam import paper
from snapbeam.plot.dynamics import plot_basins, plot_diagram, plot_survival

two = sb.System(
    sb.ReducedModel.from_beam(paper.BEAM, modes=2),
    paper.CONTACT,
    sb.Shaker(frequency_ratio=1.21, velocity_amplitude=0.25),
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
# Which motions are there, and where are they born?
# -------------------------------------------------
# One mode with more damping, struck slowly enough that its motions can be counted: the diagram of runs that are carried
# on up and down, over it the orbits that a branch follows, stable or not, with what happens to them.

one = sb.System(
    sb.ReducedModel.from_beam(paper.BEAM, modes=1, damping_ratio=0.03),
    paper.CONTACT,
    sb.Shaker(frequency_ratio=1.6, velocity_amplitude=0.05),
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
# Which of them is reached from where?
# ------------------------------------
# States of the mode in the plane of displacement and velocity, from the tip's mid-position on, which stays where it is.

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
