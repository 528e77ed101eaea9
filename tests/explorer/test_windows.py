"""Parts of the map computed anew: their order, their numbers, and that they can be stopped."""

from __future__ import annotations

import shlex

import numpy as np
import pytest
import xarray as xr

import snapbeam as sb
from snapbeam.cli import app

pytest.importorskip("panel")

from snapbeam.explorer.jobs import Cancelled, Jobs, Token
from snapbeam.explorer.maps import (
    DatasetSource,
    Plane,
    Point,
    SystemSource,
    compute,
    drawn_shares,
    known_cells,
    map_command,
    planned,
    system_toml,
    visible_strides,
)

NAMES = ("drive.frequency_ratio", "drive.velocity_amplitude")


@pytest.fixture
def jobs():
    made = Jobs()
    yield made
    made.close()


@pytest.fixture(scope="module")
def one_mode(system):
    return system.replace(**{"model.modes": 1})


def _window(system, pixels=(60, 36), cell=3, log=(False, False)):
    return planned(system, sb.Integration(cycles=4), NAMES, (0.9, 1.4, 0.1, 0.4), log, pixels, cell)


def test_a_window_ends_as_the_sweep_of_its_points(one_mode, jobs):
    window = _window(one_mode)
    assert (window.x.size, window.y.size) == (27, 27)
    told = []
    compute(window, jobs, Token(), lambda w: told.append((w.done, int(w.stride.max()), int((w.stride == 0).sum()))))
    assert window.finished and window.done == 729 and (window.stride == 1).all()
    assert told[0][1] == 27, "it begins coarse"
    assert window.own().all()
    axes = {"drive.velocity_amplitude": window.y, "drive.frequency_ratio": window.x}
    whole = sb.sweep(one_mode, axes, sb.Integration(cycles=4))
    for name in ("response_class", "zero_crossings", "peak_force", "striker_work"):
        np.testing.assert_array_equal(window.values[name], whole[name].values, name)


def test_every_cell_of_a_coarse_window_holds_a_run_that_was_made(one_mode, jobs):
    window, token = _window(one_mode, (150, 90)), Token()

    def tell(w):
        if w.done >= 60:
            token.cancel()

    with pytest.raises(Cancelled):
        compute(window, jobs, token, tell)
    assert not window.finished and 60 <= window.done < window.size
    own = window.own()
    rows, columns = np.nonzero(window.stride)
    for row, column in list(zip(rows, columns, strict=True))[::97]:
        at = window.computed_at(float(window.x[column]), float(window.y[row]))
        assert own[at], "the cell that is clicked stands for a run"
        assert window.values["peak_force"][row, column] == window.values["peak_force"][at]
    before = window.done
    compute(window, jobs, Token(), lambda _: None)  # what was computed is kept
    assert window.finished and window.done == window.size
    assert before < window.done


def test_a_window_of_too_many_points_has_wider_cells(one_mode):
    window = planned(one_mode, sb.Integration(), NAMES, (0.9, 1.4, 0.1, 0.4), (False, False), (3000, 2000), 1)
    assert window.size <= 60_000


def test_cells_of_axes_of_powers_are_even_in_powers(one_mode):
    window = _window(one_mode, log=(True, False))
    np.testing.assert_allclose(np.diff(np.log(window.x)), np.diff(np.log(window.x))[0])
    assert window.cell(float(window.x[7]), float(window.y[3])) == (3, 7)


@pytest.fixture(scope="module")
def plane(one_mode):
    """A map of 12 by 8 points over the part that the windows show."""
    axes = {"velocity_amplitude": np.linspace(0.1, 0.4, 8), "frequency_ratio": np.linspace(0.9, 1.4, 12)}
    source = DatasetSource(sb.sweep(one_mode, axes, sb.Integration(cycles=4)))
    return Plane.of(source, "frequency_ratio", "velocity_amplitude", {})


def test_a_window_is_computed_and_drawn_only_where_it_is_finer(one_mode, plane, jobs):
    """The cells of the map are 6.8 by 10 pixels: blocks of 81 and 27 pixels would hide them."""
    window = _window(one_mode, (81, 81))
    window.known = known_cells(window, plane, [])
    assert 2.0 < window.known[0].min() < window.known[0].max() < 3.0
    told = []
    compute(window, jobs, Token(), lambda w: told.append(int(w.stride.max())))
    assert set(told) == {1} and window.done == window.wanted == window.size
    # a part of it again, in cells of the same size: nothing is finer, nothing is computed or drawn
    part = planned(one_mode, sb.Integration(cycles=4), NAMES, (1.0, 1.4, 0.1, 0.4), (False, False), (65, 81))
    part.known = known_cells(part, plane, [(window, window.stride)])
    compute(part, jobs, Token(), lambda _: None)
    assert part.wanted == part.done == 0 and part.finished
    coarse = _window(one_mode, (81, 81))
    coarse.stride[:] = 3
    drawn = visible_strides([coarse, window, coarse], plane)
    assert [int(each.max()) for each in drawn] == [0, 1, 0]
    assert visible_strides([coarse, window], None)[0].all(), "without a map anything is finer"


