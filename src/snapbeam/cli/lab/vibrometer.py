"""``snapbeam vibrometer``: amplitude, frequency, distortion and start-up of the shaker's measured motion."""

from __future__ import annotations

from snapbeam.cli.common import options as opt
from snapbeam.cli.common.console import door, file_line, out
from snapbeam.cli.lab import options as lab
from snapbeam.cli.lab import vibrometer_options as asked

__all__ = ["vibrometer"]


@door
def vibrometer(
    signal: lab.SignalFile,
    frequency: asked.Frequency = None,
    snr_limit: asked.SnrLimit = None,
    channel: lab.Channel = None,
    units: lab.Units = None,
    sensitivity: lab.Sensitivity = None,
    sampling_frequency: lab.SamplingFreq = None,
    columns: lab.Columns = None,
    camera: asked.Camera = None,
    polarity: asked.Polarity = None,
    near: asked.Near = None,
    amplitude: asked.Amplitude = None,
    amplitude_from: asked.AmplitudeFrom = "vibrometer",
    drive_output: asked.DriveOutput = None,
    drive_sampling_frequency: asked.DriveSamplingFreq = None,
    plot: opt.Plot = None,
    report: lab.JsonFile = None,
    strict: lab.Strict = False,
) -> None:
    """Measure the shaker's motion in a vibrometer record and say whether the test is acceptable.

    Fits the steady sine with standard errors, tells noise from distortion, finds and describes the start-up
    transient, and on request aligns the record with a tracked recording and writes the measured drive for use
    in the model.

    Example: snapbeam vibrometer velocity.csv --frequency 100 --plot drive.png --json drive.json
    """
    from snapbeam.core.files import check_writable
    from snapbeam.core.findings import doubtful, refuse
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
    data = lab.open_signal(signal, channel, units, sensitivity, sampling_frequency, columns)
    limit = SNR_LIMIT if snr_limit is None else snr_limit
    drive = measure_drive(data, frequency, amplitude=amplitude, snr_limit=limit)
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
    console.print(
        f"  distortion   {100.0 * fit.distortion:.3f} % (noise alone: {100.0 * fit.distortion_floor:.3f} %)"
    )
    console.print(f"  start-up     {summary['startup']}")
    diagnostics = drive.diagnostics
    alignment = None
    if camera is not None:
        from snapbeam.cli.common.results import open_result
        from snapbeam.lab.drive.align import align
        from snapbeam.lab.drive.seen import shaker_signal

        alignment = align(shaker_signal(open_result(camera)), data, frequency, polarity=polarity, near=near)
        diagnostics += alignment.diagnostics
        summary["alignment"] = {
            "delay_s": alignment.delay, "delay_se_s": alignment.delay_se, "certain": alignment.certain,
            "polarity": alignment.polarity, "gain": alignment.gain, "gain_se": alignment.gain_se,
            "clock_difference": alignment.clock_difference,
            "diagnostics": [one.plain() for one in alignment.diagnostics],
        }  # fmt: skip
        console.print(f"  alignment    {alignment.description}")
    lab.tell_findings(console, diagnostics)
    if plot is not None:
        from snapbeam.figures.lab.vibrometer import plot_drive

        save_figure(plot_drive(data, drive), plot)
        console.print(f"Written: {file_line(plot)}")
    if strict:
        refuse(diagnostics, str(signal))
    if drive_output is not None:
        from snapbeam.lab.drive.record import recorded_drive

        resampled = recorded_drive(
            data, drive_sampling_frequency or 1e5, measurement=drive, alignment=alignment, polarity=polarity,
            amplitude_from=amplitude_from,
        )  # fmt: skip
        write_netcdf(resampled, drive_output)
        console.print(f"Written: {file_line(drive_output)}")
    if report is not None:
        lab.write_json(report, summary)
        console.print(f"Written: {file_line(report)}")
