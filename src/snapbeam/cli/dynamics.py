"""``snapbeam dynamics``: lifetimes, bifurcation diagrams, exponents, sections, orbits and basins of a struck beam."""

from __future__ import annotations

import time
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
import typer

from snapbeam.cli import parameter_options as opt
from snapbeam.cli.console import answer, door, duration, file_line, out, progress
from snapbeam.cli.parameter_options import (
    BEAM,
    CONTACT,
    DRIVE,
    MODEL,
    RUN,
    STRIKER,
    configured,
    with_parameters,
)

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["dynamics"]


dynamics = typer.Typer(
    help="What holds beyond a class: lifetimes, attractors, basins, exponents, orbits and their branches.",
    no_args_is_help=True,
    rich_markup_mode="markdown",
)
_ALL = (*DRIVE, *STRIKER, *BEAM, *MODEL, *CONTACT, *RUN)
_AXES = ("drive.frequency_ratio", "drive.velocity_amplitude", "striker.location", "model.modes")
_OWN = "Question"
_FEW = 4000
"""Numbers of a variable, at most, that are told as plain ones."""
Output = Annotated[
    Path,
    typer.Option("--output", "-o", help="NetCDF file to write.", rich_help_panel="Output", metavar="FILE"),
]
Along = Annotated[
    str, typer.Option(help="Parameter that is varied (velocity_amplitude).", rich_help_panel=_OWN)
]
Values = Annotated[
    str, typer.Option(help="Its values, start:stop:count.", rich_help_panel=_OWN, metavar="VALUES")
]


def _checked(output: Path, plot: Path | None) -> None:
    from snapbeam.cli.console import check_pictures
    from snapbeam.util.files import check_writable

    check_writable(output, "output", (".nc",))
    check_pictures(("plot", plot))


def _finish(dataset: xr.Dataset, output: Path, plot: Path | None, picture: str, lines: list[str]) -> None:
    """Write the results, draw them, and say what they are."""
    from snapbeam.cli.console import draw_dynamics, write_map

    files = [write_map(dataset, output)]
    if plot is not None:
        files.append(draw_dynamics(dataset, plot, picture))
    small = {str(name): each.values for name, each in dataset.data_vars.items() if each.size <= _FEW}
    answer(found=small, words=lines, files=files)
    out().print(*lines, *(f"Written: {file_line(path)}" for path in files), sep="\n")


@dynamics.command("lifetimes")
@door
@with_parameters(*_ALL, axes=_AXES)
def lifetimes(
    given: Any,
    starts: Annotated[int | None, opt.count_option("Starts of every point (32).", _OWN)] = None,
    seed: Annotated[int | None, opt.count_option("Chooses the starts (0).", _OWN)] = None,
    phase: Annotated[
        bool, typer.Option("--phase", help="Start at any phase of the drive.", rich_help_panel=_OWN)
    ] = False,
    quiet_cycles: Annotated[
        float | None,
        opt.number_option("Cycles without a crossing after which snapping has ended (50).", _OWN),
    ] = None,
    store: Annotated[
        Path | None,
        typer.Option(
            help="Folder that keeps the runs; one that exists is resumed.",
            rich_help_panel="Output",
            metavar="DIR",
        ),
    ] = None,
    output: Output = Path("lifetimes.nc"),
    plot: opt.Plot = None,
    threads: opt.Threads = None,
) -> None:
    """How long snapping lasts and how it ends, from many starts at every point, with confidence intervals.

    Example: snapbeam dynamics lifetimes --modes 8 --frequency-ratio 1.625 --velocity-amplitude 0.2:0.5:16
    --starts 100 -o lifetimes.nc --plot lifetimes.png
    """
    from snapbeam.dynamics.flow import InitialConditions
    from snapbeam.dynamics.lifetimes import LifetimeSettings, lifetime_map

    settings = configured(given)
    _checked(output, plot)
    chosen = InitialConditions(
        count=32 if starts is None else starts, phase=phase, seed=0 if seed is None else seed
    )
    begun = time.monotonic()
    cycles = settings.integration.cycles if given.get("integration.cycles") is not None else 1000
    with progress(None, "lifetimes", "points") as report:
        dataset = lifetime_map(
            settings.system, settings.axes() or None, settings.integration.replace(cycles=cycles, threads=threads),
            initial_conditions=chosen, settings=LifetimeSettings(settling_cycles=50.0 if quiet_cycles is None else quiet_cycles), checkpoint=store,
            progress=report,
        )  # fmt: skip
    runs = int(dataset["last_snap"].size)
    lines = [f"{runs} runs in {duration(time.monotonic() - begun)}"]
    if dataset["lifetime"].ndim == 0:
        low, value, high = (float(dataset[name]) for name in ("lifetime_low", "lifetime", "lifetime_high"))
        lines.append(
            f"lifetime {value:.4g} cycles, {low:.4g} to {high:.4g} at {100 * dataset.attrs['confidence']:g} %"
        )
        ends = ", ".join(
            f"{name} {float(p):.3g}"
            for name, p in zip(dataset["well"].values, dataset["end_probability"], strict=True)
        )
        lines.append(f"ends in the well: {ends}")
    else:
        known = int(dataset["lifetime"].notnull().sum())
        lines.append(f"a lifetime at {known} of {dataset['lifetime'].size} points")
    _finish(dataset, output, plot, "survival" if dataset["lifetime"].ndim == 0 else "lifetimes", lines)


