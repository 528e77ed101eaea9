"""``snapbeam vibrometer``: amplitude, frequency, distortion and start-up of the shaker's measured motion."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from snapbeam.cli import lab
from snapbeam.cli import options as opt
from snapbeam.cli.console import door, file_line, out

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["vibrometer"]


@door
def vibrometer(
    signal: lab.SignalFile,
    frequency: Annotated[
        float | None, opt.number_option("Excitation frequency as set, Hz, as a guess.", "Drive")
    ] = None,
    snr_limit: Annotated[
        float | None, opt.number_option("Least ratio of sine to all else, dB, to accept (15).", "Drive")
    ] = None,
    channel: lab.Channel = None,
    units: lab.Units = None,
    sensitivity: lab.Sensitivity = None,
    sampling_freq: lab.SamplingFreq = None,
    camera: Annotated[
        Path | None,
        typer.Option(
            help="NetCDF file of the tracked recording of the same test, to align with.",
            metavar="FILE", rich_help_panel="Drive",
        ),
    ] = None,
    drive_output: Annotated[
        Path | None,
        typer.Option(
            help="NetCDF file of the drive, drift-free and resampled, to write.",
            metavar="FILE", rich_help_panel="Output",
        ),
    ] = None,
    drive_sampling_freq: Annotated[
        float | None, opt.number_option("Samples per second of --drive-output, Hz (100000).", "Output")
    ] = None,
    plot: opt.Plot = None,
    report: lab.Report = None,
) -> None:  # fmt: skip
    """Measure the shaker's motion in a vibrometer record and say whether the test is acceptable.

    Fits the steady sine with standard errors, tells noise from distortion, finds and describes the start-up
    transient, and on request aligns the record with a tracked recording and writes the measured drive for use
    in the model.

    Example: snapbeam vibrometer velocity.csv --frequency 100 --plot drive.png --json drive.json
    """
    from snapbeam.core.files import check_writable
    from snapbeam.core.netcdf import write_netcdf
    from snapbeam.figures.style import FIGURE_SUFFIXES, save_figure
    from snapbeam.lab.drive.vibrometer import SNR_LIMIT, measure_drive

    for name, path, suffixes in (
        ("plot", plot, FIGURE_SUFFIXES),
        ("json", report, (".json",)),
        ("drive_output", drive_output, (".nc",)),
    ):
        if path is not None:
            check_writable(path, name, suffixes)
    data = lab.open_signal(signal, channel, units, sensitivity, sampling_freq)
    limit = SNR_LIMIT if snr_limit is None else snr_limit
    drive = measure_drive(data, frequency, snr_limit=limit)
    fit, summary = drive.steady, drive.summary()
    console = out()
    verdict = "[green]accepted[/]" if drive.accepted else "[bold red]not accepted[/]"
    console.print(f"{signal.name}: {verdict} (sine to noise and distortion above {limit:g} dB)")
    console.print(f"  frequency    {fit.frequency:.6g} +- {fit.frequency_se:.1g} Hz")
    console.print(f"  amplitude    {fit.amplitude:.6g} +- {fit.amplitude_se:.1g} {drive.units}")
    console.print(f"  phase        {fit.phase:.5g} +- {fit.phase_se:.1g} rad at time 0")
    console.print(f"  noise        {fit.snr:.1f} dB below the sine; with distortion {fit.sinad:.1f} dB")
    console.print(
        f"  distortion   {100.0 * fit.distortion:.3f} % (noise alone: {100.0 * fit.distortion_floor:.3f} %)"
    )
    console.print(f"  start-up     {summary['startup']}")
    for note in drive.notes:
        console.print(f"  [yellow]note[/]         {note}")
    if camera is not None:
        from snapbeam.lab.drive.align import align

        alignment = align(_shaker_of(camera), data, frequency)
        summary["alignment"] = {
            "delay_s": alignment.delay,
            "delay_se_s": alignment.delay_se,
            "certain": alignment.certain,
            "polarity": alignment.polarity,
            "gain": alignment.gain,
            "clock_difference": alignment.clock_difference,
        }
        console.print(f"  alignment    {alignment.description}")
    if drive_output is not None:
        from snapbeam.lab.drive.record import recorded_drive

        resampled = recorded_drive(data, drive_sampling_freq or 1e5, measurement=drive)
        write_netcdf(resampled, drive_output)
        console.print(f"Written: {file_line(drive_output)}")
    if plot is not None:
        from snapbeam.figures.vibrometer import plot_drive

        save_figure(plot_drive(data, drive), plot)
        console.print(f"Written: {file_line(plot)}")
    if report is not None:
        lab.write_report(report, summary)
        console.print(f"Written: {file_line(report)}")


def _shaker_of(path: Path) -> xr.DataArray:
    """The shaker's displacement [m] in a tracked recording, over its longest stretch without dropouts."""
    import numpy as np

    from snapbeam.cli.results import open_result
    from snapbeam.core.validate import InputError
    from snapbeam.lab.signals.signal import make_signal

    tracked = open_result(path)
    if "shaker_displacement_mm" not in tracked or "time" not in tracked.coords:
        raise InputError(f"{path}: has no shaker_displacement_mm over time; it must come from snapbeam track")
    values = tracked["shaker_displacement_mm"].values
    good = np.concatenate(([0], np.isfinite(values).astype(np.int8), [0]))
    runs = np.flatnonzero(np.diff(good)).reshape(-1, 2)
    if not runs.size:
        raise InputError(f"{path}: the shaker was found in no frame")
    first, last = runs[np.argmax(runs[:, 1] - runs[:, 0])]
    time = tracked["time"].values[first:last]
    return make_signal(values[first:last], "mm", time=time, name="shaker seen by the camera")
