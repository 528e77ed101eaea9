"""Contact stiffness from tracked impacts: their durations over the speeds at which tip and body close.

For a force k d^1.5 between two bodies of effective mass m that close at v (Hertz), the contact lasts

    T = 2.943 (5 m/(4 k))^0.4 v^-0.2 .

The power of v checks that the impacts are such collisions; on a limp beam, which bends while it is in touch,
they are not, and then there is no stiffness to tell.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from snapbeam.core.findings import Diagnostic
from snapbeam.core.validate import InputError, InputTypeError, positive
from snapbeam.lab.calibration.measurements import HERTZ_TIME
from snapbeam.lab.plausibility.calibration import KINDS

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["ContactStiffness", "stiffness_from_impacts"]

_HERTZ_POWER = -0.2
_LEAST_SPAN = 2.0  # factor by which speeds must differ for the power to be told
_COARSE = 6.0  # frames


@dataclass(frozen=True)
class ContactStiffness:
    """Contact stiffness [N/m^1.5] from impacts, with its standard error; ``exponent`` is the power of the speed.

    ``impacts`` were used.
    """

    stiffness: float
    stiffness_se: float
    exponent: float
    exponent_se: float
    impacts: int
    diagnostics: tuple[Diagnostic, ...]


def stiffness_from_impacts(impacts: xr.Dataset, effective_mass: float) -> ContactStiffness:
    """Fit the contact stiffness to the durations of tracked impacts.

    Parameters
    ----------
    impacts : xarray.Dataset
        From :func:`snapbeam.lab.contact_onsets`; those of which both ends were seen count.
    effective_mass : float
        1/(1/m_1 + 1/m_2) of the two bodies [kg].

    Raises
    ------
    InputError
        If fewer than three impacts can be used.
    """
    import xarray as xr

    mass = positive("effective_mass", effective_mass, "kg")
    if not isinstance(impacts, xr.Dataset):
        raise InputTypeError(f"impacts: must be an xarray.Dataset, not {type(impacts).__name__}")
    missing = [
        name for name in ("duration", "duration_stderr", "closing_speed", "frames") if name not in impacts
    ]
    if missing:
        raise InputError(f"impacts without {', '.join(missing)}: must come from contact_onsets()")
    speed, duration = impacts["closing_speed"].values, impacts["duration"].values
    error = impacts["duration_stderr"].values
    good = np.isfinite(speed) & (speed > 0.0) & (duration > 0.0) & (impacts["bounded"].values == 1)
    if good.sum() < 3:
        raise InputError(
            f"impacts: {int(good.sum())} of {speed.size} seen from end to end: must be at least 3"
        )
    log_v, log_t = np.log(speed[good]), np.log(duration[good])
    spread = np.maximum(error[good] / duration[good], 1e-3)
    weight = 1.0 / spread**2
    middle = float((weight * log_v).sum() / weight.sum())
    lever = float((weight * (log_v - middle) ** 2).sum())
    level = float((weight * log_t).sum() / weight.sum())
    exponent = float((weight * (log_v - middle) * log_t).sum()) / lever if lever > 0.0 else math.nan
    rest = log_t - level - (log_v - middle) * (exponent if math.isfinite(exponent) else 0.0)
    scatter = max(1.0, float(np.sqrt((weight * rest**2).sum() / max(good.sum() - 2, 1))))
    exponent_se = scatter / math.sqrt(lever) if lever > 0.0 else math.inf
    # the constant of the law, with its power held
    constant = float((weight * (log_t - _HERTZ_POWER * log_v)).sum() / weight.sum())
    held = log_t - _HERTZ_POWER * log_v - constant
    constant_se = math.sqrt(1.0 / weight.sum()) * max(
        1.0, float(np.sqrt((weight * held**2).sum() / max(good.sum() - 1, 1)))
    )
    stiffness = 1.25 * mass * (HERTZ_TIME / math.exp(constant)) ** 2.5
    told = []
    span = float(np.exp(np.ptp(log_v)))
    if abs(exponent - _HERTZ_POWER) > max(4.0 * exponent_se, 0.1):
        told.append(KINDS["exponent"].found(exponent=exponent, error=exponent_se))
    elif span < _LEAST_SPAN or good.sum() < 5:
        told.append(KINDS["few"].found(count=int(good.sum()), span=span))
    frames = float(np.median(impacts["frames"].values[good]))
    if frames < _COARSE:
        told.append(KINDS["coarse"].found(frames=frames))
    return ContactStiffness(
        stiffness, 2.5 * constant_se * stiffness, exponent, exponent_se, int(good.sum()), tuple(told)
    )
