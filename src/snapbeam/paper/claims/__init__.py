"""What the paper says, measured: each claim a function with a rule, all of them a table."""

from __future__ import annotations

import os
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from snapbeam.core.validate import InputError
from snapbeam.paper.claims.table import VERDICTS, Claim, write_table
from snapbeam.paper.recipe import MissingResults

if TYPE_CHECKING:
    from snapbeam.paper.recipe import Results

__all__ = ["VERDICTS", "Claim", "measure_claims", "write_claims"]


def measure_claims(results: Results, sketch: Results | None = None) -> list[Claim]:
    """Measure every claim, in the order of the table.

    Parameters
    ----------
    results : Results
        The data of the recipes, stored or computed; their size is the size of the measurement.  Verdicts of
        the size ``"quick"`` exercise the rules and mean nothing else.
    sketch : Results, optional
        What to measure a claim on if *results* lack its data and do not compute them; each row says its size.
    """
    from snapbeam.paper.claims import contact, frequencies, locations, maps, unsaid, waveforms

    functions = (
        frequencies.natural_frequencies,
        frequencies.misprint,
        maps.notches,
        maps.thresholds,
        maps.long_runs,
        maps.low_frequency,
        locations.one_mode,
        locations.many_modes,
        locations.added_modes,
        waveforms.resonances,
        waveforms.snap_through,
        frequencies.convergence,
        contact.restitution,
        frequencies.dynamic_basis,
        waveforms.central_shaker,
        locations.transient_window,
        contact.stiffness,
        unsaid.reference_frequency,
        unsaid.contact_stiffness,
        unsaid.damping,
        unsaid.end_rule,
        unsaid.tolerance,
    )
    rows: list[Claim] = []
    for function in functions:
        used = results
        try:
            found = function(results)
        except MissingResults:
            if sketch is None:
                raise
            used = sketch
            found = function(sketch)
        rows += [replace(claim, size=used.size) for claim in found]
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
