"""Figures of the dynamics: bifurcation diagrams, lifetimes, Lyapunov exponents, sections, basins, edge states."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from cmcrameri import cm
from matplotlib.axes import Axes
from matplotlib.colors import BoundaryNorm, ListedColormap, LogNorm
from matplotlib.lines import Line2D
from matplotlib.patches import Patch, Rectangle
from matplotlib.ticker import MaxNLocator

from snapbeam.plot.axes import axis_label, dress, edges_of, positions
from snapbeam.plot.map import in_order
from snapbeam.plot.style import (
    SERIES_COLORS,
    color_bar,
    color_of,
    contains,
    extend_title,
    fix_ticks,
    frame,
    legend_below,
    marker_size,
    plain_decades,
)
from snapbeam.plot.units import in_units, scale_text
from snapbeam.util.si_prefixes import prefixed
from snapbeam.util.status_codes import RunStatus
from snapbeam.util.validation import InputError, checked, choice, instance, shown

if TYPE_CHECKING:
    import xarray as xr

_BLUE, _RED, _, _GRAY, _BLACK = SERIES_COLORS
_STARTS = "#8A8A8A"
MAX_CURVES = 5
"""The most points of a map that :func:`plot_survival` draws."""
_STABILITY: dict[bool, tuple[Any, str]] = {True: ("-", "stable"), False: ("--", "unstable")}
"""Line of a motion by its stability, and its name."""
_SPECIAL_POINTS = {"fold": "s", "flip": "D", "Neimark-Sacker": "o", "branch point": "^", "grazing": "x"}


@checked
def plot_diagram(
    dataset: xr.Dataset | None,
    ax: Axes | None = None,
    *,
    branches: Sequence[xr.Dataset] = (),
    variable: str = "midspan_displacement",
) -> Axes:
    """Draw a bifurcation diagram, swept up and down, with branches of orbits over it.

    Parameters
    ----------
    dataset : xarray.Dataset, optional
        Of :func:`snapbeam.dynamics.bifurcation_diagram`.
    branches : sequence of xarray.Dataset
        Of :meth:`snapbeam.dynamics.Branch.to_dataset`: stable solid, unstable dashed, special points as markers.
    variable : str
        Variable to draw; branches have ``midspan_displacement`` alone, at every return.

    Examples
    --------
    >>> import snapbeam as sb
    >>> from snapbeam import paper
    >>> damped = paper.struck_beam(frequency_ratio=1.6, velocity_amplitude=0.03, damping_ratio=0.05)
    >>> diagram = sb.dynamics.bifurcation_diagram(damped, "velocity_amplitude", [0.02, 0.03, 0.04])
    >>> ax = sb.plot.plot_diagram(diagram)
    """
    branches = list(branches)
    if dataset is None and not branches:
        raise InputError("dataset: give a diagram or at least one branch")
    if branches and variable != "midspan_displacement":
        raise InputError(f"variable = {variable!r}: branches have midspan_displacement alone; draw one or the other")
    first = dataset if dataset is not None else branches[0]
    along = str(getattr(first, "attrs", {}).get("parameter", ""))
    for name, each in [("dataset", dataset), *(("branches", branch) for branch in branches)]:
        needed = {"sweep", "period"} if name == "dataset" else {"orbit"}
        if each is not None and not needed <= set(getattr(each, "dims", ())):
            raise InputError(f"{name}: must have the dimensions {', '.join(sorted(needed))}")
    new = ax is None
    with frame(ax, first, height=80.0) as ax:
        handles: list[Line2D] = []
        if dataset is not None:
            contains(dataset, variable, variable)
            handles += _points(dataset, ax, along, variable)
            dress(ax.xaxis, dataset, along)
        for branch in branches:
            handles += _branch(branch, ax, along)
        if dataset is None:
            dress(ax.xaxis, branches[0].swap_dims(orbit=along).drop_duplicates(along), along)
        kind = "Velocity" if "velocity" in variable else "Displacement"
        unit = r"$\dot w\,/\,b\omega_1$" if kind == "Velocity" else "$w/b$"
        place = "mid-span" if variable.startswith("midspan") else "the striker"
        ax.set_ylabel(f"{kind} at {place}\nonce a period, {scale_text(first.attrs, unit)}")
        unique = {handle.get_label(): handle for handle in handles}
        legend_below(ax, list(unique.values()))
        if new:
            _close_gap(ax)
    return ax


def _close_gap(ax: Axes) -> None:
    """Break the vertical axis where no curve is over more than a third of its range."""
    drawn = np.concatenate([np.ravel(line.get_ydata()) for line in ax.lines])
    y = np.unique(drawn[np.isfinite(drawn)])
    if y.size < 2 or (widest := float(np.diff(y).max())) < 0.34 * np.ptp(y):
        return
    at, pad = int(np.argmax(np.diff(y))), 0.05 * (np.ptp(y) - widest) + 0.02 * widest
    low, high = y[at] + pad, y[at + 1] - pad
    scale = (np.ptp(y) - widest) * 0.06 / (high - low)
    known = np.array([y[0] - 1e3, low, high, y[-1] + 1e3])
    drawn_at = np.cumsum(np.append(known[0], np.diff(known) * [1.0, scale, 1.0]))
    functions = (lambda w: np.interp(w, known, drawn_at), lambda w: np.interp(w, drawn_at, known))
    ax.set_yscale("function", functions=functions)
    ticks = MaxNLocator(5, steps=[1, 2, 5, 10]).tick_values(0.0, np.ptp(y) - widest + 4.0 * pad)
    step = ticks[1] - ticks[0]
    places = step * np.arange(np.ceil((y[0] - pad) / step), (y[-1] + pad) / step + 1e-9)
    ax.set_yticks([place for place in places if not low < place < high])
    ax.set_ylim(y[0] - pad, y[-1] + pad)
    ax.axhspan(low, high, color="0.92", linewidth=0.0, zorder=0)
    ax.annotate("axis broken", (0.995, 0.5 * (low + high)), xycoords=("axes fraction", "data"), ha="right",
                va="center", fontsize="small", color="0.3")  # fmt: skip


def _points(dataset: xr.Dataset, ax: Axes, along: str, variable: str) -> list[Line2D]:
    """Draw the points, those swept down smaller and over those swept up, so that both are seen where they agree."""
    handles = []
    looks = {"up": (_BLUE, "swept up", 2.4), "down": (_RED, "swept down", 1.5)}
    sweeps = [str(name) for name in dataset["sweep"].values]
    for name in sorted(sweeps, key=list(looks).index if set(sweeps) <= set(looks) else str):
        part = dataset[variable].isel(sweep=sweeps.index(name)).transpose(along, "period")
        x = np.repeat(dataset[along].values, part.sizes["period"])
        color, text, share = looks.get(name, (_STARTS, "from many starts", 2.0))
        size = share * float(np.clip(120.0 / dataset.sizes[along], 0.4, 1.6))
        look: dict[str, Any] = {"color": color, "markeredgewidth": 0.0, "linestyle": "", "marker": "o"}
        ax.plot(x, part.values.ravel(), markersize=size, rasterized=True, **look)
        handles.append(Line2D([], [], markersize=2.0 * share, label=text, **look))
    return handles


def _branch(branch: xr.Dataset, ax: Axes, along: str) -> list[Line2D]:
    x, stable = branch[along].values, branch["stable"].values
    returns = branch["midspan_returns"].transpose("return", "orbit").values
    after = branch["special_point_index"].values.astype(int) + 1
    near = np.array([returns[:, at - 1 : at + 1].mean(axis=1) for at in after]).reshape(after.size, len(returns)).T
    # the curve passes through its special points
    x, returns = (np.insert(x, after, branch["special_point_value"].values), np.insert(returns, after, near, axis=1))
    stable = np.insert(stable, after, stable[after - 1])
    # up to the stable orbits beside them, so that no gap is left
    beside = ~stable | np.append(~stable[1:], False) | np.append(False, ~stable[:-1])
    for y in returns:
        ax.plot(x, np.where(stable, y, np.nan), color=_BLACK, linewidth=1.1)
        ax.plot(x, np.where(beside, y, np.nan), color=_BLACK, linewidth=0.9, dashes=(3, 2))
    drawn = [(line, name) for kind, (line, name) in _STABILITY.items() if (stable == kind).any()]
    handles = [Line2D([], [], color=_BLACK, linestyle=line, label=f"{name} orbit") for line, name in drawn]
    for kind, value, heights in zip(
        branch["special_point_kind"].values, branch["special_point_value"].values, near.T, strict=True
    ):
        handles += ax.plot(
            np.full(heights.size, value), heights, _SPECIAL_POINTS[str(kind)], color=_BLACK, markersize=3.5,
            markerfacecolor="white", label=str(kind),
        )  # fmt: skip
    return handles


# ----------------------------------------------------------------------------------------------------
# Lifetimes over one parameter or two, and survival curves.


@checked
def plot_lifetimes(
    dataset: xr.Dataset, ax: Axes | None = None, *, limits: tuple[float, float] | None = None, legend: bool = True
) -> Axes:
    """Draw the lifetime of snapping: along one parameter with its interval, or over two in colours.

    Points without a lifetime are white where nothing snapped and hatched where runs snap on with no end seen.  *limits*
    are those of the colours, in cycles.

    Examples
    --------
    >>> import snapbeam as sb
    >>> from snapbeam import paper
    >>> damped = paper.struck_beam(frequency_ratio=1.6, velocity_amplitude=0.03, damping_ratio=0.05)
    >>> axes = {"drive.velocity_amplitude": [0.1, 0.2]}
    >>> settings = sb.dynamics.LifetimeSettings(settling_cycles=5)
    >>> lifetimes = sb.dynamics.lifetime_map(
    ...     damped, axes, sb.Integration(cycles=20), initial_conditions=4, settings=settings
    ... )
    >>> ax = sb.plot.plot_lifetimes(lifetimes)
    """
    contains(dataset, "lifetimes", "lifetime")
    dataset = in_units(dataset)
    dims = [str(name) for name in dataset["lifetime"].dims]
    if not 1 <= len(dims) <= 2 or "point" in dims:
        raise InputError(f"lifetime over {dims}: is drawn over one or two parameters")
    with frame(ax, dataset) as ax:
        if len(dims) == 1:
            x, _ = positions(dataset, dims[0])
            _lifetime_line(dataset, ax, x, legend)
            dress(ax.xaxis, dataset, dims[0])
        else:
            _lifetime_cells(dataset, ax, list(in_order(dataset, dims)), limits, legend)
    return ax


def _lifetime_line(dataset: xr.Dataset, ax: Axes, x: Any, legend: bool) -> None:
    """Lifetimes with their intervals, upward without end where no end is known, and the points that have none."""
    value, low, high = (dataset[f"lifetime{end}"].values for end in ("", "_low", "_high"))
    ends = np.concatenate([value, low, high])
    ends = ends[np.isfinite(ends) & (ends > 0.0)]
    top = 3.0 * float(ends.max()) if ends.size else 10.0
    bars = np.stack([value - low, np.minimum(high, top) - value])
    share = 100.0 * float(dataset.attrs.get("confidence", 0.95))
    label = f"lifetime, {share:g} % interval"
    if np.isfinite(value).any():
        look: dict[str, Any] = {"color": _BLUE, "markersize": marker_size(x.size), "linewidth": 0.7, "elinewidth": 0.7}
        ax.errorbar(x, value, yerr=bars, fmt="o-", label=label, **look)
    ax.set(yscale="log", ylim=(0.5 * float(ends.min()) if ends.size else 0.1, top))
    ax.set_ylabel("Lifetime of snapping (cycles)")
    none, going = np.isnan(value), dataset["runs_snapping"].values > 0
    for which, height, mark, words in ((none & ~going, 0.03, "v", _NONE), (none & going, 0.97, "^", _ENDLESS)):
        if which.any():
            at = np.full(int(which.sum()), height)
            ax.plot(x[which], at, mark, color="0.4", markersize=3.5, transform=ax.get_xaxis_transform(), label=words)
    if legend:
        legend_below(ax)


_NONE, _ENDLESS = "no run snaps", "snaps on, no end seen"


def _lifetime_cells(
    dataset: xr.Dataset, ax: Axes, dims: list[str], limits: tuple[float, float] | None, legend: bool
) -> None:
    values = dataset["lifetime"].transpose(*reversed(dims)).values
    known = values[np.isfinite(values) & (values > 0.0)]
    edges = [edges_of(dataset, name) for name in dims]
    if known.size:
        low, high = (float(np.quantile(known, share)) for share in (0.02, 0.98))
        low, high = (max(low, 1.0), max(high, low, 1.0) * 1.001) if limits is None else limits
        colors = ListedColormap(cm.batlow(np.linspace(0.0, 0.92, 256)))  # its last colours are nearly white
        cells = ax.pcolormesh(*edges, values, cmap=colors, norm=LogNorm(low, high), rasterized=True)
        beyond = known.min() < low, known.max() > high
        extend = {(True, True): "both", (True, False): "min", (False, True): "max"}.get(beyond, "neither")
        color_bar(cells, ax, "Lifetime of snapping (cycles)", extend=extend)
    none = np.isnan(values)
    endless = none & (dataset["runs_snapping"].transpose(*reversed(dims)).values > 0)
    hatched: dict[str, Any] = {"facecolor": "white", "edgecolor": "0.4", "hatch": "//////", "linewidth": 0.0}
    for row, column in np.argwhere(endless):
        low, left = edges[1][row], edges[0][column]
        size = edges[0][column + 1] - left, edges[1][row + 1] - low
        ax.add_patch(Rectangle((left, low), *size, **hatched))
    if legend:
        plain: dict[str, Any] = {"facecolor": "white", "edgecolor": "black", "linewidth": 0.4}
        handles = [Patch(**plain, label=_NONE)] if (none & ~endless).any() else []
        legend_below(ax, handles + ([Patch(**hatched, label=_ENDLESS)] if endless.any() else []))
    dress(ax.xaxis, dataset, dims[0])
    dress(ax.yaxis, dataset, dims[1])


@checked
def plot_survival(dataset: xr.Dataset, ax: Axes | None = None, *, labels: Sequence[str] | None = None) -> Axes:
    """Draw the fraction of runs that still snap over cycles, and the fitted exponential, for up to five points.

    The curve ends ``settling_cycles`` before the end of the runs.  A ring there marks the fraction of right-censored
    runs, which were still snapping.

    Examples
    --------
    >>> import snapbeam as sb
    >>> from snapbeam import paper
    >>> damped = paper.struck_beam(frequency_ratio=1.6, velocity_amplitude=0.03, damping_ratio=0.05)
    >>> lifetimes = sb.dynamics.lifetime_map(damped, None, sb.Integration(cycles=60), initial_conditions=4)
    >>> ax = sb.plot.plot_survival(lifetimes)
    """
    if "last_snap" not in dataset:
        raise InputError("dataset: holds no lifetimes of starts")
    runs = dataset.transpose(..., "start")
    rows = np.atleast_2d(runs["last_snap"].values).reshape(-1, runs.sizes["start"])
    if len(rows) > MAX_CURVES:
        raise InputError(f"dataset: has {len(rows)} points; choose at most {MAX_CURVES} of them")
    tau, delay = (np.atleast_1d(runs[name].values).ravel() for name in ("lifetime", "delay"))
    with frame(ax, dataset) as ax:
        seen = float(dataset.attrs["cycles"]) - float(dataset.attrs["settling_cycles"])
        settled = runs["final_well_proven"].values.astype(bool) | (runs["status"].values == int(RunStatus.EARLY_STOP))
        settled = np.atleast_2d(settled).reshape(rows.shape)
        good = rows.shape[1] - np.atleast_1d(runs["runs_failed"].values).ravel()
        open_ends = False
        for i, row in enumerate(rows):
            color = cm.batlow(0.05 + 0.7 * i / max(len(rows) - 1, 1))
            lasting = (row > seen) & ~settled[i]
            times = np.sort(row[np.isfinite(row) & ~lasting])
            # a run that never snapped ended at once; one that failed is none
            share = (times.size + lasting.sum() - np.arange(1, times.size + 1)) / good[i]
            going = float(lasting.sum() / good[i])
            if going > 0.0:
                open_ends = True
                last = max(seen, times[-1]) if times.size else seen
                times, share = np.append(times, last), np.append(share, going)
                ax.plot(last, going, "o", color=color, markerfacecolor="white", markersize=4.0, zorder=4)
            alone = f"{row.size} runs" if len(rows) == 1 else f"point {i + 1}"
            name = labels[i] if labels is not None else alone
            ax.step(np.append(0.0, times), np.append(1.0, share), where="post", color=color, label=name)
            if np.isfinite(tau[i]) and np.isfinite(delay[i]):
                begun = float((row > delay[i]).sum() / good[i])
                t = np.linspace(delay[i], times[-1], 200)
                ax.plot(t, begun * np.exp(-(t - delay[i]) / tau[i]), color=color, dashes=(4, 2), linewidth=0.7)
        ax.set(xlabel="Cycles", ylabel="Fraction of runs still snapping", yscale="log")
        ax.set_ylim(0.6 / rows.shape[1], 1.3)
        plain_decades(ax.yaxis, *ax.get_ylim())
        ax.set_xlim(left=0.0)
        if not np.isfinite(rows).any():
            ax.text(0.5, 0.5, "no run snaps through", transform=ax.transAxes, ha="center")
        handles, _ = ax.get_legend_handles_labels()
        own = color if len(rows) == 1 else "0.3"
        if (np.isfinite(tau) & np.isfinite(delay)).any():
            handles.append(Line2D([], [], color=own, dashes=(4, 2), linewidth=0.7, label="fitted"))
        if open_ends:
            ring: dict[str, Any] = {"marker": "o", "color": own, "markerfacecolor": "white", "markersize": 4.0}
            handles.append(Line2D([], [], linestyle="none", label="right-censored", **ring))
        legend_below(ax, handles)
    return ax


# ----------------------------------------------------------------------------------------------------
# State space: Lyapunov exponents, Poincare sections, basins, edge states.


_PER = {"second": r"s$^{-1}$", "period": "per period of the excitation"}


@checked
def plot_exponents(dataset: xr.Dataset, ax: Axes | None = None, *, per: str = "second") -> Axes:
    """Draw Lyapunov exponents: their convergence over periods, or the largest over one or two parameters.

    Order and chaos are distinguished by an interval of two standard errors: the largest exponent is negative, positive,
    or its sign is not decided.  Colours of a map over two parameters diverge at 0.

    Parameters
    ----------
    dataset : xarray.Dataset
        Of :func:`snapbeam.dynamics.lyapunov_spectrum` or :func:`snapbeam.dynamics.largest_lyapunov`.
    ax : matplotlib.axes.Axes, optional
        Axes to draw in; new ones by default.
    per : {"second", "period"}
        Unit of time: 1 s, or one period of the excitation.

    Examples
    --------
    >>> import snapbeam as sb
    >>> from snapbeam import paper
    >>> damped = paper.struck_beam(frequency_ratio=1.6, velocity_amplitude=0.03, damping_ratio=0.05)
    >>> ax = sb.plot.plot_exponents(sb.dynamics.lyapunov_spectrum(damped, periods=40, transient=20))
    """
    contains(dataset, "exponents", "exponent")
    dataset = in_units(dataset)
    unit = _PER[choice("per", per, tuple(_PER))]
    of_map = str(dataset["exponent"].attrs.get("units", "1/s")) == "1"
    factor: Any = 1.0
    if per == "period" and not of_map:
        if "period" not in dataset.attrs and "excitation_period" not in dataset:
            raise InputError("per = 'period': the dataset does not contain the period; compute it again")
        factor = dataset.attrs["period"] if "period" in dataset.attrs else dataset["excitation_period"]
    unit = "per iteration of the map" if of_map else unit
    first = {"exponent_number": 0} if "exponent_number" in dataset.dims else {}
    value, error = (factor * dataset[name].isel(first) for name in ("exponent", "exponent_error"))
    dims = [str(name) for name in dataset["exponent"].dims if name != "exponent_number"]
    dims = list(in_order(dataset, dims)) if len(dims) == 2 else dims
    value, error = (each.transpose(*dims) for each in (value, error))
    with frame(ax, dataset) as ax:
        if "running" in dataset:
            _running(dataset, factor, ax)
            ax.set(xlabel="Periods of the excitation", ylabel=f"Lyapunov exponent so far ({unit})", xscale="log")
            plain_decades(ax.xaxis, 1.0, dataset.sizes["period"])
        elif len(dims) == 1:
            _exponent_line(dataset, ax, dims[0], value.values, error.values)
            ax.set_ylabel(f"Largest Lyapunov exponent\n({unit})")
        elif len(dims) == 2:
            most = float(np.nanmax(np.abs(value.values))) or 1.0
            edges = [edges_of(dataset, name) for name in dims]
            cells = ax.pcolormesh(*edges, value.values.T, cmap=cm.vik, vmin=-most, vmax=most, rasterized=True)
            color_bar(cells, ax, f"Largest Lyapunov exponent ({unit}),\nbelow 0: periodic, above 0: chaotic")
            _undecided_cells(ax, edges, value.values.T, error.values.T)
            dress(ax.xaxis, dataset, dims[0])
            dress(ax.yaxis, dataset, dims[1])
        else:
            raise InputError(f"exponent over {dims}: is drawn over one or two parameters")
    return ax


def _running(dataset: xr.Dataset, factor: Any, ax: Axes) -> None:
    """The exponents so far; the legend has the results with their standard errors."""
    running = factor * dataset["running"]
    result, error = (np.ravel(factor * dataset[f"exponent{end}"]) for end in ("", "_error"))
    period = np.arange(1, running.sizes["period"] + 1)
    ax.axhline(0.0, color="0.6", linewidth=0.5)
    shown = min(running.sizes["exponent_number"], 10)
    values = running.transpose("period", ..., "exponent_number").values
    for number in range(shown):
        digits = int(np.clip(1.0 - np.floor(np.log10(error[number])), 0, 6)) if error[number] > 0.0 else 3
        ends = " ± ".join(f"{each[number]:.{digits}f}" for each in (result, error) if np.isfinite(each[number]))
        label = rf"$\lambda_{{{number + 1}}}$ = {ends}".replace(" = -", " = \N{MINUS SIGN}")
        ax.plot(period, values[:, 0, number], color=color_of(number, shown), label=label)
    legend_below(ax)


def _exponent_line(dataset: xr.Dataset, ax: Axes, name: str, value: Any, error: Any) -> None:
    """The largest exponent over one parameter, with its interval; marker and colour state its sign."""
    x, _ = positions(dataset, name)
    ax.axhline(0.0, color="0.6", linewidth=0.5)
    ax.fill_between(
        x, value - 2 * error, value + 2 * error, color="0.6", alpha=0.35, linewidth=0.0, label="two standard errors"
    )
    ax.plot(x, value, color="0.45", linewidth=0.6)
    settled, chaotic = value + 2 * error < 0.0, value - 2 * error > 0.0
    for which, mark, color, words in (
        (settled, "o", _BLUE, "negative: periodic"),
        (chaotic, "^", _RED, "positive: chaotic"),
        (np.isfinite(value) & ~settled & ~chaotic, "x", "0.3", "sign not decided"),
    ):
        if which.any():
            ax.plot(x[which], value[which], mark, color=color, markersize=3.0, label=words)
    legend_below(ax)
    if name in dataset.coords:
        dress(ax.xaxis, dataset, name)
    else:
        ax.set_xlabel("Run")


def _undecided_cells(ax: Axes, edges: list[Any], value: Any, error: Any) -> None:
    """Mark the cells whose sign is not decided."""
    undecided = np.isfinite(value) & (np.abs(value) <= 2 * error)
    middle = [0.5 * (edge[1:] + edge[:-1]) for edge in edges]
    if undecided.any():
        row, column = np.nonzero(undecided)
        for color, width, label in (("white", 1.8, None), ("0.2", 0.8, "sign not decided")):
            look: dict[str, Any] = {"color": color, "markersize": 2.4 + width, "markeredgewidth": width, "label": label}
            ax.plot(middle[0][column], middle[1][row], "x", **look)
    legend_below(ax)


@checked
def plot_multipliers(dataset: xr.Dataset, ax: Axes | None = None) -> Axes:
    """Draw Floquet multipliers: of one orbit in the complex plane, of a branch their absolute values over the parameter.

    A multiplier outside the unit circle, or above 1, makes the orbit unstable.

    Parameters
    ----------
    dataset : xarray.Dataset
        Of ``to_dataset`` of a :class:`snapbeam.dynamics.PeriodicOrbit` or a :class:`snapbeam.dynamics.Branch`.
    ax : matplotlib.axes.Axes, optional
        Axes to draw in; new ones by default.

    Examples
    --------
    >>> import snapbeam as sb
    >>> from snapbeam import paper
    >>> damped = paper.struck_beam(frequency_ratio=1.6, velocity_amplitude=0.03, damping_ratio=0.05)
    >>> orbit = sb.dynamics.periodic_orbit(damped, transient=200)
    >>> ax = sb.plot.plot_multipliers(orbit.to_dataset())
    """
    contains(dataset, "multipliers", "multiplier_real", "multiplier_imag")
    values = dataset["multiplier_real"].values + 1j * dataset["multiplier_imag"].values
    with frame(ax, dataset, height=84.0) as ax:
        if "orbit" in dataset.dims:
            _multipliers_along(dataset, ax, np.abs(values))
        else:
            angle = np.linspace(0.0, 2.0 * np.pi, 361)
            ax.plot(np.cos(angle), np.sin(angle), color="0.5", linewidth=0.7, label="unit circle")
            outside = np.abs(values) > 1.0
            for which, mark, color, words in (
                (~outside, "o", _BLUE, "inside: decays"),
                (outside, "^", _RED, "outside: grows"),
            ):
                if which.any():
                    ax.plot(values[which].real, values[which].imag, mark, color=color, markersize=3.5, label=words)
            ax.set_aspect("equal")
            ax.margins(0.08)
            ax.set(xlabel="Floquet multiplier, real part", ylabel="Floquet multiplier, imaginary part")
            legend_below(ax)
    return ax


def _listed(given: xr.Dataset | Sequence[xr.Dataset], kind: str, *needed: str) -> list[xr.Dataset]:
    """One or several datasets of a kind as a list."""
    from snapbeam.util.datasets import xr

    found: list[xr.Dataset] = []
    for each in [given] if isinstance(given, xr.Dataset) else given:  # one by one: there may be very many
        found.append(instance("datasets", each, xr.Dataset, f"a dataset of a {kind}, or several"))
        if not set(needed) <= set(map(str, each.variables)):
            raise InputError(f"datasets: no {kind} among {list(map(str, each.variables))}")
    if not found:
        raise InputError(f"datasets = []: must hold at least one {kind}")
    return found


def _labels(given: Sequence[str] | None, default: list[str]) -> Sequence[str]:
    """The labels of curves, checked."""
    labels = default if given is None else given
    if len(labels) != len(default) or not all(isinstance(label, str) for label in labels):
        raise InputError(f"labels = {shown(list(labels))}: must be one text for each of {len(default)} curves")
    return labels


@checked
def plot_backbone(
    datasets: xr.Dataset | Sequence[xr.Dataset], ax: Axes | None = None, *, labels: Sequence[str] | None = None
) -> Axes:
    """Draw backbone curves: the amplitude at mid-span over the frequency; unstable motions are dashed.

    Earlier curves are wider, so that each is seen where they agree.

    Parameters
    ----------
    datasets : xarray.Dataset or sequence of xarray.Dataset
        Of :func:`snapbeam.dynamics.backbone_curve`.
    ax : matplotlib.axes.Axes, optional
        Axes to draw in; new ones by default.
    labels : sequence of str, optional
        Of the curves, in a legend; the wells by default if there are several.

    Examples
    --------
    >>> import snapbeam as sb
    >>> from snapbeam import paper
    >>> model = sb.ReducedModel.from_beam(paper.BEAM, modes=1)
    >>> ax = sb.plot.plot_backbone(sb.dynamics.backbone_curve(sb.System(model), max_points=5))
    """
    curves = _listed(datasets, "backbone curve", "frequency_ratio", "max_midspan", "stable")
    words = {"lower": "about the lower well", "upper": "about the upper well", "both": "across both wells"}
    labels = _labels(labels, [words[curve.attrs["well"]] for curve in curves])
    one_model = len({curve.attrs["modes"] for curve in curves}) == 1
    with frame(ax, curves[0] if one_model else None, height=84.0) as ax:
        handles: list[Line2D] = []
        kinds = set[bool]()
        for number, (curve, label) in enumerate(zip(curves, labels, strict=True)):
            frequency = curve["frequency_ratio"].values
            height = 0.5 * (curve["max_midspan"] - curve["min_midspan"]).values
            stable = curve["stable"].values
            color = SERIES_COLORS[number % len(SERIES_COLORS)]
            look: dict[str, Any] = {"color": color, "linewidth": 1.2 + 0.7 * (len(curves) - 1 - number)}
            for kind in (True, False):
                # a segment is drawn as its first point is
                segments = (stable == kind) | np.append(False, (stable == kind)[:-1])
                x, y = (np.where(segments, each, np.nan) for each in (frequency, height))
                if (stable == kind).any():
                    ax.plot(x, y, _STABILITY[kind][0], **look)
                    kinds.add(kind)
            if len(curves) > 1:
                handles.append(Line2D([], [], label=label, **look))
        unit = rf" ($\Omega$ = 1: {prefixed(curves[0].attrs['reference_frequency'], 'Hz')})" if one_model else ""
        ax.set(xlabel=rf"Frequency $\Omega$ of free vibration{unit}")
        ax.set_ylabel(scale_text(curves[0].attrs if one_model else {}, "Amplitude at mid-span $w/b$"))
        ax.set_ylim(bottom=0.0)
        for line, name in (_STABILITY[kind] for kind in sorted(kinds, reverse=True)):
            own = (look["color"], f"{labels[0]}, {name}") if len(curves) == 1 else ("0.3", f"{name} motion")
            handles.append(Line2D([], [], color=own[0], linestyle=line, label=own[1]))
        legend_below(ax, handles)
    return ax


_CURVE_LINES = {"fold": "-", "flip": "--", "Neimark-Sacker": ":", "grazing": "-."}
_CURVE_MARKS = {
    "cusp": "*", "fold-flip": "D", "generalized flip": "X",
    "resonance 1:1": "$1$", "resonance 1:2": "$2$", "resonance 1:3": "$3$", "resonance 1:4": "$4$",
}  # fmt: skip


@checked
def plot_bifurcation_curve(
    datasets: xr.Dataset | Sequence[xr.Dataset], ax: Axes | None = None, *, labels: Sequence[str] | None = None
) -> Axes:
    """Draw bifurcation curves over their two parameters, on a response map too.

    Folds are solid lines, flips dashed, Neimark-Sacker points dotted, grazing dash-dotted.  Points of codimension two are marked:
    cusps by stars, fold-flips by diamonds, generalized flips by crosses, resonances 1:n by n, grazing by circles.

    Parameters
    ----------
    datasets : xarray.Dataset or sequence of xarray.Dataset
        Of :func:`snapbeam.dynamics.bifurcation_curve`, all over the same parameters.
    ax : matplotlib.axes.Axes, optional
        Where to draw, such as a map over these parameters; a new figure one column wide by default.
    labels : sequence of str, optional
        Of the curves; their kinds by default.

    Examples
    --------
    >>> import snapbeam as sb
    >>> from snapbeam import paper
    >>> system = paper.struck_beam(frequency_ratio=1.6, velocity_amplitude=0.03, damping_ratio=0.05)
    >>> orbit = sb.dynamics.periodic_orbit(system, transient=100)
    >>> branch = sb.dynamics.continuation(orbit, "velocity_amplitude", (0.02, 0.3), max_points=12)
    >>> names, bounds = ("frequency_ratio", "velocity_amplitude"), ((1.5, 1.7), (0.02, 0.1))
    >>> curve = sb.dynamics.bifurcation_curve(branch.special_points[0], names, bounds, max_points=5)
    >>> ax = sb.plot.plot_bifurcation_curve(curve)
    """
    curves = _listed(datasets, "bifurcation curve", "special_point_kind")
    for curve in curves:
        if curve.attrs.get("kind") not in _CURVE_LINES:
            raise InputError(f"datasets: no bifurcation curve among {list(map(str, curve.variables))}")
    names = list(curves[0].attrs["parameters"])
    if any(list(curve.attrs["parameters"]) != names for curve in curves):
        raise InputError("datasets: curves over different parameters")
    labels = _labels(labels, [curve.attrs["kind"] for curve in curves])
    new = ax is None
    with frame(ax, curves[0], height=70.0) as ax:
        for number, (curve, label) in enumerate(zip(curves, labels, strict=True)):
            kind = curve.attrs["kind"]
            color = SERIES_COLORS[number % len(SERIES_COLORS)] if new else "black"
            x, y = (curve[name].values for name in names)
            ax.plot(x, y, _CURVE_LINES[kind], color=color, label=label, linewidth=1.0)
            for at, words in enumerate(curve["special_point_kind"].values):
                place = [float(curve[f"special_point_{name}"][at]) for name in names]
                ax.plot(*place, _CURVE_MARKS.get(str(words), "o"), color=color, markersize=4.0, label=str(words))
        if new:
            dress(ax.xaxis, curves[0], names[0])
            dress(ax.yaxis, curves[0], names[1])
        unique = dict(zip(*reversed(ax.get_legend_handles_labels()), strict=True))
        if unique:
            ax.legend(unique.values(), unique.keys(), loc="best")
    return ax


def _multipliers_along(dataset: xr.Dataset, ax: Axes, sizes: Any) -> None:
    over = dataset["multiplier_real"].dims
    sizes = -np.sort(-(sizes if over[0] == "orbit" else sizes.T), axis=1)
    along = next(
        str(name)
        for name in dataset.variables
        if "parameter" in dataset[name].attrs or name == dataset.attrs.get("parameter")
    )
    shown = min(sizes.shape[1], 6)
    for number in range(shown):
        label = f"multiplier {number + 1}"
        ax.plot(dataset[along].values, sizes[:, number], color=color_of(number, shown), label=label)
    ax.axhline(1.0, color=_RED, linewidth=0.8, dashes=(4, 2), label="limit of stability")
    for value, kind in zip(dataset["special_point_value"].values, dataset["special_point_kind"].values, strict=True):
        ax.axvline(float(value), color="0.6", linewidth=0.5)
        ax.annotate(
            str(kind), (float(value), 1.0), (2.0, -3.0), xycoords=("data", "axes fraction"),
            textcoords="offset points", rotation=90, va="top", fontsize="small",
        )  # fmt: skip
    ax.set(yscale="log", ylabel="Absolute value of the Floquet multipliers")
    legend_below(ax)
    dress(ax.xaxis, dataset.swap_dims(orbit=along).drop_duplicates(along), along)


@checked
def plot_attractors(dataset: xr.Dataset, ax: Axes | None = None) -> Axes:
    """Draw the attractors once a period, in their first two coordinates, with the share of the states that go to each.

    The title states the upper bound of the share of states that go to attractors that were not found.

    Parameters
    ----------
    dataset : xarray.Dataset
        Of :meth:`snapbeam.dynamics.Attractors.to_dataset`.
    ax : matplotlib.axes.Axes, optional
        Axes to draw in; new ones by default.

    Examples
    --------
    >>> import snapbeam as sb
    >>> from snapbeam import paper
    >>> damped = paper.struck_beam(frequency_ratio=1.6, velocity_amplitude=0.03, damping_ratio=0.05)
    >>> attractors = sb.dynamics.find_attractors(damped, 12)
    >>> ax = sb.plot.plot_attractors(attractors.to_dataset())
    """
    contains(dataset, "attractors", "points", "share")
    names = [str(name) for name in dataset["coordinate"].values]
    modes = sum(name.startswith("amplitude[") for name in names)
    pair = (0, modes if 0 < modes < len(names) else min(1, len(names) - 1))
    points = dataset["points"].transpose("attractor", "point", "coordinate").values
    count = dataset.sizes["attractor"]
    with frame(ax, dataset, height=88.0) as ax:
        for number in range(count):
            period = int(dataset["period"][number])
            words = f"period {period}" if period else "chaotic"
            ax.plot(
                points[number, :, pair[0]], points[number, :, pair[1]], "o" if period else ".", color=_attractor_colors(count)[number],
                markersize=4.0 if period else 1.5, label=f"{number}: {words}{_well_of(names[0], points[number, :, 0])}, {100 * float(dataset['share'][number]):.1f} % of the states",
            )  # fmt: skip
        ax.set(xlabel=_coordinate(names[pair[0]]), ylabel=_coordinate(names[pair[1]]))
        ax.margins(0.08)
        unseen = 100 * float(dataset.attrs["unseen_share_95"])
        extend_title(ax, f"Attractors not found: below {unseen:.2g} % of the states (95 %)")
        legend_below(ax)
    return ax


@checked
def plot_section(dataset: xr.Dataset, ax: Axes | None = None, x: str | None = None) -> Axes:
    """Draw a Poincare section: a velocity over its displacement, or over the phase of the drive.

    Parameters
    ----------
    dataset : xarray.Dataset
        Of :func:`snapbeam.dynamics.poincare_section`.
    ax : matplotlib.axes.Axes, optional
        Axes to draw in; new ones by default.
    x : {"midspan_displacement", "displacement_at_striker", "drive_phase"}, optional
        By default the displacement of mid-span, once a period; the phase of the drive, at impacts or a level.

    Examples
    --------
    >>> import snapbeam as sb
    >>> from snapbeam import paper
    >>> damped = paper.struck_beam(frequency_ratio=1.6, velocity_amplitude=0.03, damping_ratio=0.05)
    >>> ax = sb.plot.plot_section(sb.dynamics.poincare_section(damped, "impact", 20, transient=20))
    """
    section, new = str(dataset.attrs.get("section", "stroboscopic")), ax is None
    x = x or next(iter(section_abscissae(dataset)), "midspan_displacement")
    y = x.replace("displacement", "velocity")
    if x == "drive_phase":
        y = "midspan_velocity" if "midspan" in section else "velocity_at_striker"
        y = y.replace("velocity", "displacement") if "velocity" in section else y  # which is the level
    contains(dataset, f"{x} and {y}", x, y)
    with frame(ax, dataset) as ax:
        # few points are large, and many do not run into one another
        size = float(np.clip(20.0 / np.sqrt(dataset[x].size), 0.8, 3.0))
        look: dict[str, Any] = {"color": _BLUE, "markersize": size, "markeredgewidth": 0.0, "rasterized": True}
        ax.plot(dataset[x].values, dataset[y].values, "o", **look)
        # a point that repeats is not magnified to its rounding errors
        for limits, name in (("xlim", x), ("ylim", y)):
            values = dataset[name].values
            middle, least = 0.5 * (values.min() + values.max()), 1e-3 * np.abs(values).max()
            if 0.0 < least > np.ptp(values):
                ax.set(**{limits: (middle - 10.0 * least, middle + 10.0 * least)})
        for axis, name in ((ax.xaxis, x), (ax.yaxis, y)):
            where = "at mid-span" if name.startswith("midspan") else "at the striker"
            moved = scale_text(dataset.attrs, f"Displacement {where} $w/b$")
            axis.set_label_text(moved if "displacement" in name else rf"Velocity {where} $\dot w\,/\,b\omega_1$")
        if x == "drive_phase":
            ax.set(xlabel="Phase of the drive (rad)", xlim=(0.0, 2.0 * np.pi))
            ax.set_xticks(np.pi * np.linspace(0.0, 2.0, 5), ["0", r"$\pi/2$", r"$\pi$", r"$3\pi/2$", r"$2\pi$"])
        if new:
            extend_title(ax, f"{dataset[x].size} points, {_MET.get(section, 'at each passage of the level')}")
    return ax


_MET = {"stroboscopic": "once a period", "impact": "at the start of each contact"}


def section_abscissae(dataset: xr.Dataset) -> list[str]:
    """The variables that a section is drawn over, the default first."""
    names = ("midspan_displacement", "displacement_at_striker", "drive_phase")
    if dataset.attrs.get("section", "stroboscopic") != "stroboscopic":
        names = names[::-1]  # the displacement at a level is the same, and that of impacts is the striker's
    return [name for name in names if name in dataset]


@checked
def plot_basins(dataset: xr.Dataset, ax: Axes | None = None) -> Axes:
    """Draw basins of attraction: a colour an attractor, grey where it is undecided, attractors as rings.

    Dots mark states whose label changes if the step is halved.

    Examples
    --------
    >>> import snapbeam as sb
    >>> from snapbeam import paper
    >>> damped = paper.struck_beam(frequency_ratio=1.6, velocity_amplitude=0.03, damping_ratio=0.05)
    >>> found = sb.dynamics.find_attractors(damped, 12)
    >>> grid = {"amplitude[1]": [-1.2, 0.0, 1.2], "velocity[1]": [-0.5, 0.5]}
    >>> ax = sb.plot.plot_basins(sb.dynamics.basins_of_attraction(found, grid))
    """
    contains(dataset, "basins", "basin")
    names = [str(name) for name in dataset["basin"].dims]
    labels = dataset["basin"].values
    count = int(dataset["basin"].attrs["flag_values"].max()) + 1
    colors = [_GRAY, *_attractor_colors(count)]
    meanings = [each.replace("_", " ") for each in str(dataset["basin"].attrs["flag_meanings"]).split()]
    for i, points in enumerate(dataset["attractor_points"].values):
        share = 100.0 * float((labels == i).mean())
        meanings[i + 1] = f"{meanings[i + 1]}{_well_of(names[0], points[:, 0])}, {share:.3g} %"
    with frame(ax, dataset, height=84.0) as ax:
        edges = [edges_of(dataset, name) for name in names]
        norm = BoundaryNorm(np.arange(-1.5, count), count + 1)
        ax.pcolormesh(*edges, labels.T, cmap=ListedColormap(colors), norm=norm, rasterized=True)
        for points in dataset["attractor_points"].values:
            ax.plot(*points.T, "o", color="black", markerfacecolor="white", markersize=3.0, markeredgewidth=0.8)
        for axis, name in ((ax.xaxis, names[0]), (ax.yaxis, names[1])):
            axis.set_label_text(_coordinate(name))
        ax.set(xlim=edges[0][[0, -1]], ylim=edges[1][[0, -1]])
        handles: list[Any] = [
            Patch(facecolor=colors[i], edgecolor="black", linewidth=0.4, label=meanings[i])
            for i in range(count + 1)
            if i > 0 or (labels == -1).any()
        ]
        if (share := float(dataset.attrs.get("sensitive_share", 0.0))) > 0.0:
            label = f"sensitive: {100 * share:.2g} %"
            points = np.argwhere(dataset["sensitive"].values == 1)
            (dots,) = ax.plot(
                *(dataset[name].values[points[:, i]] for i, name in enumerate(names)), ".", color="0.6", markersize=2.0,
                label=label,
            )  # fmt: skip
            handles.append(dots)
        legend_below(ax, handles)
    return ax


@checked
def plot_manifold(dataset: xr.Dataset, ax: Axes | None = None) -> Axes:
    """Draw an invariant manifold in its first displacement and velocity, over basins of attraction too.

    Unstable manifolds are solid, stable ones dashed; the saddle is a cross.

    Parameters
    ----------
    dataset : xarray.Dataset
        Of :func:`snapbeam.dynamics.invariant_manifold`.
    ax : matplotlib.axes.Axes, optional
        Where to draw, such as basins or another manifold; a new figure one column wide by default.

    Examples
    --------
    >>> import snapbeam as sb
    >>> from snapbeam import paper
    >>> system = paper.struck_beam(frequency_ratio=1.6, velocity_amplitude=0.03, damping_ratio=0.05)
    >>> saddle = sb.dynamics.periodic_orbit(system, [0.0, 0.0])
    >>> ax = sb.plot.plot_manifold(sb.dynamics.invariant_manifold(saddle, max_arclength=1.0))
    """
    contains(dataset, "manifold", "age", "saddle")
    names = [str(name) for name in dataset["coordinate"].values]
    at = (0, next((i for i, name in enumerate(names) if name.startswith("velocity")), 1 % len(names)))
    stability, new = str(dataset.attrs["stability"]), ax is None
    line, color = ("-", _RED) if stability == "unstable" else ("--", cm.batlow(0.15))
    with frame(ax, dataset, height=84.0) as ax:
        for side in np.unique(dataset["side"].values):
            points = dataset["state"].values[dataset["side"].values == side]
            label = f"{stability} manifold" if side > 0 else None
            ax.plot(*points[:, at].T, line, color=color, linewidth=0.7, label=label)
        saddle = dataset["saddle"].values[list(at)]
        ax.plot(*saddle, "x", color="black", markersize=5.0, label="saddle" if new else None)
        if new:
            ax.set(xlabel=_coordinate(names[at[0]]), ylabel=_coordinate(names[at[1]]))
        ax.legend(loc="best")
    return ax


def plot_tangency(dataset: xr.Dataset, ax: Axes | None = None) -> Axes:
    """Draw the values that a search for a homoclinic tangency tried, and its bracket."""
    contains(dataset, "homoclinic tangency", "crosses", "bracket")
    crosses, value = dataset["crosses"].values, dataset["value"].values
    with frame(ax, dataset, height=48.0) as ax:
        for state, color in ((False, cm.batlow(0.15)), (True, _RED)):
            ax.plot(value[crosses == state], crosses[crosses == state], "o", color=color, markersize=3.0)
        bracket = dataset["bracket"].values
        if np.isfinite(bracket).all():
            ax.axvspan(bracket.min(), bracket.max(), color="0.8", label="bracket of the tangency")
            legend_below(ax)
        ax.set_xlabel(axis_label(dataset, str(dataset.attrs["parameter"])))
        ax.set(ylabel="Manifolds", yticks=[0, 1], yticklabels=["apart", "crossing"], ylim=(-0.5, 1.5))
    return ax


@checked
def plot_homoclinic(dataset: xr.Dataset, ax: Axes | None = None) -> Axes:
    """Draw homoclinic points, the result of :func:`snapbeam.dynamics.homoclinic_points`, over manifolds too."""
    contains(dataset, "homoclinic points", "state", "stable_arclength")
    names, new = [str(name) for name in dataset["coordinate"].values], ax is None
    with frame(ax, dataset) as ax:
        label = f"homoclinic points, {dataset.sizes['point']}"
        ax.plot(*dataset["state"].values.T, "o", color=_BLACK, markerfacecolor="white", markersize=4.0, label=label)
        if new:
            ax.set(xlabel=_coordinate(names[0]), ylabel=_coordinate(names[1]))
        legend_below(ax)
    return ax


def plot_edge(dataset: xr.Dataset, ax: Axes | None = None) -> Axes:
    """Draw an edge state: the first coordinate once a period, and the unstable orbit that it settles on.

    Below it, on a logarithmic axis, is the distance between the two states of different outcome; with *ax* the
    coordinate alone is drawn.
    """
    contains(dataset, "edge state", "orbit_state", "state")
    name, new = str(dataset["coordinate"].values[0]), ax is None
    values, points = dataset["state"].values[:, 0], dataset["orbit_state"].values[:, 0]
    out = int((np.hypot(dataset["multiplier_real"], dataset["multiplier_imag"]) > 1.0).sum())
    with frame(ax, dataset, height=104.0) as ax:
        period = np.arange(1, values.size + 1)
        look: dict[str, Any] = {"color": _BLUE, "linewidth": 0.7, "markersize": 3.0}
        ax.plot(period, values, "o-", label="state between the two outcomes", **look)
        kind = f"unstable orbit of period {points.size}, {out} multiplier{'s' if out != 1 else ''} above 1"
        for i, point in enumerate(points):
            ax.axhline(point, color=_RED, linewidth=0.9, dashes=(4, 2), label=kind if i == 0 else None, zorder=3)
        ax.margins(y=0.12)
        legend_below(ax)
        ax.set(xlabel="Period of the drive", ylabel=_coordinate(name))
        if new:
            _distance(dataset, ax, period)
    return ax


def _distance(dataset: xr.Dataset, ax: Axes, period: Any) -> None:
    """Draw the distance of the two states in axes of its own below *ax*."""
    spec = ax.get_subplotspec()
    assert spec is not None
    grid = spec.subgridspec(2, 1, height_ratios=(1.5, 1.0))
    ax.set_subplotspec(grid[0])
    below = ax.figure.add_subplot(grid[1], sharex=ax)
    distance = dataset["distance"].values
    below.semilogy(period, np.where(distance > 0.0, distance, np.nan), ".-", color=_STARTS, linewidth=0.7)
    below.set(xlabel=ax.get_xlabel(), ylabel="Distance of\nthe two states")
    ax.set_xlabel("")
    ax.tick_params(labelbottom=False)
    ax.figure.align_ylabels([ax, below])
    fix_ticks(below)


def _attractor_colors(count: int) -> list[Any]:
    """A colour for each of some attractors."""
    if count <= len(SERIES_COLORS) - 2:
        return list(SERIES_COLORS[:count])
    return [cm.batlow(0.08 + 0.84 * i / (count - 1)) for i in range(count)]


def _well_of(name: str, amplitudes: np.ndarray) -> str:
    """The well about which an attractor moves, by its amplitudes once a period."""
    known = amplitudes[np.isfinite(amplitudes)]
    if name != "amplitude[1]" or not known.size:
        return ""
    return " in the upper well" if known.min() > 0.0 else " in the lower well" if known.max() < 0.0 else ", interwell"


def _coordinate(name: str) -> str:
    """Axis label of a coordinate of a state."""
    mode, well = name[name.find("[") + 1 : -1], r"|\alpha_{1,\mathrm{well}}|"
    if name.startswith("amplitude["):
        return rf"Modal amplitude $\alpha_{{{mode}}}\,/\,{well}$"
    if name.startswith("velocity["):
        return rf"Modal velocity $\dot\alpha_{{{mode}}}\,/\,\omega_1{well}$"
    return f"{name.partition('[')[0].replace('_', ' ').capitalize()} {mode}"
