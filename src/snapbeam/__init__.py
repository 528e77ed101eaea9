"""snapbeam: the impact dynamics of bistable buckled beams.

A clamped-clamped beam pressed past buckling is struck by a shaker; its reduced model is integrated, each run
is classed, and maps show where it snaps.
"""

from snapbeam.accuracy import Accuracy, conditioning
from snapbeam.codes import ResponseClass, RunStatus
from snapbeam.maps.grid import response_map
from snapbeam.maps.long import long_map
from snapbeam.maps.threshold import threshold_curve
from snapbeam.model.beam import Beam
from snapbeam.model.contact import HertzContact, Restitution
from snapbeam.model.drive import RecordedDrive, Shaker, quasi_static_threshold
from snapbeam.model.frequencies import exact_natural_freq
from snapbeam.model.reduction import ReducedModel
from snapbeam.provenance import __version__
from snapbeam.response import Response, classify
from snapbeam.simulation import Run, simulate
from snapbeam.validate import InputError, InputTypeError

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
