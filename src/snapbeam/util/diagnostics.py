"""Diagnostics: findings about an input or a result, as data; printing, storing and raising them."""

from __future__ import annotations

import json
import math
import sys
import threading
import time
import warnings
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from types import FrameType
from typing import Any

from snapbeam.util import validation
from snapbeam.util.validation import InputError, InputTypeError, choice, shown
from snapbeam.util.work_rate import WorkRate

_INTERVAL = 0.2
_WAIT = 2.0
"""Seconds after which a computation without *progress* shows it to a person who waits."""
_Counts = Callable[[int, int], object]
_Shares = Callable[[float], object]


class DiagnosticWarning(UserWarning):
    """Warning about an input that is valid but probably not intended.

    Examples
    --------
    >>> import warnings
    >>> import snapbeam as sb
    >>> warnings.simplefilter("error", sb.DiagnosticWarning)  # a doubtful input then ends the script
    >>> warnings.resetwarnings()
    """


class Severity(StrEnum):
    """Severity of a diagnostic.

    INFO: information only. WARNING: the numbers may not be what you intended, or the errors may exceed the
    standard errors, which are increased where possible. ERROR: the numbers contradict known facts.

    Examples
    --------
    >>> from snapbeam import lab
    >>> [each.value for each in lab.Severity]
    ['info', 'warning', 'error']
    """

    INFO = "info"
    WARNING = "warning"
    ERROR = "error"


@dataclass(frozen=True)
class Diagnostic:
    """One finding about an input or a result that needs attention.

    Attributes
    ----------
    code : str
        Short name, stable over versions, such as ``"first-mode-antisymmetric"`` or ``"camera.gamma"``, by which
        programs tell diagnostics apart.
    message : str
        Cause and remedy.
    numbers : mapping of str to float
        The figures behind the words, by name.
    severity : Severity
        Severity of the diagnostic, or its name.

    Examples
    --------
    >>> import snapbeam as sb
    >>> diagnostic = sb.Diagnostic("beam.steep", "the slopes of the beam are not small", {"slope": 0.2})
    >>> diagnostic.numbers["slope"]
    0.2
    """

    code: str
    message: str
    numbers: Mapping[str, float] = field(default_factory=dict)
    severity: Severity = Severity.WARNING

    def __post_init__(self) -> None:
        words = tuple(str(each.value) for each in Severity)
        choice("severity", self.severity, words)
        object.__setattr__(self, "severity", Severity(self.severity))

    @property
    def is_warning(self) -> bool:
        """True if the result needs a check before use: every severity except INFO."""
        return self.severity is not Severity.INFO

    def plain(self) -> dict[str, Any]:
        """Diagnostic as plain text and numbers; a nonfinite number becomes None."""
        numbers = {name: float(value) if math.isfinite(value) else None for name, value in self.numbers.items()}
        return {"code": self.code, "severity": self.severity.value, "message": self.message, "numbers": numbers}

    def __str__(self) -> str:
        return f"{self.severity.value} [{self.code}]: {self.message}"


class DiagnosticError(InputError):
    """A measurement refused because of its diagnostics, which are in ``diagnostics``.

    Examples
    --------
    >>> from snapbeam import lab
    >>> issubclass(lab.DiagnosticError, ValueError)
    True
    """

    def __init__(self, message: str, diagnostics: tuple[Diagnostic, ...]) -> None:
        super().__init__(message)
        self.diagnostics = diagnostics


def doubtful(diagnostics: Iterable[Diagnostic]) -> tuple[Diagnostic, ...]:
    """The diagnostics that take something from the result: all but notes."""
    return tuple(one for one in diagnostics if one.is_warning)


def refuse(diagnostics: Iterable[Diagnostic], what: str) -> None:
    """Raise if any diagnostic is more than a note.

    Raises
    ------
    DiagnosticError
        With the words of every such diagnostic; *what* names the measurement.
    """
    found = doubtful(diagnostics)
    if found:
        told = "; ".join(f"[{one.code}] {one.message}" for one in found)
        raise DiagnosticError(f"{what}: refused as implausible: {told}", found)


def to_json(diagnostics: Iterable[Diagnostic]) -> str:
    """Diagnostics as text for an attribute of a file."""
    return json.dumps([one.plain() for one in diagnostics], ensure_ascii=False)


def from_json(text: str) -> tuple[Diagnostic, ...]:
    """Diagnostics from what :func:`to_json` wrote."""
    return tuple(
        Diagnostic(
            str(one["code"]),
            str(one["message"]),
            {name: math.nan if value is None else float(value) for name, value in one["numbers"].items()},
            Severity(one["severity"]),
        )
        for one in json.loads(text)
    )


