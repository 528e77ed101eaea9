"""``snapbeam compare``: compare a measured run or measured responses with a simulation."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from snapbeam.cli import parameter_options as opt
from snapbeam.cli.console import add_json, cli_command, open_result, out
from snapbeam.lab.cli import options as lab
from snapbeam.util.status_codes import ResponseClass

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

    from snapbeam.util.diagnostics import Diagnostic


_RUN = "Measured run"
_AT = {"striker": "displacement_at_striker", "midspan": "midspan_displacement"}


@cli_command
def compare(
    measured: Annotated[
        Path,
        typer.Argument(
            help="With a map: CSV table of measured responses. With a run: NetCDF file of a tracked run, or a signal "
            "file of a displacement sensor, zero midway between the wells.",
            metavar="MEASURED",
        ),
    ],
    simulated: Annotated[Path, typer.Argument(help="NetCDF file of a map, or of a run.", metavar="SIMULATED")],
    frequency: Annotated[float | None, opt.number_option("Excitation frequency, Hz.", _RUN)] = None,
    start: Annotated[float | None, opt.number_option("Start of the excitation, s.", _RUN)] = None,
    cycles: Annotated[int, opt.count_option("Number of cycles for the response class (200).", _RUN)] = 200,
    at: Annotated[str, lab.option("Location of the measured displacement: striker or midspan.", _RUN)] = "striker",
    channel: lab.Channel = None,
    units: lab.Units = None,
    sensitivity: lab.Sensitivity = None,
    sampling_frequency: lab.SamplingFreq = None,
    columns: lab.Columns = None,
    window: opt.Window = None,
    plot: opt.Plot = None,
    overlay: Annotated[
        bool,
        lab.option("Superimpose the waveforms of --plot, and draw their difference.", lab.OUTPUT, None, "--overlay"),
    ] = False,
    strict: lab.Strict = False,
) -> None:
    """Compare measured responses with a simulated map, or a measured waveform with a simulated one.

    With a CSV table of responses and a map, the command prints the fraction that agrees and a table of measured against
    simulated classes.  With a tracked run, it aligns the simulated run by the phase of the shaker.  With the signal of a
    displacement sensor, it aligns the run by --start, the time at which the shaker starts.

    Example: snapbeam compare laser.csv run.nc --at midspan --frequency 100 --start 0.2 --plot waves.png
    """
    from snapbeam.lab.waveform_comparison import run_of_signal
    from snapbeam.plot.style import FIGURE_SUFFIXES
    from snapbeam.util.diagnostics import refuse
    from snapbeam.util.validation import choice

    lab.check_files(FIGURE_SUFFIXES, plot=plot)
    dataset = open_result(simulated)
    place = choice("at", at, tuple(_AT))
    if "time" not in dataset.dims:
        summary, figure, diagnostics = _map(measured, dataset, plot is not None)
    else:
        if measured.suffix.lower() == ".nc":
            run = open_result(measured)
        else:
            signal = lab.open_signal(measured, channel, units, sensitivity, sampling_frequency, columns)
            run = run_of_signal(signal, float(dataset.attrs["length_scale"]), _AT[place])
        draw = ("overlay" if overlay else "beside") if plot is not None else ""
        part = opt.parse_window(window)
        summary, figure, diagnostics = _run(run, dataset, frequency, start, cycles, _AT[place], part, draw)
    if plot is not None and figure is not None:
        lab.save_plot(figure, plot)
    if strict:
        refuse(diagnostics, str(measured))
    add_json(**summary)


def _map(path: Path, dataset: xr.Dataset, draw: bool) -> tuple[dict, Figure | None, tuple[Diagnostic, ...]]:
    from rich.table import Table

    points, result = lab.map_comparison(dataset, path)
    console = out()
    low, high = result.agreement_interval
    if result.used:
        console.print(
            f"{result.used} of {len(points)} measured responses count; {100.0 * result.agreement:.0f} % agree "
            f"with the map (95 %: {100.0 * low:.0f} to {100.0 * high:.0f} %), "
            f"{100.0 * result.snap_agreement:.0f} % on whether the beam snaps through"
        )
    table = Table(box=None, pad_edge=False)
    table.add_column("measured \\ simulated")
    for kind in result.classes:
        table.add_column(_short(kind), justify="right", no_wrap=True)
    for kind, row in zip(result.classes, result.confusion, strict=True):
        table.add_row(_short(kind), *map(str, row))
    console.print(table)
    lab.print_notes(result)
    figure = None
    if draw:
        from snapbeam.lab.plot.comparison import plot_map_comparison

        figure = plot_map_comparison(dataset, points, result)
    return result.summary(), figure, result.diagnostics


def _short(kind: ResponseClass) -> str:
    return kind.label.replace("interwell ", "").replace(" interwell", "")


def _run(
    run: xr.Dataset,
    model: xr.Dataset,
    frequency: float | None,
    start: float | None,
    cycles: int,
    at: str,
    window: tuple[float, float] | None,
    draw: str,
) -> tuple[dict, Figure | None, tuple[Diagnostic, ...]]:
    import numpy as np

    from snapbeam.lab.waveform_comparison import compare_waveforms, measure_response
    from snapbeam.util.diagnostics import diagnostics_of

    onsets = None
    if "penetration_mm" in run:
        from snapbeam.lab.tracking.track import contact_onsets

        onsets = contact_onsets(run)["onset"].values
    result = compare_waveforms(run, model, frequency, at=at, start=start, measured_onsets=onsets)
    seen = measure_response(run, frequency, cycles=cycles, at=at, start=start)
    console = out()
    console.print(f"  measured class      {seen.description}")
    console.print(
        f"  beam                rms difference {result.rms_difference:.4g} b; rms of the measured motion "
        f"{result.measured_rms:.4g} b"
    )
    console.print(f"  correlation         {result.correlation:.4f}")
    if not np.isnan(result.amplitude_ratio):
        console.print(
            f"  shaker              rms difference {result.shaker_rms_difference:.4g} b, amplitude ratio "
            f"{result.amplitude_ratio:.4f}"
        )
    parted = "never" if np.isnan(result.parted) else f"at cycle {result.parted:.2f}"
    console.print(f"  the two part        {parted} (by more than {result.apart:.2g} b)")
    diagnostics = (*diagnostics_of(run), *result.diagnostics)
    lab.print_diagnostics(console, diagnostics)
    summary = {
        "measured_response": seen.response_class.label,
        "measured_crossings": seen.zero_crossings,
        "reasons": list(seen.reasons),
        "rms_difference_b": result.rms_difference,
        "correlation": result.correlation,
        "shaker_rms_difference_b": result.shaker_rms_difference,
        "amplitude_ratio": result.amplitude_ratio,
        "shift_cycles": result.shift,
        "parted_cycle": result.parted,
        "diagnostics": [one.plain() for one in diagnostics],
    }
    figure = None
    if draw:
        from snapbeam.lab.plot.comparison import plot_waveform_comparison, plot_waveform_overlay

        figure = (plot_waveform_overlay if draw == "overlay" else plot_waveform_comparison)(result, window)
    return summary, figure, diagnostics
