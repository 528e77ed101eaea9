"""The CUDA engine's driver: what the device needs, in slices of time short enough to be interrupted."""

from __future__ import annotations

import math
import time
import warnings
from collections.abc import Callable, Iterator
from importlib.util import find_spec
from typing import Any, NamedTuple

import numpy as np
from numba import NumbaPerformanceWarning
from numpy.typing import NDArray

from snapbeam.model.contact.base import ContactLaw
from snapbeam.model.drive.base import Drive
from snapbeam.model.drive.sine import Sine
from snapbeam.solver.cuda.layout import (
    FEWEST_THREADS,
    KEPT,
    MARKS,
    MOST_MODES,
    RESIDENT_WARPS,
    device_structure,
)
from snapbeam.solver.ensemble import Ensemble
from snapbeam.solver.splitting import COMPOSITIONS, TURNS
from snapbeam.solver.statistics import OutputStates, Recorded, empty_accumulators, updated
from snapbeam.solver.step_control import SUBINTERVALS
from snapbeam.util.validation import InputError

_Array = NDArray[np.float64]
_Integers = NDArray[np.int64]

_CHUNK = 1 << 18
"""Runs whose columns are on the device at a time, whatever the ensemble's size."""
_SLICE = 0.4
"""Aim for the length of one call of the kernel, s."""
SLICE_STEPS = (500, 10**8)
"""Fewest and most steps of a slice."""


def _unusable() -> str | None:
    """Reason why no CUDA device can be used; None if one can."""
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
    """Return whether the Numba simulator replaces a device: for tests only, thousands of times slower."""
    from numba import config

    return bool(config.ENABLE_CUDASIM)


def refusal(modes: int, law: type[ContactLaw] | None = None, drive: type[Drive] = Sine) -> str | None:
    """Reason why such runs cannot be integrated on a device; None if they can."""
    if law is not None and law.impulsive:
        return f"the law of contact {law.name!r}, whose impacts last no time, is integrated by the CPU engine alone"
    if law is not None and law.rate_dependent:
        return f"the law of contact {law.name!r}, which loses energy, is integrated by the CPU engine alone"
    if law is not None and law.memory:
        return f"the law of contact {law.name!r}, which has a state of its own, is integrated by the CPU engine alone"
    if not drive.harmonic:
        return f"the drive {drive.name!r} is integrated by the CPU engine alone"
    if modes > MOST_MODES:
        return f"a model of {modes} modes has more than its {MOST_MODES}"
    if updated():
        return "statistics that were registered are kept by the CPU engine alone"
    return _unusable()


def _most_subintervals(ensemble: Ensemble) -> int:
    """The most subintervals in which a step of any run is sampled."""
    step_time = float(ensemble.step_times.max())
    return max(4, math.ceil(step_time * SUBINTERVALS * ensemble.fastest / (2.0 * math.pi))) + 2


class Options(NamedTuple):
    """Options of benchmarks and tests; only *fewest_threads* changes results, in their last bits."""

    most_blocks: int | None = None
    """Runs integrated at a time; as many as the device holds by default."""
    first_budget: int = 1000
    """Steps of the first slice; later ones last about 0.4 s."""
    fewest_threads: int | None = None
    """Minimum threads of a block: 16 on a device by default, because fewer leave lanes idle."""
    warps: int | None = None
    """Warps that a multiprocessor is to hold; see :data:`snapbeam.solver.cuda.layout.RESIDENT_WARPS`."""


