"""``snapbeam dynamics``: lifetimes, bifurcation diagrams, Lyapunov exponents, sections, orbits, basins, edge states."""

from __future__ import annotations

import inspect
import time
from collections.abc import Callable
from dataclasses import dataclass
from difflib import get_close_matches
from pathlib import Path
from types import SimpleNamespace
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
import typer

from snapbeam import dynamics as library
from snapbeam.cli import parameter_options as opt
from snapbeam.cli.console import (
    FAILED,
    add_json,
    check_outputs,
    cli_command,
    draw_computed,
    duration,
    print_written,
    progress,
    write_map,
)
from snapbeam.cli.parameter_options import ALL, BEAM, MODEL, configured, with_parameters
from snapbeam.cli.short_help import ShortHelpCommand, ShortHelpGroup
from snapbeam.util.validation import InputError, choice

if TYPE_CHECKING:
    import xarray as xr
    from numpy.typing import NDArray

    from snapbeam.dynamics.basins import BasinEntropy
    from snapbeam.dynamics.periodic_orbits import PeriodicOrbit
    from snapbeam.model.integration import Integration
    from snapbeam.model.parameter_file import Config
    from snapbeam.model.system import System


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
_AXES = ("drive.frequency_ratio", "drive.velocity_amplitude", "contact.location", "model.modes")
_OWN = "Analysis"
_BRANCHES = 0.1
"""Difference of two sweeps, over the maximum, from which they are reported as two branches."""
_FEW = 4000
"""Maximum size of a variable in the JSON output."""
_SETTLING = "16 time constants of the slowest mode, at least 200 and at most 20,000"


# ----------------------------------------------------------------------------------------------------
# Options of an analysis, and the command that is made of them and of its computation.


@dataclass(frozen=True)
class _Option:
    """An option of an analysis."""

    kind: Any
    """Its annotation."""
    default: Any
    """Its value if it is not given."""
    shown: Any = None
    """The default of the command line: of a number None, since its help states the default."""


def _described(about: str, default: object) -> str:
    """The help of a number."""
    return f"{about}{'' if default is None else f' ({default:g})'}."


def _count(about: str, default: int | None = None) -> _Option:
    return _Option(Annotated[int | None, opt.count_option(_described(about, default), _OWN)], default)


def _number(about: str, default: float | None = None) -> _Option:
    return _Option(Annotated[float | None, opt.number_option(_described(about, default), _OWN)], default)


def _text(about: str, default: str, metavar: str | None = None) -> _Option:
    option = typer.Option(help=f"{about}.", rich_help_panel=_OWN, metavar=metavar)
    return _Option(Annotated[str, option], default, default)


_PARAMETER = _text("Parameter to vary (velocity_amplitude)", "velocity_amplitude")
_VALUES = _text("Values of the parameter, start:stop:count", "0.01:0.6:200", "VALUES")
_BOUNDS = _text("Bounds of the parameter, low:high", "0.005:0.3")
_PERIOD = _count("Period of the orbit in periods of the drive", 1)
_SEARCHED = _count("Transient periods to integrate before the search", 500)
_DISCARDED = _count(f"Transient periods to discard ({_SETTLING})")
_CHECKPOINT = _Option(opt.CheckpointFolder, None)
_PHASE = _Option(
    Annotated[bool, typer.Option("--phase", help="Sample the initial phase of the drive too.", rich_help_panel=_OWN)],
    False,
    False,
)


