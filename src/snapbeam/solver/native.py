"""Driver of the native core: an ensemble as arrays, integrated in threads, read as accumulators and states."""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from snapbeam import _core
from snapbeam.model.matrix_pairs import coupled_blocks
from snapbeam.solver.channels import AXIAL_LOAD, BASE, EXTERNAL_FORCE, LINEAR_DAMPING, PIECES, STEEP, SWEEP, TONE, TONES
from snapbeam.solver.ensemble import Ensemble, Records
from snapbeam.solver.statistics import OF_CONTACT, OF_CORE, SAMPLED, OutputStates, Recorded, empty_accumulators, updated
from snapbeam.solver.step_size import CALM, barrier_of, composition_of
from snapbeam.solver.user_laws import Function, updates_of
from snapbeam.util.cores import instruction_set, usable_cores
from snapbeam.util.interrupts import raise_held
from snapbeam.util.status_codes import RunStatus

_Array = NDArray[np.float64]
Progress = Callable[[int, int], object]

RUN = (
    "tick", "step", "end", "output_interval", "last_quarter", "well_sign", "contact_step", "halvings", "decide_energy",
    "decide_reach", "decide_crossings", "max_steps", "stretch", "calm_energy", "lowest", "shortest",
)  # fmt: skip
"""Numbers of a run, in the order of ``core/api.hpp: RunNumber``."""
OF_CHANNEL = (
    "impacts", "impulse", "work", "gross_work", "lost", "late_lost", "peak_force", "deepest", "contact_time", "touching", "onset"
)  # fmt: skip
_IN_TICKS = ("step", "end", "output_interval", "last_quarter")
STATUS = (RunStatus.OK, RunStatus.EARLY_STOP, RunStatus.INTERRUPTED, RunStatus.DIVERGED, RunStatus.STEP_LIMIT)
"""Status of a run by its number in the core."""
OF_SAMPLE, CHANNEL_SAMPLE = 3, 6
"""Numbers of a sample, and of each channel in it."""
_WORKS = {EXTERNAL_FORCE: "force_work", BASE: "base_work", AXIAL_LOAD: "load_work", LINEAR_DAMPING: "dissipated"}
_FEW_MODES = 16
"""Modes up to which runs are integrated side by side."""
_MOST_TICKS = 2.0**52
_FINER = 16
"""Halvings of a tick, at most: events lie on ticks."""
_STEEP = 7
"""Further halvings of steps where a force may be far steeper than the steps are chosen for."""
_GRADED = 6
"""The same where derivatives are wanted: at both ends of a contact that of the force is a root, whose integral errs by h^1.5."""
_SAMPLES, _NUMBERS, _IMPACTS, _BUDGET = 50_000, 4_000_000, 4096, 50_000
"""Room for samples, their numbers and impacts, and steps, of one piece of a recorded run."""


def reversed_in_time(ensemble: Ensemble) -> Ensemble | None:
    """The runs with time reversed: velocities and damping change sign, and A sin(rate t + phase) becomes A sin(rate t + pi - phase).

    None where a part has no such inverse: a force that depends on the velocity or has a memory, a circuit, another motion
    than sines.
    """
    channels, structure = ensemble.channels, ensemble.structure
    if channels is None or structure.circuits or structure.indentations or np.isin(channels.laws, _core.LOSSY).any():
        return None
    if np.isin(channels.kinds, (PIECES, SWEEP)).any() or channels.jumps.size:
        return None
    signals, tones = channels.signals.copy(), channels.kinds != TONES
    signals[:, tones, 3] = math.pi - signals[:, tones, 3]
    return replace(
        ensemble,
        structure=replace(structure, damping_ratio=-structure.damping_ratio),
        channels=replace(channels, signals=signals),
        starts=ensemble.starts * np.array([1.0, -1.0])[:, None],
    )


