"""One run, recorded: the beam, the striker, and everything that can be read off them."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from typing import Any, overload

import numpy as np
from numpy.typing import ArrayLike, NDArray

from snapbeam.core.codes import RunStatus
from snapbeam.core.findings import Finding, tell
from snapbeam.core.reporting import counting, sharing
from snapbeam.core.validate import InputError, InputTypeError, finite_array
from snapbeam.engines.answer import statistics_of
from snapbeam.engines.assemble import make_ensemble, plans_of, run_columns
from snapbeam.engines.cpu.driver import usable_cores
from snapbeam.engines.ensemble import Ensemble
from snapbeam.engines.outputs import Recorded
from snapbeam.engines.registry import resolve
from snapbeam.model.contact import ContactLaw
from snapbeam.model.drive import Recorded as RecordedMotion
from snapbeam.model.galerkin.reduction import ReducedModel
from snapbeam.model.integration import Integration
from snapbeam.model.state import State
from snapbeam.model.striker import RecordedDrive, Shaker, Striker
from snapbeam.model.system import System
from snapbeam.runs.describe import attributes_of
from snapbeam.runs.outcome import Outcome
from snapbeam.runs.request import asked, cycle_of
from snapbeam.runs.run import Run
from snapbeam.runs.samples import impact_table, joined, run_dataset
from snapbeam.runs.states import states_of
from snapbeam.runs.tolerance import steps_for

__all__ = ["MEMORY_LIMIT", "simulate"]

_Array = NDArray[np.float64]

_SAMPLES_PER_CYCLE = 200
"""Regular samples of a run per cycle of the excitation or of the first mode, whichever is the faster."""
MEMORY_LIMIT = 4 * 2**30
"""Bytes that the samples of a run may take."""
_ENERGY_ERROR = 1e-3
"""Of the gross work, from which a run says that it misses its energy ledger."""
_ENDED = (RunStatus.OK, RunStatus.DECIDED)


@overload
def simulate(
    system: System,
    integration: Integration | None = None,
    /,
    *,
    sample_times: ArrayLike | None = None,
    progress: Callable[[float], object] | bool | None = None,
) -> Run: ...


@overload
def simulate(
    system: Sequence[System],
    integration: Integration | None = None,
    /,
    *,
    sample_times: ArrayLike | None = None,
    progress: Callable[[int, int], object] | bool | None = None,
) -> list[Run]: ...


@overload
def simulate(
    model: ReducedModel,
    shaker: Striker | Shaker | RecordedDrive | None = None,
    contact: ContactLaw | None = None,
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
    progress: Callable[[float], object] | bool | None = None,
) -> Run: ...


def simulate(
    model: System | Sequence[System] | ReducedModel,
    *parts: Any,
    sample_times: ArrayLike | None = None,
    progress: Any = None,
    **options: Any,
) -> Run | list[Run]:
    """Integrate one run and record it.

    The beam starts at rest in the well that the striker pushes it out of (the lower one for a striker below), the tip
    touching it (Eqs. 11-18), or where the system says.  Without a striker the beam vibrates freely from the system's
    start, and a cycle is one of the first mode.

    Called as ``simulate(system, integration)``, or, as in version 0.1, with the parts and options by themselves:
    ``simulate(model, shaker, contact, cycles, step=..., tolerance=..., accuracy=..., engine=..., initial_state=...,
    early_decision=..., reference_freq=...)``.

    Parameters
    ----------
    system : System, or a list of them
        What is run; several are run side by side on all cores (``integration.threads``).
    integration : Integration, optional
        How: cycles, steps or accuracy or tolerance, early decision.  One recorded run is always the CPU's work.
    sample_times : array_like, optional
        Instants to record, s, ascending, from 0 to the end of the run.  By default 200 per cycle of the
        excitation or of the first mode, and the ends of the steps of each impact.  Instants that a run which was
        decided early or failed did not reach are NaN, with ``valid`` = 0.
    progress : callable, optional
        Called with the share of the run that is done, several times a second; True writes a line to standard error.
        Of several runs: called as ``progress(done, total)``.

    Returns
    -------
    Run, or a list of them

    Raises
    ------
    InputError
        For bad input, and for a run whose samples would take more than 4 GiB.  A run that fails numerically does not
        raise: ``run.outcome.status`` says why.
    """
    if isinstance(model, (list, tuple)):
        return _several(model, parts, options, sample_times, progress)
    system, integration = asked(model, parts, options)
    report = sharing(progress, "run")
    tell(system.findings())
    plan, reached = plans_of(system, integration, run_columns(system, {}))[0], None
    if integration.tolerance is not None:
        plan, reached = steps_for(system, integration)
    ensemble = make_ensemble(system, integration, plan=plan)
    run = ensemble.runs[0]
    end = float(run["tick"]) * int(run["end"])
    period = cycle_of(system)
    times = None if sample_times is None else _checked_times(sample_times, end)
    count = _regular_count(system, end, period) if times is None else times.size
    _check_memory(system, count, times is None)
    regular = np.linspace(0.0, end, count) if times is None else times
    _, engine = resolve("cpu")
    recorded = joined(list(engine.record(ensemble, regular, times is None, report)))
    if report is not None:
        report(1.0)
    lasted = end / period
    outcome = Outcome.from_statistics(statistics_of(ensemble, recorded.books, lasted))
    if times is None and outcome.status != RunStatus.OK:
        recorded = _reached(recorded, float(recorded.books["time"][0] * run["tick"]))
        if recorded.times.size == 0:
            times = np.zeros(1)  # it failed before anything could be written down
    more: dict[str, Any] = _own_attributes(system, integration, lasted)
    more["response"] = outcome.response.label
    more["status"] = f"{outcome.status.name}: {outcome.status.advice}"
    attrs = attributes_of("run of a struck bistable beam", system, integration, plan, more)
    attrs["gross_work"] = float(recorded.books["gross_work"][0])
    attrs["energy_error"] = _energy_error(recorded.books)
    tell(_unbalanced(attrs["energy_error"]))
    if reached is not None:
        attrs |= reached.attributes()
    return Run.of(
        lambda: (
            run_dataset(ensemble, system, recorded, times, period, attrs),
            impact_table(recorded.impacts, attrs),
        ),
        outcome=outcome,
        system=system,
        integration=integration,
        accuracy=reached,
        end=None if outcome.status not in _ENDED else _end_state(ensemble, recorded),
    )


def _several(
    systems: Sequence[Any], parts: Any, options: Any, sample_times: ArrayLike | None, progress: Any
) -> list[Run]:
    """Runs of several systems, on all cores: kernels give up the interpreter's lock."""
    report = counting(progress, "simulate", "runs")
    for at, system in enumerate(systems):
        if not isinstance(system, System):
            raise InputTypeError(f"system[{at}] = {system!r}: must be a System")
    checked = [asked(system, parts, dict(options)) for system in systems]
    threads = next((each.threads for _, each in checked), None) or usable_cores()
    with ThreadPoolExecutor(max_workers=max(1, min(threads, len(systems) or 1))) as pool:
        waiting = [pool.submit(simulate, system, each, sample_times=sample_times) for system, each in checked]
        try:
            for done, future in enumerate(as_completed(waiting), 1):
                future.result()
                if report is not None:
                    report(done, len(systems))
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)
            raise
    return [future.result() for future in waiting]


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
            "drive": "recorded",
            "frequency_ratio": striker.drive.frequency / system.model.reference_freq,
        }
    if striker is not None:
        attrs |= {"location": striker.location, "side": striker.side}
    attrs["early_decision"] = int(integration.early_decision)
    return attrs


