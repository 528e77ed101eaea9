"""How sure the class of each point of a map is: paler where its repeats disagree."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import ListedColormap
from matplotlib.patches import Patch
from numpy.typing import NDArray

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["draw_agreement"]

_PALEST = 0.85
"""Share of white in a cell that none of its repeats agrees with."""


def draw_agreement(
    ax: Axes, dataset: xr.Dataset, dims: tuple[str, str], edges: tuple[NDArray[np.float64], ...]
) -> Patch:
    """Lay white over the cells of a map, the more the fewer repeats have the class of the cell's own run.

    Returns what a legend needs to say so.
    """
    share = dataset["class_share"].squeeze().transpose(dims[1], dims[0], "response_class")
    kinds = dataset["response"].squeeze().transpose(dims[1], dims[0]).values
    own = kinds[..., None] == share["response_class"].values
    agreement = np.where(own, share.values, 0.0).sum(axis=-1)
    unknown = np.isnan(share.values).any(axis=-1)
    white = np.where(unknown, 0.0, _PALEST * (1.0 - agreement))
    ramp = ListedColormap([(1.0, 1.0, 1.0, alpha) for alpha in np.linspace(0.0, 1.0, 256)])
    ax.pcolormesh(*edges, white, cmap=ramp, vmin=0.0, vmax=1.0, rasterized=True)
    split = float(np.mean(agreement[~unknown] < 1.0 - 1e-9)) if (~unknown).any() else 0.0
    label = f"paler: repeats disagree, {100.0 * split:.1f} %"
    return Patch(facecolor="white", edgecolor="black", linewidth=0.4, label=label)
