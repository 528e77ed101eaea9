"""Settings made over a picture: the page's state, the file, and ``snapbeam track --settings``."""

import sys
import tomllib
from pathlib import Path

import numpy as np
import pytest
import typer
import xarray as xr
from typer.testing import CliRunner

pytest.importorskip("snapbeam.explorer.server", reason="the explorer or its extra is not installed")
sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
from lab_waveforms import FRAME_RATE, PIXEL, impacts

from snapbeam.lab import open_recording
from snapbeam.lab.batch import read_settings
from snapbeam.lab.cli.track import track
from snapbeam.lab.look_page import Looked, LookPage
from snapbeam.lab.synthetic import SyntheticCamera, SyntheticStage, render_recording
from snapbeam.util.validation import InputError

pytestmark = pytest.mark.filterwarnings("ignore::PendingDeprecationWarning")
app = typer.Typer()
app.command()(track)
SHAPE = (160, 90)


@pytest.fixture(scope="module")
def recorded(tmp_path_factory):
    """The path of a synthetic recording of 76 frames."""
    time, beam, shaker, *_ = impacts(1)
    camera = SyntheticCamera(frame_rate=FRAME_RATE, pixel_size=PIXEL, shape=SHAPE)
    made = render_recording(time, beam, shaker, camera=camera, stage=SyntheticStage(shaker_width=0.8e-3))
    return made.write(tmp_path_factory.mktemp("look") / "test.cihx")


def opened(recording, output, settings=None):
    return LookPage(Looked(recording, output, read_settings(settings, {})), {})


def tracked(recording, output, *arguments):
    result = CliRunner().invoke(app, [str(each) for each in (recording, "-o", output, *arguments)])
    assert result.exit_code == 0, result.output
    with xr.open_dataset(output, engine="h5netcdf") as dataset:
        return dataset.load()


@pytest.fixture
def page(recorded, tmp_path):
    """A page on which everything is set by hand."""
    page = opened(recorded, tmp_path / "look.toml")
    page.box.update(top=3.6, bottom=156.4, left=9.4, right=84.6)  # rows 4 to 156, columns 10 to 84
    page._region_drawn()
    page.line.data = {"x": [12.0, 62.0], "y": [20.0, 20.0]}
    page.length.value = "1.3"
    page.take_scale()
    page.contact.data = {"x": [46.0], "y": [70.0]}
    page.frame.value = 5
    page.take_frame(0)
    page.frame.value = 69
    page.take_frame(1)
    for name, text in {"rest_frames": "4:18", "buckling_level": "0.335", "frame_rate": "5100"}.items():
        page.field[name].value = text
    page.field["marker"].value = False
    yield page
    page.close()


def test_what_is_set_on_the_page_is_tracked_as_by_options(page, recorded, tmp_path):
    page.find()
    assert "shaker by its tip" in page.found.object and page.lines.data["name"]
    page._told(page.write)
    assert "Written" in page.words.object
    assert tomllib.loads((tmp_path / "look.toml").read_text()) == {
        "camera": {"pixel_size": 2.6e-5, "frame_rate": 5100.0, "region": [4, 157, 10, 85], "frames": [5, 70]},
        "tracking": {"rest_frames": [4, 18], "buckling_level": 0.335e-3, "marker": False, "contact_column": 36.0},
    }
    found = tracked(recorded, tmp_path / "a.nc", "--settings", tmp_path / "look.toml", "--rest-displacement", 0)
    wanted = tracked(
        recorded, tmp_path / "b.nc", "--region", "4:157,10:85", "--pixel-size", 26e-6, "--frame-rate", 5100,
        "--frames", "5:70", "--rest-frames", "4:18", "--buckling-level", 0.335e-3, "--no-marker", "--contact-column",
        36, "--rest-displacement", 0,
    )  # fmt: skip
    xr.testing.assert_identical(found.drop_attrs(), wanted.drop_attrs())
    assert found.attrs["pixel_size"] == 26e-6 and found.sizes["time"] == 65 and float(found["time"][0]) == 0.0
    for name in ("region", "frames", "threshold", "side", "contact_column", "location", "diagnostics"):
        assert np.array_equal(found.attrs[name], wanted.attrs[name]), name
    assert found.attrs["location"] == pytest.approx(1 / 2.1)


