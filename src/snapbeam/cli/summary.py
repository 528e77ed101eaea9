"""Printed summaries of maps and runs."""

from __future__ import annotations

import re
import shlex
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from rich.console import Group, RenderableType
from rich.markup import escape
from rich.table import Table

from snapbeam.cli.console import duration, file_line
from snapbeam.cli.parameter_options import point_text
from snapbeam.model.parameters import lookup, parameters
from snapbeam.model.quantity import numbered, split_name
from snapbeam.plot.units import in_units, ratio_name, scale_text
from snapbeam.sweeps.seeds import mean_over_seeds, seed_axes
from snapbeam.util.si_prefixes import WITH_PREFIX, prefixed
from snapbeam.util.status_codes import ResponseClass, RunStatus, is_of_matrices, wells_of
from snapbeam.util.validation import InputError, printable

if TYPE_CHECKING:
    import xarray as xr

    from snapbeam.model.system import System

_SYMBOLS = {"frequency_ratio": "Omega", "velocity_amplitude": "V", "location": "x_s", "modes": "N"}
_PAPER = ("frequency_ratio", "velocity_amplitude", "location")


def map_summary(
    dataset: xr.Dataset, files: Sequence[Path], elapsed: float | None = None, variable: str | None = None
) -> RenderableType:
    """Return the classes, the lowest interwell amplitude, the highest statistic, failures, files and next commands.

    The amplitude is that of an axis of the map that drives the system.  The statistic is *variable*, or the power of a
    harvester.  For a beam with one well the range of the centre's displacement is added.
    """
    dataset = in_units(dataset)
    attrs = dataset.attrs
    runs = dataset["response_class"].size
    noun = "point" if "computed" in dataset or "class_fraction" in dataset else "run"
    head = f"{_count(runs, noun)} of {_modes(dataset)} over {_count(attrs.get('cycles', 0), 'cycle')}"
    if elapsed is not None:
        head += f" in {duration(elapsed)} ({runs / max(elapsed, 1e-9):.3g} runs/s)"
    lines = [head, *initial_well_lines(dataset)]
    low, response = lowest_interwell(dataset), dataset["response_class"]
    interwell = response.values >= _SNAPPED
    failed = _failed_below(dataset, low)
    one = wells_of(dataset.attrs) == 1
    point, lines_after = (
        low,
        _ranges(dataset, ("min_midspan_displacement", "max_midspan_displacement")) if one else [],
    )
    if not interwell.any():
        advice = f": raise the {raised}" if (raised := _strength_words(dataset)) else ""
        lines_after.append(f"No run snapped through{advice}.")
    elif low is not None and (name := _strength_axis(dataset)) is not None:
        lowest = (
            f"Lowest {_words(dataset, name)} with snap-through" if one else f"Lowest interwell {_words(dataset, name)}"
        )
        lines_after.append(f"{lowest}: {_where(dataset, low, name)}")
        notch = deepest_notch(dataset)
        if notch is not None:
            lines_after.append(f"Deepest notch of the threshold: {_where(dataset, notch, name)}")
            low = point = notch
    else:
        first = np.unravel_index(int(np.argmax(interwell)), interwell.shape)
        point = _point(response, dict(zip(response.dims, first, strict=True)), attrs)
    best = _highest(dataset, variable)
    if best is not None:
        point = best[0]
        lines_after.append(best[1])
    if failed:
        lines_after.append(
            f"{_count(failed, 'point')} of unknown response class may be interwell{' below it' if low else ''}."
        )
    lines_after += status_lines(dataset)
    lines_after += [f"Written: {file_line(path)}" for path in files]
    lines_after += ["Next:", *(f"  {line}" for line in _suggestions(dataset, files, point))]
    return Group(*lines, class_table(dataset), *lines_after)


def initial_well_lines(dataset: xr.Dataset) -> list[str]:
    """Return the line with the well that the runs begin in; none if it differs between the points."""
    well, reason = (dataset.attrs.get(name) for name in ("initial_well", "initial_well_reason"))
    if well is None:
        return []
    return [f"Runs begin in the {well if well[-1].isdigit() else f'{well} well'} ({reason})."]


