"""What a person sees while and after something is computed."""

from __future__ import annotations

import functools
import inspect
import io
import json
import logging
import math
import sys
import time
import warnings
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager, nullcontext
from contextvars import ContextVar
from dataclasses import dataclass, field
from enum import IntEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, ParamSpec, TypeVar

import typer
from rich.console import Console
from rich.markup import escape
from rich.progress import BarColumn, MofNCompleteColumn, Progress, ProgressColumn, Task, TextColumn
from rich.text import Text

from snapbeam._version import __version__
from snapbeam.util.files import VERSION, foreign_files_kept
from snapbeam.util.validation import InputError

if TYPE_CHECKING:
    import xarray as xr

__all__ = [
    "FAILED",
    "INTERRUPTED",
    "REFUSED",
    "answer",
    "answer_now",
    "check_pictures",
    "compiling_told",
    "counted",
    "door",
    "draw_dynamics",
    "draw_map",
    "draw_run",
    "draw_threshold",
    "duration",
    "errors",
    "file_line",
    "notes",
    "open_result",
    "out",
    "pace",
    "progress",
    "read_overlay",
    "write_json",
    "write_map",
]


FAILED = 1
REFUSED = 2
INTERRUPTED = 130

_P = ParamSpec("_P")
_R = TypeVar("_R")


@dataclass
class _Asked:
    """How a command is to speak, and what it has found so far."""

    quiet: bool = False
    json: Path | None = None
    found: dict[str, Any] = field(default_factory=dict)

    @property
    def silent(self) -> bool:
        """Whether standard output is not for words."""
        return self.quiet or self.json == Path("-")


_ASKED: ContextVar[_Asked] = ContextVar("asked", default=_Asked())  # noqa: B039  a default that is never changed

_JSON = Annotated[
    Path | None,
    typer.Option(
        "--json", help="JSON file of what was found to write; - for standard output, in place of the words.",
        rich_help_panel="Output", metavar="FILE",
    ),
]  # fmt: skip
_QUIET = Annotated[
    bool,
    typer.Option("--quiet", "-q", help="Say nothing but what went wrong.", rich_help_panel="Output"),
]
_FORCE = Annotated[
    bool,
    typer.Option(
        "--force", help="Replace files that snapbeam did not write, or that are read too.", rich_help_panel="Output"
    ),
]  # fmt: skip


def out() -> Console:
    """Return the console of results, standard output; one that nobody hears if words were not asked for."""
    silent = _ASKED.get().silent
    return Console(highlight=False, soft_wrap=True, file=io.StringIO() if silent else None)


def answer(**found: Any) -> None:
    """Say what a command found as plain values, for ``--json``."""
    _ASKED.get().found.update(found)


def answer_now(**found: Any) -> None:
    """As :func:`answer`, and write it at once: what goes on until it is stopped does not wait to be asked."""
    asked = _ASKED.get()
    if asked.json is not None:
        write_json(asked.json, asked.found | found)
        asked.found.clear()


def write_json(path: Path, found: Mapping[str, Any]) -> None:
    """Write plain numbers and words to a JSON file, whole or not at all, or, for ``-``, to standard output.

    What is not finite becomes null.  The version that wrote it comes first.
    """
    from snapbeam.util.files import atomic_path, check_writable

    text = (
        json.dumps({VERSION: __version__} | _plain(found), indent=2, ensure_ascii=False, allow_nan=False)
        + "\n"
    )
    if path == Path("-"):
        sys.stdout.write(text)
        sys.stdout.flush()
        return
    with atomic_path(check_writable(path, "json", (".json",))) as temporary:
        temporary.write_text(text, encoding="utf-8")


