"""A store: damage is found and alone computed again; what is no map of these parameters is refused."""

from __future__ import annotations

import errno
import json
import os
import re
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from small_map import setup_of, swept
from typer.testing import CliRunner

import snapbeam
from snapbeam.cli.app import app
from snapbeam.sweeps.checkpoint import records as durable
from snapbeam.sweeps.checkpoint import records as ledger
from snapbeam.sweeps.checkpoint import store as tables
from snapbeam.sweeps.checkpoint.records import CheckpointError, CheckpointLock, TaskLog, TaskRecord, append_line
from snapbeam.sweeps.checkpoint.store import Checkpoint
from snapbeam.sweeps.compute import SweepReport
from snapbeam.sweeps.tasks import PointWork, Stage
from snapbeam.util.validation import InputError

CHUNK = 6  # twenty points: four tasks, the last one short


def fill(store, stage):
    store.open_stage(stage)
    todo = store.pending(stage)
    for task in todo:
        store.commit(stage, task, store.work.compute(stage.columns(task), 1))
    return todo


@pytest.fixture
def stored(tmp_path, work):
    """A finished store, and its only stage."""
    stage = Stage("base", work.setup.points, CHUNK)
    with Checkpoint(tmp_path / "store", work, CHUNK) as store:
        assert fill(store, stage) == [0, 1, 2, 3]
    return tmp_path / "store", stage


def chunks(path):
    return sorted(path.glob("runs.zarr/base/*/c.*"))


def truncate(file):
    file.write_bytes(file.read_bytes()[:-3])


def empty(file):
    file.write_bytes(b"")