def _highest(dataset: xr.Dataset, variable: str | None) -> tuple[dict[str, Any], str, dict[str, Any]] | None:
    """Return the point, the line and the values of the highest *variable*, by default of the power of a harvester."""
    name = variable if variable not in (None, "response_class") else None
    if name is None and "harvester_type" in dataset.attrs:
        name = "harvested_power_last_quarter"
    if name is None or name not in dataset or dataset[name].dtype.kind != "f":
        return None
    unknown, total = int(dataset[name].isnull().sum()), dataset[name].size
    if unknown == total:
        return None
    seeds = seed_axes(dataset)
    means = mean_over_seeds(dataset) if seeds else dataset
    values = means[name]
    at = np.unravel_index(int(np.nanargmax(values.values)), values.shape)
    point = _point(values, dict(zip(values.dims, at, strict=True)), dataset.attrs)
    where = ", ".join(coordinate_text(dataset, each, point[each]) for each in point)
    facts: dict[str, Any] = {"variable": name, "value": float(values.values[at]), "point": dict(point)}
    line = f"Highest {statistic_text(means, name, values.values[at])}"
    if seeds:
        ends = [float(means[f"{name}{end}"].values[at]) for end in ("_low", "_high")]
        words = f"{' to '.join(value_text(means, name, each) for each in ends)}, 95 % interval of the mean"
        line += f" ({words if np.isfinite(ends[1]) else 'no interval: all seeds give this, or one gives none'})"
        facts["interval"] = ends
        near = int((means[f"{name}_high"] >= ends[0]).sum()) - 1
        where += f"; {near} of {values.size - 1} other points may have as much" if values.size > 1 else ""
        point |= {each: dataset[each].values[0].item() for each in seeds}
    line += f" at {where}" if where else ""
    return point, line + (f"; not known at {unknown} of {total} points" if unknown else ""), facts


def _ranges(dataset: xr.Dataset, names: Sequence[str]) -> list[str]:
    """Lines with the minimum and the maximum value of variables."""
    lines = []
    for name in names:
        unit = dataset[name].attrs.get("units", "1")
        unit = "" if unit == "1" else f" {unit}"
        low, high = float(dataset[name].min()), float(dataset[name].max())
        words = scale_text(dataset.attrs, str(dataset[name].attrs.get("long_name", name)))
        lines.append(f"{words}: {low:.4g} to {high:.4g}{unit}")
    return lines


def map_facts(dataset: xr.Dataset, variable: str | None = None) -> dict[str, Any]:
    """Summary of a map as plain values: points of each class and status, lowest interwell point, notch, highest value."""
    dataset = in_units(dataset)
    best = _highest(dataset, variable)
    kinds, codes = np.asarray(dataset["response_class"].values), np.asarray(dataset["status"].values)
    low = lowest_interwell(dataset)
    return {
        "sizes": {str(name): int(size) for name, size in dataset["response_class"].sizes.items()},
        "classes": {kind.label_of(wells_of(dataset.attrs)): int((kinds == kind).sum()) for kind in ResponseClass},
        "statuses": {kind.name.lower(): int((codes == kind).sum()) for kind in RunStatus if (codes == kind).any()},
        "lowest_interwell": low,
        "deepest_notch": None if low is None else deepest_notch(dataset),
        **({} if best is None else {"highest": best[2]}),
    }


def _modes(dataset: xr.Dataset) -> str:
    if "modes" in dataset.coords:
        return f"{', '.join(str(number) for number in np.atleast_1d(dataset['modes'].values))} modes"
    return _count(int(dataset.attrs["modes"]), "mode") if "modes" in dataset.attrs else "its modes"


_SNAPPED = ResponseClass.TRANSIENT_1
"""First class of an interwell response."""
_DRIVING = ("drive", "base_excitation", "axial_load", "force")
"""Sections whose amplitudes drive the system; of strikers after the first with a number."""
_STRENGTH = re.compile("amplitude|velocity|acceleration|displacement|force$|change")
"""Names of the parameters of an excitation that its strength follows from."""
_NORMALISED = re.compile(r" over (b[^,]*)")


def _drives(parameter: str) -> bool:
    """Return True for the dotted name of a parameter that the strength of an excitation follows from."""
    section, field = split_name(parameter)
    return numbered(section)[0] in _DRIVING and _STRENGTH.search(field) is not None


