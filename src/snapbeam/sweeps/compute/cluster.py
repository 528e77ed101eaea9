"""Where the workers of a map come from: processes here, a scheduler that runs already, or a SLURM queue."""

from __future__ import annotations

import tomllib
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from snapbeam.core.validate import InputError, integer, shown
from snapbeam.engines.cpu.driver import usable_cores
from snapbeam.sweeps.errors import CheckpointError

if TYPE_CHECKING:
    from distributed import Client

__all__ = ["Cluster", "open_client", "parse_cluster", "slurm_arguments"]

_FORMS = "local:N, tcp://host:port, tls://host:port or a TOML file such as slurm.toml"
_LOOPBACK = "127.0.0.1"
_SLURM: dict[str, type] = {
    "account": str,
    "cores": int,
    "interface": str,
    "jobs": int,
    "memory": str,
    "prologue": list,
    "queue": str,
    "walltime": str,
}
_NEEDED = ("cores", "interface", "memory")


@dataclass(frozen=True)
class Cluster:
    """A cluster as it was asked for, checked."""

    kind: str
    """``"local"``, ``"address"`` or ``"slurm"``."""
    workers: int = 0
    address: str = ""
    slurm: dict[str, Any] = field(default_factory=dict)


def parse_cluster(text: str) -> Cluster:
    """Read what was given as cluster.

    Parameters
    ----------
    text : str
        ``"local:4"`` for four processes here, ``"tcp://host:8786"`` or ``"tls://host:8786"`` for a scheduler
        that runs already, or the path of a TOML file with a section ``[slurm]``.

    Raises
    ------
    InputError
        If it is none of these; of a file, with the key that is wrong.
    """
    if not isinstance(text, str) or not text:
        raise InputError(f"cluster = {shown(text)}: must be {_FORMS}")
    kind, colon, rest = text.partition(":")
    if kind == "local" and colon:
        if not rest.isdecimal():
            raise InputError(f"cluster = {shown(text)}: the workers must be a whole number, as in local:4")
        return Cluster("local", workers=integer("cluster workers", int(rest), 1, 4096))
    if text.startswith(("tcp://", "tls://")):
        return Cluster("address", address=text)
    if text.endswith(".toml"):
        return Cluster("slurm", slurm=_read_slurm(Path(text)))
    raise InputError(f"cluster = {shown(text)}: must be {_FORMS}")


def _read_slurm(path: Path) -> dict[str, Any]:
    try:
        sections = tomllib.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise InputError(f"cluster = {str(path)!r}: cannot be read, {error.strerror or error}") from error
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise InputError(f"cluster = {str(path)!r}: is no TOML, {error}") from error
    given = sections.pop("slurm", None)
    if sections or not isinstance(given, dict):
        raise InputError(f"cluster = {str(path)!r}: must hold one section, [slurm]")
    for name, value in given.items():
        if name not in _SLURM:
            raise InputError(f"{path.name}: [slurm] {name}: unknown key; must be one of {', '.join(_SLURM)}")
        if not isinstance(value, _SLURM[name]) or isinstance(value, bool):
            raise InputError(
                f"{path.name}: [slurm] {name} = {shown(value)}: must be of type {_SLURM[name].__name__}"
            )
    for name in _NEEDED:
        if name not in given:
            raise InputError(
                f"{path.name}: [slurm] {name} is missing"
                + (": the network that the workers reach the scheduler by" if name == "interface" else "")
            )
    for name in ("cores", "jobs"):
        if name in given:
            integer(f"{path.name}: [slurm] {name}", given[name], 1, 100_000)
    return given


@contextmanager
def open_client(cluster: Cluster) -> Iterator[Client]:
    """Start or join a cluster; what was started here ends with the block."""
    try:
        import dask
        from distributed import Client
    except ImportError as error:
        raise InputError("dask is needed for --cluster: install snapbeam[cluster]") from error
    if cluster.kind == "address":
        try:
            client = Client(cluster.address, timeout="30s", set_as_default=False)
        except (OSError, TimeoutError, ValueError) as error:
            raise CheckpointError(
                f"cluster = {shown(cluster.address)}: no scheduler answers there ({error})"
            ) from error
        try:
            yield client
        finally:
            with suppress(Exception):  # a scheduler that is gone cannot be taken leave of
                client.close(timeout=5)
        return
    with dask.config.set({"distributed.comm.timeouts.connect": "60s"}):
        made = _local(cluster.workers) if cluster.kind == "local" else _slurm(cluster.slurm)
        with made, Client(made, set_as_default=False) as client:
            yield client


def _local(workers: int) -> Any:
    from distributed import LocalCluster

    return LocalCluster(
        n_workers=workers,
        threads_per_worker=max(1, usable_cores() // workers),
        processes=True,
        host=_LOOPBACK,
        dashboard_address=f"{_LOOPBACK}:0",
        worker_dashboard_address=f"{_LOOPBACK}:0",
        memory_limit=0,
        silence_logs=50,
        env=_one_thread_each(),
    )


def _one_thread_each() -> dict[str, str]:
    """Settings that keep a linear algebra library from starting threads beside the engine's."""
    return {name: "1" for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")}


def _slurm(settings: dict[str, Any]) -> Any:
    """One worker process a job, with all its cores; the scheduler listens on the interface that was named."""
    try:
        from dask_jobqueue import SLURMCluster
    except ImportError as error:
        raise InputError("dask-jobqueue is needed for a SLURM cluster: install dask-jobqueue") from error
    made = SLURMCluster(**slurm_arguments(settings))
    made.scale(jobs=settings.get("jobs", 1))
    return made


def slurm_arguments(settings: dict[str, Any]) -> dict[str, Any]:
    """What a job of a SLURM queue is asked for, in the words of dask-jobqueue."""
    exports = [f"export {name}={value}" for name, value in _one_thread_each().items()]
    return {
        "queue": settings.get("queue"),
        "account": settings.get("account"),
        "cores": settings["cores"],
        "processes": 1,
        "memory": settings["memory"],
        "walltime": settings.get("walltime"),
        "interface": settings["interface"],
        "job_script_prologue": [*map(str, settings.get("prologue", [])), *exports],
        "scheduler_options": {"interface": settings["interface"], "dashboard_address": f"{_LOOPBACK}:0"},
    }
