r"""
One run
=======

The 32-mode beam of the paper, hit at :math:`\Omega = 1.21` with the velocity amplitude :math:`V = 0.18`,
which is enough to make it snap through (Fig. 5 of the paper). The shaker starts in contact with the beam at
rest in its lower well and moves as

.. math:: w_s(t) = w(x_s, 0) + \frac{V b\, \omega_1}{\omega} \sin \omega t .
"""

import snapbeam as sb
from snapbeam import paper

shaker = sb.Shaker(
    frequency_ratio=1.21, velocity_amplitude=0.18, location=paper.LOCATION
)
system = sb.System(
    sb.ReducedModel.from_beam(
        paper.BEAM, modes=32, damping_ratio=paper.DAMPING_RATIO
    ),
    contacts=[sb.Contact(paper.CONTACT, shaker)],
)
run = sb.simulate(system, sb.Integration(cycles=40))

# %%
# The summary contains the response class and the statistics of the run:

print(run.summary.response_class.label)
print(
    f"{run.summary.zero_crossings} crossings, "
    f"the last at {1e3 * run.summary.last_zero_crossing:.1f} ms"
)
print(f"{run.summary.impacts} impacts, the hardest {run.summary.peak_force:.2f} N")

# %%
# The waveform, and the impact with the maximum force:

ax = run.plot(window=(0.0, 20.0))

# %%
# The contact law dissipates no energy. The work of the shaker is therefore stored in the beam or in the contact, or
# dissipated by damping:

energy = run.dataset
balance = (
    energy.energy_beam
    - energy.energy_beam[0]
    + energy.energy_contact
    + energy.energy_dissipated
)
residual = abs(balance - energy.striker_work).max() / energy.attrs["gross_work"]
print(f"energy residual over gross work: {float(residual):.1e}")
