"""Claims of the source paper, measured: each claim is a function with a rule; all claims form a table.

``topics`` contains the claims: modules of functions that return numbers, and a file with the texts of each module.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

from snapbeam.paper.claims.claim_result import VERDICTS, ClaimResult
from snapbeam.paper.claims.prose import fill, read_topic
from snapbeam.paper.claims.table import Claim, summary, write_table
from snapbeam.paper.recipe import MissingResults
from snapbeam.util.validation import InputError

if TYPE_CHECKING:
    from snapbeam.paper.recipe import Results

__all__ = ["TOPICS", "VERDICTS", "Claim", "measure_claims", "measurements", "summary", "write_claims"]


TOPICS = (
    "beam", "basis", "contact", "waveforms", "ripples", "thresholds", "resonances", "classes", "transients", "disturbances",
    "locations", "added_modes", "efficiency", "questions",
)  # fmt: skip
"""The topics in the order of the table."""


def measurements(topic: str) -> Mapping[str, Callable[[Results], ClaimResult]]:
    """The functions of a topic by the numbers of its rows."""
    rows: Mapping[str, Callable[[Results], ClaimResult]] = import_module(f"{__name__}.topics.{topic}").ROWS
    return rows


def measure_claims(results: Results, sketch: Results | None = None) -> list[Claim]:
    """Measure every claim, in the order of the table.

    Parameters
    ----------
    results : Results
        The data of the recipes, stored or computed; their size is the size of the measurement.  Verdicts of
        the size ``"quick"`` exercise the rules and mean nothing else.
    sketch : Results, optional
        Results for a claim whose data are missing in *results* and not computed there; each row contains its
        size.
    """
    rows: list[Claim] = []
    for name in TOPICS:
        topic, functions = read_topic(name), measurements(name)
        for number, entry in topic.entries.items():
            used = results
            try:
                result = functions[number](results)
            except MissingResults:
                if sketch is None:
                    raise
                used = sketch
                result = functions[number](sketch)
            texts = ("measured", "uncertainty", "rule", "fails", "note")
            parts: dict[str, Any] = {part: fill(getattr(entry, part), result) for part in texts}
            parts |= {part: getattr(entry, part) for part in ("says", "paper", "source", "figure")}
            parts |= {part: getattr(result, part) for part in ("verdict", "close", "quantities")}
            rows.append(Claim(number=number, topic=topic.title, size=used.size, **parts))
    return rows


def write_claims(
    folder: str | os.PathLike[str], results: Results, sketch: Results | None = None
) -> tuple[list[Claim], list[Path]]:
    """Measure every claim and write the table as Markdown, CSV and JSON; returns the rows and the files."""
    target = Path(folder)
    if not target.is_dir():
        raise InputError(f"folder = {str(folder)!r}: must be an existing folder")
    rows = measure_claims(results, sketch)
    return rows, write_table(rows, target, results.size)
