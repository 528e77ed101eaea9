"""Query string of the page's address: the displayed state, so that a link shows it again.

Whatever comes from there is checked like any input, and counts for nothing where it is wrong.
"""

from __future__ import annotations

import json
import math
import re
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any
from urllib.parse import urlencode

from snapbeam import InputError
from snapbeam.explorer.jobs import ADDRESS
from snapbeam.model.parameters import lookup
from snapbeam.model.quantity import split_name

_KEYS = ("x", "y", "show", "cut", "at", "b", "view", "set", "theme", "type", "tab", "card", "units")
_NAMES = ("x", "y", "show", "tab", "card")
_WORDS = {"theme": ("default", "dark"), "type": ("large",), "units": ("physical",)}
_MOST = 64
_NAME = r"[a-z]\w*(\.[1-9]\d*)?(\.\w+)?"


@dataclass(frozen=True)
class Address:
    """The state of a page.

    Attributes
    ----------
    x, y, show : str
        The two axes and the variable; empty for the default.
    cut : dict
        The point of each axis that is not shown, by dotted name.
    at, b : dict
        The point whose run is shown, and that of the second run, by dotted name.
    view : tuple of 4 floats, optional
        What is seen of the map.
    changes : dict
        Parameters that differ from the map's system, by dotted name; None for a parameter, or a section, that it has not.
    theme, type : str
        "dark" or "default"; "large" for a lecture.
    units : str
        "physical" for Hz, mm and mm/s in the views of a run.
    tab, card : str
        View of the run and card next to it; empty for the first ones.
    words : tuple of str
        What was wrong in the address.
    """

    x: str = ""
    y: str = ""
    show: str = ""
    cut: Mapping[str, Any] = field(default_factory=dict)
    at: Mapping[str, Any] = field(default_factory=dict)
    b: Mapping[str, Any] = field(default_factory=dict)
    view: tuple[float, ...] | None = None
    changes: Mapping[str, Any] = field(default_factory=dict)
    theme: str = "default"
    type: str = ""
    tab: str = ""
    card: str = ""
    units: str = ""
    words: tuple[str, ...] = ()

    @classmethod
    def read(cls, arguments: Mapping[str, list[bytes]]) -> Address:
        """The state that an address describes; invalid parts are ignored and reported."""
        size = sum(len(name) + sum(map(len, values)) for name, values in arguments.items())
        if size > ADDRESS:
            return cls(words=(f"the address is longer than {ADDRESS} characters and counts for nothing",))
        found, wrong = cls(), []
        for name in _KEYS:
            values = arguments.get(name)
            if not values:
                continue
            try:
                found = _with(found, name, values[0].decode("utf-8"))
            except (InputError, ValueError) as error:
                wrong.append(f"address, {name}: {str(error)[:200]}")
        return replace(found, words=tuple(wrong))

    def write(self) -> str:
        """The part of the address after the question mark."""
        parts = {name: getattr(self, name) for name in _NAMES}
        for name in ("cut", "at", "b"):
            parts[name] = ",".join(f"{each}:{value}" for each, value in getattr(self, name).items())
        parts["set"] = ",".join(f"{name}:{_written(value)}" for name, value in self.changes.items())
        if self.view is not None:
            parts["view"] = ",".join(repr(float(value)) for value in self.view)
        parts |= {name: getattr(self, name) for name in _WORDS}
        held = {name: value for name, value in parts.items() if value and value != "default"}
        return urlencode(held, safe=",:")


def _with(found: Address, name: str, text: str) -> Address:
    if name in _NAMES:
        if not text.isidentifier() or len(text) > _MOST:
            raise InputError("must be a name")
        return replace(found, **{name: text})  # type: ignore[arg-type]
    if name in _WORDS:
        if text not in _WORDS[name]:
            raise InputError(f"must be {' or '.join(_WORDS[name])}")
        return replace(found, **{name: text})  # type: ignore[arg-type]
    if name == "view":
        view = tuple(number("view", part) for part in text.split(","))
        if len(view) != 4 or not (view[0] < view[1] and view[2] < view[3]):
            raise InputError("must be left,right,low,high")
        return replace(found, view=view)
    if name == "set":
        return replace(found, changes=_changes(text))
    return replace(found, **{name: _pairs(text)})  # type: ignore[arg-type]


def _written(value: Any) -> str:
    """A value of a parameter file in an address: empty for None, a word as it is, anything else as JSON without commas."""
    if value is None:
        return ""
    if isinstance(value, str) and value.isidentifier() and _value(value) == value:
        return value
    if isinstance(value, str):
        return json.dumps(value).replace(",", r"\u002c").replace(";", r"\u003b")
    return json.dumps(value, separators=(";", ":"))


def _value(text: str) -> Any:
    try:
        return json.loads(text.replace(";", ",")) if text else None
    except (ValueError, RecursionError):
        return text


def _changes(text: str) -> dict[str, Any]:
    """Differences from the map's system, which are checked when the system is made."""
    parts = [part.partition(":") for part in text.split(",")]
    changes = {name: _value(value) for name, _, value in parts}
    for name, colon, value in parts:
        if not colon or not re.fullmatch(_NAME, name) or (value and not split_name(name)[1]):
            raise InputError("must be section.name:value,section.name:value")
    return changes


def _pairs(text: str) -> dict[str, Any]:
    parts = [part.partition(":") for part in text.split(",")]
    if not all(colon for _, colon, _ in parts):
        raise InputError("must be name:value,name:value")
    if len(parts) > _MOST:
        raise InputError(f"at most {_MOST} of them")
    return {lookup(name).name: typed(name, value) for name, _, value in parts}


def typed(name: str, text: str) -> Any:
    """The value of a parameter that was typed; refused (InputError) if it has none such."""
    item, value = lookup(name).quantity, text.strip()
    if item.kind is bool:
        return item.check(name, {"True": True, "False": False}.get(value, value))
    if item.kind is str:
        return item.check(name, value)
    found = number(name, value)
    return item.check(name, int(found) if item.kind is int and found == int(found) else found)


def number(name: str, text: str) -> float:
    """A finite number that was typed.

    Raises
    ------
    InputError
        If it is none.
    """
    try:
        value = float(text.strip())
    except (ValueError, AttributeError):
        raise InputError(f"{name} = {str(text)[:40]!r}: must be a number") from None
    if not math.isfinite(value):
        raise InputError(f"{name} = {text!r}: must be a finite number")
    return value
