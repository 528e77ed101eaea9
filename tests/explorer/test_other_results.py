"""Results that are no map are refused before a page is made, by their kind."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr

import snapbeam as sb
from snapbeam.explorer.maps import opened
from snapbeam.model.parameter_file import Config

SYSTEM = Config().system.replace(**{"model.modes": 1, "model.damping_ratio": 0.05})
SHORT = sb.Integration(cycles=4)


def _orbit():
    return sb.dynamics.periodic_orbit(SYSTEM.replace(**{"drive.velocity_amplitude": 0.02}), transient=100)


KINDS = {
    "bifurcation diagram": lambda: sb.dynamics.bifurcation_diagram(
        SYSTEM, "velocity_amplitude", np.linspace(0.02, 0.04, 3)
    ),
    "backbone curve": lambda: sb.dynamics.backbone_curve(SYSTEM.model, lowest_frequency_ratio=0.9),
    "run": lambda: sb.simulate(SYSTEM, SHORT).dataset,
    "attractors": lambda: sb.dynamics.find_attractors(SYSTEM, 12).to_dataset(),
    "branch of orbits": lambda: sb.dynamics.continuation(
        _orbit(), "velocity_amplitude", (0.015, 0.03), max_points=6
    ).to_dataset(),
}


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
def test_another_result_is_refused_by_its_kind(kind, tmp_path):
    dataset = KINDS[kind]()
    sb.write_netcdf(dataset, tmp_path / "other.nc")
    for given in (tmp_path / "other.nc", dataset):
        with pytest.raises(
            sb.InputError, match=f"must be a map, and is a {kind}; draw it with snapbeam plot"
        ):
            opened(given)


def test_a_backbone_curve_is_refused():
    """Its dimension is called as that of a list of points."""
    curve = sb.dynamics.backbone_curve(SYSTEM.model, max_points=3)
    with pytest.raises(sb.InputError, match="is a backbone curve"):
        opened(curve)


@pytest.mark.parametrize(
    "dataset",
    [
        xr.Dataset(),
        xr.Dataset({"response_class": ("point", [0, 1, 2])}),
        xr.Dataset({"basin": ("cell", [0])}),
        xr.Dataset({"response_class": ("frequency_ratio", [0, 1])}, {"frequency_ratio": ("frequency_ratio", [1.0, 2.0], {"parameter": "drive.frequency_ratio"})}),
    ],
    ids=["nothing", "points without parameters", "basin without axes", "one axis alone"],
)  # fmt: skip
def test_what_has_no_two_axes_is_refused(dataset):
    with pytest.raises(sb.InputError, match="must be a map"):
        opened(dataset)


def test_a_map_of_one_axis_or_one_point_stays_a_map(system):
    one = sb.sweep(SYSTEM, {"frequency_ratio": [0.9, 1.0, 1.1]}, SHORT)
    assert opened(one).dims == ["frequency_ratio", "velocity_amplitude"]
    assert len(opened(one.isel(frequency_ratio=[1])).dims) == 2
