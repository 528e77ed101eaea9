"""Every result of an analysis draws itself: ``dataset.snapbeam.plot``, ``.plot()`` and the command line agree."""

from __future__ import annotations

import inspect
import os
import subprocess
import sys

import matplotlib.pyplot as plt
import numpy as np
import pytest

import snapbeam as sb
from snapbeam.model.parameter_file import Config
from snapbeam.plot.dataset import _KINDS
from snapbeam.plot.dynamics import plot_attractors, plot_diagram, plot_exponents, plot_multipliers
from snapbeam.util.datasets import xr

SMALL = Config().system.replace(**{"model.modes": 1})


@pytest.fixture(autouse=True)
def closed():
    yield
    plt.close("all")


def exponents() -> xr.Dataset:
    """Exponents over a frequency: two negative, one not decided, two positive."""
    value = np.array([-3.0, -2.0, 0.1, 1.0, 2.0])
    labels = {"units": "1/s"}
    return xr.Dataset(
        {
            "exponent": (("frequency_ratio", "exponent_number"), value[:, None], labels),
            "exponent_error": (("frequency_ratio", "exponent_number"), np.full((5, 1), 0.2), labels),
            "excitation_period": ("frequency_ratio", np.full(5, 0.01), {"units": "s"}),
        },
        {"frequency_ratio": np.linspace(0.5, 1.5, 5), "exponent_number": [1]},
    )


def orbit_dataset(values: np.ndarray) -> xr.Dataset:
    return xr.Dataset(
        {
            "state": (("period", "coordinate"), np.zeros((1, values.size))),
            "multiplier_real": ("multiplier", values.real),
            "multiplier_imag": ("multiplier", values.imag),
        }
    )


def test_a_map_is_drawn_by_what_it_is(synthetic_map) -> None:
    table = synthetic_map.assign(peak_force=synthetic_map["response_class"] + 0.5)
    ax = table.snapbeam.plot(quasi_static_line=True)
    assert ax.get_ylabel().startswith("Velocity amplitude")
    other = table.snapbeam.plot("peak_force")
    assert len(other.figure.axes) == 2, "the map and its colour bar"
    with pytest.raises(
        sb.InputError, match=r"no figure of this file \(map\); choose one of response_class, peak_force"
    ):
        table.snapbeam.plot("force")


def test_the_dataset_of_a_sweep_draws_itself() -> None:
    table = sb.sweep(SMALL, {"drive.velocity_amplitude": [0.05, 0.1]}, sb.Integration(cycles=2))
    assert table.snapbeam.plot("peak_force").get_ylabel() == "Peak contact force (N)"


@pytest.mark.slow
def test_a_stored_run_draws_itself_in_a_program_that_imports_snapbeam_alone(tmp_path) -> None:
    sb.simulate(SMALL, sb.Integration(cycles=2)).save(tmp_path / "run.nc")
    script = (
        "import sys, snapbeam as sb; assert 'xarray' not in sys.modules\n"
        f"print(sb.load({str(tmp_path / 'run.nc')!r}).dataset.snapbeam.plot('phase_portrait').get_xlabel())"
    )
    ended = subprocess.run(
        [sys.executable, "-c", script],
        capture_output=True,
        text=True,
        check=True,
        env=os.environ | {"MPLBACKEND": "Agg"},
    )
    assert "isplacement" in ended.stdout


def test_a_run_is_drawn_by_what_it_is(synthetic_run) -> None:
    _, ax = plt.subplots()
    assert synthetic_run.snapbeam.plot("spectrum", ax=ax) is ax
    with pytest.raises(
        sb.InputError, match=r"no figure of this file \(run\); choose one of run, spectrum, spectrogram$"
    ):
        synthetic_run.snapbeam.plot("class")


def test_other_datasets_are_refused() -> None:
    with pytest.raises(sb.InputError, match="its variables are temperature"):
        xr.Dataset({"temperature": ("x", [1.0])}).snapbeam.plot()


def test_order_and_chaos_are_told_apart_and_the_unit_of_time_chosen() -> None:
    ax = plot_exponents(exponents())
    counts = {line.get_label(): len(line.get_xdata()) for line in ax.lines if ":" in line.get_label()}
    assert counts == {"negative: periodic": 2, "positive: chaotic": 2}
    assert any(line.get_label() == "sign not decided" and len(line.get_xdata()) == 1 for line in ax.lines)
    other = plot_exponents(exponents(), per="period")
    line = next(line for line in other.lines if line.get_label() == "positive: chaotic")
    np.testing.assert_allclose(line.get_ydata(), [0.01, 0.02])
    assert "per period" in other.get_ylabel()
    with pytest.raises(sb.InputError, match="does not contain the period"):
        plot_exponents(exponents().drop_vars("excitation_period"), per="period")


