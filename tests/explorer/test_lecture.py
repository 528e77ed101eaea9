"""The lecture in examples/lecture.md, carried out with its clicks in the order of its text."""

from __future__ import annotations

import wave

import numpy as np
import pytest
import xarray as xr

import snapbeam as sb
from snapbeam.model.parameter_file import Config

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def lecture(tmp_path_factory):
    """A folder with the two files that the lecture needs, the map coarser than there."""
    found = tmp_path_factory.mktemp("lecture")
    system = Config().system.replace(**{"model.modes": 8})
    axes = {"frequency_ratio": np.linspace(0.4, 2.4, 24), "velocity_amplitude": np.linspace(0.02, 0.6, 15)}
    sb.write_netcdf(sb.sweep(system, axes, sb.Integration(cycles=60)), found / "class.nc")
    one = system.replace(**{"model.modes": 1, "drive.frequency_ratio": 1.4})
    values = np.linspace(0.005, 0.12, 40)
    sb.write_netcdf(sb.dynamics.bifurcation_diagram(one, "velocity_amplitude", values), found / "diagram.nc")
    return found


class Teacher:
    """A page, and the acts of a teacher on it; ``after`` is called after each with a word for it."""

    def __init__(self, page, after=lambda word: None) -> None:
        self.page, self.after = page, after

    def type(self, ratio: str, velocity: str, which: int = 0) -> str:
        """Type a point and press Enter; the line on its run."""
        for label, text in (("frequency ratio", ratio), ("velocity amplitude", velocity)):
            field = self.page.page.get_by_label(label, exact=True).locator("visible=true")
            field.fill(text)
        field.press("Enter")
        words = f"frequency ratio {ratio}, velocity amplitude {velocity}"
        self.page.wait(lambda: words in self.page.head(which) and "impact" in self.page.head(which), words)
        self.after(velocity)
        return self.page.head(which)

    def turn(self, title: str) -> None:
        """Open a tab."""
        self.page.page.locator(f'.bk-tab:has-text("{title}")').first.click()
        self.page.page.wait_for_timeout(500)
        self.after(title)

    def press(self, name: str) -> None:
        """Press a button."""
        self.page.page.get_by_role("button", name=name, exact=True).click()
        self.page.page.wait_for_timeout(500)
        self.after(name)


