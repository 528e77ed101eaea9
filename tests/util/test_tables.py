"""Tables of datasets: rows, columns of modes, text and MATLAB files."""

from __future__ import annotations

import sys

import numpy as np
import pandas as pd
import pytest
import xarray as xr
from scipy.io import loadmat
from typer.testing import CliRunner

import snapbeam as sb
from snapbeam.cli.app import app
from snapbeam.util.tables import data_frame

RUN = xr.Dataset(
    {
        "voltage": ("time", [1.0, 2.0, 1.0 / 3.0], {"units": "V"}),
        "power": ("time", [0.0, 1.0, 2.0], {"units": "W"}),
        "modal_amplitude": (("time", "mode"), np.arange(6.0).reshape(3, 2)),
        "shape": (("mode", "place"), np.ones((2, 4))),
    },
    {"time": ("time", [0.0, 0.1, 0.2], {"units": "s"}), "cycle": ("time", [0.0, 1.0, 2.0]), "mode": [1, 2]},
)


def test_a_run_has_a_row_for_each_time_and_a_column_for_each_mode():
    frame = data_frame(RUN)
    assert list(frame.columns) == ["time", "cycle", "voltage", "power", "modal_amplitude_1", "modal_amplitude_2"]
    assert len(frame) == 3 and list(frame["modal_amplitude_2"]) == [1.0, 3.0, 5.0]
    assert frame.attrs["left_out"] == ["shape"]


def test_a_map_has_a_row_for_each_point(synthetic_map):
    frame = data_frame(synthetic_map)
    assert len(frame) == synthetic_map["response_class"].size
    row = frame.iloc[27]
    there = synthetic_map.sel(frequency_ratio=row["frequency_ratio"], velocity_amplitude=row["velocity_amplitude"])
    assert int(there["response_class"]) == row["response_class"]
    turned = synthetic_map.assign(peak=synthetic_map["response_class"].T * 1.0, more=synthetic_map["response_class"])
    assert (data_frame(turned)["peak"] == data_frame(turned)["more"]).all()


def test_text_keeps_every_digit_and_states_units(tmp_path):
    assert sb.write_table(RUN, tmp_path / "run.csv") == ["shape"]
    back = pd.read_csv(tmp_path / "run.csv")
    assert list(back.columns)[:3] == ["time (s)", "cycle", "voltage (V)"]
    assert back["voltage (V)"][2] == 1.0 / 3.0


def test_a_matlab_file_has_every_array(tmp_path):
    assert sb.write_table(RUN, tmp_path / "run.mat") == []
    back = loadmat(tmp_path / "run.mat")
    np.testing.assert_array_equal(back["modal_amplitude"], RUN["modal_amplitude"])
    np.testing.assert_array_equal(back["time"].ravel(), RUN["time"])


def test_a_universal_file_has_a_record_of_each_variable_over_time(tmp_path, monkeypatch):
    """Even samples are kept; the contact samples of a run are interpolated, and the record says so."""
    pyuff = pytest.importorskip("pyuff")
    assert sb.write_table(RUN, tmp_path / "run.uff") == ["shape"]
    file = pyuff.UFF(str(tmp_path / "run.uff"))
    records = [file.read_sets(k) for k in range(4)]
    assert [each["id1"] for each in records] == ["voltage", "power", "modal_amplitude_1", "modal_amplitude_2"]
    np.testing.assert_array_equal(records[3]["data"], [1.0, 3.0, 5.0])
    assert records[0]["ordinate_axis_units_lab"] == "V" and records[0]["id2"] == "NONE"
    time = np.concatenate([np.arange(11) * 0.1, [0.505, 0.51]])
    uneven = xr.Dataset({"gap": ("time", 2.0 * np.sort(time), {"units": "m"})}, {"time": np.sort(time)})
    sb.write_table(uneven, tmp_path / "uneven.uff")
    record = pyuff.UFF(str(tmp_path / "uneven.uff")).read_sets(0)
    np.testing.assert_allclose(record["data"], 0.2 * np.arange(11))
    assert record["id2"] == "interpolated from 13 uneven samples"
    with monkeypatch.context() as without:
        without.setitem(sys.modules, "pyuff", None)
        with pytest.raises(sb.InputError, match=r"a universal file needs pyuff; install it .*\[lab\]"):
            sb.write_table(RUN, tmp_path / "without.uff")
    with pytest.raises(sb.InputError, match="must have a variable over time"):
        sb.write_table(xr.Dataset({"a": ("x", [1.0, 2.0])}), tmp_path / "a.uff")


