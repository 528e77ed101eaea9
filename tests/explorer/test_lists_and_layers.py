"""Lists of points, sweeps over one axis, probabilities and lifetimes as maps; without a browser."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr

import snapbeam as sb

pytest.importorskip("panel")

from snapbeam.explorer.maps import Plane, Scatter, chances, compared, integration_of, opened, system_of

SHORT = sb.Integration(cycles=4)


@pytest.fixture(scope="module")
def one_mode(system):
    return system.replace(**{"model.modes": 1})


@pytest.fixture(scope="module")
def points(one_mode):
    """A list over three parameters."""
    rng = np.random.default_rng(3)
    table = xr.Dataset({
        "drive.frequency_ratio": ("point", rng.uniform(0.5, 2.0, 30)),
        "drive.velocity_amplitude": ("point", rng.uniform(0.05, 0.4, 30)),
        "beam.thickness": ("point", rng.choice([3.9e-4, 4.1e-4], 30)),
    })  # fmt: skip
    return sb.sweep(one_mode, table, SHORT)


def test_a_point_of_a_list_is_run_bit_for_bit(points):
    source = opened(points)
    assert source.is_list and source.dims == ["frequency_ratio", "velocity_amplitude", "beam_thickness"]
    scatter = Scatter.of(source, "frequency_ratio", "velocity_amplitude")
    base, how = system_of(source.attrs, source.name), integration_of(source.attrs)
    for number in (0, 7, 29):
        x, y = (float(points[name][number]) for name in ("frequency_ratio", "velocity_amplitude"))
        assert scatter.index(x, y) == (number,)
        point = scatter.at(number)
        assert scatter.find(point.values) == (number,) and scatter.place(point.values) == (x, y)
        assert point.values["beam.thickness"] == float(points["beam_thickness"][number])
        outcome = sb.simulate(*point.system(base, how)).summary
        same, words = compared(source.point(scatter.indexers(number)), outcome, "native")
        assert same and "bitwise identical" in words
    assert scatter.find(point.values | {"beam.thickness": 4.0e-4}) is None


def test_keys_lead_to_the_nearest_point_of_a_list_in_their_direction(points):
    scatter = Scatter.of(opened(points), "frequency_ratio", "velocity_amplitude")
    x, y = scatter.x.at, scatter.y.at
    wide, tall = (float(np.diff(axis.span)[0]) for axis in (scatter.x, scatter.y))
    for number in range(30):
        place = (float(x[number]), float(y[number]))
        (right,) = scatter.beside(place, 1, 0)
        ahead = [
            (np.hypot((x[k] - x[number]) / wide, (y[k] - y[number]) / tall), k)
            for k in range(30)
            if (x[k] - x[number]) / wide >= abs(y[k] - y[number]) / tall and k != number
        ]
        assert right == (min(ahead)[1] if ahead else number)


def test_a_sweep_over_one_axis_is_a_strip(one_mode):
    line = sb.sweep(one_mode, {"frequency_ratio": np.linspace(0.5, 2.0, 9)}, SHORT)
    source = opened(line)
    assert source.dims == ["frequency_ratio", "velocity_amplitude"], "it stands at one amplitude"
    plane = Plane.of(source, "frequency_ratio", "velocity_amplitude", {})
    np.testing.assert_array_equal(plane.values("response_class"), line["response_class"].values[None, :])
    point = plane.at(*plane.index(1.25, 0.4))
    assert point.values["drive.velocity_amplitude"] == float(line["velocity_amplitude"])
    assert point.values["drive.frequency_ratio"] == line["frequency_ratio"].values[4]
    assert plane.find(point.values) == (0, 4)
    assert source.point(plane.indexers(0, 4))["zero_crossings"] == int(line["zero_crossings"][4])


def test_one_point_of_an_axis_may_stand_upward(one_mode):
    axes = {"velocity_amplitude": [0.2], "frequency_ratio": np.linspace(0.5, 2.0, 5)}
    found = sb.sweep(one_mode, axes, SHORT)
    source = opened(found)
    assert source.dims == ["frequency_ratio", "velocity_amplitude"]
    plane = Plane.of(source, "frequency_ratio", "velocity_amplitude", {})
    assert plane.values("peak_force").shape == (1, 5)
    assert plane.at(0, 2).values["drive.velocity_amplitude"] == 0.2


def test_probabilities_and_lifetimes_are_shown_and_told(one_mode, tmp_path):
    axes = {"frequency_ratio": np.linspace(0.8, 1.6, 3), "velocity_amplitude": np.linspace(0.1, 0.3, 2)}
    spread = sb.uncertainty.ParameterUncertainty(of={"velocity_amplitude": sb.uncertainty.Normal(0.05, relative=True)})
    allocation = sb.uncertainty.SamplingPlan(half_width=0.4, initial_runs=8, max_runs=8)
    found = sb.uncertainty.probability_map(one_mode, axes, spread, allocation, integration=SHORT)
    lived = sb.dynamics.lifetime_map(one_mode, axes, sb.Integration(cycles=80), initial_conditions=6, after=[10, 30])
    both = xr.merge(
        [found, lived.drop_vars([name for name in lived.data_vars if name in found])], compat="override"
    ).assign_attrs(found.attrs)
    both.to_netcdf(tmp_path / "both.nc", engine="h5netcdf")
    for source in (opened(both), opened(tmp_path / "both.nc")):
        names = source.variables()
        assert {"probability_snap", "lifetime", "end_probability_first", "snapping_probability_10"} <= set(names)
        assert not any(name.startswith("last_snap") for name in names), "that is a number of each start"
        assert not any("_low" in name or "_high" in name for name in names)
        plane = Plane.of(source, "frequency_ratio", "velocity_amplitude", {})
        exact = found["probability"].sel(outcome="snap").transpose("velocity_amplitude", "frequency_ratio")
        np.testing.assert_array_equal(plane.values("probability_snap"), exact)
        held = source.point(plane.indexers(1, 2))
        words = chances(source.layers, held)
        at = found.isel(frequency_ratio=2, velocity_amplitude=1).sel(outcome="snap")
        low, high = float(at["probability_low"]), float(at["probability_high"])
        told = f"outcome: snap {float(at['probability']):.3g} ({low:.3g} to {high:.3g})"
        assert told in words
        # a run is not compared with what is no number of a run
        outcome = sb.simulate(*plane.at(1, 2).system(system_of(source.attrs, ""), integration_of(source.attrs)))
        assert compared(held, outcome.summary, "native") == (True, "")


def test_shares_of_replicas_are_told(one_mode):
    axes = {"frequency_ratio": [0.8, 1.2], "velocity_amplitude": [0.1, 0.3]}
    found = sb.sweep(one_mode, axes, SHORT, replicates=sb.Replicates(3))
    source = opened(found)
    plane = Plane.of(source, "frequency_ratio", "velocity_amplitude", {})
    words = chances(source.layers, source.point(plane.indexers(1, 1)))
    shares = found["class_fraction"].isel(frequency_ratio=1, velocity_amplitude=1)
    first = int(shares.values.argmax())
    kind = sb.ResponseClass(int(found["class_code"][first]))
    assert f"{kind.label} {100 * float(shares[first]):.0f} %" in words


def test_the_quasi_static_line_is_refused_for_a_system_that_it_does_not_describe(one_mode):
    from snapbeam.explorer.map_view import MapView
    from snapbeam.explorer.style import LIGHT

    force = sb.ExternalForce(location=0.5, history=sb.HarmonicForce(amplitude=0.01, frequency_ratio=1.0))
    loaded = sb.System(one_mode.model, contacts=one_mode.contacts, forces=[force])
    for system, refused in ((one_mode, False), (loaded, True)):
        source = opened(system)
        plane = Plane.of(source, "frequency_ratio", "velocity_amplitude", {})
        view = MapView(LIGHT, plane.x, plane.y)
        words = view.show_quasi_static(True, source.attrs, source.scalars())
        assert ("Eq. 21" in words) == refused == (len(view.curve.data["x"]) == 0), words
