"""``snapbeam vibrometer``: amplitude, frequency, distortion and start-up of the shaker's measured motion."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from snapbeam.cli import parameter_options as opt
from snapbeam.cli.console import add_json, cli_command, file_line, out
from snapbeam.lab.cli import options as lab
from snapbeam.lab.cli.options import option


@cli_command
def vibrometer(
    signal: lab.SignalFile,
    frequency: Annotated[
        float | None, opt.number_option("Set excitation frequency, Hz, as the initial guess.", "Drive")
    ] = None,
    snr_limit: Annotated[
        float | None, opt.number_option("Minimum signal-to-noise ratio (SINAD) to accept, dB (15).", "Drive")
    ] = None,
    channel: lab.Channel = None,
    units: lab.Units = None,
    sensitivity: lab.Sensitivity = None,
    sampling_frequency: lab.SamplingFreq = None,
    columns: lab.Columns = None,
    camera: Annotated[
        Path | None,
        option("NetCDF file of the tracked recording of the same test, for the alignment.", "Drive", "FILE"),
    ] = None,
    polarity: Annotated[
        int | None,
        option(
            "Polarity of the vibrometer relative to the camera, 1 or -1; by default from the onset of the motion.", "Drive"
        ),
    ] = None,
    near: Annotated[
        float | None,
        opt.number_option("Approximate delay of the camera's clock, s, to half a cycle, such as from a trigger.", "Drive"),
    ] = None,
    amplitude: Annotated[float | None, opt.number_option("Set amplitude, m/s (or m), for a check.", "Drive")] = None,
    acceleration: Annotated[
        Path | None,
        option("Acceleration of the same shaker, for a check of units and sampling rate.", "Drive", "FILE"),
    ] = None,
    amplitude_from: Annotated[
        str, option("Source of the amplitude of the drive: vibrometer or camera.", "Drive")
    ] = "vibrometer",
    drive_output: Annotated[
        Path | None, option("NetCDF file of the drive to write, drift-free and resampled.", lab.OUTPUT, "FILE")
    ] = None,
    drive_sampling_frequency: Annotated[
        float | None, opt.number_option("Sampling frequency of --drive-output, Hz (100000).", lab.OUTPUT)
    ] = None,
    plot: opt.Plot = None,
    strict: lab.Strict = False,
) -> None:  # fmt: skip
    """Measure the motion of the shaker from a vibrometer signal, and check whether the test is acceptable.

    The command fits the steady sine with standard errors, separates noise from distortion, and describes the start-up
    transient.  With --camera it aligns the signal with a tracked recording; with --drive-output it writes the measured
    drive for simulations.

    Example: snapbeam vibrometer velocity.csv --frequency 100 --plot drive.png --json drive.json
    """
    from snapbeam.lab.vibrometer import SNR_LIMIT, measure_drive
    from snapbeam.plot.style import FIGURE_SUFFIXES
    from snapbeam.util.diagnostics import doubtful, refuse
    from snapbeam.util.netcdf import write_netcdf

    lab.check_files(FIGURE_SUFFIXES, plot=plot)
    lab.check_files((".nc",), drive_output=drive_output)
    data = lab.open_signal(signal, channel, units, sensitivity, sampling_frequency, columns)
    limit = SNR_LIMIT if snr_limit is None else snr_limit
    other = None if acceleration is None else lab.open_signal(acceleration, None, None, None, None, None)
    drive = measure_drive(data, frequency, amplitude=amplitude, acceleration=other, snr_limit=limit)
    fit, summary = drive.steady, drive.summary()
    console = out()
    verdict = "[green]accepted[/]" if drive.accepted else "[bold red]not accepted[/]"
    if drive.accepted and doubtful(drive.diagnostics):
        verdict = "[yellow]accepted, but doubtful[/]"
    console.print(f"{signal.name}: {verdict} (sine to noise and distortion above {limit:g} dB)")
    console.print(f"  frequency    {fit.frequency:.6g} +- {fit.frequency_se:.1g} Hz")
    console.print(f"  amplitude    {fit.amplitude:.6g} +- {fit.amplitude_se:.1g} {drive.units}")
    console.print(f"  phase        {fit.phase:.5g} +- {fit.phase_se:.1g} rad at time 0")
    console.print(f"  noise        {fit.snr:.1f} dB below the sine; with distortion {fit.sinad:.1f} dB")
    console.print(f"  distortion   {100.0 * fit.distortion:.3f} % (noise alone: {100.0 * fit.distortion_floor:.3f} %)")
    console.print(f"  start-up     {summary['startup']}")
    if acceleration is None and (amplitude is None or frequency is None):
        console.print(
            "  not checked  unit, quantity and sampling rate: give --frequency and --amplitude, or --acceleration"
        )
    diagnostics = drive.diagnostics
    alignment = None
    if camera is not None:
        from snapbeam.cli.console import open_result
        from snapbeam.lab.drive_alignment import align
        from snapbeam.lab.vibrometer import shaker_signal

        alignment = align(shaker_signal(open_result(camera)), data, frequency, polarity=polarity, near=near)
        diagnostics += alignment.diagnostics
        summary["alignment"] = {
            "delay_s": alignment.delay, "delay_se_s": alignment.delay_se, "certain": alignment.certain,
            "polarity": alignment.polarity, "gain": alignment.gain, "gain_se": alignment.gain_se,
            "clock_difference": alignment.clock_difference,
            "diagnostics": [one.plain() for one in alignment.diagnostics],
        }  # fmt: skip
        console.print(f"  alignment    {alignment.description}")
    lab.print_diagnostics(console, diagnostics)
    if plot is not None:
        from snapbeam.lab.plot.vibrometer import plot_drive

        lab.save_plot(plot_drive(data, drive), plot)
    if strict:
        refuse(diagnostics, str(signal))
    if drive_output is not None:
        from snapbeam.lab.drive_alignment import recorded_drive

        resampled = recorded_drive(
            data, drive_sampling_frequency or 1e5, measurement=drive, alignment=alignment, polarity=polarity,
            amplitude_from=amplitude_from,
        )  # fmt: skip
        write_netcdf(resampled, drive_output)
        console.print(f"Written: {file_line(drive_output)}")
    add_json(**summary)
