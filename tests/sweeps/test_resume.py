"""A map that is stopped, killed or cut otherwise: no finished point is lost, and every number is the same."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from small_map import setup_of, swept
from typer.testing import CliRunner

import snapbeam as sb
from snapbeam.cli.app import app
from snapbeam.model.default_values import BEAM, CONTACT, DAMPING_RATIO, LOCATION
from snapbeam.sweeps.checkpoint.store import Checkpoint
from snapbeam.sweeps.compute import SweepReport
from snapbeam.sweeps.replicates import Replicates
from snapbeam.sweeps.tasks import PointWork, Stage, chunk_size

HERE = Path(__file__).parent
pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="kills and forks are POSIX here")


def kill_loop(folder, kills, seed):
    command = [sys.executable, str(HERE / "kill_driver.py"), str(folder), str(kills), str(seed)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=3600)
    assert done.returncode == 0, done.stderr
    seen = json.loads(done.stdout.splitlines()[-1])
    print(seen)
    assert seen["kills"] >= kills
    assert {key: seen[key] for key in ("lost", "changed", "wrong", "damaged", "surplus")} == {
        "lost": 0,
        "changed": 0,
        "wrong": 0,
        "damaged": 0,
        "surplus": 0,
    }
    assert seen["needed"] <= seen["begun"] <= seen["needed"] + seen["kills"]


@pytest.mark.slow
def test_killed_at_random_instants(tmp_path):
    """No finished task lost or changed; none computed twice but the one in flight at a kill."""
    kill_loop(tmp_path, 8, 1)


@pytest.mark.slow
def test_killed_at_two_hundred_random_instants(tmp_path):
    kill_loop(tmp_path, 200, 2)


@pytest.mark.slow
def test_killed_command_goes_on_from_its_store_alone(tmp_path, monkeypatch):
    """``snapbeam map --checkpoint DIR`` of a killed command: the rest is computed, the file is the same."""
    monkeypatch.chdir(tmp_path)
    command = [sys.executable, "-m", "snapbeam", "map", "--modes", "1"]
    command += ["--cycles", "60", "--frequency-ratio", "0.5:2:8", "--velocity-amplitude", "0.05:0.6:8"]
    command += ["--checkpoint", "store", "--points-per-task", "4", "--threads", "1", "--log", "map.log", "-o", "map.nc"]
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
    ledger = tmp_path / "store" / "tasks.jsonl"
    while not ledger.exists() or ledger.read_text(encoding="utf-8").count("\n") < 2:
        assert process.poll() is None, process.stderr.read()
        time.sleep(0.01)
    process.send_signal(signal.SIGKILL)
    process.communicate()
    done = ledger.read_text(encoding="utf-8").count("\n")
    assert done < 16 and not (tmp_path / "map.nc").exists()
    again = CliRunner().invoke(app, ["map", "--checkpoint", "store", "-o", "map.nc", "--log", "map.log"])
    assert again.exit_code == 0, again.output
    assert f"16 tasks, {done} resumed, {16 - done} computed, 0 damaged, 0 failed" in again.stdout
    log = (tmp_path / "map.log").read_text(encoding="utf-8").splitlines()
    assert log[0].endswith("map of 64 points") and "T" in log[0].split()[0]
    assert any(f"{4 * done} of 64 points are finished" in line for line in log)
    assert any("(100.0 %)" in line and "points/s" in line for line in log)
    resumed = xr.load_dataset(tmp_path / "map.nc", engine="h5netcdf")
    model = sb.ReducedModel.from_beam(BEAM, modes=1, damping_ratio=DAMPING_RATIO)
    whole = swept(
        model, CONTACT, cycles=60, frequency_ratio=np.linspace(0.5, 2.0, 8),
        velocity_amplitude=np.linspace(0.05, 0.6, 8), location=LOCATION,
    )  # fmt: skip
    xr.testing.assert_equal(resumed, whole)
    assert "bitwise identical" in resumed.attrs["reproducible"]
    verified = CliRunner().invoke(app, ["map", "--checkpoint", "store", "--check-checkpoint"])
    assert verified.exit_code == 0 and "16 resumed, 0 computed, 0 damaged" in verified.stdout
    refused = CliRunner().invoke(app, ["map", "--checkpoint", "store", "--cycles", "61"])
    assert refused.exit_code == 2 and "its parameters are not those of this command" in refused.stderr


@pytest.mark.slow
def test_interrupt_keeps_what_is_finished(tmp_path):
    command = [sys.executable, "-m", "snapbeam", "map", "--modes", "1"]
    command += ["--cycles", "2000", "--frequency-ratio", "0.5:2:8", "--velocity-amplitude", "0.05:0.6:8"]
    command += ["--checkpoint", "store", "--points-per-task", "1", "--threads", "1"]
    process = subprocess.Popen(command, cwd=tmp_path, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
    ledger = tmp_path / "store" / "tasks.jsonl"
    while not ledger.exists():
        assert process.poll() is None
        time.sleep(0.01)
    process.send_signal(signal.SIGINT)
    _, messages = process.communicate(timeout=600)
    assert process.returncode == 130
    assert "run the same command to resume" in messages and "Traceback" not in messages
    assert sorted(file.name for file in tmp_path.iterdir()) == ["store"]


@pytest.mark.parametrize("early", [pytest.param(False, marks=pytest.mark.slow), True])
def test_bits_do_not_depend_on_tasks_order_or_threads(tmp_path, small, early):
    """Over location too, where the rows of a task's structure are computed together, and with repeats."""
    asked = dict(small, location=[0.21, 0.3, 0.4762], early_termination=early)
    asked["model"] = sb.ReducedModel.from_beam(asked["model"].beam, modes=4)
    work = PointWork(setup_of(**asked), Replicates(1, check_half_step=True))
    grid = work.setup.points
    wanted = work.compute(grid.take(np.arange(grid.size)), 2).content_hash()
    for chunk, threads, reverse in ((7, 1, True), (1, 2, False), (60, 3, False)):
        stage = Stage("base", grid, chunk)
        with Checkpoint(tmp_path / f"{chunk}", work, chunk) as store:
            store.open_stage(stage)
            for task in sorted(store.pending(stage), reverse=reverse):
                store.commit(stage, task, work.compute(stage.columns(task), threads))
            assert store.reader(stage).read(0, grid.size).content_hash() == wanted


