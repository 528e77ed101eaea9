"""Where runs begin: at rest in a well, or anywhere, named in numbers that people use."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any

import numpy as np

from snapbeam.core.validate import InputError, finite_array, integer
from snapbeam.model.galerkin.reduction import ReducedModel
from snapbeam.model.state import State
from snapbeam.model.striker import Striker

__all__ = ["START_NAME", "amplitude_scale", "rest_state", "started"]

START_NAME = re.compile(r"(amplitude|velocity)\[([1-9][0-9]{0,3})\]")
"""Names of the parameters of a start, after ``start.``: ``amplitude[1]``, ``velocity[3]``."""


def amplitude_scale(model: ReducedModel) -> float:
    """What amplitudes of a start are counted in, m^0.5: the first amplitude in a well, or, of a structure
    with one well, what moves the centre by the length scale."""
    well = float(np.sqrt(model.well_amplitude @ model.well_amplitude))
    if well > 0.0:
        return well
    return float(model.length_scale or 1.0) / float(np.abs(model.midspan_shape).max())


def rest_state(model: ReducedModel, striker: Striker | None = None) -> State:
    """At rest in the well that the striker pushes away from, and touched by it."""
    if striker is not None and striker.side == "above":
        return State(amplitude=-model.mirrored.equilibrium)
    return State(amplitude=model.well_amplitude)


def started(
    model: ReducedModel, striker: Striker | None, start: State | None, values: Mapping[str, Any]
) -> State:
    """A start with some of its numbers changed.

    ``amplitude[i]`` is the amplitude of buckling mode i over that of the well (-1 for i = 1: the lower well),
    ``velocity[i]`` its velocity over the same times omega_1, ``striker_position`` the mid-position of the tip
    in space, m, ``phase`` that of the drive, rad.  Arrays of one length make a batch.
    """
    state = rest_state(model, striker) if start is None else start
    columns = {name: finite_array(f"start.{name}", value) for name, value in values.items()}
    batch = np.broadcast_shapes(state.batch, *(column.shape for column in columns.values()))
    amplitude = np.array(np.broadcast_to(state.amplitude, (*batch, model.modes)))
    velocity = np.array(np.broadcast_to(state.velocity, (*batch, model.modes)))
    parts: dict[str, Any] = {"phase": state.phase, "striker_position": state.striker_position}
    scale = amplitude_scale(model)
    for name, column in columns.items():
        found = START_NAME.fullmatch(name)
        if found is None and name not in parts:
            raise InputError(
                f"start.{name}: no parameter of a start; must be amplitude[i], velocity[i], phase or striker_position"
            )
        if found is None:
            parts[name] = column
            continue
        mode = integer(f"start.{name}: mode", int(found[2]), 1, model.modes) - 1
        if found[1] == "amplitude":
            amplitude[..., mode] = column * scale
        else:
            velocity[..., mode] = column * scale * 2.0 * np.pi * model.reference_frequency
    return State(amplitude=amplitude, velocity=velocity, **parts)
