"""What an engine is asked for and what it answers: many runs of one structure, by arrays.

An engine is a function ``engine(ensemble, outputs_of, progress)``; :data:`snapbeam.engines.registry` names
them.  Nothing above this module knows how an engine steps.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from snapbeam.core.validate import InputError
from snapbeam.engines.columns import Reals, Ticks
from snapbeam.engines.cpu.memory import Packed, pack
from snapbeam.engines.plan import Plan
from snapbeam.model.contact import HertzContact, Restitution
from snapbeam.model.decision import decidable_energy
from snapbeam.model.drive import RecordedDrive
from snapbeam.model.reduction import ReducedModel

__all__ = ["Ensemble", "Start", "make_ensemble", "with_recorded_drive"]

_Array = NDArray[np.float64]
_SUBDIVISION = 1 << 20
"""Ticks of a flight step, so that halved steps and located events are whole numbers of ticks."""
_MOST_TICKS = 2.0**61
_RECORD_MARGIN = 1.5
"""Greatest speed of the cubic through a record over the greatest recorded one, at most."""
_FAR_AWAY = -1e30
"""Penetration, m, of a shaker that is not there."""


@dataclass(frozen=True)
class Ensemble:
    """Runs of one structure, one plan and one side, ready for an engine."""

    packed: Packed
    plan: Plan
    contact_rows: _Array
    """V^T phi of every location, shape (locations, rows)."""
    starts: _Array
    """q and p of every start, shape (starts, 2 rows)."""
    reals: _Array
    """Shape (runs, len(Reals))."""
    ticks: NDArray[np.int64]
    """Shape (runs, len(Ticks))."""
    max_steps: int
    restitution: bool
    """Whether the stiffness column is a coefficient of restitution: Newton's law of impact, one mode."""
    drive_table: _Array = field(default_factory=lambda: np.empty(0))
    """Displacement (m, from its start) and velocity (m/s) of a recorded drive, sample after sample."""
    drive_interval: float = 1.0
    """Seconds between those samples."""

    @property
    def size(self) -> int:
        """Number of runs."""
        return self.reals.shape[0]

    @property
    def first_side(self) -> NDArray[np.int64]:
        """-1 for a run that starts in the well away from which the shaker pushes, +1 for the other one."""
        layout = self.packed.layout
        center = self.packed.memory[layout.center : layout.center + layout.size]
        moved = (self.starts[:, : layout.size] @ center)[self.ticks[:, Ticks.START_ROW]]
        side: NDArray[np.int64] = np.where(self.reals[:, Reals.REST_CENTER] + moved > 0.0, 1, -1)
        return side

    @property
    def work(self) -> _Array:
        """Expected work of each run in flight steps, shape (runs,)."""
        return self.ticks[:, Ticks.END] / self.ticks[:, Ticks.STEP]


class Start(NamedTuple):
    """Amplitudes and their velocities at time zero, each of shape (N,)."""

    alpha: _Array
    velocity: _Array


def contact_parameter(contact: HertzContact | Restitution | None) -> float:
    """The one number of a law of impact: contact stiffness, coefficient of restitution, or 0 for none."""
    if contact is None:
        return 0.0
    return contact.coefficient if isinstance(contact, Restitution) else contact.stiffness


def whole_steps(period: _Array, step: float, cycles: int) -> NDArray[np.int64]:
    """Flight steps in each period, the step made a little shorter to fit.

    Raises
    ------
    InputError
        If a run has more steps than can be counted in ticks.
    """
    steps = np.ceil(period / step * (1.0 - 1e-12))
    most = float(steps.max()) * cycles
    if most > _MOST_TICKS / _SUBDIVISION:
        raise InputError(
            f"step = {step:g} s with cycles = {cycles} of up to {float(period.max()):g} s: makes {most:.2g} steps, "
            f"must be at most {_MOST_TICKS / _SUBDIVISION:.2g}"
        )
    whole: NDArray[np.int64] = steps.astype(np.int64)
    return whole


