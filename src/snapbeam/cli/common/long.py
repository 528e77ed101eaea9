"""What ``snapbeam map`` needs for maps that take long: their options, their log and their summary."""

from __future__ import annotations

import inspect
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from snapbeam.cli.common import options as opt
from snapbeam.cli.common.console import duration, notes, pace, progress

if TYPE_CHECKING:
    from snapbeam.config import Config
    from snapbeam.sweeps.stored import SweepReport

__all__ = [
    "LongReport",
    "is_long",
    "kept_config",
    "report",
    "resumed",
    "sweep_options",
    "tally_lines",
    "with_keeping",
]

_LONG = "Long maps"

StoreOption = Annotated[
    Path | None,
    typer.Option(
        "--checkpoint",
        help="Folder to keep the map in while it is computed; one that exists is resumed, and grows with longer axes.",
        rich_help_panel=_LONG,
        metavar="DIR",
    ),
]
Verify = Annotated[
    bool,
    typer.Option(
        "--check-checkpoint",
        help="Check the store and compute again only what is damaged.",
        rich_help_panel=_LONG,
    ),
]
ClusterOption = Annotated[
    str | None,
    typer.Option(
        "--cluster",
        help="Who computes: local:N, tcp://host:port, or slurm.toml; needs --checkpoint.",
        rich_help_panel=_LONG,
        metavar="WHERE",
    ),
]
Refine = Annotated[
    int | None,
    opt.count_option("Times to halve the spacing of the axes where neighbours differ in class.", _LONG),
]
Replicates = Annotated[
    int | None, opt.count_option("Repeats of each run with a slightly different start.", _LONG)
]
ReplicaSize = Annotated[
    float | None,
    opt.number_option("Rms change of the centre's start, m (3.5e-6, a camera's pixel).", _LONG),
]
HalveStep = Annotated[
    bool,
    typer.Option(
        "--check-half-step", help="One repeat more with the time step halved.", rich_help_panel=_LONG
    ),
]
Chunk = Annotated[int | None, opt.count_option("Points of a task; follows from the map by default.", _LONG)]
Log = Annotated[
    Path | None,
    typer.Option("--log", help="Text file to append the progress to.", rich_help_panel=_LONG, metavar="FILE"),
]

_KEPT = {"refine": int, "replicas": int, "perturbation_rms": float, "check_half_step": bool}
_OPTIONS: dict[str, tuple[Any, Any]] = {
    "store": (None, StoreOption),
    "verify": (False, Verify),
    "cluster": (None, ClusterOption),
    "refine": (None, Refine),
    "replicas": (None, Replicates),
    "perturbation_rms": (None, ReplicaSize),
    "check_half_step": (False, HalveStep),
    "chunk": (None, Chunk),
    "log": (None, Log),
}


def with_keeping(function: Callable[..., Any]) -> Callable[..., Any]:
    """Give a command the options of sweeps that take long; it gets them as a mapping ``keeping``."""
    own = {
        name: parameter
        for name, parameter in inspect.signature(function, eval_str=True).parameters.items()
        if name != "keeping"
    }

    def command(**arguments: Any) -> Any:
        keeping = {name: arguments.pop(name) for name in _OPTIONS}
        return function(keeping=keeping, **arguments)

    added = [
        inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY, default=default, annotation=kind)
        for name, (default, kind) in _OPTIONS.items()
    ]
    kept = [parameter.replace(kind=inspect.Parameter.KEYWORD_ONLY) for parameter in own.values()]
    command.__name__, command.__doc__, command.__module__ = (
        function.__name__,
        function.__doc__,
        function.__module__,
    )
    command.__signature__ = inspect.Signature(kept + added)  # type: ignore[attr-defined]
    return command


def is_long(keeping: Mapping[str, Any]) -> bool:
    """Whether anything but a log was asked for."""
    return any(value not in (None, False) for name, value in keeping.items() if name != "log")


def sweep_options(keeping: Mapping[str, Any]) -> dict[str, Any]:
    """What a sweep is asked for beside its store."""
    from snapbeam.core.validate import integer
    from snapbeam.sweeps.replicas import MEASURING_ERROR, Replicates

    repeats = None
    count = 0 if keeping["replicas"] is None else integer("replicas", keeping["replicas"], 0, 10_000)
    if count or keeping["check_half_step"]:
        size = MEASURING_ERROR if keeping["perturbation_rms"] is None else keeping["perturbation_rms"]
        repeats = Replicates(count, size, bool(keeping["check_half_step"]))
    return {"cluster": keeping["cluster"], "refine_levels": keeping["refine"] or 0, "replicas": repeats}


