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
from snapbeam.util.si_prefixes import prefixed
from snapbeam.util.status_codes import ResponseClass, RunStatus

if TYPE_CHECKING:
    import xarray as xr

__all__ = [
    "class_table",
    "coordinate_text",
    "deepest_notch",
    "lowest_interwell",
    "map_facts",
    "map_summary",
    "parameter_table",
    "status_lines",
]


_SYMBOLS = {"frequency_ratio": "Omega", "velocity_amplitude": "V", "location": "x_s", "modes": "N"}
_PAPER = ("frequency_ratio", "velocity_amplitude", "location")


def map_summary(
    dataset: xr.Dataset,
    files: Sequence[Path],
    elapsed: float | None = None,
    variable: str | None = None,
    *,
    bistable: bool = True,
) -> RenderableType:
    """Return the classes, the lowest interwell amplitude, what failed, the files and what to try next.

    Of a beam with one well: the range of *variable*, or of the centre's displacement, in place of the classes.
    """
    attrs = dataset.attrs
    runs = dataset["response_class"].size
    noun = "point" if "computed" in dataset or "class_fraction" in dataset else "run"
    head = f"{_count(runs, noun)} of {_modes(dataset)} over {_count(attrs.get('cycles', 0), 'cycle')}"
    if elapsed is not None:
        head += f" in {duration(elapsed)} ({runs / max(elapsed, 1e-9):.3g} runs/s)"
    lines = [head]
    if not bistable:
        lines.append("The beam has one well: response classes are not shown.")
        lines += _ranges(
            dataset, (variable,) if variable else ("min_midspan_displacement", "max_midspan_displacement")
        )
        lines += [*status_lines(dataset), *(f"Written: {file_line(path)}" for path in files)]
        return Group(*lines)
    low = lowest_interwell(dataset)
    failed = _failed_below(dataset, low)
    if low is None:
        lines_after = ["No run snapped through: raise the velocity amplitude."]
    else:
        raised = _raised(dataset)
        lines_after = [f"Lowest interwell {raised.replace('_', ' ')}: {_where(low, raised, attrs)}"]
        notch = deepest_notch(dataset)
        if notch is not None:
            lines_after.append(f"Deepest notch of the threshold: {_where(notch, raised, attrs)}")
            low = notch
    if failed:
        lines_after.append(
            f"{_count(failed, 'point')} of unknown response class may be interwell{' below it' if low else ''}."
        )
    lines_after += status_lines(dataset)
    lines_after += [f"Written: {file_line(path)}" for path in files]
    lines_after += ["Next:", *(f"  {line}" for line in _suggestions(dataset, files, low))]
    return Group(*lines, class_table(dataset), *lines_after)


def _ranges(dataset: xr.Dataset, names: Sequence[str]) -> list[str]:
    """Lines with the least and the greatest value of variables."""
    lines = []
    for name in names:
        unit = dataset[name].attrs.get("units", "1")
        unit = "" if unit == "1" else f" {unit}"
        low, high = float(dataset[name].min()), float(dataset[name].max())
        lines.append(f"{dataset[name].attrs.get('long_name', name)}: {low:.4g} to {high:.4g}{unit}")
    return lines


def map_facts(dataset: xr.Dataset) -> dict[str, Any]:
    """What a map shows, as plain values: points of each class and status, the lowest interwell point, the notch."""
    kinds, codes = np.asarray(dataset["response_class"].values), np.asarray(dataset["status"].values)
    low = lowest_interwell(dataset)
    return {
        "sizes": {str(name): int(size) for name, size in dataset["response_class"].sizes.items()},
        "classes": {kind.label: int((kinds == kind).sum()) for kind in ResponseClass},
        "statuses": {
            kind.name.lower(): int((codes == kind).sum()) for kind in RunStatus if (codes == kind).any()
        },
        "lowest_interwell": low,
        "deepest_notch": None if low is None else deepest_notch(dataset),
    }


def _modes(dataset: xr.Dataset) -> str:
    if "modes" in dataset.coords:
        return f"{', '.join(str(number) for number in np.atleast_1d(dataset['modes'].values))} modes"
    return _count(int(dataset.attrs["modes"]), "mode") if "modes" in dataset.attrs else "its modes"


def _raised(dataset: xr.Dataset) -> str:
    """The axis whose least interwell value is of interest: the velocity amplitude, or the last one of numbers."""
    if "velocity_amplitude" in dataset.dims or not dataset["response_class"].dims:
        return "velocity_amplitude"
    numbers = [
        str(name)
        for name in dataset["response_class"].dims
        if name in dataset.coords and dataset[name].dtype.kind == "f"
    ]
    return numbers[-1] if numbers else "velocity_amplitude"


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
            table.add_row(kind.label, str(count), f"{100.0 * count / kinds.size:.1f} %")
    return table