def test_a_map_of_exponents_diverges_at_zero() -> None:
    table = exponents().expand_dims(velocity_amplitude=[0.1, 0.2]).transpose("frequency_ratio", ...)
    ax = plot_exponents(table)
    low, high = ax.collections[0].get_clim()
    assert low == -high
    marks = next(line for line in ax.lines if line.get_label() == "sign not decided")
    assert set(np.asarray(marks.get_xdata())) == {1.0}


def test_multipliers_inside_and_outside_the_unit_circle() -> None:
    found = orbit_dataset(np.array([1.4, 0.5 + 0.5j, 0.5 - 0.5j]))
    ax = plot_multipliers(found)
    outside = next(line for line in ax.lines if line.get_label() == "outside: grows")
    np.testing.assert_array_equal(outside.get_xdata(), [1.4])
    assert found.snapbeam.plot().get_xlabel() == ax.get_xlabel()


def test_attractors_state_what_may_be_unseen() -> None:
    points = np.array([[[1.0, 0.0]], [[-1.0, 0.1]]])
    found = xr.Dataset(
        {
            "points": (("attractor", "point", "coordinate"), points),
            "share": ("attractor", [0.7, 0.3]),
            "period": ("attractor", [1, 1]),
        },
        {"coordinate": ["amplitude[1]", "velocity[1]"]},
        {"unseen_share_95": 0.07},
    )
    ax = plot_attractors(found)
    assert "below 7 %" in ax.get_title().replace("\N{NO-BREAK SPACE}", " ")
    assert [line.get_label() for line in ax.lines] == [
        "0: period 1 in the upper well, 70.0 % of the states",
        "1: period 1 in the lower well, 30.0 % of the states",
    ]


RESULTS = {
    "sweep": "map", "read_checkpoint": "map", "threshold": "threshold", "force_displacement": "force-displacement curve",
    "perturbation_growth": "growth of a perturbation", "backbone_curve": "backbone curve",
    "basins_of_attraction": "basins of attraction", "bifurcation_curve": "bifurcation curve",
    "bifurcation_diagram": "bifurcation diagram", "homoclinic_points": "homoclinic points",
    "homoclinic_tangency": "homoclinic tangency",
    "hysteresis": "statistics swept up and down", "invariant_manifold": "manifold",
    "largest_lyapunov": "Lyapunov exponents", "lyapunov_spectrum": "Lyapunov exponents", "lifetime_map": "lifetimes",
    "poincare_section": "section", "gradient": "gradient", "optimize_design": "designs",
    "probability_map": "probability map", "quantile_threshold": "quantiles of a threshold",
    "mean_over_seeds": "means over seeds",
    "score_measurements": "measured classes", "sensitivity": "sensitivities",
    "equilibrium_branches": "equilibrium branches",
}  # fmt: skip
"""Public functions that return a dataset, and the kind of figure that it has."""


def public(kind) -> dict[str, object]:
    spaces = (sb, sb.dynamics, sb.uncertainty, sb.model)
    found = {name: getattr(space, name) for space in spaces for name in dir(space) if name[0] != "_"}
    return {name: each for name, each in found.items() if kind(each)}


def test_every_dataset_that_an_analysis_returns_has_a_kind_of_figure() -> None:
    """A new function that returns a dataset fails here until its result draws itself."""
    functions = public(inspect.isfunction)
    returned = {name for name, each in functions.items() if "Dataset" in str(inspect.signature(each).return_annotation)}
    assert returned == set(RESULTS)
    assert set(RESULTS.values()) <= {kind.words for kind in _KINDS}


def test_every_class_of_results_has_plot() -> None:
    classes = public(inspect.isclass)
    results = {name for name, each in classes.items() if hasattr(each, "to_dataset")} | {"Run", "System"}
    assert results >= {"Attractors", "Branch", "EdgeState", "PeriodicOrbit", "Posterior"}
    assert [name for name in sorted(results) if not callable(getattr(classes[name], "plot", None))] == []


def test_posterior_and_gradient_state_units_and_intervals() -> None:
    draw = np.random.default_rng(1).normal(size=(4000, 2))
    values = np.column_stack([3.4e-4 * (1.0 + 0.02 * draw[:, 0]), 4e8 * (1.0 + 0.1 * draw[:, 1])])
    names = ("beam.buckling_level", "contact.stiffness")
    ax = sb.uncertainty.Posterior(names, values, np.full(4000, 1 / 4000)).plot()
    labels = [text.get_text().split("\n") for text in ax.get_yticklabels()]
    assert labels[0][0] == "buckling level" and labels[0][1].endswith("µm")
    wide = ax.collections[0].get_segments()
    np.testing.assert_allclose([np.ptp(line[:, 0]) for line in wide], [2 * 1.96 * 2, 2 * 1.96 * 10], rtol=0.06)
    table = xr.Dataset(
        {"elasticity": ("parameter", [0.4, -2.0]), "relative_error": ("parameter", [0.1, 0.01])},
        {"parameter": list(names)}, {"quantity": "peak_force"},
    )  # fmt: skip
    bars = table.snapbeam.plot().patches
    assert [bar.get_width() for bar in bars] == [0.4, -2.0], "the most telling parameter on top"


