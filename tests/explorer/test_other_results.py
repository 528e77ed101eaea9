"""Every result opens with its figures; what is none is refused before a page is made."""

from __future__ import annotations

import os
import subprocess
import sys

import numpy as np
import pytest
import xarray as xr

import snapbeam as sb
from snapbeam.explorer.maps import opened
from snapbeam.model.parameter_file import Config
from snapbeam.plot.dataset import figures_of

Tap = pytest.importorskip("bokeh.events").Tap
pytestmark = pytest.mark.filterwarnings("ignore::PendingDeprecationWarning")

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
def test_every_result_opens_with_its_figures(kind, drawn, tmp_path, monkeypatch):
    dataset = KINDS[kind]()
    sb.write_netcdf(dataset, tmp_path / "other.nc")
    assert opened(dataset).kind == opened(tmp_path / "other.nc").kind == kind
    page = page_of(tmp_path / "other.nc", monkeypatch)
    for name in list(figures_of(dataset)[1])[:drawn]:
        page.shown.value = name
        page.draw()
        plots = [plot for plot, _ in page.drawn.plots]
        assert plots and any(len(each.renderers) > 0 for each in plots), name
        assert "$" not in "".join(
            str(text) for each in plots for text in (each.xaxis.axis_label, each.yaxis.axis_label)
        )
    page.kind.value = "svg"
    page.save()
    assert bytes(page.downloads.source.data["bytes"][:5].tolist()) == b"<?xml"


def _click(page, x, y):
    """Click on the first figure of a page, and return the run that is computed."""
    event = Tap(page.drawn.plots[0][0], x=x, y=y)
    page.drawn.plots[0][0]._trigger_event(event)
    return page.view.run


def test_a_click_on_a_branch_computes_its_orbit(monkeypatch):
    page = page_of(KINDS["branch of orbits"](), monkeypatch)
    at, branch = 1, page.source.skeleton
    middle = float(branch["velocity_amplitude"][branch.sizes["orbit"] // 2])
    assert page.view.run.system.parameters["drive.velocity_amplitude"] == middle, "a page opens with a run"
    place = [float(branch[name][at]) for name in ("velocity_amplitude", "midspan_displacement")]
    run = _click(page, *place)
    assert run.system.parameters["drive.velocity_amplitude"] == float(branch["velocity_amplitude"][at])
    w = run.dataset["midspan_displacement"].values
    assert w[0] == pytest.approx(float(branch["midspan_displacement"][at]), abs=1e-9)
    assert w[-1] == pytest.approx(w[0], abs=1e-6), "an orbit returns"
    assert [page.mark.data["x"][0], page.mark.data["y"][0]] == place


def test_a_click_on_another_figure_of_a_branch_computes_nothing(monkeypatch):
    page = page_of(KINDS["branch of orbits"](), monkeypatch)
    page.shown.value = "multipliers"
    page.draw()
    before = page.view.run
    assert _click(page, 0.02, 0.5) is before


def test_a_click_on_a_basin_starts_there(monkeypatch):
    found = sb.dynamics.find_attractors(SYSTEM, 6)
    grid = {"amplitude[1]": [-1.2, 0.0, 1.2], "velocity[1]": [-0.5, 0.5]}
    first = _click(page_of(sb.dynamics.basins_of_attraction(found, grid), monkeypatch), -1.1, 0.2).dataset.isel(time=0)
    assert float(first["midspan_displacement"]) == pytest.approx(-1.1, abs=1e-6)


def test_a_click_on_a_diagram_starts_at_the_nearest_point_and_stays_on_it(monkeypatch):
    page = page_of(KINDS["bifurcation diagram"](), monkeypatch)
    diagram = page.source.skeleton.isel(sweep=0, velocity_amplitude=0)
    v, w = float(diagram["velocity_amplitude"]), float(diagram["midspan_displacement"][0])
    run = _click(page, v + 1e-4, w + 1e-3)
    assert run.system.parameters["drive.velocity_amplitude"] == v
    moved = run.dataset["midspan_displacement"].values
    assert moved[0] == pytest.approx(w, abs=1e-9)
    whole = int(round(run.dataset.sizes["time"] - 1) / run.dataset["cycle"].values[-1])
    assert moved[whole] == pytest.approx(w, abs=1e-4), "a motion of one period returns after it"


def test_a_click_on_a_backbone_computes_the_free_motion(monkeypatch):
    page = page_of(KINDS["backbone curve"](), monkeypatch)
    curve = page.source.skeleton.isel(point=4)
    height = 0.5 * float(curve["max_midspan"] - curve["min_midspan"])
    run = _click(page, float(curve["frequency_ratio"]), height)
    w = run.dataset["midspan_displacement"].values
    assert w.max() == pytest.approx(float(curve["max_midspan"]), abs=1e-4)
    assert w.min() == pytest.approx(float(curve["min_midspan"]), abs=1e-4)
    assert run.system.model.damping_ratio == 0.0 and not run.system.contacts


@pytest.mark.parametrize("kind", ["threshold", "hysteresis"])
def test_a_click_on_a_curve_over_parameters_computes_their_run(kind, monkeypatch):
    speeds = [0.02, 0.1, 0.2]
    dataset = (
        sb.threshold(SYSTEM, "drive.velocity_amplitude", speeds, {"frequency_ratio": [1.0, 1.4]}, SHORT)
        if kind == "threshold"
        else sb.dynamics.hysteresis(SYSTEM, "velocity_amplitude", speeds, SHORT)
    )
    run = _click(page_of(dataset, monkeypatch), *((1.3, 0.07) if kind == "threshold" else (0.07, 0.5)))
    values = run.system.parameters
    assert values["drive.velocity_amplitude"] == 0.07
    assert values["drive.frequency_ratio"] == (
        1.3 if kind == "threshold" else SYSTEM.parameters["drive.frequency_ratio"]
    )
    as_long = sb.simulate(run.system, SHORT).dataset
    np.testing.assert_array_equal(run.dataset["midspan_displacement"], as_long["midspan_displacement"])


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


@pytest.mark.parametrize("content", [b"", b"hello", b"\x89HDF\r\n\x1a\n" + bytes(range(256)) * 20])
def test_a_file_of_garbage_is_refused_in_words_before_a_page_is_loaded(content, tmp_path):
    (tmp_path / "junk.nc").write_bytes(content)
    code = (
        "import sys\nfrom snapbeam.cli import main\n"
        "try:\n    main()\nfinally:\n    print('panel' in sys.modules)"
    )  # fmt: skip
    asked = [sys.executable, "-c", code, "explore", "junk.nc", "--no-browser"]
    found = subprocess.run(asked, cwd=tmp_path, capture_output=True, text=True, env=dict(os.environ, COLUMNS="400"))
    assert found.returncode == 2 and found.stdout.strip() == "False"
    assert found.stderr.strip() == "error: map = 'junk.nc': is no NetCDF or HDF5 file, or is damaged"
