"""Several commands on one store: one writes, the others say who does, nothing is lost."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest
from small_map import swept

from snapbeam.sweeps.checkpoint.records import CheckpointError
from snapbeam.sweeps.checkpoint.store import Checkpoint
from snapbeam.sweeps.tasks import Stage
from snapbeam.util.validation import InputError

DRIVER = Path(__file__).with_name("race_driver.py")
CHUNK = 6


def raced(folder, races, seed):
    command = [sys.executable, str(DRIVER), str(folder), str(races), str(seed)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=1200, check=True)
    return json.loads(done.stdout)


def check(seen, races):
    assert seen["died"] == 0, seen["texts"]
    assert seen["races"] == races
    assert seen["silent"] == seen["nobody"] == seen["unnamed"] == seen["wrong"] == 0
    assert seen["refused"] > 0


@pytest.mark.slow
def test_three_writers_at_once(tmp_path, tried):
    check(raced(tmp_path, 3, 1), 3)
    tried("races of three writers", 3)


@pytest.mark.slow
def test_three_writers_at_once_a_hundred_times(tmp_path, tried):
    seen = raced(tmp_path, 100, 2)
    check(seen, 100)
    tried("races of three writers", 100)
    tried("races of three writers: refused, the holder named", seen["refused"])


@pytest.fixture
def stored(tmp_path, work):
    """A finished store."""
    stage = Stage("base", work.setup.points, CHUNK)
    with Checkpoint(tmp_path / "store", work, CHUNK) as store:
        store.open_stage(stage)
        for task in store.pending(stage):
            store.commit(stage, task, store.work.compute(stage.columns(task), 1))
    return tmp_path / "store", stage


def test_a_refused_writer_touches_nothing(stored, work):
    """What the writer is in the middle of is left alone; who holds it next sweeps what is torn."""
    path, _ = stored
    torn = path / "runs.zarr" / ".c.0.0.1234.partial"
    with Checkpoint(path, work):
        torn.write_bytes(b"in the middle of it")
        before = {file: file.stat().st_mtime_ns for file in path.rglob("*")}
        with pytest.raises(CheckpointError, match=rf"another process is writing it .process {os.getpid()}."):
            Checkpoint(path, work)
        assert {file: file.stat().st_mtime_ns for file in path.rglob("*")} == before
    with Checkpoint(path, work):
        assert not torn.exists()


def test_a_foreign_folder_is_left_as_it_is(tmp_path, work):
    (tmp_path / "notes.txt").write_text("mine", encoding="utf-8")
    with pytest.raises(InputError, match="is not empty and is not a checkpoint"):
        Checkpoint(tmp_path, work)
    assert [file.name for file in tmp_path.iterdir()] == ["notes.txt"]


@pytest.mark.parametrize("name", ["lock", "tasks.jsonl"])
def test_hard_links_lead_nowhere(stored, work, tmp_path, tried, name):
    """A file of the store that is also one outside is not written to."""
    path, stage = stored
    outside = tmp_path / "outside"
    (path / name).replace(outside)
    os.link(outside, path / name)
    before = outside.read_bytes()
    tried("links in a store")
    with pytest.raises(InputError, match="is a link or not a plain file"), Checkpoint(path, work) as store:
        store.open_stage(stage)
        store.fail(stage, 0, "for this test")
    assert outside.read_bytes() == before


def test_a_name_of_a_holder_that_is_gone_is_not_told(stored, work):
    """After a kill the old name stands in the lock; the next writer's is told as soon as it is there."""
    path, _ = stored
    (path / "lock").write_text("process 4194304000\n", encoding="utf-8")
    with Checkpoint(path, work):
        with pytest.raises(CheckpointError, match=rf"process {os.getpid()}"):
            Checkpoint(path, work)
    assert (path / "lock").read_text(encoding="utf-8") == ""


def test_a_whole_store_is_read_where_nothing_can_be_written(mounted, read_only, work, whole, small, tmp_path, tried):
    """A complete store on read-only media is exported; one that is not says so."""
    disk = mounted("media", "size=4m")
    stage = Stage("base", work.setup.points, CHUNK)
    for name, tasks in (("whole", 4), ("half", 2)):
        with Checkpoint(disk / name, work, CHUNK) as store:
            store.open_stage(stage)
            for task in store.pending(stage)[:tasks]:
                store.commit(stage, task, store.work.compute(stage.columns(task), 1))
    read_only(disk)
    with Checkpoint(disk / "whole", work) as store:
        assert store.read_only
    result = swept(**small, path=disk / "whole", output=tmp_path / "map.nc")
    assert (result["response_class"].values.ravel() == work.values("response_class", whole)).all()
    result.close()
    with pytest.raises(CheckpointError, match="is read-only, and 2 of 4 tasks are not finished"):
        swept(**small, path=disk / "half")
    with pytest.raises(CheckpointError, match="cannot be written, Read-only file system"):
        swept(**small, path=disk / "none")
    tried("stores on read-only media", 3)
