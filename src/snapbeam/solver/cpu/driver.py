"""The CPU engine's driver: threads that take runs from a queue, and one run in slices."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from threading import Lock
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from snapbeam.solver.compilation import is_compiled, kernel, ready
from snapbeam.solver.cpu.integrate import KernelOutput, integrate_ensemble, integrate_recorded
from snapbeam.solver.cpu.memory import Memory, Packed, lay_out, pack
from snapbeam.solver.cpu.recording import MARKS, REALS, VALUES, Outputs
from snapbeam.solver.cpu.run_lanes.integrate import integrate_run_lanes
from snapbeam.solver.cpu.run_lanes.memory import lay_out_few, suits
from snapbeam.solver.cpu.state import KernelInput, Scratch
from snapbeam.solver.cpu.tangent import TANGENT_ROWS, integrate_tangent
from snapbeam.solver.ensemble import Ensemble
from snapbeam.solver.further_contacts import NUMBERS, ONSET, TOUCHING, count_of, several
from snapbeam.solver.registered_statistics import extras_of_table
from snapbeam.solver.simd import WIDTH
from snapbeam.solver.statistics import Last, OutputStates, Recorded, empty_accumulators
from snapbeam.solver.step_control import SUBINTERVALS
from snapbeam.util.cores import usable_cores
from snapbeam.util.status_codes import RunStatus

_Array = NDArray[np.float64]
_Integers = NDArray[np.int64]
_CHUNK_STEPS = 3_000_000
"""Flight steps per task at most: a second or so, so that progress is smooth."""
_CHUNKS = 4
"""Tasks per thread at least, of _FEW runs each at least, so that the threads end together."""
_FEW = 4
FEW_MODES = 12
"""Modes up to which eight runs in a register are faster: 1.98 times with 8, 1.03 with 16 (benchmarks/README.md)."""
FEWEST_STEPS = 5e6
"""Flight steps asked for, of one kind of ensembles, from which on what they save pays for another kernel."""
_WORK: dict[tuple[Any, ...], float] = {}
_KEPT: dict[tuple[Any, ...], bool] = {}
"""Kinds of ensembles, and whether their kernel of eight runs in a register was compiled when first asked for."""
_ASKING = Lock()
_POLL = 0.2
"""Seconds after which an interrupt is heard."""
_SLICE_STEPS = 200_000
"""Steps of a recorded run between two checks for a stop or full buffers: about 0.1 s."""
_SLICE_BYTES = 32 * 2**20
"""Size of a slice's buffers, at most."""


def _packed(ensemble: Ensemble) -> Packed:
    others = None if ensemble.others is None else several(ensemble.others.laws)
    return pack(
        ensemble.structure, ensemble.high_omega, drive=ensemble.drive, several=others, law=ensemble.law
    )


def _asked(ensemble: Ensemble, packed: Packed, memory: Memory | None) -> KernelInput:
    """The ensemble in this engine's layout; without *memory*, for a drive without tables."""
    law, drive = ensemble.law.numbers_type(), ensemble.drive.numbers_type()
    return KernelInput(
        runs=ensemble.runs,
        law_numbers=ensemble.law_numbers,
        drive_numbers=ensemble.drive_numbers if memory is None else memory.drive_numbers,
        contact_rows=packed.spread(ensemble.contact_rows),
        starts=packed.spread(ensemble.starts),
        law=law(*[0.0] * len(law._fields)),
        drive=drive(*[0.0] * len(drive._fields)),
        other_numbers=None if ensemble.others is None else ensemble.others.numbers,
        other_places=None if ensemble.others is None else ensemble.others.places,
        other_rows=None if ensemble.others is None else packed.spread(ensemble.others.rows),
        circuit_rates=ensemble.circuit_rates if ensemble.circuits else None,
        extras=extras_of_table(),
        max_steps=ensemble.max_steps,
        high=bool(ensemble.structure.high_modes(ensemble.high_omega).any()),
    )


def _room(ensemble: Ensemble) -> Scratch:
    longest = float(ensemble.step_times.max())
    subintervals = max(8, math.ceil(SUBINTERVALS * ensemble.fastest * longest / (2.0 * math.pi)) + 1)
    return Scratch(np.empty((subintervals + 1, 4)), np.empty(subintervals * 4 * WIDTH))


