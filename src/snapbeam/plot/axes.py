"""Axes of pictures over any parameter: labels, and spacing of the points."""

from __future__ import annotations

import re
import textwrap
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axis import Axis
from matplotlib.ticker import FuncFormatter
from numpy.typing import NDArray

from snapbeam.model.parameters import Parameter, lookup
from snapbeam.plot.style import cell_edges
from snapbeam.util.si_prefixes import WITH_PREFIX, prefixed, scale_of
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
"""Between these the maximum number along an axis of a unit without prefixes is shown as it is."""
_PLAIN = {"um": "µm", "ohm": "Ω"}
"""Units of parameters as figures write them."""
_DECADES = 10.0
"""Ratio of the maximum to the minimum above which geometric points have a logarithmic axis."""


def wrapped(text: str, width: int) -> str:
    """Text in lines, the unit or scale in parentheses at its end beside the word before it."""
    held = re.sub(r"\S+ \([^()]*\)$", lambda found: found[0].replace(" ", "\xa0"), text)
    return textwrap.fill(held, width, break_long_words=False).replace("\xa0", " ")


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
    _, unit = _scaled(dataset, name)
    if unit:
        text = f"{text.rpartition(' (')[0] or text} ({unit})"
    return wrapped(text, _LONGEST)


def _scaled(dataset: xr.Dataset, name: str) -> tuple[float, str]:
    """The number that those along an axis are divided by, so that ticks are short, and the unit that makes."""
    row = _parameter(dataset, name)
    unit = "1" if row is None else row.quantity.unit
    own = 1.0, _PLAIN.get(unit, "")
    if name not in dataset.coords:
        return own
    points, words = positions(dataset, name)
    most = float(np.abs(points).max())
    if words is not None or name in AXIS_LABELS or is_geometric(points) or most == 0.0:
        return own
    if unit in WITH_PREFIX:
        return own if 1.0 <= most < _LARGE else scale_of(points, _PLAIN.get(unit, unit))
    if _SMALL <= most < (1e6 if unit == "g" else _LARGE):  # kg would be another unit
        return own
    power = int(np.floor(np.log10(most)))
    return 10.0**power, f"10$^{{{power}}}${'' if unit == '1' else f' {unit}'}"


def symbol_of(dataset: xr.Dataset, name: str) -> str:
    """The symbol of an axis; empty without one."""
    row = _parameter(dataset, name)
    return "" if row is None or not row.quantity.symbol else f"${row.quantity.symbol}$"


def tick_text(dataset: xr.Dataset, name: str, value: float, digits: int = 2) -> str:
    """A number along an axis in the unit of its label, such as ``5 kHz``."""
    divisor, unit = _scaled(dataset, name)
    row = _parameter(dataset, name)
    if not unit and row is not None and row.quantity.unit != "1":
        unit = row.quantity.unit
    if divisor == 1.0 and row is not None and row.quantity.unit in WITH_PREFIX and not 1.0 <= abs(value) < _LARGE:
        return prefixed(value, unit, digits)
    symbol = "" if unit else f" in {symbol_of(dataset, name)}".removesuffix(" in ")
    return f"{float(f'{value / divisor:.{digits}g}'):.6g} {unit}".rstrip() + symbol


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
    divisor, _ = _scaled(dataset, name)
    if divisor != 1.0:
        axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value / divisor:.6g}"))
