"""What makes two measured wells unequal."""

from __future__ import annotations

from typing import Any

from snapbeam.core.validate import InputError
from snapbeam.lab.calibration.measurements import Measurements
from snapbeam.model.beam import Beam
from snapbeam.model.galerkin.reduction import ReducedModel
from snapbeam.model.imperfection import Imperfection
from snapbeam.model.imperfection.fitted import identify_imperfection

__all__ = ["ends_section", "imperfection_section", "uneven_beam", "uneven_words"]

_UNITS = {"rise": "m", "point_load": "N", "uniform_load": "N/m"}


def uneven_beam(beam: Beam, measured: Measurements, kind: str, modes: int) -> ReducedModel:
    """The calibrated beam with the imperfection that gives each well its own first frequency.

    Of the beam, the buckling level alone changes: two numbers from two frequencies, see
    :func:`snapbeam.model.imperfection.fitted.identify_imperfection`.
    """
    both = {}
    for well in ("lower", "upper"):
        values, shapes = (
            getattr(measured, f"{well}_well_frequencies"),
            getattr(measured, f"{well}_well_shape"),
        )
        own = (
            [f for f, shape in zip(values, shapes, strict=True) if shape == "symmetric"] if shapes else values
        )
        if not own:
            raise InputError(
                f"imperfection = {kind!r}: needs the first frequency about both wells; the {well} one's is not given"
            )
        both[well] = float(own[0])
    return identify_imperfection(beam, both["lower"], both["upper"], kind, modes)


def uneven_words(kind: str, model: ReducedModel) -> str:
    """What was found, and what it does not say."""
    assert model.imperfection is not None and model.beam is not None
    value, level = getattr(model.imperfection, kind), model.beam.buckling_level * 1e3
    return (
        f"{kind} = {value:.4g} {_UNITS[kind]} with a buckling level of {level:.4g} mm gives each well "
        "its own first frequency; which kind of imperfection it is, two frequencies do not say"
    )


def imperfection_section(imperfection: Imperfection | None) -> dict[str, Any]:
    """What differs from a perfect beam, as the section of a parameter file."""
    if imperfection is None:
        return {}
    perfect = vars(Imperfection())
    return {name: value for name, value in vars(imperfection).items() if not _same(value, perfect[name])}


def ends_section(beam: Beam) -> dict[str, Any]:
    """Ends that are no clamps, as the section of a parameter file."""
    return {name: float(value) for name, value in vars(beam.boundary).items() if value is not None}


def _same(value: Any, other: Any) -> bool:
    return value is other or (isinstance(value, (int, float, str)) and value == other)
