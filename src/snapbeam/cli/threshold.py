"""``snapbeam threshold``: the smallest velocity amplitude that makes the beam snap through."""

from __future__ import annotations

import time
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
import typer

from snapbeam.cli import options as opt
from snapbeam.cli.console import door, duration, file_line, out, progress

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["threshold"]

_AXES = "Axes: a number, numbers a,b,c, or start:stop:count"
_SEARCH = "Search"


@door
def threshold(
    ctx: typer.Context,
    config: opt.ConfigFile = None,
    frequency_ratio: Annotated[
        str | None, typer.Option(help="Omega (0.1:4:64).", rich_help_panel=_AXES)
    ] = None,
    location: Annotated[
        str | None,
        typer.Option(help="x_s (1/2.1); an axis if --frequency-ratio is a number.", rich_help_panel=_AXES),
    ] = None,
    velocity_amplitude: Annotated[
        str | None,
        typer.Option(help="V to choose from: range and resolution (0.005:0.64:128).", rich_help_panel=_AXES),
    ] = None,
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
    modes: Annotated[
        str | None,
        typer.Option(
            help="Numbers N of buckling modes, such as 1,32.", rich_help_panel="Reduced model and contact"
        ),
    ] = None,
    damping_ratio: opt.DampingRatio = None,
    contact_stiffness: opt.ContactStiffness = None,
    cycles: opt.Cycles = None,
    reference_freq: opt.ReferenceFreq = None,
    step: opt.Step = None,
    accuracy: opt.Accuracy = None,
    engine: opt.Engine = None,
    threads: opt.Threads = None,
    length: opt.Length = None,
    thickness: opt.Thickness = None,
    width: opt.Width = None,
    density: opt.Density = None,
    young_modulus: opt.YoungModulus = None,
    buckling_level: opt.BucklingLevel = None,
    axial_load: opt.AxialLoad = None,
) -> None:
    """Find the threshold of the interwell response along frequency ratio or location, as a band.

    The boundary is fractal in places, so two curves are written: the lowest amplitude that snaps the beam
    through, and the one above which every run does.

    Example: snapbeam threshold --modes 1,32 --frequency-ratio 0.1:4:64 --velocity-amplitude 0.005:0.64:128
    -o threshold.nc --plot threshold.png
    """
    from snapbeam.core.files import check_writable

    axes = {
        "frequency_ratio": frequency_ratio,
        "velocity_amplitude": velocity_amplitude or "0.005:0.64:128",
        "location": location,
    }
    given = {name: value for name, value in ctx.params.items() if name != "modes"}
    settings = opt.configured(given, map=axes)
    counts = [settings.model.modes] if modes is None else _counts(modes)
    check_writable(output, "output", (".nc",))
    if plot is not None:
        from snapbeam.figures.style import FIGURE_SUFFIXES

        check_writable(plot, "plot", FIGURE_SUFFIXES)

    from snapbeam import ReducedModel, threshold_curve
    from snapbeam.cli.map import write_map

    beam = settings.beam.build()
    models = [
        ReducedModel.from_beam(beam, modes=n, damping_ratio=settings.model.damping_ratio) for n in counts
    ]
    for model in models:
        model.require_bistable("a threshold")
    arguments: dict[str, Any] = settings.map.axes() | opt.run_arguments(settings)
    arguments.pop("early_decision", None)
    start = time.monotonic()
    with progress(1) as report:
        dataset = threshold_curve(
            models[0] if len(models) == 1 else models, settings.contact.build(), **arguments,
            search=search, share=0.1 if share is None else share, threads=threads, progress=report,
        )  # fmt: skip
    elapsed = time.monotonic() - start
    files = [write_map(dataset, output)]
    if plot is not None:
        files.append(_draw(dataset, plot))
    out().print(*_summary(dataset, elapsed), *(f"Written: {file_line(path)}" for path in files), sep="\n")


def _counts(text: str) -> list[int]:
    from snapbeam.core.validate import InputError, integer

    try:
        return [integer("modes", int(part), 1, 256) for part in text.split(",")]
    except ValueError as error:
        if isinstance(error, InputError):
            raise
        raise InputError(f"modes = {text!r}: must be whole numbers, such as 1,32") from None


def _draw(dataset: xr.Dataset, path: Path) -> Path:
    import matplotlib

    matplotlib.use("Agg")
    from snapbeam.figures import plot_threshold, save_figure

    figure = plot_threshold(dataset).get_figure(root=True)
    assert figure is not None
    return save_figure(figure, path)


def _summary(dataset: xr.Dataset, elapsed: float) -> list[str]:
    runs, full = dataset.attrs["runs"], dataset.attrs["runs_of_full_map"]
    lines = [f"{runs} runs in {duration(elapsed)}, {100.0 * runs / full:.1f} % of a full map's {full}"]
    curves = [dataset.isel(modes=at) for at in range(dataset.sizes.get("modes", 0))] or [dataset]
    for curve in curves:
        modes = curve["modes"].item() if "modes" in curve.coords else dataset.attrs["modes"]
        first = curve["first_interwell"]
        if bool(first.isnull().all()):
            lines.append(f"N = {modes}: no interwell response; raise the velocity amplitude")
            continue
        at = first.isel({first.dims[0]: int(np.nanargmin(first.values))})
        width = float((curve["always_interwell"] - first).mean())
        along = str(first.dims[0])
        lines.append(
            f"N = {modes}: lowest threshold V = {float(at):.4g} at {along} = {float(at[along]):.4g}; "
            f"band {width:.2g} wide on average"
        )
        none = int(first.isnull().sum())
        if none:
            lines.append(f"  no interwell response in range at {none} of {first.size} points")
    lines.append(f"It may miss {dataset.attrs['may_miss']}.")
    return lines
