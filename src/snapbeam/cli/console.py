"""Output of the commands: messages, progress, JSON, result files and figures."""

from __future__ import annotations

import functools
import inspect
import io
import json
import math
import os
import shlex
import sys
import warnings
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
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
from snapbeam.cli.short_help import wants_all
from snapbeam.util.files import VERSION, atomic_path, check_writable, foreign_files_kept, require_room
from snapbeam.util.interrupts import WORDS, during_command
from snapbeam.util.memory_limit import limit, not_sufficient, sufficient
from snapbeam.util.packages import extra_of, needs
from snapbeam.util.validation import InputError, printable, text
from snapbeam.util.work_rate import WorkRate

if TYPE_CHECKING:
    import xarray as xr

FAILED = 1
REFUSED = 2
INTERRUPTED = 130

_P = ParamSpec("_P")
_R = TypeVar("_R")


@dataclass
class _OutputOptions:
    """Output options of the running command, and its results so far."""

    quiet: bool = False
    json: Path | None = None
    given: frozenset[str] = frozenset()
    found: dict[str, Any] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)
    """Warnings of the command, which its JSON contains too."""

    @property
    def silent(self) -> bool:
        """True if only JSON may be written to standard output."""
        return self.quiet or self.json == Path("-")


_OUTPUT_OPTIONS: ContextVar[_OutputOptions] = ContextVar("asked", default=_OutputOptions())  # noqa: B039  a default that is never changed

_JSON = Annotated[
    Path | None,
    typer.Option(
        "--json", help="JSON file to write the results to; without a name, or with -, standard output instead of text.",
        rich_help_panel="Output", metavar="FILE",
    ),
]  # fmt: skip
_QUIET = Annotated[bool, typer.Option("--quiet", "-q", help="Print errors only.", rich_help_panel="Output")]
_FORCE = Annotated[
    bool,
    typer.Option(
        "--force", help="Overwrite files that snapbeam did not write, input files, and results of other parameters.", rich_help_panel="Output"
    ),
]  # fmt: skip

_STYLE = Annotated[
    str | None,
    typer.Option(
        "--style", help="Widths and letters of figures: elsevier, ieee, nature or slides, as of snapbeam.plot.plot_style.",
        rich_help_panel="Output", metavar="NAME",
    ),
]  # fmt: skip


def _print_all_options(ctx: typer.Context, wanted: bool) -> None:
    if wanted:
        wants_all(ctx)
        typer.echo(ctx.get_help(), color=ctx.color)
        raise typer.Exit


_HELP_ALL = Annotated[
    bool,
    typer.Option(
        "--help-all", help="Show all options and exit.", is_eager=True, callback=_print_all_options
    ),
]  # fmt: skip


def out() -> Console:
    """Return the console of results: standard output, or a console that discards text with --quiet or --json -."""
    silent = _OUTPUT_OPTIONS.get().silent
    return Console(highlight=False, soft_wrap=True, file=io.StringIO() if silent else None)


def add_json(**found: Any) -> None:
    """Add results of a command as plain values for ``--json``."""
    _OUTPUT_OPTIONS.get().found.update(found)


def write_json_now(**found: Any) -> None:
    """Add results and write the JSON now, for a command that runs until it is stopped."""
    asked = _OUTPUT_OPTIONS.get()
    if asked.json is not None:
        write_json(asked.json, asked.found | found | {"notes": asked.notes})
        asked.found.clear()


def write_json(path: Path, found: Mapping[str, Any]) -> None:
    """Write plain values to a JSON file, atomically, or for ``-`` to standard output; what is not finite is null."""
    text = json.dumps({VERSION: __version__} | _plain(found), indent=2, ensure_ascii=False, allow_nan=False) + "\n"
    text = text.encode("utf-8", "backslashreplace").decode()  # a name that is not UTF-8: an escape of JSON
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
    """Return the console of notes: standard error, or a console that discards text with --quiet."""
    return Console(
        stderr=True, highlight=False, soft_wrap=True, file=io.StringIO() if _OUTPUT_OPTIONS.get().quiet else None
    )