def _plain(value: Any) -> Any:
    if isinstance(value, Mapping):
        return {str(key): _plain(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [_plain(item) for item in value]
    if isinstance(value, Path):
        return str(value)
    if isinstance(value, IntEnum):
        return getattr(value, "label", value.name.lower())
    if hasattr(value, "tolist"):
        return _plain(value.tolist())
    if isinstance(value, float):
        return float(value) if math.isfinite(value) else None
    return value


def errors() -> Console:
    """Return the console of messages, standard error."""
    return Console(stderr=True, highlight=False, soft_wrap=True)


def notes() -> Console:
    """Return the console of what is said on the way: standard error, or nobody."""
    return Console(
        stderr=True, highlight=False, soft_wrap=True, file=io.StringIO() if _ASKED.get().quiet else None
    )


def door(command: Callable[_P, _R]) -> Callable[_P, _R]:
    """End a command that cannot go on with one clear line, and with the exit status that says why.

    Every command gets ``--quiet`` and ``--force``, and ``--json`` if it has none of its own: what it
    :func:`answer`\\ s.
    """
    signature = inspect.signature(command, eval_str=True)
    own = next((name for name, each in signature.parameters.items() if "--json" in _flags(each)), None)

    @functools.wraps(command)
    def guarded(*args: _P.args, **kwargs: _P.kwargs) -> _R:
        named = _named(kwargs.values())
        kept = nullcontext() if kwargs.pop("force", False) else foreign_files_kept(named)
        quiet, path = bool(kwargs.pop("quiet", False)), kwargs.get(own) if own else kwargs.pop("json", None)
        asked = _Asked(quiet, path if isinstance(path, Path) else None)
        token = _ASKED.set(asked)
        try:
            with warnings.catch_warnings(), kept:
                warnings.showwarning = _show_warning  # type: ignore[assignment]
                if asked.json is not None and asked.json != Path("-"):
                    from snapbeam.util.files import check_writable

                    check_writable(asked.json, "json", (".json",))
                try:
                    return command(*args, **kwargs)
                finally:
                    if asked.json is not None and own is None and asked.found:
                        write_json(asked.json, asked.found)
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
        finally:
            _ASKED.reset(token)

    more = [
        inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY, default=False, annotation=kind)
        for name, kind in (("quiet", _QUIET), ("force", _FORCE))
    ]
    if own is None:
        more.append(inspect.Parameter("json", inspect.Parameter.KEYWORD_ONLY, default=None, annotation=_JSON))
    mine = [each.replace(kind=inspect.Parameter.KEYWORD_ONLY) for each in signature.parameters.values()]
    guarded.__signature__ = inspect.Signature(mine + more)  # type: ignore[attr-defined]
    guarded.__annotations__ = {}
    return guarded


def _named(values: Iterable[Any]) -> list[Path]:
    """The files among what a command was given."""
    listed = [each for value in values for each in (value if isinstance(value, (list, tuple)) else [value])]
    return [each for each in listed if isinstance(each, Path)]


def _flags(parameter: inspect.Parameter) -> tuple[str, ...]:
    """The names that a parameter has on the command line, where they were given."""
    options = getattr(parameter.annotation, "__metadata__", ())
    # typer takes the first name for a default until it makes the command
    named = (
        (getattr(each, "default", None), *(getattr(each, "param_decls", None) or ())) for each in options
    )
    return tuple(flag for names in named for flag in names if isinstance(flag, str) and flag.startswith("-"))


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
        found = int(task.fields.get("found", 0))
        return Text(pace(int(task.completed), int(task.total), task.elapsed, self.what, found))


def pace(done: int, total: int, elapsed: float, what: str = "points", found: int = 0) -> str:
    """Return points, or whatever else is counted, per second and the time left, in words.

    Of those *done*, *found* were there before the time began.
    """
    rate = (done - found) / max(elapsed, 1e-9)
    left = f", {duration((total - done) / rate)} left" if found < done < total else ""
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
    elsewhere a line for each tenth of the work.  What was done before the first call is not counted, nor its time, in
    which an engine may be compiled.
    """
    console = errors()
    if _ASKED.get().quiet:
        yield lambda done, all_of_them: None
    elif console.is_terminal:
        columns = (TextColumn(task), BarColumn(), MofNCompleteColumn(), _RateColumn(what))
        with Progress(*columns, console=console, transient=True) as bar, compiling_told(bar.console):
            shown = bar.add_task(task, total=total, start=False)

            def update(done: int, all_of_them: int) -> None:
                if not bar.tasks[0].started:
                    bar.start_task(shown)
                    bar.update(shown, found=done)
                bar.update(shown, completed=done, total=all_of_them)

            yield update
    else:
        with compiling_told(console):
            yield _Lines(console, total, what)


@contextmanager
def compiling_told(console: Console) -> Iterator[None]:
    """Show what the engines log, which is when they are compiled."""
    if _ASKED.get().quiet:
        yield
        return
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
        self.total = total
        self.start: float | None = None
        self.found = self.tenths = 0
        if total is not None:
            self.console.print(f"{counted(total, what)} to compute")

    def __call__(self, done: int, total: int) -> None:
        if total != self.total:
            begun = self.total is not None
            self.console.print(f"{counted(total, self.what)} {'in all now' if begun else 'to compute'}")
            self.total, self.tenths = total, 10 * done // total if begun and total else 0
        if self.start is None:
            self.start, self.found = time.monotonic(), done
        tenths = 10 * done // total if total else 10
        if tenths <= self.tenths:
            return
        self.tenths = tenths
        text = f"{done} of {counted(total, self.what)}"
        if done > self.found:
            text += f", {pace(done, total, time.monotonic() - self.start, self.what, self.found)}"
        self.console.print(text)


# ----------------------------------------------------------------------------------------------------
# Results as files and pictures: what commands read, write and draw.


def open_result(file: Path) -> xr.Dataset:
    """Return the dataset in a file, read into memory; refuse what is no NetCDF file of results."""
    from snapbeam.util.netcdf import read_netcdf

    return read_netcdf(file, "file")


def check_pictures(*pictures: tuple[str, Path | None]) -> None:
    """Refuse, before any work, pictures that cannot be written."""
    from snapbeam.util.files import check_writable

    for name, path in pictures:
        if path is not None:
            from snapbeam.plot.style import FIGURE_SUFFIXES

            check_writable(path, name, FIGURE_SUFFIXES)


def read_overlay(dots: Path | None, reference_frequency: float | None, buckling_level: float | None) -> Any:
    """Return the measured points of a CSV file, normalised, or None."""
    if dots is None:
        return None
    from snapbeam.sweeps.measured_points import read_measured_points

    return read_measured_points(dots, reference_frequency=reference_frequency, buckling_level=buckling_level)


def write_map(dataset: xr.Dataset, path: Path) -> Path:
    """Write a dataset to a NetCDF file, whole or not at all."""
    from snapbeam.util.netcdf import write_netcdf

    write_netcdf(dataset, path)
    return path


def _save(drawn: Any, path: Path) -> Path:
    from snapbeam.plot.style import save_figure

    return save_figure(drawn, path)


def draw_map(dataset: xr.Dataset, path: Path, overlay: Any, threshold_line: bool) -> Path:
    """Draw a map to a picture file."""
    import matplotlib

    matplotlib.use("Agg")
    from snapbeam.plot.map import plot_response_map

    return _save(plot_response_map(dataset, dots=overlay, threshold_line=threshold_line), path)


def draw_threshold(dataset: xr.Dataset, path: Path) -> Path:
    """Draw a threshold to a picture file."""
    import matplotlib

    matplotlib.use("Agg")
    from snapbeam.plot.threshold import plot_threshold

    return _save(plot_threshold(dataset), path)


def draw_run(dataset: xr.Dataset, path: Path, window: tuple[float, float] | None) -> Path:
    """Draw a run to a picture file."""
    import matplotlib

    matplotlib.use("Agg")
    from snapbeam.plot.run import plot_run

    return _save(plot_run(dataset, window), path)


def draw_dynamics(dataset: xr.Dataset, path: Path, picture: str) -> Path:
    """Draw results of dynamics to a picture file."""
    import matplotlib

    matplotlib.use("Agg")
    from snapbeam.plot import dynamics as figures

    if picture == "branch":
        return _save(figures.plot_diagram(None, branches=[dataset]), path)
    plots: dict[str, Any] = {
        "lifetimes": figures.plot_lifetimes, "survival": figures.plot_survival, "diagram": figures.plot_diagram,
        "exponents": figures.plot_exponents, "section": figures.plot_section, "basins": figures.plot_basins,
        "edge": figures.plot_edge,
    }  # fmt: skip
    return _save(plots[picture](dataset), path)
