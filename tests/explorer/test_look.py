"""The page over the first frame of a recording, in the browser."""

import tomllib
from importlib.util import find_spec

import numpy as np
import pytest

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(find_spec("snapbeam.lab") is None, reason="the laboratory part is not installed"),
]
NAME = "frames of a beam.npy"


@pytest.fixture
def recorded(tmp_path):
    """Sixty frames of a beam on a rod, which move, and of a bar at the lower left that does not."""
    row, column = np.arange(120)[:, None] + np.zeros(160), np.arange(160) + np.zeros((120, 1))
    rng, frames = np.random.default_rng(0), []
    for k in range(60):
        top = 50.0 - (4.0 * np.sin(0.3 * (k - 20)) if k > 20 else 0.0)
        beam = np.clip(row - top, 0, 1) * np.clip(top + 14.0 - row, 0, 1)
        rod = np.clip(row - top - 20.0, 0, 1) * (abs(column - 80) < 12)
        bar = (abs(row - 100) < 12) & (abs(column - 20) < 8)
        frames.append(20.0 + 150.0 * np.maximum(beam, np.maximum(rod, bar)) + 2.0 * rng.standard_normal(row.shape))
    np.save(tmp_path / NAME, np.array(frames).clip(0, 255).astype(np.uint8))
    return tmp_path


def test_what_is_drawn_over_the_picture_is_written(recorded, serve, browser):
    served = serve(NAME, where=recorded, command="look")
    page = browser.new_page(viewport={"width": 1280, "height": 900})
    errors = []
    page.on("console", lambda message: errors.append(message.text))
    page.on("pageerror", lambda error: errors.append(str(error)))

    def at(x, y):
        return page.evaluate(
            """([x, y]) => { const plot = Bokeh.index.find_one(Bokeh.documents[0].get_model_by_name('frame'));
            const box = plot.el.getBoundingClientRect();
            return [box.left + plot.frame.x_scale.compute(x), box.top + plot.frame.y_scale.compute(y)]; }""",
            [x, y],
        )

    def drag(start, end):
        page.mouse.move(*at(*start))
        page.mouse.down()
        page.mouse.move(*at(*np.mean([start, end], axis=0)), steps=4)
        page.mouse.move(*at(*end), steps=4)
        page.mouse.up()

    page.goto(f"{served.url}?token={served.token}")
    page.get_by_text("Found: a beam 13.0 px").wait_for()
    drag((80, 119.5), (80, 113.6))  # the lower side of the region, to row 114
    page.wait_for_function("() => Bokeh.documents[0].get_model_by_name('region').bottom < 118")
    ends = page.evaluate("() => ['x', 'y'].map((k) => [...Bokeh.documents[0].get_model_by_name('line').data[k]])")
    for start, end in zip(np.transpose(ends), ((20, 20), (120, 20)), strict=True):
        drag(start, end)
    page.get_by_label("Length of the line, mm").fill("2")
    page.keyboard.press("Enter")
    page.get_by_role("button", name="Set the pixel size").click()
    page.get_by_text("from a line of 2 mm").wait_for()
    page.get_by_label("Frame rate, Hz").fill("-5")
    page.keyboard.press("Enter")
    page.get_by_role("button", name="Write the settings").click()
    page.get_by_text("frame_rate (--frame-rate) = -5").or_(page.get_by_text("frame_rate = -5")).wait_for()
    assert [each.name for each in recorded.glob("*.toml")] == []
    page.get_by_label("Frame rate, Hz").fill("2000")
    page.keyboard.press("Enter")
    page.get_by_role("button", name="Contact").click()
    page.mouse.click(*at(82, 40))
    page.get_by_role("button", name="Fixed marks").click()
    page.keyboard.down("Shift")
    drag((9, 86), (31, 112))
    page.keyboard.up("Shift")
    page.wait_for_function("() => Bokeh.documents[0].get_model_by_name('marks').data.left.length == 1")
    page.get_by_role("button", name="Write the settings").click()
    page.get_by_text("Written: look.toml").wait_for()
    assert page.get_by_text(f"snapbeam track '{NAME}' --settings look.toml").count() == 1
    found = tomllib.loads((recorded / "look.toml").read_text())
    assert found["camera"]["frame_rate"] == 2000.0 and found["camera"]["pixel_size"] == pytest.approx(20e-6, rel=0.02)
    assert found["camera"]["region"][0] == 0 and abs(found["camera"]["region"][1] - 114) <= 1
    assert found["tracking"]["contact_column"] == pytest.approx(82, abs=0.6)
    np.testing.assert_allclose(found["tracking"]["fixed_marks"], [[86, 112, 9, 31]], atol=1)
    assert errors == []
    page.close()
