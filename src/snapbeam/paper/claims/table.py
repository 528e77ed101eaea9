"""One row of the table of claims, and the files the table is written to."""

from __future__ import annotations

import csv
import io
import json
import math
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from itertools import groupby
from pathlib import Path

from snapbeam.paper.claims.claim_result import VERDICTS, Quantity
from snapbeam.util.files import atomic_path, check_writable
from snapbeam.util.provenance import made_by
from snapbeam.util.validation import choice

BEGINS = {"claims.md": "**Of ", "claims.csv": "number,topic,says,paper,", "claims.json": ""}
"""The files of the table, and what the text of each begins with."""


@dataclass(frozen=True)
class Claim:
    """Statement of the paper, the measured value with its rule, and the verdict.

    ``verdict``: ``holds``, ``in part``, ``fails``, or ``open`` for properties that the paper does not specify
    and whose influence is measured instead.  ``close``: whether it would be another within the uncertainty.
    ``size``: whether it was measured at the size of the paper or on a sketch.
    """

    number: str
    topic: str
    says: str
    paper: str
    source: str
    measured: str
    uncertainty: str
    verdict: str
    close: bool
    rule: str
    fails: str
    note: str = ""
    figure: str = ""
    size: str = "full"
    quantities: Mapping[str, Quantity] = field(default_factory=dict)

    def __post_init__(self) -> None:
        choice("verdict", self.verdict, VERDICTS)


def summary(claims: Sequence[Claim]) -> str:
    """Summary of the verdicts: numbers of statements that hold, hold in part, fail, are close or open."""
    counts = Counter(claim.verdict for claim in claims)
    close = sum(claim.close for claim in claims if claim.verdict != "open")
    total = len(claims) - counts["open"]
    sketched = sum(claim.size != "full" for claim in claims)
    return (
        f"Of {total} statements {counts['holds']} hold, {counts['in part']} hold in part and {counts['fails']} fail; "
        f"{close} of these verdicts (†) could change within the uncertainty. {counts['open']} properties "
        "that the paper does not specify are measured separately."
        + (f" {sketched} rows (*) are measured on sketches." if sketched else "")
    )


def write_table(claims: Sequence[Claim], folder: Path, size: str) -> list[Path]:
    """Write ``claims.md``, ``claims.csv`` and ``claims.json`` to a folder."""
    stamp = made_by({"size": size, "claims": [claim.number for claim in claims]})
    record = {"size": size, **stamp, "summary": summary(claims), "claims": [_record(row) for row in claims]}
    texts = {
        "claims.md": _markdown(claims),
        "claims.csv": _csv(claims),
        "claims.json": json.dumps(record, indent=1, ensure_ascii=False, allow_nan=False) + "\n",
    }
    files = []
    for name, text in texts.items():
        target = check_writable(folder / name, "output", begin=BEGINS[name])
        with atomic_path(target) as temporary:
            temporary.write_text(text, encoding="utf-8")
        files.append(target)
    return files


def _record(claim: Claim) -> dict[str, object]:
    """A row for JSON, which has no number for what was not found."""
    quantities = {
        name: {part: value if math.isfinite(value) else None for part, value in quantity._asdict().items()}
        for name, quantity in claim.quantities.items()
    }
    return {**asdict(claim), "quantities": quantities}


def _markdown(claims: Sequence[Claim]) -> str:
    lines = [f"**{summary(claims)}**", ""]
    # questions last, whatever their place in the list
    ordered = sorted(claims, key=lambda claim: claim.verdict == "open")
    for topic, group in groupby(ordered, key=lambda claim: claim.topic):
        rows = list(group)
        is_open = rows[0].verdict == "open"
        lines += [f"### {topic}", "", *_table(rows, is_open), ""]
    return "\n".join(lines).rstrip() + "\n"


def _table(rows: Iterable[Claim], is_open: bool) -> list[str]:
    if is_open:
        lines = ["| # | question | measured | for comparison | shown in |", "|---|---|---|---|---|"]
    else:
        lines = [
            "| # | statement of the paper | value in the paper | measured | uncertainty | verdict | shown in |",
            "|---|---|---|---|---|---|---|",
        ]
    for row in rows:
        verdict = f"**{row.verdict}**" + (" †" if row.close else "") + (" *" if row.size != "full" else "")
        cells = [row.says, row.measured, row.uncertainty, _link(row.figure)]
        if not is_open:
            cells = [row.says, row.paper, row.measured, row.uncertainty, verdict, _link(row.figure)]
        lines.append("| " + " | ".join([row.number, *(cell.replace("|", "\\|") for cell in cells)]) + " |")
    return lines


def _link(figures: str) -> str:
    """Links to headings, given one after another with commas, of the page that holds the table."""
    names = [name.strip() for name in figures.split(",") if name.strip()]
    return ", ".join(f"[{name}](#{name.lower().replace(' ', '-').replace('.', '')})" for name in names)


def _csv(claims: Sequence[Claim]) -> str:
    stream = io.StringIO()
    rows = []
    for claim in claims:
        row = {key: value for key, value in asdict(claim).items() if key != "quantities"}
        name, quantity = next(iter(claim.quantities.items()))
        rows.append(row | {"quantity": name, "value": quantity.value, "value_uncertainty": quantity.uncertainty})
    writer = csv.DictWriter(stream, list(rows[0]), lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
    return stream.getvalue()
