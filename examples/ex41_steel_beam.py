r"""
A steel beam of 300 mm
======================

Which amplitude is necessary for snap-through, and does it depend on the thickness? This example first compares the
first mode of the beam with the exact one. It also shows how certain the result is.
"""

import numpy as np

import snapbeam as sb

beam = sb.Beam(
    length=0.300,
    thickness=0.8e-3,
    width=20e-3,
    density=7850.0,
    young_modulus=205e9,
    buckling_level=0.9e-3,
)
contact = sb.HertzContact.from_materials(5e-3, (210e9, 205e9), (0.3, 0.3))
model = sb.ReducedModel.from_beam(beam, modes=6, damping_ratio=0.004)
print(
    model.natural_frequencies[:3],
    sb.model.exact_natural_frequencies(beam, count=3),
    "Hz",
)
print(
    f"b/r = {beam.buckling_level / beam.radius_of_gyration:.2f}; "
    "above 6.2 the first mode would be antisymmetric"
)

shaker = sb.Shaker(frequency_ratio=1.2, velocity_amplitude=0.2, location=0.47)
system = sb.System(
    model,
    contacts=[sb.Contact(contact, shaker)],
)
print(system.diagnostics() or "nothing is doubtful")

# %%
# The threshold over frequency, for three thicknesses at one buckling level.

found = sb.threshold(
    system,
    "velocity_amplitude",
    np.linspace(0.02, 0.6, 30),
    {
        "beam.thickness": [0.7e-3, 0.8e-3, 0.9e-3],
        "frequency_ratio": np.linspace(0.8, 2.0, 13),
    },
    sb.Integration(cycles=60),
)
low = found.lower_threshold.min("frequency_ratio")
for thickness, value in zip(found.beam_thickness.values, low.values, strict=True):
    print(f"h = {1e3 * thickness:.1f} mm: snaps through from V = {value:.2f}")

# %%
# How certain is a point near the threshold? Replicates with slightly different initial conditions show it.

near = {"velocity_amplitude": np.linspace(0.05, 0.35, 7)}
sure = sb.sweep(
    system,
    near,
    sb.Integration(cycles=60),
    replicates=sb.Replicates(5, check_half_step=True),
)
print(sure.class_fraction.max("class_code").values)

# %%
# One run, with its summary:

run = sb.simulate(system, sb.Integration(cycles=60))
print(run.summary.to_text())
ax = run.plot(window=(0.0, 20.0))
