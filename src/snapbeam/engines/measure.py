"""Steps in free flight, measured on the structure itself.

How long a step may be follows from how the tension detunes the modes, from which of them come in step with the kicks,
and from how much energy there is; no formula holds from one mode to a hundred and from shallow beams to deep ones.  So
it is tried: the structure is struck at one point in its well, gently and hard, and marched for two periods of its first
mode with steps of many lengths.  What differs from the finest of them by less than a limit serves, where the error is
counted in the relative change of velocity at the start that would have done as much.
"""

from __future__ import annotations

import math
from collections import OrderedDict

import numpy as np
from numpy.typing import NDArray

from snapbeam.engines.scalar.compile import kernel
from snapbeam.engines.scalar.composition import COMPOSITIONS
from snapbeam.engines.structure import Structure, structure_of
from snapbeam.model.galerkin.reduction import ReducedModel

__all__ = ["flight_step"]

_Array = NDArray[np.float64]

_FEWEST = 30.0
"""Flight steps in a period of the first mode, at least."""
_MOST = 2.0**17
_PER_OCTAVE = 10
_MARGIN = 1
"""So many of the numbers that are tried must serve below and above the one that is taken: steps are made shorter to fit
the cycle, and modes that come in step with the kicks spoil single lengths."""
_FINER = 2.0
"""Steps of sixth order that all others are compared with, over the shortest of them."""
_STARTS = ((0.15, 1.0 / 60.0, 2.0, 0.3), (10.0, 1.0 / 160.0, 1.0, 1.0))
"""Of each blow its energy over the barrier's, how long it lasts in periods of the first mode, the length of the steps
that follow it over the flight step, and the error allowed over the limit: a beam that rings in its well, where steps
are twice as long, and one that has been struck hard."""
_STRUCK = 0.46
"""Where, over the length of the beam: no mode has a node there that its neighbours do not have near it."""
_PERIODS = 2.0
_MOST_SLOPE = 1e5
_NEIGHBOUR = 1e-9
"""Relative difference of the velocities of a neighbour, by which a start's own sensitivity is measured."""
_PLACES = (0.1, 0.2, 0.3, 0.4, 0.5)
_MOST_MODES = 48
"""Lowest modes that take part: the tension hardly couples the others, and the step found is the same."""
_KEPT: OrderedDict[tuple[str, int, float], float] = OrderedDict()
_MOST_KEPT = 4096


def flight_step(model: ReducedModel, order: int, limit: float) -> float:
    """The longest step in free flight, s, that serves a structure.

    Parameters
    ----------
    model : ReducedModel
    order : int
        Of the composition.
    limit : float
        Greatest error of a displacement, over the buckling level, after two periods of the first mode; where the
        start is sensitive, that many times the displacement's relative slope along the velocity at the start.
    """
    period = 1.0 / model.reference_frequency
    if model.nonlinear_stiffness == 0.0 or not model.tension_matrix.any():
        return period / _FEWEST  # nothing but linear modes, whose flow is exact
    structure = structure_of(model, "below")
    key = (structure.hash, order, limit)
    if key not in _KEPT:
        _KEPT[key] = period / _Bench(structure, order).fewest(limit)
        if structure.uneven is not None:
            _KEPT[key] = min(_KEPT[key], period / _Bench(structure, order, far=True).fewest(limit))
        while len(_KEPT) > _MOST_KEPT:
            _KEPT.popitem(last=False)
    return _KEPT[key]


