"""Write the version and the address of the repository into every file that states them.

``make release VERSION=0.2.0 REPOSITORY=https://github.com/OWNER/snapbeam`` calls this. A version that ends in ``.dev0``
is one between two releases: it opens the section "Unreleased" of the changelog again.
"""

from __future__ import annotations

import datetime
import re
import sys
from pathlib import Path

ROOT = Path(__file__).parents[2]
VERSIONS = {
    "src/snapbeam/_version.py": r'^(__version__ = ")([^"]+)(")$',
    "CITATION.cff": r"^(version: )(\S+)()$",
    "codemeta.json": r'^(  "version": ")([^"]+)(",)$',
    "recipe/recipe.yaml": r'^(  version: ")([^"$]+)(")$',
    "docs/getting-started.md": r"^(  version = \{)([^}]+)(\},)$",
}
"""File and pattern; the second group is the version."""


def versions(root: Path = ROOT) -> dict[str, str]:
    """Return the version that each file states."""
    found = {}
    for name, pattern in VERSIONS.items():
        match = re.search(pattern, (root / name).read_text(encoding="utf-8"), re.MULTILINE)
        assert match is not None, name
        found[name] = match[2]
    return found


def _edit(path: Path, pattern: str, replacement: str) -> None:
    text, count = re.subn(pattern, replacement, path.read_text(encoding="utf-8"), count=1, flags=re.MULTILINE)
    if count != 1:
        raise SystemExit(f"{path.name}: nothing matches {pattern}")
    path.write_text(text, encoding="utf-8")


def _state_line(path: Path, pattern: str, line: str, after: str) -> None:
    """Replace the line that matches, or add it after another one."""
    text = path.read_text(encoding="utf-8")
    if re.search(pattern, text, re.MULTILINE):
        _edit(path, pattern, line)
    else:
        _edit(path, rf"({after})", rf"\1\n{line}")


def prepare(version: str, repository: str = "", day: str = "", root: Path = ROOT) -> None:
    """Write version, date and repository.

    Raises
    ------
    SystemExit
        For a version that is not ``1.2.3`` or ``1.2.3.dev0``, or a file that does not have the expected text.
    """
    if not re.fullmatch(r"\d+\.\d+\.\d+(\.dev0)?", version):
        raise SystemExit(f"VERSION = {version!r}: must be like 0.2.0 or 0.3.0.dev0")
    for name, pattern in VERSIONS.items():
        _edit(root / name, pattern, rf"\g<1>{version}\g<3>")
    changelog = root / "CHANGELOG.md"
    if version.endswith(".dev0"):
        if "\n## Unreleased\n" not in changelog.read_text(encoding="utf-8"):
            _edit(changelog, r"^## ", "## Unreleased\n\n## ")
    else:
        day = day or datetime.date.today().isoformat()
        _edit(changelog, r"^## Unreleased$", f"## {version} ({day})")
        _edit(root / "docs" / "getting-started.md", r"^(  year    = \{)\d+", rf"\g<1>{day[:4]}")
        _state_line(root / "CITATION.cff", r"^date-released: .*$", f"date-released: {day}", r"^version: \S+$")
        _state_line(
            root / "codemeta.json", r'^  "dateModified": .*$', f'  "dateModified": "{day}",',
            r'^  "version": .*$',
        )  # fmt: skip
    if repository:
        _state_line(
            root / "CITATION.cff", r"^repository-code: .*$", f"repository-code: {repository}",
            r"^license: \S+$",
        )  # fmt: skip
        _state_line(
            root / "codemeta.json", r'^  "codeRepository": .*$', f'  "codeRepository": "{repository}",',
            r'^  "version": .*$',
        )  # fmt: skip
        urls = {
            "Source": repository,
            "Issues": f"{repository}/issues",
            "Changelog": f"{repository}/blob/main/CHANGELOG.md",
        }
        for name, url in urls.items():
            _state_line(root / "pyproject.toml", rf"^{name} = .*$", f'{name} = "{url}"', r"^\[project\.urls\]$")


if __name__ == "__main__":
    prepare(*sys.argv[1:3])