def _parameter(dataset: xr.Dataset, name: str) -> str:
    """Return the dotted name of the parameter along an axis; the name itself if it is not a parameter."""
    if "parameter" in dataset[name].attrs:
        return str(dataset[name].attrs["parameter"])
    try:
        return lookup(name).name
    except InputError:
        return name


def _strength_axis(dataset: xr.Dataset) -> str | None:
    """Return the axis that the strength of the excitation varies along; None if there is not one."""
    axes = [str(name) for name in dataset["response_class"].dims if name in dataset.coords]
    names = [name for name in axes if dataset[name].dtype.kind == "f" and _drives(_parameter(dataset, name))]
    return "velocity_amplitude" if "velocity_amplitude" in names else names[-1] if names else None


def _strength_words(dataset: xr.Dataset) -> str | None:
    """Return the words for the strength of the excitation: an axis, or else a fixed parameter; None if there is none."""
    axis = _strength_axis(dataset)
    if axis is not None:
        return _words(dataset, axis)
    fixed = [
        row
        for row in parameters().values()
        if _drives(row.name) and (row.short in dataset.attrs or row.short in dataset.coords)
    ]
    return _without_scale(fixed[0].quantity.long_name) if fixed else None


def _without_scale(words: str) -> str:
    return _NORMALISED.sub("", words).replace(", of the", " of the").rstrip(",")


def _long_name(dataset: xr.Dataset, name: str) -> str:
    return str(dataset[name].attrs.get("long_name", name.replace("_", " ")))


def _words(dataset: xr.Dataset, name: str) -> str:
    """Return the words for an axis, without what normalises it."""
    if name in _SYMBOLS:
        return name.replace("_", " ")
    return _without_scale(_long_name(dataset, name))


def value_text(dataset: xr.Dataset, name: str, value: Any, digits: int = 4) -> str:
    """Return a value with its unit, or with what normalises it; :func:`in_units` gives axes their units."""
    if not isinstance(value, float):
        return str(value)
    if name in _SYMBOLS:
        return f"{value:.{digits}g}"
    return _with_unit(value, dataset[name].attrs.get("units", "1"), _long_name(dataset, name), digits)


def _with_unit(value: float, unit: str, long_name: str, digits: int) -> str:
    """Return a value with its unit, or with what the words say that it is over."""
    if unit in WITH_PREFIX:
        return prefixed(value, unit, digits)
    unit = unit_words(unit, long_name)
    text = f"{value:.{digits}g}"
    if "e+0" in text and abs(value) < 1e6:
        text = f"{float(text):.0f}"
    return f"{text} {unit}".rstrip()


def unit_words(unit: str, long_name: str) -> str:
    """Return a unit, or what the words of a number without a unit say that it is over, such as ``b``; empty without either."""
    scale = _NORMALISED.search(long_name)
    return unit if unit != "1" else scale[1] if scale else ""


def statistic_text(dataset: xr.Dataset, name: str, value: Any) -> str:
    """Return the words of a statistic and a value of it, with the length scale b where it is over b: ``0.5 b (b = 6 µm)``."""
    words, text = _long_name(dataset, name), value_text(dataset, name, value)
    if _NORMALISED.search(words):
        words, text = _without_scale(words), scale_text(dataset.attrs, text)
    return f"{words}: {text}"


def statistic_value(name: str, value: float, system: System) -> str:
    """Return a value of a statistic of a run with its unit, or over b with the size of b: ``0.5 b (b = 6 µm)``."""
    from snapbeam.solver.statistics import STATISTICS

    row = STATISTICS[name]
    text = _with_unit(value, row.unit, row.long_name, 4)
    return scale_text({"length_scale": system.scale.length}, text) if _NORMALISED.search(row.long_name) else text


def _count(number: int, noun: str) -> str:
    return f"{number} {noun}{'' if number == 1 else 's'}"


def class_table(dataset: xr.Dataset) -> Table:
    """Return the number and the share of runs of each class."""
    kinds = np.asarray(dataset["response_class"].values)
    table = Table(box=None, pad_edge=False)
    table.add_column("response_class")
    table.add_column("runs", justify="right")
    table.add_column("share", justify="right")
    for kind in (*(k for k in ResponseClass if k >= 0), ResponseClass.UNKNOWN):
        count = int((kinds == kind).sum())
        if count or kind is not ResponseClass.UNKNOWN:
            table.add_row(kind.label_of(wells_of(dataset.attrs)), str(count), f"{100.0 * count / kinds.size:.1f} %")
    return table


