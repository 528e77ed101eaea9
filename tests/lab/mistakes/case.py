"""A mistake, what is made of it, and how it is told."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from snapbeam import InputError
from snapbeam.lab import diagnostics as kinds
from snapbeam.lab.diagnostics import Kind
from snapbeam.lab.tracking import diagnostics as tracking
from snapbeam.util.diagnostics import Diagnostic

KINDS: Mapping[str, Kind] = {
    kind.code: kind
    for table in (
        kinds.KINDS_ALIGNMENT,
        kinds.KINDS_CALIBRATION,
        kinds.KINDS_COMPARISON,
        kinds.KINDS_DECAY,
        kinds.KINDS_RECORDING,
        kinds.KINDS_RESPONSE,
        kinds.KINDS_SIGNAL,
        tracking.KINDS,
        kinds.KINDS_VIBROMETER,
    )
    for kind in table.values()
}


@dataclass(frozen=True)
class Outcome:
    """What came of a case.

    ``ratio`` is the largest error of any number, in its standard errors; NaN where no number was asked.
    """

    diagnostics: tuple[Diagnostic, ...] = ()
    refusal: str = ""
    ratio: float = math.nan


@dataclass(frozen=True)
class Case:
    """One mistake.

    ``look`` makes it in a folder and measures it.  ``end`` is what must come of it: "right", "flagged" with the
    diagnostic ``code``, or "refused" with words that match ``words``.  ``sees`` says what gives it away, where
    that is no diagnostic's.
    """

    group: str
    mistake: str
    look: Callable[[Path], Outcome] = field(repr=False)
    end: str
    code: str = ""
    words: str = ""
    sees: str = ""


def looked(case: Case, folder: Path) -> Outcome:
    """The outcome of a case; a refusal is one."""
    try:
        return case.look(folder)
    except InputError as error:
        return Outcome(refusal=str(error).replace(f"{folder}/", ""))


def off(measured, truth, error) -> float:
    """The largest error over its standard error."""
    miss = np.abs(np.asarray(measured, dtype=float) - truth)
    known = np.isfinite(miss)
    return float(np.max(miss[known] / np.broadcast_to(error, miss.shape)[known])) if known.any() else math.nan
