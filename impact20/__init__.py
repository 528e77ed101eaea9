"""Impact problems with references by two independent codes: `from impact20 import load; problem = load("hertz_wall")`."""

import tomllib
from pathlib import Path
from typing import Any, NamedTuple

FOLDER = Path(__file__).parent


class Problem(NamedTuple):
    """A problem: parameters in SI units, and for each quantity its reference value, error and conditioning."""

    name: str
    description: str
    source: str
    parameters: dict[str, float]
    references: dict[str, dict[str, float]]


def names() -> list[str]:
    """List the names of the problems."""
    return sorted(path.stem for path in (FOLDER / "problems").glob("*.toml"))


def load(name: str) -> Problem:
    """Read a problem by its name."""
    if name not in names():
        raise ValueError(f"name = {name!r}: must be one of {', '.join(names())}")
    text: dict[str, Any] = tomllib.loads((FOLDER / "problems" / f"{name}.toml").read_text(encoding="utf-8"))
    stored = FOLDER / "references.toml"
    references = tomllib.loads(stored.read_text(encoding="utf-8")).get(name, {}) if stored.exists() else {}
    return Problem(name, text["description"], text["source"], text["parameters"], references)
