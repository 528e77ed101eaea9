"""One run, recorded: the beam, the shaker, and everything that can be read off them."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from snapbeam.core.codes import RunStatus
from snapbeam.core.provenance import made_by
from snapbeam.core.validate import InputError, finite_array
from snapbeam.engines.columns import Counts, Numbers, Reals, Ticks
from snapbeam.engines.cpu import driver as cpu_engine
from snapbeam.engines.ensemble import Ensemble
from snapbeam.engines.plan import Plan
from snapbeam.engines.registry import resolve
from snapbeam.model.contact import HertzContact, Restitution
from snapbeam.model.drive import RecordedDrive, Shaker
from snapbeam.model.reduction import ReducedModel
from snapbeam.runs.request import one_run
from snapbeam.runs.response import Response, statistics_of
from snapbeam.runs.schema import trajectory_dataset
from snapbeam.runs.tolerance import Accuracy, steps_for

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["Run", "simulate"]

_Array = NDArray[np.float64]

_SAMPLES_PER_CYCLE = 200
"""Regular samples of a run per cycle of the excitation or of the first mode, whichever is the faster."""
_LEAST_PER_IMPACT, _MOST_PER_IMPACT = 24, 96
"""Extra samples from the onset to the release of each impact."""
_BLOW = 12
"""Contact steps after the onset within which a long contact is sampled densely: its first blow."""


@dataclass(frozen=True)
class Run:
    """A recorded run: time series, class with statistics, a table of impacts, and what an asked tolerance gave."""

    dataset: xr.Dataset
    response: Response
    impacts: xr.Dataset
    accuracy: Accuracy | None = None
    """None if no tolerance was asked for."""


def simulate(
    model: ReducedModel,
    shaker: Shaker | RecordedDrive | None = None,
    contact: HertzContact | Restitution | None = None,
    cycles: int | None = None,
    *,
    step: float | None = None,
    tolerance: float | None = None,
    accuracy: str = "map",
    engine: str = "auto",
    initial_state: tuple[ArrayLike, ArrayLike] | None = None,
    sample_times: ArrayLike | None = None,
    early_decision: bool = False,
    reference_freq: float | None = None,
) -> Run:
    """Integrate one run and record it.

    The beam starts at rest in the well on the shaker's far side, the shaker's tip touching it (Eqs. 11-18).
    Without a shaker the beam vibrates freely from *initial_state*, and a cycle is one of the first mode.

    Parameters
    ----------
    model : ReducedModel
    shaker : Shaker or RecordedDrive, optional
    contact : HertzContact or Restitution, optional
        Needed with a shaker; Restitution with a model of one mode only.
    cycles : int, optional
        Cycles of excitation, at least 1; 200 by default, and with a recorded drive as many as it holds.
    step : float, optional
        Step in free flight, s; steps in contact scale with it.  The default follows from the model and
        the contact; its error is on the docs' page on accuracy.
    tolerance : float, optional
        Greatest error allowed in the displacement of the contact point and of the centre, in b, from 1e-10 to
        0.1: the steps are refined until two runs agree, as far as the problem's conditioning lets any
        integrator promise it; ``run.accuracy`` says what was reached.  In place of *step* and *accuracy*.
    accuracy : {"map", "reference"}
        ``"map"``: order 4.  ``"reference"``: order 6 and much shorter steps, to check others with.
    engine : {"auto", "cpu", "cuda"}
        What integrates; one recorded run is always the CPU's work.
    initial_state : pair of arrays of shape (N,), optional
        Modal amplitudes alpha (m^0.5) and their velocities (m^0.5/s) at the start, in place of the well at
        rest.  The shaker starts in touch with the beam wherever it is.
    sample_times : array_like, optional
        Instants to record, s, ascending, from 0 to the end of the run.  By default 200 per cycle of the
        excitation or of the first mode, and at least 24 more in each impact.  Instants that a run which was
        decided early or failed did not reach are NaN, with ``valid`` = 0.
    early_decision : bool
        End the run once its class is certain; statistics other than the class then stop there.
    reference_freq : float, optional
        Frequency in Hz that stands for omega_1 in Omega and V; the model's first natural frequency if not
        given.

    Returns
    -------
    Run

    Raises
    ------
    InputError
        For bad input.  A run that fails numerically does not raise: ``run.response.status`` says why.
    """
    resolve(engine)
    asked_run = one_run(model, shaker, contact, cycles, initial_state, early_decision, reference_freq)
    reached_accuracy = None
    if tolerance is None:
        plan = asked_run.plan(step, accuracy)
    else:
        if step is not None or accuracy != "map":
            raise InputError(
                f"tolerance = {tolerance!r} with step = {step!r}, accuracy = {accuracy!r}: give one"
            )
        plan, reached_accuracy = steps_for(tolerance, asked_run)
    ensemble, reference = asked_run.ensemble(plan), asked_run.reference_freq
    tick = float(ensemble.reals[0, Reals.TICK])
    end = tick * int(ensemble.ticks[0, Ticks.END])
    period = asked_run.period
    lasted = end / period
    asked = None if sample_times is None else _checked_times(sample_times, end)
    counts, numbers, outputs = cpu_engine.record(ensemble, 0, np.empty(0), 0, False)
    counts, numbers, outputs = cpu_engine.record(ensemble, 0, np.empty(0), int(counts[Counts.IMPACTS]), False)
    table = outputs.impacts
    if asked is None:
        contact_step = plan.step / 2**plan.coarsest
        times = _default_times(end, min(period, 1.0 / reference), table, contact_step)
    else:
        times = asked
    reached = min(float(counts[Counts.TIME] * tick), end)
    if asked is None and counts[Counts.STATUS] != RunStatus.OK:
        times = times[times <= reached]
    _, _, outputs = cpu_engine.record(ensemble, 0, times, 0, True)
    response = Response.from_statistics(statistics_of(ensemble, counts[None, :], numbers[None, :], lasted))
    attrs = _attributes(model, shaker, contact, lasted, plan, reference, early_decision, response)
    attrs["gross_work"] = float(numbers[Numbers.GROSS_WORK])
    if reached_accuracy is not None:
        attrs |= reached_accuracy.attributes()
    return Run(
        dataset=_dataset(ensemble, shaker, times, period, outputs, attrs),
        response=response,
        impacts=_impact_table(table, attrs),
        accuracy=reached_accuracy,
    )


def _checked_times(sample_times: ArrayLike, end: float) -> _Array:
    times = finite_array("sample_times", sample_times, 1)
    if times.size == 0:
        raise InputError("sample_times = []: must hold at least one instant")
    if (np.diff(times) <= 0.0).any():
        raise InputError("sample_times: must be strictly increasing")
    if times[0] < 0.0 or times[-1] > end * (1.0 + 1e-9):
        raise InputError(
            f"sample_times from {times[0]:g} to {times[-1]:g} s: must lie within the run, 0 to {end:g} s"
        )
    return times


def _default_times(end: float, fastest_period: float, impacts: _Array, contact_step: float) -> _Array:
    """Regular instants, and in each impact enough to show its force and the first blow of a long one."""
    parts = [np.linspace(0.0, end, math.ceil(end / fastest_period * _SAMPLES_PER_CYCLE) + 1)]
    for onset, duration in impacts[:, :2]:
        count = min(max(math.ceil(duration / contact_step), _LEAST_PER_IMPACT), _MOST_PER_IMPACT)
        parts.append(onset + np.linspace(0.0, duration, count))
        parts.append(onset + np.linspace(0.0, min(duration, _BLOW * contact_step), _LEAST_PER_IMPACT))
    return np.unique(np.clip(np.concatenate(parts), 0.0, end))


def _dataset(
    ensemble: Ensemble,
    shaker: Shaker | RecordedDrive | None,
    times: _Array,
    period: float,
    outputs: Any,
    attrs: dict[str, Any],
) -> xr.Dataset:
    packed = ensemble.packed
    model, sign = packed.model, packed.sign
    scale = model.length_scale
    assert scale is not None
    values = outputs.values
    alpha = packed.amplitudes(outputs.rows)
    location = attrs.get("location", 0.5)
    displacement = alpha @ model.shape_at(location) / scale
    variables: dict[str, _Array] = {
        "displacement": displacement,
        "center_displacement": alpha @ model.center_shape / scale,
    }
    if shaker is not None:
        penetration = values[:, 0] / scale
        variables |= {
            "shaker_displacement": displacement + sign * penetration,
            "penetration": penetration,
            "contact_force": values[:, 1],
        }
    variables |= {"modal_amplitude": alpha, "energy_beam": values[:, 2]}
    if shaker is not None:
        variables |= {"energy_contact": values[:, 3], "work_shaker": values[:, 4]}
    variables["energy_dissipated"] = values[:, 5]
    valid = np.isfinite(values[:, 2:]).all(axis=1) & np.isfinite(alpha).all(axis=1)
    if not valid.all():
        variables = {name: np.where(_like(valid, array), array, np.nan) for name, array in variables.items()}
        variables["valid"] = valid.astype(np.int8)
    return trajectory_dataset(times, times / period, attrs=attrs, **variables)


def _like(valid: NDArray[np.bool_], array: _Array) -> NDArray[np.bool_]:
    return valid if array.ndim == 1 else valid[:, None]


def _impact_table(table: _Array, attrs: dict[str, Any]) -> xr.Dataset:
    import xarray as xr

    columns = (
        ("onset", "s", "onset of the impact"),
        ("duration", "s", "duration of the impact"),
        ("peak_force", "N", "peak contact force"),
        ("impulse", "N s", "impulse on the beam"),
    )
    data = {
        name: ("impact", table[:, i], {"units": units, "long_name": words})
        for i, (name, units, words) in enumerate(columns)
    }
    return xr.Dataset(data, {"impact": np.arange(1, len(table) + 1)}, attrs)


def describe_system(
    model: ReducedModel, contact: HertzContact | Restitution | None, plan: Plan, reference_freq: float
) -> dict[str, Any]:
    """The parameters of a model, its contact and its steps, as attributes of a file."""
    damping = model.damping_ratio
    attrs: dict[str, Any] = {
        "modes": model.modes,
        "damping_ratio": float(damping[0]) if np.all(damping == damping[0]) else damping.tolist(),
        "length_scale": model.length_scale,
        "reference_freq": reference_freq,
        "step": plan.step,
        "order": plan.order,
        "longest_contact_step": plan.step / 2**plan.coarsest,
        "shortest_contact_step": plan.step / 2**plan.finest,
    }
    if isinstance(contact, HertzContact):
        attrs["contact_stiffness"] = contact.stiffness
    elif contact is not None:
        attrs["restitution_coefficient"] = contact.coefficient
    if model.beam is not None:
        beam = model.beam
        for name in (
            "length",
            "thickness",
            "width",
            "density",
            "young_modulus",
            "axial_load",
            "buckling_level",
        ):
            attrs[f"beam_{name}"] = getattr(beam, name)
    return attrs


def _attributes(
    model: ReducedModel,
    shaker: Shaker | RecordedDrive | None,
    contact: HertzContact | Restitution | None,
    cycles: float,
    plan: Plan,
    reference: float,
    early_decision: bool,
    response: Response,
) -> dict[str, Any]:
    attrs: dict[str, Any] = {
        "title": "run of a struck bistable beam",
        "cycles": round(cycles, 9),
        "engine": "cpu",
    }
    attrs |= describe_system(model, contact, plan, reference)
    if isinstance(shaker, Shaker):
        attrs |= {
            "frequency_ratio": shaker.frequency_ratio,
            "velocity_amplitude": shaker.velocity_amplitude,
        }
    elif shaker is not None:
        attrs |= {"drive": "recorded", "frequency_ratio": shaker.frequency / reference}
    if shaker is not None:
        attrs |= {"location": shaker.location, "side": shaker.side}
    attrs["early_decision"] = int(early_decision)
    attrs["response"] = response.response.label
    attrs["status"] = f"{response.status.name}: {response.status.advice}"
    return attrs | made_by(attrs)
