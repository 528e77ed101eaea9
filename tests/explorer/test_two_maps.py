"""The difference of two maps, and two statistics of one against each other."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr
from scipy import stats

import snapbeam as sb
from snapbeam.explorer.maps import DatasetSource, Plane, apart, compute, planned, visible_strides
from snapbeam.model.parameter_file import Config

pytest.importorskip("panel")

from snapbeam.explorer.jobs import Jobs, Token
from snapbeam.explorer.page import Page
from snapbeam.explorer.shared import Shared

NAMES = ("frequency_ratio", "velocity_amplitude")
SYSTEM = Config().system.replace(**{"model.modes": 1})
RATIO, VELOCITY = np.linspace(0.6, 1.8, 7), np.linspace(0.1, 0.4, 4)


def _map(values, ratio=RATIO, velocity=VELOCITY, **more):
    """A map of given forces; 1 - *more* are variables of the same shape."""
    found = sb.sweep(SYSTEM, {"frequency_ratio": ratio, "velocity_amplitude": velocity}, sb.Integration(cycles=1))
    for name, each in {"peak_force": values, **more}.items():
        found[name] = (found["peak_force"].dims, np.asarray(each).T, {"long_name": name, "units": "1"})
    return found


def _plane(dataset):
    return Plane.of(DatasetSource(dataset, "first.nc"), *NAMES, {})


@pytest.fixture(scope="module")
def forces():
    rng = np.random.default_rng(8)
    return rng.uniform(1.0, 3.0, (2, VELOCITY.size, RATIO.size))


def test_the_difference_is_that_of_the_cells_that_a_point_lies_in(forces):
    first = _plane(_map(forces[0]))
    found, words = apart(first, "peak_force", DatasetSource(_map(forces[1])), [])
    np.testing.assert_array_equal(found, forces[0] - forces[1])
    assert words.startswith("28 of 28 points differ; their scatter is not known")
    # another grid: half as many points, of the middle part
    coarse = RATIO[1:6:2]
    other = DatasetSource(_map(forces[1][:, 1:6:2], ratio=coarse), "second.nc")
    found, words = apart(first, "peak_force", other, [])
    for column, ratio in enumerate(RATIO):
        nearest = int(np.argmin(np.abs(coarse - ratio)))
        away = abs(coarse[nearest] - ratio)
        if away > 0.2 + 1e-9:
            assert np.isnan(found[:, column]).all()
        elif away < 0.1:
            np.testing.assert_array_equal(found[:, column], forces[0][:, column] - forces[1][:, 1 + 2 * nearest])


def test_a_point_that_is_not_computed_has_no_difference(forces):
    dataset = _map(forces[0])
    dataset["status"][2, 1] = int(sb.RunStatus.NOT_RUN)
    for pair in ((dataset, _map(forces[1])), (_map(forces[1]), dataset)):
        found, words = apart(_plane(pair[0]), "peak_force", DatasetSource(pair[1]), [])
        assert np.argwhere(np.isnan(found)).tolist() == [[1, 2]] and "1 points are not in both" in words


def test_the_scatter_of_two_shares_is_that_of_both_intervals():
    """Newcombe's interval of 56/70 - 48/80: from .0524 to .3339 (Stat. Med. 17 (1998) 873, Table II, method 10)."""
    pairs = [((56, 70), (48, 80)), ((28, 35), (26, 40)), ((9, 10), (3, 10)), ((5, 56), (0, 29))]
    differs = [True, False, True, False]
    sides = []
    for side in (0, 1):
        limits = [stats.binomtest(*pair[side]).proportion_ci(method="wilson") for pair in pairs]
        columns = {
            "share": [pair[side][0] / pair[side][1] for pair in pairs], "share_low": [each.low for each in limits],
            "share_high": [each.high for each in limits],
        }  # fmt: skip
        wide = {name: np.tile(each, (4, 1)) for name, each in columns.items()}
        sides.append(_map(wide["share"], ratio=RATIO[:4], **wide))
    found, words = apart(_plane(sides[0]), "share", DatasetSource(sides[1]), [])
    np.testing.assert_allclose(found[0], [0.2, 0.15, 0.6, 5 / 56], atol=1e-12)
    assert f"16 of 16 points differ, {4 * sum(differs)} by more than the scatter of both (intervals of 95 %)" in words


