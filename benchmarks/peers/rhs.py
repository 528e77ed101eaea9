"""The right-hand side that the peers integrate, in C++, compiled with the machine's own compiler.

The state is (q / q0, p / (q0 omega_s)), of order one, so that one absolute tolerance suits every component.  With modal damping a
right-hand side needs one dense product per parity in either form: the modal form has it in the tension (G q), the
diagonal-plus-rank-one form of the mass matrix in the damping (m^-1 C).  The modal form is used.
"""

from __future__ import annotations

import ctypes
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.cases import Case
from benchmarks.peers.compiled import library
from benchmarks.peers.equations import equations_of

__all__ = ["CompiledSystem", "compiled_system"]

_Array = NDArray[np.float64]
_SLOPE = library(Path(__file__).with_name("rhs.cpp"), "-std=c++17", "-ffp-contract=fast").slope
_SLOPE.argtypes, _SLOPE.restype = [ctypes.c_double, *3 * [ctypes.c_void_p]], None


@dataclass(frozen=True)
class CompiledSystem:
    """A compiled right-hand side and what it reads."""

    memory: _Array
    initial_state: _Array
    """State at rest in the well, with the shaker in touch."""
    order: NDArray[np.intp]
    """Mode of each coordinate of the state."""
    scale: float
    """q0."""
    function: Any = _SLOPE
    """``slope(t, u, du, memory)`` writes du; the last three are pointers to doubles."""

    @property
    def address(self) -> int:
        """Of the function."""
        found = ctypes.cast(self.function, ctypes.c_void_p).value
        assert found is not None
        return found

    def coordinates(self, states: _Array) -> _Array:
        """Modal coordinates q of states of shape (..., size)."""
        found = np.empty((*states.shape[:-1], self.order.size))
        found[..., self.order] = self.scale * states[..., : self.order.size]
        return found


def compiled_system(case: Case, weight: float) -> CompiledSystem:
    """The equations of *case* for a general-purpose integrator.

    *weight* is omega_s / omega_1: how much looser the absolute tolerance is on velocities.  Each method is
    given the one that serves it best.
    """
    e = equations_of(case)
    scale = float(np.sqrt(np.abs(e.contact).max() / np.abs(e.push).max()))
    blocks = [np.flatnonzero(e.parity == each) for each in np.unique(e.parity)[::-1]]
    blocks += [np.empty(0, dtype=np.intp)] * (2 - len(blocks))

    def padded(values: _Array) -> _Array:
        return np.concatenate([np.pad(values[each], (0, -each.size % 8)) for each in blocks])

    head = (
        blocks[0].size,
        blocks[1].size,
        scale,
        weight * e.omega[0],
        e.gamma / scale**2,
        e.stiffness,
        e.amplitude,
        e.drive,
    )
    rows = [padded(each) for each in (e.omega**2, e.damping_ratio * e.omega, e.g * scale, e.push * scale)]
    strips = [np.pad(e.tension[np.ix_(each, each)], ((0, 0), (0, -each.size % 8))).ravel() for each in blocks]
    memory = np.concatenate([np.array(head, dtype=float), *rows, *strips])
    return CompiledSystem(memory, np.zeros(2 * e.omega.size), np.concatenate(blocks), scale)
