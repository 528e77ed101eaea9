"""snapbeam: the impact dynamics of bistable buckled beams.

A clamped-clamped beam pressed past buckling is struck by a shaker; its reduced model is integrated, each run
is classed, and sweeps show where it snaps.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from snapbeam.core.codes import ResponseClass, RunStatus, classify
    from snapbeam.core.findings import Finding, PlausibilityWarning
    from snapbeam.core.netcdf import write_netcdf
    from snapbeam.core.validate import InputError, InputTypeError
    from snapbeam.core.version import __version__
    from snapbeam.design.distributions import Between, LogNormal, Normal, Uniform
    from snapbeam.design.optimum.design import Effort, design_problem, optimize_design
    from snapbeam.design.optimum.evolution import Evolution
    from snapbeam.design.optimum.measures import Goal, Limit
    from snapbeam.design.plan import Cost, plan
    from snapbeam.design.posterior.classes import class_likelihood
    from snapbeam.design.posterior.posterior import Posterior, posterior
    from snapbeam.design.posterior.waveforms import Waveform
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
        LayeredHertz,
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
        Sum,
        TwoSines,
    )
    from snapbeam.model.ends import Ends
    from snapbeam.model.galerkin.frequencies import exact_natural_freq
    from snapbeam.model.galerkin.quasi_static import quasi_static_threshold
    from snapbeam.model.galerkin.reduction import ReducedModel
    from snapbeam.model.imperfection import Imperfection
    from snapbeam.model.imperfection.fitted import fit_wells
    from snapbeam.model.integration import Integration
    from snapbeam.model.state import State
    from snapbeam.model.striker import RecordedDrive, Shaker, Striker
    from snapbeam.model.striker.another import Another
    from snapbeam.model.system import System
    from snapbeam.model.world import AxialLoad, Base, Coil, LoadRamp, LoadSine, Piezo
    from snapbeam.runs.advance import advance
    from snapbeam.runs.outcome import Outcome
    from snapbeam.runs.run import Run
    from snapbeam.runs.save import load_run
    from snapbeam.runs.simulate import simulate
    from snapbeam.runs.stream import simulate_to_file
    from snapbeam.runs.tolerance import Accuracy, conditioning
    from snapbeam.sweeps.doors import long_map, response_map, threshold_curve
    from snapbeam.sweeps.errors import StoreError
    from snapbeam.sweeps.reading import read_store
    from snapbeam.sweeps.replicas import Replicas
    from snapbeam.sweeps.stored import Keeping, Tally
    from snapbeam.sweeps.sweep import sweep
    from snapbeam.sweeps.threshold import threshold

__all__ = [
    "STATISTICS",
    "AccelerationSine",
    "Accuracy",
    "Allocation",
    "Another",
    "Attractor",
    "Attractors",
    "AxialLoad",
    "Base",
    "Beam",
    "Between",
    "Branch",
    "Burst",
    "Chirp",
    "Coil",
    "ContactLaw",
    "Cost",
    "DisplacementSine",
    "Drive",
    "EdgeState",
    "Effort",
    "Ends",
    "Event",
    "Evolution",
    "Finding",
    "Flight",
    "Goal",
    "HalfSine",
    "HertzContact",
    "HuntCrossley",
    "Imperfection",
    "InputError",
    "InputTypeError",
    "Integration",
    "Keeping",
    "KelvinVoigt",
    "LayeredHertz",
    "LifetimeOf",
    "Limit",
    "LoadRamp",
    "LoadSine",
    "LogNormal",
    "NoOrbit",
    "Noise",
    "Normal",
    "NotchOf",
    "Orbit",
    "Outcome",
    "Piezo",
    "PlausibilityWarning",
    "Posterior",
    "PowerLaw",
    "Recorded",
    "RecordedDrive",
    "ReducedModel",
    "Replicas",
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
    "Sum",
    "Survival",
    "System",
    "Tally",
    "ThresholdOf",
    "TwoSines",
    "Uniform",
    "Waveform",
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
    "design_problem",
    "edge_state",
    "exact_natural_freq",
    "explore",
    "fit_wells",
    "given_data_indices",
    "hertz_stress",
    "integrity",
    "judge_dots",
    "lifetime_map",
    "load_run",
    "long_map",
    "lyapunov",
    "optimize_design",
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
    "simulate_to_file",
    "sobol",
    "sweep",
    "switch_branch",
    "threshold",
    "threshold_curve",
    "uncertainty_exponent",
    "write_netcdf",
]

# Where each name stands: it is loaded when it is first asked for, with what it needs.
_NAMES = {
    "core.codes": "ResponseClass RunStatus classify",
    "core.findings": "Finding PlausibilityWarning",
    "core.netcdf": "write_netcdf",
    "core.validate": "InputError InputTypeError",
    "core.version": "__version__",
    "design.distributions": "Between LogNormal Normal Uniform",
    "design.optimum.design": "Effort design_problem optimize_design",
    "design.optimum.evolution": "Evolution",
    "design.optimum.measures": "Goal Limit",
    "design.plan": "Cost plan",
    "design.posterior.classes": "class_likelihood",
    "design.posterior.posterior": "Posterior posterior",
    "design.posterior.waveforms": "Waveform",
    "design.probability.allocation": "Allocation",
    "design.probability.dots": "judge_dots",
    "design.probability.probability_map": "probability_map",
    "design.quantiles.quantile_threshold": "quantile_threshold",
    "design.quantiles.search": "Search",
    "design.sensitivity.answers": "LifetimeOf NotchOf StatisticOf ThresholdOf",
    "design.sensitivity.given_data": "given_data_indices",
    "design.sensitivity.sensitivity": "sensitivity",
    "design.sensitivity.variance": "sobol",
    "design.spread": "Spread",
    "dynamics.attractors": "Attractor Attractors attractors",
    "dynamics.basins": "basins",
    "dynamics.bifurcation": "bifurcation_diagram",
    "dynamics.edge": "EdgeState edge_state",
    "dynamics.lifetimes.lifetime_map": "lifetime_map",
    "dynamics.lifetimes.survival": "Survival",
    "dynamics.lyapunov": "lyapunov separation_exponent",
    "dynamics.measures": "basin_entropy integrity uncertainty_exponent",
    "dynamics.orbits.branch": "Branch Event",
    "dynamics.orbits.continuation": "continue_orbit switch_branch",
    "dynamics.orbits.orbit": "NoOrbit Orbit periodic_orbit",
    "dynamics.sections": "poincare",
    "dynamics.starts": "Starts",
    "engines.outcomes": "STATISTICS Statistic",
    "model.beam": "Beam",
    "model.contact": "ContactLaw HertzContact HuntCrossley KelvinVoigt LayeredHertz PowerLaw Restitution "
    "bending_stress hertz_stress",
    "model.drive": "AccelerationSine Burst Chirp DisplacementSine Drive Flight HalfSine Noise Recorded Sine Still "
    "Sum TwoSines",
    "model.galerkin.frequencies": "exact_natural_freq",
    "model.ends": "Ends",
    "model.imperfection": "Imperfection",
    "model.imperfection.fitted": "fit_wells",
    "model.integration": "Integration",
    "model.galerkin.quasi_static": "quasi_static_threshold",
    "model.galerkin.reduction": "ReducedModel",
    "model.state": "State",
    "model.striker": "RecordedDrive Shaker Striker",
    "model.striker.another": "Another",
    "model.system": "System",
    "model.world": "AxialLoad Base Coil LoadRamp LoadSine Piezo",
    "runs.advance": "advance",
    "runs.outcome": "Outcome",
    "runs.run": "Run",
    "runs.save": "load_run",
    "runs.simulate": "simulate",
    "runs.stream": "simulate_to_file",
    "runs.tolerance": "Accuracy conditioning",
    "sweeps.doors": "long_map response_map threshold_curve",
    "sweeps.errors": "StoreError",
    "sweeps.reading": "read_store",
    "sweeps.replicas": "Replicas",
    "sweeps.stored": "Keeping Tally",
    "sweeps.sweep": "sweep",
    "sweeps.threshold": "threshold",
}
_HOMES = {name: module for module, names in _NAMES.items() for name in names.split()}
_ROOMS = frozenset(module.partition(".")[0] for module in _NAMES) | {"figures", "lab", "paper"}


def __getattr__(name: str) -> Any:
    """A public name, or a room, when it is first asked for."""
    if name in _ROOMS:
        return import_module(f"snapbeam.{name}")
    home = _HOMES.get(name)
    if name == "explore":
        home = "explorer"
    if home is None:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    found = getattr(import_module(f"snapbeam.{home}"), name)
    globals()[name] = found
    return found


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
