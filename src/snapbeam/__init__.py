"""snapbeam: the impact dynamics of bistable buckled beams.

A clamped-clamped beam pressed past buckling is struck by a shaker; its reduced model is integrated, each run
is classed, and sweeps show where it snaps.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

from snapbeam.core.showing import register_accessor

if TYPE_CHECKING:
    from snapbeam.core.codes import ResponseClass, RunStatus, classify
    from snapbeam.core.findings import Finding, PlausibilityWarning
    from snapbeam.core.netcdf import write_netcdf
    from snapbeam.core.validate import InputError, InputTypeError
    from snapbeam.core.version import __version__
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
    from snapbeam.model.ends import Ends
    from snapbeam.model.galerkin.frequencies import exact_natural_freq
    from snapbeam.model.galerkin.quasi_static import quasi_static_threshold
    from snapbeam.model.galerkin.reduction import ReducedModel
    from snapbeam.model.imperfection import Imperfection
    from snapbeam.model.imperfection.fitted import fit_wells
    from snapbeam.model.integration import Integration
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

__all__ = [
    "STATISTICS",
    "AccelerationSine",
    "Accuracy",
    "Attractor",
    "Attractors",
    "Beam",
    "Branch",
    "Burst",
    "Chirp",
    "ContactLaw",
    "DisplacementSine",
    "Drive",
    "EdgeState",
    "Ends",
    "Event",
    "Finding",
    "Flight",
    "HalfSine",
    "HertzContact",
    "HuntCrossley",
    "Imperfection",
    "InputError",
    "InputTypeError",
    "Integration",
    "Keeping",
    "KelvinVoigt",
    "NoOrbit",
    "Noise",
    "Orbit",
    "Outcome",
    "PlausibilityWarning",
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
    "Shaker",
    "Sine",
    "Starts",
    "State",
    "Statistic",
    "Still",
    "StoreError",
    "Striker",
    "Survival",
    "System",
    "Tally",
    "TwoSines",
    "__version__",
    "advance",
    "attractors",
    "basin_entropy",
    "basins",
    "bending_stress",
    "bifurcation_diagram",
    "classify",
    "conditioning",
    "continue_orbit",
    "edge_state",
    "exact_natural_freq",
    "explore",
    "fit_wells",
    "hertz_stress",
    "integrity",
    "lifetime_map",
    "load_run",
    "long_map",
    "lyapunov",
    "periodic_orbit",
    "poincare",
    "quasi_static_threshold",
    "read_store",
    "response_map",
    "separation_exponent",
    "simulate",
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
    "model.contact": "ContactLaw HertzContact HuntCrossley KelvinVoigt PowerLaw Restitution bending_stress "
    "hertz_stress",
    "model.drive": "AccelerationSine Burst Chirp DisplacementSine Drive Flight HalfSine Noise Recorded Sine Still "
    "TwoSines",
    "model.galerkin.frequencies": "exact_natural_freq",
    "model.ends": "Ends",
    "model.imperfection": "Imperfection",
    "model.imperfection.fitted": "fit_wells",
    "model.integration": "Integration",
    "model.galerkin.quasi_static": "quasi_static_threshold",
    "model.galerkin.reduction": "ReducedModel",
    "model.state": "State",
    "model.striker": "RecordedDrive Shaker Striker",
    "model.system": "System",
    "runs.advance": "advance",
    "runs.outcome": "Outcome",
    "runs.run": "Run",
    "runs.save": "load_run",
    "runs.simulate": "simulate",
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

register_accessor()
del register_accessor


def __getattr__(name: str) -> Any:
    """A public name, or a room, when it is first asked for."""
    if name in _ROOMS:
        return import_module(f"snapbeam.{name}")
    home = _HOMES.get("Outcome" if name == "Response" else name)
    if name == "explore":
        home = "explorer"
    if home is None:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    found = getattr(import_module(f"snapbeam.{home}"), "Outcome" if name == "Response" else name)
    globals()[name] = found
    return found


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
