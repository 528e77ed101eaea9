"""Boost.odeint, compiled for the machine when it is first asked for; needs a C++ compiler and Boost's headers.

The environment variable BOOST_INCLUDE names the folder of the headers if the compiler does not find them.
"""

from __future__ import annotations

import ctypes
import os
import shutil
import subprocess
import tempfile
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from impact20 import Array, Case
from impact20.runners import CannotRun, Result, has_restitution, tolerances
from impact20.runners.flat import initial_state, pack, set_states
from impact20.runners.hybrid import Segment, drive, outputs
from impact20.runners.hybrid import through as through_states

PACKAGE = "boost"


@cache
def library() -> Any:
    """Compile and load; ImportError if there is no compiler or no header."""
    compiler = shutil.which("g++") or shutil.which("clang++")
    if compiler is None:
        raise ImportError("no C++ compiler")
    target = Path(tempfile.mkdtemp(prefix="impact20_")) / "boost.so"
    include = ["-I", os.environ["BOOST_INCLUDE"]] if "BOOST_INCLUDE" in os.environ else []
    flags = ["-O3", "-march=native", "-ffast-math", "-std=c++17", "-shared", "-fPIC"]
    source = str(Path(__file__).with_name("boost.cpp"))
    done = subprocess.run([compiler, *flags, *include, source, "-o", str(target)], capture_output=True, text=True)
    if done.returncode:
        raise ImportError(f"Boost.odeint does not compile: {done.stderr.strip().splitlines()[0]}")
    loaded = ctypes.CDLL(str(target))
    loaded.version.restype, loaded.counted.restype = ctypes.c_char_p, ctypes.c_long
    return loaded


def version() -> str:
    """Version of the headers."""
    return str(library().version().decode()).replace("_", ".")


library()


def settings(case: Case) -> list[dict[str, Any]]:
    """Dormand-Prince 5 with events; both methods through the contacts."""
    found = tolerances(case, "dopri5", (1e-5, 1e-7, 1e-9, 1e-11, 1e-13), events=True)
    if not has_restitution(case):
        found += tolerances(case, "dopri5", (1e-5, 1e-7, 1e-9), events=False)
        found += tolerances(case, "fehlberg78", (1e-5, 1e-7, 1e-9, 1e-11, 1e-13), events=False)
    return found


def _pointer(array: Array) -> Any:
    return array.ctypes.data_as(ctypes.c_void_p)


def prepare(case: Case, setting: dict[str, Any]) -> Callable[[], Result]:
    """A solve of the case."""
    loaded, p, n = library(), pack(case), len(case.stiffness)
    start = initial_state(case)
    tolerance = ctypes.c_double(setting["tolerance"])
    if not setting["events"]:
        times = np.concatenate(([0.0], case.times))

        def solve() -> Result:
            set_states(case, p, through_states(case, ""), case.pulse is not None)
            out = np.empty((times.size, start.size))
            method = {"dopri5": 0, "fehlberg78": 1}[setting["method"]]
            if loaded.through(_pointer(p), _pointer(start), start.size, _pointer(times), times.size, method, tolerance, _pointer(out)):  # fmt: skip
                raise CannotRun("the integration failed")
            return Result(outputs(case, out[1:]), None, loaded.counted(), out[-1])

        return solve
    longest = ctypes.c_double(1.0 / max([case.frequency, *[tip.frequency for tip in case.tips], 0.5]))

    def segment(states: tuple[int, ...], pulse: bool, t: float, u: Array, end: float, times: Array) -> Segment:
        set_states(case, p, states, pulse)
        state, at, reached = np.array(u, dtype=float), ctypes.c_double(t), ctypes.c_int(0)
        out, wanted = np.empty((times.size, u.size)), np.ascontiguousarray(times)
        before = loaded.counted()
        hit = loaded.segment(
            _pointer(p), _pointer(state), state.size, ctypes.byref(at), ctypes.c_double(end), _pointer(wanted),
            wanted.size, tolerance, longest, _pointer(out), ctypes.byref(reached),
        )  # fmt: skip
        if hit == -2:
            raise CannotRun("the integration failed")
        return Segment(at.value, state, out[: reached.value, :n] @ case.output, hit, loaded.counted() - before)

    return lambda: drive(case, segment)