def diagnostics_of(result: Any) -> tuple[Diagnostic, ...]:
    """The diagnostics of a result: of a measurement, or of a dataset or its file's attributes; none if it has none.

    Examples
    --------
    >>> from snapbeam import lab
    >>> velocity = lab.render_vibrometer(100.0, 7e-3, duration=0.5)  # 100 Hz, 7 mm/s
    >>> drive = lab.measure_drive(velocity, 100.0)
    >>> [each.code for each in lab.diagnostics_of(drive)]
    ['vibrometer.high_pass_possible']
    """
    own = getattr(result, "diagnostics", None)
    if isinstance(own, tuple):
        return own
    attrs = getattr(result, "attrs", result if isinstance(result, Mapping) else {})
    text = attrs.get("diagnostics")
    return from_json(text) if isinstance(text, str) else ()


_told: set[tuple[str, str]] = set()
_PACKAGE = __name__.partition(".")[0]


def tell(diagnostics: Iterable[Diagnostic]) -> None:
    """Warn of each diagnostic, once a process for the same words, where the package was called from."""
    for diagnostic in diagnostics:
        if (diagnostic.code, diagnostic.message) not in _told:
            _told.add((diagnostic.code, diagnostic.message))
            warnings.warn(diagnostic.message, DiagnosticWarning, stacklevel=_outside())


def _outside() -> int:
    """Level of the stack, as :func:`tell` counts it, of the first caller that is not the package itself."""
    frame, level = sys._getframe(1), 1
    while frame.f_back is not None and frame.f_globals.get("__name__", "").partition(".")[0] == _PACKAGE:
        frame, level = frame.f_back, level + 1
    return level


# Progress in a script or a notebook: one line that is written over.


class _Line:
    """Progress line on standard error, updated at most five times per second, from *after* seconds on."""

    def __init__(self, what: str, after: float = 0.0) -> None:
        self.what = what
        self.last = time.monotonic()
        self.begin = self.last + after
        self.rate = WorkRate()
        self.ended = False

    def say(self, share: float, words: str) -> None:
        now = time.monotonic()
        self.rate.report(share)
        if now < self.begin or (self.ended and share >= 1.0) or (now - self.last < _INTERVAL and share < 1.0):
            return
        self.ended = share >= 1.0
        self.last = now
        rate = self.rate.per_second
        left = f", {(1.0 - share) / rate:.0f} s left" if rate is not None and share < 1.0 else ""
        end = "\n" if share >= 1.0 else ""
        sys.stderr.write(f"\r{self.what}: {words}{left}      {end}")
        sys.stderr.flush()


def _line(progress: object, what: str) -> _Line | None:
    """The line of True; that of None for a person who waits for a call of the package itself; otherwise None."""
    if progress is True:
        return _Line(what)
    stream = sys.stderr
    is_seen = progress is None and stream is not None
    is_seen = is_seen and (stream.isatty() or type(stream).__module__.startswith("ipykernel."))
    if not is_seen or threading.current_thread() is not threading.main_thread():
        return None
    frame: FrameType | None = sys._getframe(2)
    own = {validation.__file__, sys._getframe(2).f_code.co_filename}
    while frame is not None and frame.f_globals.get("__name__", "").partition(".")[0] == _PACKAGE:
        if frame.f_code.co_filename not in own:  # a part of a longer computation
            return None
        frame = frame.f_back
    return _Line(what, _WAIT)


def counting(progress: _Counts | bool | None, what: str, noun: str = "points") -> _Counts | None:
    """Function to which a computation reports ``(done, total)``.

    True selects a line on standard error; so does None, after 2 s, in a terminal or a notebook, unless the computation is a
    part of another one; False selects none.

    Raises
    ------
    InputTypeError
        If *progress* can be called no more than it is True, False or None.
    """
    if (line := _line(progress, what)) is not None:
        return lambda done, total: line.say(done / max(total, 1), f"{done} of {total} {noun}")
    own: _Counts | None = _given(progress, "done, total")
    return own


def sharing(progress: _Shares | bool | None, what: str) -> _Shares | None:
    """Progress function as :func:`counting`, for progress as a fraction."""
    if (line := _line(progress, what)) is not None:
        return lambda share: line.say(share, f"{100.0 * share:.0f} %")
    own: _Shares | None = _given(progress, "share")
    return own


def _given(progress: Any, arguments: str) -> Any:
    """The function that was given; None for None and False."""
    if progress is None or progress is False:
        return None
    if not callable(progress):
        raise InputTypeError(f"progress = {shown(progress)}: must be True or callable, as progress({arguments})")
    return progress
