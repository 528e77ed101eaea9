"""What ``snapbeam map`` needs for maps that take long: their options, their log and their summary."""

from __future__ import annotations

import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from snapbeam.cli import options as opt
from snapbeam.cli.console import duration, errors, pace, progress

if TYPE_CHECKING:
    from snapbeam.config import Config
    from snapbeam.sweeps.stored import Tally

__all__ = [
    "Chunk",
    "ClusterOption",
    "HalveStep",
    "Log",
    "Refine",
    "ReplicaSize",
    "Replicas",
    "Report",
    "StoreOption",
    "Verify",
    "kept_config",
    "long_arguments",
    "report",
    "resumed",
    "tally_lines",
]

_LONG = "Long maps"

StoreOption = Annotated[
    Path | None,
    typer.Option(
        "--store",
        help="Folder to keep the map in while it is computed; one that exists is resumed.",
        rich_help_panel=_LONG,
        metavar="DIR",
    ),
]
Verify = Annotated[
    bool,
    typer.Option(
        "--verify", help="Check the store and compute again only what is damaged.", rich_help_panel=_LONG
    ),
]
ClusterOption = Annotated[
    str | None,
    typer.Option(
        "--cluster",
        help="Who computes: local:N, tcp://host:port, or slurm.toml; needs --store.",
        rich_help_panel=_LONG,
        metavar="WHERE",
    ),
]
Refine = Annotated[
    int | None,
    opt.count_option("Times to halve the spacing of the axes where neighbours differ in class.", _LONG),
]
Replicas = Annotated[
    int | None, opt.count_option("Repeats of each run with a slightly different start.", _LONG)
]
ReplicaSize = Annotated[
    float | None,
    opt.number_option("Rms change of the centre's start, m (3.5e-6, a camera's pixel).", _LONG),
]
HalveStep = Annotated[
    bool,
    typer.Option("--halve-step", help="One repeat more with the time step halved.", rich_help_panel=_LONG),
]
Chunk = Annotated[int | None, opt.count_option("Points of a task; follows from the map by default.", _LONG)]
Log = Annotated[
    Path | None,
    typer.Option("--log", help="Text file to append the progress to.", rich_help_panel=_LONG, metavar="FILE"),
]

_KEPT = {"refine": int, "replicas": int, "replica_size": float, "halve_step": bool}


def long_arguments(given: Mapping[str, Any]) -> dict[str, Any]:
    """Return the arguments of a long map among the options *given*; empty if it is a map like any other."""
    names = ("store", "cluster", "replicas", "replica_size", "chunk")
    arguments = {name: given[name] for name in names if given[name] is not None}
    if given["refine"] is not None:
        arguments["refine_levels"] = given["refine"]
    return arguments | {name: True for name in ("verify", "halve_step") if given[name]}


def resumed(given: dict[str, Any], settings: Config) -> Config:
    """Return the parameters of a store that is named alone, for one can be resumed without repeating them.

    Options of the map that the store keeps are put into *given* where they were left out.
    """
    from snapbeam.config import config_from_mapping
    from snapbeam.core.validate import InputError
    from snapbeam.sweeps.keep.store import read_stored_config

    if given["store"] is None or settings.model_dump(exclude_unset=True):
        return settings
    kept = read_stored_config(given["store"])
    if kept is None:
        return settings
    options = kept.get("options", {})
    if not isinstance(kept.get("parameters"), dict) or not isinstance(options, dict):
        raise InputError(f"store = {str(given['store'])!r}: keeps no parameters that can be read")
    for name, kind in _KEPT.items():
        if not given[name] and isinstance(options.get(name), kind):
            given[name] = options[name]
    return config_from_mapping(kept["parameters"], source=f"{given['store'].name}/map.json")


def kept_config(settings: Config, given: Mapping[str, Any]) -> dict[str, Any]:
    """Return what a store keeps so that it can be resumed by its name alone."""
    options = {name: given[name] for name in _KEPT if given[name]}
    return {
        "parameters": settings.model_dump(mode="json", exclude_unset=True, exclude_none=True),
        "options": options,
    }


class Report:
    """Progress for a person: a bar on a terminal, lines elsewhere, and lines with the time in a log file."""

    _INTERVAL = 30.0

    def __init__(self, bar: Any, log: Path | None) -> None:
        self._bar = bar
        self._log = log
        self._start = self._last = time.monotonic()
        self._before = 0
        self._quiet = True

    def note(self, text: str) -> None:
        """Say something once."""
        errors().print(text, markup=False)
        self.log(text)

    def progress(self, done: int, total: int) -> None:
        """Say how far the present stage is."""
        now = time.monotonic()
        if done < self._before:
            self._start = now
        finished = done >= total and done != self._before
        self._before = done
        self._bar(done, total)
        if finished or self._quiet or now - self._last >= self._INTERVAL:
            self._last, self._quiet = now, False
            share = 100.0 * done / max(total, 1)
            self.log(f"{done} of {total} points ({share:.1f} %), {pace(done, total, now - self._start)}")

    def log(self, text: str) -> None:
        """Append a line with the time to the log file, if there is one."""
        if self._log is None:
            return
        from snapbeam.core.provenance import created_now

        with self._log.open("a", encoding="utf-8") as stream:
            stream.write(f"{created_now()}  {text}\n")


@contextmanager
def report(total: int, log: Path | None) -> Iterator[Report]:
    """Give a report of a map of *total* points; refuse, before any work, a log that cannot be written."""
    from snapbeam.core.files import check_writable

    if log is not None:
        check_writable(log, "log")
    with progress(total) as bar:
        said = Report(bar, log)
        said.log(f"map of {total} points")
        try:
            yield said
        except KeyboardInterrupt:
            said.note("stopped; what the store holds is kept, and the same command goes on from there")
            raise


def tally_lines(tally: Tally, store: Path | None, elapsed: float) -> list[str]:
    """Return what happened, in words."""
    lines = []
    if store is not None:
        lines.append(f"{tally.runs} runs computed in {duration(elapsed)}")
        lines.append(
            f"Store {store}: {tally.tasks} tasks, {tally.kept} done before, {tally.computed} computed now, "
            f"{len(tally.damaged)} damaged, {len(tally.failed)} given up"
        )
    if tally.missing:
        lines.append(f"{tally.missing} tasks were never computed; without --verify they will be")
    lines += [f"given up: {stage} task {task} {reason}" for stage, task, reason in tally.failed]
    return lines
