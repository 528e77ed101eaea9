"""Files as laboratories have them: instruments' headers, other alphabets, other decimals, other programs."""

from __future__ import annotations

import math
import warnings
import wave

import numpy as np
import pytest

from snapbeam.lab.signal_files import read_channels, read_signal
from snapbeam.lab.signals import check_signal, parse_sensitivity, si_unit
from snapbeam.util.diagnostics import DiagnosticWarning, diagnostics_of
from snapbeam.util.validation import InputError

COUNT = 40
TIME = np.arange(COUNT) / 2000.0
VALUES = 0.25 * np.sin(2.0 * np.pi * 97.0 * TIME)


def rows(template, decimal="."):
    lines = [template.format(i=i, t=t, v=v) for i, (t, v) in enumerate(zip(TIME, VALUES, strict=True))]
    return "\n".join(line.replace(".", decimal) for line in lines) + "\n"


TEKTRONIX_KEYS = [
    "Record Length,2.500000e+03",
    "Sample Interval,5.000000e-04",
    "Vertical Units,V",
    "Horizontal Units,s",
    "Source,CH1",
]
POLYTEC = "Source File Name:\ttest.svd\nPoint Index:\t1\nComponent:\tX\n\n"
PAIRS = list(zip(TIME, VALUES, strict=True))
TEXTS = {
    "polytec, tabs": POLYTEC + "Time\tVib Velocity\n[ s ]\t[ m/s ]\n" + rows("{t:.6e}\t{v:.9e}"),
    "decimal comma, semicolons": "Zeit [s];Geschwindigkeit [m/s]\n" + rows("{t:.6f};{v:.9f}", ","),
    "points, semicolons": "time [s];velocity [m/s]\n" + rows("{t:.6f};{v:.9f}"),
    "decimal comma, tabs": "time [s]\tvelocity [m/s]\n" + rows("{t:.6f}\t{v:.9f}", ","),
    "decimal comma, blanks": "time[s]  velocity[m/s]\n" + rows("{t:.6f}  {v:.9f}", ","),
    "picoscope": "Time,Velocity\n(ms),(m/s)\n\n" + "\n".join(f"{1e3 * t:.6f},{v:.9f}" for t, v in PAIRS),
    "rate in the header": "Device;DAQ 7\nSampling Rate;2 kHz\nvelocity [m/s]\n" + rows("{v:.9f}"),
    "step in the header": "Delta T: 0,5 ms\nvelocity [m/s]\n" + rows("{v:.9f}"),
    "trailing separators": "time [s],velocity [m/s],\n" + rows("{t:.6f},{v:.9f},"),
    "percent comments": "% made by a program\n% fs = 2000 Hz\nvelocity [m/s]\n" + rows("{v:.9f}"),
    "quoted": '"time [s]","velocity [m/s]"\n' + rows('"{t:.6f}","{v:.9f}"'),
}
SIGLENT = "Record Length,Analog:40\nSample Interval,CH1:5.0e-04\nVertical Units,CH1:V\nHorizontal Units,s\n"
VOLTS = {
    "tektronix": "\n".join(
        f"{key},,{t:.6e},{v:.9e},"
        for key, (t, v) in zip(TEKTRONIX_KEYS + [","] * (COUNT - len(TEKTRONIX_KEYS)), PAIRS, strict=True)
    ),
    "keysight": "x-axis,1\nsecond,Volt\n" + rows("{t:.6e},{v:.9e}"),
    "siglent": SIGLENT + "Second,Value\n" + rows("{t:.6e},{v:.9e}"),
}


def same(signal):
    np.testing.assert_allclose(signal.values, VALUES, atol=2e-9)
    assert check_signal(signal).sampling_frequency == pytest.approx(2000.0, rel=1e-6)


@pytest.mark.parametrize("kind", TEXTS)
@pytest.mark.parametrize("encoding", ["utf-8", "utf-16", "utf-8-sig", "latin-1", "utf-16-le"])
def test_text_tables_of_instruments(tmp_path, kind, encoding):
    path = tmp_path / "velocity.txt"
    path.write_bytes(TEXTS[kind].encode(encoding))
    signal = read_signal(path)
    same(signal)
    assert signal.attrs["units"] == "m/s"


@pytest.mark.parametrize("kind", VOLTS)
def test_tables_of_oscilloscopes(tmp_path, kind):
    path = tmp_path / "scope.csv"
    path.write_text(VOLTS[kind], encoding="utf-8")
    signal = read_signal(path)
    same(signal)
    assert signal.attrs["units"] == "V"
    assert read_signal(path, sensitivity="125 mm/s/V").attrs["units"] == "m/s"


def test_a_table_without_a_header_is_read_when_its_columns_are_named(tmp_path):
    path = tmp_path / "bare.csv"
    path.write_text(rows("{t:.6f},{v:.9f}"), encoding="utf-8")
    with pytest.raises(InputError, match=r"--columns"):
        read_signal(path)
    same(read_signal(path, columns="time [s],velocity [m/s]"))
    with pytest.raises(InputError, match="names 3"):
        read_signal(path, columns="a,b,c")
    path.write_text(rows("{v:.9f}", ","), encoding="utf-8")
    with pytest.raises(InputError, match="commas part columns or decimals"):
        read_signal(path)
    same(read_signal(path, columns="velocity [m/s]", sampling_frequency=2000.0))