class _Arrays:
    """An ensemble as the arrays of the core."""

    def __init__(self, ensemble: Ensemble, graded: int = 0) -> None:
        channels, structure, table = ensemble.channels, ensemble.structure, ensemble.runs
        assert channels is not None
        self.ensemble, self.channels = ensemble, channels
        self.updated = updated()
        self.updates = updates_of(self.updated)
        # charges and residual indentations are states of laws
        first = structure.modes_of_bodies.stop
        states = [each.mode for each in structure.circuits if each.mode is not None]
        kept = np.setdiff1d(
            np.arange(structure.omega.size), [*states, *range(first, first + len(structure.indentations))]
        )
        order, sizes = coupled_blocks(structure.coupling[np.ix_(kept, kept)] != 0.0)
        self.order = kept[order]
        count = channels.laws.size
        self.circuits = np.arange(count)[count - channels.circuits :]
        """Channels of the circuits."""
        has_two = structure.stretch > 0.0
        wells = structure.unequal_wells if has_two else None
        high = structure.high_modes(ensemble.high_omega)
        # finer ticks than those of the table, so that an event lies on one to rounding
        longest = float(np.maximum(table["end"], 1).max())
        self.finer = finer = 2.0 ** max(0, min(_FINER, math.floor(math.log2(_MOST_TICKS / longest))))
        run = np.zeros((ensemble.size, len(RUN)))
        of = dict(zip(RUN, run.T, strict=True))
        for name in set(RUN) & set(table.dtype.names):
            of[name][:] = table[name] * (finer if name in _IN_TICKS else 1.0)
        of["tick"] /= finer
        np.minimum(of["output_interval"], of["end"], out=of["output_interval"])
        contact = np.minimum(table["contact_step"] / of["tick"], of["step"])
        most = np.minimum(table["halvings"] + float(graded + _STEEP), np.floor(np.log2(contact)))  # to a tick
        usual = np.minimum(table["halvings"] + float(graded), most)
        of["contact_step"][:] = 2.0**most * np.floor(contact / 2.0**most)  # the same whether a law is steep or not
        of["shortest"][:] = 0.5**usual * of["contact_step"]
        halvings = most if np.isin(channels.laws, STEEP).any() else usual
        if ensemble.order == 4:  # halves of the flight step that are longer than the contact step
            between = np.ceil(np.log2(of["step"] / of["contact_step"]) - 1e-9) - 1.0
            halvings = halvings + np.maximum(between, 0.0)
        of["halvings"][:], of["max_steps"][:], of["stretch"][:] = halvings, ensemble.max_steps, structure.stretch
        nonlinear = structure.nonlinear_stiffness != 0.0 and structure.coupling.any()
        of["calm_energy"][:] = CALM[ensemble.order] * barrier_of(structure) if nonlinear else math.inf
        row = self.row
        self.problem = {
            "omega": row(structure.omega), "sigma": row(structure.damping_ratio * structure.omega), "g": row(structure.well),
            "G": np.ascontiguousarray(structure.coupling[np.ix_(self.order, self.order)]),
            "gamma": float(structure.nonlinear_stiffness), "shift": row(structure.shift) if has_two else None,
            "far_force": None if wells is None else row(wells.force), "second": None if wells is None else row(wells.second),
            "lift": 0.0 if wells is None else float(wells.lift), "high": row(high) if high.any() else None,
            "beam": row(np.arange(structure.omega.size) < structure.equilibrium.size), "block_sizes": sizes,
            "composition": composition_of(ensemble.order, bool(np.isin(channels.laws, _core.LOSSY).any())),
            "laws": channels.laws, "uses": channels.uses, "signal_kinds": channels.kinds, "windows": channels.windows,
            "signals": channels.kinds.size, "jumps": channels.jumps.shape[1], "law_numbers": channels.numbers.shape[2],
            "center": row(structure.center), "center_rest": float(structure.center_rest),
            "dividing_height": float(structure.dividing_height),
            "levels": int(halvings.max()) + 2, "update": np.array([each.address for each in self.updates], np.int64),
        }  # fmt: skip
        signals, tones, tick = channels.signals.copy(), channels.kinds == TONE, run[:, :1]
        signals[:, tones, 4] *= finer
        signals[:, :, 4][(signals[:, :, 4] > _MOST_TICKS) & tones] = 0.0
        jumps = np.sort(np.maximum(np.floor(channels.jumps / tick) + 1.0, 0.0), axis=1)
        start = table["start_row"]
        self.batch: dict[str, Any] = {
            "run": run, "signals": signals, "pieces": channels.pieces, "jumps": np.minimum(jumps, 1e300),
            "numbers": channels.numbers, "offset": channels.offset,
            "since": np.where(channels.since >= 0.0, np.rint(channels.since / tick), channels.since),
            "rows": row(channels.rows), "row_of": channels.row_of, "rest": channels.rest,
            "q": row(ensemble.starts[start, 0]), "p": row(ensemble.starts[start, 1]),
            "order": np.argsort(-ensemble.work, kind="stable").astype(np.int32), "account": 0,
            "statistics": np.empty((ensemble.size, len(OF_CORE))), "held": np.empty((ensemble.size, len(self.updated))),
            "of_channels": np.empty((ensemble.size, count, len(OF_CHANNEL))),
        }  # fmt: skip
        self.hand_out(0)
        self.begin()

    def row(self, values: Any) -> _Array:
        """Rows in the order of the modes in the core."""
        return np.ascontiguousarray(np.asarray(values, dtype=float)[..., self.order])

    def hand_out(self, outputs: int, interval: _Array | None = None) -> None:
        """Make room for so many states of each run, one after each *interval*, ticks of the core."""
        width = 2 * self.order.size + 1 + 2 * self.channels.laws.size
        self.batch |= {"outputs": outputs, "states": np.full((self.ensemble.size, outputs, width), np.nan)}
        if interval is not None:
            self.batch["run"][:, RUN.index("output_interval")] = interval

    def hand_out_end(self) -> None:
        """Make room for the state at the end of each run."""
        self.hand_out(1, self.batch["run"][:, RUN.index("end")])

    def states(self) -> tuple[Any, ...]:
        """q, p, wells and contact ticks of the states handed out, shape (runs, outputs, ...)."""
        found, contacts, n = self.batch["states"], self.channels.contacts, self.order.size
        q, p = self.modes_of(found, found[..., 2 * n + 1 + self.channels.laws.size :])
        ticks = found[..., 2 * n + 1 : 2 * n + 1 + contacts] if contacts else np.full((*found.shape[:2], 1), -1.0)
        return q, p, found[..., 2 * n].copy(), np.where(ticks > 0.0, ticks / self.finer, ticks)

    def begin(self) -> None:
        """Outputs as they are before a run."""
        self.batch["statistics"].fill(np.nan)
        self.batch["statistics"][:, 0] = -1.0
        self.batch["states"].fill(np.nan)
        self.batch["of_channels"].fill(0.0)
        self.batch["held"][:] = [float(row.start) for row in self.updated]

    def modes_of(self, states: _Array, laws: _Array) -> tuple[_Array, _Array]:
        """q and p of the structure, of those in the core and of the states of laws, shape (..., channels)."""
        n, structure = self.order.size, self.ensemble.structure
        q, p = np.zeros((2, *states.shape[:-1], structure.omega.size))
        # a slice is copied several times as fast as columns by their numbers
        at = slice(n) if np.array_equal(self.order, np.arange(n)) else self.order
        q[..., at], p[..., at] = states[..., :n], states[..., n : 2 * n]
        for circuit, channel in zip(structure.circuits, self.circuits.tolist(), strict=True):
            if circuit.mode is not None:
                q[..., circuit.mode] = laws[..., channel] + q @ circuit.row
        for mode, contact in enumerate(structure.indentations, structure.modes_of_bodies.stop):
            q[..., mode] = laws[..., contact]
        return q, p

    def no_change(self) -> dict[str, _Array]:
        """Derivatives of what runs begin with, all of them 0, and room for those of the outputs."""
        batch, channels, n = self.batch, self.channels.laws.size, self.order.size
        shapes: dict[str, tuple[int, ...]] = {
            "q": (n,), "p": (n,), "numbers": batch["numbers"].shape[1:], "laws": (channels,), "offset": (channels,), "rest": (channels + 1,),
            "rows": (channels + 1, n), "signals": batch["signals"].shape[1:], "end": (), "statistics": (len(OF_CORE),),
            "of_channels": (channels, len(OF_CHANNEL)), "jumps": batch["jumps"].shape[1:],
        }  # fmt: skip
        found = {name: np.zeros((self.ensemble.size, _core.DIRECTIONS, *shape)) for name, shape in shapes.items()}
        room = (self.ensemble.size, batch["outputs"], _core.DIRECTIONS, 2 * n + channels)
        return found | {"states": np.full(room, np.nan)}

    def changes(self, above: Ensemble, below: Ensemble, distance: float) -> dict[str, _Array]:
        """Derivatives of the arrays by a parameter: differences of what is assembled, which no run is in."""
        parts, of_structure = [], not unchanged(above, below)
        order = np.argsort(self.channels.jumps, axis=1, kind="stable")
        for arrays in (_Arrays(above), _Arrays(below)):
            batch, problem = arrays.batch, arrays.problem
            part = {name: batch[name] for name in ("q", "p", "numbers", "offset", "rest", "signals", "pieces")}
            part["rows"] = batch["rows"][batch["row_of"]]
            part["end"] = batch["run"][:, RUN.index("end")] * batch["run"][:, RUN.index("tick")]
            part["jumps"] = np.take_along_axis(arrays.channels.jumps, order, axis=1)
            if of_structure:
                rows = [np.zeros(self.order.size) if problem[name] is None else problem[name] for name in _ROWS]
                part |= {"structure": np.array(rows), "scalars": np.array([problem[name] for name in _SCALARS])}
                part["G"] = problem["G"]
            parts.append(part)
        with np.errstate(invalid="ignore"):  # a jump that never is
            found = {name: np.nan_to_num((parts[0][name] - parts[1][name]) / distance) for name in parts[0]}
        if not found["pieces"].any():
            del found["pieces"]
        found["signals"][:, self.problem["signal_kinds"] == TONE, 4] = 0.0  # periods in ticks of another clock
        found["signals"][:, :, 6:] = 0.0  # bounds
        return found

    def laws_of(self, q: _Array) -> dict[int, _Array]:
        """States of laws in q of shape (..., N), by their channel: the inverse of :meth:`modes_of`."""
        structure = self.ensemble.structure
        circuits = zip(structure.circuits, self.circuits.tolist(), strict=True)
        found = {channel: q[..., each.mode] - q @ each.row for each, channel in circuits if each.mode is not None}
        bodies = structure.modes_of_bodies.stop
        return found | {contact: q[..., mode] for mode, contact in enumerate(structure.indentations, bodies)}

    @property
    def _functions(self) -> list[Function]:
        """Functions of a user."""
        return [*(each for law in self.channels.of_user for each in law.functions), *self.updates]

    @property
    def layout(self) -> str:
        """The layout of the core: few modes in lanes of runs, a single run as a thread with the same bits."""
        alone, chosen = self.ensemble.size == 1, os.environ.get("SNAPBEAM_LAYOUT")
        return chosen or ("modes" if self.order.size > _FEW_MODES else "thread" if alone else "runs")

    def check(self) -> None:
        """Raise the first error that a function of a user raised in the core."""
        for each in self._functions:
            each.check()

    def threads(self, asked: int | None) -> int:
        """Threads: one if a function of a user holds the interpreter's lock, so that they would wait for each other."""
        return 1 if any(each.why_slow for each in self._functions) else asked or usable_cores()

    def accumulators(self) -> Records:
        """The records of the runs."""
        statistics, channels = self.batch["statistics"], self.channels
        of = dict(zip(OF_CHANNEL, np.moveaxis(self.batch["of_channels"], 2, 0), strict=True))
        found = empty_accumulators(self.ensemble.size, channels.contacts, len(self.circuits))
        begun = statistics[:, 0] >= 0.0
        for k, name in enumerate(OF_CORE):
            found[name][begun] = statistics[begun, k]
        found["status"][begun] = np.array(STATUS, dtype=np.int64)[statistics[begun, 0].astype(int)]
        found["time"][begun] = np.rint(statistics[begun, 1] / self.finer)
        for row, held in zip(self.updated, self.batch["held"].T, strict=True):
            found[f"own_{row.name}"] = held
        for name in ("impacts", "impulse", "work", "lost", "contact_time"):
            found["total_impulse" if name == "impulse" else name] = of[name][:, : channels.contacts].sum(axis=1)
        if channels.contacts:
            found["contacts"] = np.stack([of[name][:, : channels.contacts] for name in OF_CONTACT], axis=2)
            found["peak_force"] = of["peak_force"][:, : channels.contacts].max(axis=1)
        if self.circuits.size:
            found["circuits"] = np.stack(
                [of[name][:, self.circuits] for name in ("lost", "late_lost", "peak_force")], axis=2
            )
        found["gross_work"] = of["gross_work"].sum(axis=1)
        account = self.batch["account"]
        for j, name in self.works():
            found[name] += account * of["lost"][:, j] if name == "dissipated" else of["work"][:, j] - of["lost"][:, j]
        if account:
            found["dissipated"] += found["lost"]
        return found

    def works(self) -> list[tuple[int, str]]:
        """Channels that are no contacts or circuits, and the accumulators of what they do."""
        first, last = self.channels.contacts, self.channels.laws.size - self.channels.circuits
        return [(j, _WORKS.get(int(self.channels.laws[j]), "local_force_work")) for j in range(first, last)]


