"""``snapbeam dynamics``: lifetimes, bifurcation diagrams, Lyapunov exponents, sections, orbits, basins, edge states."""

from __future__ import annotations

import time
from difflib import get_close_matches
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
import typer

from snapbeam.cli import parameter_options as opt
from snapbeam.cli.console import FAILED, add_json, cli_command, duration, file_line, out, progress
from snapbeam.cli.parameter_options import BEAM, CONTACT, DRIVE, MODEL, RUN, STRIKER, configured, with_parameters
from snapbeam.cli.short_help import ShortHelpCommand, ShortHelpGroup

if TYPE_CHECKING:
    import xarray as xr

    from snapbeam.dynamics.basins import BasinEntropy
    from snapbeam.model.parameter_file import Config


class _Analyses(ShortHelpGroup):
    """The commands, with a suggestion for a name that is part of a command or a word of its description."""

    def resolve_command(self, ctx: Any, args: list[str]) -> Any:
        """Suggest a command where none has the name."""
        if args and self.get_command(ctx, args[0]) is None and not ctx.resilient_parsing:
            near = self._near(args[0])
            if near:
                ctx.fail(f"No such command {args[0]!r}. Did you mean {' or '.join(map(repr, near))}?")
        return super().resolve_command(ctx, args)

    def _near(self, name: str) -> list[str]:
        words = name.lower().replace("_", "-")
        named = [each for each in self.commands if words in each or each in words]
        first = {each: str(command.help or "").partition("\n")[0].lower() for each, command in self.commands.items()}
        described = [each for each, text in first.items() if words.rstrip("s") in text]
        return named or get_close_matches(words, self.commands) or (described if len(words) > 3 else [])


dynamics = typer.Typer(
    cls=_Analyses,
    help="Nonlinear dynamics: lifetimes, bifurcation diagrams, Lyapunov spectra, Poincare sections, branches, basins "
    "and edge states.",
    no_args_is_help=True,
    rich_markup_mode="markdown",
)
_ALL = (*DRIVE, *STRIKER, *BEAM, *MODEL, *CONTACT, *RUN)
_AXES = ("drive.frequency_ratio", "drive.velocity_amplitude", "contact.location", "model.modes")
_OWN = "Analysis"
_BRANCHES = 0.1
"""Difference of two sweeps, over the maximum, from which they are reported as two branches."""
_FEW = 4000
"""Maximum size of a variable in the JSON output."""
_SETTLING = "16 time constants of the slowest mode, at least 200 and at most 20,000"
Output = Annotated[
    Path, typer.Option("--output", "-o", help="NetCDF file to write.", rich_help_panel="Output", metavar="FILE")
]
Parameter = Annotated[str, typer.Option(help="Parameter to vary (velocity_amplitude).", rich_help_panel=_OWN)]
Values = Annotated[
    str, typer.Option(help="Values of the parameter, start:stop:count.", rich_help_panel=_OWN, metavar="VALUES")
]


def _checked(output: Path, plot: Path | None) -> None:
    from snapbeam.cli.console import check_pictures
    from snapbeam.util.files import check_writable

    check_writable(output, "output", (".nc",))
    check_pictures(("plot", plot))


def _extremes(dataset: xr.Dataset, statistic: str) -> list[str]:
    """Return the maximum of a statistic in each direction of a sweep, and where both directions differ."""
    from snapbeam.cli.summary import coordinate_text, statistic_text
    from snapbeam.plot.units import in_units

    dataset = in_units(dataset)
    values, name = dataset[statistic], str(dataset.attrs["parameter"])
    lines = []
    for direction in values["sweep"].values:
        part = values.sel(sweep=direction).dropna(name) if values.dtype.kind == "f" else values.sel(sweep=direction)
        if part.size:
            at = part.isel({name: int(part.values.argmax())})
            where = coordinate_text(dataset, name, at[name].item())
            text = statistic_text(dataset, statistic, at.item())
            text = text if text.startswith("maximum ") else f"maximum {text}"
            lines.append(f"{direction}: {text} at {where}")
    if values.sizes["sweep"] == 2 and values.dtype.kind == "f":
        one, other = (values.isel(sweep=i).values for i in (0, 1))
        apart = np.abs(one - other) > _BRANCHES * np.nanmax(np.abs(values.values), initial=0.0)
        if apart.any():
            ends = (coordinate_text(dataset, name, each) for each in values[name].values[apart][[0, -1]].tolist())
            lines.append(f"both directions differ by more than 10 % of the maximum between {' and '.join(ends)}")
    return lines


