"""Every figure keeps its text inside the canvas, at the width of one column and of two."""

from __future__ import annotations

import matplotlib.pyplot as plt
import numpy as np
import pytest

import snapbeam as sb
from snapbeam.model import default_values
from snapbeam.plot.dataset import figures_of
from snapbeam.plot.style import COLUMN_WIDTHS, save_figure
from snapbeam.util.datasets import xr

SHORT = sb.Integration(cycles=20)
MODEL = sb.ReducedModel.from_beam(default_values.BEAM, modes=1, damping_ratio=0.05)
SYSTEM = sb.System(
    MODEL,
    contacts=[sb.Contact(default_values.CONTACT, sb.Shaker(frequency_ratio=1.6, velocity_amplitude=0.03))],
)
AXES = {"drive.frequency_ratio": [0.8, 1.2, 1.6], "drive.velocity_amplitude": [0.1, 0.2, 0.3]}


def exponents(**axes: np.ndarray) -> xr.Dataset:
    shape = (*(len(values) for values in axes.values()), 1)
    over = (*axes, "exponent_number")
    data = {
        "exponent": (over, np.linspace(-2.0, 2.0, np.prod(shape)).reshape(shape), {"units": "1/s"}),
        "exponent_error": (over, np.full(shape, 0.3), {"units": "1/s"}),
    }
    return xr.Dataset(data, {**axes, "exponent_number": [1]})


def probability() -> xr.Dataset:
    ratio, v = np.linspace(0.5, 2.0, 9), np.linspace(0.05, 0.4, 8)
    share = 1.0 / (1.0 + np.exp(-40.0 * (v - 0.1 - 0.05 * ratio[:, None])))[..., None]
    dims = ("frequency_ratio", "velocity_amplitude", "outcome")
    ends = {"": 0.0, "_low": -0.05, "_high": 0.05}
    data = {f"probability{end}": (dims, np.clip(share + shift, 0.0, 1.0)) for end, shift in ends.items()}
    data["reached"] = (dims[:2], share[..., 0] < 0.99)
    coords = {"frequency_ratio": ratio, "velocity_amplitude": v, "outcome": ["snap"]}
    return xr.Dataset(data, coords, {"confidence": 0.95})


def basins() -> xr.Dataset:
    grid = {"amplitude[1]": np.linspace(-0.98, 1.4, 6), "velocity[1]": np.linspace(-0.6, 0.6, 5)}
    return sb.dynamics.basins_of_attraction(sb.dynamics.find_attractors(SYSTEM, 12), grid)


def branch() -> xr.Dataset:
    orbit = sb.dynamics.periodic_orbit(SYSTEM, transient=100)
    return sb.dynamics.continuation(orbit, "velocity_amplitude", (0.02, 0.3), max_points=40).to_dataset()


def edge() -> xr.Dataset:
    ends = np.array([-0.9, 0.0]), np.array([-1.0, 1.3])
    return sb.dynamics.edge_tracking(SYSTEM, *ends, periods=25, horizon=60).to_dataset()


def lifetimes() -> xr.Dataset:
    settings = sb.dynamics.LifetimeSettings(settling_cycles=5)
    return sb.dynamics.lifetime_map(SYSTEM, AXES, SHORT, initial_conditions=4, settings=settings)


RATIOS = np.linspace(0.5, 1.5, 9)
QUICK = {
    "run": lambda: sb.simulate(SYSTEM.replace(**{"model.modes": 3}), SHORT).dataset,
    "map": lambda: sb.sweep(SYSTEM, AXES, SHORT)[["response_class", "peak_force"]],
    "line of a map": lambda: QUICK["map"]().isel(frequency_ratio=1),
    "lifetimes": lifetimes,
    "lifetimes of a point": lambda: lifetimes().isel(frequency_ratio=1, velocity_amplitude=0),
    "section": lambda: sb.dynamics.poincare_section(SYSTEM, "impact", 20),
    "attractors": lambda: sb.dynamics.find_attractors(SYSTEM, 12).to_dataset(),
    "line of exponents": lambda: exponents(frequency_ratio=RATIOS),
    "map of exponents": lambda: exponents(
        frequency_ratio=RATIOS, velocity_amplitude=np.linspace(0.1, 0.3, 5)
    ),
    "probability": probability,
}
SLOW = {
    "basins": basins,
    "branch": branch,
    "edge": edge,
    "diagram": lambda: sb.dynamics.bifurcation_diagram(
        SYSTEM, "velocity_amplitude", np.linspace(0.02, 0.04, 3)
    ),
    "exponents": lambda: sb.dynamics.lyapunov_spectrum(SYSTEM, periods=40, transient=10),
}


def outside(figure: plt.Figure) -> float:
    """How far the drawing, with its text, extends beyond the canvas, inches."""
    figure.canvas.draw()
    drawn = figure.get_tightbbox()
    return float(np.max([*-drawn.min, *(drawn.max - figure.get_size_inches())]))


@pytest.mark.parametrize("result", [*QUICK, *(pytest.param(name, marks=pytest.mark.slow) for name in SLOW)])
def test_text_is_inside_the_canvas(result: str) -> None:
    dataset = (QUICK | SLOW)[result]()
    for name in figures_of(dataset)[1]:
        figure = dataset.snapbeam.plot(name).get_figure(root=True)
        for width, millimetres in COLUMN_WIDTHS.items():
            figure.set_size_inches(millimetres / 25.4, figure.get_figheight())
            assert outside(figure) < 0.01, f"{name} of {width} column"
        plt.close(figure)


@pytest.fixture(
    params=["ieee", *(pytest.param(name, marks=pytest.mark.slow) for name in ("elsevier", "talk"))]
)
def style(request):
    sb.plot.plot_style(request.param)
    yield request.param
    sb.plot.plot_style("elsevier")


GALLERY = (
    "run",
    "map",
    "line of a map",
    "attractors",
    "line of exponents",
    "map of exponents",
    "probability",
)


@pytest.mark.parametrize(
    "result", [pytest.param(name, marks=pytest.mark.slow if name == "run" else ()) for name in GALLERY]
)
def test_text_is_inside_the_canvas_in_each_style_and_the_files_are_small(
    result: str, style: str, tmp_path
) -> None:
    """At both widths of the style; vector files have their fonts embedded as TrueType and are below 2 MB."""
    dataset = QUICK[result]()
    for name in figures_of(dataset)[1]:
        figure = dataset.snapbeam.plot(name).get_figure(root=True)
        for width, millimetres in COLUMN_WIDTHS.items():
            figure.set_size_inches(millimetres / 25.4, figure.get_figheight())
            assert outside(figure) < 0.01, f"{name} of {width} column"
        for suffix in (".pdf", ".svg"):
            file = save_figure(figure, tmp_path / f"figure{suffix}")
            assert file.stat().st_size < 2e6, f"{name}{suffix}"
        text = (tmp_path / "figure.pdf").read_bytes()
        assert b"/FontFile2" in text and b"/Type3" not in text, name
        plt.close(figure)


def test_text_of_the_schematic_is_inside_the_canvas() -> None:
    figure = SYSTEM.plot()
    assert outside(figure) < 0.01
    plt.close(figure)
