"""Steps for a requested tolerance, and the error estimate of a run.

An impacting beam can be chaotic.  Two runs whose drives differ by a relative 1e-13, little more than rounding, then
diverge, and no integrator can bound the error of a single run after that time.  snapbeam therefore estimates the error
up to the predictability horizon: the time at which the difference of these runs exceeds a tenth of the tolerance.
"""

from __future__ import annotations

import math
import warnings
from dataclasses import dataclass, fields, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from snapbeam.model.integration import ACCURACIES, Integration
from snapbeam.model.system import System
from snapbeam.simulation.dataset import joined
from snapbeam.simulation.request import checked_request, cycle_of
from snapbeam.solver.assemble import make_ensemble, plans_of, run_columns
from snapbeam.solver.engines import engine_of
from snapbeam.solver.ensemble import Ensemble
from snapbeam.solver.step_size import Plan
from snapbeam.util.provenance import made_by
from snapbeam.util.validation import InputError, choice, positive

if TYPE_CHECKING:
    import xarray as xr

_Array = NDArray[np.float64]

PERTURBATION = 1e-13
"""Relative change of the drive for the perturbation growth."""
_SHARE = 0.1
"""Fraction of the tolerance that the perturbation growth reaches at the predictability horizon."""
_SAMPLES_PER_CYCLE = 40
_MOST_SAMPLES = 400_000
_CHEAP = 3e-5
"""Tolerance above which order 4 takes less time than order 6."""
_ROUGH = (("standard", 1.0), ("standard", 0.5))
_FINE = tuple(("reference", 2.0**power) for power in range(1, -5, -1))
"""Accuracy level and factor of its steps, from coarse to fine."""
_BETWEEN = 2.0
"""Bound of a difference between the compared times, relative to its values at these times."""


@dataclass(frozen=True)
class ErrorEstimate:
    """Error estimate of a run of :func:`~snapbeam.simulate` with a tolerance.

    See Also
    --------
    snapbeam.perturbation_growth, snapbeam.Integration

    Examples
    --------
    >>> import snapbeam as sb
    >>> from snapbeam import paper
    >>> system = paper.struck_beam(frequency_ratio=1.2, velocity_amplitude=0.05)
    >>> run = sb.simulate(system, sb.Integration(cycles=5, tolerance=1e-6))
    >>> run.accuracy.reached, run.accuracy.estimated_error < 1e-6
    (True, True)
    """

    tolerance: float
    """Requested maximum error of the displacement at the striker and at mid-span, in units of b."""
    estimated_error: float
    """Bound of the error up to the horizon, in units of b: twice the maximum difference from the next coarser run, which
    exceeds the error if the refinement converges, plus the perturbation growth."""
    predictability_horizon: float
    """Time up to which the estimate is valid, s: the end of the run, or the predictability horizon."""
    perturbation_growth: float
    """Maximum change of the displacement during the run, in units of b, for a relative change of the drive by 1e-13."""
    reached: bool
    """True if the estimated error is within the tolerance up to the predictability horizon."""
    step: float
    """Step in free flight, s."""
    order: int
    """Order of the splitting method."""

    def attributes(self) -> dict[str, float | int]:
        """Return the estimate as attributes of a dataset."""
        return {
            f"accuracy_{item.name}": int(value) if isinstance(value, bool) else value
            for item in fields(self)
            if item.name not in ("step", "order")
            for value in [getattr(self, item.name)]
        }


def perturbation_growth(
    system: System,
    integration: Integration | None = None,
    *,
    accuracy: str = "reference",
    perturbation: float = PERTURBATION,
) -> xr.Dataset:
    """Compute the growth of a small perturbation of the drive: a lower limit of the error of any integrator.

    Parameters
    ----------
    system : System
        System whose runs are compared.
    integration : Integration, optional
        Cycles and solver settings, except accuracy and tolerance.
    accuracy : {"standard", "reference"}
        Accuracy level of the two runs.
    perturbation : float
        Relative change of every driving motion, or else of the initial state.

    Returns
    -------
    xarray.Dataset
        ``separation`` over ``time`` (s) and ``cycle``: the maximum change so far of the displacement at the striker and
        at mid-span, over b.

    See Also
    --------
    snapbeam.simulate, snapbeam.ErrorEstimate

    Examples
    --------
    >>> import snapbeam as sb
    >>> from snapbeam import paper
    >>> system = paper.struck_beam(frequency_ratio=1.6, velocity_amplitude=0.03, damping_ratio=0.05)
    >>> growth = sb.perturbation_growth(system, sb.Integration(cycles=5))
    """
    from snapbeam.util.datasets import xr

    size = positive("perturbation", perturbation)
    level = choice("accuracy", accuracy, ACCURACIES)
    system, integration = checked_request(system, integration)
    integration = integration.replace(accuracy=level, tolerance=None, early_termination=False)
    plan = plans_of(system, integration, run_columns(system, {}))[0]
    ensemble = make_ensemble(system, integration, plan=plan)
    times = _instants(system, ensemble)
    separation = _apart(_watch(system, ensemble, times), _watch(system, _perturbed(ensemble, system, size), times))
    attrs = {
        "title": "perturbation growth of a run",
        "length_scale": system.scale.length,
        "perturbation": size,
        "step": float(ensemble.step_times[0]),
        "order": plan.order,
    }
    return xr.Dataset(
        {
            "separation": (
                "time",
                separation,
                {"units": "1", "long_name": "maximum change of the displacement so far, over b"},
            )
        },
        {
            "time": ("time", times, {"units": "s", "long_name": "time"}),
            "cycle": ("time", times / cycle_of(system), {"units": "1", "long_name": "cycles of excitation"}),
        },
        attrs | made_by(attrs),
    )


