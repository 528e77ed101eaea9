"""Headers and cells as pandas, R, MATLAB, NumPy, Fortran and instruments write them, and times that are not even."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest
from test_signal_formats import COUNT, PAIRS, TIME, VALUES, rows, same

from snapbeam.lab.signal_files import read_channels, read_signal
from snapbeam.lab.signals import even_sampling
from snapbeam.util.validation import InputError

FRAME = pd.DataFrame({"time [s]": TIME, "velocity [m/s]": np.round(VALUES, 9)})
BODY = rows("{t:.6f},{v:.9f}")
CASES = {
    "pandas": FRAME.to_csv(),
    "pandas, semicolons": FRAME.to_csv(sep=";", decimal=","),
    "pandas, text": FRAME.rename(columns={"time [s]": "time_s", "velocity [m/s]": "velocity_m_s"}).to_string(
        float_format="%.9f"
    ),
    "R": '"time [s]"\t"velocity [m/s]"\n' + "".join(f'"{k + 1}"\t{t:.6f}\t{v:.9f}\n' for k, (t, v) in enumerate(PAIRS)),
    "index and units": ",time,velocity\n,s,m/s\n" + rows("{i},{t:.6f},{v:.9f}"),
    "MATLAB timetable": "Time,velocity_m_s\n" + rows("{t:.6f} sec,{v:.9f}"),
    "MATLAB, minutes": "Time;velocity_m_s\n" + "".join(f"{t / 60.0:.12f} min;{v:.9f}\n" for t, v in PAIRS),
    "NumPy": "# time [s],velocity [m/s]\n" + BODY,
    "NumPy, blanks": "# run 7, shaker on\n# time [s], velocity [m/s]\n" + rows("{t:.6f} {v:.9f}"),
    "NumPy, blanks in the names": "# time [s] velocity [m/s]\n" + rows("{t:.6f} {v:.9f}"),
    "comments, two lines": "% fs = 2000 Hz\n% time\tvelocity\n% s\tm/s\n" + rows("{t:.6f}\t{v:.9f}"),
    "Fortran": "time[s] velocity[m/s]\n" + "".join(f"{t:.9e} {v:.9e}\n".replace("e", "D") for t, v in PAIRS),
    "Unicode minus": "time [s];velocity [m/s]\n" + rows("{t:.6f};{v:.9f}").replace("-", "\u2212"),
    "settings in the first row": "time [s],velocity [m/s]\n" + BODY.replace("\n", ",2024-05-01,run 7\n", 1),
    "numbers in the first row": "time [s];velocity [m/s]\n" + rows("{t:.6f};{v:.9f}").replace("\n", ";2000;1\n", 1),
}


@pytest.mark.parametrize("kind", CASES)
def test_headers_and_cells_of_programs(tmp_path, kind):
    path = tmp_path / "table.txt"
    path.write_text(CASES[kind], encoding="utf-8")
    channels = read_channels(path)
    assert [each["name"] for each in channels] == ["velocity"]
    signal = read_signal(path)
    assert signal.attrs["units"] == "m/s" and signal.size == COUNT
    same(signal)


def test_an_unnamed_last_column_is_a_channel(tmp_path):
    path = tmp_path / "table.csv"
    path.write_text("time [s],velocity [m/s]\n" + rows("{t:.6f},{v:.9f},7.5"), encoding="utf-8")
    with pytest.raises(InputError, match="names its 3 column"):  # the velocity begins like a time too
        read_signal(path)
    falling = "".join(f"{t:.6f},{-v:.9f},7.5\n" for t, v in PAIRS)
    path.write_text("time [s],velocity [m/s]\n" + falling, encoding="utf-8")
    assert [each["name"] for each in read_channels(path)] == ["velocity", "column 3"]
    np.testing.assert_allclose(read_signal(path, "velocity").values, -VALUES, atol=1e-9)


@pytest.mark.parametrize(
    "text",
    [
        ",velocity [m/s]\n" + rows("{t:.6f},{v:.9f}"),  # an index that is no count may be anything
        "Serial,123\n" + rows("{i},{t:.6f},{v:.9f}"),
        "# fs = 2000 Hz, 7\n" + BODY,
        "# made by me, today\n" + BODY,
    ],
)
def test_lines_that_name_no_column_are_no_header(tmp_path, text):
    path = tmp_path / "table.csv"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(InputError, match="has no header above it"):
        read_signal(path)


def test_rows_that_are_wider_further_down_are_refused(tmp_path):
    path = tmp_path / "table.csv"
    lines = ("time [s],velocity [m/s]\n" + BODY).splitlines()
    lines[12] += ",overload"
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    with pytest.raises(InputError, match="line 13 has 3 value"):
        read_signal(path)
    lines = FRAME.to_csv().splitlines()
    del lines[9]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    with pytest.raises(InputError, match="each must have a name of its own"):
        read_signal(path)


def test_durations_and_another_unit_contradict(tmp_path):
    path = tmp_path / "table.csv"
    path.write_text("Time [ms],velocity [m/s]\n" + rows("{t:.6f} sec,{v:.9f}"), encoding="utf-8")
    with pytest.raises(InputError, match="remove one of the units"):
        read_signal(path)


def test_jitter_is_uneven_and_gaps_are_missing_samples():
    rng = np.random.default_rng(11)
    grid = np.arange(400) * 1e-3
    for size in (0.3, 0.4, 0.45):
        times = grid + 1e-3 * rng.uniform(-size, size, grid.size)
        assert np.diff(times).max() > 1.5e-3 and np.diff(times).min() > 0.0
        with pytest.raises(InputError, match="must be sampled evenly; resample it first"):
            even_sampling("a", times)
    for lost in (1, 2, 30):
        gap = np.delete(grid, np.s_[100 : 100 + lost]) + 2e-5 * rng.standard_normal(400 - lost)
        with pytest.raises(InputError, match=r"after time\[99\] .* samples are missing"):
            even_sampling("a", gap)
    start, rate = even_sampling("a", grid + 5e-5 * rng.standard_normal(400))
    assert start == pytest.approx(0.0, abs=2e-5) and rate == pytest.approx(1000.0, rel=1e-4)
