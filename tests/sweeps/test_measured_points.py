"""Measured responses from a CSV table: what is read, and how a bad cell is named."""

from __future__ import annotations

import math

import numpy as np
import pytest

from snapbeam.sweeps.measured_points import read_measured_points
from snapbeam.util.status_codes import ResponseClass
from snapbeam.util.validation import InputError


def table(tmp_path, text):
    path = tmp_path / "measured.csv"
    path.write_text(text, encoding="utf-8")
    return path


def test_normalised_columns(tmp_path):
    points = read_measured_points(
        table(
            tmp_path,
            "# a sweep\nfrequency_ratio, velocity_amplitude, location, response_class\n\n"
            "1.2,0.18,0.47,Transient Interwell 2\n0.5,0.1,,intrawell\n2,0.3,0.3,transient_1\n"
            "3,0.4,0.3,3\n4,.4,,-1\n",
        )
    )
    assert len(points) == 5
    assert [ResponseClass(int(kind)).name for kind in points.response_class] == [
        "TRANSIENT_2",
        "INTRAWELL",
        "TRANSIENT_1",
        "CONTINUOUS",
        "UNKNOWN",
    ]
    np.testing.assert_array_equal(points.frequency_ratio, [1.2, 0.5, 2.0, 3.0, 4.0])
    np.testing.assert_array_equal(points.location, [0.47, np.nan, 0.3, 0.3, np.nan])


def test_units_are_normalised(tmp_path):
    path = table(tmp_path, "response_class,velocity_m_s,frequency_hz\ncontinuous,0.0310,100\n")
    points = read_measured_points(path, reference_frequency=80.0, buckling_level=0.335e-3)
    assert points.frequency_ratio[0] == 1.25
    assert points.velocity_amplitude[0] == pytest.approx(0.0310 / (2.0 * math.pi * 80.0 * 0.335e-3))
    with pytest.raises(InputError, match="column 'frequency_hz' needs reference_frequency, in Hz"):
        read_measured_points(path)
    with pytest.raises(InputError, match="column 'velocity_m_s' needs buckling_level, in m"):
        read_measured_points(path, reference_frequency=80.0)


HEADER = "frequency_ratio,velocity_amplitude,location,response_class\n"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "measured.csv: is empty"),
        ("a,b\n", "measured.csv: unknown column 'a'"),
        ("frequency_ratio,velocity_amplitude\n", "must have one column response_class"),
        (
            "frequency_ratio,frequency_hz,velocity_amplitude,response_class\n",
            "one column frequency_ratio or frequency_hz",
        ),
        ("response_class,response_class,frequency_ratio,velocity_amplitude\n", "column 'response_class' occurs twice"),
        (
            HEADER + "1,2,0.5,intrawell\n1,x,0.5,intrawell\n",
            "line 3, column 'velocity_amplitude': 'x' must be a number",
        ),
        (HEADER + "nan,1,0.5,intrawell\n", "line 2, column 'frequency_ratio': 'nan'"),
        (HEADER + "-1,1,0.5,intrawell\n", "column 'frequency_ratio': '-1' must be a number greater than 0"),
        (HEADER + "1,1,47,intrawell\n", "column 'location': '47' must be a number greater than 0 and less than 1"),
        (HEADER + "1,1,0.5,wild\n", "line 2, column 'response_class': 'wild' must be one of unknown, intrawell"),
        (HEADER + "1,1\n", "line 2: has 2 cells, the header names 4"),
    ],
)
def test_refusals(tmp_path, text, message):
    with pytest.raises(InputError) as refusal:
        read_measured_points(table(tmp_path, text))
    assert message in str(refusal.value)


def test_missing_file(tmp_path):
    with pytest.raises(InputError, match="cannot be read, No such file"):
        read_measured_points(tmp_path / "none.csv")