def _interval(name: str, text: str, settings: Config, parameter: str) -> tuple[float, float]:
    """Minimum and maximum of a parameter, in its unit."""
    from snapbeam.model.parameters import lookup

    return opt.parse_range(name, text, lookup(settings.full_name(parameter)).quantity.unit)


def _plain(found: object) -> str:
    """The representation of a result, without its angle brackets."""
    return repr(found).removeprefix("<").removesuffix(">")


def _finish(dataset: xr.Dataset, output: Path, plot: Path | None, lines: list[str]) -> None:
    """Write, draw and print the results."""
    from snapbeam.cli.console import draw_computed, write_map
    from snapbeam.cli.summary import initial_well_lines

    reason = dataset.attrs.get("termination_reason")
    if reason and not any(str(reason) in line for line in lines):
        lines = [*lines, f"stopped: {reason}"]
    lines = [*initial_well_lines(dataset), *lines]
    files = [write_map(dataset, output)]
    if plot is not None:
        files.append(draw_computed(dataset, plot, output))
    small = {str(name): each.values for name, each in dataset.data_vars.items() if each.size <= _FEW}
    add_json(results=small, summary=lines, files=files)
    out().print(*lines, *(f"Written: {file_line(path)}" for path in files), sep="\n")


@dynamics.command("lifetimes", cls=ShortHelpCommand)
@cli_command
@with_parameters(*_ALL, axes=_AXES)
def lifetimes(
    given: Any,
    initial_conditions: Annotated[
        int | None, opt.count_option("Number of initial conditions at each point (32).", _OWN)
    ] = None,
    seed: Annotated[int | None, opt.count_option("Seed of the initial conditions (0).", _OWN)] = None,
    phase: Annotated[
        bool, typer.Option("--phase", help="Sample the initial phase of the drive too.", rich_help_panel=_OWN)
    ] = False,
    settling_cycles: Annotated[
        float | None,
        opt.number_option("Cycles without a zero crossing after which a run counts as settled (50).", _OWN),
    ] = None,
    checkpoint: Annotated[
        Path | None,
        typer.Option(help="Checkpoint folder; an existing one is resumed.", rich_help_panel="Output", metavar="DIR"),
    ] = None,
    output: Output = Path("lifetimes.nc"),
    plot: opt.Plot = None,
    threads: opt.Threads = None,
) -> None:
    """Compute lifetimes of snap-through and the final wells, with confidence intervals.

    snapbeam integrates many initial conditions at each point.

    Example: snapbeam dynamics lifetimes --modes 8 --frequency-ratio 1.625 --velocity-amplitude 0.2:0.5:16
    --initial-conditions 100 -o lifetimes.nc --plot lifetimes.png
    """
    from snapbeam.dynamics.flow import InitialConditions
    from snapbeam.dynamics.lifetimes import LifetimeSettings, lifetime_map

    settings = configured(given)
    _checked(output, plot)
    sampled = InitialConditions(
        count=32 if initial_conditions is None else initial_conditions, phase=phase, seed=0 if seed is None else seed
    )
    begun = time.monotonic()
    cycles = settings.integration.cycles if given.get("integration.cycles") is not None else 1000
    with progress(None, "lifetimes", "points") as report:
        dataset = lifetime_map(
            settings.system, settings.axes() or None, settings.integration.replace(cycles=cycles, threads=threads),
            initial_conditions=sampled, settings=LifetimeSettings(settling_cycles=50.0 if settling_cycles is None else settling_cycles), checkpoint=checkpoint,
            progress=report,
        )  # fmt: skip
    runs = int(dataset["last_snap"].size)
    lines = [f"{runs} runs in {duration(time.monotonic() - begun)}"]
    if dataset["lifetime"].ndim == 0:
        low, value, high = (float(dataset[name]) for name in ("lifetime_low", "lifetime", "lifetime_high"))
        lines.append(f"lifetime {value:.4g} cycles, {low:.4g} to {high:.4g} at {100 * dataset.attrs['confidence']:g} %")
        ends = ", ".join(
            f"{name} {float(p):.3g}" for name, p in zip(dataset["well"].values, dataset["end_probability"], strict=True)
        )
        lines.append(f"ends in the well: {ends}")
    else:
        known = int(dataset["lifetime"].notnull().sum())
        lines.append(f"a lifetime at {known} of {dataset['lifetime'].size} points")
    _finish(dataset, output, plot, lines)


