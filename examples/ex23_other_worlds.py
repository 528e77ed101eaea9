"""
Other worlds
============

The paper's shaker moves as prescribed and its contact loses nothing.  Here are a shaker with a mass on a suspension,
which comes and goes in a burst and loses energy in contact, and a sphere that is thrown at the beam, each drawn from
the system itself.
"""

# %%
# A burst from a shaker of 20 g
# -----------------------------
# Its mass and suspension let the contact force move it; the loss of the contact follows from a wanted restitution.

import snapbeam as sb
from snapbeam import paper
from snapbeam.figures import plot_run, plot_system

model = sb.ReducedModel.from_beam(paper.BEAM, modes=8)
level = paper.BEAM.buckling_level
lossy = sb.HuntCrossley.from_restitution(stiffness=4e8, restitution=0.6, speed=0.05)
burst = sb.Burst(frequency_ratio=1.21, velocity_amplitude=0.2, length=5, rise=2, fall=1, retreat=0.4)
shaker = sb.Striker(drive=burst, mass=0.02, spring=700.0, damper=0.7)
system = sb.System(model, lossy, shaker)
plot_system(system)

# %%
# Of the work that the striker does, part is lost in contact and part in the beam.

run = sb.simulate(system, sb.Integration(cycles=8))
print(f"work {run.outcome.shaker_work:.3e} J, lost in contact {run.outcome.contact_loss:.3e} J")
plot_run(run.dataset)

# %%
# A sphere of 2 g
# ---------------
# Thrown at the middle of the beam from above, at 0.4 of b omega_1.

sphere = sb.Striker(drive=sb.Flight(speed=0.4), mass=2e-3, gap=0.5 * level, side="above", location=0.5)
thrown = sb.System(model, paper.CONTACT, sphere)
plot_system(thrown)

# %%

run = sb.simulate(thrown, sb.Integration(cycles=3))
print(
    f"impacts {run.outcome.impacts}, peak force {run.outcome.peak_force:.1f} N, {run.outcome.response.label}"
)
plot_run(run.dataset)