def lowest_interwell(dataset: xr.Dataset) -> dict[str, Any] | None:
    """Return the coordinates of the known interwell run of minimum amplitude; None without such a run or axis."""
    response, raised = dataset["response_class"], _strength_axis(dataset)
    interwell = response.values >= _SNAPPED
    if raised is None or not interwell.any():
        return None
    amounts = dataset[raised].broadcast_like(response).transpose(*response.dims).values
    at = np.unravel_index(np.argmin(np.where(interwell, amounts, np.inf)), response.shape)
    return _point(response, dict(zip(response.dims, at, strict=True)), dataset.attrs)


def _point(values: xr.DataArray, index: dict[Any, Any], attrs: Any) -> dict[str, Any]:
    """Return the coordinates of a point of a map: those of its axes, and the paper's, each in the unit that was given."""
    point = values.isel(index)
    fixed = [str(name) for name, each in values.coords.items() if each.ndim == 0 and ratio_name(str(name)) in _PAPER]
    in_unit = {ratio_name(name) for name in map(str, (*values.dims, *fixed)) if ratio_name(name) != name}
    in_unit |= {"location"} if is_of_matrices(attrs) else set()
    names = [str(name) for name in values.coords if name in values.dims or name in {*_PAPER, *fixed} - in_unit]
    return {name: point[name].item() for name in names}


def _failed_below(dataset: xr.Dataset, low: dict[str, Any] | None) -> int:
    """Return the number of points of unknown class that may be interwell below the lowest interwell run."""
    response, raised = dataset["response_class"], _strength_axis(dataset)
    unknown = response == ResponseClass.UNKNOWN
    if low is not None and raised is not None:
        unknown = unknown & (dataset[raised] < low[raised])
    return int(unknown.sum())


def deepest_notch(dataset: xr.Dataset) -> dict[str, float] | None:
    """Return where the interwell threshold over frequency dips deepest, or None if it has no dip.

    The depth of a dip is its prominence: how far the threshold rises on both sides before it falls lower.  Frequencies
    at which a point of unknown class leaves the threshold open are left out.
    """
    from scipy.signal import find_peaks

    response = dataset["response_class"].squeeze()
    axes = {ratio_name(str(name)): str(name) for name in response.dims}
    if axes.keys() != {"frequency_ratio", "velocity_amplitude"}:
        return None
    across, raised = axes["frequency_ratio"], axes["velocity_amplitude"]
    velocity = dataset[raised]
    interwell = response >= _SNAPPED
    lowest = velocity.where(interwell).min(raised).fillna(np.inf)
    known = ~((response == ResponseClass.UNKNOWN) & (velocity < lowest)).any(raised).values
    threshold = np.minimum(lowest.values, float(velocity.max()))[known]
    dips, shape = find_peaks(-threshold, prominence=float(np.ptp(velocity.values)) / 50.0)
    if not dips.size:
        return None
    at = dips[np.argmax(shape["prominences"])]
    place = {across: float(dataset[across][known][at]), raised: float(threshold[at])}
    return _point(response, {name: 0 for name in response.dims}, dataset.attrs) | place


def coordinate_text(dataset: xr.Dataset, name: str, value: Any) -> str:
    """Return a coordinate by the paper's symbol where it has one, or by its words, with its unit: ``V = 0.18``."""
    if name in _SYMBOLS:
        return f"{_SYMBOLS[name]} = {value_text(dataset, name, value)}"
    return f"{_words(dataset, name)} = {value_text(dataset, name, value)}"


def _where(dataset: xr.Dataset, point: dict[str, Any], raised: str) -> str:
    """Return the coordinates of a point, the amplitude first, and physical units where they are known."""
    attrs = dataset.attrs
    first = coordinate_text if raised in _SYMBOLS else value_text
    text = first(dataset, raised, point[raised])
    others = ", ".join(coordinate_text(dataset, name, point[name]) for name in point if name != raised)
    text += f" at {others}" if others else ""
    freq, level = attrs.get("reference_frequency"), attrs.get("beam_buckling_level")
    if freq and level and {"frequency_ratio", "velocity_amplitude"} <= point.keys():
        velocity, omega = point["velocity_amplitude"], point["frequency_ratio"]
        speed = prefixed(2.0 * np.pi * freq * level * velocity, "m/s")
        text += f" ({speed} at {prefixed(omega * freq, 'Hz', 4)})"
    return text