def steps_for(system: System, integration: Integration) -> tuple[Plan, ErrorEstimate]:
    """Return steps with which a run meets the tolerance of *integration*, and the error estimate.

    Runs with finer and finer steps are compared at the striker and at mid-span, 40 times per cycle, until two of them
    differ by less than half the tolerance up to the horizon.  The steps of the finer run are taken; the difference
    bounds its error if the refinement converges.  The perturbation growth is added to the estimate.
    """
    limit = integration.tolerance
    assert limit is not None
    whole = integration.replace(tolerance=None, early_termination=False)
    steps = {level: plans_of(system, whole.replace(accuracy=level), run_columns(system, {}))[0] for level in ACCURACIES}
    refinements = _FINE if limit < _CHEAP else (*_ROUGH, *_FINE[1:])
    levels = [steps[level].scaled(length) for level, length in refinements]
    times = _instants(system, make_ensemble(system, whole, plan=steps["standard"]))
    coarse = _watch(system, make_ensemble(system, whole, plan=levels[0]), times)
    for plan in levels[1:]:
        ensemble = make_ensemble(system, whole, plan=plan)
        fine = _watch(system, ensemble, times)
        response = _apart(fine, _watch(system, _perturbed(ensemble, system, PERTURBATION), times))
        bound = _BETWEEN * _apart(coarse, fine) + response
        last = _last_within(response, _SHARE * limit)
        reached = bool(bound[last] <= limit)
        if reached:
            break
        coarse = fine
    if not reached:
        last = min(last, _last_within(bound, limit))
        warnings.warn(
            f"tolerance = {limit:g} b is met only up to {times[last]:g} s of {times[-1]:g} s, which is less than the "
            "predictability horizon; see run.accuracy, or give a larger tolerance",
            RuntimeWarning,
            stacklevel=3,
        )
    return plan, ErrorEstimate(
        tolerance=limit,
        estimated_error=float(bound[last]),
        predictability_horizon=float(times[last]),
        perturbation_growth=float(response[-1]),
        reached=reached,
        step=float(ensemble.step_times[0]),
        order=plan.order,
    )


def _instants(system: System, ensemble: Ensemble) -> _Array:
    end = float(ensemble.runs["tick"][0] * ensemble.runs["end"][0])
    fastest = min(cycle_of(system), 1.0 / system.model.reference_frequency)
    count = math.ceil(end / fastest * _SAMPLES_PER_CYCLE)
    return np.linspace(0.0, end, min(count, _MOST_SAMPLES) + 1)


def _perturbed(ensemble: Ensemble, system: System, size: float) -> Ensemble:
    """Return the run with its drives, or its initial state if nothing drives it, changed by a relative *size*."""
    factor, channels = 1.0 + size, ensemble.channels
    if channels is None:
        raise InputError(
            "engine = 'python': does not change a drive by a perturbation, for its growth or for a tolerance; use engine = 'native'"
        )
    if not channels.moves:
        return replace(ensemble, starts=ensemble.starts * factor)
    return replace(ensemble, channels=replace(channels, uses=channels.uses * factor))


def _watch(system: System, ensemble: Ensemble, times: _Array) -> _Array:
    """Return displacements of the beam at the striker and at mid-span, over b, shape (times, 2)."""
    recorded = joined(list(engine_of(ensemble).record(ensemble, times, False)))
    beam = ensemble.structure.row_of_beam(ensemble.contact_rows[0])
    read_out = np.column_stack((beam, ensemble.structure.center))
    found = np.full((times.size, 2), np.nan)
    found[: recorded.times.size] = recorded.q @ read_out / system.scale.length
    return found


def _apart(a: _Array, b: _Array) -> _Array:
    """Return the maximum difference of two runs so far; infinite after the time at which one of them failed."""
    difference = np.abs(a - b).max(axis=1)
    return np.asarray(np.maximum.accumulate(np.where(np.isfinite(difference), difference, np.inf)))


def _last_within(growing: _Array, limit: float) -> int:
    """Return the index of the last time at which a growing quantity, 0 at first, is within *limit*."""
    return max(int(np.searchsorted(growing, limit, side="right")) - 1, 0)