class _Request(SimpleNamespace):
    """The options of an analysis by name, with their defaults, the parameters, and the time since it began."""

    settings: Config
    given: dict[str, Any]
    failed: bool

    def __getattr__(self, name: str) -> Any:  # options
        raise AttributeError(name)

    @property
    def took(self) -> str:
        """Time since the analysis began."""
        return duration(time.monotonic() - self.begun)

    @property
    def system(self) -> System:
        """The system of the parameters."""
        return self.settings.system

    @property
    def integration(self) -> Integration:
        """Settings of the integration, with the number of cores."""
        return self.settings.integration.replace(threads=getattr(self, "threads", None))

    @property
    def chosen_integration(self) -> Integration | None:
        """Settings of the integration if their accuracy was given; otherwise the analysis chooses its own."""
        return None if self.given.get("integration.accuracy") is None else self.settings.integration

    def axis(self) -> NDArray[np.float64]:
        """Values of the parameter."""
        from snapbeam.model.parameter_file import parsed_axis

        return parsed_axis(self.settings.full_name(self.parameter), self.values)

    def interval(self, option: str, parameter: str) -> tuple[float, float]:
        """Minimum and maximum of a parameter, in its unit."""
        from snapbeam.model.parameters import lookup

        unit = lookup(self.settings.full_name(parameter)).quantity.unit
        return opt.parse_range(f"{option} (--{option.replace('_', '-')})", getattr(self, option), unit)


_Found = tuple["xr.Dataset", list[str]]


def _analysis(
    *parameters: str, axes: tuple[str, ...] = (), threads: bool = False, **options: _Option
) -> Callable[[Callable[[_Request], _Found]], Callable[[_Request], _Found]]:
    """Make a command of a function that returns a dataset and the lines to print."""

    def decorate(compute: Callable[[_Request], _Found]) -> Callable[[_Request], _Found]:
        def command(given: Any, output: Path, plot: Path | None, **chosen: Any) -> None:
            for name, option in options.items():
                chosen[name] = option.default if chosen[name] is None else chosen[name]
            request = _Request(settings=configured(given), given=given, failed=False, **chosen)
            check_outputs(output, plot)
            request.begun = time.monotonic()
            dataset, lines = compute(request)
            _finish(dataset, output, plot, lines, chosen.get("statistic"))
            if request.failed:
                raise typer.Exit(FAILED)

        rows = {name: (each.kind, each.shown) for name, each in options.items()}
        rows |= {"output": (opt.Output, Path(f"{compute.__name__}.nc")), "plot": (opt.Plot, None)}
        rows |= {"threads": (opt.Threads, None)} if threads else {}
        keyword = inspect.Parameter.KEYWORD_ONLY
        command.__signature__ = inspect.Signature(  # type: ignore[attr-defined]
            [inspect.Parameter("given", keyword)]
            + [inspect.Parameter(name, keyword, annotation=kind, default=shown) for name, (kind, shown) in rows.items()]
        )
        command.__name__, command.__doc__ = compute.__name__, compute.__doc__
        made = cli_command(with_parameters(*parameters, axes=axes)(command))
        dynamics.command(compute.__name__.replace("_", "-"), cls=ShortHelpCommand)(made)
        return compute

    return decorate


def _finish(
    dataset: xr.Dataset, output: Path, plot: Path | None, lines: list[str], statistic: str | None = None
) -> None:
    """Write, draw and print the results."""
    from snapbeam.cli.summary import initial_well_lines

    reason = dataset.attrs.get("termination_reason")
    if reason and not any(str(reason) in line for line in lines):
        lines = [*lines, f"stopped: {reason}"]
    lines = [*initial_well_lines(dataset), *lines]
    files = [write_map(dataset, output)]
    if plot is not None:
        files.append(draw_computed(dataset, plot, output, statistic))
    small = {str(name): each.values for name, each in dataset.data_vars.items() if each.size <= _FEW}
    add_json(results=small, summary=lines, files=files)
    print_written(lines, files)


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


def _plain(found: object) -> str:
    """The representation of a result, without its angle brackets."""
    return repr(found).removeprefix("<").removesuffix(">")


def _orbit(request: _Request, words: str, start: Any = None, **settings: Any) -> PeriodicOrbit:
    """The periodic orbit near a state, by default the one that a run settles on."""
    try:
        return library.periodic_orbit(
            request.system, start, request.period, integration=request.chosen_integration, **settings
        )
    except library.OrbitNotFoundError as error:
        raise InputError(f"{words}: {error}") from None


