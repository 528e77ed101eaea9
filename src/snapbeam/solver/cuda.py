"""The native core on a GPU: its headers, compiled by NVRTC for the structure and the card at hand, one run a thread."""

from __future__ import annotations

import re
import time
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from snapbeam import _core
from snapbeam.solver.channels import PARTIAL
from snapbeam.solver.native import Progress
from snapbeam.util.packages import needing, needs
from snapbeam.util.validation import InputError

_BLOCK = 512
"""Threads of a block."""
_LONG = 0.25
"""s that a launch takes about: then progress is told, and a stop is heard."""
_IN_REGISTERS = (1, 2, 4, 6, 8, 10, 12)
"""Numbers of modes for which rows stay in registers."""
_TEXT = Path(__file__).parents[1] / "core"


def source() -> str:
    """The text of the kernels, all headers of the core in one, so that a cache knows it by its content."""
    seen = set()

    def with_headers(name: str) -> str:
        seen.add(name)
        text = (_TEXT / name).read_text(encoding="utf-8").replace("#pragma once", "")
        return re.sub(r'#include "(\S+)"', lambda found: "" if found[1] in seen else with_headers(found[1]), text)

    return with_headers("kernel.cu")


def definitions(problem: dict[str, Any]) -> dict[str, str]:
    """Return what a kernel knows of a structure: macros of ``core/layout.hpp`` and ``core/kernel.cu``."""
    sizes, modes, channels = problem["block_sizes"].tolist(), problem["omega"].size, problem["laws"].size
    in_registers = modes in _IN_REGISTERS and sizes == ([1] if modes == 1 else [modes // 2] * 2)
    found = {
        "SET": "gpu",
        "WIDTH": 1,
        "BLOCK": _BLOCK,
        "FIXED": modes if in_registers else 0,
        "CELLS": modes,
        "BLOCKS": len(sizes),
        "CHANNELS": channels,
        "SIGNALS": np.count_nonzero(problem["signal_kinds"] != PARTIAL),
        "LAW_NUMBERS": problem["law_numbers"],
        "LEVELS": problem["levels"],
        "DISTINCT_FLOWS": (len(_core.COMPOSITIONS[problem["composition"]][0]) + 1) // 2,
        "LAWS": f"{sum(1 << law for law in set(problem['laws'].tolist()))}u",
    }
    if not problem["signal_kinds"].any() and (problem["windows"] < 0).all():
        found["ONLY_TONES"] = 1
    return {f"SNAPBEAM_{name}": str(value) for name, value in found.items()}


def compiled(architecture: str, defined: dict[str, str]) -> Any:
    """Compile the kernels of a structure for an architecture such as ``sm_90``, or take them from the cache on disk.

    No GPU is needed.
    """
    with needing("engine = 'cuda'", "cuda"):
        from cuda.core import Program, ProgramOptions
        from cuda.core.utils import FileStreamProgramCache
        from cuda.pathfinder import DynamicLibNotFoundError
    options = ProgramOptions(
        std="c++20", arch=architecture, fma=False, device_as_default_execution_space=True, disable_warnings=True,
        define_macro=list(defined.items()),
    )  # fmt: skip
    try:
        with FileStreamProgramCache() as stored:
            return Program(source(), "c++", options).compile("cubin", cache=stored)
    except DynamicLibNotFoundError as error:
        raise InputError(needs("engine = 'cuda'", "the compiler NVRTC", "cuda")) from error


@cache
def _device() -> Any:
    """The card."""
    with needing("engine = 'cuda'", "cuda"):
        from cuda.core import Device
    try:
        found = Device()
        found.set_current()
    except Exception as error:  # of the driver, or that there is none
        raise InputError(f"engine = 'cuda': no GPU of NVIDIA answers ({error}); use engine = 'native'") from error
    return found


class _Memory:
    """Memory of the card for one call."""

    def __init__(self) -> None:
        self.stream = _device().create_stream()
        self._held: list[Any] = []

    def room(self, size: int) -> int:
        """The address of so many bytes."""
        try:
            self._held.append(_device().allocate(max(size, 1), stream=self.stream))
        except Exception as error:
            if "OUT_OF_MEMORY" not in str(error):
                raise
            raise InputError(
                f"engine = 'cuda': the GPU has no room for {size / 1e9:.3g} GB more; compute fewer points at a time "
                "(points_per_task of a checkpoint), or use engine = 'native'"
            ) from error
        self.stream.sync()
        return int(self._held[-1].handle)

    def put(self, values: Any) -> int:
        """The address of a copy of an array."""
        at = self.room(values.nbytes)
        self._copy("cuMemcpyHtoD", at, values.ctypes.data, values.nbytes)
        return at

    def get(self, at: int, values: Any) -> None:
        """Read an array from an address."""
        self._copy("cuMemcpyDtoH", values.ctypes.data, at, values.nbytes)

    def _copy(self, function: str, to: int, origin: int, size: int) -> None:
        from cuda.bindings import driver

        if size:
            (error,) = getattr(driver, function)(to, origin, size)
            if error != driver.CUresult.CUDA_SUCCESS:
                raise RuntimeError(f"{function}: {error.name}")

    def launch(self, kernel: Any, blocks: int, threads: int, *arguments: Any) -> None:
        """Run a kernel to its end."""
        from cuda.core import LaunchConfig, launch

        launch(self.stream, LaunchConfig(grid=blocks, block=threads), kernel, *arguments)
        self.stream.sync()

    def close(self) -> None:
        """Give the memory back."""
        for each in self._held:
            each.close(self.stream)


def integrate(problem: dict[str, Any], batch: dict[str, Any], progress: Progress | None) -> None:
    """Integrate the runs of a batch as :func:`snapbeam._core.integrate` does."""
    memory = _Memory()
    try:
        _integrate(memory, problem, batch, progress)
    finally:
        memory.close()


def _integrate(memory: _Memory, problem: dict[str, Any], batch: dict[str, Any], progress: Progress | None) -> None:
    arrays = [each for each in (problem | batch).values() if isinstance(each, np.ndarray)]
    places = {each.ctypes.data: memory.put(each) for each in arrays}
    arguments = _core.moved_arguments(problem, batch, places)
    card = _device()
    program = compiled(f"sm_{card.arch}", definitions(problem))
    sizes, begin_runs, go_on = (program.get_kernel(name) for name in ("sizes", "begin_runs", "go_on"))
    size = np.zeros(2, dtype=np.int64)
    at = memory.room(size.nbytes)
    memory.launch(sizes, 1, 1, np.uint64(at))
    memory.get(at, size)
    runs = batch["run"].shape[0]
    resident = go_on.occupancy.max_active_blocks_per_multiprocessor(_BLOCK, 0)
    processors = card.properties.multiprocessor_count
    threads = min(_BLOCK, 32 * max(1, -(-runs // (32 * processors))))
    blocks = min(processors * max(1, resident), -(-runs // threads))
    shared, aside = memory.room(int(size[0])), memory.room(blocks * threads * int(size[1]))
    given = [np.uint64(memory.put(np.frombuffer(each, dtype=np.uint8))) for each in arguments]
    memory.launch(begin_runs, 1, 1, *given, np.uint64(shared))
    counters, budget, begins = np.zeros(2, dtype=np.int32), 64, True  # next, done
    while counters[1] < runs:
        begun = time.perf_counter()
        memory.launch(go_on, blocks, threads, np.uint64(shared), np.uint64(aside), np.int32(budget), np.int32(begins))
        took, begins = time.perf_counter() - begun, False
        memory.get(shared, counters)
        if progress is not None:
            progress(int(counters[1]), runs)
        budget = int(min(budget * min(4.0, 0.1 + _LONG / took), 1e6)) + 1
    for name in ("states", "statistics", "of_channels"):
        memory.get(places[batch[name].ctypes.data], batch[name])
