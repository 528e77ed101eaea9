"""``snapbeam simulate``: one run, recorded, drawn and told."""

from __future__ import annotations

import time
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from snapbeam.cli import options as opt
from snapbeam.cli.console import door, duration, file_line, out

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["draw_run", "simulate"]

_SHAKER = "Shaker"


@door
def simulate(
    ctx: typer.Context,
    config: opt.ConfigFile = None,
    frequency_ratio: Annotated[
        float | None,
        opt.number_option("Omega, excitation over first natural frequency (1.21).", _SHAKER),
    ] = None,
    velocity_amplitude: Annotated[
        float | None,
        opt.number_option("V, velocity amplitude over b omega_1 (0.18).", _SHAKER),
    ] = None,
    location: Annotated[
        float | None, opt.number_option("x_s, position over length, in (0, 1) (1/2.1).", _SHAKER)
    ] = None,
    side: Annotated[
        str | None, typer.Option(help="Side it pushes from: below or above.", rich_help_panel=_SHAKER)
    ] = None,
    drive: Annotated[
        Path | None,
        typer.Option(
            help="Recorded drive in place of the sinusoidal one: the file that snapbeam vibrometer "
            "--drive-output wrote.",
            rich_help_panel=_SHAKER,
            metavar="FILE",
        ),
    ] = None,
    output: Annotated[
        Path | None,
        typer.Option(
            "--output", "-o", help="NetCDF file to write.", rich_help_panel="Output", metavar="FILE"
        ),
    ] = None,
    plot: opt.Plot = None,
    animate: Annotated[
        Path | None,
        typer.Option(
            help="Animation to write, .mp4 or .gif: the moving beam beside the waveform, with slow motion about "
            "the hardest impact of the window.",
            rich_help_panel="Output",
            metavar="FILE",
        ),
    ] = None,
    window: opt.Window = None,
    modes: opt.Modes = None,
    damping_ratio: opt.DampingRatio = None,
    contact_stiffness: opt.ContactStiffness = None,
    cycles: opt.Cycles = None,
    reference_freq: opt.ReferenceFreq = None,
    step: opt.Step = None,
    accuracy: opt.Accuracy = None,
    engine: opt.Engine = None,
    early_decision: opt.EarlyDecision = None,
    length: opt.Length = None,
    thickness: opt.Thickness = None,
    width: opt.Width = None,
    density: opt.Density = None,
    young_modulus: opt.YoungModulus = None,
    buckling_level: opt.BucklingLevel = None,
    axial_load: opt.AxialLoad = None,
) -> None:
    """Compute one run and say how the beam responds.

    Example: snapbeam simulate --frequency-ratio 1.21 --velocity-amplitude 0.18 -o run.nc --plot run.png
    --window 0:20
    """
    from snapbeam.core.files import check_writable

    sine = {
        "frequency_ratio": frequency_ratio,
        "velocity_amplitude": velocity_amplitude,
        "location": location,
        "side": side,
    }
    settings = opt.configured(ctx.params, shaker=sine)
    if output is not None:
        check_writable(output, "output", (".nc",))
    if plot is not None:
        from snapbeam.figures.style import FIGURE_SUFFIXES

        check_writable(plot, "plot", FIGURE_SUFFIXES)
    if animate is not None:
        from snapbeam.figures.animation import ANIMATION_SUFFIXES

        check_writable(animate, "animate", ANIMATION_SUFFIXES)
    part = opt.parse_window(window)

    import snapbeam as sb

    model = sb.ReducedModel.from_beam(settings.beam.build(), **settings.model.model_dump())
    start = time.monotonic()
    arguments = opt.run_arguments(settings)
    shaker: sb.Shaker | sb.RecordedDrive = settings.shaker.build()
    if drive is not None:
        if frequency_ratio is not None or velocity_amplitude is not None:
            raise sb.InputError("frequency_ratio, velocity_amplitude: must be left out with a recorded drive")
        shaker = sb.RecordedDrive.from_dataset(
            _recorded(drive), location=settings.shaker.location, side=settings.shaker.side
        )
        arguments["cycles"] = cycles
    run = sb.simulate(model, shaker, settings.contact.build(), **arguments)
    elapsed = time.monotonic() - start
    console = out()
    console.print(_told(run, elapsed))
    if output is not None:
        from snapbeam.cli.map import write_map

        console.print(f"Written: {file_line(write_map(run.dataset, output))}")
    if plot is not None:
        console.print(f"Written: {file_line(draw_run(run.dataset, plot, part))}")
    if animate is not None:
        console.print(f"Written: {file_line(_animated(run.dataset, animate, part))}")


def draw_run(dataset: xr.Dataset, path: Path, window: tuple[float, float] | None) -> Path:
    """Draw a run to a picture file."""
    import matplotlib

    matplotlib.use("Agg")
    from snapbeam.figures import plot_run, save_figure

    return save_figure(plot_run(dataset, window), path)


def _recorded(path: Path) -> xr.Dataset:
    import xarray as xr

    from snapbeam.core.validate import InputError

    try:
        return xr.load_dataset(path, engine="h5netcdf")
    except (OSError, ValueError) as error:
        raise InputError(
            f"drive = {path.name!r}: must be a NetCDF file of a recorded drive ({error})"
        ) from None


def _animated(dataset: xr.Dataset, path: Path, window: tuple[float, float] | None) -> Path:
    import matplotlib

    matplotlib.use("Agg")
    from snapbeam.figures.animation import animate_run

    return animate_run(dataset, path, window)


def _told(run: Any, elapsed: float) -> str:
    from snapbeam.core.codes import ResponseClass, RunStatus

    answer = run.response
    kind, status = ResponseClass(int(answer.response)), RunStatus(int(answer.status))
    well = "upper" if answer.final_well > 0 else "lower"
    final = "below the barrier: it stays there" if answer.end_is_final else "above the barrier: not settled"
    crossings = f"{answer.crossings}, {answer.crossings_last_quarter} of them in the last quarter"
    contact = f"{answer.impacts}, in contact {100.0 * answer.contact_share:.3g} % of the time"
    center = f"{answer.min_center_displacement:.4g} to {answer.max_center_displacement:.4g} b"
    lines = [
        f"[bold]{kind.label}[/] (in {duration(elapsed)}; {status.advice})",
        f"  zero crossings        {crossings}",
        f"  at the end            in the {well} well, {final}",
        f"  centre displacement   {center}",
        f"  at the shaker         {answer.min_displacement:.4g} to {answer.max_displacement:.4g} b",
        f"  impacts               {contact}",
        f"  peak contact force    {answer.peak_force:.4g} N",
    ]
    if answer.crossings:
        lines.insert(2, f"  last crossing         at {answer.last_crossing:.5g} s")
    return "\n".join(lines)