def give(teacher, class_counts) -> None:
    """The lecture up to its second page; *class_counts* is of a run of a point, as a library computes it."""
    page, still = teacher.page, "() => Bokeh.documents[0].get_model_by_name('scrub').value"
    size = "() => parseFloat(getComputedStyle(document.body).fontSize)"
    usual = page.js(size)
    teacher.press("Lecture")
    page.wait(lambda: page.js(size) > usual and "impact" in page.head(), "larger type")
    # two equilibria
    teacher.turn("System")
    page.wait(lambda: "barrier" in page.text("system-facts") and "P/P_cr" in page.text("system-facts"), "the facts")
    teacher.turn("Map")
    assert "intrawell" in teacher.type("1.21", "0.1")
    begun = page.js(still)
    teacher.press("► Play")
    page.wait(lambda: page.js(still) != begun, "the beam in motion")
    teacher.press("❚❚ Pause")
    # snap-through
    assert "1 crossing, 12 impacts" in teacher.type("1.21", "0.16")
    teacher.turn("Impacts")
    page.wait(lambda: len(page.data("impacts", "peak")) == 12, "twelve impacts")
    teacher.turn("Energy")
    page.wait(lambda: page.data("energy", "y"), "the energies")
    teacher.turn("Waveform")
    assert "1 crossing, 4 impacts" in teacher.type("1.21", "0.4")
    # the map
    teacher.press("threshold")
    teacher.press("quasi-static")
    page.page.mouse.move(*page.place(1.2, 0.15))
    page.page.mouse.wheel(0, -300)
    page.wait(lambda: page.data("map-windows", "x") and "points" in page.state(), "finer cells")
    teacher.after("zoom")
    # two points
    own = class_counts(0.3)
    assert own in teacher.type("1.21", "0.3")
    teacher.press("Two points")
    other = class_counts(0.3000000003)
    assert other in teacher.type("1.21", "0.3000000003", 1) and "velocity amplitude 0.3," not in page.head(1)
    page.wait(lambda: len(page.data("apart", "y")) > 100, "the separation")
    apart = np.array(page.data("apart", "y"))
    assert apart.min() < 1e-8 and apart.max() > 0.1, "from a rounding to the width of a well"
    axis = "() => [...Bokeh.documents[0]._all_models.values()].filter((m) => m.type === 'LogScale').length"
    assert page.js(axis) >= 1
    assert len(page.data("waveform", "y")) > 100 and len(page.data("waveform-second", "y")) > 100
    assert page.data("map-mark", "text") == ["A", "B"]
    teacher.press("Two points")
    # live, and heard
    teacher.turn("System")
    page.page.get_by_label("Vary by a slider").select_option(label="drive.velocity amplitude")
    handle = page.page.locator(".noUi-handle:visible").last
    handle.scroll_into_view_if_needed()
    box = handle.bounding_box()
    x, y = box["x"] + 0.5 * box["width"], box["y"] + 0.5 * box["height"]
    page.page.mouse.move(x, y)
    page.page.mouse.down()
    for at in range(1, 13):
        page.page.mouse.move(x + 5 * at, y)
        page.page.wait_for_timeout(50)
    page.wait(lambda: "the first 30 cycles" in page.head(), "the run while the slider moves")
    moved = page.data("map-mark", "y")[0]
    teacher.after("slider")
    page.page.mouse.up()
    page.wait(lambda: "the first 30 cycles" not in page.head() and "impact" in page.head(), "the whole run")
    assert moved > 0.3 and page.data("map-mark", "y")[0] > 0.3
    teacher.turn("Export")
    with page.page.expect_download() as given:
        teacher.press("WAV")
    with wave.open(str(given.value.path())) as file:
        assert file.getframerate() == 44_100 and file.getnframes() > 10_000
    played = "() => document.querySelector('audio') && document.querySelector('audio').currentSrc.startsWith('blob:')"
    page.wait(lambda: page.js(played), "the sound")


def follow(teacher, diagram) -> None:
    """The second page: a click on a branch of a bifurcation diagram, and on its end, shows the motion."""
    page = teacher.page
    for at in (len(diagram["velocity_amplitude"]) // 2, -1):
        point = diagram.isel(sweep=0, velocity_amplitude=at)
        v, w = float(point["velocity_amplitude"]), float(point["midspan_displacement"][0])
        page.click(v, w)
        page.wait(lambda v=v: f"velocity amplitude {v:.6g}" in page.head() and page.data("mark", "x") == [v], "its run")
        page.wait(lambda w=w: abs(page.data("waveform", "y")[0] - w) < 1e-5, "a waveform that begins there")
        teacher.after(f"branch at {v:.3g}")


def test_the_lecture_is_given_with_its_clicks(lecture, serve, tab):
    system = Config().system.replace(**{"model.modes": 8, "drive.frequency_ratio": 1.21})

    def counts(velocity):
        run = sb.simulate(system.replace(**{"drive.velocity_amplitude": velocity}), sb.Integration(cycles=60)).summary
        return f"{run.zero_crossings} crossing"

    screen = {"viewport": {"width": 1280, "height": 800}}
    give(Teacher(tab(serve("class.nc", where=lecture).url, **screen)), counts)
    url = f"{serve('diagram.nc', where=lecture).url}?type=large"
    with xr.open_dataset(lecture / "diagram.nc", engine="h5netcdf") as diagram:
        follow(Teacher(tab(url, plot="result-plot", **screen)), diagram)
