"""What surrounds a beam, in the schematic of a system: its base, a load that changes, layers, a coil and their load."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Polygon, Rectangle
from numpy.typing import NDArray

from snapbeam.figures.style import BEAM_COLOR, CENTER_COLOR
from snapbeam.model.system import System
from snapbeam.model.world import ElectromagneticHarvester, PiezoelectricHarvester

__all__ = ["FRAME", "draw_surroundings"]

_Array = NDArray[np.float64]
FRAME = 2.3
"""Distance of the base's bar from the straight beam, b."""
_LAYER = 0.09
"""Thickness of a layer in the picture, b."""
_COLOR = CENTER_COLOR


def draw_surroundings(ax: Axes, system: System, x: _Array, w: _Array, sign: float, wide: float) -> None:
    """Draw what surrounds the beam; *x* and *w* are its shape at rest, *sign* the striker's side."""
    if system.base_excitation is not None:
        _base(ax, system, sign, wide)
    if isinstance(system.harvester, PiezoelectricHarvester):
        _layers(ax, system.harvester, x, w, sign, wide)
    if isinstance(system.harvester, ElectromagneticHarvester):
        _coil(ax, system.harvester, x, w, sign, wide)


def _base(ax: Axes, system: System, sign: float, wide: float) -> None:
    """A frame under the clamps, and the arrow of its motion."""
    assert system.base_excitation is not None
    foot = -sign * FRAME
    bar: Any = {"facecolor": "0.88", "edgecolor": BEAM_COLOR, "linewidth": 0.6}
    for left in (-0.3, wide + 0.06):
        ax.add_patch(Rectangle((left, min(foot, -0.35 * sign)), 0.24, FRAME - 0.35, zorder=0, **bar))
    ax.add_patch(Rectangle((-0.3, min(foot, foot - 0.16 * sign)), wide + 0.6, 0.16, zorder=0, **bar))
    up = 1.0 if system.base_excitation.direction == "up" else -1.0
    arrow: Any = {"arrowstyle": "-|>", "lw": 1.0, "color": _COLOR}
    middle = -sign * (FRAME - 0.75)
    ax.annotate("", (0.62, middle + 0.4 * up), (0.62, middle - 0.4 * up), arrowprops=arrow)
    ax.text(0.76, middle, "$y(t)$", ha="left", va="center", color=_COLOR)
    if system.striker is not None and not system.base_excitation.striker_on_base:
        at = system.striker.location * wide
        ax.text(at + 0.75, -sign * 2.05, "not on the base", ha="left", va="center", color=_COLOR)


def _layers(ax: Axes, piezo: PiezoelectricHarvester, x: _Array, w: _Array, sign: float, wide: float) -> None:
    """Both layers along the beam, and wires to a resistor on the other side than the striker."""
    inside = (x >= piezo.patch_start * wide) & (x <= piezo.patch_end * wide)
    for away in (1.0, -1.0):
        outline = np.concatenate((
            np.stack((x[inside], w[inside] + 0.03 * away), axis=1),
            np.stack((x[inside], w[inside] + (0.03 + _LAYER) * away), axis=1)[::-1],
        ))  # fmt: skip
        ax.add_patch(Polygon(outline, closed=True, facecolor=_COLOR, alpha=0.75, edgecolor="none", zorder=4))
    at = 0.5 * (piezo.patch_start + piezo.patch_end) * wide
    there = float(np.interp(at, x, w))
    _resistor(ax, at, there + sign * (0.03 + _LAYER), sign, f"{_ohms(piezo.resistance)}")


def _coil(ax: Axes, coil: ElectromagneticHarvester, x: _Array, w: _Array, sign: float, wide: float) -> None:
    """A magnet on the beam and the windings beside it."""
    at = coil.location * wide
    there = float(np.interp(at, x, w))
    edge = there + 0.03 * sign
    corner = (at - 0.09, min(edge, edge + 0.34 * sign))
    ax.add_patch(
        Rectangle(corner, 0.18, 0.34, facecolor="0.55", edgecolor=BEAM_COLOR, linewidth=0.5, zorder=4)
    )
    for side in (-1.0, 1.0):
        for turn in range(4):
            y = there + sign * (0.22 + 0.1 * turn)
            ax.plot(at + side * 0.19, y, marker="o", markersize=2.2, color=_COLOR, zorder=4)
    _resistor(ax, at, there + sign * 0.6, sign, f"{_ohms(coil.resistance)}", apart=0.19)


def _resistor(ax: Axes, at: float, edge: float, sign: float, words: str, apart: float = 0.14) -> None:
    top = sign * 0.85
    share = np.linspace(0.0, 1.0, 9)
    swing = np.array([0.0, 0.0, 1.0, -1.0, 1.0, -1.0, 1.0, 0.0, 0.0])
    for side in (-1.0, 1.0):
        ax.plot(
            [at + side * apart, at + side * apart, at + side * 0.32],
            [edge, top, top],
            color=_COLOR,
            linewidth=0.7,
        )
    ax.plot(at - 0.32 + 0.64 * share, top + 0.28 * sign + 0.06 * swing, color=_COLOR, linewidth=0.9)
    for side in (-1.0, 1.0):
        ax.plot([at + side * 0.32] * 2, [top, top + 0.28 * sign], color=_COLOR, linewidth=0.7)
    # over the resistor, clear of the shape of the other well
    ax.text(at, top + 0.58 * sign, words, ha="center", va="center", color=_COLOR)


def _ohms(value: float) -> str:
    for size, prefix in ((1e6, "M"), (1e3, "k"), (1.0, "")):
        if value >= size:
            return rf"{value / size:.3g} {prefix}$\Omega$"
    return rf"{value:.3g} $\Omega$"