# ----------------------------------------------------------------------------------------------------
# The analyses.


@_analysis(
    *ALL,
    axes=_AXES,
    threads=True,
    initial_conditions=_count("Number of initial conditions at each point", 32),
    seed=_count("Seed of the initial conditions", 0),
    phase=_PHASE,
    settling_cycles=_number("Cycles without a zero crossing after which a run counts as settled", 50.0),
    checkpoint=_CHECKPOINT,
)
def lifetimes(request: _Request) -> _Found:
    """Compute lifetimes of snap-through and the final wells, with confidence intervals.

    snapbeam integrates many initial conditions at each point.

    Example: snapbeam dynamics lifetimes --modes 8 --frequency-ratio 1.625 --velocity-amplitude 0.2:0.5:16
    --initial-conditions 100 -o lifetimes.nc --plot lifetimes.png
    """
    cycles = request.integration.cycles if request.given.get("integration.cycles") is not None else 1000
    with progress(None, "lifetimes", "points") as report:
        dataset = library.lifetime_map(
            request.system,
            request.settings.axes() or None,
            request.integration.replace(cycles=cycles),
            initial_conditions=library.InitialConditions(
                count=request.initial_conditions, phase=request.phase, seed=request.seed
            ),
            settings=library.LifetimeSettings(settling_cycles=request.settling_cycles),
            checkpoint=request.checkpoint,
            progress=report,
        )
    lines = [f"{dataset['last_snap'].size} runs in {request.took}"]
    if dataset["lifetime"].ndim == 0:
        low, value, high = (float(dataset[name]) for name in ("lifetime_low", "lifetime", "lifetime_high"))
        lines.append(f"lifetime {value:.4g} cycles, {low:.4g} to {high:.4g} at {100 * dataset.attrs['confidence']:g} %")
        shares = zip(dataset["well"].values, dataset["end_probability"], strict=True)
        lines.append(f"ends in the well: {', '.join(f'{name} {float(share):.3g}' for name, share in shares)}")
    else:
        known = int(dataset["lifetime"].notnull().sum())
        lines.append(f"a lifetime at {known} of {dataset['lifetime'].size} points")
    return dataset, lines


@_analysis(
    *ALL,
    threads=True,
    parameter=_PARAMETER,
    values=_VALUES,
    initial_conditions=_count("Number of initial conditions at each value, in addition to the sweeps", 0),
    periods=_count("Periods to record at each value", 32),
    transient=_count(f"Transient periods to discard at each value ({_SETTLING})"),
)
def bifurcation_diagram(request: _Request) -> _Found:
    """Compute a bifurcation diagram, with an upward and a downward sweep; each value starts from the last state.

    Example: snapbeam dynamics bifurcation-diagram --modes 8 --frequency-ratio 1.4 --values 0.01:0.3:400 --plot diagram.png
    """
    points = request.axis()
    with progress(None, "bifurcation diagram", "values") as report:
        dataset = library.bifurcation_diagram(
            request.system,
            request.parameter,
            points,
            request.integration,
            initial_conditions=request.initial_conditions,
            periods=(request.transient, request.periods),
            progress=report,
        )
    lines = [f"{points.size} values in {request.took}"]
    for sweep in dataset["sweep"].values[:2]:
        found = dataset["minimal_period"].sel(sweep=sweep).values
        kinds = ", ".join(f"{int((found == m).sum())} of period {m}" for m in np.unique(found) if m > 0)
        lines.append(f"{sweep}: {kinds or 'no value repeats'}, {int((found == 0).sum())} that do not repeat")
    return dataset, lines


