"""Findings: what is doubtful about an input or a result, as data; and the one warning that tells them."""

from __future__ import annotations

import sys
import warnings
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field

__all__ = ["Finding", "PlausibilityWarning", "tell"]


class PlausibilityWarning(UserWarning):
    """Something that can be computed but is probably not what was meant."""


@dataclass(frozen=True)
class Finding:
    """One thing that is doubtful.

    Attributes
    ----------
    code : str
        Short name, stable over versions, such as ``"first-mode-antisymmetric"``.
    words : str
        What was found and what to do about it.
    numbers : mapping of str to float
        The figures behind the words, in SI units.
    severity : {"note", "warning", "error"}
        How much it matters.
    """

    code: str
    words: str
    numbers: Mapping[str, float] = field(default_factory=dict)
    severity: str = "warning"


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
