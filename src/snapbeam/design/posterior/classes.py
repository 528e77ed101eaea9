"""What measured response classes say of a beam: how likely each sample of it makes them."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from snapbeam.core.codes import ResponseClass
from snapbeam.core.kinds import checked
from snapbeam.core.validate import InputError, integer
from snapbeam.design.events import reached
from snapbeam.design.posterior.posterior import Posterior
from snapbeam.design.spread import ParameterUncertainty
from snapbeam.design.trials import trials_of
from snapbeam.model.integration import Integration
from snapbeam.model.system import System
from snapbeam.sweeps.stored import CheckpointOptions

if TYPE_CHECKING:
    from snapbeam.lab.compare.dots import MeasuredPoints

__all__ = ["class_likelihood"]

_Array = NDArray[np.float64]
_KINDS = (
    ResponseClass.INTRAWELL,
    ResponseClass.TRANSIENT_1,
    ResponseClass.TRANSIENT_2,
    ResponseClass.CONTINUOUS,
)
_PRIOR = 0.5


@checked
def class_likelihood(
    posterior: Posterior,
    system: System,
    measurements: MeasuredPoints,
    uncertainty: ParameterUncertainty,
    *,
    runs: int = 16,
    integration: Integration | None = None,
    checkpoint: str | os.PathLike[str] | CheckpointOptions | None = None,
) -> _Array:
    """Log likelihood of measured classes under every sample of a posterior, for :meth:`Posterior.updated`.

    The class of a dot is one outcome of *runs* and one more draw from the same unknown chances: with c of m runs of its
    class, a Dirichlet-multinomial of Jeffreys' prior gives it (c + 1/2)/(m + 2).  So a class that no run had is
    unlikely, not impossible, and few runs say little.

    Parameters
    ----------
    posterior : Posterior
        Few samples: :meth:`Posterior.resampled` first.
    system : System
        The nominal one, by which Omega and V of the dots are normalised.
    measurements : Dots
        Struck with the same Hz and m/s whatever the sample; those of unknown class are left out.
    uncertainty : Spread
        What differs from test to test, such as ``Spread(displacement=3.5e-6)``: no parameter of the posterior.
    runs : int
        Of each dot and sample, the same draws for all.
    integration, store
        As of :func:`snapbeam.probability_map`.

    Returns
    -------
    array of shape (samples,)

    Raises
    ------
    InputError
        For bad input, a spread that draws a parameter of the posterior, and dots without a class.
    """
    integer("runs", runs, 2, 10**6)
    shared = sorted(set(posterior.parameters) & set(uncertainty.of))
    if shared:
        raise InputError(f"spread: draws {', '.join(shared)}, which the posterior says")
    known = np.isin(measurements.response_class, _KINDS)
    if not known.any():
        raise InputError("dots: none has a known class")
    trials = trials_of(system, uncertainty, integration, store=checkpoint)
    samples, count = len(posterior.values), int(known.sum())
    sample, dot, number = (
        each.ravel()
        for each in np.meshgrid(np.arange(samples), np.arange(count), np.arange(runs), indexing="ij")
    )
    points = {name: posterior.values[sample, j] for j, name in enumerate(posterior.parameters)}
    points |= {
        "drive.frequency_ratio": measurements.frequency_ratio[known][dot],
        "drive.velocity_amplitude": measurements.velocity_amplitude[known][dot],
    }
    place = measurements.location[known]
    if np.isfinite(place).all():
        points["striker.location"] = place[dot]
    found = trials.statistics(trials.in_hz(points), number)
    mine = (found["response_class"] == measurements.response_class[known][dot]) & reached(found)
    hits = mine.reshape(samples, count, runs).sum(axis=-1)
    total = reached(found).reshape(samples, count, runs).sum(axis=-1)
    return np.asarray(np.log((hits + _PRIOR) / (total + _PRIOR * len(_KINDS))).sum(axis=-1))