@_analysis(
    *ALL,
    parameter=_PARAMETER,
    values=_VALUES,
    statistic=_text("Statistic that --plot draws (peak_midspan_displacement)", "peak_midspan_displacement"),
)
def hysteresis(request: _Request) -> _Found:
    """Sweep a parameter up and down, with every statistic of a run at each value; each run starts from the last state.

    Example: snapbeam dynamics hysteresis --config harvester.toml --parameter base_excitation.frequency_ratio
    --values 0.2:1.4:25 --statistic harvested_power_last_quarter --plot power.png
    """
    from snapbeam.solver.statistics import STATISTICS
    from snapbeam.util.status_codes import RunStatus

    choice("statistic", request.statistic, tuple(STATISTICS))
    points = request.axis()
    with progress(None, "hysteresis", "values") as report:
        dataset = library.hysteresis(request.system, request.parameter, points, request.integration, progress=report)
    failed = int((dataset["status"] != RunStatus.OK).sum())
    request.failed = failed > 0
    first = f"{points.size} values up and down in {request.took}, {failed} runs failed or not run"
    return dataset, [first, *_extremes(dataset, request.statistic)]


@_analysis(
    *BEAM,
    *MODEL,
    well=_text("Motion about the lower or the upper well, or across both", "lower"),
    mode=_count("Linear mode in which the motion about a well begins", 1),
    amplitude_limit=_number("Displacement of the centre, over b, where the curve ends", 2.5),
    max_points=_count("Maximum number of points of the curve", 200),
)
def backbone_curve(request: _Request) -> _Found:
    """Compute a backbone curve: frequency of the free, undamped motion over its amplitude, with its stability.

    Example: snapbeam dynamics backbone-curve --modes 3 --well both -o backbone.nc --plot backbone.png
    """
    names = ("well", "mode", "amplitude_limit", "max_points")
    with progress(None, "backbone curve", "points") as report:
        curve = library.backbone_curve(
            request.settings.free_system, progress=report, **{name: getattr(request, name) for name in names}
        )
    hertz, stable = curve["frequency"].values, curve["stable"].values
    without = ", ".join(request.settings.exciting)
    return curve, [
        *([f"Free motion, without {without}."] if without else []),
        f"{hertz.size} motions in {request.took}, {hertz[0]:.5g} to {hertz[-1]:.5g} Hz; {int(stable.sum())} stable",
        f"The curve ends: {curve.attrs['end']}",
    ]


@_analysis(
    *ALL,
    axes=_AXES[:3],
    threads=True,
    k=_count("Number of Lyapunov exponents, largest first", 1),
    periods=_count("Periods to average over", 500),
    transient=_DISCARDED,
)
def lyapunov_spectrum(request: _Request) -> _Found:
    """Compute Lyapunov exponents (1/s) by tangents, or a map of the largest exponent.

    For the exponents of a transient set --transient 0.

    Example: snapbeam dynamics lyapunov-spectrum --modes 8 --frequency-ratio 1.4 --velocity-amplitude 0.01 --k 4
    """
    with progress(None, "Lyapunov spectrum", "periods") as report:
        dataset = library.lyapunov_spectrum(
            request.system,
            request.k,
            request.periods,
            transient=request.transient,
            axes=request.settings.axes() or None,
            integration=request.integration,
            progress=report,
        )
    lines = [f"in {request.took}"]
    if "running" in dataset:
        for i in range(min(dataset.sizes["exponent_number"], 6)):
            value, error = (float(dataset[name][0, i]) for name in ("exponent", "exponent_error"))
            # on a periodic orbit all blocks agree; what remains is the finite time, of the order of 1/T
            finite = 1.0 / (dataset.attrs["periods"] * dataset.attrs["period"])
            words = f"+- {error:.2g}" if error > finite else f"+- {finite:.2g}, from the finite time"
            per_period = value * dataset.attrs["period"]
            lines.append(f"exponent {i + 1}: {value:.4g} {words}, 1/s; {per_period:.4g} per period")
    return dataset, lines


