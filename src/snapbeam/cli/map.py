"""``snapbeam map``: the response class over frequency, amplitude and location."""

from __future__ import annotations

import math
import time
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from snapbeam.cli import long
from snapbeam.cli import options as opt
from snapbeam.cli.console import FAILED, door, out, progress

if TYPE_CHECKING:
    import xarray as xr

    from snapbeam.config import Axis

__all__ = ["compute_map"]

_AXES = "Axes: a number, numbers a,b,c, or start:stop:count"


@door
def compute_map(
    ctx: typer.Context,
    config: opt.ConfigFile = None,
    frequency_ratio: Annotated[
        str | None,
        typer.Option(
            help="Omega, excitation over first natural frequency (0.1:4:64).", rich_help_panel=_AXES
        ),
    ] = None,
    velocity_amplitude: Annotated[
        str | None,
        typer.Option(help="V, velocity amplitude over b omega_1 (0.01:0.65:40).", rich_help_panel=_AXES),
    ] = None,
    location: Annotated[
        str | None,
        typer.Option(help="x_s, shaker position over length, in (0, 1) (1/2.1).", rich_help_panel=_AXES),
    ] = None,
    output: Annotated[
        Path,
        typer.Option(
            "--output", "-o", help="NetCDF file to write.", rich_help_panel="Output", metavar="FILE"
        ),
    ] = Path("map.nc"),
    plot: opt.Plot = None,
    dots: opt.Dots = None,
    threshold_line: opt.ThresholdLine = False,
    modes: opt.Modes = None,
    damping_ratio: opt.DampingRatio = None,
    contact_stiffness: opt.ContactStiffness = None,
    cycles: opt.Cycles = None,
    reference_freq: opt.ReferenceFreq = None,
    step: opt.Step = None,
    accuracy: opt.Accuracy = None,
    engine: opt.Engine = None,
    early_decision: opt.EarlyDecision = None,
    threads: opt.Threads = None,
    store: long.StoreOption = None,
    verify: long.Verify = False,
    cluster: long.ClusterOption = None,
    refine: long.Refine = None,
    replicas: long.Replicas = None,
    replica_size: long.ReplicaSize = None,
    halve_step: long.HalveStep = False,
    chunk: long.Chunk = None,
    log: long.Log = None,
    length: opt.Length = None,
    thickness: opt.Thickness = None,
    width: opt.Width = None,
    density: opt.Density = None,
    young_modulus: opt.YoungModulus = None,
    buckling_level: opt.BucklingLevel = None,
    axial_load: opt.AxialLoad = None,
) -> None:
    """Compute the map of response types and say what it shows.

    Runs one simulation for each point of the axes, tells intrawell, transient interwell 1 and 2 and
    continuous interwell apart, and writes the classes and their statistics to a NetCDF file.

    Example: snapbeam map --modes 32 --cycles 200 --frequency-ratio 0.1:4:64 --velocity-amplitude
    0.01:0.65:40 --location 1/2.1 -o map.nc --plot map.png
    """
    from snapbeam.cli.summary import map_summary
    from snapbeam.core.files import check_writable

    axes = {
        "frequency_ratio": frequency_ratio,
        "velocity_amplitude": velocity_amplitude,
        "location": location,
    }
    given = dict(ctx.params)
    settings = long.resumed(given, opt.configured(given, map=axes))
    points = settings.map.axes()
    check_writable(output, "output", (".nc",))
    if plot is not None:
        _check_plot(plot, points)

    from snapbeam import ReducedModel, long_map, response_map

    beam = settings.beam.build()
    model = ReducedModel.from_beam(beam, **settings.model.model_dump())
    model.require_bistable("a map")
    overlay = read_overlay(dots, settings.run.reference_freq or model.natural_freq[0], beam.buckling_level)
    arguments: dict[str, Any] = points | opt.run_arguments(settings)
    total = math.prod(1 if isinstance(values, float) else len(values) for values in points.values())
    start = time.monotonic()
    further = long.long_arguments(given)
    contact = settings.contact.build()
    if not further and log is None:
        with progress(total) as say:
            dataset = response_map(model, contact, **arguments, threads=threads, progress=say)
        write_map(dataset, output)
        lines: list[str] = []
    else:
        from snapbeam.sweeps.stored import Tally

        tally = Tally()
        further |= {} if verify else {"output": output}
        further |= {"config": long.kept_config(settings, given), "tally": tally, "threads": threads}
        with long.report(total, log) as say:
            dataset = long_map(model, contact, **arguments, **further, progress=say.progress, note=say.note)
            lines = long.tally_lines(tally, store, time.monotonic() - start)
            for line in lines:
                say.log(line)
        if verify:
            out().print(*lines, sep="\n", markup=False)
            raise typer.Exit(FAILED if tally.failed else 0)
    elapsed = time.monotonic() - start
    files = [output]
    if plot is not None:
        files.append(draw_map(dataset, plot, overlay, threshold_line))
    out().print(map_summary(dataset, files, None if further else elapsed))
    out().print(*lines, sep="\n", markup=False, end="\n" if lines else "")
    if further and tally.failed:
        raise typer.Exit(FAILED)


def _check_plot(path: Path, points: dict[str, Axis]) -> None:
    from snapbeam.core.files import check_writable
    from snapbeam.core.validate import InputError
    from snapbeam.figures.style import FIGURE_SUFFIXES

    check_writable(path, "plot", FIGURE_SUFFIXES)
    axes = [name for name, values in points.items() if not isinstance(values, float) and len(values) > 1]
    if len(axes) != 2:
        raise InputError(
            f"plot = {str(path)!r}: a map is drawn over two axes, not {len(axes)} ({', '.join(axes)}); "
            "leave --plot out, and draw one point of an axis with snapbeam plot map.nc --location 0.3"
        )


def read_overlay(dots: Path | None, reference_freq: float | None, buckling_level: float | None) -> Any:
    """Return the measured points of a CSV file, normalised, or None."""
    if dots is None:
        return None
    from snapbeam.lab.compare.dots import read_dots

    return read_dots(dots, reference_freq=reference_freq, buckling_level=buckling_level)


def write_map(dataset: xr.Dataset, path: Path) -> Path:
    """Write a map to a NetCDF file, whole or not at all."""
    from snapbeam.core.files import atomic_path

    with atomic_path(path) as temporary:
        dataset.to_netcdf(temporary, engine="h5netcdf")
    return path


def draw_map(dataset: xr.Dataset, path: Path, overlay: Any, threshold_line: bool) -> Path:
    """Draw a map to a picture file."""
    import matplotlib

    matplotlib.use("Agg")
    from snapbeam.figures import plot_response_map, save_figure

    figure = plot_response_map(dataset, dots=overlay, threshold_line=threshold_line).get_figure(root=True)
    assert figure is not None
    return save_figure(figure, path)