def test_thousands_are_points_only_before_a_decimal_comma(tmp_path):
    path = tmp_path / "large.csv"
    values = [1234.5 + 100.0 * i for i in range(COUNT)]
    german = [f"{v:,.2f}".replace(",", "x").replace(".", ",").replace("x", ".") for v in values]
    path.write_text("fs = 1000 Hz\nforce [N]\n" + "\n".join(german), encoding="utf-8")
    np.testing.assert_allclose(read_signal(path).values, values)


def test_a_header_that_contradicts_itself_is_refused(tmp_path):
    path = tmp_path / "twice.csv"
    path.write_text("Sample Rate: 2000 Hz\nSample Interval: 1e-3\nvelocity [m/s]\n" + rows("{v:.9f}"), encoding="utf-8")
    with pytest.raises(InputError, match="contradicts itself"):
        read_signal(path)
    path.write_text("Sample Rate: 1000 Hz\ntime [s],velocity [m/s]\n" + rows("{t:.6f},{v:.9f}"), encoding="utf-8")
    with pytest.raises(InputError, match="the header says 1000"):
        read_signal(path)


def test_lines_in_the_middle_are_never_dropped(tmp_path):
    path = tmp_path / "hole.csv"
    lines = TEXTS["points, semicolons"].splitlines()
    path.write_text("\n".join([*lines[:20], "overload", *lines[20:]]), encoding="utf-8")
    with pytest.raises(InputError, match="line 21 has 1 value"):
        read_signal(path)


def lvm(decimal="."):
    head = (
        f"LabVIEW Measurement\t\nWriter_Version\t2\nReader_Version\t2\nSeparator\tTab\nDecimal_Separator\t{decimal}\n"
        "Multi_Headings\tNo\nX_Columns\tNo\nTime_Pref\tAbsolute\n***End_of_Header***\t\n\t\nChannels\t2\t\t\n"
        f"Samples\t{COUNT}\t{COUNT}\t\nDate\t2024/01/01\t2024/01/01\t\nY_Unit_Label\tm/s\tVolts\t\nX_Dimension\tTime\tTime\t\n"
        f"X0\t0{decimal}0\t0{decimal}0\t\nDelta_X\t0{decimal}0005\t0{decimal}0005\t\n***End_of_Header***\t\t\t\nX_Value\tVelocity\tDrive\tComment\n"
    )
    return head + rows("\t{v:.9f}\t{i}", decimal)


@pytest.mark.parametrize("decimal", [".", ","])
def test_labview_text(tmp_path, decimal):
    path = tmp_path / "daq.lvm"
    path.write_text(lvm(decimal), encoding="utf-8")
    assert [entry["name"] for entry in read_channels(path)] == ["Velocity", "Drive"]
    same(read_signal(path, "Velocity"))
    assert read_signal(path, "Drive").attrs["units"] == "V"
    path.write_text("\n".join(lvm(decimal).splitlines()[:-3]), encoding="utf-8")
    with pytest.warns(DiagnosticWarning, match="promises 40 samples"):
        short = read_signal(path, "Velocity")
    assert short.size == COUNT - 3 and [one.code for one in diagnostics_of(short)] == ["signal.cut"]


def test_matlab_of_both_kinds(tmp_path):
    import h5py
    from scipy.io import savemat

    old = tmp_path / "old.mat"
    savemat(old, {"velocity": VALUES[:, None], "velocity_units": "m/s", "fs": 2000.0})
    same(read_signal(old))
    nested = tmp_path / "nested.mat"
    savemat(nested, {"test": {"velocity": VALUES, "units": "m/s", "time": TIME}})
    same(read_signal(nested))
    new = tmp_path / "new.mat"
    with h5py.File(new, "w", userblock_size=512) as file:
        file["velocity"] = VALUES[None, :]
        file["velocity"].attrs["MATLAB_class"] = np.bytes_("double")
        file["fs"] = np.array([[2000.0]])
        file["velocity_units"] = np.array([[ord(c)] for c in "m/s"], dtype=np.uint16)
        file["velocity_units"].attrs["MATLAB_class"] = np.bytes_("char")
    with open(new, "r+b") as file:
        file.write(b"MATLAB 7.3 MAT-file".ljust(116))
    same(read_signal(new))
    empty = tmp_path / "objects.mat"
    savemat(empty, {"cells": np.array(["a", [1, 2]], dtype=object)})
    with pytest.raises(InputError, match="objects and cells are not read"):
        read_signal(empty)


