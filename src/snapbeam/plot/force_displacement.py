"""Figures of static equilibria: force-displacement curves, and branches over a parameter."""

from __future__ import annotations

import dataclasses
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D

from snapbeam.model.parameters import lookup
from snapbeam.plot.style import frame, legend_below
from snapbeam.util.si_prefixes import prefixed, scale_of
from snapbeam.util.validation import InputError, checked

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["plot_equilibrium_branches", "plot_force_displacement"]


_STABLE, _HELD, _UNSTABLE = "#16245E", "#B03A27", "#9A9A9A"
_STYLES: dict[str, tuple[str, Any, float]] = {
    "stable": (_STABLE, "-", 1.6),
    "stable under displacement control only": (_HELD, "--", 1.2),
    "unstable": (_UNSTABLE, ":", 0.9),
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
        Where to draw; a new figure one column wide by default.

    Returns
    -------
    matplotlib.axes.Axes

    Examples
    --------
    >>> import snapbeam as sb
    >>> beam = sb.Beam(length=5e-4, thickness=2e-6, width=2e-5, density=2330, young_modulus=160e9, axial_load=0.0)
    >>> arch = sb.ReducedModel.from_beam(beam, modes=4, imperfection=sb.Imperfection(midspan_amplitude=6e-6))
    >>> ax = sb.plot.plot_force_displacement(sb.force_displacement(arch, 0.5))
    """
    if not {"force", "displacement", "unstable_directions", "critical_force"} <= set(dataset.variables):
        raise InputError(
            f"dataset with {', '.join(map(str, dataset.variables))}: must be a result of force_displacement"
        )
    place, force = dataset["displacement"].values, dataset["force"].values
    held = dataset["unstable_directions_at_fixed_displacement"].values == 0
    low, high = _force_range(dataset)
    seen = (force >= low) & (force <= high)
    prefix_w, unit_w = scale_of(place[seen], "m")
    prefix_f, unit_f = scale_of([low, high], "N")
    kind = np.where(dataset["unstable_directions"].values == 0, 0, np.where(held, 1, 2))
    names = list(_STYLES)
    drawn = set()
    with frame(ax, height=84.0) as ax:
        secondary = np.flatnonzero(dataset["branch_kind"].values == "secondary")
        # the two halves of a secondary branch differ in a mode that does not move at the force
        for number in np.setdiff1d(np.arange(dataset.sizes["branch_number"]), secondary[1::2]):
            index = np.flatnonzero(dataset["branch"].values == number)
            # a line of one kind ends where the next one begins
            cuts = np.flatnonzero(np.diff(kind[index])) + 1
            for part in np.split(np.arange(index.size), cuts):
                if not part.size:
                    continue
                name = names[kind[index[part[0]]]]
                color, line, width = _STYLES[name]
                points = index[part[0] : min(part[-1] + 2, index.size)]
                order = 3 - kind[index[part[0]]]
                ax.plot(
                    place[points] / prefix_w,
                    force[points] / prefix_f,
                    line,
                    color=color,
                    linewidth=width,
                    zorder=order,
                )
                drawn.add(name)
        handles = [
            Line2D(
                [],
                [],
                color=_STYLES[name][0],
                linestyle=_STYLES[name][1],
                linewidth=_STYLES[name][2],
                label=name,
            )
            for name in names
            if name in drawn
        ]
        handles += _critical(dataset, ax, prefix_w, prefix_f)
        for name, words in (("snap_through", "snap-through"), ("snap_back", "snap-back")):
            value = float(dataset[f"{name}_force"])
            if np.isfinite(value):
                ax.plot(
                    float(dataset[f"{name}_displacement"]) / prefix_w, value / prefix_f,
                    "^" if value > 0.0 else "v", color="#000000", markersize=6.0, zorder=6,
                )  # fmt: skip
                right = float(dataset[f"{name}_displacement"]) > place[seen].mean()
                ax.annotate(
                    f"{words} {prefixed(value, 'N')}",
                    (float(dataset[f"{name}_displacement"]) / prefix_w, value / prefix_f),
                    xytext=(6.0 if right else -6.0, 9.0 if value > 0.0 else -15.0), textcoords="offset points",
                    ha="right" if right else "left", fontsize=7.0,
                    bbox={"facecolor": "white", "edgecolor": "none", "alpha": 0.8, "pad": 0.5}, zorder=7,
                )  # fmt: skip
        ax.axhline(0.0, color="#000000", linewidth=0.5, zorder=0)
        ax.set_xlabel(f"Displacement at the force's location, $w$ ({unit_w})")
        ax.set_ylabel(f"Force, $F$ ({unit_f})")
        margin = 0.05 * float(np.ptp(place[seen]))
        ax.set_xlim((place[seen].min() - margin) / prefix_w, (place[seen].max() + margin) / prefix_w)
        ax.set_ylim(low / prefix_f, high / prefix_f)
        legend_below(ax, handles)
    return ax


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
        near = np.array(
            [
                bool(stable.any())
                and float(np.hypot((place[stable] - w) / spans[0], (force[stable] - f) / spans[1]).min())
                < 0.02
                for w, f in at
            ],
            dtype=bool,
        )
        if near.any():
            ax.plot(
                at[near, 0] / prefix_w, at[near, 1] / prefix_f, marker, color="#000000", markerfacecolor="white",
                markersize=4.0, markeredgewidth=0.9, zorder=5,
            )  # fmt: skip
            handles.append(
                Line2D(
                    [], [], linestyle="", marker=marker, color="#000000", markerfacecolor="white", markersize=4.0,
                    label=label,
                )
            )  # fmt: skip
    return handles


@checked
def plot_equilibrium_branches(dataset: xr.Dataset, ax: Axes | None = None) -> Axes:
    """Draw the equilibria of a system over a parameter: displacement of the centre, stability, critical points.

    Parameters
    ----------
    dataset : xarray.Dataset
        Of :func:`snapbeam.model.equilibrium_branches`.
    ax : matplotlib.axes.Axes, optional
        Where to draw; a new figure one column wide by default.

    Returns
    -------
    matplotlib.axes.Axes

    Examples
    --------
    >>> import snapbeam as sb
    >>> plate = sb.ReducedModel.from_matrices([[1e-9]], [[2.0]], contact_shape=[1.0], length_scale=3e-6)
    >>> electrode = sb.ElectrostaticForce(voltage=1.0, area=4e-8, gap=3e-6)
    >>> found = sb.model.equilibrium_branches(sb.System(plate, forces=[electrode]), "force.voltage", (0.0, 8.0))
    >>> ax = sb.plot.plot_equilibrium_branches(found)
    """
    if not {"midspan_displacement", "unstable_directions", "critical_value"} <= set(dataset.variables):
        raise InputError(
            f"dataset with {', '.join(map(str, dataset.variables))}: must be a result of equilibrium_branches"
        )
    row = lookup(dataset.attrs["parameter"])
    value, place = dataset[row.short].values, dataset["midspan_displacement"].values
    stable = dataset["unstable_directions"].values == 0
    prefix, unit = scale_of(place, "m")
    size, axis = _short_axis(value, row.quantity.unit)
    label = dataclasses.replace(row, quantity=dataclasses.replace(row.quantity, unit=axis)).label
    with frame(ax, height=70.0) as ax:
        for number in np.unique(dataset["branch"].values):
            index = np.flatnonzero(dataset["branch"].values == number)
            for part in np.split(np.arange(index.size), np.flatnonzero(np.diff(stable[index])) + 1):
                # a line of one kind ends where the next one begins
                points = index[part[0] : min(part[-1] + 2, index.size)]
                color, line, width = _STYLES["stable" if stable[points[0]] else "unstable"]
                ax.plot(value[points] / size, place[points] / prefix, line, color=color, linewidth=width)
        handles = [
            Line2D([], [], color=_STYLES[name][0], linestyle=_STYLES[name][1], label=name)
            for name in ("stable", "unstable")
            if (stable if name == "stable" else ~stable).any()
        ]
        for kind, (marker, words) in _MARKERS.items():
            at = dataset["critical_kind"].values == kind
            if at.any():
                handles += ax.plot(
                    dataset["critical_value"].values[at] / size, dataset["critical_displacement"].values[at] / prefix,
                    marker, markerfacecolor="white", markeredgecolor="#000000", markersize=4.5, linestyle="", label=words,
                )  # fmt: skip
        ax.set_xlabel(label)
        ax.set_ylabel(f"Displacement of the centre ({unit})")
        ax.legend(handles=handles, loc="best")
    return ax


def _short_axis(values: np.ndarray, unit: str) -> tuple[float, str]:
    """Factor and unit of an axis with short numbers: a prefix, or a power of ten where the unit takes none."""
    if unit.isalpha():
        return scale_of(values, unit)
    power = int(np.floor(np.log10(max(float(np.abs(values).max()), 1e-300))))
    if abs(power) < 4:
        return 1.0, unit
    return 10.0**power, f"$10^{{{power}}}$" + ("" if unit == "1" else f" {unit}")
