"""Error on request: steps refined until two runs agree, as far as the problem's conditioning allows.

An impacting beam can be chaotic.  Two runs whose drives differ by a relative 1e-13, little more than rounding, then
part company, and from there on no integrator can promise anything about a single run.  Accuracy is therefore
judged up to a horizon, the time at which that response exceeds a tenth of the tolerance, and the horizon
is reported.
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
from snapbeam.simulation.request import cycle_of, kernel_input
from snapbeam.solver.assemble import make_ensemble, plans_of, run_columns
from snapbeam.solver.ensemble import Ensemble
from snapbeam.solver.registry import resolve
from snapbeam.solver.step_size import Plan
from snapbeam.util.provenance import made_by
from snapbeam.util.validation import InputError, choice, positive

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["PERTURBATION", "ErrorEstimate", "perturbation_growth", "steps_for"]


_Array = NDArray[np.float64]

PERTURBATION = 1e-13
"""Relative change of the drive whose response is called the conditioning."""
_SHARE = 0.1
"""Of the tolerance: what the response to the perturbation may take before nothing more is promised."""
_SAMPLES_PER_CYCLE = 40
_MOST_SAMPLES = 400_000
_CHEAP = 3e-5
"""Tolerance from which order 4 is the cheaper one."""
_ROUGH = (("standard", 1.0), ("standard", 0.5))
_FINE = tuple(("reference", 2.0**power) for power in range(1, -5, -1))
"""Level of accuracy and length of its steps over those that the level takes, from coarse to fine."""
_BETWEEN = 2.0
"""What a difference may be between the instants that are compared, over what it is there."""


@dataclass(frozen=True)
class ErrorEstimate:
    """What a tolerance asked of :func:`~snapbeam.simulate` gave."""

    tolerance: float
    """Asked: greatest error of the displacement at the contact point and at the centre, b."""
    estimated_error: float
    """Bound of the error up to the horizon, b: twice the greatest difference from the next coarser run, which is larger
    than the error wherever refinement converges, and the conditioning there."""
    predictability_horizon: float
    """Up to here, s, the estimate holds: the end of the run, or where the conditioning forbids more."""
    perturbation_growth: float
    """Greatest change of the displacement, up to the end of the run, by a relative change of V by 1e-13, b."""
    reached: bool
    """Whether the estimate is within the tolerance up to the conditioning's horizon."""
    step: float
    """Flight step, s."""
    order: int
    """Of the composition."""

    def attributes(self) -> dict[str, float | int]:
        """The same, as attributes of a file."""
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
    """How far a tiny change of the drive moves a run: what no integrator can promise to undercut.

    Parameters
    ----------
    system : System
    integration : Integration, optional
        The number of cycles and the solver settings.  ``accuracy`` takes the place of its accuracy and tolerance.
    accuracy : {"standard", "reference"}
        Steps of the two runs compared.
    perturbation : float
        Relative change of every motion that drives the system, or of the start if nothing does.

    Returns
    -------
    xarray.Dataset
        Over ``time`` (s) and ``cycle``: ``separation``, the greatest change up to that time of the displacement
        at the contact point and at the centre, over b.

    Raises
    ------
    InputError
        For bad input.
    """
    import xarray as xr

    size = positive("perturbation", perturbation)
    level = choice("accuracy", accuracy, ACCURACIES)
    system, integration = kernel_input(system, integration)
    integration = integration.replace(accuracy=level, tolerance=None, early_termination=False)
    plan = plans_of(system, integration, run_columns(system, {}))[0]
    ensemble = make_ensemble(system, integration, plan=plan)
    times = _instants(system, ensemble)
    separation = _apart(_watch(system, ensemble, times), _watch(system, _perturbed(ensemble, size), times))
    attrs = {"title": "conditioning of a run", "perturbation": size, "step": plan.step, "order": plan.order}
    return xr.Dataset(
        {
            "separation": (
                "time",
                separation,
                {"units": "1", "long_name": "greatest change of the displacement so far, over b"},
            )
        },
        {
            "time": ("time", times, {"units": "s", "long_name": "time"}),
            "cycle": ("time", times / cycle_of(system), {"units": "1", "long_name": "cycles of excitation"}),
        },
        attrs | made_by(attrs),
    )


