"""Continuous snap-through is a transient: how long snapping lasts over the plane of Figs. 6 and 7.

Every point of a coarser grid is run from many starts for 1000 cycles with 1 to 32 modes.  Four points of 32 modes have
many starts, one has its exponents and the sensitivity of its outcome too, and the longest of one mode is run for ten
thousand cycles at both accuracy levels.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

import snapbeam as sb
from snapbeam.model.default_values import CONTACT, LONG_CYCLES
from snapbeam.paper.system import paper_model
from snapbeam.plot.dynamics import plot_lifetimes, plot_survival
from snapbeam.plot.style import figure_style, new_figure, panel_letters

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

    from snapbeam.paper.recipe import Results

POINTS = {"frequency_ratio": (1.21, 1.625, 2.5, 3.5), "velocity_amplitude": (0.25, 0.3, 0.55, 0.6)}
"""Points at which 32 modes have many initial conditions."""
ENDLESS = (1.625, 0.3)
"""Point at which one mode snaps through in many runs without end; its exponents use 32 modes."""
LONGEST = (0.75, 0.58)
"""Point of the longest lifetime of 32 modes."""
_SEED = 118291
_SCALE = (5.0, 5000.0)
"""Limits of the colour scale, cycles."""
_APART = 1.0
"""Cycles by which the ends of two runs must differ."""


def _system(modes: int, ratio: float, velocity: float) -> sb.System:
    return sb.System(
        paper_model(modes),
        contacts=[sb.Contact(CONTACT, sb.Shaker(frequency_ratio=ratio, velocity_amplitude=velocity).striker())],
    )


def compute(results: Results) -> dict[str, xr.Dataset]:
    """Lifetime maps, points, long runs, exponents and sensitivity."""
    from snapbeam.util.datasets import xr

    found = {}
    cycles = results.pick(120, LONG_CYCLES)
    survival = sb.dynamics.LifetimeSettings(settling_cycles=results.pick(20.0, 50.0))
    axes = {
        "frequency_ratio": results.pick(np.linspace(0.5, 4.0, 3), np.linspace(0.25, 4.0, 16)),
        "velocity_amplitude": results.pick(np.linspace(0.1, 0.65, 3), np.linspace(0.1, 0.64, 10)),
    }
    for modes in results.pick((1, 2), (1, 2, 4, 8, 32)):
        found[f"modes_{modes}"] = sb.dynamics.lifetime_map(
            _system(modes, *ENDLESS), axes, sb.Integration(cycles=cycles), initial_conditions=results.pick(3, 8),
            settings=survival, after=results.pick(None, (200, 500, 950)),
            progress=results.progress(f"lifetimes, N = {modes}"),
        )  # fmt: skip
    most = results.pick(2, 32)
    points = xr.Dataset({name: ("point", np.array(values)) for name, values in POINTS.items()})
    found["points"] = sb.dynamics.lifetime_map(
        _system(most, *ENDLESS), points, sb.Integration(cycles=cycles), initial_conditions=results.pick(8, 250),
        settings=survival, progress=results.progress("lifetimes at four points"),
    )  # fmt: skip
    for accuracy in ("standard", "reference"):
        long = sb.Integration(cycles=results.pick(200, 10_000), accuracy=accuracy)
        found[f"long_{accuracy}"] = sb.dynamics.lifetime_map(
            _system(1, *ENDLESS), None, long, initial_conditions=results.pick(4, 24), settings=survival
        )
    found["exponents"] = _exponents(results, most)
    found["sensitivity"] = _sensitivity(results, most)
    for accuracy in ("standard", "reference"):
        long = sb.Integration(cycles=results.pick(120, 10_000), accuracy=accuracy)
        found[f"long_many_{accuracy}"] = sb.dynamics.lifetime_map(
            _system(most, *LONGEST), None, long, initial_conditions=results.pick(2, 8), settings=survival,
            progress=results.progress(f"longest of {most} modes, {accuracy}"),
        )  # fmt: skip
    return found


def _exponents(results: Results, modes: int) -> xr.Dataset:
    """The largest exponent while it snaps, of several runs."""
    system = _system(modes, *ENDLESS)
    starts = sb.dynamics.InitialConditions(count=results.pick(2, 16))
    states = [starts.state(system, number) for number in range(starts.count)]
    batch = sb.State(
        amplitude=np.array([state.amplitude for state in states]),
        velocity=np.array([state.velocity for state in states]),
    )
    return sb.dynamics.lyapunov_spectrum(system, 1, results.pick(20, 200), transient=0, states=batch)


def _sensitivity(results: Results, modes: int) -> xr.Dataset:
    """Share of random points at which the last snap moves by more than a cycle with a relative change of V.

    Two runs part after ln(1/epsilon)/lambda, and both still snap then with a probability that falls as kappa says: the
    share goes with epsilon to the power kappa/lambda.
    """
    from snapbeam.util.datasets import xr

    count, cycles = results.pick(6, 400), results.pick(30, LONG_CYCLES)
    base = np.random.default_rng(_SEED).uniform(0.27, 0.33, count)
    sizes = np.logspace(-12.0, -4.0, results.pick(2, 9))
    system, how = _system(modes, *ENDLESS), sb.Integration(cycles=cycles, early_termination=True)
    cycle = 1.0 / (system.model.reference_frequency * ENDLESS[0])
    ends = []
    for size in (0.0, *sizes):
        ds = sb.sweep(system, xr.Dataset({"velocity_amplitude": ("point", base * (1.0 + size))}), how)
        ends.append(ds["last_zero_crossing"].fillna(0.0).values / cycle)
    changed = np.array([(np.abs(each - ends[0]) > _APART).sum() for each in ends[1:]])
    labels = {"units": "1", "long_name": "points whose last snap moves by more than a cycle"}
    return xr.Dataset(
        {"changed": ("size", changed, labels)},
        {"size": ("size", sizes, {"units": "1", "long_name": "relative change of V"})},
        {"points": count, "cycles": cycles, "modes": modes, "seed": _SEED},
    )


def draw(results: Results) -> Figure:
    """A panel a number of modes, and the survival at four points."""
    data = results["lifetimes"]
    maps = {name: ds for name, ds in data.items() if name.startswith("modes_")}
    with figure_style():
        figure = new_figure("double", 118.0)
        axes = figure.subplots(2, 3).ravel()
        for ax, (name, ds) in zip(axes, maps.items(), strict=False):
            plot_lifetimes(ds, ax, limits=_SCALE, legend=False)
            ax.set_title(f"$N$ = {name[6:]}", loc="left")
        for ax in axes[len(maps) : -1]:
            ax.set_visible(False)
        pairs = zip(*POINTS.values(), strict=True)
        plot_survival(data["points"], axes[-1], labels=[f"{a:g}, {b:g}" for a, b in pairs])
        axes[-1].get_legend().set_title(r"$\Omega$, $V$", {"size": 6})
        panel_letters([*axes[: len(maps)], axes[-1]])
    return figure
