"""Axes in physical units, maps that are swept in them, and the look for a lecture."""

from __future__ import annotations

import numpy as np
import pytest

import snapbeam as sb
from snapbeam.explorer.address import Address
from snapbeam.explorer.maps import Plane, integration_of, opened, run_command, system_of
from snapbeam.model.parameter_file import Config

_FITS = "() => document.scrollingElement.scrollHeight <= window.innerHeight"
_RANGES = """() => {
  const plot = Bokeh.documents[0].get_model_by_name('map');
  const pair = (range) => [range.start, range.end];
  const [x, y] = [plot.extra_x_ranges, plot.extra_y_ranges].map((all) => all.get ? all.get('unit') : all.unit);
  return {x: pair(plot.x_range), y: pair(plot.y_range), hz: pair(x), mm: pair(y)};
}"""


def test_further_axes_follow_the_view(tab, served, system) -> None:
    page = tab(served.url, reduced_motion="no-preference")
    place = "() => Bokeh.documents[0].get_model_by_name('scrub').value"
    begun = page.js(place)
    page.wait(lambda: page.js(place) != begun and page.data("beam", "top"), "the beam in motion")
    first = system.model.reference_frequency
    speed = 1e3 * system.scale.length * system.scale.omega
    whole = page.js(_RANGES)
    np.testing.assert_allclose(whole["hz"], first * np.array(whole["x"]), rtol=1e-12)
    np.testing.assert_allclose(whole["mm"], speed * np.array(whole["y"]), rtol=1e-12)
    page.page.mouse.move(*page.place(1.2, 0.2))
    page.page.mouse.wheel(0, -300)
    page.wait(lambda: page.js(_RANGES)["x"][1] < whole["x"][1], "another view")
    seen = page.js(_RANGES)
    np.testing.assert_allclose(seen["hz"], first * np.array(seen["x"]), rtol=1e-12)
    np.testing.assert_allclose(seen["mm"], speed * np.array(seen["y"]), rtol=1e-12)


@pytest.mark.slow
def test_a_lecture_has_larger_type_and_keeps_the_view(tab, served, small_map) -> None:
    x, y = float(small_map["frequency_ratio"][9]), float(small_map["velocity_amplitude"][12])
    page = tab(f"{served.url}?at=drive.frequency_ratio:{x!r},drive.velocity_amplitude:{y!r}")
    page.wait(lambda: "impacts" in page.head(), "the run")
    size = "() => parseFloat(getComputedStyle(document.body).fontSize)"
    usual, said = page.js(size), page.head()
    page.page.get_by_role("button", name="Lecture").click()
    page.wait(lambda: page.js(size) > 1.3 * usual, "larger type")
    page.wait(lambda: page.head() == said, "the same run")
    assert "type=large" in page.page.url
    page.page.get_by_role("button", name="Two points").click()
    page.page.get_by_label("velocity amplitude").fill(repr(y * (1.0 + 1e-9)))
    page.page.get_by_label("velocity amplitude").press("Enter")
    page.wait(lambda: len(page.data("apart", "y")) > 0 and page.notes(1), "the separation of the two")
    for width, height in ((1920, 1080), (1280, 800)):
        page.page.set_viewport_size({"width": width, "height": height})
        page.wait(lambda: page.js(_FITS), f"all of it on {width} by {height}")
        tabs = page.page.locator('.bk-tab:has-text("Waveform"), .bk-tab:has-text("Numbers")')
        boxes = [tabs.nth(at).bounding_box() for at in range(2)]
        assert boxes[0]["y"] == boxes[1]["y"], "the tabs of a run in one row"
    page.page.get_by_role("button", name="Two points").click()
    page.wait(lambda: page.js(_FITS), "one point on 1280 by 800")
    page.page.set_viewport_size({"width": 390, "height": 844})
    page.wait(lambda: page.js("() => document.scrollingElement.scrollWidth") <= 390, "a lecture on a phone")
    page.page.get_by_role("button", name="Desk").click()
    page.wait(lambda: page.js(size) == usual, "the usual type")


def test_the_type_in_an_address() -> None:
    assert Address.read({"type": [b"large"]}).type == "large"
    assert "type=large" in Address(type="large").write()
    assert Address.read({"type": [b"huge"]}).words == ("address, type: must be large",)


def test_a_point_of_a_map_in_hz() -> None:
    """Beside an axis of the structure an axis in Hz stays in Hz; a point is run at the ratio of its structure."""
    base = Config().system.replace(**{"model.modes": 1})
    axes = {"beam.length": [0.15, 0.161], "drive.frequency_hz": np.linspace(60.0, 120.0, 5)}
    swept = sb.sweep(base, axes, sb.Integration(cycles=3))
    source = opened(swept)
    point = Plane.of(source, "frequency_hz", "beam_length", {}).at(1, 2)
    assert point.values == {"drive.frequency_hz": 90.0, "beam.length": 0.161}
    system, integration = point.system(system_of(swept.attrs, "map"), integration_of(swept.attrs))
    assert system.get("drive.frequency_ratio") == float(swept.frequency_ratio[1, 2])
    assert sb.simulate(system, integration).summary.min_displacement == float(swept.min_displacement[1, 2])
    assert "frequency_hz=90.0" in run_command(point.values, "map.nc", on_map=True)
