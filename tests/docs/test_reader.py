"""Pages as a reader follows them: every file that a command or a script reads is shown or made before it is read."""

from __future__ import annotations

import re
import shlex
from collections import defaultdict
from pathlib import Path
from typing import NamedTuple

import matplotlib.pyplot as plt
import pytest
from test_tutorials import follow

ROOT = Path(__file__).parents[2]
PAGES = {path.stem: path.read_text(encoding="utf-8") for path in sorted((ROOT / "docs").glob("*.md"))}
README = (ROOT / "README.md").read_text(encoding="utf-8")
WRITES = {
    "-o", "--output", "--plot", "--export", "--json", "--picture", "--video", "--report", "--drive-output", "--checkpoint",
    "--stream", "--save-system",
}  # fmt: skip
"""Options whose value is a file that the command makes."""
FILE = re.compile(r"[\w./-]+\.(?:toml|nc|csv|cihx|mraw|wav|uff|tdms|mat|h5|map|checkpoint|tif|tiff|mp4|py|json)")
REFERENCE = {"command_line", "parameters", "variables", "api"}
"""Written from the program; each example of a command stands alone."""
OWN = {
    "experiment": "recordings and tables of the reader's laboratory",
    "explore": "maps and results of the reader",
    "reproduction": "data of the repository",
    "finite_elements": "matrices from another program",
}
"""Pages on files that the reader has, with what they are."""
MEASURED = {"getting-started": {"measured.csv"}}
"""Tables of the reader whose columns the page lists."""


class Block(NamedTuple):
    """A fenced block."""

    kind: str
    text: str
    begin: int


def blocks(text: str) -> list[Block]:
    """Every fenced block of a page, with its place."""
    found = re.finditer(r"^```([\w{}-]*)[^\n]*\n(.*?)^```$", text, re.MULTILINE | re.DOTALL)
    return [Block(each[1], each[2], each.start()) for each in found]


def shown_file(block: Block) -> str | None:
    """The name in the comment that a block of a file begins with."""
    name = re.match(r"# (\S+\.(?:toml|py))\b", block.text)
    return name[1] if name else None


def read_and_made(words: list[str]) -> tuple[set[str], set[str]]:
    """Files that a command line reads, and files that it makes."""
    read, made = set(), set()
    for before, word in zip(["", *words], words, strict=False):
        name = word.partition(":")[0]
        if FILE.fullmatch(name):
            (made if before in WRITES else read).add(name)
    return read, made


def missing_files(page: str, text: str) -> list[str]:
    """Files that commands and scripts of a page read before anything shows or makes them."""
    there = set(MEASURED.get(page, ()))
    missing = []
    for block in blocks(text):
        if name := shown_file(block):
            there.add(name)
        elif block.kind == "python":
            there |= set(FILE.findall(block.text))
        elif block.kind in ("", "sh", "bash", "console"):
            for line in block.text.replace("\\\n", " ").splitlines():
                if not line.startswith("snapbeam "):
                    continue
                read, made = read_and_made(shlex.split(line, comments=True)[1:])
                linked = text[: block.begin]
                for name in sorted(read - there):
                    others = re.findall(r"\]\((\w+)\.md[^)]*\)", linked)
                    if f"`{name}`" not in linked or not any(
                        name in map(shown_file, blocks(PAGES[other])) for other in others if other in PAGES
                    ):
                        missing.append(name)
                there |= made
    return missing


@pytest.mark.parametrize("page", [page for page in PAGES if page not in REFERENCE | OWN.keys()])
def test_files_are_there_before_they_are_read(page) -> None:
    """On the page, or on one that the text before links for this file."""
    assert not missing_files(page, PAGES[page])


def test_a_missing_file_is_found() -> None:
    """What the test before is for."""
    file = "```toml\n# own.toml\n[beam]\n```\n\n"
    command = "```\nsnapbeam map --config own.toml -o a.nc --plot a.png\nsnapbeam info a.nc --export a.csv\n```\n"
    assert missing_files("page", file + command) == []
    assert missing_files("page", command) == ["own.toml"]
    assert missing_files("page", command + file) == ["own.toml"]
    assert missing_files("page", file + command.replace("info a.nc", "info b.nc")) == ["b.nc"]
    assert missing_files("page", "`own.toml` of [this page](sweeps.md)\n\n" + command) == ["own.toml"]
    text = "`beam.toml` of [this page](tutorial_beam.md)\n\n" + command.replace("own", "beam")
    assert missing_files("page", text) == []


def test_a_file_of_one_name_is_one_file() -> None:
    """A reader may follow two pages in one folder."""
    texts = defaultdict(set)
    for text in (*PAGES.values(), README):
        for block in blocks(text):
            if name := shown_file(block):
                texts[name].add(block.text)
    assert len(texts) > 8
    assert sorted(name for name, found in texts.items() if len(found) > 1) == []


def anchors(text: str) -> set[str]:
    """Places of a page that links lead to: headings and labels."""
    plain = re.sub(r"^```.*?^```$", "", text, flags=re.MULTILINE | re.DOTALL)
    found = set(re.findall(r"^\(([\w-]+)\)=$", plain, re.MULTILINE))
    for heading in re.findall(r"^#+ (.*)$", plain, re.MULTILINE):
        words = re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", heading).lower()
        found.add(re.sub(r"[^\w\- ]", "", words).strip().replace(" ", "-"))
    return found


@pytest.mark.parametrize("page", [*PAGES, "README"])
def test_links_lead_to_headings(page) -> None:
    """Every link to a place of a page names one that the page has."""
    text = README if page == "README" else PAGES[page]
    plain = re.sub(r"^```.*?^```$", "", text, flags=re.MULTILINE | re.DOTALL)
    lost = []
    for target, place in re.findall(r"\]\((?:docs/)?([\w/.-]*)#([\w-]+)\)", plain):
        stem = target.removesuffix(".md") or page
        if (stem in PAGES or target == "") and place not in anchors(text if target == "" else PAGES[stem]):
            lost.append(f"{target}#{place}")
    assert not lost


def test_pages_of_the_change_log_exist() -> None:
    """Files by their path; a page in quotation marks is a title."""
    text = " ".join((ROOT / "CHANGELOG.md").read_text(encoding="utf-8").split())
    for path in re.findall(r"`((?:docs|impact20|examples|benchmarks)/[\w/.-]*)`", text):
        assert (ROOT / path).exists(), path
    titles = {each.partition("\n")[0].lstrip("# ") for each in PAGES.values()}
    assert set(re.findall(r'page "([^"]+)"', text)) <= titles


@pytest.mark.slow
@pytest.mark.parametrize(
    "page",
    [
        "systems",
        "runs",
        "base_and_load",
        "basins",
        "beams",
        "design",
        "exponents",
        "sweeps",
        "finite_elements",
        "strikers",
        "extended_models",
    ],
)
def test_page_as_a_reader(page, tmp_path, monkeypatch, capsys) -> None:
    """Files, commands and scripts in their order, in an empty folder; the tutorials run in ``test_tutorials.py``."""
    monkeypatch.chdir(tmp_path)
    follow(page, capsys)
    plt.close("all")