def test_the_file_is_the_map(tmp_path, small):
    """Written a block at a time, the file is what xarray would write of the map in memory."""
    whole = swept(**small)
    report = SweepReport()
    stored = swept(**small, path=tmp_path / "store", points_per_task=6, output=tmp_path / "a.nc", report=report)
    assert (report.tasks, report.resumed, report.computed, report.runs) == (4, 0, 4, 20)
    whole.to_netcdf(tmp_path / "b.nc", engine="h5netcdf")
    expected = xr.load_dataset(tmp_path / "b.nc", engine="h5netcdf")
    stored = stored.load()
    assert {key: stored.attrs[key] for key in expected.attrs if key not in ("created", "parameter_hash")} == {
        key: expected.attrs[key] for key in expected.attrs if key not in ("created", "parameter_hash")
    }
    expected.attrs = stored.attrs
    xr.testing.assert_identical(stored, expected)
    assert all(stored[name].dtype == expected[name].dtype for name in expected.variables)
    flat = dict(small, frequency_ratio=1.0, velocity_amplitude=0.4)
    point = swept(**flat, path=tmp_path / "point", output=tmp_path / "point.nc")
    xr.testing.assert_equal(point.load(), swept(**flat))
    deep = dict(small, location=[0.3, 0.45])
    xr.testing.assert_equal(swept(**deep, path=tmp_path / "deep", output=tmp_path / "deep.nc").load(), swept(**deep))


def test_task_size():
    assert chunk_size(100) == 64 and chunk_size(10**6) == 4096
    assert chunk_size(100_000) == 500


MEMORY = """
import sys
from pathlib import Path
import numpy as np
import snapbeam as sb
side, folder = int(sys.argv[1]), sys.argv[2]
beam = sb.Beam(length=0.161, thickness=0.4e-3, width=15e-3, density=7800.0, young_modulus=200e9,
               buckling_level=0.335e-3)
model = sb.ReducedModel.from_beam(beam, modes=1)
system = sb.System(model, contacts=[sb.Contact(sb.HertzContact(stiffness=4e8), sb.Shaker(frequency_ratio=1.0, velocity_amplitude=0.0))])
axes = {"frequency_ratio": np.linspace(2.0, 4.0, side), "velocity_amplitude": np.linspace(0.01, 0.6, 1000)}
sb.sweep(system, axes, sb.Integration(cycles=1, step=7e-4), checkpoint=folder + "/store", output=folder + "/map.nc")
lines = Path("/proc/self/status").read_text().splitlines()
print(int(next(line for line in lines if line.startswith("VmHWM")).split()[1]) / 1024)
"""
"""Peak of this process alone: ru_maxrss is at least what the process had that began it."""


@pytest.mark.slow
@pytest.mark.skipif(not Path("/proc/self/status").exists(), reason="the peak of memory is in /proc")
def test_memory_does_not_grow_with_the_map(tmp_path):
    """A million points: below 1 GiB, and at most 80 bytes for each of those beyond a hundred thousand, 45 to 70 measured."""
    peak = {}
    for side in (2, 100, 1000):  # the first may have to compile
        folder = tmp_path / str(side)
        folder.mkdir()
        done = subprocess.run(
            [sys.executable, "-c", MEMORY, str(side), str(folder)], capture_output=True, text=True, timeout=7200
        )
        assert done.returncode == 0, done.stderr
        peak[side] = float(done.stdout)
    print(f"peak memory: {peak[100]:.0f} MiB for 1e5 points, {peak[1000]:.0f} MiB for 1e6")
    assert peak[1000] < 1024.0
    assert peak[1000] - peak[100] < 900_000 * 80 / 2**20


@pytest.mark.slow
def test_a_store_costs_little(tmp_path, small):
    """Storing takes less than a tenth of computing at N = 32 and 200 cycles, in tasks of the usual size."""
    asked = dict(small, cycles=200, frequency_ratio=np.linspace(1.0, 3.0, 8))
    asked["velocity_amplitude"] = np.linspace(0.05, 0.6, 16)
    asked["model"] = sb.ReducedModel.from_beam(asked["model"].beam, modes=32)
    work = PointWork(setup_of(**asked))
    computing = storing = 0.0
    with Checkpoint(tmp_path / "store", work) as store:
        stage = Stage("base", work.setup.points, store.chunk)
        store.open_stage(stage)
        for task in range(stage.tasks):
            clock = time.process_time()
            columns = work.compute(stage.columns(task), len(os.sched_getaffinity(0)))
            computing += time.process_time() - clock
            clock = time.process_time()
            store.commit(stage, task, columns)
            storing += time.process_time() - clock
    print(f"computing {computing:.2f} s, storing {storing:.3f} s: {100.0 * storing / computing:.2f} %")
    assert storing < 0.1 * computing
