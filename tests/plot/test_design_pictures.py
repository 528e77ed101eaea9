"""Pictures of design: what they say of their numbers, and what they refuse."""

from __future__ import annotations

import matplotlib.pyplot as plt
import numpy as np
import pytest
import xarray as xr

from snapbeam.plot.uncertainty import plot_designs, plot_probability, plot_quantiles, plot_tornado
from snapbeam.util.validation import InputError


@pytest.fixture(autouse=True)
def _close():
    yield
    plt.close("all")


@pytest.fixture
def probabilities():
    ratio, v = np.linspace(0.5, 2.0, 9), np.linspace(0.05, 0.4, 8)
    share = 1.0 / (1.0 + np.exp(-40.0 * (v[None, :] - 0.1 - 0.05 * ratio[:, None])))
    dims = ("frequency_ratio", "velocity_amplitude", "outcome")
    table = np.stack([share, 1.0 - share], axis=-1)
    low, high = np.clip(table - 0.05, 0.0, 1.0), np.clip(table + 0.05, 0.0, 1.0)
    reached = np.ones(share.shape, dtype=bool)
    reached[2, 3] = False
    return xr.Dataset(
        {
            "probability": (dims, table),
            "probability_low": (dims, low),
            "probability_high": (dims, high),
            "reached": (dims[:2], reached),
        },
        {"frequency_ratio": ratio, "velocity_amplitude": v, "outcome": ["snap", "first_well"]},
        {"confidence": 0.95},
    )


def test_probabilities_over_two_parameters(probabilities) -> None:
    ax = plot_probability(probabilities)
    words = [text.get_text() for text in ax.figure.legends[0].get_texts()]
    assert words == ["P = 0.05", "P = 0.5", "P = 0.95", "interval wider than requested"]
    assert "V" in ax.get_ylabel()
    cells = ax.collections[0].get_array().reshape(8, 9)
    np.testing.assert_array_equal(cells, probabilities["probability"].sel(outcome="snap").T)


def test_probabilities_over_one_parameter(probabilities) -> None:
    ax = plot_probability(probabilities.isel(frequency_ratio=1))
    line = next(line for line in ax.lines if line.get_label() == "fraction of the runs")
    np.testing.assert_array_equal(line.get_ydata(), probabilities["probability"][1, :, 0])
    with pytest.raises(InputError, match="must be one of snap, first_well"):
        plot_probability(probabilities, "continuous")
    with pytest.raises(InputError, match="no probabilities"):
        plot_probability(xr.Dataset())


def test_quantiles() -> None:
    ratio = np.linspace(0.5, 2.0, 7)
    middle = 0.1 + 0.05 * np.cos(ratio)
    table = np.stack([middle - 0.02, middle, middle + 0.02], axis=-1)
    dims = ("frequency_ratio", "quantile")
    high = table + 0.01
    high[0, 2] = np.inf
    monotone = np.ones(7, dtype=bool)
    monotone[3] = False
    dataset = xr.Dataset(
        {"threshold": (dims, table), "threshold_low": (dims, table - 0.01), "threshold_high": (dims, high),
         "is_monotonic": (dims[:1], monotone), "runs": (dims[:1], np.full(7, 200))},
        {"frequency_ratio": ratio, "quantile": [0.05, 0.5, 0.95], "location": 0.4},
        {"parameter": "velocity_amplitude", "bounds": [0.0, 0.5], "confidence": 0.95},
    )  # fmt: skip
    ax = plot_quantiles(dataset, quasi_static=True)
    lines = {line.get_label(): line for line in ax.lines}
    np.testing.assert_array_equal(lines["P = 0.5"].get_ydata(), middle)
    assert lines["not monotone"].get_xdata().tolist() == [ratio[3]]
    np.testing.assert_allclose(lines[r"quasi-static, $V_\mathrm{QS1}$"].get_ydata(), ratio * np.sin(np.pi * 0.4) ** 2)
    with pytest.raises(InputError, match="no quantile thresholds"):
        plot_quantiles(xr.Dataset())


def test_tornado() -> None:
    names = ["contact.stiffness", "contact.location"]
    half = np.array([0.01, -0.03])
    dataset = xr.Dataset(
        {"effect": ("parameter", half), "effect_low": ("parameter", half - 0.002),
         "effect_high": ("parameter", half + 0.002), "step": ("parameter", [1e7, 0.01])},
        {"parameter": names},
        {"quantity_mean": 0.2, "quantity": "threshold", "quantity_units": "1", "confidence": 0.95},
    )  # fmt: skip
    ax = plot_tornado(dataset)
    assert [text.get_text().split("\n")[0] for text in ax.get_yticklabels()] == ["contact stiffness", "location"]
    widths = sorted(round(abs(patch.get_width()), 6) for patch in ax.patches)
    assert widths == [0.01, 0.01, 0.03, 0.03]
    ax = plot_tornado(dataset.assign_attrs(quantity="peak contact force", quantity_units="N"))
    assert ax.get_xlabel() == "Peak contact force (mN)" and max(
        each.get_width() for each in ax.patches
    ) == pytest.approx(30.0)
    with pytest.raises(InputError, match="no sensitivities"):
        plot_tornado(xr.Dataset())


def test_designs() -> None:
    draw = np.random.default_rng(1)
    x, goal = draw.random(50), draw.random(50)
    dataset = xr.Dataset(
        {"location": ("design", [0.3]), "tried_location": ("tried", x, {"parameter": "contact.location"}), "objective_speed": ("design", [0.5]),
         "objective_speed_low": ("design", [0.4]), "objective_speed_high": ("design", [0.7]),
         "tried_objective_speed": ("tried", goal), "violation": ("tried", np.where(goal < 0.4, 0.1, 0.0)),
         "constraints_satisfied": ("design", [2])}
    )  # fmt: skip
    ax = plot_designs(dataset)
    words = [text.get_text() for text in ax.figure.legends[0].get_texts()]
    assert words == ["candidates that satisfy the constraints", "reported design, constraints satisfied"]
    assert ax.collections[0].get_offsets().shape == (int((goal >= 0.4).sum()), 2)
    with pytest.raises(InputError, match="must be one of location"):
        plot_designs(dataset, "gap")


def test_an_objective_has_a_prefix_of_its_unit() -> None:
    """Powers of some µW are drawn in µW, with their intervals and all candidates."""
    from snapbeam.plot.uncertainty import _with_prefix
    from snapbeam.util.datasets import xr

    watts, attrs = [3.1e-4, 2.5e-5], {"units": "W", "long_name": "power"}
    names = ("objective_power", "objective_power_low", "objective_power_high", "tried_objective_power")
    found = _with_prefix(xr.Dataset({name: ("x", watts, attrs) for name in names}), "objective_power")
    for name in names:
        assert found[name].attrs["units"] == "µW"
        assert found[name].values == pytest.approx([310.0, 25.0])