def test_shares_of_replicas_have_the_scatter_of_their_number():
    dims, codes = ("velocity_amplitude", "frequency_ratio", "class_code"), [0, 3]
    sides = []
    for share in (0.9, 0.3):
        base = _map(np.ones((4, 7))).assign_coords(class_code=codes).assign_attrs(replicates=9)
        base["class_fraction"] = (dims, np.broadcast_to([share, 1 - share], (4, 7, 2)).copy())
        sides.append(base)
    name = next(name for name, layer in DatasetSource(sides[0]).layers.items() if layer.variable == "class_fraction")
    found, words = apart(_plane(sides[0]), name, DatasetSource(sides[1]), [])
    np.testing.assert_allclose(found, 0.6)
    assert "28 by more than the scatter of both" in words, "9 of 10 against 3 of 10"


def test_what_cannot_be_compared_is_refused_by_name(forces):
    first = _plane(_map(forces[0]))
    with pytest.raises(sb.InputError, match=r"second.nc: has no peak_force"):
        apart(first, "peak_force", DatasetSource(_map(forces[1]).drop_vars("peak_force"), "second.nc"), [])
    axes = {"frequency_ratio": RATIO, "location": [0.3, 0.4]}
    with pytest.raises(sb.InputError, match=r"second.nc: has no location = 0.476"):
        apart(first, "peak_force", DatasetSource(sb.sweep(SYSTEM, axes, sb.Integration(cycles=1)), "second.nc"), [])
    axes |= {"velocity_amplitude": VELOCITY}
    with pytest.raises(sb.InputError, match=r"second.nc: has no location"):
        apart(first, "peak_force", DatasetSource(sb.sweep(SYSTEM, axes, sb.Integration(cycles=1)), "second.nc"), [])


@pytest.fixture
def page_of(monkeypatch):
    monkeypatch.setattr(Page, "post", lambda self, work: work())
    monkeypatch.setattr(Page, "later", lambda self, work, milliseconds: None)
    held = []

    def make(dataset, other=None):
        shared = Shared(DatasetSource(dataset, "first.nc"), None, other and DatasetSource(other, "second.nc"))
        held.append(shared)
        return Page(shared, {})

    yield make
    for each in held:
        each.close()


@pytest.mark.filterwarnings("ignore::PendingDeprecationWarning")
def test_the_page_shows_the_difference_in_a_scale_about_nought(forces, page_of):
    card = page_of(_map(forces[0]), _map(forces[1])).card
    card.show.value = "peak_force"
    difference = forces[0] - forces[1]
    most = np.abs(difference).max()
    assert (card.view.mapper.low, card.view.mapper.high) == (-most, most)
    assert card.view.plot.title.text == "peak_force: first.nc minus second.nc"
    colors = card.view.base.data["image"][0].view(np.uint8).reshape(4, 7, 4).astype(int)
    red, blue = colors[..., 0], colors[..., 2]
    large = np.abs(difference) > 0.2 * most
    assert ((red > blue) == (difference > 0))[large].all()
    assert "28 of 28 points differ" in card.key.object
    card._hovered(float(RATIO[2]), float(VELOCITY[1]))
    assert f"difference {difference[1, 2]:.5g}" in card.hover.object
    card.layers.value = ["windows"]
    card._hovered(float(RATIO[2]), float(VELOCITY[1]))
    assert card.view.mapper.low == pytest.approx(forces[0].min()) and "difference" not in card.hover.object