def test_an_option_goes_before_the_file(page, recorded, tmp_path):
    page.write()
    other = ("--region", "0:160,0:90", "--contact-column", 45, "--frames", "0:60", "--marker")
    found = tracked(recorded, tmp_path / "a.nc", "--settings", tmp_path / "look.toml", *other)
    assert list(found.attrs["region"]) == [0, 160, 0, 90] and found.attrs["contact_column"] == 45
    assert found.sizes["time"] == 60 and found.attrs["shaker_mark"] == "sticker"
    assert found.attrs["pixel_size"] == 26e-6 and found.attrs["buckling_level"] == 0.335e-3  # of the file


def test_a_page_begins_with_a_file_of_settings_and_writes_it_again(page, recorded, tmp_path):
    page.field["marker"].value = True
    page.marks.data = {"top": [99.5], "bottom": [129.5], "left": [10.5], "right": [28.5]}
    page.kept["gamma"] = 1.2  # not on the page
    page.shared.sections["signal"] = {"channel": "velocity"}
    page.write()
    again = opened(recorded, tmp_path / "again.toml", tmp_path / "look.toml")
    assert "file of settings" in again.source_of["pixel_size"].object
    assert (again.box.top, again.box.left, list(again.contact.data["x"])) == (3.5, 9.5, [46.0])
    again.write()
    again.close()
    first, second = ((tmp_path / name).read_text() for name in ("look.toml", "again.toml"))
    assert first == second and "gamma" in first and "velocity" in first
    assert tomllib.loads(first)["tracking"]["fixed_marks"] == [[96, 126, 1, 19]]  # rows and columns of the region


def test_scales_come_from_the_file_and_are_not_written(recorded, tmp_path):
    page = opened(recorded, tmp_path / "look.toml")
    assert (page.field["pixel_size"].value, page.field["frame_rate"].value) == (f"{PIXEL * 1e6:g}", f"{FRAME_RATE:g}")
    assert page.sections()["camera"] == {} and page.sections()["tracking"] == {}
    assert "in the file" in page.source_of["frame_rate"].object
    page.close()


def test_without_scales_edges_are_shown_and_nothing_is_written(recorded, tmp_path):
    with open_recording(recorded) as recording:
        np.save(tmp_path / "frames.npy", np.stack(list(recording)))
    page = opened(tmp_path / "frames.npy", tmp_path / "look.toml")
    assert "not in the file" in page.source_of["pixel_size"].object and page.field["pixel_size"].value == ""
    page.find()
    assert "Found: a beam" in page.found.object
    page._told(page.write)
    assert "the frame rate is not in the file" in page.words.object and not (tmp_path / "look.toml").exists()
    page.close()


def test_a_line_between_marks_is_measured_between_their_centres(tmp_path):
    row, column = np.mgrid[:120, :100]
    frame = 20.0 + sum(150.0 * np.exp(-((row - r) ** 2 + (column - c) ** 2) / 8.0) for r, c in ((20, 18), (98, 71)))
    np.save(tmp_path / "marks.npy", frame[None].astype(np.uint8))
    page = opened(tmp_path / "marks.npy", tmp_path / "look.toml")
    page.line.data = {"x": [19.6, 70.0], "y": [21.2, 96.9]}
    page.length.value, page.centred.value = "10", True
    page.take_scale()
    assert float(page.field["pixel_size"].value) == pytest.approx(1e4 / np.hypot(78, 53), rel=1e-4)
    page.line.data = {"x": [18.0, 18.0], "y": [20.0, 20.0 + 100.0]}
    page.take_tip()
    assert float(page.field["tip_distance"].value) == pytest.approx(1e3 / np.hypot(78, 53), rel=1e-4)
    page.close()


