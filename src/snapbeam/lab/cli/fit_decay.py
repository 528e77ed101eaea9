"""``snapbeam fit-decay``: natural frequencies and damping ratios from a free decay."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from snapbeam.cli import parameter_options as opt
from snapbeam.cli.console import add_json, cli_command, out
from snapbeam.lab.cli import options as lab
from snapbeam.lab.cli.options import option

_DECAY = "Decay"


@cli_command
def fit_decay(
    signal: lab.SignalFile,
    modes: Annotated[int, opt.count_option("Number of modes to fit (1).", _DECAY)] = 1,
    frequencies: Annotated[
        str | None, option("Approximate frequencies of the modes, Hz, instead of --modes.", _DECAY, "F,F")
    ] = None,
    method: Annotated[str, option("Method: fit, hilbert, log_decrement, or all.", _DECAY)] = "fit",
    start: Annotated[float | None, opt.number_option("Start of the free decay, s.", _DECAY)] = None,
    stop: Annotated[float | None, opt.number_option("End of the free decay, s.", _DECAY)] = None,
    soften: Annotated[
        bool, option("Fit the dependence of frequency on amplitude.", _DECAY, None, "--soften/--linear")
    ] = True,
    buckling_level: Annotated[
        float | None,
        opt.number_option(
            "Buckling level b, m, for a prior of the softening near that of one mode, 0.75 (a/b)^2.", _DECAY
        ),
    ] = None,
    exponential_window: Annotated[
        float | None,
        opt.number_option(
            "Time constant T, s, of an exponential window exp(-t/T) of the analyser, to correct.", _DECAY
        ),
    ] = None,
    mirror_channel: Annotated[
        str | None,
        option(
            "Channel of a second sensor at the mirror location, to distinguish symmetric from antisymmetric modes.",
            _DECAY, "NAME",
        ),
    ] = None,
    channel: lab.Channel = None,
    units: lab.Units = None,
    sensitivity: lab.Sensitivity = None,
    sampling_frequency: lab.SamplingFreq = None,
    columns: lab.Columns = None,
    plot: opt.Plot = None,
    stabilisation: Annotated[
        Path | None, option("Figure of the stabilisation diagram to write.", lab.OUTPUT, "FILE")
    ] = None,
    strict: lab.Strict = False,
) -> None:  # fmt: skip
    """Fit frequency, damping ratio and softening to a free decay, with standard errors.

    The frequency is the limit at zero amplitude, because a buckled beam softens about a well.

    Example: snapbeam fit-decay decay.csv --start 0.12 --method all --plot decay.png --json lower.json
    """
    from rich.table import Table

    from snapbeam.lab.decay.identify import METHODS, identify_decay
    from snapbeam.lab.decay.model import mode_shapes
    from snapbeam.plot.style import FIGURE_SUFFIXES
    from snapbeam.util.diagnostics import refuse
    from snapbeam.util.validation import choice

    lab.check_files(FIGURE_SUFFIXES, plot=plot, stabilisation=stabilisation)
    choice("method", method, (*METHODS, "all"))
    data = lab.open_signal(signal, channel, units, sensitivity, sampling_frequency, columns)
    rough = lab.numbers("frequencies", frequencies) or None
    fits = {
        name: identify_decay(
            data, modes=modes, frequencies=rough, method=name, start=start, stop=stop, soften=soften,
            buckling_level=buckling_level, exponential_window=exponential_window,
        )
        for name in (METHODS if method == "all" else (method,))
    }  # fmt: skip
    first = next(iter(fits.values()))
    console = out()
    console.print(
        f"{signal.name}: {first.start:.4g} to {first.stop:.4g} s, {first.snr:.1f} dB above noise at the start"
    )
    table = Table(box=None, pad_edge=False)
    for title in ("method", "mode", "frequency (Hz)", "damping (%)", "amplitude", "softening"):
        table.add_column(title, justify="left" if title == "method" else "right", no_wrap=True)
    for name, fit in fits.items():
        for i, mode in enumerate(fit.modes):
            table.add_row(
                name if i == 0 else "",
                str(i + 1),
                f"{mode.natural_frequency:.4f} +- {mode.natural_frequency_se:.4f}",
                f"{100 * mode.damping_ratio:.4f} +- {100 * mode.damping_ratio_se:.4f}",
                f"{mode.amplitude:.4g} {fit.units}",
                f"{mode.softening * mode.amplitude**2:.4f}" if i == 0 else "",
            )
    console.print(table)
    console.print("softening: relative fall of the first frequency at the starting amplitude")
    for mode in first.modes[:1]:
        law = mode.damping
        if law.name == "free":
            console.print(f"damping: {1.0 + law.strength:.3f} times that at zero amplitude at the start")
        elif law.name != "viscous":
            strength = f"{law.strength:.3f} +- {law.strength_se:.3f}"
            console.print(f"damping: viscous and {law.name}, {strength} times as strong at the start")
    if mirror_channel is not None:
        second = lab.open_signal(signal, mirror_channel, units, sensitivity, sampling_frequency, columns)
        shapes = mode_shapes(data, second, first)
        told = ", ".join(
            f"{mode.natural_frequency:.4g} Hz {kind}" for mode, kind in zip(first.modes, shapes, strict=True)
        )
        console.print(f"shapes: {told}")
    diagnostics = tuple({one.code: one for fit in fits.values() for one in fit.diagnostics}.values())
    lab.print_diagnostics(console, diagnostics)
    if plot is not None:
        from snapbeam.lab.plot.fit_decay import plot_decay

        lab.save_plot(plot_decay(data, first), plot)
    if stabilisation is not None:
        from snapbeam.lab.plot.fit_decay import plot_stabilisation

        lab.save_plot(plot_stabilisation(data, first), stabilisation)
    if strict:
        refuse(diagnostics, str(signal))
    add_json(**{name: fit.summary() for name, fit in fits.items()})
