"""The figures of results on the page: clicked on, zoomed into, linked; on a telephone too."""

from __future__ import annotations

import numpy as np
import pytest

import snapbeam as sb

pytestmark = pytest.mark.filterwarnings("ignore::PendingDeprecationWarning")

_EXTENT = """(name) => { const m = Bokeh.documents[0].get_model_by_name(name);
  return [m.x_range.start, m.x_range.end, m.y_range.start, m.y_range.end]; }"""


@pytest.fixture(scope="module")
def branch(folder, system):
    """A branch of orbits in a file."""
    quiet = system.replace(**{"model.modes": 1, "model.damping_ratio": 0.05, "drive.velocity_amplitude": 0.02})
    orbit = sb.dynamics.periodic_orbit(quiet, transient=100)
    found = sb.dynamics.continuation(orbit, "velocity_amplitude", (0.015, 0.06), max_points=12).to_dataset()
    sb.write_netcdf(found, folder / "branch.nc")
    return found


def test_a_click_on_a_point_of_a_branch_shows_its_orbit(branch, serve, tab):
    page = tab(serve("branch.nc").url, plot="result-plot")
    at = 2
    x, w = float(branch["velocity_amplitude"][at]), float(branch["midspan_displacement"][at])
    page.click(x, w)
    assert f"velocity amplitude {x:.6g}" in page.head()
    page.wait(lambda: page.data("mark", "x") == [x], "the mark of the orbit")
    assert page.data("mark", "y") == [w]
    page.page.get_by_text("Waveform", exact=True).click()
    page.wait(lambda: len(page.data("waveform", "y")) > 10 or page.js(_HAS_CURVE), "the waveform")
    low, high = page.js(_EXTENT, "result-plot")[:2]
    page.page.mouse.move(*page.place(x, w, "result-plot"))
    page.page.mouse.wheel(0, -300)
    page.wait(lambda: np.ptp(page.js(_EXTENT, "result-plot")[:2]) < 0.9 * (high - low), "the zoom")


_HAS_CURVE = """() => [...Bokeh.documents[0]._all_models.values()].some(
  (m) => m.data && m.data.y && m.data.y.length > 10)"""


def test_the_axes_of_a_run_share_their_time_and_a_cursor(folder, system, serve, tab):
    sb.simulate(system, sb.Integration(cycles=5)).save(folder / "run.nc")
    page = tab(serve("run.nc").url, plot="result-plot")
    names = page.js(
        "() => [...Bokeh.documents[0]._all_models.values()].map((m) => m.name || '').filter((n) => n.startsWith('result-plot'))"
    )
    assert len(names) >= 3
    shared = [name for name in names if page.js(_EXTENT, name)[:2] == page.js(_EXTENT, "result-plot")[:2]]
    assert len(shared) >= 3
    before = page.js(_EXTENT, "result-plot")
    page.page.mouse.move(*page.place(0.5 * sum(before[:2]), 0.5 * sum(before[2:]), "result-plot"))
    page.page.mouse.wheel(0, -300)
    page.wait(lambda: page.js(_EXTENT, shared[-1])[1] < before[1] - 0.01, "the zoom of the axes below")
    assert page.js(_EXTENT, shared[-1])[:2] == page.js(_EXTENT, "result-plot")[:2]


def test_a_telephone_shows_a_result_within_its_width(branch, serve, tab):
    page = tab(serve("branch.nc").url, plot="result-plot", viewport={"width": 390, "height": 844})
    assert page.js("() => document.documentElement.scrollWidth") <= 390