class _Launch:
    """The kernel, the structure on the device, and room for the runs that are integrated at a time."""

    def __init__(self, ensemble: Ensemble, options: Options) -> None:
        from numba import cuda

        from snapbeam.solver.cuda.integrate import integrate_kernel

        self.ensemble = ensemble
        self.max_halvings = ensemble.max_halvings
        self.structure = device_structure(
            ensemble, options.fewest_threads or (1 if simulated() else FEWEST_THREADS)
        )
        self.kernel = integrate_kernel(
            ensemble.order, self.structure.threads, self.structure.columns, self.max_halvings,
            options.warps or RESIDENT_WARPS,
        )  # fmt: skip
        self.fixed = (
            cuda.to_device(self.structure.values),
            cuda.to_device(self.structure.places),
            cuda.to_device(self.structure.coupling),
        )
        self.contact_rows = cuda.to_device(self.structure.across(ensemble.contact_rows))
        self.starts = cuda.to_device(self.structure.across(ensemble.starts))
        self.subintervals = _most_subintervals(ensemble)
        self.blocks = 1
        self.kernel_output, self.work = self._room()
        # a launch of no steps: the kernel is compiled, and the driver knows how many blocks fit
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", NumbaPerformanceWarning)
            self._call(self._runs(np.zeros(1, dtype=np.int64), empty_accumulators(1)), 0)
        fitting = [
            one.max_cooperative_grid_blocks(self.structure.threads) for one in self.kernel.overloads.values()
        ]
        self.blocks = max(
            1, min(max(fitting, default=1), options.most_blocks or ensemble.size, ensemble.size)
        )
        self.kernel_output, self.work = self._room()

    def _room(self) -> tuple[Any, Any]:
        """Allocate the memory of each block: marks and state of the interrupted run, and work arrays."""
        from numba import cuda

        from snapbeam.solver.cuda.integrate import DeviceState, DeviceWorkspace

        threads, blocks = self.structure.threads, self.blocks
        distinct = (COMPOSITIONS[self.ensemble.order].flow.size + 1) // 2
        flows = (self.max_halvings + 2) * distinct + 2
        kernel_output = DeviceState(
            cuda.to_device(np.full(blocks, -1, dtype=np.int64)),
            cuda.to_device(np.zeros((blocks, MARKS), dtype=np.int64)),
            cuda.to_device(np.zeros((blocks, KEPT))),
            cuda.device_array((blocks, 3, threads), dtype=np.float64),
        )
        work = DeviceWorkspace(
            cuda.device_array((blocks, flows, 4, threads), dtype=np.float64),
            cuda.device_array((blocks, self.max_halvings + 2, 2, TURNS), dtype=np.float64),
            cuda.device_array((blocks, self.subintervals + 1, 4), dtype=np.float64),
        )
        return kernel_output, work

    def _runs(self, which: _Integers, accumulators_of_runs: NDArray[Any]) -> tuple[Any, ...]:
        """The columns of the runs *which*, their queue, and where their results go."""
        from numba import cuda

        from snapbeam.solver.cuda.integrate import DeviceInput

        ensemble = self.ensemble
        law, drive = ensemble.law.numbers_type(), ensemble.drive.numbers_type()
        kernel_input = DeviceInput(
            runs=cuda.to_device(np.ascontiguousarray(ensemble.runs[which]).view(np.recarray)),
            law_numbers=cuda.to_device(np.ascontiguousarray(ensemble.law_numbers[which])),
            drive_numbers=cuda.to_device(np.ascontiguousarray(ensemble.drive_numbers[which])),
            contact_rows=self.contact_rows,
            starts=self.starts,
            law=law(*[0.0] * len(law._fields)),
            drive=drive(*[0.0] * len(drive._fields)),
            gamma=float(ensemble.structure.nonlinear_stiffness),
            stretch=float(ensemble.structure.stretch),
            max_steps=ensemble.max_steps,
            high=bool(ensemble.structure.high_modes(ensemble.high_omega).any()),
        )
        return (
            kernel_input,
            cuda.to_device(np.arange(which.size, dtype=np.int64)),
            cuda.to_device(np.zeros(2, dtype=np.int64)),
            cuda.to_device(accumulators_of_runs.view(np.recarray)),
        )

    def _call(self, runs: tuple[Any, ...], budget: int) -> _Integers:
        """Integrate every block for *budget* steps; returns how many runs were drawn and how many ended."""
        kernel_input, order, queue, accumulators_of_runs = runs
        self.kernel[self.blocks, self.structure.threads](
            *self.fixed,
            kernel_input,
            order,
            queue,
            self.kernel_output,
            self.work,
            accumulators_of_runs,
            budget,
        )
        state: _Integers = queue.copy_to_host()
        return state

    def march(
        self,
        which: _Integers,
        accumulators_of_runs: NDArray[Any],
        ended: Callable[[int], object],
        budget: int,
    ) -> int:
        """Integrate the runs *which*, in this order, into *accumulators*; returns the last budget."""
        runs = self._runs(which, accumulators_of_runs[which])
        done = 0
        while done < which.size:
            began = time.perf_counter()
            now = int(self._call(runs, budget)[1])
            took = time.perf_counter() - began
            budget = int(min(max(budget * min(max(_SLICE / took, 0.5), 4.0), SLICE_STEPS[0]), SLICE_STEPS[1]))
            if now > done:
                ended(now - done)
            done = now
        accumulators_of_runs[which] = runs[3].copy_to_host()
        return budget


def run_ensemble(
    ensemble: Ensemble,
    threads: int | None = None,
    progress: Callable[[int, int], object] | None = None,
    options: Options | None = None,
) -> NDArray[Any]:
    """Integrate every run of an ensemble on the CUDA device.

    Runs go to the device longest first, a bounded number at a time; what a run gives does not depend on
    which block integrated it, beside which others, or in how many slices.

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
    array of accumulators, shape (runs,)

    Raises
    ------
    InputError
        No device can be used, or the ensemble is none for it.
    """
    reason = refusal(ensemble.structure.omega.size, ensemble.law, ensemble.drive)
    if reason is not None:
        raise InputError(f"engine = 'cuda': {reason}; use engine='cpu'")
    accumulators_of_runs = empty_accumulators(ensemble.size)
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
        budget = launch.march(order[first : first + _CHUNK], accumulators_of_runs, ended, budget)
    return accumulators_of_runs


def _cpu_only(what: str) -> InputError:
    return InputError(f"engine = 'cuda': {what} by the CPU engine alone; use engine='cpu'")


def integrate_with_output_states(
    ensemble: Ensemble, threads: int | None = None, progress: Any = None
) -> OutputStates:
    """Refused: states are handed out by the CPU engine."""
    raise _cpu_only("states are handed out")


def integrate_tangents(
    ensemble: Ensemble, tangents: _Array, threads: int | None = None, progress: Any = None
) -> tuple[OutputStates, _Array]:
    """Refused: tangents are carried by the CPU engine."""
    raise _cpu_only("tangents are carried")


def record(ensemble: Ensemble, times: _Array, in_contact: bool, progress: Any = None) -> Iterator[Recorded]:
    """Refused: runs are recorded by the CPU engine."""
    raise _cpu_only("runs are recorded")
