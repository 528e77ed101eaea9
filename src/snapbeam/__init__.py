"""snapbeam: the impact dynamics of bistable buckled beams.

A clamped-clamped beam pressed past buckling is struck by a shaker; its reduced model is integrated, each run
is classed, and maps show where it snaps.
"""

from snapbeam.core.codes import ResponseClass, RunStatus, classify
from snapbeam.core.provenance import __version__
from snapbeam.core.validate import InputError, InputTypeError
from snapbeam.model.beam import Beam
from snapbeam.model.contact import HertzContact, Restitution
from snapbeam.model.drive import RecordedDrive, Shaker, quasi_static_threshold
from snapbeam.model.frequencies import exact_natural_freq
from snapbeam.model.reduction import ReducedModel
from snapbeam.runs.response import Response
from snapbeam.runs.simulate import Run, simulate
from snapbeam.runs.tolerance import Accuracy, conditioning
from snapbeam.sweeps.grid import response_map
from snapbeam.sweeps.stored import long_map
from snapbeam.sweeps.threshold import threshold_curve

__all__ = [
    "Accuracy",
    "Beam",
    "HertzContact",
    "InputError",
    "InputTypeError",
    "RecordedDrive",
    "ReducedModel",
    "Response",
    "ResponseClass",
    "Restitution",
    "Run",
    "RunStatus",
    "Shaker",
    "__version__",
    "classify",
    "conditioning",
    "exact_natural_freq",
    "long_map",
    "quasi_static_threshold",
    "response_map",
    "simulate",
    "threshold_curve",
]
