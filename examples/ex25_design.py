"""
Probabilities, thresholds and sensitivities
===========================================

The parameters of a real system have tolerances: beam, contact and location, and the drive begins at any phase.  Every
result of this example is counted over random samples of such systems, and has a confidence interval.

This is a sketch with one mode and few runs.
"""

# %%
# How likely is it to snap?
# -------------------------
# Lines of equal probability; a small cross marks an interval that is wider than requested.

import numpy as np

import snapbeam as sb
from snapbeam import paper
from snapbeam.plot.uncertainty import plot_probability, plot_quantiles, plot_tornado

shaker = sb.Shaker(frequency_ratio=1.21, velocity_amplitude=0.18)
system = sb.System(
    sb.ReducedModel.from_beam(paper.BEAM, modes=1),
    contacts=[sb.Contact(paper.CONTACT, shaker)],
)
uncertainty = sb.uncertainty.ParameterUncertainty(
    of={
        "beam.buckling_level": sb.uncertainty.Normal(0.01, relative=True),
        "contact.stiffness": sb.uncertainty.LogNormal(0.2),
        "location": sb.uncertainty.Normal(0.005),
        "velocity_amplitude": sb.uncertainty.Normal(0.02, relative=True),
    },
    displacement=3.5e-6,
    phase=True,
)
short = sb.Integration(cycles=20)
probability = sb.uncertainty.probability_map(
    system,
    {
        "frequency_ratio": np.linspace(0.4, 2.4, 17),
        "velocity_amplitude": np.linspace(0.02, 0.24, 17),
    },
    uncertainty,
    sb.uncertainty.SamplingPlan(half_width=0.12, initial_runs=16, max_runs=60),
    integration=short,
)
print(f"{int(probability.runs.sum())} runs")
plot_probability(probability)

# %%
# At which amplitude?
# -------------------
# Amplitudes with the probabilities 0.05, 0.5 and 0.95, with bands of 95 %. A cross marks a probability that decreases
# again.

threshold = sb.uncertainty.quantile_threshold(
    system,
    "velocity_amplitude",
    (0.005, 0.3),
    {"frequency_ratio": np.linspace(0.4, 2.4, 9)},
    uncertainty,
    sb.uncertainty.QuantileSearchSettings(runs=200),
    integration=short,
)
plot_quantiles(threshold)

# %%
# What matters most?
# ------------------
# Each parameter is changed by one standard score down and up; the label gives the change in the unit of the parameter.

sensitivity = sb.uncertainty.sensitivity(
    system,
    "peak_force",
    uncertainty,
    samples=16,
    integration=sb.Integration(cycles=5),
)
plot_tornado(sensitivity)
