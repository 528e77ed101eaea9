"""Public names; each is loaded when it is first used."""

from .contact.stress import bending_stress as bending_stress
from .contact.stress import hertz_stress as hertz_stress
from .drive.chirp import AccelerationChirp as AccelerationChirp
from .drive.force import BurstForce as BurstForce
from .drive.force import ChirpForce as ChirpForce
from .drive.force import HalfSineForce as HalfSineForce
from .drive.force import NoiseForce as NoiseForce
from .equilibrium_branches import equilibrium_branches as equilibrium_branches
from .harvester import PiezoelectricPatches as PiezoelectricPatches
from .imperfection_identification import identify_imperfection as identify_imperfection
from .modal_convergence import converged_modes as converged_modes
from .modal_convergence import modal_error as modal_error
from .natural_frequencies import exact_natural_frequencies as exact_natural_frequencies
from .quasi_static import quasi_static_threshold as quasi_static_threshold
