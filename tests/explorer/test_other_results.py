"""Every result opens with its figures; what is none is refused before a page is made."""

from __future__ import annotations

import base64
import io

import matplotlib.pyplot as plt
import numpy as np
import pytest
import xarray as xr

import snapbeam as sb
from snapbeam.explorer.maps import opened
from snapbeam.model.parameter_file import Config
from snapbeam.plot.dataset import figures_of

SYSTEM = Config().system.replace(**{"model.modes": 1, "model.damping_ratio": 0.05})
SHORT = sb.Integration(cycles=4)


def _orbit():
    return sb.dynamics.periodic_orbit(SYSTEM.replace(**{"drive.velocity_amplitude": 0.02}), transient=100)


KINDS = {
    "bifurcation diagram": lambda: sb.dynamics.bifurcation_diagram(
        SYSTEM, "velocity_amplitude", np.linspace(0.02, 0.04, 3)
    ),
    "backbone curve": lambda: sb.dynamics.backbone_curve(sb.System(SYSTEM.model), lowest_frequency_ratio=0.9),
    "run": lambda: sb.simulate(SYSTEM, SHORT).dataset,
    "attractors": lambda: sb.dynamics.find_attractors(SYSTEM, 12).to_dataset(),
    "basins of attraction": lambda: sb.dynamics.basins_of_attraction(
        sb.dynamics.find_attractors(SYSTEM, 6), {"amplitude[1]": [-1.0, 0.0, 1.0], "velocity[1]": [-0.5, 0.5]}
    ),
    "section": lambda: sb.dynamics.poincare_section(
        SYSTEM.replace(**{"drive.velocity_amplitude": 0.02}), "impact", 20, transient=20
    ),
    "periodic orbit": lambda: _orbit().to_dataset(),
    "force-displacement curve": lambda: sb.force_displacement(SYSTEM.model, 0.5),
    "branch of orbits": lambda: sb.dynamics.continuation(
        _orbit(), "velocity_amplitude", (0.015, 0.03), max_points=6
    ).to_dataset(),
}


class _Now:
    """Jobs that are done at once."""

    def run(self, work, done, token):
        done(work(token), "")

    export = run

    def close(self):
        """Nothing is left."""


def page_of(what, monkeypatch):
    """The page of a result; its work is done at once."""
    pytest.importorskip("panel")
    from snapbeam.explorer.result_page import ResultPage
    from snapbeam.explorer.shared import Shared

    shared = Shared(opened(what))
    shared.close()
    shared.jobs = _Now()
    monkeypatch.setattr(ResultPage, "post", lambda self, work: work())
    monkeypatch.setattr(ResultPage, "later", lambda self, work, milliseconds: None)
    page = ResultPage(shared, {})
    page.stand()
    return page


@pytest.mark.parametrize("drawn", [1, pytest.param(None, marks=pytest.mark.slow)], ids=["first", "all"])
@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.filterwarnings("ignore::PendingDeprecationWarning")
def test_every_result_opens_with_its_figures(kind, drawn, tmp_path, monkeypatch):
    dataset = KINDS[kind]()
    sb.write_netcdf(dataset, tmp_path / "other.nc")
    assert opened(dataset).kind == opened(tmp_path / "other.nc").kind == kind
    page = page_of(tmp_path / "other.nc", monkeypatch)
    for name in list(figures_of(dataset)[1])[:drawn]:
        page.shown.value = name
        page.draw()
        (url,) = page.image.data["url"]
        image = plt.imread(io.BytesIO(base64.b64decode(url.partition(",")[2])))
        assert image.shape[1] > 400 and np.unique(image).size > 10, name
        assert page.plot.aspect_ratio == pytest.approx(image.shape[1] / image.shape[0]), name
    page.kind.value = "svg"
    page.save()
    assert bytes(page.downloads.source.data["bytes"][:5].tolist()) == b"<?xml"


@pytest.mark.filterwarnings("ignore::PendingDeprecationWarning")
def test_a_click_on_a_branch_or_a_basin_computes_its_run(monkeypatch):
    page = page_of(KINDS["branch of orbits"](), monkeypatch)
    assert page.view.run is None
    at, branch = 1, page.source.skeleton
    place = [float(branch[name][at]) for name in ("velocity_amplitude", "midspan_displacement")]
    page.tapped(*page.axes.transData.transform(place))
    run = page.view.run
    assert run.system.parameters["drive.velocity_amplitude"] == float(branch["velocity_amplitude"][at])
    w = run.dataset["midspan_displacement"].values
    assert w[0] == pytest.approx(float(branch["midspan_displacement"][at]), abs=1e-9)
    assert w[-1] == pytest.approx(w[0], abs=1e-6), "an orbit returns"
    found = sb.dynamics.find_attractors(SYSTEM, 6)
    grid = {"amplitude[1]": [-1.2, 0.0, 1.2], "velocity[1]": [-0.5, 0.5]}
    page = page_of(sb.dynamics.basins_of_attraction(found, grid), monkeypatch)
    page.tapped(*page.axes.transData.transform((-1.1, 0.2)))
    first = page.view.run.dataset.isel(time=0)
    assert float(first["midspan_displacement"]) == pytest.approx(-1.1, abs=1e-6)


@pytest.mark.filterwarnings("ignore::PendingDeprecationWarning")
def test_a_stored_run_and_an_orbit_show_themselves(tmp_path, monkeypatch):
    run = sb.simulate(SYSTEM, SHORT)
    run.save(tmp_path / "run.nc")
    page = page_of(tmp_path / "run.nc", monkeypatch)
    np.testing.assert_array_equal(page.view.run.dataset["contact_force"], run.dataset["contact_force"])
    orbit = _orbit()
    page = page_of(orbit.to_dataset(), monkeypatch)
    w = page.view.run.dataset["midspan_displacement"].values
    assert w[-1] == pytest.approx(w[0], abs=1e-6) and page.view.active.title == "Phase"


@pytest.mark.parametrize(
    "dataset",
    [
        xr.Dataset(),
        xr.Dataset({"response_class": ("point", [0, 1, 2])}),
        xr.Dataset({"response_class": ("frequency_ratio", [0, 1])}, {"frequency_ratio": ("frequency_ratio", [1.0, 2.0], {"parameter": "drive.frequency_ratio"})}),
    ],
    ids=["nothing", "points without parameters", "one axis alone"],
)  # fmt: skip
def test_what_has_no_two_axes_is_refused(dataset):
    with pytest.raises(sb.InputError, match=r"must be a result|needs two parameters"):
        opened(dataset)


def test_a_map_of_one_axis_or_one_point_stays_a_map(system):
    one = sb.sweep(SYSTEM, {"frequency_ratio": [0.9, 1.0, 1.1]}, SHORT)
    assert opened(one).dims == ["frequency_ratio", "velocity_amplitude"]
    assert len(opened(one.isel(frequency_ratio=[1])).dims) == 2
