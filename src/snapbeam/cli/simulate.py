"""``snapbeam simulate``: one run with its time series, figures and summary."""

from __future__ import annotations

import shlex
import time
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from snapbeam.cli import parameter_options as opt
from snapbeam.cli.console import (
    FAILED,
    add_json,
    check_pictures,
    cli_command,
    draw_computed,
    duration,
    errors,
    file_line,
    kept_if_not_drawn,
    least_picture_size,
    notes,
    out,
)
from snapbeam.cli.parameter_options import BEAM, CONTACT, DRIVE, MODEL, RUN, STRIKER, configured, with_parameters
from snapbeam.util.files import check_writable, require_room_of
from snapbeam.util.netcdf import read_netcdf
from snapbeam.util.validation import InputError, choice, integer

if TYPE_CHECKING:
    pass


@cli_command
@with_parameters(*DRIVE, *STRIKER, *BEAM, *MODEL, *CONTACT, *RUN, "integration.tolerance")
def simulate(
    given: Any,
    recorded_drive: Annotated[
        Path | None,
        opt.option(
            "Recorded motion instead of the sinusoidal one: a file that snapbeam vibrometer --drive-output wrote.",
            "Striker and drive",
            "FILE",
        ),
    ] = None,
    output: Annotated[
        Path | None,
        typer.Option("--output", "-o", help="NetCDF file to write.", rich_help_panel="Output", metavar="FILE"),
    ] = None,
    plot: opt.Plot = None,
    animate: Annotated[
        Path | None,
        opt.option(
            "Animation to write, .mp4 or .gif: the moving beam and the waveform, in slow motion near "
            "the impact with the highest force.",
            "Output",
            "FILE",
        ),
    ] = None,
    window: opt.Window = None,
    samples: Annotated[
        int | None,
        opt.count_option("Evenly spaced samples per cycle (default: 200, and every step in contact).", "Output"),
    ] = None,
    save: Annotated[
        str,
        opt.option(
            "Samples in the file of --output: samples (all, default), waveforms (without those of the modes), states "
            "(one each cycle) or statistics (none, for long runs).",
            "Output",
            "CONTENT",
        ),
    ] = "samples",
    stream: Annotated[
        bool,
        opt.option(
            "Write the file during the run, for runs whose samples do not fit in memory; such runs are not plotted.",
            "Output",
            flags="--stream",
        ),
    ] = False,
) -> None:
    """Compute one run and print its response class and statistics.

    Example: snapbeam simulate --frequency-ratio 1.21 --velocity-amplitude 0.18 -o run.nc --plot run.png
    --window 0:20
    """
    from snapbeam.simulation.simulate import least_file_size

    settings = configured(given)
    if output is not None:
        check_writable(output, "output", (".nc",))
    check_pictures(("plot", plot))
    if animate is not None:
        from snapbeam.plot.animation import ANIMATION_SUFFIXES

        check_writable(animate, "animate", ANIMATION_SUFFIXES)
    drawn = {"plot": plot, "animate": animate}
    pictures = {name: (path, least_picture_size(path)) for name, path in drawn.items() if path is not None}
    require_room_of(pictures)
    part = opt.parse_window(window)

    import snapbeam as sb
    from snapbeam.simulation.save import CONTENTS

    if choice("save", save, CONTENTS) != "samples" and (output is None or stream):
        raise sb.InputError(f"save = {save!r}: is of the file of --output, without --stream")
    if stream and (output is None or plot is not None or animate is not None):
        raise sb.InputError("--stream: writes one file, name it with --output; draw it later with snapbeam plot")

    system, integration = settings.system, settings.integration
    if recorded_drive is not None:
        _require_striker(system)
        named = [name for name in ("frequency_ratio", "velocity_amplitude") if given[f"drive.{name}"] is not None]
        if named:
            raise sb.InputError(f"{', '.join(named)}: must be left out with a recorded drive")
        system = system.replace(drive=sb.RecordedMotion.from_dataset(read_netcdf(recorded_drive, "drive")))
    if animate is not None and system.model.beam is None:
        raise sb.InputError("--animate: a structure given by matrices has no shape that moves; use --plot")
    start = time.monotonic()
    run = None
    with _share_done() as progress:
        times = _even(system, integration, samples)
        if save in ("states", "statistics") and not pictures:  # samples that nobody sees are not recorded
            times = [0.0] if save == "statistics" else _even(system, integration, 1)
        if output is not None and not stream:
            kept = _even(system, integration, 1) if save == "states" else times
            size = (
                0.0
                if save == "statistics"
                else least_file_size(system, integration, None if kept is None else len(kept))
            )
            size = 0.0 if save == "waveforms" else size
            _tell_size(size, output)
            require_room_of({"output": (output, size), **pictures})
        if stream and output is not None:
            summary = sb.simulate_to_file(system, integration, path=output, sample_times=times, progress=progress)
        else:
            run = sb.simulate(system, integration, sample_times=times, progress=progress)
            summary = run.summary
    console = out()
    console.print(_summary_text(summary, time.monotonic() - start, system))
    if output is not None:
        if run is not None:
            run.save(output, save)
        console.print(f"Written: {file_line(output)}")
    if run is not None and plot is not None:
        console.print(f"Written: {file_line(draw_computed(run.dataset, plot, output, save=run.save, window=part))}")
    if run is not None and animate is not None:
        console.print(f"Written: {file_line(_animated(run, animate, part, output))}")
    files = [path for path in (output, plot, animate) if path is not None]
    wells = 2 if system.model.is_bistable else 1
    shown = dict(summary) | {"response_class": summary.response_class.label_of(wells)}
    shown |= {"initial_well": system.start_well, "initial_well_reason": system.initial_well_reason}
    add_json(summary=shown, seconds=time.monotonic() - start, system=system.hash, files=files)
    if summary.status not in (sb.RunStatus.OK, sb.RunStatus.EARLY_STOP):
        raise typer.Exit(FAILED)


