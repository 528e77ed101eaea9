"""Runs survive the disk: what is read back is what was written, and says what it is to anybody."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

import snapbeam as sb
from snapbeam.model import default_values
from snapbeam.util.validation import InputError

sys.path.insert(0, str(Path(__file__).parents[1] / "conformance"))
from start_up import start_up

MODEL = sb.ReducedModel.from_beam(default_values.BEAM, modes=3)
SYSTEM = sb.System(
    MODEL, contacts=[sb.Contact(default_values.CONTACT, sb.Shaker(frequency_ratio=1.21, velocity_amplitude=0.18))]
)
RECORDED = sb.Striker(drive=start_up(MODEL, cycles=4), location=0.45)
CASES = {
    "plain": (SYSTEM, sb.Integration(cycles=5)),
    "tolerance": (SYSTEM, sb.Integration(cycles=2, tolerance=1e-4)),
    "recorded": (sb.System(MODEL, contacts=[sb.Contact(default_values.CONTACT, RECORDED)]), sb.Integration()),
    "restitution": (
        sb.System(
            sb.ReducedModel.from_beam(default_values.BEAM, modes=1),
            contacts=[sb.Contact(sb.Restitution(0.6), SYSTEM.striker)],
        ),
        sb.Integration(cycles=4),
    ),
    "free": (sb.System(MODEL, initial_state=sb.State(amplitude=0.9 * MODEL.well_amplitude)), sb.Integration(cycles=3)),
    "decided": (
        SYSTEM.replace(**{"drive.velocity_amplitude": 0.36, "model.modes": 1}),
        sb.Integration(cycles=60, early_termination=True),
    ),
    "failed": (sb.System(MODEL, initial_state=sb.State(amplitude=[1e200, 0.0, 0.0])), sb.Integration(cycles=3)),
    "no impact ends": (SYSTEM.replace(**{"drive.velocity_amplitude": 0.0}), sb.Integration(cycles=1)),
}


@pytest.mark.slow
def test_parts_of_a_run(tmp_path) -> None:
    """Without the modes or all samples a file has the same statistics, impacts and final state, and says what it lacks."""
    run = sb.simulate(*CASES["plain"])
    sizes = []
    for content in ("samples", "waveforms", "states", "statistics"):
        path = tmp_path / f"{content}.nc"
        run.save(path, content)
        sizes.append(path.stat().st_size)
        again = sb.load(path)
        np.testing.assert_equal(dict(again.summary), dict(run.summary))
        xr.testing.assert_identical(again.impacts, run.impacts)
        assert again.system == run.system
        np.testing.assert_array_equal(again.final_state.amplitude, run.final_state.amplitude)
        if content == "waveforms":
            kept = run.dataset.drop_vars(["modal_amplitude", "modal_velocity", "mode"])
            xr.testing.assert_identical(again.dataset, kept)
            assert len(again.plot("spectrum").lines) > 0
            with pytest.raises(InputError, match="without modal_amplitude"):
                again.plot("modal_amplitudes")
        if content == "states":
            at = np.argmin(
                abs(run.dataset["cycle"].values[:, None] - np.arange(run.dataset["cycle"][-1] + 1e-6)), axis=0
            )
            xr.testing.assert_identical(again.dataset, run.dataset.isel(time=at))
    assert sizes[0] > 1.2 * sizes[1] > 1.4 * sizes[3] and sizes[1] > 1.2 * sizes[2] > sizes[3]
    for kind in ("run", "spectrum"):
        with pytest.raises(InputError, match="run with 0 samples: has no figures"):
            again.plot(kind)
    with pytest.raises(InputError, match="content = 'state': must be one of"):
        run.save(path, "state")


def test_save_of_the_command(tmp_path) -> None:
    from typer.testing import CliRunner

    from snapbeam.cli.app import app

    words = ["simulate", "--modes", "3", "--cycles", "5", "-o", str(tmp_path / "run.nc"), "--save"]
    done = CliRunner().invoke(app, [*words, "statistics"])
    assert done.exit_code == 0, done.output
    again = sb.load(tmp_path / "run.nc")
    whole = sb.simulate(again.system, again.integration)
    np.testing.assert_equal(dict(again.summary), dict(whole.summary))
    xr.testing.assert_equal(again.impacts, whole.impacts)
    assert again.dataset.sizes["time"] == 0
    figure = CliRunner().invoke(app, ["plot", str(tmp_path / "run.nc"), "-o", str(tmp_path / "run.png")])
    assert figure.exit_code == 2 and "run with 0 samples: has no figures" in figure.output
    done = CliRunner().invoke(app, [*words, "states"])
    assert done.exit_code == 0, done.output
    states = sb.load(tmp_path / "run.nc").dataset
    assert states["cycle"].values == pytest.approx(np.arange(6.0), abs=1e-12)
    orbit = sb.simulate(again.system, again.integration, sample_times=states["time"].values).dataset
    np.testing.assert_array_equal(states["modal_velocity"], orbit["modal_velocity"])
    for more in (["state"], ["waveforms", "--stream"]):
        assert CliRunner().invoke(app, [*words, *more]).exit_code == 2


QUICK = ("tolerance", "decided", "failed", "no impact ends")


@pytest.mark.sampled(4)
@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=() if name in QUICK else pytest.mark.slow) for name in CASES]
)
def test_round_trip(name: str, tmp_path) -> None:
    system, integration = CASES[name]
    run = sb.simulate(system, integration)
    run.save(tmp_path / "run.nc")
    assert [file.name for file in tmp_path.iterdir()] == ["run.nc"]
    again = sb.load(tmp_path / "run.nc")
    xr.testing.assert_identical(again.dataset, run.dataset)
    xr.testing.assert_identical(again.impacts, run.impacts)
    np.testing.assert_equal(dict(again.summary), dict(run.summary))
    assert [type(value) for value in again.summary.values()] == [type(value) for value in run.summary.values()]
    assert again.system == run.system and again.integration == run.integration
    assert again.accuracy == run.accuracy
    assert (again.final_state is None) == (run.final_state is None) == (name == "failed")
    if run.final_state is not None:
        for part in ("amplitude", "velocity", "phase", "striker_position", "contact_time"):
            np.testing.assert_array_equal(
                getattr(again.final_state, part), getattr(run.final_state, part), err_msg=part
            )
    # saved again, it is the same
    again.save(tmp_path / "again.nc")
    xr.testing.assert_identical(sb.load(tmp_path / "again.nc").dataset, run.dataset)


def test_what_was_read_goes_on(tmp_path) -> None:
    run = sb.simulate(SYSTEM, sb.Integration(cycles=3))
    run.save(tmp_path / "run.nc")
    again = sb.load(tmp_path / "run.nc")
    same = sb.simulate(again.system, again.integration)
    xr.testing.assert_equal(same.dataset, run.dataset)
    on, of_file = (sb.advance(SYSTEM, state, 2) for state in (run.final_state, again.final_state))
    np.testing.assert_allclose(of_file.amplitude, on.amplitude, rtol=0.0, atol=1e-12)


def test_the_file_says_what_it_is(tmp_path) -> None:
    """Any program that reads NetCDF finds units, names and what codes mean."""
    run = sb.simulate(SYSTEM, sb.Integration(cycles=3))
    run.save(tmp_path / "run.nc")
    root = xr.load_dataset(tmp_path / "run.nc", engine="h5netcdf")
    assert root.attrs["Conventions"] == "CF-1.11"
    assert root.attrs["system_hash"] == SYSTEM.hash
    for name, variable in root.variables.items():
        assert {"units", "long_name"} <= variable.attrs.keys(), name
    outcome = xr.load_dataset(tmp_path / "run.nc", engine="h5netcdf", group="summary")
    flags = outcome.response_class.attrs
    assert flags["flag_meanings"].split()[list(flags["flag_values"]).index(int(run.summary.response_class))] == (
        run.summary.response_class.label.replace(" ", "_")
    )
    assert len(outcome.status.attrs["flag_meanings"].split()) == len(outcome.status.attrs["flag_values"])
    impacts = xr.load_dataset(tmp_path / "run.nc", engine="h5netcdf", group="impacts")
    assert impacts.peak_force.attrs["units"] == "N"
    assert (
        root.displacement_at_striker.encoding["zlib"]
        or root.displacement_at_striker.encoding.get("compression") == "gzip"
    )
    text = str(root.attrs)
    assert str(tmp_path) not in text


def test_a_long_run_is_compressed(tmp_path) -> None:
    run = sb.simulate(SYSTEM.replace(**{"drive.velocity_amplitude": 0.01}), sb.Integration(cycles=60))
    run.save(tmp_path / "run.nc")
    assert (tmp_path / "run.nc").stat().st_size < run.dataset.nbytes


@pytest.mark.slow
def test_refusals(tmp_path) -> None:
    run = sb.simulate(SYSTEM, sb.Integration(cycles=1))
    with pytest.raises(InputError, match=r"must end in \.nc"):
        run.save(tmp_path / "run.txt")
    with pytest.raises(InputError, match="is not an existing folder"):
        run.save(tmp_path / "none" / "run.nc")
    with pytest.raises(InputError, match=r"none\.nc.*no such file"):
        sb.load(tmp_path / "none.nc")
    (tmp_path / "text.nc").write_text("no netcdf", encoding="utf-8")
    with pytest.raises(InputError, match="is no NetCDF or HDF5 file"):
        sb.load(tmp_path / "text.nc")
    run.dataset.to_netcdf(tmp_path / "dataset.nc", engine="h5netcdf")
    with pytest.raises(InputError, match=r"is not a run that Run\.save wrote"):
        sb.load(tmp_path / "dataset.nc")
    run.save(tmp_path / "run.nc")
    import h5netcdf

    for name, text in (("snapbeam_system", "{"), ("snapbeam_format", "snapbeam run 99")):
        with h5netcdf.File(tmp_path / "run.nc", "a") as file:
            before, file.attrs[name] = file.attrs[name], text
        with pytest.raises(InputError, match=r"is damaged|is not a run"):
            sb.load(tmp_path / "run.nc")
        with h5netcdf.File(tmp_path / "run.nc", "a") as file:
            file.attrs[name] = before
    assert sb.load(tmp_path / "run.nc").system == SYSTEM
    assert "<Run intrawell" in repr(run) and "samples" in repr(run)