def lowest_interwell(dataset: xr.Dataset) -> dict[str, Any] | None:
    """Return the coordinates of the interwell run of least velocity amplitude, or None.

    Of a map without that axis it is the least value of its last axis of numbers.  Points of unknown class are left
    out; they may be interwell at a smaller value.
    """
    response, raised = dataset["response_class"], _raised(dataset)
    interwell = response.values >= ResponseClass.TRANSIENT_1
    if not interwell.any():
        return None
    names = [str(name) for name in dataset.coords if name in response.dims or name in _PAPER]
    if raised in dataset.coords:
        amounts = dataset[raised].broadcast_like(response).transpose(*response.dims).values
        at = np.unravel_index(np.argmin(np.where(interwell, amounts, np.inf)), response.shape)
    else:
        at = np.unravel_index(int(np.argmax(interwell)), response.shape)
    point = response.isel(dict(zip(response.dims, at, strict=True)))
    return {name: point[name].item() for name in names if name in point.coords}


def _failed_below(dataset: xr.Dataset, low: dict[str, Any] | None) -> int:
    """Return the number of points of unknown class that may be interwell below the lowest interwell run."""
    response, raised = dataset["response_class"], _raised(dataset)
    unknown = response == ResponseClass.UNKNOWN
    if low is not None and raised in low:
        unknown = unknown & (dataset[raised] < low[raised])
    return int(unknown.sum())


def deepest_notch(dataset: xr.Dataset) -> dict[str, float] | None:
    """Return where the interwell threshold over frequency dips deepest, or None if it has no dip.

    The depth of a dip is its prominence: how far the threshold rises on both sides before it falls lower.  Frequencies
    at which a point of unknown class leaves the threshold open are left out.
    """
    from scipy.signal import find_peaks

    response = dataset["response_class"].squeeze()
    if set(response.dims) != {"frequency_ratio", "velocity_amplitude"}:
        return None
    velocity = dataset["velocity_amplitude"]
    interwell = response >= ResponseClass.TRANSIENT_1
    lowest = velocity.where(interwell).min("velocity_amplitude").fillna(np.inf)
    known = ~((response == ResponseClass.UNKNOWN) & (velocity < lowest)).any("velocity_amplitude").values
    threshold = np.minimum(lowest.values, float(velocity.max()))[known]
    dips, shape = find_peaks(-threshold, prominence=float(np.ptp(velocity.values)) / 50.0)
    if not dips.size:
        return None
    at = dips[np.argmax(shape["prominences"])]
    place = {
        "frequency_ratio": float(dataset["frequency_ratio"][known][at]),
        "velocity_amplitude": float(threshold[at]),
    }
    return place | {"location": float(dataset["location"].squeeze())}


def coordinate_text(name: str, value: Any) -> str:
    """A coordinate in words, by the paper's symbol where it has one: ``V = 0.18``, ``side = below``."""
    shown = f"{value:.4g}" if isinstance(value, float) else str(value)
    return f"{_SYMBOLS.get(name, name)} = {shown}"


def _where(point: dict[str, Any], raised: str, attrs: dict[str, Any]) -> str:
    """Coordinates of a point in words, in physical units beside where they are known."""
    others = [coordinate_text(name, point[name]) for name in point if name != raised]
    text = (
        f"{coordinate_text(raised, point[raised])} at {', '.join(others)}"
        if raised in point
        else ", ".join(others)
    )
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
    lines = []
    for status in RunStatus:
        count = int((codes == status).sum())
        if count and status not in (RunStatus.OK, RunStatus.EARLY_STOP, RunStatus.FILLED):
            lines.append(f"[bold red]{count} failed[/] ({status.name}): {status.advice}")
    decided = int((codes == RunStatus.EARLY_STOP).sum())
    if decided:
        lines.append(f"{decided} of {codes.size} runs ended early because their response class was certain.")
    inferred = int((codes == RunStatus.FILLED).sum())
    if inferred:
        lines.append(
            f"{codes.size - inferred} of {codes.size} points were run, "
            "the others were filled from their neighbours."
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
        if {"frequency_ratio", "velocity_amplitude"} <= set(axes) and min(
            dataset.sizes[name] for name in axes
        ) > 1:
            closer = _closer(files[0].stem)
            omega, velocity = low["frequency_ratio"], low["velocity_amplitude"]
            lines.append(
                f"zoom in           snapbeam map --from {file}{at} "
                f"--frequency-ratio {0.8 * omega:.3g}:{1.2 * omega:.3g}:40 "
                f"--velocity-amplitude {0.5 * velocity:.3g}:{2.0 * velocity:.3g}:40 "
                f"-o {closer}.nc --plot {closer}.png"
            )
    if file is not None:
        line = " --quasi-static-line" if set(axes) <= set(_PAPER) else ""
        if sum(dataset.sizes[name] > 1 for name in axes) == 2:
            lines.append(f"plot again        snapbeam plot {file}{line} -o map.pdf")
        lines.append(
            f'open the file     python -c "import xarray; print(xarray.open_dataset({str(files[0])!r}))"'
        )
    return [escape(line) for line in lines]


def parameter_table(attrs: dict[str, Any]) -> Table:
    """Return the attributes of a file, one a row."""
    table = Table(box=None, pad_edge=False, show_header=False)
    table.add_column(style="bold", no_wrap=True)
    table.add_column(overflow="fold")
    for name, value in attrs.items():
        table.add_row(
            str(name), escape(f"{value:.10g}" if isinstance(value, (float, np.floating)) else str(value))
        )
    return table
