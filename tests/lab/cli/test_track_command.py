"""``snapbeam track`` from a file to displacements, pictures and words."""

import sys
from pathlib import Path

import numpy as np
import pytest
import typer
import xarray as xr
from typer.testing import CliRunner

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
from lab_waveforms import BUCKLING_LEVEL, FRAME_RATE, PIXEL, errors_px, impacts, rms

from snapbeam.lab.cli.track import track
from snapbeam.lab.synthetic import SyntheticCamera, SyntheticStage, render_recording

app = typer.Typer()
app.command()(track)


@pytest.fixture(scope="module")
def recorded(tmp_path_factory):
    """A synthetic recording and the path of its file."""
    time, beam, shaker, *_ = impacts(2)
    recording = render_recording(
        time, beam, shaker, camera=SyntheticCamera(frame_rate=FRAME_RATE, pixel_size=PIXEL, shape=(160, 64)),
        stage=SyntheticStage(shaker_width=0.8e-3), glare_frames=[40],
    )  # fmt: skip
    return recording, recording.write(tmp_path_factory.mktemp("cli") / "test.cihx")


def run(*arguments):
    return CliRunner().invoke(app, [str(argument) for argument in arguments])


@pytest.mark.slow
def test_the_whole_command(recorded, tmp_path):
    recording, path = recorded
    out, picture, report = tmp_path / "t.nc", tmp_path / "frame.png", tmp_path / "quality.pdf"
    result = run(
        path, "-o", out, "--buckling-level", BUCKLING_LEVEL, "--picture", picture, "--frame", 40, "--report",
        report, "--rest-displacement", 1e-3 * float(recording.truth["displacement_mm"][0]), "--region",
        "0:158,0:64",
        "--video", tmp_path / "t.mp4", "--video-every", 20,
    )  # fmt: skip
    assert result.exit_code == 0, result.output
    assert "glare: 1 frame" in result.output and "frames/s" in result.output
    for file in (out, picture, report, tmp_path / "t.mp4"):
        assert file.stat().st_size > 1000 and file.name in result.output
    with xr.open_dataset(out, engine="h5netcdf") as dataset:
        assert rms(errors_px(dataset, recording.truth, "displacement_mm")) < 0.1
        assert dataset["displacement_at_striker"].attrs["units"] == "1"
        assert dataset.attrs["source"] == "test.cihx"
        np.testing.assert_array_equal(dataset["flags"].values.nonzero()[0], [40])


@pytest.mark.sampled(4)
@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("--region", "0:5"), "region"),
        (("--region", "a:b,c:d"), "region"),
        (("--frame", "9999", "--picture", "frame.png"), "frame"),
        (("--output", "out.csv"), "output"),
        (("--picture", "frame.gif"), "picture"),
        (("--video", "frame.gif"), "video"),
        (("--side", "front"), "side"),
        (("--pixel-size", "-1"), "pixel_size"),
    ],
)
def test_refusals_are_one_line_and_leave_no_file(recorded, tmp_path, monkeypatch, arguments, message):
    monkeypatch.chdir(tmp_path)
    result = run(recorded[1], *arguments)
    assert result.exit_code == 2 and message in result.output
    assert "Traceback" not in result.output and [file for file in tmp_path.iterdir() if file.suffix != ".png"] == []


def test_a_recording_in_which_nothing_is_found_leaves_a_picture_with_rows_and_columns(recorded, tmp_path):
    result = run(recorded[1], "--region", "140:158,0:64", "-o", tmp_path / "t.nc")
    assert result.exit_code == 2 and "t.png" in result.output
    assert [file.name for file in tmp_path.iterdir()] == ["t.png"]


def speckled(count=4):
    """Frames of a beam with speckles as dark as a clamp's shadow, clamps at both ends, and a sensor above it."""
    rng = np.random.default_rng(3)
    frames = 30.0 + 5.0 * rng.standard_normal((count, 80, 400))
    grain = np.kron(rng.random((7, 70)) < 0.5, np.ones((4, 4)))
    for k, frame in enumerate(frames):
        frame[25 + k : 53 + k, 60:340] += 90.0 + 90.0 * grain
        frame[:, :20] += 150.0
        frame[5 + k : 25 + k, 100:108] += 150.0
    return frames.clip(0, 255).astype(np.uint8)


def test_a_recording_without_scales_is_looked_at_and_its_regions_are_options_to_repeat(tmp_path):
    path = tmp_path / "speckled.npy"
    np.save(path, speckled())
    result = run(path, "-o", tmp_path / "t.nc")
    assert result.exit_code == 2 and "frame_rate" in result.output and (tmp_path / "t.png").exists()
    given = [line.split() for line in result.output.splitlines() if line.strip().startswith("--region")]
    assert given
    scales = ("--frame-rate", 1000, "--pixel-size", 1e-5, "--rest-frames", 1)
    result = run(path, *scales, *given[-1], "-o", tmp_path / "t.nc")
    assert result.exit_code == 0, result.output
    with xr.open_dataset(tmp_path / "t.nc", engine="h5netcdf") as dataset:
        np.testing.assert_allclose(np.diff(dataset["beam_row"]), 1.0, atol=0.5)
