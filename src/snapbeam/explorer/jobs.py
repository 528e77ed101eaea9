"""Background jobs of a page: newest first, cancelled by a new request.

The native core lets go of Python's lock, so that threads are enough.  A job hears that it is cancelled where it reports its
progress; a window's next batch waits while a run, which a person waits for, is computed.
"""

from __future__ import annotations

import logging
import mimetypes
import tempfile
import threading
import time
import traceback
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import AbstractContextManager, contextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import panel as pn
from bokeh.document import Document
from bokeh.models import ColumnDataSource, CustomJS
from numpy.typing import NDArray

import snapbeam as sb
from snapbeam import CheckpointError, InputError, Integration, Run, RunStatus, System

_LOG = logging.getLogger("snapbeam.explorer")


class Cancelled(Exception):
    """The work is not wanted any more."""


@dataclass(eq=False)
class Token:
    """Cancellation token of a job, with a time limit."""

    seconds: float = float("inf")
    begun: float = field(default_factory=time.monotonic)
    event: threading.Event = field(default_factory=threading.Event)
    reported: bool = False

    def begin(self) -> None:
        """The work begins."""
        self.begun, self.reported = time.monotonic(), False

    def cancel(self) -> None:
        """Stop it at its next report."""
        self.event.set()

    @property
    def cancelled(self) -> bool:
        """True if cancellation was requested."""
        return self.event.is_set()

    def check(self, *report: Any) -> None:
        """Go on, or not.

        Raises
        ------
        Cancelled
            If cancellation was requested.
        InputError
            If it has taken longer than a page may ask for.
        """
        if self.event.is_set():
            raise Cancelled
        if report and not self.reported:
            self.begun, self.reported = time.monotonic(), True
        if time.monotonic() - self.begun > self.seconds:
            raise InputError(f"given up after {self.seconds:g} s, the longest that a page may ask for")


class Jobs:
    """Threads that the pages of one server share."""

    def __init__(self) -> None:
        sizes = {"run": 2, "window": 8, "export": 3}  # a picture need not wait for an animation
        self._pools = {name: ThreadPoolExecutor(size, f"snapbeam-{name}") for name, size in sizes.items()}
        self._waiting = 0
        self._free = threading.Condition()
        self._turns = threading.Condition()
        self._queue: list[object] = []

    def run(self, work: Callable[[Token], Any], done: Callable[[Any, str], None], token: Token) -> None:
        """Do *work* at once; then ``done(result, words)``, one of the two empty, on the thread that did it."""
        with self._free:
            self._waiting += 1

        def guarded() -> None:
            try:
                _guarded(work, done, token)
            finally:
                with self._free:
                    self._waiting -= 1
                    self._free.notify_all()

        self._pools["run"].submit(guarded)

    def window(self, work: Callable[[Token], Any], done: Callable[[Any, str], None], token: Token) -> None:
        """Do *work* when nothing more urgent is to be done."""
        self._pools["window"].submit(_guarded, work, done, token)

    def export(self, work: Callable[[Token], Any], done: Callable[[Any, str], None], token: Token) -> None:
        """Make a file."""
        self._pools["export"].submit(_guarded, work, done, token)

    def give_way(self, token: Token) -> None:
        """Wait while a run is computed."""
        with self._free:
            while self._waiting and not token.cancelled:
                self._free.wait(0.1)
        token.check()

    @contextmanager
    def turn(self, token: Token) -> Iterator[None]:
        """The turn of one batch of a window: windows of several pages take turns, first come, first served."""
        ticket = object()
        with self._turns:
            self._queue.append(ticket)
        try:
            with self._turns:
                while self._queue[0] is not ticket and not token.cancelled:
                    self._turns.wait(0.1)
            self.give_way(token)
            yield
        finally:
            with self._turns:
                self._queue.remove(ticket)
                self._turns.notify_all()

    def close(self) -> None:
        """Take no more work, and drop what has not begun."""
        for pool in self._pools.values():
            pool.shutdown(wait=False, cancel_futures=True)


