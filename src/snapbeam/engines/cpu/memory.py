"""From a ReducedModel to the padded rows that the kernels march."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components

from snapbeam.engines.cpu.rows import Layout
from snapbeam.engines.scalar.lanes import WIDTH
from snapbeam.model.reduction import ReducedModel

__all__ = ["Packed", "pack"]

_Array = NDArray[np.float64]

_LONGEST_DECAY = 4.0
"""zeta omega t up to which :func:`~snapbeam.engines.scalar.physics.decay` is accurate."""
_SLOWEST = 1e-12
"""Stands for no damping, 1/s."""


class Packed(NamedTuple):
    """A structure in rows, and the way there and back."""

    memory: _Array
    """What the kernel reads."""
    blocks: NDArray[np.int64]
    layout: Layout
    rows: NDArray[np.int64]
    """Row of each linear mode, shape (N,)."""
    equilibrium: _Array
    """alpha at the well the run starts in, shape (N,)."""
    model: ReducedModel
    sign: float
    """+1 for a shaker below, -1 for one above."""

    def row(self, shape: _Array) -> _Array:
        """V^T shape as a padded row, with the sign of the shaker's side."""
        padded = np.zeros(self.layout.size)
        padded[self.rows] = self.sign * (self.model.linear_modes.T @ shape)
        return padded

    def modal(self, alpha: _Array, velocity: _Array) -> tuple[_Array, _Array]:
        """Amplitudes and their velocities as padded rows q and p."""
        back = self.model.linear_modes.T @ self.model.mass
        q, p = np.zeros(self.layout.size), np.zeros(self.layout.size)
        q[self.rows] = back @ (alpha - self.equilibrium)
        p[self.rows] = back @ velocity
        return q, p

    def amplitudes(self, q: _Array) -> _Array:
        """alpha of padded rows q of shape (..., rows)."""
        alpha: _Array = self.equilibrium + q[..., self.rows] @ self.model.linear_modes.T
        return alpha


def pack(model: ReducedModel, side: str) -> Packed:
    """Arrange *model* in rows about the well that a run from *side* starts in.

    Linear modes that the tension does not couple (the symmetric and the antisymmetric ones) become
    separate blocks, each padded to a multiple of eight rows.
    """
    sign = 1.0 if side == "below" else -1.0
    equilibrium = sign * model.equilibrium
    coupling = model.tension_matrix
    _, label = connected_components(csr_array(coupling != 0.0), directed=False)
    omega, zeta = model.omega, model.damping_ratio
    blocks: list[int] = []
    rows = np.empty(model.modes, dtype=np.int64)
    size = 0
    for b in range(label.max() + 1):
        members = np.flatnonzero(label == b)
        rows[members] = size + np.arange(members.size)
        stop = size + -(-members.size // WIDTH) * WIDTH
        unroll = 4 if stop - size > WIDTH else 2
        blocks += [size, stop, -(-members.size // unroll) * unroll]
        size = stop

    def padded(values: _Array, fill: float = 0.0) -> _Array:
        out = np.full(size, fill)
        out[rows] = values
        return out

    full = np.zeros((size, size))
    full[np.ix_(rows, rows)] = coupling
    strips = []
    for start, stop, columns in zip(blocks[::3], blocks[1::3], blocks[2::3], strict=True):
        at = start
        while at < stop:
            height = 2 * WIDTH if at + 2 * WIDTH <= stop else WIDTH
            strips.append(full[at : at + height, start : start + columns].T.ravel())
            at += height
    packed = Packed(
        memory=np.empty(0),
        blocks=np.array(blocks, dtype=np.int64),
        layout=Layout(*range(len(Layout._fields))),
        rows=rows,
        equilibrium=equilibrium,
        model=model,
        sign=sign,
    )
    pieces = [
        padded(omega),
        padded(omega * omega),
        padded(omega * np.sqrt(1.0 - zeta * zeta), 1.0),
        padded(zeta * omega),
        padded(model.linear_modes.T @ equilibrium),
        np.zeros(size),
        packed._replace(layout=packed.layout._replace(size=size)).row(model.center_shape),
        padded(-2.0 * (model.linear_modes.T @ model.mass @ equilibrium)),
        np.concatenate(strips),
    ]
    starts = np.concatenate(([0], np.cumsum([piece.size for piece in pieces])))
    stretch = float(equilibrium @ equilibrium)
    moving = bool(np.all(omega * np.sqrt(1.0 - zeta * zeta) > 0.0))
    gentle = _LONGEST_DECAY / max(float((zeta * omega).max()), _SLOWEST) if moving else 0.0
    layout = Layout._make(
        (size, *map(int, starts), float(model.tension_stiffness), stretch, gentle, 0, 0, 1.0)
    )
    return packed._replace(memory=np.concatenate(pieces), layout=layout)