def _integrate(arrays: _Arrays, threads: int | None, progress: Progress | None) -> None:
    if progress is not None:
        progress(0, arrays.ensemble.size)
    if arrays.ensemble.on_gpu:
        from snapbeam.solver import cuda

        cuda.integrate(arrays.problem, arrays.batch, progress)
    else:
        _core.integrate(
            arrays.problem, arrays.batch, arrays.layout, instruction_set(), arrays.threads(threads), progress
        )
    arrays.check()
    if progress is not None:
        progress(arrays.ensemble.size, arrays.ensemble.size)


def run_ensemble(ensemble: Ensemble, threads: int | None = None, progress: Progress | None = None) -> Records:
    """Integrate every run of an ensemble; returns a record of accumulators a run."""
    arrays = _Arrays(ensemble)
    _integrate(arrays, threads, progress)
    return arrays.accumulators()


def integrate_with_output_states(
    ensemble: Ensemble, threads: int | None = None, progress: Progress | None = None
) -> OutputStates:
    """Integrate as :func:`run_ensemble`, with the states at every output time."""
    arrays = _Arrays(ensemble)
    outputs = int(-(-ensemble.runs["end"][0] // ensemble.runs["output_interval"][0]))
    arrays.hand_out(outputs)
    _integrate(arrays, threads, progress)
    return OutputStates(arrays.accumulators(), *arrays.states())


_ROWS = ("omega", "sigma", "g", "shift", "far_force", "center", "second")
_SCALARS = ("gamma", "center_rest", "dividing_height", "lift")
"""Rows and numbers of a structure that may have derivatives, beside G, as in ``core/api.hpp: Tangent``."""
_NEAR = 1e-2
"""Relative change of a structure over the step of a difference, beyond which its modes are not the same: two of one frequency."""


def unchanged(above: Ensemble, below: Ensemble) -> bool:
    """Return whether two ensembles have the same modes."""
    return _same(above, below, {"levels"})


def differentiable(above: Ensemble, below: Ensemble) -> bool:
    """Return whether two ensembles differ only in numbers of which the core takes derivatives, and little."""
    one, other = above.channels, below.channels
    assert one is not None and other is not None
    jumps = (each.jumps.argsort(axis=1, kind="stable") for each in (one, other))
    if one.pieces.shape != other.pieces.shape or not np.array_equal(*jumps):
        return False
    if not _same(above, below, {"levels", "G", *_ROWS, *_SCALARS}):
        return False
    first, second = _Arrays(above), _Arrays(below)
    near = [(first.problem[name], second.problem[name]) for name in ("G", *_ROWS)]
    if any((high is None) != (low is None) for high, low in near) or not np.array_equal(first.order, second.order):
        return False
    near = [pair for pair in near if pair[0] is not None] + [(first.batch["rows"], second.batch["rows"])]
    near += [(high, low) for high, low in zip(one.pieces.T, other.pieces.T, strict=True)]
    return all(np.abs(high - low).max(initial=0.0) <= _NEAR * np.abs(high).max(initial=0.0) for high, low in near)


def _same(above: Ensemble, below: Ensemble, without: set[str]) -> bool:
    first, second = (_Arrays(each).problem for each in (above, below))
    return all(np.array_equal(value, second[name]) for name, value in first.items() if name not in without)


def tangents(
    ensemble: Ensemble,
    q: _Array,
    p: _Array,
    threads: int | None = None,
    beside: tuple[Ensemble, Ensemble, float] | None = None,
) -> tuple[_Array, _Array]:
    """Derivatives of the state at the end along changes of the first one, and of a parameter of the runs.

    Parameters
    ----------
    ensemble : Ensemble
    q, p : array of shape (runs, k, N)
        Changes of the modes, with those of circuits and indentations.
    threads : int, optional
    beside : tuple, optional
        The ensembles at a larger and at a smaller value of a parameter and their distance: every direction changes that parameter too.

    Returns
    -------
    q, p : array of shape (runs, k, N)
        Changes at the end; NaN where a run did not reach it.
    """
    arrays, most = _differentiated(ensemble), _core.DIRECTIONS
    n, count = arrays.order.size, q.shape[1]
    laws, changes = arrays.laws_of(q), {} if beside is None else arrays.changes(*beside)
    found_q, found_p = np.zeros((2, *q.shape))
    for first in range(0, count, most):
        own = slice(first, first + most)
        some = q[:, own].shape[1]
        seeds = arrays.no_change()
        for name, change in changes.items():
            _seed(seeds, name, slice(some), change)
        seeds["q"][:, :some], seeds["p"][:, :some] = arrays.row(q[:, own]), arrays.row(p[:, own])
        for channel, change in laws.items():
            seeds["laws"][:, :some, channel] = change[:, own]
        _integrate_tangents(arrays, seeds, threads)
        ends = seeds["states"][:, 0, :some]
        found_q[:, own], found_p[:, own] = arrays.modes_of(ends, ends[..., 2 * n :])
    return found_q, found_p


def _seed(seeds: dict[str, _Array], name: str, directions: slice, change: _Array) -> None:
    """Give some directions a derivative, of each run or of what all runs share."""
    if name in ("structure", "scalars", "G", "pieces"):
        seeds.setdefault(name, np.zeros((_core.DIRECTIONS, *change.shape)))[directions] = change
    else:
        seeds[name][:, directions] = change[:, None]


def _differentiated(ensemble: Ensemble) -> _Arrays:
    """Arrays of runs with derivatives, which end with an output."""
    arrays = _Arrays(ensemble, _GRADED if ensemble.order == 4 else 0)
    arrays.hand_out_end()
    return arrays


def _integrate_tangents(arrays: _Arrays, seeds: dict[str, _Array], threads: int | None) -> None:
    _core.integrate_tangents(arrays.problem, arrays.batch, seeds, instruction_set(), arrays.threads(threads), None)
    arrays.check()


def changed_accumulators(
    ensemble: Ensemble, beside: Sequence[tuple[Ensemble, Ensemble, float]], threads: int | None = None
) -> tuple[list[tuple[Records, Records]], _Array, Records]:
    """Accumulators of runs at a larger and at a smaller value of parameters, by their derivatives.

    Parameters
    ----------
    ensemble : Ensemble
    beside : sequence of tuple
        Ensembles at the two values of each parameter, and their distance.
    threads : int, optional

    Returns
    -------
    pairs : list of tuple
        Records at the larger and at the smaller value of each parameter.
    growth : array of shape (runs, parameters)
        Norm of the derivative of the state at the end, the square root of twice an energy, J^0.5, per unit of the parameter.
    accumulators : records
        Records of the runs themselves.
    """
    arrays, n = _differentiated(ensemble), ensemble.structure.omega.size
    batch, pairs, growth = arrays.batch, [], np.empty((ensemble.size, len(beside)))
    whole = arrays.accumulators()
    for first in range(0, len(beside), _core.DIRECTIONS):
        some, seeds = beside[first : first + _core.DIRECTIONS], arrays.no_change()
        for k, each in enumerate(some):
            for name, change in arrays.changes(*each).items():
                _seed(seeds, name, slice(k, k + 1), change)
        _integrate_tangents(arrays, seeds, threads)
        whole = arrays.accumulators()
        ends = seeds["states"][:, 0, :]
        q, p = arrays.modes_of(ends, ends[..., 2 * arrays.order.size :])
        bodies = slice(0, ensemble.structure.modes_of_bodies.stop or n)
        rates = ensemble.structure.omega[bodies]
        size = np.sqrt(((rates * q[..., bodies]) ** 2 + p[..., bodies] ** 2).sum(axis=-1))
        growth[:, first : first + len(some)] = size[:, : len(some)]
        kept = {name: batch[name] for name in ("statistics", "of_channels")}
        for k, (above, below, distance) in enumerate(some):
            pair = []
            for near, side in ((above, 0.5), (below, -0.5)):
                for name, value in kept.items():
                    batch[name] = value + side * distance * seeds[name][:, k]
                found = arrays.accumulators()
                ended = found["time"] == ensemble.runs["end"]
                found["time"] = np.where(ended, near.runs["end"], found["time"])
                pair.append(found)
            pairs.append((pair[0], pair[1]))
        batch.update(kept)
    return pairs, growth, whole


def record(
    ensemble: Ensemble, times: _Array, in_contact: bool, progress: Callable[[float], object] | None = None
) -> Iterator[Recorded]:
    """Integrate the one run of an ensemble, and return its records, one part after the other."""
    return pieces(*recorder_of(ensemble, times, in_contact), progress)


def recorder_of(ensemble: Ensemble, times: _Array, in_contact: bool) -> tuple[_Arrays, dict[str, Any]]:
    """The one run of an ensemble and room for its records, for :func:`pieces`."""
    arrays = _Arrays(ensemble)
    n, channels = arrays.order.size, arrays.channels
    arrays.batch["account"], count = 1, channels.laws.size
    arrays.hand_out_end()
    # one step may hold many instants
    span, most = 2.0 * float(ensemble.step_times[0]), 0
    for begin in range(0, times.size, _SAMPLES):
        raise_held()
        part = times[begin : begin + _SAMPLES]
        found = np.searchsorted(times, part + span, side="right") - np.arange(begin, begin + part.size)
        most = max(most, int(found.max()))
    width = OF_SAMPLE + CHANNEL_SAMPLE * count
    samples = max(min(_SAMPLES if in_contact else times.size + 8, _SAMPLES, _NUMBERS // (2 * n + width)), most + 8)
    saved = (3 * (n + 64) + count * (12 + len(OF_CHANNEL)) + len(OF_CORE) + 6 * channels.kinds.size + 32) * 8
    return arrays, {
        "times": np.ascontiguousarray(times, dtype=float), "in_contact": int(in_contact), "rows": np.empty((samples, 2 * n)),
        "values": np.empty((samples, width)), "impacts": np.empty((_IMPACTS + count, 5)), "marks": np.zeros(5, np.dtype("l")),
        "saved": np.zeros(saved), "budget": _BUDGET,
    }  # fmt: skip


def pieces(
    arrays: _Arrays, recorder: dict[str, Any], progress: Callable[[float], object] | None = None
) -> Iterator[Recorded]:
    """Integrate a run from its beginning, and return its records, one part after the other."""
    arrays.begin()
    recorder["marks"][:] = 0
    running = True
    while running:
        _core.record(arrays.problem, arrays.batch, recorder, arrays.layout, instruction_set())
        arrays.check()
        piece = _recorded(arrays, recorder)
        running = piece.accumulators_of_runs["status"][0] == RunStatus.INTERRUPTED
        yield piece
        if progress is not None:
            progress(float(piece.accumulators_of_runs["time"][0]) / float(arrays.ensemble.runs["end"][0]))
        recorder["marks"][1:3] = 0


def _recorded(arrays: _Arrays, recorder: Any) -> Recorded:
    """The piece of a run that a recorder holds; its state is not finite if the run diverged."""
    channels, (held, impacts) = arrays.channels, recorder["marks"][1:3].tolist()
    values, table = recorder["values"][:held], recorder["impacts"][:impacts]
    own = values[:, OF_SAMPLE:].reshape(held, channels.laws.size, CHANNEL_SAMPLE)
    q, p = arrays.modes_of(recorder["rows"][:held], own[:, :, 5])
    contacts = own[:, : channels.contacts]
    found = np.zeros((held, len(SAMPLED) + arrays.circuits.size))
    stored, work, lost = contacts[:, :, 2:5].sum(axis=1).T
    found[:, :5] = np.stack((values[:, 1], stored, work, values[:, 2] + lost, lost), axis=1)
    found[:, len(SAMPLED) :] = own[:, arrays.circuits, 4]
    for j, name in arrays.works():
        found[:, SAMPLED.index(name)] += own[:, j, 4] if name == "dissipated" else own[:, j, 3] - own[:, j, 4]
    table = np.concatenate((table[:, 1:], table[:, :1] + 1.0), axis=1) if channels.contacts > 1 else table[:, 1:].copy()
    at, pressed = values[:, 0].copy(), contacts[:, :, :2].copy()
    return Recorded(at, q, p, pressed, found, table, arrays.accumulators(), arrays.states())