def resumed(given: Mapping[str, Any], keeping: dict[str, Any], settings: Config) -> Config:
    """The parameters of the store that is named, with those that are given laid over them.

    So a store is resumed by its name alone, and what is given beside it is compared with what the store holds, not with
    the paper's beam.  Options that the store keeps are put into *keeping* where they were left out.
    """
    from snapbeam.config import config_from_mapping, override
    from snapbeam.core.validate import InputError
    from snapbeam.sweeps.keep.description import read_stored_config

    if keeping["store"] is None:
        return settings
    kept = read_stored_config(keeping["store"])
    if kept is None:
        return settings
    options = kept.get("options", {})
    if not isinstance(kept.get("parameters"), dict) or not isinstance(options, dict):
        raise InputError(f"store = {str(keeping['store'])!r}: keeps no parameters that can be read")
    for name, kind in _KEPT.items():
        if not keeping[name] and isinstance(options.get(name), kind):
            keeping[name] = options[name]
    own = config_from_mapping(kept["parameters"], source=f"{keeping['store'].name}/map.json")
    return override(own, settings.to_mapping())


def kept_config(settings: Config, keeping: Mapping[str, Any]) -> dict[str, Any]:
    """What a store keeps so that it can be resumed by its name alone."""
    import numpy as np

    options = {name: keeping[name] for name in _KEPT if keeping[name]}
    plain = {
        section: {
            name: value.tolist() if isinstance(value, np.ndarray) else value for name, value in values.items()
        }
        for section, values in settings.to_mapping().items()
    }
    return {"parameters": plain, "options": options}


class LongReport:
    """Progress for a person: a bar on a terminal, lines elsewhere, and lines with the time in a log file."""

    _INTERVAL = 30.0

    def __init__(self, bar: Any, log: Path | None) -> None:
        self._bar = bar
        self._log = log
        self._start = self._last = time.monotonic()
        self._found = 0
        self._before: int | None = None
        self._quiet = True

    def note(self, text: str) -> None:
        """Say something once."""
        notes().print(text, markup=False)
        self.log(text)

    def progress(self, done: int, total: int) -> None:
        """Say how far the present stage is."""
        now = time.monotonic()
        if self._before is None or done < self._before:
            self._start, self._found = now, done
        finished = done >= total and done != self._before
        self._before = done
        self._bar(done, total)
        if finished or self._quiet or now - self._last >= self._INTERVAL:
            self._last, self._quiet = now, False
            share = 100.0 * done / max(total, 1)
            text = f"{done} of {total} points ({share:.1f} %)"
            if done > self._found:
                text += f", {pace(done, total, now - self._start, found=self._found)}"
            self.log(text)

    def log(self, text: str) -> None:
        """Append a line with the time to the log file, if there is one."""
        if self._log is None:
            return
        from snapbeam.core.provenance import created_now

        try:
            with self._log.open("a", encoding="utf-8") as stream:
                stream.write(f"{created_now()}  {text}\n")
        except OSError as error:  # no reason to give up what is computed
            where, self._log = self._log, None
            self.note(f"log {str(where)!r}: cannot be written any more, {error.strerror or error}")


@contextmanager
def report(total: int, log: Path | None, store: Path | None) -> Iterator[LongReport]:
    """Give a report of a map of *total* points; refuse, before any work, a log that cannot be written."""
    from snapbeam.core.files import check_writable

    if log is not None:
        check_writable(log, "log", appended=True)
    with progress(total) as bar:
        said = LongReport(bar, log)
        said.log(f"map of {total} points")
        try:
            yield said
        except KeyboardInterrupt:
            said.note(
                "stopped; nothing is kept: with --checkpoint FOLDER it could go on from here another time"
                if store is None
                else "stopped; what the store holds is kept, and the same command goes on from there"
            )
            raise


def tally_lines(tally: SweepReport, store: Path | None, elapsed: float) -> list[str]:
    """Return what happened, in words."""
    lines = []
    if store is not None:
        lines.append(f"{tally.runs} runs computed in {duration(elapsed)}")
        lines.append(
            f"Store {store}: {tally.tasks} tasks, {tally.resumed} done before, {tally.computed} computed now, "
            f"{len(tally.damaged)} damaged, {len(tally.failed)} given up"
        )
    if tally.missing:
        lines.append(f"{tally.missing} tasks were never computed; without --check-checkpoint they will be")
    lines += [f"given up: {stage} task {task} {reason}" for stage, task, reason in tally.failed]
    return lines