def _folder_gone() -> str:
    """Message if the working folder does not exist any more, otherwise an empty text."""
    try:
        os.getcwd()
    except FileNotFoundError:
        return (
            f"working folder = {os.environ.get('PWD', '')!r}: does not exist any more; change to a folder that exists"
        )
    return ""


def cli_command(command: Callable[_P, _R]) -> Callable[_P, _R]:
    """Report errors of a command in one line and exit with the matching status.

    The decorator adds ``--quiet``, ``--force``, ``--help-all`` and ``--json``.  The JSON file contains the values that
    the command passes to :func:`add_json`.
    """
    signature = inspect.signature(command, eval_str=True)

    @functools.wraps(command)
    def guarded(*args: _P.args, **kwargs: _P.kwargs) -> _R:
        context: Any = kwargs.pop("context")
        kept = foreign_files_kept(
            _named(kwargs.values()),
            defaults=_defaults(kwargs, context),
            request={name: value for name, value in kwargs.items() if name not in _NO_PARAMETERS},
            force=bool(kwargs.pop("force", False)),
        )
        kwargs.pop("help_all", None)
        quiet, path, style = bool(kwargs.pop("quiet", False)), kwargs.pop("json", None), kwargs.pop("style", None)
        given = frozenset(name for name in kwargs if not _is_default(name, context))
        asked = _OutputOptions(quiet, path if isinstance(path, Path) else None, given)
        token = _OUTPUT_OPTIONS.set(asked)
        try:
            with during_command(), warnings.catch_warnings(), kept:
                warnings.showwarning = _show_warning  # type: ignore[assignment]
                if asked.json is not None and asked.json != Path("-"):
                    check_writable(asked.json, "json", (".json",))
                _check_texts(kwargs)
                try:
                    with _styled(None if style is None else str(style)):
                        return command(*args, **kwargs)
                finally:
                    if asked.json is not None and asked.found:
                        write_json(asked.json, asked.found | {"notes": asked.notes})
        except InputError as error:
            errors().print(f"[bold red]error:[/] {escape(str(error))}")
            raise typer.Exit(REFUSED) from None
        except ModuleNotFoundError as error:
            if (extra := extra_of(error.name)) is None:
                raise
            errors().print(f"[bold red]error:[/] {escape(needs(context.command_path, error.name, extra))}")
            raise typer.Exit(REFUSED) from None
        except BrokenPipeError:
            raise
        except OSError as error:
            errors().print(f"[bold red]error:[/] {escape(printable(_folder_gone() or str(error)))}")
            raise typer.Exit(FAILED) from None
        except MemoryError as error:
            errors().print(f"[bold red]error:[/] {escape(not_sufficient(printable(str(error))))}")
            raise typer.Exit(FAILED) from None
        except RuntimeError as error:
            if "start new thread" not in str(error):
                raise
            words = "the system starts no further threads; end other programs"
            if limit() < sufficient():
                words = not_sufficient("no further threads")
            errors().print(f"[bold red]error:[/] {escape(words)}")
            raise typer.Exit(FAILED) from None
        except KeyboardInterrupt:
            errors().print(WORDS)
            raise typer.Exit(INTERRUPTED) from None
        finally:
            _OUTPUT_OPTIONS.reset(token)

    more = [
        inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY, default=False, annotation=kind)
        for name, kind in (("quiet", _QUIET), ("force", _FORCE), ("help_all", _HELP_ALL))
    ]
    if _draws(signature):
        more.append(inspect.Parameter("style", inspect.Parameter.KEYWORD_ONLY, default=None, annotation=_STYLE))
    more.append(inspect.Parameter("context", inspect.Parameter.KEYWORD_ONLY, annotation=typer.Context))
    more.append(inspect.Parameter("json", inspect.Parameter.KEYWORD_ONLY, default=None, annotation=_JSON))
    mine = [each.replace(kind=inspect.Parameter.KEYWORD_ONLY) for each in signature.parameters.values()]
    guarded.__signature__ = inspect.Signature(mine + more)  # type: ignore[attr-defined]
    guarded.__annotations__ = {}
    return guarded


