"""snapbeam: the impact dynamics of bistable buckled beams.

A clamped-clamped beam pressed past buckling is struck by a shaker; its reduced model is integrated, each run
is classed, and sweeps show where it snaps.
"""

from typing import Any

from snapbeam.core.codes import ResponseClass, RunStatus, classify
from snapbeam.core.findings import Finding, PlausibilityWarning
from snapbeam.core.netcdf import write_netcdf
from snapbeam.core.provenance import __version__
from snapbeam.core.showing import register_accessor
from snapbeam.core.validate import InputError, InputTypeError
from snapbeam.design.distributions import Between, LogNormal, Normal, Uniform
from snapbeam.design.optimum.design import Effort, design, design_problem
from snapbeam.design.optimum.evolution import Evolution
from snapbeam.design.optimum.measures import Goal, Limit
from snapbeam.design.plan import Cost, plan
from snapbeam.design.posterior.classes import class_likelihood
from snapbeam.design.posterior.posterior import Posterior, posterior
from snapbeam.design.probability.allocation import Allocation
from snapbeam.design.probability.dots import judge_dots
from snapbeam.design.probability.probability_map import probability_map
from snapbeam.design.quantiles.quantile_threshold import quantile_threshold
from snapbeam.design.quantiles.search import Search
from snapbeam.design.sensitivity.answers import LifetimeOf, NotchOf, StatisticOf, ThresholdOf
from snapbeam.design.sensitivity.given_data import given_data_indices
from snapbeam.design.sensitivity.sensitivity import sensitivity
from snapbeam.design.sensitivity.variance import sobol
from snapbeam.design.spread import Spread
from snapbeam.dynamics.attractors import Attractor, Attractors, attractors
from snapbeam.dynamics.basins import basins
from snapbeam.dynamics.bifurcation import bifurcation_diagram
from snapbeam.dynamics.edge import EdgeState, edge_state
from snapbeam.dynamics.lifetimes.lifetime_map import lifetime_map
from snapbeam.dynamics.lifetimes.survival import Survival
from snapbeam.dynamics.lyapunov import lyapunov, separation_exponent
from snapbeam.dynamics.measures import basin_entropy, integrity, uncertainty_exponent
from snapbeam.dynamics.orbits.branch import Branch, Event
from snapbeam.dynamics.orbits.continuation import continue_orbit, switch_branch
from snapbeam.dynamics.orbits.orbit import NoOrbit, Orbit, periodic_orbit
from snapbeam.dynamics.sections import poincare
from snapbeam.dynamics.starts import Starts
from snapbeam.engines.outcomes import STATISTICS, Statistic
from snapbeam.model.beam import Beam
from snapbeam.model.contact import (
    ContactLaw,
    HertzContact,
    HuntCrossley,
    KelvinVoigt,
    PowerLaw,
    Restitution,
    bending_stress,
    hertz_stress,
)
from snapbeam.model.drive import (
    AccelerationSine,
    Burst,
    Chirp,
    DisplacementSine,
    Drive,
    Flight,
    HalfSine,
    Noise,
    Recorded,
    Sine,
    Still,
    TwoSines,
)
from snapbeam.model.frequencies import exact_natural_freq
from snapbeam.model.integration import Integration
from snapbeam.model.quasi_static import quasi_static_threshold
from snapbeam.model.reduction import ReducedModel
from snapbeam.model.state import State
from snapbeam.model.striker import RecordedDrive, Shaker, Striker
from snapbeam.model.system import System
from snapbeam.runs.advance import advance
from snapbeam.runs.outcome import Outcome
from snapbeam.runs.run import Run
from snapbeam.runs.save import load_run
from snapbeam.runs.simulate import simulate
from snapbeam.runs.tolerance import Accuracy, conditioning
from snapbeam.sweeps.doors import long_map, response_map, threshold_curve
from snapbeam.sweeps.errors import StoreError
from snapbeam.sweeps.reading import read_store
from snapbeam.sweeps.replicas import Replicas
from snapbeam.sweeps.stored import Keeping, Tally
from snapbeam.sweeps.sweep import sweep
from snapbeam.sweeps.threshold import threshold

Response = Outcome
register_accessor()
del register_accessor

__all__ = [
    "STATISTICS",
    "AccelerationSine",
    "Accuracy",
    "Allocation",
    "Attractor",
    "Attractors",
    "Beam",
    "Between",
    "Branch",
    "Burst",
    "Chirp",
    "ContactLaw",
    "Cost",
    "DisplacementSine",
    "Drive",
    "EdgeState",
    "Effort",
    "Event",
    "Evolution",
    "Finding",
    "Flight",
    "Goal",
    "HalfSine",
    "HertzContact",
    "HuntCrossley",
    "InputError",
    "InputTypeError",
    "Integration",
    "Keeping",
    "KelvinVoigt",
    "LifetimeOf",
    "Limit",
    "LogNormal",
    "NoOrbit",
    "Noise",
    "Normal",
    "NotchOf",
    "Orbit",
    "Outcome",
    "PlausibilityWarning",
    "Posterior",
    "PowerLaw",
    "Recorded",
    "RecordedDrive",
    "ReducedModel",
    "Replicas",
    "Response",
    "ResponseClass",
    "Restitution",
    "Run",
    "RunStatus",
    "Search",
    "Shaker",
    "Sine",
    "Spread",
    "Starts",
    "State",
    "Statistic",
    "StatisticOf",
    "Still",
    "StoreError",
    "Striker",
    "Survival",
    "System",
    "Tally",
    "ThresholdOf",
    "TwoSines",
    "Uniform",
    "__version__",
    "advance",
    "attractors",
    "basin_entropy",
    "basins",
    "bending_stress",
    "bifurcation_diagram",
    "class_likelihood",
    "classify",
    "conditioning",
    "continue_orbit",
    "design",
    "design_problem",
    "edge_state",
    "exact_natural_freq",
    "explore",
    "given_data_indices",
    "hertz_stress",
    "integrity",
    "judge_dots",
    "lifetime_map",
    "load_run",
    "long_map",
    "lyapunov",
    "periodic_orbit",
    "plan",
    "poincare",
    "posterior",
    "probability_map",
    "quantile_threshold",
    "quasi_static_threshold",
    "read_store",
    "response_map",
    "sensitivity",
    "separation_exponent",
    "simulate",
    "sobol",
    "sweep",
    "switch_branch",
    "threshold",
    "threshold_curve",
    "uncertainty_exponent",
    "write_netcdf",
]


def __getattr__(name: str) -> Any:
    """The explorer, when it is first asked for: the package does without what draws pages."""
    if name == "explore":
        from importlib import import_module

        return import_module("snapbeam.explorer").explore
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
