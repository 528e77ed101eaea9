"""Workers and schedulers that die at every moment: no map hangs, none differs, and each says what happened."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest

from snapbeam.sweeps import distributed as workers
from snapbeam.sweeps.checkpoint.records import CheckpointError
from snapbeam.sweeps.checkpoint.store import Checkpoint
from snapbeam.sweeps.compute import CheckpointOptions, CheckpointRunner, SweepReport
from snapbeam.sweeps.distributed import ClusterWorkers, open_client, parse_cluster
from snapbeam.sweeps.tasks import Stage

CHUNK = 3
DRIVER = Path(__file__).with_name("worker_driver.py")

pytest.importorskip("distributed")


@pytest.fixture(scope="module")
def client():
    with open_client(parse_cluster("local:2")) as client:
        yield client


def computed(path, work, client, **options):
    stage, report, said = Stage("base", work.setup.points, CHUNK), SweepReport(), []
    with Checkpoint(path, work, CHUNK) as store:
        cluster = ClusterWorkers(client, said.append, **options)
        kept = CheckpointOptions(path, note=said.append, report=report)
        results = CheckpointRunner(store, cluster, kept).complete(stage)
        return results.read(0, stage.size), report, said


def within(seconds, function, *arguments, **options):
    """What a function gives, in a thread; failing if it takes too long."""
    found = []

    def call():
        try:
            found.append(function(*arguments, **options))
        except BaseException as error:
            found.append(error)

    thread = threading.Thread(target=call, daemon=True)
    thread.start()
    thread.join(seconds)
    assert found, f"still at it after {seconds} s"
    if isinstance(found[0], BaseException):
        raise found[0]
    return found[0]


@pytest.fixture
def between(monkeypatch, client, tried):
    """Kill the worker of a finished task before its results are fetched, so many times."""
    deliver, left = ClusterWorkers._delivered, []

    def kill_first(self, future, address):
        if left and left.pop():
            where = client.scheduler_info(n_workers=-1)["workers"]
            there = client.run(os.getpid, workers=[address])
            assert address in where
            os.kill(there[address], signal.SIGKILL)
            until = time.monotonic() + 20
            while address in client.nthreads() and time.monotonic() < until:
                time.sleep(0.05)
            tried("workers killed between the end of a task and its delivery")
        return deliver(self, future, address)

    monkeypatch.setattr(ClusterWorkers, "_delivered", kill_first)
    monkeypatch.setattr(workers, "_DELIVERY_POLL", 0.5)
    return left


@pytest.mark.slow
def test_a_worker_that_dies_before_it_delivers(tmp_path, work, whole, client, between):
    between += [False, True, False, True]
    columns, report, _ = within(120, computed, tmp_path / "store", work, client)
    assert columns.content_hash() == whole.content_hash()
    assert report.computed == 7 and not report.failed and not between


@pytest.mark.slow
def test_a_worker_that_never_delivers(tmp_path, work, client, monkeypatch):
    """One that lives and gives nothing: the task is given up after as many tries as any other."""
    from distributed import Future

    def result(self, timeout=None):
        time.sleep(0.05)
        raise TimeoutError

    monkeypatch.setattr(Future, "result", result)
    _, report, _said = within(120, computed, tmp_path / "store", work, client, delivery=0.1)
    assert len(report.failed) == 7
    assert all("gave no results within 0.1 s, 3 times" in reason for _, _, reason in report.failed)


@pytest.mark.slow
def test_workers_with_other_code_are_refused(tmp_path, work, client, monkeypatch):
    monkeypatch.setattr("snapbeam.util.provenance.code_hash", lambda: "0123456789abcdef")
    monkeypatch.setattr("snapbeam.sweeps.tasks.code_hash", lambda: "0123456789abcdef")
    with pytest.raises(CheckpointError, match=r"a worker runs snapbeam .* install the same in both places"):
        within(120, computed, tmp_path / "store", work, client)


class _Coming:
    """A client whose workers come and go and never finish anything."""

    status = "running"

    def __init__(self):
        self.number = 0

    def nthreads(self):
        self.number += 1
        return {f"tcp://127.0.0.1:{self.number // 2}": 1} if self.number % 2 else {}

    def submit(self, *arguments, **options):
        return _Never()

    def as_current(self):
        import contextlib

        return contextlib.nullcontext()

    def cancel(self, futures, force):
        pass


class _Never:
    status = "pending"

    def done(self):
        return False

    def cancel(self, force):
        pass

    release = done


def test_workers_that_are_too_small_are_given_up(tmp_path, work, monkeypatch):
    """Restarted for ever by their keeper, they come and go: in the end that is said."""
    monkeypatch.setattr("distributed.wait", lambda futures, **options: None)
    monkeypatch.setattr(workers, "_POLL", 0.0)
    monkeypatch.setattr(workers, "ATTEMPTS", 1000)
    with pytest.raises(CheckpointError, match="were lost and no task finished; they may have too little mem"):
        within(60, computed, tmp_path / "store", work, _Coming())


@pytest.mark.slow
def test_a_scheduler_that_is_killed(tmp_path, work, monkeypatch, tried):
    """In the middle of a map: words, an end, and a store that goes on."""
    monkeypatch.setattr(workers, "_RECONNECT", 3.0)
    script = (
        "import time\nfrom distributed import LocalCluster\n"
        "if __name__ == '__main__':\n"
        "    c = LocalCluster(n_workers=1, threads_per_worker=1, dashboard_address=None)\n"
        "    print(c.scheduler_address, flush=True)\n    time.sleep(600)\n"
    )
    file = tmp_path / "scheduler.py"
    file.write_text(script, encoding="utf-8")
    process = subprocess.Popen([sys.executable, str(file)], stdout=subprocess.PIPE, text=True)
    try:
        address = process.stdout.readline().strip()

        def go():
            with open_client(parse_cluster(address)) as client:
                first = ClusterWorkers._delivered

                def then_kill(self, future, at):
                    found = first(self, future, at)
                    os.kill(process.pid, signal.SIGKILL)
                    return found

                monkeypatch.setattr(ClusterWorkers, "_delivered", then_kill)
                return computed(tmp_path / "store", work, client)

        with pytest.raises(CheckpointError, match="the scheduler does not answer"):
            within(180, go)
    finally:
        process.kill()
        process.communicate()
    tried("schedulers killed")
    stage = Stage("base", work.setup.points, CHUNK)
    with Checkpoint(tmp_path / "store", work) as store:
        store.open_stage(stage)
        assert 1 <= len(store.pending(stage)) < stage.tasks


def test_an_address_where_nobody_is(monkeypatch):
    from distributed import Client

    def nobody(*arguments, **options):
        raise OSError("timed out")

    monkeypatch.setattr(Client, "__init__", nobody)
    with pytest.raises(CheckpointError, match=r"tcp://127\.0\.0\.1:1': no scheduler answers there"):
        with open_client(parse_cluster("tcp://127.0.0.1:1")):
            pass


def killed(folder, maps, kills, seed):
    command = [sys.executable, str(DRIVER), str(folder), str(maps), str(kills), str(seed)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=3600, check=True)
    return json.loads(done.stdout.splitlines()[-1])


@pytest.mark.slow
def test_two_hundred_kills_over_forty_maps(tmp_path, tried):
    seen = killed(tmp_path, 40, 200, 1)
    tried("kills of workers", seen["kills"])
    tried("cluster maps under kills", seen["maps"])
    assert seen["maps"] == 40 and seen["kills"] >= 200
    assert seen["hung"] == seen["differ"] == seen["raised"] == 0, seen