class _Bench:
    """The structure, let go."""

    def __init__(self, structure: Structure, order: int, far: bool = False) -> None:
        model = structure.model
        self.structure = structure
        self.order = order
        self.period = 1.0 / model.reference_frequency
        length = model.length_scale or 1.0
        shapes = [model.shape_at(x) for x in _PLACES] if model.beam is not None else [model.midspan_shape]
        if model.contact_shape is not None:
            shapes.append(model.contact_shape)
        kernel_output = slice(0, _MOST_MODES)
        self.omega, self.damping = (
            structure.omega[kernel_output],
            (structure.damping_ratio * structure.omega)[kernel_output],
        )
        self.columns = np.array(structure.coupling[kernel_output, kernel_output].T, order="C")
        self.well = structure.well[kernel_output]
        self.rest = self.force = np.zeros(self.omega.size)
        if (
            far and structure.uneven is not None
        ):  # about the mirror image of the first well, at rest in the second
            self.well = -self.well
            self.rest, self.force = (
                structure.uneven.second[kernel_output],
                structure.uneven.force[kernel_output],
            )
        self.rows = (np.array(shapes) @ model.linear_modes)[:, kernel_output] / length
        if model.beam is not None:
            struck = model.shape_at(_STRUCK)
        else:
            struck = model.midspan_shape if model.contact_shape is None else model.contact_shape
        blow = (struck @ model.linear_modes)[kernel_output]
        if not blow.any():
            blow = np.ones(self.omega.size)
        if structure.uneven is not None and model.landscape is not None:
            barrier = model.saddle_energy - model.landscape.deepest.energy
        elif model.is_bistable:
            straight, well = np.zeros(model.modes), structure.equilibrium
            barrier = float(model.potential_energy(straight) - model.potential_energy(well))
        else:
            barrier = 0.5 * (2.0 * math.pi * model.reference_frequency / np.abs(self.rows[:, 0]).max()) ** 2
        self.starts = []
        for energy, duration, *_ in _STARTS:
            # the spectrum of a pulse falls off beyond the inverse of what it lasts
            velocity = blow / (1.0 + (self.omega * duration * self.period / math.pi) ** 2)
            self.starts.append(velocity * math.sqrt(2.0 * energy * barrier / (velocity @ velocity)))

    def ends(self, velocity: _Array, counts: _Array, order: int) -> _Array:
        """Displacements at the end, with each number of steps, over the length that normalises.

        Shape (counts, places).
        """
        composition, damping = COMPOSITIONS[order], self.damping
        steps = _PERIODS * self.period / counts
        time = np.multiply.outer(steps, composition.flow)[:, :, None]
        # the flow of q' = p, p' = -omega^2 q - 2 zeta omega p, whichever way the mode is damped
        root = np.sqrt((self.omega**2 - damping**2).astype(np.complex128))
        sine = np.where(root == 0.0, time, np.sin(root * time) / np.where(root == 0.0, 1.0, root)).real
        cosine, decay = np.cos(root * time).real, np.exp(-damping * time)
        flows = np.stack(
            [
                decay * (cosine + damping * sine),
                decay * sine,
                -decay * self.omega**2 * sine,
                decay * (cosine - damping * sine),
            ],
            axis=2,
        )
        kicks = np.multiply.outer(steps, composition.kick)
        out, work = np.empty((counts.size, self.omega.size)), np.empty((3, self.omega.size))
        whole, gamma = counts.astype(np.int64), self.structure.nonlinear_stiffness
        kernel(_march, ())(
            whole,
            flows,
            kicks,
            self.columns,
            self.well,
            gamma,
            np.stack((self.rest, velocity, self.force)),
            work,
            out,
        )
        return out @ self.rows.T

    def fewest(self, limit: float) -> float:
        """Fewest flight steps per period that serve, and still do with a few more of them."""
        lowest = _FEWEST
        while lowest < _MOST:
            counts = lowest * 2.0 ** (np.arange(_PER_OCTAVE + 2 * _MARGIN + 1) / _PER_OCTAVE)
            serves = self._errors(counts) <= limit
            for first in range(_PER_OCTAVE + 1):
                if serves[first : first + 2 * _MARGIN + 1].all():
                    return float(counts[first + _MARGIN])
            lowest *= 2.0
        return float(counts[-1])

    def _errors(self, counts: _Array) -> _Array:
        """Greatest error of each number of flight steps, over what each start is allowed."""
        worst = np.zeros(counts.size)
        for velocity, (_, _, longer, share) in zip(self.starts, _STARTS, strict=True):
            own = np.ceil(_PERIODS * counts / longer)
            finest = np.ceil(_FINER * own[-1:])
            with np.errstate(all="ignore"):
                best = self.ends(velocity, finest, 6)
                beside = self.ends((1.0 + _NEIGHBOUR) * velocity, finest, 6)
                slope = min(max(1.0, float(np.abs(beside - best).max()) / _NEIGHBOUR), _MOST_SLOPE)
                difference = np.abs(self.ends(velocity, own, self.order) - best).max(axis=1) / (share * slope)
            worst = np.maximum(worst, np.where(np.isfinite(difference), difference, np.inf))
        return worst


def _march(counts, flows, kicks, columns, well, gamma, start, work, out):
    # r = G q column by column: every sum keeps its order, and nothing waits for the sum before
    modes = well.size
    last = kicks.shape[1] - 1
    q, p, r = work[0], work[1], work[2]
    for run in range(counts.size):
        for i in range(modes):
            q[i], p[i] = start[0, i], start[1, i]
        for step in range(counts[run]):
            for stage in range(last + 1):
                weight = kicks[run, stage]
                if stage == last and step < counts[run] - 1:
                    weight += kicks[run, 0]
                if stage > 0 or step == 0:
                    along_well, along = 0.0, 0.0
                    for i in range(modes):
                        r[i] = 0.0
                    for j in range(modes):
                        along_mode = q[j]
                        for i in range(modes):
                            r[i] += columns[j, i] * along_mode
                    for i in range(modes):
                        along += r[i] * q[i]
                        along_well += well[i] * q[i]
                    toward, back = -gamma * along * weight, -gamma * (2.0 * along_well + along) * weight
                    for i in range(modes):
                        p[i] += toward * well[i] + back * r[i]
                        p[i] += weight * start[2, i]
                if stage < last:
                    for i in range(modes):
                        turned = flows[run, stage, 0, i] * q[i] + flows[run, stage, 1, i] * p[i]
                        p[i] = flows[run, stage, 2, i] * q[i] + flows[run, stage, 3, i] * p[i]
                        q[i] = turned
        for i in range(modes):
            out[run, i] = q[i]
