"""A map on workers that die: the same numbers, poisonous tasks set apart, nothing open to the network."""

from __future__ import annotations

import os
import re
import signal
import sys
from typing import ClassVar

import numpy as np
import pytest
from small_map import setup_of, swept

import snapbeam as sb
from snapbeam.sweeps.checkpoint.records import CheckpointError
from snapbeam.sweeps.checkpoint.store import Checkpoint
from snapbeam.sweeps.compute import CheckpointOptions, CheckpointRunner, SweepReport
from snapbeam.sweeps.distributed import ATTEMPTS, ClusterWorkers, open_client, parse_cluster, slurm_arguments
from snapbeam.sweeps.tasks import PointWork, Stage
from snapbeam.util.status_codes import ResponseClass, RunStatus
from snapbeam.util.validation import InputError

CHUNK = 3  # twenty points: seven tasks


class Trouble(PointWork):
    """A work whose tasks do harm in the worker: once each, or always."""

    once: ClassVar[dict] = {}
    always: ClassVar[dict] = {}
    marks = ""

    def compute(self, points, threads=None, progress=None):
        first = (float(points["drive.frequency_ratio"][0]), float(points["drive.velocity_amplitude"][0]))
        harm = self.always.get(first)
        mark = os.path.join(self.marks, f"{first[0]:.3f}-{first[1]:.3f}")
        if first in self.once and not os.path.exists(mark):
            harm = self.once[first]
        with open(mark, "a") as stream:
            stream.write(".")
        if harm == "kill":
            os.kill(os.getpid(), signal.SIGKILL)
        elif harm == "segfault":
            import ctypes

            ctypes.string_at(0)
        elif harm == "raise":
            raise RuntimeError("no luck")
        return super().compute(points, threads, progress)


@pytest.fixture(scope="module")
def client():
    pytest.importorskip("distributed")
    import cloudpickle

    cloudpickle.register_pickle_by_value(sys.modules[__name__])
    with open_client(parse_cluster("local:2")) as client:
        yield client


def trouble(small, folder, once=None, always=None):
    work = Trouble(setup_of(**small))
    stage = Stage("base", work.setup.points, CHUNK)

    def first(task):
        points = stage.columns(task)
        return float(points["drive.frequency_ratio"][0]), float(points["drive.velocity_amplitude"][0])

    for name, harm in (("once", once or {}), ("always", always or {})):
        object.__setattr__(work, name, {first(task): kind for task, kind in harm.items()})
    object.__setattr__(work, "marks", str(folder))
    return work, stage


def computed(path, work, stage, client):
    report, said = SweepReport(), []
    with Checkpoint(path, work, CHUNK) as store:
        options = CheckpointOptions(path, note=said.append, report=report)
        results = CheckpointRunner(store, ClusterWorkers(client, said.append), options).complete(stage)
        return results.read(0, stage.size), report, said, store.made_with()


@pytest.mark.slow
def test_nothing_listens_to_the_network(client):
    addresses = [client.scheduler.address, *client.nthreads()]
    assert len(addresses) == 3
    assert all(address.startswith("tcp://127.0.0.1:") for address in addresses)
    psutil = pytest.importorskip("psutil")
    me = psutil.Process()
    for process in (me, *me.children(recursive=True)):
        heard = [c.laddr.ip for c in process.net_connections("inet") if c.status == psutil.CONN_LISTEN]
        assert set(heard) <= {"127.0.0.1"}


@pytest.mark.slow
def test_workers_that_are_killed_in_mid_task(tmp_path, small, whole, client):
    """By SIGKILL and by a segmentation fault: the same numbers, to the last bit."""
    work, stage = trouble(small, tmp_path, once={1: "kill", 4: "segfault"})
    columns, report, _, made = computed(tmp_path / "store", work, stage, client)
    assert columns.content_hash() == whole.content_hash()
    assert report.computed == 7 and not report.failed and "failed_tasks" not in made
    assert sorted(len(file.read_text(encoding="utf-8")) for file in tmp_path.glob("*-*")) == [1, 1, 1, 1, 1, 2, 2]


