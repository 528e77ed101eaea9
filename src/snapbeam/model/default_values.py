"""The beam, the contact and the runs of Rouleau et al., J. Sound Vib. (2024), 118291, by name."""

from __future__ import annotations

from snapbeam.model.beam import Beam
from snapbeam.model.contact.hertz import HertzContact

# Section 3.3.  The thickness and the buckling level are those the paper fitted to measured frequencies
# (measured: 0.44 mm and 0.5 mm).
BEAM = Beam(length=0.161, thickness=0.4e-3, width=15e-3, density=7800.0, young_modulus=200e9, buckling_level=0.335e-3)

# Section 3.3: the same beam before compression, whose first two frequencies set the thickness.
STRAIGHT_BEAM = BEAM.replace(axial_load=0.0)

# Section 3.3.  The stated materials give this value only with a modulus of 5.4 GPa for the tip; a radius, not a
# diameter, of 5 mm gives 3.7e8.
CONTACT = HertzContact(stiffness=4e8)

# Section 3.3: x_s = L/2.1.
LOCATION = 1.0 / 2.1

# Section 3.3: in every mode, from the measured decay of free vibration.
DAMPING_RATIO = 0.005

# Section 3.3: converged in the first ten frequencies and in the maps.
MODES = 32

# Sections 2 and 4.2: cycles of excitation in the experiment and in Fig. 6, and in Fig. 7.
CYCLES = 200
LONG_CYCLES = 1000
