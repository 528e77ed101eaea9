"""Findings: what is doubtful about an input or a result, as data; and the ways they are told, kept and refused."""

from __future__ import annotations

import json
import math
import sys
import warnings
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Any

from snapbeam.core.validate import InputError, choice

__all__ = [
    "Finding",
    "ImplausibleError",
    "PlausibilityWarning",
    "Severity",
    "doubtful",
    "findings_of",
    "from_json",
    "refuse",
    "tell",
    "to_json",
]


class PlausibilityWarning(UserWarning):
    """Something that can be computed but is probably not what was meant."""


class Severity(StrEnum):
    """How much a finding takes from a result.

    NOTE: worth knowing, the numbers stand.  DOUBT: the numbers may not be what was meant, or be off by more than
    their standard errors, which were widened where that could be told.  WRONG: the numbers contradict something
    known and cannot be right as they are.
    """

    NOTE = "note"
    DOUBT = "doubt"
    WRONG = "wrong"


@dataclass(frozen=True)
class Finding:
    """One thing that is doubtful: what the numbers of an input or a result do not say by themselves.

    Attributes
    ----------
    code : str
        Short name, stable over versions, such as ``"first-mode-antisymmetric"`` or ``"camera.gamma"``, by which
        programs tell findings apart.
    words : str
        What was found and what to do about it.
    numbers : mapping of str to float
        The figures behind the words, by name.
    severity : Severity
        How much it takes from the result; its name does, too.
    """

    code: str
    words: str
    numbers: Mapping[str, float] = field(default_factory=dict)
    severity: Severity = Severity.DOUBT

    def __post_init__(self) -> None:
        words = tuple(str(each.value) for each in Severity)
        choice("severity", self.severity, words)
        object.__setattr__(self, "severity", Severity(self.severity))

    @property
    def doubtful(self) -> bool:
        """Whether the result should not be used without a look: all but notes."""
        return self.severity is not Severity.NOTE

    def plain(self) -> dict[str, Any]:
        """The finding as plain words and numbers; what is not finite becomes None."""
        numbers = {
            name: float(value) if math.isfinite(value) else None for name, value in self.numbers.items()
        }
        return {"code": self.code, "severity": self.severity.value, "words": self.words, "numbers": numbers}

    def __str__(self) -> str:
        return f"{self.severity.value} [{self.code}]: {self.words}"


class ImplausibleError(InputError):
    """A measurement refused because of its findings, which are in ``findings``."""

    def __init__(self, message: str, findings: tuple[Finding, ...]) -> None:
        super().__init__(message)
        self.findings = findings


def doubtful(findings: Iterable[Finding]) -> tuple[Finding, ...]:
    """The findings that take something from the result: all but notes."""
    return tuple(one for one in findings if one.doubtful)


def refuse(findings: Iterable[Finding], what: str) -> None:
    """Raise if any finding is more than a note.

    Raises
    ------
    ImplausibleError
        With the words of every such finding; *what* names the measurement.
    """
    found = doubtful(findings)
    if found:
        told = "; ".join(f"[{one.code}] {one.words}" for one in found)
        raise ImplausibleError(f"{what}: refused as implausible: {told}", found)


def to_json(findings: Iterable[Finding]) -> str:
    """Findings as text for an attribute of a file."""
    return json.dumps([one.plain() for one in findings], ensure_ascii=False)


def from_json(text: str) -> tuple[Finding, ...]:
    """Findings from what :func:`to_json` wrote."""
    return tuple(
        Finding(
            str(one["code"]),
            str(one["words"]),
            {name: math.nan if value is None else float(value) for name, value in one["numbers"].items()},
            Severity(one["severity"]),
        )
        for one in json.loads(text)
    )


def findings_of(result: Any) -> tuple[Finding, ...]:
    """The findings of a result: of a measurement, or of a dataset or its file's attributes; none if it has none."""
    own = getattr(result, "findings", None)
    if isinstance(own, tuple):
        return own
    attrs = getattr(result, "attrs", result if isinstance(result, Mapping) else {})
    text = attrs.get("findings")
    return from_json(text) if isinstance(text, str) else ()


_told: set[tuple[str, str]] = set()
_PACKAGE = __name__.partition(".")[0]


def tell(findings: Iterable[Finding]) -> None:
    """Warn of each finding, once a process for the same words, where the package was called from."""
    for finding in findings:
        if (finding.code, finding.words) not in _told:
            _told.add((finding.code, finding.words))
            warnings.warn(finding.words, PlausibilityWarning, stacklevel=_outside())


def _outside() -> int:
    """Level of the stack, as :func:`tell` counts it, of the first caller that is not the package itself."""
    frame, level = sys._getframe(1), 1
    while frame.f_back is not None and frame.f_globals.get("__name__", "").partition(".")[0] == _PACKAGE:
        frame, level = frame.f_back, level + 1
    return level
