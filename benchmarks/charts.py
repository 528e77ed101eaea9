"""Figures of the benchmarks."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from snapbeam.plot.style import figure_style, new_figure, save_figure

__all__ = ["requests_chart", "scaling_chart", "work_precision_chart"]

# library: colour; method: marker and line
_COLORS = {
    "snapbeam": "#000000",
    "scipy": "#B03A27",
    "numbalsoda": "#16245E",
    "Boost.odeint": "#6B8E23",
    "heyoka": "#3D9BE0",
    "diffrax": "#8A8A8A",
}
_MARKS = {
    "snapbeam standard": ("o", "-"),
    "snapbeam reference": ("s", "--"),
    "scipy DOP853": ("v", "-"),
    "scipy LSODA": ("^", "--"),
    "scipy odeint": ("x", ":"),
    "numbalsoda dop853": ("v", "-"),
    "numbalsoda lsoda": ("^", "--"),
    "Boost.odeint dopri5": ("v", "-"),
    "Boost.odeint fehlberg78": ("^", "--"),
    "Boost.odeint Bulirsch-Stoer": ("x", ":"),
    "heyoka Taylor": ("D", "-"),
    "diffrax Tsit5": ("<", "-"),
    "diffrax Dopri8": (">", "--"),
}
_FLOOR = 1e-13


def work_precision_chart(data: dict[str, Any], path: Path) -> None:
    """Time of a run against its error, a panel per point."""
    points = list(data["points"])
    with figure_style():
        figure = new_figure("double", 92.0)
        axes = figure.subplots(1, len(points), sharex=True, sharey=True)
        for ax, point in zip(axes, points, strict=True):
            for method, (marker, line) in _MARKS.items():
                mine = [r for r in data["records"] if r["point"] == point and r["method"] == method]
                mine = [r for r in mine if np.isfinite(r["e5"])]
                if not mine:
                    continue
                color = _COLORS[method.split()[0]]
                ax.plot(
                    [max(r["e5"], _FLOOR) for r in mine],
                    [r["seconds"] for r in mine],
                    line,
                    marker=marker,
                    color=color,
                    markersize=4,
                    markerfacecolor=color if line == "-" else "white",
                    label=method,
                )
            ax.axvline(1e-3, color="#BBBBBB", linewidth=0.6, zorder=0)
            ax.set(xscale="log", yscale="log", xlabel="error over five cycles $e_5$ (b)")
            ax.set_title(rf"$(\Omega, V)$ = {point}")
            ax.grid(True, which="major", color="#E4E4E4", linewidth=0.4)
        axes[0].set_ylabel("time per 200 cycles (s)")
        handles, labels = axes[0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside lower center", ncols=5)
        save_figure(figure, path)


def requests_chart(data: dict[str, Any], path: Path) -> None:
    """Measured error against the requested tolerance."""
    marks = {1: ("o", "#16245E"), 8: ("^", "#3D9BE0"), 32: ("s", "#B03A27")}
    with figure_style():
        figure = new_figure("single", 80.0)
        ax = figure.subplots()
        for shift, (modes, (marker, color)) in enumerate(marks.items()):
            mine = [r for r in data["records"] if r["modes"] == modes and r["error"] is not None]
            contact_event, short = [r for r in mine if r["reached"]], [r for r in mine if not r["reached"]]
            for group, face in ((contact_event, color), (short, "none")):
                ax.plot(
                    [r["tolerance"] * 1.25 ** (shift - 1) for r in group],
                    [max(r["error"], _FLOOR) for r in group],
                    linestyle="none",
                    marker=marker,
                    markersize=3.5,
                    markeredgecolor=color,
                    markerfacecolor=face,
                    label=f"N = {modes}" if face == color else None,
                )
        ends = np.array([min(r["tolerance"] for r in data["records"]), max(r["tolerance"] for r in data["records"])])
        ax.plot(ends, ends, color="#000000", label="error = request")
        ax.set(
            xscale="log", yscale="log", xlabel="requested tolerance (b)", ylabel="error measured up to the horizon (b)"
        )
        ax.grid(True, color="#E4E4E4", linewidth=0.4)
        ax.legend(loc="lower right")
        save_figure(figure, path)


def scaling_chart(data: dict[str, Any], path: Path) -> None:
    """Time per run against the number of runs; time against the number of modes."""
    with figure_style():
        figure = new_figure("double", 70.0)
        left, right = figure.subplots(1, 2)
        runs, modes = data["runs"], data["modes"]
        left.plot([r["runs"] for r in runs], [r["microseconds"] for r in runs], "o-", color="#000000", markersize=4)
        left.set(xscale="log", xlabel="runs", ylabel=r"time per run ($\mathrm{\mu}$s)")
        left.set_ylim(0.0, 1.4 * max(r["microseconds"] for r in runs))
        count = [r["modes"] for r in modes]
        right.plot(count, [r["milliseconds"] for r in modes], "o-", color="#000000", markersize=4)
        right.set(xscale="log", yscale="log", xlabel="modes $N$", ylabel="time per 200 cycles (ms)")
        for ax in (left, right):
            ax.grid(True, color="#E4E4E4", linewidth=0.4)
        right.set_xticks(count, [str(n) for n in count])
        right.xaxis.minorticks_off()
        save_figure(figure, path)
