"""The motions of tips in the schematic of a system: one, or those of several strikers in one pair of axes."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from numpy.typing import NDArray

from snapbeam.figures.style import CENTER_COLOR, SHAKER_COLOR
from snapbeam.model.system import System

__all__ = ["draw_tips", "motion_of"]

_Array = NDArray[np.float64]
_CYCLES = 8.0
_LINES: tuple[dict[str, Any], ...] = (
    {"color": SHAKER_COLOR}, {"color": CENTER_COLOR, "linestyle": "--"}, {"color": "0.3", "linestyle": ":"},
    {"color": "0.6"},
)  # fmt: skip


def draw_tips(ax: Axes, system: System, tips: list[tuple[int, Any]]) -> None:
    """Displacements of tips from their mid-positions over the first cycles of the first one, each towards the beam."""
    scale = system.scale
    lead = tips[0][1]
    times = np.linspace(0.0, _CYCLES * float(lead.cycle(_columns(lead), scale)[0]), 1601)
    for (number, drive), line in zip(tips, _LINES, strict=False):
        columns = _columns(drive)
        moved = motion_of(drive, columns, scale, times, float(columns.get("phase", np.zeros(1))[0]))
        ax.plot(times / times[-1] * _CYCLES, moved / scale.length, label=f"striker {number}", **line)
    ax.set_xlabel("Cycles of the drive")
    ax.set_ylabel("Tips / $b$")
    ax.set_xlim(0.0, _CYCLES)
    ax.legend(ncols=2, loc="lower center", bbox_to_anchor=(0.45, 1.0), frameon=False, columnspacing=1.0)


def _columns(drive: Any) -> dict[str, _Array]:
    return {name: np.array([value]) for name, value in drive.values().items()} or {"": np.zeros(1)}


def motion_of(drive: Any, columns: dict[str, _Array], scale: Any, times: _Array, phase: float) -> _Array:
    """Displacement of a tip from its mid-position at instants, m, or the change of a load, N."""
    found = drive.numbers(columns, scale)
    if drive.harmonic:
        return np.asarray(found["amplitude"][0] * np.sin(found["omega"][0] * times + phase))
    numbers = drive.numbers_type()(*(float(found[name][0]) for name in drive.number_names))
    samples = drive.samples()
    return np.array([drive.motion(numbers, samples, numbers.omega * t)[0] for t in times])
