"""Twenty impact problems with references by two independent codes: `from impact20 import load; load("hertz").cases`."""

import json
import tomllib
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

FOLDER = Path(__file__).parent
Array = NDArray[np.float64]


@dataclass(frozen=True)
class Tip:
    """A contact: the penetration is d = amplitude sin(frequency t + phase) - gap - row . x, the force acts along row."""

    row: Array
    law: str
    """"power", "hunt_crossley", "kelvin_voigt" or "restitution"."""
    stiffness: float = 0.0
    exponent: float = 1.0
    factor: float = 0.0
    """chi of Hunt and Crossley."""
    damping: float = 0.0
    """c of Kelvin and Voigt."""
    coefficient: float = 1.0
    """e of Newton's law of impact."""
    gap: float = 0.0
    amplitude: float = 0.0
    frequency: float = 0.0
    phase: float = 0.0


@dataclass(frozen=True)
class Case:
    """The numbers of one initial value problem; `equations` in the problem's file states what they mean."""

    name: str
    horizon: float
    samples: int
    scale: float
    stiffness: Array
    damping: Array
    start: Array
    speed: Array
    output: Array
    gamma: float = 0.0
    coupling: Array | None = None
    """Symmetric matrix G of the cubic term, or None."""
    gradient: Array | None = None
    """Vector g of the cubic term, or None for zeros."""
    load: Array | None = None
    harmonic: Array | None = None
    frequency: float = 0.0
    phase: float = 0.0
    pulse: Array | None = None
    pulse_duration: float = 0.0
    truss: tuple[float, float] | None = None
    """Stiffness and rest length of the truss's bars."""
    circuit: tuple[float, float] | None = None
    """Coupling and rate of the circuit."""
    conservative: bool = False
    count_impacts: bool = True
    tips: tuple[Tip, ...] = ()

    @property
    def times(self) -> Array:
        """The output times: `samples` equal parts of the horizon."""
        return self.horizon * np.arange(1, self.samples + 1) / self.samples


@dataclass(frozen=True)
class Problem:
    """A problem: why it exists, its equations, its cases and for each case the reference."""

    name: str
    title: str
    reason: str
    difficulty: int
    equations: str
    source: str
    kind: str
    cases: tuple[Case, ...]
    study: dict[str, Any] = field(default_factory=dict)
    references: dict[str, dict[str, Any]] = field(default_factory=dict)


def names() -> list[str]:
    """List the names of the problems, from easy to hard."""
    files = (FOLDER / "problems").glob("*.toml")
    order = {path.stem: tomllib.loads(path.read_text(encoding="utf-8"))["number"] for path in files}
    return sorted(order, key=lambda name: order[name])


def case_of(table: dict[str, Any]) -> Case:
    """Make a case of its table; matrices are read from the file that `data` names."""
    given = dict(table)
    if "data" in given:
        stored = json.loads((FOLDER / "data" / given.pop("data")).read_text(encoding="utf-8"))
        given = {**stored["structure"], **given}
        rows = stored["rows"]
    else:
        rows = {}

    def vector(value: Any) -> Array:
        return np.array(rows[value] if isinstance(value, str) else value, dtype=float)

    tips = tuple(Tip(**{**tip, "row": vector(tip["row"])}) for tip in given.pop("contact", []))
    size = len(given["stiffness"])
    given.setdefault("damping", [0.0] * size)
    given.setdefault("speed", [0.0] * size)
    given.setdefault("start", [0.0] * size)
    for key in ("stiffness", "damping", "start", "speed", "output", "gradient", "coupling", "load", "harmonic"):
        if key in given:
            given[key] = vector(given[key])
    if "pulse" in given:
        given["pulse"] = vector(given["pulse"])
    for key in ("truss", "circuit"):
        if key in given:
            given[key] = tuple(given[key])
    return Case(tips=tips, **given)


def load(name: str) -> Problem:
    """Read a problem by its name."""
    if name not in names():
        raise ValueError(f"name = {name!r}: must be one of {', '.join(names())}")
    text: dict[str, Any] = tomllib.loads((FOLDER / "problems" / f"{name}.toml").read_text(encoding="utf-8"))
    stored = FOLDER / "references.toml"
    references = tomllib.loads(stored.read_text(encoding="utf-8")).get(name, {}) if stored.exists() else {}
    return Problem(
        name, text["title"], text["reason"], text["difficulty"], text["equations"], text["source"],
        text.get("kind", "trajectory"), tuple(case_of(table) for table in text["case"]),
        text.get("study", {}), references,
    )  # fmt: skip
