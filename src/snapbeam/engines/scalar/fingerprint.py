"""A mark of everything that a kernel bakes in, under which its machine code is kept."""

from __future__ import annotations

import hashlib
import inspect
import sys
from collections.abc import Iterable
from functools import cache
from pathlib import Path
from types import BuiltinFunctionType, CodeType, FunctionType, ModuleType
from typing import Any

import numba
import numpy as np

__all__ = ["fingerprint"]

_PACKAGE = Path(__file__).parents[2]
_BAKED_IN = ("core/codes.py", "engines/**/*.py")
_CONSTANTS = (int, float, complex, str, bytes, type(None), type(Ellipsis))


class _Unknown(Exception):
    """Something that a kernel may bake in and that has no mark."""


@cache
def _package_mark() -> str:
    digest = hashlib.sha256()
    for pattern in _BAKED_IN:
        for path in sorted(_PACKAGE.glob(pattern)):
            digest.update(path.relative_to(_PACKAGE).as_posix().encode())
            digest.update(path.read_bytes())
    digest.update(f"{sys.version} {numba.__version__} {np.__version__}".encode())
    return digest.hexdigest()


@cache
def fingerprint(kinds: tuple[type, ...]) -> str | None:
    """Of everything that a kernel for these laws and drives bakes in, in 20 hexadecimal digits.

    That is every file of the engines, the codes, the versions of Python, Numba and NumPy, and of each law and drive
    its plain attributes and its static methods, with all that those call and every constant that they read.  None if
    some of it cannot be told, as of a class typed at a prompt.
    """
    digest = hashlib.sha256(_package_mark().encode())
    try:
        for kind in kinds:
            for mark in _marks_of_class(kind):
                digest.update(mark.encode() + b"\0")
    except _Unknown:
        return None
    return digest.hexdigest()[:20]


def _marks_of_class(kind: type) -> Iterable[str]:
    """Of a class that anybody can import by its name."""
    module = sys.modules.get(kind.__module__)
    if kind.__module__ == "__main__" or getattr(module, kind.__qualname__, None) is not kind:
        raise _Unknown(kind.__qualname__)
    seen: set[int] = set()
    for each in kind.__mro__[:-1]:
        yield f"{each.__module__}.{each.__qualname__}"
        for name, value in sorted(vars(each).items()):
            if isinstance(value, staticmethod):
                yield name
                yield from _marks(value.__func__, seen)
            elif name == "__annotations__" or isinstance(value, (bool, int, float)) or _is_names(value):
                yield f"{name} {value!r}"


def _is_names(value: Any) -> bool:
    """Whether it is a tuple of names, as those of a drive's numbers and of the times of its jumps."""
    return isinstance(value, tuple) and all(isinstance(name, str) for name in value)


def _marks(value: Any, seen: set[int]) -> Iterable[str]:
    """Of a function with all that it refers to, of a constant, of a module or what is built into one."""
    if isinstance(value, _CONSTANTS):
        yield repr(value)
    elif isinstance(value, tuple):
        for item in value:
            yield from _marks(item, seen)
    elif isinstance(value, ModuleType):
        yield f"{value.__name__} {getattr(value, '__version__', '')}"
    elif isinstance(value, BuiltinFunctionType) or getattr(value, "__module__", None) == "builtins":
        yield repr(value.__qualname__)
    elif isinstance(value, CodeType):
        yield f"{value.co_name} {value.co_code.hex()} {value.co_names} {value.co_freevars}"
        yield from _marks(value.co_consts, seen)
    elif isinstance(value, FunctionType):
        yield from _function_marks(value, seen)
    elif isinstance(getattr(value, "py_func", None), FunctionType):
        yield from _function_marks(value.py_func, seen)
    else:
        raise _Unknown(repr(value))


def _function_marks(function: FunctionType, seen: set[int]) -> Iterable[str]:
    if id(function) in seen:
        return
    seen.add(id(function))
    variables = inspect.getclosurevars(function)
    yield from _marks(function.__code__, seen)
    for name, value in sorted({**variables.globals, **variables.nonlocals}.items()):
        yield name
        yield from _marks(value, seen)
