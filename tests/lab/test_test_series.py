"""A test series: a folder of tests to one table, a page of pictures and a comparison with a map, taken up where it stopped."""

import csv
import os

import pytest
import series_bench as bench
import xarray as xr
from typer.testing import CliRunner

from snapbeam import InputError
from snapbeam.cli.app import app
from snapbeam.lab.batch import COLUMNS, find_tests, load_settings, run_test_series

KNOWN = {
    "tracking": {"buckling_level": 0.335e-3, "location": 1.0 / 2.1, "beam_thickness": 0.4e-3},
    "signal": {"units": "m/s"},
    "test_series": {"cycles": 20},
}
OPTIONS = (
    "--buckling-level", "0.335e-3", "--location", "1/2.1", "--beam-thickness", "0.4e-3", "--units", "m/s",
    "--cycles", "20",
)  # fmt: skip
REASONS = {"test03": "is truncated", "test07": "begins in motion", "test10": "must be the same motion"}


def command(*arguments):
    return CliRunner().invoke(app, ["process-tests", *(str(one) for one in arguments)])


def rows(output):
    """The table by test."""
    with open(output / "tests.csv", encoding="utf-8", newline="") as file:
        reader = csv.DictReader(file)
        assert tuple(reader.fieldnames) == COLUMNS
        return {row["test"]: row for row in reader}


def dates(output):
    return {path.name: path.stat().st_mtime_ns for path in (output / "tests").glob("*.json")}


def is_measured(row, truth):
    """A good row holds what is true of its test, and no doubt; a gentle start does not exclude a filter."""
    for name, true in (("frequency_hz", truth["frequency"]), ("velocity_m_s", truth["speed"])):
        error = float(row[name.replace("_hz", "_se_hz").replace("_m_s", "_se_m_s")])
        assert abs(float(row[name]) - true) < 5.0 * error, (row["test"], name)
    assert row["response_class"] == truth["response_class"]
    assert float(row["location"]) == pytest.approx(1.0 / 2.1)
    assert (row["status"], row["comment"]) == ("measured", "")
    assert row["diagnostics"] in ("", "vibrometer.high_pass_possible")


@pytest.mark.parametrize("name", ["tests.png", "measurements.png", "tests.html"])
def test_a_foreign_figure_is_kept_and_nothing_is_measured(tmp_path, name):
    output = tmp_path / "test_series"
    output.mkdir()
    (output / name).write_text("not a figure of snapbeam")
    done = command(tmp_path, *OPTIONS)
    assert done.exit_code == 2 and name in done.output
    assert [path.name for path in output.iterdir()] == [name]


@pytest.mark.slow
def test_a_good_test_and_a_spoiled_one(tmp_path):
    folder = tmp_path / "tests"
    folder.mkdir()
    truth = bench.write_test(folder, "test05", 1.3, 0.06, seed=5)
    bench.write_test(folder, "test03", 0.9, 0.3, seed=3, spoiled="cut short")
    options = ("--operator", "A. <Smith>", *OPTIONS)
    done = command(folder, *options)
    assert done.exit_code == 0, done.output
    assert "2 tests, 1 spoiled" in done.output
    table = rows(folder / "test_series")
    is_measured(table["test05"], truth)
    assert table["test03"]["status"] == "spoiled"
    assert REASONS["test03"] in table["test03"]["comment"]
    assert (folder / "test_series" / "tests.png").stat().st_size > 10_000
    page = (folder / "test_series" / "tests.html").read_text(encoding="utf-8")
    assert "<td>test05</td>" in page and "is truncated" in page and 'src="tests.png"' in page
    assert "2 tests: 1 spoiled, 1 measured; operator: A. &lt;Smith&gt;; snapbeam" in page
    run = xr.open_dataset(folder / "test_series" / "tests" / "test05.nc", engine="h5netcdf")
    assert run.attrs["operator"] == "A. <Smith>" and run.attrs["recording_format"] == "Photron mraw"
    assert run.attrs["recording_date"]

    # nothing has changed: nothing is measured again
    before = dates(folder / "test_series")
    assert command(folder, *options).exit_code == 0
    assert dates(folder / "test_series") == before
    # another setting changes every test
    again = command(folder, *OPTIONS[:-1], "21")
    assert again.exit_code == 0, again.output
    assert all(date > before[name] for name, date in dates(folder / "test_series").items())


