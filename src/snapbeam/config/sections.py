"""The sections of a parameter file: names, kinds, units and the size a number may have."""

from __future__ import annotations

import math
from typing import Any, Self

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, ValidationInfo, field_validator, model_validator

from snapbeam.config.axes import Axis, parse_axis
from snapbeam.core.validate import integer, positive, within
from snapbeam.model.beam import Beam
from snapbeam.model.contact import HertzContact
from snapbeam.model.drive import Shaker
from snapbeam.model.modes import MAX_MODES
from snapbeam.model.paper_values import BEAM, CONTACT, CYCLES, DAMPING_RATIO, LOCATION, MODES

__all__ = [
    "BeamSection",
    "Config",
    "ContactSection",
    "MapSection",
    "ModelSection",
    "RunSection",
    "ShakerSection",
    "units_of",
]

Window = tuple[float, float, str]

_RANGES = {
    "frequency_ratio": (0.0, math.inf, "neither"),
    "velocity_amplitude": (0.0, math.inf, "left"),
    "location": (0.0, 1.0, "neither"),
}


def _quantity(default: Any, description: str, units: str = "", window: Window | None = None) -> Any:
    """A field with its unit and a *window*: the sizes it may have, and the unit that is meant outside."""
    extra: dict[str, Any] = {"units": units, "window": window}
    return Field(default, description=description, json_schema_extra=extra)


def _extra(model: type[BaseModel], name: str) -> dict[str, Any]:
    field = model.model_fields.get(name)
    extra = field.json_schema_extra if field is not None else None
    return extra if isinstance(extra, dict) else {}


def units_of(model: type[BaseModel], name: str) -> str:
    """Return the unit of a key of a section, empty if it has none."""
    return str(_extra(model, name).get("units", ""))


class _Section(BaseModel):
    model_config = ConfigDict(extra="forbid", strict=True, frozen=True, allow_inf_nan=False)

    @field_validator("*", mode="after")
    @classmethod
    def _plausible(cls, value: Any, info: ValidationInfo) -> Any:
        extra = _extra(cls, info.field_name or "")
        window = extra.get("window")
        if window and isinstance(value, float) and value != 0.0 and not window[0] <= abs(value) <= window[1]:
            allowed = f"{window[0]:g} to {window[1]:g} {extra['units']}".rstrip()
            raise ValueError(f"must be {allowed}; is it given in {window[2]}?")
        return value


class BeamSection(_Section):
    """The beam; of ``buckling_level`` and ``axial_load`` at most one is given."""

    length: float = _quantity(BEAM.length, "distance between the clamps", "m", (1e-6, 100.0, "mm"))
    thickness: float = _quantity(BEAM.thickness, "in the direction of bending", "m", (1e-9, 1.0, "mm"))
    width: float = _quantity(BEAM.width, "of the section", "m", (1e-9, 10.0, "mm"))
    density: float = _quantity(BEAM.density, "mass density", "kg/m^3", (10.0, 3e4, "g/cm^3"))
    young_modulus: float = _quantity(BEAM.young_modulus, "Young's modulus", "Pa", (1e3, 2e12, "GPa"))
    buckling_level: float | None = _quantity(None, "height at the centre", "m", (1e-12, 10.0, "mm"))
    axial_load: float | None = _quantity(None, "compression positive", "N")

    @model_validator(mode="after")
    def _one_beam(self) -> Self:
        beam = self.build()
        for name in ("thickness", "width", "buckling_level"):
            value = getattr(self, name)
            if value is not None and value >= beam.length:
                raise ValueError(
                    f"{name} = {value:g} m: must be less than length = {beam.length:g} m; is it given in mm?"
                )
        return self

    def build(self) -> Beam:
        """Return the beam; with neither buckling level nor load it has the paper's buckling level."""
        values = self.model_dump(exclude_none=True)
        if self.axial_load is None and self.buckling_level is None:
            values["buckling_level"] = BEAM.buckling_level
        return Beam(**values)


class ModelSection(_Section):
    """The reduced model."""

    modes: int = _quantity(MODES, "number of buckling modes")
    damping_ratio: float = _quantity(DAMPING_RATIO, "of every linear mode", "", (0.0, 1.0, "percent"))

    @model_validator(mode="after")
    def _reducible(self) -> Self:
        integer("modes", self.modes, 1, MAX_MODES)
        within("damping_ratio", self.damping_ratio, 0.0, 1.0, closed="left")
        return self