def steps_for(system: System, integration: Integration) -> tuple[Plan, ErrorEstimate]:
    """Steps with which a run meets the tolerance of *integration*, and what they gave.

    Runs of ever finer steps are compared with the one before, at the contact point and at the centre, 40 times
    a cycle, until they differ by less than half the tolerance up to the horizon; the finer one is taken, so the
    difference bounds its error from above wherever refinement converges.  What the run makes of a relative change
    of the drive by 1e-13, little more than it makes of rounding, is added.
    """
    limit = integration.tolerance
    assert limit is not None
    whole = integration.replace(tolerance=None, early_termination=False)
    steps = {
        level: plans_of(system, whole.replace(accuracy=level), run_columns(system, {}))[0]
        for level in ACCURACIES
    }
    rungs = _FINE if limit < _CHEAP else (*_ROUGH, *_FINE[1:])
    levels = [steps[level]._replace(step=length * steps[level].step) for level, length in rungs]
    times = _instants(system, make_ensemble(system, whole, plan=steps["standard"]))
    coarse = _watch(system, make_ensemble(system, whole, plan=levels[0]), times)
    for plan in levels[1:]:
        ensemble = make_ensemble(system, whole, plan=plan)
        fine = _watch(system, ensemble, times)
        response = _apart(fine, _watch(system, _perturbed(ensemble, PERTURBATION), times))
        bound = _BETWEEN * _apart(coarse, fine) + response
        last = _last_within(response, _SHARE * limit)
        reached = bool(bound[last] <= limit)
        if reached:
            break
        coarse = fine
    if not reached:
        last = min(last, _last_within(bound, limit))
        warnings.warn(
            f"tolerance = {limit:g} b is met only up to {times[last]:g} s of {times[-1]:g} s although the conditioning "
            "would allow more; integration.accuracy says so too",
            RuntimeWarning,
            stacklevel=3,
        )
    return plan, ErrorEstimate(
        tolerance=limit,
        estimated_error=float(bound[last]),
        predictability_horizon=float(times[last]),
        perturbation_growth=float(response[-1]),
        reached=reached,
        step=plan.step,
        order=plan.order,
    )


def _instants(system: System, ensemble: Ensemble) -> _Array:
    end = float(ensemble.runs["tick"][0] * ensemble.runs["end"][0])
    fastest = min(cycle_of(system), 1.0 / system.model.reference_frequency)
    count = math.ceil(end / fastest * _SAMPLES_PER_CYCLE)
    return np.linspace(0.0, end, min(count, _MOST_SAMPLES) + 1)


def _perturbed(ensemble: Ensemble, size: float) -> Ensemble:
    """The same run with all that drives it, or its start if nothing does, changed by a relative *size*."""
    factor, numbers = 1.0 + size, ensemble.drive_numbers.copy()
    names = ensemble.drive.number_names
    scaled = [names.index(name) for name in ensemble.drive.amplitudes if name in names]
    numbers[:, scaled] *= factor
    driven = bool(numbers[:, scaled].any() or ensemble.samples.any())
    if not driven and (ensemble.runs["tip_speed"] != 0.0).any():
        raise InputError(
            f"the drive {ensemble.drive.name!r}: names no number in its amplitudes that its motion is proportional to, "
            "so that nothing can be said of how a run responds to a change of it"
        )
    starts = ensemble.starts if driven else ensemble.starts * factor
    return replace(ensemble, drive_numbers=numbers, starts=starts, samples=ensemble.samples * factor)


def _watch(system: System, ensemble: Ensemble, times: _Array) -> _Array:
    """Displacements of the beam at the striker's location and at the centre, over b, shape (times, 2)."""
    recorded = joined(list(resolve("cpu")[1].record(ensemble, times, False)))
    beam = ensemble.structure.row_of_beam(ensemble.contact_rows[0])
    read_out = np.column_stack((beam, ensemble.structure.center))
    found = np.full((times.size, 2), np.nan)
    found[: recorded.times.size] = recorded.q @ read_out / system.scale.length
    return found


def _apart(a: _Array, b: _Array) -> _Array:
    """Greatest difference of two runs so far; infinite from where one of them failed."""
    difference = np.abs(a - b).max(axis=1)
    return np.asarray(np.maximum.accumulate(np.where(np.isfinite(difference), difference, np.inf)))


def _last_within(growing: _Array, limit: float) -> int:
    """Index of the last instant at which a growing quantity, 0 at first, is within *limit*."""
    return max(int(np.searchsorted(growing, limit, side="right")) - 1, 0)