def test_gradients_of_several_statistics_have_panels_in_one_order() -> None:
    """None for a statistic without a derivative; a bar whose error is not below its length is hatched and named."""
    both = ("statistic", "parameter")
    table = xr.Dataset(
        {
            "elasticity": (both, [[0.4, -2.0], [np.nan, np.nan], [30.0, 1.0]]),
            "relative_error": (both, [[0.1, 0.01], [np.nan, np.nan], [np.inf, 0.0]]),
            "no_derivative": ("statistic", ["", "is a count", ""]),
        },
        {"statistic": ["peak_force", "impacts", "impulse"], "parameter": ["beam.thickness", "contact.stiffness"]},
    )
    figure = table.snapbeam.plot().get_figure(root=True)
    assert [ax.get_xlabel().split("\n")[0] for ax in figure.axes] == [
        "Change of peak contact force",
        "Change of impulse on the beam, all impacts",
    ]
    names = [[text.get_text() for text in ax.get_yticklabels()] for ax in figure.axes]
    assert names == [["contact stiffness", "thickness"]] * 2
    widths = [{round(bar.get_width(), 6): bar.get_hatch() for bar in ax.patches} for ax in figure.axes]
    assert widths[0] == {-2.0: None, 0.4: None} and widths[1][1.0] is None and widths[1][30.0]
    assert [text.get_text() for text in figure.legends[0].get_texts()] == [
        "error not below the value: grazing or chaos"
    ]
    assert len(table.snapbeam.plot("impulse").get_figure(root=True).axes) == 1
    with pytest.raises(sb.InputError, match="choose a statistic: peak_force, impulse"):
        table.snapbeam.plot(ax=plt.figure().add_subplot())


def test_scores_are_in_the_colours_of_the_measured_classes() -> None:
    kinds = np.array([0, 3, 3], dtype=np.int8)
    names = ("probability", "probability_low", "probability_high")
    columns = dict(zip(names, ([0.9, 0.2, 0.6], [0.8, 0.1, 0.5], [1.0, 0.3, 0.7]), strict=True))
    table = xr.Dataset(
        {name: ("measurement", values) for name, values in columns.items()}
        | {"response_class": ("measurement", kinds), "most_likely": ("measurement", kinds)},
        attrs={"agree": 2, "agree_expected": 1.7},
    )
    ax = table.snapbeam.plot()
    assert [text.get_text() for text in ax.figure.legends[0].get_texts()] == [
        "measured: intrawell", "measured: continuous interwell",
    ]  # fmt: skip
    np.testing.assert_allclose(ax.containers[1].lines[0].get_ydata(), [0.2, 0.6])


def test_homoclinic_points_and_growth_draw_themselves() -> None:
    points = xr.Dataset(
        {"state": (("point", "coordinate"), [[0.1, 0.2], [0.3, 0.4]]), "stable_arclength": ("point", [1.0, 2.0])},
        {"coordinate": ["amplitude[1]", "velocity[1]"]},
    )
    assert points.snapbeam.plot().lines[0].get_label() == "homoclinic points, 2"
    growth = sb.perturbation_growth(SMALL, sb.Integration(cycles=3))
    assert growth.snapbeam.plot().get_yscale() == "log"


def test_the_gap_between_two_groups_of_curves_is_closed() -> None:
    """A broken axis where no curve is: both groups keep one scale, and no tick is in the gap."""
    value, low = np.linspace(0.1, 0.3, 5), np.linspace(-1.0, -0.5, 5)
    table = xr.Dataset(
        {"midspan_displacement": (("sweep", "velocity_amplitude", "period"), np.stack([low, np.ones(5)])[..., None])},
        {"sweep": ["up", "down"], "velocity_amplitude": value}, {"parameter": "velocity_amplitude"},
    )  # fmt: skip
    ax = plot_diagram(table)
    at = ax.transAxes.inverted().transform(ax.transData.transform([(0.2, y) for y in (-1.0, -0.75, -0.5, 1.0)]))[:, 1]
    assert at[2] - at[1] == pytest.approx(at[1] - at[0])
    assert at[3] - at[2] < 0.4 and at[2] - at[0] > 0.5
    assert all(y < -0.4 or y > 0.9 for y in ax.get_yticks())
    joined = plot_diagram(table.isel(sweep=[0]))
    assert joined.get_yscale() == "linear"


def test_objects_draw_themselves() -> None:
    system = Config().system.replace(**{"model.modes": 1})
    assert len(system.plot().axes) > 0
