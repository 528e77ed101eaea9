"""Report on the sentences of the documentation: ``make prose``.

It informs and refuses nothing: words per page, long sentences, sentences that begin with "What" and ask nothing, and
words that the glossary replaced. ``python tests/docs/prose.py PAGE ...`` lists the sentences of some pages.
"""

from __future__ import annotations

import re
import sys
from pathlib import Path

ROOT = Path(__file__).parents[2]
LIMIT = 30
"""Words of a long sentence."""
BANNED = re.compile(
    r"\b(march(?:es|ed|ing)?|ledgers?|worlds?|doors?|house|anew|tall(?:y|ies)|rungs?|campaigns?|greatest|some \d+)\b",
    re.IGNORECASE,
)
ADDRESS = re.compile(r"\b(you|your|we|our)\b", re.IGNORECASE)


def prose(text: str) -> str:
    """The prose of a page: without code, tables, formulas, headings, directives and targets of links."""
    text = text.partition("<!-- From here on")[0]
    text = re.sub(r"^```.*?^```$", "", text, flags=re.MULTILINE | re.DOTALL)
    text = re.sub(r"\$\$.*?\$\$", "X", text, flags=re.DOTALL)
    text = re.sub(r"^(\||#|!\[|\([\w-]+\)=).*$", "", text, flags=re.MULTILINE)
    text = re.sub(r"\$[^$]+\$|`[^`]+`", "X", text)
    text = re.sub(r"\[([^]]*)\]\([^)]*\)", r"\1", text)
    return re.sub(r"^\s*([-:]|\d+\.) ", "\n", text, flags=re.MULTILINE)


def sentences(text: str) -> list[str]:
    """The sentences of some prose; a paragraph ends a sentence."""
    found = []
    for paragraph in re.split(r"\n\s*\n", text):
        words = re.sub(r"[*_]", "", " ".join(paragraph.split()))
        found += [part for part in re.split(r"(?<=[.!?])\s+(?=[A-Z\[])", words) if len(part.split()) > 1]
    return found


def report(path: Path, listed: bool) -> tuple[int, int, int, int, int, int]:
    """Print the sentences of a page that need a look, and return its counts."""
    text = prose(path.read_text(encoding="utf-8"))
    every = sentences(text)
    long = [each for each in every if len(each.split()) > LIMIT]
    what = [each for each in every if each.startswith("What ") and not each.endswith("?")]
    banned = BANNED.findall(text)
    if listed:
        print(*(f"{path.name}: {len(each.split())} words: {each}" for each in long), sep="\n")
        print(
            *(f"{path.name}: {each}" for each in what),
            *(f"{path.name}: word {each}" for each in banned),
            sep="\n",
        )
    words = len(text.split())
    return words, len(every), len(long), len(what), len(banned), len(ADDRESS.findall(text))


def main(names: list[str]) -> None:
    """Print a line for each page and one for all."""
    pages = [Path(name) for name in names] or [
        *sorted((ROOT / "docs").glob("*.md")), ROOT / "README.md", ROOT / "CONTRIBUTING.md", ROOT / "VISION.md",
        ROOT / "CHANGELOG.md",
    ]  # fmt: skip
    print(f"{'page':32}{'words':>7}{'sentences':>11}{'long':>6}{'What':>6}{'banned':>8}{'you, we':>9}")
    rows = [(path.name, report(path, bool(names))) for path in pages]
    rows.append(("all", tuple(map(sum, zip(*(row for _, row in rows), strict=True)))))
    for name, (words, count, long, what, banned, address) in rows:
        print(f"{name:32}{words:7}{count:11}{long:6}{what:6}{banned:8}{address:9}")


if __name__ == "__main__":
    main(sys.argv[1:])
