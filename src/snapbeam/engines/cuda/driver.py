"""The CUDA engine's driver: what the device needs, in slices of time short enough to be interrupted."""

from __future__ import annotations

import math
import time
import warnings
from collections.abc import Callable
from importlib.util import find_spec
from typing import Any, NamedTuple

import numpy as np
from numba import NumbaPerformanceWarning
from numpy.typing import NDArray

from snapbeam.core.codes import RunStatus
from snapbeam.core.validate import InputError
from snapbeam.engines.columns import Counts, Numbers, Reals, Ticks
from snapbeam.engines.cuda.layout import (
    FEWEST_THREADS,
    KEPT,
    MARKS,
    MOST_MODES,
    RESIDENT_WARPS,
    DeviceStructure,
    device_structure,
)
from snapbeam.engines.ensemble import Ensemble
from snapbeam.engines.scalar.composition import COMPOSITIONS, TURNS

__all__ = ["Options", "refusal", "run_ensemble", "simulated"]

_Array = NDArray[np.float64]
_Integers = NDArray[np.int64]

_CHUNK = 1 << 18
"""Runs whose columns are on the device at a time, whatever the ensemble's size."""
_SLICE = 0.4
"""Aim for the length of one call of the kernel, s."""
SLICE_STEPS = (500, 10**8)
"""Fewest and most steps of a slice."""


def _unusable() -> str | None:
    """Why no CUDA device can be used, or None if one can."""
    if find_spec("numba_cuda") is None:
        return "the package numba-cuda is not installed (pip install 'snapbeam[cuda]')"
    from numba import cuda

    try:
        if cuda.is_available():
            return None
    except Exception as error:  # a broken driver fails in its own ways
        return f"the CUDA driver does not work: {error}"
    return "no CUDA device, or no driver for one, was found"


def simulated() -> bool:
    """Whether Numba's simulator stands in for a device: for tests, and thousands of times slower."""
    from numba import config

    return bool(config.ENABLE_CUDASIM)


def refusal(modes: int, restitution: bool) -> str | None:
    """Why such runs cannot be marched on a device here, or None if they can."""
    if restitution:
        return "Newton's law of restitution is marched by the CPU engine alone"
    if modes > MOST_MODES:
        return f"a model of {modes} modes has more than its {MOST_MODES}"
    return _unusable()


def _most_pieces(ensemble: Ensemble, structure: DeviceStructure) -> int:
    """Room for what is seen inside a step of any run."""
    from snapbeam.engines.scalar.decisions import PIECES

    step_time = float((ensemble.reals[:, Reals.TICK] * ensemble.ticks[:, Ticks.STEP]).max())
    fastest = max(float(structure.values[0].max()), float(ensemble.reals[:, Reals.OMEGA].max()))
    return 2 * (max(4, math.ceil(step_time * PIECES * fastest / (2.0 * math.pi))) + 2)


class Options(NamedTuple):
    """What a benchmark or a test may set; only *fewest_threads* touches results, in their last bits."""

    most_blocks: int | None = None
    """Runs marched at a time; as many as the device holds by default."""
    first_budget: int = 1000
    """Steps of the first slice; later ones last about 0.4 s."""
    fewest_threads: int | None = None
    """Of a block: 16 on a device by default, where fewer leave lanes idle all the same."""
    warps: int | None = None
    """Warps that a multiprocessor is to hold; see :data:`snapbeam.engines.cuda.layout.RESIDENT_WARPS`."""


