"""Write the table of the page "Validation": ``python tests/validation/write_table.py``."""

from __future__ import annotations

from pathlib import Path

from cases import CASES, COMPUTED, FORMULA, PRINTED, Row

TABLE = Path(__file__).parents[2] / "docs" / "data" / "validation.md"
LETTERS = {PRINTED: "p", FORMULA: "f", COMPUTED: "c"}


def rows_of(rows: list[Row]) -> list[str]:
    """One line of the table for each row."""
    return [
        f"| {row.source} | {row.quantity} | {row.published:.7g} ({LETTERS[row.origin]}) | {row.ours:.7g} | {_size(row.difference)} | "
        f"{row.remark} |"
        for row in rows
    ]


def _size(difference: float) -> str:
    return "below 1e-6" if abs(difference) < 1e-6 else f"{difference:+.1e}"


def table() -> str:
    """The whole table."""
    lines = [
        "| source | quantity | published | snapbeam | relative difference | remark |",
        "| --- | --- | ---: | ---: | ---: | --- |",
    ]
    for case in CASES.values():
        lines += rows_of(case())
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    TABLE.write_text(table(), encoding="utf-8")
