"""Interruptions: kills at each write, a stopped process, clock jumps, no home folder."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
import xarray as xr
from small_map import swept

import snapbeam as sb

KILLER = Path(__file__).with_name("write_killer.py")
pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="kills and stops are POSIX signals here")


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["map", "list", "refined", "repeats", "extended"])
def test_killed_at_each_write(tmp_path, tried, kind):
    """Whatever was on the disk last: the same results after a second start."""
    done = subprocess.run([sys.executable, str(KILLER), str(tmp_path), kind], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout.splitlines()[-1])
    assert found["wrong"] == [] and found["kills"] > 15
    tried("kills at each write of a checkpoint", found["kills"])


@pytest.mark.slow
def test_a_stopped_process_keeps_its_lock_and_goes_on(tmp_path, tried):
    """SIGSTOP, as of Ctrl-Z: others are refused with its number; after SIGCONT the results are the same."""
    command = [sys.executable, "-m", "snapbeam", "map", "--modes", "1", "--cycles", "60", "--frequency-ratio",
               "0.5:2:8", "--velocity-amplitude", "0.05:0.6:8", "--points-per-task", "4", "--threads", "1"]  # fmt: skip
    process = subprocess.Popen(
        [*command, "--checkpoint", "store", "-o", "a.nc"], cwd=tmp_path, stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )  # fmt: skip
    log = tmp_path / "store" / "tasks.jsonl"
    while not log.exists():
        assert process.poll() is None
        time.sleep(0.002)
    process.send_signal(signal.SIGSTOP)
    other = subprocess.run(
        [*command, "--checkpoint", "store", "-o", "b.nc"], cwd=tmp_path, capture_output=True, text=True
    )
    stopped = process.poll() is None and len(log.read_text(encoding="utf-8").splitlines()) < 16
    process.send_signal(signal.SIGCONT)
    assert process.wait(timeout=600) == 0
    assert stopped and other.returncode == 1 and f"process {process.pid}" in other.stderr
    assert subprocess.run([*command, "-o", "c.nc"], cwd=tmp_path, capture_output=True).returncode == 0
    first, second = (xr.load_dataset(tmp_path / name, engine="h5netcdf") for name in ("a.nc", "c.nc"))
    xr.testing.assert_equal(first, second)
    tried("processes stopped and continued")


@pytest.mark.parametrize("jump", [-1e9, 1e9])
def test_a_clock_that_jumps_changes_no_result(tmp_path, small, monkeypatch, tried, jump):
    whole, clock, calls = swept(**small), time.time, [0]

    def jumping():
        calls[0] += 1
        return clock() + jump * (calls[0] % 2)

    monkeypatch.setattr(time, "time", jumping)
    report = sb.SweepReport()
    found = swept(**small, path=tmp_path / "store", points_per_task=6, report=report)
    xr.testing.assert_equal(found, whole)
    assert report.computed == 4
    tried("jumps of the clock")


@pytest.mark.slow
def test_no_home_folder(tmp_path, tried):
    hidden = ("HOME", "XDG_CACHE_HOME", "XDG_CONFIG_HOME", "MPLCONFIGDIR", "USER", "LOGNAME")
    environment = {name: value for name, value in os.environ.items() if name not in hidden}
    done = subprocess.run(
        [sys.executable, "-m", "snapbeam", "frequencies", "--count", "2"], cwd=tmp_path, env=environment,
        capture_output=True, text=True,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert "Traceback" not in done.stderr and "P = 37.19 N" in done.stdout
    tried("starts without a home folder")