@dynamics.command("diagram")
@door
@with_parameters(*_ALL)
def diagram(
    given: Any,
    along: Along = "velocity_amplitude",
    values: Values = "0.01:0.6:200",
    starts: Annotated[
        int | None, opt.count_option("Starts of every value beside the sweeps (0).", _OWN)
    ] = None,
    keep: Annotated[int | None, opt.count_option("Periods to keep at every value (32).", _OWN)] = None,
    leave: Annotated[int | None, opt.count_option("Periods to leave out before them (100).", _OWN)] = None,
    output: Output = Path("diagram.nc"),
    plot: opt.Plot = None,
    threads: opt.Threads = None,
) -> None:
    """A bifurcation diagram, swept up and down with the state carried on.

    Example: snapbeam dynamics diagram --modes 8 --frequency-ratio 1.4 --values 0.01:0.3:400 --plot diagram.png
    """
    from snapbeam.dynamics.bifurcation import bifurcation_diagram
    from snapbeam.model.parameter_axes import parse_axis

    settings = configured(given)
    _checked(output, plot)
    points = np.atleast_1d(parse_axis(along, values))
    begun = time.monotonic()
    with progress(None, "diagram", "values") as report:
        dataset = bifurcation_diagram(
            settings.system, along, points, settings.integration.replace(threads=threads), initial_conditions=starts or 0,
            periods=(100 if leave is None else leave, 32 if keep is None else keep), progress=report,
        )  # fmt: skip
    lines = [f"{points.size} values in {duration(time.monotonic() - begun)}"]
    for sweep in dataset["sweep"].values[:2]:
        periods = dataset["least_period"].sel(sweep=sweep).values
        kinds = ", ".join(f"{int((periods == m).sum())} of period {m}" for m in np.unique(periods) if m > 0)
        lines.append(
            f"{sweep}: {kinds or 'no value repeats'}, {int((periods == 0).sum())} that do not repeat"
        )
    _finish(dataset, output, plot, "diagram", lines)


@dynamics.command("exponents")
@door
@with_parameters(*_ALL, axes=_AXES[:3])
def exponents(
    given: Any,
    k: Annotated[int | None, opt.count_option("Exponents, from the largest on (1).", _OWN)] = None,
    periods: Annotated[int | None, opt.count_option("Periods to go over (500).", _OWN)] = None,
    transient: Annotated[int | None, opt.count_option("Periods before them (100).", _OWN)] = None,
    output: Output = Path("exponents.nc"),
    plot: opt.Plot = None,
    threads: opt.Threads = None,
) -> None:
    """Lyapunov exponents by the tangent flow, or a map of the largest one.

    Example: snapbeam dynamics exponents --modes 8 --frequency-ratio 1.4 --velocity-amplitude 0.01 --k 4
    """
    from snapbeam.dynamics.lyapunov import lyapunov_spectrum

    settings = configured(given)
    _checked(output, plot)
    begun = time.monotonic()
    with progress(None, "exponents", "periods") as report:
        dataset = lyapunov_spectrum(
            settings.system, 1 if k is None else k, 500 if periods is None else periods,
            transient=100 if transient is None else transient, axes=settings.axes() or None,
            integration=settings.integration.replace(threads=threads), progress=report,
        )  # fmt: skip
    lines = [f"in {duration(time.monotonic() - begun)}"]
    if "running" in dataset:
        for i in range(min(dataset.sizes["exponent_number"], 6)):
            value, error = (float(dataset[name][0, i]) for name in ("exponent", "exponent_error"))
            lines.append(f"exponent {i + 1}: {value:.4g} +- {error:.2g} 1/s")
    _finish(dataset, output, plot, "exponents", lines)


