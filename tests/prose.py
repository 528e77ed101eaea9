"""Report on the sentences of the documentation: ``make prose``.

The report counts words, long sentences, sentences that begin with "What" and ask nothing, and words that the glossary
replaced: for each page, and for docstrings, command-line help, headings of tables and labels of figures.
``python tests/prose.py NAME ...`` lists the sentences of some pages, or of ``docstrings``, ``help``, ``headings``
and ``labels``. ``tests/test_terms.py`` refuses what must not come back.
"""

from __future__ import annotations

import ast
import itertools
import re
import sys
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).parents[1]
LIMIT = 30
"""Words of a long sentence."""
BANNED = re.compile(
    r"\b(march(?:es|ed|ing)?|ledgers?|worlds?|doors?|house|anew|tall(?:y|ies)|rungs?|campaigns?|greatest|some \d+)\b",
    re.IGNORECASE,
)
CLAUSES = {"What", "How", "Where", "Whether", "When", "Who", "Why", "That", "If"}
"""First words of a docstring that names no object."""
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


def docstrings(folder: Path = ROOT / "src" / "snapbeam") -> Iterator[tuple[str, str]]:
    """Place and text of every docstring, of attributes and constants too."""
    for path in sorted(folder.rglob("*.py")):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant):
                if isinstance(node.value.value, str):
                    yield f"{path.relative_to(folder)}:{node.lineno}", node.value.value


def plain(docstring: str) -> str:
    """The prose of a docstring: without examples, underlines, headings and the types of parameters."""
    lines, example = [], False
    for line in docstring.splitlines():
        text = line.strip()
        example = text.startswith(">>>") or (example and bool(text))
        if example or re.fullmatch(r"-+", text) or re.match(r"[\w*]+(, [\w*]+)* : ", text):
            lines.append("")
        else:
            lines.append(text)
    return re.sub(r"``[^`]+``|:\w+:`[^`]+`|\*\w+\*", "X", "\n".join(lines))


def help_texts() -> Iterator[tuple[str, str]]:
    """Place and text of the help of every command and option."""
    import typer

    from snapbeam.cli import app

    def visit(command: object, words: str) -> Iterator[tuple[str, str]]:
        text = str(getattr(command, "help", None) or "").partition("Example:")[0]
        yield words, text
        for each in getattr(command, "params", []):
            yield f"{words} {each.opts[0]}", str(getattr(each, "help", None) or "")
        for name, inner in sorted(getattr(command, "commands", {}).items()):
            yield from visit(inner, f"{words} {name}")

    yield from visit(typer.main.get_command(app), "snapbeam")


def headings() -> Iterator[tuple[str, str]]:
    """Place and text of the headings of the tables that programs print."""
    for path in [*sorted((ROOT / "docs" / "data").glob("*.md")), *sorted((ROOT / "docs" / "images").glob("*.inc"))]:
        lines = path.read_text(encoding="utf-8").splitlines()
        for row, rule in itertools.pairwise(lines):
            if re.fullmatch(r"\|[-:| ]+\|", rule) and row.startswith("|"):
                yield path.name, " ".join(row.strip("| ").split("|"))


def labels() -> Iterator[tuple[str, str]]:
    """Place and text of the labels of figures and of the variables of datasets."""
    names = {"label", "xlabel", "ylabel", "title", "long_name"}
    for path in sorted((ROOT / "src" / "snapbeam").rglob("*.py")):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            found = list[ast.expr]()
            if isinstance(node, ast.Call):
                found += [each.value for each in node.keywords if each.arg in names]
                called = node.func.attr if isinstance(node.func, ast.Attribute) else ""
                if called.startswith("set_") and called.endswith(("label", "title")):
                    found += node.args[:1]
            elif isinstance(node, ast.Dict):
                found += [
                    value
                    for key, value in zip(node.keys, node.values, strict=True)
                    if isinstance(key, ast.Constant) and key.value in names
                ]
            for each in found:
                if isinstance(each, ast.Constant) and isinstance(each.value, str):
                    yield f"{path.name}:{each.lineno}", each.value


def report(name: str, text: str, listed: bool) -> tuple[int, int, int, int, int, int]:
    """Print the sentences of a text that need a look, and return its counts."""
    every = sentences(text)
    long = [each for each in every if len(each.split()) > LIMIT]
    what = [each for each in every if each.startswith("What ") and not each.endswith("?")]
    banned = BANNED.findall(text)
    if listed:
        print(*(f"{name}: {len(each.split())} words: {each}" for each in long), sep="\n")
        print(*(f"{name}: {each}" for each in what), *(f"{name}: word {each}" for each in banned), sep="\n")
    words = len(text.split())
    return words, len(every), len(long), len(what), len(banned), len(ADDRESS.findall(text))


def other_texts() -> dict[str, str]:
    """The texts outside the pages, by name."""
    return {
        "docstrings": "\n\n".join(plain(text) for _, text in docstrings()),
        "help": "\n\n".join(text for _, text in help_texts()),
        "headings": "\n\n".join(text for _, text in headings()),
        "labels": "\n\n".join(text for _, text in labels()),
    }


def main(names: list[str]) -> None:
    """Print a line for each page, and one for all; then a line for each of the other texts."""
    others = other_texts() if not names or set(names) & {"docstrings", "help", "headings", "labels"} else {}
    pages = [Path(name) for name in names if name not in others] if names else [
        *sorted((ROOT / "docs").glob("*.md")), ROOT / "README.md", ROOT / "CONTRIBUTING.md", ROOT / "VISION.md",
        ROOT / "CHANGELOG.md",
    ]  # fmt: skip
    print(f"{'page':32}{'words':>7}{'sentences':>11}{'long':>6}{'What':>6}{'banned':>8}{'you, we':>9}")
    rows = [(path.name, report(path.name, prose(path.read_text(encoding="utf-8")), bool(names))) for path in pages]
    if rows:
        rows.append(("all pages", tuple(map(sum, zip(*(row for _, row in rows), strict=True)))))
    rows += [(name, report(name, text, bool(names))) for name, text in others.items() if not names or name in names]
    for name, (words, count, long, what, banned, address) in rows:
        print(f"{name:32}{words:7}{count:11}{long:6}{what:6}{banned:8}{address:9}")


if __name__ == "__main__":
    main(sys.argv[1:])
