"""``snapbeam simulate`` with a recorded drive: the striker keeps its own values, a system without one is refused."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr
from typer.testing import CliRunner

import snapbeam as sb
from snapbeam.cli.app import app
from snapbeam.model.default_values import BEAM, CONTACT

MODEL = sb.ReducedModel.from_beam(BEAM, modes=1, damping_ratio=0.02)
RECORD = [0.0, 1.0, 2.0, 1.0, 0.0, -1.0, -2.0, -1.0] * 20
SPRING = {"forces": [sb.LocalSpring(stiffness=1.0, location=0.5)]}
FORCE = {"forces": [sb.ExternalForce(history=sb.ConstantForce(force=0.01), location=0.5)]}
SHAKEN = {
    "base_excitation": sb.BaseExcitation(motion=sb.AccelerationSine(frequency_ratio=0.9, acceleration_amplitude=0.02))
}


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """A folder with a recorded drive."""
    monkeypatch.chdir(tmp_path)
    time, omega = np.arange(4000) / 2e4, 2.0 * np.pi * 100.0
    xr.Dataset(
        {
            "displacement": ("time", 5e-5 * np.sin(omega * time), {"units": "m"}),
            "velocity": ("time", 5e-5 * omega * np.cos(omega * time), {"units": "m/s"}),
        },
        {"time": time},
        {"frequency": 100.0},
    ).to_netcdf("drive.nc", engine="h5netcdf")
    return tmp_path


def refused(*arguments):
    answer = CliRunner().invoke(app, arguments, catch_exceptions=False)
    assert answer.exit_code == 2
    return " ".join(answer.output.split())


@pytest.mark.parametrize(
    ("parts", "way"),
    [
        (SHAKEN, "[base_excitation] with type = 'recorded_acceleration' and its file"),
        (FORCE, "[force] with type = 'recorded_force' and its file"),
        (SPRING, "use a system with a [contact] and without a moving base, load or external force"),
    ],
)
def test_a_recorded_drive_needs_a_striker(folder, parts, way):
    sb.System(MODEL, **parts).save("system.toml")
    said = refused("simulate", "--config", "system.toml", "--recorded-drive", "drive.nc")
    assert "recorded_drive (--recorded-drive): moves a striker, but the system does not have one" in said
    assert way in said


@pytest.mark.slow
@pytest.mark.parametrize("part", ["base_excitation", "forces"])
def test_the_advised_record_is_accepted(folder, part):
    """The types that the message names, in a file."""
    parts = {
        "base_excitation": sb.BaseExcitation(motion=sb.RecordedAcceleration(record=RECORD, sampling_frequency=2e3)),
        "forces": [
            sb.ExternalForce(
                history=sb.RecordedForce(record=1e-3 * np.array(RECORD), sampling_frequency=2e3), location=0.5
            )
        ],
    }
    sb.System(MODEL, **{part: parts[part]}).save("system.toml")
    answer = CliRunner().invoke(app, ["simulate", "--config", "system.toml", "--cycles", "2"])
    assert answer.exit_code == 0, answer.output


@pytest.mark.slow
def test_a_recorded_drive_leaves_the_gap_of_the_striker(folder):
    system = sb.System(
        MODEL,
        contacts=[
            sb.Contact(CONTACT, sb.Striker(drive=sb.Sine(frequency_ratio=1.2, velocity_amplitude=0.1), gap=1e-3))
        ],
    )
    system.save("system.toml")
    command = ["simulate", "--config", "system.toml", "--recorded-drive", "drive.nc", "--cycles", "2", "-o", "run.nc"]
    answer = CliRunner().invoke(app, command, catch_exceptions=False)
    assert answer.exit_code == 0, answer.output
    run = sb.load("run.nc")
    assert run.system.striker.gap == 1e-3
    assert run.summary.impacts == 0, "the tip moves by 0.05 mm, the gap is 1 mm"


@pytest.mark.parametrize("text", ["", "0.1", "0.3:0.1", "a:b"])
@pytest.mark.parametrize(
    ("command", "option"),
    [("branch", "bounds"), ("bifurcation-curve", "bounds"), ("bifurcation-curve", "second-bounds")],
)
def test_bounds_that_are_not_a_range_are_refused_by_their_name(folder, command, option, text):
    said = refused("dynamics", command, "--modes", "1", f"--{option}", text)
    assert f"{option.replace('-', '_')} (--{option}) = '{text}'" in said


def test_a_long_run_says_once_how_long_it_takes(monkeypatch) -> None:
    """One line where standard error is no terminal, none if asked for errors only."""
    from snapbeam.cli.simulate import _share_done

    monkeypatch.setattr(_share_done, "_MOMENT", -1.0)
    words = ["simulate", "--modes", "2", "--cycles", "400"]
    said = CliRunner().invoke(app, words).stderr
    assert said.count("% of the run in") == 1 and "left" in said
    assert "% of the run" not in CliRunner().invoke(app, [*words, "--quiet"]).stderr
