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
from numpy.typing import ArrayLike, NDArray

from snapbeam.core.provenance import made_by
from snapbeam.core.validate import choice, positive, within
from snapbeam.engines.columns import Reals, Ticks
from snapbeam.engines.cpu import driver as cpu_engine
from snapbeam.engines.ensemble import Ensemble
from snapbeam.engines.plan import Plan
from snapbeam.model.contact import HertzContact, Restitution
from snapbeam.model.drive import RecordedDrive, Shaker
from snapbeam.model.reduction import ReducedModel
from snapbeam.runs.request import OneRun, one_run

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["PERTURBATION", "Accuracy", "conditioning", "steps_for"]

_Array = NDArray[np.float64]

PERTURBATION = 1e-13
"""Relative change of the drive whose response is called the conditioning."""
_TOLERANCES = (1e-10, 0.1)
_SHARE = 0.1
"""Of the tolerance: what the response to the perturbation may take before nothing more is promised."""
_SAMPLES_PER_CYCLE = 40
_MOST_SAMPLES = 400_000
_CHEAP = 3e-5
"""Tolerance from which order 4 is the cheaper one."""
_HALVINGS = {4: 2, 6: 6}
_LADDER = ((4, 1), (4, 2), (6, 2), (6, 4), (6, 8), (6, 16), (6, 32))
"""Order of the composition and divisor of the flight step of level "map", from coarse to fine."""


@dataclass(frozen=True)
class Accuracy:
    """What a tolerance asked of :func:`~snapbeam.simulate` gave."""

    tolerance: float
    """Asked: greatest error of the displacement at the contact point and at the centre, b."""
    estimated_error: float
    """Greatest difference, up to the horizon, between this run and the next coarser one, b."""
    horizon: float
    """Up to here, s, the estimate holds: the end of the run, or where the conditioning forbids more."""
    conditioning: float
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


def conditioning(
    model: ReducedModel,
    shaker: Shaker | RecordedDrive | None = None,
    contact: HertzContact | Restitution | None = None,
    cycles: int | None = None,
    *,
    accuracy: str = "reference",
    initial_state: tuple[ArrayLike, ArrayLike] | None = None,
    reference_freq: float | None = None,
    perturbation: float = PERTURBATION,
) -> xr.Dataset:
    """How far a tiny change of the drive moves a run: what no integrator can promise to undercut.

    Parameters
    ----------
    model, shaker, contact, cycles, initial_state, reference_freq
        As for :func:`~snapbeam.simulate`.
    accuracy : {"reference", "map"}
        Steps of the two runs compared.
    perturbation : float
        Relative change of the shaker's amplitude, or of the initial state if there is no shaker.

    Returns
    -------
    xarray.Dataset
        Over ``time`` (s) and ``cycle``: ``separation``, the greatest change up to that time of the displacement
        at the contact point and at the centre, in b.

    Raises
    ------
    InputError
        For bad input.
    """
    import xarray as xr

    size = positive("perturbation", perturbation)
    asked = one_run(model, shaker, contact, cycles, initial_state, False, reference_freq)
    plan = asked.plan(accuracy=choice("accuracy", accuracy, ("map", "reference")))
    ensemble = asked.ensemble(plan)
    times = _instants(asked, ensemble)
    separation = _apart(_watch(ensemble, times), _watch(_perturbed(ensemble, size), times))
    attrs = {"title": "conditioning of a run", "perturbation": size, "step": plan.step, "order": plan.order}
    return xr.Dataset(
        {
            "separation": (
                "time",
                separation,
                {"units": "b", "long_name": "greatest change of the displacement so far"},
            )
        },
        {
            "time": ("time", times, {"units": "s", "long_name": "time"}),
            "cycle": ("time", times / asked.period, {"units": "1", "long_name": "cycles of excitation"}),
        },
        attrs | made_by(attrs),
    )


