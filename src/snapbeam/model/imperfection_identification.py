"""The imperfection that explains two wells of unequal frequency."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np

from snapbeam.model.beam import Beam
from snapbeam.model.buckling_modes import MAX_MODES
from snapbeam.model.imperfection import Imperfection
from snapbeam.model.reduced_model import ReducedModel
from snapbeam.util.singular_values import lstsq
from snapbeam.util.validation import InputError, choice, instance, integer, positive

FITTED = ("midspan_amplitude", "point_load", "uniform_load")
_TOLERANCE = 1e-9
_TRIES = 60


def identify_imperfection(
    beam: Beam,
    lower_frequency: float,
    upper_frequency: float,
    kind: str = "midspan_amplitude",
    modes: int = 32,
    imperfection: Imperfection | None = None,
) -> ReducedModel:
    """The beam and the imperfection whose first frequencies about the two wells are those that were measured.

    Two unknowns, the buckling level (or the axial load) and one number of the imperfection, follow from two
    frequencies, which do not determine the type of imperfection.

    Parameters
    ----------
    beam : Beam
        Beam whose load is identified.
    lower_frequency, upper_frequency : float
        First natural frequency about the lower and about the upper well, Hz.
    kind : {"midspan_amplitude", "point_load", "uniform_load"}
        Type of the imperfection.
    modes : int
        Number of modes of the model.
    imperfection : Imperfection, optional
        Other known parts.

    Returns
    -------
    ReducedModel
        Model of the identified ``beam`` and ``imperfection``, with the given ``well_frequencies``.

    Raises
    ------
    InputError
        If no load and imperfection give these frequencies.

    See Also
    --------
    snapbeam.Imperfection, snapbeam.lab.calibrate
    """
    instance("beam", beam, Beam, "a Beam")
    wanted = np.array(
        [positive("lower_frequency", lower_frequency, "Hz"), positive("upper_frequency", upper_frequency, "Hz")]
    )
    choice("kind", kind, FITTED)
    modes = integer("modes", modes, 1, MAX_MODES)
    base = Imperfection() if imperfection is None else instance("imperfection", imperfection, Imperfection, "one")
    level = beam.buckling_level if beam.is_buckled else beam.thickness
    sizes = np.array([level, level if kind == "midspan_amplitude" else _load_size(beam, kind)])

    def model_at(at: Any) -> ReducedModel:
        own: dict[str, Any] = {kind: float(at[1] * sizes[1])}
        return ReducedModel.from_beam(
            beam.replace(buckling_level=float(at[0] * sizes[0])), modes, imperfection=dataclasses.replace(base, **own)
        )

    def residual(at: Any) -> Any:
        model = model_at(at)
        if not model.is_bistable:
            return None
        return model.well_frequencies[:, 0] / wanted - 1.0

    at = np.array([1.0, getattr(base, kind) / sizes[1]])
    # the mean of the two frequencies goes with the level, nearly, and their difference with the imperfection
    found = residual(at)
    for _ in range(_TRIES):
        if found is None or np.abs(found).max() < _TOLERANCE:
            break
        step = 1e-6
        columns = [residual(at + step * np.eye(2)[i]) for i in range(2)]
        if any(column is None for column in columns):
            break
        slope = (np.stack(columns, axis=1) - found[:, None]) / step
        if not np.isfinite(slope).all():
            break
        change = lstsq(slope, -found)
        change *= min(1.0, 0.3 / max(float(np.abs(change[0])), 10.0 * float(np.abs(change[1])), 1e-300))
        for _ in range(_TRIES):
            new = residual(at + change) if at[0] + change[0] > 0.0 else None
            if new is not None and np.abs(new).max() < np.abs(found).max():
                break
            change = 0.5 * change
        else:
            break
        at, found = at + change, new
    if found is None or not np.abs(found).max() < 1e-6:
        raise InputError(
            f"lower_frequency = {wanted[0]:g} Hz, upper_frequency = {wanted[1]:g} Hz: no load of this beam with a {kind} gives "
            "them; are thickness and length as measured?"
        )
    return model_at(at)


def _load_size(beam: Beam, kind: str) -> float:
    """A load of the size that bends the beam by its own height."""
    force = 200.0 * beam.bending_stiffness * max(beam.buckling_level, beam.thickness) / beam.length**3
    return force if kind == "point_load" else force / beam.length
