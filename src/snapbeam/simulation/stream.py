"""A run that is written to its file while it goes on, and never stands in memory whole."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from snapbeam.model.integration import Integration
from snapbeam.model.system import System
from snapbeam.simulation.dataset import impact_table, joined, run_dataset
from snapbeam.simulation.save import compressed, description, summary_dataset
from snapbeam.simulation.simulate import Prepared, end_state, prepared, reached_by, said_of
from snapbeam.simulation.summary import RunSummary
from snapbeam.solver.registry import resolve
from snapbeam.solver.statistics import Recorded, statistics_of
from snapbeam.util.diagnostics import sharing
from snapbeam.util.files import check_writable
from snapbeam.util.netcdf import netcdf_file
from snapbeam.util.status_codes import RunStatus
from snapbeam.util.validation import InputTypeError, instance, shown

if TYPE_CHECKING:
    import h5netcdf
    import xarray as xr

__all__ = ["simulate_to_file"]


_KEPT_BACK = 4096
"""Samples of a piece that wait for the next one, which may hold some that are earlier."""
_CHUNK = 2**16
"""Numbers of a chunk of a variable."""


def simulate_to_file(
    system: System,
    integration: Integration | None = None,
    *,
    path: str | os.PathLike[str],
    sample_times: ArrayLike | None = None,
    progress: Callable[[float], object] | bool | None = None,
) -> RunSummary:
    """Simulate one run and write it to a file while it goes on: the file that ``simulate(...).save(path)`` writes.

    Memory does not grow with what a sample holds, modes and energies; it takes 8 bytes for each instant that is to be
    recorded, and some 200 MB beside.  :func:`snapbeam.load` reads the file whole; ``xarray.open_dataset(path)``
    reads what is asked of it.

    Parameters
    ----------
    system : System
    integration : Integration, optional
        As for :func:`snapbeam.simulate`.
    path : path
        NetCDF file to write, ending in ``.nc``.  It is put there when the run is over, whole or not at all.
    sample_times : array_like, optional
        As for :func:`snapbeam.simulate`.  Instants that the run did not reach are left out.
    progress : callable, optional
        Called with the share of the run that is done, several times a second; True writes a line to standard error.

    Returns
    -------
    Outcome

    Raises
    ------
    InputError
        For bad input.
    NoRoomError
        If the disk has no room for it.
    """
    if not isinstance(system, System):
        raise InputTypeError(f"system = {shown(system)}: must be a System")
    integration = instance("integration", integration or Integration(), Integration, "an Integration")
    target, report = check_writable(path, "path", (".nc",)), sharing(progress, "run")
    run = prepared(system, integration, sample_times)
    _, engine = resolve("cpu")
    with netcdf_file(target) as file:
        writer = _Writer(file, run)
        for piece in engine.record(run.ensemble, run.instants, run.times is None, report):
            writer.take(piece)
        outcome = writer.finish()
    if report is not None:
        report(1.0)
    return outcome


class _Writer:
    """Puts pieces of a run into a file, in the order of time."""

    def __init__(self, file: h5netcdf.File, run: Prepared) -> None:
        self.file, self.run, self.written = file, run, 0
        self.waiting: Recorded | None = None
        self.impacts: list[Any] = []

    def take(self, piece: Recorded) -> None:
        """Write a piece but for its last samples, which wait for the next."""
        self.impacts.append(piece.impacts)
        piece = piece._replace(impacts=piece.impacts[:0])
        together = joined([piece] if self.waiting is None else [self.waiting, piece])
        ready = max(0, together.times.size - _KEPT_BACK)
        self.waiting = _part(together, slice(ready, None))
        for begin in range(0, ready, _CHUNK):
            self.append(_part(together, slice(begin, min(ready, begin + _CHUNK))))

    def finish(self) -> RunSummary:
        """Write what waits, the impacts, the outcome and what there is to say of the run."""
        from xarray.backends import H5NetCDFStore

        run, last = self.run, self.waiting
        assert last is not None  # an engine hands over one piece at least
        outcome = RunSummary.from_statistics(
            statistics_of(run.ensemble, last.accumulators_of_runs, run.end / run.period)
        )
        if outcome.status != RunStatus.OK:
            last = reached_by(
                last, float(last.accumulators_of_runs["time"][0] * run.ensemble.runs["tick"][0])
            )
        attrs = said_of(run, outcome, last.accumulators_of_runs)
        self.append(last, np.zeros(1) if self.written + last.times.size == 0 else None)
        end = end_state(run.ensemble, last, outcome)
        self.file.attrs.update(attrs | description(run.system, run.integration, run.accuracy, end))
        tables = {
            "impacts": impact_table(np.concatenate(self.impacts), attrs).assign_attrs({}),
            "summary": summary_dataset(outcome),
        }
        for name, table in tables.items():
            table.dump_to_store(H5NetCDFStore(self.file.create_group(name)), encoding=compressed(table))
        return outcome

    def append(self, samples: Recorded, times: Any = None) -> None:
        """Write samples behind those that stand in the file; *times* are instants that were not reached."""
        from xarray.backends import H5NetCDFStore

        if samples.times.size == 0 and times is None:
            return
        dataset = run_dataset(self.run.ensemble, self.run.system, samples, times, self.run.period, {})
        begin, end = self.written, self.written + dataset.sizes["time"]
        if begin == 0:
            dataset.dump_to_store(
                H5NetCDFStore(self.file), encoding=_chunked(dataset), unlimited_dims={"time"}
            )
        else:
            self.file.resize_dimension("time", end)
            for name, variable in _over_time(dataset):
                self.file.variables[name][begin:end] = variable.values
        self.written = end


def _part(samples: Recorded, which: slice) -> Recorded:
    return samples._replace(
        times=samples.times[which], q=samples.q[which], p=samples.p[which], values=samples.values[which]
    )


def _over_time(dataset: xr.Dataset) -> Iterator[tuple[str, xr.Variable]]:
    for name, variable in dataset.variables.items():
        if "time" in variable.dims:
            yield str(name), variable


def _chunked(dataset: xr.Dataset) -> dict[Any, dict[str, Any]]:
    encoding = compressed(dataset)
    for name, variable in _over_time(dataset):
        beside = variable.size // variable.sizes["time"]
        rows = max(1, _CHUNK // beside)
        encoding[name] = {**encoding[name], "chunksizes": (rows, *variable.shape[1:])}
    return encoding
