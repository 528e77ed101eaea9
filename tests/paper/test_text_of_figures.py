"""Fig. 6 and Fig. 8 of the paper keep their text inside the canvas in each style."""

from __future__ import annotations

import matplotlib.pyplot as plt
import numpy as np
import pytest

import snapbeam as sb
from snapbeam import paper
from snapbeam.plot.style import COLUMN_WIDTHS
from snapbeam.util.datasets import xr

SYSTEM_ATTRS = {"beam_length": 0.161, "beam_thickness": 4e-4, "length_scale": 3.35e-4, "reference_frequency": 83.9}


@pytest.fixture(params=("elsevier", "ieee", "talk"))
def style(request):
    sb.plot.plot_style(request.param)
    yield request.param
    sb.plot.plot_style("elsevier")


def paper_results() -> paper.Results:
    """Maps of the size of a sketch, with every class, instead of computed ones."""
    rng = np.random.default_rng(2)
    results = paper.Results("quick")
    v, location = np.linspace(0.05, 0.65, 13), np.linspace(0.06, 0.5, 8)
    for modes in (1, 4):
        attrs = SYSTEM_ATTRS | {"modes": modes, "cycles": 200}
        kinds = rng.integers(0, 4, (20, 13)).astype(np.int8)
        results._known.setdefault("fig6", {})[f"modes_{modes}"] = xr.Dataset(
            {"response_class": (("frequency_ratio", "velocity_amplitude"), kinds)},
            {"frequency_ratio": np.linspace(0.2, 4.0, 20), "velocity_amplitude": v, "location": 0.476}, attrs,
        )  # fmt: skip
    for ratio in (0.05, 0.625, 1.625):
        for modes in (1, 4):
            results._known.setdefault("fig8", {})[f"omega_{ratio:g}_modes_{modes}"] = xr.Dataset(
                {"response_class": (("relative_amplitude", "location"), rng.integers(0, 4, (8, 8)).astype(np.int8))},
                {"relative_amplitude": np.linspace(0.1, 2.0, 8), "location": location, "frequency_ratio": ratio},
                {"modes": modes},
            )  # fmt: skip
    return results


@pytest.mark.slow
@pytest.mark.parametrize("name", ["fig6", "fig8"])
def test_figures_of_the_paper_in_each_style(name: str, style: str) -> None:
    figure = getattr(paper, name)(results=paper_results())
    assert 25.4 * figure.get_figwidth() == pytest.approx(COLUMN_WIDTHS["double"])
    figure.canvas.draw()
    drawn = figure.get_tightbbox()
    assert np.max([*-drawn.min, *(drawn.max - figure.get_size_inches())]) < 0.01, "in inches"
    plt.close(figure)
