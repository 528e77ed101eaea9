"""A slider of a parameter, and the figure of the view that is seen."""

from __future__ import annotations

import contextlib
import wave
from urllib.parse import parse_qs

import numpy as np
import pytest

import snapbeam as sb
from snapbeam.explorer.cards import write_sound
from snapbeam.explorer.jobs import Cancelled
from snapbeam.explorer.maps import opened, python_lines
from snapbeam.model.parameter_file import Config

pytest.importorskip("panel")

from snapbeam.explorer.map_view import MapView
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


class _Held(_Now):
    """Jobs that are done when a test says so."""

    turn = staticmethod(lambda token: contextlib.nullcontext())

    def __init__(self):
        self.waiting = []

    def run(self, work, done, token):
        self.waiting.append((work, done, token))

    window = run

    def work(self):
        """Do all that is wanted."""
        while self.waiting:
            work, done, token = self.waiting.pop(0)
            with contextlib.suppress(Cancelled):
                done(work(token), "")


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


@pytest.mark.filterwarnings("ignore::PendingDeprecationWarning")
def test_a_slider_that_returns_shows_the_run_of_the_point_again(page):
    page.ask(page.card.point(1.0, 0.2))
    card, own = page.system_card(), page.runs[0].run.summary
    card.vary.value = "beam.thickness"
    held = card.slider.value
    for value in (1.2 * held, held):
        card.slider.value = value
    assert page.runs[0].run.integration.cycles == 30
    card._released(held)
    again = page.runs[0].run
    assert page.changes == {} and again.integration.cycles == 40 and again.summary.peak_force == own.peak_force


@pytest.mark.filterwarnings("ignore::PendingDeprecationWarning")
@pytest.mark.parametrize("way", ["fields", "back"])
def test_run_and_export_of_a_changed_system_are_old_until_it_is_computed(page, way):
    page.ask(page.card.point(1.0, 0.2))
    take, view = page.take_card(), page.runs[0]
    page.write_address()
    before = page._search()
    assert view.current is not None and "snapbeam simulate" in take.text.object
    page.shared.jobs = held = _Held()
    if way == "fields":
        page.system_card().fields["beam.thickness"].value = "0.0005"
        page.system_card().apply()
        assert "Beam: thickness 0.0005 m" in page.old.object
    else:
        page._went(f"{before}&set=beam.thickness:0.0005")
    assert view.current is None and view.tabs.css_classes == ["stale"], "Numbers is one of the tabs"
    assert "is old" in take.text.object and "snapbeam simulate" not in take.text.object
    take.buttons["WAV"].clicks += 1
    assert "is old" in take.words.object
    held.work()
    assert view.current.system.parameters["beam.thickness"] == 0.0005 and view.tabs.css_classes == []
    assert "snapbeam simulate" in take.text.object


@pytest.mark.filterwarnings("ignore::PendingDeprecationWarning")
def test_a_window_that_was_stopped_goes_on_to_its_end_when_asked(page, monkeypatch):
    monkeypatch.setattr(MapView, "pixels", (81, 81))
    monkeypatch.setattr("snapbeam.explorer.cards._WAIT", 0.0)
    page.shared.jobs = held = _Held()
    control, card = page.card.control, page.card
    control.compute_view()
    held.work()
    assert "Compute view continues" in card.state.object, "a long level is a question"
    control.compute_view(force=True)
    control.halt()
    held.work()
    (window,) = card.windows()
    assert "stopped" in card.state.object and not window.finished and not card.stop.visible
    control.compute_view()  # the figure got another size
    assert not held.waiting, "nothing goes on unasked"
    control.compute_view(force=True)
    held.work()
    assert window.finished and card.windows() == [window] and "continues" not in card.state.object


def _state(page):
    """All that the page shows, computed from the page itself."""
    return (
        page.card.plane.names, page.card.show.value, page.card.view.view, page.points[0] and page.points[0].values,
        page.changes, page.card.system, page.card.integration, page.runs[0].tabs.active, page.look,
    )  # fmt: skip


