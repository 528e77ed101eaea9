"""``snapbeam map``: the response class over frequency, amplitude, location, or any parameters."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Annotated, Any

import typer

from snapbeam.cli import parameter_options as opt
from snapbeam.cli.console import (
    FAILED,
    add_json,
    check_outputs,
    cli_command,
    draw_computed,
    out,
    read_overlay,
    write_map,
)
from snapbeam.cli.parameter_options import ALL, AXES, configured, with_parameters
from snapbeam.model.quantity import split_name
from snapbeam.util.files import require_room, set_request
from snapbeam.util.validation import InputError, choice


@cli_command
@with_parameters(*ALL, axes=AXES)
@opt.with_checkpoint
def compute_map(
    given: Any,
    keeping: Any,
    output: opt.Output = Path("map.nc"),
    plot: opt.Plot = None,
    variable: Annotated[
        str | None,
        opt.option("Statistic that --plot draws, such as peak_force; the response class by default.", "Output", "NAME"),
    ] = None,
    over: opt.CurvesOver = None,
    measurements: opt.Measurements = None,
    quasi_static_line: opt.QuasiStaticLine = False,
    threads: opt.Threads = None,
) -> None:
    """Compute a map of response classes and print a summary.

    The command runs one simulation for each point of the axes.  It writes the response classes (intrawell, transient
    interwell 1 and 2, continuous interwell) and the statistics to a NetCDF file.

    Example: snapbeam map --modes 32 --cycles 200 --frequency-ratio 0.1:4:64 --velocity-amplitude
    0.01:0.65:40 --location 1/2.1 -o map.nc --plot map.png
    """
    from snapbeam.cli.summary import map_facts, map_summary

    settings = opt.resumed(given, keeping, configured(given, _axes_of))
    axes = _axes_of(settings, given)
    stored = opt.kept_config(settings, keeping)
    set_request([settings.system.hash, settings.integration, axes, stored["options"]])
    check_outputs(output, plot)
    variable = _checked_variable(variable, settings, plot, overlaid=measurements is not None or quasi_static_line)
    _check_over(over, variable, settings, axes)
    if plot is not None:
        _check_axes(plot, axes, variable)
    system = settings.system
    beam = system.model.beam
    overlay = read_overlay(
        measurements, system.model.reference_frequency, None if beam is None else beam.buckling_level
    )

    from snapbeam.sweeps.compute import LEAST_BYTES, CheckpointOptions, SweepReport, compute_sweep
    from snapbeam.sweeps.setup import sweep_setup

    setup = sweep_setup(system, axes, settings.integration.replace(threads=threads))
    require_room(output, LEAST_BYTES * setup.points.size)
    asked = opt.sweep_options(keeping)
    total = setup.points.size
    start = time.monotonic()
    counts = SweepReport()
    with opt.report(total, keeping["log"], keeping["checkpoint"]) as say:
        kept = CheckpointOptions(
            keeping["checkpoint"], keeping["check_checkpoint"], keeping["points_per_task"], stored,
            say.note, counts,
        )  # fmt: skip
        dataset = compute_sweep(
            setup, kept, output=output if opt.is_long(keeping) and not kept.check_checkpoint else None,
            progress=say.progress, **asked,
        )  # fmt: skip
        lines = opt.sweep_report_lines(counts, keeping["checkpoint"], time.monotonic() - start)
        for line in lines:
            say.log(line)
    if keeping["check_checkpoint"]:
        out().print(*lines, sep="\n", markup=False)
        raise typer.Exit(FAILED if counts.failed else 0)
    elapsed = time.monotonic() - start
    if not opt.is_long(keeping):
        write_map(dataset, output)
    files = [output]
    if plot is not None:
        curves: dict[str, Any] = {} if over is None else {"over": over}
        overlays = {"measurements": overlay, "quasi_static_line": quasi_static_line}
        files.append(
            draw_computed(dataset, plot, output, variable, **curves)
            if variable not in (None, "response_class")
            else draw_computed(dataset, plot, output, "response_class", **overlays)
        )
    add_json(**map_facts(dataset, variable), seconds=elapsed, files=files)
    out().print(map_summary(dataset, files, None if opt.is_long(keeping) else elapsed, variable))
    out().print(*lines, sep="\n", markup=False, end="\n" if lines else "")
    if counts.failed:
        raise typer.Exit(FAILED)


def _axes_of(settings: Any, given: Any) -> dict[str, Any]:
    """The axes that were named.

    Where nothing but the paper's own axes and the number of modes is named, the frequency ratio and the velocity
    amplitude have their default axes unless they have a value.
    """
    from snapbeam.model.parameter_file import DEFAULT_AXES, parsed_axis, same_axis
    from snapbeam.model.parameters import ratio_of

    named: dict[str, Any] = settings.axes()
    order = ("model.modes", "drive.frequency_ratio", "drive.velocity_amplitude", "contact.location")
    if any(text for text in given.get("sweep") or ()) or any(ratio_of(name) not in order for name in named):
        return named
    drive = settings.section("drive")
    axes = dict(named)
    for name, text in DEFAULT_AXES.items():
        own = {split_name(each)[1] for each in same_axis(name)}
        if not same_axis(name) & named.keys() and not own & drive.keys():
            axes |= {name: parsed_axis(name, text)}
    axes = {name: axes[name] for name in sorted(axes, key=lambda each: order.index(ratio_of(each)))}
    if not axes:
        import numpy as np

        striker = settings.system.striker
        return {"contact.location": np.array([striker.location])}
    return axes


def _checked_variable(variable: str | None, settings: Any, plot: Path | None, *, overlaid: bool) -> str | None:
    """Return the name in the map; refused, before any run, if the map will not have it or --plot cannot draw it."""
    from snapbeam.solver.statistics import name_in, rows_for

    if variable is None:
        return None
    rows = rows_for(len(settings.system.contacts))
    choice("variable", variable := name_in(rows, variable), tuple(rows))
    if plot is None:
        raise InputError(f"variable = {variable!r}: names what --plot draws; give --plot FILE")
    if overlaid and variable != "response_class":
        raise InputError(
            f"variable = {variable!r}: measured responses and the quasi-static line are drawn over response classes; "
            "leave them out"
        )
    return variable


def _check_over(over: str | None, variable: str | None, settings: Any, axes: dict[str, Any]) -> None:
    """Refuse, before any run, curves of nothing or over no axis."""
    from snapbeam.model.parameter_file import same_axis

    if over is not None and variable in (None, "response_class"):
        raise InputError(f"over = {over!r}: curves are of a statistic; give --variable, such as peak_force, and --plot")
    if over is not None and not set(same_axis(settings.full_name(over))) & axes.keys():
        raise InputError(f"over = {over!r}: is not an axis of this map; its axes: {', '.join(axes)}")


def _check_axes(path: Path, axes: dict[str, Any], variable: str | None) -> None:
    from snapbeam.model.parameters import lookup
    from snapbeam.solver.statistics import STATISTICS

    many = [lookup(name).short for name, values in axes.items() if len(values) > 1]
    real = variable is not None and STATISTICS[variable].dtype == "float64"
    others = [name for name in many if not lookup(name).name.endswith(".seed")]  # of which the mean is drawn
    if len(many) not in (1, 2) and not (real and 1 <= len(others) <= 2):
        raise InputError(
            f"plot = {str(path)!r}: a map is drawn over one or two axes, not {len(many)} ({', '.join(many)}); "
            "leave --plot out, and plot a slice with snapbeam plot map.nc --at location=0.3"
        )
