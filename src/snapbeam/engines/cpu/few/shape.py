"""How many modes there are and which of them are coupled, as a type: code is compiled for each."""

from __future__ import annotations

from collections import namedtuple
from functools import cache
from typing import Any

__all__ = ["shape_of"]

_named_tuple: Any = namedtuple


@cache
def shape_of(blocks: tuple[int, ...], flows: int) -> Any:
    """An empty named tuple whose type stands for blocks of so many coupled modes and for so many flows of a step."""
    name = "_".join(map(str, ("Modes", *blocks, "flows", flows)))
    made: Any = _named_tuple(name, ())
    made.__module__, made.blocks, made.flows = __name__, blocks, flows
    globals()[name] = made
    return made()


def __getattr__(name: str) -> Any:
    """The type of a shape by its name, for compiled code that is read from the disk."""
    if name.startswith("Modes_"):
        *blocks, _, flows = name.split("_")[1:]
        return type(shape_of(tuple(map(int, blocks)), int(flows)))
    raise AttributeError(name)