def test_sound_files_of_24_bits_and_of_floats(tmp_path):
    from scipy.io import wavfile

    deep = tmp_path / "deep.wav"
    values = np.tile(VALUES, 50)  # a long record, so that its header is small beside it
    levels = np.round(values / 0.5 * 2**23).astype(np.int32)
    with wave.open(str(deep), "wb") as file:
        file.setnchannels(1)
        file.setsampwidth(3)
        file.setframerate(2000)
        file.writeframes(b"".join(int(level).to_bytes(3, "little", signed=True) for level in levels))
    np.testing.assert_allclose(read_signal(deep, sensitivity="0.5 m/s/FS").values, values, atol=1e-7)
    deep.write_bytes(deep.read_bytes()[:-9])
    with pytest.raises(InputError):
        read_signal(deep, sensitivity="0.5 m/s/FS")
    floats = tmp_path / "float.wav"
    wavfile.write(floats, 2000, VALUES.astype(np.float32))
    np.testing.assert_allclose(read_signal(floats, units="m/s").values, VALUES, atol=1e-7)
    np.testing.assert_allclose(read_signal(floats, sensitivity="2 m/s/FS").values, 2.0 * VALUES, atol=1e-7)
    with pytest.raises(InputError, match=r"--units.*--sensitivity"):
        read_signal(floats)


def test_more_units_and_sensitivities_the_other_way_round():
    assert si_unit("a", "g") == (9.80665, "m/s^2")
    assert si_unit("v", "in/s") == si_unit("v", "ips") == (0.0254, "m/s")
    assert si_unit("p", "kPa") == (1e3, "Pa") and si_unit("t", "seconds") == (1.0, "s")
    factor, unit, per = parse_sensitivity("s", "100 mV/g")
    assert (unit, per) == ("m/s^2", "V") and factor == pytest.approx(98.0665)
    assert parse_sensitivity("s", "50 mV/Pa") == (20.0, "Pa", "V")
    assert parse_sensitivity("s", "10 mV/(m/s^2)")[0] == pytest.approx(100.0)


@pytest.mark.parametrize(
    ("end", "cut"), [("0.12", True), ("0.123456", False), ("0.123456\n", False), ("0.12\n", False)]
)
def test_a_table_that_was_cut_in_its_last_number_says_so(tmp_path, end, cut):
    rows = "".join(f"{i * 1e-4:.6f},{math.sin(0.3 * i):.6f}\n" for i in range(400))
    file = tmp_path / "cut.csv"
    file.write_text(f"time [s],velocity [mm/s]\n{rows}0.040000,{end}", encoding="utf-8")
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        read_signal(file)
    assert any("ends inside its last number" in str(each.message) for each in told) == cut


@pytest.mark.parametrize("shape", [(1, COUNT), (COUNT, 1), (2, COUNT), (COUNT, 2)])
def test_rows_and_columns_of_hdf5(tmp_path, shape):
    import h5py

    path = tmp_path / "matrix.h5"
    many = 2 in shape
    both = np.stack([VALUES, 2.0 * VALUES]) if many else VALUES[None]
    with h5py.File(path, "w") as file:
        data = file.create_dataset("velocity", data=both if shape[1] == COUNT else both.T)
        data.attrs["units"] = "m/s"
        file.attrs["fs"] = 2000.0
        file["fs"] = np.array([[2000.0]])
    same(read_signal(path, "velocity 1" if many else None))
    if many:
        np.testing.assert_array_equal(read_signal(path, "velocity 2").values, 2.0 * VALUES)


POLYTEC = "Source File Name:\tscan.pvd\nPoint Index:\t1\nSignal:\tVib Velocity\n\n"


@pytest.mark.parametrize(
    "heads", ["Time\tVelocity\n[ s ]\t[ m/s ]\n", "[ s ]\t[ m/s ]\n", "Time [ s ]\tVib Velocity [ m/s ]\n"]
)
@pytest.mark.parametrize("decimal", [".", ","])
def test_tables_of_polytec(tmp_path, heads, decimal):
    path = tmp_path / "scan.txt"
    path.write_text(POLYTEC + heads + rows("{t:.6e}\t{v:.9e}", decimal), encoding="latin-1")
    same(read_signal(path))


def test_a_spectrum_is_no_time_signal(tmp_path):
    path = tmp_path / "scan.txt"
    path.write_text(POLYTEC + "Frequency\tMagnitude\n[ Hz ]\t[ m/s ]\n" + rows("{i}\t{v:.9e}"), encoding="utf-8")
    with pytest.raises(InputError, match="this is a spectrum; export the time signal"):
        read_signal(path)


def test_labview_text_with_appended_records_and_empty_channels(tmp_path):
    path = tmp_path / "daq.lvm"
    head = lvm(".").replace("Samples\t40\t40", "Samples\t20\t20").replace("Channels\t2", "Channels\t3")
    path.write_text(head.replace("Velocity\tDrive\tComment", "Velocity\tDrive\tUntitled\tComment"), encoding="utf-8")
    with pytest.warns(DiagnosticWarning, match="appended"):
        signal = read_signal(path, "Velocity")
    same(signal)
    assert [one.code for one in diagnostics_of(signal)] == ["signal.appended"]
    assert [entry["name"] for entry in read_channels(path)] == ["Velocity", "Drive"]