@dynamics.command("bifurcation-diagram", cls=ShortHelpCommand)
@cli_command
@with_parameters(*_ALL)
def bifurcation_diagram(
    given: Any,
    parameter: Parameter = "velocity_amplitude",
    values: Values = "0.01:0.6:200",
    initial_conditions: Annotated[
        int | None, opt.count_option("Number of initial conditions at each value, in addition to the sweeps (0).", _OWN)
    ] = None,
    periods: Annotated[int | None, opt.count_option("Periods to record at each value (32).", _OWN)] = None,
    transient: Annotated[
        int | None, opt.count_option(f"Transient periods to discard at each value ({_SETTLING}).", _OWN)
    ] = None,
    output: Output = Path("bifurcation_diagram.nc"),
    plot: opt.Plot = None,
    threads: opt.Threads = None,
) -> None:
    """Compute a bifurcation diagram, with an upward and a downward sweep; each value starts from the last state.

    Example: snapbeam dynamics bifurcation-diagram --modes 8 --frequency-ratio 1.4 --values 0.01:0.3:400 --plot diagram.png
    """
    from snapbeam.dynamics.swept import bifurcation_diagram as diagram_of
    from snapbeam.model.parameter_file import parsed_axis

    settings = configured(given)
    _checked(output, plot)
    points = parsed_axis(settings.full_name(parameter), values)
    begun = time.monotonic()
    with progress(None, "bifurcation diagram", "values") as report:
        dataset = diagram_of(
            settings.system, parameter, points, settings.integration.replace(threads=threads), initial_conditions=initial_conditions or 0,
            periods=(transient, 32 if periods is None else periods), progress=report,
        )  # fmt: skip
    lines = [f"{points.size} values in {duration(time.monotonic() - begun)}"]
    for sweep in dataset["sweep"].values[:2]:
        found = dataset["minimal_period"].sel(sweep=sweep).values
        kinds = ", ".join(f"{int((found == m).sum())} of period {m}" for m in np.unique(found) if m > 0)
        lines.append(f"{sweep}: {kinds or 'no value repeats'}, {int((found == 0).sum())} that do not repeat")
    _finish(dataset, output, plot, lines)


@dynamics.command("hysteresis", cls=ShortHelpCommand)
@cli_command
@with_parameters(*_ALL)
def hysteresis(
    given: Any,
    parameter: Parameter = "velocity_amplitude",
    values: Values = "0.01:0.6:200",
    statistic: Annotated[
        str, typer.Option(help="Statistic that --plot draws (peak_midspan_displacement).", rich_help_panel=_OWN)
    ] = "peak_midspan_displacement",
    output: Output = Path("hysteresis.nc"),
    plot: opt.Plot = None,
) -> None:
    """Sweep a parameter up and down, with every statistic of a run at each value; each run starts from the last state.

    Example: snapbeam dynamics hysteresis --config harvester.toml --parameter base_excitation.frequency_ratio
    --values 0.2:1.4:25 --statistic harvested_power_last_quarter --plot power.png
    """
    from snapbeam.cli.console import check_pictures, draw_computed, write_map
    from snapbeam.cli.summary import initial_well_lines
    from snapbeam.dynamics.swept import hysteresis as swept
    from snapbeam.model.parameter_file import parsed_axis
    from snapbeam.solver.statistics import STATISTICS
    from snapbeam.util.files import check_writable
    from snapbeam.util.status_codes import RunStatus
    from snapbeam.util.validation import choice

    settings = configured(given)
    check_writable(output, "output", (".nc",))
    check_pictures(("plot", plot))
    choice("statistic", statistic, tuple(STATISTICS))
    points = parsed_axis(settings.full_name(parameter), values)
    begun = time.monotonic()
    with progress(None, "hysteresis", "values") as report:
        dataset = swept(settings.system, parameter, points, settings.integration, progress=report)
    failed = int((dataset["status"] != RunStatus.OK).sum())
    lines = [
        f"{points.size} values up and down in {duration(time.monotonic() - begun)}, {failed} runs failed or not run",
        *initial_well_lines(dataset),
        *_extremes(dataset, statistic),
    ]
    files = [write_map(dataset, output)]
    if plot is not None:
        files.append(draw_computed(dataset, plot, output, statistic))
    add_json(summary=lines, files=files)
    out().print(*lines, *(f"Written: {file_line(path)}" for path in files), sep="\n")
    if failed:
        raise typer.Exit(FAILED)