class ContactSection(_Section):
    """Hertz's contact: its stiffness, or the sphere and the materials it follows from."""

    stiffness: float | None = _quantity(None, "contact stiffness", "N/m^1.5", (1.0, 1e15, "N/mm^1.5"))
    radius: float | None = _quantity(None, "radius of the sphere", "m", (1e-9, 10.0, "mm"))
    young_modulus: list[float] | None = _quantity(None, "Young's moduli of sphere and beam", "Pa")
    poisson_ratio: list[float] | None = _quantity(None, "Poisson ratios of sphere and beam")

    @model_validator(mode="after")
    def _one_contact(self) -> Self:
        materials = (self.radius, self.young_modulus, self.poisson_ratio)
        given = sum(value is not None for value in materials)
        if self.stiffness is not None and given:
            raise ValueError("give stiffness, or radius, young_modulus and poisson_ratio, not both")
        if 0 < given < 3:
            raise ValueError("radius, young_modulus and poisson_ratio belong together; one is missing")
        if self.young_modulus is not None and any(0.0 < value < 1e3 for value in self.young_modulus):
            raise ValueError(f"young_modulus = {self.young_modulus!r}: must be in Pa; is it given in GPa?")
        self.build()
        return self

    def build(self) -> HertzContact:
        """Return the contact; the paper's stiffness if nothing is given."""
        if self.radius is not None and self.young_modulus is not None and self.poisson_ratio is not None:
            moduli, ratios = tuple(self.young_modulus), tuple(self.poisson_ratio)
            return HertzContact.from_materials(self.radius, moduli, ratios)  # type: ignore[arg-type]
        return CONTACT if self.stiffness is None else HertzContact(stiffness=self.stiffness)


class ShakerSection(_Section):
    """The shaker of a single run."""

    frequency_ratio: float = _quantity(1.21, "excitation frequency over the first natural frequency")
    velocity_amplitude: float = _quantity(0.18, "velocity amplitude over b omega_1")
    location: float = _quantity(LOCATION, "position over the length", "", (0.0, 1.0, "m or percent"))
    side: str = _quantity("below", "side the shaker pushes from, 'below' or 'above'")

    @model_validator(mode="after")
    def _one_shaker(self) -> Self:
        self.build()
        return self

    def build(self) -> Shaker:
        """Return the shaker."""
        return Shaker(**self.model_dump())


class MapSection(_Section):
    """The axes of a map: each a number, a list of numbers or ``"start:stop:count"``."""

    frequency_ratio: float | str | list[float] = _quantity("0.1:4:64", "a number or an axis")
    velocity_amplitude: float | str | list[float] = _quantity("0.01:0.65:40", "a number or an axis")
    location: float | str | list[float] = _quantity(LOCATION, "a number or an axis")

    @field_validator("*", mode="before")
    @classmethod
    def _readable(cls, value: Any, info: ValidationInfo) -> Any:
        name = info.field_name or "axis"
        points = np.atleast_1d(parse_axis(name, value))
        low, high, closed = _RANGES[name]
        for point in (points[0], points[-1]):
            within(name, float(point), low, high, closed=closed)
        return value

    def axes(self) -> dict[str, Axis]:
        """Return each axis as a number or an array, by name."""
        return {name: parse_axis(name, getattr(self, name)) for name in type(self).model_fields}


class RunSection(_Section):
    """How long and how finely a run is integrated; what is left out follows from the model."""

    cycles: int = _quantity(CYCLES, "cycles of excitation")
    reference_freq: float | None = _quantity(None, "frequency that normalises Omega and V", "Hz")
    step: float | None = _quantity(None, "time step", "s")
    accuracy: str | None = _quantity(None, "of the integration, 'map' or 'reference'")
    engine: str | None = _quantity(None, "what integrates")
    early_decision: bool | None = _quantity(None, "end a run once its response class is certain")

    @model_validator(mode="after")
    def _runnable(self) -> Self:
        integer("cycles", self.cycles, 1)
        for name in ("reference_freq", "step"):
            if getattr(self, name) is not None:
                positive(name, getattr(self, name), units_of(type(self), name))
        return self


class Config(_Section):
    """All parameters of a computation, section by section; the paper's where nothing is given."""

    beam: BeamSection = BeamSection()
    model: ModelSection = ModelSection()
    contact: ContactSection = ContactSection()
    shaker: ShakerSection = ShakerSection()
    map: MapSection = MapSection()
    run: RunSection = RunSection()
