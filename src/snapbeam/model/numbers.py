"""The numbers of a law or a drive, as kernels see them."""

from __future__ import annotations

import secrets
from collections import namedtuple
from collections.abc import Iterable
from typing import Any

__all__ = ["numbers_type", "own_name"]

_named_tuple: Any = namedtuple


def own_name(kind: type) -> str:
    """A name that no other class has, in this process or in one whose machine code may be loaded into it.

    Compiled functions are linked by names that those of their arguments' types are part of.  Two laws whose numbers
    were called alike would share code, whichever was loaded first.
    """
    return f"{kind.__qualname__}.{secrets.token_hex(8)}"


def numbers_type(kind: Any, fields: Iterable[str]) -> Any:
    """The named tuple of a class's numbers, made once; an attribute of the class, ``Numbers``."""
    if "Numbers" not in vars(kind):
        made: Any = _named_tuple("Numbers", tuple(fields))
        made.__module__, made.__qualname__ = kind.__module__, f"{kind.__qualname__}.Numbers"
        made.__name__, made.owner = own_name(kind), kind
        kind.Numbers = made
    return kind.Numbers