_LARGE_FILE = 20e6
"""Size of the file of a run above which the command tells it before the run, bytes."""


def _tell_size(least: float, path: Path) -> None:
    if 2.0 * least > _LARGE_FILE:
        notes().print(
            f"{path}: about {2.0 * least / 1e6:.2g} MB; smaller are files with fewer samples per cycle (--samples 50), without "
            "those of the modes (--save waveforms), with one each cycle (--save states), or without any (--save statistics)",
            markup=False,
        )


def _even(system: Any, integration: Any, samples: int | None) -> Any:
    """Instants of so many samples a cycle, evenly spaced to the end; None if no number was given."""
    if samples is None:
        return None
    from snapbeam.simulation.request import cycle_of
    from snapbeam.simulation.simulate import even_instants

    integer("samples", samples, 1, 100_000)
    drive = system.primary_excitation[1]
    cycles = integration.cycles_or_default
    if integration.cycles is None and hasattr(drive, "frequency"):
        cycles = int(round(drive.duration * drive.frequency, 9))
    return even_instants(cycles * cycle_of(system), cycles * samples + 1)


class _share_done:
    """Shows how much of a run is done, once it takes longer than a moment; a bar on a terminal alone."""

    _MOMENT = 1.0

    def __init__(self) -> None:
        self._start = time.monotonic()
        self._bar: Any = None
        self._told = False

    def __enter__(self) -> Any:
        return self._report

    def __exit__(self, *_: object) -> None:
        if self._bar is not None:
            self._bar.stop()

    def _report(self, share: float) -> None:
        taken = time.monotonic() - self._start
        if taken < self._MOMENT or self._told:
            return
        if not errors().is_terminal:
            self._told = True
            notes().print(f"{100.0 * share:.2g} % of the run in {duration(taken)}", markup=False, end="")
            notes().print(f"; about {duration(taken * (1.0 / share - 1.0))} left" if share > 0.0 else "", markup=False)
            return
        if self._bar is None:
            from rich.progress import Progress

            self._bar = Progress(console=errors(), transient=True)
            self._task = self._bar.add_task("run", total=1.0)
            self._bar.start()
        self._bar.update(self._task, completed=share)


_OWN_RECORD = {"base_excitation": "recorded_acceleration", "force": "recorded_force"}
"""Type of a record that a section takes from a parameter file."""


def _require_striker(system: Any) -> None:
    """Refuse a recorded drive of a system without a striker; name the section that takes a record."""
    if system.striker is not None:
        return

    moving = [section for section, _ in system.moving]
    instead = next((section for section in moving if section in _OWN_RECORD), None)
    way = (
        "use a system with a [contact] and without a moving base, load or external force"
        if instead is None
        else f"give the record in the parameter file: [{instead}] with type = {_OWN_RECORD[instead]!r} and its file"
    )
    raise InputError(f"recorded_drive (--recorded-drive): moves a striker, but the system does not have one; {way}")


