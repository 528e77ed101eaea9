"""What is asked of one run, checked, and made into an ensemble of one for an engine."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from snapbeam.core.validate import InputError, InputTypeError, finite_array, flag, integer, positive
from snapbeam.engines.ensemble import Ensemble, Start, make_ensemble, with_recorded_drive
from snapbeam.engines.plan import Plan, plan_steps
from snapbeam.model.contact import HertzContact, Restitution
from snapbeam.model.drive import RecordedDrive, Shaker
from snapbeam.model.reduction import ReducedModel

__all__ = ["OneRun", "check_system", "one_run"]

_CYCLES = 200


@dataclass(frozen=True)
class OneRun:
    """A run that makes sense; how finely it is stepped is left open."""

    model: ReducedModel
    shaker: Shaker | RecordedDrive | None
    contact: HertzContact | Restitution | None
    """None without a shaker."""
    cycles: int | None
    start: Start | None
    early_decision: bool
    reference_freq: float
    """Hz."""

    @property
    def period(self) -> float:
        """Seconds of one cycle."""
        if isinstance(self.shaker, RecordedDrive):
            return 1.0 / self.shaker.frequency
        ratio = 1.0 if self.shaker is None else self.shaker.frequency_ratio
        return 1.0 / (self.reference_freq * ratio)

    @property
    def _drive(self) -> Shaker:
        if isinstance(self.shaker, Shaker):
            return self.shaker
        if self.shaker is None:
            # seen from the well the beam starts in, so that mirror images are mirrored to the bit
            assert self.start is not None
            side = "above" if float(self.start.alpha @ self.model.center_shape) > 0.0 else "below"
            return Shaker(frequency_ratio=1.0, velocity_amplitude=0.0, side=side)
        return Shaker(
            frequency_ratio=self.shaker.frequency / self.reference_freq,
            velocity_amplitude=0.0,
            location=self.shaker.location,
            side=self.shaker.side,
        )

    def plan(self, step: float | None = None, accuracy: str = "map") -> Plan:
        """The steps of a named level, or of a flight step in seconds."""
        return plan_steps(self.model, self.contact, step=step, accuracy=accuracy)

    def ensemble(self, plan: Plan) -> Ensemble:
        """This run, with these steps, for an engine."""
        drive = self._drive
        ensemble = make_ensemble(
            self.model,
            self.contact,
            plan,
            frequency_ratio=np.array([drive.frequency_ratio]),
            velocity_amplitude=np.array([drive.velocity_amplitude]),
            location=np.array([drive.location]),
            side=drive.side,
            cycles=self.cycles or _CYCLES,
            reference_freq=self.reference_freq,
            early_decision=self.early_decision,
            start=self.start,
        )
        if isinstance(self.shaker, RecordedDrive):
            return with_recorded_drive(ensemble, self.shaker, _recorded_duration(self.shaker, self.cycles))
        return ensemble


def one_run(
    model: ReducedModel,
    shaker: Shaker | RecordedDrive | None,
    contact: HertzContact | Restitution | None,
    cycles: int | None,
    initial_state: tuple[ArrayLike, ArrayLike] | None,
    early_decision: bool,
    reference_freq: float | None,
) -> OneRun:
    """Check what is asked of a run.

    Raises
    ------
    InputError
        For bad input.
    """
    check_system(model, contact, shaker)
    if cycles is not None:
        cycles = integer("cycles", cycles, 1, 10**7)
    start = None if initial_state is None else _checked_start(model, initial_state)
    if shaker is None and start is None:
        raise InputError("shaker = None: a beam that nothing strikes needs an initial_state to move")
    reference = model.reference_freq if reference_freq is None else positive("reference_freq", reference_freq)
    struck = contact if shaker is not None else None
    return OneRun(model, shaker, struck, cycles, start, flag("early_decision", early_decision), reference)


def _recorded_duration(drive: RecordedDrive, cycles: int | None) -> float:
    if cycles is None:
        return drive.duration
    if cycles / drive.frequency > drive.duration * (1.0 + 1e-9):
        held = drive.duration * drive.frequency
        raise InputError(f"cycles = {cycles}: must be at most the {held:.1f} cycles of the recorded drive")
    return min(cycles / drive.frequency, drive.duration)


def check_system(model: Any, contact: Any, shaker: Any = None) -> None:
    """Refuse what is no model, contact or shaker, and a model that cannot be struck."""
    if not isinstance(model, ReducedModel):
        raise InputTypeError(f"model = {model!r}: must be a ReducedModel")
    if shaker is not None and not isinstance(shaker, (Shaker, RecordedDrive)):
        raise InputTypeError(f"shaker = {shaker!r}: must be a Shaker or a RecordedDrive")
    if contact is not None and not isinstance(contact, (HertzContact, Restitution)):
        raise InputTypeError(f"contact = {contact!r}: must be a HertzContact or a Restitution")
    if isinstance(contact, Restitution) and model.modes != 1:
        raise InputError(
            f"contact = {contact!r} with modes = {model.modes}: Newton's law needs one mode, since the "
            "mass met by an impulse at a point falls to zero as modes are added; use a HertzContact"
        )
    if shaker is not None and contact is None:
        raise InputError("contact = None: a shaker needs a HertzContact")
    if model.length_scale is None:
        model.require_bistable("a run")


def _checked_start(model: ReducedModel, initial_state: tuple[ArrayLike, ArrayLike]) -> Start:
    try:
        alpha, velocity = initial_state
    except (TypeError, ValueError):
        raise InputTypeError("initial_state: must be a pair of arrays, amplitudes and velocities") from None
    parts = []
    for name, value in (("amplitudes", alpha), ("velocities", velocity)):
        array = finite_array(f"initial_state {name}", value, 1)
        if array.size != model.modes:
            raise InputError(f"initial_state {name} of shape {array.shape}: must have shape ({model.modes},)")
        parts.append(array)
    return Start(*parts)
