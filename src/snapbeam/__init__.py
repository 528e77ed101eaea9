"""snapbeam: the impact dynamics of bistable buckled beams.

A clamped-clamped beam pressed past buckling is struck by a shaker; its reduced model is integrated, each run
is classed, and sweeps show where it snaps.
"""

from snapbeam.core.codes import ResponseClass, RunStatus, classify
from snapbeam.core.findings import Finding, PlausibilityWarning
from snapbeam.core.provenance import __version__
from snapbeam.core.showing import register_accessor
from snapbeam.core.validate import InputError, InputTypeError
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
    "Beam",
    "Burst",
    "Chirp",
    "ContactLaw",
    "DisplacementSine",
    "Drive",
    "Finding",
    "Flight",
    "HalfSine",
    "HertzContact",
    "HuntCrossley",
    "InputError",
    "InputTypeError",
    "Integration",
    "Keeping",
    "KelvinVoigt",
    "Noise",
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
    "State",
    "Statistic",
    "Still",
    "StoreError",
    "Striker",
    "System",
    "Tally",
    "TwoSines",
    "__version__",
    "advance",
    "bending_stress",
    "classify",
    "conditioning",
    "exact_natural_freq",
    "hertz_stress",
    "load_run",
    "long_map",
    "quasi_static_threshold",
    "response_map",
    "simulate",
    "sweep",
    "threshold",
    "threshold_curve",
]
