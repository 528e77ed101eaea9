"""The lines of constraints.txt that the package and some of its extras need, with their hashes.

python locked.py EXTRA... > requirements.txt
"""

from __future__ import annotations

import re
import sys
import tomllib
from pathlib import Path

ROOT = Path(__file__).parents[2]
_LINES = re.compile(r"^(?P<name>[\w.-]+)==\S+.*?\n    # via (?P<parents>[^\n]*)\n", re.MULTILINE | re.DOTALL)


def normal(requirement: str) -> str:
    """Return the name of a requirement as package indexes compare it."""
    name = re.match(r"[\w.-]+", requirement)
    assert name is not None
    return re.sub(r"[-_.]+", "-", name[0]).lower()


def locked(extras: list[str]) -> dict[str, str]:
    """Return the lines of each package: of the direct requirements, and of what has one of them as a parent."""
    described = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    project = described["project"]
    direct = [*described["build-system"]["requires"], *project["dependencies"]]
    for extra in extras:
        direct += project["optional-dependencies"][extra]
    wanted, before = {normal(each) for each in direct}, set()
    found = {
        each["name"]: (each[0], set(each["parents"].split(", ")))
        for each in _LINES.finditer((ROOT / "constraints.txt").read_text(encoding="utf-8"))
    }
    while wanted != before:
        before = set(wanted)
        wanted |= {name for name, (_, parents) in found.items() if parents & before}
    return {name: found[name][0] for name in sorted(wanted)}


if __name__ == "__main__":
    print(*locked(sys.argv[1:]).values(), sep="", end="")