@_analysis(
    *ALL,
    at=_text("Section: stroboscopic or impact", "stroboscopic", "KIND"),
    periods=_count("Periods to record", 1000),
    transient=_DISCARDED,
)
def poincare_section(request: _Request) -> _Found:
    """Compute a Poincare section: one state per period, or one at the onset of each impact.

    Example: snapbeam dynamics poincare-section --modes 1 --frequency-ratio 1.625 --velocity-amplitude 0.3
    --plot section.png
    """
    dataset = library.poincare_section(
        request.system, request.at, request.periods, transient=request.transient, integration=request.integration
    )
    return dataset, [f"{dataset.sizes['point']} points"]


@_analysis(
    *ALL,
    parameter=_PARAMETER,
    bounds=_BOUNDS,
    direction=_text("Initial direction: up or down", "up"),
    period=_PERIOD,
    transient=_SEARCHED,
    max_points=_count("Maximum number of orbits", 500),
)
def branch(request: _Request) -> _Found:
    """Continue a periodic orbit along a parameter, and locate folds, flips and grazing.

    Example: snapbeam dynamics branch --modes 1 --frequency-ratio 1.6 --velocity-amplitude 0.03 --bounds 0.005:0.3
    """
    limits = request.interval("bounds", request.parameter)
    orbit = _orbit(request, f"no orbit of period {request.period}", transient=request.transient)
    found = library.continuation(
        orbit, request.parameter, limits, direction=request.direction, max_points=request.max_points
    )
    return found.to_dataset(), [_plain(found), *map(_plain, found.special_points), f"in {request.took}"]


@_analysis(
    *ALL,
    stability=_text("Manifold: unstable or stable", "unstable", "KIND"),
    period=_count("Period of the saddle in periods of the drive", 1),
    max_arclength=_number("Length of each branch, in units of the well's amplitude", 10.0),
    max_seconds=_number("Time after which the manifold ends as it is, s"),
)
def manifold(request: _Request) -> _Found:
    """Compute the one-dimensional unstable or stable manifold of the saddle orbit near the straight beam.

    Example: snapbeam dynamics manifold --modes 1 --frequency-ratio 1.6 --velocity-amplitude 0.03 --plot manifold.png
    """
    straight = np.zeros(2 * request.system.model.modes)
    saddle = _orbit(request, "no saddle near the straight beam", straight)
    with progress(None, "manifold", "percent of the length") as report:
        curve = library.invariant_manifold(
            saddle,
            request.stability,
            max_arclength=request.max_arclength,
            max_seconds=request.max_seconds,
            progress=lambda share: report(round(100.0 * share), 100),
        )
    return curve, [
        _plain(saddle),
        f"{curve.sizes['point']} points in {request.took}",
        f"ends of the branches: {curve.attrs['termination_reason']}",
    ]


