"""Configuration of the documentation."""

from __future__ import annotations

import ast
import csv
import importlib.util
import logging
import os
import re
import shutil
import sys
from collections import Counter
from pathlib import Path
from typing import Any

from docutils import nodes
from sphinx.domains.python._object import PyXrefMixin
from sphinx.ext.napoleon.docstring import GoogleDocstring

from snapbeam._version import __version__

# Figures of the paper are drawn from full-size data that were computed once.
DATA = Path(__file__).parent / "data"
os.environ["SNAPBEAM_PAPER_DATA"] = str(DATA)  # read by the examples
sys.path[:0] = [str(Path(__file__).parent / "_ext"), str(Path(__file__).parents[1])]
os.environ.setdefault("MPLBACKEND", "Agg")
logging.getLogger("fontTools").setLevel(logging.WARNING)

project = "snapbeam"
author = "The snapbeam developers"
copyright = "2026, The snapbeam developers"
version = release = __version__

extensions = [
    "myst_parser",
    "formulas",
    "sphinx.ext.autodoc",
    "sphinx.ext.mathjax",
    "sphinx.ext.napoleon",
    "sphinx.ext.viewcode",
    "sphinx_gallery.gen_gallery",
]
exclude_patterns = ["_build", "_ext", "_generated", "data"]
exclude_patterns += ["sg_execution_times.rst", "gallery/sg_execution_times.rst"]  # load scripts from elsewhere
exclude_patterns += [f"gallery/**/*.{kind}" for kind in ("ipynb", "py", "json")]
templates_path: list[str] = []

myst_enable_extensions = ["amsmath", "deflist", "dollarmath"]
smartquotes_action = "qe"  # two hyphens are an option's, not a dash
myst_heading_anchors = 3

autodoc_member_order = "bysource"
autodoc_typehints = "none"
autodoc_preserve_defaults = True  # a default by its name
autodoc_mock_imports = ["bokeh", "panel", "param", "tornado"]  # of the explorer, which a build does not need
napoleon_google_docstring = False
napoleon_use_ivar = True  # one list of attributes, not an entry for each
napoleon_use_param = False  # types are words: "array of shape (N,)" names no class
napoleon_use_rtype = False

highlight_language = "text"
# MathJax from a package, beside the pages: formulas are set without a network too.
_MATHJAX = importlib.util.find_spec("sphinx-mathjax-offline")
assert _MATHJAX is not None and _MATHJAX.origin is not None
mathjax_path = "mathjax.js"

html_theme = "furo"
html_static_path = ["_static", "_generated/static"]
html_css_files = ["wide.css"]
html_theme_options = {"source_repository": "", "navigation_with_keys": True}
html_title = f"snapbeam {version}"

sphinx_gallery_conf = {
    "examples_dirs": ["../examples"],
    "gallery_dirs": ["gallery"],
    "filename_pattern": r"ex\d\d_",
    "within_subsection_order": "FileNameSortKey",
    "download_all_examples": False,
    "min_reported_time": 86400,  # how long a machine took is no matter of the reader's
    "capture_repr": ("_repr_html_",),  # tables, not the names of objects
}


def keep_whole(self: Any) -> tuple[str, list[str]]:
    """The docstring of an attribute as it stands: Napoleon would take what is before a colon for its type."""
    return "", self._dedent(list(self._consume_to_end()))


GoogleDocstring._consume_inline_attribute = keep_whole

_CLASSES = {
    name.rpartition(".")[2]: name
    for page in sorted(Path(__file__).parent.glob("api*.md"))
    for name in re.findall(r"autoclass:: (snapbeam\S+)", page.read_text(encoding="utf-8"))
}
"""Classes that have an entry in the reference, by their own name."""
_CLASS = re.compile(rf"(?<![\w.`~[])({'|'.join(_CLASSES)})(?![\w.`])")
_format_field = GoogleDocstring._format_field