def _guarded(work: Callable[[Token], Any], done: Callable[[Any, str], None], token: Token) -> None:
    token.begin()
    result, words = None, ""
    try:
        token.check()
        result = work(token)
    except Cancelled:
        return
    except (InputError, CheckpointError, OSError) as error:
        words = str(error) or type(error).__name__
    except MemoryError:
        words = "there is not enough memory for this"
    except Exception as error:  # a page says what went wrong and lives on
        _LOG.error("%s", traceback.format_exc())
        words = f"this failed, which it should not: {type(error).__name__}: {error}"
    if not token.cancelled:
        done(result, words)


# ----------------------------------------------------------------------------------------------------
# How far a run can be trusted: what becomes of a neighbour that differs by 1e-9.


NEIGHBOUR = 1e-9
"""Relative change of the striker's amplitude."""
_APART = 0.1
"""Displacement over b from which two runs count as apart."""
_MOST_CYCLES = 2000


def conditioned(run: Run, token: Token) -> str:
    """Words for it, computed of a neighbour of *run*."""
    system, integration = run.system, run.integration
    striker = system.striker
    if striker is None or not striker.drive.harmonic or run.summary.status not in (RunStatus.OK, RunStatus.EARLY_STOP):
        return ""
    cycles = integration.cycles_or_default
    if cycles > _MOST_CYCLES:
        return ""
    token.check()
    found = sb.perturbation_growth(system, integration, accuracy="standard", perturbation=NEIGHBOUR)
    token.check()
    apart = np.flatnonzero(found["separation"].values > _APART)
    amplitude = system.parameters["drive.velocity_amplitude"]
    neighbour = system.replace(**{"drive.velocity_amplitude": amplitude * (1.0 + NEIGHBOUR)})
    other: Any = sb.simulate(neighbour, integration, sample_times=[0.0], progress=token.check).summary
    same = other.response_class is run.summary.response_class and other.final_well == run.summary.final_well
    ends = "ends in the same class and well" if same else f"ends elsewhere: {other.response_class.label}"
    if not apart.size:
        near = f"a neighbour {NEIGHBOUR:.0e} away in V stays within {_APART:g} b"
        return f"well conditioned: {near} for all {cycles} cycles"
    cycle = float(found["cycle"][apart[0]])
    return f"separates after {cycle:.3g} cycles: a neighbour {NEIGHBOUR:.0e} away in V {ends}"


# ----------------------------------------------------------------------------------------------------
# What a page says while one waits: for how long so far.


_FIRST = 150
"""Milliseconds after which a wait is worth a word."""
_AGAIN = 1000


class Waiting:
    """The waits of one page; ``later(work, milliseconds)`` does something on the page's own thread a little later."""

    def __init__(self, later: Callable[[Callable[[], None], int], object]) -> None:
        self._later = later
        self._asked: dict[int, object] = {}

    def begin(self, which: int, tell: Callable[[float], None]) -> None:
        """Call ``tell(seconds)`` every second until *which* ends or begins again."""
        begun, mark = time.monotonic(), object()
        self._asked[which] = mark

        def look() -> None:
            if self._asked.get(which) is mark:
                tell(time.monotonic() - begun)
                self._later(look, _AGAIN)

        self._later(look, _FIRST)

    def end(self, which: int) -> None:
        """There is something to see, or no more to wait for."""
        self._asked.pop(which, None)


# ----------------------------------------------------------------------------------------------------
# What one page may ask of the machine that it runs on; beyond it a request is refused with words.


SESSIONS = 24
"""Open pages."""
MODES = 256
CYCLES = 20_000
SAMPLES = 120_000
"""Regular samples of a recorded run."""
SAMPLE_BYTES = 160 * 2**20
"""Bytes that those samples take."""
RUN_SECONDS = 60.0
"""A run that takes longer is given up."""
WINDOW_POINTS = 60_000
"""Points of one window that is computed."""
WINDOW_SECONDS = 1800.0
UPLOAD = 2 * 2**20
"""Bytes of a file given to the page."""
ADDRESS = 4096
"""Maximum length of the query string."""
BODY = 8 * 2**20
"""Bytes of one message from a page."""

_FEWEST = 200
"""Regular samples of a cycle of the excitation, or of the first mode, that a run is recorded with by itself."""


def too_large(name: str, size: int) -> str:
    """Words for a file that is too large for a page to give."""
    return f"{name[:80]}: has {size / 2**20:.1f} MiB; a page takes at most {UPLOAD // 2**20} MiB"


