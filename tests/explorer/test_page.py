"""The page in a real browser: its map, its runs, its keys."""

from __future__ import annotations

import numpy as np
import pytest

from snapbeam import ResponseClass


def _label(small_map, row, column):
    return ResponseClass(int(small_map["response_class"].values[column, row])).label


def test_twenty_points_are_the_maps_bit_for_bit(tab, served, small_map):
    page = tab(served.url)
    ratio, velocity = small_map["frequency_ratio"].values, small_map["velocity_amplitude"].values
    rng = np.random.default_rng(7)
    chosen = {(int(rng.integers(ratio.size)), int(rng.integers(velocity.size))) for _ in range(40)}
    seen = set()
    for column, row in sorted(chosen)[:20]:
        x, y = float(ratio[column]), float(velocity[row])
        page.click(x, y)
        words = f"frequency ratio {x:.6g}, velocity amplitude {y:.6g}"
        page.wait(lambda words=words: words in page.head() and "crossing" in page.head(), words)
        page.wait(lambda: "bitwise identical" in page.notes(), "the comparison")
        assert _label(small_map, row, column) in page.head()
        seen.add(_label(small_map, row, column))
        crossings = int(small_map["zero_crossings"].values[column, row])
        assert f"{crossings} crossing{'' if crossings == 1 else 's'}," in page.head()
        waveform = np.array(page.data("waveform", "y"))
        assert waveform.max() == pytest.approx(
            float(small_map["max_midspan_displacement"].values[column, row]), abs=0.01
        )
    assert len(seen) >= 3, "the map of the test should hold several classes"


def test_keys_go_from_point_to_point(tab, served, small_map):
    page = tab(served.url)
    ratio, velocity = small_map["frequency_ratio"].values, small_map["velocity_amplitude"].values
    page.click(float(ratio[5]), float(velocity[5]))
    page.wait(lambda: "bitwise identical" in page.notes(), "the run")
    for key, column, row in (("ArrowRight", 6, 5), ("ArrowUp", 6, 6), ("ArrowLeft", 5, 6), ("ArrowDown", 5, 5)):
        page.page.keyboard.press(key)
        words = f"frequency ratio {ratio[column]:.6g}, velocity amplitude {velocity[row]:.6g}"
        page.wait(lambda words=words: words in page.head() and "crossing" in page.head(), f"{key} to {words}")
        assert _label(small_map, row, column) in page.head()


def test_numbers_are_typed_in_full(tab, served, system):
    import snapbeam as sb

    page = tab(served.url)
    page.page.get_by_label("frequency ratio").fill("1.2345678901234567")
    page.page.get_by_label("velocity amplitude").fill("0.31415926535897931")
    page.page.get_by_role("button", name="Run").click()
    page.wait(lambda: "1.23457" in page.head() and "crossing" in page.head(), "the run")
    exact = system.replace(
        **{"drive.frequency_ratio": 1.2345678901234567, "drive.velocity_amplitude": 0.31415926535897931}
    )
    run = sb.simulate(exact, sb.Integration(cycles=30))
    assert run.summary.response_class.label in page.head()
    assert f"{run.summary.zero_crossings} crossings, {run.summary.impacts} impacts" in page.head()
    greyed = "() => Bokeh.documents[0]._all_models.values().some((m) => (m.css_classes || []).includes('stale'))"
    assert not page.js(greyed)
    page.page.get_by_label("frequency ratio").fill("one")
    page.page.get_by_label("frequency ratio").press("Enter")
    page.wait(lambda: "must be a number" in page.text("field-error"), "a refusal beside the field")
    page.wait(lambda: "no run" in page.head() and page.js(greyed), "the old run greyed")
    page.page.get_by_label("frequency ratio").fill("1.5")
    page.page.get_by_label("frequency ratio").press("Enter")
    page.wait(lambda: "ratio 1.5," in page.head() and "crossings" in page.head(), "the run, without a click")
    assert not page.js(greyed) and page.text("field-error") == ""


def test_the_pointer_is_told_what_it_is_over(tab, served, small_map):
    page = tab(served.url)
    x, y = float(small_map["frequency_ratio"][10]), float(small_map["velocity_amplitude"][12])
    where = page.place(x, y)
    page.page.mouse.move(where[0] - 40, where[1])
    page.page.wait_for_timeout(100)
    page.page.mouse.move(*where)
    page.wait(lambda: f"{x:.6g}" in page.text("hover"), "the hover")
    assert _label(small_map, 12, 10) in page.text("hover")
    assert f"zero crossings {int(small_map['zero_crossings'].values[10, 12])}" in page.text("hover")


def test_back_and_forward_are_undo_and_redo(tab, served, small_map):
    page = tab(served.url)
    ratio, velocity = small_map["frequency_ratio"].values, small_map["velocity_amplitude"].values
    page.wait(lambda: "show=" in page.page.url, "the state to which Back returns")
    opened = page.head()
    for column in (5, 15):
        page.click(float(ratio[column]), float(velocity[5]))
        page.wait(lambda column=column: f"{ratio[column]:.6g}" in page.head() and "crossings" in page.head(), "a run")
    page.page.locator('.bk-tab:has-text("Phase")').first.click()
    page.wait(lambda: "tab=Phase" in page.page.url, "the view in the address")
    zoomed = "() => Bokeh.documents[0].get_model_by_name('map').x_range.start"
    whole = page.js(zoomed)
    page.page.mouse.move(*page.place(1.2, 0.2))
    page.page.mouse.wheel(0, -240)
    page.wait(lambda: "view=" in page.page.url, "the part of the map in the address")
    page.page.go_back()
    page.wait(lambda: page.js(zoomed) == whole and "view=" not in page.page.url, "the whole map")
    page.page.go_back()
    page.wait(lambda: "tab=" not in page.page.url and len(page.data("waveform", "x")) > 0, "the waveform")
    page.page.go_back()
    page.wait(lambda: f"{ratio[5]:.6g}" in page.head() and "crossings" in page.head(), "the first run")
    page.page.go_back()
    page.wait(lambda: page.head() == opened, "the run that the page opened with")
    for _ in range(2):
        page.page.go_forward()
    page.wait(lambda: f"{ratio[15]:.6g}" in page.head() and "crossings" in page.head(), "the second run again")
    assert page.page.get_by_label("frequency ratio").input_value() == f"{ratio[15]:.6g}"


def test_links_survive_a_restart_of_the_server(serve, tmp_path):
    """The token is kept for the user, the port is fixed; a second server takes the next one."""
    servers = [serve("map.nc", "--port", "0", state=tmp_path) for _ in range(2)]
    assert servers[0].token == servers[1].token
    assert servers[0].url.rpartition(":")[2].partition("/")[2] == servers[1].url.rpartition(":")[2].partition("/")[2]
    kept = tmp_path / "snapbeam" / "explorer-token"
    assert kept.stat().st_mode & 0o077 == 0


def test_the_port_is_fixed_and_the_next_one_is_taken_if_it_is_in_use(monkeypatch):
    import socket

    from snapbeam.explorer import server

    with socket.socket() as busy:
        busy.bind(("127.0.0.1", 0))
        busy.listen()
        monkeypatch.setattr(server, "_PORT", busy.getsockname()[1])
        found = server._next_port("127.0.0.1")
        assert busy.getsockname()[1] < found < busy.getsockname()[1] + server._PORTS
    assert server._next_port("127.0.0.1") == server._PORT
