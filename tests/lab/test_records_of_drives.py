"""Records of drives from files: every reader of measured signals, units, drift, parameter files, refusals."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.io import savemat

import snapbeam as sb
from snapbeam import lab
from snapbeam.lab.signals import make_signal
from snapbeam.model.default_values import BEAM
from snapbeam.model.drive.shock import GRAVITY
from snapbeam.model.parameter_file import load_config
from snapbeam.util.validation import InputError

RATE = 5000.0
TIME = np.arange(2000) / RATE
G = 0.3 * np.sin(2.0 * np.pi * 75.0 * TIME)  # whole periods
SYSTEM = f"""
[beam]
length = {BEAM.length}
width = {BEAM.width}
thickness = {BEAM.thickness}
density = {BEAM.density}
young_modulus = {BEAM.young_modulus}
buckling_level = {BEAM.buckling_level}
[model]
modes = 1
damping_ratio = 0.02
"""


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """A folder beside the current one, with a table of three columns."""
    (tmp_path / "elsewhere").mkdir()
    monkeypatch.chdir(tmp_path / "elsewhere")
    table = np.column_stack((TIME, G, 0.1 * G))
    np.savetxt(tmp_path / "rec.csv", table, delimiter=",", header="time (s),base (g),other (m/s^2)", comments="")
    return tmp_path


def written(folder, kind: str):
    """The same acceleration in a file of each kind, and what has to be said of it."""
    path = folder / f"one.{kind}"
    signal = make_signal(GRAVITY * G, "m/s^2", name="base", sampling_frequency=RATE)
    if kind == "mat":
        savemat(path, {"base": GRAVITY * G})
        return path, {"unit": "m/s^2", "sampling_frequency": RATE}
    if kind == "nc":
        signal.to_netcdf(path, engine="h5netcdf")
        return path, {}
    lab.write_signal(path, signal, full_scale=10.0 if kind == "wav" else None)
    return path, {"sensitivity": "10 m/s^2/FS"} if kind == "wav" else {}


@pytest.mark.parametrize("kind", ["csv", "wav", "mat", "nc", "uff", "npz"])
def test_every_reader(folder, kind: str) -> None:
    path, said = written(folder, kind)
    motion = sb.RecordedAcceleration.from_file(path, **said)
    assert motion.sampling_frequency == pytest.approx(RATE, rel=1e-9)
    np.testing.assert_allclose(motion.record, GRAVITY * G, rtol=0.0, atol=1e-6)


def test_units_columns_and_quantities(folder) -> None:
    np.testing.assert_allclose(
        sb.RecordedAcceleration.from_file(folder / "rec.csv", column="base").record, GRAVITY * G, atol=1e-12
    )
    np.testing.assert_allclose(
        sb.RecordedAcceleration.from_file(folder / "rec.csv", column=1).record, 0.1 * G, atol=1e-12
    )
    omega = 2.0 * np.pi * 75.0
    for unit, values in (("um", 50.0 * np.sin(omega * TIME)), ("mm/s", 0.05 * omega * np.cos(omega * TIME))):
        np.savetxt(
            "tip.csv", np.column_stack((TIME, values)), delimiter=",", header=f"time (s),tip ({unit})", comments=""
        )
        motion = sb.RecordedMotion.from_file("tip.csv", frequency=75.0)
        np.testing.assert_allclose(motion.displacement, 5e-5 * np.sin(omega * TIME), atol=5e-9)
        np.testing.assert_allclose(motion.velocity, 5e-5 * omega * np.cos(omega * TIME), atol=3e-6)
    np.savetxt("force.csv", np.column_stack((TIME, 0.2 * G)), delimiter=",", header="time (s),force (mN)", comments="")
    force = sb.RecordedForce.from_file("force.csv")
    np.testing.assert_allclose(force.record, 2e-4 * G, rtol=1e-12, atol=1e-15)
    with pytest.raises(InputError, match=r"unit = 'N': must be m/s\^2 \(an acceleration\)"):
        sb.RecordedAcceleration.from_file("force.csv")
    with pytest.raises(InputError, match=r"unit = 'm/s': must be N \(a force\)"):
        sb.RecordedForce.from_file("tip.csv")


def test_drift_is_decided(folder) -> None:
    """An offset of a sensor: refused, removed by a straight line, or kept."""
    for of, unit, values, words in (
        (sb.RecordedAcceleration, "g", G + 0.15, "an offset of 1.47 m/s"),
        (sb.RecordedMotion, "m/s", 1e-3 * G + 1e-2, "a mean velocity of 0.01 m/s"),
    ):
        np.savetxt("x.csv", np.column_stack((TIME, values)), delimiter=",", header=f"time (s),x ({unit})", comments="")
        fields = {"frequency": 75.0} if of is sb.RecordedMotion else {}
        with pytest.raises(InputError, match=rf"x\.csv.*drift: {words}.*must be 'remove'.*or 'keep'"):
            of.from_file("x.csv", **fields)
        removed, kept = (of.from_file("x.csv", drift=drift, **fields) for drift in ("remove", "keep"))
        name = "record" if of is sb.RecordedAcceleration else "velocity"
        line = np.polyfit(TIME, getattr(removed, name), 1)
        assert np.abs(line).max() < 1e-9 and abs(getattr(kept, name).mean()) > 1e-3
    with pytest.raises(InputError, match="drift = 'no': must be one of 'keep', 'remove'"):
        sb.RecordedAcceleration.from_file("x.csv", drift="no")


def saved(folder, text: str) -> str:
    (folder / "system.toml").write_text(SYSTEM + text, encoding="utf-8")
    return str(folder / "system.toml")


def test_parameter_files_name_records(folder) -> None:
    """Relative to the parameter file; the system holds the samples and is written with them."""
    path = saved(
        folder,
        '[base_excitation]\ntype = "recorded_acceleration"\nfile = "rec.csv"\ncolumn = "base"\ndirection = "down"\n',
    )
    system = load_config(path).system
    assert system == sb.System.load(path)
    assert system.base_excitation.direction == "down"
    assert system.base_excitation.motion == sb.RecordedAcceleration.from_file(folder / "rec.csv", column="base")
    system.save("whole.toml")
    assert sb.System.load("whole.toml") == system
    (folder / "psd.csv").write_text("frequency (Hz),psd (m^2/s^3)\n20,1\n200,1\n", encoding="utf-8")
    path = saved(
        folder, '[base_excitation]\ntype = "random_vibration"\nfile = "psd.csv"\nduration_s = 0.5\nrms_g = 2\n'
    )
    motion = sb.System.load(path).base_excitation.motion
    np.testing.assert_allclose(motion.psd, [(20.0, GRAVITY**-2), (200.0, GRAVITY**-2)], rtol=1e-14)
    assert motion.rms_g == 2.0
    path = saved(folder, '[base_excitation]\ntype = "random_vibration"\npsd = "NAVMAT P-9492"\nduration_s = "500 ms"\n')
    assert sb.System.load(path).base_excitation.motion == sb.RecordedAcceleration.from_psd("NAVMAT P-9492", 0.5)
    np.savetxt(
        folder / "force.csv", np.column_stack((TIME, G)), delimiter=",", header="time (s),force (mN)", comments=""
    )
    path = saved(folder, '[[force]]\ntype = "recorded_force"\nfile = "force.csv"\nlocation = 0.5\n')
    assert sb.System.load(path).forces[0].history.record.size == TIME.size
    np.savetxt(
        folder / "tip.csv", np.column_stack((TIME, 5.0 * G)), delimiter=",", header="time (s),tip (um)", comments=""
    )
    path = saved(
        folder,
        '[contact]\nstiffness = 4e8\nlocation = 0.5\n[drive]\ntype = "recorded_motion"\nfile = "tip.csv"\nfrequency = 75\n',
    )
    assert sb.System.load(path).striker.drive.displacement.max() == pytest.approx(1.5e-6, rel=1e-3)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ('type = "recorded_acceleration"\nfile = "no.csv"', "no.csv: no such file"),
        ('type = "recorded_acceleration"\nfile = "rec.csv"', "rec.csv: holds the channels 'base', 'other'; choose one"),
        ('type = "recorded_acceleration"\nfile = "rec.csv"\ncolumn = "b"', "channel = 'b': the file holds 'base', 'other'"),
        ('type = "recorded_acceleration"\nfile = "rec.csv"\ncolumn = "base"\nunit = "m/s^2"', "base is in 'g' but units = 'm/s^2' was given"),
        ('type = "recorded_acceleration"\nfile = "rec.csv"\nrecord = [1, 2]', "[base_excitation] record: is in the file 'rec.csv'; leave one out"),
        ('type = "recorded_acceleration"\nfile = 3', "[base_excitation] file = 3: must be a path"),
        ('type = "acceleration_sine"\nfile = "rec.csv"', "[base_excitation] file = 'rec.csv': must be a key of type = 'recorded_acceleration' or 'random_vibration'"),
        ('type = "random_vibration"\nfile = "rec.csv"', "[base_excitation] duration_s: missing for type = 'random_vibration'"),
        ('type = "random_vibration"\nfile = "rec.csv"\nduration_s = 1\ncolumns = ["f", "base"]', "columns = ['f']: must be 2 of 'time (s)', 'base (g)', 'other (m/s^2)'"),
        ('type = "random_vibration"\npsd = [[20, 0.04], [10, 0.04]]\nduration_s = 1', "psd: 10 Hz after 20 Hz: frequencies must increase"),
    ],
)  # fmt: skip
def test_bad_files_are_refused(folder, text: str, said: str) -> None:
    with pytest.raises(InputError) as refused:
        load_config(saved(folder, f"[base_excitation]\n{text}\n"))
    assert said in str(refused.value)
    assert str(refused.value).count("[base_excitation]") == 1
