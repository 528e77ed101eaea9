"""
Where to strike: an optimised location
======================================

The paper describes a trade-off: near a clamp the displacement of the striker is small, near the centre its force.  This
example optimises location, frequency and amplitude. The beam must snap in at least 95 % of cases under small tolerances, with
low speed and low force.  Intervals are from independent samples.

This is a sketch with one mode and few runs; the page on verification has the numbers of eight modes.
"""

from matplotlib import pyplot as plt

import snapbeam as sb
from snapbeam import paper
from snapbeam.plot.uncertainty import plot_designs

shaker = sb.Shaker(frequency_ratio=1.0, velocity_amplitude=0.1)
system = sb.System(
    sb.ReducedModel.from_beam(paper.BEAM, modes=1, damping_ratio=paper.DAMPING_RATIO),
    contacts=[sb.Contact(paper.CONTACT, shaker)],
)
uncertainty = sb.uncertainty.ParameterUncertainty(
    of={
        "velocity_amplitude": sb.uncertainty.Normal(0.02, relative=True),
        "location": sb.uncertainty.Normal(0.005),
    },
    displacement=3.5e-6,
    phase=True,
)
found = sb.uncertainty.optimize_design(
    system,
    {
        "location": (0.1, 0.48),
        "frequency_ratio": (0.3, 2.6),
        "velocity_amplitude": (0.01, 0.6),
    },
    ["speed", sb.uncertainty.Objective(quantity="peak_force", quantile=0.5)],
    sb.uncertainty.Constraint(quantity="snap", lower=0.95),
    uncertainty,
    sb.uncertainty.OptimizerSettings(
        generations=8, population=12, samples=40, validation_samples=100
    ),
    integration=sb.Integration(cycles=10),
)
plot_designs(found)
plt.show()