@pytest.mark.parametrize(
    ("name", "text", "options"),
    [
        ("region", "0:500,0:90", ("--region", "0:500,0:90")),
        ("frames", "20:9999", ("--frames", "20:9999")),
        ("frames", "20:20", ("--frames", "20:20")),
        ("pixel_size", "-24", ("--pixel-size", "-24e-6")),
        ("frame_rate", "0", ("--frame-rate", "0")),
        ("location", "1.5", ("--location", "1.5")),
        ("rest_frames", "5:5", ("--rest-frames", "5:5")),
        ("rest_frames", "a:b", ("--rest-frames", "a:b")),
    ],
)
def test_a_value_out_of_range_is_refused_as_the_option_is(recorded, tmp_path, name, text, options):
    page = opened(recorded, tmp_path / "look.toml")
    page.field[name].value = text
    page._told(page.write)
    page.close()
    assert not list(tmp_path.glob("*.toml")) and not list(tmp_path.glob(".look*"))
    refused = CliRunner().invoke(app, [str(recorded), "-o", str(tmp_path / "t.nc"), *options])
    assert refused.exit_code == 2
    said = page.words.object.striptags().split(";")[0]
    assert said and said in " ".join(refused.output.split())


@pytest.mark.parametrize("text", ["0,5", "x", "1e999999999", "nan"])
def test_a_number_that_is_none_is_refused(recorded, tmp_path, text):
    page = opened(recorded, tmp_path / "look.toml")
    page.field["pixel_size"].value = text
    page._told(page.write)
    page.close()
    assert "must be" in page.words.object and not (tmp_path / "look.toml").exists()


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("[camera]\npixels = 1\n", "pixels: unknown"),
        ("[camera]\nregion = 5\n", "region = 5"),
        ("[camera]\nframes = [1, 2, 3]\n", "frames"),
        ("[tracking]\nsides = 'below'\n", "sides"),
        ("[trackings]\n", "unknown section"),
    ],
)
def test_a_file_of_other_settings_is_refused(recorded, tmp_path, text, message):
    (tmp_path / "look.toml").write_text(text)
    result = CliRunner().invoke(app, [str(recorded), "--settings", str(tmp_path / "look.toml")])
    assert result.exit_code == 2 and message in result.output


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("[camera]\nregion = [1, 2]\n", "region"),
        ("[camera]\npixel_size = 'small'\n", "pixel_size"),
        ("[tracking]\nfixed_marks = [3]\n", "fixed_marks"),
        ("[tracking]\ncontact_column = 500\n", "contact_column"),
    ],
)
def test_a_page_does_not_begin_with_settings_that_are_not_valid(recorded, tmp_path, text, message):
    (tmp_path / "bad.toml").write_text(text)
    with pytest.raises(InputError, match=message):
        opened(recorded, tmp_path / "look.toml", tmp_path / "bad.toml")


@pytest.mark.parametrize("side", ["left", "above"])
def test_contact_and_marks_are_those_of_the_picture_for_each_side(recorded, tmp_path, side):
    page = opened(recorded, tmp_path / "look.toml")
    page.field["side"].value, page.field["region"].value = side, "20:150,30:90"
    page.contact.data = {"x": [41.5], "y": [73.25]}
    page.marks.data = {"top": [29.5], "bottom": [49.5], "left": [39.5], "right": [59.5]}
    tracking = page.sections()["tracking"]
    assert tracking["contact_column"] == (53.25 if side == "left" else 11.5)
    assert tracking["fixed_marks"] == [[10, 30, 10, 30]]
    page.write()
    page.close()
    again = opened(recorded, tmp_path / "again.toml", tmp_path / "look.toml")
    assert again.contact.data["y" if side == "left" else "x"] == [73.25 if side == "left" else 41.5]
    assert again.sections()["tracking"] == tracking
    again.close()


def test_where_no_beam_is_found_regions_with_one_are_shown(recorded, tmp_path):
    page = opened(recorded, tmp_path / "look.toml")
    page.field["region"].value = "140:158,0:90"
    page.find()
    assert "alert" in page.found.object and "beam" in page.found.object and page.edges is None
    page.field["region"].value = ""
    page.find()
    assert "Found: a beam" in page.found.object and "alert" not in page.found.object
    page.close()


def test_frames_of_a_recording_begin_at_time_zero_and_keep_their_holes(recorded):
    with open_recording(recorded) as whole, open_recording(recorded, frames=(7, 30)) as part:
        assert len(part) == 23 and part.time[0] == 0.0 and part.time[-1] == pytest.approx(22 / whole.frame_rate)
        np.testing.assert_array_equal(part.frame(0), whole.frame(7))
        np.testing.assert_array_equal(np.concatenate(list(part.batches(5))), np.stack(list(whole))[7:30])
