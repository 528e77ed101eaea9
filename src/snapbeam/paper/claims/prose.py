"""The words of the table: a TOML file a topic, whose placeholders the measured numbers fill.

``<name:.2f>`` is a number by that format, ``<name.u:.2f>`` the uncertainty of a quantity, ``<name?this|that>`` one
of two texts as the number is true or zero.  A share is written ``<name:.1%>``, a small number in powers of ten
``<name:e>``.  A list is joined by commas; the rows of a list of rows are each written by a format of printf.
"""

from __future__ import annotations

import math
import re
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, fields
from importlib.resources import files

from snapbeam.paper.claims.claim_result import ClaimResult, Number, Quantity

_PLACEHOLDER = re.compile(r"<([a-z][a-z0-9_]*)(\.u)?(?::([^<>]+)|\?([^<>|]*)\|([^<>|]*))?>")


@dataclass(frozen=True)
class Entry:
    """The words of one row, with placeholders where measured numbers go.

    ``says``: the statement.  ``paper``: its number, in the paper's words.  ``source``: its location there.
    ``measured``, ``uncertainty``: what was found and how well it is known.  ``rule``: what the verdict follows
    from.  ``fails``: what would have failed it.  ``figure``: the recipe that shows it.  ``note``: what to make
    of it.
    """

    says: str
    paper: str
    source: str
    measured: str
    uncertainty: str
    rule: str
    fails: str
    figure: str = ""
    note: str = ""


@dataclass(frozen=True)
class Topic:
    """Rows that belong together, in their order; ``open`` if they are questions and not claims."""

    title: str
    open: bool
    entries: Mapping[str, Entry]


def read_topic(name: str) -> Topic:
    """The words of a topic, by the name of its module."""
    text = (files("snapbeam.paper.claims.topics") / f"{name}.toml").read_text(encoding="utf-8")
    table = tomllib.loads(text)
    title, is_open, shared = table.pop("title"), table.pop("open", False), table.pop("shared", {})
    known = {item.name for item in fields(Entry)}
    entries = {}
    for number, given in table.items():
        row = {**shared, **given}
        if unknown := set(row) - known:
            raise ValueError(f"{name}.toml, {number}: {', '.join(sorted(unknown))} is no part of a row")
        entries[number] = Entry(**{key: " ".join(value.split()) for key, value in row.items()})
    return Topic(title, is_open, entries)


def fill(text: str, result: ClaimResult) -> str:
    """A text with its placeholders filled; KeyError for a name that was not measured."""

    def value(match: re.Match[str]) -> str:
        name, uncertainty, spec, yes, no = match.groups()
        given: Quantity | Number = result.quantities[name] if name in result.quantities else result.numbers[name]
        if isinstance(given, Quantity):
            given = given.uncertainty if uncertainty else given.value
        elif uncertainty:
            raise KeyError(f"{name}.u")
        if yes is not None:
            return str(yes if given else no)
        return _written(given, spec or "g")

    return _PLACEHOLDER.sub(value, text)


def _written(given: Number, spec: str) -> str:
    if isinstance(given, tuple):
        rows = [spec % row if isinstance(row, tuple) else _written(row, spec) for row in given]
        return ", ".join(rows) if rows else "none"
    if isinstance(given, float) and not math.isfinite(given):
        return "none"
    if spec.endswith("%"):
        return f"{100.0 * given:{spec[:-1]}f} %"
    if spec.endswith("e"):
        return _power(float(given), spec[:-1] or ".1")
    return f"{given:{spec}}"


def _power(value: float, precision: str) -> str:
    if value == 0.0:
        return "0"
    mantissa, exponent = f"{value:{precision}e}".split("e")
    return rf"${mantissa} \times 10^{{{int(exponent)}}}$"
