"""
Extended models
===============

The paper's shaker has a prescribed motion, and its contact dissipates no energy.  This example simulates a shaker with a
mass on a suspension, a thrown sphere, unequal wells, elastic supports and harvesters, and draws each system.
"""

# %%
# A burst from a shaker of 20 g
# -----------------------------
# Because of its mass and suspension, the contact force moves the shaker. The contact loss follows from the requested
# restitution.

import snapbeam as sb
from snapbeam import paper
from snapbeam.plot.run import plot_run
from snapbeam.plot.schematic import plot_system

model = sb.ReducedModel.from_beam(paper.BEAM, modes=8)
level = paper.BEAM.buckling_level
lossy = sb.HuntCrossley.from_restitution(stiffness=4e8, restitution=0.6, speed=0.05)
burst = sb.Burst(
    frequency_ratio=1.21,
    velocity_amplitude=0.2,
    duration_cycles=5,
    ramp_up_cycles=2,
    ramp_down_cycles=1,
    retraction=0.4,
)
shaker = sb.Striker(
    drive=burst, mass=0.02, suspension_stiffness=700.0, suspension_damping=0.7
)
system = sb.System(model, contacts=[sb.Contact(lossy, shaker)])
plot_system(system)

# %%
# The contact and the beam each dissipate a part of the work of the striker.

run = sb.simulate(system, sb.Integration(cycles=8))
print(
    f"work {1e6 * run.summary.striker_work:.1f} µJ, "
    f"lost in contact {1e6 * run.summary.energy_lost_contact:.1f} µJ"
)
plot_run(run.dataset)

# %%
# A sphere of 2 g
# ---------------
# The sphere is thrown at mid-span from above, at :math:`0.4\,b\,\omega_1`.

sphere = sb.Striker(
    drive=sb.ConstantVelocity(speed=0.4),
    mass=2e-3,
    gap=0.5 * level,
    side="above",
    location=0.5,
)
thrown = sb.System(model, contacts=[sb.Contact(paper.CONTACT, sphere)])
plot_system(thrown)

# %%

run = sb.simulate(thrown, sb.Integration(cycles=3))
print(
    f"impacts {run.summary.impacts}, peak force {run.summary.peak_force:.1f} N, "
    f"{run.summary.response_class.label}"
)
plot_run(run.dataset)

# %%
# Unequal wells and elastic supports
# ----------------------------------
# An initial shape and a side load make the wells unequal; each end has a rotational spring.

soft = paper.BEAM.replace(
    boundary=sb.BoundaryConditions(
        left_rotational_stiffness=20.0, right_rotational_stiffness=5.0
    )
)
uneven = sb.ReducedModel.from_beam(
    soft,
    modes=8,
    imperfection=sb.Imperfection(
        midspan_amplitude=8e-6, point_load=0.02, point_location=0.3
    ),
)
print(
    f"first frequency about the lower well {uneven.well_frequencies[0, 0]:.1f} Hz, "
    f"upper {uneven.well_frequencies[1, 0]:.1f} Hz"
)
shaker = sb.Shaker(frequency_ratio=1.2, velocity_amplitude=0.2)
plot_system(sb.System(uneven, contacts=[sb.Contact(paper.CONTACT, shaker)]))

# %%
# A harvester on a moving base
# ----------------------------
# The only striker is a stop that moves with the base. Two layers of PZT-5H next to the clamp supply a resistor.

motion = sb.AccelerationSine(frequency_ratio=0.9, acceleration_amplitude=0.25)
stop = sb.Striker(drive=sb.FixedStop(), gap=0.2 * level)
piezo = sb.PiezoelectricHarvester.from_material(
    stress_constant=-16.6,
    permittivity=25.55e-9,
    layer_thickness=0.1e-3,
    layer_width=paper.BEAM.width,
    beam=paper.BEAM,
    resistance=1e4,
    patch_end=0.25,
)
shaken = sb.System(
    model,
    contacts=[sb.Contact(paper.CONTACT, stop)],
    harvesters=[piezo],
    base_excitation=sb.BaseExcitation(motion=motion),
)
plot_system(shaken)

# %%
# A coil and a changing axial load
# --------------------------------

coil = sb.ElectromagneticHarvester(
    force_factor=1.5, resistance=30.0, coil_resistance=10.0, location=0.4
)
load = sb.AxialLoadModulation(
    motion=sb.HarmonicLoad(frequency_ratio=2.0, amplitude=3.0)
)
shaker = sb.Shaker(frequency_ratio=1.21, velocity_amplitude=0.2)
plot_system(
    sb.System(
        model,
        contacts=[sb.Contact(paper.CONTACT, shaker)],
        harvesters=[coil],
        axial_load=load,
    )
)
