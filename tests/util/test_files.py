"""Files that are not snapbeam's: no command replaces them unasked."""

from __future__ import annotations

import json

import matplotlib.pyplot as plt
import numpy as np
import pytest
import xarray as xr
from typer.testing import CliRunner

import snapbeam as sb
from snapbeam.cli.app import app
from snapbeam.model.parameter_file import Config
from snapbeam.plot.animation import write_frames
from snapbeam.plot.style import save_figure
from snapbeam.util.files import check_writable, foreign_files_kept, is_ours
from snapbeam.util.netcdf import write_netcdf
from snapbeam.util.validation import InputError

RUN = ["simulate", "--modes", "1", "--cycles", "3", "--quiet"]


def command(*words: object):
    return CliRunner().invoke(app, [str(word) for word in words])


def figures(count: int):
    return [plt.figure(figsize=(1.2, 0.8)) for _ in range(count)]


@pytest.mark.parametrize("suffix", [".png", ".pdf", ".svg", ".gif", ".mp4", ".nc"])
def test_what_is_written_carries_its_mark(suffix, tmp_path):
    ours, other = tmp_path / f"ours{suffix}", tmp_path / f"other{suffix}"
    if suffix == ".nc":
        data = xr.Dataset({"displacement_mm": ("time", np.arange(3.0))})  # of the laboratory: no attributes
        write_netcdf(data, ours)
        data.to_netcdf(other, engine="h5netcdf")
    elif suffix in (".gif", ".mp4"):
        pytest.importorskip("PIL" if suffix == ".gif" else "imageio_ffmpeg")
        write_frames(figures(2), ours)
        other.write_bytes(ours.read_bytes().replace(b"made by snapbeam", b"made by somebody"))
    else:
        save_figure(figures(1)[0], ours)
        figures(1)[0].savefig(other)
    plt.close("all")
    assert is_ours(ours) and not is_ours(other)


@pytest.mark.sampled(3)
@pytest.mark.parametrize(("option", "name"), [("-o", "data.nc"), ("--plot", "photo.png"), ("--json", "notes.json")])
def test_a_foreign_file_is_kept_unless_forced(option, name, tmp_path):
    file = tmp_path / name
    file.write_bytes(b'{"mine": 1}')
    refused = command(*RUN, option, file)
    assert refused.exit_code == 2 and "exists" in refused.stderr and "--force" in refused.stderr
    assert file.read_bytes() == b'{"mine": 1}'
    assert command(*RUN, option, file, "--force").exit_code == 0
    assert file.read_bytes() != b'{"mine": 1}'
    assert command(*RUN, option, file).exit_code == 0, "one's own is replaced"


def test_parameter_files_are_a_persons(tmp_path):
    file = tmp_path / "beam.toml"
    words = ["calibrate", "--straight", "80,221", "--lower-well", "81.3", "--upper-well", "80.5", "-o", file]
    Config().system.save(file)
    before = file.read_bytes()
    assert command(*words).exit_code == 2 and file.read_bytes() == before


def test_what_is_read_is_not_replaced(tmp_path):
    file = tmp_path / "map.nc"
    axes = ["--frequency-ratio", "1:1.4:3", "--velocity-amplitude", "0.1:0.5:2"]
    assert command("map", "--modes", "1", "--cycles", "3", *axes, "-o", file, "--quiet").exit_code == 0
    before = file.read_bytes()
    refused = command("simulate", "--from", file, "--point", "frequency_ratio=1.2,velocity_amplitude=0.1", "-o", file)
    assert refused.exit_code == 2 and "named twice" in refused.stderr and file.read_bytes() == before


def test_the_answer_as_json_says_what_wrote_it(tmp_path):
    file = tmp_path / "a.json"
    assert command("frequencies", "--json", file).exit_code == 0
    found = json.loads(file.read_text(encoding="utf-8"))
    assert next(iter(found)) == "snapbeam_version" and found["snapbeam_version"] == sb.__version__


def test_python_replaces_as_everywhere(tmp_path):
    """As xarray and matplotlib do; inside a command what was allowed stays so, even if the file appears since."""
    file = tmp_path / "a.nc"
    file.write_bytes(b"mine")
    assert check_writable(file) == file
    with foreign_files_kept():
        with pytest.raises(InputError, match="exists"):
            check_writable(file)
        file.unlink()
        check_writable(file)
        file.write_bytes(b"appeared meanwhile")
        check_writable(file)


def test_a_table_is_known_by_its_columns(tmp_path):
    file = tmp_path / "tests.csv"
    file.write_text("test,recording\n1,a\n", encoding="utf-8")
    with foreign_files_kept():
        with pytest.raises(InputError, match="exists"):
            check_writable(file, begin="test,recording,status")
        check_writable(file, begin="test,recording")