def make_ensemble(
    model: ReducedModel,
    contact: HertzContact | Restitution | None,
    plan: Plan,
    *,
    frequency_ratio: _Array,
    velocity_amplitude: _Array,
    location: _Array,
    side: str,
    cycles: int,
    reference_freq: float,
    early_decision: bool,
    start: Start | None = None,
    max_steps: int = 10**10,
) -> Ensemble:
    """Arrange runs, given by arrays of one length, for an engine.

    With ``contact`` None nothing strikes the beam, and *frequency_ratio* only sets what a cycle is.
    """
    packed = pack(model, side)
    sign = packed.sign
    scale = model.length_scale
    if scale is None:
        model.require_bistable("a run")
        raise InputError("length_scale is not known")
    if start is None:
        start = Start(packed.equilibrium, np.zeros(model.modes))
    q, p = packed.modal(start.alpha, start.velocity)
    places, which = np.unique(location, return_inverse=True)
    shapes = np.array([model.shape_at(float(x)) for x in places])
    rows = np.array([packed.row(shape) for shape in shapes])
    runs = frequency_ratio.size
    omega_1 = 2.0 * math.pi * reference_freq
    omega = frequency_ratio * omega_1
    period = 2.0 * math.pi / omega
    steps = whole_steps(period, plan.step, cycles)

    reals = np.zeros((runs, len(Reals)))
    reals[:, Reals.OFFSET] = (rows @ q)[which] if contact is not None else _FAR_AWAY
    reals[:, Reals.AMPLITUDE] = velocity_amplitude * scale * omega_1 / omega
    reals[:, Reals.OMEGA] = omega
    reals[:, Reals.STIFFNESS] = contact_parameter(contact)
    rest = sign * (shapes @ packed.equilibrium)[which]
    reals[:, Reals.REST_CONTACT] = rest
    reals[:, Reals.REST_CENTER] = sign * float(model.center_shape @ packed.equilibrium)
    ticks = np.zeros((runs, len(Ticks)), dtype=np.int64)
    ticks[:, Ticks.STEP] = _SUBDIVISION
    ticks[:, Ticks.PERIOD] = steps * _SUBDIVISION
    reals[:, Reals.TICK] = period / ticks[:, Ticks.PERIOD]
    ticks[:, Ticks.END] = ticks[:, Ticks.PERIOD] * cycles
    ticks[:, Ticks.LAST_QUARTER] = ticks[:, Ticks.END] // 4 * 3
    ticks[:, Ticks.CONTACT_ROW] = which
    ticks[:, Ticks.DECIDE_CROSSINGS] = -1
    reals[:, Reals.DECIDE_ENERGY] = -math.inf
    newton = isinstance(contact, Restitution)
    if early_decision and not newton:
        ticks[:, Ticks.DECIDE_CROSSINGS] = cycles // 20
        highest = rest + reals[:, Reals.OFFSET] + reals[:, Reals.AMPLITUDE]
        reals[:, Reals.DECIDE_REACH] = np.maximum(highest, 0.0)
        reals[:, Reals.DECIDE_ENERGY] = decidable_energy(model, location, highest)
    return Ensemble(packed, plan, rows, np.concatenate((q, p))[None], reals, ticks, max_steps, newton)


def with_recorded_drive(ensemble: Ensemble, drive: RecordedDrive, duration: float) -> Ensemble:
    """The ensemble of one run, driven by a record for *duration* seconds instead of by a sinusoid."""
    reals, ticks = ensemble.reals.copy(), ensemble.ticks.copy()
    steps = whole_steps(np.array([duration]), ensemble.plan.step, 1)
    ticks[:, Ticks.PERIOD] = ticks[:, Ticks.END] = steps * _SUBDIVISION
    ticks[:, Ticks.LAST_QUARTER] = ticks[:, Ticks.END] // 4 * 3
    ticks[:, Ticks.DECIDE_CROSSINGS] = -1
    reals[:, Reals.TICK] = duration / ticks[:, Ticks.PERIOD]
    reals[:, Reals.DECIDE_ENERGY] = -math.inf
    # the phase of a record is 2 pi t / duration; the amplitude only bounds its speed
    reals[:, Reals.OMEGA] = 2.0 * math.pi / duration
    sign = ensemble.packed.sign
    moved = sign * (drive.displacement - drive.displacement[0])
    reals[:, Reals.AMPLITUDE] = _RECORD_MARGIN * np.abs(drive.velocity).max() / reals[:, Reals.OMEGA]
    table = np.column_stack((moved, sign * drive.velocity)).ravel()
    return replace(
        ensemble, reals=reals, ticks=ticks, drive_table=table, drive_interval=1.0 / drive.sampling_freq
    )