@dynamics.command("backbone-curve", cls=ShortHelpCommand)
@cli_command
@with_parameters(*BEAM, *MODEL)
def backbone_curve(
    given: Any,
    well: Annotated[
        str, typer.Option(help="Motion about the lower or the upper well, or across both.", rich_help_panel=_OWN)
    ] = "lower",
    mode: Annotated[
        int | None, opt.count_option("Linear mode in which the motion about a well begins (1).", _OWN)
    ] = None,
    amplitude_limit: Annotated[
        float | None, opt.number_option("Displacement of the centre, over b, where the curve ends (2.5).", _OWN)
    ] = None,
    max_points: Annotated[int | None, opt.count_option("Maximum number of points of the curve (200).", _OWN)] = None,
    output: Output = Path("backbone_curve.nc"),
    plot: opt.Plot = None,
) -> None:
    """Compute a backbone curve: frequency of the free, undamped motion over its amplitude, with its stability.

    Example: snapbeam dynamics backbone-curve --modes 3 --well both -o backbone.nc --plot backbone.png
    """
    from snapbeam.cli.console import check_pictures, draw_computed, write_map
    from snapbeam.dynamics.backbone import backbone_curve as curve_of
    from snapbeam.util.files import check_writable

    settings = configured(given)
    check_writable(output, "output", (".nc",))
    check_pictures(("plot", plot))
    begun = time.monotonic()
    with progress(None, "backbone curve", "points") as report:
        chosen = {"mode": mode, "amplitude_limit": amplitude_limit, "max_points": max_points}
        named = {name: value for name, value in chosen.items() if value is not None}
        curve = curve_of(settings.free_system, well=well, progress=report, **named)  # type: ignore[arg-type]
    hertz, stable = curve["frequency"].values, curve["stable"].values
    lines = [
        f"{hertz.size} motions in {duration(time.monotonic() - begun)}, {hertz[0]:.5g} to {hertz[-1]:.5g} Hz; "
        f"{int(stable.sum())} stable",
        f"The curve ends: {curve.attrs['end']}",
    ]
    files = [write_map(curve, output)]
    if plot is not None:
        files.append(draw_computed(curve, plot, output))
    add_json(summary=lines, files=files)
    out().print(*lines, *(f"Written: {file_line(path)}" for path in files), sep="\n")


