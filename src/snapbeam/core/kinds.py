"""The kinds of arguments at a public function's door, read off its annotations."""

from __future__ import annotations

import functools
import inspect
import types
import typing
from collections.abc import Callable, Iterable, Mapping, Sequence
from importlib import import_module
from numbers import Real
from typing import Any, TypeVar

import numpy as np

from snapbeam.core.validate import InputTypeError, flag, shown

__all__ = ["checked"]

_F = TypeVar("_F", bound=Callable[..., Any])
_ABSTRACT = {Sequence: "a sequence", Mapping: "a mapping", Iterable: "a sequence", Callable: "callable"}
_LIBRARIES = {"xr": "xarray", "np": "numpy", "pd": "pandas"}
_ROOMS = ("snapbeam", "snapbeam.lab")


class _Names(dict[str, Any]):
    """Names of annotations that a module imports for its type checks alone: xarray's and snapbeam's own."""

    def __missing__(self, name: str) -> Any:
        if name in _LIBRARIES:
            return import_module(_LIBRARIES[name])
        for room in map(import_module, _ROOMS):
            if name in room.__all__:
                return getattr(room, name)
        raise KeyError(name)


def _kinds(function: Callable[..., Any]) -> dict[str, Any]:
    """What each parameter may be, as far as its annotation can be read."""
    found = {}
    for each in inspect.signature(function).parameters.values():
        if each.kind in (each.VAR_POSITIONAL, each.VAR_KEYWORD) or each.annotation is each.empty:
            continue
        annotation = each.annotation
        if isinstance(annotation, str):
            holder = type(each.name, (), {"__annotations__": {each.name: annotation}})
            try:
                annotation = typing.get_type_hints(holder, function.__globals__, _Names())[each.name]
            except Exception:
                continue
        found[each.name] = annotation
    return found


def _members(annotation: Any) -> list[Any]:
    if typing.get_origin(annotation) in (typing.Union, types.UnionType):
        return [each for part in typing.get_args(annotation) for each in _members(part)]
    return [annotation]


def _suits(value: Any, kind: Any) -> bool:
    """If *value* may be of a kind; whatever cannot be told is left to the function."""
    origin = typing.get_origin(kind) or kind
    if kind is Any or kind is object:
        return True
    if kind is None or kind is type(None):
        return value is None
    if origin is typing.Literal:
        return True  # the function names the words that it takes
    if kind is float or kind is int:
        return isinstance(value, Real) or (isinstance(value, np.ndarray) and value.ndim == 0)
    if origin in (tuple, list):
        origin = Sequence
    if origin in (Sequence, Iterable):
        if isinstance(value, np.ndarray):
            return value.ndim > 0
        return isinstance(value, origin) and not isinstance(value, (str, bytes))
    if origin is np.ndarray:
        return True  # checked, with its numbers, where it is used
    if not isinstance(origin, type) or getattr(origin, "_is_protocol", False):
        return origin is not Callable or callable(value)
    return isinstance(value, origin)


def _words(kinds: list[Any]) -> str:
    names = []
    for kind in kinds:
        origin = typing.get_origin(kind) or kind
        if kind is None or kind is type(None):
            names.append("None")
        elif origin is tuple and typing.get_args(kind) == (float, float):
            names.append("two numbers")
        elif origin in (tuple, list):
            names.append("a sequence")
        elif origin in _ABSTRACT:
            names.append(_ABSTRACT[origin])
        elif kind in (float, int):
            names.append("a number")
        elif kind is str:
            names.append("text")
        else:
            names.append(getattr(origin, "__name__", str(origin)))
    return " or ".join(dict.fromkeys(names))


def checked(function: _F) -> _F:
    """Refuse arguments of another kind than *function*'s annotations say, before it begins.

    What is a number, a flag, a dataset, a system or a sequence is decided here; which numbers and words are allowed is
    the function's to say.

    Raises
    ------
    InputTypeError
        By the function that comes of it: the parameter, its value and what it must be.
    """
    signature = inspect.signature(function)
    known: dict[str, list[Any]] = {}

    @functools.wraps(function)
    def door(*args: Any, **named: Any) -> Any:
        if not known:
            known.update({name: _members(kind) for name, kind in _kinds(function).items()})
        try:
            given = signature.bind(*args, **named).arguments
        except TypeError:
            return function(*args, **named)  # which says so in Python's words
        for name, value in given.items():
            kinds = known.get(name)
            if kinds is None:
                continue
            if bool in kinds and len(kinds) == 1:
                flag(name, value)
            elif not any(_suits(value, kind) for kind in kinds):
                raise InputTypeError(
                    f"{name} = {shown(value)}: must be {_words(kinds)}, not {type(value).__name__}"
                )
        return function(*args, **named)

    return typing.cast(_F, door)