def steps_for(tolerance: float, asked: OneRun) -> tuple[Plan, Accuracy]:
    """Steps with which a run meets *tolerance*, and what they gave.

    Runs of ever finer steps are compared with the one before, at the contact point and at the centre, 40 times
    a cycle, until they differ by less than the tolerance up to the horizon; the finer one is taken, so the
    difference bounds its error from above wherever refinement converges.

    Raises
    ------
    InputError
        For a tolerance out of range.
    """
    limit = within("tolerance", tolerance, *_TOLERANCES, closed="both", unit="b")
    whole = replace(asked, early_decision=False)
    base = whole.plan()
    levels = [_level(base, order, divisor) for order, divisor in _LADDER]
    if limit < _CHEAP:
        levels = levels[2:]
    times = _instants(whole, whole.ensemble(base))
    coarse = _watch(whole.ensemble(levels[0]), times)
    for plan in levels[1:]:
        ensemble = whole.ensemble(plan)
        fine = _watch(ensemble, times)
        response = _apart(fine, _watch(_perturbed(ensemble, PERTURBATION), times))
        difference = _apart(coarse, fine)
        last = _last_within(response, _SHARE * limit)
        reached = bool(difference[last] <= limit)
        if reached:
            break
        coarse = fine
    if not reached:
        last = min(last, _last_within(difference, limit))
        warnings.warn(
            f"tolerance = {limit:g} b is met only up to {times[last]:g} s of {times[-1]:g} s although the conditioning "
            "would allow more; run.accuracy says so too",
            RuntimeWarning,
            stacklevel=3,
        )
    return plan, Accuracy(
        tolerance=limit,
        estimated_error=float(difference[last]),
        horizon=float(times[last]),
        conditioning=float(response[-1]),
        reached=reached,
        step=plan.step,
        order=plan.order,
    )


def _level(base: Plan, order: int, divisor: int) -> Plan:
    return Plan(order, base.step / divisor, base.coarsest, base.coarsest + _HALVINGS[order])


def _instants(asked: OneRun, ensemble: Ensemble) -> _Array:
    end = float(ensemble.reals[0, Reals.TICK] * ensemble.ticks[0, Ticks.END])
    fastest = min(asked.period, 1.0 / asked.reference_freq)
    count = math.ceil(end / fastest * _SAMPLES_PER_CYCLE)
    return np.linspace(0.0, end, min(count, _MOST_SAMPLES) + 1)


def _perturbed(ensemble: Ensemble, size: float) -> Ensemble:
    """The same run with its drive, or its initial state if nothing drives it, changed by a relative *size*."""
    reals, factor = ensemble.reals.copy(), 1.0 + size
    driven = bool((reals[:, Reals.AMPLITUDE] != 0.0).any())
    reals[:, Reals.AMPLITUDE] *= factor
    starts = ensemble.starts if driven else ensemble.starts * factor
    return replace(ensemble, reals=reals, starts=starts, drive_table=ensemble.drive_table * factor)


def _watch(ensemble: Ensemble, times: _Array) -> _Array:
    """Displacements of the contact point and of the centre, b, shape (times, 2)."""
    packed, layout = ensemble.packed, ensemble.packed.layout
    scale = packed.model.length_scale
    assert scale is not None
    _, _, outputs = cpu_engine.record(ensemble, 0, times, 0, False)
    center = packed.memory[layout.center : layout.center + layout.size]
    read_out = np.column_stack((ensemble.contact_rows[0], center))
    return np.asarray(outputs.rows @ read_out / scale)


def _apart(a: _Array, b: _Array) -> _Array:
    """Greatest difference of two runs so far; infinite from where one of them failed."""
    difference = np.abs(a - b).max(axis=1)
    return np.asarray(np.maximum.accumulate(np.where(np.isfinite(difference), difference, np.inf)))


def _last_within(growing: _Array, limit: float) -> int:
    """Index of the last instant at which a growing quantity, 0 at first, is within *limit*."""
    return max(int(np.searchsorted(growing, limit, side="right")) - 1, 0)
