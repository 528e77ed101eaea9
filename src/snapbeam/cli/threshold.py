"""``snapbeam threshold``: the smallest velocity amplitude, or whatever else, that makes the beam snap through."""

from __future__ import annotations

import time
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
import typer

from snapbeam.cli.common import options as opt
from snapbeam.cli.common.console import answer, door, duration, file_line, out, progress
from snapbeam.cli.common.parameter_options import (
    BEAM,
    CONTACT,
    DRIVE,
    MODEL,
    RUN,
    STRIKER,
    configured,
    with_parameters,
)
from snapbeam.cli.common.summary import coordinate_text

if TYPE_CHECKING:
    import xarray as xr

    from snapbeam.config import Config

__all__ = ["threshold"]

_AXES = (
    "drive.frequency_ratio", "drive.frequency_hz", "drive.velocity_amplitude", "drive.velocity_m_s",
    "striker.location", "striker.location_m", "model.modes",
)  # fmt: skip
_SEARCH = "Search"
_VALUES = "0.005:0.64:128"


@door
@with_parameters(*DRIVE, *STRIKER, *BEAM, *MODEL, *CONTACT, *RUN, axes=_AXES)
def threshold(
    given: Any,
    along: Annotated[
        str, typer.Option(help="Parameter to raise (velocity_amplitude).", rich_help_panel=_SEARCH)
    ] = "velocity_amplitude",
    search: Annotated[
        str,
        typer.Option(
            help="fast: a tenth of a full map's runs, may miss isolated interwell points below the band; "
            "exhaustive: finds the first interwell point of the grid.",
            rich_help_panel=_SEARCH,
            metavar="KIND",
        ),
    ] = "fast",
    share: Annotated[
        float | None, opt.number_option("Runs of the fast search over a full map's (0.1).", _SEARCH)
    ] = None,
    output: Annotated[
        Path,
        typer.Option(
            "--output", "-o", help="NetCDF file to write.", rich_help_panel="Output", metavar="FILE"
        ),
    ] = Path("threshold.nc"),
    plot: opt.Plot = None,
    threads: opt.Threads = None,
) -> None:
    """Find the threshold of the interwell response over frequency ratio, location or any parameters, as a band.

    The boundary is fractal in places, so two curves are written: the lowest amplitude that snaps the beam
    through, and the one above which every run does.

    Example: snapbeam threshold --modes 1,32 --frequency-ratio 0.1:4:64 --velocity-amplitude 0.005:0.64:128
    -o threshold.nc --plot threshold.png
    """
    from snapbeam.cli.common.results import check_pictures, draw_threshold, write_map
    from snapbeam.config import lookup
    from snapbeam.core.files import check_writable

    settings = configured(given, lambda config, _: _axes_of(config, along))
    check_writable(output, "output", (".nc",))
    check_pictures(("plot", plot))
    name = lookup(along).name
    axes = _axes_of(settings, along)
    values = axes.pop(name)

    from snapbeam.sweeps.threshold import threshold as find

    system = settings.system
    system.model.require_bistable("a threshold")
    start = time.monotonic()
    with progress(None, "threshold", "runs") as report:
        dataset = find(
            system, name, values, axes, settings.integration.replace(threads=threads), search=search,
            share=0.1 if share is None else share, progress=report,
        )  # fmt: skip
    elapsed = time.monotonic() - start
    files = [write_map(dataset, output)]
    if plot is not None:
        files.append(draw_threshold(dataset, plot))
    names = ("first_interwell", "always_interwell")
    answer(
        along=dataset.attrs["along"],
        axes={str(each): dataset[each].values for each in dataset["first_interwell"].dims},
        **{each: dataset[each].values for each in names},
        runs=dataset.attrs["runs"], seconds=elapsed, files=files,
    )  # fmt: skip
    out().print(*_summary(dataset, elapsed), *(f"Written: {file_line(path)}" for path in files), sep="\n")


def _axes_of(settings: Config, along: str) -> dict[str, Any]:
    """The axes of a search, those of the structure first, and the values to choose from."""
    from snapbeam.config import lookup, parse_axis
    from snapbeam.core.validate import InputError

    axes: dict[str, Any] = settings.axes()
    name = lookup(along).name
    values = axes.pop(name, None)
    if values is None:
        if name != "drive.velocity_amplitude":
            raise InputError(f"{along}: give the values to choose from, as --axis {along}=start:stop:count")
        values = np.atleast_1d(parse_axis("velocity_amplitude", _VALUES))
    if not [each for each in axes if each != "model.modes"]:
        axes["drive.frequency_ratio"] = np.atleast_1d(parse_axis("frequency_ratio", "0.1:4:64"))
    return dict(sorted(axes.items(), key=lambda item: lookup(item[0]).is_run)) | {name: values}


def _summary(dataset: xr.Dataset, elapsed: float) -> list[str]:
    runs, full = dataset.attrs["runs"], dataset.attrs["runs_of_full_map"]
    lines = [f"{runs} runs in {duration(elapsed)}, {100.0 * runs / full:.1f} % of a full map's {full}"]
    along = dataset.attrs["along"]
    first = dataset["first_interwell"]
    across = str(first.dims[-1])
    for at in np.ndindex(first.shape[:-1]):
        chosen = dict(zip(map(str, first.dims[:-1]), at, strict=True))
        curve = dataset.isel(chosen)
        lines += _curve(curve, along, across, chosen)
    lines.append(f"It may miss {dataset.attrs['may_miss']}.")
    return lines


def _curve(curve: xr.Dataset, along: str, across: str, chosen: dict[str, int]) -> list[str]:
    """What one curve shows."""
    first = curve["first_interwell"]
    named = [coordinate_text(name, curve[name].item()) for name in chosen]
    if "modes" in curve.attrs and "modes" not in chosen:
        named.append(coordinate_text("modes", int(curve.attrs["modes"])))
    head = f"{', '.join(named)}: " if named else ""
    if bool(first.isnull().all()):
        return [f"{head}no interwell response; raise {along}"]
    at = first.isel({across: int(np.nanargmin(first.values))})
    width = float((curve["always_interwell"] - first).mean())
    lines = [
        f"{head}lowest threshold {coordinate_text(along, float(at))} at {coordinate_text(across, at[across].item())}; "
        f"band {width:.2g} wide on average"
    ]
    none = int(first.isnull().sum())
    if none:
        lines.append(f"  no interwell response in range at {none} of {first.size} points")
    return lines
