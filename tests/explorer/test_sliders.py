"""A slider of a parameter, and the figure of the view that is seen."""

from __future__ import annotations

import numpy as np
import pytest

import snapbeam as sb
from snapbeam.explorer.maps import opened, python_lines
from snapbeam.model.parameter_file import Config

pytest.importorskip("panel")

from snapbeam.explorer.page import Page
from snapbeam.explorer.shared import Shared

SYSTEM = Config().system.replace(**{"model.modes": 1, "model.damping_ratio": 0.05})
HOW = sb.Integration(cycles=40)


class _Now:
    """Jobs that are done at once."""

    def run(self, work, done, token):
        done(work(token), "")

    window = export = run

    def close(self):
        """Nothing is left."""


@pytest.fixture
def page(monkeypatch):
    shared = Shared(opened(SYSTEM, integration=HOW))
    shared.close()
    shared.jobs = _Now()
    monkeypatch.setattr(Page, "post", lambda self, work: work())
    monkeypatch.setattr(Page, "later", lambda self, work, milliseconds: None)
    return Page(shared, {})


@pytest.mark.filterwarnings("ignore::PendingDeprecationWarning")
@pytest.mark.parametrize("name", ["drive.velocity_amplitude", "contact.location"])
def test_a_dragged_slider_shows_the_first_cycles_and_its_release_the_run(page, name):
    page.ask(page.card.point(1.0, 0.2))
    card, view = page.system_card(), page.runs[0]
    card.vary.value = name
    held = card.slider.value
    assert held == pytest.approx(page.shown_system()[0].parameters[name]) and card.slider.visible
    dragged = 0.9 * held
    card.slider.value = dragged
    assert view.run.system.parameters[name] == pytest.approx(dragged)
    assert view.run.integration.cycles == 30
    assert page.changes == {}, "nothing is changed until the release"
    if name == "drive.velocity_amplitude":
        assert page.card.view.mark.data["y"] == [pytest.approx(dragged)]
    card._released(dragged)
    assert view.run.integration.cycles == 40
    own = sb.simulate(SYSTEM.replace(**page.points[0].values, **page.changes), HOW)
    assert view.run.system.parameters[name] == dragged
    assert own.summary.zero_crossings == view.run.summary.zero_crossings


@pytest.mark.filterwarnings("ignore::PendingDeprecationWarning")
def test_the_lines_of_python_draw_the_view_that_is_seen(page, tmp_path, monkeypatch):
    page.ask(page.card.point(1.0, 0.2))
    view = page.runs[0]
    pictures = [part.picture for part in view.parts]
    assert pictures[:5] == ["run", "phase_portrait", "spectrum", "modal_amplitudes", "energies"]
    view.tabs.active = 1
    monkeypatch.chdir(tmp_path)
    exec(python_lines(view.run.system, view.run.integration, view.picture), {})
    assert (tmp_path / "phase_portrait.png").read_bytes().startswith(b"\x89PNG")
    again = sb.load(tmp_path / "run.nc")
    assert again.summary.zero_crossings == view.run.summary.zero_crossings
    np.testing.assert_array_equal(again.dataset["time"][0], view.run.dataset["time"][0])
