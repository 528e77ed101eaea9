"""Figures of static equilibria: force-displacement curves, and branches over a parameter."""

from __future__ import annotations

import dataclasses
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D

from snapbeam.model.parameters import lookup
from snapbeam.plot.axes import wrapped
from snapbeam.plot.style import SERIES_COLORS, contains, frame, legend_below
from snapbeam.util.si_prefixes import prefixed, scale_of
from snapbeam.util.validation import checked, choice

if TYPE_CHECKING:
    import xarray as xr

_STABLE, _HELD, _UNSTABLE = *SERIES_COLORS[:2], SERIES_COLORS[3]
_STYLES: dict[str, dict[str, Any]] = {
    "stable": {"color": _STABLE, "linestyle": "-", "linewidth": 1.6},
    "stable under displacement control only": {"color": _HELD, "linestyle": "-.", "linewidth": 1.2},
    "unstable": {"color": _UNSTABLE, "linestyle": "--", "linewidth": 0.9},
}
_MARKERS = {"limit": ("o", "limit point"), "bifurcation": ("D", "bifurcation point")}


@checked
def plot_force_displacement(dataset: xr.Dataset, ax: Axes | None = None) -> Axes:
    """Draw every branch of a force-displacement curve, its stability and its critical points.

    Critical points are marked where a stable part of a branch begins or ends, under a given force or a given
    displacement; triangles mark snap-through and snap-back.  The force axis spans about twice these two forces.

    Parameters
    ----------
    dataset : xarray.Dataset
        Of :func:`snapbeam.force_displacement`.
    ax : matplotlib.axes.Axes, optional
        Axes to draw in; new ones by default.

    Examples
    --------
    >>> import snapbeam as sb
    >>> beam = sb.Beam(length=5e-4, thickness=2e-6, width=2e-5, density=2330, young_modulus=160e9, axial_load=0.0)
    >>> arch = sb.ReducedModel.from_beam(beam, modes=4, imperfection=sb.Imperfection(midspan_amplitude=6e-6))
    >>> ax = sb.plot.plot_force_displacement(sb.force_displacement(arch, 0.5))
    """
    needed = ("force", "displacement", "unstable_directions", "critical_force")
    contains(dataset, "force-displacement curve", *needed)
    place, force = dataset["displacement"].values, dataset["force"].values
    held = dataset["unstable_directions_at_fixed_displacement"].values == 0
    low, high = _force_range(dataset)
    seen = (force >= low) & (force <= high)
    prefix_w, unit_w = scale_of(place[seen], "m")
    prefix_f, unit_f = scale_of([low, high], "N")
    kind = np.where(dataset["unstable_directions"].values == 0, 0, np.where(held, 1, 2))
    names = np.array(list(_STYLES))
    handles = []
    with frame(ax, dataset, height=84.0) as ax:
        secondary = np.flatnonzero(dataset["branch_kind"].values == "secondary")
        # the two halves of a secondary branch differ in a mode that does not move at the force
        for number in np.setdiff1d(np.arange(dataset.sizes["branch_number"]), secondary[1::2]):
            own = dataset["branch"].values == number
            handles += _pieces(ax, place[own] / prefix_w, force[own] / prefix_f, names[kind[own]])
        handles += _critical(dataset, ax, prefix_w, prefix_f)
        for name, words in (("snap_through", "snap-through"), ("snap_back", "snap-back")):
            value = float(dataset[f"{name}_force"])
            if np.isfinite(value):
                there = float(dataset[f"{name}_displacement"])
                at, right = (there / prefix_w, value / prefix_f), there > place[seen].mean()
                ax.plot(*at, "^" if value > 0.0 else "v", color="#000000", markersize=8.5, zorder=5)
                ax.annotate(
                    f"{words} {prefixed(value, 'N')}".replace(" -", " \N{MINUS SIGN}"), at,
                    xytext=(6.0 if right else -6.0, 9.0 if value > 0.0 else -15.0), textcoords="offset points",
                    ha="right" if right else "left", fontsize="small",
                    bbox={"facecolor": "white", "edgecolor": "none", "alpha": 0.8, "pad": 0.5}, zorder=7,
                )  # fmt: skip
        ax.axhline(0.0, color="#000000", linewidth=0.5, zorder=0)
        ax.set_xlabel(f"Displacement at the force's location, $w$ ({unit_w})")
        ax.set_ylabel(f"Force, $F$ ({unit_f})")
        margin = 0.05 * float(np.ptp(place[seen]))
        ax.set_xlim((place[seen].min() - margin) / prefix_w, (place[seen].max() + margin) / prefix_w)
        ax.set_ylim(low / prefix_f, high / prefix_f)
        legend_below(ax, _in_order(handles))
    return ax


def _pieces(ax: Axes, x: np.ndarray, y: np.ndarray, names: np.ndarray) -> list[Line2D]:
    """Draw a branch; a line of one kind of stability ends where the next one begins."""
    lines: list[Line2D] = []
    for part in np.split(np.arange(x.size), np.flatnonzero(names[1:] != names[:-1]) + 1):
        if part.size:
            points, name = slice(part[0], part[-1] + 2), str(names[part[0]])
            order = 3 - list(_STYLES).index(name)
            lines += ax.plot(x[points], y[points], label=name, zorder=order, **_STYLES[name])
    return lines


def _in_order(handles: list[Line2D]) -> list[Line2D]:
    """One legend entry of each label, those of stability first."""
    unique = {str(each.get_label()): each for each in reversed(handles)}
    return [unique.pop(name) for name in _STYLES if name in unique] + list(unique.values())[::-1]


