"""``snapbeam fit-decay``: natural frequencies and damping ratios from a free decay."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from snapbeam.cli import parameter_options as opt
from snapbeam.cli.console import add_json, cli_command, file_line, out
from snapbeam.lab.cli import options as lab

# ----------------------------------------------------------------------------------------------------
# Options of ``snapbeam fit-decay``.


_DECAY = "Decay"


Modes = Annotated[int, opt.count_option("Number of modes to fit (1).", _DECAY)]
Frequencies = Annotated[
    str | None,
    typer.Option(
        help="Approximate frequencies of the modes, Hz, instead of --modes.",
        metavar="F,F",
        rich_help_panel=_DECAY,
    ),
]
Method = Annotated[
    str, typer.Option(help="Method: fit, hilbert, log_decrement, or all.", rich_help_panel=_DECAY)
]
Start = Annotated[float | None, opt.number_option("Start of the free decay, s.", _DECAY)]
Stop = Annotated[float | None, opt.number_option("End of the free decay, s.", _DECAY)]
Soften = Annotated[
    bool,
    typer.Option(
        "--soften/--linear", help="Fit the dependence of frequency on amplitude.", rich_help_panel=_DECAY
    ),
]
BucklingLevel = Annotated[
    float | None,
    opt.number_option(
        "Buckling level b, m, for a prior of the softening near that of one mode, 0.75 (a/b)^2.", _DECAY
    ),
]
ExponentialWindow = Annotated[
    float | None,
    opt.number_option(
        "Time constant T, s, of an exponential window exp(-t/T) of the analyser, to correct.", _DECAY
    ),
]
MirrorChannel = Annotated[
    str | None,
    typer.Option(
        help="Channel of a second sensor at the mirror location, to distinguish symmetric from antisymmetric modes.",
        metavar="NAME",
        rich_help_panel=_DECAY,
    ),
]
Stabilisation = Annotated[
    Path | None,
    typer.Option(
        help="Figure of the stabilisation diagram to write.",
        metavar="FILE",
        rich_help_panel="Output",
    ),
]


# ----------------------------------------------------------------------------------------------------


@cli_command
def fit_decay(
    signal: lab.SignalFile,
    modes: Modes = 1,
    frequencies: Frequencies = None,
    method: Method = "fit",
    start: Start = None,
    stop: Stop = None,
    soften: Soften = True,
    buckling_level: BucklingLevel = None,
    exponential_window: ExponentialWindow = None,
    mirror_channel: MirrorChannel = None,
    channel: lab.Channel = None,
    units: lab.Units = None,
    sensitivity: lab.Sensitivity = None,
    sampling_frequency: lab.SamplingFreq = None,
    columns: lab.Columns = None,
    plot: opt.Plot = None,
    stabilisation: Stabilisation = None,
    strict: lab.Strict = False,
) -> None:
    """Fit frequency, damping ratio and softening to a free decay, with standard errors.

    The frequency is the limit at zero amplitude, because a buckled beam softens about a well.

    Example: snapbeam fit-decay decay.csv --start 0.12 --method all --plot decay.png --json lower.json
    """
    from rich.table import Table

    from snapbeam.lab.decay.identify import METHODS, identify_decay
    from snapbeam.lab.decay.model import mode_shapes
    from snapbeam.plot.style import FIGURE_SUFFIXES, save_figure
    from snapbeam.util.diagnostics import refuse
    from snapbeam.util.files import check_writable
    from snapbeam.util.validation import choice

    for name, path in (("plot", plot), ("stabilisation", stabilisation)):
        if path is not None:
            check_writable(path, name, FIGURE_SUFFIXES)
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
        if mode.law != "viscous":
            strength = f"{mode.law_strength:.3f} +- {mode.law_strength_se:.3f}"
            console.print(f"damping: viscous and {mode.law}, {strength} times as strong at the start")
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

        save_figure(plot_decay(data, first), plot)
        console.print(f"Written: {file_line(plot)}")
    if stabilisation is not None:
        from snapbeam.lab.plot.fit_decay import plot_stabilisation

        save_figure(plot_stabilisation(data, first), stabilisation)
        console.print(f"Written: {file_line(stabilisation)}")
    if strict:
        refuse(diagnostics, str(signal))
    add_json(**{name: fit.summary() for name, fit in fits.items()})
