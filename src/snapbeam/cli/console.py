"""What a person sees while and after something is computed."""

from __future__ import annotations

import functools
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


def pace(done: int, total: int, elapsed: float, what: str = "runs") -> str:
    """Return runs, or whatever else is counted, per second and the time left, in words."""
    rate = done / max(elapsed, 1e-9)
    left = f", {duration((total - done) / rate)} left" if 0 < done < total else ""
    return f"{rate:.3g} {what}/s{left}"


@contextmanager
def progress(total: int, task: str = "map", what: str = "runs") -> Iterator[Callable[[int, int], None]]:
    """Give a function of (runs done, runs in all) that shows how far it is, how fast, and what is left.

    *task* names the work, *what* is counted.  A bar on a terminal; elsewhere a line for each tenth of the work.
    """
    console = errors()
    if console.is_terminal:
        columns = (TextColumn(task), BarColumn(), MofNCompleteColumn(), _RateColumn(what))
        with Progress(*columns, console=console, transient=True) as bar:
            shown = bar.add_task(task, total=total)
            yield lambda done, all_of_them: bar.update(shown, completed=done, total=all_of_them)
    else:
        console.print(f"{total} {what} to compute")
        yield _Lines(console, what)


class _Lines:
    def __init__(self, console: Console, what: str) -> None:
        self.console = console
        self.what = what
        self.start = time.monotonic()
        self.tenths = 0

    def __call__(self, done: int, total: int) -> None:
        tenths = 10 * done // total if total else 10
        if tenths <= self.tenths:
            return
        self.tenths = tenths
        spent = pace(done, total, time.monotonic() - self.start, self.what)
        self.console.print(f"{done} of {total} {self.what}, {spent}")