def test_refusals(tmp_path):
    with pytest.raises(sb.InputError, match=r"must end in \.csv or \.mat or \.uff"):
        sb.write_table(RUN, tmp_path / "run.xls")
    with pytest.raises(sb.InputError, match="a table needs rows"):
        sb.write_table(xr.Dataset({"a": 1.0}), tmp_path / "a.csv")


def test_the_command(tmp_path, monkeypatch, synthetic_map):
    monkeypatch.chdir(tmp_path)
    sb.write_netcdf(synthetic_map, "map.nc")
    for _ in range(2):  # the second replaces a file that snapbeam wrote
        for name in ("map.csv", "map.mat"):
            answer = CliRunner().invoke(app, ["info", "map.nc", "--export", name], catch_exceptions=False)
            assert answer.exit_code == 0, answer.output
    assert len(pd.read_csv("map.csv")) == synthetic_map["response_class"].size
    (tmp_path / "own.csv").write_text("mine\n1\n")
    assert CliRunner().invoke(app, ["info", "map.nc", "--export", "own.csv"]).exit_code == 2
    assert (tmp_path / "own.csv").read_text() == "mine\n1\n"


def test_a_threshold_is_a_table_in_long_form_with_its_units(tmp_path):
    """A row for each acceleration at each frequency, with the threshold of the frequency in g beside it."""
    import csv

    from snapbeam.plot.units import in_units
    from snapbeam.util.tables import write_table

    ratio, amplitude = np.array([0.5, 1.0]), np.array([0.1, 0.2, 0.3])
    names = ("base_excitation_frequency_ratio", "base_excitation_acceleration_amplitude")
    parameters = ("base_excitation.frequency_ratio", "base_excitation.acceleration_amplitude")
    curve = xr.Dataset(
        {
            "lower_threshold": (names[0], [0.2, np.nan], {"units": "1"}),
            "upper_threshold": (names[0], [0.3, np.nan], {"units": "1"}),
            "failed_runs": (names[0], [0, 1]),
            "response_class": (names, np.array([[0, 3, 3], [0, 0, -1]], dtype=np.int8)),
            "max_midspan_displacement": (names, np.ones((2, 3)), {"units": "1", "long_name": "maximum, over b"}),
        },
        {
            name: (name, values, {"parameter": parameter})
            for name, values, parameter in zip(names, (ratio, amplitude), parameters, strict=True)
        },
        {"parameter": names[1], "length_scale": 5e-6, "reference_frequency": 4e4},
    )
    unit = 5e-6 * (2.0 * np.pi * 4e4) ** 2 / 9.80665
    assert write_table(in_units(curve), tmp_path / "threshold.csv") == []
    rows = list(csv.DictReader((tmp_path / "threshold.csv").read_text(encoding="utf-8").splitlines()))
    assert len(rows) == 6
    assert [float(row["base_excitation_frequency_hz (Hz)"]) for row in rows] == [2e4] * 3 + [4e4] * 3
    given = [float(row["base_excitation_amplitude_g (g)"]) for row in rows]
    np.testing.assert_allclose(given, np.tile(amplitude, 2) * unit)
    assert [row["response_class"] for row in rows] == ["0", "3", "3", "0", "0", "-1"]
    np.testing.assert_allclose([float(row["lower_threshold (g)"]) for row in rows[:3]], 0.2 * unit)
    assert [row["lower_threshold (g)"] for row in rows[3:]] == [""] * 3
    assert "max_midspan_displacement (over 5e-06 m)" in rows[0]