def linked_field(self: Any, name: str, kind: str, description: list[str]) -> list[str]:
    """A parameter with links to the classes of its type, and a dash: two hyphens are an option's."""
    if "`" not in kind and _CLASS.search(kind):
        parts = [part.strip() for part in _CLASS.split(kind)]
        kind = " ".join(
            f":class:`~{_CLASSES[part]}`" if i % 2 else f"*{part}*" for i, part in enumerate(parts) if part
        ).replace("` *,", "`\\ *,")
    first, *others = _format_field(self, name, kind, description)
    return [first.replace(" -- ", " – ", 1), *others]


GoogleDocstring._format_field = linked_field

_link = PyXrefMixin.make_xrefs


def link_errors_only(self: Any, rolename: str, domain: str, target: str, *more: Any, **options: Any) -> Any:
    """Types are words, such as "array of shape (N,)": they name no class and no attribute ``shape``."""
    if rolename == "exc":
        return _link(self, rolename, domain, target, *more, **options)
    return [options.get("contnode") or nodes.emphasis(target, target)]


PyXrefMixin.make_xrefs = link_errors_only


_PREAMBLES = {
    page.stem: (
        re.findall(r"^```python\n(.*?)^```$", page.read_text(encoding="utf-8"), re.MULTILINE | re.DOTALL) or [""]
    )[0]
    for page in Path(__file__).parent.glob("api_*.md")
}
"""Beginning of the examples on each page of the reference, by page."""
_BRIEF = tuple(
    name
    for page in Path(__file__).parent.glob("api_*.md")
    for block in page.read_text(encoding="utf-8").split("% brief\n")[1:]
    for name in re.findall(r"^\.\. auto\w+:: (\S+)", block.partition("\n## ")[0], re.MULTILINE)
)
"""Names and modules of which the reference has signature and summary only."""


def shorten(app: Any, what: str, name: str, found: Any, options: Any, lines: list[str]) -> None:
    """Leave out of a docstring what the page states once, and all but the summary of names that are listed only."""
    if name in _BRIEF or name.startswith(tuple(f"{each}." for each in _BRIEF)):
        lines[:] = lines[: lines.index("")] if "" in lines else lines
        return
    code = _PREAMBLES.get(app.env.docname, "")
    stated = set(map(ast.unparse, ast.parse(code).body))
    bound = {
        each.asname or each.name
        for node in ast.walk(ast.parse(code))
        if isinstance(node, (ast.Import, ast.ImportFrom))
        for each in node.names
    }
    kept: list[str] = []
    leading = False
    position = 0
    while position < len(lines):
        end = position + 1
        if lines[position].lstrip().startswith(">>> "):
            while end < len(lines) and lines[end].lstrip().startswith("..."):
                end += 1
            try:
                node = ast.parse("\n".join(line.lstrip()[4:] for line in lines[position:end])).body[0]
            except (SyntaxError, IndexError):
                node = None
            imported = (
                isinstance(node, (ast.Import, ast.ImportFrom))
                and {each.asname or each.name for each in node.names} <= bound
            )
            own = any(name.rpartition(".")[2] + "(" in line for line in lines[position:end])
            if imported or (leading and not own and node is not None and ast.unparse(node) in stated):
                position = end
                continue
            leading = False
        elif lines[position].strip() == "Examples":
            leading = True
        kept += lines[position:end]
        position = end
    lines[:] = kept


def hide_signature(app: Any, what: str, name: str, found: Any, options: Any, *signature: Any) -> tuple[str, str] | None:
    """Leave out the arguments of a class that functions make: its docstring has none, and no call of it."""
    words = found.__doc__ or ""
    made = what == "class" and "Parameters\n" not in words and f"{name.rpartition('.')[2]}(" not in words
    return ("", "") if made else None


def join_names(app: Any, what: str, name: str, found: Any, options: Any, lines: list[str]) -> None:
    """Write attributes that share a description without spaces: Sphinx takes what is before a space for a type."""
    lines[:] = [re.sub(r"^:(?:ivar|vartype) [^:]+:", lambda names: names[0].replace(", ", ","), line) for line in lines]


def with_dashes(app: Any, doctree: Any) -> None:
    """Write a dash between an error and its description."""
    for text in list(doctree.findall(nodes.Text)):
        if text == " -- ":
            text.parent.replace(text, nodes.Text(" – "))


