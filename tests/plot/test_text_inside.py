"""Every figure keeps its text inside the canvas, at the width of one column and of two."""

from __future__ import annotations

import os
import matplotlib.pyplot as plt
import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.figure import Figure

import snapbeam as sb
from snapbeam.model import default_values
from snapbeam.plot.style import COLUMN_WIDTHS
from snapbeam.plot.dataset import figures_of
from snapbeam.util.datasets import xr

V = np.linspace(0.02, 0.04, 3)
SHORT = sb.Integration(cycles=20)


def system() -> sb.System:
    model = sb.ReducedModel.from_beam(default_values.BEAM, modes=1, damping_ratio=0.05)
    return sb.System(model, default_values.CONTACT, sb.Shaker(frequency_ratio=1.6, velocity_amplitude=0.03))


def run():
    return sb.simulate(system().replace(**{"model.modes": 3}), SHORT).dataset


def lifetimes(ratio):
    axes = {"drive.frequency_ratio": ratio, "drive.velocity_amplitude": [0.1, 0.2]}
    settings = sb.dynamics.LifetimeSettings(settling_cycles=5)
    return sb.dynamics.lifetime_map(system(), axes, SHORT, initial_conditions=4, settings=settings)


def point_lifetime():
    return lifetimes([1.2, 1.6]).isel(frequency_ratio=0, velocity_amplitude=0)


def section():
    return sb.dynamics.poincare_section(system(), "impact", 20)


def exponents():
    return sb.dynamics.lyapunov_spectrum(system(), periods=40, transient=10)


def exponents_over(**axes):
    rng = np.random.default_rng(1)
    shape = tuple(len(values) for values in axes.values())
    labels = {"units": "1/s"}
    over = (*axes, "exponent_number")
    return xr.Dataset(
        {
            "exponent": (over, rng.normal(0.0, 2.0, (*shape, 1)), labels),
            "exponent_error": (over, np.full((*shape, 1), 0.3), labels),
        },
        {**axes, "exponent_number": [1]},
    )


def exponent_line():
    return exponents_over(frequency_ratio=np.linspace(0.5, 1.5, 9))


def exponent_map():
    return exponents_over(
        frequency_ratio=np.linspace(0.5, 1.5, 9), velocity_amplitude=np.linspace(0.1, 0.3, 5)
    )


def diagram():
    return sb.dynamics.bifurcation_diagram(system(), "velocity_amplitude", V)


def orbit():
    return sb.dynamics.periodic_orbit(system(), transient=100)


def branch():
    return sb.dynamics.continuation(orbit(), "velocity_amplitude", (0.02, 0.3), max_points=40).to_dataset()


def attractors():
    return sb.dynamics.find_attractors(system(), 12).to_dataset()


def basins():
    grid = {"amplitude[1]": np.linspace(-0.98, 1.4, 6), "velocity[1]": np.linspace(-0.6, 0.6, 5)}
    return sb.dynamics.basins_of_attraction(sb.dynamics.find_attractors(system(), 12), grid)


def edge():
    return sb.dynamics.edge_tracking(
        system(), np.array([-0.9, 0.0]), np.array([-1.0, 1.3]), periods=25, horizon=60
    ).to_dataset()


def class_map():
    axes = {"drive.frequency_ratio": [0.8, 1.2, 1.6], "drive.velocity_amplitude": [0.1, 0.2, 0.3]}
    return sb.sweep(system(), axes, SHORT)[["response_class", "peak_force"]]


def class_line():
    return class_map().isel(frequency_ratio=1)


def probability():
    ratio, v = np.linspace(0.5, 2.0, 9), np.linspace(0.05, 0.4, 8)
    share = 1.0 / (1.0 + np.exp(-40.0 * (v[None, :] - 0.1 - 0.05 * ratio[:, None])))[..., None]
    dims = ("frequency_ratio", "velocity_amplitude", "outcome")
    parts = {
        f"probability{end}": (dims, np.clip(share + shift, 0.0, 1.0))
        for end, shift in (("", 0.0), ("_low", -0.05), ("_high", 0.05))
    }
    axes = {"frequency_ratio": ratio, "velocity_amplitude": v, "outcome": ["snap"]}
    table = xr.Dataset(parts, axes, {"confidence": 0.95})
    return table.assign(reached=(dims[:2], share[..., 0] < 0.99))


RESULTS = (
    run, lifetimes, point_lifetime, section, exponents, exponent_line, exponent_map, diagram, branch, attractors,
    basins, edge, class_map, class_line, probability,
)  # fmt: skip


def check(drawn: Figure | Axes) -> None:
    """What is drawn, with its text, ends within the canvas."""
    figure = drawn if isinstance(drawn, Figure) else drawn.get_figure(root=True)
    for width, millimetres in COLUMN_WIDTHS.items():
        figure.set_size_inches(millimetres / 25.4, figure.get_figheight())
        figure.canvas.draw()
        drawn_over, canvas = figure.get_tightbbox(), figure.get_size_inches()
        beyond = np.maximum(-np.ravel(drawn_over.min), np.ravel(drawn_over.max) - canvas)
        if os.environ.get("FIGS"):
            figure.savefig(
                f"/tmp/fig33/{os.environ['PYTEST_CURRENT_TEST'].split('::')[1].split(' ')[0]}{figure.number}-{width}.png",
                dpi=110,
            )
        assert (beyond < 0.01).all(), f"{width}: {beyond} inches outside the canvas, across and upward"


@pytest.mark.parametrize("result", RESULTS)
def test_results(result) -> None:
    dataset = lifetimes([1.2, 1.6]) if result is lifetimes else result()
    dataset = dataset.to_dataset() if hasattr(dataset, "to_dataset") else dataset
    for name in figures_of(dataset)[1]:
        check(dataset.snapbeam.plot(name))
        plt.close("all")


def test_system() -> None:
    check(system().plot())
    plt.close("all")