@dynamics.command("lyapunov-spectrum", cls=ShortHelpCommand)
@cli_command
@with_parameters(*_ALL, axes=_AXES[:3])
def lyapunov_spectrum(
    given: Any,
    k: Annotated[int | None, opt.count_option("Number of Lyapunov exponents, largest first (1).", _OWN)] = None,
    periods: Annotated[int | None, opt.count_option("Periods to average over (500).", _OWN)] = None,
    transient: Annotated[int | None, opt.count_option(f"Transient periods to discard ({_SETTLING}).", _OWN)] = None,
    output: Output = Path("lyapunov_spectrum.nc"),
    plot: opt.Plot = None,
    threads: opt.Threads = None,
) -> None:
    """Compute Lyapunov exponents (1/s) by tangents, or a map of the largest exponent.

    For the exponents of a transient set --transient 0.

    Example: snapbeam dynamics lyapunov-spectrum --modes 8 --frequency-ratio 1.4 --velocity-amplitude 0.01 --k 4
    """
    from snapbeam.dynamics.lyapunov import lyapunov_spectrum as spectrum_of

    settings = configured(given)
    _checked(output, plot)
    begun = time.monotonic()
    with progress(None, "Lyapunov spectrum", "periods") as report:
        dataset = spectrum_of(
            settings.system, 1 if k is None else k, 500 if periods is None else periods,
            transient=transient, axes=settings.axes() or None,
            integration=settings.integration.replace(threads=threads), progress=report,
        )  # fmt: skip
    lines = [f"in {duration(time.monotonic() - begun)}"]
    if "running" in dataset:
        for i in range(min(dataset.sizes["exponent_number"], 6)):
            value, error = (float(dataset[name][0, i]) for name in ("exponent", "exponent_error"))
            # on a periodic orbit all blocks agree; what remains is the finite time, of the order of 1/T
            finite = 1.0 / (dataset.attrs["periods"] * dataset.attrs["period"])
            words = f"+- {error:.2g}" if error > finite else f"+- {finite:.2g}, from the finite time"
            lines.append(
                f"exponent {i + 1}: {value:.4g} {words}, 1/s; {value * dataset.attrs['period']:.4g} per period"
            )
    _finish(dataset, output, plot, lines)


@dynamics.command("poincare-section", cls=ShortHelpCommand)
@cli_command
@with_parameters(*_ALL)
def poincare_section(
    given: Any,
    at: Annotated[
        str, typer.Option(help="Section: stroboscopic or impact.", rich_help_panel=_OWN, metavar="KIND")
    ] = "stroboscopic",
    periods: Annotated[int | None, opt.count_option("Periods to record (1000).", _OWN)] = None,
    transient: Annotated[int | None, opt.count_option(f"Transient periods to discard ({_SETTLING}).", _OWN)] = None,
    output: Output = Path("poincare_section.nc"),
    plot: opt.Plot = None,
) -> None:
    """Compute a Poincare section: one state per period, or one at the onset of each impact.

    Example: snapbeam dynamics poincare-section --modes 1 --frequency-ratio 1.625 --velocity-amplitude 0.3
    --plot section.png
    """
    from snapbeam.dynamics.sections import poincare_section as section_of

    settings = configured(given)
    _checked(output, plot)
    dataset = section_of(
        settings.system, at, 1000 if periods is None else periods,
        transient=transient, integration=settings.integration,
    )  # fmt: skip
    _finish(dataset, output, plot, [f"{dataset.sizes['point']} points"])


@dynamics.command("branch", cls=ShortHelpCommand)
@cli_command
@with_parameters(*_ALL)
def branch(
    given: Any,
    parameter: Parameter = "velocity_amplitude",
    bounds: Annotated[str, typer.Option(help="Bounds of the parameter, low:high.", rich_help_panel=_OWN)] = "0.005:0.3",
    direction: Annotated[str, typer.Option(help="Initial direction: up or down.", rich_help_panel=_OWN)] = "up",
    period: Annotated[int | None, opt.count_option("Period of the orbit in periods of the drive (1).", _OWN)] = None,
    transient: Annotated[
        int | None, opt.count_option("Transient periods to integrate before the search (500).", _OWN)
    ] = None,
    max_points: Annotated[int | None, opt.count_option("Maximum number of orbits (500).", _OWN)] = None,
    output: Output = Path("branch.nc"),
    plot: opt.Plot = None,
) -> None:
    """Continue a periodic orbit along a parameter, and locate folds, flips and grazing.

    Example: snapbeam dynamics branch --modes 1 --frequency-ratio 1.6 --velocity-amplitude 0.03 --bounds 0.005:0.3
    """
    from snapbeam.dynamics.branches import continuation
    from snapbeam.dynamics.periodic_orbits import periodic_orbit
    from snapbeam.dynamics.shooting import OrbitNotFoundError

    settings = configured(given)
    _checked(output, plot)
    limits = _interval("bounds (--bounds)", bounds, settings, parameter)
    begun = time.monotonic()
    options = None if given.get("integration.accuracy") is None else settings.integration
    try:
        orbit = periodic_orbit(
            settings.system, period=1 if period is None else period, transient=500 if transient is None else transient,
            integration=options,
        )  # fmt: skip
    except OrbitNotFoundError as error:
        from snapbeam.util.validation import InputError

        raise InputError(f"no orbit of period {1 if period is None else period}: {error}") from None
    found = continuation(
        orbit, parameter, limits, direction=direction, max_points=500 if max_points is None else max_points
    )
    lines = [_plain(found), *map(_plain, found.special_points), f"in {duration(time.monotonic() - begun)}"]
    _finish(found.to_dataset(), output, plot, lines)


