"""A test series at a glance: a small picture of every test, the spoiled ones with their reason."""

from __future__ import annotations

import textwrap
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from snapbeam.plot.style import BEAM_COLOR, CLASS_COLORS, SHAKER_COLOR, figure_style, fix_ticks, new_figure
from snapbeam.util.netcdf import read_netcdf
from snapbeam.util.status_codes import ResponseClass
from snapbeam.util.validation import InputError

if TYPE_CHECKING:
    from snapbeam.lab.batch import TestResult

__all__ = ["plot_test_series"]


_ACROSS = 4
_WIDTH = 44  # letters of a line in a picture
_LINES = 12  # of a reason in a picture; the table has all of it
_ROOM = 0.3  # of the height of a picture above the curves, for the codes of diagnostics
_LABELS = {kind.label: kind for kind in ResponseClass}


def plot_test_series(results: list[TestResult], folder: Path) -> Figure:
    """Draw beam and shaker of every test over time, in a frame of the colour of its class.

    Parameters
    ----------
    results : list of TestResult
        What :func:`snapbeam.lab.batch.run_test_series` returned.
    folder : path
        Where the tracked runs are kept, ``<test>.nc``.
    """
    if not results:
        raise InputError("results: must hold at least one test")
    rows = -(-len(results) // _ACROSS)
    with figure_style():
        figure = new_figure("double", 34.0 * rows + 8.0)
        axes = figure.subplots(rows, _ACROSS, squeeze=False).ravel()
        for ax, result in zip(axes, results, strict=False):
            _thumbnail(ax, result, folder / f"{result.test}.nc")
        for ax in axes[len(results) :]:
            ax.set_axis_off()
        for k in range(max(len(results) - _ACROSS, 0), len(results)):
            axes[k].set_xlabel("time (s)")
        for k in range(0, len(results), _ACROSS):
            axes[k].set_ylabel("$w$ ($b$)")
        handles = [
            axes[0].plot([], [], "s", color=CLASS_COLORS[kind], label=kind.label)[0]
            for kind in ResponseClass
            if any(result.response_class == kind.label for result in results)
        ]
        figure.legend(handles=handles, loc="outside lower center", ncols=len(handles))
        fix_ticks(*axes[: len(results)])
    return figure


def _thumbnail(ax: Axes, result: TestResult, path: Path) -> None:
    color = CLASS_COLORS[_LABELS.get(result.response_class, ResponseClass.UNKNOWN)]
    told = result.status != "measured"
    if path.exists() and not told:
        with read_netcdf(path, lazily=True) as run:
            time = run["time"].values
            step = max(1, time.size // 2000)
            for name, line, width in (
                ("striker_displacement", SHAKER_COLOR, 0.4), ("displacement_at_striker", BEAM_COLOR, 0.5)
            ):  # fmt: skip
                if name in run:
                    shown = run[name].values[::step]
                    ax.plot(time[::step], shown, color=line, linewidth=width)
            ax.set_xlim(time[0], time[-1])
        ax.axhline(0.0, color="0.8", linewidth=0.4, zorder=0)
    else:
        ax.set(xticks=[], yticks=[])
    for spine in ax.spines.values():
        spine.set(color=color, linewidth=1.6)
    title = result.test
    if np.isfinite(result.frequency_hz):
        title += f": {result.frequency_hz:.4g} Hz, {1e3 * result.velocity_m_s:.3g} mm/s"
    ax.set_title(title, fontsize=6, loc="left")
    codes = dict.fromkeys(code for code, severity, _ in result.diagnostics if severity != "info")
    if told:
        lines = textwrap.wrap(f"{result.status}: {result.reason}", _WIDTH)
        text = "\n".join(lines if len(lines) <= _LINES else [*lines[: _LINES - 1], lines[_LINES - 1] + " ..."])
        ax.text(0.04, 0.93, text, transform=ax.transAxes, fontsize=4.2, va="top", color=SHAKER_COLOR)
    elif codes:
        low, high = ax.get_ylim()
        ax.set_ylim(low, high + _ROOM * (high - low))
        text = "\n".join(textwrap.wrap("! " + " ".join(codes), _WIDTH))
        ax.text(0.04, 0.93, text, transform=ax.transAxes, fontsize=4.2, va="top", color=SHAKER_COLOR)