@pytest.mark.slow
def test_twelve_tests_three_of_them_spoiled_interrupted_and_resumed(tmp_path):
    folder, output = tmp_path / "tests", tmp_path / "results"
    folder.mkdir()
    truth = bench.write_test_series(folder)
    bench.coarse_map().to_netcdf(tmp_path / "map.nc", engine="h5netcdf")

    def interrupt(done, total, result):
        assert total == len(truth)
        if done == 5:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        run_test_series(folder, load_settings(None, KNOWN), output, progress=interrupt)
    assert len(rows(output)) == 5
    before = dates(output)
    done = command(folder, *OPTIONS, "-o", output, "--map", tmp_path / "map.nc")
    assert done.exit_code == 0, done.output
    after = dates(output)
    assert len(after) == len(truth)
    assert all(after[name] == date for name, date in before.items())
    table = rows(output)
    assert {name for name, row in table.items() if row["status"] == "spoiled"} == set(bench.SPOILED)
    for name, row in table.items():
        if name in REASONS:
            assert REASONS[name] in row["comment"]
            assert row["response_class"] == "unknown"
            assert f"{name}: spoiled: " in done.output
        else:
            is_measured(row, truth[name])
    assert "of 9 agree with the map" in done.output
    for name in ("tests.png", "measurements.png"):
        assert (output / name).stat().st_size > 10_000


def touch(folder, *names):
    for name in names:
        (folder / name).touch()


def test_recordings_and_signals_are_paired_by_name(tmp_path):
    touch(tmp_path, "a_cam.cihx", "a_cam.mraw", "a-vib.csv", "b.tif", "b velocity.wav", "c.mp4", "notes.txt")
    found = {test.name: test for test in find_tests(tmp_path)}
    assert set(found) == {"a", "b", "c"}
    assert (found["a"].recording.name, found["a"].vibrometer.name) == ("a_cam.cihx", "a-vib.csv")
    assert found["b"].vibrometer.name == "b velocity.wav"
    assert found["c"].vibrometer is None


def test_two_recordings_of_one_name_are_refused(tmp_path):
    touch(tmp_path, "a.cihx", "a_cam.tif")
    with pytest.raises(InputError, match=r"both would be of test 'a'.*--table"):
        find_tests(tmp_path)


@pytest.mark.parametrize("encoding", ["utf-8-sig", "utf-16", "utf-16-le", "latin-1"])
def test_a_table_says_which_files_are_which_test(tmp_path, encoding):
    touch(tmp_path, "x1.tif", "v7.csv")
    table = tmp_path / "list.csv"
    table.write_text(
        "test;recording;vibrometer;frequency_hz;location;comment\n;;;;;\nfirst;x1.tif;v7.csv;98,5;0,47;für\n",
        encoding=encoding,
    )
    (test,) = find_tests(tmp_path, table)
    assert (test.name, test.recording.name, test.vibrometer.name) == ("first", "x1.tif", "v7.csv")
    assert (test.frequency, test.location, test.velocity) == (98.5, 0.47, None)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("test,recording\na,none.tif\n", "line 2: recording 'none.tif' is not in"),
        ("test,recording,speed\na,x1.tif,3\n", "unknown column 'speed'"),
        ("test,recording\na,x1.tif\na,x1.tif\n", "'a' stands twice"),
        ("test,recording,frequency_hz\na,x1.tif,fast\n", "frequency_hz = 'fast'"),
        ("test,recording,location\na,x1.tif,1.2\n", "location"),
        ("recording\nx1.tif\n", "must have a column 'test'"),
        ("", "is empty"),
        ("test,recording,location\na,x1.tif\n", "line 2: has 2 cells, the header names 3"),
        ("test,recording\n\na,\n", "line 3: recording is empty"),
        ("test,recording\n,x1.tif\n", "line 2: test is empty"),
        ("test,recording,recording\na,x1.tif,x1.tif\n", "column 'recording' occurs twice"),
    ],
)
def test_a_bad_table_is_refused(tmp_path, text, words):
    touch(tmp_path, "x1.tif")
    (tmp_path / "list.csv").write_text(text, encoding="utf-8")
    with pytest.raises(InputError, match=words):
        find_tests(tmp_path, tmp_path / "list.csv")


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ((), "buckling_level (--buckling-level)"),
        (("--buckling-level", "1e-3", "--cycles", "19"), "at least 20"),
        (("--buckling-level", "1e-3", "--settings", "none.toml"), "cannot be read"),
    ],
)
def test_a_bad_setting_is_refused(tmp_path, arguments, words):
    touch(tmp_path, "x1.tif")
    done = command(tmp_path, *arguments)
    assert done.exit_code == 2
    assert words in " ".join(done.output.split())


def test_an_empty_folder_is_refused(tmp_path):
    done = command(tmp_path, *OPTIONS)
    assert done.exit_code == 2
    assert "holds no recording" in " ".join(done.output.split())
    assert os.listdir(tmp_path) == []
