"""Axes of pictures over any parameter: labels, and spacing of the points."""

from __future__ import annotations

import textwrap
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axis import Axis
from matplotlib.ticker import FuncFormatter
from numpy.typing import NDArray

from snapbeam.model.parameters import PHYSICAL, Parameter, lookup
from snapbeam.plot.style import cell_edges
from snapbeam.util.validation import InputError

if TYPE_CHECKING:
    import xarray as xr

_Array = NDArray[np.float64]

AXIS_LABELS = {
    "frequency_ratio": r"Excitation frequency $\Omega$",
    "location": r"Striker location $x_\mathrm{s}$",
    "velocity_amplitude": r"Velocity amplitude $V$",
    "modes": r"Number of modes $N$",
}
"""Labels of the paper's own axes; those of the others are in the table of parameters."""
_LONGEST = 44
"""Characters of a line along an axis of a picture of one column."""
_SMALL, _LARGE = 0.01, 1e4
"""Between these the maximum number along an axis is shown as it is."""
_PREFIXES = {
    "m": ((-3, "m"), (-6, "µ")),
    "Pa": ((9, "G"), (6, "M"), (3, "k")),
    "s": ((-3, "m"), (-6, "µ")),
    "N": ((-3, "m"), (-6, "µ"), (-9, "n")),
    "Hz": ((6, "M"), (3, "k")),
    "ohm": ((6, "M"), (3, "k")),
}
"""Powers of ten, from great to small, that have a prefix before a unit."""
_DECADES = 10.0
"""Ratio of the maximum to the minimum above which geometric points have a logarithmic axis."""


def axis_label(dataset: xr.Dataset, name: str) -> str:
    """Label of an axis: long name, symbol and unit of the parameter, wrapped to fit."""
    if name in AXIS_LABELS:
        return AXIS_LABELS[name]
    row = _parameter(dataset, name)
    if row is not None:
        text = row.label
    else:
        labels = dataset[name].attrs if name in dataset.coords else {}
        unit = labels.get("units", "1")
        text = f"{labels.get('long_name', name)}{'' if unit == '1' else f' ({unit})'}"
    power, unit = _power(dataset, name)
    if power:
        text = f"{text.rpartition(' (')[0] or text} ({unit})"
    return textwrap.fill(text, _LONGEST, break_long_words=False)


def in_units(dataset: xr.Dataset) -> xr.Dataset:
    """The dataset with its axes in the physical units in which they were given, and those of a base's motion always.

    The paper's own plane keeps its ratios unless it was given in physical units.
    """
    for dim in map(str, dataset.dims):
        given = [
            str(name)
            for name, each in dataset.coords.items()
            if each.dims == (dim,) and name != dim and each.attrs.get("parameter") in PHYSICAL
        ]
        if given and dataset.sizes[dim] > 1:
            dataset = dataset.swap_dims({dim: given[0]})
    frequency, length = (dataset.attrs.get(each) for each in ("reference_frequency", "length_scale"))
    if frequency is None or length is None:
        return dataset
    rows = {
        row.parameter: (name, row) for name, row in PHYSICAL.items() if name.startswith("base_excitation.")
    }
    for dim in map(str, dataset.dims):
        found = (
            rows.get(dataset[dim].attrs.get("parameter", ""))
            if dim in dataset.coords and dataset.sizes[dim] > 1
            else None
        )
        if found is not None:
            name, row = found
            unit = row.unit_of(float(length), 2.0 * np.pi * float(frequency))
            words = f"{row.words[:1].upper()}{row.words[1:]}"
            attrs = {"units": row.unit, "long_name": words, "parameter": name}
            dataset = dataset.assign_coords({dim: (dim, dataset[dim].values * unit, attrs)})
    return dataset


def _power(dataset: xr.Dataset, name: str) -> tuple[int, str]:
    """The power of ten that numbers along an axis are counted in, so that ticks are short, and the unit that makes."""
    points, words = positions(dataset, name)
    most = float(np.abs(points).max())
    if (
        words is not None
        or name in AXIS_LABELS
        or is_geometric(points)
        or most == 0.0
        or _SMALL <= most < _LARGE
    ):
        return 0, ""
    row = _parameter(dataset, name)
    unit = "1" if row is None else row.quantity.unit
    for power, prefix in _PREFIXES.get(unit, ()):
        if most >= 0.01 * 10.0**power:
            return power, f"{prefix}{unit}"
    power = int(np.floor(np.log10(most)))
    return power, f"10$^{{{power}}}${'' if unit == '1' else f' {unit}'}"


def symbol_of(dataset: xr.Dataset, name: str) -> str:
    """The symbol of an axis, or its name."""
    row = _parameter(dataset, name)
    return name if row is None or not row.quantity.symbol else f"${row.quantity.symbol}$"


def _parameter(dataset: xr.Dataset, name: str) -> Parameter | None:
    """The row of the table for an axis, by its attribute, or for a fixed parameter, by the name in the dataset."""
    full = dataset[name].attrs.get("parameter", name) if name in dataset.coords else name
    try:
        return lookup(str(full))
    except InputError:
        return None


def positions(dataset: xr.Dataset, name: str) -> tuple[_Array, list[str] | None]:
    """Coordinates of the points of an axis; words and integers are equally spaced, with their names."""
    values = np.asarray(dataset[name].values)
    if values.dtype.kind in "fc":
        return values.astype(np.float64), None
    return np.arange(values.size, dtype=np.float64), [str(value) for value in values]


def is_geometric(points: _Array) -> bool:
    """Return whether points form a geometric sequence over a decade or more."""
    if points.size < 3 or points[0] <= 0.0 or points[-1] < _DECADES * points[0]:
        return False
    factors = points[1:] / points[:-1]
    return bool(np.allclose(factors, factors[0], rtol=1e-6))


def edges_of(dataset: xr.Dataset, name: str) -> _Array:
    """Borders of the cells about the points of an axis: midway, or midway between powers."""
    points, words = positions(dataset, name)
    if words is not None:
        return cell_edges(points)
    if is_geometric(points):
        edges: _Array = np.exp(cell_edges(np.log(points)))
        return edges
    return cell_edges(points, 0.0 if points[0] >= 0.0 else -np.inf, 1.0 if name == "location" else np.inf)


def dress(axis: Axis, dataset: xr.Dataset, name: str) -> None:
    """Label an axis, and give it a scale and ticks that suit its points."""
    points, words = positions(dataset, name)
    axis.set_label_text(axis_label(dataset, name))
    if words is not None:
        axis.set_ticks(points.tolist(), words)
    elif is_geometric(points):
        set_scale = axis.axes.set_xscale if axis.axis_name == "x" else axis.axes.set_yscale  # type: ignore[attr-defined]
        set_scale("log")
    power, _ = _power(dataset, name)
    if power:
        axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value / 10.0**power:.6g}"))