@_analysis(
    *ALL,
    parameter=_PARAMETER,
    bounds=_BOUNDS,
    second=_text("Second parameter of the curve", "frequency_ratio"),
    second_bounds=_text("Bounds of the second parameter, low:high", "0.5:3"),
    number=_count("Number of the fold, flip, Neimark-Sacker point or grazing of the branch", 1),
    period=_PERIOD,
    transient=_SEARCHED,
    max_points=_count("Maximum number of points to either side", 200),
)
def bifurcation_curve(request: _Request) -> _Found:
    """Continue a fold, flip, Neimark-Sacker point or grazing in two parameters, and locate points of codimension two.

    A periodic orbit is continued along the first parameter until the point with this number is found.

    Example: snapbeam dynamics bifurcation-curve --modes 1 --frequency-ratio 1.6 --velocity-amplitude 0.03 --second-bounds 1.2:2
    """
    from snapbeam.dynamics.bifurcation_curves import CURVES

    parameter, second, wanted = request.parameter, request.second, request.number
    limits, others = request.interval("bounds", parameter), request.interval("second_bounds", second)
    orbit = _orbit(request, "no such curve", transient=request.transient)
    try:
        branch = library.continuation(orbit, parameter, limits)
        found = [point for point in branch.special_points if point.kind in CURVES]
        if len(found) < wanted:
            raise InputError(
                f"number (--number) = {wanted}: the branch in {parameter} has {len(found)} such points: "
                f"{', '.join(map(_plain, branch.special_points)) or 'none'}"
            )
        curve = library.bifurcation_curve(
            found[wanted - 1], (second, parameter), (others, limits), max_points=request.max_points
        )
    except library.OrbitNotFoundError as error:
        raise InputError(f"no such curve: {error}") from None
    lines = [f"{_plain(found[wanted - 1])}: {curve.sizes['point']} points in {request.took}"]
    for k, kind in enumerate(curve["special_point_kind"].values):
        at = (f"{name} = {float(curve[f'special_point_{name}'][k]):.8g}" for name in curve.attrs["parameters"])
        lines.append(f"{kind} at {', '.join(at)}")
    return curve, [*lines, f"The curve ends: {curve.attrs['termination_reason']}"]


@_analysis(
    *ALL,
    threads=True,
    amplitudes=_text("Values of amplitude[1], start:stop:count", "-1.6:1.6:200"),
    velocities=_text("Values of velocity[1], start:stop:count", "-1:1:200"),
    periods=_count(
        "Periods after which a state counts as undecided (16 time constants of the slowest decay, at least 200 and at "
        "most 20,000)"
    ),
    states=_count("Initial states of the search for attractors", 200),
)
def basins(request: _Request) -> _Found:
    """Find and verify attractors, and compute their basins over the first modal amplitude and its velocity.

    The search draws amplitude[1] from -1.4 to 1.4 and velocity[1] from -0.6 to 0.6, and discards 16 time constants, at
    least 1000 periods; its bound for attractors that were not found applies to that region, not to the plane.

    Example: snapbeam dynamics basins --modes 1 --frequency-ratio 1.6 --velocity-amplitude 0.03 --plot basins.png
    """
    from snapbeam.model.parameter_axes import parse_axis

    grid = {
        "amplitude[1]": parse_axis("amplitudes", request.amplitudes),
        "velocity[1]": parse_axis("velocities", request.velocities),
    }
    found = library.find_attractors(request.system, request.states, integration=request.integration)
    with progress(None, "basins", "periods") as report:
        dataset = library.basins_of_attraction(found, grid, periods=request.periods, progress=report)
    lines = [f"{len(found.attractors)} attractors in {request.took}"]
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
    return dataset, lines + _entropy_lines(library.basin_entropy(dataset["basin"].values, 5))


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


@_analysis(
    *ALL,
    initial_velocity=_number(
        "Initial velocity of the first mode, divided by omega_1 times the amplitude of the well, that makes the beam "
        "snap through (doubled from 0.1 until it does)"
    ),
    periods=_count("Periods to track the edge for", 60),
    horizon=_count("Periods after which a run is classified as snapping or not", 40),
)
def edge(request: _Request) -> _Found:
    """Track the edge state between two outcomes, and find the unstable orbit on it.

    Example: snapbeam dynamics edge --modes 1 --damping-ratio 0.05 --frequency-ratio 0.7 --velocity-amplitude 0.14
    --plot edge.png
    """
    from snapbeam.dynamics.edge_states import kicked
    from snapbeam.dynamics.stroboscope import Stroboscope

    exact = request.settings.integration.replace(accuracy="reference")
    flow = Stroboscope(request.system, request.chosen_integration or exact)
    ends = kicked(flow, request.initial_velocity, request.horizon)
    found = library.edge_tracking(flow, *ends, periods=request.periods, horizon=request.horizon)
    return found.to_dataset(), [_plain(found), f"in {request.took}"]
