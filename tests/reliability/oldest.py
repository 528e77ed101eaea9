"""The lower bounds of pyproject.toml as versions to install: what ``make test-oldest`` tests with.

python oldest.py EXTRA_OR_GROUP... > requirements.txt
"""

from __future__ import annotations

import re
import sys
import tomllib
from pathlib import Path

PYPROJECT = Path(__file__).parents[2] / "pyproject.toml"
_BOUND = re.compile(r"(?P<name>[A-Za-z0-9_.-]+(?:\[[a-z0-9,]+\])?)>=(?P<version>[0-9.]+)(?:,<[0-9.]+)?")


def oldest(sets: list[str], pyproject: Path = PYPROJECT) -> list[str]:
    """A requirement for each dependency, of the package and of some of its extras and groups, at its lower bound.

    Raises
    ------
    ValueError
        For a dependency without a lower bound, or with more than a lower and an upper bound.
    """
    stated = tomllib.loads(pyproject.read_text(encoding="utf-8"))
    known = stated["project"].get("optional-dependencies", {}) | stated.get("dependency-groups", {})
    asked = list(stated["project"]["dependencies"])
    for name in sets:
        asked += known[name]
    found = []
    for text in asked:
        match = _BOUND.fullmatch(text)
        if match is None:
            raise ValueError(f"{text!r}: must be name>=version")
        found.append(f"{match['name']}=={match['version']}")
    return found


if __name__ == "__main__":
    print(*oldest(sys.argv[1:]), sep="\n")
