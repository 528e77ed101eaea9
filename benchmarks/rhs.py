"""The right-hand side that the peers integrate, compiled, from the package's own eight-wide rows.

The state is (q / q0, p / (q0 omega_s)) in the padded modal rows of the package, of order one, so that one
absolute tolerance suits every component.  With modal damping a right-hand side needs one dense product per
parity in either form: the modal form has it in the tension (G q), the diagonal-plus-rank-one form of the mass
matrix in the damping (m^-1 C).  The modal form is used, with the package's own product.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from benchmarks.cases import CONTACT, Case
from benchmarks.peers.equations import equations_of
from snapbeam.solver.cpu.memory import pack
from snapbeam.solver.cpu.mode_lanes import tension_rows
from snapbeam.solver.physics import sincos, tension_factors
from snapbeam.solver.simd import dot
from snapbeam.solver.structure import structure_of

__all__ = ["CompiledSystem", "aligned", "compiled_system"]

_Array = NDArray[np.float64]
_ALIGNMENT = 64


def aligned(size: int) -> _Array:
    """Zeros that begin where a whole register can be loaded at once."""
    raw = np.zeros(size + _ALIGNMENT // 8)
    first = (-raw.ctypes.data % _ALIGNMENT) // 8
    return raw[first : first + size]


@dataclass(frozen=True)
class CompiledSystem:
    """A compiled right-hand side and what it reads."""

    function: Any
    """``function(t, u, du, memory)`` writes du; all arrays of float64."""
    memory: _Array
    initial_state: _Array
    """State at rest in the well, with the shaker in touch."""
    rows: NDArray[np.int64]
    """Where q of each linear mode stands in the state."""
    scale: float
    """q0."""

    def coordinates(self, states: _Array) -> _Array:
        """Modal coordinates q of states of shape (..., size)."""
        return np.asarray(self.scale * states[..., self.rows])


def compiled_system(case: Case, weight: float) -> CompiledSystem:
    """The equations of *case* for a general-purpose integrator.

    *weight* is omega_s / omega_1: how much looser the absolute tolerance is on velocities.  Each method is
    given the one that serves it best.
    """
    model, e = case.model, equations_of(case)
    packed = pack(structure_of(model, "below"))
    layout, blocks = packed.layout, packed.blocks
    size, work = layout.size, layout.work
    memory = aligned(work + 2 * size)
    memory[:work] = packed.memory[:work]
    row = packed.spread(model.linear_modes.T @ model.shape_at(case.location))
    memory[layout.contact : layout.contact + size] = row
    start_q = np.zeros(size)  # at rest in the well, the tip in touch
    scale = float(model.length_scale / np.abs(row).max())
    rate = weight * float(model.omega[0])
    amplitude, omega, stiffness = e.amplitude, e.drive, CONTACT.stiffness
    gamma = layout.gamma
    q, r = work, work + size
    squared, damping, g, contact = layout.omega_squared, layout.damping, layout.g, layout.contact
    inverse = 1.0 / (scale * rate)

    @njit(error_model="numpy", fastmath={"contract", "reassoc", "nsz"}, nogil=True)
    def function(t: float, u: _Array, du: _Array, memory: _Array) -> None:
        for i in range(size):
            memory[q + i] = scale * u[i]
        gq, qr = tension_rows(memory, blocks, layout, q, r)
        along_g, along_r = tension_factors(gamma, gq, qr)
        sine, _ = sincos(omega * t)
        depth = amplitude * sine - dot(memory, size, contact, q)
        force = stiffness * depth * depth**0.5 if depth > 0.0 else 0.0
        for i in range(size):
            du[i] = rate * u[size + i]
            pull = along_g * memory[g + i] + along_r * memory[r + i] + force * memory[contact + i]
            pull -= memory[squared + i] * memory[q + i]
            du[size + i] = inverse * pull - 2.0 * memory[damping + i] * u[size + i]

    initial_state = np.concatenate((start_q / scale, np.zeros(size)))
    return CompiledSystem(function, memory, initial_state, packed.rows, scale)