def _draws(signature: inspect.Signature) -> bool:
    """Return whether an option of a command names a figure."""
    texts = (
        getattr(each, "help", "")
        for own in signature.parameters.values()
        for each in getattr(own.annotation, "__metadata__", ())
    )
    return any(str(text).startswith("Figure ") for text in texts)


@contextmanager
def _styled(style: str | None) -> Iterator[None]:
    """Draw in a style of :func:`snapbeam.plot.plot_style` in the block."""
    if style is None:
        yield
        return
    from snapbeam.plot.style import plot_style

    try:
        plot_style(style)
    except InputError as error:
        raise InputError(str(error).replace("name", "style", 1)) from None
    try:
        yield
    finally:
        plot_style("elsevier")


def _check_texts(arguments: Mapping[str, Any]) -> None:
    """Refuse arguments that no attribute of a file can hold; names of files may have any bytes."""
    for name, value in arguments.items():
        if isinstance(value, Mapping):
            _check_texts(value)
        for each in value if isinstance(value, (list, tuple)) else [value]:
            if isinstance(each, str):
                text(f"{name} (--{name.replace('_', '-')})", each)


_NO_PARAMETERS = frozenset(
    "output plot variable measurements quasi_static_line statistic picture frame report video video_every figure style json "
    "quiet force help_all threads yes estimate_cost checkpoint check_checkpoint cluster points_per_task log".split()
)
"""Arguments of commands that do not change the numbers of a result."""


def _defaults(arguments: Mapping[str, Any], context: typer.Context) -> list[Path]:
    """The paths among the arguments of a command that were not given."""
    return [each for name, each in arguments.items() if isinstance(each, Path) and _is_default(name, context)]


def _is_default(name: str, context: typer.Context) -> bool:
    return getattr(context.get_parameter_source(name), "name", "") == "DEFAULT"


def given_options() -> frozenset[str]:
    """Names of the options that the user of the running command gave."""
    return _OUTPUT_OPTIONS.get().given


def _named(values: Iterable[Any]) -> list[Path]:
    """The paths among the arguments of a command."""
    listed = [each for value in values for each in (value if isinstance(value, (list, tuple)) else [value])]
    return [each for each in listed if isinstance(each, Path)]


def _show_warning(message: Warning | str, category: type[Warning], *_: object) -> None:
    text = printable(str(message))
    _OUTPUT_OPTIONS.get().notes.append(text)
    errors().print(f"[bold yellow]note:[/] {escape(text)}")


def duration(seconds: float) -> str:
    """Return seconds as text: ``4.2 s``, ``3 min 20 s``, ``2 h 5 min``."""
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
    return f"{escape(printable(str(path)))} ({text})"


class _RateColumn(ProgressColumn):
    def __init__(self, what: str) -> None:
        super().__init__()
        self.what = what
        self.rate = WorkRate()

    def render(self, task: Task) -> Text:
        if self.rate.per_second is None or task.total is None:
            return Text("starting")
        return Text(pace(int(task.completed), int(task.total), self.rate, self.what))


def pace(done: int, total: int, rate: WorkRate, what: str = "points") -> str:
    """Return the rate and the remaining time as text; empty while the rate is not known."""
    speed = rate.per_second
    if speed is None:
        return ""
    left = f", {duration((total - done) / speed)} left" if done < total else ""
    return f"{float(f'{speed:.3g}'):g} {what}/s{left}"