@pytest.mark.slow
def test_a_poisonous_task_is_set_apart(tmp_path, small, whole, client):
    work, stage = trouble(small, tmp_path, always={2: "kill"}, once={5: "raise"})
    columns, report, said, made = computed(tmp_path / "store", work, stage, client)
    assert report.failed == [("base", 2, f"killed its worker, {ATTEMPTS} times")]
    assert report.computed == 6 and any("task 2 failed" in line for line in said)
    assert "base 2: killed its worker, 3 times" in made["failed_tasks"]
    poisoned = slice(2 * CHUNK, 3 * CHUNK)
    status = work.values("status", columns)
    assert (status[poisoned] == RunStatus.NOT_RUN).all() and (np.delete(status, np.r_[poisoned]) == RunStatus.OK).all()
    assert (work.values("response_class", columns)[poisoned] == ResponseClass.UNKNOWN).all()
    assert sorted(len(file.read_text(encoding="utf-8")) for file in tmp_path.glob("*-*")) == [1, 1, 1, 1, 1, 2, 3]
    report = SweepReport()
    result = swept(**small, path=tmp_path / "store", report=report)  # here, and without the poison
    assert report.resumed == 6 and report.computed == 1
    np.testing.assert_array_equal(
        result["response_class"].values.ravel(), PointWork.values(work, "response_class", whole)
    )


@pytest.mark.slow
def test_workers_that_cannot_compute_at_all(tmp_path, small, client):
    work, stage = trouble(small, tmp_path, always=dict.fromkeys(range(7), "raise"))
    with pytest.raises(CheckpointError, match="cannot compute this sweep: a task raised RuntimeError: no luck"):
        computed(tmp_path / "store", work, stage, client)


@pytest.mark.slow
def test_a_scheduler_that_runs_already(tmp_path, small, whole, client):
    """The address of a scheduler, through the public function; refined as well."""
    address = client.scheduler.address
    result = swept(**small, path=tmp_path / "store", cluster=address, points_per_task=4, refine_levels=1)
    here = swept(**small, refine_levels=1)
    for name in here.data_vars:
        np.testing.assert_array_equal(result[name], here[name])
    assert "bitwise identical" in result.attrs["reproducible"]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("local", "must be local:N"),
        ("local:0", "cluster workers = 0"),
        ("local:two", "must be a whole number"),
        ("10.0.0.1:8786", "must be local:N"),
        ("http://host", "must be local:N"),
        ("none.toml", "cannot be read"),
    ],
)
def test_clusters_that_are_none(text, message):
    with pytest.raises(InputError, match=message):
        parse_cluster(text)


SLURM = """[slurm]
queue = "short"
cores = 16
memory = "32GB"
walltime = "02:00:00"
interface = "lo"
jobs = 4
prologue = ["module load python"]
"""


def test_slurm(tmp_path):
    file = tmp_path / "slurm.toml"
    file.write_text(SLURM, encoding="utf-8")
    cluster = parse_cluster(str(file))
    assert cluster.kind == "slurm" and cluster.slurm["jobs"] == 4
    jobqueue = pytest.importorskip("dask_jobqueue")
    with jobqueue.SLURMCluster(**slurm_arguments(cluster.slurm)) as made:
        script = made.job_script()
        assert made.scheduler.address.startswith("tcp://127.0.0.1:")
    for line in ("#SBATCH -p short", "#SBATCH --cpus-per-task=16", "#SBATCH -t 02:00:00", "module load python"):
        assert line in script
    assert "export OPENBLAS_NUM_THREADS=1" in script
    assert re.search(r"--nthreads 16 (--nworkers 1 )?", script)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (
            SLURM.replace('interface = "lo"\n', ""),
            "interface is missing: the network interface through which the workers reach",
        ),
        (SLURM.replace("cores = 16", 'cores = "16"'), r"cores = '16': must be of type int"),
        (SLURM + "nodes = 3\n", "nodes: unknown key; must be one of account, cores"),
        ("cores = 3\n", r"must contain one section, \[slurm\]"),
        ("[slurm\n", "is no TOML"),
    ],
)
def test_slurm_files_that_are_wrong(tmp_path, text, message):
    file = tmp_path / "slurm.toml"
    file.write_text(text, encoding="utf-8")
    with pytest.raises(InputError, match=message):
        parse_cluster(str(file))


def test_a_cluster_needs_a_store(small):
    with pytest.raises(InputError, match="cluster: needs a checkpoint"):
        swept(**small, cluster="local:2")


def test_importing_loads_no_cluster():
    import subprocess

    code = "import sys, snapbeam; print([m for m in ('dask', 'distributed', 'zarr') if m in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "[]\n"
    assert callable(sb.sweep)
