"""Public names; each is loaded when it is first used."""

from .attractors import Attractor as Attractor
from .attractors import Attractors as Attractors
from .attractors import find_attractors as find_attractors
from .backbone import backbone_curve as backbone_curve
from .basins import basin_entropy as basin_entropy
from .basins import basins_of_attraction as basins_of_attraction
from .basins import dynamical_integrity as dynamical_integrity
from .basins import uncertainty_exponent as uncertainty_exponent
from .bifurcation import bifurcation_diagram as bifurcation_diagram
from .bifurcation_curves import bifurcation_curve as bifurcation_curve
from .branches import Branch as Branch
from .branches import SpecialPoint as SpecialPoint
from .branches import continuation as continuation
from .branches import switch_branch as switch_branch
from .edge_states import EdgeState as EdgeState
from .edge_states import edge_tracking as edge_tracking
from .flow import InitialConditions as InitialConditions
from .lifetimes import LifetimeSettings as LifetimeSettings
from .lifetimes import lifetime_map as lifetime_map
from .lyapunov import largest_lyapunov as largest_lyapunov
from .lyapunov import lyapunov_spectrum as lyapunov_spectrum
from .periodic_orbits import OrbitNotFoundError as OrbitNotFoundError
from .periodic_orbits import PeriodicOrbit as PeriodicOrbit
from .periodic_orbits import periodic_orbit as periodic_orbit
from .sections import poincare_section as poincare_section
from .swept_statistics import hysteresis as hysteresis