@dynamics.command("section")
@door
@with_parameters(*_ALL)
def section(
    given: Any,
    at: Annotated[
        str, typer.Option(help="stroboscopic or impact.", rich_help_panel=_OWN, metavar="KIND")
    ] = "stroboscopic",
    periods: Annotated[int | None, opt.count_option("Periods to look at (1000).", _OWN)] = None,
    transient: Annotated[int | None, opt.count_option("Periods before them (100).", _OWN)] = None,
    output: Output = Path("section.nc"),
    plot: opt.Plot = None,
) -> None:
    """A Poincare section: a run once a period, or at the onset of every impact.

    Example: snapbeam dynamics section --modes 1 --frequency-ratio 1.625 --velocity-amplitude 0.3 --plot section.png
    """
    from snapbeam.dynamics.sections import poincare_section

    settings = configured(given)
    _checked(output, plot)
    dataset = poincare_section(
        settings.system, at, 1000 if periods is None else periods,
        transient=100 if transient is None else transient, integration=settings.integration,
    )  # fmt: skip
    _finish(dataset, output, plot, "section", [f"{dataset.sizes['point']} points"])


@dynamics.command("branch")
@door
@with_parameters(*_ALL)
def branch(
    given: Any,
    along: Along = "velocity_amplitude",
    between: Annotated[
        str, typer.Option(help="Least and greatest value, low:high.", rich_help_panel=_OWN)
    ] = "0.005:0.3",
    direction: Annotated[str, typer.Option(help="up or down, at first.", rich_help_panel=_OWN)] = "up",
    period: Annotated[
        int | None, opt.count_option("Periods of the drive after which it closes (1).", _OWN)
    ] = None,
    transient: Annotated[
        int | None, opt.count_option("Periods to march before the search (500).", _OWN)
    ] = None,
    most: Annotated[int | None, opt.count_option("Orbits at most (500).", _OWN)] = None,
    output: Output = Path("branch.nc"),
    plot: opt.Plot = None,
) -> None:
    """A periodic orbit, and its branch along a parameter with folds, flips and grazing located.

    Example: snapbeam dynamics branch --modes 1 --frequency-ratio 1.6 --velocity-amplitude 0.03 --between 0.005:0.3
    """
    from snapbeam.cli.parameter_options import parse_window
    from snapbeam.dynamics.branches import continuation
    from snapbeam.dynamics.periodic_orbits import OrbitNotFoundError, periodic_orbit

    settings = configured(given)
    _checked(output, plot)
    limits = parse_window(between)
    assert limits is not None
    begun = time.monotonic()
    how = None if given.get("integration.accuracy") is None else settings.integration
    try:
        orbit = periodic_orbit(
            settings.system, period=1 if period is None else period, transient=500 if transient is None else transient,
            integration=how,
        )  # fmt: skip
    except OrbitNotFoundError as error:
        from snapbeam.util.validation import InputError

        raise InputError(f"no orbit of period {1 if period is None else period}: {error}") from None
    found = continuation(orbit, along, limits, direction=direction, max_points=500 if most is None else most)
    lines = [
        f"{found!r} in {duration(time.monotonic() - begun)}",
        *(f"{event!r}" for event in found.special_points),
    ]
    _finish(found.to_dataset(), output, plot, "branch", [line.strip("<>") for line in lines])