def check_run(system: System, integration: Integration) -> None:
    """Refuse a run that one page may not ask for."""
    if system.model.modes > MODES:
        raise InputError(f"model.modes = {system.model.modes}: a page may ask for at most {MODES}")
    if integration.cycles_or_default > CYCLES:
        raise InputError(f"integration.cycles = {integration.cycles_or_default}: a page may ask for at most {CYCLES}")


def sample_times(system: System, integration: Integration) -> NDArray[np.float64] | None:
    """Instants to record a run at; None if it may have all that it is recorded with by itself."""
    striker = system.striker
    if striker is None or not striker.drive.harmonic:
        return None
    ratio = float(striker.drive.frequency_ratio)  # type: ignore[attr-defined]
    cycles = integration.cycles_or_default
    most = min(SAMPLES, SAMPLE_BYTES // (8 * (4 * system.model.modes + 20)))
    if cycles * max(1.0, 1.0 / ratio) * _FEWEST <= most:
        return None
    return np.linspace(0.0, cycles / (ratio * system.model.reference_frequency), most)


# ----------------------------------------------------------------------------------------------------


class Tab:
    """One tab of a browser, with a thread of its own on which its page is changed; *doc* is the document of its session."""

    def __init__(self, doc: Document | None) -> None:
        self.doc = doc
        self.closed = False
        self._runs: dict[int, Token] = {}

    def close(self) -> None:
        """The tab is closed: compute nothing for it any more."""
        self.closed = True
        for token in self._runs.values():
            token.cancel()

    def begin_run(self, which: int = 0) -> Token:
        """The token of another run of a number; the one before is cancelled."""
        if which in self._runs:
            self._runs[which].cancel()
        self._runs[which] = token = Token(RUN_SECONDS)
        return token

    def post(self, work: Callable[[], None]) -> None:
        """Do something on the page's own thread, unless the page is closed."""
        if not self.closed and self.doc is not None:
            with suppress(Exception):  # the page was closed between the two lines
                self.doc.add_next_tick_callback(self._on_page(work))

    def later(self, work: Callable[[], None], milliseconds: int) -> None:
        """Do something a little later."""
        if not self.closed and self.doc is not None:
            self.doc.add_timeout_callback(self._on_page(work), milliseconds)

    def _on_page(self, work: Callable[[], None]) -> Callable[[], None]:
        def guarded() -> None:
            if not self.closed:
                with self._together():
                    work()

        return guarded

    def _together(self) -> AbstractContextManager[None]:
        """Context that sends all changes to the browser at once."""
        held: AbstractContextManager[None] = pn.io.hold(self.doc)
        return held


# ----------------------------------------------------------------------------------------------------
# Files that a page gives: made beside the page, handed to the browser, never written where a page says.


drawing = threading.RLock()
"""Held while Matplotlib draws, which one thread at a time may do."""
_SAVE = """
const bytes = source.data.bytes;
if (!bytes.length) { return; }
const link = document.createElement('a');
link.href = URL.createObjectURL(new Blob([Uint8Array.from(bytes)], {type: source.tags[1]}));
link.download = source.tags[0];
document.body.appendChild(link);
link.click();
link.remove();
if (source.tags[1].startsWith('audio/')) {  // heard at once
  document.querySelector('audio')?.remove();
  const sound = document.body.appendChild(new Audio(link.href));
  sound.play().catch(() => {});
}
setTimeout(() => URL.revokeObjectURL(link.href), 10000);
"""


class Downloads:
    """The way of files to the browser."""

    def __init__(self) -> None:
        self.source = ColumnDataSource({"bytes": np.zeros(0, dtype=np.uint8)}, tags=["", ""], name="download")
        self.source.js_on_change("data", CustomJS(args={"source": self.source}, code=_SAVE))

    def give(self, name: str, content: bytes) -> None:
        """Hand a file to the browser; on the page's own thread."""
        self.source.tags = [name, mimetypes.guess_type(name)[0] or "application/octet-stream"]
        self.source.data = {"bytes": np.frombuffer(content, dtype=np.uint8).copy()}


def file_bytes(suffix: str, write: Callable[[Path], object]) -> bytes:
    """Bytes that ``write(path)`` writes to a temporary file."""
    with tempfile.TemporaryDirectory(prefix="snapbeam-") as folder:
        path = Path(folder) / f"file{suffix}"
        write(path)
        return path.read_bytes()