def _energy_error(books: Any) -> float:
    """What the ledger of a recorded run misses at its end, over the gross work: 0 for exact steps.

    The striker's work less what the beam and the contact gained and what was dissipated, as it was integrated.
    """
    book = books[0]
    with np.errstate(invalid="ignore"):  # a run that failed has no numbers
        missed = book["work"] - (book["energy"] - book["first_energy"]) - book["dissipated"]
    scale = float(book["gross_work"]) or float(abs(book["first_energy"]) + abs(book["energy"])) or 1.0
    return float(missed) / scale


def _unbalanced(error: float) -> list[Finding]:
    if not abs(error) > _ENERGY_ERROR:
        return []
    return [
        Finding(
            "ledger-missed",
            f"the run misses its energy ledger by {abs(error):.2g} of the gross work of the striker: its steps are too "
            "long for what the beam does; use accuracy = 'reference', a tolerance, or a smaller step",
            {"energy_error": error},
        )
    ]


def _regular_count(system: System, end: float, period: float) -> int:
    fastest = min(period, 1.0 / system.model.reference_freq)
    count = end / fastest * _SAMPLES_PER_CYCLE
    if count > 1e9:
        raise InputError(
            f"a run of {count:.3g} samples is too long to record: give sample_times, or fewer cycles"
        )
    return math.ceil(count) + 1


def _check_memory(system: System, samples: int, with_contacts: bool) -> None:
    """Refuse a run whose samples would not fit, before anything is computed."""
    row = 8 * (4 * system.model.modes + 20)
    size = samples * row * (1.5 if with_contacts else 1.0)
    if size > MEMORY_LIMIT:
        raise InputError(
            f"{samples} samples of {system.model.modes} modes would take {size / 2**30:.1f} GiB, the limit is "
            f"{MEMORY_LIMIT / 2**30:.0f} GiB: give fewer sample_times, or fewer cycles"
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


def _reached(recorded: Recorded, until: float) -> Recorded:
    """The samples up to where a run came that did not go to its end."""
    kept = recorded.times <= until
    return recorded._replace(
        times=recorded.times[kept], q=recorded.q[kept], p=recorded.p[kept], values=recorded.values[kept]
    )


def _end_state(ensemble: Ensemble, recorded: Recorded) -> State:
    last, time = recorded.last, int(recorded.books["time"][0])
    states = states_of(
        ensemble,
        last.q[None],
        last.p[None],
        np.array([last.home]),
        np.array([last.contact_ticks]),
        np.array([time]),
    )
    return states[0]
