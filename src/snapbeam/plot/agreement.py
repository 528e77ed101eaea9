"""Certainty of the response classes of a map: paler colours where replicates disagree."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import ListedColormap, to_rgb
from matplotlib.legend import Legend
from matplotlib.legend_handler import HandlerBase
from matplotlib.patches import Patch, Rectangle
from numpy.typing import NDArray

from snapbeam.plot.style import CLASS_COLORS
from snapbeam.util.status_codes import ResponseClass

if TYPE_CHECKING:
    import xarray as xr

_STEPS = (1.0, 0.75, 0.5, 0.25)
"""Shares of repeats that agree, of which the legend shows the shade."""
_PALEST = 0.85
"""Share of white in a cell that none of its repeats agrees with."""


def draw_agreement(
    ax: Axes, dataset: xr.Dataset, dims: tuple[str, str], edges: tuple[NDArray[np.float64], ...]
) -> Patch:
    """Lay white over the cells of a map, the more the fewer repeats have the class of the cell's own run.

    Returns the scale of the shades, for the legend.
    """
    share = dataset["class_fraction"].squeeze().transpose(dims[1], dims[0], "class_code")
    kinds = dataset["response_class"].squeeze().transpose(dims[1], dims[0]).values
    own = kinds[..., None] == share["class_code"].values
    agreement = np.where(own, share.values, 0.0).sum(axis=-1)
    unknown = np.isnan(share.values).any(axis=-1)
    white = np.where(unknown, 0.0, _PALEST * (1.0 - agreement))
    ramp = ListedColormap([(1.0, 1.0, 1.0, alpha) for alpha in np.linspace(0.0, 1.0, 256)])
    ax.pcolormesh(*edges, white, cmap=ramp, vmin=0.0, vmax=1.0, rasterized=True)
    split = float(np.mean(agreement[~unknown] < 1.0 - 1e-9)) if (~unknown).any() else 0.0
    most, least = 100.0 * _STEPS[0], 100.0 * _STEPS[-1]
    words = f"repeats agree, {most:.0f} to {least:.0f} %;\n{100.0 * split:.1f} % of cells are split"
    return _Scale(label=words)


class _Scale(Patch):
    """Stands in a legend for shades of one colour, from full to pale."""


class _ScaleHandler(HandlerBase):
    """Draws the shades side by side."""

    def create_artists(
        self, legend: Any, _: Any, x: float, y: float, width: float, height: float, __: float, trans: Any
    ) -> list[Rectangle]:
        """A rectangle for each step, in the colour of a class over which white is laid as in the map."""
        part = width / len(_STEPS)
        color = np.array(to_rgb(CLASS_COLORS[ResponseClass.INTRAWELL]))
        shades = [color + _PALEST * (1.0 - step) * (1.0 - color) for step in _STEPS]
        return [
            Rectangle(
                (-x + k * part, -y), part, height, facecolor=shade, edgecolor="black", linewidth=0.4, transform=trans
            )
            for k, shade in enumerate(shades)
        ]  # fmt: skip


Legend.update_default_handler_map({_Scale: _ScaleHandler()})