def _force_range(dataset: xr.Dataset) -> tuple[float, float]:
    """Force axis: snap-through and snap-back with room for the stiff parts beyond; everything without them."""
    force = dataset["force"].values
    snaps = np.array([float(dataset[f"{name}_force"]) for name in ("snap_through", "snap_back")])
    if not np.isfinite(snaps).all():
        margin = 0.06 * float(np.ptp(force))
        return float(force.min()) - margin, float(force.max()) + margin
    low, high = min(*snaps, 0.0), max(*snaps, 0.0)
    return float(low - 0.9 * (high - low)), float(high + 0.9 * (high - low))


def _critical(dataset: xr.Dataset, ax: Axes, prefix_w: float, prefix_f: float) -> list[Line2D]:
    """Critical points at which a stable part begins or ends."""
    handles = []
    stable = (dataset["unstable_directions"].values == 0) | (
        dataset["unstable_directions_at_fixed_displacement"].values == 0
    )
    force, place = dataset["force"].values, dataset["displacement"].values
    spans = [max(float(np.ptp(each)), 1e-300) for each in (place, force)]
    for name, (marker, label) in _MARKERS.items():
        chosen = dataset["critical_kind"].values == name
        at = np.column_stack(
            (dataset["critical_displacement"].values[chosen], dataset["critical_force"].values[chosen])
        )
        apart = np.hypot(
            (place[stable] - at[:, :1]) / spans[0], (force[stable] - at[:, 1:]) / spans[1]
        ).min(axis=1, initial=np.inf)  # fmt: skip
        near = apart < 0.02
        if near.any():
            handles += ax.plot(
                at[near, 0] / prefix_w, at[near, 1] / prefix_f, marker, color="#000000", markerfacecolor="white",
                markersize=3.5, markeredgewidth=0.9, zorder=6, label=label,
            )  # fmt: skip
    return handles


BRANCH_FIGURES = ("midspan_displacement", "natural_frequency")
"""Variables that :func:`plot_equilibrium_branches` draws over a parameter."""


@checked
def plot_equilibrium_branches(
    dataset: xr.Dataset, ax: Axes | None = None, *, variable: str = "midspan_displacement"
) -> Axes:
    """Draw the equilibria of a system over a parameter: displacement or frequency, stability, critical points.

    Parameters
    ----------
    dataset : xarray.Dataset
        Of :func:`snapbeam.model.equilibrium_branches`.
    ax : matplotlib.axes.Axes, optional
        Axes to draw in; new ones by default.
    variable : {"midspan_displacement", "natural_frequency"}
        Displacement of the centre, or first natural frequency of the stable parts, which is 0 where one ends.

    Examples
    --------
    >>> import snapbeam as sb
    >>> plate = sb.ReducedModel.from_matrices([[1e-9]], [[2.0]], contact_shape=[1.0], length_scale=3e-6)
    >>> electrode = sb.ElectrostaticForce(voltage=1.0, area=4e-8, gap=3e-6)
    >>> found = sb.model.equilibrium_branches(sb.System(plate, forces=[electrode]), "force.voltage", (0.0, 8.0))
    >>> ax = sb.plot.plot_equilibrium_branches(found)
    """
    contains(dataset, "equilibrium branches", "midspan_displacement", "unstable_directions", "critical_value")
    frequency = choice("variable", variable, BRANCH_FIGURES) == "natural_frequency"
    row = lookup(dataset.attrs["parameter"])
    value, place = dataset[row.short].values, dataset["midspan_displacement"].values
    crossings, heights = dataset["critical_value"].values, dataset["critical_displacement"].values
    if frequency:
        place, heights = dataset["natural_frequency"].values[:, 0], np.zeros_like(heights)
    names = np.where(dataset["unstable_directions"].values == 0, "stable", "unstable")
    prefix, unit = scale_of(place, "Hz" if frequency else "m")
    size, axis = _short_axis(value, row.quantity.unit)
    label = dataclasses.replace(row, quantity=dataclasses.replace(row.quantity, unit=axis)).label
    handles: list[Line2D] = []
    with frame(ax, dataset, height=70.0) as ax:
        for number in np.unique(dataset["branch"].values):
            own = dataset["branch"].values == number
            handles += _pieces(ax, value[own] / size, place[own] / prefix, names[own])
        if frequency:
            handles = [each for each in handles if each.get_label() == "stable"]
        for kind, (marker, words) in _MARKERS.items():
            at = dataset["critical_kind"].values == kind
            if frequency:
                at &= dataset["critical_unstable_directions"].values == 0
            if at.any():
                handles += ax.plot(
                    crossings[at] / size, heights[at] / prefix,
                    marker, markerfacecolor="white", markeredgecolor="#000000", markersize=4.5, linestyle="", label=words,
                )  # fmt: skip
        ax.set_xlabel(wrapped(label))
        ax.set_ylabel(f"{'First natural frequency' if frequency else 'Displacement at mid-span'} ({unit})")
        ax.legend(handles=_in_order(handles), loc="best")
    return ax


def _short_axis(values: np.ndarray, unit: str) -> tuple[float, str]:
    """Factor and unit of an axis with short numbers: a prefix, or a power of ten where the unit takes none."""
    if unit.isalpha():
        return scale_of(values, unit)
    power = int(np.floor(np.log10(max(float(np.abs(values).max()), 1e-300))))
    if abs(power) < 4:
        return 1.0, unit
    return 10.0**power, f"$10^{{{power}}}$" + ("" if unit == "1" else f" {unit}")