def _kernel(march: Callable[..., Any], ensemble: Ensemble) -> Any:
    moving = [kind for _, kind in ensemble.drive.parts]
    parts = [*moving, *(term for kind in (ensemble.drive, *moving) for term in kind.terms)]
    others = () if ensemble.others is None else (several(ensemble.others.laws), *ensemble.others.laws)
    forces = tuple(type(each.law).owner for each in ensemble.structure.local_forces)
    kinds = (ensemble.law, ensemble.drive, *parts, *others, *forces, type(extras_of_table()).owner)
    return kernel(march.py_func, kinds)  # type: ignore[attr-defined]


def _chunks(work: _Array, threads: int) -> list[_Integers]:
    """The runs of each task, longest first: tasks of so little *work* that every thread gets several."""
    order = np.argsort(-work, kind="stable")
    share = work.sum() / max(1.0, min(threads * _CHUNKS, work.size / _FEW))
    most = _CHUNK_STEPS if threads == 1 else min(_CHUNK_STEPS, share)
    cuts = np.unique(np.cumsum(work[order]) // most, return_index=True)[1][1:]
    return np.split(order, cuts)


def run_ensemble(
    ensemble: Ensemble, threads: int | None = None, progress: Callable[[int, int], object] | None = None
) -> NDArray[Any]:
    """Integrate every run of an ensemble; returns a record of accumulators a run.

    Runs are handed out longest first, a chunk at a time; what a run gives does not depend on which thread
    integrated it or on what it was integrated with.
    """
    return _march(ensemble, threads, progress, output_states=0).accumulators_of_runs


def integrate_with_output_states(
    ensemble: Ensemble, threads: int | None = None, progress: Callable[[int, int], object] | None = None
) -> OutputStates:
    """Integrate as :func:`run_ensemble`, with the states at every output time."""
    output_states = int(-(-ensemble.runs["end"][0] // ensemble.runs["output_interval"][0]))
    return _march(ensemble, threads, progress, output_states)


def integrate_tangents(
    ensemble: Ensemble,
    tangents: _Array,
    threads: int | None = None,
    progress: Callable[[int, int], object] | None = None,
) -> tuple[OutputStates, _Array]:
    """Integrate as :func:`integrate_with_output_states`, with tangents.

    Parameters
    ----------
    tangents : array of shape (runs, k, 2, N)
        Small changes of q and p of each run.

    Returns
    -------
    states : OutputStates
    tangents : array of shape (runs, k, 2, N)
    """
    output_states = int(-(-ensemble.runs["end"][0] // ensemble.runs["output_interval"][0]))
    packed = _packed(ensemble)
    size = packed.layout.size
    spread = packed.spread(tangents).reshape(*tangents.shape[:2], 2 * size)
    march = _kernel(integrate_tangent, ensemble)
    rows = TANGENT_ROWS + 2 * tangents.shape[1]

    def arguments(which: _Integers, kernel_output: KernelOutput) -> tuple[Any, ...]:
        memory = lay_out(ensemble, packed, rows)
        first = memory.layouts[1].g - rows * size + TANGENT_ROWS * size
        kernel_input, scratch = _asked(ensemble, packed, memory), _room(ensemble)
        return (
            memory.memory,
            memory.blocks,
            memory.layouts[0],
            memory.stages,
            kernel_input,
            which,
            scratch,
            kernel_output,
            spread,
            first,
        )

    found = _spread_over(ensemble, packed, march, arguments, threads, progress, output_states)
    return found, spread.reshape(*tangents.shape[:2], 2, size)[..., packed.rows]


def _march(
    ensemble: Ensemble,
    threads: int | None,
    progress: Callable[[int, int], object] | None,
    output_states: int,
) -> OutputStates:
    packed = _packed(ensemble)
    if output_states == 0 and (_few_modes_pay(ensemble, packed) or _few_modes_kept(ensemble, packed)):
        return _spread_over(
            ensemble, packed, *_side_by_side(ensemble, packed), threads, progress, output_states
        )
    march = _kernel(integrate_ensemble, ensemble)

    def arguments(which: _Integers, kernel_output: KernelOutput) -> tuple[Any, ...]:
        memory = lay_out(ensemble, packed)
        kernel_input, scratch = _asked(ensemble, packed, memory), _room(ensemble)
        return (
            memory.memory,
            memory.blocks,
            memory.layouts,
            memory.stages,
            kernel_input,
            which,
            scratch,
            kernel_output,
        )

    return _spread_over(ensemble, packed, march, arguments, threads, progress, output_states)


def _few_modes_pay(ensemble: Ensemble, packed: Packed) -> bool:
    """Return whether the run-lane layout is faster than the mode-lane layout, compile time included.

    Both layouts give the same bits, so that how much was asked for before may decide.
    """
    if ensemble.size < WIDTH or not suits(ensemble, packed, FEW_MODES):
        return False
    kind = (packed.members, ensemble.order, ensemble.law, ensemble.drive)
    with _ASKING:
        _WORK[kind] = _WORK.get(kind, 0.0) + float(ensemble.work.sum())
        return _WORK[kind] >= FEWEST_STEPS


def _few_modes_kept(ensemble: Ensemble, packed: Packed) -> bool:
    """True if the kernel of eight runs in a register is faster and was compiled before."""
    if ensemble.size < WIDTH or not suits(ensemble, packed, FEW_MODES):
        return False
    kind = (packed.members, ensemble.order, ensemble.law, ensemble.drive)
    if kind not in _KEPT:
        march, arguments = _side_by_side(ensemble, packed)
        _KEPT[kind] = is_compiled(
            march, *arguments(np.zeros(1, dtype=np.int64), _empty_output(ensemble, packed, 1, 0))
        )
    return _KEPT[kind]


def _empty_output(ensemble: Ensemble, packed: Packed, runs: int, output_states: int) -> KernelOutput:
    """Room for the results of some runs."""
    return KernelOutput(
        empty_accumulators(runs, _beside(ensemble), len(ensemble.circuits)),
        np.empty((runs, output_states, 2 * packed.layout.size)),
        np.empty((runs, output_states, 2 + _beside(ensemble)), dtype=np.int64),
        np.zeros(1, dtype=np.int64),
    )


def _side_by_side(
    ensemble: Ensemble, packed: Packed
) -> tuple[Callable[..., None], Callable[[_Integers, KernelOutput], tuple[Any, ...]]]:
    """Integration of eight runs in a register, and its arguments."""
    order = np.argsort(packed.rows)
    kernel_input = _asked(ensemble, packed, None)._replace(
        contact_rows=np.ascontiguousarray(ensemble.contact_rows[:, order]),
        starts=np.ascontiguousarray(ensemble.starts[..., order]),
    )

    def arguments(which: _Integers, kernel_output: KernelOutput) -> tuple[Any, ...]:
        scratch = _room(ensemble)
        memory = lay_out_few(ensemble, packed, scratch.inner_samples.shape[0] - 1)
        return (
            memory.m,
            memory.n,
            memory.shape,
            memory.lane_settings,
            kernel_input,
            which,
            scratch,
            kernel_output,
            empty_accumulators(1),
        )

    return _kernel(integrate_run_lanes, ensemble), arguments


def _spread_over(
    ensemble: Ensemble,
    packed: Packed,
    march: Callable[..., None],
    arguments: Callable[[_Integers, KernelOutput], tuple[Any, ...]],
    threads: int | None,
    progress: Callable[[int, int], object] | None,
    output_states: int,
) -> OutputStates:
    """Hand the runs to threads, in chunks; *arguments* are those of *integrate*, whose memory is a thread's own."""
    size, kernel_output = packed.layout.size, _empty_output(ensemble, packed, ensemble.size, output_states)
    threads = threads or usable_cores()
    ready(march, *arguments(np.zeros(1, dtype=np.int64), kernel_output))
    if progress is not None:
        progress(0, ensemble.size)

    def integrate_chunk(which: _Integers) -> int:
        march(*arguments(which, kernel_output))
        return which.size

    done = 0
    with ThreadPoolExecutor(threads) as pool:
        pending: set[Future[int]] = {
            pool.submit(integrate_chunk, chunk) for chunk in _chunks(ensemble.work, threads)
        }
        try:
            while pending:
                finished, pending = wait(pending, timeout=_POLL, return_when=FIRST_COMPLETED)
                done += sum(future.result() for future in finished)
                if progress is not None and finished:
                    progress(done, ensemble.size)
        except BaseException:
            kernel_output.stop_flag[0] = 1
            pool.shutdown(wait=True, cancel_futures=True)
            raise
    q, p = kernel_output.states[..., packed.rows], kernel_output.states[..., size + packed.rows]
    contacts = kernel_output.contacts
    return OutputStates(kernel_output.accumulators_of_runs, q, p, contacts[..., 0], contacts[..., 1:])


def _last(
    memory: _Array, packed: Packed, saved_state: tuple[_Integers, _Array], accumulators_of_runs: NDArray[Any]
) -> Last:
    """Final state of a run that was saved."""
    marks, reals = saved_state
    q, p = memory[marks[4] : marks[4] + packed.layout.size], memory[marks[5] : marks[5] + packed.layout.size]
    since = [int(marks[0] - accumulators_of_runs["onset"][0]) if marks[10] else -1]
    others = packed.layout.others
    for j in range(0 if others is None else count_of(others.kinds)):
        at = others.numbers + j * NUMBERS
        since.append(int(marks[0] - memory[at + ONSET]) if memory[at + TOUCHING] else -1)
    return Last(q[packed.rows], p[packed.rows], int(reals[0]), np.array(since))


class _Buffers(NamedTuple):
    """Capacity of the buffers of one slice of a recorded run."""

    samples: int
    impacts: int
    most: int


def _buffers(ensemble: Ensemble, times: _Array, size: int) -> _Buffers:
    """Room for a slice: at least for what a single step may hold."""
    span = 2.0 * float(ensemble.step_times[0]) * (1.0 + 1e-9)
    most = int((np.searchsorted(times, times + span, side="right") - np.arange(times.size)).max(initial=0))
    row = 8 * (2 * size + VALUES + 1)
    samples = max(2 * most + 4, min(times.size + 4096, _SLICE_BYTES // row))
    return _Buffers(samples, 4096, most + 1)


def _beside(ensemble: Ensemble) -> int:
    """Number of strikers in addition to the first."""
    return 0 if ensemble.others is None else len(ensemble.others.laws)


def _impact_rows(ensemble: Ensemble, buffers: _Buffers) -> _Array:
    """Room for impacts, the first striker's number in each row if there are several."""
    strikers = 1 + _beside(ensemble)
    return np.ones((buffers.impacts + strikers, 4 if strikers == 1 else 5))


def record(
    ensemble: Ensemble,
    times: _Array,
    in_contact: bool,
    progress: Callable[[float], object] | None = None,
) -> Iterator[Recorded]:
    """Integrate the one run of an ensemble once, and return its records, one part after the other.

    Parameters
    ----------
    times : array of shape (instants,)
        Instants to record, s, ascending.
    in_contact : bool
        Whether to record the ends of the steps in contact too.
    progress : callable, optional
        Called with the share of the run that is done, several times a second.
    """
    packed = _packed(ensemble)
    size, march = packed.layout.size, _kernel(integrate_recorded, ensemble)
    memory, accumulators_of_runs = (
        lay_out(ensemble, packed),
        empty_accumulators(1, _beside(ensemble), len(ensemble.circuits)),
    )
    kernel_input, scratch = _asked(ensemble, packed, memory), _room(ensemble)
    buffers = _buffers(ensemble, times, size)
    saved_state = np.zeros(MARKS, dtype=np.int64), np.zeros(REALS)
    saved_state[0][0] = -1
    marks = np.zeros(3, dtype=np.int64)
    accumulators, end = accumulators_of_runs[0], float(ensemble.runs["end"][0])
    outputs = Outputs(
        times, np.empty(buffers.samples), np.empty((buffers.samples, 2 * size)),
        np.empty((buffers.samples, VALUES + len(ensemble.circuits))), _impact_rows(ensemble, buffers), buffers.impacts, marks, buffers.most, in_contact,
    )  # fmt: skip
    arguments = (
        memory.memory, memory.blocks, memory.layouts[0], memory.stages, kernel_input, scratch, accumulators, outputs, saved_state, _SLICE_STEPS,
    )  # fmt: skip
    ready(march, *arguments)
    while True:
        march(*arguments)
        running = accumulators_of_runs["status"][0] == RunStatus.INTERRUPTED
        full = accumulators_of_runs["samples"][0] + buffers.most + 3 > buffers.samples
        held = int(accumulators_of_runs["impacts"][0] - marks[1])
        if not running or full or held >= buffers.impacts:
            count = int(accumulators_of_runs["samples"][0])
            rows = outputs.rows[:count]
            yield Recorded(
                outputs.at[:count].copy(), rows[:, packed.rows], rows[:, size + packed.rows],
                outputs.values[:count].copy(), outputs.impacts[:held].copy(), accumulators_of_runs.copy(),
                _last(memory.memory, packed, saved_state, accumulators_of_runs),
            )  # fmt: skip
            if not running:
                return
            marks[1] += held
            outputs.impacts[:, 4:] = 1.0
            saved_state[0][1] = 0
        if progress is not None:
            progress(float(accumulators_of_runs["time"][0]) / end)