def count_text(count: int, what: str = "points") -> str:
    """A number of things as text: ``1 point``, ``256 points``."""
    return f"{count} {what.removesuffix('s') if count == 1 else what}"


@contextmanager
def progress(total: int | None, task: str = "map", what: str = "points") -> Iterator[Callable[[int, int], None]]:
    """Give a function of (done, total) that shows progress, rate and remaining time.

    *total* is None if it is not known in advance, *task* names the work, *what* names the counted things.  A terminal
    shows a bar; other outputs get a line for each tenth of the work.  The rate leaves out the results that existed
    before the first call, and the time before it.
    """
    console = errors()
    if _OUTPUT_OPTIONS.get().quiet:
        yield lambda done, all_of_them: None
    elif console.is_terminal:
        speed = _RateColumn(what)
        columns = (TextColumn(task), BarColumn(), MofNCompleteColumn(), speed)
        with Progress(*columns, console=console, transient=True) as bar:
            shown = bar.add_task(task, total=total, start=False)

            def update(done: int, all_of_them: int) -> None:
                if not bar.tasks[0].started:
                    bar.start_task(shown)
                speed.rate.report(done)
                bar.update(shown, completed=done, total=all_of_them)

            yield update
    else:
        yield _Lines(console, total, what)


class _Lines:
    def __init__(self, console: Console, total: int | None, what: str) -> None:
        self.console = console
        self.what = what
        self.total = total
        self.tenths = 0
        self.rate = WorkRate()
        if total is not None:
            self.console.print(f"{count_text(total, what)} to compute")

    def __call__(self, done: int, total: int) -> None:
        if total != self.total:
            begun = self.total is not None
            less = self.total is not None and total < self.total
            self.console.print(f"{count_text(total, self.what)} {'remain' if less else 'to compute'}")
            self.total, self.tenths = total, 10 * done // total if begun and total else 0
        self.rate.report(done)
        tenths = 10 * done // total if total else 10
        if tenths <= self.tenths:
            return
        self.tenths = tenths
        texts = (f"{done} of {count_text(total, self.what)}", pace(done, total, self.rate, self.what))
        self.console.print(", ".join(filter(None, texts)))


# ----------------------------------------------------------------------------------------------------
# Result files and figures.


def open_result(file: Path) -> xr.Dataset:
    """Return the dataset of a result file, or of a result in it (``FILE.nc:GROUP``), read into memory."""
    from snapbeam.util.netcdf import read_result

    return read_result(file, "file")


def check_pictures(*pictures: tuple[str, Path | None]) -> None:
    """Raise an error, before any computation, if a figure file cannot be written."""
    for name, path in pictures:
        if path is not None:
            from snapbeam.plot.style import FIGURE_SUFFIXES

            check_writable(path, name, FIGURE_SUFFIXES)
            require_room(path, least_picture_size(path), name)


def check_outputs(output: Path, plot: Path | None, suffixes: tuple[str, ...] = (".nc",), begin: str = "") -> None:
    """Refuse, before any computation, results and figures that cannot be written; *begin* begins such tables."""
    if output.suffix.lower() == ".csv" and ".csv" not in suffixes:
        name = shlex.quote(str(output.with_suffix(".nc")))
        raise InputError(
            f"output = {str(output)!r}: must end in {' or '.join(suffixes)}; write a table of it afterwards by "
            f"snapbeam info {name} --export {shlex.quote(str(output))}"
        )
    check_writable(output, "output", suffixes, begin)
    check_pictures(("plot", plot))


def print_written(lines: Iterable[str], files: Iterable[Path]) -> None:
    """Print the lines of a result, and the files that were written."""
    out().print(*lines, *(f"Written: {file_line(path)}" for path in files), sep="\n")


_LEAST_SIZES = {".png": 35e3, ".pdf": 10e3, ".svg": 8e3, ".gif": 300e3, ".mp4": 50e3}
"""Half of the sizes of the smallest figures and animations of the commands, bytes."""