@pytest.mark.filterwarnings("ignore::PendingDeprecationWarning")
def test_the_computed_map_of_a_changed_system_is_compared_with_the_file(page_of):
    axes = {"frequency_ratio": RATIO, "velocity_amplitude": VELOCITY}
    how = sb.Integration(cycles=4)
    page = page_of(sb.sweep(SYSTEM, axes, how))
    card = page.card
    card.layers.value = ["windows", "difference"]
    assert "needs two maps" in card.key.object
    page._adopt({"beam.thickness": 4.4e-4})
    card.show.value = "zero_crossings"
    changed = SYSTEM.replace(**{"beam.thickness": 4.4e-4})
    key = (card.plane_key, 0)
    bounds = (*card.plane.x.span, *card.plane.y.span)
    window = planned(changed, how, card.plane.names, bounds, (False, False), (81, 81), key=key)
    card.own.add(key)
    card.shared.window(window)
    jobs = Jobs()
    compute(window, jobs, Token(), lambda _: None)
    jobs.close()
    card.redraw()
    assert "computed minus first.nc" in card.view.plot.title.text and not card.view.tiles.data["image"]
    for row, column in ((0, 0), (2, 3), (3, 6)):
        at = window.computed_at(float(RATIO[column]), float(VELOCITY[row]), visible_strides([window], None)[0])
        own = {"frequency_ratio": float(window.x[at[1]]), "velocity_amplitude": float(window.y[at[0]])}
        expected = sb.simulate(changed.replace(**{f"drive.{name}": value for name, value in own.items()}), how).summary
        held = sb.simulate(
            SYSTEM.replace(**{"drive.frequency_ratio": RATIO[column], "drive.velocity_amplitude": VELOCITY[row]}), how
        ).summary
        assert card._apart[row, column] == expected.zero_crossings - held.zero_crossings


def test_another_map_is_given_beside_the_first(tmp_path, forces):
    from snapbeam.explorer.server import _shared

    _map(forces[0]).to_netcdf(tmp_path / "a.nc", engine="h5netcdf")
    xr.Dataset({"point": ("point", np.arange(3.0))}).to_netcdf(tmp_path / "b.nc", engine="h5netcdf")
    shared = _shared(tmp_path / "a.nc", None, None, tmp_path / "a.nc")
    shared.close()
    assert shared.other.name == "a.nc"
    with pytest.raises(sb.InputError):
        _shared(tmp_path / "a.nc", None, None, tmp_path / "b.nc")


def test_points_selected_in_the_scatter_are_marked_in_the_map(tab, serve, folder, small_map):
    small_map.assign(peak_force=0.5 * small_map["peak_force"]).to_netcdf(folder / "half.nc", engine="h5netcdf")
    page = tab(serve("map.nc", "--against", "half.nc").url, viewport={"width": 1280, "height": 800})
    page.wait(lambda: "points differ" in page.text("key-box"), "the difference")
    page.page.get_by_role("button", name="difference").click()
    page.wait(lambda: "intrawell" in page.text("key-box"), "the map")
    page.page.get_by_role("button", name="scatter").click()
    page.wait(lambda: "draw a box" in page.text("scatter-words"), "the scatter")
    page.page.set_viewport_size({"width": 1280, "height": 800})
    fits = "() => document.scrollingElement.scrollHeight <= window.innerHeight"
    page.wait(lambda: page.js(fits), "map and scatter on 1280 by 800")
    page.page.wait_for_timeout(1000)  # the figures find their places
    force = small_map["peak_force"].transpose("velocity_amplitude", "frequency_ratio").values.ravel()
    counts = small_map["zero_crossings"].transpose("velocity_amplitude", "frequency_ratio").values.ravel()
    np.testing.assert_array_equal(page.data("scatter", "a"), counts)
    low, high = float(np.nanmedian(force)), float(np.nanmax(force)) * 1.01
    left, right = 2.5, float(counts.max()) + 0.5
    page.page.mouse.move(*page.place(left, low, "scatter-plot"))
    page.page.mouse.down()
    page.page.mouse.move(*page.place(0.5 * (left + right), 0.5 * (low + high), "scatter-plot"), steps=4)
    page.page.mouse.move(*page.place(right, high, "scatter-plot"), steps=4)
    page.page.mouse.up()
    inside = np.flatnonzero((force > low) & (force < high) & (counts > left) & (counts < right))
    page.wait(lambda: f"{inside.size} of {force.size} points are selected" in page.text("scatter-words"), "a selection")
    marked = page.js("""() => { const d = Bokeh.documents[0], s = d.get_model_by_name('scatter');
      const r = d.get_model_by_name('map').renderers.filter((each) => each.data_source === s);
      return [r.length, Array.from(s.selected.indices)]; }""")
    assert marked[0] == 1 and sorted(marked[1]) == inside.tolist()
