"""What a person sees while and after something is computed."""

from __future__ import annotations

import functools
import logging
import time
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import ParamSpec, TypeVar

import typer
from rich.console import Console
from rich.markup import escape
from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress,
    ProgressColumn,
    Task,
    TextColumn,
)
from rich.text import Text

from snapbeam.core.validate import InputError

__all__ = [
    "FAILED",
    "INTERRUPTED",
    "REFUSED",
    "compiling_told",
    "counted",
    "door",
    "duration",
    "errors",
    "file_line",
    "out",
    "pace",
    "progress",
]

FAILED = 1
REFUSED = 2
INTERRUPTED = 130

_P = ParamSpec("_P")
_R = TypeVar("_R")


def out() -> Console:
    """Return the console of results, standard output."""
    return Console(highlight=False, soft_wrap=True)


def errors() -> Console:
    """Return the console of messages, standard error."""
    return Console(stderr=True, highlight=False, soft_wrap=True)


def door(command: Callable[_P, _R]) -> Callable[_P, _R]:
    """End a command that cannot go on with one clear line, and with the exit status that says why."""

    @functools.wraps(command)
    def guarded(*args: _P.args, **kwargs: _P.kwargs) -> _R:
        try:
            with warnings.catch_warnings():
                warnings.showwarning = _show_warning  # type: ignore[assignment]
                return command(*args, **kwargs)
        except InputError as error:
            errors().print(f"[bold red]error:[/] {escape(str(error))}")
            raise typer.Exit(REFUSED) from None
        except BrokenPipeError:
            raise
        except OSError as error:
            errors().print(f"[bold red]error:[/] {escape(str(error))}")
            raise typer.Exit(FAILED) from None
        except KeyboardInterrupt:
            errors().print("interrupted; no file was left half written")
            raise typer.Exit(INTERRUPTED) from None

    return guarded


def _show_warning(message: Warning | str, category: type[Warning], *_: object) -> None:
    errors().print(f"[bold yellow]note:[/] {escape(str(message))}")


def duration(seconds: float) -> str:
    """Return seconds in words: ``4.2 s``, ``3 min 20 s``, ``2 h 5 min``."""
    if seconds < 10.0:
        return f"{seconds:.1f} s"
    whole = round(seconds)
    if whole < 60:
        return f"{whole} s"
    if whole < 3600:
        return f"{whole // 60} min {whole % 60} s"
    return f"{whole // 3600} h {whole % 3600 // 60} min"


def file_line(path: Path) -> str:
    """Return a file's name and size."""
    size = path.stat().st_size
    text = f"{size / 1e6:.2f} MB" if size >= 1e5 else f"{size / 1e3:.1f} kB"
    return f"{escape(str(path))} ({text})"


class _RateColumn(ProgressColumn):
    def __init__(self, what: str) -> None:
        super().__init__()
        self.what = what

    def render(self, task: Task) -> Text:
        if not task.completed or not task.elapsed or task.total is None:
            return Text("starting")
        return Text(pace(int(task.completed), int(task.total), task.elapsed, self.what))


def pace(done: int, total: int, elapsed: float, what: str = "points") -> str:
    """Return points, or whatever else is counted, per second and the time left, in words."""
    rate = done / max(elapsed, 1e-9)
    left = f", {duration((total - done) / rate)} left" if 0 < done < total else ""
    return f"{rate:.3g} {what}/s{left}"


def counted(count: int, what: str = "points") -> str:
    """A number of things, in words: ``1 point``, ``256 points``."""
    return f"{count} {what.removesuffix('s') if count == 1 else what}"


@contextmanager
def progress(
    total: int | None, task: str = "map", what: str = "points"
) -> Iterator[Callable[[int, int], None]]:
    """Give a function of (points done, points in all) that shows how far it is, how fast, and what is left.

    *total* is None where it is not known before, *task* names the work, *what* is counted.  A bar on a terminal;
    elsewhere a line for each tenth of the work.  The time before the first call, in which an engine may be compiled,
    is not counted.
    """
    console = errors()
    if console.is_terminal:
        columns = (TextColumn(task), BarColumn(), MofNCompleteColumn(), _RateColumn(what))
        with Progress(*columns, console=console, transient=True) as bar, compiling_told(bar.console):
            shown = bar.add_task(task, total=total, start=False)

            def update(done: int, all_of_them: int) -> None:
                bar.start_task(shown)
                bar.update(shown, completed=done, total=all_of_them)

            yield update
    else:
        with compiling_told(console):
            yield _Lines(console, total, what)


@contextmanager
def compiling_told(console: Console) -> Iterator[None]:
    """Show what the engines log, which is when they are compiled."""
    log = logging.getLogger("snapbeam")
    handler = _Handler(console)
    before = log.level
    log.addHandler(handler)
    log.setLevel(min(before, logging.INFO) if before else logging.INFO)
    try:
        yield
    finally:
        log.removeHandler(handler)
        log.setLevel(before)


class _Handler(logging.Handler):
    def __init__(self, console: Console) -> None:
        super().__init__(logging.INFO)
        self.console = console

    def emit(self, record: logging.LogRecord) -> None:
        self.console.print(record.getMessage(), markup=False)


class _Lines:
    def __init__(self, console: Console, total: int | None, what: str) -> None:
        self.console = console
        self.what = what
        self.total: int | None = None
        if total is not None:
            self._begin(total)

    def _begin(self, total: int) -> None:
        self.total = total
        self.start: float | None = None
        self.tenths = 0
        self.console.print(f"{counted(total, self.what)} to compute")

    def __call__(self, done: int, total: int) -> None:
        if total != self.total:
            self._begin(total)
        if self.start is None:
            self.start = time.monotonic()
        tenths = 10 * done // total if total else 10
        if tenths <= self.tenths:
            return
        self.tenths = tenths
        spent = pace(done, total, time.monotonic() - self.start, self.what)
        self.console.print(f"{done} of {counted(total, self.what)}, {spent}")
