"""Checks of a class that extends the package: a law, a drive, a force, a harvester, when it is defined."""

from __future__ import annotations

import dataclasses
import difflib
import inspect
from collections.abc import Iterable
from functools import cached_property
from typing import Any

from snapbeam.util.validation import InputError

_CLOSE = 0.78
"""Similarity from which on a name of one's own counts as a misspelt hook."""


def check_names(kind: Any) -> None:
    """Raise an error for a public name of an extension that looks like a hook, and that nothing reads.

    Fields are the constants of the extension, class methods make it.  Static methods and plain values are hooks, all of them.
    Ordinary methods and properties may be the author's own; they are refused where they resemble a hook.
    """
    known = {*kind.hooks, *(name for base in kind.__mro__[1:] for name in vars(base))}
    for name, value in vars(kind).items():
        if name.startswith("_") or name in known or isinstance(value, (dataclasses.Field, classmethod)):
            continue
        own = inspect.isfunction(value) or isinstance(value, (property, cached_property))
        close = difflib.get_close_matches(name, kind.hooks, 1, _CLOSE if own else 0.6)
        if not own and not close:
            close = [each for each in kind.hooks if each.startswith(name) or name.startswith(each)][:1]
        if close or not own:
            nearest = f"did you mean {close[0]!r}? " if close else ""
            raise InputError(
                f"{kind.__name__}.{name}: is no hook, and nothing would read it; {nearest}the hooks are "
                f"{', '.join(kind.hooks)}; a constant is a "
                "field made by quantity, and a name of your own begins with an underscore"
            )


def overrides(kind: type, base: type, name: str) -> bool:
    """Return whether a class has a hook of its own, in place of that of the *base*."""
    return getattr(kind, name, None) is not getattr(base, name, None)


def takes(function: Any, count: int) -> bool:
    """Return whether a function can be called with so many arguments."""
    try:
        inspect.signature(function).bind(*range(count))
    except (TypeError, ValueError):
        return False
    return True


def check_pair(kind: type, flag: str, base: type, hooks: Iterable[str]) -> None:
    """Raise an error unless a class has all *hooks* with the flag, and none without."""
    value: Any = getattr(kind, flag)
    for name in hooks:
        if bool(value) and not overrides(kind, base, name):
            raise InputError(f"{kind.__name__}.{flag} = {value!r}: needs {name}, which is not defined; define it")
        if not value and overrides(kind, base, name):
            raise InputError(
                f"{kind.__name__}.{name}: is read only with {flag}, which is {value!r}; set {flag} in the class"
            )


def check_defined(kind: type, base: type, hooks: Iterable[str]) -> None:
    """Raise an error for hooks that a class must have and does not define."""
    missing = [name for name in hooks if not overrides(kind, base, name)]
    if missing:
        raise InputError(
            f"{kind.__name__}: has no {' and no '.join(missing)}; see the docstring of {base.__name__} and define "
            f"{'it' if len(missing) == 1 else 'them'}"
        )