def draw_paper(app: Any) -> None:
    """Draw every figure of the paper for the page on its reproduction."""
    import matplotlib.pyplot as plt
    import studies  # noqa: F401  so that they are drawn too

    from snapbeam import paper
    from snapbeam.plot.style import save_figure

    folder = Path(app.srcdir) / "_paper"
    folder.mkdir(exist_ok=True)
    quick = paper.Results("quick")
    for name, recipe in paper.FIGURES.items():
        kept = (DATA / f"{name}.nc").exists()
        results = paper.Results("full", read=DATA) if kept else quick
        for suffix in (".png", ".pdf"):
            figure = recipe(results=results)
            save_figure(figure, folder / f"{name}{suffix}")
            plt.close(figure)


def summarise_claims(app: Any) -> None:
    """Count the verdicts on the claims of the paper by topic, and list the claims that fail."""
    with (DATA / "claims.csv").open(encoding="utf-8", newline="") as stream:
        claims = list(csv.DictReader(stream))
    verdicts = ("holds", "in part", "fails")
    lines = [
        (DATA / "claims.md").read_text(encoding="utf-8").partition("\n")[0],
        "",
        "| topic | hold | hold in part | fail |",
        "| --- | --- | --- | --- |",
    ]
    for topic in dict.fromkeys(row["topic"] for row in claims if row["verdict"] != "open"):
        counts = Counter(row["verdict"] for row in claims if row["topic"] == topic)
        lines.append(f"| {topic} | " + " | ".join(str(counts[each]) for each in verdicts) + " |")
    lines += [
        "",
        "These claims fail:",
        "",
        "| # | statement | value in the paper | measured |",
        "| --- | --- | --- | --- |",
    ]
    for row in claims:
        if row["verdict"] == "fails":
            cells = (row[name].replace("|", "\\|") for name in ("number", "says", "paper", "measured"))
            lines.append("| " + " | ".join(cells) + " |")
    (_HERE / "_generated" / "claims.md").write_text("\n".join(lines) + "\n", encoding="utf-8")


def summarise_validation(app: Any) -> None:
    """List for each source of published numbers how many are compared, and the maximum difference with its remark."""
    rows: dict[str, list[tuple[float, str]]] = {}
    for line in (DATA / "validation.md").read_text(encoding="utf-8").splitlines()[2:]:
        source, _, _, _, difference, remark = (cell.strip() for cell in line.split("|")[1:-1])
        rows.setdefault(source, []).append((abs(float(difference.removeprefix("below "))), remark))
    lines = ["| source | quantities | maximum difference | remark on the maximum |", "| --- | --- | --- | --- |"]
    for source, found in rows.items():
        difference, remark = max(found)
        lines.append(
            f"| {source} | {len(found)} | {'below 1e-6' if difference == 1e-6 else f'{difference:.0e}'} | {remark} |"
        )
    (_HERE / "_generated" / "validation.md").write_text("\n".join(lines) + "\n", encoding="utf-8")


def link_gallery(app: Any, name: str, source: list[str]) -> None:
    """Lead links of a page to scripts of the gallery to the pages that show them."""
    source[0] = re.sub(r"\]\(\.\./examples/(ex\d\d_\w+)\.py\)", r"](gallery/\1.rst)", source[0])


_HERE = Path(__file__).parent
(_HERE / "_generated" / "static").mkdir(parents=True, exist_ok=True)
shutil.copyfile(
    Path(_MATHJAX.origin).parent / "static" / "mathjax" / "tex-svg.js", _HERE / "_generated" / "static" / "mathjax.js"
)


def setup(app: Any) -> None:
    """Connect to Sphinx."""
    app.connect("builder-inited", draw_paper)
    app.connect("builder-inited", summarise_claims)
    app.connect("builder-inited", summarise_validation)
    app.connect("source-read", link_gallery)
    app.connect("doctree-read", with_dashes)
    app.connect("autodoc-process-signature", hide_signature)
    app.connect("autodoc-process-docstring", shorten, priority=400)  # before Napoleon
    app.connect("autodoc-process-docstring", join_names, priority=600)  # after Napoleon