def test_a_long_level_waits_until_it_is_asked_for(one_mode, jobs):
    window = _window(one_mode)
    compute(window, jobs, Token(), lambda _: None, seconds=0.0)
    assert not window.finished and window.done < 30 and window.waits
    compute(window, jobs, Token(), lambda _: None)
    assert window.finished and not window.waits and window.done == window.size


@pytest.mark.slow
def test_a_window_stops_when_the_view_moves_and_goes_on_when_asked(tab, served):
    page = tab(f"{served.url}?set=integration.cycles:3000")
    page.wait(lambda: "window: " in page.state(), "points of the changed system")
    page.page.mouse.move(*page.place(1.2, 0.2))
    page.page.mouse.wheel(0, -120)
    page.wait(lambda: "the view moved" in page.state(), "the end of the computation")
    page.wait(lambda: "Compute view continues" in page.state(), "the end of what is computed unasked")

    def done() -> int:
        return int(page.state().partition("window: ")[2].split()[0])

    before = done()
    for _ in range(2):  # after a stop it goes on from there
        page.page.get_by_role("button", name="Compute view").click()
        page.wait(lambda least=before + 3: "now; about" in page.state() and done() > least, "more points")
        before = done()
        page.page.get_by_role("button", name="Stop").click()
        page.wait(lambda: "stopped" in page.state(), "the end of it")


def test_one_notch_of_the_wheel_hides_no_cell_of_the_map(tab, served):
    page = tab(served.url)
    page.page.mouse.move(*page.place(1.2, 0.2))
    page.page.mouse.wheel(0, -120)
    page.wait(lambda: "window: " in page.state() and page.data("map-windows", "image"), "a window")
    assert "blocks of 27" not in page.state() and "blocks of 9 " not in page.state()


def test_zooming_computes_what_is_seen_and_a_click_runs_its_points(tab, served):
    page = tab(served.url)
    page.js("""() => { const p = Bokeh.documents[0].get_model_by_name('map');
      p.x_range.setv({start: 1.0, end: 1.3}); p.y_range.setv({start: 0.1, end: 0.2}); }""")
    page.page.get_by_role("button", name="Compute view").click()
    page.wait(lambda: "points" in page.state() and len(page.data("map-windows", "image")) == 1, "a window")
    page.wait(lambda: "blocks of 9" in page.state() or "blocks of 3" in page.state(), "finer cells")
    page.page.get_by_role("button", name="Stop").click()
    page.wait(lambda: "stopped" in page.state(), "the end of it")
    page.click(1.151, 0.152)
    page.wait(lambda: "bitwise identical" in page.notes(), "the run of a point between those of the map")


@pytest.mark.slow
def test_the_papers_beam_is_mapped_while_one_looks(tab, serve, folder):
    (folder / "quick.toml").write_text(
        "extends = 'paper'\n[model]\nmodes = 1\n[integration]\ncycles = 5\n", encoding="utf-8"
    )
    page = tab(serve("--config", "quick.toml").url)
    page.wait(lambda: len(page.data("map-windows", "image")) == 1, "a map out of nothing")
    finer = ("blocks of 9", "blocks of 3", "blocks of 1 ", "all ")
    page.wait(lambda: any(words in page.state() for words in finer), "the coarsest level")
    page.click(1.2, 0.3)
    page.wait(lambda: "crossings" in page.head() and "bitwise identical" in page.notes(), "a run")


