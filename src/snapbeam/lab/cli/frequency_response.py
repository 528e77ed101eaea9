"""``snapbeam frf``: frequency response and coherence of two channels."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, cast

from snapbeam.cli import parameter_options as opt
from snapbeam.cli.console import add_json, cli_command, file_line, out
from snapbeam.lab.cli import options as lab
from snapbeam.lab.cli.options import option

_PAIR = "Frequency response"


@cli_command
def frequency_response(
    signal: lab.SignalFile,
    excitation: Annotated[
        str, option("Name of the channel of the excitation, or its number from 0.", _PAIR, "NAME")
    ] = "0",
    response: Annotated[str, option("Name of the channel of the response, or its number from 0.", _PAIR, "NAME")] = "1",
    resolution: Annotated[
        float | None, opt.number_option("Distance of the lines, Hz; 31 segments by default.", _PAIR)
    ] = None,
    estimator: Annotated[
        str, option("Estimator: h1 (noise of the response) or h2 (noise of the excitation).", _PAIR)
    ] = "h1",
    sampling_frequency: lab.SamplingFreq = None,
    columns: lab.Columns = None,
    output: Annotated[Path | None, option("NetCDF file to write.", lab.OUTPUT, "FILE", "--output", "-o")] = None,
    plot: opt.Plot = None,
    strict: lab.Strict = False,
) -> None:
    """Estimate the frequency response of two channels of a file, with standard errors and coherence.

    The units are those that the file states.  The result has the magnitude, the phase and the coherence at each line.

    Example: snapbeam frf hammer.csv --excitation force --response velocity -o response.nc --plot response.png
    """
    import numpy as np

    from snapbeam.lab.coherence import coherent_lines
    from snapbeam.lab.coherence import frequency_response as estimate
    from snapbeam.plot.run import plot_frequency_response
    from snapbeam.plot.style import FIGURE_SUFFIXES
    from snapbeam.util.diagnostics import diagnostics_of, refuse
    from snapbeam.util.netcdf import write_netcdf

    lab.check_files(FIGURE_SUFFIXES, plot=plot)
    lab.check_files((".nc",), output=output)
    channels = (excitation, response)
    pair = [lab.open_signal(signal, channel, None, None, sampling_frequency, columns) for channel in channels]
    found = estimate(*pair, resolution=resolution, estimator=estimator)
    coherent, _ = coherent_lines(found)
    peak: dict[str, float] = {}
    if coherent.any():
        top = found.isel(frequency=int(np.argmax(np.where(coherent, found["magnitude"].values, 0.0))))
        names = ("frequency", "magnitude", "magnitude_se", "phase", "coherence")
        peak = {name: float(top[name]) for name in names}
    mode = {name: float(value) for name, value in found.attrs.items() if name.startswith("peak_")}
    console = out()
    unit = found["magnitude"].attrs["units"]
    console.print(
        f"{found.attrs['response']} over {found.attrs['excitation']}: {found.sizes['frequency']} lines, "
        f"{found.attrs['resolution']:.4g} Hz apart, {found.attrs['segments']} segments; coherent at "
        f"{100.0 * float(coherent.mean()):.0f} % of the lines",
        markup=False,
    )
    if peak:
        console.print(
            f"  highest peak  {peak['magnitude']:.5g} +- {peak['magnitude_se']:.1g} {unit} at {peak['frequency']:.5g} Hz, "
            f"phase {peak['phase']:.3f} rad, coherence {peak['coherence']:.3f}"
        )
    if mode:
        console.print(
            f"  mode          {mode['peak_magnitude']:.5g} +- {mode['peak_magnitude_se']:.1g} {unit} at "
            f"{mode['peak_frequency']:.6g} +- {mode['peak_frequency_se']:.1g} Hz, damping ratio "
            f"{mode['peak_damping_ratio']:.3g} +- {mode['peak_damping_ratio_se']:.1g}, without the width of the window"
        )
    diagnostics = diagnostics_of(found)
    lab.print_diagnostics(console, diagnostics)
    if plot is not None:
        from matplotlib.figure import Figure

        lab.save_plot(cast(Figure, plot_frequency_response(found).figure), plot)
    if strict:
        refuse(diagnostics, str(signal))
    if output is not None:
        write_netcdf(found, output)
        console.print(f"Written: {file_line(output)}")
    add_json(
        peak=peak or None, mode=mode or None, coherent_share=float(coherent.mean()), resolution_hz=float(found.attrs["resolution"]),
        segments=int(found.attrs["segments"]), diagnostics=[one.plain() for one in diagnostics],
    )  # fmt: skip