@dynamics.command("basins")
@door
@with_parameters(*_ALL)
def basins(
    given: Any,
    amplitudes: Annotated[
        str, typer.Option(help="amplitude[1]: start:stop:count.", rich_help_panel=_OWN)
    ] = "-1.6:1.6:200",
    velocities: Annotated[
        str, typer.Option(help="velocity[1]: start:stop:count.", rich_help_panel=_OWN)
    ] = "-1:1:200",
    periods: Annotated[
        int | None, opt.count_option("Periods after which a state is undecided (200).", _OWN)
    ] = None,
    states: Annotated[
        int | None, opt.count_option("States that attractors are sought from (200).", _OWN)
    ] = None,
    output: Output = Path("basins.nc"),
    plot: opt.Plot = None,
    threads: opt.Threads = None,
) -> None:
    """Attractors, certified, and their basins on the plane of the first amplitude and its velocity.

    Example: snapbeam dynamics basins --modes 1 --frequency-ratio 1.6 --velocity-amplitude 0.03 --plot basins.png
    """
    from snapbeam.dynamics.attractors import find_attractors
    from snapbeam.dynamics.basins import basin_entropy
    from snapbeam.dynamics.basins import basins_of_attraction as basins_of
    from snapbeam.model.parameter_axes import parse_axis

    settings = configured(given)
    _checked(output, plot)
    begun = time.monotonic()
    plane = {
        "amplitude[1]": parse_axis("amplitudes", amplitudes),
        "velocity[1]": parse_axis("velocities", velocities),
    }
    found = find_attractors(
        settings.system,
        200 if states is None else states,
        integration=settings.integration.replace(threads=threads),
    )
    with progress(None, "basins", "periods") as report:
        dataset = basins_of(found, plane, periods=200 if periods is None else periods, progress=report)
    lines = [f"{len(found.attractors)} attractors in {duration(time.monotonic() - begun)}"]
    for number, each in enumerate(found.attractors):
        share = 100.0 * float((dataset["basin"] == number).mean())
        lines.append(f"{number}: {repr(each).strip('<>')}, {share:.3g} % of the plane")
    lines.append(f"undecided: {100 * dataset.attrs['undecided']:.3g} %")
    entropy = basin_entropy(dataset["basin"].values, 5)
    lines.append(
        f"basin entropy {entropy.basin:.3f} +- {entropy.basin_error:.1g}, at borders {entropy.boundary:.3f} +- "
        f"{entropy.boundary_error:.1g}{': fractal' if entropy.is_fractal else ''}"
    )
    _finish(dataset, output, plot, "basins", lines)


@dynamics.command("edge")
@door
@with_parameters(*_ALL)
def edge(
    given: Any,
    kick: Annotated[
        float | None,
        opt.number_option(
            "Velocity of the first mode, over omega_1 times the well's amplitude, that makes the beam snap from its "
            "start (doubled from 0.1 until it does).",
            _OWN,
        ),
    ] = None,
    periods: Annotated[int | None, opt.count_option("Periods to follow the border for (60).", _OWN)] = None,
    horizon: Annotated[
        int | None, opt.count_option("Periods after which snapping or not is told (40).", _OWN)
    ] = None,
    output: Output = Path("edge.nc"),
    plot: opt.Plot = None,
) -> None:
    """The motion on the border between snapping and not, and the unstable orbit that it settles on.

    Example: snapbeam dynamics edge --modes 1 --damping-ratio 0.05 --frequency-ratio 1.6 --velocity-amplitude 0.03
    --plot edge.png
    """
    from snapbeam.dynamics.edge_states import edge_tracking, kicked
    from snapbeam.dynamics.flow import Stroboscope

    settings = configured(given)
    _checked(output, plot)
    ahead = 40 if horizon is None else horizon
    how = settings.integration
    flow = Stroboscope(
        settings.system,
        how if given.get("integration.accuracy") is not None else how.replace(accuracy="reference"),
    )
    begun = time.monotonic()
    found = edge_tracking(
        flow, *kicked(flow, kick, ahead), periods=60 if periods is None else periods, horizon=ahead
    )
    lines = [f"{found!r}".strip("<>") + f", in {duration(time.monotonic() - begun)}"]
    if found.orbit is None:
        lines.append("it settles on no orbit within these periods: follow it for longer (--periods)")
    _finish(found.to_dataset(), output, plot, "edge", lines)
