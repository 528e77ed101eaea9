"""What a dataset can show over its parameters: its variables, and each entry of those that have one dimension more."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from snapbeam import STATISTICS, InputError, ResponseClass
from snapbeam.config import lookup

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["POINT", "Layer", "chances", "layers_of", "parameter_dims", "parameter_name"]

POINT = "point"
"""Dimension of a list of points."""
_ENTRIES = 12
"""Entries of one more dimension that are shown one by one: outcomes, wells, classes, numbers of cycles."""
_HIDDEN = ("status",)
_OF_0_1 = ("frequency_ratio", "velocity_amplitude", "location")
"""Axes of maps of version 0.1, which do not say what parameter they are."""


@dataclass(frozen=True)
class Layer:
    """One number a point: a variable, or one entry of it.

    Attributes
    ----------
    variable : str
    where : dict of str to int
        Which entry of its further dimension.
    words, unit : str
    shown : bool
        Whether it is offered; limits of intervals and statuses are told with their point alone.
    """

    variable: str
    where: dict[str, int]
    words: str
    unit: str
    shown: bool


def parameter_name(skeleton: xr.Dataset, name: str) -> str | None:
    """The dotted name of what a coordinate is of; None if it is no parameter."""
    if name not in skeleton.coords:
        return None
    said = skeleton[name].attrs.get("parameter", name if name in _OF_0_1 else "")
    try:
        return lookup(str(said)).name
    except InputError:
        return None


def parameter_dims(skeleton: xr.Dataset) -> list[str]:
    """The dimensions that are swept; one of them is ``point`` for a list."""
    names = [str(name) for name in skeleton.dims]
    if "response_class" in skeleton:
        names = [str(name) for name in skeleton["response_class"].dims]
    return [name for name in names if name == POINT or parameter_name(skeleton, name) is not None]


def layers_of(skeleton: xr.Dataset) -> dict[str, Layer]:
    """All that is known of a point, by name, the class first."""
    over = set(parameter_dims(skeleton))
    found: dict[str, Layer] = {}
    names = set(map(str, skeleton.data_vars))
    for name, item in skeleton.data_vars.items():
        if item.dtype.kind not in "biuf" or not over <= set(item.dims):
            continue
        further = [str(each) for each in item.dims if each not in over]
        words, unit = str(item.attrs.get("long_name", name)), str(item.attrs.get("units", "1"))
        limit = str(name).endswith(("_low", "_high")) and str(name).rpartition("_")[0] in names
        if not further:
            found[str(name)] = Layer(str(name), {}, words, unit, shown=not limit and str(name) not in _HIDDEN)
        elif len(further) == 1 and further[0] in skeleton.coords and item.sizes[further[0]] <= _ENTRIES:
            for at, entry in enumerate(skeleton[further[0]].values.tolist()):
                label = _entry(further[0], entry)
                found[f"{name}_{label.replace(' ', '_')}"] = Layer(
                    str(name), {further[0]: at}, f"{words}: {label}", unit, shown=not limit
                )
    order = list(STATISTICS)

    def place(name: str) -> tuple[bool, int, str]:
        # those of one of several strikers after those of all
        whole = name.partition("_striker_")[0] if name in STATISTICS else name
        return (
            name != "response_class",
            order.index(whole) if whole in order else -1,
            name if whole != name else "",
        )

    return dict(sorted(found.items(), key=lambda each: place(each[0])))


def _entry(dimension: str, value: Any) -> str:
    if dimension == "response_class":
        return ResponseClass(int(value)).label
    return f"{value:g}" if isinstance(value, float) else str(value)


def chances(layers: dict[str, Layer], held: dict[str, Any]) -> str:
    """Lifetimes and probabilities of a point in words, each with its interval; empty if there are none."""
    parts = []
    for name, layer in layers.items():
        low, high = (
            _partner(layers, layer, f"{layer.variable}_{ending}", held) for ending in ("low", "high")
        )
        if name not in held or low is None or high is None:
            continue
        value = held[name]
        if isinstance(value, float) and np.isnan(value) and np.isnan(low):
            continue
        parts.append(f"{layer.words} {_number(value)} ({_number(low)} to {_number(high)})")
    shares = {name: layer for name, layer in layers.items() if layer.variable == "class_fraction"}
    some = [
        f"{layer.words.rpartition(': ')[2]} {100.0 * held[name]:.0f} %"
        for name, layer in shares.items()
        if held.get(name, 0.0) > 0.0
    ]
    if some:
        parts.append(f"of its replicas: {', '.join(some)}")
    return "; ".join(parts)


def _partner(layers: dict[str, Layer], layer: Layer, variable: str, held: dict[str, Any]) -> Any:
    for name, each in layers.items():
        if each.variable == variable and each.where == layer.where:
            return held.get(name)
    return None


def _number(value: Any) -> str:
    return "∞" if value == np.inf else f"{value:.3g}" if isinstance(value, float) else str(value)