@dynamics.command("manifold", cls=ShortHelpCommand)
@cli_command
@with_parameters(*_ALL)
def manifold(
    given: Any,
    stability: Annotated[
        str, typer.Option(help="Manifold: unstable or stable.", rich_help_panel=_OWN, metavar="KIND")
    ] = "unstable",
    period: Annotated[int | None, opt.count_option("Period of the saddle in periods of the drive (1).", _OWN)] = None,
    max_arclength: Annotated[
        float | None, opt.number_option("Length of each branch, in units of the well's amplitude (10).", _OWN)
    ] = None,
    max_seconds: Annotated[
        float | None, opt.number_option("Time after which the manifold ends as it is, s.", _OWN)
    ] = None,
    output: Output = Path("manifold.nc"),
    plot: opt.Plot = None,
) -> None:
    """Compute the one-dimensional unstable or stable manifold of the saddle orbit near the straight beam.

    Example: snapbeam dynamics manifold --modes 1 --frequency-ratio 1.6 --velocity-amplitude 0.03 --plot manifold.png
    """
    from snapbeam.dynamics.manifolds import invariant_manifold
    from snapbeam.dynamics.periodic_orbits import periodic_orbit
    from snapbeam.dynamics.shooting import OrbitNotFoundError
    from snapbeam.util.validation import InputError

    settings = configured(given)
    _checked(output, plot)
    begun = time.monotonic()
    options = None if given.get("integration.accuracy") is None else settings.integration
    straight = np.zeros(2 * settings.system.model.modes)
    try:
        saddle = periodic_orbit(settings.system, straight, 1 if period is None else period, integration=options)
    except OrbitNotFoundError as error:
        raise InputError(f"no saddle near the straight beam: {error}") from None
    with progress(None, "manifold", "percent of the length") as report:
        curve = invariant_manifold(
            saddle, stability, max_arclength=10.0 if max_arclength is None else max_arclength, max_seconds=max_seconds,
            progress=lambda share: report(round(100.0 * share), 100),
        )  # fmt: skip
    lines = [
        _plain(saddle),
        f"{curve.sizes['point']} points in {duration(time.monotonic() - begun)}",
        f"ends of the branches: {curve.attrs['termination_reason']}",
    ]
    _finish(curve, output, plot, lines)