@pytest.mark.filterwarnings("ignore::PendingDeprecationWarning")
def test_a_page_read_from_the_address_of_another_shows_the_same(page):
    rng = np.random.default_rng(11)
    for _ in range(2):
        page.card.show.value = str(rng.choice(page.card.source.variables()))
        left, low = rng.uniform(0.4, 1.0), rng.uniform(0.02, 0.1)
        page.card.view.view = (left, left + 0.5, low, low + 0.2)
        page.runs[0].tabs.active = int(rng.integers(len(page.runs[0].parts)))
        page._adopt(
            {"beam.thickness": float(rng.uniform(3.9e-4, 4.1e-4)), "integration.cycles": int(rng.integers(5, 9))}
        )
        page.ask(page.card.point(float(left + 0.2), float(low + 0.1)))
        given = {name: [each.encode() for each in values] for name, values in parse_qs(page._search()).items()}
        again = Page(page.shared, given)
        again._show_runs(again.address)
        assert _state(again) == _state(page)
        assert again._search() == page._search()


@pytest.mark.filterwarnings("ignore::PendingDeprecationWarning")
def test_a_field_shows_six_digits_and_keeps_all(page):
    value = 1.1434782608695653
    page.ask(page.card.point(value, 0.2))
    exact = page.points[0].values
    assert all(len(field.value) <= 8 for field in page.fields.values())
    page._ask_typed()
    assert page.points[0].values == exact
    page.fields["drive.velocity_amplitude"].value = "0.3000000003"
    page._ask_typed()
    assert page.points[0].values["drive.velocity_amplitude"] == 0.3000000003
    assert page.fields["drive.velocity_amplitude"].value == "0.3000000003", "as it was typed"


@pytest.mark.filterwarnings("ignore::PendingDeprecationWarning")
def test_one_switch_gives_all_views_physical_units(page):
    page.ask(page.card.point(1.0, 0.2))
    physical = Page(page.shared, {"units": [b"physical"]})
    physical.ask(physical.card.point(1.0, 0.2))
    system = page.runs[0].run.system
    length, first = 1e3 * system.scale.length, system.model.reference_frequency
    for active, name, factor, label in (
        (0, "midspan_displacement", length, "displacement w (mm)"),
        (2, "midspan_displacement", length, "amplitude (mm)"),
    ):
        views = [each.runs[0] for each in (page, physical)]
        for view in views:
            view.tabs.active = active
            view._draw()
        ratios, units = (view.active.sources[name].data for view in views)
        np.testing.assert_allclose(units["y"], np.maximum(factor * ratios["y"], units["y"].min()), rtol=1e-5)
        plot = getattr(views[1].active, "top", None) or views[1].active.plot
        assert plot.yaxis.axis_label == label
    np.testing.assert_allclose(units["x"], first * ratios["x"], rtol=1e-12)
    for view in views:
        view.tabs.active = 1
        view._draw()
    v = [view.active.line.data["v"] for view in views]
    np.testing.assert_allclose(v[1], length * system.scale.omega * v[0], rtol=1e-12)


@pytest.mark.filterwarnings("ignore::PendingDeprecationWarning")
def test_the_figure_of_the_map_is_that_of_the_view(page, monkeypatch):
    axes = {"frequency_ratio": np.linspace(0.5, 1.5, 4), "velocity_amplitude": np.linspace(0.1, 0.4, 4)}
    shared = Shared(opened(sb.sweep(SYSTEM, axes, sb.Integration(cycles=3))))
    shared.close()
    shared.jobs = _Now()
    zoomed = Page(shared, {"view": [b"0.7,1.1,0.15,0.3"]})
    limits = []
    monkeypatch.setattr(
        "snapbeam.explorer.cards.save_figure",
        lambda figure, path: (limits.append((figure.axes[0].get_xlim(), figure.axes[0].get_ylim())), path.touch()),
    )
    for name in ("response_class", "peak_force"):
        zoomed.card.show.value = name
        zoomed.take_card()._map_picture()
    assert limits == [((0.7, 1.1), (0.15, 0.3))] * 2


def test_a_velocity_is_heard_at_its_own_pitch(tmp_path):
    time = np.sort(np.random.default_rng(2).uniform(0.0, 0.5, 20_000))
    write_sound(time, 0.03 * np.sin(2 * np.pi * 440.0 * time), tmp_path / "velocity.wav")
    with wave.open(str(tmp_path / "velocity.wav")) as file:
        rate, series = file.getframerate(), np.frombuffer(file.readframes(file.getnframes()), dtype="<i2")
    assert series.size == pytest.approx(0.5 * rate, rel=1e-3) and np.abs(series).max() == 32767
    spectrum = np.abs(np.fft.rfft(series))
    assert np.argmax(spectrum) * rate / series.size == pytest.approx(440.0, abs=2.5)