def least_picture_size(path: Path) -> float:
    """Size in bytes below which no figure or animation of a command is."""
    return _LEAST_SIZES.get(path.suffix.lower(), 0.0)


def read_overlay(measurements: Path | None, reference_frequency: float | None, buckling_level: float | None) -> Any:
    """Return the measured points of a CSV file, normalised, or None."""
    if measurements is None:
        return None
    from snapbeam.sweeps.measured_points import read_measured_points

    return read_measured_points(measurements, reference_frequency=reference_frequency, buckling_level=buckling_level)


def write_map(dataset: xr.Dataset, path: Path) -> Path:
    """Write a dataset to a NetCDF file (atomically)."""
    from snapbeam.util.netcdf import write_netcdf

    write_netcdf(dataset, path)
    return path


def write_result(dataset: xr.Dataset, path: Path, found: Mapping[str, Any]) -> Path:
    """Write a dataset to a NetCDF file or a table, or its plain values to a JSON file, by the suffix."""
    from snapbeam.util.tables import write_table

    if path.suffix.lower() == ".nc":
        return write_map(dataset, path)
    if path.suffix.lower() == ".json":
        write_json(path, found)
    else:
        write_table(dataset, path)
    return path


@contextmanager
def kept_if_not_drawn(again: Callable[[str], str], kept: Path | None, save: Callable[[Path], object]) -> Iterator[None]:
    """In the block, add to an error that the numbers are in *kept*, or written now by *save*, and how to draw them.

    *again* returns the command that draws a file of them.
    """
    try:
        yield
    except (OSError, MemoryError, InputError) as error:
        there = kept if kept is not None else _rescued(save)
        if there is None:
            raise
        words = not_sufficient() if isinstance(error, MemoryError) else str(error)
        words = f"{words}.  The numbers are in {str(there)!r}"
        if isinstance(error, InputError):  # would be refused again
            raise InputError(words) from error
        raise OSError(f"{words}; draw them with: {again(str(there))}") from error


def _rescued(save: Callable[[Path], object]) -> Path | None:
    """A temporary file with numbers that are in no other; None if it cannot be written."""
    import tempfile

    try:
        handle, name = tempfile.mkstemp(prefix="snapbeam-", suffix=".nc")
    except OSError:
        return None
    os.close(handle)
    try:
        save(Path(name))
    except (OSError, MemoryError):
        os.unlink(name)
        return None
    return Path(name)


def draw(dataset: xr.Dataset, path: Path, variable: str | None = None, **options: Any) -> Path:
    """Draw a result of any kind to a figure file, as ``dataset.snapbeam.plot`` does."""
    import matplotlib

    matplotlib.use("Agg")
    from snapbeam.plot.dataset import plot_dataset
    from snapbeam.plot.style import save_figure

    return save_figure(plot_dataset(dataset, variable, **options), path)


def draw_computed(
    dataset: xr.Dataset,
    path: Path,
    kept: Path | None,
    variable: str | None = None,
    *,
    save: Callable[[Path], object] | None = None,
    **options: Any,
) -> Path:
    """Draw a result that the command has computed, as :func:`draw`; errors as of :func:`kept_if_not_drawn`."""
    save = functools.partial(write_map, dataset) if save is None else save
    with kept_if_not_drawn(
        lambda file: plot_command(file, path, variable, options.get("window"), options.get("over")), kept, save
    ):
        return draw(dataset, path, variable, **options)


def plot_command(
    file: str,
    path: Path,
    variable: str | None = None,
    window: tuple[float, float] | None = None,
    over: str | None = None,
) -> str:
    """The command that draws a result file."""
    words = ["snapbeam", "plot", file, "-o", str(path)]
    words += [] if variable is None else ["--variable", variable]
    words += [] if over is None else ["--over", over]
    words += [] if window is None else ["--window", f"{window[0]:.12g}:{window[1]:.12g}"]
    return shlex.join(words)
