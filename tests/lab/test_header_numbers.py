"""Rates in headers as programs of different countries write them: read by one rule, or refused with both readings."""

from __future__ import annotations

import numpy as np
import pytest
from nptdms import ChannelObject, TdmsWriter
from test_signal_formats import VALUES, rows

from snapbeam.lab.signal_files import read_signal
from snapbeam.lab.signal_formats import readings
from snapbeam.lab.signals import check_signal
from snapbeam.util.validation import InputError


def rate_of(path, **options):
    signal = read_signal(path, **options)
    np.testing.assert_allclose(signal.values, VALUES, atol=2e-9)
    return check_signal(signal).sampling_frequency


def table(path, head, decimal="."):
    path.write_text(f"{head}\nvelocity [m/s]\n" + rows("{v:.9f}", decimal), encoding="utf-8")
    return path


@pytest.mark.parametrize(
    ("text", "numbers"),
    [
        ("12", (12.0,)),
        ("25,600", (25600.0, 25.6)),
        ("1,000", (1000.0, 1.0)),
        ("25,60", (25.6,)),
        ("0,200", (0.2,)),
        ("1234,567", (1234.567,)),
        ("1,234,567", (1234567.0,)),
        ("1.234.567", (1234567.0,)),
        ("1,024.5", (1024.5,)),
        ("1.024,5", (1024.5,)),
        ("25 600", (25600.0,)),
        ("25\u202f600,5", (25600.5,)),
        ("25'600", (25600.0,)),
        ("25.600", (25.6,)),
        ("2.500e+03", (2500.0,)),
        ("2,500e+03", (2500.0,)),
        ("\u22121,5", (-1.5,)),
        ("12,34,567", ()),
        ("1,5,", ()),
        ("one", ()),
    ],
)
def test_readings_of_a_number(text, numbers):
    assert readings(text) == pytest.approx(numbers)


def test_points_may_part_thousands_only_beside_decimal_commas():
    assert readings("25.600", True) == pytest.approx((25.6, 25600.0))
    assert readings("25.60", True) == pytest.approx((25.6,))


@pytest.mark.parametrize(
    ("head", "rate"),
    [
        ("Sample Rate: 25 600 Hz", 25600.0),
        ("Sample Rate (kHz): 2", 2000.0),
        ("Sample Rate [kHz];2", 2000.0),
        ("Sampling Rate: 2.5 kSa/s", 2500.0),
        ("Sampling Rate: 2 kSPS", 2000.0),
        ("Sample Rate: 1,024,000 samples/s", 1.024e6),
        ('"Sample Rate","25,600.0"', 25600.0),
        ("Sample Rate,1,024,000", 1.024e6),
        ("Sample Interval (us): 12,5", 80000.0),
        ("Sample Interval: 0,125 ms", 8000.0),
        ("Abtastrate = 1.024,5 Hz", 1024.5),
    ],
)
def test_rates_of_headers(tmp_path, head, rate):
    assert rate_of(table(tmp_path / "a.csv", head)) == pytest.approx(rate)


@pytest.mark.parametrize(
    "head",
    ["Sample Rate: 25,600 Hz", '"Sample Rate","25,600"', "Sample Rate,25,600 Hz", "Sample Rate;25,600", "fs = 25,600"],
)
def test_a_rate_with_two_readings_is_refused_and_decided_by_other_evidence(tmp_path, head):
    path = table(tmp_path / "a.csv", head)
    with pytest.raises(InputError, match=r"'25,600.*so that it is 25600 or 25\.6; write 25600 or 25\.6"):
        read_signal(path)
    assert rate_of(path, sampling_frequency=25600.0) == pytest.approx(25600.0)
    assert rate_of(path, sampling_frequency=25.6) == pytest.approx(25.6)
    for rate in (25600.0, 25.6):
        body = "".join(f"{k / rate:.9f},{v:.9f}\n" for k, v in enumerate(VALUES))
        path.write_text(f"{head}\ntime [s],velocity [m/s]\n{body}", encoding="utf-8")
        assert rate_of(path) == pytest.approx(rate)
    path.write_text(path.read_text(encoding="utf-8").replace("25,600", "30,600"), encoding="utf-8")
    with pytest.raises(InputError, match="30600 or 30"):
        read_signal(path)
    for told in ("25600", "25.6"):  # the advice
        assert rate_of(table(path, head.replace("25,600", told))) == pytest.approx(float(told))


def test_points_in_a_file_of_decimal_commas(tmp_path):
    with pytest.raises(InputError, match=r"25\.6 or 25600"):
        read_signal(table(tmp_path / "a.txt", "Abtastrate;25.600 Hz", ","), columns="velocity [m/s]")
    assert rate_of(table(tmp_path / "a.csv", "Abtastrate: 2.000 kHz")) == pytest.approx(2000.0)


def test_texts_in_properties_follow_the_same_rule(tmp_path):
    path = tmp_path / "a.tdms"
    for text, rate in (("2 000", 2000.0), ("2,5 kHz", 2500.0), ("2,000", None)):
        with TdmsWriter(str(path)) as writer:
            properties = {"unit_string": "m/s", "SamplingRate": text}
            writer.write_segment([ChannelObject("g", "velocity", VALUES, properties=properties)])
        if rate is None:
            with pytest.raises(InputError, match="2000 or 2"):
                read_signal(path)
        else:
            assert rate_of(path) == pytest.approx(rate)