def status_lines(dataset: xr.Dataset) -> list[str]:
    """Return one line for each way runs failed, with what to do about it."""
    if "status" not in dataset:
        return []
    codes = np.asarray(dataset["status"].values)
    pulled_in = int(dataset.attrs.get("pull_in_runs", 0))
    lines = [f"{pulled_in} of {codes.size} runs left the displacements of a force: pull-in, counted as snap-through."]
    lines = lines if pulled_in else []
    for status in RunStatus:
        count = int((codes == status).sum()) - (pulled_in if status is RunStatus.DIVERGED else 0)
        if count and status not in (RunStatus.OK, RunStatus.EARLY_STOP, RunStatus.FILLED):
            lines.append(f"[bold red]{count} failed[/] ({status.name}): {status.advice}")
    decided = int((codes == RunStatus.EARLY_STOP).sum())
    if decided:
        lines.append(f"{decided} of {codes.size} runs ended early because their response class was certain.")
    inferred = int((codes == RunStatus.FILLED).sum())
    if inferred:
        lines.append(
            f"{codes.size - inferred} of {codes.size} points were run, the others were filled from their neighbours."
        )
    return lines


def _closer(stem: str) -> str:
    """Name of the next file, closer to a point: ``closer``, ``closer_2``, ``closer_3``; never that of the file itself."""
    found = re.fullmatch(r"closer(?:_(\d+))?", stem)
    return "closer" if found is None else f"closer_{int(found[1] or 1) + 1}"


def _suggestions(dataset: xr.Dataset, files: Sequence[Path], low: dict[str, Any] | None) -> list[str]:
    """Suggested next commands for a map."""
    lines = []
    file = shlex.quote(str(files[0])) if files else None
    axes = [str(name) for name in dataset["response_class"].dims if name in dataset.coords]
    if low is not None and file is not None and "point" not in dataset.dims:
        point = point_text({name: low[name] for name in axes})
        at = f" --point {shlex.quote(point)}" if point else ""
        lines.append(f"run this point    snapbeam simulate --from {file}{at} --plot run.png")
        ratios = {ratio_name(name): name for name in axes}
        if {"frequency_ratio", "velocity_amplitude"} <= ratios.keys() and min(dataset.sizes[name] for name in axes) > 1:
            closer = _closer(files[0].stem)
            names = [ratios[name] for name in ("frequency_ratio", "velocity_amplitude")]
            options = [f"--{name.replace('_', '-')}" for name in names]
            omega, velocity = (low[name] for name in names)
            lines.append(
                f"zoom in           snapbeam map --from {file}{at} "
                f"{options[0]} {0.8 * omega:.3g}:{1.2 * omega:.3g}:40 "
                f"{options[1]} {0.5 * velocity:.3g}:{2.0 * velocity:.3g}:40 "
                f"-o {closer}.nc --plot {closer}.png"
            )
    if file is not None:
        line = " --quasi-static-line" if set(map(ratio_name, axes)) <= set(_PAPER) else ""
        if sum(dataset.sizes[name] > 1 for name in axes) == 2:
            lines.append(f"plot again        snapbeam plot {file}{line} -o map.pdf")
        lines.append(f'open the file     python -c "import xarray; print(xarray.open_dataset({str(files[0])!r}))"')
    return [escape(line) for line in lines]


_LONGEST_ATTRIBUTE = 20_000


def parameter_table(attrs: dict[str, Any]) -> Table:
    """Return the attributes of a file, one a row."""
    table = Table(box=None, pad_edge=False, show_header=False)
    table.add_column(style="bold", no_wrap=True)
    table.add_column(overflow="fold")
    for name, value in attrs.items():
        text = f"{value:.10g}" if isinstance(value, (float, np.floating)) else str(value)
        table.add_row(escape(printable(str(name))), escape(printable(text, _LONGEST_ATTRIBUTE)))
    return table
