"""Labelled datasets of the results of dynamics."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from typing import TYPE_CHECKING, Any

from snapbeam.dynamics.flow import Flow
from snapbeam.dynamics.stroboscope import Stroboscope
from snapbeam.model.parameters import lookup, ratio_of
from snapbeam.simulation.simulate import given_attribute
from snapbeam.util.diagnostics import counting
from snapbeam.util.provenance import canonical_json

if TYPE_CHECKING:
    import xarray as xr

    from snapbeam.model.reduced_model import ReducedModel


def labelled(
    variables: Mapping[str, tuple[Any, Any, Any]],
    coords: Mapping[str, Any] | None = None,
    attrs: Mapping[str, Any] | None = None,
) -> xr.Dataset:
    """A dataset of variables, each with its dimensions, values and long name, or attributes; without a unit it is "1"."""
    from snapbeam.util.datasets import xr

    found = {
        name: (dims, values, {"units": "1", "long_name": words} if isinstance(words, str) else words)
        for name, (dims, values, words) in variables.items()
    }
    return xr.Dataset(found, coords, attrs)


def of_flow(
    flow: Flow,
    variables: Mapping[str, tuple[Any, Any, Any]],
    attrs: dict[str, Any],
    coords: dict[str, Any] | None = None,
    varied: Iterable[str] = (),
) -> xr.Dataset:
    """A dataset over the coordinates of a flow, with its parameters except those that are *varied*."""
    coords = {"coordinate": coordinate_names(flow)} | (coords or {})
    return labelled(variables, coords, fixed_parameters(flow, *varied) | attrs)


def multiplier_rows(values: Any, *dims: str) -> dict[str, tuple[Any, Any, Any]]:
    """Variables of Floquet multipliers, over some dimensions."""
    over = (*dims, "multiplier")
    parts = {"real": (values.real, "Floquet multiplier"), "imag": (values.imag, "its imaginary part")}
    return {f"multiplier_{part}": (over, each, words) for part, (each, words) in parts.items()}


def reported(
    progress: Callable[[int, int], object] | bool | None, what: str, noun: str
) -> Callable[[int, int], object]:
    """Function to which a tool reports ``(done, total)``, as :func:`counting`; it does nothing where no report is wanted."""
    return counting(progress, what, noun) or (lambda done, total: None)


def in_unit(unit: str, words: str) -> dict[str, str]:
    """Attributes of a variable."""
    return {"units": unit, "long_name": words}


def parameter_labels(flow: Flow, name: str) -> tuple[str, dict[str, str]]:
    """Name of a parameter in datasets, and its attributes."""
    if not isinstance(flow, Stroboscope):
        return name, in_unit("1", name)
    row = flow.system.parameter(name)
    return row.short, in_unit(row.quantity.unit, row.quantity.long_name)


def coordinate_names(flow: Flow) -> list[str]:
    """Names of the coordinates of a flow."""
    return list(getattr(flow, "names", (f"x[{i + 1}]" for i in range(flow.dimension))))


def beam_attributes(model: ReducedModel) -> dict[str, float]:
    """Dimensions of the beam that a figure states; none of a model of matrices."""
    names = ("length", "thickness", "buckling_level") if model.beam is not None else ()
    return {f"beam_{name}": float(getattr(model.beam, name)) for name in names}


def fixed_parameters(flow: Flow, *varied: str) -> dict[str, Any]:
    """Return the parameters that a figure states: beam, modes, excitation and location, without the varied ones."""
    if not isinstance(flow, Stroboscope):
        return {}
    system, model = flow.system, flow.system.model
    attrs: dict[str, Any] = {
        "modes": model.modes,
        "length_scale": model.length_scale,
        "reference_frequency": model.reference_frequency,
        "system": canonical_json(system.to_mapping()),
    }
    attrs |= beam_attributes(model) | given_attribute(system)
    if system.primary_excitation is not None:
        section, drive = system.primary_excitation
        attrs |= {lookup(f"{section}.{name}").short: float(value) for name, value in drive.values().items()}
    if system.striker is not None:
        attrs["location"] = float(system.striker.location)
    shorts = {lookup(ratio_of(system.parameter(name).name)).short for name in varied}
    return {name: value for name, value in attrs.items() if name not in {*varied, *shorts}}