def flip(file):
    data = bytearray(file.read_bytes())
    data[len(data) // 2] ^= 0x10
    file.write_bytes(bytes(data))


def delete(file):
    file.unlink()


def swap(file):
    number = int(file.name.split(".")[1])
    other = file.with_name(f"c.{(number + 1) % 3}.0")
    held = file.read_bytes()
    file.write_bytes(other.read_bytes())
    other.write_bytes(held)
    return {(number + 1) % 3}


@pytest.mark.parametrize("damage", [truncate, empty, flip, delete, swap])
def test_damage_in_any_chunk_is_found_and_repaired(stored, work, whole, damage):
    path, stage = stored
    for file in chunks(path):
        task = int(file.name.split(".")[1])
        if damage is swap and task == 3:
            continue  # the short last chunk holds another number of rows: covered by the others' exchange
        before = {each: each.read_bytes() for each in chunks(path)}
        broken = {task} | (damage(file) or set())
        with Checkpoint(path, work) as store:
            store.open_stage(stage)
            assert set(store.damaged_in(stage)) == broken == set(store.pending(stage))
            for again in store.pending(stage):
                store.commit(stage, again, work.compute(stage.columns(again), 1))
            assert store.reader(stage).read(0, stage.size).content_hash() == whole.content_hash()
        assert {each: each.read_bytes() for each in chunks(path)} == before


def test_each_bit_of_a_chunk_counts(stored, work):
    path, stage = stored
    file = chunks(path)[0]
    sound = file.read_bytes()
    for at in range(0, 8 * len(sound), max(1, 8 * len(sound) // 40)):
        data = bytearray(sound)
        data[at // 8] ^= 1 << (at % 8)
        file.write_bytes(bytes(data))
        with Checkpoint(path, work) as store:
            store.open_stage(stage)
            assert store.damaged_in(stage) == [0], f"bit {at}"


def test_damage_after_the_check_is_not_read(stored, work):
    path, stage = stored
    with Checkpoint(path, work) as store:
        store.open_stage(stage)
        flip(chunks(path)[-1])
        with pytest.raises(CheckpointError, match="task 3 of stage base was damaged after"):
            store.reader(stage).read(0, stage.size)


def test_descriptions_of_arrays_are_written_again(stored, work, whole):
    path, stage = stored
    for file in sorted(path.glob("runs.zarr/**/zarr.json")):
        file.write_text("{}", encoding="utf-8")
    with Checkpoint(path, work) as store:
        assert fill(store, stage) == []
        assert store.reader(stage).read(0, 20).content_hash() == whole.content_hash()


def test_done_is_what_the_task_log_says(stored, work, tmp_path):
    path, stage = stored
    lines = (path / "tasks.jsonl").read_text(encoding="utf-8").splitlines(keepends=True)
    assert len(lines) == 4
    altered = lines[1].replace('"task":1', '"task":0', 1)
    for content, pending in (
        ("".join(lines[:3]), [3]),
        ("".join(lines[:3]) + lines[3][:40], [3]),
        (lines[0] + altered + lines[2] + lines[3], [1]),
        ("", [0, 1, 2, 3]),
        ("\x00\xff not a record\n" + "".join(lines), []),
    ):
        (path / "tasks.jsonl").write_text(content, encoding="utf-8")
        with Checkpoint(path, work) as store:
            store.open_stage(stage)
            assert store.pending(stage) == pending and store.damaged == []
    (path / "tasks.jsonl").write_text("".join(lines[:3]) + lines[3][:40], encoding="utf-8")
    with Checkpoint(path, work) as store:
        assert store.task_log.torn == 1
        assert fill(store, stage) == [3]
    kept = TaskLog(path / "tasks.jsonl")
    assert sorted(task for _, task in kept.records) == [0, 1, 2, 3] and kept.torn == 1
    record = kept.records["base", 2]
    assert record.engine == work.setup.integration.engine and record.step == work.setup.plan.step
    assert record.version == snapbeam.__version__ and len(record.content) == len(record.parameters) == 64


def test_other_parameters_are_refused_with_the_differences(stored, small):
    path, _ = stored
    other = dict(small, cycles=4, velocity_amplitude=np.linspace(0.05, 0.7, 6), location=0.4)
    with pytest.raises(InputError) as refused:
        Checkpoint(path, PointWork(setup_of(**other)))
    text = str(refused.value)
    assert "cycles: 3 in the checkpoint, 4 requested" in text
    assert re.search(r"velocity_amplitude: .* in the checkpoint, 6 points from 0\.05 to 0\.7 requested", text)
    assert "location: 0.476" in text and "0.4 requested" in text
    assert "damping_ratio" not in text and "frequency_ratio" not in text
    with pytest.raises(InputError, match=r"replicates\.count: nothing in the checkpoint, 2 requested"):
        swept(**small, path=path, replicates=2)


def test_a_folder_that_is_no_store(tmp_path, work):
    (tmp_path / "notes.txt").write_text("mine", encoding="utf-8")
    with pytest.raises(InputError, match="is not empty and is not a checkpoint"):
        Checkpoint(tmp_path, work)
    with pytest.raises(InputError, match="must be a folder, not a file"):
        Checkpoint(tmp_path / "notes.txt", work)
    with pytest.raises(InputError, match="is not an existing folder"):
        Checkpoint(tmp_path / "none" / "store", work)


def test_a_pipe_for_a_description_is_refused(tmp_path):
    os.mkfifo(tmp_path / "map.json")
    with pytest.raises(InputError, match="must be a regular file"):
        tables.read_description(tmp_path / "map.json")


@pytest.mark.parametrize("text", ["[" * 100_000, '{"task":' + "1" * 5000 + "}"])
def test_a_record_that_cannot_be_parsed_counts_as_damaged(text):
    assert TaskRecord.from_line(f"{text}\t{durable._check(text)}\n") is None


def test_a_damaged_description_is_told(stored, work):
    path, _ = stored
    held = json.loads((path / "map.json").read_text(encoding="utf-8"))
    for text in ("", "{", json.dumps(held | {"parameters": held["parameters"] | {"cycles": 4}})):
        (path / "map.json").write_text(text, encoding="utf-8")
        with pytest.raises(CheckpointError, match=r"map\.json is damaged"):
            Checkpoint(path, work)
    (path / "map.json").write_text(json.dumps(held | {"format_version": 99}), encoding="utf-8")
    with pytest.raises(InputError, match=r"has the format .*'format_version': 99"):
        Checkpoint(path, work)


@pytest.mark.parametrize("where", ["map.json", "tasks.jsonl", "runs.zarr/base/numbers/c.1.0", "runs.zarr/base"])
def test_links_are_refused(stored, work, tmp_path, where):
    path, _ = stored
    moved = tmp_path / "elsewhere"
    (path / where).rename(moved)
    (path / where).symlink_to(moved)
    with pytest.raises(InputError, match="is a link or not a plain file"):
        Checkpoint(path, work)


@pytest.mark.parametrize("name", ["../outside", "/etc", "a/b", "..", ".hidden", ""])
def test_names_that_leave_the_store_are_refused(stored, work, name):
    path, stage = stored
    good = TaskLog(path / "tasks.jsonl").records["base", 0]
    append_line(path / "tasks.jsonl", TaskRecord(**(vars(good) | {"stage": name})).line())
    with pytest.raises(InputError, match="is not a name of a member of a checkpoint"):
        Checkpoint(path, work)
    (path / "tasks.jsonl").unlink()
    with Checkpoint(path, work) as store, pytest.raises(InputError, match="is not a name of a member"):
        store.open_stage(Stage(name, stage.points, CHUNK))


HOLDER = """
import sys, time
from pathlib import Path
from snapbeam.sweeps.checkpoint.records import CheckpointLock
with CheckpointLock(Path(sys.argv[1]) / "lock"):
    print("held", flush=True)
    time.sleep(120)
"""


def test_a_second_writer_is_refused_until_the_first_is_gone(stored, work):
    path, _ = stored
    command = [sys.executable, "-c", HOLDER, str(path)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        try:
            assert process.stdout.readline() == "held\n"
            with pytest.raises(CheckpointError, match=f"another process is writing it .process {process.pid}."):
                Checkpoint(path, work)
        finally:
            process.send_signal(signal.SIGKILL)
    with Checkpoint(path, work), pytest.raises(CheckpointError, match=f"process {os.getpid()}"):
        Checkpoint(path, work)
    with CheckpointLock(path / "lock"):
        pass


class Full:
    """A disk with room for so many writes, then none."""

    def __init__(self, function, writes):
        self.function = function
        self.left = writes

    def __call__(self, path, data):
        if self.left <= 0:
            raise OSError(errno.ENOSPC, "No space left on device", str(path))
        self.left -= 1
        self.function(path, data)


@pytest.mark.parametrize("where", ["data", "ledger"])
@pytest.mark.parametrize("writes", [0, 1, 3])
def test_a_full_disk_loses_nothing(tmp_path, work, whole, monkeypatch, where, writes):
    stage = Stage("base", work.setup.points, CHUNK)
    store = Checkpoint(tmp_path / "store", work, CHUNK)
    store.open_stage(stage)
    place, name = (tables, "durable_write") if where == "data" else (ledger, "append_line")
    with monkeypatch.context() as patch, store:
        patch.setattr(place, name, Full(getattr(durable, name), writes))
        with pytest.raises(CheckpointError, match="No space left on device; no finished task is lost"):
            for task in range(stage.tasks):
                store.commit(stage, task, work.compute(stage.columns(task), 1))
    finished = writes // 2 if where == "data" else writes
    with Checkpoint(tmp_path / "store", work) as store:
        store.open_stage(stage)
        assert store.pending(stage) == list(range(finished, 4)) and store.damaged == []
        fill(store, stage)
        assert store.reader(stage).read(0, 20).content_hash() == whole.content_hash()


def test_a_torn_line_of_the_task_log_stays_apart(tmp_path):
    file = tmp_path / "ledger"
    append_line(file, "one")
    with file.open("ab") as stream:
        stream.write(b"tw")
    append_line(file, "three")
    assert file.read_text(encoding="utf-8") == "one\ntw\nthree\n"


@pytest.fixture
def small_disk(tmp_path):
    """A file system of 600 kB, where this process may mount one."""
    place = tmp_path / "disk"
    place.mkdir()
    mount = ["mount", "-t", "tmpfs", "-o", "size=600k", "tmpfs", str(place)]
    try:
        done = subprocess.run(mount, capture_output=True).returncode == 0
    except OSError:
        done = False
    if not done:
        pytest.skip("no file system can be mounted here; the full disk is tested by faults of the file layer")
    yield place
    subprocess.run(["umount", "-l", str(place)], check=True)


@pytest.mark.slow
def test_a_full_file_system(small_disk, tmp_path, monkeypatch):
    """The command says what is wrong, ends with a status, and goes on once there is room."""
    monkeypatch.chdir(tmp_path)
    filler = small_disk / "filler"
    filler.write_bytes(b"0" * 400_000)
    command = ["map", "--modes", "1", "--cycles", "2", "--frequency-ratio", "0.5:2:10"]
    command += ["--velocity-amplitude", "0.05:0.6:8", "--points-per-task", "2", "--threads", "1"]
    full = CliRunner().invoke(app, [*command, "--checkpoint", str(small_disk / "store"), "-o", "a.nc"])
    assert full.exit_code == 1
    assert "No space left on device; no finished task is lost: make room" in full.stderr
    assert "Traceback" not in full.output and not Path("a.nc").exists()
    filler.unlink()
    done = TaskLog(small_disk / "store" / "tasks.jsonl").records
    assert 0 < len(done) < 40
    again = CliRunner().invoke(app, [*command, "--checkpoint", str(small_disk / "store"), "-o", "a.nc"])
    assert again.exit_code == 0, again.output
    assert f"{len(done)} resumed, {40 - len(done)} computed, 0 damaged" in again.stdout
    CliRunner().invoke(app, [*command, "-o", "b.nc"])
    xr.testing.assert_equal(xr.load_dataset("a.nc", engine="h5netcdf"), xr.load_dataset("b.nc", engine="h5netcdf"))


def test_verify_repairs_and_computes_nothing_else(tmp_path, small, work):
    path, stage = tmp_path / "store", Stage("base", work.setup.points, CHUNK)
    with Checkpoint(path, work, CHUNK) as store:
        store.open_stage(stage)
        for task in (0, 2):
            store.commit(stage, task, work.compute(stage.columns(task), 1))
    flip(path / "runs.zarr/base/integers/c.2.0")
    report = SweepReport()
    checked = swept(**small, path=path, check_checkpoint=True, report=report, threads=1)
    assert report.damaged == [("base", 2)] and report.computed == 1 and report.missing == 2
    assert int((checked["response_class"] == -1).sum()) == 8
    assert (checked["status"].values.ravel()[6:12] == snapbeam.RunStatus.NOT_RUN).all()
    with pytest.raises(InputError, match="is not the folder of a sweep, so it cannot be checked"):
        swept(**small, path=tmp_path / "none", check_checkpoint=True)


def test_another_version_is_told(stored, work, small):
    path, _ = stored
    lines = []
    for record in TaskLog(path / "tasks.jsonl").records.values():
        lines.append(TaskRecord(**(vars(record) | {"version": "0.0.1", "processor": "i386"})).line())
    (path / "tasks.jsonl").write_text("\n".join(lines) + "\n", encoding="utf-8")
    with pytest.warns(UserWarning, match=r"started with snapbeam 0\.0\.1 on a i386 processor"):
        result = swept(**small, path=path)
    assert "snapbeam 0.0.1, processor i386" in result.attrs["computed_by"]


def test_nothing_on_the_way_to_a_number_runs_code_of_a_file():
    """No pickle, eval or other loader that executes what it reads, anywhere in the package."""
    forbidden = re.compile(
        r"\b(pickle|marshal|shelve|dill|joblib)\b|(?<![\w.])(eval|exec)\(|allow_pickle\s*=\s*True|yaml\.load\("
    )
    package = Path(snapbeam.__file__).parent
    for file in package.rglob("*.py"):
        hits = [line for line in file.read_text(encoding="utf-8").splitlines() if forbidden.search(line)]
        assert hits == [], file
