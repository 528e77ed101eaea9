"""Fig. A.9: relative error of the first ten natural frequencies as modes are added."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

import snapbeam as sb
from snapbeam.model.default_values import BEAM, MODES
from snapbeam.paper.system import paper_model
from snapbeam.plot.style import figure_style, fix_ticks, new_figure
from snapbeam.util.provenance import made_by

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

    from snapbeam.paper.recipe import Results

_COUNT = 10


def compute(results: Results) -> dict[str, xr.Dataset]:
    """Error of each frequency of each model against the exact one; NaN where a model has too few modes."""
    from snapbeam.util.datasets import xr

    modes = np.arange(1, results.pick(32, 64) + 1)
    exact = sb.model.exact_natural_frequencies(BEAM, _COUNT)
    error = np.full((modes.size, _COUNT), np.nan)
    for row, count in zip(error, modes, strict=True):
        freq = paper_model(int(count)).natural_frequencies[:_COUNT]
        row[: freq.size] = freq / exact[: freq.size] - 1.0
    words = {"units": "1", "long_name": "relative error of the natural frequency"}
    return {
        "error": xr.Dataset(
            {"error": (("modes", "number"), error, words), "exact": ("number", exact, {"units": "Hz"})},
            {"modes": modes, "number": np.arange(1, _COUNT + 1)},
            made_by({"count": _COUNT}),
        )
    }


def draw(results: Results) -> Figure:
    """The errors over N."""
    from cmcrameri import cm

    error = results["figA9"]["error"]
    modes = error.modes.values
    with figure_style():
        figure = new_figure("single", 74.0)
        ax = figure.add_subplot()
        colors = cm.batlow(np.linspace(0.0, 0.92, _COUNT))
        for column, color in enumerate(colors):
            values = error.error.values[:, column]
            marker = "s" if column % 2 else "o"  # the modes of the paper's beam alternate, the first is symmetric
            ax.semilogy(modes, values, color=color, marker=marker, markersize=1.8, linewidth=0.7, label=f"{column + 1}")
        ax.axhline(7e-4, color="0.3", linewidth=0.7, dashes=(4, 2))
        ax.axvline(MODES, color="0.3", linewidth=0.7, dashes=(1, 2))
        ax.annotate("0.07 %", (modes[-1], 7e-4), (-2, 2), textcoords="offset points", fontsize=7, ha="right")
        ax.set(xlabel="Number of buckling modes $N$", ylabel="Relative error of natural frequency")
        ax.set_xlim(0.0, modes[-1] + 1.0)
        figure.legend(
            title="dynamic mode (round: symmetric, square: antisymmetric)", title_fontsize=7,
            loc="outside lower center", ncols=5,
        )  # fmt: skip
        fix_ticks(ax)
    return figure
