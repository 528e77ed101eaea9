"""Axes and thresholds of a result in the physical units in which they were given; figures and printed texts use them."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping
from functools import cache
from typing import TYPE_CHECKING, Any

import numpy as np

from snapbeam.model.parameters import PHYSICAL, lookup
from snapbeam.util.si_prefixes import prefixed

if TYPE_CHECKING:
    import xarray as xr

_AMOUNTS = (
    "lower_threshold", "upper_threshold", "last_intrawell", "lower_threshold_min", "upper_threshold_max",
    "threshold", "threshold_low", "threshold_high",
)  # fmt: skip
"""Variables in the unit of the parameter that a threshold is of."""


def in_units(dataset: xr.Dataset) -> xr.Dataset:
    """The dataset with its axes and thresholds in the units in which they were given, those of a base's motion always.

    Axes of ratios that were given in physical units get these as their coordinate; the ratios remain beside them.  The
    paper's own plane keeps its ratios unless it was given in physical units.  A fixed ratio that was given in a physical
    unit has a coordinate in this unit beside it.
    """
    dataset = _with_motion_of_base(dataset)
    for full, value in given_in_units(dataset.attrs).items():
        ratio = lookup(PHYSICAL[full].parameter).short
        if ratio in dataset.coords and dataset[ratio].ndim == 0:
            dataset = dataset.assign_coords({lookup(full).short: ((), value, _labels(full))})
    names, known = {}, _by_short()
    for name, item in dataset.coords.items():
        parameter = known.get(str(name))
        if parameter is not None and item.ndim == 1 and name != item.dims[0]:
            ratio = lookup(PHYSICAL[parameter].parameter).short
            if ratio in dataset.coords and dataset[ratio].dims == item.dims:
                names[ratio] = str(name)
                dataset = dataset.assign_coords({name: (item.dims, item.values, _labels(parameter))})
    raised = str(dataset.attrs.get("parameter", ""))
    if raised in names and dataset[raised].dims == (raised,):
        dataset = _amounts_in_unit(dataset, raised, names[raised])
    return dataset.swap_dims({ratio: name for ratio, name in names.items() if ratio in dataset.dims})


def given_in_units(attrs: Mapping[Any, Any]) -> dict[str, float]:
    """Values of a whole result that were given in the physical units of ratios, by dotted name."""
    found = json.loads(attrs.get("as_given", "{}"))
    return {name: value for name, value in found.items() if name in PHYSICAL}


def _with_motion_of_base(dataset: xr.Dataset) -> xr.Dataset:
    """Add the motion of the base in physical units, where one frequency and one length hold for all points."""
    frequency, length = (dataset.attrs.get(each) for each in ("reference_frequency", "length_scale"))
    if frequency is None or length is None:
        return dataset
    for name, physical in PHYSICAL.items():
        if not name.startswith("base_excitation."):
            continue
        row, ratio = lookup(name), lookup(physical.parameter).short
        if ratio in dataset.coords and row.short not in dataset.coords and dataset[ratio].ndim == 1:
            unit = physical.unit_of(float(length), 2.0 * np.pi * float(frequency))
            values = dataset[ratio].values * unit
            dataset = dataset.assign_coords({row.short: (dataset[ratio].dims, values, _labels(name))})
    return dataset


@cache
def _by_short() -> dict[str, str]:
    """Dotted names of parameters in physical units by the names that datasets use."""
    return {lookup(name).short: name for name in PHYSICAL}


def _labels(name: str) -> dict[str, str]:
    """Attributes of the coordinate of a parameter in its physical unit."""
    return {"units": PHYSICAL[name].unit, "long_name": PHYSICAL[name].words, "parameter": name}


def _amounts_in_unit(dataset: xr.Dataset, ratio: str, name: str) -> xr.Dataset:
    """Put the thresholds of a parameter from ratios into the unit of the coordinate *name*."""
    unit = ratio_along(dataset, name)[1]
    old, row = lookup(ratio).quantity.long_name, lookup(str(dataset[name].attrs["parameter"])).quantity
    found = {}
    for each in (*_AMOUNTS, "bounds"):
        if each in dataset:
            words = str(dataset[each].attrs.get("long_name", each)).replace(old, row.long_name)
            labels = {**dataset[each].attrs, "units": row.unit, "long_name": words}
            values = np.vectorize(lambda value: float(f"{value * unit:.14g}"), otypes=[float])
            found[each] = (dataset[each].dims, values(dataset[each].values), labels)
    attrs = {**dataset.attrs, "parameter": name}
    if "bounds" in attrs:
        attrs["bounds"] = [float(each) * unit for each in np.ravel(attrs["bounds"])]
    return dataset.assign(found).assign_attrs(attrs)


def ratio_along(dataset: xr.Dataset, name: str) -> tuple[str, float]:
    """The ratio that an axis of :func:`in_units` stands for, and the value of a ratio of 1 in its unit; itself and 1 else."""
    parameter = dataset[name].attrs.get("parameter") if name in dataset.coords else None
    if parameter in PHYSICAL:
        ratio = lookup(PHYSICAL[parameter].parameter).short
        if ratio in dataset.coords and dataset[ratio].dims == dataset[name].dims:
            at = int(np.argmax(np.abs(dataset[ratio].values)))
            return ratio, float(dataset[name].values.flat[at] / dataset[ratio].values.flat[at])
    return name, 1.0


def ratio_name(name: str) -> str:
    """The name that datasets give the ratio of a parameter in its physical unit; the name itself for any other."""
    full = _by_short().get(name)
    return name if full is None else lookup(PHYSICAL[full].parameter).short


def in_symbols(words: str) -> str:
    """Words of a long name for a figure, with b and omega_1 as symbols."""
    words = re.sub(r",? over b(?!\w)", " over b", words)
    symbol = re.compile(r"(?<= over )b(?!\w)( omega_1(\^2)?)?|\bomega_1\b")
    return symbol.sub(lambda found: f"${found[0].replace(' ', '').replace('omega', chr(92) + 'omega')}$", words)


def scale_text(attrs: Mapping[Any, Any], words: str) -> str:
    """*words* with the length scale b behind them, as in ``w/b (b = 6 µm)``; as they are where it is not known."""
    names = ("length_scale", "beam_buckling_level", "fixed_beam_buckling_level")  # the last of designs
    scale = next((attrs[name] for name in names if attrs.get(name)), None)
    symbol = "$b$" if "$" in words else "b"
    return f"{words} ({symbol} = {prefixed(float(scale), 'm')})" if scale else words
