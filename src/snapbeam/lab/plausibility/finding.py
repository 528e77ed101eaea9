"""A finding: what makes a measurement doubtful, as data with a code, a severity, words and numbers."""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Any

from snapbeam.core.validate import InputError

__all__ = [
    "Finding",
    "ImplausibleError",
    "Severity",
    "doubtful",
    "findings_of",
    "from_json",
    "refuse",
    "to_json",
]


class Severity(StrEnum):
    """How much a finding takes from a result.

    NOTE: worth knowing, the numbers stand.  DOUBT: the numbers may be off by more than their standard errors,
    which were widened where that could be told.  WRONG: the numbers contradict something known and cannot be
    right as they are.
    """

    NOTE = "note"
    DOUBT = "doubt"
    WRONG = "wrong"


@dataclass(frozen=True)
class Finding:
    """What was seen in a measurement that its numbers alone do not say.

    ``code`` is a fixed name such as "camera.gamma", by which programs tell findings apart; ``words`` say what
    was seen and what to do; ``numbers`` are those in the words, by name.
    """

    code: str
    severity: Severity
    words: str
    numbers: Mapping[str, float] = field(default_factory=dict)

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
            Severity(one["severity"]),
            str(one["words"]),
            {name: math.nan if value is None else float(value) for name, value in one["numbers"].items()},
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
