"""One row of the table of claims, and the files the table is written to."""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass, fields
from pathlib import Path

from snapbeam.core.files import atomic_path, check_writable
from snapbeam.core.provenance import made_by
from snapbeam.core.validate import choice

__all__ = ["VERDICTS", "Claim", "write_table"]

VERDICTS = ("holds", "in part", "fails", "open")


@dataclass(frozen=True)
class Claim:
    """What the paper says, what was measured by which rule, and whether they agree.

    ``verdict``: ``holds``, ``in part``, ``fails``, or ``open`` for what the paper does not say and whose
    influence is measured instead.  ``size``: whether it was measured at the size of the paper or on a sketch.
    """

    number: str
    statement: str
    paper: str
    measured: str
    uncertainty: str
    verdict: str
    rule: str
    remark: str = ""
    size: str = "full"

    def __post_init__(self) -> None:
        choice("verdict", self.verdict, VERDICTS)


def write_table(claims: Sequence[Claim], folder: Path, size: str) -> list[Path]:
    """Write ``claims.md``, ``claims.csv`` and ``claims.json`` to a folder."""
    stamp = made_by({"size": size, "claims": [claim.number for claim in claims]})
    record = {"size": size, **stamp, "claims": [asdict(claim) for claim in claims]}
    texts = {
        "claims.md": _markdown(claims),
        "claims.csv": _csv(claims),
        "claims.json": json.dumps(record, indent=1, ensure_ascii=False) + "\n",
    }
    files = []
    for name, text in texts.items():
        target = check_writable(folder / name, "output")
        with atomic_path(target) as temporary:
            temporary.write_text(text, encoding="utf-8")
        files.append(target)
    return files


def _markdown(claims: Sequence[Claim]) -> str:
    lines = [
        "| # | the paper says | paper | measured | uncertainty | verdict | size |",
        "|---|---|---|---|---|---|---|",
    ]
    for claim in claims:
        cells = (claim.number, claim.statement, claim.paper, claim.measured, claim.uncertainty)
        lines.append("| " + " | ".join(map(_cell, cells)) + f" | **{claim.verdict}** | {claim.size} |")
    lines += ["", "**How each was measured, and what to make of it**", ""]
    for claim in claims:
        remark = f" {claim.remark}" if claim.remark else ""
        lines += [f"{claim.number}", f": *{claim.rule}*{remark}", ""]
    return "\n".join(lines)


def _cell(text: str) -> str:
    return text.replace("|", "\\|").replace("\n", " ")


def _csv(claims: Sequence[Claim]) -> str:
    stream = io.StringIO()
    names = [field.name for field in fields(Claim)]
    writer = csv.DictWriter(stream, names, lineterminator="\n")
    writer.writeheader()
    writer.writerows(asdict(claim) for claim in claims)
    return stream.getvalue()
