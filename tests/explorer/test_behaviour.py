"""What else happens to a page: a changed system, two tabs, files that go, checkpoints that grow, and bad guests."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from urllib.parse import quote

import numpy as np
import pytest
import xarray as xr

import snapbeam as sb
from snapbeam.explorer.maps import brief, opened


def _turn(page, title):
    page.page.locator(f'.bk-tab:has-text("{title}")').first.click()


def test_a_changed_system_says_what_is_old(tab, served, small_map, system):
    page = tab(served.url)
    x, y = float(small_map["frequency_ratio"][9]), float(small_map["velocity_amplitude"][12])
    page.click(x, y)
    page.wait(lambda: "bitwise identical" in page.notes(), "the run")
    page.page.get_by_text("compute the view automatically").click()
    page.wait(lambda: "shares of the map" in page.text("key-box"), "the shares of the classes")
    _turn(page, "System")
    page.page.get_by_label("thickness (m)").fill("-1")
    page.page.get_by_role("button", name="Use this system").click()
    page.wait(lambda: "thickness" in page.text("system-words"), "a refusal in words")
    page.page.get_by_label("thickness (m)").fill("0.0005")
    page.page.get_by_role("button", name="Use this system").click()
    page.wait(lambda: "map is old" in page.text("old-words"), "what is old")
    assert "%" not in page.text("key-box"), "nothing of the changed system is drawn yet"
    assert "Beam: thickness 0.0005 m" in page.text("old-words")
    again = {"beam.thickness": 0.0005, "drive.frequency_ratio": x, "drive.velocity_amplitude": y}
    found = sb.simulate(system.replace(**again), sb.Integration(cycles=30)).summary
    page.wait(lambda: f"{found.zero_crossings} crossings, {found.impacts} impacts" in page.head(), "the same point")
    _turn(page, "Map")
    page.click(x, float(small_map["velocity_amplitude"][11]))
    changed = system.replace(**{
        "beam.thickness": 0.0005, "drive.frequency_ratio": x,
        "drive.velocity_amplitude": float(small_map["velocity_amplitude"][11]),
    })  # fmt: skip
    outcome = sb.simulate(changed, sb.Integration(cycles=30)).summary
    page.wait(
        lambda: f"{outcome.zero_crossings} crossings, {outcome.impacts} impacts" in page.head(), "the changed run"
    )
    assert outcome.response_class.label in page.head()
    assert "set=beam.thickness" in page.page.url


def test_a_link_shows_the_same_again(tab, served, small_map):
    page = tab(served.url)
    x, y = float(small_map["frequency_ratio"][4]), float(small_map["velocity_amplitude"][13])
    page.click(x, y)
    page.wait(lambda: "bitwise identical" in page.notes(), "the run")
    page.wait(lambda: f"drive.frequency_ratio:{x!r}" in page.page.url, "the address")
    head = page.head()
    other = tab(page.page.url)
    other.wait(lambda: "bitwise identical" in other.notes(), "the same run")
    assert other.head() == head


@pytest.mark.slow
def test_two_tabs_do_not_disturb_each_other(tab, served, small_map):
    first, second = tab(served.url), tab(served.url)
    ratio, velocity = small_map["frequency_ratio"].values, small_map["velocity_amplitude"].values
    first.click(float(ratio[3]), float(velocity[3]))
    second.click(float(ratio[18]), float(velocity[14]))
    for page, at in ((first, (3, 3)), (second, (18, 14))):
        words = f"frequency ratio {ratio[at[0]]:.6g}, velocity amplitude {velocity[at[1]]:.6g}"
        page.wait(lambda page=page, words=words: words in page.head() and "bitwise identical" in page.notes(), words)
    second.close()
    first.click(float(ratio[4]), float(velocity[3]))
    first.wait(
        lambda: f"{ratio[4]:.6g}" in first.head() and "bitwise identical" in first.notes(),
        "a run after a tab was closed",
    )


def test_what_one_tab_computes_is_not_laid_over_the_map_of_another(tab, served, small_map):
    first, second = tab(served.url), tab(served.url)
    first.js("""() => { const p = Bokeh.documents[0].get_model_by_name('map');
      p.x_range.setv({start: 0.7, end: 1.9}); p.y_range.setv({start: 0.05, end: 0.45}); }""")
    first.page.get_by_role("button", name="Compute view").click()
    first.wait(lambda: len(first.data("map-windows", "image")) == 1, "a window")
    x, y = float(small_map["frequency_ratio"][12]), float(small_map["velocity_amplitude"][9])
    second.click(x, y)
    second.wait(lambda: "bitwise identical" in second.notes(), "the map's own point")
    assert f"frequency ratio {x:.6g}, velocity amplitude {y:.6g}" in second.head()
    assert second.data("map-windows", "image") == []


def test_a_list_of_points_is_clicked_point_by_point(tab, serve, system, tmp_path):
    rng = np.random.default_rng(5)
    table = xr.Dataset({
        "drive.frequency_ratio": ("point", np.linspace(0.6, 2.0, 12)),
        "drive.velocity_amplitude": ("point", rng.uniform(0.05, 0.4, 12)),
        "beam.thickness": ("point", rng.choice([3.9e-4, 4.1e-4], 12)),
    })  # fmt: skip
    found = sb.sweep(system, table, sb.Integration(cycles=10))
    found.to_netcdf(tmp_path / "list.nc", engine="h5netcdf")
    page = tab(serve("list.nc", where=tmp_path).url)
    ratio, velocity = found["frequency_ratio"].values, found["velocity_amplitude"].values
    assert len(page.data("map-list", "x")) == 12
    page.click(float(ratio[4]), float(velocity[4]))
    page.wait(lambda: "bitwise identical" in page.notes(), "the run")
    assert f"beam thickness {float(found['beam_thickness'][4]):.6g}" in page.head()
    assert sb.ResponseClass(int(found["response_class"][4])).label in page.head()
    page.page.keyboard.press("ArrowRight")
    page.wait(lambda: "bitwise identical" in page.notes() and f"{ratio[4]:.6g}" not in page.head(), "another point")


def test_a_file_that_is_too_large_is_refused_in_words(tab, served):
    page = tab(served.url)
    _turn(page, "Export")
    page.wait(lambda: page.page.locator("input[type=file]").count() > 0, "where a file can be given")
    large = {"name": "large.csv", "mimeType": "text/csv", "buffer": b"1,2,3\n" * (3 * 2**19)}
    page.page.locator("input[type=file]").first.set_input_files(large)
    page.wait(lambda: "9.0 MiB; a page takes at most 2 MiB" in page.text("take-words"), "words")
    assert page.page.locator("#gone").count() == 0, "the page lives on"


@pytest.mark.slow
def test_two_points_side_by_side(tab, served, small_map):
    page = tab(served.url)
    ratio, velocity = small_map["frequency_ratio"].values, small_map["velocity_amplitude"].values
    page.click(float(ratio[3]), float(velocity[3]))
    page.wait(lambda: "bitwise identical" in page.notes(), "A")
    page.page.get_by_role("button", name="Two points").click()
    page.wait(
        lambda: page.text("run-head", 1) != "" or page.js("() => !!Bokeh.documents[0].get_model_by_name('waveform-B')"),
        "B",
    )
    page.click(float(ratio[18]), float(velocity[14]))
    page.wait(lambda: "crossings" in page.head(1), "the run of B")
    assert f"{ratio[3]:.6g}" in page.head(0) and f"{ratio[18]:.6g}" in page.head(1)
    assert page.data("map-mark", "text") == ["A", "B"]
    # two points that six digits do not tell apart: a letter on either side, both waveforms in one axis
    near = float(velocity[3]) * (1.0 + 1e-10)
    page.page.get_by_label("frequency ratio").fill(repr(float(ratio[3])))
    page.page.get_by_label("velocity amplitude").fill(repr(near))
    page.page.get_by_label("velocity amplitude").press("Enter")
    page.wait(lambda: brief(near, float(velocity[3])) in page.head(1), "B beside A")
    page.wait(lambda: brief(float(velocity[3]), near) in page.head(0), "A in as many digits")
    assert page.data("map-mark", "align") == ["right", "left"]
    page.wait(lambda: brief(near, float(velocity[3])) in page.text("hover"), "the digits of what is selected")
    page.wait(lambda: 0.0 < min(page.data("apart", "y"), default=0.0) < 1e-8, "a small separation")
    assert len(page.data("waveform-second", "x")) > 0


@pytest.mark.slow
def test_the_server_ends_and_the_page_says_so(tab, serve):
    server = serve("map.nc")
    page = tab(server.url)
    server.stop()
    page.wait(lambda: page.page.locator("#gone").count() == 1, "words")
    assert "has stopped" in page.page.locator("#gone").inner_text()
    page.errors.clear()  # the browser itself says that it cannot connect


@pytest.mark.skipif(os.name != "posix", reason="Ctrl+C is a signal of POSIX")
def test_ctrl_c_ends_the_server_in_words(serve):
    server = serve("map.nc")
    server.process.send_signal(signal.SIGINT)
    assert server.process.wait(60) == 130
    server.listener.join()
    assert server.text.splitlines()[-1] == "stopped" and "Traceback" not in server.text


@pytest.mark.slow
def test_a_file_that_goes_is_told_and_runs_go_on(tab, serve, small_map, tmp_path):
    path = tmp_path / "gone.nc"
    small_map.to_netcdf(path, engine="h5netcdf")
    page = tab(serve("gone.nc", where=tmp_path).url)
    path.unlink()
    page.click(float(small_map["frequency_ratio"][4]), float(small_map["velocity_amplitude"][4]))
    page.wait(lambda: "crossings" in page.head(), "the run")


def test_a_checkpoint_fills_in_as_it_grows(tab, serve, system, tmp_path):
    pytest.importorskip("zarr")
    few = system.replace(**{"model.modes": 1})
    axes = {"frequency_ratio": np.linspace(0.5, 2.0, 20), "velocity_amplitude": np.linspace(0.05, 0.4, 10)}
    path = tmp_path / "growing.map"

    class Enough(Exception):
        pass

    def stop(done, total):
        if done >= 50:
            raise Enough

    keeping = sb.CheckpointOptions(path, points_per_task=16)
    with pytest.raises(Enough):
        sb.sweep(few, axes, sb.Integration(cycles=5), checkpoint=keeping, progress=stop)
    page = tab(serve("growing.map", where=tmp_path).url)
    clear = "() => { const m = Bokeh.documents[0].get_model_by_name('map-base'); return Array.from(m.data.image[0]); }"
    before = page.js(clear)
    unknown = 0xFF858585
    assert before.count(unknown) > 100
    sb.sweep(few, axes, sb.Integration(cycles=5), checkpoint=sb.CheckpointOptions(path, points_per_task=16))
    page.wait(lambda: "200 of 200 points" in page.state(), "all of it")
    assert page.js(clear).count(unknown) == 0


def test_a_checkpoint_is_read_again_only_when_it_has_grown(system, tmp_path):
    pytest.importorskip("zarr")
    few = system.replace(**{"model.modes": 1})
    axes = {"frequency_ratio": np.linspace(0.5, 2.0, 8), "velocity_amplitude": np.linspace(0.05, 0.4, 8)}
    path = tmp_path / "growing.map"

    def stop(done, total):
        if done >= 40:
            raise RuntimeError("enough")

    options = sb.CheckpointOptions(path, points_per_task=16)
    with pytest.raises(RuntimeError, match="enough"):
        sb.sweep(few, axes, sb.Integration(cycles=5), checkpoint=options, progress=stop)
    source = opened(path)
    assert not source.refresh() and 0 < source.attrs["points_done"] < 64
    sb.sweep(few, axes, sb.Integration(cycles=5), checkpoint=options)
    assert source.refresh() and source.attrs["points_done"] == 64
    assert not source.refresh()


@pytest.mark.slow
def test_a_map_of_a_million_points(tab, serve, system, tmp_path):
    x, y = np.linspace(0.4, 2.3, 1000), np.linspace(0.03, 0.5, 1000)
    seed = sb.sweep(system, {"frequency_ratio": x[:2], "velocity_amplitude": y[:2]}, sb.Integration(cycles=30))
    rng = np.random.default_rng(3)
    labels = {
        name: {"units": "1", "long_name": name, "parameter": f"drive.{name}"}
        for name in ("frequency_ratio", "velocity_amplitude")
    }
    dims = ("frequency_ratio", "velocity_amplitude")
    force = (dims, rng.random((1000, 1000)), {"units": "N"})
    large = xr.Dataset(
        {"response_class": (dims, rng.integers(0, 4, (1000, 1000)).astype(np.int8)), "peak_force": force},
        {name: (name, values, labels[name]) for name, values in zip(dims, (x, y), strict=True)},
        seed.attrs,
    )
    large.to_netcdf(tmp_path / "large.nc", engine="h5netcdf")
    page = tab(serve("large.nc", where=tmp_path).url)
    page.wait(lambda: len(page.data("map-base", "image")) == 1, "the map")
    page.click(float(x[500]), float(y[500]))
    page.wait(lambda: "crossings" in page.head() and ("map" in page.notes()), "a run of it")


# ---------------------------------------------------------------------- taking away


_COMMAND = """
import shlex, sys
from snapbeam.cli import app
app(shlex.split(sys.argv[1])[1:])
"""


def _saved(page, button, tmp_path):
    with page.page.expect_download() as waiting:
        page.page.get_by_role("button", name=button, exact=True).click()
    path = tmp_path / waiting.value.suggested_filename
    waiting.value.save_as(path)
    return path


def test_what_is_taken_away_is_what_is_shown(tab, served, small_map, folder, tmp_path):
    page = tab(served.url)
    x, y = float(small_map["frequency_ratio"][4]), float(small_map["velocity_amplitude"][13])
    page.click(x, y)
    page.wait(lambda: "bitwise identical" in page.notes(), "the run")
    _turn(page, "Export")
    page.wait(lambda: "snapbeam simulate" in page.text("take-text"), "the command")
    assert _saved(page, "Map", tmp_path).read_bytes().startswith(b"\x89PNG")
    assert _saved(page, "Run", tmp_path).read_bytes().startswith(b"\x89PNG")
    run = sb.load(_saved(page, "Run as NetCDF", tmp_path))
    for name in sb.STATISTICS:
        held, found = small_map[name].values[4, 13].item(), run.summary[name]
        assert held == found or (held != held and found != found), name
    with xr.open_dataset(_saved(page, "Map as NetCDF", tmp_path)) as whole:
        np.testing.assert_array_equal(whole["response_class"], small_map["response_class"])
    command = page.page.locator("pre.command").inner_text()
    lines = page.page.locator("pre.python").inner_text()
    # the command and the lines, as a person would run them
    made = subprocess.run(
        [sys.executable, "-c", _COMMAND, command],
        cwd=folder, capture_output=True, text=True, env=dict(os.environ), check=False,
    )  # fmt: skip
    assert made.returncode == 0, made.stderr
    again = sb.load(folder / "run.nc")
    np.testing.assert_array_equal(again.dataset["displacement_at_striker"], run.dataset["displacement_at_striker"])
    subprocess.run([sys.executable, "-c", lines], cwd=tmp_path, check=True, env=dict(os.environ))
    np.testing.assert_array_equal(
        sb.load(tmp_path / "run.nc").dataset["displacement_at_striker"], run.dataset["displacement_at_striker"]
    )


@pytest.mark.slow
def test_the_beam_moving_is_exported(tab, served, small_map, tmp_path):
    pytest.importorskip("imageio_ffmpeg")
    page = tab(served.url)
    page.click(float(small_map["frequency_ratio"][4]), float(small_map["velocity_amplitude"][13]))
    page.wait(lambda: "bitwise identical" in page.notes(), "the run")
    _turn(page, "Export")
    page.page.get_by_label("length of the animation (s)").fill("1")
    page.page.get_by_label("slow motion at the hardest impact (s)").fill("1")
    assert _saved(page, "GIF", tmp_path).read_bytes().startswith(b"GIF89a")
    assert _saved(page, "MP4", tmp_path).read_bytes()[4:8] == b"ftyp"


def test_an_animation_reports_its_progress_is_cancelled_and_keeps_nobody_waiting(tab, served, small_map, tmp_path):
    pytest.importorskip("imageio_ffmpeg")
    page = tab(served.url)
    page.click(float(small_map["frequency_ratio"][4]), float(small_map["velocity_amplitude"][13]))
    page.wait(lambda: "bitwise identical" in page.notes(), "the run")
    _turn(page, "Export")
    page.page.get_by_label("length of the animation (s)").fill("60")
    page.page.get_by_role("button", name="GIF", exact=True).click()
    page.wait(lambda: " %" in page.text("take-words"), "the progress")
    assert _saved(page, "Map", tmp_path).read_bytes().startswith(b"\x89PNG"), "while the animation is made"
    page.page.get_by_role("button", name="Cancel the animation").click()
    page.wait(lambda: "was cancelled" in page.text("take-words"), "the end of it")
    page.page.get_by_role("button", name="Copy the link").click()
    page.wait(lambda: page.page.get_by_role("button", name="opied").count() == 1, "a confirmation")


# ---------------------------------------------------------------------- bad guests


@pytest.mark.parametrize(
    "state",
    [
        "x=__class__&y=../../etc/passwd&show=<script>alert(1)</script>",
        "at=drive.frequency_ratio:nan,drive.velocity_amplitude:1e999",
        "set=model.modes:100000000&at=beam.thickness:-1",
        "view=1,0,0,0&theme=%00",
        "at=" + "drive.frequency_ratio:1," * 400,
        "set=" + quote("__import__('os').system('true'):1"),
    ],
)
def test_a_hostile_address_counts_for_nothing_and_is_told(tab, served, state):
    page = tab(f"{served.url}?{state}")
    page.wait(lambda: "address" in page.state(), "words")
    assert page.page.locator("script:has-text('alert(1)')").count() == 0
    page.click(1.2, 0.3)
    page.wait(lambda: "bitwise identical" in page.notes(), "a run none the less")
