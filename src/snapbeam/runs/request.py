"""What is asked of a run, in the words of a system and an integration, or of version 0.1."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from snapbeam.core.validate import InputError, InputTypeError, finite_array, positive, shown
from snapbeam.model.contact import ContactLaw
from snapbeam.model.drive import Sine
from snapbeam.model.galerkin.reduction import ReducedModel
from snapbeam.model.integration import Integration
from snapbeam.model.state import State
from snapbeam.model.striker import RecordedDrive, Shaker, Striker
from snapbeam.model.system import System

__all__ = ["asked", "cycle_of", "require_motion", "system_of"]

_OPTIONS = ("step", "tolerance", "accuracy", "engine", "early_decision", "threads", "max_steps")


def asked(model: Any, parts: tuple[Any, ...], options: dict[str, Any]) -> tuple[System, Integration]:
    """A system and an integration, however they were given.

    Raises
    ------
    InputError
        For bad input, and for a system in which nothing could move.
    """
    if isinstance(model, System):
        system, integration = model, integration_of(parts, options)
    else:
        system, integration = system_of(model, *parts, **options)
    require_motion(system)
    return system, integration


def require_motion(system: System) -> None:
    """Refuse a system in which nothing could move."""
    if system.striker is None and system.start is None:
        raise InputError(
            "striker = None: a beam that nothing strikes needs a start to move from (initial_state)"
        )


def system_of(
    model: ReducedModel,
    shaker: Striker | Shaker | RecordedDrive | None = None,
    contact: ContactLaw | None = None,
    cycles: int | None = None,
    *,
    initial_state: tuple[ArrayLike, ArrayLike] | None = None,
    reference_freq: float | None = None,
    **options: Any,
) -> tuple[System, Integration]:
    """What version 0.1 took as parts and options, as a system and an integration."""
    if not isinstance(model, ReducedModel):
        raise InputTypeError(f"model = {shown(model)}: must be a System or a ReducedModel")
    for name in options:
        if name not in _OPTIONS:
            raise InputTypeError(f"{name}: no parameter of a run; must be one of {', '.join(_OPTIONS)}")
    if reference_freq is not None:
        model = replace(model, given_reference_freq=positive("reference_freq", reference_freq, "Hz"))
    start = None if initial_state is None else _start_of(model, initial_state)
    system = System(model, contact if shaker is not None else None, shaker, start)  # type: ignore[arg-type]
    if shaker is None and contact is not None:
        System(model, contact)  # refuses a law that does not suit the model
    return system, Integration(cycles=cycles, **options)


def integration_of(parts: tuple[Any, ...], options: dict[str, Any]) -> Integration:
    given = [*parts, *(options.pop(name) for name in ("integration",) if name in options)]
    if options or len(given) > 1:
        raise InputTypeError(
            f"{', '.join(options) or 'arguments'}: with a System, what is left is one Integration, sample_times and "
            "progress"
        )
    integration = given[0] if given and given[0] is not None else Integration()
    if not isinstance(integration, Integration):
        raise InputTypeError(f"integration = {shown(integration)}: must be an Integration")
    return integration


def _start_of(model: ReducedModel, initial_state: tuple[ArrayLike, ArrayLike]) -> State:
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
    return State(amplitude=parts[0], velocity=parts[1])


def cycle_of(system: System) -> float:
    """Seconds of one cycle of excitation, or of the first mode where nothing strikes."""
    freq = system.model.reference_freq
    if system.striker is None:
        return 1.0 / freq
    drive = system.striker.drive
    if isinstance(drive, Sine):
        return 1.0 / (freq * drive.frequency_ratio)
    columns = {name: np.array([value]) for name, value in drive.values().items()} or {"": np.zeros(1)}
    return float(drive.cycle(columns, system.scale)[0])
