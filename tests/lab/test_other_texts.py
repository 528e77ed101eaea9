"""Text, UFF and TDMS files that are seldom: read, or refused with the reason and a way out that works."""

from __future__ import annotations

import datetime

import numpy as np
import pytest
from nptdms import ChannelObject, GroupObject, TdmsWriter
from test_signal_formats import COUNT, TIME, VALUES, lvm, same

from snapbeam.lab.signal_files import read_channels, read_signal
from snapbeam.lab.signals import check_signal
from snapbeam.util.diagnostics import diagnostics_of
from snapbeam.util.validation import InputError


def test_labview_channels_of_different_length(tmp_path):
    lines = lvm().replace("Samples\t40\t40", "Samples\t40\t20").splitlines()
    lines[-20:] = [line.rpartition("\t")[0] + "\t" for line in lines[-20:]]
    path = tmp_path / "daq.lvm"
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    same(read_signal(path, "Velocity"))
    drive = read_signal(path, "Drive")
    np.testing.assert_array_equal(drive.values, np.arange(20.0))
    assert not diagnostics_of(drive)
    lines[-10] = lines[-10].rstrip("\t").rpartition("\t")[0] + "\t\t"  # a hole is none at the end
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    with pytest.raises(InputError, match=r"column 'Velocity': is not a finite number"):
        read_channels(path)


def test_labview_commas_between_cells_and_in_numbers(tmp_path):
    path = tmp_path / "daq.lvm"
    text = lvm(",").replace("Separator\tTab", "Separator\tComma").replace("\t", ",")
    path.write_text(text, encoding="utf-8")
    with pytest.raises(InputError, match="cannot be told apart: save it again with the separator Tab"):
        read_signal(path, "Velocity")
    path.write_text(lvm(","), encoding="utf-8")
    same(read_signal(path, "Velocity"))
    path.write_text(lvm().replace("Separator\tTab", "Separator\tComma").replace("\t", ","), encoding="utf-8")
    same(read_signal(path, "Velocity"))


@pytest.mark.parametrize(
    "form",
    ["%Y-%m-%d %H:%M:%S.%f", "%Y-%m-%dT%H:%M:%S.%fZ", "%H:%M:%S.%f", "%m/%d/%Y %H:%M:%S.%f", "%d.%m.%Y %H:%M:%S,%f"],
)
@pytest.mark.parametrize("separator", [";", "\t"])
def test_dates_and_clock_times_are_refused_with_two_ways_out(tmp_path, form, separator):
    start = datetime.datetime(2024, 1, 1, 23, 59, 59, 990_000)
    stamps = [(start + datetime.timedelta(seconds=float(t))).strftime(form) for t in TIME]
    path = tmp_path / "table.csv"

    def write(times, head):
        rows = [
            separator.join([*([time] if times else []), f"{v:.9f}"])
            for time, v in zip(times or TIME, VALUES, strict=True)
        ]
        path.write_text("\n".join([head, *rows]) + "\n", encoding="utf-8")

    write(stamps, f"Timestamp{separator}velocity [m/s]")
    with pytest.raises(
        InputError, match=r"such as '.*00.*'.*write them in seconds, or leave them out and give sampling_f"
    ):
        read_signal(path)
    write([f"{t:.6f}" for t in TIME], f"time [s]{separator}velocity [m/s]")
    same(read_signal(path))
    write([], "velocity [m/s]")
    same(read_signal(path, sampling_frequency=2000.0))


UFF = """    -1
    58
velocity
NONE
01-Jan-24 12:00:00
NONE
NONE
    1         0    0         0       NONE         1   3       NONE         0   0
{kind:10d}{count:10d}{even:10d}  0.00000E+00  {step}  0.00000E+00
        17    0    0    0                 NONE                    s
        11    0    0    0                 NONE                  m/s
         0    0    0    0                 NONE                 NONE
         0    0    0    0                 NONE                 NONE
{body}
    -1
"""


def uff(path, numbers, form, line, *, kind=4, even=1, step="5.00000E-04", count=COUNT, exponent="E"):
    words = [f"{number:{form}}".replace("E", exponent) for number in numbers]
    body = "\n".join("".join(words[k : k + line]) for k in range(0, len(words), line))
    path.write_text(UFF.format(kind=kind, count=count, even=even, step=step, body=body), encoding="ascii")
    return path


def test_ascii_universal_files_of_any_width(tmp_path):
    path = tmp_path / "a.uff"
    same(read_signal(uff(path, VALUES, "20.12E", 4)))
    same(read_signal(uff(path, VALUES, "20.12E", 4, exponent="D")))
    same(read_signal(uff(path, VALUES, "20.12E", 4, step="5.00000D-04", exponent="D")))
    padded = np.concatenate([VALUES[:38], [0.0, 0.0]])
    for given in (padded, np.concatenate([VALUES[:37], [0.0, 0.0, 0.0]])):
        count = 38 if given is padded else 37
        signal = read_signal(uff(path, given, "20.12E", 4, count=count))
        np.testing.assert_allclose(signal.values, VALUES[:count], atol=1e-12)
    pairs = np.column_stack([TIME, VALUES]).ravel()
    for options in ({"exponent": "E"}, {"exponent": "D"}):
        same(read_signal(uff(path, pairs, "20.12E", 4, even=0, **options)))  # E20 abscissa
    path.write_text(uff(path, VALUES[:39], "20.12E", 4).read_text(encoding="ascii"), encoding="ascii")
    with pytest.raises(InputError, match="promises 40 samples, the file has 39"):
        read_signal(path)
    with pytest.raises(InputError, match="promises 36 samples, the file has 40"):
        read_signal(uff(path, np.concatenate([VALUES[:36], 4 * [0.5]]), "20.12E", 4, count=36))


def tdms(path, **properties):
    with TdmsWriter(str(path)) as writer:
        group = GroupObject("g", properties=properties.pop("group", {}))
        writer.write_segment(
            [group, ChannelObject("g", "velocity", VALUES, properties={"unit_string": "m/s", **properties})]
        )
    return path


def test_tdms_without_an_increment(tmp_path):
    path = tdms(tmp_path / "a.tdms", wf_increment=0.0)
    with pytest.raises(InputError, match=r"no sampling rate; state sampling_frequency \(--sampling-freq\)"):
        read_signal(path)
    same(read_signal(path, sampling_frequency=2000.0))
    same(read_signal(tdms(path, wf_increment=0.0, group={"SamplingRate": 2000.0})))
    same(read_signal(tdms(path, wf_increment=5e-4)))
    with pytest.raises(InputError, match="contradicts itself about the sampling rate"):
        read_signal(tdms(path, wf_increment=5e-4, group={"dt": 1e-3}))
    assert check_signal(read_signal(tdms(path, wf_increment=5e-4, wf_start_offset=0.25))).time[0] == 0.25