@pytest.mark.slow
def test_what_each_of_two_strikers_does_is_shown_and_kept(one_mode, jobs) -> None:
    """A map to be computed offers it, a window has it with unit and words, after what all of them do together."""
    from snapbeam.explorer.cards import window_dataset
    from snapbeam.explorer.maps import SystemSource, layers_of

    stop = sb.Striker(drive=sb.FixedStop(), location=0.3, side="above", gap=2e-5)
    two = sb.System(
        one_mode.model,
        contacts=[sb.Contact(one_mode.contact_law, one_mode.striker), sb.Contact(one_mode.contact_law, stop)],
    )
    axes = {NAMES[0]: np.linspace(0.9, 1.4, 3), NAMES[1]: np.linspace(0.1, 0.4, 3)}
    offered = SystemSource(two, axes, sb.Integration(cycles=4), "two").variables()
    assert {"peak_force_contact_1", "peak_force_contact_2"} <= set(offered)
    assert not any("_striker_" in name for name in SystemSource(one_mode, axes, sb.Integration(), "one").variables())
    window = compute(_window(two, (30, 30), 10), jobs, Token(), lambda _: None)
    found = window_dataset(window)
    assert found.peak_force_contact_2.attrs == {"units": "N", "long_name": "peak contact force, contact 2"}
    order = list(layers_of(found))
    assert order[0] == "response_class"
    at = order.index("peak_force")
    assert order[at : at + 3] == ["peak_force", "peak_force_contact_1", "peak_force_contact_2"]


@pytest.mark.parametrize("log", [False, True])
def test_the_command_of_a_window_on_a_slice_computes_the_window(system, jobs, tmp_path, monkeypatch, log) -> None:
    """The parameter file has 6 modes, the slice 1."""
    axes = {"modes": [1, 2], NAMES[0]: np.linspace(0.9, 1.4, 3), NAMES[1]: np.linspace(0.1, 0.4, 3)}
    source = SystemSource(system, axes, sb.Integration(cycles=8), "sliced")
    plane = Plane.of(source, "frequency_ratio", "velocity_amplitude", {"modes": 0})
    cut = plane.fixed_values()
    at_cut, how = Point(cut).system(system, sb.Integration(cycles=8))
    window = planned(at_cut, how, NAMES, (0.9, 1.4, 0.1, 0.4), (log, False), (27, 27), 1)
    compute(window, jobs, Token(), lambda _: None)
    monkeypatch.chdir(tmp_path)
    (tmp_path / "system.toml").write_text(system_toml(system, how), encoding="utf-8")
    with pytest.raises(SystemExit) as ended:
        app(shlex.split(map_command(window, cut))[1:])
    assert ended.value.code in (0, None)
    found = xr.load_dataset("window.nc", engine="h5netcdf")
    for name in ("response_class", "zero_crossings", "peak_force"):
        np.testing.assert_array_equal(
            found[name].transpose("velocity_amplitude", "frequency_ratio"), window.values[name]
        )


def test_shares_are_those_of_the_area_that_is_drawn(one_mode, plane, jobs) -> None:
    """Of a part of one cell of the map the map's cells give 0 and 100 %, whatever windows are drawn over it."""
    whole = (*plane.x.span, *plane.y.span)
    kinds = plane.values("response_class")
    alone = drawn_shares(plane, kinds, [], whole, (560, 340))
    assert alone == pytest.approx({int(kind): float(np.mean(kinds == kind)) for kind in np.unique(kinds)})
    window = compute(_window(one_mode, (81, 81)), jobs, Token(), lambda _: None)
    drawn = list(zip([window], visible_strides([window], plane), strict=True))
    rng = np.random.default_rng(4)
    differs = 0
    for _ in range(8):
        (left, right), (low, high) = np.sort(rng.uniform(0.95, 1.35, 2)), np.sort(rng.uniform(0.12, 0.38, 2))
        view = (left, right, low, high)
        found = drawn_shares(plane, kinds, drawn, view, (4000, 4000))
        x, y = rng.uniform(left, right, 8_000), rng.uniform(low, high, 8_000)
        at = [window.cell(a, b) for a, b in zip(x, y, strict=True)]
        seen = np.array([window.values["response_class"][each] for each in at])
        for kind in np.unique(seen):
            assert found[int(kind)] == pytest.approx(float(np.mean(seen == kind)), abs=0.02)
        assert sum(found.values()) == pytest.approx(1.0)
        coarse = drawn_shares(plane, kinds, [], view, (4000, 4000))
        differs += any(abs(coarse.get(kind, 0.0) - share) > 0.1 for kind, share in found.items())
        rough = drawn_shares(plane, kinds, drawn, view, (30, 30))  # fewer pixels than cells
        assert all(rough.get(kind, 0.0) == pytest.approx(share, abs=0.1) for kind, share in found.items())
    assert differs > 0
    assert drawn_shares(plane, None, [], whole, (560, 340)) == {}, "of another system nothing is drawn yet"
