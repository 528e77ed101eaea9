"""One run, recorded: the beam, the striker, and everything that can be read off them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from typing import Any, overload

import numpy as np
from numpy.typing import ArrayLike

from snapbeam.core.codes import RunStatus
from snapbeam.core.reporting import counting, sharing
from snapbeam.core.validate import InputTypeError, shown
from snapbeam.engines.answer import statistics_of
from snapbeam.engines.cpu.driver import usable_cores
from snapbeam.engines.registry import resolve
from snapbeam.model.integration import Integration
from snapbeam.model.system import System
from snapbeam.runs.outcome import RunSummary
from snapbeam.runs.recording import check_memory, end_state, prepared, reached_by, said_of
from snapbeam.runs.request import kernel_input
from snapbeam.runs.run import Run
from snapbeam.runs.samples import impact_table, joined, run_dataset

__all__ = ["simulate"]


@overload
def simulate(
    system: System,
    integration: Integration | None = None,
    *,
    sample_times: ArrayLike | None = None,
    progress: Callable[[float], object] | bool | None = None,
) -> Run: ...


@overload
def simulate(
    system: Sequence[System],
    integration: Integration | None = None,
    *,
    sample_times: ArrayLike | None = None,
    progress: Callable[[int, int], object] | bool | None = None,
) -> list[Run]: ...


def simulate(
    system: System | Sequence[System],
    integration: Integration | None = None,
    *,
    sample_times: ArrayLike | None = None,
    progress: Any = None,
) -> Run | list[Run]:
    """Integrate one run and record it.

    The beam starts at rest in the well that the striker pushes it out of (the lower one for a striker below), the tip
    touching it (Eqs. 11-18), or where the system says.  Without a striker the beam vibrates freely from the system's
    start, and a cycle is one of the first mode.

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
    if isinstance(system, (list, tuple)):
        return _several(system, integration, sample_times, progress)
    system, integration = kernel_input(system, integration)
    report = sharing(progress, "run")
    run = prepared(system, integration, sample_times)
    times, ensemble = run.times, run.ensemble
    check_memory(system, run.samples, times is None)
    _, engine = resolve("cpu")
    recorded = joined(list(engine.record(ensemble, run.instants, times is None, report)))
    if report is not None:
        report(1.0)
    outcome = RunSummary.from_statistics(
        statistics_of(ensemble, recorded.accumulators_of_runs, run.end / run.period)
    )
    if times is None and outcome.status != RunStatus.OK:
        recorded = reached_by(
            recorded, float(recorded.accumulators_of_runs["time"][0] * ensemble.runs["tick"][0])
        )
        if recorded.times.size == 0:
            times = np.zeros(1)  # it failed before anything could be written down
    attrs = said_of(run, outcome, recorded.accumulators_of_runs)
    return Run.of(
        lambda: (
            run_dataset(ensemble, system, recorded, times, run.period, attrs),
            impact_table(recorded.impacts, attrs),
        ),
        outcome=outcome,
        system=system,
        integration=integration,
        accuracy=run.accuracy,
        end=end_state(ensemble, recorded, outcome),
    )


def _several(
    systems: Sequence[Any], integration: Integration | None, sample_times: ArrayLike | None, progress: Any
) -> list[Run]:
    """Runs of several systems, on all cores: kernels give up the interpreter's lock."""
    report = counting(progress, "simulate", "runs")
    for at, system in enumerate(systems):
        if not isinstance(system, System):
            raise InputTypeError(f"system[{at}] = {shown(system)}: must be a System")
    checked = [kernel_input(system, integration) for system in systems]
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