@dynamics.command("bifurcation-curve", cls=ShortHelpCommand)
@cli_command
@with_parameters(*_ALL)
def bifurcation_curve(
    given: Any,
    parameter: Parameter = "velocity_amplitude",
    bounds: Annotated[str, typer.Option(help="Bounds of the parameter, low:high.", rich_help_panel=_OWN)] = "0.005:0.3",
    second: Annotated[
        str, typer.Option(help="Second parameter of the curve.", rich_help_panel=_OWN)
    ] = "frequency_ratio",
    second_bounds: Annotated[
        str, typer.Option(help="Bounds of the second parameter, low:high.", rich_help_panel=_OWN)
    ] = "0.5:3",
    number: Annotated[
        int | None,
        opt.count_option("Number of the fold, flip, Neimark-Sacker point or grazing of the branch (1).", _OWN),
    ] = None,
    period: Annotated[int | None, opt.count_option("Period of the orbit in periods of the drive (1).", _OWN)] = None,
    transient: Annotated[
        int | None, opt.count_option("Transient periods to integrate before the search (500).", _OWN)
    ] = None,
    max_points: Annotated[int | None, opt.count_option("Maximum number of points to either side (200).", _OWN)] = None,
    output: Output = Path("bifurcation_curve.nc"),
    plot: opt.Plot = None,
) -> None:
    """Continue a fold, flip, Neimark-Sacker point or grazing in two parameters, and locate points of codimension two.

    A periodic orbit is continued along the first parameter until the point with this number is found.

    Example: snapbeam dynamics bifurcation-curve --modes 1 --frequency-ratio 1.6 --velocity-amplitude 0.03 --second-bounds 1.2:2
    """
    from snapbeam.dynamics.bifurcation_curves import CURVES
    from snapbeam.dynamics.bifurcation_curves import bifurcation_curve as curve_of
    from snapbeam.dynamics.branches import continuation
    from snapbeam.dynamics.periodic_orbits import periodic_orbit
    from snapbeam.dynamics.shooting import OrbitNotFoundError
    from snapbeam.util.validation import InputError

    settings = configured(given)
    _checked(output, plot)
    limits = _interval("bounds (--bounds)", bounds, settings, parameter)
    others = _interval("second_bounds (--second-bounds)", second_bounds, settings, second)
    wanted = 1 if number is None else number
    begun = time.monotonic()
    options = None if given.get("integration.accuracy") is None else settings.integration
    try:
        orbit = periodic_orbit(
            settings.system, period=1 if period is None else period, transient=500 if transient is None else transient,
            integration=options,
        )  # fmt: skip
        branch = continuation(orbit, parameter, limits)
        found = [point for point in branch.special_points if point.kind in CURVES]
        if len(found) < wanted:
            raise InputError(
                f"number (--number) = {wanted}: the branch in {parameter} has {len(found)} such points: "
                f"{', '.join(map(_plain, branch.special_points)) or 'none'}"
            )
        curve = curve_of(
            found[wanted - 1],
            (second, parameter),
            (others, limits),
            max_points=200 if max_points is None else max_points,
        )
    except OrbitNotFoundError as error:
        raise InputError(f"no such curve: {error}") from None
    names = curve.attrs["parameters"]
    lines = [
        f"{_plain(found[wanted - 1])}: {curve.sizes['point']} points in {duration(time.monotonic() - begun)}",
        *(
            f"{kind} at " + ", ".join(f"{name} = {float(curve[f'special_point_{name}'][k]):.8g}" for name in names)
            for k, kind in enumerate(curve["special_point_kind"].values)
        ),
        f"The curve ends: {curve.attrs['termination_reason']}",
    ]
    _finish(curve, output, plot, lines)