class _Launch:
    """The kernel, the structure on the device, and room for the runs that are marched at a time."""

    def __init__(self, ensemble: Ensemble, options: Options) -> None:
        from numba import cuda

        from snapbeam.engines.cuda.march import march_kernel

        plan = ensemble.plan
        self.ensemble = ensemble
        self.structure = device_structure(
            ensemble, options.fewest_threads or (1 if simulated() else FEWEST_THREADS)
        )
        self.kernel = march_kernel(
            plan.order, self.structure.threads, self.structure.columns, options.warps or RESIDENT_WARPS
        )
        row = self.structure.across
        size = ensemble.packed.layout.size
        starts = row(ensemble.starts.reshape(-1, 2, size))
        self.fixed = (
            cuda.to_device(self.structure.values),
            cuda.to_device(self.structure.places),
            cuda.to_device(self.structure.coupling),
            float(ensemble.packed.layout.gamma),
            float(ensemble.packed.layout.stretch),
            cuda.to_device(row(ensemble.contact_rows)),
            cuda.to_device(starts),
        )
        self.pieces = _most_pieces(ensemble, self.structure)
        self.blocks = 1
        self.room = self._room()
        one_run = (np.empty((1, len(Counts)), dtype=np.int64), np.empty((1, len(Numbers))))
        # a march of no steps: the kernel is compiled, and the driver knows how many blocks fit
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", NumbaPerformanceWarning)
            self._call(self._runs(np.zeros(1, dtype=np.int64), *one_run), 0)
        fitting = [
            one.max_cooperative_grid_blocks(self.structure.threads) for one in self.kernel.overloads.values()
        ]
        self.blocks = max(
            1, min(max(fitting, default=1), options.most_blocks or ensemble.size, ensemble.size)
        )
        self.room = self._room()

    def _room(self) -> tuple[Any, ...]:
        """What blocks keep of their own: marks and state of the run laid down, and work arrays."""
        from numba import cuda

        plan, threads, blocks = self.ensemble.plan, self.structure.threads, self.blocks
        distinct = (COMPOSITIONS[plan.order].flow.size + 1) // 2
        flows = (plan.finest + 3) * distinct + 2
        return (
            cuda.to_device(np.full(blocks, -1, dtype=np.int64)),
            cuda.to_device(np.zeros((blocks, MARKS), dtype=np.int64)),
            cuda.to_device(np.zeros((blocks, KEPT))),
            cuda.device_array((blocks, 3, threads), dtype=np.float64),
            cuda.device_array((blocks, flows, 4, threads), dtype=np.float64),
            cuda.device_array((blocks, plan.finest + 3, 2, TURNS), dtype=np.float64),
            cuda.device_array((blocks, self.pieces + 1, 4), dtype=np.float64),
        )

    def _runs(self, which: _Integers, counts: _Integers, numbers: _Array) -> tuple[Any, ...]:
        """The columns of the runs *which*, their queue, and where their results go."""
        from numba import cuda

        return (
            cuda.to_device(np.ascontiguousarray(self.ensemble.reals[which])),
            cuda.to_device(np.ascontiguousarray(self.ensemble.ticks[which])),
            cuda.to_device(np.arange(which.size, dtype=np.int64)),
            cuda.to_device(np.zeros(2, dtype=np.int64)),
            cuda.to_device(counts),
            cuda.to_device(numbers),
        )

    def _call(self, runs: tuple[Any, ...], budget: int) -> _Integers:
        """March every block for *budget* steps; returns how many runs were drawn and how many ended."""
        reals, ticks, order, queue, counts, numbers = runs
        plan = self.ensemble.plan
        self.kernel[self.blocks, self.structure.threads](
            *self.fixed, reals, ticks, order, queue, *self.room, counts, numbers,
            plan.coarsest, plan.finest, self.ensemble.max_steps, budget,
        )  # fmt: skip
        state: _Integers = queue.copy_to_host()
        return state

    def march(
        self,
        which: _Integers,
        counts: _Integers,
        numbers: _Array,
        ended: Callable[[int], object],
        budget: int,
    ) -> int:
        """March the runs *which*, in this order, into *counts* and *numbers*; returns the last budget."""
        own_counts, own_numbers = counts[which], numbers[which]
        runs = self._runs(which, own_counts, own_numbers)
        done = 0
        while done < which.size:
            began = time.perf_counter()
            now = int(self._call(runs, budget)[1])
            took = time.perf_counter() - began
            budget = int(min(max(budget * min(max(_SLICE / took, 0.5), 4.0), SLICE_STEPS[0]), SLICE_STEPS[1]))
            if now > done:
                ended(now - done)
            done = now
        counts[which], numbers[which] = runs[4].copy_to_host(), runs[5].copy_to_host()
        return budget


def run_ensemble(
    ensemble: Ensemble,
    threads: int | None = None,
    progress: Callable[[int, int], object] | None = None,
    options: Options | None = None,
) -> tuple[_Integers, _Array]:
    """March every run of an ensemble on the CUDA device.

    Runs go to the device longest first, a bounded number at a time; what a run gives does not depend on
    which block marched it, beside which others, or in how many slices.

    Parameters
    ----------
    ensemble : Ensemble
    threads : int, optional
        Of no account here: the CPU's.
    progress : callable, optional
        Called as ``progress(done, total)`` as runs end.
    options : Options, optional

    Returns
    -------
    counts : int64 array of shape (runs, len(Counts))
    numbers : float64 array of shape (runs, len(Numbers))

    Raises
    ------
    InputError
        No device can be used, or the ensemble is none for it.
    """
    reason = refusal(ensemble.packed.model.modes, ensemble.restitution)
    if reason is None and ensemble.drive_table.size > 0:
        reason = "a recorded drive is marched by the CPU engine alone"
    if reason is not None:
        raise InputError(f"engine = 'cuda': {reason}; use engine='cpu'")
    counts = np.zeros((ensemble.size, len(Counts)), dtype=np.int64)
    counts[:, Counts.STATUS] = RunStatus.NOT_RUN
    numbers = np.zeros((ensemble.size, len(Numbers)))
    numbers[:, Numbers.LAST_CROSSING] = np.nan
    numbers[:, Numbers.DECIDED_AT] = np.nan
    done = 0

    def ended(more: int) -> None:
        nonlocal done
        done += more
        if progress is not None:
            progress(done, ensemble.size)

    options = options or Options()
    launch = _Launch(ensemble, options)
    order = np.argsort(-ensemble.work, kind="stable")
    budget = options.first_budget
    for first in range(0, order.size, _CHUNK):
        budget = launch.march(order[first : first + _CHUNK], counts, numbers, ended, budget)
    return counts, numbers
