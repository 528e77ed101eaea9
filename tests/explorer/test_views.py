"""Every view of a run in the browser: what it draws is what the run holds."""

from __future__ import annotations

import numpy as np
import pytest

import snapbeam as sb

pytest.importorskip("panel")

from snapbeam.explorer.run_view import BeamPanel, WaveformPanel
from snapbeam.explorer.style import LIGHT, Cursor


def _turn(page, title):
    page.page.locator(f'.bk-tab:has-text("{title}")').first.click()


@pytest.fixture
def opened(tab, served, small_map, system):
    """A page with a run, and the same run."""
    page = tab(served.url)
    x, y = float(small_map["frequency_ratio"][9]), float(small_map["velocity_amplitude"][12])
    page.click(x, y)
    page.wait(lambda: "bitwise identical" in page.notes(), "the run")
    exact = system.replace(**{"drive.frequency_ratio": x, "drive.velocity_amplitude": y})
    return page, sb.simulate(exact, sb.Integration(cycles=30))


def test_every_view_shows_the_run(opened):
    page, run = opened
    _turn(page, "Phase")
    page.wait(lambda: len(page.data("section", "w")) > 0, "the section")
    at = np.arange(0.0, 30.5)
    np.testing.assert_allclose(
        page.data("section", "w"), np.interp(at, run.dataset["cycle"], run.dataset["midspan_displacement"]), atol=1e-6
    )
    _turn(page, "Spectrum")
    page.wait(lambda: len(page.data("spectrum", "x")) > 0, "the spectrum")
    _turn(page, "Modes")
    page.wait(lambda: len(page.data("modal", "rms")) == 6, "the modes")
    alpha = run.dataset["modal_amplitude"].values / np.abs(run.system.model.wells[:, 0]).max()
    np.testing.assert_allclose(page.data("modal", "rms"), alpha.std(axis=0), rtol=1e-6)
    _turn(page, "Energy")
    page.wait(lambda: len(page.data("energy", "y")) > 0, "the energy")
    assert page.data("energy", "y")[-1] == pytest.approx(1e6 * float(run.dataset["striker_work"][-1]), rel=1e-6)
    _turn(page, "Impacts")
    page.wait(lambda: len(page.data("impacts", "peak")) > 0, "the impacts")
    np.testing.assert_array_equal(page.data("impacts", "peak"), run.impacts["peak_force"].values)
    _turn(page, "Numbers")
    page.wait(lambda: page.page.locator("table.numbers tr").count() > 20, "the numbers")


def test_the_beam_moves_and_is_that_of_the_modes(opened):
    page, run = opened
    _turn(page, "Beam")
    model = "() => !!Bokeh.documents[0].get_model_by_name('beam-plot')"
    page.wait(lambda: page.js(model) and len(page.data("beam", "top")) == 121, "the beam")
    place = "Bokeh.documents[0].get_model_by_name('frames').data.t"
    first = page.data("beam", "top")
    at = page.js(f"() => {place}[0]")
    length = float(run.dataset.attrs["beam_length"])
    shape = np.array([run.system.model.shape_at(x) for x in np.linspace(0, 1, 121)[1:-1]])
    index = int(np.argmin(np.abs(run.dataset["cycle"].values - at)))
    exact = 1e3 * (shape @ run.dataset["modal_amplitude"].values[index])
    np.testing.assert_allclose(np.array(first)[1:-1], exact, atol=1e-5)
    title = page.js("() => Bokeh.documents[0].get_model_by_name('beam-plot').title.text")
    assert "without its thickness" in title, "displacements alone are exaggerated"
    assert page.data("supports", "left") == pytest.approx([-0.02e3 * length, 1e3 * length])
    w, cycle = run.dataset["midspan_displacement"].values, run.dataset["cycle"].values
    snap = cycle[np.flatnonzero(w[:-1] * w[1:] < 0.0)[0]]
    assert page.data("beam-meta", "begin") == [pytest.approx(max(snap - 0.5, 0.0), abs=1e-6)]
    assert page.data("beam", "x")[-1] == pytest.approx(1e3 * length)
    page.page.get_by_role("button", name="Play").click()
    page.wait(lambda: page.data("beam", "top") != first, "the beam to move")
    page.page.get_by_role("button", name="Pause").click()
    page.page.wait_for_timeout(200)
    still = page.data("beam", "top")
    page.page.wait_for_timeout(200)
    assert page.data("beam", "top") == still


def test_a_closer_look_sends_the_samples_in_it(opened):
    page, run = opened
    page.js("""() => { const r = Bokeh.documents[0].get_model_by_name('waveform-plot').x_range;
                       r.setv({start: 2.0, end: 3.0}); }""")
    page.wait(lambda: page.data("waveform", "x")[-1] < 3.1, "the window")
    cycle = run.dataset["cycle"].values
    inside = (cycle >= 2.0) & (cycle <= 3.0)
    assert len(page.data("waveform", "x")) >= inside.sum()


def test_the_force_of_a_link_has_all_samples(tab, served, small_map, system):
    """The first look of 4000 samples is replaced although the page is still being loaded when it is computed."""
    x, y = float(small_map["frequency_ratio"][9]), float(small_map["velocity_amplitude"][12])
    page = tab(f"{served.url}?at=drive.frequency_ratio:{x!r},drive.velocity_amplitude:{y!r}&theme=dark")
    page.wait(lambda: "bitwise identical" in page.notes(), "the run")
    exact = system.replace(**{"drive.frequency_ratio": x, "drive.velocity_amplitude": y})
    peak = float(sb.simulate(exact, sb.Integration(cycles=30)).dataset["contact_force"].max())
    page.wait(lambda: max(page.data("force", "y"), default=0.0) == pytest.approx(peak, rel=1e-6), "the peak")


def test_no_curve_of_the_waveform_hides_another_and_impacts_are_curves(system):
    cursor = Cursor(LIGHT, "", lambda work, milliseconds: None)
    panel = WaveformPanel(LIGHT, cursor, BeamPanel(LIGHT, cursor))
    panel.activate()
    _, center, striker, *_ = (each.glyph for each in panel.top.renderers)
    assert striker.line_dash and not center.line_dash, "the dashed thin line lies on the wide one"
    assert striker.line_width < center.line_width
    point = {"drive.frequency_ratio": 1.14, "drive.velocity_amplitude": 0.4}
    run = sb.simulate(system.replace(**point), sb.Integration(cycles=30))
    time, impacts = run.dataset["time"].values, run.impacts
    for onset, duration in zip(impacts["onset"].values, impacts["duration"].values, strict=True):
        assert ((time >= onset) & (time <= onset + duration)).sum() >= 10


def test_numbers_of_parts_that_the_system_lacks_are_not_listed(opened):
    page, _ = opened
    _turn(page, "Numbers")
    page.wait(lambda: page.page.locator("table.numbers tr").count() > 0, "the numbers")
    words = page.page.locator("table.numbers").inner_text()
    assert "peak_force" in words and "voltage" not in words and "harvested" not in words