@dynamics.command("basins", cls=ShortHelpCommand)
@cli_command
@with_parameters(*_ALL)
def basins(
    given: Any,
    amplitudes: Annotated[
        str, typer.Option(help="Values of amplitude[1], start:stop:count.", rich_help_panel=_OWN)
    ] = "-1.6:1.6:200",
    velocities: Annotated[
        str, typer.Option(help="Values of velocity[1], start:stop:count.", rich_help_panel=_OWN)
    ] = "-1:1:200",
    periods: Annotated[
        int | None,
        opt.count_option(
            "Periods after which a state counts as undecided (16 time constants of the slowest decay, at least 200 "
            "and at most 20,000).",
            _OWN,
        ),
    ] = None,
    states: Annotated[int | None, opt.count_option("Initial states of the search for attractors (200).", _OWN)] = None,
    output: Output = Path("basins.nc"),
    plot: opt.Plot = None,
    threads: opt.Threads = None,
) -> None:
    """Find and verify attractors, and compute their basins over the first modal amplitude and its velocity.

    The search draws amplitude[1] from -1.4 to 1.4 and velocity[1] from -0.6 to 0.6, and discards 16 time constants, at
    least 1000 periods; its bound for attractors that were not found applies to that region, not to the plane.

    Example: snapbeam dynamics basins --modes 1 --frequency-ratio 1.6 --velocity-amplitude 0.03 --plot basins.png
    """
    from snapbeam.dynamics.attractors import find_attractors
    from snapbeam.dynamics.basins import basin_entropy
    from snapbeam.dynamics.basins import basins_of_attraction as basins_of
    from snapbeam.model.parameter_axes import parse_axis

    settings = configured(given)
    _checked(output, plot)
    begun = time.monotonic()
    grid = {"amplitude[1]": parse_axis("amplitudes", amplitudes), "velocity[1]": parse_axis("velocities", velocities)}
    found = find_attractors(
        settings.system, 200 if states is None else states, integration=settings.integration.replace(threads=threads)
    )
    with progress(None, "basins", "periods") as report:
        dataset = basins_of(found, grid, periods=periods, progress=report)
    lines = [f"{len(found.attractors)} attractors in {duration(time.monotonic() - begun)}"]
    for number, each in enumerate(found.attractors):
        share = 100.0 * float((dataset["basin"] == number).mean())
        lines.append(f"{number}: {_plain(each)}, {share:.3g} % of the plane")
    lines.append(
        f"attractors that were not found have less than {100 * found.unseen_share():.2g} % of the sampled region, at 95 % "
        f"({found.labels.size} states)"
    )
    if found.undecided > 0.0:
        lines.append(f"search for attractors: {found.termination_reason}")
    share, low, high = (100 * dataset.attrs[f"sensitive_share{end}"] for end in ("", "_low", "_high"))
    lines.append(
        f"undecided: {100 * dataset.attrs['undecided']:.3g} %; label changes at half the step: {share:.2g} % of the plane "
        f"({low:.2g} to {high:.2g} % at 95 %)"
    )
    lines += _entropy_lines(basin_entropy(dataset["basin"].values, 5))
    _finish(dataset, output, plot, lines)


def _entropy_lines(entropy: BasinEntropy) -> list[str]:
    over = "" if entropy.undecided == 0.0 else " over the decided states"
    lines = [
        f"basin entropy{over} {entropy.basin:.3f} +- {entropy.basin_error:.1g}, at borders {entropy.boundary:.3f} +- "
        f"{entropy.boundary_error:.1g}{': fractal' if entropy.is_fractal else ''}"
    ]
    if over:
        (low, high), (least, most) = entropy.basin_bounds, entropy.boundary_bounds
        lines.append(
            f"basin entropy over all states: {low:.3f} to {high:.3f}, at borders {least:.3f} to {most:.3f}, whichever of "
            "these attractors the undecided states go to"
        )
    return lines


@dynamics.command("edge", cls=ShortHelpCommand)
@cli_command
@with_parameters(*_ALL)
def edge(
    given: Any,
    initial_velocity: Annotated[
        float | None,
        opt.number_option(
            "Initial velocity of the first mode, divided by omega_1 times the amplitude of the well, that makes the beam "
            "snap through (doubled from 0.1 until it does).",
            _OWN,
        ),
    ] = None,
    periods: Annotated[int | None, opt.count_option("Periods to track the edge for (60).", _OWN)] = None,
    horizon: Annotated[
        int | None, opt.count_option("Periods after which a run is classified as snapping or not (40).", _OWN)
    ] = None,
    output: Output = Path("edge.nc"),
    plot: opt.Plot = None,
) -> None:
    """Track the edge state between two outcomes, and find the unstable orbit on it.

    Example: snapbeam dynamics edge --modes 1 --damping-ratio 0.05 --frequency-ratio 0.7 --velocity-amplitude 0.14
    --plot edge.png
    """
    from snapbeam.dynamics.edge_states import edge_tracking, kicked
    from snapbeam.dynamics.stroboscope import Stroboscope

    settings = configured(given)
    _checked(output, plot)
    ahead = 40 if horizon is None else horizon
    how = settings.integration
    flow = Stroboscope(
        settings.system, how if given.get("integration.accuracy") is not None else how.replace(accuracy="reference")
    )
    begun = time.monotonic()
    found = edge_tracking(
        flow, *kicked(flow, initial_velocity, ahead), periods=60 if periods is None else periods, horizon=ahead
    )
    lines = [_plain(found), f"in {duration(time.monotonic() - begun)}"]
    _finish(found.to_dataset(), output, plot, lines)
