"""Simulate a run and write it to a file piece by piece."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from snapbeam.model.integration import Integration
from snapbeam.model.system import System
from snapbeam.simulation.dataset import impact_table, joined, run_dataset
from snapbeam.simulation.request import checked_request
from snapbeam.simulation.save import compressed, description, summary_dataset
from snapbeam.simulation.simulate import (
    Prepared,
    end_state,
    least_file_size,
    prepared,
    reached_by,
    run_attributes,
    tell_imbalance,
)
from snapbeam.simulation.summary import RunSummary
from snapbeam.solver.engines import engine_of
from snapbeam.solver.statistics import Recorded, statistics_of
from snapbeam.util.diagnostics import Diagnostic, Severity, sharing, tell
from snapbeam.util.files import NoRoomError, check_writable, missing_room
from snapbeam.util.interrupts import raise_held
from snapbeam.util.netcdf import netcdf_stream, read_netcdf
from snapbeam.util.status_codes import RunStatus

if TYPE_CHECKING:
    import h5netcdf
    import xarray as xr

_KEPT_BACK = 4096
"""Samples of a piece that are not written yet, because the next piece may contain earlier ones."""
_END = 2**20
"""Bytes for the summary, the attributes and the structure of the file."""
_CHUNK = 2**16
"""Numbers in a chunk of a variable."""


def simulate_to_file(
    system: System,
    integration: Integration | None = None,
    *,
    path: str | os.PathLike[str],
    sample_times: ArrayLike | None = None,
    progress: Callable[[float], object] | bool | None = None,
) -> RunSummary:
    """Simulate one run and write it to a file during the simulation.

    The file is that of ``simulate(...).save(path)``, with about 200 MB of memory plus 8 bytes for each recorded time.
    :func:`snapbeam.load` reads the file; ``xarray.open_dataset(path)`` reads parts of it.

    Parameters
    ----------
    system : System
        System to simulate.
    integration : Integration, optional
        Solver settings, as for :func:`snapbeam.simulate`.
    path : path
        NetCDF file, ending in ``.nc``, which appears at the end of the run.
    sample_times : array_like, optional
        Times to record, as for :func:`snapbeam.simulate`; those that the run did not reach are omitted.
    progress : callable, optional
        Called with the finished fraction; True prints it.

    Returns
    -------
    RunSummary

    Raises
    ------
    InputError
        If the sample times are not increasing times within the run.
    NoRoomError
        If the disk is full: the file has the samples up to there, the status ``INTERRUPTED`` and the state to continue
        from.

    See Also
    --------
    snapbeam.simulate, snapbeam.load

    Examples
    --------
    >>> import snapbeam as sb
    >>> from snapbeam import paper
    >>> system = paper.struck_beam(frequency_ratio=1.2, velocity_amplitude=0.18)
    >>> summary = sb.simulate_to_file(system, sb.Integration(cycles=2), path="run.nc")
    """
    system, integration = checked_request(system, integration)
    target, report = check_writable(path, "path", (".nc",)), sharing(progress, "run")
    run = prepared(system, integration, sample_times)
    if words := missing_room(target, least_file_size(system, integration, run.samples), "path"):
        text = f"{words}: the run will be stopped where the disk is full, and the file is whole up to there"
        tell([Diagnostic("run.room", text, {"samples": run.samples}, Severity.WARNING)])

    def reported(share: float) -> None:
        raise_held()
        if report is not None:
            report(share)

    full = False
    pieces = engine_of(run.ensemble).record(run.ensemble, run.instants, run.times is None, reported)
    with netcdf_stream(target) as (file, stream):
        writer = _Writer(file, run)
        for piece in pieces:
            full = not stream.reserve(writer.room(piece))
            if full and writer.waiting is not None:
                break
            writer.take(piece)
            if full or stream.trouble is not None:  # not even the first piece: an error below says where it is
                break
        summary = writer.finish()
    if full and summary.status is RunStatus.INTERRUPTED:
        raise _stopped(target)
    if report is not None:
        report(1.0)
    return summary


def _stopped(target: Path) -> NoRoomError:
    with read_netcdf(target, lazily=True) as kept:
        end = float(kept["time"][-1])
    return NoRoomError(
        f"{str(target)!r}: the disk is full; the run was stopped at {end:.6g} s, and the file is whole up to there.  Make "
        "room and continue in another file, with initial_state = snapbeam.load(...).final_state of this one"
    )


class _Writer:
    """Writes pieces of a run to a file, in the order of time."""

    def __init__(self, file: h5netcdf.File, run: Prepared) -> None:
        self.file, self.run, self.written = file, run, 0
        self.waiting: Recorded | None = None
        self.impacts: list[Any] = []

    def room(self, piece: Recorded) -> int:
        """Bytes on the disk that suffice to write a piece, and the end of the file after it."""
        parts = [piece] if self.waiting is None else [self.waiting, piece]
        samples = sum(array.nbytes for part in parts for array in part[:5])
        impacts = sum(rows.nbytes for rows in (*self.impacts, piece.impacts))
        return 4 * (samples + impacts) + _END  # derived variables, and chunks that are written twice

    def take(self, piece: Recorded) -> None:
        """Write a piece without its last samples, which wait for the next piece."""
        self.impacts.append(piece.impacts)
        piece = piece._replace(impacts=piece.impacts[:0])
        together = joined([piece] if self.waiting is None else [self.waiting, piece])
        ready = max(0, together.times.size - _KEPT_BACK)
        self.waiting = together.at(slice(ready, None))
        for begin in range(0, ready, _CHUNK):
            self.append(together.at(slice(begin, min(ready, begin + _CHUNK))))

    def finish(self) -> RunSummary:
        """Write the remaining samples, the impacts, the summary and the attributes."""
        from snapbeam.util.datasets import NetCDFStore

        run, last = self.run, self.waiting
        assert last is not None  # an engine yields at least one piece
        summary = RunSummary.from_statistics(statistics_of(run.ensemble, last.accumulators_of_runs))
        if summary.status != RunStatus.OK:
            last = reached_by(last, float(last.accumulators_of_runs["time"][0] * run.ensemble.runs["tick"][0]))
        tell_imbalance(run, summary, last.accumulators_of_runs)
        attrs = run_attributes(run, summary, last.accumulators_of_runs)
        self.append(last, np.zeros(1) if self.written + last.times.size == 0 else None)
        end = end_state(run.ensemble, last, summary)
        self.file.attrs.update(attrs | description(run.system, run.integration, run.accuracy, end))
        tables = {
            "impacts": impact_table(np.concatenate(self.impacts), attrs).assign_attrs({}),
            "summary": summary_dataset(summary),
        }
        for name, table in tables.items():
            table.dump_to_store(NetCDFStore(self.file.create_group(name)), encoding=compressed(table))
        return summary

    def append(self, samples: Recorded, times: Any = None) -> None:
        """Append samples to the file; *times* are times that were not reached."""
        from snapbeam.util.datasets import NetCDFStore

        if samples.times.size == 0 and times is None:
            return
        dataset = run_dataset(self.run.ensemble, self.run.system, samples, times, self.run.period, {})
        begin, end = self.written, self.written + dataset.sizes["time"]
        if begin == 0:
            begin = 1
            first = dataset.isel(time=slice(0, 1))
            first.dump_to_store(NetCDFStore(self.file), encoding=_chunked(first), unlimited_dims={"time"})
        self.file.resize_dimension("time", end)
        for name, variable in _over_time(dataset):
            stored, rows = self.file.variables[name], _rows(variable)
            for at in range(begin, end, rows):
                raise_held()
                stored[at : min(at + rows, end)] = variable.values[at - self.written : at - self.written + rows]
        self.written = end


def _over_time(dataset: xr.Dataset) -> Iterator[tuple[str, xr.Variable]]:
    for name, variable in dataset.variables.items():
        if "time" in variable.dims:
            yield str(name), variable


def _rows(variable: xr.Variable) -> int:
    """Instants in a chunk of a variable."""
    return max(1, _CHUNK * variable.sizes["time"] // max(1, variable.size))


def _chunked(dataset: xr.Dataset) -> dict[Any, dict[str, Any]]:
    encoding = compressed(dataset)
    for name, variable in _over_time(dataset):
        encoding[name] = {**encoding.get(name, {}), "chunksizes": (_rows(variable), *variable.shape[1:])}
    return encoding
