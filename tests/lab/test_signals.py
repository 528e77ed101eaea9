"""Readers and writers of time series, and what is refused."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from snapbeam.lab.signal_files import read_channels, read_signal, write_signal
from snapbeam.lab.signals import check_signal, even_sampling, make_signal, parse_sensitivity, si_unit
from snapbeam.util.validation import InputError

KINDS = ("csv", "wav", "uff", "tdms", "h5", "npz")
QUICK = settings(max_examples=25, deadline=None, suppress_health_check=list(HealthCheck), derandomize=True)


def velocity(samples: int = 400, rate: float = 12_000.0, start: float = -0.01) -> xr.DataArray:
    time = start + np.arange(samples) / rate
    values = 0.03 * np.cos(2.0 * np.pi * 99.0 * time) + 1e-4 * np.sin(1e3 * time)
    return make_signal(values, "m/s", rate, start=start, name="shaker velocity")


def write(folder, kind: str, signal: xr.DataArray):
    return write_signal(folder / f"s.{kind}", signal, full_scale=0.05 if kind == "wav" else None)


def read(path):
    return read_signal(path, sensitivity="0.05 m/s/FS" if path.suffix == ".wav" else None)


@pytest.mark.parametrize("kind", KINDS)
def test_round_trip(tmp_path, kind):
    signal = velocity()
    back = read(write(tmp_path, kind, signal))
    assert np.abs(back.values - signal.values).max() < 3e-11  # a WAV's 32-bit step is 0.05/2**31
    assert back.attrs["units"] == "m/s" and back.attrs["source"] == f"s.{kind}"
    shift = 0.01 if kind == "wav" else 0.0  # a sound file has no start
    assert np.abs(back["time"].values - signal["time"].values - shift).max() < 1e-12


def test_uff_keeps_a_rate_whose_step_does_not_fit_six_digits(tmp_path):
    back = read(write(tmp_path, "uff", velocity(rate=44_100.0)))
    assert check_signal(back).sampling_frequency == pytest.approx(44_100.0, rel=1e-12)


def test_units():
    assert si_unit("x", "µm/s") == (1e-6, "m/s") == si_unit("x", "um s^-1")
    assert si_unit("x", "mm/s²") == (1e-3, "m/s^2")
    assert parse_sensitivity("s", "125 mm/s/V") == (0.125, "m/s", "V")
    assert parse_sensitivity("s", "0.5 m/s/mV") == (500.0, "m/s", "V")
    for text in ("125", "mm/s/V", "1e mm/s/V", "0 mm/s/V", "1 furlong/V", None):
        with pytest.raises(InputError):
            parse_sensitivity("s", text)


TABLES = {
    "time [ms];velocity [mm/s]\n" + "".join(f"{i};{i % 7},5\n" for i in range(30)): (1e3, 1e-3),
    "# sampling_frequency: 2 kHz\nvelocity (mm/s)\n" + "".join(f"{i % 7}.5\n" for i in range(30)): (2e3, 1e-3),
    "t_ms,velocity_mm_s\n" + "".join(f"{i},{i % 7}.5\n" for i in range(30)): (1e3, 1e-3),
    "time [s]\tvelocity [m/s]\n" + "".join(f"{i / 1e3}\t{i % 7}.5\n" for i in range(30)): (1e3, 1.0),
    "time[s] velocity[mm/s]\n" + "".join(f"{i / 3e3:.4f} {i % 7}.5\n" for i in range(30)): (3e3, 1e-3),
}


@pytest.mark.parametrize("text", TABLES)
def test_dialects_of_csv(tmp_path, text):
    path = tmp_path / "t.csv"
    path.write_text(text, encoding="utf-8")
    rate, scale = TABLES[text]
    signal = read_signal(path)
    np.testing.assert_allclose(signal.values, scale * (np.arange(30) % 7 + 0.5), rtol=1e-12)
    assert check_signal(signal).sampling_frequency == pytest.approx(rate, rel=1e-3)
    assert signal.name == "velocity"


ROWS = [f"{i / 1e3},{i % 7}" for i in range(40)]
BROKEN = {
    "NaN": (["time [s],v [m/s]", *ROWS[:20], "0.02,nan", *ROWS[21:]], r"line 22, column 'v \[m/s\]'"),
    "text": (["time [s],v [m/s]", *ROWS[:5], "0.005,oops", *ROWS[6:]], "line 7.*'oops'"),
    "empty cell": (["time [s],v [m/s]", *ROWS[:5], "0.005,", *ROWS[6:]], "line 7"),
    "short row": (["time [s],v [m/s]", *ROWS[:5], "0.005", *ROWS[6:]], "line 7 has 1 value"),
    "backward time": (["time [s],v [m/s]", *ROWS[:5], "0.001,2", *ROWS[6:]], "must come after"),
    "gap": (["time [s],v [m/s]", *ROWS[:5], *ROWS[9:]], "gap"),
    "uneven": (["time [s],v [m/s]", *ROWS[:5], "0.0054,2", *ROWS[6:]], "even grid"),
    "no unit": (["time [s],v", *ROWS], "no stated unit"),
    "wrong unit": (["time [s],v [parsec]", *ROWS], "parsec"),
    "time in metres": (["time [m],v [m/s]", *ROWS], "not in seconds"),
    "no header": (ROWS, "header"),
    "no rate": (["v [m/s]", *(row.split(",")[1] for row in ROWS)], "no sampling rate"),
    "two times": (["time [s],t [s]", *ROWS], "only one"),
    "twice": (["v [m/s],v [m/s]", *ROWS], "name of its own"),
    "only header": (["time [s],v [m/s]"], "no row"),
    "volts unread": (["time [s],v [V]", *ROWS], "per FS"),
}


@pytest.mark.parametrize("case", BROKEN)
def test_broken_tables_name_the_file_and_the_place(tmp_path, case):
    lines, word = BROKEN[case]
    path = tmp_path / "broken.csv"
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    with pytest.raises(InputError, match=word) as caught:
        read_signal(path, sensitivity="1 m/s/FS" if case == "volts unread" else None)
    assert "broken.csv" in str(caught.value)


def test_channels_and_contradictions(tmp_path):
    path = tmp_path / "two.csv"
    path.write_text(
        "time [s],v [V],x [mm]\n" + "".join(f"{i / 1e3},{i % 3},{i}\n" for i in range(40)), encoding="utf-8"
    )
    assert [c["name"] for c in read_channels(path)] == ["v", "x"]
    assert read_signal(path, "v", sensitivity="125 mm/s/V").values[1] == pytest.approx(0.125)
    assert read_signal(path, 1).attrs["units"] == "m"
    for kwargs, word in (
        ({}, "choose one"),
        ({"channel": "w"}, "'w'"),
        ({"channel": 5}, "0 to 1"),
        ({"channel": "x", "units": "V"}, "units = 'V'"),
        ({"channel": "x", "sensitivity": "1 m/s/V"}, "per V"),
    ):
        with pytest.raises(InputError, match=word):
            read_signal(path, **kwargs)
    npz = write(tmp_path, "wav", velocity())
    with pytest.raises(InputError, match="12000 Hz"):
        read_signal(npz, sensitivity="1 m/s/FS", sampling_frequency=5e3)
    with pytest.raises(InputError, match="full scale"):
        read_signal(npz)


@pytest.mark.parametrize("kind", KINDS)
@given(data=st.data())
@QUICK
def test_truncated_files_are_refused_or_whole_in_what_they_give(tmp_path_factory, kind, data):
    folder = tmp_path_factory.mktemp("cut")
    signal = velocity()
    path = write(folder, kind, signal)
    raw = path.read_bytes()
    path.write_bytes(raw[: data.draw(st.integers(0, len(raw) - 9))])
    try:
        back = read(path)
    except InputError as error:
        assert path.name in str(error)
    else:
        assert kind == "csv"  # a table cut between two lines is a shorter table
        assert np.isfinite(back.values).all() and back.size < signal.size
        np.testing.assert_allclose(back.values[:-1], signal.values[: back.size - 1], atol=1e-12)


@pytest.mark.parametrize("kind", (*KINDS, "npy", "txt", "nc"))
@given(raw=st.binary(max_size=400))
@QUICK
def test_any_bytes_are_refused_by_name(tmp_path_factory, kind, raw):
    path = tmp_path_factory.mktemp("junk") / f"junk.{kind}"
    path.write_bytes(raw)
    with pytest.raises(InputError, match="junk"):
        read_signal(path, units="m", sampling_frequency=1e3)


@pytest.mark.parametrize("kind", KINDS)
@given(data=st.data())
@QUICK
def test_flipped_bytes_give_a_signal_or_a_refusal(tmp_path_factory, kind, data):
    path = write(tmp_path_factory.mktemp("flip"), kind, velocity())
    raw = bytearray(path.read_bytes())
    for _ in range(3):
        raw[data.draw(st.integers(0, min(len(raw), 900) - 1))] = data.draw(st.integers(0, 255))
    path.write_bytes(bytes(raw))
    try:
        back = read(path)
    except InputError:
        return
    assert np.isfinite(back.values).all() and np.diff(back["time"].values).min() > 0.0


@given(st.lists(st.floats(allow_nan=True, allow_infinity=True), max_size=40))
@QUICK
def test_time_axes_are_even_or_refused(times):
    try:
        start, rate = even_sampling("x", times)
    except InputError:
        return
    assert np.isfinite(start) and rate > 0.0


def test_files_that_cannot_be(tmp_path):
    with pytest.raises(InputError, match="no such file"):
        read_signal(tmp_path / "none.csv")
    with pytest.raises(InputError, match="unknown kind"):
        read_signal(tmp_path / "none.xyz")
    (tmp_path / "empty.csv").touch()
    with pytest.raises(InputError, match="empty"):
        read_signal(tmp_path / "empty.csv")
    with pytest.raises(InputError, match="full_scale"):
        write_signal(tmp_path / "x.wav", velocity())
    with pytest.raises(InputError, match="exceed"):
        write_signal(tmp_path / "x.wav", velocity(), full_scale=0.01)
    assert not (tmp_path / "x.wav").exists()
    with pytest.raises(InputError, match="whole numbers"):
        write_signal(tmp_path / "x.wav", velocity(rate=12_000.5), full_scale=1.0)