def _animated(run: Any, path: Path, window: tuple[float, float] | None, kept: Path | None) -> Path:
    import matplotlib

    matplotlib.use("Agg")
    from snapbeam.plot.animation import animate_run

    def again(file: str) -> str:
        code = (
            "import snapbeam; from snapbeam.plot.animation import animate_run; "
            f"animate_run(snapbeam.load({file!r}).dataset, {str(path)!r}, {window})"
        )
        return shlex.join(["python", "-c", code])

    with kept_if_not_drawn(again, kept, run.save):
        return animate_run(run.dataset, path, window)


def _harvest_lines(summary: Any) -> list[str]:
    """Power and voltage of a harvester, over the run and over its last quarter, which leaves out the transient."""
    from snapbeam.util.si_prefixes import prefixed

    energy, whole, late = (
        prefixed(summary[name], unit, 4)
        for name, unit in (
            ("energy_harvested", "J"), ("harvested_power", "W"), ("harvested_power_last_quarter", "W"),
        )
    )  # fmt: skip
    peak, voltage = (prefixed(summary[name], "V", 4) for name in ("peak_voltage", "rms_voltage_last_quarter"))
    steady = f"{late}, {voltage} root mean square"
    if summary.harvested_power_last_quarter != summary.harvested_power_last_quarter:
        steady = "not known: the run ended before it; set integration.early_termination = false"
    return [
        f"  harvested             {energy}; {whole} over the whole run, peak {peak}",
        f"  last quarter          {steady}",
    ]


def _summary_text(summary: Any, elapsed: float, system: Any) -> str:
    from snapbeam.util.si_prefixes import prefixed
    from snapbeam.util.status_codes import RunStatus

    kind, status = summary.response_class, summary.status
    if status not in (RunStatus.OK, RunStatus.EARLY_STOP):
        return f"[bold red]failed[/] ({status.name}): {status.advice}"
    well = "upper" if summary.final_well > 0 else "lower"
    final = ", and stays there for certain" if summary.final_well_proven else ""
    crossings = f"{summary.zero_crossings}, {summary.zero_crossings_last_quarter} of them in the last quarter"
    contact = f"{summary.impacts}, in contact {100.0 * summary.contact_time_fraction:.3g} % of the time"
    scale = prefixed(system.model.length_scale, "m", 4)
    center = f"{summary.min_midspan_displacement:.4g} to {summary.max_midspan_displacement:.4g} b (b = {scale})"
    end = f"in the {well} well{final}"
    reached = "" if summary.other_well_reached else "not "
    other, wells = f"the other well was {reached}reached", 2
    if not system.model.is_bistable:
        wells, end = 1, f"the centre is {'above' if summary.final_well > 0 else 'below'} 0"
        other = f"the beam has one well; its shape was {reached}inverted"
    force = "no finite force" if summary.peak_force != summary.peak_force else prefixed(summary.peak_force, "N", 4)
    work, lost = (prefixed(each, "J", 4) for each in (summary.striker_work, summary.energy_dissipated))
    lines = [
        f"[bold]{kind.label_of(wells)}[/] (in {duration(elapsed)}; {status.advice})",
        f"  at the start          in the {system.initial_well_text}",
        f"  zero crossings        {crossings}",
        f"  at the end            {end}",
        f"  centre displacement   {center}; {other}",
    ]
    if system.striker is not None:
        lines += [
            f"  at the striker        {summary.min_displacement:.4g} to {summary.max_displacement:.4g} b",
            f"  impacts               {contact}",
            f"  peak contact force    {force}",
            f"  striker's work        {work}",
        ]
    if system.base_excitation is not None:
        lines.append(f"  work of the base      {prefixed(summary.base_work, 'J', 4)}")
    if system.external_forces:
        lines.append(f"  work of the forces    {prefixed(summary.force_work, 'J', 4)}")
    lines.append(f"  dissipated            {lost}")
    if system.harvester is not None:
        lines += _harvest_lines(summary)
    if summary.zero_crossings:
        lines.insert(3, f"  last crossing         at {prefixed(summary.last_zero_crossing, 's', 5)}")
    return "\n".join(lines)
