"""Restrictions of the run-lane layout, and the memory of a thread that integrates it."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from snapbeam.solver.cpu.memory import Packed
from snapbeam.solver.cpu.run_lanes import layout as at
from snapbeam.solver.cpu.run_lanes.layout import shape_of
from snapbeam.solver.cpu.run_lanes.state import LaneSettings
from snapbeam.solver.ensemble import Ensemble
from snapbeam.solver.registered_statistics import extras_of_table
from snapbeam.solver.simd import WIDTH
from snapbeam.solver.splitting import COMPOSITIONS, in_memory

_Array = NDArray[np.float64]
_MOST_TICKS = 2.0**52
"""Ticks that numbers of double precision count one by one."""
_ALIGNMENT = 64
_LAW_NUMBERS = 8


class FewMemory(NamedTuple):
    """Everything that one thread needs to integrate eight runs at a time."""

    m: _Array
    n: NDArray[np.int64]
    shape: Any
    lane_settings: LaneSettings


def suits(ensemble: Ensemble, packed: Packed, most: int = at.MOST) -> bool:
    """Return whether the run-lane layout supports an ensemble with at most *most* modes.

    It knows a structure without terms and circuit, sinusoidal drives, laws that store energy and are plain arithmetic, modes whose flows
    polynomials serve, and the package's own statistics.
    """
    law, longest = ensemble.law, float(ensemble.step_times.max())
    flow = float(np.abs(COMPOSITIONS[ensemble.order].flow).max())
    return (
        packed.rows.size <= most
        and not packed.layout.terms
        and not ensemble.structure.circuits
        and ensemble.size > 1
        and ensemble.drive.harmonic
        and law.vectorizable
        and not (law.rate_dependent or law.impulsive or law.memory)
        and ensemble.law_numbers.shape[1] <= _LAW_NUMBERS
        and ensemble.max_halvings + 1 <= at.LEVELS
        and 2.0 * flow * longest < packed.layout.gentle
        and float(ensemble.runs["end"].max()) + 2.0 * float(ensemble.runs["period"].max()) < _MOST_TICKS
        and not type(extras_of_table()).owner.rows
    )


def lay_out_few(ensemble: Ensemble, packed: Packed, subintervals: int) -> FewMemory:
    """Memory for eight runs, with the structure and the composition in it; a step has *subintervals* at most."""
    structure, order = ensemble.structure, np.argsort(packed.rows)
    modes = order.size
    stages, weights = in_memory(ensemble.order, at.STAGES)
    distinct = (stages.flows + 1) // 2
    slot = at.slot_size(modes, distinct)
    sampling, length = at.sizes(modes, distinct, subintervals)
    raw = np.zeros(length + _ALIGNMENT // 8)
    skipped = (-raw.ctypes.data % _ALIGNMENT) // 8
    m: _Array = raw[skipped : skipped + length]
    m[at.STAGES : at.STAGES + weights.size] = weights
    coupling = structure.coupling[np.ix_(order, order)]
    omega, zeta = structure.omega, structure.damping_ratio
    numbers = {
        at.OMEGA_I: omega,
        at.OMEGA_SQUARED: omega * omega,
        at.OMEGA_DAMPED: omega * np.sqrt(1.0 - zeta * zeta),
        at.DAMPING: zeta * omega,
        at.CENTER: structure.center,
        at.SHIFT: structure.shift,
        at.HIGH: structure.high_modes(ensemble.high_omega).astype(np.float64),
        at.WELL: structure.well,
    }
    for i, mode in enumerate(order):
        m[at.COUPLING + i * at.MOST : at.COUPLING + i * at.MOST + modes] = coupling[i]
        for place, values in numbers.items():
            m[at.MODE + i * at.MODE_ROWS + place] = values[mode]
    _enter_pairs(
        m,
        [numbers[place][order] for place in (at.OMEGA_DAMPED, at.DAMPING, at.OMEGA_SQUARED)],
        stages.flow,
        distinct,
    )
    blocks = tuple(int(size) for size in packed.members)
    body = None
    if structure.bodies:
        body = int(np.flatnonzero(order == structure.equilibrium.size)[0])
    lane_settings = LaneSettings(stages, structure.nonlinear_stiffness, structure.stretch, slot, sampling)
    return FewMemory(
        m, np.zeros(at.RUNS + 8, dtype=np.int64), shape_of(blocks, stages.flows, body), lane_settings
    )


def _enter_pairs(m: _Array, of_modes: list[_Array], flow: int, distinct: int) -> None:
    """Write the coefficients of the flows for each pair of a mode and a distinct flow; padding pairs do not move."""
    modes = of_modes[0].size
    pairs = np.zeros((at.groups(modes, distinct) * WIDTH, 4))
    pairs[:, 0] = 1.0
    for column, values in enumerate(of_modes):
        pairs[: modes * distinct, column] = np.repeat(values, distinct)
    pairs[: modes * distinct, 3] = np.tile(m[flow : flow + distinct], modes)
    grouped = pairs.reshape(-1, WIDTH, 4).transpose(0, 2, 1).ravel()
    m[at.PAIRS : at.PAIRS + grouped.size] = grouped
