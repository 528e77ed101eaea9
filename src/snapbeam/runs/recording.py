"""What a recorded run is made of before its first step, and what is said of it after its last."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from snapbeam.core.codes import RunStatus
from snapbeam.core.findings import Diagnostic, tell
from snapbeam.core.validate import InputError, finite_array
from snapbeam.engines.assemble import make_ensemble, plans_of, run_columns
from snapbeam.engines.ensemble import Ensemble
from snapbeam.engines.outputs import Recorded
from snapbeam.engines.plan import Plan
from snapbeam.model.drive import RecordedMotion as RecordedMotion
from snapbeam.model.integration import Integration
from snapbeam.model.state import State
from snapbeam.model.system import System
from snapbeam.runs.describe import attributes_of
from snapbeam.runs.outcome import RunSummary
from snapbeam.runs.request import cycle_of
from snapbeam.runs.states import states_of
from snapbeam.runs.tolerance import ErrorEstimate, steps_for

__all__ = ["MEMORY_LIMIT", "Prepared", "check_memory", "end_state", "prepared", "reached_by", "said_of"]

_Array = NDArray[np.float64]

_SAMPLES_PER_CYCLE = 200
"""Regular samples of a run per cycle of the excitation or of the first mode, whichever is the faster."""
MEMORY_LIMIT = 4 * 2**30
"""Bytes that the samples of a run may take."""
_ENERGY_ERROR = 1e-3
"""Of the gross work, from which a run says that it misses its energy ledger."""
_ENDED = (RunStatus.OK, RunStatus.EARLY_STOP)


class Prepared(NamedTuple):
    """A run that can begin."""

    system: System
    integration: Integration
    plan: Plan
    accuracy: ErrorEstimate | None
    """What an asked tolerance gave."""
    ensemble: Ensemble
    times: _Array | None
    """Instants that were asked for, s."""
    samples: int
    """Instants to record, beside the ends of steps in contact."""
    end: float
    """s"""
    period: float
    """Of a cycle, s."""

    @property
    def instants(self) -> _Array:
        """To record, s."""
        return np.linspace(0.0, self.end, self.samples) if self.times is None else self.times


def prepared(system: System, integration: Integration, sample_times: ArrayLike | None) -> Prepared:
    """Choose the steps of a run and the instants to record; says what is doubtful of the system.

    Raises
    ------
    InputError
        For bad input.
    """
    tell(system.diagnostics())
    plan, accuracy = plans_of(system, integration, run_columns(system, {}))[0], None
    if integration.tolerance is not None:
        plan, accuracy = steps_for(system, integration)
    ensemble = make_ensemble(system, integration, plan=plan)
    end = float(ensemble.runs["tick"][0]) * int(ensemble.runs["end"][0])
    period = cycle_of(system)
    times = None if sample_times is None else _checked_times(sample_times, end)
    count = _regular_count(system, end, period) if times is None else times.size
    return Prepared(system, integration, plan, accuracy, ensemble, times, count, end, period)


def said_of(run: Prepared, outcome: RunSummary, accumulators_of_runs: Any) -> dict[str, Any]:
    """The attributes of a run that ended; says where it misses its energy ledger."""
    lasted = run.end / run.period
    more: dict[str, Any] = _own_attributes(run.system, run.integration, lasted)
    more["response_class"] = outcome.response_class.label
    more["status"] = f"{outcome.status.name}: {outcome.status.advice}"
    attrs = attributes_of("run of a struck bistable beam", run.system, run.integration, run.plan, more)
    attrs["gross_work"] = float(accumulators_of_runs["gross_work"][0])
    attrs["energy_error"] = _energy_error(accumulators_of_runs)
    tell(_unbalanced(attrs["energy_error"]))
    if run.accuracy is not None:
        attrs |= run.accuracy.attributes()
    return attrs


def _own_attributes(system: System, integration: Integration, lasted: float) -> dict[str, Any]:
    """What attributes say of the drive, the striker and how long it went on."""
    striker = system.striker
    attrs: dict[str, Any] = {"cycles": round(lasted, 9), "engine": "cpu"}
    if striker is not None and striker.drive.harmonic:
        attrs |= {
            name: getattr(striker.drive, name)
            for name in ("frequency_ratio", "velocity_amplitude")
            if hasattr(striker.drive, name)
        }
    elif striker is not None and isinstance(striker.drive, RecordedMotion):
        attrs |= {
            "drive": "recorded_motion",
            "frequency_ratio": striker.drive.frequency / system.model.reference_frequency,
        }
    if striker is not None:
        attrs |= {"location": striker.location, "side": striker.side}
    attrs["early_termination"] = int(integration.early_termination)
    return attrs


def _energy_error(accumulators_of_runs: Any) -> float:
    """What the ledger of a recorded run misses at its end, over the gross work: 0 for exact steps.

    The striker's work less what the beam and the contact gained and what was dissipated, as it was integrated.
    """
    accumulators = accumulators_of_runs[0]
    with np.errstate(invalid="ignore"):  # a run that failed has no numbers
        given = accumulators["work"] + accumulators["base_work"] + accumulators["load_work"]
        missed = (
            given
            - (accumulators["energy"] - accumulators["first_energy"])
            - accumulators["dissipated"]
            - accumulators["circuit_energy"]
        )
    scale = (
        float(accumulators["gross_work"])
        or float(abs(accumulators["first_energy"]) + abs(accumulators["energy"]))
        or 1.0
    )
    return float(missed) / scale


def _unbalanced(error: float) -> list[Diagnostic]:
    if not abs(error) > _ENERGY_ERROR:
        return []
    return [
        Diagnostic(
            "ledger-missed",
            f"the run misses its energy ledger by {abs(error):.2g} of the gross work: its steps are too "
            "long for what the beam does; use accuracy = 'reference', a tolerance, or a smaller step",
            {"energy_error": error},
        )
    ]


def _regular_count(system: System, end: float, period: float) -> int:
    fastest = min(period, 1.0 / system.model.reference_frequency)
    count = end / fastest * _SAMPLES_PER_CYCLE
    if count > 1e9:
        raise InputError(
            f"a run of {count:.3g} samples is too long to record: give sample_times, or fewer cycles"
        )
    return math.ceil(count) + 1


def check_memory(system: System, samples: int, with_contacts: bool) -> None:
    """Refuse a run whose samples would not fit, before anything is computed."""
    row = 8 * (4 * system.model.modes + 20)
    size = samples * row * (1.5 if with_contacts else 1.0)
    if size > MEMORY_LIMIT:
        raise InputError(
            f"{samples} samples of {system.model.modes} modes would take {size / 2**30:.1f} GiB, the limit is "
            f"{MEMORY_LIMIT / 2**30:.0f} GiB: give fewer sample_times, or fewer cycles, or have "
            "it written in pieces by simulate_to_file (--stream)"
        )


def _checked_times(sample_times: ArrayLike, end: float) -> _Array:
    times = finite_array("sample_times", sample_times, 1).copy()
    if times.size == 0:
        raise InputError("sample_times = []: must hold at least one instant")
    if (np.diff(times) <= 0.0).any():
        raise InputError("sample_times: must be strictly increasing")
    if times[0] < 0.0 or times[-1] > end * (1.0 + 1e-9):
        raise InputError(
            f"sample_times from {times[0]:g} to {times[-1]:g} s: must lie within the run, 0 to {end:g} s"
        )
    return times


def reached_by(recorded: Recorded, until: float) -> Recorded:
    """The samples up to where a run came that did not go to its end."""
    kept = recorded.times <= until
    return recorded._replace(
        times=recorded.times[kept], q=recorded.q[kept], p=recorded.p[kept], values=recorded.values[kept]
    )


def end_state(ensemble: Ensemble, recorded: Recorded, outcome: RunSummary) -> State | None:
    """Where a run stands at its end; None if it failed."""
    if outcome.status not in _ENDED:
        return None
    last, time = recorded.last, int(recorded.accumulators_of_runs["time"][0])
    states = states_of(
        ensemble,
        last.q[None],
        last.p[None],
        np.array([last.well_sign]),
        np.array([last.contact_ticks]),
        np.array([time]),
    )
    return states[0]
